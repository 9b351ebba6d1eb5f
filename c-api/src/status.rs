//! The outcome of a call, and what is kept of the last failure.

use std::borrow::Cow;
use std::cell::RefCell;
use std::ffi::CStr;

use crate::text::c_text;

/// Outcome of a call. Numbers are never reused.
#[allow(non_camel_case_types, clippy::upper_case_acronyms)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_status {
    /// All went well.
    SRF_OK = 0,
    /// A number or an enumerator that was passed, as an argument, in a struct or as what an array is said to be, is out of its range. The
    /// text has the value, the range and the unit.
    SRF_ERR_PARAMETER = 1,
    /// The content of an array, a matrix, a text, a mesh or a file can't be used, or does not go with another. The text names the element.
    SRF_ERR_INPUT = 2,
    /// A file does not hold what its format promises. The text names the place.
    SRF_ERR_FORMAT = 3,
    /// Reading or writing a file failed.
    SRF_ERR_IO = 4,
    /// There is not enough memory.
    SRF_ERR_OUT_OF_MEMORY = 5,
    /// The caller cancelled. Nothing was left behind.
    SRF_ERR_CANCELLED = 6,
    /// A pointer is NULL that must not be.
    SRF_ERR_NULL = 7,
    /// A mistake of the library itself: please report it with the text.
    SRF_ERR_INTERNAL = 8,
    /// A handle is of another kind than asked for, was freed or never was one.
    SRF_ERR_HANDLE = 9,
    /// The size a struct starts with is none this library can work with.
    SRF_ERR_STRUCT_SIZE = 10,
}

use srf_status::*;

/// Reason why a call failed.
#[derive(Debug)]
pub struct Failure {
    /// The status that the call returns.
    pub status: srf_status,
    /// The answer of `srf_last_error_message`.
    pub text: String,
}

impl Failure {
    /// A failure with its text.
    pub fn new(status: srf_status, text: impl Into<String>) -> Self {
        Failure { status, text: text.into() }
    }
}

/// Says of what the core refuses that it is a number that the caller passed.
pub fn of_number(error: surfrecon::Error) -> Failure {
    Failure { status: SRF_ERR_PARAMETER, ..error.into() }
}

impl From<surfrecon::Error> for Failure {
    fn from(error: surfrecon::Error) -> Self {
        use surfrecon::Error;
        let status = match &error {
            Error::Parameter { .. } => SRF_ERR_PARAMETER,
            Error::Input(_) => SRF_ERR_INPUT,
            Error::Format { .. } => SRF_ERR_FORMAT,
            Error::Io { .. } => SRF_ERR_IO,
            Error::OutOfMemory(_) => SRF_ERR_OUT_OF_MEMORY,
            Error::Cancelled => SRF_ERR_CANCELLED,
            _ => SRF_ERR_INTERNAL,
        };
        Failure::new(status, error.to_string())
    }
}

/// A number that says yes or no.
pub fn flag(name: &str, value: u32) -> Result<bool, Failure> {
    match value {
        0 | 1 => Ok(value == 1),
        other => Err(Failure::new(SRF_ERR_PARAMETER, format!("{name} must be 0 or 1, got {other}"))),
    }
}

thread_local! {
    /// The answer of `srf_last_error_message` on this thread.
    pub static LAST_ERROR: RefCell<Cow<'static, CStr>> = const { RefCell::new(Cow::Borrowed(c"")) };
}

/// Keeps the text for `srf_last_error_message`.
pub fn remember(text: &str) {
    let text = c_text(text);
    LAST_ERROR.with(|last| *last.borrow_mut() = text.into());
}

/// Keeps a text for `srf_last_error_message` that takes no memory.
pub fn remember_fixed(text: &'static CStr) {
    LAST_ERROR.with(|last| *last.borrow_mut() = text.into());
}

/// Calls a function of the caller's. Returns its answer, and the text that it left as the last error, which becomes what it was.
pub fn said<R>(call: impl FnOnce() -> R) -> (R, String) {
    let before = LAST_ERROR.replace(Cow::Borrowed(c""));
    let answer = call();
    let text = LAST_ERROR.replace(before);
    (answer, text.to_string_lossy().into_owned())
}
