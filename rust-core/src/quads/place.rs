//! Stage 8: from pixels to places in space, also for vertices on the background.
//!
//! A grid covers the whole image, so vertices may lie on invalid pixels. Their ranges continue those of the vertices around
//! them: of ever larger blocks of vertices the mean range of the valid ones, each block blended from the next larger one.
//! In a point grid, where an invalid pixel has no ray either, all three coordinates are continued, as departures
//! from the affine map of rows and columns that fits the valid vertices best.

use glam::{DMat3, DVec3};

use super::sight::linear_value;
use super::stitch::Net;
use crate::range_image::{Projection, RangeImage, Samples};

/// The vertices of a grid, in its order.
#[derive(Clone, Debug, Default)]
pub(super) struct Vertices {
    /// In the sensor's frame; finite.
    pub points: Vec<DVec3>,
    /// What is linear in column and row on a plane, if anything is.
    pub values: Vec<f64>,
    /// Whether the pixel has no sample.
    pub background: Vec<bool>,
}

/// Places the vertices of a grid of the filled image. O(vertices).
pub(super) fn place(image: &RangeImage, net: &Net) -> Vertices {
    let pixel = |site: [u32; 2]| site[0] as usize * image.cols() + site[1] as usize;
    let background: Vec<bool> = net.sites.iter().map(|&s| !image.is_valid(pixel(s))).collect();
    if let Samples::Points(_) = image.samples() {
        let mut points: Vec<DVec3> = net.sites.iter().map(|&s| image.point_in_sensor(pixel(s))).collect();
        continue_points(net, &background, &mut points);
        let values = vec![0.0; points.len()];
        return Vertices { points, values, background };
    }
    let mut ranges: Vec<[f64; 3]> = net.sites.iter().map(|&s| [image.range(pixel(s)), 0.0, 0.0]).collect();
    continue_over(net, &background, &mut ranges);
    let projection: &Projection = image.projection();
    let of = |(&[row, col], &[range, ..]): (&[u32; 2], &[f64; 3])| projection.point(row as usize, col as usize, range);
    Vertices {
        points: net.sites.iter().zip(&ranges).map(of).collect(),
        values: net.sites.iter().zip(&ranges).map(|(&site, r)| linear_value(projection, site, r[0])).collect(),
        background,
    }
}

fn continue_points(net: &Net, background: &[bool], points: &mut [DVec3]) {
    if !background.contains(&true) {
        return;
    }
    let affine = fit(net, background, points);
    let mut departures: Vec<[f64; 3]> =
        net.sites.iter().zip(points.iter()).map(|(&site, &p)| (p - affine(site)).to_array()).collect();
    continue_over(net, background, &mut departures);
    for v in 0..points.len() {
        if background[v] {
            points[v] = affine(net.sites[v]) + DVec3::from_array(departures[v]);
        }
    }
}

/// The affine map from row and column to space that fits the valid vertices best.
fn fit(net: &Net, background: &[bool], points: &[DVec3]) -> impl Fn([u32; 2]) -> DVec3 + use<> {
    let valid = || (0..points.len()).filter(|&v| !background[v]);
    let count = (valid().count() as f64).max(1.0);
    let at = |site: [u32; 2]| DVec3::new(f64::from(site[0]), f64::from(site[1]), 0.0);
    let middle = valid().map(|v| at(net.sites[v])).sum::<DVec3>() / count;
    let mean = valid().map(|v| points[v] / count).sum::<DVec3>();
    let (mut rr, mut rc, mut cc) = (0.0, 0.0, 0.0);
    let (mut by_row, mut by_col) = (DVec3::ZERO, DVec3::ZERO);
    for v in valid() {
        let (offset, point) = (at(net.sites[v]) - middle, points[v] - mean);
        rr += offset.x * offset.x;
        rc += offset.x * offset.y;
        cc += offset.y * offset.y;
        by_row += offset.x * point;
        by_col += offset.y * point;
    }
    let det = rr * cc - rc * rc;
    // All valid vertices on a line, or none: no slope can be told.
    let (down, right) = if det > 1e-9 * rr * cc {
        ((by_row * cc - by_col * rc) / det, (by_col * rr - by_row * rc) / det)
    } else {
        (DVec3::ZERO, DVec3::ZERO)
    };
    let map = DMat3::from_cols(down, right, mean);
    let map = if map.is_finite() { map } else { DMat3::ZERO };
    move |site| map * (at(site) - middle).with_z(1.0)
}

/// Gives each background vertex values that continue those of the others; zero where there is no other.
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
        // What lies near counts, not how much of it there is.
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
