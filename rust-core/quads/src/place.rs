//! Stage 8: from pixels to places in space, also for vertices on the background.
//!
//! A grid covers the whole image, so vertices may lie on invalid pixels. Their ranges continue those of the vertices around them. They are
//! the mean range of the valid ones in ever larger blocks of vertices, each block blended from the next larger one. In a point grid, where
//! an invalid pixel has no ray either, all three coordinates are continued, as departures from the affine map of rows and columns that fits
//! the valid vertices best. If no vertex met a sample, all samples between them stand for the vertices.

use glam::{DMat3, DVec3};

use super::quad_distance::linear_value;
use super::stitch::Net;
use base::error::Result;
use base::progress::Progress;
use image::range_image::{Projection, RangeImage, Samples};

/// The vertices of a grid, in its order.
#[derive(Clone, Debug, Default)]
pub(super) struct Vertices {
    /// In the sensor's frame. Finite.
    pub points: Vec<DVec3>,
    /// Values that are linear in column and row on a plane, if there are any.
    pub values: Vec<f64>,
    /// Whether the pixel has no sample.
    pub background: Vec<bool>,
}

/// Places the vertices of a grid of the filled image. O(vertices).
///
/// # Errors
/// [`base::Error::Cancelled`].
pub(super) fn place(image: &RangeImage, net: &Net, progress: &Progress<'_>) -> Result<Vertices> {
    let pixel = |site: [u32; 2]| site[0] as usize * image.cols() + site[1] as usize;
    let background: Vec<bool> = passes(&net.sites, |&s| !image.is_valid(pixel(s)), progress)?;
    if let Samples::Points(_) = image.samples() {
        let mut points = passes(&net.sites, |&s| image.point_in_sensor(pixel(s)), progress)?;
        continue_points(image, net, &background, &mut points);
        let values = vec![0.0; points.len()];
        return Ok(Vertices { points, values, background });
    }
    let mut ranges = passes(&net.sites, |&s| [image.range(pixel(s)), 0.0, 0.0], progress)?;
    if background.contains(&false) {
        continue_over(net, &background, &mut ranges);
    } else {
        ranges.fill([mean_range(image), 0.0, 0.0]);
    }
    let projection: &Projection = image.projection();
    let mut points = Vec::with_capacity(net.sites.len());
    let mut values = Vec::with_capacity(net.sites.len());
    for block in progress.ranges(net.sites.len()) {
        for v in block? {
            let (site, range) = (net.sites[v], ranges[v][0]);
            points.push(projection.point(site[0] as usize, site[1] as usize, range));
            values.push(linear_value(projection, site, range));
        }
    }
    Ok(Vertices { points, values, background })
}

/// The results of `of` for each, with a look at the progress now and then.
fn passes<T, R>(all: &[T], of: impl Fn(&T) -> R, progress: &Progress<'_>) -> Result<Vec<R>> {
    let mut made = Vec::with_capacity(all.len());
    for block in progress.blocks(all) {
        made.extend(block?.iter().map(&of));
    }
    Ok(made)
}

/// The mean range of the valid pixels. 0 if there is none.
fn mean_range(image: &RangeImage) -> f64 {
    let valid = || (0..image.len()).filter(|&i| image.is_valid(i));
    let count = (valid().count() as f64).max(1.0);
    // Shares first: a sum of large values has no room.
    valid().map(|i| image.range(i) / count).sum()
}

fn continue_points(image: &RangeImage, net: &Net, background: &[bool], points: &mut [DVec3]) {
    if !background.contains(&true) {
        return;
    }
    if !background.contains(&false) {
        let site = |i: usize| [i / image.cols(), i % image.cols()].map(|x| x as u32);
        let samples = (0..image.len()).filter(|&i| image.is_valid(i));
        let affine = fit(samples.map(|i| (site(i), image.point_in_sensor(i))));
        (0..points.len()).for_each(|v| points[v] = affine.at(net.sites[v]));
        return;
    }
    let valid = (0..points.len()).filter(|&v| !background[v]);
    let affine = fit(valid.map(|v| (net.sites[v], points[v])));
    let mut departures: Vec<[f64; 3]> =
        net.sites.iter().zip(points.iter()).map(|(&site, &p)| (p - affine.at(site)).to_array()).collect();
    continue_over(net, background, &mut departures);
    for v in 0..points.len() {
        if background[v] {
            points[v] = affine.at(net.sites[v]) + DVec3::from_array(departures[v]);
        }
    }
}

/// An affine map from row and column to space.
struct Affine {
    middle: DVec3,
    map: DMat3,
}

impl Affine {
    fn at(&self, site: [u32; 2]) -> DVec3 {
        self.map * (pixel_point(site) - self.middle).with_z(1.0)
    }
}

fn pixel_point([row, col]: [u32; 2]) -> DVec3 {
    DVec3::new(f64::from(row), f64::from(col), 0.0)
}

/// The affine map that fits the samples best.
fn fit(samples: impl Iterator<Item = ([u32; 2], DVec3)> + Clone) -> Affine {
    let count = (samples.clone().count() as f64).max(1.0);
    let middle = samples.clone().map(|(site, _)| pixel_point(site)).sum::<DVec3>() / count;
    let mean = samples.clone().map(|(_, point)| point / count).sum::<DVec3>();
    let (mut rr, mut rc, mut cc) = (0.0, 0.0, 0.0);
    let (mut by_row, mut by_col) = (DVec3::ZERO, DVec3::ZERO);
    for (site, point) in samples {
        let (offset, point) = (pixel_point(site) - middle, point - mean);
        rr += offset.x * offset.x;
        rc += offset.x * offset.y;
        cc += offset.y * offset.y;
        by_row += offset.x * point;
        by_col += offset.y * point;
    }
    let det = rr * cc - rc * rc;
    // All samples on a line, or none: no slope can be told.
    let (down, right) = if det > 1e-9 * rr * cc {
        ((by_row * cc - by_col * rc) / det, (by_col * rr - by_row * rc) / det)
    } else {
        (DVec3::ZERO, DVec3::ZERO)
    };
    let map = DMat3::from_cols(down, right, mean);
    Affine { middle, map: if map.is_finite() { map } else { DMat3::ZERO } }
}

/// Gives each background vertex values that continue those of the others, of which there is at least one.
fn continue_over(net: &Net, background: &[bool], values: &mut [[f64; 3]]) {
    if !background.contains(&true) {
        return;
    }
    let weights = background.iter().map(|&b| if b { 0.0 } else { 1.0 }).collect();
    let finest: Vec<[f64; 3]> = values.iter().zip(background).map(|(&v, &b)| if b { [0.0; 3] } else { v }).collect();
    // Coarser and coarser blocks of 2 x 2: weighted means of what is known.
    let mut levels = vec![(net.rows, net.cols, finest, weights)];
    while let Some((rows, cols, _, _)) = levels.last().map(|l| (l.0, l.1, &l.2, &l.3))
        && rows * cols > 1
    {
        let (_, _, fine, fine_weights): &(usize, usize, Vec<[f64; 3]>, Vec<f64>) = &levels[levels.len() - 1];
        let (half_rows, half_cols) = (rows.div_ceil(2), cols.div_ceil(2));
        let mut coarse = vec![[0.0; 3]; half_rows * half_cols];
        let mut weights = vec![0.0_f64; half_rows * half_cols];
        for r in 0..rows {
            for c in 0..cols {
                let (from, to) = (r * cols + c, r / 2 * half_cols + c / 2);
                weights[to] += fine_weights[from];
            }
        }
        for r in 0..rows {
            for c in 0..cols {
                let (from, to) = (r * cols + c, r / 2 * half_cols + c / 2);
                if fine_weights[from] > 0.0 {
                    // Shares first: a sum of large values has no room.
                    let share = fine_weights[from] / weights[to];
                    (0..3).for_each(|k| coarse[to][k] += fine[from][k] * share);
                }
            }
        }
        // Whether something lies near counts, not how much of it there is.
        weights.iter_mut().for_each(|w| *w = w.min(1.0));
        levels.push((half_rows, half_cols, coarse, weights));
    }
    // And back: bilinear between the blocks of the coarser level where the finer one knows nothing.
    for level in (1..levels.len()).rev() {
        let (fine, coarse) = levels.split_at_mut(level);
        let (rows, cols, fine, weights) = &mut fine[level - 1];
        let (coarse_rows, coarse_cols, coarse, _) = &coarse[0];
        for r in 0..*rows {
            for c in 0..*cols {
                if weights[r * *cols + c] > 0.0 {
                    continue;
                }
                let near = |x: usize, count: usize| {
                    let home = x / 2;
                    let other = if x.is_multiple_of(2) { home.saturating_sub(1) } else { (home + 1).min(count - 1) };
                    [(home, 0.75), (other, 0.25)]
                };
                let mut value = [0.0; 3];
                for (i, along) in near(r, *coarse_rows) {
                    for (j, across) in near(c, *coarse_cols) {
                        (0..3).for_each(|k| value[k] += coarse[i * *coarse_cols + j][k] * (along * across));
                    }
                }
                fine[r * *cols + c] = value;
            }
        }
    }
    for (v, value) in values.iter_mut().enumerate() {
        if background[v] {
            *value = levels[0].2[v];
        }
    }
}
