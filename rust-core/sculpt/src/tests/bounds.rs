//! Nothing that is returned or written lies farther from a sample than was asked for: by exact arithmetic, not by a slack.

use num_bigint::BigInt;

use super::*;
use io::export::{PlyEncoding, write_ply};
use io::import::{self, Content};

/// Hills with noise, in whole metres as terrain comes.
fn relief(rows: usize, cols: usize) -> RangeImage {
    flat(rows, cols, |r, c| {
        let hills = 40.0 * (r * 0.05).sin() * (c * 0.07).cos() + 15.0 * (r * 0.21 + c * 0.13).sin();
        (400.0 + hills + 6.0 * (noise(3, (r * 4096.0 + c) as u64) - 0.5)).round()
    })
}

/// A number in units of 2^-80. It has no finer digits.
fn exact(x: f64) -> BigInt {
    if x == 0.0 {
        return BigInt::ZERO;
    }
    let exponent = ((x.to_bits() >> 52 & 0x7ff) as i32 - 1023 - 52).max(-200);
    let mantissa = BigInt::from((x / f64::from(exponent).exp2()) as i64);
    let shift = 80 + exponent;
    assert!(shift >= 0 || x == 0.0, "{x} has digits below 2^-80");
    mantissa << shift
}

/// Whether no height lies farther from the mesh than `tolerance`: triangles as the whole numbers of their pixels, heights as they
/// are, no rounding anywhere.
fn assert_within(image: &RangeImage, positions: &[DVec3], triangles: &[[u32; 3]], tolerance: f64) {
    let Samples::Values(values) = image.samples() else { panic!("heights") };
    let cols = image.cols() as i64;
    let place = |p: DVec3| [p.x as i64, -p.y as i64];
    let mut seen = vec![false; values.len()];
    for corners in triangles {
        let corners = corners.map(|v| positions[v as usize]);
        assert!(corners.iter().all(|p| place(*p).map(|x| x as f64) == [p.x, -p.y]), "on the lattice: {corners:?}");
        let [a, b, c] = corners.map(place);
        let twice = |[a, b, c]: [[i64; 2]; 3]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        let whole = twice([a, b, c]);
        let range = |axis: usize| {
            let places = [a[axis], b[axis], c[axis]];
            *places.iter().min().unwrap()..=*places.iter().max().unwrap()
        };
        for y in range(1) {
            for x in range(0) {
                let p = [x, y];
                let weights = [[p, b, c], [a, p, c], [a, b, p]].map(|t| twice(t) * whole.signum());
                let pixel = (y * cols + x) as usize;
                if weights.iter().any(|&w| w < 0) || values[pixel].is_nan() {
                    continue;
                }
                seen[pixel] = true;
                let sum: BigInt = (0..3).map(|i| (exact(corners[i].z) - exact(values[pixel])) * weights[i]).sum();
                let sum = if sum < BigInt::ZERO { -sum } else { sum };
                assert!(sum <= exact(tolerance) * whole.abs(), "pixel {y}, {x} is off by more than {tolerance}");
            }
        }
    }
    assert_eq!(seen.iter().filter(|&&s| s).count(), image.valid_count(), "every sample is covered");
}

#[test]
fn heights_in_whole_metres_keep_the_tolerance_exactly() {
    let image = relief(300, 300);
    for tolerance in [0.0, 0.5, 1.0, 2.5, 4.0 / 3.0] {
        for (effort, interpolate) in [(0, true), (1, true), (1, false), (2, true), (2, false)] {
            if effort == 2 && tolerance != 2.5 {
                continue;
            }
            let triangulation = TriangulateParams { edge_limit: Some(1e6), ..TriangulateParams::default() };
            let params = SculptParams { effort, interpolate, triangulation, ..absolute(tolerance) };
            let sculpted = run(&image, &params, &Progress::none()).unwrap();
            assert_sound(&image, &params, &sculpted);
            assert_within(&image, &sculpted.mesh.positions, &sculpted.mesh.triangles, tolerance);
        }
    }
}

#[test]
fn no_tolerance_keeps_every_sample_in_every_projection() {
    for scene in [
        Scene { rows: 24, cols: 31, seed: 3, holes: 0.05, roughness: 0.3, step: 0.5, quantum: 0.0 },
        Scene { rows: 24, cols: 31, seed: 4, holes: 0.0, roughness: 0.0, step: 0.0, quantum: 0.0625 },
    ] {
        for kind in 0..32 {
            let image = seen(&scene, kind);
            for (effort, interpolate) in [(0, true), (1, true), (2, true), (1, false)] {
                let sculpted = sculpt(&image, &SculptParams { effort, interpolate, ..absolute(0.0) });
                assert_eq!(sculpted.certificate.max_error, 0.0, "{kind}");
            }
        }
    }
}

#[test]
fn what_digging_left_beyond_the_bound_is_mended() {
    let scene = Scene { rows: 40, cols: 44, seed: 9, holes: 0.02, roughness: 0.05, step: 0.5, quantum: 0.0 };
    for kind in 0..32 {
        let image = seen(&scene, kind);
        for interpolate in [true, false] {
            for tolerance in [0.02, 1e-3, 0.0] {
                let params = SculptParams { interpolate, ..absolute(tolerance) };
                let sculptor = Sculptor::new(&image, &params).unwrap();
                let mut dug = sculptor.dig(0.2, &|| (), &Progress::none()).unwrap();
                dug.bound = mend::Bound::new(tolerance, 4.0);
                let sculpted = sculptor.finish(dug, &Progress::none()).unwrap();
                assert_sound(&image, &params, &sculpted);
                assert!(
                    sculpted.report.triangles
                        > sculptor.refine(Tolerance::Absolute(0.2), &Progress::none()).unwrap().report.triangles
                );
            }
        }
    }
}

#[test]
fn a_written_mesh_keeps_the_tolerance() {
    let folder = tempfile::tempdir().unwrap();
    let mut doubles = 0;
    for (k, quantum) in [0.0, 1.0, 0.125].into_iter().enumerate() {
        let image = flat(60, 60, |r, c| {
            let z = 1000.1 + 3.0 * (r * 0.3).sin() * (c * 0.2).cos() + noise(k as u64, (r * 100.0 + c) as u64);
            if quantum > 0.0 { (z / quantum).round() * quantum } else { z }
        });
        for interpolate in [true, false] {
            let tolerance = 0.7;
            let params = SculptParams { interpolate, ..absolute(tolerance) };
            let sculpted = sculpt(&image, &params);
            for encoding in [PlyEncoding::BinaryLittleEndian, PlyEncoding::Ascii] {
                let path = folder.path().join("a.ply");
                write_ply(&path, &sculpted.mesh, encoding, &Progress::none()).unwrap();
                let header = std::fs::read(&path).unwrap();
                let double = String::from_utf8_lossy(&header[..200]).contains("property double x");
                doubles += usize::from(double);
                // A mesh that single precision holds takes no more.
                assert!(!double || sculpted.mesh.single_rounding() > 0.0);
                let Content::Mesh(read) = import::open(&path).unwrap().scans[0].read().unwrap() else { panic!() };
                let domain = Domain::new(&image, &params.triangulation, &Progress::none()).unwrap();
                let triangles = &read.triangles;
                assert_eq!(domain.pixels.len(), image.valid_count());
                assert_within(&image, &read.positions, triangles, tolerance);
            }
            // The certificate of single precision.
            let single: Vec<DVec3> = sculpted.mesh.positions.iter().map(|p| p.as_vec3().as_dvec3()).collect();
            // It is rounded itself.
            let most = sculpted.certificate.max_error_single * (1.0 + f64::EPSILON);
            assert_within(&image, &single, &sculpted.mesh.triangles, most);
            assert!(sculpted.certificate.max_error_single <= 1.001 * tolerance);
        }
    }
    assert!((2..12).contains(&doubles), "{doubles}");
}

#[test]
fn pixels_that_rounding_puts_in_one_place_are_refused() {
    let n = f64::NAN;
    let heights = vec![1e-3, 1e-3, 0.0, 0.0, n, 1e-3, 1e-3, 1e-3, n, 1e-3, 0.0, 1e-3, 0.0, 0.0, 0.0, 0.0];
    let projection = Projection::Orthographic { first: [1e12, 0.0], step: [1e-5, -0.01] };
    let image = RangeImage::from_values(2, 8, heights, projection).unwrap();
    let text = run(&image, &absolute(0.0), &Progress::none()).unwrap_err().to_string();
    assert!(text.contains("Move the image nearer to the origin."), "{text}");
}

/// Largest distance along the vertical between samples and triangles of an orthographic image, at the places where both are:
/// differences of coordinates that lie close together are exact.
fn farthest_as_placed(image: &RangeImage, mesh: &TriMesh) -> f64 {
    let origin = image.point_in_sensor(0);
    let mut worst = 0.0_f64;
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|v| mesh.positions[v as usize] - origin);
        let normal = (b - a).cross(c - a);
        for pixel in 0..image.len() {
            let at = image.point_in_sensor(pixel) - origin;
            let turn = |p: DVec3, q: DVec3| (q.x - p.x) * (at.y - p.y) - (q.y - p.y) * (at.x - p.x);
            let sides = [turn(a, b), turn(b, c), turn(c, a)];
            let slack = 1e-6 * normal.z.abs();
            if sides.iter().all(|side| side * normal.z.signum() >= -slack) {
                let height = a.z - (normal.x * (at.x - a.x) + normal.y * (at.y - a.y)) / normal.z;
                worst = worst.max((height - at.z).abs());
            }
        }
    }
    worst
}

#[test]
fn far_from_the_origin_the_places_of_pixels_are_rounded() {
    let steep: [&dyn Fn(usize, usize) -> f64; 2] =
        [&|r, c| (c + 2 * r) as f64, &|r, c| 3.0 * c as f64 + noise(7, (r * 64 + c) as u64)];
    for at in [0.0, 5e6] {
        let projection = Projection::Orthographic { first: [at + 0.1, 0.3 - at], step: [1e-3, -1e-3] };
        for height in steep {
            let values = (0..20 * 24).map(|i| height(i / 24, i % 24)).collect();
            let image = RangeImage::from_values(20, 24, values, projection).unwrap();
            for tolerance in [0.0, 1e-7, 0.3] {
                let sculpted = sculpt(&image, &absolute(tolerance));
                let (told, found) = (sculpted.certificate.max_error, farthest_as_placed(&image, &sculpted.mesh));
                assert!(told <= tolerance && sculpted.certificate.max_error_single >= told);
                assert!(found <= told + 1e-12, "at {at} within {tolerance}: {found}, but {told} is told");
            }
        }
    }
}
