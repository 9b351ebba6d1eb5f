//! Size of the net, and number of patches, that a resolution takes.

use super::driver::{Disks, Job};
use super::kmeans::KMeans;
use super::net::Size;
use super::params::Resolution;
use super::polish;
use super::surface::NONE;
use base::error::Result;
use base::progress::Progress;

/// Tries for a number of vertices, or of triangles.
const TRIES: usize = 8;
/// Nodes more than wanted, at most, that are collapsed. Of many it may be a share.
const SPARE: usize = 24;
const SPARE_SHARE: usize = 16;

impl<'a> Job<'a> {
    /// Patches for a resolution. `None` for a bound on the error.
    pub(super) fn patches(&self, resolution: Resolution) -> Option<usize> {
        let patches = match (resolution, self.wanted(resolution)) {
            (Resolution::Patches(k), _) => k as usize,
            (_, Some(wanted)) => self.patches_for(self.made(wanted)),
            _ => return None,
        };
        Some(patches.clamp(1, self.surface.points.len()))
    }

    /// The size that is sought. A patch has at least one of the input's vertices, and three nodes and six triangles in the middle of a
    /// surface.
    pub(super) fn wanted(&self, resolution: Resolution) -> Option<Size> {
        let points = self.surface.points.len();
        match resolution {
            Resolution::Vertices(n) => Some(Size::Nodes((n as usize).min(3 * points))),
            Resolution::Triangles(n) => Some(Size::Triangles((n as usize).min(6 * points))),
            Resolution::Tenth => Some(Size::Nodes(points / 10)),
            Resolution::Patches(_) | Resolution::MaxError(_) => None,
        }
    }

    /// The size that patches make for the one that is sought: with a least angle the best of more nodes are kept.
    pub(super) fn made(&self, wanted: Size) -> Size {
        let spare = if self.params.min_angle > 0.0 { polish::SPARE } else { 1 };
        wanted.of((spare * wanted.count()).min(wanted.choose(3, 6) * self.surface.points.len()))
    }

    /// Patches whose fans have about this size: three nodes and six triangles per patch. At the border a patch has a node more, which
    /// takes the place of a triangle.
    fn patches_for(&self, wanted: Size) -> usize {
        let surface = &self.surface;
        let nodes = match wanted {
            Size::Nodes(nodes) => nodes,
            Size::Triangles(triangles) => return triangles.div_ceil(6) + 1,
        };
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

    /// Patches whose fans have at least the size that is wanted and little more, if the topology lets them. They are sought from `disks`, which came
    /// from `patches` patches.
    pub(super) fn with_nodes(
        &self,
        coarser: &KMeans<'a>,
        kmeans: &mut KMeans<'a>,
        mut disks: Disks,
        mut patches: usize,
        wanted: Size,
        progress: &Progress<'_>,
    ) -> Result<Disks> {
        let most = self.surface.points.len();
        // The fewest patches that are enough, the most that are too few.
        let (mut enough, mut too_few): (Option<(usize, KMeans<'a>, Disks)>, usize) = (None, 0);
        for _ in 0..TRIES {
            let (have, least) = (disks.size(wanted), wanted.count());
            if have >= least {
                let close = have <= least + (least / SPARE_SHARE).max(wanted.choose(1, 2) * SPARE);
                if enough.as_ref().is_none_or(|e| patches < e.0) {
                    enough = Some((patches, kmeans.clone(), disks));
                }
                if close {
                    break;
                }
            } else {
                too_few = too_few.max(patches);
            }
            let share = least as f64 / have as f64;
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
