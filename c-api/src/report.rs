//! Structs of figures: how the core's reports become them. The structs are in `reports/`, written by `make generate`.

use bytemuck::Pod;
use surfrecon::reports::{Found, Kind, Values, in_order};

use crate::settings::SRF_FROM_DATA;
use crate::sized;
use crate::status::Failure;

/// Whole numbers of figures that do not apply.
const NONE: u64 = u64::MAX;

/// Writes a report into the caller's struct: as much of it as that has room for.
///
/// After its size and four bytes of 0 a struct has a number of eight bytes for each field.
pub fn write<T: Pod>(name: &str, out: *mut T, values: Values<'_>) -> Result<(), Failure> {
    let mut words: Vec<u64> = vec![0];
    for (field, found) in in_order(values) {
        match (field.array, found) {
            (None, one) => words.push(word(field.figure.kind, &one)),
            (Some(_), Found::Array(many)) => words.extend(many.iter().map(|one| word(field.figure.kind, one))),
            (Some(size), _) => words.extend(vec![word(field.figure.kind, &Found::Absent); size]),
        }
    }
    assert_eq!(size_of_val(words.as_slice()), size_of::<T>(), "the struct of {name} is generated from the same rows");
    sized::write(name, out, bytemuck::pod_read_unaligned(bytemuck::cast_slice(&words)))
}

/// A value as the eight bytes that a struct holds of it.
fn word(kind: Kind, found: &Found<'_>) -> u64 {
    match (kind, found) {
        (_, Found::Flag(flag)) => u64::from(*flag),
        (_, Found::Count(count)) => *count,
        (_, Found::Integer(number)) => number.cast_unsigned(),
        (_, Found::Number(number)) => number.to_bits(),
        (Kind::Choice(choices), Found::Choice(name)) => {
            1 + choices.iter().position(|choice| choice.name == *name).expect("the choices are declared") as u64
        }
        (Kind::Length | Kind::Angle | Kind::Ratio | Kind::Number, Found::Absent) => SRF_FROM_DATA.to_bits(),
        (_, Found::Absent) => NONE,
        (kind, found) => unreachable!("{found:?} is no {kind:?} of a fixed size"),
    }
}
