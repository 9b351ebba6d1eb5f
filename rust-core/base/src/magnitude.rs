//! Limits of numbers. Geometry multiplies coordinates to squares, areas, volumes and their products, which must stay finite. Larger numbers
//! are refused where they come in, by name. Scans of real things, in any unit, are nowhere near.

use glam::DVec3;

use crate::error::{Error, Result, Shown};

/// Largest size of a coordinate or a length: products of four stay finite.
pub const LARGEST: f64 = 1e75;
/// Smallest size of a divisor: the longest component of a direction, or a focal length. Also of the largest coordinate of a set of points,
/// unless all are zero.
pub const SMALLEST: f64 = 1e-75;

/// A coordinate, a length or an angle that may have any sign.
///
/// # Errors
/// [`Error::Input`] for a number that is not finite or larger than [`LARGEST`]. `name` begins the sentence.
pub fn coordinate(name: &str, value: f64) -> Result<f64> {
    if value.abs() <= LARGEST {
        return Ok(value);
    }
    Err(Error::input(format!("{name} must be a finite number of at most {LARGEST:e} in size, got {}", Shown(value))))
}

/// A number that is divided by.
///
/// # Errors
/// [`Error::Input`] for one that is not finite, larger than [`LARGEST`] or smaller than [`SMALLEST`].
pub fn divisor(name: &str, value: f64) -> Result<f64> {
    if (SMALLEST..=LARGEST).contains(&value.abs()) {
        return Ok(value);
    }
    Err(Error::input(format!("{name} must be {SMALLEST:e} to {LARGEST:e} in size, got {}", Shown(value))))
}

/// A place.
///
/// # Errors
/// [`Error::Input`] for one with a coordinate that is not finite or larger than [`LARGEST`].
pub fn place(name: &str, at: DVec3) -> Result<DVec3> {
    if fits(at) {
        return Ok(at);
    }
    Err(Error::input(format!("{name} must have finite coordinates of at most {LARGEST:e} in size, got {}", shown(at))))
}

/// A direction of any length that can be measured.
///
/// # Errors
/// [`Error::Input`] for one whose longest component is not finite, larger than [`LARGEST`] or smaller than [`SMALLEST`].
pub fn direction(name: &str, toward: DVec3) -> Result<DVec3> {
    if fits(toward) && toward.abs().max_element() >= SMALLEST {
        return Ok(toward);
    }
    Err(Error::input(format!(
        "{name} must be a direction whose longest component is {SMALLEST:e} to {LARGEST:e} in size, got {}",
        shown(toward)
    )))
}

/// Checks points. `what` is one of them, "vertex" for example.
///
/// # Errors
/// [`Error::Input`] naming the first with a coordinate that is not finite or larger than [`LARGEST`]. Or if all of them are smaller than
/// [`SMALLEST`] and not all zero.
pub fn points(what: &str, points: &[DVec3]) -> Result<()> {
    let Some(i) = points.iter().position(|p| !fits(*p)) else {
        let largest = points.iter().fold(DVec3::ZERO, |m, p| m.max(p.abs())).max_element();
        if largest == 0.0 || largest >= SMALLEST {
            return Ok(());
        }
        return Err(Error::input(format!(
            "no {what} has a coordinate larger than {}, but at least {SMALLEST:e} is needed, or products of them \
                vanish: use a smaller unit",
            Shown(largest)
        )));
    };
    if !points[i].is_finite() {
        return Err(Error::input(format!(
            "{what} {i} lies at {}: coordinates must be finite numbers",
            shown(points[i])
        )));
    }
    Err(Error::input(format!(
        "{what} {i} lies at {}: coordinates must be finite and at most {LARGEST:e}, or products of them overflow. Use a larger unit.",
        shown(points[i])
    )))
}

/// A point in an error.
pub fn shown(at: DVec3) -> String {
    format!("({}, {}, {})", Shown(at.x), Shown(at.y), Shown(at.z))
}

fn fits(at: DVec3) -> bool {
    // Comparisons with NaN are false.
    at.x.abs() <= LARGEST && at.y.abs() <= LARGEST && at.z.abs() <= LARGEST
}
