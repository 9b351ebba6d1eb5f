//! One row of the table.

use crate::error::{Error, Result, Shown};
use crate::nearest::meant;

/// The sort of a parameter, which says its unit too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParamKind {
    /// A number in the unit of the scans' coordinates, whatever that is.
    Length,
    /// Radians. Hosts show degrees.
    Angle,
    /// A plain ratio or share.
    Ratio,
    /// A whole number of things.
    Count,
    /// On or off.
    Flag,
    /// One of these, the first by default.
    Choice(&'static [Choice]),
}

/// One of the things a parameter may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// Name, the same in every language. For choices that are numbers it is the place in the list, counted from 1.
    pub name: &'static str,
    /// Name for people.
    pub label: &'static str,
    /// Its meaning.
    pub text: &'static str,
}

/// Source of a parameter's value when the caller gives none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Default {
    /// This value: of a flag 0 or 1, of a choice its place in the list.
    Value(f64),
    /// Measured from the data, or nothing at all. The text says how.
    FromData(&'static str),
}

/// A parameter's value in the form in which it is set and got by name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value<'a> {
    /// None given: the default.
    Absent,
    /// A length, an angle, a ratio or a count.
    Number(f64),
    /// A flag.
    Flag(bool),
    /// The name of a choice.
    Choice(&'a str),
}

/// One parameter of one operation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParamSpec {
    /// Operation, for example `merge`.
    pub operation: &'static str,
    /// Name, the same in every language.
    pub name: &'static str,
    /// Name for people.
    pub label: &'static str,
    /// Its sort, which says its unit.
    pub kind: ParamKind,
    /// Value when none is given.
    pub default: Default,
    /// Smallest allowed number. Minus infinity for none.
    pub min: f64,
    /// Whether `min` itself is refused.
    pub min_excluded: bool,
    /// Largest allowed number. Infinity for none.
    pub max: f64,
    /// Whether all numbers are allowed, infinite ones and NaN too.
    pub any_number: bool,
    /// Its effect, and the effect of smaller and larger values: one or two sentences. Of a flag, the effect when it is on.
    pub text: &'static str,
    /// The effect of 0, or of a flag that is off. Empty if that is plain from the text.
    pub off: &'static str,
    /// The version of the library it came with.
    pub since: &'static str,
}

/// A row for a length.
pub const fn length(label: &'static str) -> ParamSpec {
    ParamSpec::new(ParamKind::Length, label)
}

/// A row for an angle.
pub const fn angle(label: &'static str) -> ParamSpec {
    ParamSpec::new(ParamKind::Angle, label)
}

/// A row for a ratio.
pub const fn ratio(label: &'static str) -> ParamSpec {
    ParamSpec::new(ParamKind::Ratio, label)
}

/// A row for a count.
pub const fn count(label: &'static str) -> ParamSpec {
    ParamSpec::new(ParamKind::Count, label)
}

/// A row for a flag, off by default.
pub const fn flag(label: &'static str) -> ParamSpec {
    ParamSpec::new(ParamKind::Flag, label).at_most(1.0)
}

/// A row for one of several things, the first by default.
pub const fn choice(label: &'static str, choices: &'static [Choice]) -> ParamSpec {
    ParamSpec::new(ParamKind::Choice(choices), label).at_most(choices.len() as f64 - 1.0)
}

/// The row of every operation's worker threads.
pub const fn threads() -> ParamSpec {
    count("Threads").at_most(1024.0)
}

impl ParamSpec {
    /// A row of version 0.1 whose default is 0 and whose value may be 0 or larger.
    const fn new(kind: ParamKind, label: &'static str) -> Self {
        ParamSpec {
            operation: "",
            name: "",
            label,
            kind,
            default: Default::Value(0.0),
            min: 0.0,
            min_excluded: false,
            max: f64::INFINITY,
            any_number: false,
            text: "",
            off: "",
            since: "0.1",
        }
    }

    /// With this default.
    pub const fn default(mut self, value: f64) -> Self {
        self.default = Default::Value(value);
        self
    }

    /// A flag that is on by default.
    pub const fn on(self) -> Self {
        self.default(1.0)
    }

    /// With a default that the data give, as the text says.
    pub const fn from_data(mut self, how: &'static str) -> Self {
        self.default = Default::FromData(how);
        self
    }

    /// Only larger numbers.
    pub const fn above(mut self, min: f64) -> Self {
        (self.min, self.min_excluded) = (min, true);
        self
    }

    /// Only this number and larger ones.
    pub const fn at_least(mut self, min: f64) -> Self {
        (self.min, self.min_excluded) = (min, false);
        self
    }

    /// Only this number and smaller ones.
    pub const fn at_most(mut self, max: f64) -> Self {
        self.max = max;
        self
    }

    /// Any number at all: one that marks something.
    pub const fn any_number(mut self) -> Self {
        (self.min, self.any_number) = (f64::NEG_INFINITY, true);
        self
    }

    /// Sets the effect of 0, or of a flag that is off.
    pub const fn off(mut self, text: &'static str) -> Self {
        self.off = text;
        self
    }

    /// The version it came with, if not the first. Structs of C have their fields in the order of versions.
    pub const fn since(mut self, version: &'static str) -> Self {
        self.since = version;
        self
    }

    /// The row as [`params!`](crate::params!) completes it. `text` comes from a comment, with the space after its slashes.
    pub const fn of(mut self, operation: &'static str, name: &'static str, text: &'static str) -> Self {
        self.operation = operation;
        self.name = name;
        self.text = text.trim_ascii();
        self
    }

    /// The values of a choice. Empty for all other kinds.
    pub const fn choices(&self) -> &'static [Choice] {
        match self.kind {
            ParamKind::Choice(choices) => choices,
            _ => &[],
        }
    }

    /// Whether no value need be given since the data have it.
    pub const fn is_optional(&self) -> bool {
        matches!(self.default, Default::FromData(_))
    }

    /// Checks a given number against the range.
    ///
    /// # Errors
    /// [`Error::Parameter`] with the value, the allowed range and the unit.
    pub fn check(&self, value: f64) -> Result<f64> {
        if self.any_number {
            return Ok(value);
        }
        let low = if self.min_excluded { value > self.min } else { value >= self.min };
        let in_range = low && value <= self.max && value.is_finite();
        match (self.kind, value.fract() == 0.0) {
            (ParamKind::Count, true) if !in_range => Err(self.refused(format!("{value:.0}"))),
            (ParamKind::Count, false) if in_range => {
                let allowed = format!("a whole number {}", self.allowed());
                Err(Error::Parameter { name: self.name, value: Shown(value).to_string(), allowed, unit: "" })
            }
            _ if in_range => Ok(value),
            _ => Err(self.refused(Shown(value))),
        }
    }

    /// The error that names what is allowed instead of `value`.
    pub fn refused(&self, value: impl ToString) -> Error {
        let unit = match self.kind {
            ParamKind::Length => " (in the unit of the scans)",
            ParamKind::Angle => " rad",
            _ => "",
        };
        Error::Parameter { name: self.name, value: value.to_string(), allowed: self.allowed(), unit }
    }

    /// The allowed values in words, for example `> 0 and <= 1`.
    pub fn allowed(&self) -> String {
        match self.kind {
            ParamKind::Flag => return "on or off".to_owned(),
            ParamKind::Choice(choices) => {
                return one_of(choices.iter().map(|choice| format!("\"{}\"", choice.name)), "or");
            }
            _ => {}
        }
        if self.min == f64::NEG_INFINITY {
            return "a finite number".to_owned();
        }
        let low = if self.min_excluded { "> " } else { ">= " };
        if self.max.is_finite() {
            format!("{low}{} and <= {}", self.min, self.max)
        } else {
            format!("a finite number {low}{}", self.min)
        }
    }

    /// Checks a value of any kind.
    ///
    /// # Errors
    /// [`Error::Parameter`].
    pub fn check_value(&self, value: Value<'_>) -> Result<()> {
        match (self.kind, value) {
            (_, Value::Absent) | (ParamKind::Flag, Value::Flag(_)) => Ok(()),
            (ParamKind::Choice(choices), Value::Choice(name)) if choices.iter().any(|choice| choice.name == name) => {
                Ok(())
            }
            (ParamKind::Flag | ParamKind::Choice(_), Value::Number(number)) => Err(self.refused(Shown(number))),
            (_, Value::Number(number)) => self.check(number).map(drop),
            (_, Value::Flag(flag)) => Err(self.refused(flag)),
            (_, Value::Choice(name)) => {
                let known = self.choices().iter().map(|choice| choice.name);
                Err(self.refused(format!("\"{name}\"{}", meant(name, known))))
            }
        }
    }

    /// The default. Absent if the data give it.
    pub fn default_value(&self) -> Value<'static> {
        match (self.default, self.kind) {
            (Default::FromData(_), _) => Value::Absent,
            (Default::Value(value), ParamKind::Flag) => Value::Flag(value != 0.0),
            (Default::Value(value), ParamKind::Choice(choices)) => Value::Choice(choices[value as usize].name),
            (Default::Value(value), _) => Value::Number(value),
        }
    }

    /// The text, with what 0 or off does.
    pub fn full_text(&self) -> String {
        match (self.off, self.kind) {
            ("", _) => self.text.to_owned(),
            (off, ParamKind::Flag) => format!("{} Off: {off}.", self.text),
            (off, _) => format!("{} 0: {off}.", self.text),
        }
    }
}

/// Words as a list that ends in "a or b".
pub(super) fn one_of(words: impl IntoIterator<Item = String>, last: &str) -> String {
    let words: Vec<String> = words.into_iter().collect();
    match words.split_last() {
        None => String::new(),
        Some((only, [])) => only.clone(),
        Some((end, before)) => format!("{} {last} {end}", before.join(", ")),
    }
}
