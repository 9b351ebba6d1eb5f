//! Rules that always hold of a sculpted mesh, whatever the image.

use glam::DVec3;
use proptest::prelude::*;

use super::domain::Domain;
use super::rays::Rays;
use super::view::{Site, View};
use super::*;
use base::progress::Progress;
use image::range_image::test_images::{ahead, as_point_grid, plane, projections, render, sphere};
use image::range_image::{Projection, RangeImage, Samples};
use image::triangulate::TriangulateParams;
use mesh::TriMesh;
use mesh::check::check;

mod bounds;
mod coverage;
mod options;
mod oracle;
mod refusals;
mod sameness;
mod shapes;
mod tolerances;

/// Distances may differ from the tolerance by rounding: of the ranges, and of the tolerance itself.
fn slack(image: &RangeImage, tolerance: f64) -> f64 {
    let largest = (0..image.len()).map(|i| image.range(i).abs()).filter(|r| !r.is_nan()).fold(0.0, f64::max);
    tolerance * (1.0 + 1e-9) + 1e-12 * largest
}

/// Distance along the ray of a pixel to each triangle that it meets, and whether it meets it well inside: by the textbook
/// and one by one.
fn meetings(image: &RangeImage, mesh: &TriMesh, index: usize) -> Vec<(f64, bool)> {
    let (origin, direction) = image.ray_in_sensor(index);
    let sample = image.point_in_sensor(index);
    let mut found = Vec::new();
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(t);
        let (e1, e2) = (b - a, c - a);
        let h = direction.cross(e2);
        let det = e1.dot(h);
        let s = origin - a;
        let u = s.dot(h) / det;
        let q = s.cross(e1);
        let v = direction.dot(q) / det;
        if u >= -1e-9 && v >= -1e-9 && u + v <= 1.0 + 1e-9 {
            let inside = u.min(v).min(1.0 - u - v) > 1e-6;
            found.push((e2.dot(q) / det - (sample - origin).dot(direction), inside));
        }
    }
    found
}

/// Checks all that must hold of a result.
fn assert_sound(image: &RangeImage, params: &SculptParams, sculpted: &Sculpted) {
    let Sculpted { mesh, certificate, report } = sculpted;
    let domain = Domain::new(image, &params.triangulation, &Progress::none()).unwrap();
    let bound = slack(image, report.tolerance);
    assert!(certificate.max_error <= report.tolerance, "{} > {}", certificate.max_error, report.tolerance);
    assert_eq!(certificate.covered_pixels, domain.pixels.len());
    assert_eq!(image.valid_count(), domain.pixels.len() + report.isolated_pixels);
    assert!(certificate.rms_error <= certificate.max_error && certificate.p95_error <= certificate.max_error);
    if let Some([row, col]) = certificate.worst_pixel {
        let error = certificate.error_image[row * image.cols() + col].abs();
        assert!(f64::from(error) >= certificate.max_error && f64::from(error.next_down()) <= certificate.max_error);
    }
    // In single precision, too.
    let of_faces = certificate.face_errors.iter().copied().fold(0.0, f32::max);
    assert!(f64::from(of_faces) >= certificate.max_error || mesh.triangles.is_empty());
    let all = certificate.face_errors.iter().chain(certificate.error_image.iter().filter(|e| !e.is_nan()));
    assert!(
        all.clone().all(|e| f64::from(e.abs()) <= report.tolerance),
        "single precision is above {}",
        report.tolerance
    );
    let found = check(mesh);
    assert!(found.is_manifold(), "{found:?}");
    assert_eq!(found.degenerate_triangles + found.duplicate_triangles, 0, "{found:?}");
    // Vertices are samples, triangles turn one way, and together they cover what the domain covers: each place once.
    let row = match mesh.vertex_attribute("range_row") {
        Some(mesh::AttributeData::I32(rows)) => rows,
        other => panic!("{other:?}"),
    };
    let col = match mesh.vertex_attribute("range_col") {
        Some(mesh::AttributeData::I32(cols)) => cols,
        other => panic!("{other:?}"),
    };
    let pixels: Vec<u32> = row.iter().zip(col).map(|(&r, &c)| (r * image.cols() as i32 + c) as u32).collect();
    for (v, &p) in pixels.iter().enumerate() {
        let sample = image.point_in_sensor(p as usize);
        if params.interpolate {
            assert_eq!(mesh.positions[v], sample);
        } else {
            // Along the ray of the sample, within the tolerance.
            let (_, direction) = image.ray_in_sensor(p as usize);
            let moved = mesh.positions[v] - sample;
            let (along, size) = (moved.dot(direction), 1e-12 * (1.0 + sample.length()));
            assert!((moved - along * direction).length() <= size && along.abs() <= bound + size, "{moved}");
        }
    }
    let cols = image.cols() as i64;
    let area = |[a, b, c]: [u32; 3]| {
        let place = |p: u32| (i64::from(p) % cols, i64::from(p) / cols);
        let ((ax, ay), (bx, by), (cx, cy)) = (place(a), place(b), place(c));
        (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    };
    let whole: i64 = domain.triangles.iter().map(|&t| area(t)).sum();
    let covered: i64 = mesh.triangles.iter().map(|t| area(t.map(|v| pixels[v as usize])).abs()).sum();
    if matches!(image.samples(), Samples::Values(_)) && !matches!(image.projection(), Projection::Spherical { .. }) {
        if params.simplify_borders {
            assert!(covered >= whole);
            let triangles: Vec<[u32; 3]> = mesh.triangles.iter().map(|t| t.map(|v| pixels[v as usize])).collect();
            borders::tests::assert_reaches_half_a_pixel(&domain, &triangles);
        } else {
            assert_eq!(covered, whole);
        }
    }
    let turned = |t: [u32; 3]| if domain.mirrored { [t[0], t[2], t[1]] } else { t };
    for triangle in &mesh.triangles {
        let [a, b, c] = turned(*triangle).map(|v| pixels[v as usize]);
        let turn = match Rays::new(image, domain.mirrored) {
            Rays::Flat(view) => turn_of(&view, [a, b, c]),
            Rays::Pinhole(view) => turn_of(&view, [a, b, c]),
            Rays::Parallel(view) => turn_of(&view, [a, b, c]),
            Rays::Central(view) => turn_of(&view, [a, b, c]),
        };
        assert!(turn > 0.0);
    }
}

fn turn_of<V: View>(view: &V, corners: [u32; 3]) -> f64 {
    let [a, b, c] = corners.map(|p| view.site(p));
    Site::turn(&a, &b, &c)
}

/// Whether any pixels are joined to a triangle: else there is nothing to sculpt, which is an error.
fn has_triangles(image: &RangeImage, params: &SculptParams) -> bool {
    !Domain::new(image, &params.triangulation, &Progress::none()).unwrap().triangles.is_empty()
}

fn sculpt(image: &RangeImage, params: &SculptParams) -> Sculpted {
    let sculpted = run(image, params, &Progress::none()).unwrap();
    assert_sound(image, params, &sculpted);
    sculpted
}

fn absolute(tolerance: f64) -> SculptParams {
    SculptParams { tolerance: Tolerance::Absolute(tolerance), threads: 2, ..SculptParams::default() }
}

fn flat(rows: usize, cols: usize, z: impl Fn(f64, f64) -> f64) -> RangeImage {
    let values = (0..rows * cols).map(|i| z((i / cols) as f64, (i % cols) as f64)).collect();
    RangeImage::from_values(rows, cols, values, Projection::Orthographic { first: [0.0; 2], step: [1.0, -1.0] })
        .unwrap()
}

/// A number in [0, 1) from a pixel and a seed.
fn noise(seed: u64, i: u64) -> f64 {
    let mut x = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ i.wrapping_mul(0xd134_2543_de82_ef95);
    for _ in 0..3 {
        x = (x ^ x >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    }
    (x >> 11) as f64 / (1_u64 << 53) as f64
}

/// Hills, a step, noise, quantized or flattened in places, with holes. Values about 2 with an extent of about 1.
#[derive(Clone, Copy, Debug)]
struct Scene {
    rows: usize,
    cols: usize,
    seed: u64,
    holes: f64,
    roughness: f64,
    step: f64,
    quantum: f64,
}

impl Scene {
    fn value(&self, row: f64, col: f64) -> f64 {
        let i = (row * 1000.0 + col) as u64;
        let block = noise(self.seed, (row / 7.0) as u64 * 77 + (col / 5.0) as u64);
        if noise(self.seed ^ 1, i) < self.holes || block < self.holes {
            return f64::NAN;
        }
        let hills = 0.3 * (row * 0.21 + self.seed as f64 % 7.0).sin() * (col * 0.17).cos();
        let step = if col > 0.6 * self.cols as f64 { self.step } else { 0.0 };
        let z = 2.0 + hills + step + self.roughness * (noise(self.seed ^ 2, i) - 0.5);
        let z = if block > 0.8 { 2.0 } else { z };
        if self.quantum > 0.0 { (z / self.quantum).round() * self.quantum } else { z }
    }
}

fn scenes() -> impl Strategy<Value = Scene> {
    (
        (1..45_usize, 1..45_usize, any::<u64>()),
        prop_oneof![Just(0.0), 0.0..0.3_f64],
        prop_oneof![Just(0.0), Just(0.01), Just(0.3)],
        prop_oneof![Just(0.0), Just(0.5)],
        prop_oneof![Just(0.0), Just(0.0625)],
    )
        .prop_map(|((rows, cols, seed), holes, roughness, step, quantum)| Scene {
            rows,
            cols,
            seed,
            holes,
            roughness,
            step,
            quantum,
        })
}

fn tolerances() -> impl Strategy<Value = f64> {
    prop_oneof![Just(0.0), Just(1e9), 0.0..0.3_f64, 0.0..0.01_f64]
}

/// The scene as each kind of sensor sees it.
fn seen(scene: &Scene, kind: usize) -> RangeImage {
    let (rows, cols) = (scene.rows, scene.cols);
    let projection = projections(rows, cols)[kind % 16];
    let values = (0..rows * cols).map(|i| scene.value((i / cols) as f64, (i % cols) as f64)).collect();
    let image = RangeImage::from_values(rows, cols, values, projection).unwrap();
    if kind >= 16 { as_point_grid(&image) } else { image }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(base::tier::cases(160)))]

    #[test]
    fn any_image_keeps_every_promise(
        scene in scenes(), kind in 0..32_usize, tolerance in tolerances(), effort in 0..3_u32,
        [joined, interpolate, simplify_borders] in any::<[bool; 3]>(), min_angle in prop_oneof![Just(0.0), 0.0..0.5_f64],
    ) {
        let image = seen(&scene, kind);
        let edge_limit = joined.then_some(1e6);
        let triangulation = TriangulateParams { edge_limit, ..TriangulateParams::default() };
        let params =
            SculptParams { effort, interpolate, min_angle, simplify_borders, triangulation, ..absolute(tolerance) };
        prop_assume!(has_triangles(&image, &params));
        let sculpted = sculpt(&image, &params);
        // One by one: every covered ray meets the mesh once, or where triangles join, and within the bound.
        for index in (0..image.len()).filter(|&i| !sculpted.certificate.error_image[i].is_nan()).step_by(7) {
            let met = meetings(&image, &sculpted.mesh, index);
            for (distance, _) in &met {
                prop_assert!(distance.abs() <= slack(&image, tolerance) * (1.0 + 1e-6) + 1e-7, "{distance}");
            }
            prop_assert!(!met.is_empty());
            prop_assert!(met.len() == 1 || !met.iter().any(|&(_, inside)| inside), "{met:?}");
        }
    }
}
