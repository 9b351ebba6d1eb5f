//! Number of patches that a resolution takes.

use super::driver::{Disks, Job};
use super::kmeans::KMeans;
use super::params::Resolution;
use super::polish;
use super::surface::NONE;
use base::error::Result;
use base::progress::Progress;

/// Tries for a number of vertices.
const TRIES: usize = 8;

impl<'a> Job<'a> {
    /// Patches for a resolution. `None` for a bound on the error.
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

    /// Patches whose fans have about `nodes` nodes: three per patch, and one more for each at the border.
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

    /// Patches whose fans have at least `wanted` nodes and few more, if the topology lets them. They are sought from `disks`, which came
    /// from `patches` patches.
    pub(super) fn with_nodes(
        &self,
        coarser: &KMeans<'a>,
        kmeans: &mut KMeans<'a>,
        mut disks: Disks,
        mut patches: usize,
        wanted: usize,
        progress: &Progress<'_>,
    ) -> Result<Disks> {
        let most = self.surface.points.len();
        // The fewest patches with enough nodes, the most with too few.
        let (mut enough, mut too_few): (Option<(usize, KMeans<'a>, Disks)>, usize) = (None, 0);
        for _ in 0..TRIES {
            let have = disks.nodes();
            if have >= wanted {
                // These few are collapsed.
                let close = have <= wanted + (wanted / 16).max(24);
                if enough.as_ref().is_none_or(|e| patches < e.0) {
                    enough = Some((patches, kmeans.clone(), disks));
                }
                if close {
                    break;
                }
            } else {
                too_few = too_few.max(patches);
            }
            let share = wanted as f64 / have as f64;
            let next = (patches as f64 * share).ceil() as usize + 1;
            patches = match &enough {
                Some((above, ..)) if next <= too_few || next >= *above => (too_few + above) / 2,
                None if next <= too_few => 2 * too_few,
                _ => next,
            };
            if patches <= too_few || enough.as_ref().is_some_and(|e| patches >= e.0) || too_few == most {
                break;
            }
            patches = patches.min(most);
            disks = self.disks(coarser, kmeans, patches, progress)?;
        }
        Ok(match enough {
            Some((_, found, disks)) => {
                *kmeans = found;
                disks
            }
            None => self.repaired(kmeans, progress)?,
        })
    }
}
