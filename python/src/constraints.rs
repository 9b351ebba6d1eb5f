//! Knowledge of the caller about scans to be aligned: numbers of scans, picks, a turntable.

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfrecon::align::{Axis, Constraints, Pick as Core};

use crate::arrays;
use crate::errors::{input_error, reworded};
use crate::params::no_others;
use crate::pickling::{self, Reduced, reduced};

/// A point that two scans show, for ``align(picks=...)``.
///
/// Three for a pair place it even where it may turn. With normals two do. The points count, not how near they are to a sample.
///
/// >>> pick = surfrecon.Pick(0, 1, point, other_point, normals=(normal, other_normal))
/// >>> aligned = surfrecon.align(scans, picks=[pick])
///
/// Args:
///     a, b: numbers of the scans, counted from 0.
///     point_a, point_b: (3,) where each scan shows the point, in the scan's own frame.
///     normals: ``(normal_a, normal_b)``, (3,) each: which way is out of the surface there, in the scans' own frames, of any length
///         but 0. ``None`` where that is not known.
///     weight: > 0. At 1 it counts as much as a two-thousandth of the smaller scan's surface.
///
/// Raises:
///     InputError: arrays of another shape, a number of a scan below 0, a number that is not finite. ``align`` refuses all else that makes no sense.
///     TypeError: what is no number.
#[pyclass(frozen, module = "surfrecon")]
pub struct Pick {
    pick: Core,
}

#[pymethods]
impl Pick {
    #[new]
    #[pyo3(signature = (a, b, point_a, point_b, *, normals = None, weight = 1.0, **others),
        text_signature = "(a, b, point_a, point_b, *, normals=None, weight=1.0)")]
    pub fn new(
        a: &Bound<'_, PyAny>,
        b: &Bound<'_, PyAny>,
        point_a: &Bound<'_, PyAny>,
        point_b: &Bound<'_, PyAny>,
        normals: Option<&Bound<'_, PyAny>>,
        weight: f64,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        no_others("Pick", others)?;
        let scans = [scan_number(a, "the pick")?, scan_number(b, "the pick")?];
        let points = [arrays::vector(point_a, "point_a")?, arrays::vector(point_b, "point_b")?];
        let both = |normals: &Bound<'_, PyAny>| {
            let [a, b] = two(normals).ok_or_else(|| {
                PyTypeError::new_err(format!("normals must be (normal_a, normal_b), got {}", shown(normals)))
            })?;
            Ok::<_, PyErr>([arrays::vector(&a, "normal_a")?, arrays::vector(&b, "normal_b")?])
        };
        let pick = Core { scans, points, normals: normals.map(both).transpose()?, weight };
        numbers_of(&pick, "the pick")?;
        Ok(Pick { pick })
    }

    /// Number of the first scan.
    #[getter]
    fn a(&self) -> usize {
        self.pick.scans[0]
    }

    /// Number of the second scan.
    #[getter]
    fn b(&self) -> usize {
        self.pick.scans[1]
    }

    /// The point as the first scan shows it, in the scan's own frame.
    #[getter]
    fn point_a(&self) -> [f64; 3] {
        self.pick.points[0].to_array()
    }

    /// The point as the second scan shows it, in the scan's own frame.
    #[getter]
    fn point_b(&self) -> [f64; 3] {
        self.pick.points[1].to_array()
    }

    /// ``(normal_a, normal_b)``, or ``None``.
    #[getter]
    fn normals(&self) -> Option<([f64; 3], [f64; 3])> {
        self.pick.normals.map(|[a, b]| (a.to_array(), b.to_array()))
    }

    /// The weight of the pick.
    #[getter]
    fn weight(&self) -> f64 {
        self.pick.weight
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Reduced<'py>> {
        reduced("pick", pickling::attributes(slf, &["a", "b", "point_a", "point_b", "normals", "weight"])?)
    }

    fn __copy__(slf: PyRef<'_, Self>) -> PyRef<'_, Self> {
        slf
    }

    fn __deepcopy__<'py>(slf: PyRef<'py, Self>, _memo: &Bound<'py, PyAny>) -> PyRef<'py, Self> {
        slf
    }

    fn __repr__(&self) -> String {
        let Core { scans: [a, b], points, normals, weight } = &self.pick;
        let [at, beside] = points.map(|point| point.to_array());
        let normals = if normals.is_some() { " with normals" } else { "" };
        format!("<Pick of scans {a} and {b} at {at:?} and {beside:?}{normals}, weight {weight}>")
    }
}

/// Takes what Python's `align` is given of constraints.
///
/// # Errors
/// `TypeError` for what is something else, `InputError` for arrays of another shape and numbers below 0.
pub fn constraints(
    fixed: Option<&Bound<'_, PyAny>>,
    picks: Option<&Bound<'_, PyAny>>,
    trusted: Option<&Bound<'_, PyAny>>,
    rejected: Option<&Bound<'_, PyAny>>,
    axis: Option<&Bound<'_, PyAny>>,
    angles: Option<&Bound<'_, PyAny>>,
) -> PyResult<Constraints> {
    let angles = angles.map(|angles| arrays::floats(angles, "angles", &[None])).transpose()?;
    if angles.as_ref().is_some_and(|(angles, _)| angles.is_empty()) {
        return Err(input_error("angles has no entry: give one a scan, or none at all".to_owned()));
    }
    Ok(Constraints {
        fixed: each(fixed, "fixed", "numbers of scans", |_, scan| scan_number(scan, "fixed"))?,
        picks: each(picks, "picks", "picks", picked)?,
        trusted: each(trusted, "trusted", "pairs (a, b)", |number, scans| pair(scans, "trusted", number))?,
        rejected: each(rejected, "rejected", "pairs (a, b)", |number, scans| pair(scans, "rejected", number))?,
        axis: axis.map(axis_of).transpose()?,
        angles: angles.map(|(angles, _)| angles).unwrap_or_default(),
    })
}

/// The number of a scan.
///
/// # Errors
/// `TypeError` for what is no whole number, `InputError` below 0.
pub fn scan_number(given: &Bound<'_, PyAny>, what: &str) -> PyResult<usize> {
    let number = given.call_method0("__index__").map_err(|error| {
        reworded(error, || {
            PyTypeError::new_err(format!("{what} must name scans by whole numbers, got {}", shown(given)))
        })
    })?;
    number.extract().map_err(|error| {
        reworded(error, || {
            input_error(format!("{what} names scan {number}, but scans are counted from 0, up to how many there are"))
        })
    })
}

/// Entries of a list.
fn each<T>(
    given: Option<&Bound<'_, PyAny>>,
    what: &str,
    of: &str,
    take: impl Fn(usize, &Bound<'_, PyAny>) -> PyResult<T>,
) -> PyResult<Vec<T>> {
    let Some(given) = given else { return Ok(Vec::new()) };
    let entries = given.try_iter().map_err(|error| {
        reworded(error, || PyTypeError::new_err(format!("{what} must be a list of {of}, got {}", shown(given))))
    })?;
    entries.enumerate().map(|(number, entry)| take(number, &entry?)).collect()
}

fn pair(given: &Bound<'_, PyAny>, what: &str, number: usize) -> PyResult<[usize; 2]> {
    let [a, b] = two(given).ok_or_else(|| {
        PyTypeError::new_err(format!("entry {number} of {what} must be a pair (a, b) of scans, got {}", shown(given)))
    })?;
    Ok([scan_number(&a, what)?, scan_number(&b, what)?])
}

fn picked(number: usize, given: &Bound<'_, PyAny>) -> PyResult<Core> {
    if let Ok(pick) = given.cast::<Pick>() {
        return Ok(pick.get().pick);
    }
    let entries = entries(given).unwrap_or_default();
    let (a, b, points, weight) = match entries.as_slice() {
        [a, b, point_a, point_b] => (a, b, [point_a, point_b], Ok(1.0)),
        [a, b, point_a, point_b, weight] => (a, b, [point_a, point_b], weight.extract()),
        _ => {
            return Err(PyTypeError::new_err(format!(
                "pick {number} must be a Pick, (a, b, point_a, point_b) or (a, b, point_a, point_b, weight), got {}",
                shown(given)
            )));
        }
    };
    let what = format!("pick {number}");
    let scans = [scan_number(a, &what)?, scan_number(b, &what)?];
    let point = |side: usize, name: &str| arrays::vector(points[side], &format!("{name} of {what}"));
    let points = [point(0, "point_a")?, point(1, "point_b")?];
    let weight =
        weight.map_err(|_: PyErr| PyTypeError::new_err(format!("{what}: its weight must be a real number")))?;
    let pick = Core { scans, points, normals: None, weight };
    numbers_of(&pick, &what)?;
    Ok(pick)
}

/// Refuses a pick of which a number is none.
fn numbers_of(pick: &Core, what: &str) -> PyResult<()> {
    let places = pick.points.into_iter().zip(["point_a", "point_b"]);
    let normals = pick.normals.into_iter().flatten().zip(["normal_a", "normal_b"]);
    places.chain(normals).try_for_each(|(at, name)| finite(&at.to_array(), &format!("{name} of {what}")))?;
    finite(&[pick.weight], &format!("weight of {what}"))
}

/// Refuses what is no finite number.
fn finite(numbers: &[f64], what: &str) -> PyResult<()> {
    match numbers.iter().find(|number| !number.is_finite()) {
        None => Ok(()),
        Some(number) => {
            let number = if number.is_nan() { "nan".to_owned() } else { number.to_string() };
            Err(input_error(format!(
                "{what} has the number {number}, but each must be finite: leave the pick out if it was not measured"
            )))
        }
    }
}

fn axis_of(given: &Bound<'_, PyAny>) -> PyResult<Axis> {
    let [point, direction] = two(given).ok_or_else(|| {
        PyTypeError::new_err(format!("axis must be (point, direction), three numbers each, got {}", shown(given)))
    })?;
    Ok(Axis {
        point: arrays::vector(&point, "the axis' point")?,
        direction: arrays::vector(&direction, "the axis' direction")?,
    })
}

/// The entries of anything that has some.
fn entries<'py>(given: &Bound<'py, PyAny>) -> Option<Vec<Bound<'py, PyAny>>> {
    given.try_iter().ok()?.collect::<PyResult<_>>().ok()
}

fn two<'py>(given: &Bound<'py, PyAny>) -> Option<[Bound<'py, PyAny>; 2]> {
    entries(given)?.try_into().ok()
}

/// The given value, as Python writes it.
fn shown(given: &Bound<'_, PyAny>) -> String {
    given.repr().map_or_else(|_| given.get_type().to_string(), |text| text.to_string())
}
