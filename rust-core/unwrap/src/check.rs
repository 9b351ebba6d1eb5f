//! Faults of texture coordinates, by exact signs: independent of how they were made.

use glam::DVec2;
use rayon::prelude::*;

use base::error::{Error, Result};
use base::progress::Progress;
use geom::predicates::orient2d;

/// Triangles looked at between two checks for cancelling.
const BLOCK: usize = 256;

/// The faults that were found.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct UvReport {
    /// Triangles that turn clockwise, ascending.
    pub flipped: Vec<u32>,
    /// Triangles whose corners lie on a line, ascending.
    pub without_area: Vec<u32>,
    /// Pairs of triangles whose insides meet, each the smaller number first, ascending.
    pub overlapping: Vec<[u32; 2]>,
}

impl UvReport {
    /// Whether no triangle is flipped and no two overlap.
    pub fn is_sound(&self) -> bool {
        self.flipped.is_empty() && self.overlapping.is_empty()
    }
}

/// Checks triangles in the plane: 0 flips and 0 overlaps are meant as written, for the coordinates as they are.
///
/// # Cost
/// O(n log n) time where triangles are of like size, one exact test per pair whose boxes meet.
///
/// # Errors
/// [`Error::Input`] for a coordinate that is not finite or a corner out of range. [`Error::Cancelled`].
pub fn check(uv: &[DVec2], triangles: &[[u32; 3]], progress: &Progress<'_>) -> Result<UvReport> {
    if let Some(v) = uv.iter().position(|at| !at.is_finite()) {
        return Err(Error::input(format!("texture coordinate {v} is ({}, {}), but must be finite", uv[v].x, uv[v].y)));
    }
    if let Some(t) = triangles.iter().position(|t| t.iter().any(|&v| v as usize >= uv.len())) {
        let count = uv.len();
        return Err(Error::input(format!("triangle {t} names a texture coordinate beyond the {count} there are")));
    }
    let corners = |t: u32| triangles[t as usize].map(|v| uv[v as usize]);
    let mut report = UvReport::default();
    let mut sound = Vec::new();
    for block in progress.ranges(triangles.len()) {
        for t in block?.map(|t| t as u32) {
            let [a, b, c] = corners(t);
            match orient2d(a, b, c) {
                0 => report.without_area.push(t),
                -1 => report.flipped.push(t),
                _ => sound.push(t),
            }
        }
    }
    // A flipped triangle covers what it covers.
    let turned = |t: u32| {
        let [a, b, c] = corners(t);
        if orient2d(a, b, c) < 0 { [a, c, b] } else { [a, b, c] }
    };
    sound.extend(&report.flipped);
    let grid = Grid::new(&sound, &corners, progress)?;
    let rows: Vec<Result<Vec<[u32; 2]>>> = (0..grid.cells())
        .into_par_iter()
        .with_min_len(64)
        .map(|cell| {
            let mut found = Vec::new();
            let there = grid.of(cell);
            for (i, &s) in there.iter().enumerate() {
                if i % BLOCK == 0 {
                    progress.check()?;
                }
                for &t in &there[i + 1..] {
                    if grid.is_first(cell, corners(s), corners(t)) && insides_meet(turned(s), turned(t)) {
                        found.push([s.min(t), s.max(t)]);
                    }
                }
            }
            Ok(found)
        })
        .collect();
    for row in rows {
        report.overlapping.extend(row?);
    }
    report.overlapping.sort_unstable();
    Ok(report)
}

/// Whether the insides of two triangles have a point in common, both turning counter-clockwise. They have none if a line along
/// an edge of one has the other on its far side.
pub fn insides_meet(s: [DVec2; 3], t: [DVec2; 3]) -> bool {
    let parted =
        |s: &[DVec2; 3], t: &[DVec2; 3]| (0..3).any(|k| t.iter().all(|&p| orient2d(s[k], s[(k + 1) % 3], p) <= 0));
    !parted(&s, &t) && !parted(&t, &s)
}

/// Triangles by the cells of a grid that their boxes meet.
struct Grid {
    low: DVec2,
    cell: f64,
    columns: usize,
    rows: usize,
    start: Vec<usize>,
    triangles: Vec<u32>,
}

impl Grid {
    fn new(triangles: &[u32], corners: &impl Fn(u32) -> [DVec2; 3], progress: &Progress<'_>) -> Result<Self> {
        let (mut low, mut high, mut sides) = (DVec2::INFINITY, DVec2::NEG_INFINITY, 0.0);
        for &t in triangles {
            let (lo, hi) = bounds(corners(t));
            (low, high) = (low.min(lo), high.max(hi));
            sides += (hi - lo).max_element();
        }
        let span = if triangles.is_empty() { DVec2::ONE } else { high - low };
        // As large as triangles are in the mean; not more cells than a few per triangle.
        let most = (4.0 * triangles.len() as f64).max(16.0);
        let least = (span.x * span.y / most).sqrt().max(span.max_element() / most);
        let mut grid = Grid {
            low,
            cell: (sides / triangles.len().max(1) as f64).max(least).max(f64::MIN_POSITIVE),
            columns: 1,
            rows: 1,
            start: Vec::new(),
            triangles: Vec::new(),
        };
        let count = |span: f64| ((span / grid.cell) as usize).min(most as usize) + 1;
        (grid.columns, grid.rows) = (count(span.x), count(span.y));
        let mut entries = Vec::new();
        for (i, &t) in triangles.iter().enumerate() {
            if i % BLOCK == 0 {
                progress.check()?;
            }
            let (lo, hi) = bounds(corners(t));
            let ([left, bottom], [right, top]) = (grid.place(lo), grid.place(hi));
            for row in bottom..=top {
                entries
                    .extend((left..=right).map(|column| ((row * grid.columns + column) as u64) << 32 | u64::from(t)));
            }
        }
        progress.sort(&mut entries, &|a: &u64, b: &u64| a.cmp(b))?;
        grid.start = vec![0; grid.cells() + 1];
        for entry in &entries {
            grid.start[(entry >> 32) as usize + 1] += 1;
        }
        for cell in 0..grid.cells() {
            grid.start[cell + 1] += grid.start[cell];
        }
        grid.triangles = entries.into_iter().map(|entry| entry as u32).collect();
        Ok(grid)
    }

    fn cells(&self) -> usize {
        self.columns * self.rows
    }

    fn of(&self, cell: usize) -> &[u32] {
        &self.triangles[self.start[cell]..self.start[cell + 1]]
    }

    fn place(&self, at: DVec2) -> [usize; 2] {
        let within = (at - self.low) / self.cell;
        [(within.x as usize).min(self.columns - 1), (within.y as usize).min(self.rows - 1)]
    }

    /// Whether their boxes meet, and this is the cell of the lowest corner that they share: each pair is tested once.
    fn is_first(&self, cell: usize, s: [DVec2; 3], t: [DVec2; 3]) -> bool {
        let ((s_low, s_high), (t_low, t_high)) = (bounds(s), bounds(t));
        if s_high.x < t_low.x || t_high.x < s_low.x || s_high.y < t_low.y || t_high.y < s_low.y {
            return false;
        }
        let [column, row] = self.place(s_low.max(t_low));
        row * self.columns + column == cell
    }
}

fn bounds([a, b, c]: [DVec2; 3]) -> (DVec2, DVec2) {
    (a.min(b).min(c), a.max(b).max(c))
}
