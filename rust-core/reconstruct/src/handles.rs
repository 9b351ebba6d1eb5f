//! Open surfaces, continued: handles that the samples force.
//!
//! A real handle is met all along a seam: two loops of the border face each other over many edges. What noise offers is met
//! at a few. So the facets that were refused vote, and loops that enough of them would join are joined.

use std::cmp::Reverse;

use super::grow::{Candidate, Fit, Front, Patience};
use base::error::Result;
use base::progress::{Pace, Progress};

/// Fewest vertices of either loop at which the other is met.
const VOTES: usize = 12;

/// No loop.
const NONE: u32 = u32::MAX;

impl<F: FnMut([u32; 3]) -> f64> Front<'_, F> {
    /// Joins the loops that enough facets speak for, and grows on from there.
    pub(super) fn join_loops(&mut self, progress: &Progress<'_>) -> Result<()> {
        while !self.refused.is_empty() {
            let (loop_of, count) = self.loops(progress)?;
            let mut seams = self.seams(&loop_of, progress)?;
            seams.retain(|seam| seam.votes >= VOTES);
            if seams.is_empty() {
                return Ok(());
            }
            seams.sort_by_key(|seam| Reverse(seam.votes));
            let mut is_joined = vec![false; count];
            self.patience = Patience::NextBest;
            for Seam { loops, contacts, .. } in seams {
                // Whether one of them meets another loop is another question once it is joined.
                if loops.iter().any(|&one| is_joined[one as usize]) {
                    continue;
                }
                loops.iter().for_each(|&one| is_joined[one as usize] = true);
                self.sew(&contacts);
            }
            self.run(0, progress)?;
        }
        Ok(())
    }

    /// Joins two loops at the best of their contacts, so that the others lie on one loop.
    fn sew(&mut self, contacts: &[Candidate]) {
        let mut is_sewn = false;
        for &Candidate { edge, apex, cell, .. } in contacts {
            self.refused.remove(&(edge, apex));
            let triangle = [edge[1], edge[0], apex];
            if is_sewn {
                self.enqueue(edge);
            } else if let Fit::WithTwin(twin, twin_cell) = self.fit(triangle, cell) {
                self.glue(triangle, cell, twin, twin_cell);
                is_sewn = true;
            }
        }
    }

    /// The loop of each vertex of the border, by number, and how many there are.
    fn loops(&self, progress: &Progress<'_>) -> Result<(Vec<u32>, usize)> {
        let mut loop_of = vec![NONE; self.complex.points.len()];
        let mut count = 0;
        let mut pace = Pace::new(progress);
        for first in 0..loop_of.len() as u32 {
            pace.after(1)?;
            let mut at = first;
            while loop_of[at as usize] == NONE
                && let Some(next) = self.border.next(at)
            {
                pace.after(1)?;
                loop_of[at as usize] = count;
                at = next;
            }
            count += u32::from(loop_of[first as usize] == count);
        }
        Ok((loop_of, count as usize))
    }

    /// Places where loops of one part meet.
    fn seams(&mut self, loop_of: &[u32], progress: &Progress<'_>) -> Result<Vec<Seam>> {
        let mut contacts: Vec<([u32; 2], Candidate)> = Vec::new();
        let mut pace = Pace::new(progress);
        let refused: Vec<([u32; 2], u32)> = self.refused.iter().copied().collect();
        for (edge, apex) in refused {
            pace.after(1)?;
            let loops = [loop_of[edge[0] as usize], loop_of[apex as usize]];
            if !self.border.has(edge) || loops.contains(&NONE) || loops[0] == loops[1] {
                continue;
            }
            let mut found = None;
            self.around(edge, |_, candidate| {
                if candidate.apex == apex {
                    found = Some(candidate);
                }
            });
            if let Some(found) = found.filter(|&found| self.is_trusted(found)) {
                contacts.push(([loops[0].min(loops[1]), loops[0].max(loops[1])], found));
            }
        }
        progress.sort(&mut contacts, &Ord::cmp)?;
        let seam = |same: &[([u32; 2], Candidate)]| {
            let loops = same[0].0;
            let contacts: Vec<Candidate> = same.iter().map(|contact| contact.1).collect();
            let mut met: Vec<u32> = contacts.iter().flat_map(|contact| [contact.edge[0], contact.apex]).collect();
            met.sort_unstable();
            met.dedup();
            let on_first = met.iter().filter(|&&vertex| loop_of[vertex as usize] == loops[0]).count();
            Seam { loops, votes: on_first.min(met.len() - on_first), contacts }
        };
        Ok(contacts.chunk_by(|a, b| a.0 == b.0).map(seam).collect())
    }
}

/// A place where two loops of the border meet.
struct Seam {
    /// The lower number first.
    loops: [u32; 2],
    /// Vertices at which they meet, of the loop with fewer.
    votes: usize,
    /// The best first.
    contacts: Vec<Candidate>,
}
