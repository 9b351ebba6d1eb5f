//! The declarations.

use super::spec::one_of;
use super::{ParamSpec, Value};
use crate::error::{Error, Result};
use crate::nearest::instead;

/// All that is declared of one operation's parameters.
#[derive(Clone, Copy, Debug)]
pub struct ParamSchema {
    /// Name of the operation.
    pub operation: &'static str,
    /// Purpose of the parameters.
    pub text: &'static str,
    /// The rows, in the order in which people read them.
    pub rows: &'static [ParamSpec],
    /// All that can be set, the parameters of other operations that it runs included.
    pub all: fn() -> Vec<&'static ParamSpec>,
}

/// A struct of parameters, or a part of one, that can be set by name.
pub trait Params: Sized {
    /// The rows that stand in the table of the operation whose struct holds this part.
    const OWN: &'static [ParamSpec];

    /// Every row that can be set, those of parts included.
    fn rows() -> Vec<&'static ParamSpec>;

    /// Rows of which at most one may be given, a list each.
    fn alternatives() -> Vec<&'static [ParamSpec]>;

    /// The value of a parameter. `None` if there is none of that name.
    fn get(&self, name: &str) -> Option<Value<'static>>;

    /// Sets a parameter. An absent value sets its default. Says whether there is one of that name.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a value that is not allowed.
    fn set(&mut self, name: &str, value: Value<'_>) -> Result<bool>;

    /// Checks each value.
    ///
    /// # Errors
    /// [`Error::Parameter`] for the first one that is not allowed.
    fn check(&self) -> Result<()>;

    /// Sets what is given by name. Of parameters of which one may be given, a default beside another is not given.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a value that is not allowed, [`Error::Input`] for several of which one may be given and for a
    /// name that is none.
    fn set_all<'a>(&mut self, given: &[(&'a str, Value<'a>)]) -> Result<()> {
        let mut given = given.to_vec();
        for rows in Self::alternatives() {
            let row_of = |name: &str| rows.iter().find(|row| row.name == name);
            let is_chosen = |(name, value): &(&str, Value<'_>)| {
                row_of(name).is_some_and(|row| *value != Value::Absent && *value != row.default_value())
            };
            let chosen = given.iter().filter(|one| is_chosen(one)).count();
            if chosen == 1 {
                given.retain(|one| row_of(one.0).is_none() || is_chosen(one));
            }
            if chosen > 1 {
                let names = || rows.iter().map(|row| row.name.to_owned());
                return Err(Error::input(match rows.len() {
                    2 => format!("give {}, not both", one_of(names(), "or")),
                    _ => format!("give one of {}", one_of(names(), "and")),
                }));
            }
        }
        for (name, value) in given {
            if !self.set(name, value)? {
                let known: Vec<&str> = Self::rows().iter().map(|row| row.name).collect();
                return Err(Error::input(format!("there is no parameter {name:?}. {}", instead(name, &known))));
            }
        }
        Ok(())
    }
}

/// The row of that name in an operation's own table.
///
/// # Panics
/// If there is none: names are written in the code that asks.
pub fn named(rows: &'static [ParamSpec], name: &str) -> &'static ParamSpec {
    rows.iter().find(|row| row.name == name).unwrap_or_else(|| panic!("there is no parameter {name}"))
}

/// Number of rows that several lists have together.
pub const fn rows_of(lists: &[&[ParamSpec]]) -> usize {
    let (mut count, mut list) = (0, 0);
    while list < lists.len() {
        count += lists[list].len();
        list += 1;
    }
    count
}

/// Several lists of rows as one.
pub const fn joined<const ROWS: usize>(lists: &[&[ParamSpec]]) -> [ParamSpec; ROWS] {
    let mut all = [super::threads(); ROWS];
    let (mut count, mut list) = (0, 0);
    while list < lists.len() {
        let mut row = 0;
        while row < lists[list].len() {
            all[count] = lists[list][row];
            row += 1;
            count += 1;
        }
        list += 1;
    }
    all
}

/// Declares the parameters of an operation: `PARAMS`, `SCHEMA` and the struct with its defaults and checks.
///
/// A field with `= row` is a parameter. Its comment is the row's text, for people in every language, so that it names no item of Rust. A
/// field without is a part: a struct of other parameters, or [`alternatives!`](crate::alternatives!). `with threads` adds the worker
/// threads as the last one. `besides` are fields that are in no table. `checked by` names a method that looks at what rows can't say.
#[macro_export]
macro_rules! params {
    // A row completed, a part's own rows.
    (@rows $operation:literal $field:ident [$($text:expr),*] $type:ty, $row:expr) => {
        &[$row.of($operation, stringify!($field), concat!($($text),*))]
    };
    (@rows $operation:literal $field:ident [$($text:expr),*] $type:ty,) => { <$type as $crate::params::Params>::OWN };
    (@spec $field:ident, $row:expr) => { $crate::params::named(PARAMS, stringify!($field)) };
    (@default $field:ident $type:ty, $row:expr) => {
        <$type as $crate::params::ParamField>::default_of($crate::params!(@spec $field, $row))
    };
    (@default $field:ident $type:ty,) => { <$type as ::std::default::Default>::default() };
    (@all $field:ident $type:ty, $row:expr) => { vec![$crate::params!(@spec $field, $row)] };
    (@all $field:ident $type:ty,) => { <$type as $crate::params::Params>::rows() };
    (@groups $type:ty, $row:expr) => { Vec::<&'static [$crate::params::ParamSpec]>::new() };
    (@groups $type:ty,) => { <$type as $crate::params::Params>::alternatives() };
    (@get $name:ident $place:expr, $field:ident, $row:expr) => {
        ($name == stringify!($field)).then(|| $crate::params::ParamField::value(&$place))
    };
    (@get $name:ident $place:expr, $field:ident,) => { $crate::params::Params::get(&$place, $name) };
    (@set $name:ident $value:ident $place:expr, $field:ident, $row:expr) => {
        if $name == stringify!($field) {
            $place = $crate::params::ParamField::from_value($crate::params!(@spec $field, $row), $value)?;
            return Ok(true);
        }
    };
    (@set $name:ident $value:ident $place:expr, $field:ident,) => {
        if $crate::params::Params::set(&mut $place, $name, $value)? {
            return Ok(true);
        }
    };
    (@check $place:expr, $field:ident, $row:expr) => {
        $crate::params!(@spec $field, $row).check_value($crate::params::ParamField::value(&$place))?
    };
    (@check $place:expr, $field:ident,) => { $crate::params::Params::check(&$place)? };

    (
        $(#[$($attribute:tt)*])*
        pub struct $Struct:ident of $operation:literal with threads { $($body:tt)* }
        $($more:tt)*
    ) => {
        $crate::params! {
            $(#[$($attribute)*])*
            pub struct $Struct of $operation {
                $($body)*
                #[doc = " Worker threads, 0 for one per core. The result is the same for any number."]
                threads: usize = $crate::params::threads(),
            }
            $($more)*
        }
    };
    (
        $(#[doc = $about:expr])*
        $(#[derive($($derived:ident),*)])?
        pub struct $Struct:ident of $operation:literal {
            $( $(#[doc = $text:expr])* $field:ident : $type:ty $(= $row:expr)? ),* $(,)?
        }
        $(besides { $( $(#[doc = $note:expr])* $other:ident : $other_type:ty ),* $(,)? })?
        $(checked by $check:ident)?
    ) => {
        $(#[doc = $about])*
        ///
        /// See [`SCHEMA`].
        $(#[derive($($derived),*)])?
        pub struct $Struct {
            $( $(#[doc = $text])* pub $field: $type, )*
            $($( $(#[doc = $note])* pub $other: $other_type, )*)?
        }

        /// The rows of [`SCHEMA`].
        const PARAMS: &[$crate::params::ParamSpec] = {
            const LISTS: &[&[$crate::params::ParamSpec]] =
                &[$( $crate::params!(@rows $operation $field [$($text),*] $type, $($row)?) ),*];
            const ALL: [$crate::params::ParamSpec; $crate::params::rows_of(LISTS)] = $crate::params::joined(LISTS);
            &ALL
        };

        /// The declaration of the operation's parameters.
        pub const SCHEMA: $crate::params::ParamSchema = $crate::params::ParamSchema {
            operation: $operation,
            text: concat!($($about),*).trim_ascii(),
            rows: PARAMS,
            all: <$Struct as $crate::params::Params>::rows,
        };

        impl ::std::default::Default for $Struct {
            fn default() -> Self {
                $Struct {
                    $( $field: $crate::params!(@default $field $type, $($row)?), )*
                    $($( $other: ::std::default::Default::default(), )*)?
                }
            }
        }

        impl $crate::params::Params for $Struct {
            const OWN: &'static [$crate::params::ParamSpec] = &[];

            fn rows() -> Vec<&'static $crate::params::ParamSpec> {
                let mut all = Vec::new();
                $( all.extend($crate::params!(@all $field $type, $($row)?)); )*
                all
            }

            fn alternatives() -> Vec<&'static [$crate::params::ParamSpec]> {
                let mut all: Vec<&'static [$crate::params::ParamSpec]> = Vec::new();
                $( all.extend($crate::params!(@groups $type, $($row)?)); )*
                all
            }

            fn get(&self, name: &str) -> Option<$crate::params::Value<'static>> {
                None $( .or_else(|| $crate::params!(@get name self.$field, $field, $($row)?)) )*
            }

            fn set(&mut self, name: &str, value: $crate::params::Value<'_>) -> $crate::error::Result<bool> {
                $( $crate::params!(@set name value self.$field, $field, $($row)?); )*
                Ok(false)
            }

            fn check(&self) -> $crate::error::Result<()> {
                self.validate()
            }
        }

        impl $Struct {
            /// Checks each value against its range.
            ///
            /// # Errors
            /// [`Error::Parameter`]($crate::Error::Parameter) naming the value, the range and the unit of the first one out of it.
            pub fn validate(&self) -> $crate::error::Result<()> {
                $( $crate::params!(@check self.$field, $field, $($row)?); )*
                $( self.$check()?; )?
                Ok(())
            }
        }
    };
}

/// Declares an enum that a parameter may be one of, the first by default. Each has its name in every language and its name for people. Its
/// comment is the text.
#[macro_export]
macro_rules! choices {
    (
        $(#[doc = $about:expr])*
        pub enum $Enum:ident { $( $(#[doc = $text:expr])* $Variant:ident = $name:literal $label:literal ),* $(,)? }
    ) => {
        $(#[doc = $about])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum $Enum { $( $(#[doc = $text])* $Variant ),* }

        impl $Enum {
            /// Its values, with names and texts.
            pub const CHOICES: &[$crate::params::Choice] = &[$(
                $crate::params::Choice { name: $name, label: $label, text: concat!($($text),*).trim_ascii() }
            ),*];

            /// Each, in the order of [`Self::CHOICES`].
            pub const ALL: &[$Enum] = &[$($Enum::$Variant),*];

            /// Its name in every language.
            pub const fn name(self) -> &'static str {
                match self { $($Enum::$Variant => $name),* }
            }

            /// The one of that name.
            pub fn named(name: &str) -> Option<Self> {
                Self::ALL.iter().copied().find(|choice| choice.name() == name)
            }
        }

        impl ::std::default::Default for $Enum {
            fn default() -> Self {
                Self::ALL[0]
            }
        }

        impl $crate::params::ParamField for $Enum {
            fn made(value: $crate::params::Value<'_>) -> Self {
                match value {
                    $crate::params::Value::Choice(name) => Self::named(name).expect("choices are checked"),
                    other => unreachable!("{other:?} is no choice"),
                }
            }

            fn value(&self) -> $crate::params::Value<'static> {
                $crate::params::Value::Choice(self.name())
            }
        }

        impl $crate::report::FigureValue for $Enum {
            fn found(&self) -> $crate::report::Found<'_> {
                $crate::report::Found::Choice(self.name())
            }
        }
    };
}

/// Declares an enum of parameters of which one is given. `or` is what holds if none is, or else the parameter that has a plain default.
#[macro_export]
macro_rules! alternatives {
    (@spec $operation:literal $name:ident [$($text:expr),*] $row:expr) => {{
        const SPEC: $crate::params::ParamSpec = $row.of($operation, stringify!($name), concat!($($text),*));
        &SPEC
    }};
    (
        $(#[doc = $about:expr])*
        pub enum $Enum:ident of $operation:literal {
            $( $(#[doc = $text:expr])* $Variant:ident($type:ty) = $name:ident: $row:expr ),* $(,)?
        }
        $(or $(#[doc = $none:expr])* $None:ident)?
    ) => {
        $(#[doc = $about])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum $Enum {
            $( $(#[doc = $none])* $None, )?
            $( $(#[doc = $text])* $Variant($type), )*
        }

        impl ::std::default::Default for $Enum {
            #[allow(unreachable_code, reason = "what holds where none is given goes first")]
            fn default() -> Self {
                $( return $Enum::$None; )?
                $(
                    let spec: &'static $crate::params::ParamSpec =
                        $crate::alternatives!(@spec $operation $name [$($text),*] $row);
                    if !spec.is_optional() {
                        return $Enum::$Variant($crate::params::ParamField::default_of(spec));
                    }
                )*
                unreachable!("one of the parameters has a default")
            }
        }

        impl $crate::params::Params for $Enum {
            const OWN: &'static [$crate::params::ParamSpec] =
                &[$( $row.of($operation, stringify!($name), concat!($($text),*)) ),*];

            fn rows() -> Vec<&'static $crate::params::ParamSpec> {
                Self::OWN.iter().collect()
            }

            fn alternatives() -> Vec<&'static [$crate::params::ParamSpec]> {
                vec![Self::OWN]
            }

            fn get(&self, name: &str) -> Option<$crate::params::Value<'static>> {
                $(
                    if name == stringify!($name) {
                        return Some(match self {
                            $Enum::$Variant(value) => $crate::params::ParamField::value(value),
                            #[allow(unreachable_patterns, reason = "there may be one only")]
                            _ => $crate::params::Value::Absent,
                        });
                    }
                )*
                None
            }

            fn set(&mut self, name: &str, value: $crate::params::Value<'_>) -> $crate::error::Result<bool> {
                $(
                    if name == stringify!($name) {
                        let spec: &'static $crate::params::ParamSpec =
                            $crate::alternatives!(@spec $operation $name [$($text),*] $row);
                        match (value, &*self) {
                            ($crate::params::Value::Absent, $Enum::$Variant(_)) => *self = ::std::default::Default::default(),
                            ($crate::params::Value::Absent, _) => {}
                            _ => {
                                let value: Option<$type> = $crate::params::ParamField::from_value(spec, value)?;
                                *self = $Enum::$Variant(value.expect("absent values went before"));
                            }
                        }
                        return Ok(true);
                    }
                )*
                Ok(false)
            }

            fn check(&self) -> $crate::error::Result<()> {
                self.validate()
            }
        }

        impl $Enum {
            /// Checks the value against its range.
            ///
            /// # Errors
            /// [`Error::Parameter`]($crate::Error::Parameter).
            pub fn validate(self) -> $crate::error::Result<()> {
                match self {
                    $( $Enum::$None => Ok(()), )?
                    $(
                        $Enum::$Variant(value) => $crate::alternatives!(@spec $operation $name [$($text),*] $row)
                            .check_value($crate::params::ParamField::value(&value)),
                    )*
                }
            }
        }
    };
}
