use std::mem::discriminant;

use glam::{DMat3, DQuat};
use proptest::prelude::*;

use super::*;
use crate::range_image::test_images::{ahead, as_point_grid, plane, projections, render, sphere};
use crate::range_image::{Projection, Viewing, is_rigid};
use mesh::AttributeData;

const ROWS: usize = 15;
const COLS: usize = 18;

/// Round-off of single precision, relative.
const SINGLE: f64 = f32::EPSILON as f64 / 2.0;

/// A bent surface in each projection, also as grids of points seen from a place and along parallel rays.
fn images() -> Vec<RangeImage> {
    let of_values = projections(ROWS, COLS).into_iter().map(|projection| {
        let mut image = render(ROWS, COLS, projection, sphere(1.4 * ahead(&projection), 1.5));
        image.leave_out([0, 7, 100]);
        image.colour = Some((0..image.len()).map(|i| [i as u8, 1, 2, 255]).collect());
        image.intensity = Some((0..image.len()).map(|i| i as f32).collect());
        image.confidence = Some((0..image.len()).map(|i| 1.0 / (1 + i) as f32).collect());
        image
    });
    of_values.flat_map(|image| [as_point_grid(&image), image]).collect()
}

fn camera(image: &RangeImage) -> GridCamera {
    GridCamera::of(image, &Progress::none()).unwrap()
}

/// A host's content: the vertices of an image, moved, less some of them, in single precision.
struct Host {
    row: Vec<i32>,
    col: Vec<i32>,
    positions: Vec<DVec3>,
}

fn single(at: DVec3) -> DVec3 {
    at.as_vec3().as_dvec3()
}

impl Host {
    fn of(image: &RangeImage, motion: &DAffine3, keep: impl Fn(usize) -> bool) -> Self {
        let mesh = to_mesh(image, false, &Progress::none()).unwrap();
        let place = |name: &str| match mesh.vertex_attribute(name) {
            Some(AttributeData::I32(places)) => places.clone(),
            other => panic!("{name}: {other:?}"),
        };
        let (row, col) = (place("range_row"), place("range_col"));
        let kept: Vec<usize> = (0..row.len()).filter(|&i| keep(i)).collect();
        Host {
            row: kept.iter().map(|&i| row[i]).collect(),
            col: kept.iter().map(|&i| col[i]).collect(),
            positions: kept.iter().map(|&i| single(motion.transform_point3(single(mesh.positions[i])))).collect(),
        }
    }

    fn image(&self, camera: &GridCamera, world_from_host: DAffine3) -> Result<RangeImage> {
        let vertices = Vertices { row: &self.row, col: &self.col, positions: &self.positions, ..Vertices::default() };
        from_vertices(camera, &vertices, world_from_host, &Progress::none())
    }

    /// Checks that each sample lies in the world where its vertex does, and that there are no others.
    fn is_where_it_was(&self, image: &RangeImage, world_from_host: &DAffine3, room: f64) {
        assert_eq!(image.valid_count(), self.row.len());
        for (i, &at) in self.positions.iter().enumerate() {
            let pixel = self.row[i] as usize * COLS + self.col[i] as usize;
            let off = image.point_in_world(pixel).distance(world_from_host.transform_point3(at));
            assert!(off <= room, "vertex {i} is {off} away, room {room}");
        }
    }
}

fn similarity(turn: DVec3, shift: DVec3, scale: f64, mirrors: bool) -> DAffine3 {
    let mirror = DMat3::from_diagonal(DVec3::new(1.0, if mirrors { -1.0 } else { 1.0 }, 1.0));
    DAffine3 { matrix3: DMat3::from_quat(DQuat::from_scaled_axis(turn)) * mirror * scale, translation: shift }
}

/// A matrix as hosts hold it.
fn single_matrix(transform: &DAffine3) -> DAffine3 {
    DAffine3::from_cols_array(&transform.to_cols_array().map(|x| f64::from(x as f32)))
}

fn largest(points: impl Iterator<Item = DVec3>) -> f64 {
    points.map(|p| p.abs().max_element()).fold(0.0, f64::max)
}

fn any_similarity() -> impl Strategy<Value = DAffine3> {
    let vector = |size: f64| prop::array::uniform3(-size..size).prop_map(DVec3::from);
    (vector(2.0), vector(4.0), -3.0..3.0_f64, any::<bool>())
        .prop_map(|(turn, shift, scale, mirrors)| similarity(turn, shift, scale.exp(), mirrors))
}

proptest! {
    /// Theorem: whatever all vertices are moved, turned, scaled and mirrored by, in single precision, whichever are deleted: the
    /// projection stays of its kind, samples and rays go with them.
    #[test]
    fn an_image_comes_back_from_where_its_vertices_went(
        baked in any_similarity(), placed in any_similarity(), is_baked in any::<bool>(),
        deleted in prop::collection::vec(0..10_u8, ROWS * COLS), share in 0..8_u8,
    ) {
        let baked = if is_baked { baked } else { DAffine3::IDENTITY };
        let world_from_host = single_matrix(&placed);
        for image in images() {
            let host = Host::of(&image, &baked, |i| deleted[i] >= share);
            let back = host.image(&camera(&image), world_from_host).unwrap();
            let kind = discriminant(image.projection());
            prop_assert_eq!(kind, discriminant(back.projection()), "{:?}", image.projection());
            prop_assert!(is_rigid(&back.world_from_sensor));

            let whole = world_from_host * baked;
            let size = motion::size(world_from_host.matrix3);
            let reach = size * largest(host.positions.iter().copied()).max(2.5 * motion::size(baked.matrix3));
            let rounding = SINGLE * (reach + world_from_host.translation.length());
            host.is_where_it_was(&back, &world_from_host, 8.0 * rounding);
            for (row, col) in host.row.iter().zip(&host.col) {
                let pixel = *row as usize * COLS + *col as usize;
                let (origin, direction) = back.ray_in_sensor(pixel);
                let (origin, direction) =
                    (back.world_from_sensor.transform_point3(origin), back.world_from_sensor.transform_vector3(direction));
                let (before, toward) = image.ray_in_sensor(pixel);
                let toward = whole.transform_vector3(toward).normalize();
                let sample = whole.transform_point3(image.point_in_sensor(pixel));
                // Pixels are 0.6 / 18 wide at a distance of 1 and more.
                let pitch = 0.03 * motion::size(whole.matrix3);
                let off = (sample - origin).cross(direction).length();
                prop_assert!(off <= 1e-6 * pitch + 16.0 * rounding, "{} off its ray, pitch {}", off, pitch);
                // Anchors lie 0.6 apart: by so much of it rounding turns them.
                let turn = SINGLE * 16.0 * (1.0 + reach / motion::size(whole.matrix3)) / 0.3;
                prop_assert!((direction - toward).length() <= 1e-6 * 0.03 + turn, "{:?}", image.projection());
                let eye = whole.transform_point3(before);
                if image.projection().eye().is_some() {
                    let room = 2.0 * turn * eye.distance(sample) + 16.0 * rounding;
                    prop_assert!(origin.distance(eye) <= 1e-6 * pitch + room, "{}", origin.distance(eye));
                }
            }
        }
    }
}

#[test]
fn where_nothing_moved_nothing_changes() {
    for mut image in images() {
        image.world_from_sensor = similarity(DVec3::new(0.3, 1.0, 2.0), DVec3::splat(1e6), 1.0, false);
        let mesh = to_mesh(&image, false, &Progress::none()).unwrap();
        let host = Host { positions: mesh.positions, ..Host::of(&image, &DAffine3::IDENTITY, |_| true) };
        let attribute = |name: &str| mesh.vertex_attributes.iter().find(|a| a.name == name).map(|a| &a.data);
        let (Some(AttributeData::Colour(colour)), Some(AttributeData::F32(intensity)), Some(AttributeData::F32(trust))) =
            (attribute("colour"), attribute("intensity"), attribute("confidence"))
        else {
            assert!(image.colour.is_none(), "attributes are missing");
            continue;
        };
        let vertices = Vertices {
            row: &host.row,
            col: &host.col,
            positions: &host.positions,
            colour: Some(colour),
            intensity: Some(intensity),
            confidence: Some(trust),
        };
        let back = from_vertices(&camera(&image), &vertices, image.world_from_sensor, &Progress::none()).unwrap();
        assert_eq!(back.projection(), image.projection());
        assert_eq!(back.world_from_sensor, image.world_from_sensor);
        let off = |pixel: usize| back.point_in_sensor(pixel).distance(image.point_in_sensor(pixel));
        let valid: Vec<usize> = (0..image.len()).filter(|&pixel| image.is_valid(pixel)).collect();
        assert_eq!(back.valid_count(), valid.len());
        for &pixel in &valid {
            assert!(off(pixel) <= 1e-9, "{}", off(pixel));
            let of = |image: &RangeImage| {
                (
                    image.colour.as_ref().unwrap()[pixel],
                    image.intensity.as_ref().unwrap()[pixel],
                    image.confidence.as_ref().unwrap()[pixel],
                )
            };
            assert_eq!(of(&back), of(&image));
        }
    }
}

#[test]
fn faces_are_those_of_the_surface() {
    for image in images() {
        let mesh = to_mesh(&image, true, &Progress::none()).unwrap();
        mesh.validate().unwrap();
        assert_eq!(mesh.positions.len(), image.valid_count());
        let surface = triangulate::triangulate(&image, &TriangulateParams::default(), &Progress::none()).unwrap();
        let corners = |positions: &[DVec3], triangles: &[[u32; 3]]| -> Vec<[DVec3; 3]> {
            triangles.iter().map(|t| t.map(|v| positions[v as usize])).collect()
        };
        assert_eq!(corners(&mesh.positions, &mesh.triangles), corners(&surface.positions, &surface.triangles));
        assert!(!mesh.triangles.is_empty());
    }
}

/// Theorem: vertices edited one by one, or stretched, leave a grid of points in the same places, seen from where it was.
#[test]
fn edited_and_stretched_vertices_are_a_grid_of_points() {
    let shear = DAffine3::from_mat3(DMat3::from_cols(DVec3::X, DVec3::new(0.2, 1.0, 0.0), DVec3::new(0.0, 0.0, 0.4)));
    let moved = similarity(DVec3::new(0.4, -1.0, 0.2), DVec3::new(1.0, 2.0, 3.0), 1.7, true);
    let still = DAffine3::IDENTITY;
    for image in images() {
        for (baked, placed, edits) in [
            (moved, still, true),
            (still, moved, true),
            (still, moved * shear, false),
            (moved * shear, still, false),
            (shear, moved, false),
        ] {
            let mut host = Host::of(&image, &baked, |_| true);
            if edits {
                let lift = DVec3::new(0.01, 0.02, 0.01);
                host.positions.iter_mut().step_by(5).for_each(|at| *at = single(*at + lift));
            }
            let back = host.image(&camera(&image), placed).unwrap();
            assert!(matches!(back.projection(), Projection::PointGrid(_)));
            assert!(is_rigid(&back.world_from_sensor));
            host.is_where_it_was(&back, &placed, 1e-5);
            let whole = placed * baked;
            let pixel = 130;
            let (_, direction) = back.ray_in_sensor(pixel);
            match (image.projection().eye(), back.projection()) {
                (Some(eye), Projection::PointGrid(Viewing::From(origin))) => {
                    let origin = back.world_from_sensor.transform_point3(*origin);
                    assert!(origin.distance(whole.transform_point3(eye)) < 1e-5, "{:?}", image.projection());
                }
                (None, Projection::PointGrid(Viewing::Parallel(_))) => {
                    let toward = whole.transform_vector3(image.ray_in_sensor(pixel).1).normalize();
                    let seen = back.world_from_sensor.transform_vector3(direction);
                    assert!(seen.distance(toward) < 1e-5, "{:?}", image.projection());
                }
                other => panic!("{other:?}"),
            }
        }
    }
}

/// Vertices in a line or a point fix no turn: they lie where they were, or where the matrix takes them, or are refused.
#[test]
fn too_few_anchors_are_helped_by_the_matrix() {
    let moved = similarity(DVec3::new(0.4, -1.0, 0.2), DVec3::new(1.0, 2.0, 3.0), 1.7, false);
    let height_map = Projection::Orthographic { first: [0.0, 0.0], step: [1.0, 1.0] };
    let line = (render(ROWS, COLS, height_map, plane(DVec3::ZERO, DVec3::Z)), 9);
    for (image, count) in images().into_iter().flat_map(|image| [(image.clone(), 1), (image, 2)]).chain([line]) {
        let kind = discriminant(image.projection());
        let keep = |i: usize| (55..55 + count).contains(&i);
        let host = Host::of(&image, &DAffine3::IDENTITY, keep);
        let of = GridCamera { anchors: anchors_of(&image, &host), ..camera(&image) };
        let back = host.image(&of, moved).unwrap();
        assert_eq!(discriminant(back.projection()), kind, "{:?}", image.projection());
        host.is_where_it_was(&back, &moved, 1e-5);
        let baked = Host::of(&image, &moved, keep);
        assert_eq!(discriminant(baked.image(&of, moved).unwrap().projection()), kind);
        let text = baked.image(&of, DAffine3::IDENTITY).unwrap_err().to_string();
        assert!(text.contains("nothing tells from where they were seen"), "{text}");
    }
}

/// Three anchors lie in a plane: the other vertices tell a mirror from a turn.
#[test]
fn rays_tell_a_mirror_from_a_turn() {
    for image in images() {
        for mirrors in [false, true] {
            let moved = similarity(DVec3::new(0.4, -1.0, 0.2), DVec3::new(1.0, 2.0, 3.0), 1.7, mirrors);
            let host = Host::of(&image, &moved, |_| true);
            let mut three = camera(&image);
            three.anchors.truncate(3);
            let back = host.image(&three, DAffine3::IDENTITY).unwrap();
            host.is_where_it_was(&back, &DAffine3::IDENTITY, 1e-5);
            assert_eq!(discriminant(back.projection()), discriminant(image.projection()), "{:?}", image.projection());
        }
    }
}

fn anchors_of(image: &RangeImage, host: &Host) -> Vec<Anchor> {
    let places = host.row.iter().zip(&host.col).map(|(row, col)| (*row as usize, *col as usize));
    places.map(|(row, col)| Anchor { row, col, point: image.point_in_sensor(row * COLS + col) }).collect()
}

/// Without anchors, as files of earlier versions have it, vertices lie in the sensor's frame.
#[test]
fn without_anchors_vertices_lie_where_they_were() {
    let moved = similarity(DVec3::new(0.4, -1.0, 0.2), DVec3::new(1.0, 2.0, 3.0), 0.1, true);
    for image in images() {
        // Of a camera whose anchors were all deleted, too, but what rays contradict was moved.
        let mut known = camera(&image);
        known.anchors.truncate(64);
        let valid: Vec<usize> = (0..image.len()).filter(|&pixel| image.is_valid(pixel)).collect();
        let is_left = |i: usize| !known.anchors.iter().any(|a| a.row * COLS + a.col == valid[i]);
        let [host, baked] = [DAffine3::IDENTITY, moved].map(|motion| Host::of(&image, &motion, is_left));
        if !host.row.is_empty() {
            host.is_where_it_was(&host.image(&known, moved).unwrap(), &moved, 1e-5);
            let found = baked.image(&known, DAffine3::IDENTITY);
            assert_eq!(
                found.is_err(),
                !matches!(image.projection(), Projection::PointGrid(_)),
                "{:?}",
                image.projection()
            );
        }
        let bare = GridCamera { anchors: Vec::new(), ..camera(&image) };
        let host = Host::of(&image, &DAffine3::IDENTITY, |_| true);
        let back = host.image(&bare, moved).unwrap();
        assert_eq!(discriminant(back.projection()), discriminant(image.projection()));
        host.is_where_it_was(&back, &moved, 1e-5);
        let nothing = Host::of(&image, &DAffine3::IDENTITY, |_| false);
        assert_eq!(nothing.image(&camera(&image), moved).unwrap().valid_count(), 0);
    }
}

/// A flat scan, and one of millions of pixels whose rows are as long as the runs that anchors are taken from.
#[test]
fn anchors_spread_over_the_image() {
    let projection = Projection::Orthographic { first: [0.0, 0.0], step: [1.0, 1.0] };
    let flat = render(300, 1024, projection, plane(DVec3::ZERO, DVec3::Z));
    let chosen = camera(&flat).anchors;
    assert_eq!(chosen.len(), MOST_ANCHORS);
    for (i, a) in chosen.iter().enumerate() {
        let nearest = chosen[..i].iter().map(|b| a.point.distance(b.point)).fold(f64::INFINITY, f64::min);
        assert!(nearest > 20.0, "{nearest}");
    }
    let moved = similarity(DVec3::new(0.4, -1.0, 0.2), DVec3::new(1.0, 2.0, 3.0), 1.7, false);
    let small = render(ROWS, COLS, projection, plane(DVec3::ZERO, DVec3::Z));
    let back = Host::of(&small, &moved, |_| true).image(&camera(&small), DAffine3::IDENTITY).unwrap();
    assert!(matches!(back.projection(), Projection::Orthographic { .. }));
}

#[test]
fn a_host_s_unit_is_another() {
    for image in images() {
        let scaled = camera(&image).scaled(1000.0).unwrap();
        let host = Host::of(&image, &similarity(DVec3::ZERO, DVec3::ZERO, 1000.0, false), |_| true);
        let back = host.image(&scaled, DAffine3::IDENTITY).unwrap();
        assert_eq!(back.projection(), &scaled.projection);
        assert_eq!(back.world_from_sensor, DAffine3::IDENTITY);
        for scale in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e80] {
            assert!(scaled.scaled(scale).is_err(), "{scale}");
        }
    }
}

#[test]
fn what_is_no_range_image_is_refused_by_name() {
    let image = &images()[1];
    let still = DAffine3::IDENTITY;
    let host = || Host::of(image, &still, |_| true);
    let refused = |host: Host, camera: &GridCamera, matrix: DAffine3, words: &str| {
        let text = host.image(camera, matrix).unwrap_err().to_string();
        assert!(text.contains(words), "{text}");
    };
    let known = camera(image);
    let with = |change: fn(&mut Host)| {
        let mut host = host();
        change(&mut host);
        host
    };
    refused(with(|h| h.row[3] = 15), &known, still, "vertex 3 is pixel (15, 4), but the grid has 15 x 18 pixels");
    refused(with(|h| h.col[3] = -1), &known, still, "vertex 3 is pixel (0, -1)");
    refused(with(|h| h.col[3] = h.col[2]), &known, still, "vertices 2 and 3 are both pixel (0, 3)");
    refused(with(|h| h.positions[5].y = f64::NAN), &known, still, "vertex 5");
    refused(with(|h| h.row.truncate(7)), &known, still, "vertices need 267 rows, got 7");
    refused(with(|h| h.positions.fill(DVec3::ONE)), &known, still, "scaled by 0");
    for flat in [DVec3::ZERO, DVec3::new(1.0, 0.0, 1.0)] {
        let flat = DAffine3::from_quat(DQuat::from_rotation_x(0.3)) * DAffine3::from_scale(flat);
        refused(host(), &known, flat, "flattens");
    }
    let bad = |rows, cols| GridCamera { rows, cols, anchors: Vec::new(), ..known.clone() };
    refused(host(), &bad(1 << 20, 1 << 20), still, "1048576 x 1048576 pixels, but 267 vertices");
    refused(host(), &bad(1 << 40, 1), still, "at most 2147483647 rows");
    let mut anchors = known.anchors.clone();
    anchors[3].row = 15;
    refused(host(), &GridCamera { anchors, ..known.clone() }, still, "anchor 3 is pixel (15,");
    let anchors = [known.anchors.clone(), known.anchors.clone()].concat();
    refused(host(), &GridCamera { anchors, ..known.clone() }, still, "at most 256 anchors, got");
    let host = host();
    let wrong = Vertices {
        row: &host.row,
        col: &host.col,
        positions: &host.positions,
        confidence: Some(&[-1.0; 267]),
        ..Vertices::default()
    };
    let text = from_vertices(&known, &wrong, still, &Progress::none()).unwrap_err().to_string();
    assert!(text.contains("the confidence is -1"), "{text}");
}

#[test]
fn a_grid_of_points_too_small_for_single_precision_is_refused() {
    for (image, size) in images().into_iter().flat_map(|image| [(image.clone(), 1e-33), (image, 1e-46)]) {
        if !matches!(image.projection(), Projection::PointGrid(_)) {
            continue;
        }
        let host = Host::of(&image, &DAffine3::IDENTITY, |_| true);
        let text = host.image(&camera(&image), DAffine3::from_scale(DVec3::splat(size))).unwrap_err().to_string();
        assert!(text.contains("which single precision cannot hold with all its digits: use a smaller unit"), "{text}");
    }
}

#[test]
fn each_call_stops_when_it_is_cancelled() {
    let image = &images()[1];
    let (known, host) = (camera(image), Host::of(image, &DAffine3::IDENTITY, |_| true));
    let vertices = Vertices { row: &host.row, col: &host.col, positions: &host.positions, ..Vertices::default() };
    let stopped = |result: Result<()>| assert!(matches!(result, Err(Error::Cancelled)), "{result:?}");
    stopped(to_mesh(image, false, &Progress::cancel_after(0)).map(drop));
    stopped(from_vertices(&known, &vertices, DAffine3::IDENTITY, &Progress::cancel_after(0)).map(drop));
}
