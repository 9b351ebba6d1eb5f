//! The folder of a merge, and what follows from the memory there is: how space is cut into blocks, and work into portions.

use std::hash::{DefaultHasher, Hash, Hasher as _};
use std::ops::Range;
use std::path::{Path, PathBuf};

use bytemuck::{AnyBitPattern, NoUninit, Pod, Zeroable};

use super::files::{Columns, Place, Stored, damaged};
use crate::finish::close_holes::Room;
use crate::surface::tiles::Block;
use base::error::{Error, Result};
use base::memory::size;

/// Bytes that loading a scan takes, for each of its samples and beside. Measured.
const BYTES_A_SAMPLE: u64 = 160;
const SCAN: u64 = 1 << 20;
/// Bytes that a brick takes, with those around a block and what is made of it. A block has some twice as many with a part of the surface as
/// it has along two sides. Measured.
const BYTES_A_BRICK: f64 = 0.75e6;

/// The folder, and what follows from the memory there is.
pub struct Setting<'a> {
    pub folder: &'a Path,
    pub cut: Cut,
    /// Bytes that all may take.
    pub memory: u64,
    /// Bytes of crossings that a worker holds.
    pub held: u64,
    /// Crossings of all scans up to which overlaps are measured by all of them.
    pub kept: u64,
    pub corner: [i64; 3],
    /// Whether what stages leave stays, so that another merge finds it.
    pub stays: bool,
    /// Whether all files of the merge are in the folder.
    pub has_all: bool,
}

/// Bytes of crossings that a worker holds who has so much memory.
fn held_by(memory: u64) -> u64 {
    (memory / 6).max(1 << 20)
}

impl<'a> Setting<'a> {
    /// For the threads that this thread's work is shared by.
    pub fn of(folder: &'a Path, memory: u64) -> Self {
        let workers = rayon::current_num_threads() as u64;
        let each = memory / workers;
        let side = (each as f64 / (2.0 * BYTES_A_BRICK)).sqrt() as i32;
        Setting {
            folder,
            cut: Cut { side: side.clamp(2, 64) },
            memory,
            held: held_by(each),
            kept: crate::crossings::bundles::MANY,
            corner: [0; 3],
            stays: false,
            has_all: true,
        }
    }

    /// Bytes of the surroundings of holes that may be in memory.
    pub fn room(&self) -> Room {
        Room { held: self.held as f64, side: self.cut.side }
    }

    /// Number of scans of so many samples that may be loaded at a time.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`]: not one.
    pub fn workers(&self, samples: usize) -> Result<usize> {
        let needed = |held: u64| SCAN + BYTES_A_SAMPLE * samples as u64 + held;
        // As one thread alone would need, so that whether it can be done is the same for any number.
        let alone = needed(held_by(self.memory));
        if self.memory < alone {
            return Err(Error::OutOfMemory(format!(
                "scans of {samples} samples need {} or more even in files, {} are allowed",
                size(alone as f64),
                size(self.memory as f64)
            )));
        }
        let workers = self.memory / needed(self.held);
        Ok((workers.max(1) as usize).min(rayon::current_num_threads()))
    }

    /// Path of a mark, by its number.
    pub fn mark(&self, kind: &str, number: u32) -> PathBuf {
        self.folder.join(format!("{kind}-{number:06}"))
    }

    /// Path of a file of a kind, by the key that it follows from.
    pub fn path(&self, kind: &str, key: Key) -> PathBuf {
        self.folder.join(format!("{kind}-{key}"))
    }

    /// The files of a kind that are complete, in the order of their names.
    pub fn files(&self, kind: &str) -> Result<Vec<PathBuf>> {
        let failed = |error| Error::io(self.folder, error);
        let mut files = Vec::new();
        for file in self.folder.read_dir().map_err(failed)? {
            let path = file.map_err(failed)?.path();
            let name = path.file_name().and_then(|name| name.to_str());
            if name.and_then(|name| name.strip_prefix(kind)).is_some_and(|rest| rest.starts_with('-')) {
                files.push(path);
            }
        }
        files.sort_unstable();
        Ok(files)
    }

    /// Removes the files of kinds that nobody needs any more in this merge, unless they stay.
    pub fn spend(&self, kinds: &[&str]) -> Result<()> {
        if self.stays {
            return Ok(());
        }
        kinds.iter().try_for_each(|kind| self.files(kind)?.iter().try_for_each(|path| remove(path)))
    }

    /// Keeps a list in a mark. If there is one, that one stays.
    pub fn keep<T: NoUninit>(&self, kind: &str, number: u32, list: &[T]) -> Result<()> {
        let path = self.mark(kind, number);
        let mut file = Columns::new(&path)?;
        let place = file.put(list)?;
        file.finish_as(&[place], std::iter::once(path)).map(|_| ())
    }

    /// The list of a mark that [`Setting::keep`] made, if there is one.
    pub fn recall<T: AnyBitPattern + NoUninit>(&self, kind: &str, number: u32) -> Result<Option<Vec<T>>> {
        let path = self.mark(kind, number);
        if !path.exists() {
            return Ok(None);
        }
        let (stored, table) = Stored::open::<Place>(&path)?;
        stored.get(table.first().ok_or_else(|| damaged(&path))?).map(Some)
    }
}

/// Removes a file, unless somebody else has.
pub fn remove(path: &Path) -> Result<()> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(()),
        done => done.map_err(|error| Error::io(path, error)),
    }
}

/// A number that follows from what a file is made of, and is another for anything else but for one chance in 2^128.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Pod, Zeroable)]
pub struct Key([u64; 2]);

impl Key {
    pub fn of(made_of: &impl Hash) -> Self {
        Key([0_u8, 1].map(|half| {
            let mut hasher = DefaultHasher::new();
            (half, made_of).hash(&mut hasher);
            hasher.finish()
        }))
    }
}

impl std::fmt::Display for Key {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{:016x}{:016x}", self.0[0], self.0[1])
    }
}

/// A block, and the key of a file that has what there is in it.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Pod, Zeroable)]
pub struct Named {
    pub block: [i32; 3],
    /// Note of a stage.
    pub note: u32,
    pub key: Key,
}

/// The part of the work that a task does.
#[derive(Clone, Copy, Debug)]
pub struct Portion {
    pub number: u32,
    pub of: u32,
}

impl Portion {
    /// A run of a list of so many: what lies beside each other.
    pub fn range(self, count: usize) -> Range<usize> {
        let first = |number: u32| (u64::from(number) * count as u64 / u64::from(self.of)) as usize;
        first(self.number)..first(self.number + 1)
    }

    /// Of what is in a list every so-manieth: what takes long lies beside each other.
    pub fn every<T>(self, list: Vec<T>) -> Vec<T> {
        let is_own = |place: usize| place % self.of as usize == self.number as usize;
        list.into_iter().enumerate().filter(|(place, _)| is_own(*place)).map(|of| of.1).collect()
    }
}

/// Cut of space into blocks: cubes of so many bricks per side.
#[derive(Clone, Copy, Debug)]
pub struct Cut {
    pub side: i32,
}

impl Cut {
    /// The block that a brick is in, along an axis.
    pub fn of(&self, brick: i32) -> i32 {
        brick.div_euclid(self.side)
    }

    pub fn block(&self, block: [i32; 3]) -> Block {
        Block::around(block.map(|at| at * self.side), self.side)
    }

    /// Blocks that have bricks within so many of a block, itself among them.
    pub fn around(&self, block: [i32; 3], bricks: i32) -> impl Iterator<Item = [i32; 3]> + use<> {
        let reach = (bricks + self.side - 1).div_euclid(self.side);
        let wide = 2 * reach + 1;
        (0..wide * wide * wide).map(move |i| {
            let by = [i / (wide * wide), i / wide % wide, i % wide];
            [0, 1, 2].map(|axis| block[axis] + by[axis] - reach)
        })
    }

    /// Whether a brick is in a block or at most so many bricks beside it.
    pub fn is_near(&self, brick: [i32; 3], block: [i32; 3], bricks: i32) -> bool {
        (0..3).all(|i| {
            let low = block[i] * self.side;
            (low - bricks..low + self.side + bricks).contains(&brick[i])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_all_and_nothing_twice() {
        for (count, of) in [(0, 1), (0, 5), (3, 7), (7, 3), (100, 8), (8, 8)] {
            let portions = || (0..of).map(|number| Portion { number, of });
            let runs: Vec<usize> = portions().flat_map(|portion| portion.range(count)).collect();
            assert_eq!(runs, (0..count).collect::<Vec<_>>());
            let mut every: Vec<usize> = portions().flat_map(|portion| portion.every((0..count).collect())).collect();
            every.sort_unstable();
            assert_eq!(every, (0..count).collect::<Vec<_>>());
        }
    }
}
