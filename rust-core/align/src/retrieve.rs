//! Scans that may touch: those whose points look like each other most often.

use rayon::prelude::*;

use crate::features::{Descriptor, difference};
use crate::view::View;
use base::error::Result;
use base::progress::Progress;

/// Points of each scan that look for others. Fewer of many scans, so that the cost, which grows with the square, stays bounded.
const SAMPLES: usize = 100;
const ALL_SAMPLES: usize = 20_000;
/// Points of other scans that each votes for.
const VOTES: usize = 6;

/// How often points of one scan look most like points of the other: a row a scan. O((scans x samples)^2).
pub(crate) fn likeness(views: &[View], progress: &Progress<'_>) -> Result<Vec<Vec<f64>>> {
    let samples = SAMPLES.min(ALL_SAMPLES / views.len()).max(10);
    views.par_iter().try_for_each(|view| {
        view.features();
        progress.check()
    })?;
    let mut entries: Vec<(usize, &Descriptor)> = Vec::new();
    for (scan, view) in views.iter().enumerate() {
        let all = &view.features().descriptors;
        let step = (all.len() as f64 / samples as f64).max(1.0);
        let picked = (all.len() as f64 / step) as usize;
        entries.extend((0..picked).map(|k| (scan, &all[((k as f64 + 0.5) * step) as usize])));
    }
    let votes = entries.par_iter().map(|&(scan, mine)| {
        progress.check()?;
        let mut best = [(u32::MAX, usize::MAX); VOTES];
        for &(other, theirs) in &entries {
            if other != scan {
                let d = difference(mine, theirs);
                if d < best[VOTES - 1].0 {
                    let place = best.partition_point(|entry| entry.0 <= d);
                    best[place..].rotate_right(1);
                    best[place] = (d, other);
                }
            }
        }
        Ok((scan, best))
    });
    let mut counts = vec![vec![0.0_f64; views.len()]; views.len()];
    for (scan, best) in votes.collect::<Result<Vec<_>>>()? {
        for (rank, (_, other)) in best.into_iter().enumerate().filter(|(_, entry)| entry.1 != usize::MAX) {
            let vote = 1.0 / (1.0 + rank as f64);
            counts[scan][other] += vote;
            counts[other][scan] += vote;
        }
    }
    Ok(counts)
}
