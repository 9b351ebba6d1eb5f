//! Storage of the intersections: lists by bundle, a row of bricks along one axis.

use std::hash::BuildHasher as _;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, Mutex, PoisonError};

use rustc_hash::{FxBuildHasher, FxHashMap};

use super::crossing::{BundleKey, Crossing};
use super::edge_sums::{self, EdgeSums};
use super::lattice::{BRICK, BRICK_BITS};
use super::lines;
use super::scan_order::ScanOrder;
use base::error::Result;
use base::progress::Progress;

const CHUNK: usize = 256;

/// The crossings of one worker, by bundle. If there are many they are added up: the memory held follows the surface, not the scans.
#[derive(Default)]
pub struct Buckets {
    index: FxHashMap<BundleKey, u32>,
    lists: Vec<Found>,
    /// Last bundle of each axis: neighbouring triangles mostly stay in it.
    last: [Option<(BundleKey, u32)>; 3],
    /// Number of crossings found.
    pub len: u64,
    /// Those that are not added up yet.
    held: u64,
    /// The store in which all workers add theirs up.
    store: Arc<SumsStore>,
}

/// Sums of the crossings of all workers, as far as they are added up.
#[derive(Default)]
pub struct SumsStore {
    bundles: Mutex<FxHashMap<BundleKey, Arc<Mutex<Added>>>>,
    /// Sums held.
    len: AtomicU64,
}

/// Sums of a bundle.
#[derive(Default)]
pub struct Added {
    /// Sorted.
    pub sums: Vec<EdgeSums>,
    /// Of the crossings added up a sample that overlaps are measured by.
    pub sample: Vec<Crossing>,
}

/// Crossings found in a bundle.
#[derive(Default)]
pub struct Found {
    /// Crossings, in chunks of fixed size: growing copies nothing.
    pub chunks: Vec<Vec<Crossing>>,
    /// Others, added up.
    pub added: Added,
}

impl Buckets {
    /// Adds a crossing with the line `(u, v)` along `axis`.
    #[inline]
    pub fn push(&mut self, axis: usize, u: i32, v: i32, make: impl FnOnce(u32) -> Crossing) {
        let key = BundleKey { axis: axis as u8, across: [u >> BRICK_BITS, v >> BRICK_BITS] };
        let list = match self.last[axis] {
            Some((last, list)) if last == key => list,
            _ => self.find(key),
        };
        let line = ((v & (BRICK - 1)) << BRICK_BITS | (u & (BRICK - 1))) as u32;
        let chunks = &mut self.lists[list as usize].chunks;
        match chunks.last_mut() {
            Some(chunk) if chunk.len() < CHUNK => chunk.push(make(line)),
            _ => {
                let mut chunk = Vec::with_capacity(CHUNK);
                chunk.push(make(line));
                chunks.push(chunk);
            }
        }
        self.len += 1;
        self.held += 1;
    }

    #[cold]
    fn find(&mut self, key: BundleKey) -> u32 {
        let list = *self.index.entry(key).or_insert_with(|| {
            self.lists.push(Found::default());
            self.lists.len() as u32 - 1
        });
        self.last[key.axis as usize] = Some((key, list));
        list
    }

    /// Adds up the crossings of whole scans, some of those of the order, once they are more than `kept`. They also have to be many beside
    /// the sums so far, so that each edge is met a few times only, however many crossings there are.
    ///
    /// # Errors
    /// Cancelled.
    pub fn add_up_many(&mut self, kept: u64, scan_order: &ScanOrder<'_>, progress: &Progress<'_>) -> Result<()> {
        if self.held <= kept.max(self.store.len.load(Relaxed) / 2) {
            return Ok(());
        }
        for (key, &list) in &self.index {
            progress.check()?;
            let chunks = std::mem::take(&mut self.lists[list as usize].chunks);
            let sums = lines::sums(&chunks);
            let added = lock(&self.store.bundles).entry(*key).or_default().clone();
            let mut added = lock(&added);
            added.sample.extend(chunks.iter().flatten().filter(|c| in_sample(key, c, scan_order)));
            let before = added.sums.len() as u64;
            edge_sums::add_up(&mut added.sums, &sums);
            self.store.len.fetch_add(added.sums.len() as u64 - before, Relaxed);
        }
        self.held = 0;
        Ok(())
    }

    /// Adds up where others do, too.
    pub fn with_store(store: Arc<SumsStore>) -> Self {
        Buckets { store, ..Buckets::default() }
    }

    /// Bytes held, without what is added up.
    pub fn bytes(&self) -> u64 {
        self.held * size_of::<Crossing>() as u64
    }
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Crossings that a worker keeps one by one.
pub const MANY: u64 = 1 << 20;
/// If there are more than [`MANY`], overlaps are measured on one line in so many.
const SAMPLED_LINES: u64 = 64;

/// Whether overlaps are measured by this crossing where crossings are many: the line decides, and the scan.
pub fn in_sample(key: &BundleKey, crossing: &Crossing, scan_order: &ScanOrder<'_>) -> bool {
    let place = (key.axis, key.across, crossing.line());
    // The upper bits of this hash are the mixed ones.
    let is_line = FxBuildHasher.hash_one(place) >> 32 & (SAMPLED_LINES - 1) == 0;
    is_line && scan_order.place(crossing.scan()).is_some_and(|place| scan_order.is_sampled(place))
}

/// The crossings of one scan, by bundle.
#[derive(Default)]
pub struct ScanCrossings {
    /// In order.
    lists: Vec<(BundleKey, Vec<Crossing>)>,
}

impl From<Buckets> for ScanCrossings {
    /// Takes what was not added up.
    fn from(mut buckets: Buckets) -> Self {
        let mut take = |list: u32| std::mem::take(&mut buckets.lists[list as usize].chunks).concat();
        let mut lists: Vec<_> = buckets.index.iter().map(|(&key, &list)| (key, take(list))).collect();
        lists.sort_unstable_by_key(|list| list.0);
        ScanCrossings { lists }
    }
}

impl ScanCrossings {
    /// Number of them.
    pub fn len(&self) -> u64 {
        self.lists.iter().map(|list| list.1.len() as u64).sum()
    }

    /// The bundles that have any.
    pub fn keys(&self) -> impl Iterator<Item = BundleKey> {
        self.lists.iter().map(|list| list.0)
    }

    /// Those of each bundle that has any.
    pub fn iter(&self) -> impl Iterator<Item = (BundleKey, &[Crossing])> {
        self.lists.iter().map(|(key, list)| (*key, &list[..]))
    }

    /// Those of a bundle, for a scan of this number.
    pub fn of(&self, key: &BundleKey, scan: u32) -> Option<Vec<Crossing>> {
        let place = self.lists.binary_search_by_key(key, |list| list.0).ok()?;
        Some(self.lists[place].1.iter().map(|crossing| crossing.of_scan(scan)).collect())
    }
}

/// Joins the crossings of scans, with their numbers, into bundles.
pub fn join<'a>(scans: impl Iterator<Item = (u32, &'a ScanCrossings)>) -> Vec<RawBundle> {
    let mut all: FxHashMap<BundleKey, Found> = FxHashMap::default();
    for (number, crossings) in scans {
        for (key, list) in crossings.iter() {
            let chunk = list.iter().map(|crossing| crossing.of_scan(number)).collect();
            all.entry(key).or_default().chunks.push(chunk);
        }
    }
    in_order(all)
}

/// The crossings of one bundle, as several workers found them: in no particular order.
pub struct RawBundle {
    /// The row of bricks.
    pub key: BundleKey,
    /// Crossings that were found there.
    pub found: Found,
}

/// Joins the workers' crossings into bundles, ordered by key.
pub fn gather(workers: Vec<Buckets>) -> Vec<RawBundle> {
    let mut all: FxHashMap<BundleKey, Found> = FxHashMap::default();
    for mut worker in workers {
        for (key, list) in worker.index {
            let chunks = &mut worker.lists[list as usize].chunks;
            all.entry(key).or_default().chunks.append(chunks);
        }
        // Of those who share it the first takes it.
        for (key, added) in lock(&worker.store.bundles).drain() {
            all.entry(key).or_default().added = std::mem::take(&mut *lock(&added));
        }
    }
    in_order(all)
}

fn in_order(all: FxHashMap<BundleKey, Found>) -> Vec<RawBundle> {
    let mut all: Vec<RawBundle> = all.into_iter().map(|(key, found)| RawBundle { key, found }).collect();
    all.sort_unstable_by_key(|bundle| bundle.key);
    all
}
