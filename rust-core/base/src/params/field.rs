//! Conversion of the types of parameters' fields into values, and back.

use super::{ParamSpec, Value};
use crate::error::Result;

/// A type that a row's field may have.
pub trait ParamField: Sized {
    /// The field for a value: the row's default where that is absent.
    ///
    /// # Errors
    /// [`crate::Error::Parameter`] for a value that the row does not allow.
    fn from_value(spec: &ParamSpec, value: Value<'_>) -> Result<Self> {
        spec.check_value(value)?;
        Ok(match value {
            Value::Absent => ParamField::made(spec.default_value()),
            given => ParamField::made(given),
        })
    }

    /// The row's default.
    fn default_of(spec: &ParamSpec) -> Self {
        ParamField::made(spec.default_value())
    }

    /// The field for a value that was checked.
    fn made(value: Value<'_>) -> Self;

    /// The field's value.
    fn value(&self) -> Value<'static>;
}

macro_rules! number {
    ($($type:ty),*) => {$(
        impl ParamField for $type {
            fn made(value: Value<'_>) -> Self {
                match value {
                    Value::Number(number) => number as $type,
                    other => unreachable!("{other:?} is no number"),
                }
            }

            fn value(&self) -> Value<'static> {
                Value::Number(*self as f64)
            }
        }
    )*};
}

number!(f64, u8, u32, u64, usize);

impl ParamField for bool {
    fn made(value: Value<'_>) -> Self {
        value == Value::Flag(true)
    }

    fn value(&self) -> Value<'static> {
        Value::Flag(*self)
    }
}

/// `None` is absent: the data give the value.
impl<T: ParamField> ParamField for Option<T> {
    fn made(value: Value<'_>) -> Self {
        (value != Value::Absent).then(|| T::made(value))
    }

    fn value(&self) -> Value<'static> {
        self.as_ref().map_or(Value::Absent, ParamField::value)
    }
}
