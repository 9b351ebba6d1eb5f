//! The same mesh for any number of threads, order of tolerances and unit.

use super::*;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(base::tier::cases(160)))]

    #[test]
    fn threads_and_order_of_tolerances_change_nothing(
        scene in scenes(), kind in 0..32_usize, tolerance in tolerances(), effort in 0..3_u32,
        [interpolate, simplify_borders] in any::<[bool; 2]>(), before in prop::collection::vec(tolerances(), 1..4),
    ) {
        let image = seen(&scene, kind);
        let params = SculptParams { effort, interpolate, simplify_borders, ..absolute(tolerance) };
        prop_assume!(has_triangles(&image, &params));
        let results: Vec<Sculpted> = [1, 2, 8]
            .map(|threads| {
                let sculptor = Sculptor::new(&image, &SculptParams { threads, ..params }).unwrap();
                if threads == 2 {
                    for &tolerance in &before {
                        sculptor.refine(Tolerance::Absolute(tolerance), &Progress::none()).unwrap();
                    }
                }
                sculptor.refine(Tolerance::Absolute(tolerance), &Progress::none()).unwrap()
            })
            .into();
        for other in &results[1..] {
            prop_assert_eq!(&other.mesh, &results[0].mesh);
            // NaN marks what is not covered.
            let bits = |s: &Sculpted| s.certificate.error_image.iter().map(|e| e.to_bits()).collect::<Vec<_>>();
            prop_assert_eq!(bits(other), bits(&results[0]));
        }
    }

    #[test]
    fn a_unit_that_is_a_power_of_two_times_another_gives_the_same_bytes(
        scene in scenes(), kind in 0..32_usize, tolerance in tolerances(), effort in 0..3_u32,
        [joined, interpolate, simplify_borders] in any::<[bool; 3]>(), power in prop_oneof![Just(-20), Just(10), -3..4],
    ) {
        let unit = f64::from(power).exp2();
        let inputs = [1.0, unit].map(|unit| {
            let edge_limit = joined.then_some(1e6 * unit);
            let triangulation = TriangulateParams { edge_limit, ..TriangulateParams::default() };
            let params = SculptParams { effort, interpolate, simplify_borders, triangulation, ..absolute(tolerance * unit) };
            (in_unit(&seen(&scene, kind), unit), params)
        });
        prop_assume!(has_triangles(&inputs[0].0, &inputs[0].1));
        let [one, other] = inputs.map(|(image, params)| sculpt(&image, &params));
        prop_assert_eq!(&other.mesh.triangles, &one.mesh.triangles);
        let scaled: Vec<DVec3> = one.mesh.positions.iter().map(|&p| p * unit).collect();
        prop_assert_eq!(&other.mesh.positions, &scaled);
        prop_assert_eq!(other.certificate.max_error, one.certificate.max_error * unit);
        prop_assert_eq!(other.certificate.rms_error, one.certificate.rms_error * unit);
        prop_assert_eq!(other.certificate.worst_pixel, one.certificate.worst_pixel);
    }
}

#[test]
fn a_change_of_unit_keeps_bound_and_count() {
    let scene = Scene { rows: 44, cols: 44, seed: 5, holes: 0.05, roughness: 0.02, step: 0.5, quantum: 0.0 };
    for kind in 0..32 {
        for (effort, interpolate) in [(1, true), (2, true), (2, false)] {
            // Metres and millimetres.
            let [metres, millimetres] = [1.0, 1000.0].map(|unit| {
                let image = in_unit(&seen(&scene, kind), unit);
                let params = SculptParams { effort, interpolate, ..SculptParams::default() };
                sculpt(&image, &SculptParams { tolerance: Tolerance::OfDepthExtent(0.02), ..params })
            });
            let counts = [&metres, &millimetres].map(|s| s.report.triangles as f64);
            assert!((counts[0] / counts[1] - 1.0).abs() <= 0.01, "{kind}: {counts:?}");
            assert!((1000.0 * metres.report.tolerance / millimetres.report.tolerance - 1.0).abs() < 1e-6);
        }
    }
}

/// The same image with all lengths times `unit`.
fn in_unit(image: &RangeImage, unit: f64) -> RangeImage {
    let (rows, cols) = (image.rows(), image.cols());
    match image.samples() {
        Samples::Points(points) => {
            let points = points.iter().map(|p| p.map(|x| (f64::from(x) * unit) as f32)).collect();
            let viewing = match image.projection() {
                Projection::PointGrid(image::range_image::Viewing::From(eye)) => {
                    image::range_image::Viewing::From(*eye * unit)
                }
                Projection::PointGrid(viewing) => *viewing,
                other => panic!("{other:?}"),
            };
            RangeImage::from_points(rows, cols, points, viewing).unwrap()
        }
        Samples::Values(values) => {
            let projection = match *image.projection() {
                Projection::Orthographic { first, step } => {
                    Projection::Orthographic { first: first.map(|x| x * unit), step: step.map(|x| x * unit) }
                }
                other => other,
            };
            RangeImage::from_values(rows, cols, values.iter().map(|x| x * unit).collect(), projection).unwrap()
        }
    }
}
