//! What aligning, and placing by hand, found.

use numpy::PyArray2;
use pyo3::prelude::*;
use surfrecon::align::{self as core, Freedom};

use crate::arrays;
use crate::report::{figures_of, report};

/// Where a scan was drawn to by ``Aligner.snap``: a ``Snap``.
///
/// # Errors
/// None but of Python itself.
pub fn snap<'py>(py: Python<'py>, found: &core::Snap) -> PyResult<Bound<'py, PyAny>> {
    let world_from_scan = arrays::matrix(py, &found.world_from_scan);
    let core::Snap { touches, overlap, residual, balance, seen_through, moved, .. } = found;
    let (state, free) = (found.state.name(), ways(&found.free));
    report(
        "Snap",
        figures_of!(py, { world_from_scan, state, touches, overlap, residual, balance, seen_through, moved, free }),
    )
}

/// What was found by ``align``: an ``AlignReport``.
///
/// # Errors
/// None but of Python itself.
pub fn align_report<'py>(py: Python<'py>, found: &core::AlignReport) -> PyResult<Bound<'py, PyAny>> {
    let summary = found.lines();
    let scans = found.scans.iter().map(|scan| aligned_scan(py, scan)).collect::<PyResult<Vec<_>>>()?;
    let pairs = found.pairs.iter().map(|pair| aligned_pair(py, pair)).collect::<PyResult<Vec<_>>>()?;
    let turntable = found.turntable.as_ref().map(|found| turntable(py, found)).transpose()?;
    let placed = found.placed();
    let core::AlignReport { groups, compared, residual, messages, .. } = found;
    report(
        "AlignReport",
        figures_of!(py, { summary, scans, pairs, groups, placed, compared, residual, turntable, messages }),
    )
}

fn turntable<'py>(py: Python<'py>, found: &core::TurntableFound) -> PyResult<Bound<'py, PyAny>> {
    let axis = (found.axis.point.to_array(), found.axis.direction.to_array());
    let angles = &found.angles;
    report("TurntableFound", figures_of!(py, { axis, angles }))
}

fn aligned_scan<'py>(py: Python<'py>, scan: &core::AlignedScan) -> PyResult<Bound<'py, PyAny>> {
    let world_from_scan = scan.world_from_scan.as_ref().map(|pose| arrays::matrix(py, pose));
    let rows: Vec<Vec<f64>> = scan.covariance.iter().map(|row| row.to_vec()).collect();
    let covariance = PyArray2::from_vec2(py, &rows).expect("rows of equal length");
    let (state, middle, free) = (scan.state.name(), scan.middle.to_array(), ways(&scan.free));
    let core::AlignedScan { name, reason, group, deviation, overlap, residual, misfit, spacing, .. } = scan;
    report(
        "AlignedScan",
        figures_of!(py, {
            name,
            state,
            reason,
            group,
            world_from_scan,
            covariance,
            middle,
            deviation,
            free,
            overlap,
            residual,
            misfit,
            spacing,
        }),
    )
}

fn aligned_pair<'py>(py: Python<'py>, pair: &core::AlignedPair) -> PyResult<Bound<'py, PyAny>> {
    let (scans, overlap): ((usize, usize), (f64, f64)) = (pair.scans.into(), pair.overlap.into());
    let (state, free) = (pair.state.name(), ways(&pair.free));
    let core::AlignedPair { residual, balance, seen_through, places, .. } = pair;
    report("AlignedPair", figures_of!(py, { scans, state, overlap, residual, balance, seen_through, places, free }))
}

/// Ways to move: `("turn" or "slide", direction, point of the axis)`.
fn ways(free: &[Freedom]) -> Vec<(&'static str, [f64; 3], [f64; 3])> {
    let way =
        |way: &Freedom| (if way.turns { "turn" } else { "slide" }, way.direction.to_array(), way.point.to_array());
    free.iter().map(way).collect()
}
