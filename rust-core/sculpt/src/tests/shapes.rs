//! Shapes whose meshes are known.

use super::*;

#[test]
fn a_plane_needs_two_triangles_in_every_projection() {
    for projection in projections(40, 50) {
        let centre = ahead(&projection);
        let image = render(40, 50, projection, plane(centre, centre.normalize()));
        let triangulation = TriangulateParams { edge_limit: Some(1.0), ..TriangulateParams::default() };
        let params = SculptParams { triangulation, ..absolute(1e-9) };
        let sculpted = sculpt(&image, &params);
        let on_lattice = !matches!(projection, Projection::Spherical { .. });
        if on_lattice {
            assert_eq!(sculpted.mesh.triangles.len(), 2, "{projection:?}");
        }
        assert!(sculpted.certificate.max_error < 1e-9);
    }
}

#[test]
fn a_sphere_stays_within_the_bound_in_every_projection() {
    for projection in projections(60, 60) {
        let image = render(60, 60, projection, sphere(ahead(&projection), 0.25));
        for image in [as_point_grid(&image), image] {
            let sculptor = Sculptor::new(&image, &absolute(0.0)).unwrap();
            let mut last = usize::MAX;
            for tolerance in [0.0, 1e-4, 1e-3, 1e-2] {
                let params = absolute(tolerance);
                let sculpted = sculptor.refine(params.tolerance, &Progress::none()).unwrap();
                assert_sound(&image, &params, &sculpted);
                assert!(sculpted.mesh.triangles.len() <= last);
                last = sculpted.mesh.triangles.len();
            }
            assert!(
                last < sculptor.refine(Tolerance::Absolute(0.0), &Progress::none()).unwrap().mesh.triangles.len() / 4
            );
        }
    }
}
