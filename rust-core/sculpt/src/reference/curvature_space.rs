//! Pixels as points whose height rises with the curvature (section 3.1, equations 1 and 2).

use glam::DVec3;

use image::range_image::RangeImage;

/// Units of curvature in the depth extent: the paper's images had integer ranges up to about 9,000.
const UNITS: f64 = 10_000.0;

/// The points of some pixels, ascending: column, row, and a height that differs by at most sqrt(7) between neighbours.
pub(super) fn points(image: &RangeImage, heights: &[f64], pixels: &[u32]) -> Vec<DVec3> {
    let extent = |values: &mut dyn Iterator<Item = f64>| {
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), z| (l.min(z), h.max(z)));
        (high - low).max(0.0)
    };
    let depth = extent(&mut pixels.iter().map(|&p| heights[p as usize]).filter(|z| !z.is_nan()));
    let unit = if depth > 0.0 { UNITS / depth } else { 0.0 };
    let mut lifted = vec![f64::NAN; heights.len()];
    for &p in pixels {
        let curvature = curvature(image, heights, p as usize) * unit;
        lifted[p as usize] = (random(p) + (curvature * curvature).min(f64::MAX / 2.0)).ln_1p();
    }
    let mut steepest = 0.0_f64;
    for &p in pixels {
        for q in neighbours(image, p as usize) {
            let difference = (lifted[p as usize] - lifted[q]).abs();
            if difference > steepest {
                steepest = difference;
            }
        }
    }
    let gamma = if steepest > 0.0 { 7.0_f64.sqrt() / steepest } else { 1.0 };
    let cols = image.cols() as u32;
    pixels.iter().map(|&p| DVec3::new(f64::from(p % cols), f64::from(p / cols), gamma * lifted[p as usize])).collect()
}

/// The paper's random number of a pixel, in [0, 1): where the curvature is constant it keeps most pixels off the hull, so
/// that the mesh starts coarse. A hash, so that the same image gives the same mesh.
fn random(pixel: u32) -> f64 {
    let mut x = u64::from(pixel).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    for _ in 0..2 {
        x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    }
    (x >> 11) as f64 / (1_u64 << 53) as f64
}

/// Absolute second difference over the valid neighbours, in eight parts. The background has none.
fn curvature(image: &RangeImage, heights: &[f64], p: usize) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    if !image.is_valid(p) {
        return 0.0;
    }
    for q in neighbours(image, p) {
        if image.is_valid(q) {
            sum += heights[p] - heights[q];
            count += 1.0;
        }
    }
    if count > 0.0 { (sum * (8.0 / count)).abs() } else { 0.0 }
}

/// The up to eight pixels around one.
fn neighbours(image: &RangeImage, p: usize) -> impl Iterator<Item = usize> + use<> {
    let (rows, cols) = (image.rows(), image.cols());
    let (row, col) = (p / cols, p % cols);
    (row.saturating_sub(1)..(row + 2).min(rows))
        .flat_map(move |r| (col.saturating_sub(1)..(col + 2).min(cols)).map(move |c| r * cols + c))
        .filter(move |&q| q != p)
}
