//! A surface on a corner of blocks, whatever their size: the node of which all coordinates are 0.

use super::*;

/// The same for blocks of one to five bricks as in memory.
fn whole_and_in_blocks(meshes: &[TriMesh], params: &MergeParams) -> Merged {
    let place = |(k, mesh)| PlacedMesh { name: format!("{k}"), mesh, world_from_mesh: DAffine3::IDENTITY };
    let placed: Vec<PlacedMesh<&TriMesh>> = (0..).zip(meshes).map(place).collect();
    let sources: Vec<&dyn ScanSource> = placed.iter().map(|scan| scan as &dyn ScanSource).collect();
    let whole = in_memory(&sources, params, u64::MAX);
    for side in 1..=5 {
        assert!(in_files(&sources, params, side, 0, u64::MAX) == whole, "blocks of {side}");
    }
    whole
}

/// A shape in cells, moved.
fn at(shape: Shape, detail: usize, place: DVec3) -> TriMesh {
    let mut mesh = shape.mesh(detail);
    mesh.positions.iter_mut().for_each(|p| *p += place);
    mesh
}

fn params() -> MergeParams {
    MergeParams { voxel: Some(1.0), merge_distance: Some(1.0), ..MergeParams::default() }
}

#[test]
fn a_hole() {
    // A sheet with a square hole around the corner.
    let count = 41;
    let point = |k: usize| {
        let [x, y] = [k % count, k / count].map(|i| 4.0 * i as f64 - 80.3);
        DVec3::new(x, y, 0.3 + 0.01 * x)
    };
    let square = |k: usize| [k, k + 1, k + 1 + count, k + count].map(|v| v as u32);
    let is_there = |k: &usize| {
        let [x, y] = [k % count, k / count];
        x + 1 < count && y + 1 < count && !((19..21).contains(&x) && (19..21).contains(&y))
    };
    let squares = (0..count * count).filter(is_there).map(square);
    let triangles = squares.flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    let sheet = TriMesh::new((0..count * count).map(point).collect(), triangles);
    let found =
        whole_and_in_blocks(std::slice::from_ref(&sheet), &MergeParams { max_hole_length: Some(60.0), ..params() });
    assert_eq!(found.report.holes[0], 1, "{:?}", found.report);
    let open = whole_and_in_blocks(&[sheet], &MergeParams { max_hole_length: Some(0.0), ..params() });
    assert!(open.mesh.triangles.len() < found.mesh.triangles.len());
}

#[test]
fn a_part_that_goes_because_of_a_larger_one_elsewhere() {
    let small = at(Shape::Sphere { radius: 3.0 }, 12, DVec3::ZERO);
    let large = at(Shape::Sphere { radius: 40.0 }, 40, DVec3::new(200.3, 0.2, 0.1));
    let with = |share: f64, meshes: &[TriMesh]| {
        let found = whole_and_in_blocks(meshes, &MergeParams { min_component_share: share, ..params() });
        found.report.dropped_components[0]
    };
    let both = [small, large];
    assert_eq!([with(0.0, &both), with(0.05, &both), with(0.05, &both[..1])], [0, 1, 0]);
}

#[test]
fn parts_that_meet_in_an_edge_or_a_corner() {
    // Boxes whose faces lie between nodes and whose sheets meet around the corner.
    for places in [[DVec3::splat(-2.0), DVec3::splat(2.0)], [DVec3::new(-2.0, -2.0, 0.2), DVec3::new(2.0, 2.0, 0.2)]] {
        for gap in [-0.2, 0.0, 0.2] {
            let half = DVec3::splat(2.0 - gap);
            let meshes = places.map(|place| at(Shape::Cuboid { half }, 1, place));
            let found = whole_and_in_blocks(&meshes, &params());
            let edges = mesh::check(&found.mesh);
            assert!(edges.is_manifold(), "{places:?} {gap}");
        }
    }
}
