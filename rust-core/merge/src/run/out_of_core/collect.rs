//! Stage 1 where crossings are more than memory holds: workers write what they have found to **segments**, added up by edge and sorted by
//! block.

use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering::Relaxed};

use rayon::prelude::*;
use rustc_hash::FxHashSet;

use super::segments::{self, About, Segment, SegmentMember, Whose};
use super::setting::{Key, Portion, Setting};
use crate::crossings::bundles::{self, Buckets};
use crate::crossings::discretize::discretize;
use crate::crossings::lattice::Lattice;
use crate::crossings::scan_order::ScanOrder;
use crate::intake::Discretized;
use crate::intake::budget;
use crate::intake::nothing_to_merge;
use crate::intake::placing::Placing;
use crate::stages::DISCRETIZING;
use base::error::{Error, Result};
use base::progress::Progress;
use image::source::{Loading, ScanSource};
use image::triangulate::TriangulateParams;

/// Bytes of crossings that are kept together for another merge, so that scans of a few samples have no file each.
const STAYS: u64 = 1 << 18;

/// Facts on all scans that collecting needs.
pub struct Collecting<'a> {
    pub scan_order: &'a ScanOrder<'a>,
    pub triangulation: TriangulateParams,
    pub grid: Grid,
    /// Basis that segments follow from besides their scans.
    pub basis: Key,
    /// Segments of merges before that are used, as [`usable`] gave them.
    pub known: &'a [Key],
}

/// The segments that merges before have left of these scans, no scan in two of them. They are chosen once, so that tasks agree on them
/// wherever their portions begin.
///
/// # Errors
/// A file can't be read.
pub fn usable(scan_order: &ScanOrder<'_>, basis: Key, lattice: Lattice, setting: &Setting<'_>) -> Result<Vec<Key>> {
    let mut taken = FxHashSet::default();
    let mut keys = Vec::new();
    for (segment, _) in Segment::all(basis, lattice, setting)? {
        if segment.members.iter().all(|member| member.is_of(scan_order) && !taken.contains(&member.number)) {
            taken.extend(segment.members.iter().map(|member| member.number));
            keys.push(segment.key());
        }
    }
    Ok(keys)
}

/// Finds the crossings of a portion of the scans, as far as no segment has them. Each worker holds `held` bytes of them at most, and those
/// of a scan. Gives the keys of the segments.
///
/// # Errors
/// The error of the first scan that can't be loaded, or counted in cells. A segment can't be written. Cancelled.
pub fn collect(
    collecting: &Collecting<'_>,
    portion: Portion,
    setting: &Setting<'_>,
    progress: &Progress<'_>,
) -> Result<Vec<Key>> {
    let Collecting { scan_order, grid: Grid { lattice, samples, .. }, basis, .. } = *collecting;
    let range = portion.range(scan_order.len());
    progress.stage(DISCRETIZING, range.len() as u64);
    let mut keys = Vec::new();
    let mut done = FxHashSet::default();
    let mut crossings = 0;
    let is_own = |member: &SegmentMember| scan_order.place(member.number).is_some_and(|place| range.contains(&place));
    let (known, new): (Vec<_>, Vec<_>) =
        Segment::all(basis, lattice, setting)?.into_iter().partition(|of| collecting.known.contains(&of.0.key()));
    for (segment, about) in known {
        if segment.members.first().is_some_and(is_own) {
            keys.push(segment.key());
            crossings += about.intersections;
        }
        done.extend(about.scans);
    }
    // Files that a task has left that was stopped, or another one at the same work.
    for (segment, about) in new {
        let is_of =
            |member: &SegmentMember| is_own(member) && member.is_of(scan_order) && !done.contains(&member.number);
        if segment.members.iter().all(is_of) {
            keys.push(segment.key());
            crossings += about.intersections;
            done.extend(about.scans);
        }
    }
    let all = range.len();
    let todo: Vec<usize> = range.filter(|&place| !done.contains(&scan_order.numbers()[place])).collect();
    progress.advance((all - todo.len()) as u64)?;
    let workers = setting.workers(samples)?.min(todo.len());
    let (next, last) = (AtomicUsize::new(0), AtomicUsize::new(usize::MAX));
    let shared = Shared {
        collecting,
        loading: Loading { triangulation: collecting.triangulation, cell: lattice.voxel },
        setting,
        keys: Mutex::new(keys),
        crossings: AtomicU64::new(crossings),
    };
    let work = |_| {
        let mut worker = Worker { shared: &shared, buckets: Buckets::default(), about: About::none(lattice) };
        let mut scan = 0;
        let mut go = || {
            loop {
                let Some(&another) = todo.get(next.fetch_add(1, Relaxed)) else { return worker.spill(progress) };
                scan = another;
                if scan > last.load(Relaxed) {
                    return worker.spill(progress);
                }
                worker.take(scan, progress)?;
            }
        };
        go().map_err(|error| {
            last.fetch_min(scan, Relaxed);
            (scan, error)
        })
    };
    let workers: Vec<_> = (0..workers).into_par_iter().with_max_len(1).map(work).collect();
    progress.check()?;
    if let Some((_, error)) = workers.into_iter().filter_map(Result::err).min_by_key(|failed| failed.0) {
        return Err(error);
    }
    Ok(shared.keys.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner))
}

/// The grid that scans are counted in, and what the first of them foretells.
#[derive(Clone, Copy)]
pub struct Grid {
    pub lattice: Lattice,
    /// Samples of the first scan.
    pub samples: usize,
    /// About how many crossings it has.
    pub crossings: f64,
}

impl Grid {
    /// The grid of the first scan that has a triangle.
    ///
    /// # Errors
    /// None has. One before it can't be loaded. Cells too small for where it lies. Cancelled.
    pub fn of_first(
        sources: &[&dyn ScanSource],
        loading: &Loading,
        corner: [i64; 3],
        progress: &Progress<'_>,
    ) -> Result<Self> {
        for source in sources {
            let surface = source.load(loading, progress)?;
            progress.check()?;
            if let Some(&[first, ..]) = surface.triangles.first() {
                let near = surface.world_from_surface.transform_point3(surface.positions[first as usize]);
                let lattice = Lattice::new(loading.cell, near, corner)?;
                let crossings = budget::crossings(&surface, loading.cell);
                return Ok(Grid { lattice, samples: surface.positions.len(), crossings });
            }
        }
        Err(nothing_to_merge(&loading.triangulation))
    }
}

/// State that workers share.
struct Shared<'a> {
    collecting: &'a Collecting<'a>,
    loading: Loading,
    setting: &'a Setting<'a>,
    /// Of segments.
    keys: Mutex<Vec<Key>>,
    /// Crossings written.
    crossings: AtomicU64,
}

struct Worker<'a> {
    shared: &'a Shared<'a>,
    buckets: Buckets,
    /// Findings about those whose crossings are held.
    about: About,
}

impl Worker<'_> {
    /// Loads a scan and finds its crossings.
    fn take(&mut self, scan: usize, progress: &Progress<'_>) -> Result<()> {
        let Shared { collecting: Collecting { scan_order, grid, .. }, loading, setting, .. } = self.shared;
        let (source, number) = (scan_order.sources[scan], scan_order.numbers()[scan]);
        let surface = source.load(loading, progress)?;
        progress.check()?;
        // It may be larger than those that were looked at before.
        setting.workers(surface.positions.len()).map_err(|error| match error {
            Error::OutOfMemory(text) => Error::OutOfMemory(format!("{}: {text}", source.name())),
            error => error,
        })?;
        discretize(&surface, source.name(), number, &grid.lattice, &mut self.buckets, progress)?;
        let mut found = Discretized::none(grid.lattice);
        found.triangles = surface.triangles.len() as u64;
        found.full_trust = surface.confidence.iter().fold(0.0, |a, &b| a.max(b));
        found.coloured = found.triangles > 0 && surface.colour.is_some();
        if found.triangles > 0 {
            found.placing = Placing::of(&surface);
            found.images.extend(surface.measured.map(|measured| (number, measured)));
        }
        self.about.add(&About { scans: vec![number], intersections: 0, found });
        // If segments stay for another merge, it goes without those of which a scan has changed.
        if self.buckets.bytes() > if setting.stays { setting.held.min(STAYS) } else { setting.held } {
            self.spill(progress)?;
        }
        progress.advance(1)
    }

    /// Writes what is held to a segment.
    fn spill(&mut self, progress: &Progress<'_>) -> Result<()> {
        let Shared { collecting: Collecting { scan_order, grid, basis, .. }, setting, keys, crossings, .. } =
            self.shared;
        let buckets = std::mem::take(&mut self.buckets);
        let mut about = std::mem::replace(&mut self.about, About::none(grid.lattice));
        if about.scans.is_empty() {
            return Ok(());
        }
        about.intersections = buckets.len;
        let raw = bundles::gather(vec![buckets]);
        // More than those of all segments so far there will be.
        let are_few = crossings.fetch_add(about.intersections, Relaxed) + about.intersections <= setting.kept;
        let members: Vec<SegmentMember> = about
            .scans
            .iter()
            .filter_map(|&number| Some(SegmentMember::of(scan_order, scan_order.place(number)?)))
            .collect();
        let whose = Whose { members: &members, basis: *basis, scan_order };
        let key = segments::write(raw, &about, &whose, setting, are_few, progress)?;
        keys.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push(key);
        Ok(())
    }
}
