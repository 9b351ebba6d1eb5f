//! The certificate: how far the finished mesh lies from each sample along the sample's own ray, measured on the mesh's
//! coordinates by code that shares nothing with the digging.
//!
//! # The error of a sample
//! It is computed in double precision, and no other way:
//!
//! * A sample that is a vertex of the triangle, coordinate by coordinate, has error 0.
//! * On a lattice, let `w_i` be twice the area, in pixels, of the triangle that a pixel makes with the edge across from corner `i`, and `w`
//!   their sum: whole numbers, so exact. Of an orthographic image of heights `h` the error is `sum w_i (h - h_i) / w`. To this comes what
//!   rounding the places of pixels may add if that is more than heights are rounded by: on steep triangles far from the origin. Of a
//!   pinhole image of depths `d` along the optical axis it is `(w / sum (w_i / d_i) - d) s`, where `s` is the length of the ray by depth.
//!   As no `w_i` is negative, rounding is at most a few units in the last place of the largest `h - h_i`, or of the range.
//! * Elsewhere it is the distance from the sample, along its ray, to the triangle that the ray meets.
//!
//! Errors in single precision are rounded up.

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashSet;

use base::error::Result;
use base::progress::{Pace, Progress};
use geom::bvh::{Bvh, Ray};
use image::range_image::{DepthKind, Projection, RangeImage, Samples, Viewing};
use mesh::TriMesh;

base::report! {
    /// Distances of the mesh from the samples, measured on the result along the samples' rays.
    pub struct Certificate {
        /// Largest distance between a sample and the mesh along the sample's ray.
        max_error: f64 = length("Largest error"),
        /// Largest distance once coordinates are rounded to single precision, as STL, GLB and many programs keep them, at most.
        max_error_single: f64 = length("In single precision"),
        /// Root of the mean square of the distances.
        rms_error: f64 = length("RMS error"),
        /// 95 % of the samples lie at most this far from the mesh.
        p95_error: f64 = length("95 % below"),
        /// Row and column of the sample farthest from the mesh. Of several the first one. There is none for an empty mesh.
        worst_pixel: Option<[usize; 2]> = count("Worst pixel").optional().parts(&[
            ("worst_row", "Row of the sample farthest from the mesh, the first one of several. There is none for an empty mesh."),
            ("worst_col", "Its column. There is none for an empty mesh."),
        ]),
        /// Samples that the mesh covers: their rays meet it.
        covered_pixels: usize = count("Samples covered"),
    }
    besides {
        /// Signed distance per pixel, row by row: positive where the mesh lies behind the sample. NaN where no ray meets it. Rounded away
        /// from 0.
        error_image: Vec<f32>,
        /// Largest distance of the samples whose rays meet each triangle, rounded up.
        face_errors: Vec<f32>,
        /// Largest motion of the mesh along a ray beside its motion anywhere: 1 by the cosine between ray and normal of its steepest
        /// triangle.
        steepness: f64,
    }
}

/// Measures of each pixel and triangle.
pub(super) struct Measured {
    /// Signed distance a pixel, NaN where no ray meets the mesh.
    pub errors: Vec<f64>,
    /// Largest distance of each triangle, rounded up.
    face_errors: Vec<f32>,
}

/// In single precision, away from 0.
fn round_up(x: f64) -> f32 {
    let single = x as f32;
    if f64::from(single).abs() >= x.abs() || x.is_nan() {
        single
    } else if x > 0.0 {
        single.next_up()
    } else {
        single.next_down()
    }
}

/// Measures a mesh in the sensor's frame against the image it came from.
///
/// Measured are the valid pixels whose rays meet the mesh. If an image hides part of itself, those of hidden samples may meet what lies
/// before them. [`super::Sculpted::certificate`] leaves these out.
///
/// Pixels on a lattice (orthographic, pinhole): each triangle is projected back to pixels and compared with every pixel seen in it or on
/// its edges. Otherwise the ray of each valid pixel is followed both ways from the sample to the nearest triangle, which is at 0 for a
/// sample that is a vertex. Rounding may let the ray of a sample on the border pass the mesh by. Then a ray beside it counts, at most 1e-11
/// of its coordinates away, or the distance to the nearest point of the mesh.
///
/// Cost: O(pixels covered) on a lattice, O(pixels log triangles) otherwise.
///
/// # Errors
/// [`base::Error::Cancelled`]. A mesh that is not finite or names vertices it doesn't have.
pub fn certify(image: &RangeImage, mesh: &TriMesh, progress: &Progress<'_>) -> Result<Certificate> {
    let valid: Vec<u32> = (0..image.len() as u32).filter(|&i| image.is_valid(i as usize)).collect();
    summarize(image, mesh, measure(image, &valid, mesh, progress)?, progress)
}

/// The errors of some of the pixels, rising. On a lattice of all.
pub(super) fn measure(image: &RangeImage, pixels: &[u32], mesh: &TriMesh, progress: &Progress<'_>) -> Result<Measured> {
    mesh.validate()?;
    match (image.projection(), image.samples()) {
        (Projection::Orthographic { .. } | Projection::Pinhole { .. }, Samples::Values(values)) => {
            on_lattice(image, values, mesh, progress)
        }
        _ => along_rays(image, pixels, mesh, progress),
    }
}

/// The certificate of a mesh and its errors.
pub(super) fn summarize(
    image: &RangeImage,
    mesh: &TriMesh,
    measured: Measured,
    progress: &Progress<'_>,
) -> Result<Certificate> {
    let Measured { errors, face_errors } = measured;
    let cols = image.cols();
    let mut sizes: Vec<f64> = Vec::with_capacity(errors.len());
    for block in progress.blocks(&errors) {
        sizes.extend(block?.iter().filter(|e| !e.is_nan()).map(|e| e.abs()));
    }
    let covered = sizes.len();
    let max_error = sizes.iter().copied().fold(0.0, f64::max);
    let worst = errors.iter().position(|e| e.abs() == max_error);
    // Scaled, so that squares neither overflow nor vanish.
    let scale = if max_error > 0.0 { max_error } else { 1.0 };
    progress.check()?;
    let squares: f64 = sizes.iter().map(|e| (e / scale) * (e / scale)).sum();
    progress.check()?;
    let p95_error = if covered == 0 {
        0.0
    } else {
        let rank = (covered * 95).div_ceil(100) - 1;
        *sizes.select_nth_unstable_by(rank, f64::total_cmp).1
    };
    progress.check()?;
    let steepness = steepness(image, mesh, progress)?;
    let rounding = mesh.single_rounding();
    Ok(Certificate {
        max_error,
        max_error_single: if rounding > 0.0 { max_error + rounding * steepness } else { max_error },
        rms_error: if covered == 0 { 0.0 } else { scale * (squares / covered as f64).sqrt() },
        p95_error,
        worst_pixel: worst.map(|i| [i / cols, i % cols]),
        covered_pixels: covered,
        error_image: errors.into_iter().map(round_up).collect(),
        face_errors,
        steepness,
    })
}

/// See [`Certificate::steepness`]. 1 without triangles.
fn steepness(image: &RangeImage, mesh: &TriMesh, progress: &Progress<'_>) -> Result<f64> {
    let of_triangle = |[a, b, c]: [DVec3; 3]| {
        let normal = (b - a).cross(c - a).normalize_or_zero();
        match image.projection() {
            Projection::Orthographic { .. } => 1.0 / normal.z.abs(),
            Projection::PointGrid(Viewing::Parallel(direction)) => 1.0 / normal.dot(direction.normalize()).abs(),
            projection => {
                let eye = if let Projection::PointGrid(Viewing::From(eye)) = projection { *eye } else { DVec3::ZERO };
                let farthest = [a, b, c].map(|p| p.distance(eye)).into_iter().fold(0.0, f64::max);
                farthest / normal.dot(a - eye).abs()
            }
        }
    };
    let triangles: Vec<usize> = (0..mesh.triangles.len()).collect();
    let mut steepest = 1.0_f64;
    for block in progress.blocks(&triangles) {
        steepest = block?.iter().map(|&t| of_triangle(mesh.corners(t))).fold(steepest, f64::max);
    }
    // Rounding takes some of the products.
    Ok(steepest * (1.0 + 1e-9))
}

/// A vertex as a pixel image sees it.
#[derive(Clone, Copy)]
struct Projected {
    col: f64,
    row: f64,
    /// A value that is linear in column and row on a triangle: height, or the inverse of depth.
    value: f64,
    /// The pixel whose sample this is, [`NO_PIXEL`] if of none.
    pixel: usize,
}

const NO_PIXEL: usize = usize::MAX;

/// Vertices nearer to a pixel's centre than this many pixels were meant to be there.
const SNAP: f64 = 1e-5;

fn project(image: &RangeImage, p: DVec3) -> Projected {
    let (col, row, value) = match image.projection() {
        Projection::Orthographic { first, step } => ((p.x - first[0]) / step[0], (p.y - first[1]) / step[1], p.z),
        Projection::Pinhole { focal, centre, .. } => {
            (p.x / p.z * focal[0] + centre[0], p.y / p.z * focal[1] + centre[1], 1.0 / p.z)
        }
        _ => (f64::NAN, f64::NAN, f64::NAN),
    };
    let snap = |x: f64| if (x - x.round()).abs() < SNAP { x.round() } else { x };
    let (near_col, near_row) = (col.round(), row.round());
    let is_within = |x: f64, count: usize| x >= 0.0 && x < count as f64;
    if is_within(near_col, image.cols()) && is_within(near_row, image.rows()) {
        let pixel = near_row as usize * image.cols() + near_col as usize;
        if image.point_in_sensor(pixel) == p {
            return Projected { col: near_col, row: near_row, value, pixel };
        }
    }
    Projected { col: snap(col), row: snap(row), value, pixel: NO_PIXEL }
}

/// Rows handled by one thread at a time.
const BAND: usize = 32;

fn on_lattice(image: &RangeImage, values: &[f64], mesh: &TriMesh, progress: &Progress<'_>) -> Result<Measured> {
    let (rows, cols) = (image.rows(), image.cols());
    let mut errors = vec![f64::NAN; rows * cols];
    let mut face_errors = vec![0.0_f32; mesh.triangles.len()];
    if errors.is_empty() {
        return Ok(Measured { errors, face_errors });
    }
    let projected: Vec<Projected> = mesh.positions.par_iter().map(|&p| project(image, p)).collect();
    let rounding = Rounding::of(image);
    let mut bands: Vec<Vec<u32>> = vec![Vec::new(); rows.div_ceil(BAND)];
    let mut pace = Pace::new(progress);
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        pace.after(1)?;
        let r = triangle.map(|v| projected[v as usize].row);
        let low = r[0].min(r[1]).min(r[2]).ceil().max(0.0) as usize;
        let high = (r[0].max(r[1]).max(r[2]).floor().max(0.0) as usize).min(rows - 1);
        for band in low / BAND..=high / BAND {
            if let Some(band) = bands.get_mut(band) {
                band.push(t as u32);
            }
        }
    }
    let per_band = errors
        .par_chunks_mut(BAND * cols)
        .zip(&bands)
        .enumerate()
        .map(|(band, (errors, triangles))| {
            progress.check()?;
            let first_row = band * BAND;
            let mut faces = Vec::with_capacity(triangles.len());
            for &t in triangles {
                let corners = mesh.triangles[t as usize].map(|v| projected[v as usize]);
                let mut worst = 0.0_f64;
                let rounded = rounding.along_rays(&corners);
                for_each_pixel(corners, [first_row, first_row + errors.len() / cols], cols, |row, col, weights| {
                    let i = row * cols + col;
                    if values[i].is_nan() {
                        return;
                    }
                    let error = if corners.iter().any(|c| c.pixel == i) {
                        0.0
                    } else {
                        let error = behind(image.projection(), row, col, values[i], &corners, weights);
                        error + rounded.copysign(error)
                    };
                    worst = worst.max(error.abs());
                    let slot = &mut errors[i - first_row * cols];
                    if slot.is_nan() || slot.abs() < error.abs() {
                        *slot = error;
                    }
                });
                faces.push(round_up(worst));
            }
            Ok(faces)
        })
        .collect::<Result<Vec<_>>>()?;
    for (triangles, faces) in bands.iter().zip(per_band) {
        pace.after(faces.len())?;
        for (&t, error) in triangles.iter().zip(faces) {
            face_errors[t as usize] = face_errors[t as usize].max(error);
        }
    }
    Ok(Measured { errors, face_errors })
}

/// Rounding of the places of an orthographic image's columns and rows, which lie on no lattice far from the origin.
struct Rounding {
    /// Largest one of columns and of rows, in steps of the lattice.
    steps: [f64; 2],
}

/// Rounding along the rays of less than this share of a triangle's heights is that of the heights themselves.
const OF_HEIGHTS: f64 = 64.0 * f64::EPSILON;

impl Rounding {
    fn of(image: &RangeImage) -> Rounding {
        let Projection::Orthographic { first, step } = *image.projection() else { return Rounding { steps: [0.0; 2] } };
        let largest = |axis: usize, count: usize| {
            let off = |i: usize| {
                let place = first[axis] + i as f64 * step[axis];
                (i as f64).mul_add(step[axis], first[axis] - place).abs()
            };
            (0..count).map(off).fold(0.0, f64::max) / step[axis].abs()
        };
        Rounding { steps: [largest(0, image.cols()), largest(1, image.rows())] }
    }

    /// Distance along the rays by which a triangle moves, at most, as its corners and the rays are rounded. 0 if that is nothing beside the
    /// rounding of heights.
    fn along_rays(&self, [a, b, c]: &[Projected; 3]) -> f64 {
        if self.steps == [0.0; 2] {
            return 0.0;
        }
        let [to_b, to_c] = [b, c].map(|p| [p.col - a.col, p.row - a.row, p.value - a.value]);
        let area = (to_b[0] * to_c[1] - to_b[1] * to_c[0]).abs();
        let by_col = (to_b[2] * to_c[1] - to_c[2] * to_b[1]).abs() / area;
        let by_row = (to_c[2] * to_b[0] - to_b[2] * to_c[0]).abs() / area;
        let moved = 2.0 * (by_col * self.steps[0] + by_row * self.steps[1]);
        let heights = a.value.abs().max(b.value.abs()).max(c.value.abs());
        if moved > OF_HEIGHTS * heights { moved } else { 0.0 }
    }
}

/// Distance of a triangle behind the sample along the ray, by the weights of its corners: see [`Certificate`].
fn behind(
    projection: &Projection,
    row: usize,
    col: usize,
    sample: f64,
    corners: &[Projected; 3],
    weights: [f64; 3],
) -> f64 {
    let [a, b, c] = weights;
    let sum = |values: [f64; 3]| a * values[0] + b * values[1] + c * values[2];
    match projection {
        Projection::Pinhole { focal, centre, depth } => {
            let (x, y) = ((col as f64 - centre[0]) / focal[0], (row as f64 - centre[1]) / focal[1]);
            let stretch = (x * x + y * y + 1.0).sqrt();
            let depth = match depth {
                DepthKind::Planar => sample,
                DepthKind::Ray => sample / stretch,
            };
            ((a + b + c) / sum(corners.map(|c| c.value)) - depth) * stretch
        }
        _ => sum(corners.map(|c| sample - c.value)) / (a + b + c),
    }
}

/// Calls `visit(row, col, weights of the corners)` for the pixels of some rows in a closed triangle. None is negative.
fn for_each_pixel(
    [a, b, c]: [Projected; 3],
    rows: [usize; 2],
    cols: usize,
    mut visit: impl FnMut(usize, usize, [f64; 3]),
) {
    let area = (b.col - a.col) * (c.row - a.row) - (b.row - a.row) * (c.col - a.col);
    if area == 0.0 || !area.is_finite() {
        return;
    }
    let low = a.row.min(b.row).min(c.row).ceil().max(rows[0] as f64) as usize;
    let high = a.row.max(b.row).max(c.row).floor().min(rows[1] as f64 - 1.0);
    let left = a.col.min(b.col).min(c.col).ceil().max(0.0) as usize;
    let right = a.col.max(b.col).max(c.col).floor().min(cols as f64 - 1.0);
    if high < 0.0 || right < 0.0 {
        return;
    }
    let turn = area.signum();
    for row in low..=high as usize {
        let y = row as f64 - a.row;
        for col in left..=right as usize {
            let x = col as f64 - a.col;
            let of_b = turn * (x * (c.row - a.row) - y * (c.col - a.col));
            let of_c = turn * ((b.col - a.col) * y - (b.row - a.row) * x);
            let of_a = area.abs() - of_b - of_c;
            if of_a >= 0.0 && of_b >= 0.0 && of_c >= 0.0 {
                visit(row, col, [of_a, of_b, of_c]);
            }
        }
    }
}

/// Rays handled between two looks at the progress.
const BLOCK: usize = 4096;

fn along_rays(image: &RangeImage, pixels: &[u32], mesh: &TriMesh, progress: &Progress<'_>) -> Result<Measured> {
    let mut errors = vec![f64::NAN; image.len()];
    let mut face_errors = vec![0.0_f32; mesh.triangles.len()];
    if mesh.triangles.is_empty() {
        return Ok(Measured { errors, face_errors });
    }
    let bits = |p: DVec3| p.to_array().map(f64::to_bits);
    // Rounding may let the ray of a vertex on the border miss its own triangles and meet what lies behind them.
    let vertices: FxHashSet<[u64; 3]> =
        mesh.triangles.iter().flatten().map(|&v| bits(mesh.positions[v as usize])).collect();
    let bvh = Bvh::build_with(&mesh.positions, &mesh.triangles, rayon::current_num_threads(), progress)?;
    let nearest_edge = 1e-6 * mesh.median_edge();
    // The triangle that the ray of a pixel meets, and the signed distance to it.
    let meet = |pixel: u32| -> Option<(Option<u32>, f64)> {
        let index = pixel as usize;
        let (_, direction) = image.ray_in_sensor(index);
        let sample = image.point_in_sensor(index);
        if vertices.contains(&bits(sample)) {
            return Some((None, 0.0));
        }
        let behind = bvh.first_hit(&Ray { origin: sample, direction }, 0.0, f64::INFINITY);
        // The ray starts at the sensor.
        let farthest = behind.map_or(f64::INFINITY, |hit| hit.t).min(reach(image, index));
        let before = bvh.first_hit(&Ray { origin: sample, direction: -direction }, 0.0, farthest);
        if let Some(hit) = before {
            return Some((Some(hit.triangle), -hit.t));
        }
        if let Some(hit) = behind {
            return Some((Some(hit.triangle), hit.t));
        }
        // Rounding may let the ray of a sample that is seen on a border edge pass the mesh by.
        let size = sample.abs().max_element();
        let (u, v) = direction.any_orthonormal_pair();
        for nudge in [1e-15, 1e-13, 1e-11] {
            for aside in [u, v, -u, -v] {
                let ray = |direction| Ray { origin: sample + aside * (nudge * size), direction };
                let behind = bvh.first_hit(&ray(direction), 0.0, f64::INFINITY).map(|hit| (hit.triangle, hit.t));
                let before =
                    || bvh.first_hit(&ray(-direction), 0.0, reach(image, index)).map(|hit| (hit.triangle, -hit.t));
                if let Some((triangle, error)) = behind.or_else(before) {
                    return Some((Some(triangle), error));
                }
            }
        }
        let near = bvh.closest_point(sample)?;
        (near.distance_squared <= nearest_edge * nearest_edge).then(|| (None, near.distance()))
    };
    let met = pixels
        .par_chunks(BLOCK)
        .map(|block| {
            progress.check()?;
            Ok(block.iter().map(|&pixel| meet(pixel)).collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>>>()?;
    for (&pixel, meeting) in pixels.iter().zip(met.into_iter().flatten()) {
        let Some((triangle, error)) = meeting else { continue };
        errors[pixel as usize] = error;
        if let Some(triangle) = triangle {
            let slot = &mut face_errors[triangle as usize];
            *slot = slot.max(round_up(error.abs()));
        }
    }
    Ok(Measured { errors, face_errors })
}

/// Distance before its sample at which a ray starts.
fn reach(image: &RangeImage, index: usize) -> f64 {
    match image.projection() {
        Projection::Orthographic { .. } | Projection::PointGrid(Viewing::Parallel(_)) => f64::INFINITY,
        _ => image.range(index),
    }
}
