//! How many patches a resolution takes.

use super::driver::Job;
use super::surface::NONE;
use super::{Resolution, polish};

impl Job<'_> {
    /// Patches for a resolution; `None` for a bound on the error.
    pub(super) fn patches(&self, resolution: Resolution) -> Option<usize> {
        let patches = match resolution {
            Resolution::Patches(k) => k as usize,
            Resolution::Vertices(n) => self.patches_for(self.made(self.nodes(n))),
            Resolution::Tenth => self.patches_for(self.made(self.surface.points.len() / 10)),
            Resolution::MaxError(_) => return None,
        };
        Some(patches.clamp(1, self.surface.points.len()))
    }

    /// Vertices that are sought: a patch has at least one of the input's, and three nodes in the middle of a surface.
    pub(super) fn nodes(&self, asked: u32) -> usize {
        (asked as usize).min(3 * self.surface.points.len())
    }

    /// Nodes that patches make for those that are sought: with a least angle the best of more are kept.
    pub(super) fn made(&self, nodes: usize) -> usize {
        let spare = if self.params.min_angle > 0.0 { polish::SPARE } else { 1 };
        (spare * nodes).min(3 * self.surface.points.len())
    }

    /// Patches whose fans have about `nodes` nodes: three a patch, and one more for each at the border.
    fn patches_for(&self, nodes: usize) -> usize {
        let surface = &self.surface;
        let area: f64 = surface.areas.iter().sum();
        let border: f64 = surface
            .border_in
            .iter()
            .filter(|&&h| h != NONE)
            .map(|&h| surface.points[surface.from(h) as usize].distance(surface.points[surface.to(h) as usize]))
            .sum();
        let n = nodes as f64;
        let mut patches = n / 3.0;
        for _ in 0..8 {
            let width = 1.1 * (area / patches).sqrt();
            let at_border = if width > 0.0 { border / width } else { 0.0 };
            patches = ((n - at_border) / 3.0).max(n / 12.0);
        }
        patches.ceil() as usize + 1
    }
}
