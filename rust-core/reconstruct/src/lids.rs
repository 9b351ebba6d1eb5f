//! Open surfaces, continued: small loops of the border are closed, and crumbs left out.

use rustc_hash::FxHashMap;

use super::facet_scale::BRIDGED;
use super::grow::Front;
use base::error::Result;
use base::progress::{Pace, Progress};
use mesh::holes::close_over_loops;

/// Fewest triangles of a part for each edge of a loop that is closed: else the loop goes around the part, not around a hole.
const AROUND: usize = 4;

/// A loop is small, too, if it is at most this share of the whole border of its part ...
const SHARE: f64 = 0.125;
/// ... and so many times as long as the perimeter of a facet may be.
const LONGEST: f64 = 16.0;

/// Parts of fewer triangles that no facet joins to others are crumbs: samples of five by five or so.
const CRUMB: usize = 64;

/// Size of a part.
#[derive(Clone, Copy, Default)]
struct Size {
    triangles: usize,
    border: f64,
}

/// By part.
type Sizes = FxHashMap<u32, Size>;

impl<F: FnMut([u32; 3]) -> f64> Front<'_, F> {
    /// The triangles, with loops closed that are at most `times` as long as the perimeter of a facet may be. If `is_joined`, also longer
    /// ones of large parts, and without crumbs beside other parts.
    pub(super) fn close_loops(mut self, times: u32, is_joined: bool, progress: &Progress<'_>) -> Result<Vec<[u32; 3]>> {
        let (border, sizes) = self.measure(progress)?;
        let (points, lines) = (self.complex.points, self.lines);
        let is_wanted = |lid: &[[u32; 3]]| {
            progress.check()?;
            let spans_jump = lines.are_deep(points, lid) && lid.iter().any(|&facet| lines.is_jump(points, facet));
            Ok(!spans_jump && !lid.iter().any(|&facet| lines.pass(points, facet)))
        };
        let triangles = std::mem::take(&mut self.triangles);
        let limit = |hole: &[u32]| {
            let size = sizes[&self.part(hole[0])];
            if size.triangles < AROUND * hole.len() {
                return 0.0;
            }
            let allowed = hole.iter().map(|&v| (self.allowed)([v; 3])).sum::<f64>() / hole.len() as f64;
            // Three samples bound no gap, even if gaps stay open.
            let times = if hole.len() == 3 { times.max(BRIDGED) } else { times };
            let longer = if is_joined { (SHARE * size.border).min(LONGEST * allowed) } else { 0.0 };
            longer.max(f64::from(times) * allowed)
        };
        let mut triangles = close_over_loops(points, triangles, &border, limit, is_wanted, progress)?;
        if is_joined && sizes.len() > 1 {
            let most = sizes.values().map(|size| size.triangles).max().unwrap_or(0).min(CRUMB);
            triangles.retain(|triangle| sizes[&self.part(triangle[0])].triangles >= most);
        }
        Ok(triangles)
    }

    /// The border's edges, and how large each part is.
    fn measure(&mut self, progress: &Progress<'_>) -> Result<(Vec<[u32; 2]>, Sizes)> {
        let mut pace = Pace::new(progress);
        let mut sizes = Sizes::default();
        for triangle in 0..self.triangles.len() {
            pace.after(1)?;
            let part = self.part(self.triangles[triangle][0]);
            sizes.entry(part).or_default().triangles += 1;
        }
        let mut border = Vec::new();
        for from in 0..self.complex.points.len() as u32 {
            pace.after(1)?;
            if let Some(to) = self.border.next(from) {
                let [a, b] = [from, to].map(|vertex| self.complex.points[vertex as usize]);
                sizes.entry(self.part(from)).or_default().border += a.distance(b);
                border.push([from, to]);
            }
        }
        Ok((border, sizes))
    }
}
