//! Promises of the options.

use super::*;

#[test]
fn vertices_off_their_samples_leave_fewer_triangles() {
    let scene = Scene { rows: 44, cols: 44, seed: 8, holes: 0.0, roughness: 0.05, step: 0.0, quantum: 0.0 };
    for kind in [0, 4, 8, 12, 16, 24] {
        let image = seen(&scene, kind);
        let triangulation = TriangulateParams { edge_limit: Some(1e6), ..TriangulateParams::default() };
        let count = |interpolate| {
            let params = SculptParams { interpolate, triangulation, effort: 2, ..absolute(0.03) };
            sculpt(&image, &params).mesh.triangles.len() as f64
        };
        let (samples, free) = (count(true), count(false));
        assert!(free < 0.95 * samples, "{kind}: {free} of {samples}");
    }
}

#[test]
fn new_triangles_keep_to_the_smallest_angle() {
    let hills = |r: f64, c: f64| (0.3 * r).sin() * (0.2 * c).cos();
    let image = flat(40, 60, hills);
    let triangulation = TriangulateParams { edge_limit: Some(1e6), ..TriangulateParams::default() };
    let dug = sculpt(&image, &SculptParams { effort: 0, triangulation, ..absolute(0.02) });
    let corners = |mesh: &TriMesh, t: usize| mesh.corners(t).map(|p| [p.x, p.y].map(f64::to_bits));
    let old: std::collections::HashSet<_> = (0..dug.mesh.triangles.len()).map(|t| corners(&dug.mesh, t)).collect();
    let mut last = 0;
    for (min_angle, interpolate) in [(0.0_f64, true), (0.2, true), (0.5, true), (0.2, false)] {
        let params = SculptParams { effort: 2, min_angle, interpolate, triangulation, ..absolute(0.02) };
        let mesh = sculpt(&image, &params).mesh;
        for t in 0..mesh.triangles.len() {
            let [a, b, c] = mesh.corners(t).map(|p| p.with_z(0.0));
            let smallest =
                (b - a).angle_between(c - a).min((c - b).angle_between(a - b)).min((a - c).angle_between(b - c));
            let turned = |by: usize| {
                let mut same = corners(&mesh, t);
                same.rotate_left(by);
                same
            };
            assert!(smallest > min_angle - 1e-9 || (0..3).any(|by| old.contains(&turned(by))), "{smallest}");
        }
        // The floor costs triangles.
        assert!(!interpolate || mesh.triangles.len() > last);
        last = mesh.triangles.len();
    }
}

#[test]
fn simplified_borders_cut_the_steps_of_slanted_ones() {
    // A plane below a line of slope 1/2, one of slope 2/3, and one of 1/4, whose steps are too long to reach over.
    for (rise, run, corners) in [(1.0, 2.0, 4), (2.0, 3.0, 4), (1.0, 4.0, 21)] {
        let image = flat(40, 37, |r, c| if r >= c * rise / run { 1.0 } else { f64::NAN });
        let count = |simplify_borders| {
            let params = SculptParams { simplify_borders, ..absolute(0.1) };
            sculpt(&image, &params).mesh.triangles.len()
        };
        let (kept, simplified) = (count(false), count(true));
        assert!(kept >= 19 && simplified + 2 == corners, "{rise}/{run}: {kept} to {simplified}");
    }
    // A disk in every projection, as pixels and as points: of all slopes only some gain.
    let mut sums = [0.0; 2];
    for projection in projections(60, 60) {
        let image = render(60, 60, projection, sphere(ahead(&projection), 0.25));
        for image in [as_point_grid(&image), image] {
            let count = |simplify_borders| {
                let params = SculptParams { simplify_borders, ..absolute(0.02) };
                sculpt(&image, &params).mesh.triangles.len() as f64
            };
            sums = [sums[0] + count(false), sums[1] + count(true)];
        }
    }
    assert!(sums[1] < 0.97 * sums[0], "{sums:?}");
}
