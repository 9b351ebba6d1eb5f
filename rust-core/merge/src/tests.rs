//! Rules that always hold of a merge, whatever the scans.

use glam::{DAffine3, DVec3};
use proptest::prelude::*;

mod blocks;
pub(crate) mod closing;
mod colours;
mod defaults;
mod grazing;
mod noise;
mod placing;
mod refusals;
mod slivers;

use crate::crossings::bundles::{self, Buckets};
use crate::crossings::crossing::Crossing;
use crate::crossings::discretize;
use crate::crossings::lattice::{ACROSS, BRICK, BRICK_BITS, Lattice};
use crate::intake::setup::Setup;
use crate::run::memory::Memory;
use crate::run::started::surface;
use crate::*;
use base::error::Error;
use base::threads;
use geom::bvh::Bvh;
use image::range_image::{Projection, RangeImage, Viewing};
use image::triangulate::TriangulateParams;
use mesh::check::check;
use mesh::{Attribute, AttributeData, TriMesh, measure};
use scan::{self, ScanParams, TurntableViews, VirtualCamera, shapes::Shape};

/// A merge of which settings are given that are no parameters.
pub(crate) fn by_setup(
    sources: &[&dyn ScanSource],
    params: &MergeParams,
    setup: &Setup,
    progress: &Progress<'_>,
) -> Result<Merged> {
    surface(&mut Memory::new(sources, params, setup), params, progress)
}

/// Everything of one size is kept: the tests are about the method, not about its cosmetics.
fn plain(voxel: f64) -> MergeParams {
    MergeParams { voxel: Some(voxel), max_hole_length: Some(0.0), min_component_share: 0.0, ..MergeParams::default() }
}

fn merge_mesh(mesh: &TriMesh, params: &MergeParams) -> Merged {
    let placed = PlacedMesh { name: "mesh".to_owned(), mesh, world_from_mesh: DAffine3::IDENTITY };
    merge(&[&placed], params, Run::default(), &Progress::none()).unwrap()
}

/// Scans of a shape from all sides, noisy and slightly misplaced.
pub(crate) fn scans(shape: Shape, pixels: usize) -> Vec<RangeImage> {
    scans_with(shape, pixels, &ScanParams { noise: 0.002, pose_shift: 0.003, ..ScanParams::default() })
}

/// The same without noise, where they are said to be.
pub(crate) fn clean_scans(shape: Shape, pixels: usize) -> Vec<RangeImage> {
    scans_with(shape, pixels, &ScanParams::default())
}

pub(crate) fn scans_with(shape: Shape, pixels: usize, params: &ScanParams) -> Vec<RangeImage> {
    let mesh = shape.mesh(24);
    let bvh = Bvh::build(&mesh.positions, &mesh.triangles, 0).unwrap();
    let bounds = scan::bounds(&mesh.positions).unwrap();
    let cameras =
        scan::turntable(bounds, &TurntableViews { around: 5, pixels, ..TurntableViews::default() }, &Progress::none())
            .unwrap();
    let look = |(i, camera): (usize, &VirtualCamera)| {
        let params = ScanParams { seed: i as u64, ..*params };
        let mut image = scan::scan(&mesh, &bvh, camera, &params, &Progress::none()).unwrap();
        image.name = format!("scan{i}");
        image.colour = Some(vec![[(20 * i) as u8, 100, 200, 255]; image.len()]);
        image
    };
    cameras.iter().enumerate().map(look).collect()
}

fn merge_scans(scans: &[RangeImage], params: &MergeParams) -> Merged {
    let sources: Vec<&dyn ScanSource> = scans.iter().map(|s| s as &dyn ScanSource).collect();
    merge(&sources, params, Run::default(), &Progress::none()).unwrap()
}

fn tetrahedron(corners: [[i32; 3]; 4], unit: f64) -> Option<TriMesh> {
    let p = corners.map(|c| DVec3::from_array(c.map(|x| f64::from(x) * unit)));
    let volume = (p[1] - p[0]).cross(p[2] - p[0]).dot(p[3] - p[0]);
    let mut triangles = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
    if volume < 0.0 {
        triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    (volume != 0.0).then(|| TriMesh::new(p.to_vec(), triangles))
}

/// Crossings of a mesh by axis, line and place, with +1 where a walk enters the object.
fn crossings(mesh: &TriMesh, voxel: f64) -> Vec<(usize, [i32; 2], f64, i32)> {
    let surface = OrientedSurface::from_mesh(mesh, DAffine3::IDENTITY).unwrap();
    let lattice = Lattice { voxel, base: [0; 3] };
    let mut buckets = Buckets::default();
    discretize::discretize(&surface, "mesh", 0, &lattice, &mut buckets, &Progress::none()).unwrap();
    let mut all = Vec::new();
    for bundle in bundles::gather(vec![buckets]) {
        for c in bundle.found.chunks.iter().flatten() {
            let line = c.line() as i32;
            let across = [
                (bundle.key.across[0] << BRICK_BITS) + (line & (BRICK - 1)),
                (bundle.key.across[1] << BRICK_BITS) + (line >> BRICK_BITS),
            ];
            let place = f64::from(c.cell) + f64::from(c.fraction);
            all.push((bundle.key.axis as usize, across, place, if c.enters() { 1 } else { -1 }));
        }
    }
    all
}

/// Sum of signs along the edge of the grid from `node` along `axis`, from exact cells.
fn edge_sums(mesh: &TriMesh, voxel: f64) -> std::collections::HashMap<(usize, [i32; 3]), i32> {
    let surface = OrientedSurface::from_mesh(mesh, DAffine3::IDENTITY).unwrap();
    let lattice = Lattice { voxel, base: [0; 3] };
    let mut buckets = Buckets::default();
    discretize::discretize(&surface, "mesh", 0, &lattice, &mut buckets, &Progress::none()).unwrap();
    let mut sums = std::collections::HashMap::new();
    for bundle in bundles::gather(vec![buckets]) {
        let axis = bundle.key.axis as usize;
        for c in bundle.found.chunks.iter().flatten() {
            let mut node = [0; 3];
            node[axis] = c.cell;
            node[ACROSS[axis][0]] = (bundle.key.across[0] << BRICK_BITS) + (c.line() as i32 & (BRICK - 1));
            node[ACROSS[axis][1]] = (bundle.key.across[1] << BRICK_BITS) + (c.line() as i32 >> BRICK_BITS);
            *sums.entry((axis, node)).or_insert(0) += if c.enters() { 1 } else { -1 };
        }
    }
    sums
}

/// A closed surface crosses the four edges around every face of the grid as a labelling of the nodes does: the signed
/// sums around the face vanish.
fn assert_watertight(mesh: &TriMesh, voxel: f64) {
    let sums = edge_sums(mesh, voxel);
    let at = |axis: usize, node: [i32; 3]| sums.get(&(axis, node)).copied().unwrap_or(0);
    for &(axis, node) in sums.keys() {
        for other in (0..3).filter(|&o| o != axis) {
            for back in 0..2 {
                let mut corner = node;
                corner[other] -= back;
                let (mut right, mut up) = (corner, corner);
                right[axis] += 1;
                up[other] += 1;
                let around = at(axis, corner) + at(other, right) - at(axis, up) - at(other, corner);
                assert_eq!(around, 0, "face at {corner:?} along {axis} and {other}");
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(base::tier::cases(400)))]

    /// Vertices on nodes, edges through nodes and along grid lines, faces in grid planes: the worst case.
    #[test]
    fn aligned_tetrahedra_are_watertight(corners in prop::array::uniform4(prop::array::uniform3(-5..6_i32)), halves in any::<bool>()) {
        let unit = if halves { 0.5 } else { 1.0 };
        if let Some(mesh) = tetrahedron(corners, unit) {
            assert_watertight(&mesh, 1.0);
            let placed = PlacedMesh { name: "mesh".to_owned(), mesh: &mesh, world_from_mesh: DAffine3::IDENTITY };
            match merge(&[&placed], &plain(1.0), Run::default(), &Progress::none()) {
                Ok(merged) => prop_assert!(check(&merged.mesh).is_closed(), "{}", check(&merged.mesh)),
                // Small ones slip through the grid.
                Err(error) => prop_assert!(error.to_string().starts_with("nothing is left"), "{error}"),
            }
        }
    }

    #[test]
    fn lines_enter_and_leave_in_turn(corners in prop::array::uniform4(prop::array::uniform3(-40..40_i32))) {
        if let Some(mesh) = tetrahedron(corners, 0.173) {
            let mut all = crossings(&mesh, 1.0);
            all.sort_by(|a, b| (a.0, a.1).cmp(&(b.0, b.1)).then(a.2.total_cmp(&b.2)));
            for line in all.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
                // A convex body: in and out once. Equal places may come in any order.
                prop_assert_eq!(line.len(), 2);
                prop_assert_eq!(line[0].3 + line[1].3, 0);
                prop_assert!(line[0].3 == 1 || line[0].2 == line[1].2);
            }
        }
    }

    /// Any scans at all: manifold with boundary.
    #[test]
    fn random_images_merge_to_manifolds(
        heights in prop::collection::vec(prop::collection::vec(prop_oneof![3 => 0.0..3.0_f64, 1 => Just(f64::NAN)], 49), 1..4),
        distance in 0.0..3.0_f64,
    ) {
        let images: Vec<_> = heights.into_iter().enumerate().map(|(i, values)| {
            let projection = Projection::Orthographic { first: [0.1, -0.2], step: [0.8, -0.9] };
            let mut image = RangeImage::from_values(7, 7, values, projection).unwrap();
            image.name = format!("{i}");
            image.world_from_sensor = DAffine3::from_rotation_x(i as f64);
            image
        }).collect();
        let params = MergeParams {
            merge_distance: Some(distance),
            triangulation: TriangulateParams { edge_limit: Some(4.0), ..TriangulateParams::default() },
            ..plain(0.5)
        };
        for max_hole_length in [0.0, 20.0] {
            let merged = merge_scans(&images, &MergeParams { max_hole_length: Some(max_hole_length), ..params });
            let report = check(&merged.mesh);
            prop_assert!(report.is_manifold() && report.unused_vertices == 0, "{report}");
            merged.mesh.validate().unwrap();
        }
    }
}

#[test]
fn a_closed_surface_stays_closed_and_keeps_its_genus() {
    for (shape, genus) in [
        (Shape::Sphere { radius: 1.0 }, 0),
        (Shape::Torus { major: 1.0, minor: 0.4 }, 1),
        (Shape::Cuboid { half: DVec3::new(1.0, 0.75, 0.5) }, 0),
    ] {
        // 1/16: the box lies in planes of the grid.
        for voxel in [0.1, 0.0625, 0.037] {
            let merged = merge_mesh(&shape.mesh(20), &plain(voxel));
            let report = check(&merged.mesh);
            assert!(report.is_closed() && report.components == 1, "{shape:?} {voxel}: {report}");
            assert_eq!(report.genus(), Some(genus));
            assert_eq!(merged.report.artificial_intersections, 0);
            assert!(measure::enclosed_volume(&merged.mesh) > 0.0, "turned inside out");
        }
    }
}

#[test]
fn a_single_clean_scan_is_not_resampled() {
    let scan = &clean_scans(Shape::Torus { major: 1.0, minor: 0.4 }, 120)[0];
    let voxel = 0.041;
    let surface = OrientedSurface::from_range_image(scan, &Loading::default(), &Progress::none()).unwrap();
    let world = surface.positions.iter().map(|&p| surface.world_from_surface.transform_point3(p)).collect();
    let input = TriMesh::new(world, surface.triangles);
    let merged = merge_scans(std::slice::from_ref(scan), &plain(voxel)).mesh;
    let Some(AttributeData::Bool(interpolated)) = merged.vertex_attribute("interpolated") else { panic!() };
    let exact: Vec<DVec3> =
        (0..merged.positions.len()).filter(|&v| !interpolated[v]).map(|v| merged.positions[v]).collect();
    assert!(exact.len() > 1000 && exact.len() * 20 > merged.positions.len() * 19);
    let deviation = measure::deviation(&exact, &input, measure::Side::Ignored, 0, &Progress::none()).unwrap();
    // Fixed point and single precision within a cell.
    assert!(deviation.summary.max < 2e-6 * voxel, "{}", deviation.summary.max / voxel);
}

#[test]
fn vertices_lie_on_grid_lines() {
    let voxel = 0.05;
    let merged = merge_scans(&scans(Shape::Sphere { radius: 1.0 }, 90), &plain(voxel)).mesh;
    assert!(merged.positions.len() > 1000);
    for p in &merged.positions {
        let off = (*p / voxel - (*p / voxel).round()).abs();
        assert!(off.to_array().iter().filter(|&&o| o < 1e-9).count() >= 2, "{p}");
    }
}

fn bytes(merged: &Merged) -> Vec<u8> {
    let mut bytes: Vec<u8> = bytemuck::cast_slice(&merged.mesh.positions).to_vec();
    bytes.extend_from_slice(bytemuck::cast_slice(&merged.mesh.triangles));
    bytes.extend(format!("{:?}{:?}", merged.mesh.vertex_attributes, merged.mesh.face_attributes).bytes());
    bytes
}

#[test]
fn the_same_bytes_for_any_threads_and_any_order() {
    let mut scans = scans(Shape::Torus { major: 1.0, minor: 0.4 }, 80);
    let params = MergeParams { voxel: Some(0.04), ..MergeParams::default() };
    let expected = bytes(&merge_scans(&scans, &MergeParams { threads: 1, ..params }));
    for threads in [2, 8] {
        assert!(bytes(&merge_scans(&scans, &MergeParams { threads, ..params })) == expected, "{threads} threads");
    }
    for turn in 1..4 {
        scans.rotate_left(turn);
        assert!(bytes(&merge_scans(&scans, &params)) == expected, "another order");
    }
    scans.reverse();
    assert!(bytes(&merge_scans(&scans, &params)) == expected, "reversed");
}

/// Triangles as places, each beginning with its lowest corner, sorted.
fn canonical(mesh: &TriMesh) -> Vec<[[u64; 3]; 3]> {
    let mut triangles: Vec<_> = (0..mesh.triangles.len())
        .map(|t| {
            let corners = mesh.corners(t).map(|p| p.to_array().map(f64::to_bits));
            let lowest = (0..3).min_by_key(|&i| corners[i]).unwrap();
            [corners[lowest], corners[(lowest + 1) % 3], corners[(lowest + 2) % 3]]
        })
        .collect();
    triangles.sort_unstable();
    triangles
}

#[test]
fn the_same_surface_for_any_split_into_bricks() {
    let scans = scans(Shape::Torus { major: 1.0, minor: 0.4 }, 80);
    let sources: Vec<&dyn ScanSource> = scans.iter().map(|s| s as &dyn ScanSource).collect();
    let params = MergeParams { max_hole_length: Some(0.0), voxel: Some(0.025), ..MergeParams::default() };
    let split = |corner: [i64; 3]| {
        canonical(&by_setup(&sources, &params, &Setup { corner, ..Setup::default() }, &Progress::none()).unwrap().mesh)
    };
    let expected = split([0; 3]);
    assert!(expected.len() > 10_000);
    for corner in [[16, 16, 16], [1, 0, 0], [-3, 7, 29], [31, 31, 31]] {
        assert!(split(corner) == expected, "bricks from {corner:?}");
    }
}

#[test]
fn noisy_scans_of_a_sphere_give_a_closed_sphere() {
    let merged = merge_scans(&scans(Shape::Sphere { radius: 1.0 }, 150), &MergeParams::default());
    let report = check(&merged.mesh);
    assert!(report.is_closed() && report.genus() == Some(0), "{report}");
    let errors: Vec<f64> = merged.mesh.positions.iter().map(|p| p.length() - 1.0).collect();
    let rms = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
    // Noise 0.002 and shifts of up to 0.003 per scan; several scans everywhere.
    assert!(rms < 0.003, "{rms}");
    assert_eq!(merged.report.scans, 9);
    assert!(merged.report.overlap_residual.is_some_and(|r| r > 0.0005 && r < 0.01));
}

#[test]
fn colours_and_sources_ride_along() {
    let scans = scans(Shape::Sphere { radius: 1.0 }, 60);
    let mesh = merge_scans(&scans, &MergeParams::default()).mesh;
    let Some(AttributeData::Colour(colour)) = mesh.vertex_attribute("colour") else { panic!() };
    assert!(colour.iter().all(|c| c[1] == 100 && c[2] == 200 && c[3] == 255));
    let Some(AttributeData::I32(source)) = mesh.vertex_attribute("source_scan") else { panic!() };
    assert!(source.iter().all(|&s| (-1..scans.len() as i32).contains(&s)));
    for i in 0..scans.len() as i32 {
        assert!(source.contains(&i), "scan {i} is nowhere the strongest");
    }
}

#[test]
fn a_scan_merged_with_itself_is_itself() {
    let scan = scans(Shape::Torus { major: 1.0, minor: 0.4 }, 70).swap_remove(2);
    let mut twin = scan.clone();
    twin.name = "twin".to_owned();
    let once = merge_scans(std::slice::from_ref(&scan), &plain(0.05));
    let twice = merge_scans(&[scan, twin], &plain(0.05));
    assert_eq!(once.mesh.triangles, twice.mesh.triangles);
    for (a, b) in once.mesh.positions.iter().zip(&twice.mesh.positions) {
        assert!(a.distance(*b) < 1e-7 * 0.05);
    }
}

#[test]
fn a_mirrored_mesh_still_faces_outward() {
    let mesh = Shape::Sphere { radius: 1.0 }.mesh(12);
    let mirrored = DAffine3::from_scale(DVec3::new(-1.0, 2.0, 1.0));
    let placed = PlacedMesh { name: "mirrored".to_owned(), mesh: &mesh, world_from_mesh: mirrored };
    let merged = merge(&[&placed], &plain(0.1), Run::default(), &Progress::none()).unwrap();
    let volume = measure::enclosed_volume(&merged.mesh);
    assert!((volume / (2.0 * measure::enclosed_volume(&mesh)) - 1.0).abs() < 0.02, "{volume}");
}

#[test]
fn georeferenced_scans_keep_their_precision() {
    let near = scans(Shape::Sphere { radius: 1.0 }, 60);
    let offset = DVec3::new(1.0e7, -4.0e6, 2.0e6);
    let far: Vec<_> = near
        .iter()
        .cloned()
        .map(|mut scan| {
            scan.world_from_sensor.translation += offset;
            scan
        })
        .collect();
    // A voxel of a power of two: the grids coincide.
    let (near, far) = (merge_scans(&near, &plain(0.0625)), merge_scans(&far, &plain(0.0625)));
    assert_eq!(near.mesh.triangles.len(), far.mesh.triangles.len());
    for (a, b) in near.mesh.positions.iter().zip(&far.mesh.positions) {
        assert!((*b - offset).distance(*a) < 1e-6);
    }
}

#[test]
fn cancelling_at_every_check_ends_the_merge() {
    let scans = scans(Shape::Sphere { radius: 1.0 }, 40);
    let sources: Vec<&dyn ScanSource> = scans.iter().map(|s| s as &dyn ScanSource).collect();
    let params = MergeParams { threads: 1, ..MergeParams::default() };
    let mut cancelled = 0;
    for checks in 0.. {
        match merge(&sources, &params, Run::default(), &Progress::cancel_after(checks)) {
            Err(Error::Cancelled) => cancelled += 1,
            Err(error) => panic!("{error}"),
            Ok(_) => break,
        }
    }
    assert!(cancelled > 50, "{cancelled}");
}

#[test]
fn holes_are_closed_up_to_the_limit_and_marked() {
    let mut mesh = Shape::Sphere { radius: 1.0 }.mesh(20);
    mesh.triangles.retain(|t| t.iter().map(|&v| mesh.positions[v as usize].z).sum::<f64>() / 3.0 < 0.95);
    let open = merge_mesh(&mesh, &plain(0.05));
    assert_eq!(check(&open.mesh).boundary_loops, 1);
    assert_eq!(open.report.holes, [0, 1]);
    let closed = merge_mesh(&mesh, &MergeParams { max_hole_length: Some(4.0), ..plain(0.05) });
    assert!(check(&closed.mesh).is_closed());
    assert_eq!(closed.report.holes, [1, 0]);
    let Some(AttributeData::Bool(fill)) = closed.mesh.face_attribute("hole_fill") else { panic!() };
    assert_eq!(fill.iter().filter(|&&f| f).count() as u64, closed.report.faces[2]);
    assert_eq!(closed.report.faces.iter().sum::<u64>(), closed.mesh.triangles.len() as u64);
}

#[test]
fn small_parts_are_dropped_below_the_share() {
    let mut mesh = Shape::Sphere { radius: 1.0 }.mesh(20);
    let small = Shape::Sphere { radius: 0.1 }.mesh(8);
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(small.positions.iter().map(|&p| p + DVec3::X * 3.0));
    mesh.triangles.extend(small.triangles.iter().map(|t| t.map(|v| v + first)));
    mesh.vertex_attributes = vec![Attribute::f32("confidence", vec![1.0; mesh.positions.len()])];
    let all = merge_mesh(&mesh, &plain(0.05));
    assert_eq!(check(&all.mesh).components, 2);
    let one = merge_mesh(&mesh, &MergeParams { min_component_share: 0.05, ..plain(0.05) });
    assert_eq!(check(&one.mesh).components, 1);
    assert_eq!(one.report.dropped_components[0], 1);
    assert_eq!(one.mesh.triangles.len() as u64 + one.report.dropped_components[1], all.mesh.triangles.len() as u64);
}

#[test]
fn a_crossing_is_small() {
    // Memory follows the crossings: 28 bytes each.
    assert_eq!(size_of::<Crossing>(), 28);
}

/// A wavy patch seen from above, moved along x.
fn patch(name: &str, moved: f64, height: impl Fn(f64, f64) -> f64) -> RangeImage {
    let (side, step) = (60, 1.0 / 59.0);
    let place = |i: usize| (i % side) as f64 * step;
    let heights = (0..side * side).map(|i| height(place(i), (i / side) as f64 * step)).collect();
    let projection = Projection::Orthographic { first: [0.0, 0.0], step: [step, step] };
    let mut image = RangeImage::from_values(side, side, heights, projection).unwrap();
    image.name = name.to_owned();
    image.world_from_sensor = DAffine3::from_translation(DVec3::X * moved);
    image
}

#[test]
fn rims_of_parts_far_apart_are_no_holes() {
    let bump = |x: f64, y: f64| -2.0 + 0.3 * (-10.0 * ((x - 0.5).powi(2) + (y - 0.5).powi(2))).exp();
    let one = merge_scans(&[patch("a", 0.0, bump)], &MergeParams::default());
    let two = merge_scans(&[patch("a", 0.0, bump), patch("b", 30.0, bump)], &MergeParams::default());
    assert_eq!(one.report.holes, [0, 1]);
    assert_eq!(two.report.holes, [0, 2]);
    assert_eq!(check(&two.mesh).boundary_loops, 2);
    let ratio = two.mesh.triangles.len() as f64 / one.mesh.triangles.len() as f64;
    assert!((1.95..2.05).contains(&ratio), "{ratio}");
}

#[test]
fn what_is_peeled_in_vain_is_put_back() {
    let wavy = |x: f64, y: f64| -2.0 + 0.1 * (6.0 * x).sin() * (6.0 * y).cos();
    let scan = [patch("a", 0.0, wavy)];
    for voxel in [0.15, 0.1, 0.05] {
        let open = merge_scans(&scan, &plain(voxel));
        let tried = merge_scans(&scan, &MergeParams { max_hole_length: Some(10.0), ..plain(voxel) });
        if tried.report.holes[0] == 0 {
            assert_eq!(tried.mesh.triangles, open.mesh.triangles, "{voxel}");
            assert_eq!(tried.mesh.positions, open.mesh.positions);
        }
        assert!(tried.mesh.triangles.len() >= open.mesh.triangles.len());
    }
}

#[test]
fn a_vertex_gone_astray_does_not_decide_the_voxel() {
    let flat = patch("a", 0.0, |x, y| -2.0 + 0.1 * x * y);
    let surface = image::triangulate::triangulate(&flat, &TriangulateParams::default(), &Progress::none()).unwrap();
    let mut mesh = TriMesh::new(surface.positions, surface.triangles);
    let voxel = merge_mesh(&mesh, &MergeParams::default()).report.voxel;
    mesh.positions[0] += DVec3::X * 1e4;
    let astray = merge_mesh(&mesh, &MergeParams::default()).report.voxel;
    assert!((astray / voxel - 1.0).abs() < 0.01, "{voxel} {astray}");
}

#[test]
fn large_triangles_are_cancelled_between_rows() {
    let mesh = TriMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], vec![[0, 1, 2]]);
    let placed = PlacedMesh { name: "mesh".to_owned(), mesh: &mesh, world_from_mesh: DAffine3::IDENTITY };
    // A thousand rows: more checks than an uncancelled run of a small mesh makes.
    for checks in [0, 100, 900] {
        let outcome = merge(&[&placed], &plain(1e-3), Run::default(), &Progress::cancel_after(checks));
        assert!(matches!(outcome, Err(Error::Cancelled)), "{checks}");
    }
}

/// A vertex may lie on any side of its plane, by however little: no vertex of the result is a quotient of nothing.
#[test]
fn a_floor_in_a_plane_of_the_grid_has_places() {
    let mut state = 1_u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    for _ in 0..20 {
        let positions: Vec<DVec3> = (0..2000)
            .map(|i| {
                let (x, y) = (0.025 * f64::from(i % 50 - 25), 0.025 * f64::from(i / 50 - 20));
                let height = 10_f64.powf(-8.5 + 2.5 * random()) * if random() < 0.5 { -1.0 } else { 1.0 };
                DVec3::new(x + 0.01 * (random() - 0.5), y + 0.01 * (random() - 0.5), height)
            })
            .collect();
        let corner = |i: u32| [[i, i + 1, i + 50], [i + 1, i + 51, i + 50]];
        let triangles = (0..39_u32).flat_map(|row| (0..49).flat_map(move |col| corner(50 * row + col))).collect();
        let mesh = TriMesh::new(positions, triangles);
        let params = MergeParams { min_component_share: 0.0, ..MergeParams::default() };
        let merged = merge_mesh(&mesh, &params);
        assert!(merged.mesh.positions.iter().all(|p| p.is_finite()));
    }
}
