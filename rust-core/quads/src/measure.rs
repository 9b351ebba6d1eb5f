//! Stage 7: how far a grid lies from the image, and the diagonals that make it lie nearest.
//!
//! Every pixel of the image lies in exactly one quad: on a side shared by two it belongs to the lower or right one. Sides
//! are followed from row to row in whole numbers, so that none is counted twice or never.

use rayon::prelude::*;

use super::place::Vertices;
use super::quad_distance::{Corner, Flat, Free, Lanes, Pinhole, Points, QuadSums, Sight, Sums};
use super::stitch::Net;
use base::error::Result;
use base::progress::Progress;
use image::range_image::{Projection, RangeImage, Samples, Viewing};

/// The error that a grid is judged by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Judge {
    Mean,
    Rms,
    Max,
}

impl Judge {
    /// The error by which grids and diagonals over the same pixels are compared. A pixel that is missed counts as one `missed` off.
    fn of(self, sums: &Sums, missed: f64) -> f64 {
        let count = sums.missed as f64;
        match self {
            _ if sums.missed == 0 => self.of_met(sums),
            Judge::Mean => sums.sum + count * missed,
            Judge::Rms => sums.squares + count * missed * missed,
            Judge::Max => sums.max.max(missed),
        }
    }

    fn of_met(self, sums: &Sums) -> f64 {
        match self {
            Judge::Mean => sums.sum,
            Judge::Rms => sums.squares,
            Judge::Max => sums.max,
        }
    }

    /// From sums over so many pixels.
    fn mean(self, sum: f64, pixels: usize) -> f64 {
        let pixels = (pixels as f64).max(1.0);
        match self {
            Judge::Mean => sum / pixels,
            Judge::Rms => (sum / pixels).sqrt(),
            Judge::Max => sum,
        }
    }
}

/// Errors of a grid over all valid pixels of the image.
#[derive(Clone, Debug, Default)]
pub(super) struct Measured {
    /// Sums over all quads, with their better diagonals.
    pub total: Sums,
    /// Valid pixels.
    pub valid: usize,
    /// Quads, row by row.
    pub quads: Vec<Quad>,
}

/// A quad's own figures.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Quad {
    /// Largest error, world units.
    pub max: f32,
    /// Valid pixels of the quad.
    pub valid: u32,
    /// All its pixels.
    pub pixels: u32,
    /// Whether the diagonal from corner 1 to 3 is the better one.
    pub odd: bool,
}

impl Measured {
    /// The mean, the root of the mean square or the largest error, of the pixels that are not missed.
    pub fn error(&self, judge: Judge) -> f64 {
        judge.mean(judge.of_met(&self.total), self.valid - self.total.missed)
    }

    /// The same for a decision: a pixel that is missed counts as one `missed` off.
    pub fn judged(&self, judge: Judge, missed: f64) -> f64 {
        judge.mean(judge.of(&self.total, missed), self.valid)
    }
}

/// Measures some grids of one image at once. Those of the same number of rows read the pixels once. Diagonals are chosen as if pixels that
/// are missed were one `missed` off. O(pixels) per grid.
pub(super) fn measure<const N: usize>(
    image: &RangeImage,
    missed: f64,
    grids: [(&Net, &Vertices); N],
    judge: Judge,
    progress: &Progress<'_>,
) -> Result<[Measured; N]> {
    let cols = image.cols();
    let judge = (judge, missed);
    match (image.samples(), *image.projection()) {
        (Samples::Values(values), Projection::Orthographic { .. }) => {
            with(&Flat { values, cols }, image, grids, judge, progress)
        }
        (Samples::Values(values), Projection::Pinhole { focal, centre, depth }) => {
            with(&Pinhole { values, cols, focal, centre, depth }, image, grids, judge, progress)
        }
        (_, projection) => {
            let viewing = match projection {
                Projection::PointGrid(Viewing::Parallel(direction)) => Viewing::Parallel(direction.normalize_or_zero()),
                Projection::PointGrid(viewing) => viewing,
                _ => Viewing::From(glam::DVec3::ZERO),
            };
            with(&Free { points: Points::of(image), cols, viewing }, image, grids, judge, progress)
        }
    }
}

fn with<S: Sight, const N: usize>(
    sight: &S,
    image: &RangeImage,
    grids: [(&Net, &Vertices); N],
    judge: (Judge, f64),
    progress: &Progress<'_>,
) -> Result<[Measured; N]> {
    let rows = grids.iter().map(|(net, _)| net.rows - 1).max().unwrap_or(0);
    let strips = (0..rows)
        .into_par_iter()
        .map(|i| {
            progress.advance(1)?;
            Ok(grids.map(|(net, vertices)| {
                if i < net.rows - 1 { strip(sight, image, net, vertices, i, judge) } else { Measured::default() }
            }))
        })
        .collect::<Result<Vec<_>>>()?;
    let mut whole: [Measured; N] = std::array::from_fn(|_| Measured::default());
    for strip in strips {
        progress.check()?;
        for (whole, strip) in whole.iter_mut().zip(strip) {
            whole.total.sum += strip.total.sum;
            whole.total.squares += strip.total.squares;
            whole.total.max = whole.total.max.max(strip.total.max);
            whole.total.missed += strip.total.missed;
            whole.valid += strip.valid;
            whole.quads.extend(strip.quads);
        }
    }
    Ok(whole)
}

/// One row of quads.
fn strip<S: Sight>(
    sight: &S,
    image: &RangeImage,
    net: &Net,
    vertices: &Vertices,
    i: usize,
    (judge, missed): (Judge, f64),
) -> Measured {
    let mut measured = Measured { quads: Vec::with_capacity(net.cols - 1), ..Measured::default() };
    for j in 0..net.cols - 1 {
        let corners = net.corners(i, j).map(|v| {
            let site = net.sites[v];
            Corner { site, value: vertices.values[v], point: vertices.points[v] }
        });
        let last = [i + 2 == net.rows, j + 2 == net.cols];
        let quad = sight.quad(&corners);
        let (mut lanes, mut pixels) = (Lanes::default(), 0);
        for_each_row(corners.map(|c| c.site.map(i64::from)), last, |row, start, end| {
            pixels += (end - start) as u32;
            sight.add(&quad, row, start, end, &mut lanes);
        });
        debug_assert!(pixels as usize <= image.len());
        let sums: QuadSums = lanes.finish(sight.first_is_even(&quad), pixels);
        let odd = judge.of(&sums.diagonals[1], missed) < judge.of(&sums.diagonals[0], missed);
        let chosen = sums.diagonals[usize::from(odd)];
        measured.total.sum += chosen.sum;
        measured.total.squares += chosen.squares;
        measured.total.max = measured.total.max.max(chosen.max);
        measured.total.missed += chosen.missed;
        measured.valid += sums.valid as usize;
        measured.quads.push(Quad { max: chosen.max as f32, valid: sums.valid, pixels: sums.pixels, odd });
    }
    measured
}

/// A line through two pixels of different rows, followed down from row to row in whole numbers.
#[derive(Clone, Copy)]
struct Side {
    /// The column where it cuts the row, rounded.
    column: i64,
    /// By how much that differs from the line, in units of 1 / `height`: 0 <= rest < `height`.
    rest: i64,
    /// Columns from row to row: a whole number ...
    whole: i64,
    /// ... and a rest in the same units.
    part: i64,
    height: i64,
}

impl Side {
    /// The first column not left of the line (`up`) or the last not right of it, from `row` on. The pixels' rows differ.
    #[inline(always)]
    fn new([from, to]: [[i64; 2]; 2], row: i64, up: bool) -> Self {
        let (width, height) =
            if to[0] > from[0] { (to[1] - from[1], to[0] - from[0]) } else { (from[1] - to[1], from[0] - to[0]) };
        let bias = if up { height - 1 } else { 0 };
        if width == 0 {
            return Side { column: from[1], rest: bias, whole: 0, part: 0, height };
        }
        let cut = (row - from[0]) * width + bias;
        let (columns, whole) = (cut.div_euclid(height), width.div_euclid(height));
        Side { column: from[1] + columns, rest: cut - columns * height, whole, part: width - whole * height, height }
    }

    /// A side that bounds nothing.
    const NONE: Side = Side { column: 0, rest: 0, whole: 0, part: 0, height: 1 };

    /// The column of this row. The next call gives that of the next one.
    #[inline(always)]
    fn next(&mut self) -> i64 {
        let column = self.column;
        self.rest += self.part;
        let carry = self.rest >= self.height;
        self.rest -= if carry { self.height } else { 0 };
        self.column += self.whole + i64::from(carry);
        column
    }
}

/// Calls `visit(row, start, end)` for each row of pixels of a sound quad. `last`: its lower, its right side belongs to it.
#[inline(always)]
fn for_each_row([a, b, c, d]: [[i64; 2]; 4], last: [bool; 2], mut visit: impl FnMut(usize, usize, usize)) {
    let top = a[0].min(b[0]);
    let flat_bottom = c[0] == d[0];
    // Rows below `bottom`; a level lower side is part of the quad at the image's lower border only.
    let bottom = c[0].max(d[0]) + i64::from(!flat_bottom || last[0]);
    // Left and right sides bound columns on the left (whole numbers from `start`) or on the right (below `end`).
    let mut left = Side::new([a, d], top, true);
    let mut right = Side::new([b, c], top, !last[1]);
    let right_too = i64::from(last[1]);
    // A level upper side is part of the quad. Others bound the side that they fall to.
    let (rising, falling) = (b[0] < a[0], b[0] > a[0]);
    let mut upper = if rising || falling { Side::new([a, b], top, rising) } else { Side::NONE };
    // The lower side is not.
    let (to_left, to_right) = (c[0] > d[0], c[0] < d[0]);
    let mut lower = if flat_bottom { Side::NONE } else { Side::new([d, c], top, to_right) };
    for row in top..bottom {
        let (mut start, mut end) = (left.next(), right.next() + right_too);
        let (upper, lower) = (upper.next(), lower.next());
        start = if rising { start.max(upper) } else { start };
        end = if falling { end.min(upper + 1) } else { end };
        start = if to_left { start.max(lower + 1) } else { start };
        end = if to_right { end.min(lower) } else { end };
        if start < end {
            visit(row as usize, start as usize, end as usize);
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::rows::Placed;
    use super::super::stitch::stitch;
    use super::super::tiles::Layout;
    use super::*;

    proptest! {
        #[test]
        fn every_pixel_lies_in_one_quad(
            pixels in (2..60_usize, 2..60_usize), steps in (1..9_usize, 1..9_usize), seed in any::<u64>(),
        ) {
            let pixels = [pixels.0, pixels.1];
            let Ok(layout) = Layout::new(pixels, [1, 1], [steps.0 + 1, steps.1 + 1]) else {
                return Ok(());
            };
            let mut state = seed;
            let mut random = |top: usize| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 33) as f64 / (1_u64 << 31) as f64 * top as f64
            };
            let places = (0..layout.rows() * layout.cols()).map(|_| [random(pixels[0]), random(pixels[1])]).collect();
            let (net, _) = stitch(&Placed { places }, &layout, pixels, &Progress::none()).unwrap();
            let mut owner = vec![None; pixels[0] * pixels[1]];
            for i in 0..net.rows - 1 {
                for j in 0..net.cols - 1 {
                    let corners = net.corners(i, j).map(|v| net.sites[v].map(i64::from));
                    let last = [i + 2 == net.rows, j + 2 == net.cols];
                    for_each_row(corners, last, |row, start, end| {
                        for col in start..end {
                            assert_eq!(owner[row * pixels[1] + col].replace((i, j)), None, "pixel {row} {col}");
                            // Within the closed quad, by the signs of four areas.
                            for k in 0..4 {
                                let ([r0, c0], [r1, c1]) = (corners[k], corners[(k + 1) % 4]);
                                let (row, col) = (row as i64, col as i64);
                                assert!((c1 - c0) * (row - r0) - (r1 - r0) * (col - c0) >= 0);
                            }
                        }
                    });
                }
            }
            prop_assert!(owner.iter().all(Option::is_some));
        }
    }
}
