//! Crossings that scans see through. Each scan that votes has a file with what it sees at the sums of each block. Voters are loaded in
//! batches, which blocks are read for once.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

use super::blocks::{self, Blocks, in_bundle};
use super::files::{Columns, Place, Stored};
use super::setting::{Key, Named, Portion, Setting};
use crate::crossings::lattice::{BRICK, BRICK_BITS, Lattice};
use crate::crossings::scan_order::ScanOrder;
use crate::intake::Discretized;
use crate::stages::LOOKING;
use crate::visibility::eyes::lines_of_sight;
use crate::visibility::{self, is_through};
use base::error::Result;
use base::progress::Progress;
use glam::DVec3;
use image::range_image::noise::Noise;
use image::visibility::{LinesOfSight, Seen};

/// Sight of a scan at an edge: nothing, a surface, or through it.
type Vote = u8;
const SURFACE: Vote = 1;
const THROUGH: Vote = 2;

/// By block, whether a scan may see any of it, and its votes.
type Answers = BTreeMap<[i32; 3], (bool, Vec<Vote>)>;

/// Kind of files of votes.
pub const KIND: &str = "votes";

/// Questions to a scan about a block.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Asked {
    block: [i32; 3],
    /// Whether it may see any of the block, whatever is in it.
    may_see: u32,
    /// The block's.
    key: Key,
    /// A vote per edge, in the order of the block's file. Nothing where it sees none.
    votes: Place,
}

/// Scans that vote: all that have lines of sight, or as many as are asked.
pub struct Voters<'a> {
    /// Numbers and noise.
    list: Vec<(u32, &'a Noise)>,
    /// All scans.
    scan_order: &'a ScanOrder<'a>,
    /// Basis that votes follow from besides scan and block.
    basis: Key,
    lattice: &'a Lattice,
    /// Possible error of surfaces, in world units.
    tolerance: f64,
}

impl<'a> Voters<'a> {
    /// `basis` is what crossings follow from.
    pub fn new(found: &'a Discretized, scan_order: &'a ScanOrder<'a>, basis: Key, tolerance: f64) -> Self {
        let basis = Key::of(&(basis, tolerance.to_bits()));
        Voters { list: visibility::voters(&found.images), scan_order, basis, lattice: &found.lattice, tolerance }
    }

    /// The files of all of them.
    pub fn paths(&self, setting: &Setting<'_>) -> Vec<PathBuf> {
        self.list.iter().map(|voter| self.path(voter.0, setting)).collect()
    }

    fn path(&self, number: u32, setting: &Setting<'_>) -> PathBuf {
        setting.path(KIND, Key::of(&(self.basis, self.scan_order.version(number))))
    }

    /// Asks a portion of them about all blocks, as far as they were not asked.
    ///
    /// # Errors
    /// A scan can't be loaded any more. A file can't be read or written. Cancelled.
    pub fn look(
        &self,
        blocks: &Blocks,
        portion: Portion,
        setting: &Setting<'_>,
        progress: &Progress<'_>,
    ) -> Result<()> {
        let own = portion.every(self.list.clone());
        if own.is_empty() {
            return Ok(());
        }
        progress.stage(LOOKING, own.len() as u64);
        let mut todo = Vec::new();
        for &(scan, noise) in &own {
            let ballot = Ballot::open(&self.path(scan, setting))?;
            let open = ballot.open_questions(blocks);
            if open.is_empty() {
                progress.advance(1)?;
            } else {
                todo.push((scan, noise, ballot, open));
            }
        }
        let mut rest = todo.into_iter().peekable();
        while rest.peek().is_some() {
            let mut batch = Vec::new();
            // As many as may be held, and no fewer than there are threads.
            loop {
                let now: Vec<_> = rest.by_ref().take(rayon::current_num_threads()).collect();
                let load = |(scan, noise, ballot, open): (u32, &Noise, Ballot, Vec<[i32; 3]>)| {
                    progress.advance(1)?;
                    let sight = lines_of_sight(self.scan_order, scan, noise, progress)?;
                    Ok(Asking { path: self.path(scan, setting), sight, ballot, open })
                };
                batch.extend(now.into_par_iter().with_max_len(1).map(load).collect::<Result<Vec<_>>>()?);
                let sights = batch.iter().filter_map(|asking: &Asking| asking.sight.as_ref());
                if rest.peek().is_none() || sights.map(LinesOfSight::bytes).sum::<u64>() >= setting.held {
                    break;
                }
            }
            self.ask(batch, blocks, setting, progress)?;
        }
        Ok(())
    }

    /// Asks some at once, and writes what they see.
    fn ask(&self, batch: Vec<Asking>, blocks: &Blocks, setting: &Setting<'_>, progress: &Progress<'_>) -> Result<()> {
        let mut open: Vec<[i32; 3]> = batch.iter().flat_map(|asking| asking.open.iter().copied()).collect();
        open.sort_unstable();
        open.dedup();
        let half = 0.5 * f64::from(BRICK) * f64::from(setting.cut.side) * self.lattice.voxel;
        let radius = 3.0_f64.sqrt() * half + self.tolerance;
        let about = |&block: &[i32; 3]| {
            progress.check()?;
            let low = block.map(|at| (at * setting.cut.side) << BRICK_BITS);
            let centre = self.lattice.world(low, 0, 0.0) + DVec3::splat(half);
            let asked: Vec<(usize, Option<&LinesOfSight>)> = (0..)
                .zip(&batch)
                .filter(|asking| asking.1.open.binary_search(&block).is_ok())
                .map(|(voter, asking)| (voter, asking.sight.as_ref().filter(|sight| sight.may_see(centre, radius))))
                .collect();
            let bricks = if asked.iter().any(|of| of.1.is_some()) { blocks.read(block)? } else { Vec::new() };
            let count = bricks.iter().flat_map(|brick| &brick.1).map(Vec::len).sum();
            let mut votes: Vec<(usize, bool, Vec<Vote>)> = asked
                .iter()
                .map(|&(voter, sight)| (voter, sight.is_some(), vec![0; if sight.is_some() { count } else { 0 }]))
                .collect();
            let mut first = 0;
            for (brick, lists) in bricks {
                for (axis, list) in lists.into_iter().enumerate() {
                    let bundle = in_bundle(brick, axis, list);
                    for (&(_, sight), (_, _, votes)) in asked.iter().zip(&mut votes) {
                        let Some(sight) = sight else { continue };
                        visibility::look(sight, &bundle, self.lattice, self.tolerance, |edge, seen| {
                            votes[first + edge] = if seen == Seen::Through { THROUGH } else { SURFACE };
                        });
                    }
                    first += bundle.list.len();
                }
            }
            Ok((block, votes))
        };
        let mut seen: Vec<Answers> = batch.iter().map(|_| BTreeMap::new()).collect();
        for (block, votes) in open.par_iter().with_max_len(1).map(about).collect::<Result<Vec<_>>>()? {
            for (voter, may_see, votes) in votes {
                seen[voter].insert(block, (may_see, votes));
            }
        }
        batch.into_iter().zip(seen).try_for_each(|(asking, seen)| asking.ballot.write(&asking.path, blocks, &seen))
    }

    /// Drops of a portion of the blocks what scans see through. Gives the files of what is left of each, which note how many sums went.
    ///
    /// # Errors
    /// A file can't be read or written. Cancelled.
    pub fn drop_seen_through(
        &self,
        blocks: &Blocks,
        portion: Portion,
        setting: &Setting<'_>,
        progress: &Progress<'_>,
    ) -> Result<Vec<Named>> {
        // Most of them see a few blocks, of all that there are.
        let open = |&(scan, _): &(u32, _)| {
            let mut ballot = Ballot::open(&self.path(scan, setting))?;
            ballot.asked.retain(|_, asked| asked.votes.count::<Vote>() > 0);
            Ok((self.scan_order.version(scan), ballot))
        };
        let ballots: Vec<(u64, Ballot)> = self.list.iter().map(open).collect::<Result<_>>()?;
        let drop = |block: [i32; 3]| {
            progress.check()?;
            let key = blocks.key(block).expect("it is of the list");
            let (mut surface, mut through): (Vec<u16>, Vec<u16>) = (Vec::new(), Vec::new());
            let mut asked = Vec::new();
            for (version, ballot) in &ballots {
                let Some(votes) = ballot.votes(block, key)? else { continue };
                asked.push(*version);
                surface.resize(votes.len(), 0);
                through.resize(votes.len(), 0);
                for (edge, vote) in votes.into_iter().enumerate() {
                    surface[edge] += u16::from(vote == SURFACE);
                    through[edge] += u16::from(vote == THROUGH);
                }
            }
            let goes: Vec<bool> = through.iter().zip(surface).map(|(&through, of)| is_through(through, of)).collect();
            let gone = goes.iter().filter(|&&goes| goes).count() as u32;
            if gone == 0 {
                return Ok(Named { block, note: 0, key });
            }
            let key = Key::of(&(self.basis, key, asked));
            let path = setting.path(blocks::LEFT, key);
            if !path.exists() {
                let mut goes = goes.into_iter();
                let mut bricks = blocks.read(block)?;
                bricks
                    .iter_mut()
                    .flat_map(|brick| &mut brick.1)
                    .for_each(|list| list.retain(|_| !goes.next().is_some_and(|goes| goes)));
                bricks.retain(|brick| brick.1.iter().any(|list| !list.is_empty()));
                blocks::write(&path, &bricks.into_iter().collect())?;
            }
            Ok(Named { block, note: gone, key })
        };
        portion.every(blocks.list()).into_par_iter().with_max_len(1).map(drop).collect()
    }
}

/// A scan to be asked. Without lines of sight it sees nothing.
struct Asking {
    path: PathBuf,
    sight: Option<LinesOfSight>,
    ballot: Ballot,
    /// Blocks, in order.
    open: Vec<[i32; 3]>,
}

/// Questions to a scan so far. Nothing yet if there is no file.
struct Ballot {
    file: Option<Stored>,
    asked: BTreeMap<[i32; 3], Asked>,
}

impl Ballot {
    fn open(path: &Path) -> Result<Self> {
        if !path.exists() {
            return Ok(Ballot { file: None, asked: BTreeMap::new() });
        }
        let (stored, table) = Stored::open::<Asked>(path)?;
        Ok(Ballot { file: Some(stored), asked: table.into_iter().map(|asked| (asked.block, asked)).collect() })
    }

    /// The blocks of which it is not known what the scan sees there, in order.
    fn open_questions(&self, blocks: &Blocks) -> Vec<[i32; 3]> {
        let is_open = |block: &[i32; 3]| {
            self.asked.get(block).is_none_or(|asked| asked.may_see != 0 && Some(asked.key) != blocks.key(*block))
        };
        blocks.list().into_iter().filter(is_open).collect()
    }

    /// The votes on a block of that key. Nothing where the scan sees none of it.
    fn votes(&self, block: [i32; 3], key: Key) -> Result<Option<Vec<Vote>>> {
        let asked = self.asked.get(&block).filter(|asked| asked.key == key && asked.votes.count::<Vote>() > 0);
        let (Some(asked), Some(file)) = (asked, &self.file) else { return Ok(None) };
        file.get(&asked.votes).map(Some)
    }

    /// Writes it with what was asked now.
    fn write(&self, path: &Path, blocks: &Blocks, seen: &Answers) -> Result<()> {
        let mut file = Columns::new(path)?;
        let mut table = Vec::new();
        for block in blocks.list() {
            let key = blocks.key(block).expect("it is of the list");
            let before = self.asked.get(&block).map(|asked| asked.may_see);
            let (may_see, votes) = match seen.get(&block) {
                Some((may_see, votes)) => (u32::from(*may_see), votes.clone()),
                None => (before.unwrap_or(0), self.votes(block, key)?.unwrap_or_default()),
            };
            let is_any = votes.iter().any(|&vote| vote > 0);
            let votes = file.put(if is_any { &votes[..] } else { &[] })?;
            table.push(Asked { block, may_see, key, votes });
        }
        file.finish(&table)
    }
}
