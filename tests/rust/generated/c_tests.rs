//! The structs of the header as the tests of the C library declare them: `tests/rust/c/generated.rs`.

use std::fmt::Write as _;

use surfrecon::params::schemas;
use surfrecon::reports::reports;

use crate::c_params::{beside, fields, formatted, names};
use crate::compare;

/// `srf_read_options` as `ReadOptions`.
fn type_name(of: &str) -> String {
    of.trim_start_matches("srf_").split('_').map(crate::words::sentence).collect()
}

#[test]
fn structs_of_the_c_tests() {
    let mut out =
        "//! Structs of the header by the numbers after their first eight bytes. Written by `make generate`.\n\n\
                   use crate::types::Sized;\n"
            .to_owned();
    for schema in schemas() {
        let (name, _) = names(schema.operation);
        let numbers = beside(schema).iter().map(|field| numbers_of(field.1)).sum::<usize>();
        let _ = write!(out, "\npub type {} = Sized<{}>;\n", type_name(&name), numbers + fields(schema).len());
    }
    for reported in reports() {
        let (mut numbers, mut places) = (0, String::new());
        for field in reported.fields() {
            let _ = writeln!(places, "    pub const {}: usize = {numbers};", field.name.to_uppercase());
            numbers += field.array.unwrap_or(1);
        }
        let _ = write!(
            out,
            "\npub type {0} = Sized<{numbers}>;\n\n/// Places of the figures of [`{0}`].\n\
             #[allow(dead_code, reason = \"tests look at some\")]\npub mod {1}_report {{\n{places}}}\n",
            reported.name(),
            reported.operation,
        );
    }
    compare("tests/rust/c/generated.rs", &formatted(&out));
}

/// How many numbers an array has, by its type.
fn numbers_of(kind: &str) -> usize {
    let size = kind.trim_end_matches(']').rsplit("; ").next();
    size.and_then(|size| size.parse().ok()).unwrap_or(1)
}
