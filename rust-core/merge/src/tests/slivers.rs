//! No side of a triangle is shorter than a hundredth of a cell.

use super::*;

/// The shortest side of a merge's triangles, in cells. Its report says the same.
fn shortest(merged: &Merged) -> f64 {
    let place = |v: u32| merged.mesh.positions[v as usize];
    let sides = merged.mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let shortest = sides.map(|[a, b]| place(a).distance_squared(place(b))).fold(f64::INFINITY, f64::min).sqrt();
    assert_eq!(merged.report.shortest_edge, shortest);
    shortest / merged.report.voxel
}

#[test]
fn scans_leave_no_slivers() {
    for scans in [scans(Shape::Torus { major: 1.0, minor: 0.3 }, 100), clean_scans(Shape::Sphere { radius: 1.0 }, 60)] {
        for params in [plain(0.02), MergeParams { max_hole_length: Some(10.0), ..plain(0.03) }] {
            let shortest = shortest(&merge_scans(&scans, &params));
            assert!(shortest >= 0.01, "{shortest}");
        }
    }
}

#[test]
fn vertices_near_a_node_are_moved_apart_and_no_others() {
    // Its distance from the nodes: in them, a little beside them, and further than vertices are moved.
    for (off, moves) in [(0.0, true), (0.003, true), (0.03, false)] {
        let (u, v) = (DVec3::new(9.0, -9.0, off), DVec3::new(-9.0, -9.0, 18.0 + off));
        let plane = TriMesh::new(vec![u, v, DVec3::new(0.0, 18.0, off - 18.0)], vec![[0, 2, 1]]);
        let merged = merge_mesh(&plane, &plain(1.0));
        let shortest = shortest(&merged);
        assert!(shortest >= 0.01, "{off}: {shortest}");
        let off_plane = |p: &DVec3| (p.dot(DVec3::ONE) - off).abs();
        let farthest = merged.mesh.positions.iter().map(off_plane).fold(0.0, f64::max);
        assert!(if moves { farthest > 0.005 } else { farthest < 1e-6 }, "{off}: {farthest}");
        assert!(farthest < 0.011, "{off}: {farthest}");
    }
}

#[test]
fn a_level_plane_in_nodes_stays_there() {
    let corners = [[-9.0, -9.0, 3.0], [9.0, -9.0, 3.0], [0.0, 9.0, 3.0]];
    let plane = TriMesh::new(corners.map(DVec3::from_array).to_vec(), vec![[0, 1, 2]]);
    let merged = merge_mesh(&plane, &plain(1.0));
    assert!(merged.mesh.positions.len() > 100 && merged.mesh.positions.iter().all(|p| p.z == 3.0));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(base::tier::cases(60)))]
    // Whole numbers put vertices into nodes. Many triangles through an edge make pinches, and between their fans holes are closed.
    #[test]
    fn soups_of_triangles_leave_no_slivers(
        corners in prop::collection::vec(prop::array::uniform3(-12..12_i32), 15..80),
        unit in prop::sample::select(vec![0.5, 0.37, 0.501]),
        hole in prop::sample::select(vec![0.0, 20.0]),
    ) {
        let positions: Vec<DVec3> = corners.iter().map(|c| DVec3::from_array(c.map(|x| f64::from(x) * unit))).collect();
        let triangles = (0..positions.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let mesh = TriMesh::new(positions, triangles);
        let placed = PlacedMesh { name: "soup".to_owned(), mesh: &mesh, world_from_mesh: DAffine3::IDENTITY };
        let params = MergeParams { max_hole_length: Some(hole), ..plain(1.0) };
        let Ok(merged) = merge(&[&placed], &params, Run::default(), &Progress::none()) else { return Ok(()) };
        let shortest = shortest(&merged);
        prop_assert!(shortest >= 0.01, "{shortest}");
    }
}
