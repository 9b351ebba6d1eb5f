//! The structs of C++ that add nothing to C's but that they are made whole: what stands between `// structs` and `// end` in
//! `surfrecon.hpp`. One that adds more, or has another name, is written by hand beside them.

use std::fmt::Write as _;

use surfrecon::params::schemas;
use surfrecon::reports::reports;

use crate::c_params::names;
use crate::c_tests::type_name;
use crate::{between, compare, root};

const NAME: &str = "c-api/include/surfrecon.hpp";
const BEGIN: &str = "// structs\n";
const END: &str = "// end\n";

#[test]
fn structs() {
    let header = std::fs::read_to_string(root().join(NAME)).expect(NAME);
    let by_hand =
        format!("{}{}", header.split(BEGIN).next().unwrap_or_default(), header.split(END).nth(1).unwrap_or_default());
    let mut all = String::new();
    let mut add = |text: &str, cpp: &str, c: &str| {
        if !by_hand.contains(&format!(" : {c} {{")) {
            let _ = write!(all, "\n// {text}\nstruct {cpp} : {c} {{\n    {cpp}() {{ check({c}_init(this)); }}\n}};\n");
        }
    };
    for schema in schemas() {
        let (c, _) = names(schema.operation);
        add(&format!("The parameters of `{}`, with their defaults.", schema.operation), &type_name(&c), &c);
    }
    for reported in reports() {
        add(reported.text(), reported.name(), &format!("srf_{}_report", reported.operation));
    }
    compare(NAME, &between(NAME, BEGIN, END, &format!("{all}\n")));
}
