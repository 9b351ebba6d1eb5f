use std::sync::Arc;

use glam::{DAffine3, DMat3, DQuat, DVec3};
use proptest::prelude::*;

use super::*;
use crate::range_image::noise::Noise;
use crate::range_image::test_images::{ahead, as_point_grid, projections, render, sphere};
use crate::range_image::{DepthKind, Projection};
use crate::rigid;
use crate::visibility::{LinesOfSight, Seen};
use base::Error;
use mesh::Attribute;
use mesh::shapes::Shape;

fn place() -> DAffine3 {
    DAffine3::from_rotation_translation(
        DQuat::from_euler(glam::EulerRot::XYZ, 0.3, -1.2, 2.0),
        DVec3::new(7.0, -3.0, 5.0),
    )
}

/// An image of a ball in each projection and as a grid of points, placed.
fn images() -> Vec<RangeImage> {
    let mut all = Vec::new();
    for projection in projections(23, 19) {
        let mut image = render(23, 19, projection, sphere(ahead(&projection), 0.25));
        image.name = "ball".to_owned();
        image.world_from_sensor = place();
        image.colour = Some((0..image.len()).map(|i| [i as u8, 1, 2, 255]).collect());
        let mut grid = as_point_grid(&image);
        (grid.name, grid.world_from_sensor) = (image.name.clone(), place());
        all.extend([image, grid]);
    }
    all
}

fn middle(image: &RangeImage) -> DVec3 {
    let valid: Vec<_> = (0..image.len()).filter(|&i| image.is_valid(i)).map(|i| image.point_in_world(i)).collect();
    valid.iter().sum::<DVec3>() / valid.len() as f64
}

#[test]
fn a_selection_and_its_opposite_share_the_samples_and_leave_all_else() {
    for image in images() {
        let at = middle(&image);
        let marks: Vec<bool> = (0..image.len()).map(|i| i % 3 == 0).collect();
        let turn =
            DAffine3::from_scale_rotation_translation(DVec3::new(0.1, 0.2, 0.3), DQuat::from_rotation_x(0.7), at);
        let regions = [
            Region::Box(OrientedBox::new(turn).unwrap()),
            Region::Below(Plane::new(at, DVec3::new(0.3, -2.0, 0.5), 0.01).unwrap()),
            Region::Mask(Arc::new(Mask::of_image(image.rows(), image.cols(), &marks).unwrap())),
        ];
        for region in regions {
            let (mut kept, mut rest) = (image.clone(), image.clone());
            let gone = region.clone().kept().of_image(&mut kept, &Progress::none()).unwrap();
            let also = region.clone().removed().of_image(&mut rest, &Progress::none()).unwrap();
            assert!(gone > 0 && also > 0, "{region:?} does not part the ball");
            assert_eq!(gone + also, image.valid_count());
            for i in 0..image.len() {
                assert_eq!(kept.is_valid(i) || rest.is_valid(i), image.is_valid(i));
                assert!(!(kept.is_valid(i) && rest.is_valid(i)));
                if kept.is_valid(i) {
                    assert_eq!(kept.point_in_world(i), image.point_in_world(i));
                    assert!(region.holds(i, image.point_in_world(i)));
                }
            }
            assert_eq!(kept.projection(), image.projection());
            assert_eq!((kept.world_from_sensor, &kept.colour), (image.world_from_sensor, &image.colour));
        }
    }
}

#[test]
fn borders_belong_to_the_region() {
    let unit = OrientedBox::between(DVec3::splat(0.1), DVec3::splat(0.7)).unwrap();
    for axis in DVec3::AXES {
        for (x, inside) in [(0.1, true), (0.7, true), (0.1_f64.next_down(), false), (0.7_f64.next_up(), false)] {
            let at = DVec3::splat(0.3) * (DVec3::ONE - axis) + axis * x;
            assert_eq!(unit.contains(at), inside, "{at}");
        }
    }
    // A plane along an axis tells heights by the coordinate itself.
    for (normal, up) in [(DVec3::Z * 3.0, 1.0), (DVec3::NEG_Z * 0.1, -1.0)] {
        let plane = Plane::new(DVec3::new(5.0, 7.0, 0.3), normal, 0.0).unwrap();
        for at in [0.3, 0.3_f64.next_up(), 0.3_f64.next_down()] {
            assert_eq!(plane.contains(DVec3::new(1e6, -2.0, at)), up * at <= up * 0.3, "{at}");
        }
    }
    assert!(!unit.contains(DVec3::NAN) && !unit.contains(DVec3::new(0.5, f64::INFINITY, 0.5)));
}

#[test]
fn boxes_are_those_that_the_cube_becomes() {
    let skew = DAffine3 {
        matrix3: DMat3::from_cols(DVec3::new(2.0, 0.1, 0.0), DVec3::new(0.7, -1.0, 0.3), DVec3::new(0.0, 0.5, 1e-3)),
        translation: DVec3::new(10.0, -20.0, 5.0),
    };
    for transform in [skew, DAffine3::from_scale(DVec3::new(-1.0, 2.0, 3.0)), place()] {
        let region = OrientedBox::new(transform).unwrap();
        for i in 0..1000 {
            let at = DVec3::new((i % 10) as f64, (i / 10 % 10) as f64, (i / 100) as f64) * 0.3 - 1.35;
            let inside = at.abs().max_element() <= 1.0;
            assert_eq!(region.contains(transform.transform_point3(at)), inside, "{at}");
        }
    }
}

#[test]
fn what_is_no_region_is_refused_by_name() {
    let flat = DAffine3::from_scale(DVec3::new(1.0, 1.0, 0.0));
    let text = |outcome: Result<OrientedBox>| outcome.unwrap_err().to_string();
    assert!(text(OrientedBox::new(flat)).contains("the box is flat"));
    assert!(text(OrientedBox::new(DAffine3::from_translation(DVec3::NAN))).contains("the centre of the box"));
    assert!(text(OrientedBox::new(DAffine3::from_scale(DVec3::new(1.0, f64::NAN, 1.0)))).contains("second axis"));
    let two = DMat3::from_cols(DVec3::X, DVec3::X * 2.0, DVec3::Z);
    assert!(text(OrientedBox::new(DAffine3::from_mat3(two))).contains("flat"));
    assert!(text(OrientedBox::between(DVec3::ZERO, DVec3::new(1.0, 0.0, 1.0))).contains("along y"));
    assert!(text(OrientedBox::between(DVec3::ZERO, DVec3::new(1.0, 1.0, f64::NAN))).contains("high corner"));
    let text = |outcome: Result<Plane>| outcome.unwrap_err().to_string();
    assert!(text(Plane::new(DVec3::ZERO, DVec3::ZERO, 0.0)).contains("the normal of the plane"));
    assert!(text(Plane::new(DVec3::NAN, DVec3::Z, 0.0)).contains("the point of the plane"));
    assert!(text(Plane::new(DVec3::ZERO, DVec3::Z, f64::NAN)).contains("the margin of the plane"));
    assert!(text(Plane::through([DVec3::ONE, DVec3::ONE * 2.0, DVec3::ONE * 3.0])).contains("on one line"));
    assert!(text(Plane::through([DVec3::ONE, DVec3::ONE, DVec3::X])).contains("on one line"));
    assert!(text(Plane::new(DVec3::ZERO, DVec3::Z, 0.0).unwrap().facing(DVec3::X)).contains("lies on the plane"));
    assert!(Mask::of_image(2, 3, &[true; 5]).unwrap_err().to_string().contains("2 x 3"));
    let mut image = images().remove(0);
    let mask = Region::Mask(Arc::new(Mask::of_image(19, 23, &[true; 437]).unwrap()));
    let wrong = mask.clone().kept().of_image(&mut image, &Progress::none()).unwrap_err().to_string();
    assert_eq!(wrong, "the mask has 19 x 23 pixels, but the image 23 x 19");
    let mut mesh = Shape::Sphere { radius: 1.0 }.mesh(4);
    let wrong = mask.removed().of_mesh(&mut mesh, DAffine3::IDENTITY, &Progress::none()).unwrap_err().to_string();
    assert!(wrong.starts_with("the mask has 437 marks for"), "{wrong}");
    let region = Region::Below(Plane::new(DVec3::ZERO, DVec3::Z, 0.0).unwrap());
    let stopped = region.kept().of_image(&mut image, &Progress::cancel_after(0));
    assert!(matches!(stopped, Err(Error::Cancelled)), "{stopped:?}");
}

#[test]
fn planes_are_turned_by_what_lies_above() {
    let plane = Plane::through([DVec3::Z, DVec3::X + DVec3::Z, DVec3::Y + DVec3::Z]).unwrap();
    assert_eq!((plane.normal(), plane.height(DVec3::new(4.0, 5.0, 3.0))), (DVec3::Z, 2.0));
    assert_eq!(plane.facing(DVec3::ZERO).unwrap(), plane.flipped());
    assert_eq!(plane.facing(DVec3::Z * 2.0).unwrap(), plane);
    assert_eq!(plane.flipped().height(DVec3::ZERO), 1.0);
    assert_eq!(plane.flipped().point(), plane.point());
}

#[test]
fn meshes_and_clouds_keep_order_and_attributes() {
    let mut mesh = Shape::Sphere { radius: 1.0 }.mesh(8);
    let count = mesh.positions.len();
    mesh.vertex_attributes.push(Attribute::i32("range_row", (0..count as i32).collect()));
    mesh.face_attributes.push(Attribute::i32("part", (0..mesh.triangles.len() as i32).collect()));
    let whole = mesh.clone();
    let up = DAffine3::from_scale_rotation_translation(DVec3::splat(2.0), DQuat::from_rotation_y(0.4), DVec3::Z);
    let region = Region::Below(Plane::new(DVec3::Z, DVec3::Z, 0.1).unwrap());
    let gone = region.clone().removed().of_mesh(&mut mesh, up, &Progress::none()).unwrap();
    assert!(gone > 0 && mesh.positions.len() + gone == count);
    mesh.validate().unwrap();
    let number = |mesh: &TriMesh, name: &str| match mesh.vertex_attribute(name).or(mesh.face_attribute(name)) {
        Some(mesh::AttributeData::I32(all)) => all.clone(),
        _ => panic!("{name}"),
    };
    let (rows, parts) = (number(&mesh, "range_row"), number(&mesh, "part"));
    for (k, &v) in rows.iter().enumerate() {
        assert_eq!(mesh.positions[k], whole.positions[v as usize]);
        assert!(up.transform_point3(mesh.positions[k]).z > 1.1);
    }
    for (k, &t) in parts.iter().enumerate() {
        assert_eq!(mesh.corners(k), whole.corners(t as usize));
    }
    let stays = |t: &[u32; 3]| t.iter().all(|&v| up.transform_point3(whole.positions[v as usize]).z > 1.1);
    assert_eq!(parts.len(), whole.triangles.iter().filter(|t| stays(t)).count());
    let mut cloud = PointCloud {
        crs: None,
        normals: Some(whole.positions.iter().map(|p| p.as_vec3().to_array()).collect()),
        colour: Some((0..count).map(|k| [k as u8; 4]).collect()),
        intensity: Some((0..count).map(|k| k as f32).collect()),
        positions: whole.positions,
        sensor: Some(DVec3::Z),
        world_from_cloud: up,
    };
    assert_eq!(region.removed().of_cloud(&mut cloud, &Progress::none()).unwrap(), gone);
    assert_eq!(cloud.positions, mesh.positions);
    assert_eq!(cloud.intensity.unwrap(), rows.iter().map(|&v| v as f32).collect::<Vec<_>>());
    assert_eq!((cloud.normals.unwrap().len(), cloud.colour.unwrap().len()), (rows.len(), rows.len()));
}

#[test]
fn nothing_is_seen_through_where_samples_were_removed() {
    for projection in projections(90, 80) {
        let mut image = render(90, 80, projection, sphere(ahead(&projection), 0.4));
        let (_, along) = projection.ray(45, 40, DVec3::NAN);
        let before = ahead(&projection) - 0.7 * along;
        let see = |image: &RangeImage| {
            let sight = LinesOfSight::new(image, Noise::default(), &Progress::none()).unwrap().unwrap();
            sight.see(before, 0.0, 0.03)
        };
        assert_eq!(see(&image), Seen::Through, "{projection:?}");
        let hole = DAffine3::from_scale_rotation_translation(
            DVec3::splat(0.1),
            DQuat::IDENTITY,
            ahead(&projection) - 0.4 * along,
        );
        Region::Box(OrientedBox::new(hole).unwrap()).removed().of_image(&mut image, &Progress::none()).unwrap();
        assert_eq!(see(&image), Seen::Nothing, "{projection:?}");
    }
}

#[test]
fn similarities_move_samples_as_they_move_places() {
    let plane = Plane::new(DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.2, -0.4, 0.9), 0.0).unwrap();
    let size = Similarity::true_size(DVec3::X, DVec3::X * 3.0, 0.005).unwrap();
    let both = Similarity::ground(&plane, DVec3::Y).unwrap().then(&size);
    assert_eq!(both.scale(), 0.0025);
    for image in images() {
        let mut moved = image.clone();
        both.of_image(&mut moved).unwrap();
        assert!(rigid::departure(moved.world_from_sensor.matrix3) < 1e-14);
        let single = matches!(image.projection(), Projection::PointGrid(_));
        for i in (0..image.len()).filter(|&i| image.is_valid(i)) {
            let (is, should) = (moved.point_in_world(i), both.of_place(image.point_in_world(i)));
            assert!(is.distance(should) < if single { 1e-9 } else { 1e-15 }, "{is} {should}");
            let (origin, direction) = moved.ray_in_sensor(i);
            let (before, along) = image.ray_in_sensor(i);
            assert!((origin - before * 0.0025).cross(direction).length() < 1e-9 && (direction - along).length() < 1e-6);
        }
        assert_eq!(moved.valid_count(), image.valid_count());
        both.inverse().of_image(&mut moved).unwrap();
        for i in (0..image.len()).filter(|&i| image.is_valid(i)) {
            assert!(moved.point_in_world(i).distance(image.point_in_world(i)) < if single { 1e-6 } else { 1e-13 });
        }
    }
    let mut mesh = Shape::Sphere { radius: 1.0 }.mesh(4);
    mesh.rounding_room = Some(4.0);
    mesh.vertex_attributes.push(Attribute::f32("noise", vec![8.0; mesh.positions.len()]));
    mesh.vertex_attributes.push(Attribute::f32("confidence", vec![0.5; mesh.positions.len()]));
    let whole = mesh.clone();
    both.of_mesh(&mut mesh).unwrap();
    for (is, was) in mesh.positions.iter().zip(&whole.positions) {
        assert!(is.distance(both.of_place(*was)) < 1e-15);
    }
    assert_eq!(mesh.rounding_room, Some(0.01));
    assert_eq!(mesh.vertex_attributes[0].data, mesh::AttributeData::F32(vec![0.02; whole.positions.len()]));
    assert_eq!(mesh.vertex_attributes[1], whole.vertex_attributes[1]);
    let mut cloud = PointCloud { positions: whole.positions.clone(), sensor: Some(DVec3::X), ..PointCloud::default() };
    both.of_cloud(&mut cloud).unwrap();
    let sensor = cloud.world_from_cloud.transform_point3(cloud.sensor.unwrap());
    assert!(sensor.distance(both.of_place(DVec3::X)) < 1e-15, "{sensor}");
    let mut same = whole.clone();
    Similarity::IDENTITY.of_mesh(&mut same).unwrap();
    assert_eq!(same, whole);
}

#[test]
fn what_is_no_size_is_refused_by_name() {
    let text = |a, b, d| Similarity::true_size(a, b, d).unwrap_err().to_string();
    assert!(text(DVec3::ONE, DVec3::ONE, 1.0).contains("pick two that lie apart"));
    for wrong in [0.0, -1.0, f64::NAN, f64::NEG_INFINITY] {
        assert!(text(DVec3::ONE, DVec3::X, wrong).contains("the true distance must be > 0"), "{wrong}");
    }
    assert!(text(DVec3::ONE, DVec3::X, f64::INFINITY).contains("the true distance must be"));
    assert!(text(DVec3::NAN, DVec3::X, 1.0).contains("the first point"));
    assert!(Similarity::from_affine(DAffine3::from_scale(DVec3::new(1.0, 2.0, 1.0))).is_err());
    assert!(Similarity::from_affine(DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0))).is_err());
    assert!(Similarity::from_affine(DAffine3::from_scale(DVec3::ZERO)).is_err());
    let large = Similarity::scaling(1e70).unwrap();
    for mut image in images() {
        image.world_from_sensor = DAffine3::IDENTITY;
        assert!(large.then(&large).of_image(&mut image).unwrap_err().to_string().contains("scaled by"));
    }
    let mut mesh = Shape::Sphere { radius: 1.0 }.mesh(4);
    let mut afar = RangeImage::from_values(1, 1, vec![1.0], projections(1, 1)[0]).unwrap();
    afar.world_from_sensor.translation = DVec3::splat(1e10);
    assert!(large.of_image(&mut afar).unwrap_err().to_string().contains("the place of the scan"));
    assert!(large.then(&large).of_mesh(&mut mesh).unwrap_err().to_string().contains("a vertex would lie at"));
}

proptest! {
    /// The ground is at 0, what was above is above, and nothing is turned more than it has to be.
    #[test]
    fn planes_become_the_ground(n in prop::array::uniform3(-1.0..1.0_f64), at in prop::array::uniform3(-9.0..9.0_f64),
                                tilt in prop_oneof![Just(0.0), Just(1e-12), Just(1e-7), Just(1.0)], down in any::<bool>()) {
        let [n, at] = [n, at].map(DVec3::from);
        prop_assume!(n.length() > 0.1);
        let up = DVec3::new(0.0, 0.6, 0.8);
        let normal = if down { -up } else { up } + n * tilt;
        prop_assume!(normal.length() > 0.01);
        let plane = Plane::new(at, normal, 0.0).unwrap();
        let ground = Similarity::ground(&plane, up).unwrap();
        let turn = ground.to_affine().matrix3;
        prop_assert!(rigid::departure(turn) < 1e-14 && turn.determinant() > 0.0);
        let across = plane.normal().any_orthonormal_vector();
        for place in [at, at + across, at + 7.0 * plane.normal().cross(across)] {
            prop_assert!(ground.of_place(place).dot(up).abs() < 1e-13, "{}", ground.of_place(place).dot(up));
        }
        prop_assert!((ground.of_place(at + plane.normal()).dot(up) - 1.0).abs() < 1e-13);
        let angle = plane.normal().dot(up).clamp(-1.0, 1.0).acos();
        let turned = ((turn.x_axis.x + turn.y_axis.y + turn.z_axis.z - 1.0) / 2.0).clamp(-1.0, 1.0).acos();
        prop_assert!((angle - turned).abs() < 1e-7);
        let back = Similarity::from_affine(ground.to_affine()).unwrap();
        prop_assert!((back.scale() - 1.0).abs() < 1e-14);
    }
}

#[test]
fn a_frame_is_scaled_whole() {
    let projection = Projection::Pinhole { focal: [20.0; 2], centre: [9.0, 11.0], depth: DepthKind::Planar };
    let depth = render(23, 19, projection, sphere(DVec3::Z * 2.0, 0.3));
    let camera = crate::frame::Camera { size: Some([19, 23]), ..crate::frame::Camera::new([20.0; 2], [9.0, 11.0]) };
    let colour = crate::frame::ColourImage {
        camera,
        pixels: (0..19 * 23).map(|i| [i as u8, (i / 7) as u8, 3]).collect(),
        colour_from_depth: DAffine3::from_translation(DVec3::new(0.05, 0.0, 0.0)),
        black_rim: false,
    };
    let frame = crate::frame::Frame { colour: Some(colour), reach: Some(1.8), ..crate::frame::Frame::new(depth) };
    let (plain, out) = frame.clone().into_range_image(&Progress::none()).unwrap();
    let mut scaled = frame;
    scale_frame(&mut scaled, 1000.0).unwrap();
    let (larger, also) = scaled.into_range_image(&Progress::none()).unwrap();
    assert!(out.out_of_reach > 0 && out == also && larger.colour == plain.colour);
}
