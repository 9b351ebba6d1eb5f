//! Structs of parameters, a file an operation, and how what is in them becomes the core's parameters. The files below are
//! written by `make generate`.

// modules
pub mod align;
pub mod check_print;
pub mod close;
pub mod cluster;
pub mod merge;
pub mod open;
pub mod plane;
pub mod prepare_print;
pub mod quads;
pub mod reconstruct;
pub mod scan;
pub mod sculpt;
pub mod spline;
pub mod texture;
pub mod triangulate;
pub mod unwrap;
pub mod write;
// end

use surfrecon::params::{ParamKind, ParamSpec, Params, Value};

use crate::given::{Fields, Given};
use crate::settings::from_data;
use crate::sized;
use crate::status::{Failure, srf_status::SRF_ERR_PARAMETER};

/// The caller's struct as the core's parameters. The defaults if it is NULL.
pub fn read<P: Params + Default, F: Fields>(name: &str, given: *const F) -> Result<P, Failure> {
    to_core(&sized::read(name, given, F::defaults())?)
}

/// A struct's fields as the core's parameters, each checked.
pub fn to_core<P: Params + Default, F: Fields>(given: &F) -> Result<P, Failure> {
    let rows = P::rows();
    let mut values = Vec::new();
    for (name, given) in given.given() {
        if let Given::Reserved(set) = given {
            if set != 0 {
                return Err(Failure::new(SRF_ERR_PARAMETER, format!("{name} must be 0, got {set}")));
            }
            continue;
        }
        let row = rows.iter().copied().find(|row| row.name == name).expect("structs are made from the table");
        values.push((row, value(row, given)?));
    }
    for rows in P::alternatives() {
        let is_one = |(row, value): &(&ParamSpec, Value<'_>)| rows.contains(row) && *value != Value::Absent;
        // A field is never empty: what has a plain default holds where no other is given.
        if values.iter().any(|given| is_one(given) && given.0.is_optional()) {
            values.retain(|given| !rows.contains(given.0) || given.0.is_optional());
        }
    }
    let values: Vec<_> = values.into_iter().map(|(row, value)| (row.name, value)).collect();
    let mut params = P::default();
    params.set_all(&values)?;
    Ok(params)
}

fn value(row: &ParamSpec, given: Given) -> Result<Value<'static>, Failure> {
    let refused = |allowed: String, got: u64| {
        Err(Failure::new(SRF_ERR_PARAMETER, format!("{} must be {allowed}, got {got}", row.name)))
    };
    Ok(match (row.kind, given) {
        (_, Given::Reserved(_)) => unreachable!("it is no parameter"),
        (_, Given::Threads(asked)) => Value::Number(f64::from(asked)),
        (_, Given::Double(number)) if !row.is_optional() => Value::Number(number),
        (_, Given::Double(number)) if row.any_number => {
            if number.is_nan() {
                Value::Absent
            } else {
                Value::Number(number)
            }
        }
        (_, Given::Double(number)) => from_data(number).map_or(Value::Absent, Value::Number),
        (ParamKind::Flag, Given::Whole(flag @ 0..=1)) => Value::Flag(flag == 1),
        (ParamKind::Flag, Given::Whole(other)) => return refused("0 or 1".to_owned(), other),
        (ParamKind::Choice(choices), Given::Whole(place)) => {
            let chosen = usize::try_from(place).ok().and_then(|place| choices.get(place.checked_sub(1)?));
            match chosen {
                Some(choice) => Value::Choice(choice.name),
                None => {
                    let known = choices.iter().enumerate().map(|(i, choice)| format!("{} ({})", i + 1, choice.name));
                    return refused(format!("one of {}", known.collect::<Vec<_>>().join(", ")), place);
                }
            }
        }
        (_, Given::Whole(0)) if row.is_optional() => Value::Absent,
        // A number that a double can't hold is more than anything here counts.
        (_, Given::Whole(count)) if count as f64 as u64 != count => return Err(row.refused(count).into()),
        (_, Given::Whole(count)) => Value::Number(count as f64),
    })
}
