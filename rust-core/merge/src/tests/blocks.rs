//! The same bytes however space is cut into blocks.

use super::*;

fn merged(scans: &[RangeImage], params: &MergeParams, block: Option<i32>) -> Merged {
    let sources: Vec<&dyn ScanSource> = scans.iter().map(|s| s as &dyn ScanSource).collect();
    let setup = Setup { block, ..Setup::default() };
    let mut merged = by_setup(&sources, params, &setup, &Progress::none()).unwrap();
    // The memory held and the time may differ.
    (merged.report.seconds, merged.report.working_bytes) = Default::default();
    merged
}

fn same_in_blocks(scans: &[RangeImage], params: &MergeParams) -> Merged {
    let whole = merged(scans, params, None);
    for side in [1, 3] {
        assert!(merged(scans, params, Some(side)) == whole, "blocks of {side}");
    }
    whole
}

#[test]
fn clean_and_noisy_scans_are_the_same_in_blocks() {
    let shape = Shape::Torus { major: 1.0, minor: 0.3 };
    for scans in [scans(shape, 100), clean_scans(shape, 100)] {
        let found = same_in_blocks(&scans, &MergeParams { voxel: Some(0.02), ..MergeParams::default() });
        assert!(found.mesh.triangles.len() > 10_000);
    }
}

#[test]
fn parts_that_go_are_the_same_in_blocks() {
    // Scans that lie apart leave blobs between them, and a share drops what is small beside a part elsewhere.
    let apart = ScanParams { noise: 0.02, pose_shift: 0.03, ..ScanParams::default() };
    let scans = scans_with(Shape::Sphere { radius: 1.0 }, 50, &apart);
    for share in [0.0, 0.01] {
        let params = MergeParams {
            voxel: Some(0.015),
            merge_distance: Some(0.015),
            min_component_share: share,
            ..MergeParams::default()
        };
        let found = same_in_blocks(&scans, &params);
        assert!(found.report.dropped_components[0] > 10, "{:?}", found.report.dropped_components);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(base::tier::cases(24)))]
    // Whole numbers put vertices into nodes, and many triangles through an edge make pinches.
    #[test]
    fn soups_of_triangles_are_the_same_in_blocks(
        corners in prop::collection::vec(prop::array::uniform3(-50..50_i32), 60..120),
        halves in any::<bool>(),
    ) {
        let unit = if halves { 0.5 } else { 0.37 };
        let positions: Vec<DVec3> = corners.iter().map(|c| DVec3::from_array(c.map(|x| f64::from(x) * unit))).collect();
        let triangles = (0..positions.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let mesh = TriMesh::new(positions, triangles);
        let placed = PlacedMesh { name: "soup".to_owned(), mesh: &mesh, world_from_mesh: DAffine3::IDENTITY };
        let params = MergeParams { voxel: Some(1.0), ..MergeParams::default() };
        let by = |block| {
            let setup = Setup { block, ..Setup::default() };
            by_setup(&[&placed], &params, &setup, &Progress::none()).map(|merged| merged.mesh).map_err(|e| e.to_string())
        };
        let whole = by(None);
        for side in [1, 2, 3] {
            prop_assert!(by(Some(side)) == whole, "blocks of {side}");
        }
    }
}
