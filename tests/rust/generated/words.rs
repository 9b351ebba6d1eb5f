//! Rows of the table in words.

use surfrecon::params::{Default, ParamKind, ParamSpec};

/// Place of the default in the list of a choice's values.
pub fn default_choice(row: &ParamSpec) -> usize {
    match row.default {
        Default::Value(place) => place as usize,
        Default::FromData(_) => unreachable!("a choice has a default"),
    }
}

/// A number as all our languages read it.
pub fn number(value: f64) -> String {
    if value.fract() == 0.0 && value.abs() < 1e16 { format!("{value:.0}") } else { format!("{value:?}") }
}

/// A number as people read it.
fn shown(value: f64) -> String {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, FRAC_PI_6, PI};
    let angles = [(FRAC_PI_6, "pi/6"), (FRAC_PI_4, "pi/4"), (FRAC_PI_2, "pi/2"), (PI, "pi")];
    let angle = angles.iter().find(|(angle, _)| *angle == value);
    angle.map_or_else(|| number(value), |(_, name)| (*name).to_owned())
}

/// The allowed numbers, for example `> 0` or `0 to 1`. Empty for all, and for what is no number.
pub fn range(row: &ParamSpec) -> String {
    match (row.kind, row.min.is_finite(), row.max.is_finite()) {
        (ParamKind::Flag | ParamKind::Choice(_), ..) | (_, false, false) => String::new(),
        (_, _, true) if !row.min_excluded => format!("{} to {}", shown(row.min), shown(row.max)),
        (_, _, bounded) => {
            let low = format!("{} {}", if row.min_excluded { ">" } else { ">=" }, shown(row.min));
            if bounded { format!("{low}, at most {}", shown(row.max)) } else { low }
        }
    }
}

/// The default of a number.
pub fn plain_default(row: &ParamSpec) -> Option<String> {
    match row.default {
        Default::Value(value) => Some(shown(value)),
        Default::FromData(_) => None,
    }
}

/// The rule that gives the default.
pub fn rule(row: &ParamSpec) -> Option<&'static str> {
    match row.default {
        Default::Value(_) => None,
        Default::FromData(rule) => Some(rule),
    }
}

/// With a large first letter.
pub fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// `AlignedScan` as `aligned_scan`.
pub fn snake(name: &str) -> String {
    let mut out = String::new();
    for letter in name.chars() {
        if letter.is_uppercase() && !out.is_empty() {
            out.push('_');
        }
        out.extend(letter.to_lowercase());
    }
    out
}

/// The text in lines that begin with `indent` and are at most `width` letters long.
pub fn wrapped(text: &str, indent: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(format!("{indent}{word}")),
        }
    }
    lines
}
