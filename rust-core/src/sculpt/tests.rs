//! What must always hold of a sculpted mesh, whatever the image.

use glam::DVec3;
use proptest::prelude::*;

use super::domain::Domain;
use super::view::{Sight, Site, View};
use super::*;
use crate::mesh::check::check;
use crate::range_image::test_images::{ahead, as_point_grid, plane, projections, render, sphere};
use crate::range_image::{Projection, Samples};
use crate::triangulate::TriangulateParams;

/// Distances may differ from the tolerance by rounding: of the ranges, and of the tolerance itself.
fn slack(image: &RangeImage, tolerance: f64) -> f64 {
    let largest = (0..image.len()).map(|i| image.range(i).abs()).filter(|r| !r.is_nan()).fold(0.0, f64::max);
    tolerance * (1.0 + 1e-9) + 1e-12 * largest
}

/// Distance along the ray of a pixel to each triangle that it meets, by the textbook and one by one.
fn meetings(image: &RangeImage, mesh: &TriMesh, index: usize) -> Vec<f64> {
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
            found.push(e2.dot(q) / det - (sample - origin).dot(direction));
        }
    }
    found
}

/// Checks all that must hold of a result.
fn assert_sound(image: &RangeImage, params: &SculptParams, sculpted: &Sculpted) {
    let Sculpted { mesh, certificate, report } = sculpted;
    let domain = Domain::new(image, &params.triangulation, &Progress::none()).unwrap();
    let bound = slack(image, report.tolerance);
    assert!(certificate.max_error <= bound, "{} > {}", certificate.max_error, report.tolerance);
    assert_eq!(certificate.covered, domain.pixels.len());
    assert_eq!(image.valid_count(), domain.pixels.len() + report.isolated_pixels);
    assert!(certificate.rms_error <= certificate.max_error && certificate.p95_error <= certificate.max_error);
    if let Some([row, col]) = certificate.worst_pixel {
        let error = certificate.error_image[row * image.cols() + col].abs();
        assert_eq!(error, certificate.max_error as f32);
    }
    let found = check(mesh);
    assert!(found.is_manifold(), "{found:?}");
    assert_eq!(found.degenerate_triangles + found.duplicate_triangles, 0, "{found:?}");
    // Vertices are samples, triangles turn one way, and together they cover what the domain covers: each place once.
    let row = match mesh.vertex_attribute("range_row") {
        Some(crate::mesh::AttributeData::I32(rows)) => rows,
        other => panic!("{other:?}"),
    };
    let col = match mesh.vertex_attribute("range_col") {
        Some(crate::mesh::AttributeData::I32(cols)) => cols,
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
        let turn = match Sight::new(image, domain.mirrored) {
            Sight::Flat(view) => turn_of(&view, [a, b, c]),
            Sight::Pinhole(view) => turn_of(&view, [a, b, c]),
            Sight::Parallel(view) => turn_of(&view, [a, b, c]),
            Sight::Central(view) => turn_of(&view, [a, b, c]),
        };
        assert!(turn > 0.0);
    }
}

fn turn_of<V: View>(view: &V, corners: [u32; 3]) -> f64 {
    let [a, b, c] = corners.map(|p| view.site(p));
    Site::turn(&a, &b, &c)
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

/// Hills, a step, noise, quantized or flattened in places, with holes; values about 2 with an extent of about 1.
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
    #![proptest_config(ProptestConfig::with_cases(160))]

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
        let sculpted = sculpt(&image, &params);
        // One by one: every covered ray meets the mesh, and each meeting is within the bound.
        for index in (0..image.len()).filter(|&i| !sculpted.certificate.error_image[i].is_nan()).step_by(7) {
            for distance in meetings(&image, &sculpted.mesh, index) {
                prop_assert!(distance.abs() <= slack(&image, tolerance) * (1.0 + 1e-6) + 1e-7, "{distance}");
            }
        }
        // The same in units of another power of two.
        if let (Samples::Values(values), Projection::Orthographic { first, step }) = (image.samples(), image.projection()) {
            let scaled = |x: &f64| x * 1024.0;
            let projection = Projection::Orthographic { first: first.map(|x| x * 1024.0), step: step.map(|x| x * 1024.0) };
            let values = values.iter().map(scaled).collect();
            let other = RangeImage::from_values(image.rows(), image.cols(), values, projection).unwrap();
            let triangulation = TriangulateParams { edge_limit: edge_limit.map(|x| x * 1024.0), ..triangulation };
            let params = SculptParams { triangulation, tolerance: Tolerance::Absolute(tolerance * 1024.0), ..params };
            prop_assert_eq!(sculpt(&other, &params).mesh.triangles, sculpted.mesh.triangles);
        }
    }

    #[test]
    fn half_cells_are_those_of_the_triangles(
        scene in scenes(), narrow in prop_oneof![Just(45_usize), Just(2), Just(3)], kind in 0..32_usize,
    ) {
        let scene = Scene { cols: scene.cols.min(narrow), ..scene };
        let domain = Domain::new(&seen(&scene, kind), &TriangulateParams::default(), &Progress::none()).unwrap();
        let (rows, cols) = (i64::from(domain.rows), i64::from(domain.cols));
        for row in 0..rows {
            for col in 0..cols {
                let corners = [[row, col], [row, col + 1], [row + 1, col + 1], [row + 1, col]];
                let mut halves = 0;
                for triangle in &domain.triangles {
                    let places = triangle.map(|p| [i64::from(p) / cols, i64::from(p) % cols]);
                    if places.iter().all(|place| corners.contains(place)) {
                        let missing = corners.iter().position(|corner| !places.contains(corner));
                        halves |= 1 << missing.unwrap();
                    }
                }
                prop_assert_eq!(domain.halves(row, col), halves);
            }
        }
        let mut pixels: Vec<u32> = domain.triangles.iter().flatten().copied().collect();
        pixels.sort_unstable();
        pixels.dedup();
        prop_assert_eq!(&domain.pixels, &pixels);
    }

    #[test]
    fn threads_and_order_of_tolerances_change_nothing(
        scene in scenes(), kind in 0..32_usize, tolerance in tolerances(), effort in 0..3_u32,
        [interpolate, simplify_borders] in any::<[bool; 2]>(),
    ) {
        let image = seen(&scene, kind);
        let params = SculptParams { effort, interpolate, simplify_borders, ..absolute(tolerance) };
        let results: Vec<Sculpted> = [1, 2, 8]
            .map(|threads| {
                let sculptor = Sculptor::new(&image, &SculptParams { threads, ..params }).unwrap();
                if threads == 2 {
                    sculptor.refine(Tolerance::Absolute(0.05), &Progress::none()).unwrap();
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
}

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
                Projection::PointGrid(crate::range_image::Viewing::From(eye)) => {
                    crate::range_image::Viewing::From(*eye * unit)
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

#[test]
fn nothing_to_mesh_gives_an_empty_mesh() {
    for (rows, cols) in [(0, 0), (0, 7), (1, 1), (1, 9), (9, 1), (5, 5)] {
        let image = flat(rows, cols, |_, _| if rows == 5 { f64::NAN } else { 1.0 });
        let sculpted = sculpt(&image, &SculptParams::default());
        assert!(sculpted.mesh.triangles.is_empty() && sculpted.certificate.worst_pixel.is_none());
    }
}

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
fn negative_huge_and_tiny_ranges_do_no_harm() {
    for projection in projections(12, 12) {
        for factor in [-1.0, 1e-300, 1e300, 1e150] {
            let values = (0..144).map(|i| factor * (1.0 + noise(3, i))).collect();
            let image = RangeImage::from_values(12, 12, values, projection).unwrap();
            match run(&image, &SculptParams::default(), &Progress::none()) {
                Ok(sculpted) => assert!(!sculpted.certificate.max_error.is_nan()),
                Err(error) => assert!(error.to_string().contains("use a larger unit"), "{error}"),
            }
        }
    }
}

#[test]
fn cancelling_at_any_moment_ends_the_call() {
    let image = flat(60, 60, |r, c| noise(9, (r * 100.0 + c) as u64));
    let mut checks = 0;
    loop {
        match run(&image, &absolute(0.1), &Progress::cancel_after(checks)) {
            Err(crate::Error::Cancelled) => checks += 1 + checks / 4,
            Ok(_) => break,
            Err(error) => panic!("{error}"),
        }
    }
    assert!(checks > 3);
    // Also before the first mesh; a large image is looked at in steps.
    let image = flat(600, 600, |r, c| r + c);
    for checks in 0..6 {
        let cancelled = Sculptor::prepare(&image, &absolute(0.1), &Progress::cancel_after(checks));
        assert!(matches!(cancelled, Err(crate::Error::Cancelled)), "{checks}");
    }
}

#[test]
fn where_the_domain_touches_itself_vertices_are_split() {
    // Two half cells that share the pixel (1, 0).
    let image = flat(3, 2, |r, c| if (r, c) == (1.0, 1.0) { f64::NAN } else { 1.0 });
    let sculpted = sculpt(&image, &absolute(0.1));
    assert_eq!(sculpted.mesh.positions.len(), 6);
    assert_eq!(sculpted.mesh.triangles.len(), 2);
    assert_eq!(sculpted.mesh.positions.iter().filter(|p| **p == DVec3::new(0.0, -1.0, 1.0)).count(), 2);
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
