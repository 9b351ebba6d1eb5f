//! Lines that lie nearly in what they meet.

use super::*;

#[test]
fn lines_that_graze_a_triangle_have_a_vote_without_weight() {
    // Found by chance: a line lies so nearly in a triangle that the weight of what it meets is none.
    let few = TriMesh::new(
        [[65.0, 65.0, 0.5], [67.5, 68.0, 1.484375], [69.0, 69.0, -0.453125], [66.0, 67.0, 0.5]]
            .map(DVec3::from)
            .to_vec(),
        vec![[0, 2, 1], [1, 2, 3]],
    );
    let places = [
        [65.0, 65.0, 0.5],
        [66.0, 65.0, 0.5],
        [67.5, 68.0, 1.484375],
        [69.0, 69.0, -0.453125],
        [66.0, 67.0, 0.5],
        [67.0, 67.0, 0.5],
        [68.0, 67.0, 0.5],
        [67.0, 68.0, 0.5],
        [69.0, 69.0, -2.234375],
    ];
    let more = TriMesh::new(
        places.map(DVec3::from).to_vec(),
        vec![[0, 1, 3], [0, 3, 2], [2, 3, 4], [3, 5, 4], [5, 6, 8], [5, 8, 7]],
    );
    for mesh in [few, more] {
        for max_hole_length in [0.0, 90.0] {
            let params = MergeParams { max_hole_length: Some(max_hole_length), ..plain(0.6) };
            let merged = merge_mesh(&mesh, &params).mesh;
            assert!(merged.positions.iter().all(|place| place.is_finite()));
            assert!(check(&merged).is_manifold());
        }
    }
}
