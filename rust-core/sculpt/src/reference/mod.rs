//! The paper's own pipeline, for comparison with the lazy digging: tetrahedra in curvature space, dug from outside. \[SG07\]
//!
//! | stage | file | in -> out |
//! |---|---|---|
//! | 1 | `curvature_space` | image, its holes filled with background -> a point a pixel (3.1) |
//! | 2 | `geom/delaunay3` | points -> tetrahedra (3.2) |
//! | 3 | `digging` | tetrahedra -> exterior mesh, dug until its triangles are valid (3.2, 3.3) |
//! | 4 | `validation` | triangle -> invalid, unreliable or reliable (3.3.1, 3.4) |
//! | 5 | `degenerate` | mesh -> mesh without triangles seen edge-on (3.5) |
//!
//! Differences from the paper: Curvature is measured in units of 1/10,000 of the depth extent, so that it does not depend on the user's
//! unit. Alpha is 1, as it only scales. The random number is a hash of the pixel. Neighbour links of the tetrahedra take the place of the
//! hash table.
//!
//! As in the paper the mesh may fold over itself seen from the sensor, and digging may end at the lower hull with a triangle that is still
//! invalid or unreliable. The halves of a triangle that is cut beside one seen edge-on are not judged again. These are counted, and the
//! certificate says how far off they are. Digging that gets through to the lower hull at one place goes on from below and leaves two
//! sheets: the tetrahedra lack some edges of the grid. If the curvature itself varies smoothly, as on analytic shapes, many pixels lie on
//! the hull from the start. The mesh is then far denser than on images with noise or plane parts.

mod curvature_space;
mod degenerate;
mod digging;
mod validation;

use super::certify::{Certificate, certify};
use super::domain::Domain;
use super::finish;
use super::params::SculptParams;
use super::pieces::Pieces;
use base::error::{Error, Result};
use base::memory;
use base::progress::Progress;
use geom::delaunay3::Delaunay3;
use image::range_image::{Projection, RangeImage, Samples};
use mesh::TriMesh;

/// At the peak. Measured.
const BYTES_A_PIXEL: f64 = 500.0;

/// The figures of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReferenceReport {
    /// Tolerance used, world units.
    pub tolerance: f64,
    /// Triangles of the step-discontinuity triangulation.
    pub full_triangles: usize,
    /// Tetrahedra.
    pub tetrahedra: usize,
    /// Rounds of digging.
    pub iterations: usize,
    /// Triangles of the result.
    pub triangles: usize,
    /// Triangles at the lower hull that are farther from a sample than the tolerance: nothing is left there to dig.
    pub invalid_triangles: usize,
    /// Triangles at the lower hull that are within the tolerance but unreliable, with nothing left there to dig.
    pub unreliable_triangles: usize,
    /// Triangles that were seen edge-on, and are gone.
    pub degenerate_triangles: usize,
    /// Names of the stages with their wall-clock seconds.
    pub seconds: Vec<(&'static str, f64)>,
}

/// The result of the paper's pipeline. The mesh is in the sensor's frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// The surface, with the attributes of [`super::Sculpted::mesh`].
    pub mesh: TriMesh,
    /// Its distances from the samples.
    pub certificate: Certificate,
    /// Figures of the run.
    pub report: ReferenceReport,
}

base::stages! {
    /// Stages with their shares of the time.
    PLAN:
    LIFTING = "curvature space", 0.05;
    TETRAHEDRALIZING = "tetrahedra", 0.6;
    DIGGING = "digging", 0.3;
    MEASURING = "measuring the error", 0.05;
}

/// Sculpts an orthographic image as the paper does. Of the parameters only `tolerance`, `triangulation` and `threads` are used.
///
/// Cost: O(n log n) expected time for n pixels, about 500 bytes per pixel.
///
/// # Errors
/// [`Error::Input`] for images of other kinds. Parameters out of range. [`Error::Cancelled`]. [`Error::OutOfMemory`].
pub fn run(image: &RangeImage, params: &SculptParams, progress: &Progress<'_>) -> Result<Reference> {
    params.validate()?;
    let (Projection::Orthographic { .. }, Samples::Values(heights)) = (image.projection(), image.samples()) else {
        return Err(Error::input(format!(
            "{}: the reference variant digs orthographic images only. Use sculpt::run for others.",
            image.called()
        )));
    };
    let pixels = image.len();
    memory::expect(BYTES_A_PIXEL * pixels as f64, || format!("sculpting {pixels} pixels"), "use fewer")?;
    let domain = Domain::new(image, &params.triangulation, progress)?;
    let tolerance = params.tolerance.in_world(domain.extent())?;
    progress.plan(PLAN);
    let pool = base::threads::pool(params.threads)?;
    progress.run(&pool, || {
        progress.stage(LIFTING, 1);
        let filled = with_background(heights);
        let whole = RangeImage::from_values(image.rows(), image.cols(), filled.clone(), *image.projection())?;
        let pixels: Vec<u32> = (0..image.len() as u32).collect();
        let points = curvature_space::points(image, heights, &pixels);
        progress.lap("curvature space");
        progress.stage(TETRAHEDRALIZING, 1);
        let mut report = ReferenceReport { tolerance, full_triangles: domain.triangles.len(), ..Default::default() };
        let mut triangles = Vec::new();
        if !domain.triangles.is_empty() {
            let delaunay = Delaunay3::new(&points, params.threads, progress)?;
            progress.lap("tetrahedra");
            progress.stage(DIGGING, 1);
            let judge = validation::Judge::new(&whole, &filled, &domain, tolerance);
            let dug = digging::dig(&delaunay, &pixels, &judge, progress)?;
            report.tetrahedra = delaunay.finite_count();
            report.iterations = dug.iterations;
            report.invalid_triangles = dug.invalid;
            report.unreliable_triangles = dug.unreliable;
            let before = dug.triangles.len();
            triangles = degenerate::remove(dug.triangles, image.cols() as u32);
            report.degenerate_triangles = before.saturating_sub(triangles.len());
            // Triangles that reach into the background are not drawn.
            let is_drawn = |t: &[u32; 3]| {
                image.is_valid(centroid(*t, image.cols() as u32)) && t.iter().all(|&p| image.is_valid(p as usize))
            };
            triangles.retain(is_drawn);
            progress.lap("digging");
        }
        report.triangles = triangles.len();
        progress.stage(MEASURING, 1);
        let mut mesh = finish::mesh(image, &domain, &Pieces::full(&triangles), progress)?;
        let certificate = certify(image, &mesh, progress)?;
        finish::add_errors(&mut mesh, &certificate.face_errors, progress)?;
        progress.lap("measuring the error");
        report.seconds = progress.seconds();
        Ok(Reference { mesh, certificate, report })
    })
}

/// The lowest height where there is no sample (section 2).
fn with_background(heights: &[f64]) -> Vec<f64> {
    let lowest = heights.iter().copied().fold(f64::INFINITY, f64::min);
    heights.iter().map(|&z| if z.is_nan() { lowest } else { z }).collect()
}

/// The pixel at the centroid of a triangle of pixels.
fn centroid(triangle: [u32; 3], cols: u32) -> usize {
    let sum = |f: &dyn Fn(u32) -> u32| triangle.iter().map(|&p| u64::from(f(p))).sum::<u64>();
    let (row, col) = (sum(&|p| p / cols), sum(&|p| p % cols));
    ((row + 1) / 3 * u64::from(cols) + (col + 1) / 3) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::Tolerance;
    use image::triangulate::TriangulateParams;
    use mesh::check::check;

    fn map(rows: usize, cols: usize, z: impl Fn(f64, f64) -> f64) -> RangeImage {
        let values = (0..rows * cols).map(|i| z((i / cols) as f64, (i % cols) as f64)).collect();
        RangeImage::from_values(rows, cols, values, Projection::Orthographic { first: [0.0; 2], step: [1.0, -1.0] })
            .unwrap()
    }

    fn params(tolerance: f64, threads: usize) -> SculptParams {
        let triangulation = TriangulateParams { edge_limit: Some(1e6), ..TriangulateParams::default() };
        SculptParams { tolerance: Tolerance::Absolute(tolerance), triangulation, threads, ..SculptParams::default() }
    }

    fn hills(r: f64, c: f64) -> f64 {
        10.0 * (0.21 * r).sin() * (0.17 * c).cos() + 0.3 * (0.9 * r + 0.4 * c).sin()
    }

    fn smooth(r: f64, c: f64) -> f64 {
        100.0 * (0.06 * r).sin() * (0.05 * c).cos() + 0.02 * (r - 20.0) * (c - 30.0)
    }

    fn noisy(r: f64, c: f64) -> f64 {
        r + 0.5 * c + 0.3 * (12.9 * r * r + 78.2 * c + 3.3 * r * c).sin()
    }

    fn gable(r: f64, c: f64) -> f64 {
        (r - 20.0).abs() + 0.25 * c
    }

    #[test]
    fn digging_ends_with_valid_triangles_and_keeps_the_border() {
        for (tolerance, shape) in
            [(0.5, smooth as fn(f64, f64) -> f64), (2.0, smooth), (0.5, hills), (0.5, noisy), (0.05, gable)]
        {
            let (image, params) = (map(48, 60, shape), params(tolerance, 1));
            let Samples::Values(heights) = image.samples() else { panic!("a height map") };
            let pixels: Vec<u32> = (0..48 * 60).collect();
            let points = curvature_space::points(&image, heights, &pixels);
            let delaunay = Delaunay3::new(&points, 1, &Progress::none()).unwrap();
            let domain = Domain::new(&image, &params.triangulation, &Progress::none()).unwrap();
            let judge = validation::Judge::new(&image, heights, &domain, tolerance);
            let dug = digging::dig(&delaunay, &pixels, &judge, &Progress::none()).unwrap();
            // Digging ends at tetrahedra that are all used up, or at triangles within the tolerance.
            let invalid = dug.triangles.iter().filter(|&&t| judge.validate(t) == validation::Verdict::Invalid).count();
            assert_eq!(invalid, dug.invalid);
            assert!(dug.iterations > 0 && dug.iterations <= delaunay.finite_count());
            // A dig replaces some facets of a tetrahedron by the others: the border stays, and so does the area within,
            // counted by sign; cutting flat triangles off does no more.
            let area = |triangles: &[[u32; 3]]| triangles.iter().map(|&t| judge.turn(t)).sum::<i64>();
            assert_eq!(area(&dug.triangles), 2 * 47 * 59);
            let cut = degenerate::remove(dug.triangles, 60);
            assert_eq!(area(&cut), 2 * 47 * 59);
            assert!(cut.iter().all(|&t| judge.turn(t) != 0));
        }
    }

    #[test]
    fn fewer_triangles_the_larger_the_tolerance_and_the_same_for_any_number_of_threads() {
        for shape in [smooth as fn(f64, f64) -> f64, hills, noisy] {
            let image = map(48, 60, shape);
            let mut last = usize::MAX;
            for tolerance in [0.1, 0.5, 2.0] {
                let result = run(&image, &params(tolerance, 1), &Progress::none()).unwrap();
                let report = &result.report;
                assert!(report.triangles < last, "{report:?}");
                last = report.triangles;
                assert_eq!(result.certificate.covered_pixels, 48 * 60, "{report:?}");
                assert_eq!(check(&result.mesh).degenerate_triangles, 0);
                // Only what is left invalid, and cuts, which are not judged again, may be beyond the tolerance.
                let beyond =
                    result.certificate.face_errors.iter().filter(|&&e| f64::from(e) > tolerance * (1.0 + 1e-6)).count();
                assert!(beyond <= report.invalid_triangles + 2 * report.degenerate_triangles, "{beyond}: {report:?}");
                assert_eq!(run(&image, &params(tolerance, 3), &Progress::none()).unwrap().mesh, result.mesh);
            }
        }
        let image = map(48, 60, gable);
        let report = run(&image, &params(0.05, 1), &Progress::none()).unwrap().report;
        assert!(report.triangles < report.full_triangles / 50, "{report:?}");
    }

    #[test]
    fn samples_of_any_size_do_no_harm() {
        for factor in [-1.0, 1e-300, 1e100, 1e150, 1e300] {
            let image = map(12, 12, |r, c| factor * (1.0 + hills(r, c)));
            for tolerance in [0.0, 1e-9, 1e9, f64::MAX] {
                match run(&image, &params(tolerance, 1), &Progress::none()) {
                    Ok(result) => assert!(!result.certificate.max_error.is_nan()),
                    Err(error) => assert!(error.to_string().contains("Use a larger unit"), "{error}"),
                }
            }
        }
        let text =
            |tolerance| run(&map(4, 4, hills), &params(tolerance, 1), &Progress::none()).unwrap_err().to_string();
        assert!(text(-1.0).contains("tolerance must be") && text(f64::NAN).contains("tolerance must be"));
    }

    #[test]
    fn any_unit_gives_the_same_mesh() {
        let small = map(20, 20, hills);
        let values = (0..400).map(|i| 1024.0 * hills((i / 20) as f64, (i % 20) as f64)).collect();
        let projection = Projection::Orthographic { first: [0.0; 2], step: [1024.0, -1024.0] };
        let large = RangeImage::from_values(20, 20, values, projection).unwrap();
        let one = run(&small, &params(0.25, 1), &Progress::none()).unwrap();
        let other = run(&large, &params(256.0, 1), &Progress::none()).unwrap();
        assert_eq!(one.mesh.triangles, other.mesh.triangles);
    }

    #[test]
    fn planes_holes_and_nothing_at_all() {
        let flat = run(&map(20, 30, |r, _| 2.0 * r), &params(0.01, 1), &Progress::none()).unwrap();
        assert!(flat.certificate.max_error <= 0.01 && flat.report.triangles >= 2);
        let holed_at = |y: f64, x: f64| (8.0..12.0).contains(&-y) && x > 9.0;
        let holed = map(20, 30, |r, c| if holed_at(-r, c) { f64::NAN } else { hills(r, c) });
        let result = run(&holed, &params(0.2, 1), &Progress::none()).unwrap();
        assert!(
            result.report.triangles > 0 && result.certificate.max_error <= 0.2 * (1.0 + 1e-9),
            "{:?}",
            result.report
        );
        assert!(result.mesh.positions.iter().all(|p| p.z > -11.0 && !holed_at(p.y, p.x)));
        for (rows, cols) in [(0, 0), (1, 9), (9, 1), (1, 1), (5, 5)] {
            let empty = map(rows, cols, |_, _| f64::NAN);
            assert_eq!(run(&empty, &params(0.2, 1), &Progress::none()).unwrap().report.triangles, 0);
        }
    }

    #[test]
    fn other_images_are_refused() {
        let points = vec![[0.0, 0.0, 0.0]; 4];
        let viewing = image::range_image::Viewing::Parallel(-glam::DVec3::Z);
        let grid = RangeImage::from_points(2, 2, points, viewing).unwrap();
        let text = run(&grid, &params(0.1, 1), &Progress::none()).unwrap_err().to_string();
        assert!(text.contains("orthographic images only"), "{text}");
    }
}
