//! What scans see through, block by block: voters are loaded in batches, each once, and what they say of a block is added up in a file.

use rayon::prelude::*;

use super::blocks::{Blocks, in_bundle};
use super::files::{Columns, Place, Stored};
use super::setting::{Portion, Setting};
use crate::LOOKING;
use crate::intake::Discretized;
use crate::lattice::{BRICK, BRICK_BITS, Lattice};
use crate::sight::{self, is_through, lines_of_sight};
use base::error::{Error, Result};
use base::progress::Progress;
use glam::DVec3;
use image::range_image::noise::Noise;
use image::sight::{LinesOfSight, Seen};
use image::source::ScanSource;

/// How many see a surface at a tally, and through it.
type Votes = [u8; 2];

/// What the votes of a portion of the voters are called.
fn kind(portion: u32) -> String {
    format!("votes-{portion}")
}

/// Asks a portion of the scans that have lines of sight about all blocks. Surfaces may be off by `tolerance`, in world units.
///
/// # Errors
/// A scan can't be loaded any more; a file can't be read or written; cancelled.
pub fn look(
    blocks: &Blocks,
    sources: &[&dyn ScanSource],
    found: &Discretized,
    tolerance: f64,
    portion: Portion,
    setting: &Setting<'_>,
    progress: &Progress<'_>,
) -> Result<()> {
    let voters: Vec<(u32, &Noise)> =
        portion.every(sight::voters(&found.images)).into_iter().map(|voter| voter.1).collect();
    if voters.is_empty() {
        return Ok(());
    }
    progress.stage(LOOKING, voters.len() as u64);
    let list: Vec<[i32; 3]> = blocks.list().collect();
    // Another who is at the same work batches them otherwise, perhaps.
    let own = tempfile::Builder::new().prefix("unfinished-").tempdir_in(setting.folder);
    let own = own.map_err(|error| Error::io(setting.folder, error))?;
    let path = |number: usize| own.path().join(format!("{number:06}"));
    let mut is_voted = vec![false; list.len()];
    let mut rest = &voters[..];
    while !rest.is_empty() {
        let mut sights: Vec<LinesOfSight> = Vec::new();
        // As many as may be held, and no fewer than there are threads.
        loop {
            let (now, later) = rest.split_at(rayon::current_num_threads().min(rest.len()));
            rest = later;
            let load = |&(scan, noise): &(u32, _)| {
                progress.advance(1)?;
                lines_of_sight(sources[scan as usize], noise, progress)
            };
            let loaded = now.par_iter().with_max_len(1).map(load).collect::<Result<Vec<_>>>()?;
            sights.extend(loaded.into_iter().flatten());
            let held: u64 = sights.iter().map(LinesOfSight::bytes).sum();
            if rest.is_empty() || held >= setting.held {
                break;
            }
        }
        let looking = Looking { sights: &sights, lattice: &found.lattice, tolerance };
        let ask = |(number, block): (usize, &[i32; 3])| {
            progress.check()?;
            let before = is_voted[number].then(|| path(number));
            let Some(votes) = looking.at(*block, setting.cut.side, blocks, before.as_deref())? else {
                return Ok(is_voted[number]);
            };
            let mut file = Columns::new(&path(number))?;
            let place = file.put(&votes)?;
            file.finish(&[place])?;
            Ok(true)
        };
        is_voted = list.par_iter().enumerate().with_max_len(1).map(ask).collect::<Result<_>>()?;
    }
    for number in (0..list.len()).filter(|&number| is_voted[number]) {
        let name = setting.path(&kind(portion.number), number as u32);
        std::fs::rename(path(number), &name).map_err(|error| Error::io(&name, error))?;
    }
    Ok(())
}

/// Drops of a portion of the blocks what scans see through, by the votes of so many portions; gives the number of tallies dropped.
///
/// # Errors
/// A file can't be read or written; cancelled.
pub fn drop_seen_through(
    blocks: &Blocks,
    portions: u32,
    portion: Portion,
    setting: &Setting<'_>,
    progress: &Progress<'_>,
) -> Result<u64> {
    let drop = |(number, block): (usize, [i32; 3])| {
        progress.check()?;
        let mut all: Vec<Votes> = Vec::new();
        for of in 0..portions {
            let path = setting.path(&kind(of), number as u32);
            if !path.exists() {
                continue;
            }
            let votes = read(&path)?;
            all.resize(votes.len(), [0; 2]);
            for (all, votes) in all.iter_mut().zip(votes) {
                (0..2).for_each(|way| all[way] = all[way].saturating_add(votes[way]));
            }
        }
        let goes = |votes: &Votes| is_through(votes[1].into(), votes[0].into());
        let gone = all.iter().filter(|votes| goes(votes)).count() as u64;
        if gone > 0 {
            let mut votes = all.iter();
            let mut bricks = blocks.read(block)?;
            bricks
                .iter_mut()
                .flat_map(|brick| &mut brick.1)
                .for_each(|list| list.retain(|_| !votes.next().is_some_and(goes)));
            bricks.retain(|brick| brick.1.iter().any(|list| !list.is_empty()));
            blocks.write_left(number, bricks, setting)?;
        }
        Ok(gone)
    };
    portion.every(blocks.list().collect()).into_par_iter().with_max_len(1).map(drop).sum()
}

/// Removes all votes.
///
/// # Errors
/// A file can't be removed.
pub fn remove(portions: u32, setting: &Setting<'_>) -> Result<()> {
    (0..portions).try_for_each(|portion| setting.remove(&kind(portion)))
}

fn read(path: &std::path::Path) -> Result<Vec<Votes>> {
    let (stored, table) = Stored::open::<Place>(path)?;
    stored.get(&table[0])
}

/// Those who are asked.
struct Looking<'a> {
    sights: &'a [LinesOfSight],
    lattice: &'a Lattice,
    tolerance: f64,
}

impl Looking<'_> {
    /// The votes on the tallies of a block, in the order of its file, with those before; nothing where none sees any of it.
    fn at(
        &self,
        block: [i32; 3],
        side: i32,
        blocks: &Blocks,
        before: Option<&std::path::Path>,
    ) -> Result<Option<Vec<Votes>>> {
        let half = 0.5 * f64::from(BRICK) * f64::from(side) * self.lattice.voxel;
        let centre = self.lattice.world(block.map(|at| (at * side) << BRICK_BITS), 0, 0.0) + DVec3::splat(half);
        let radius = 3.0_f64.sqrt() * half + self.tolerance;
        let sights: Vec<&LinesOfSight> = self.sights.iter().filter(|sight| sight.may_see(centre, radius)).collect();
        if sights.is_empty() {
            return Ok(None);
        }
        let bricks = blocks.read(block)?;
        let count = bricks.iter().flat_map(|brick| &brick.1).map(Vec::len).sum();
        let mut votes = match before {
            Some(path) => read(path)?,
            None => vec![[0; 2]; count],
        };
        let mut first = 0;
        let mut is_any = false;
        for (brick, lists) in bricks {
            for (axis, list) in lists.into_iter().enumerate() {
                let bundle = in_bundle(brick, axis, list);
                for sight in &sights {
                    sight::look(sight, &bundle, self.lattice, self.tolerance, |tally, seen| {
                        is_any = true;
                        let vote = &mut votes[first + tally][usize::from(seen == Seen::Through)];
                        *vote = vote.saturating_add(1);
                    });
                }
                first += bundle.list.len();
            }
        }
        Ok(is_any.then_some(votes))
    }
}
