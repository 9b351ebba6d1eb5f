//! How pixels see: a dict with `kind` and its parameters, both ways.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfrecon::range_image::{DepthKind, Projection, Viewing};

use crate::arrays;
use crate::errors::{input_error, reworded};

/// "parallel" with a direction, or "from" an origin. Along -z without either.
///
/// # Errors
/// `InputError` for anything else.
pub fn viewing(value: Option<&Bound<'_, PyAny>>) -> PyResult<Viewing> {
    let Some(value) = value else { return Ok(Viewing::ALONG_MINUS_Z) };
    // A list, too: what was kept as JSON has no tuples.
    let wrong = || input_error("viewing must be (\"parallel\", direction) or (\"from\", origin)".to_owned());
    let [kind, vector] = value.extract::<[Bound<'_, PyAny>; 2]>().map_err(|error| reworded(error, wrong))?;
    let kind = kind.extract::<String>().map_err(|error| reworded(error, wrong))?;
    match kind.as_str() {
        "parallel" => Ok(Viewing::Parallel(arrays::vector(&vector, "the viewing direction")?)),
        "from" => Ok(Viewing::From(arrays::vector(&vector, "the sensor's origin")?)),
        _ => Err(input_error(format!("viewing must begin with \"parallel\" or \"from\", got {kind:?}"))),
    }
}

/// A projection as a dict with ``kind`` and its parameters.
///
/// # Errors
/// None but of Python itself.
pub fn described<'py>(py: Python<'py>, projection: &Projection) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    let set = |kind: &str, first: (&str, [f64; 2]), second: (&str, [f64; 2])| -> PyResult<()> {
        dict.set_item("kind", kind)?;
        dict.set_item(first.0, <(f64, f64)>::from(first.1))?;
        dict.set_item(second.0, <(f64, f64)>::from(second.1))
    };
    match *projection {
        Projection::Orthographic { first, step } => set("orthographic", ("first", first), ("step", step))?,
        Projection::Spherical { first, step } => set("spherical", ("first", first), ("step", step))?,
        Projection::Pinhole { focal, centre, depth } => {
            set("pinhole", ("focal", focal), ("centre", centre))?;
            dict.set_item("depth", if depth == DepthKind::Planar { "planar" } else { "ray" })?;
        }
        Projection::PointGrid(viewing) => {
            let (kind, v) = match viewing {
                Viewing::Parallel(direction) => ("parallel", direction),
                Viewing::From(origin) => ("from", origin),
            };
            dict.set_item("kind", "points")?;
            dict.set_item("viewing", (kind, <(f64, f64, f64)>::from(v)))?;
        }
    }
    Ok(dict)
}

/// The projection that [`described`] made a dict of.
///
/// # Errors
/// `InputError` for a kind that isn't known, for parameters that are missing or of the wrong length.
pub fn parsed(dict: &Bound<'_, PyDict>) -> PyResult<Projection> {
    let of = |name: &str| {
        let lacking = || input_error(format!("projection must have {name:?}, see RangeImage.projection"));
        dict.get_item(name)?.ok_or_else(lacking)
    };
    let text = |name: &str| {
        let value = of(name)?;
        value.extract::<String>().map_err(|_| input_error(format!("{name} of projection must be a text, got {value}")))
    };
    let pair = |name: &str| -> PyResult<[f64; 2]> {
        let (numbers, _) = arrays::floats(&of(name)?, &format!("{name} of projection"), &[Some(2)])?;
        Ok([numbers[0], numbers[1]])
    };
    let kind = text("kind")?;
    Ok(match kind.as_str() {
        "orthographic" => Projection::Orthographic { first: pair("first")?, step: pair("step")? },
        "spherical" => Projection::Spherical { first: pair("first")?, step: pair("step")? },
        "pinhole" => {
            let depth = text("depth")?;
            let depth = DepthKind::named(&depth).ok_or_else(|| {
                input_error(format!("depth of projection must be \"planar\" or \"ray\", got {depth:?}"))
            })?;
            Projection::Pinhole { focal: pair("focal")?, centre: pair("centre")?, depth }
        }
        "points" => Projection::PointGrid(viewing(Some(&of("viewing")?))?),
        _ => {
            let known = "\"orthographic\", \"pinhole\", \"spherical\" or \"points\"";
            return Err(input_error(format!("kind of projection must be {known}, got {kind:?}")));
        }
    })
}
