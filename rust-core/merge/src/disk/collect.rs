//! Stage 1 where crossings are more than memory holds: workers write what they have found to **segments**, added up by edge and sorted by block.

use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering::Relaxed};

use rayon::prelude::*;
use rustc_hash::FxHashSet;

use super::segments::{self, About, Segment};
use super::setting::{Portion, Setting};
use crate::bundles::{self, Buckets};
use crate::discretize::discretize;
use crate::intake::Discretized;
use crate::lattice::Lattice;
use crate::{DISCRETIZING, nothing_to_merge};
use base::error::Result;
use base::progress::Progress;
use image::source::{Loading, ScanSource};
use image::triangulate::TriangulateParams;

/// Finds the crossings of a portion of the scans, as far as that is not done; each worker holds `held` bytes of them at most, and those of a
/// scan. Gives the numbers of the segments.
///
/// # Errors
/// That of the first scan that can't be loaded, or counted in cells; a segment can't be written; cancelled.
pub fn collect(
    sources: &[&dyn ScanSource],
    triangulation: &TriangulateParams,
    grid: &Grid,
    portion: Portion,
    setting: &Setting<'_>,
    progress: &Progress<'_>,
) -> Result<Vec<u32>> {
    let Grid { lattice, samples } = *grid;
    let loading = Loading { triangulation: *triangulation, cell: lattice.voxel };
    let range = portion.range(sources.len());
    progress.stage(DISCRETIZING, range.len() as u64);
    let mut numbers = Vec::new();
    let mut done = FxHashSet::default();
    let mut crossings = 0;
    for (number, path) in setting.files(&segments::kind(portion))? {
        let (_, about) = Segment::open(path, lattice)?;
        // Where two were at the same work their segments have the same scans.
        if about.scans.iter().all(|scan| !done.contains(scan)) {
            numbers.push(number);
            crossings += about.intersections;
            done.extend(about.scans);
        }
    }
    let todo: Vec<usize> = range.filter(|&scan| !done.contains(&(scan as u32))).collect();
    progress.advance(done.len() as u64)?;
    let workers = setting.workers(samples)?.min(todo.len());
    let (next, last) = (AtomicUsize::new(0), AtomicUsize::new(usize::MAX));
    let shared = Shared {
        sources,
        loading,
        lattice,
        portion,
        setting,
        segments: Mutex::new(numbers),
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
    Ok(shared.segments.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner))
}

/// The grid that scans are counted in, and of how many samples the first is.
#[derive(Clone, Copy)]
pub struct Grid {
    pub lattice: Lattice,
    pub samples: usize,
}

impl Grid {
    /// That of the first scan that has a triangle.
    ///
    /// # Errors
    /// None has; one before it can't be loaded; cells too small for where it lies; cancelled.
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
                return Ok(Grid { lattice, samples: surface.positions.len() });
            }
        }
        Err(nothing_to_merge())
    }
}

/// What workers share.
struct Shared<'a> {
    sources: &'a [&'a dyn ScanSource],
    loading: Loading,
    lattice: Lattice,
    portion: Portion,
    setting: &'a Setting<'a>,
    /// Their numbers.
    segments: Mutex<Vec<u32>>,
    /// Crossings written.
    crossings: AtomicU64,
}

struct Worker<'a> {
    shared: &'a Shared<'a>,
    buckets: Buckets,
    /// What was found out of those whose crossings are held.
    about: About,
}

impl Worker<'_> {
    /// Loads a scan and finds its crossings.
    fn take(&mut self, scan: usize, progress: &Progress<'_>) -> Result<()> {
        let Shared { sources, loading, lattice, setting, .. } = self.shared;
        let surface = sources[scan].load(loading, progress)?;
        progress.check()?;
        discretize(&surface, sources[scan].name(), scan as u32, lattice, &mut self.buckets, progress)?;
        let mut found = Discretized::none(*lattice);
        found.triangles = surface.triangles.len() as u64;
        found.full_trust = surface.confidence.iter().fold(0.0, |a, &b| a.max(b));
        found.coloured = found.triangles > 0 && surface.colour.is_some();
        if found.triangles > 0 {
            found.images.extend(surface.measured.map(|measured| (scan as u32, measured)));
        }
        self.about.add(&About { scans: vec![scan as u32], intersections: 0, found });
        if self.buckets.bytes() > setting.held {
            self.spill(progress)?;
        }
        progress.advance(1)
    }

    /// Writes what is held to a segment.
    fn spill(&mut self, progress: &Progress<'_>) -> Result<()> {
        let Shared { setting, sources, portion, segments, crossings, lattice, .. } = self.shared;
        let buckets = std::mem::take(&mut self.buckets);
        let mut about = std::mem::replace(&mut self.about, About::none(*lattice));
        if about.scans.is_empty() {
            return Ok(());
        }
        about.intersections = buckets.len;
        let raw = bundles::gather(vec![buckets]);
        // More than those of all segments so far there will be.
        let are_few = crossings.fetch_add(about.intersections, Relaxed) + about.intersections <= setting.kept;
        let number = segments::write(raw, &about, *portion, setting, sources.len(), are_few, progress)?;
        segments.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push(number);
        Ok(())
    }
}
