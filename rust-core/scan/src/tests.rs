use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3};

use super::shapes::Shape;
use super::*;
use base::error::Error;
use base::progress::Progress;
use geom::bvh::Bvh;
use image::range_image::{DepthKind, Projection, RangeImage};
use mesh::TriMesh;

fn shoot(mesh: &TriMesh, camera: &VirtualCamera, params: &ScanParams) -> RangeImage {
    let bvh = Bvh::build(&mesh.positions, &mesh.triangles, 1).unwrap();
    scan(mesh, &bvh, camera, params, &Progress::none()).unwrap()
}

fn turned() -> DMat3 {
    DMat3::from_quat(DQuat::from_scaled_axis(DVec3::new(0.4, -1.1, 0.7)))
}

/// Cameras of every kind that look at the origin from about 5 away.
fn cameras(rows: usize, cols: usize) -> Vec<VirtualCamera> {
    let eye = turned() * DVec3::new(0.1, 0.3, 5.0);
    let mut cameras = vec![
        VirtualCamera::orthographic(rows, cols, 0.05, DVec3::ZERO, -eye, DVec3::Y).unwrap(),
        VirtualCamera::pinhole(rows, cols, 0.5, eye, DVec3::ZERO, DVec3::Z).unwrap(),
        VirtualCamera::pinhole(rows, cols, 0.5, eye, DVec3::ZERO, DVec3::Z).unwrap(),
    ];
    if let Projection::Pinhole { depth, .. } = &mut cameras[2].projection {
        *depth = DepthKind::Ray;
    }
    let spherical = Projection::Spherical { first: [-0.3, 0.25], step: [0.6 / cols as f64, -0.5 / rows as f64] };
    // Its x axis, azimuth 0, looks at the origin.
    let x = -eye.normalize();
    let y = DVec3::Z.cross(x).normalize();
    let world_from_sensor = DAffine3::from_mat3_translation(DMat3::from_cols(x, y, x.cross(y)), eye);
    cameras.push(VirtualCamera { rows, cols, projection: spherical, world_from_sensor });
    cameras
}

/// A finely cut part of the unit sphere around the direction `toward`.
fn cap(toward: DVec3, half_angle: f64, n: usize) -> TriMesh {
    let u = toward.any_orthonormal_vector();
    let v = toward.cross(u);
    let mut mesh = TriMesh::default();
    for i in 0..=n {
        for j in 0..=n {
            let (s, t) = (2.0 * i as f64 / n as f64 - 1.0, 2.0 * j as f64 / n as f64 - 1.0);
            mesh.positions.push((toward + u * (half_angle * s) + v * (half_angle * t)).normalize());
        }
    }
    for i in 0..n {
        for j in 0..n {
            let at = |i: usize, j: usize| (i * (n + 1) + j) as u32;
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

#[test]
fn ranges_of_a_sphere_are_exact_in_every_projection() {
    for camera in cameras(40, 30) {
        let eye = camera.world_from_sensor.inverse();
        let toward = match camera.projection {
            Projection::Orthographic { .. } => camera.world_from_sensor.matrix3.z_axis,
            _ => camera.world_from_sensor.translation.normalize(),
        };
        let mesh = cap(toward, 0.3, 300);
        let image = shoot(&mesh, &camera, &ScanParams::default());
        assert!(image.valid_count() > 50, "{:?} sees {}", camera.projection, image.valid_count());
        let centre = eye.transform_point3(DVec3::ZERO);
        for pixel in (0..image.len()).filter(|&i| image.is_valid(i)) {
            let p = image.point_in_sensor(pixel);
            let (origin, direction) = camera.projection.ray(pixel / camera.cols, pixel % camera.cols, p);
            // The place where the pixel's own ray meets the sphere.
            let m = origin - centre;
            let b = m.dot(direction);
            let exact = -b - (b * b - m.length_squared() + 1.0).sqrt();
            let range = (p - origin).dot(direction);
            assert!((range - exact).abs() <= 1e-6 * exact.abs().max(5.0), "{range} {exact}");
            assert!((p - origin).cross(direction).length() < 1e-12, "the point is not on its ray");
        }
    }
}

#[test]
fn ranges_of_a_plane_are_exact_in_every_projection_and_far_from_the_origin() {
    for offset in [0.0, 1e7] {
        for mut camera in cameras(33, 47) {
            // A plane across the line of sight, tilted.
            let normal = (turned() * DVec3::new(0.3, -0.2, 1.0)).normalize();
            let (u, v) = normal.any_orthonormal_pair();
            let shift = DVec3::splat(offset);
            let corners = [-u - v, u - v, u + v, v - u].map(|p| p * 4.0 + shift);
            let mesh = TriMesh::new(corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]]);
            camera.world_from_sensor.translation += shift;
            let image = shoot(&mesh, &camera, &ScanParams::default());
            assert_eq!(image.valid_count(), image.len());
            for pixel in 0..image.len() {
                let distance = (image.point_in_world(pixel) - shift).dot(normal);
                assert!(distance.abs() < if offset == 0.0 { 1e-14 * 20.0 } else { 1e-8 }, "{distance}");
            }
        }
    }
}

#[test]
fn every_point_of_a_scan_lies_on_the_surface() {
    let shape = Shape::Cuboid { half: DVec3::new(0.7, 0.9, 0.5) };
    let mesh = shape.mesh(3);
    for camera in cameras(50, 50) {
        let image = shoot(&mesh, &camera, &ScanParams::default());
        assert!(image.valid_count() > 100);
        for pixel in (0..image.len()).filter(|&i| image.is_valid(i)) {
            assert!(shape.distance(image.point_in_world(pixel)).abs() < 1e-14 * 10.0);
        }
    }
}

#[test]
fn an_inscribed_sphere_is_missed_by_no_more_than_its_facets_sag() {
    let mesh = Shape::Sphere { radius: 1.0 }.mesh(24);
    let lowest = (0..mesh.triangles.len())
        .map(|t| {
            let [a, b, c] = mesh.corners(t);
            (b - a).cross(c - a).normalize().dot(a)
        })
        .fold(1.0, f64::min);
    for camera in cameras(64, 64) {
        let image = shoot(&mesh, &camera, &ScanParams::default());
        assert!(image.valid_count() > 500);
        for pixel in (0..image.len()).filter(|&i| image.is_valid(i)) {
            let radius = image.point_in_world(pixel).length();
            assert!(radius >= lowest - 1e-12 && radius <= 1.0 + 1e-12);
        }
    }
}

#[test]
fn the_same_image_for_any_number_of_threads() {
    let mut mesh = Shape::Torus { major: 1.0, minor: 0.4 }.mesh(20);
    let colours = (0..mesh.positions.len()).map(|i| [i as u8, (i >> 8) as u8, 7, 255]).collect();
    mesh.vertex_attributes.push(mesh::Attribute::colour("colour", colours));
    let noisy = ScanParams {
        noise: 0.01,
        noise_grazing: 1.0,
        dropout: 0.1,
        dropout_grazing: 0.5,
        pose_shift: 0.01,
        pose_turn: 0.01,
        seed: 42,
        ..ScanParams::default()
    };
    // NaN is not equal to itself: compare the bits.
    let bits = |image: &RangeImage| {
        let image::range_image::Samples::Values(values) = image.samples() else { panic!() };
        let values: Vec<u64> = values.iter().map(|v| v.to_bits()).collect();
        (values, image.colour.clone(), image.world_from_sensor)
    };
    for camera in cameras(61, 83) {
        let images = [1, 2, 8].map(|threads| bits(&shoot(&mesh, &camera, &ScanParams { threads, ..noisy })));
        assert!(images[0] == images[1] && images[0] == images[2]);
        assert!(images[0] != bits(&shoot(&mesh, &camera, &ScanParams { seed: 43, ..noisy })));
    }
}

fn wall() -> (TriMesh, VirtualCamera) {
    let mesh = Shape::Plane { half: DVec2::splat(10.0) }.mesh(1);
    (mesh, VirtualCamera::pinhole(300, 300, 0.2, DVec3::new(0.0, 0.0, 8.0), DVec3::ZERO, DVec3::Y).unwrap())
}

#[test]
fn noise_has_the_wanted_deviation_along_the_ray() {
    let (mesh, camera) = wall();
    let truth = shoot(&mesh, &camera, &ScanParams::default());
    let sigma = 0.02;
    let image = shoot(&mesh, &camera, &ScanParams { noise: sigma, seed: 3, ..ScanParams::default() });
    let n = image.len() as f64;
    let errors: Vec<f64> = (0..image.len())
        .map(|i| {
            let (seen, true_point) = (image.point_in_sensor(i), truth.point_in_sensor(i));
            (seen - true_point).length().copysign(seen.length() - true_point.length())
        })
        .collect();
    let mean = errors.iter().sum::<f64>() / n;
    let deviation = (errors.iter().map(|e| e * e).sum::<f64>() / n).sqrt();
    assert!(mean.abs() < 5.0 * sigma / n.sqrt(), "{mean}");
    assert!((deviation / sigma - 1.0).abs() < 5.0 / (2.0 * n).sqrt(), "{deviation}");
}

#[test]
fn noise_and_dropouts_grow_at_grazing_angles() {
    let mesh = Shape::Plane { half: DVec2::splat(1000.0) }.mesh(1);
    let share = |image: &RangeImage| 1.0 - image.valid_count() as f64 / image.len() as f64;
    for (cosine, params) in [1.0f64, 0.5, 0.2].map(|c| {
        (c, ScanParams { noise: 0.01, noise_grazing: 2.0, dropout: 0.1, dropout_grazing: 0.8, ..ScanParams::default() })
    }) {
        let toward = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, -cosine);
        let camera = VirtualCamera::orthographic(300, 300, 1e-3, DVec3::ZERO, toward, DVec3::Y).unwrap();
        let image = shoot(&mesh, &camera, &params);
        let expected = 0.1 + 0.8 * (1.0 - cosine).powi(4);
        assert!((share(&image) - expected).abs() < 5.0 * (expected / 90_000.0).sqrt(), "{} {expected}", share(&image));
        let sum: f64 =
            (0..image.len()).filter(|&i| image.is_valid(i)).map(|i| (image.point_in_world(i).z / cosine).powi(2)).sum();
        let (deviation, expected) =
            ((sum / image.valid_count() as f64).sqrt(), 0.01 * (1.0 + 2.0 * (1.0 / cosine - 1.0)));
        assert!((deviation / expected - 1.0).abs() < 0.015, "{deviation} {expected}");
    }
}

#[test]
fn values_are_multiples_of_the_quantum_and_off_by_half_of_it_at_most() {
    let (mesh, camera) = wall();
    let tilted = TriMesh { positions: mesh.positions.iter().map(|p| *p + DVec3::Z * p.x * 0.1).collect(), ..mesh };
    let truth = shoot(&tilted, &camera, &ScanParams::default());
    let image = shoot(&tilted, &camera, &ScanParams { quantum: 0.01, ..ScanParams::default() });
    for i in 0..image.len() {
        let (z, exact) = (image.point_in_sensor(i).z, truth.point_in_sensor(i).z);
        assert!((z - exact).abs() <= 0.005 + 1e-12 && (z / 0.01 - (z / 0.01).round()).abs() < 1e-9);
    }
}

#[test]
fn the_back_of_a_surface_and_what_is_too_far_are_not_seen() {
    let (mesh, camera) = wall();
    let back = TriMesh { triangles: mesh.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect(), ..mesh.clone() };
    assert_eq!(shoot(&back, &camera, &ScanParams::default()).valid_count(), 0);
    let both = ScanParams { backfaces: true, ..ScanParams::default() };
    assert_eq!(shoot(&back, &camera, &both).valid_count(), camera.rows * camera.cols);

    let range = 8.01;
    let image = shoot(&mesh, &camera, &ScanParams { max_range: Some(range), ..ScanParams::default() });
    let truth = shoot(&mesh, &camera, &ScanParams::default());
    assert!((1..image.len()).contains(&image.valid_count()));
    for i in 0..image.len() {
        assert_eq!(image.is_valid(i), truth.point_in_sensor(i).length() <= range);
    }
}

#[test]
fn a_wrong_pose_is_rigid_of_the_wanted_size_and_moves_no_sample() {
    let mesh = Shape::Sphere { radius: 1.0 }.mesh(8);
    let camera = cameras(30, 30)[1];
    let truth = shoot(&mesh, &camera, &ScanParams::default());
    assert_eq!(truth.world_from_sensor, camera.world_from_sensor);
    let (shift, turn) = (0.01, 0.02);
    let (mut moved, mut turned) = (0.0, 0.0);
    let runs = 400;
    for seed in 0..runs {
        let params = ScanParams { pose_shift: shift, pose_turn: turn, seed, ..ScanParams::default() };
        let image = shoot(&mesh, &camera, &params);
        for i in (0..image.len()).filter(|&i| image.is_valid(i)) {
            assert_eq!(image.point_in_sensor(i), truth.point_in_sensor(i));
        }
        let error = image.world_from_sensor * camera.world_from_sensor.inverse();
        let q = DQuat::from_mat3(&error.matrix3);
        assert!((error.matrix3.determinant() - 1.0).abs() < 1e-12);
        turned += q.to_scaled_axis().length_squared();
        let valid: Vec<usize> = (0..image.len()).filter(|&i| image.is_valid(i)).collect();
        let mean = |of: &RangeImage| valid.iter().map(|&i| of.point_in_world(i)).sum::<DVec3>() / valid.len() as f64;
        moved += (mean(&image) - mean(&truth)).length_squared();
    }
    let (moved, turned) = ((moved / runs as f64 / 3.0).sqrt(), (turned / runs as f64).sqrt());
    assert!((moved / shift - 1.0).abs() < 0.1, "{moved}");
    assert!((turned / turn - 1.0).abs() < 0.18, "{turned}");
}

#[test]
fn colours_are_mixed_from_the_corners() {
    let mut mesh = TriMesh::new(
        vec![DVec3::new(-2.0, -2.0, 0.0), DVec3::new(4.0, -2.0, 0.0), DVec3::new(-2.0, 4.0, 0.0)],
        vec![[0, 1, 2]],
    );
    let colours = vec![[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 0]];
    mesh.vertex_attributes.push(mesh::Attribute::colour("colour", colours));
    let camera = VirtualCamera::orthographic(1, 1, 1.0, DVec3::ZERO, DVec3::NEG_Z, DVec3::Y).unwrap();
    // The pixel's ray meets the centroid.
    assert_eq!(shoot(&mesh, &camera, &ScanParams::default()).colour, Some(vec![[85, 85, 85, 170]]));
}

#[test]
fn a_ring_of_cameras_sees_all_of_the_shape() {
    let mesh = Shape::Torus { major: 1.0, minor: 0.3 }.mesh(10);
    for height_angle in [None, Some(0.6)] {
        let table = TurntableViews { pixels: 60, height_angle, ..TurntableViews::default() };
        let cameras = turntable(bounds(&mesh.positions).unwrap(), &table, &Progress::none()).unwrap();
        assert_eq!(cameras.len(), 12);
        for camera in &cameras {
            let image = shoot(&mesh, camera, &ScanParams::default());
            let (rows, cols) = (image.rows(), image.cols());
            let border = (0..image.len()).filter(|i| {
                let (row, col) = (i / cols, i % cols);
                row == 0 || row == rows - 1 || col == 0 || col == cols - 1
            });
            assert!(image.valid_count() > 100 && border.into_iter().all(|i| !image.is_valid(i)));
        }
    }
    assert!(turntable((DVec3::ZERO, DVec3::ZERO), &TurntableViews::default(), &Progress::none()).is_err());
    assert!(
        turntable(
            (DVec3::ZERO, DVec3::ONE),
            &TurntableViews { up: DVec3::ZERO, ..TurntableViews::default() },
            &Progress::none()
        )
        .is_err()
    );
}

#[test]
fn a_spherical_camera_sees_all_around() {
    let mesh = Shape::Cuboid { half: DVec3::splat(2.0) }.mesh(2);
    let camera = VirtualCamera::spherical(45, 90, -1.5, 1.5, DVec3::new(0.3, 0.2, -0.1), DVec3::Y).unwrap();
    let image = shoot(&mesh, &camera, &ScanParams { backfaces: true, ..ScanParams::default() });
    assert_eq!(image.valid_count(), image.len());
    assert!(image.point_in_world(0).y > 1.9 && image.point_in_world(image.len() - 1).y < -1.9);
}

#[test]
fn odd_sizes_and_empty_meshes() {
    let mesh = Shape::Sphere { radius: 1.0 }.mesh(2);
    for (rows, cols) in [(0, 0), (0, 5), (5, 0), (1, 1), (1, 17), (9, 3)] {
        let camera = VirtualCamera::orthographic(rows, cols, 0.01, DVec3::ZERO, DVec3::NEG_Z, DVec3::Y).unwrap();
        assert_eq!(shoot(&mesh, &camera, &ScanParams::default()).valid_count(), rows * cols);
        assert_eq!(shoot(&TriMesh::default(), &camera, &ScanParams::default()).valid_count(), 0);
    }
    let flat = TriMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::X * 2.0], vec![[0, 1, 2], [0, 0, 0]]);
    for camera in cameras(20, 20) {
        shoot(&flat, &camera, &ScanParams { noise: 0.1, noise_grazing: 1.0, backfaces: true, ..ScanParams::default() });
    }
}

#[test]
fn bad_input_is_named() {
    let mesh = Shape::Sphere { radius: 1.0 }.mesh(1);
    let bvh = Bvh::build(&mesh.positions, &mesh.triangles, 1).unwrap();
    let camera = cameras(4, 4)[1];
    let fails = |camera: &VirtualCamera, params: &ScanParams, words: &str| {
        let text = scan(&mesh, &bvh, camera, params, &Progress::none()).unwrap_err().to_string();
        assert!(text.contains(words), "{text}");
    };
    fails(&camera, &ScanParams { noise: -1.0, ..ScanParams::default() }, "noise must be");
    fails(&camera, &ScanParams { dropout: 1.5, ..ScanParams::default() }, "dropout must be >= 0 and <= 1");
    fails(&camera, &ScanParams { seed: u64::MAX, ..ScanParams::default() }, "seed must be");
    fails(&camera, &ScanParams { max_range: Some(0.0), ..ScanParams::default() }, "max_range must be");
    fails(&VirtualCamera { rows: usize::MAX, ..camera }, &ScanParams::default(), "too large");
    let skewed = DAffine3::from_scale(DVec3::splat(2.0));
    fails(&VirtualCamera { world_from_sensor: skewed, ..camera }, &ScanParams::default(), "rotation");
    let ranged = ScanParams { max_range: Some(1.0), ..ScanParams::default() };
    fails(&cameras(4, 4)[0], &ranged, "infinitely far");
    let other = TriMesh::default();
    assert!(scan(&other, &bvh, &camera, &ScanParams::default(), &Progress::none()).is_err());
}

#[test]
fn cancels_at_every_check() {
    let mesh = Shape::Sphere { radius: 1.0 }.mesh(4);
    let bvh = Bvh::build(&mesh.positions, &mesh.triangles, 1).unwrap();
    let camera = cameras(33, 20)[0];
    for checks in 0..5 {
        let outcome = scan(&mesh, &bvh, &camera, &ScanParams::default(), &Progress::cancel_after(checks));
        assert!(matches!(outcome, Err(Error::Cancelled)), "{checks}");
    }
    assert!(scan(&mesh, &bvh, &camera, &ScanParams::default(), &Progress::cancel_after(5)).is_ok());
}

#[test]
fn cameras_of_unusable_numbers_are_refused_by_name() {
    let (zero, far) = (DVec3::ZERO, DVec3::new(0.0, 1e200, 0.0));
    let pinhole = |angle: f64, eye, target, up| VirtualCamera::pinhole(9, 9, angle, eye, target, up).map(drop);
    let flat = |spacing, target, toward, up| VirtualCamera::orthographic(9, 9, spacing, target, toward, up).map(drop);
    let around = |lowest, highest, eye, up| VirtualCamera::spherical(9, 9, lowest, highest, eye, up).map(drop);
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    assert!(pinhole(1.0, x, zero, z).is_ok() && flat(0.1, zero, x, zero).is_ok() && around(-1.0, 1.0, zero, y).is_ok());
    let all = [
        (pinhole(std::f64::consts::PI, x, zero, z), "3.14159"),
        (pinhole(0.0, x, zero, z), "got 0 rad"),
        (pinhole(1e-320, x, zero, z), "1e-320"),
        (pinhole(f64::NAN, x, zero, z), "NaN"),
        (pinhole(1.0, far, zero, z), "eye must have finite coordinates"),
        (pinhole(1.0, x, far, z), "target must have finite coordinates"),
        (pinhole(1.0, x, zero, far), "vertical must be a direction"),
        (flat(1e200, zero, x, z), "spacing must be 1e-75 to 1e75"),
        (flat(-1.0, zero, x, z), "spacing must be > 0, got -1"),
        (flat(0.1, far, x, z), "(0, 1e200, 0)"),
        (flat(0.1, zero, far, z), "the direction a camera looks in"),
        (flat(0.1, zero, 1e-200 * x, z), "(1e-200, 0, 0)"),
        (around(-1e308, 1.0, zero, z), "lowest elevation"),
        (around(-1.0, 1e308, zero, z), "highest elevation"),
        (around(-1.0, 1.0, far, z), "eye"),
        (around(-1.0, 1.0, zero, zero), "vertical must be a direction"),
    ];
    for (outcome, words) in all {
        let text = outcome.unwrap_err().to_string();
        assert!(text.contains(words), "{text} says nothing of {words}");
    }
    let bounds = (DVec3::splat(-1.0), DVec3::splat(1.0));
    let table = |change: fn(&mut TurntableViews)| {
        let mut table = TurntableViews::default();
        change(&mut table);
        turntable(bounds, &table, &Progress::none()).map(drop).unwrap_err().to_string()
    };
    assert!(table(|t| t.height_angle = Some(std::f64::consts::PI)).contains("3.14159"));
    assert!(table(|t| t.height_angle = Some(0.0)).contains("got 0 rad"));
    assert!(table(|t| t.up = DVec3::new(0.0, 0.0, 1e200)).contains("(0, 0, 1e200)"));
    assert!(table(|t| t.elevation = 1e308).contains("1e308"));
    let far = turntable((DVec3::ZERO, DVec3::splat(1e200)), &TurntableViews::default(), &Progress::none())
        .unwrap_err()
        .to_string();
    assert!(far.contains("1e200"), "{far}");
    let mut camera = VirtualCamera::pinhole(9, 9, 1.0, x, zero, z).unwrap();
    camera.projection = Projection::Pinhole { focal: [1e-70; 2], centre: [1e10; 2], depth: DepthKind::Planar };
    assert!(camera.validate().unwrap_err().to_string().contains("rays reach to "));
}
