use glam::{DAffine3, DQuat, DVec3};
use proptest::prelude::*;

use super::*;
use crate::pool::random;
use base::error::{Error, Result};
use base::progress::Progress;
use image::RangeImage;
use image::range_image::test_images::{plane, render, sphere};
use image::range_image::{DepthKind, Projection};
use image::select::Region;
use image::source::{PlacedCloud, PlacedMesh, ScanSource};
use mesh::point_cloud::PointCloud;
use mesh::shapes::Shape;

/// Evenly from -1 to 1.
fn draw(i: u64) -> f64 {
    random(i) as f64 / (1_u64 << 63) as f64 - 1.0
}

/// Nearly normal, of deviation 1.
fn normal(i: u64) -> f64 {
    (0..12).map(|k| draw(12 * i + k)).sum::<f64>() / 2.0
}

/// Frames of a ball on a table, from all around: the table is the plane z = 0 before it is placed. Their depths scatter by `noise`.
fn frames(count: usize, noise: f64, world_from_table: DAffine3) -> Vec<RangeImage> {
    let look = |k: usize| {
        let (sin, cos) = (std::f64::consts::TAU * k as f64 / count as f64).sin_cos();
        let eye = DVec3::new(2.0 * cos, 2.0 * sin, 1.5);
        let forward = (-eye).normalize();
        let right = forward.cross(DVec3::Z).normalize();
        let pose = DAffine3::from_cols(right, forward.cross(right), forward, eye);
        let projection = Projection::Pinhole { focal: [80.0; 2], centre: [39.5, 29.5], depth: DepthKind::Planar };
        let back = pose.inverse();
        let (table, up) = (back.transform_point3(DVec3::ZERO), back.transform_vector3(DVec3::Z));
        let ball = sphere(back.transform_point3(DVec3::Z * 0.3), 0.3);
        let on_table = plane(table, up);
        let clean = render(60, 80, projection, |from, to| {
            [ball(from, to), on_table(from, to).filter(|t| *t > 0.0)].into_iter().flatten().reduce(f64::min)
        });
        let depths = (0..clean.len()).map(|i| clean.range(i) + noise * normal((k * clean.len() + i) as u64)).collect();
        let mut image = RangeImage::from_values(60, 80, depths, projection).unwrap();
        image.name = format!("frame {k:03}");
        image.world_from_sensor = world_from_table * pose;
        image
    };
    (0..count).map(look).collect()
}

fn tilted() -> DAffine3 {
    DAffine3::from_rotation_translation(
        DQuat::from_euler(glam::EulerRot::XYZ, 0.4, -2.2, 1.0),
        DVec3::new(40.0, 5.0, -3.0),
    )
}

fn search(images: &[RangeImage], threads: usize) -> Result<DominantPlane> {
    let sources: Vec<&dyn ScanSource> = images.iter().map(|image| image as &dyn ScanSource).collect();
    dominant(&sources, &PlaneParams { threads, ..PlaneParams::default() }, &Progress::none())
}

#[test]
fn the_table_is_found_and_removed_and_the_ball_stays() {
    for (noise, far) in [(0.0, 0.0), (0.0, 1e6), (0.004, 0.0), (0.02, 0.0)] {
        let mut place = tilted();
        place.translation *= 1.0 + far;
        let images = frames(9, noise, place);
        let found = search(&images, 0).unwrap();
        let (up, at) = (place.matrix3 * DVec3::Z, place.translation);
        let off = found.plane.normal().angle_between(up);
        assert!(off < 1e-7 + noise, "{off} off at a noise of {noise}");
        assert!(found.plane.height(at).abs() < 1e-8 + 0.2 * noise + far * 1e-15, "{}", found.plane.height(at));
        assert!(found.share > 0.8 && found.share < 0.97, "{}", found.share);
        assert!(found.spread <= 1e-7 + noise && found.spread >= 0.3 * noise, "{} of {noise}", found.spread);
        let back = place.inverse();
        for mut image in images {
            let whole = image.clone();
            Region::Below(found.plane).removed().of_image(&mut image, &Progress::none()).unwrap();
            let heights = |image: &RangeImage| -> Vec<f64> {
                let valid = (0..image.len()).filter(|&i| image.is_valid(i));
                valid.map(|i| back.transform_point3(image.point_in_world(i)).z).collect()
            };
            // Of the ball, all but what lies within the noise of the table.
            let of_ball = heights(&whole).iter().filter(|&&z| z > 0.01 + 6.0 * noise).count();
            let left = heights(&image);
            assert!(left.len() >= of_ball && left.len() < of_ball + 25 + whole.len() / 100, "{} {of_ball}", left.len());
        }
    }
}

#[test]
fn neither_order_nor_threads_count() {
    let mut images = frames(7, 0.004, tilted());
    let bits = |found: DominantPlane| {
        let DominantPlane { plane, share, spread } = found;
        let all =
            [plane.normal().x, plane.normal().y, plane.normal().z, plane.point().z, plane.margin(), share, spread];
        all.map(f64::to_bits)
    };
    let expected = bits(search(&images, 1).unwrap());
    for threads in [2, 3, 8] {
        images.rotate_left(3);
        images.swap(0, 1);
        assert_eq!(bits(search(&images, threads).unwrap()), expected, "{threads} threads");
    }
}

/// Points of a square in the plane z = 0 and of a heap on one side of it.
fn square_and_heap(side: f64) -> PointCloud {
    let at = |i: u64| match i % 4 {
        0 => DVec3::new(0.2 * draw(5 * i), 0.2 * draw(5 * i + 1), side * (0.3 + 0.2 * draw(5 * i + 2))),
        _ => DVec3::new(draw(5 * i), draw(5 * i + 1), 0.001 * normal(i)),
    };
    PointCloud { positions: (0..8000).map(at).collect(), ..PointCloud::default() }
}

fn of_cloud(cloud: &PointCloud, params: &PlaneParams) -> Result<DominantPlane> {
    let scan = PlacedCloud { name: "points".to_owned(), cloud, world_from_cloud: cloud.world_from_cloud };
    dominant(&[&scan], params, &Progress::none())
}

#[test]
fn above_is_where_it_was_seen_from_else_where_the_others_are() {
    for side in [1.0, -1.0] {
        let mut cloud = square_and_heap(side);
        let found = of_cloud(&cloud, &PlaneParams::default()).unwrap();
        assert!(found.plane.normal().z * side > 0.999, "{:?}", found.plane);
        assert!((found.share - 0.75).abs() < 0.01, "{}", found.share);
        // Normals say more than where others lie: a floor seen beside a table does not turn it.
        for seen in [1.0, -1.0] {
            cloud.normals = Some(vec![[0.0, 0.0, seen as f32]; cloud.positions.len()]);
            let found = of_cloud(&cloud, &PlaneParams::default()).unwrap();
            assert!(found.plane.normal().z * seen > 0.999);
        }
    }
    let block = Shape::Cuboid { half: DVec3::new(5.0, 4.0, 1.0) }.mesh(9);
    let mesh = PlacedMesh { name: "block".to_owned(), mesh: &block, world_from_mesh: DAffine3::IDENTITY };
    let found = dominant(&[&mesh], &PlaneParams::default(), &Progress::none()).unwrap();
    // Of its two largest sides either, seen from outside.
    assert!(found.plane.height(DVec3::ZERO) < -0.99 && found.plane.normal().z.abs() > 0.999, "{found:?}");
}

#[test]
fn parameters_are_heeded() {
    let cloud = square_and_heap(1.0);
    let margin =
        of_cloud(&cloud, &PlaneParams { margin: Some(0.25), ..PlaneParams::default() }).unwrap().plane.margin();
    assert_eq!(margin, 0.25);
    let narrow = of_cloud(&cloud, &PlaneParams { tolerance: Some(0.0005), min_share: 0.0, ..PlaneParams::default() });
    assert!(narrow.is_err() || narrow.is_ok_and(|found| found.share < 0.4));
    let refused = of_cloud(&cloud, &PlaneParams { min_share: 0.8, ..PlaneParams::default() }).unwrap_err().to_string();
    assert!(refused.starts_with("no plane stands out: 75 % of the samples lie on the best one"), "{refused}");
    let refused = of_cloud(&cloud, &PlaneParams { min_share: 2.0, ..PlaneParams::default() }).unwrap_err().to_string();
    assert!(refused.starts_with("min_share must be"), "{refused}");
}

#[test]
fn where_no_plane_stands_out_that_is_said() {
    let refused = |positions: Vec<DVec3>| {
        let cloud = PointCloud { positions, ..PointCloud::default() };
        of_cloud(&cloud, &PlaneParams::default()).unwrap_err().to_string()
    };
    let ball = Shape::Sphere { radius: 2.0 }.mesh(90).positions;
    assert!(refused(ball).starts_with("no plane stands out"));
    let heap = (0..9000).map(|i| DVec3::new(normal(3 * i), normal(3 * i + 1), normal(3 * i + 2))).collect();
    assert!(refused(heap).starts_with("no plane stands out"));
    for many in [4, 5, 300] {
        let line = (0..many).map(|i| DVec3::new(1.0, 2.0, 3.0) * i as f64).collect();
        assert!(refused(line).starts_with("the samples lie on a line"));
        assert!(refused(vec![DVec3::ONE; many]).starts_with("the samples lie on a line or in one place"));
    }
    for few in 0..3 {
        let text = refused((0..few).map(|i| DVec3::ONE * i as f64).collect());
        assert!(text.contains(&format!("at least three samples, but the scans have {few}")), "{text}");
    }
    assert!(dominant(&[], &PlaneParams::default(), &Progress::none()).unwrap_err().to_string().contains("have 0"));
    assert!(refused(vec![DVec3::splat(1e200); 9]).contains("a sample must have finite coordinates"));
    let images = frames(2, 0.0, DAffine3::IDENTITY);
    let sources: Vec<&dyn ScanSource> = images.iter().map(|image| image as &dyn ScanSource).collect();
    for checks in [0, 3, 20, 60] {
        let stopped = dominant(&sources, &PlaneParams::default(), &Progress::cancel_after(checks));
        assert!(matches!(stopped, Err(Error::Cancelled)), "after {checks}: {stopped:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(base::tier::cases(12)))]
    /// A plane of a tenth of the samples is found among others that lie anywhere.
    #[test]
    fn a_tenth_of_the_samples_is_enough(n in prop::array::uniform3(-1.0..1.0_f64), at in prop::array::uniform3(-5.0..5.0_f64), seed in 0..1000_u64) {
        prop_assume!(DVec3::from(n).length() > 0.1);
        let (n, at) = (DVec3::from(n).normalize(), DVec3::from(at));
        let [across, along] = [n.any_orthonormal_vector(), n.cross(n.any_orthonormal_vector())];
        let place = |i: u64| {
            let [x, y, z] = [0, 1, 2].map(|k| draw((seed * 100_000 + i) * 3 + k));
            at + if i.is_multiple_of(10) { across * x * 0.5 + along * y * 0.5 + n * z * 0.001 } else { DVec3::new(x, y, z) }
        };
        let cloud = PointCloud { positions: (0..20_000).map(place).collect(), ..PointCloud::default() };
        let found = of_cloud(&cloud, &PlaneParams::default()).unwrap();
        prop_assert!(found.plane.normal().dot(n).abs() > 0.9999, "{found:?}");
        prop_assert!(found.plane.height(at).abs() < 0.002);
    }
}
