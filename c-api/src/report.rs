//! Structs of figures: how the core's reports become them. The structs are in `reports/`, written by `make generate`.

use bytemuck::Pod;
use surfrecon::reports::{FigureKind, Found, Holds, Values, in_order};

use crate::pose;
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
    push_all(values, &mut words);
    assert_eq!(size_of_val(words.as_slice()), size_of::<T>(), "the struct of {name} is generated from the same rows");
    sized::write(name, out, bytemuck::pod_read_unaligned(bytemuck::cast_slice(&words)))
}

/// Adds the numbers of a report's fields.
fn push_all(values: Values<'_>, words: &mut Vec<u64>) {
    for (field, found) in in_order(values) {
        let after = words.len() + field.numbers();
        match found {
            Found::Array(many) if matches!(field.holds, Holds::Array(_)) => {
                many.iter().for_each(|one| push(field.kind(), one, words));
            }
            Found::List(reports) => {
                for report in reports {
                    if let Found::Nested(values) = report {
                        push_all(values, words);
                    }
                }
                words.resize(after, 0);
            }
            Found::Absent => {
                let none = absent(field.kind());
                words.resize(after, none);
            }
            one => push(field.kind(), &one, words),
        }
        assert_eq!(words.len(), after, "{} has its numbers", field.name);
    }
}

/// Adds a value as the numbers of eight bytes that a struct holds of it.
fn push(kind: FigureKind, found: &Found<'_>, words: &mut Vec<u64>) {
    match (kind, found) {
        (_, Found::Flag(flag)) => words.push(u64::from(*flag)),
        (_, Found::Count(count)) => words.push(*count),
        (_, Found::Integer(number)) => words.push(number.cast_unsigned()),
        (_, Found::Number(number)) => words.push(number.to_bits()),
        (_, Found::Vector(vector)) => words.extend(vector.to_array().map(f64::to_bits)),
        (_, Found::Pose(transform)) => words.extend(pose::pose(*transform).matrix.map(f64::to_bits)),
        (FigureKind::Matrix(_), Found::Array(rows)) => {
            for row in rows {
                if let Found::Array(values) = row {
                    values.iter().for_each(|value| push(FigureKind::Number, value, words));
                }
            }
        }
        (FigureKind::Choice(choices), Found::Choice(name)) => words
            .push(1 + choices.iter().position(|choice| choice.name == *name).expect("the choices are declared") as u64),
        (kind, found) => unreachable!("{found:?} is no {kind:?} of a fixed size"),
    }
}

/// The number of a figure that does not apply.
fn absent(kind: FigureKind) -> u64 {
    match kind {
        FigureKind::Length | FigureKind::Angle | FigureKind::Ratio | FigureKind::Number => SRF_FROM_DATA.to_bits(),
        FigureKind::Vector | FigureKind::Pose | FigureKind::Matrix(_) => 0,
        _ => NONE,
    }
}
