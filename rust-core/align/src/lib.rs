//! From a heap of scans without poses to one frame.
//!
//! Steps, each a file: a scan's surface by few points and by more (`level`), what its sensor saw through (`sight`); what looks like
//! what (`features`, `correspond`); which scans may touch (`retrieve`); motions that many like points agree on (`hypothesise`),
//! made exact (`refine`), judged (`judge`) and found sure or not (`finding`); groups (`assemble`); all poses at once (`relax`) and
//! how far they may be off (`uncertainty`); what is said (`report`).
//!
//! A scan is placed only if overlap, balance and uniqueness pass: never guessed. Nothing is drawn at random, and scans are
//! taken by size and content, so that results are the same bytes for any number of threads and any order of the scans.

mod assemble;
mod blocks;
mod constraints;
mod correspond;
mod features;
mod finding;
mod hypothesise;
mod judge;
mod level;
mod linear;
mod pair;
mod params;
mod refine;
mod relax;
mod report;
mod retrieve;
mod search;
mod sight;
mod solve;
mod uncertainty;
mod view;

use rayon::prelude::*;

pub use constraints::{Constraints, Pick};
pub use image::oriented::OrientedPoints;
pub use image::source::{PlacedCloud, ScanSource};
pub use params::{AlignParams, SCHEMA, Start};
pub use report::{AlignReport, AlignedPair, AlignedScan, Alignment, Freedom, PairState, ScanState};

use base::error::{Error, Result};
use base::progress::{Plan, Progress};
use view::{Reduced, View, coarse_cell};

/// Stages with their shares of the time.
const PLAN: Plan = &[("reading scans", 0.3), ("comparing scans", 0.5), ("fitting all scans", 0.2)];
/// Bytes that a scan's points and features take, and a pair that is looked at.
const BYTES_A_SCAN: f64 = 2.5e6;

/// Brings scans to one frame.
///
/// Poses of the scans are used where they are fixed and where `params.start` says that they are rough; otherwise only that of the
/// largest scan is, which stays.
///
/// # Errors
/// Parameters out of range; fewer than two scans; a constraint on a scan that isn't there; a scan whose pose is not rigid; whatever
/// loading a scan can meet; [`Error::Cancelled`].
pub fn run(
    sources: &[&dyn ScanSource],
    params: &AlignParams,
    constraints: &Constraints,
    progress: &Progress<'_>,
) -> Result<Alignment> {
    params.validate()?;
    if sources.len() < 2 {
        return Err(Error::input(format!("aligning takes at least two scans, got {}", sources.len())));
    }
    constraints.validate(sources)?;
    base::memory::foresee(sources.len(), BYTES_A_SCAN, "aligning", "scans")?;
    progress.plan(PLAN);
    let pool = base::threads::pool(params.threads)?;
    let alignment = progress.run(&pool, || {
        progress.stage(0, sources.len() as u64);
        let (views, order) = read(sources, progress)?;
        let inside = constraints.renumbered(&order, &views);
        let solved = solve::solve(&views, params, &inside, progress)?;
        Ok(report::alignment(sources, &views, &order, solved))
    });
    if alignment.is_err() {
        progress.check()?;
    }
    alignment
}

/// The scans made ready, the largest first, ties by content; and the number that each had.
fn read(sources: &[&dyn ScanSource], progress: &Progress<'_>) -> Result<(Vec<View>, Vec<usize>)> {
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
