//! Parameters out of range, extreme samples, cancelling.

use super::*;

#[test]
fn parameters_out_of_range_are_refused_by_name() {
    let image = flat(4, 4, |r, _| r);
    let text = |params: SculptParams| run(&image, &params, &Progress::none()).unwrap_err().to_string();
    assert_eq!(text(absolute(-1.0)), "tolerance must be a finite number >= 0, got -1 (in the unit of the scans)");
    assert!(text(absolute(f64::NAN)).contains("tolerance"));
    assert!(
        text(SculptParams { tolerance: Tolerance::OfDepthExtent(-0.1), ..SculptParams::default() })
            .contains("relative_tolerance")
    );
    assert!(
        text(SculptParams { effort: 9, ..SculptParams::default() }).contains("effort must be >= 0 and <= 2, got 9")
    );
}

#[test]
fn nothing_is_sculpted_in_degrees() {
    let mut image = flat(4, 4, |r, _| r);
    image.crs = Some(mesh::Crs::new("EPSG:4326").unwrap());
    let error = run(&image, &SculptParams::default(), &Progress::none()).unwrap_err().to_string();
    assert!(error.starts_with("its coordinates are degrees (EPSG:4326), in which nothing can be measured"), "{error}");
}

#[test]
fn negative_huge_and_tiny_ranges_do_no_harm() {
    for projection in projections(12, 12) {
        for factor in [-1.0, 1e-300, 1e300, 1e150] {
            let values = (0..144).map(|i| factor * (1.0 + noise(3, i))).collect();
            let image = RangeImage::from_values(12, 12, values, projection).unwrap();
            match run(&image, &SculptParams::default(), &Progress::none()) {
                Ok(sculpted) => assert!(!sculpted.certificate.max_error.is_nan()),
                // Nothing lies behind a sensor.
                Err(error) if factor < 0.0 => assert!(error.to_string().contains("of which 0 are valid"), "{error}"),
                Err(error) => {
                    let text = error.to_string();
                    assert!(
                        text.to_lowercase().contains("use a larger unit") || text.contains("use a smaller unit"),
                        "{text}"
                    );
                }
            }
        }
    }
}

#[test]
fn cancelling_at_any_moment_ends_the_call() {
    // On the lattice there is digging; elsewhere a mesh of all samples is peeled.
    let scene = Scene { rows: 60, cols: 60, seed: 9, holes: 0.0, roughness: 0.3, step: 0.0, quantum: 0.0 };
    for (kind, effort) in [(0, 0), (0, 2), (4, 1), (8, 2), (20, 1)] {
        let image = seen(&scene, kind);
        let params = SculptParams { effort, threads: 1, ..absolute(0.1) };
        // The stage that hears a cancel at that check, if there are so many checks.
        let hears = |checks: u64| {
            let progress = Progress::cancel_after(checks);
            match run(&image, &params, &progress) {
                Err(base::Error::Cancelled) => Some(progress.tick().stage),
                Ok(_) => None,
                Err(error) => panic!("{error}"),
            }
        };
        let (mut last, mut step) = (0, 1 << 12);
        while step > 0 {
            if hears(last + step).is_some() {
                last += step;
            }
            step /= 2;
        }
        let heard_in: Vec<_> = (0..32).map(|i| hears(last * i / 31).unwrap()).collect();
        let mut stages = vec!["triangulating", "removing vertices", "measuring the error"];
        if kind < 8 {
            stages.push("digging");
        }
        for stage in stages {
            let nothing_to_do = effort == 0 && stage == "removing vertices";
            assert!(nothing_to_do || heard_in.contains(&stage), "{kind}: {stage} does not hear: {heard_in:?}");
        }
    }
    // Also before the first mesh; a large image is looked at in steps.
    let image = flat(600, 600, |r, c| r + c);
    for checks in 0..6 {
        let cancelled = Sculptor::prepare(&image, &absolute(0.1), &Progress::cancel_after(checks));
        assert!(matches!(cancelled, Err(base::Error::Cancelled)), "{checks}");
    }
}

#[test]
fn a_sculptor_is_as_good_after_a_cancelled_call() {
    let image = seen(&Scene { rows: 44, cols: 44, seed: 3, holes: 0.05, roughness: 0.1, step: 0.5, quantum: 0.0 }, 0);
    let params = absolute(0.0);
    let fresh = |tolerance| Sculptor::new(&image, &params).unwrap().refine(tolerance, &Progress::none()).unwrap();
    let sculptor = Sculptor::new(&image, &params).unwrap();
    for (i, tolerance) in [0.3, 0.001, 0.1, 0.02].map(Tolerance::Absolute).into_iter().enumerate() {
        for checks in 0..20 {
            let cancelled = sculptor.refine(tolerance, &Progress::cancel_after(checks * (i as u64 + 1)));
            assert!(cancelled.is_ok() || matches!(cancelled, Err(base::Error::Cancelled)));
        }
        assert_eq!(sculptor.refine(tolerance, &Progress::none()).unwrap().mesh, fresh(tolerance).mesh);
    }
}
