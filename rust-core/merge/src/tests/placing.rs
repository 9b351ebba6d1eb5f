//! Scans that plainly do not lie where they belong are said, and no others.

use super::*;

/// A room with a block at a wall, seen from inside.
fn room() -> TriMesh {
    let mut scene = Shape::Cuboid { half: DVec3::new(2.5, 2.0, 1.3) }.mesh(8);
    scene.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    for (at, half) in [(DVec3::new(1.9, 0.4, -0.8), 0.5), (DVec3::new(-0.7, -1.5, -0.9), 0.4)] {
        let block = Shape::Cuboid { half: DVec3::splat(half) }.mesh(2);
        let base = scene.positions.len() as u32;
        scene.positions.extend(block.positions.iter().map(|p| *p + at));
        scene.triangles.extend(block.triangles.iter().map(|t| t.map(|v| v + base)));
    }
    scene
}

/// Theorem: depth images without poses are said even where what little meets fits: of an object in empty space, seen from all around.
#[test]
fn depth_images_without_poses_around_an_object_are_said() {
    let ring = Shape::Torus { major: 1.0, minor: 0.3 }.mesh(24);
    let bvh = Bvh::build(&ring.positions, &ring.triangles, 0).unwrap();
    let seen = |k: usize| {
        let eye = 3.0 * DVec3::new((k as f64).cos(), (k as f64).sin(), 0.6);
        let camera = VirtualCamera::pinhole(48, 64, 0.8, eye, DVec3::ZERO, DVec3::Z).unwrap();
        let params = ScanParams { noise: 0.002, seed: k as u64, ..ScanParams::default() };
        let mut image = scan::scan(&ring, &bvh, &camera, &params, &Progress::none()).unwrap();
        image.name = format!("frame{k}");
        image
    };
    let scans: Vec<RangeImage> = (0..6).map(seen).collect();
    assert_eq!(kinds(&scans), []);
    assert_eq!(kinds(&moved(&scans, |_, _| DAffine3::IDENTITY)), [WarningKind::NoPoses]);
}

/// Views of the room that a camera sees as it turns.
fn tour(count: usize, noise: f64) -> Vec<RangeImage> {
    let room = room();
    let bvh = Bvh::build(&room.positions, &room.triangles, 0).unwrap();
    let seen = |k: usize| {
        let turn = 0.6 * k as f64;
        let eye = DVec3::new(0.8 * turn.cos(), 0.5 * turn.sin(), 0.1 + 0.3 * (3.0 * turn).sin());
        let target = eye + DVec3::new((turn + 0.5).cos(), (turn + 0.5).sin(), 0.4 * (2.0 * turn).cos() - 0.2);
        let camera = VirtualCamera::pinhole(48, 64, 1.0, eye, target, DVec3::Z).unwrap();
        let params = ScanParams { noise, seed: k as u64, ..ScanParams::default() };
        let mut image = scan::scan(&room, &bvh, &camera, &params, &Progress::none()).unwrap();
        image.name = format!("frame{k}");
        image
    };
    (0..count).map(seen).collect()
}

fn moved(scans: &[RangeImage], pose: impl Fn(usize, DAffine3) -> DAffine3) -> Vec<RangeImage> {
    let mut moved = scans.to_vec();
    moved.iter_mut().enumerate().for_each(|(k, scan)| scan.world_from_sensor = pose(k, scan.world_from_sensor));
    moved
}

fn warnings(scans: &[RangeImage]) -> Vec<Warning> {
    merge_scans(scans, &MergeParams::default()).report.warnings
}

fn kinds(scans: &[RangeImage]) -> Vec<WarningKind> {
    warnings(scans).into_iter().map(|warning| warning.kind).collect()
}

#[test]
fn depth_images_without_poses_are_said() {
    for noise in [0.0, 0.004] {
        let scans = moved(&tour(6, noise), |_, _| DAffine3::IDENTITY);
        let said = warnings(&scans);
        assert_eq!(said.len(), 1, "{said:?}");
        assert_eq!(said[0].kind, WarningKind::NoPoses);
        assert!(said[0].text.starts_with("no scan has a pose: all 6 stand at one place"), "{said:?}");
        assert!(said[0].text.ends_with("align them first, or give their poses"), "{said:?}");
    }
}

#[test]
fn scans_that_lie_far_apart_are_said() {
    let by =
        |k: usize| DAffine3::from_translation(0.2 * DVec3::new((3.0 * k as f64).sin(), (5.0 * k as f64).cos(), 0.0));
    let said = warnings(&moved(&tour(6, 0.004), |k, pose| by(k) * pose));
    assert_eq!(said.iter().map(|warning| warning.kind).collect::<Vec<_>>(), [WarningKind::Apart]);
    assert!(said[0].text.starts_with("the scans lie ") && said[0].text.contains(" times the noise of"), "{said:?}");
}

#[test]
fn scans_that_fit_are_not() {
    for noise in [0.0, 0.004, 0.03] {
        let scans = tour(6, noise);
        assert_eq!(kinds(&scans), [], "{noise}");
        assert_eq!(kinds(&moved(&scans[..1], |_, _| DAffine3::IDENTITY)), [], "one alone");
    }
    // From one place, and of it alone: nothing but who took them knows.
    let still: Vec<RangeImage> = (0..3)
        .map(|k| {
            let mut scan = moved(&tour(1, 0.004 + 0.0001 * f64::from(k)), |_, _| DAffine3::IDENTITY).remove(0);
            scan.name = format!("take{k}");
            scan
        })
        .collect();
    let said = warnings(&still);
    assert_eq!(said.iter().map(|warning| warning.kind).collect::<Vec<_>>(), [WarningKind::NoPoses]);
    assert!(said[0].text.contains("stand at one place. Unless the camera stood still, align them first"), "{said:?}");
    assert_eq!(kinds(&scans(Shape::Torus { major: 1.0, minor: 0.3 }, 40)), []);
    // Points that lie in the world already.
    let grids: Vec<RangeImage> = tour(6, 0.004).iter().map(in_world).collect();
    assert_eq!(kinds(&grids), []);
}

/// A depth image as a grid of points where they are.
fn in_world(image: &RangeImage) -> RangeImage {
    let at = |k: usize| match image.is_valid(k) {
        true => image.point_in_world(k).as_vec3().to_array(),
        false => [f32::NAN; 3],
    };
    let points = (0..image.len()).map(at).collect();
    let eye = image.world_from_sensor.translation;
    let mut grid = RangeImage::from_points(image.rows(), image.cols(), points, Viewing::From(eye)).unwrap();
    grid.name = image.name.clone();
    grid
}

#[test]
fn meshes_are_told_by_the_distance_of_their_vertices() {
    let ball = Shape::Sphere { radius: 1.0 }.mesh(48);
    let of = |shift: f64| {
        let places = [0.0, shift].map(|x| DAffine3::from_translation(DVec3::new(x, 0.1 * x, 0.2 * x)));
        let meshes = places.map(|place| PlacedMesh { name: format!("{place:?}"), mesh: &ball, world_from_mesh: place });
        let params = MergeParams { voxel: Some(0.1), ..MergeParams::default() };
        merge(&[&meshes[0], &meshes[1]], &params, Run::default(), &Progress::none()).unwrap().report.warnings
    };
    assert_eq!(of(0.0), []);
    let said = of(0.5);
    assert!(said.len() == 1 && said[0].text.contains(" times the distance of their samples"), "{said:?}");
}
