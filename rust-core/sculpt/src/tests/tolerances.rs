//! None, huge, and as many triangles as are asked for.

use super::*;

#[test]
fn no_tolerance_at_all_keeps_every_sample() {
    let image = flat(40, 30, |r, c| noise(5, (r * 100.0 + c) as u64));
    let sculpted = sculpt(&image, &absolute(0.0));
    assert_eq!(sculpted.certificate.max_error, 0.0);
    assert_eq!(sculpted.mesh.positions.len(), 40 * 30);
}

#[test]
fn a_huge_tolerance_leaves_the_fewest_triangles_that_cover_the_mask() {
    // A rectangle; one with a hole whose corners half cells cut off: 12 vertices, a ring of 12 triangles.
    let joined = TriangulateParams { edge_limit: Some(1e6), ..TriangulateParams::default() };
    let params = SculptParams { triangulation: joined, ..absolute(1e9) };
    let rough = |r: f64, c: f64| noise(1, (r * 100.0 + c) as u64);
    assert_eq!(sculpt(&flat(50, 70, rough), &params).mesh.triangles.len(), 2);
    let holed =
        flat(
            50,
            70,
            |r, c| if (20.0..30.0).contains(&r) && (25.0..40.0).contains(&c) { f64::NAN } else { rough(r, c) },
        );
    assert_eq!(sculpt(&holed, &params).mesh.triangles.len(), 12);
}

#[test]
fn at_most_n_triangles_are_as_many_as_that_allows() {
    let scene = Scene { rows: 44, cols: 44, seed: 8, holes: 0.0, roughness: 0.01, step: 0.0, quantum: 0.0 };
    let image = seen(&scene, 0);
    let triangulation = TriangulateParams { edge_limit: Some(1e6), ..TriangulateParams::default() };
    let params = SculptParams { triangulation, ..absolute(0.0) };
    let sculptor = Sculptor::new(&image, &params).unwrap();
    for most in [60, 200, 900, 1_000_000] {
        let sculpted = sculptor.at_most(most, &Progress::none()).unwrap();
        assert_sound(&image, &params, &sculpted);
        let count = sculpted.mesh.triangles.len();
        assert!(count <= most && (count as f64 >= 0.8 * most as f64 || most > 5000), "{count} of {most}");
        let again = sculptor.refine(Tolerance::Absolute(sculpted.report.tolerance), &Progress::none()).unwrap();
        assert_eq!(again.mesh, sculpted.mesh);
    }
    let text = sculptor.at_most(1, &Progress::none()).unwrap_err().to_string();
    assert!(text.contains("at most 1 triangles are asked for, but no fewer than 2 cover it"), "{text}");
    let levels = sculptor.levels(&[0.001, 0.01, 0.1].map(Tolerance::Absolute), &Progress::none()).unwrap();
    assert!(levels.windows(2).all(|l| l[1].mesh.triangles.len() < l[0].mesh.triangles.len()));
}
