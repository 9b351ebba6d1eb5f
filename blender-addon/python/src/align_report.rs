//! What aligning, and placing by hand, found.

use numpy::PyArray2;
use pyo3::prelude::*;
use surfrecon::align::{self as core, Snap as CoreSnap};

use crate::arrays;

/// Where a scan was drawn to by ``Aligner.snap``, and how well it lies there. Lengths in the unit of the scans.
#[pyclass(frozen, module = "surfrecon")]
pub struct Snap {
    pub snap: CoreSnap,
}

#[pymethods]
impl Snap {
    /// 4 x 4 float64: where it was drawn to; where it was if it touches nothing.
    #[getter]
    fn world_from_scan<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        arrays::matrix(py, &self.snap.world_from_scan)
    }

    /// ``"fits"``, ``"misfit"`` (it overlaps, but further apart than noise explains), ``"slides"`` (it fits, but may turn or slide),
    /// ``"seen_through"`` (sensors saw through where it lies) or ``"nothing"`` (it touches nothing, or too little).
    #[getter]
    fn state(&self) -> &'static str {
        self.snap.state.name()
    }

    /// Numbers of the scans that it touches.
    #[getter]
    fn touches(&self) -> Vec<usize> {
        self.snap.touches.clone()
    }

    /// Share of its surface that lies on the scan that shares most with it.
    #[getter]
    fn overlap(&self) -> f64 {
        self.snap.overlap
    }

    /// Root mean square distance to the surfaces of the others, along normals.
    #[getter]
    fn residual(&self) -> f64 {
        self.snap.residual
    }

    /// How well it is held against turning and sliding: 1 at best, 0 where it may.
    #[getter]
    fn balance(&self) -> f64 {
        self.snap.balance
    }

    /// Of what the sensors can tell, the share that speaks against it.
    #[getter]
    fn seen_through(&self) -> f64 {
        self.snap.seen_through
    }

    /// How far its points moved, at most.
    #[getter]
    fn moved(&self) -> f64 {
        self.snap.moved
    }

    /// Ways that it may turn or slide: ``("turn" or "slide", direction, point of the axis)``.
    #[getter]
    fn free(&self) -> Vec<Free> {
        self.snap.free.iter().map(free).collect()
    }

    fn __repr__(&self) -> String {
        let CoreSnap { overlap, residual, moved, .. } = &self.snap;
        format!("<Snap {}, overlap {:.0} %, residual {residual:.3e}, moved {moved:.3e}>", self.state(), 100.0 * overlap)
    }
}

/// What was found by ``align``: each scan, each pair, and what the user should know. Lengths in the unit of the scans.
#[pyclass(frozen, module = "surfrecon")]
pub struct AlignReport {
    pub report: core::AlignReport,
}

#[pymethods]
impl AlignReport {
    /// Each scan, in the order given.
    #[getter]
    fn scans(&self) -> Vec<AlignedScan> {
        self.report.scans.iter().map(|scan| AlignedScan { scan: scan.clone() }).collect()
    }

    /// The pairs of scans of which anything was found.
    #[getter]
    fn pairs(&self) -> Vec<AlignedPair> {
        self.report.pairs.iter().map(|pair| AlignedPair { pair: pair.clone() }).collect()
    }

    /// Numbers of the scans that are joined, a list a group; the first is the one that is placed.
    #[getter]
    fn groups(&self) -> Vec<Vec<usize>> {
        self.report.groups.clone()
    }

    /// Scans that have a pose.
    #[getter]
    fn placed(&self) -> usize {
        self.report.placed()
    }

    /// Pairs that were compared.
    #[getter]
    fn compared(&self) -> usize {
        self.report.compared
    }

    /// Root mean square distance of the surfaces of all pairs that touch, along normals; ``None`` where none do.
    #[getter]
    fn residual(&self) -> Option<f64> {
        self.report.residual
    }

    /// The turntable, where there was one and it was found; otherwise ``None``.
    #[getter]
    fn turntable(&self) -> Option<TurntableFound> {
        self.report.turntable.clone().map(|found| TurntableFound { found })
    }

    /// What the user should know, a sentence each.
    #[getter]
    fn messages(&self) -> Vec<String> {
        self.report.messages.clone()
    }

    fn __str__(&self) -> String {
        self.report.lines().join("\n")
    }

    fn __repr__(&self) -> String {
        format!("<AlignReport: {}>", self.report.lines()[0])
    }
}

/// A turntable as it was found.
#[pyclass(frozen, module = "surfrecon")]
pub struct TurntableFound {
    pub found: core::TurntableFound,
}

#[pymethods]
impl TurntableFound {
    /// ``(point, direction)`` in the frame that the scans were taken in; the direction is of length 1. What ``align`` takes.
    #[getter]
    fn axis(&self) -> ([f64; 3], [f64; 3]) {
        (self.found.axis.point.to_array(), self.found.axis.direction.to_array())
    }

    /// By how much it was turned at each scan, in radians from 0 to 2 pi, counter-clockwise where the axis points to the viewer; 0
    /// at the first scan that is placed. ``None`` for scans that aren't.
    #[getter]
    fn angles(&self) -> Vec<Option<f64>> {
        self.found.angles.clone()
    }

    fn __repr__(&self) -> String {
        let (point, direction) = self.axis();
        format!("<TurntableFound about {direction:?} through {point:?}>")
    }
}

/// What was found of a scan.
#[pyclass(frozen, module = "surfrecon")]
pub struct AlignedScan {
    pub scan: core::AlignedScan,
}

#[pymethods]
impl AlignedScan {
    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        &self.scan.name
    }

    /// ``"placed"``, ``"kept"`` (its pose is as given), ``"apart"`` (joined with others, but these with nothing) or ``"unplaced"``.
    #[getter]
    fn state(&self) -> &'static str {
        self.scan.state.name()
    }

    /// Why it is not placed, and what to do; empty if it is.
    #[getter]
    fn reason(&self) -> &str {
        &self.scan.reason
    }

    /// Number of its group: 0 is the one that is placed; ``None`` if it is in none.
    #[getter]
    fn group(&self) -> Option<usize> {
        self.scan.group
    }

    /// 4 x 4 float64, its pose in its group, or ``None``. Scans of a group that is not placed lie together where the largest of
    /// them was given.
    #[getter]
    fn world_from_scan<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyAny>> {
        self.scan.world_from_scan.as_ref().map(|pose| arrays::matrix(py, pose))
    }

    /// 6 x 6 float64: covariance of a small motion of it in the world, a turn about ``middle`` (radians), then a shift. Zero for
    /// scans that are kept.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let rows: Vec<Vec<f64>> = self.scan.covariance.iter().map(|row| row.to_vec()).collect();
        Ok(PyArray2::from_vec2(py, &rows).expect("rows of equal length").into_any())
    }

    /// The middle of its points, in the world.
    #[getter]
    fn middle(&self) -> [f64; 3] {
        self.scan.middle.to_array()
    }

    /// One standard deviation of the place of its points, where it is largest; at least its size where nothing holds it, infinite where it has
    /// no place.
    #[getter]
    fn deviation(&self) -> f64 {
        self.scan.deviation
    }

    /// Ways that nothing holds it: ``("turn" or "slide", direction, point of the axis)``.
    #[getter]
    fn free(&self) -> Vec<Free> {
        self.scan.free.iter().map(free).collect()
    }

    /// Share of its surface that lies on the scan that shares most with it.
    #[getter]
    fn overlap(&self) -> f64 {
        self.scan.overlap
    }

    /// Root mean square distance to the surfaces of others, along normals.
    #[getter]
    fn residual(&self) -> f64 {
        self.scan.residual
    }

    /// Root mean square of how far it lies from the others where noise is averaged out: what no rigid pose explains, such as warp.
    /// Bending within a few samples counts as well, so that some of it is always there. ``Alignment.misfit`` says where it is.
    #[getter]
    fn misfit(&self) -> f64 {
        self.scan.misfit
    }

    /// Median distance of its samples.
    #[getter]
    fn spacing(&self) -> f64 {
        self.scan.spacing
    }

    fn __repr__(&self) -> String {
        let reason = if self.scan.reason.is_empty() { String::new() } else { format!(": {}", self.scan.reason) };
        format!("<AlignedScan {:?} {}{reason}>", self.scan.name, self.state())
    }
}

/// A way to move, for Python.
pub type Free = (&'static str, [f64; 3], [f64; 3]);

/// What Python is told of a way to move.
pub fn free(freedom: &core::Freedom) -> Free {
    (if freedom.turns { "turn" } else { "slide" }, freedom.direction.to_array(), freedom.point.to_array())
}

/// What was found of two scans.
#[pyclass(frozen, module = "surfrecon")]
pub struct AlignedPair {
    pub pair: core::AlignedPair,
}

#[pymethods]
impl AlignedPair {
    /// Their numbers, the smaller first.
    #[getter]
    fn scans(&self) -> (usize, usize) {
        self.pair.scans.into()
    }

    /// ``"fits"``, ``"misfit"`` (they overlap, but further apart than noise explains), or why the pair was not used: ``"slides"``,
    /// ``"ambiguous"``, ``"background"``, ``"seen_through"``, ``"disagrees"``, ``"rejected"``.
    #[getter]
    fn state(&self) -> &'static str {
        self.pair.state.name()
    }

    /// Share of either surface that lies on the other.
    #[getter]
    fn overlap(&self) -> (f64, f64) {
        self.pair.overlap.into()
    }

    /// Root mean square distance of the surfaces where they touch, along normals.
    #[getter]
    fn residual(&self) -> f64 {
        self.pair.residual
    }

    /// How well it is held against turning and sliding: 1 at best, 0 where it may.
    #[getter]
    fn balance(&self) -> f64 {
        self.pair.balance
    }

    /// Of what the sensors can tell, the share that speaks against it.
    #[getter]
    fn seen_through(&self) -> f64 {
        self.pair.seen_through
    }

    /// Places in which one fits the other.
    #[getter]
    fn places(&self) -> usize {
        self.pair.places
    }

    /// Ways that it may turn or slide: ``("turn" or "slide", direction, point of the axis)``.
    #[getter]
    fn free(&self) -> Vec<Free> {
        self.pair.free.iter().map(free).collect()
    }

    fn __repr__(&self) -> String {
        let [a, b] = self.pair.scans;
        format!("<AlignedPair {a}, {b} {}>", self.state())
    }
}
