//! Stage 1 over all scans: each is loaded when its turn comes, at most one a worker at a time, and leaves its crossings.
//!
//! Nodes are counted from a base near the first scan that has a triangle. It is chance which scan is loaded first. Until that one is,
//! others count from a base near the first of those known. Bases lie so far apart that it nearly always is the same. A scan that counted
//! from another is loaded again, and forgotten with whatever was wrong with it.

pub mod budget;
pub mod damage;
pub mod decoded;
pub mod defaults;
mod nothing;
pub mod overlap;
pub mod placing;
pub mod setup;

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use glam::DVec3;
use rayon::prelude::*;

use crate::crossings::bundles::{Buckets, SumsStore};
use crate::crossings::discretize::discretize;
use crate::crossings::lattice::Lattice;
use crate::crossings::scan_order::ScanOrder;
use crate::params::MergeParams;
use crate::report::{MergeReport, VoxelReason};
use crate::stages::DISCRETIZING;
use base::error::{Error, Result};
use base::progress::Progress;
use budget::{Budget, Foreseen};
use defaults::rounded;
use image::range_image::noise::Noise;
use image::source::{Loading, Measured};
use placing::Placing;
use setup::Setup;

pub use nothing::nothing_to_merge;

/// Findings of stage 1 in all scans.
pub struct Discretized {
    /// The grid that all crossings are counted in.
    pub lattice: Lattice,
    /// The crossings of each worker.
    pub buckets: Vec<Buckets>,
    /// Triangles of all scans.
    pub triangles: u64,
    /// Largest trust of any sample.
    pub full_trust: f32,
    /// Whether any scan has colours.
    pub coloured: bool,
    /// Placing of the scans as given.
    pub placing: Placing,
    /// Measures of those scans that are range images, with their numbers, ascending.
    pub images: Vec<(u32, Measured)>,
}

/// Findings of one worker in scans that were counted from one base.
pub struct Group {
    /// Their places in the order.
    pub scans: Vec<usize>,
    /// Its findings.
    pub found: Discretized,
    /// Estimate for its scan, if each is a group of its own.
    pub foreseen: Option<Arc<Foreseen>>,
    /// Place of the first triangle of the first of them, in the world.
    pub near: DVec3,
}

/// A scan that can't be merged, and the grid it can't be counted in where that is why.
struct Failure {
    scan: usize,
    lattice: Option<Lattice>,
    error: Error,
}

/// The work on a list of scans.
pub struct Intake<'a, 'p> {
    scan_order: &'a ScanOrder<'a>,
    params: &'a MergeParams,
    setup: &'a Setup,
    /// Stores in which crossings are added up, by the grid they are counted in.
    stores: Mutex<Vec<(Lattice, Arc<SumsStore>)>>,
    budget: &'a Budget,
    /// Whether each scan is a group of its own, and its crossings are kept one by one.
    are_apart: bool,
    /// The first scan known to have a triangle, and its grid.
    first: Mutex<Option<(usize, Lattice)>>,
    /// No scan after this one is worth loading.
    last: AtomicUsize,
    progress: &'a Progress<'p>,
}

/// Stage 1: the crossings of all scans with the grid, of larger cells where these were not given and would not fit into memory.
///
/// # Errors
/// As [`Intake::take_all`]. No scan has a triangle.
pub fn find_crossings(
    scan_order: &ScanOrder<'_>,
    params: &MergeParams,
    setup: &Setup,
    report: &mut MergeReport,
    progress: &Progress<'_>,
) -> Result<Discretized> {
    let scans = in_cells_that_fit(scan_order.len(), params, setup, report, |budget| {
        progress.stage(DISCRETIZING, scan_order.len() as u64);
        let intake = Intake::new(scan_order, params, setup, budget, progress);
        let (lattice, groups) = intake.take_all((0..scan_order.len()).collect())?;
        let lattice = lattice.ok_or_else(|| nothing_to_merge(&params.triangulation))?;
        Ok(groups.into_iter().fold(Discretized::none(lattice), |mut all, mut group| {
            all.add(&group.found);
            all.buckets.append(&mut group.found.buckets);
            all
        }))
    })?;
    scans.tell(report);
    Ok(scans)
}

/// The result of `find` with a grid of cells as the report has them. Cells are larger if these were not given, would not fit into memory,
/// and may be larger.
///
/// # Errors
/// Those of `find`.
pub fn in_cells_that_fit<T>(
    scans: usize,
    params: &MergeParams,
    setup: &Setup,
    report: &mut MergeReport,
    mut find: impl FnMut(&mut Budget) -> Result<T>,
) -> Result<T> {
    let may_be_larger = params.voxel.is_none() && !setup.fit.keeps_to_cells;
    loop {
        let mut budget = Budget::new(report.voxel, scans, setup.fit.memory);
        match find(&mut budget) {
            Err(Error::OutOfMemory(_)) if may_be_larger && budget.fits().is_some_and(|v| v > report.voxel) => {
                report.voxel = budget.fits().map_or(report.voxel, rounded);
                report.voxel_reason = VoxelReason::Memory;
            }
            found => {
                setup.fit.is_refused.store(budget.refused().is_some(), Ordering::Relaxed);
                setup.fit.surface_may_fit.store(budget.leaves_room_for_the_surface(), Ordering::Relaxed);
                return found;
            }
        }
    }
}

impl Discretized {
    /// Nothing yet.
    pub fn none(lattice: Lattice) -> Self {
        Discretized {
            lattice,
            buckets: Vec::new(),
            triangles: 0,
            full_trust: 0.0,
            coloured: false,
            placing: Placing::default(),
            images: Vec::new(),
        }
    }

    /// Adds what is known of other scans. Not their crossings.
    pub fn add(&mut self, other: &Discretized) {
        self.triangles += other.triangles;
        self.full_trust = self.full_trust.max(other.full_trust);
        self.coloured |= other.coloured;
        self.placing.add(&other.placing);
        self.images.extend_from_slice(&other.images);
        self.images.sort_unstable_by_key(|image| image.0);
    }

    /// Says it in the report.
    pub fn tell(&self, report: &mut MergeReport) {
        report.input_triangles = self.triangles;
        let over_images = |of_image: fn(&Noise) -> f64| {
            let mut all: Vec<f64> = self.images.iter().map(|(_, measured)| of_image(&measured.noise)).collect();
            all.sort_by(f64::total_cmp);
            all.get(all.len() / 2).copied()
        };
        report.noise_across = over_images(Noise::across).unwrap_or(0.0);
        report.noise_step = over_images(Noise::typical_step).unwrap_or(0.0);
        report.noise_correlation = over_images(Noise::correlation).unwrap_or(1.0);
    }
}

impl<'a, 'p> Intake<'a, 'p> {
    /// Of the cells of `budget`.
    pub fn new(
        scan_order: &'a ScanOrder<'a>,
        params: &'a MergeParams,
        setup: &'a Setup,
        budget: &'a Budget,
        progress: &'a Progress<'p>,
    ) -> Self {
        Intake {
            scan_order,
            params,
            setup,
            stores: Mutex::default(),
            budget,
            are_apart: false,
            first: Mutex::new(None),
            last: AtomicUsize::new(usize::MAX),
            progress,
        }
    }

    /// Of some scans of the list, each by itself. Of the others `first` is the first that has a triangle, and the grid of that.
    pub fn of_some(self, first: Option<(usize, Lattice)>) -> Self {
        Intake { are_apart: true, first: Mutex::new(first), ..self }
    }

    /// Loads scans and finds their crossings: the grid they are counted in, `None` if no scan has a triangle, and what was
    /// found.
    ///
    /// # Errors
    /// The error of the first scan that can't be loaded, or counted in cells. Cancelled.
    pub fn take_all(&self, mut todo: BTreeSet<usize>) -> Result<(Option<Lattice>, Vec<Group>)> {
        let mut good: Vec<Group> = Vec::new();
        let mut failure: Option<Failure> = None;
        while !todo.is_empty() {
            let list: Vec<usize> = todo.iter().copied().collect();
            let next = AtomicUsize::new(0);
            let workers = rayon::current_num_threads().min(list.len());
            let found: Vec<_> = (0..workers).into_par_iter().with_max_len(1).map(|_| self.work(&list, &next)).collect();
            self.progress.check()?;
            // Of the scans before the first with a triangle none was passed over, so that this one is known now.
            let lattice = self.lattice();
            for (groups, empty, failed) in found {
                empty.iter().for_each(|scan| assert!(todo.remove(scan)));
                for group in groups.into_iter().filter(|group| Some(group.found.lattice) == lattice) {
                    group.scans.iter().for_each(|scan| assert!(todo.remove(scan)));
                    good.push(group);
                }
                if let Some(failed) = failed
                    && (failed.lattice.is_none() || failed.lattice == lattice)
                    && failure.as_ref().is_none_or(|known| failed.scan < known.scan)
                {
                    failure = Some(failed);
                }
            }
            // Those before it may fail too, and then are the first.
            let refused = self.budget.refused().map(|refused| refused.0);
            let end =
                failure.as_ref().map(|failure| failure.scan).into_iter().chain(refused).min().unwrap_or(usize::MAX);
            todo.retain(|scan| *scan < end);
            self.last.store(end, Ordering::Relaxed);
        }
        // All scans before the first that failed are counted now.
        match (self.budget.refused(), failure) {
            (Some((scan, error)), failure) if failure.as_ref().is_none_or(|failure| failure.scan >= scan) => Err(error),
            (_, Some(failure)) => Err(failure.error),
            (_, None) => Ok((self.lattice(), good)),
        }
    }

    fn lattice(&self) -> Option<Lattice> {
        self.first.lock().unwrap_or_else(PoisonError::into_inner).map(|first| first.1)
    }

    fn store(&self, lattice: Lattice) -> Arc<SumsStore> {
        let mut stores = self.stores.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, store)) = stores.iter().find(|known| known.0 == lattice) {
            return store.clone();
        }
        let store = Arc::<SumsStore>::default();
        stores.push((lattice, store.clone()));
        store
    }

    /// The grid to count a scan in whose first triangle lies near a place.
    fn lattice_for(&self, scan: usize, near: DVec3) -> Result<Lattice> {
        let own = Lattice::new(self.budget.voxel, near, self.setup.corner)?;
        let mut first = self.first.lock().unwrap_or_else(PoisonError::into_inner);
        if first.is_none_or(|first| scan < first.0) {
            *first = Some((scan, own));
        }
        Ok(first.map_or(own, |first| first.1))
    }

    /// One worker's groups, scans without a triangle, and first failure.
    fn work(&self, list: &[usize], next: &AtomicUsize) -> (Vec<Group>, Vec<usize>, Option<Failure>) {
        let (mut groups, mut empty) = (Vec::new(), Vec::new());
        while let Some(&scan) = list.get(next.fetch_add(1, Ordering::Relaxed)) {
            if scan > self.last.load(Ordering::Relaxed) {
                break;
            }
            let mut lattice = None;
            match self.take(scan, &mut lattice, &mut groups) {
                Ok(true) => {}
                Ok(false) => empty.push(scan),
                Err(error) => {
                    self.last.fetch_min(scan, Ordering::Relaxed);
                    return (groups, empty, Some(Failure { scan, lattice, error }));
                }
            }
        }
        (groups, empty, None)
    }

    /// Loads a scan and finds its crossings. False if it has no triangle.
    fn take(&self, scan: usize, counted_in: &mut Option<Lattice>, groups: &mut Vec<Group>) -> Result<bool> {
        let (source, number) = (self.scan_order.sources[scan], self.scan_order.numbers()[scan]);
        let surface = source
            .load(&Loading { triangulation: self.params.triangulation, cell: self.budget.voxel }, self.progress)?;
        self.progress.check()?;
        let Some(&[first, ..]) = surface.triangles.first() else {
            self.budget.know(scan, None);
            return self.progress.advance(1).map(|()| false);
        };
        let near = surface.world_from_surface.transform_point3(surface.positions[first as usize]);
        let lattice = self.lattice_for(scan, near)?;
        *counted_in = Some(lattice);
        let foreseen = self.budget.expect(scan, &surface);
        if let Some((refused, _)) = self.budget.refused() {
            self.last.fetch_min(refused, Ordering::Relaxed);
        }
        let foreseen = Some(foreseen?).filter(|_| self.are_apart);
        if self.are_apart || groups.last().is_none_or(|group| group.found.lattice != lattice) {
            let buckets = vec![Buckets::with_store(self.store(lattice))];
            let found = Discretized { buckets, ..Discretized::none(lattice) };
            groups.push(Group { scans: Vec::new(), found, foreseen, near });
        }
        let Group { scans, found, .. } = groups.last_mut().expect("one was just pushed");
        discretize(&surface, source.name(), number, &lattice, &mut found.buckets[0], self.progress)?;
        if !self.are_apart {
            found.buckets[0].add_up_many(self.setup.kept, self.scan_order, self.progress)?;
        }
        scans.push(scan);
        found.triangles += surface.triangles.len() as u64;
        found.full_trust = surface.confidence.iter().fold(found.full_trust, |a, &b| a.max(b));
        found.coloured |= surface.colour.is_some();
        found.placing.add(&Placing::of(&surface));
        found.images.extend(surface.measured.map(|measured| (number, measured)));
        self.progress.advance(1).map(|()| true)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Condvar;
    use std::time::Duration;

    use glam::DAffine3;

    use super::*;
    use crate::run::{Run, merge};
    use image::source::{OrientedSurface, PlacedMesh, ScanSource};
    use mesh::shapes::Shape;

    /// Scans that are loaded in an order of their own.
    struct Queue {
        loaded: Mutex<Vec<usize>>,
        changed: Condvar,
    }

    struct Queued<'a> {
        placed: PlacedMesh<&'a mesh::TriMesh>,
        number: usize,
        /// Scans that are loaded before this one.
        before: Vec<usize>,
        queue: &'a Queue,
    }

    impl ScanSource for Queued<'_> {
        fn name(&self) -> &str {
            self.placed.name()
        }

        fn load(&self, loading: &Loading, progress: &Progress<'_>) -> Result<OrientedSurface> {
            let mut loaded = self.queue.loaded.lock().unwrap();
            while !self.before.iter().all(|scan| loaded.contains(scan)) {
                let (held, waited) = self.queue.changed.wait_timeout(loaded, Duration::from_secs(20)).unwrap();
                assert!(!waited.timed_out(), "{} waits in vain", self.name());
                loaded = held;
            }
            loaded.push(self.number);
            self.queue.changed.notify_all();
            drop(loaded);
            self.placed.load(loading, progress)
        }
    }

    /// Merges spheres at these places (in cells, along x) which are loaded in this order.
    fn merged(places: [f64; 3], order: [usize; 3]) -> std::result::Result<Vec<[u64; 3]>, String> {
        let mesh = Shape::Sphere { radius: 3.0 }.mesh(4);
        let queue = Queue { loaded: Mutex::new(Vec::new()), changed: Condvar::new() };
        let scans = [0, 1, 2].map(|number| Queued {
            placed: PlacedMesh {
                name: format!("scan{number}"),
                mesh: &mesh,
                world_from_mesh: DAffine3::from_translation(DVec3::new(places[number] + 0.3, 0.2, 0.1)),
            },
            number,
            before: order.iter().copied().take_while(|scan| *scan != number).collect(),
            queue: &queue,
        });
        let sources = [0, 1, 2].map(|i| &scans[i] as &dyn ScanSource);
        let params = MergeParams {
            voxel: Some(1.0),
            max_hole_length: Some(0.0),
            min_component_share: 0.0,
            threads: 3,
            ..MergeParams::default()
        };
        match merge(&sources, &params, Run::default(), &Progress::none()) {
            Ok(merged) => Ok(merged.mesh.positions.iter().map(|p| p.to_array().map(f64::to_bits)).collect()),
            Err(error) => Err(error.to_string()),
        }
    }

    const ORDERS: [[usize; 3]; 4] = [[0, 1, 2], [1, 2, 0], [2, 1, 0], [2, 0, 1]];

    #[test]
    fn what_is_within_reach_does_not_depend_on_which_scan_is_loaded_first() {
        // Of the first both others are within reach, of each other they are not.
        let expected = merged([0.0, 0.7e9, -0.7e9], ORDERS[0]).unwrap();
        for order in ORDERS {
            assert_eq!(merged([0.0, 0.7e9, -0.7e9], order).as_ref(), Ok(&expected), "{order:?}");
        }
        // And the other way round: the same scan is refused with the same words.
        let refused = merged([0.7e9, 0.0, -0.7e9], ORDERS[0]).unwrap_err();
        assert!(refused.starts_with("scan2: vertex"), "{refused}");
        for order in ORDERS {
            assert_eq!(merged([0.7e9, 0.0, -0.7e9], order).unwrap_err(), refused, "{order:?}");
        }
    }

    #[test]
    fn the_first_of_several_bad_scans_is_named() {
        for order in ORDERS {
            let refused = merged([0.0, 3e9, -3e9], order).unwrap_err();
            assert!(refused.starts_with("scan1: vertex"), "{order:?}: {refused}");
        }
    }
}
