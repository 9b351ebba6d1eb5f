//! Facets above the threshold that are no gap: few beside each other, with the surface all around them.
//!
//! Samples at random leave some facets larger than any factor. Nobody left out on purpose what a few samples bound.

use rustc_hash::{FxHashMap, FxHashSet};

use super::facet_scale::BRIDGED;
use super::params::Closure;
use base::error::Result;
use base::progress::Progress;

/// Edges of a hole that is closed at most: of four facets, or of six around a sample.
const FEW: usize = 6;
/// ... and where gaps stay open: of a facet alone.
const FEWEST: usize = 3;

/// Adds to what is `kept` of a surface those facets left out of it that bound no gap. `sizes`: of these the perimeter, and the largest that
/// is allowed.
pub(super) fn close_small(
    kept: &mut Vec<[u32; 3]>,
    left_out: &[[u32; 3]],
    mut sizes: impl FnMut([u32; 3]) -> [f64; 2],
    closure: Closure,
    progress: &Progress<'_>,
) -> Result<()> {
    let most = if closure == Closure::Open { FEWEST } else { FEW };
    // Of each edge, how many of these facets have it, and the first and the last of them.
    let mut sides: FxHashMap<[u32; 2], (u32, [usize; 2])> = FxHashMap::default();
    for (number, facet) in left_out.iter().enumerate() {
        progress.check()?;
        for edge in edges(*facet) {
            let (count, ends) = sides.entry(edge).or_insert((0, [number; 2]));
            (*count, ends[1]) = (*count + 1, number);
        }
    }
    // Edges between what is kept and what is not.
    let mut inner: FxHashSet<[u32; 2]> = FxHashSet::default();
    for range in progress.ranges(kept.len()) {
        inner.extend(kept[range?].iter().flat_map(|facet| edges(*facet)).filter(|edge| sides.contains_key(edge)));
    }
    let mut is_seen = vec![false; left_out.len()];
    let mut part = Vec::new();
    for first in 0..left_out.len() {
        progress.check()?;
        if std::mem::replace(&mut is_seen[first], true) {
            continue;
        }
        part.clear();
        part.push(first);
        let (mut next, mut around, mut is_hole) = (0, 0, true);
        while next < part.len() {
            let facet = left_out[part[next]];
            let [perimeter, allowed] = sizes(facet);
            is_hole &= perimeter <= f64::from(BRIDGED) * allowed;
            for edge in edges(facet) {
                match sides[&edge] {
                    (1, _) => {
                        around += 1;
                        is_hole &= inner.contains(&edge);
                    }
                    (2, ends) => {
                        part.extend(ends.into_iter().filter(|&other| !std::mem::replace(&mut is_seen[other], true)));
                    }
                    _ => is_hole = false,
                }
            }
            next += 1;
        }
        if is_hole && around <= most {
            kept.extend(part.iter().map(|&facet| left_out[facet]));
        }
    }
    Ok(())
}

fn edges([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]].map(|[from, to]| [from.min(to), from.max(to)])
}
