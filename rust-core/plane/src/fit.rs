//! Planes through three samples, and the best of them by least squares.

use glam::DVec3;
use rayon::prelude::*;

use base::error::Result;
use base::progress::Progress;
use geom::linear::eigen;

use crate::pool::{Pool, Sample, random};

/// Planes through three samples that are tried.
const TRIED: usize = 1 << 14;
/// Planes tried between two looks at the progress.
const AT_ONCE: usize = 64;
/// Samples that these are judged by, and those that the best of them are judged by again.
const JUDGING: [usize; 2] = [1 << 9, 1 << 12];
/// Planes that are judged again, and those that are fitted to all samples then.
const JUDGED_AGAIN: usize = 1 << 10;
const FITTED: usize = 24;
/// Rounds of fitting.
const ROUNDS: usize = 16;
/// Tolerance at first, in extents of the scans.
const WIDE: f64 = 0.01;
/// Deviations within which samples count for the plane.
const WITHIN: f64 = 3.0;
/// From the median of distances to the standard deviation of what is distributed normally.
const DEVIATION: f64 = 1.4826;
/// Samples on a plane spread in it further than off it, or they lie on a line.
const FLATNESS: f64 = 5.0;
/// Smallest tolerance in extents of the scans: what rounding does to samples without noise.
const ROUNDING: f64 = 1e-9;
/// Samples spread less across a line, in extents of the scans.
const LINE: f64 = 1e-6;

/// A plane fitted to the samples near it.
#[derive(Clone, Copy, Debug)]
pub struct Fitted {
    /// Amid its samples, less the origin of the pool.
    pub centre: DVec3,
    pub normal: DVec3,
    /// Largest distance of samples that count.
    pub width: f64,
    /// Samples within the width, and in as much space right beside that.
    pub on: usize,
    pub beside: usize,
    /// Root mean square of the heights of those on it.
    pub spread: f64,
    /// Whether above is where the normal does not point.
    pub is_upside_down: bool,
}

/// The plane with most samples. `None` if samples are on a line. `tolerance` is how far off they may lie. If it is not given, it follows
/// from how they scatter.
///
/// # Errors
/// Cancelled.
pub fn best(pool: &Pool, tolerance: Option<f64>, progress: &Progress<'_>) -> Result<Option<Fitted>> {
    let width = tolerance.unwrap_or(WIDE * pool.extent);
    let count = pool.points.len();
    let judges = JUDGING.map(|most| {
        let judging = most.min(count);
        (0..judging).map(|k| pool.points[k * count / judging].at).collect::<Vec<DVec3>>()
    });
    let on = |judges: &[DVec3], point: DVec3, normal: DVec3| {
        judges.iter().filter(|&&at| normal.dot(at - point).abs() <= width).count()
    };
    let blocks = (0..TRIED / AT_ONCE).into_par_iter().map(|block| {
        progress.check()?;
        let tried = (block * AT_ONCE..(block + 1) * AT_ONCE).filter_map(|number| {
            let (point, normal) = through_three(&pool.points, number as u64)?;
            Some((on(&judges[0], point, normal), number, point, normal))
        });
        Ok(tried.collect::<Vec<_>>())
    });
    let mut tried = blocks.collect::<Result<Vec<_>>>()?.concat();
    let best_first = |&(on, number, ..): &(usize, usize, DVec3, DVec3)| (std::cmp::Reverse(on), number);
    tried.sort_by_key(best_first);
    tried.truncate(JUDGED_AGAIN);
    tried.par_iter_mut().for_each(|(count, _, point, normal)| *count = on(&judges[1], *point, *normal));
    tried.sort_by_key(best_first);
    tried.truncate(FITTED);
    let fitted = tried.into_par_iter().map(|(_, _, point, normal)| fitted(pool, point, normal, tolerance, progress));
    let fitted: Vec<Option<Fitted>> = fitted.collect::<Result<_>>()?;
    // Of equal ones the first: the order is that of the numbers of what was tried.
    let best = fitted.into_iter().flatten().reduce(|best, next| if next.on > best.on { next } else { best });
    Ok(best.map(|best| Fitted { is_upside_down: is_upside_down(pool, &best), ..best }))
}

/// A plane through three samples: anywhere, or near each other at one of many scales.
fn through_three(points: &[Sample], number: u64) -> Option<(DVec3, DVec3)> {
    let count = points.len() as u64;
    let draw = |k: u64| random(number * 8 + k);
    let first = draw(0) % count;
    let scales = u64::from(count.ilog2()) + 1;
    let reach = (1 << (draw(1) % scales + 1)).min(count);
    let near = |k: u64| (first + count + draw(k) % reach - reach / 2) % count;
    let [a, b, c] = [first, near(2), near(3)].map(|k| points[k as usize].at);
    let normal = (b - a).normalize_or_zero().cross((c - a).normalize_or_zero());
    normal.try_normalize().map(|normal| (a, normal))
}

fn fitted(
    pool: &Pool,
    mut centre: DVec3,
    mut normal: DVec3,
    tolerance: Option<f64>,
    progress: &Progress<'_>,
) -> Result<Option<Fitted>> {
    let wide = tolerance.unwrap_or(WIDE * pool.extent);
    let mut width = wide;
    let mut heights = Vec::new();
    for _ in 0..ROUNDS {
        progress.check()?;
        let Some((middle, axis)) = least_squares(pool, centre, normal, width) else { return Ok(None) };
        (centre, normal) = (middle, axis);
        if tolerance.is_some() {
            continue;
        }
        heights.clear();
        heights.extend(pool.points.iter().map(|sample| normal.dot(sample.at - centre).abs()).filter(|&h| h <= width));
        let middle = heights.len() / 2;
        if heights.is_empty() {
            return Ok(None);
        }
        let median = *heights.select_nth_unstable_by(middle, f64::total_cmp).1;
        width = (WITHIN * DEVIATION * median).clamp(ROUNDING * pool.extent, wide);
    }
    let (mut on, mut beside, mut squares) = (0, 0, 0.0);
    for sample in &pool.points {
        let height = normal.dot(sample.at - centre).abs();
        if height <= width {
            on += 1;
            squares += height * height;
        } else if height <= 2.0 * width {
            beside += 1;
        }
    }
    let spread = (squares / on.max(1) as f64).sqrt();
    Ok((on >= 3).then_some(Fitted { centre, normal, width, on, beside, spread, is_upside_down: false }))
}

/// The plane of least squares of the samples near a plane: its centre and normal. `None` if they are on a line.
fn least_squares(pool: &Pool, centre: DVec3, normal: DVec3, width: f64) -> Option<(DVec3, DVec3)> {
    let on = || pool.points.iter().map(|sample| sample.at - centre).filter(|away| normal.dot(*away).abs() <= width);
    let (mut count, mut sum) = (0.0, DVec3::ZERO);
    for away in on() {
        count += 1.0;
        sum += away;
    }
    let middle = sum / f64::max(count, 1.0);
    let mut products = [[0.0; 3]; 3];
    for away in on() {
        let away = away - middle;
        for i in 0..3 {
            for j in 0..3 {
                products[i][j] += away[i] * away[j];
            }
        }
    }
    let (values, axes) = eigen(&products);
    let across = LINE * pool.extent;
    let is_flat = values[1] > across * across * count && values[1] > FLATNESS * FLATNESS * values[0];
    is_flat.then(|| (centre + middle, DVec3::from(axes[0])))
}

/// Above is the side that the samples of the plane were seen from, if most of them say the same. Else it is the side on which most of the
/// others lie. Else it is the side on which the normal's largest component is positive.
fn is_upside_down(pool: &Pool, plane: &Fitted) -> bool {
    let (mut seen, mut voices, mut others) = (0_i64, 0_i64, 0_i64);
    for sample in &pool.points {
        let height = plane.normal.dot(sample.at - plane.centre);
        if height.abs() > plane.width {
            others += if height > 0.0 { 1 } else { -1 };
            continue;
        }
        let side = plane.normal.dot(sample.outward);
        if side != 0.0 {
            voices += 1;
            seen += if side > 0.0 { 1 } else { -1 };
        }
    }
    let largest = plane.normal.to_array().into_iter().fold(0.0_f64, |a, b| if b.abs() > a.abs() { b } else { a });
    if 2 * seen.abs() > voices {
        seen < 0
    } else if others != 0 {
        others < 0
    } else {
        largest < 0.0
    }
}
