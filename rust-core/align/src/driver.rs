//! The driver: scans made ready, and aligned, placed by hand or measured as often as wanted.

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use crate::constraints::Constraints;
use crate::params::{AlignParams, Start};
use crate::report::Alignment;
use crate::snap::Snap;
use crate::stages::{
    ALIGNING, COMPARING, MEASURING, MEASURING_PLAN, PLAN, READING, READING_ALONE, SNAPPING, SNAPPING_PLAN,
};
use crate::view::{Reduced, View, coarse_cell};
use crate::{finding, misfit, reach, sequence, snap, solve, summary};
use base::error::{Error, Result, counted};
use base::magnitude;
use base::progress::Progress;
use image::range_image::is_rigid;
use image::source::{ScanSource, common_crs};

/// Bytes that a scan's points and features take, and a pair that is looked at.
const BYTES_A_SCAN: f64 = 3.2e6;

/// Words on the order that the frames are followed in, where their recording or their numbers say it rather than the caller.
const FOLLOWED: &str = "the frames are followed as a sequence, in the order of their recording or of the numbers in their names. If that order means \
    nothing, say start = \"unknown\".";

/// The same where too few frames were found to overlap the next.
const NOT_FOLLOWED: &str = "the order of the frames is not used: less than half of them were found to overlap the next. If they follow each other, say \
    start = \"sequence\".";

/// Brings scans to one frame: [`Prepared::read`], then [`Prepared::align`].
///
/// Poses of the scans are used where they are fixed and where `params.start` says that they are rough. Otherwise only that of the
/// largest scan is, which stays.
///
/// # Errors
/// Those of both.
pub fn run(
    sources: &[&dyn ScanSource],
    params: &AlignParams,
    constraints: &Constraints,
    progress: &Progress<'_>,
) -> Result<Alignment> {
    params.validate()?;
    constraints.validate(sources.len())?;
    constraints.suits(params)?;
    progress.plan(PLAN);
    Prepared::new(sources, params.threads, progress)?.aligned(params, constraints, progress)
}

/// Scans made ready to be aligned, as often as wanted. Of their samples nothing is kept: 1 to 2.5 MB a scan.
pub struct Prepared {
    /// The largest first, ties by content.
    views: Vec<View>,
    /// The number that each had.
    order: Vec<usize>,
    names: Vec<String>,
    /// The numbers in the order of the recording that the scans are frames of.
    in_time: Option<Vec<(usize, u64)>>,
    /// The words on two scans of one number, where these would give the order.
    twice: Option<String>,
    threads: usize,
}

impl Prepared {
    /// Reads scans. O(samples).
    ///
    /// # Errors
    /// Fewer than two scans. Scans of different coordinate reference systems, or in degrees. A scan whose pose is not rigid. Errors of loading
    /// a scan. [`Error::Cancelled`].
    pub fn read(sources: &[&dyn ScanSource], threads: usize, progress: &Progress<'_>) -> Result<Self> {
        progress.plan(READING_ALONE);
        Prepared::new(sources, threads, progress)
    }

    fn new(sources: &[&dyn ScanSource], threads: usize, progress: &Progress<'_>) -> Result<Self> {
        if sources.len() < 2 {
            return Err(Error::input(format!("aligning takes at least two scans, got {}", sources.len())));
        }
        common_crs(sources)?;
        base::memory::foresee(sources.len(), BYTES_A_SCAN, "aligning", "scans")?;
        let pool = base::threads::pool(threads)?;
        let read = progress.run(&pool, || {
            progress.stage(READING, sources.len() as u64);
            read(sources, progress)
        });
        // Also where the work was done before it heard of it.
        let (views, order) = progress.check().and(read)?;
        let name = |&number: &usize| match sources[number].name() {
            "" => format!("scan {number}"),
            name => name.to_owned(),
        };
        let in_time = sequence::in_time(sources);
        let twice = sequence::twice(sources).map(|[a, b]| {
            format!(
                "{:?} and {:?} have the same number in their names, so the scans are not followed in the order of these. If each \
                    follows the one before, say start = \"sequence\".",
                name(&a),
                name(&b)
            )
        });
        Ok(Prepared { names: order.iter().map(name).collect(), views, order, in_time, twice, threads })
    }

    /// How many scans there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.views.len()
    }

    /// Never: there are at least two scans.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.views.is_empty()
    }

    /// Brings the scans to one frame.
    ///
    /// # Errors
    /// Parameters out of range. A constraint on a scan that isn't there, or that can't be. [`Error::Cancelled`].
    pub fn align(&self, params: &AlignParams, constraints: &Constraints, progress: &Progress<'_>) -> Result<Alignment> {
        params.validate()?;
        constraints.validate(self.len())?;
        constraints.suits(params)?;
        progress.plan(ALIGNING);
        self.aligned(params, constraints, progress)
    }

    fn aligned(&self, params: &AlignParams, constraints: &Constraints, progress: &Progress<'_>) -> Result<Alignment> {
        let pool = base::threads::pool(params.threads)?;
        progress.stage(COMPARING, 1);
        self.refuse_empty()?;
        constraints.lie_on(&self.order, &self.views)?;
        let alignment = progress.run(&pool, || {
            let inside = constraints.renumbered(params, &self.order, &self.views, self.in_time.as_deref());
            let has_order = inside.sequence.as_ref().is_some_and(|order| !order.is_told);
            let solved = solve::solve(&self.views, params, &inside, progress)?;
            // Fixed scans are not compared with each other: that they were not followed says nothing.
            let order = match solved.sequence {
                Some(_) => Some(FOLLOWED),
                None => (!inside.is_fixed.contains(&true)).then_some(NOT_FOLLOWED),
            };
            let mut found = summary::alignment(&self.names, &self.views, &self.order, solved, progress)?;
            if let Some(order) = order.filter(|_| has_order) {
                found.report.messages.insert(0, order.to_owned());
            }
            let is_by_numbers = params.start == Start::Auto && inside.turned.is_none();
            found.report.messages.extend(self.twice.clone().filter(|_| is_by_numbers));
            found.report.messages.extend(reach::unused(params));
            Ok(found)
        });
        progress.check().and(alignment)
    }

    /// Refuses scans of which none has a surface.
    fn refuse_empty(&self) -> Result<()> {
        if self.views.iter().any(|view| view.reduced.area > 0.0) {
            return Ok(());
        }
        let damage = self.order.iter().zip(&self.names).zip(&self.views);
        let first =
            damage.filter_map(|((number, name), view)| Some((number, name, view.reduced.damage.as_ref()?))).min();
        Err(Error::input(match first {
            Some((_, name, damage)) => {
                format!("none of the {} scans has a surface: {name:?} {damage}. Check the files.", self.len())
            }
            None => {
                format!("none of the {} scans has a surface: no sample has neighbours. Check the files.", self.len())
            }
        }))
    }

    /// Draws one scan, from a rough pose, to others, which stay: for placing by hand. `world_from_scan` has a pose for each scan that it
    /// may be drawn to. Its own is where it starts. It is drawn no further than `reach`, about: by default a tenth of its size. Of
    /// `params` tolerance and least overlap count. O(1): some tens of milliseconds.
    ///
    /// # Errors
    /// Parameters out of range. No such scan, or no pose of it. Not as many poses as scans, or one that is not rigid.
    /// [`Error::Cancelled`].
    pub fn snap(
        &self,
        scan: usize,
        world_from_scan: &[Option<DAffine3>],
        params: &AlignParams,
        progress: &Progress<'_>,
    ) -> Result<Snap> {
        params.validate()?;
        let poses = self.local(world_from_scan)?;
        let inside = self.inside(scan)?;
        let Some(start) = poses[inside] else {
            return Err(Error::input(format!(
                "scan {scan} is to be drawn to the others, but has no pose to start from"
            )));
        };
        let stays = (0..self.len()).filter(|&k| k != inside).filter_map(|k| {
            Some(snap::Stays { number: self.order[k], view: &self.views[k], world_from_local: poses[k]? })
        });
        let stays: Vec<snap::Stays<'_>> = stays.collect();
        let view = &self.views[inside];
        let reach = params.reach.unwrap_or(reach::ROUGH_REACH * view.reduced.radius);
        let limits = finding::Limits::of(params);
        progress.plan(SNAPPING_PLAN);
        progress.stage(SNAPPING, 1);
        let pool = base::threads::pool(params.threads)?;
        progress.run(&pool, || snap::snap(view, &start, &stays, reach, &limits, progress))
    }

    /// How far points of a scan, in its own frame, lie outside of the others' surfaces, along normals, where the scans lie as
    /// `world_from_scan` says: a mean over a few samples, so that warp and what moved shows. NaN where no other is near.
    /// O(points + scans).
    ///
    /// # Errors
    /// No such scan, or no pose of it. Not as many poses as scans, or one that is not rigid. [`Error::Cancelled`].
    pub fn misfit(
        &self,
        scan: usize,
        world_from_scan: &[Option<DAffine3>],
        points: &[DVec3],
        progress: &Progress<'_>,
    ) -> Result<Vec<f64>> {
        let poses = self.local(world_from_scan)?;
        let inside = self.inside(scan)?;
        let placed = |k: usize| Some(misfit::Placed { view: &self.views[k], world_from_local: poses[k]? });
        let Some(placed_scan) = placed(inside) else {
            return Err(Error::input(format!("scan {scan} has no pose, so that nothing can be said of how it fits")));
        };
        let others: Vec<misfit::Placed<'_>> = (0..self.len()).filter(|&k| k != inside).filter_map(placed).collect();
        progress.plan(MEASURING_PLAN);
        progress.stage(MEASURING, 1);
        let pool = base::threads::pool(self.threads)?;
        progress.run(&pool, || {
            let map = misfit::Map::new(&placed_scan, &others, usize::MAX);
            let middle = self.views[inside].reduced.middle;
            let at = |point: &DVec3| {
                progress.check()?;
                Ok(map.at(*point - middle))
            };
            points.par_iter().map(at).collect()
        })
    }

    /// The number inside.
    fn inside(&self, scan: usize) -> Result<usize> {
        self.order
            .iter()
            .position(|&number| number == scan)
            .ok_or_else(|| Error::input(format!("there is no scan {scan}: there are {} (counted from 0)", self.len())))
    }

    /// Poses by numbers inside, of the local frames.
    fn local(&self, world_from_scan: &[Option<DAffine3>]) -> Result<Vec<Option<DAffine3>>> {
        if world_from_scan.len() != self.len() {
            return Err(Error::input(format!(
                "{} given for {}: give a list of as many as there are scans, none at a scan without a pose",
                counted(world_from_scan.len() as u64, "pose is", "poses are"),
                counted(self.len() as u64, "scan", "scans")
            )));
        }
        if let Some(scan) = world_from_scan.iter().position(|pose| pose.is_some_and(|pose| !is_rigid(&pose))) {
            return Err(Error::input(format!("the pose of scan {scan} is not rigid: aligning turns and shifts only")));
        }
        for (scan, pose) in world_from_scan.iter().enumerate() {
            if let Some(pose) = pose {
                magnitude::place(&format!("the place of scan {scan}"), pose.translation)?;
            }
        }
        let local = |(k, &number): (usize, &usize)| {
            world_from_scan[number].map(|pose| pose * DAffine3::from_translation(self.views[k].reduced.middle))
        };
        Ok(self.order.iter().enumerate().map(local).collect())
    }
}

/// The scans made ready, the largest first, ties by content, and the number that each had.
pub fn read(sources: &[&dyn ScanSource], progress: &Progress<'_>) -> Result<(Vec<View>, Vec<usize>)> {
    let reduced = sources.par_iter().map(|source| {
        let reduced = Reduced::read(*source, progress)?;
        progress.advance(1)?;
        Ok(reduced)
    });
    let mut reduced: Vec<(usize, Reduced)> = reduced.collect::<Result<Vec<_>>>()?.into_iter().enumerate().collect();
    reduced.sort_by(|(i, x), (j, y)| {
        let by_name = || sources[*i].name().cmp(sources[*j].name());
        y.area.total_cmp(&x.area).then(x.content.cmp(&y.content)).then_with(by_name)
    });
    let order = reduced.iter().map(|(number, _)| *number).collect();
    let cell = coarse_cell(reduced.iter().map(|(_, reduced)| reduced));
    let views = reduced
        .into_par_iter()
        .map(|(_, reduced)| {
            progress.check()?;
            Ok(View::new(reduced, cell))
        })
        .collect::<Result<_>>()?;
    Ok((views, order))
}
