//! Errors, in words the caller can act on.
//!
//! [`Error`] is for input and environment: it names the offending thing and, where there is one, the remedy. A broken
//! invariant of our own is an assertion instead.

use std::path::{Component, Path, PathBuf};

/// Result of every fallible call of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// An error of the caller's input or of the environment.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A parameter lies outside its range. The text gives the name, the value, the allowed range and the unit.
    #[error("{name} must be {allowed}, got {value}{unit}")]
    Parameter {
        /// Name as in the parameter table.
        name: &'static str,
        /// The value as given. Behind a name that is no choice stands which one was probably meant.
        value: String,
        /// Allowed range in words, for example `> 0`.
        allowed: String,
        /// Unit with a leading space, or empty.
        unit: &'static str,
    },
    /// The data handed in can't be used. The text names the element and the remedy.
    #[error("{0}")]
    Input(String),
    /// A file does not hold what its format promises.
    #[error("{}: {at}: {problem}", known_as(path))]
    Format {
        /// The file.
        path: PathBuf,
        /// Place in the file: a line, an element or a byte offset, in words.
        at: String,
        /// The fault there and, if there is one, the remedy.
        problem: String,
    },
    /// Reading or writing failed.
    #[error("{}: {source}", known_as(path))]
    Io {
        /// The file.
        path: PathBuf,
        /// The operating system's answer.
        source: std::io::Error,
    },
    /// The work would need more memory than is allowed or there is.
    #[error("not enough memory: {0}")]
    OutOfMemory(String),
    /// The caller cancelled. Nothing was left behind.
    #[error("cancelled")]
    Cancelled,
}

impl Error {
    /// An [`Error::Input`] from any text.
    pub fn input(text: impl Into<String>) -> Self {
        Error::Input(text.into())
    }

    /// An [`Error::Format`] at a place of a file.
    pub fn format(path: &Path, at: impl Into<String>, problem: impl Into<String>) -> Self {
        // It may quote the file, and what the file holds must not reach a terminal or end a C string.
        let shown = |text: String| match text.chars().any(char::is_control) {
            true => text.replace(char::is_control, "\u{fffd}"),
            false => text,
        };
        Error::Format { path: path.to_owned(), at: at.into(), problem: shown(problem.into()) }
    }

    /// An [`Error::Io`] for a file. [`Error::OutOfMemory`] if memory ran short.
    pub fn io(path: &Path, source: std::io::Error) -> Self {
        if source.kind() == std::io::ErrorKind::OutOfMemory {
            return Error::OutOfMemory(format!("{}: {}", known_as(path), crate::allowed::not_had_for_file()));
        }
        Error::Io { path: path.to_owned(), source }
    }
}

/// A number as people read it: very large and very small ones with a power of ten, not with hundreds of digits.
pub struct Shown(pub f64);

impl Shown {
    /// Rounded to so many digits.
    pub fn digits(x: f64, digits: usize) -> Self {
        // Through text: a quotient by a power of ten would show its rounding.
        Shown(format!("{x:.*e}", digits - 1).parse().unwrap_or(x))
    }
}

impl std::fmt::Display for Shown {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Shown(x) = *self;
        // A number of single precision is shown as it was given there: 0.1, not 0.10000000149011612.
        let single = x as f32;
        if f64::from(single) == x && x.fract() != 0.0 && single.is_normal() {
            return if x.abs() >= 1e-6 { write!(f, "{single}") } else { write!(f, "{single:e}") };
        }
        if x == 0.0 || !x.is_finite() || (1e-6..1e9).contains(&x.abs()) { write!(f, "{x}") } else { write!(f, "{x:e}") }
    }
}

/// Beginning of the paths of all folders in memory. A number follows.
pub const IN_MEMORY: &str = "memory:";

/// A path as people know it: of a file in a folder in memory the name that it was given there.
pub fn known_as<P: AsRef<Path> + ?Sized>(path: &P) -> std::path::Display<'_> {
    let path = path.as_ref();
    let mut parts = path.components();
    let is = |part: Option<Component<'_>>, what: &dyn Fn(&str) -> bool| {
        part.and_then(|part| part.as_os_str().to_str()).is_some_and(what)
    };
    let in_memory = is(parts.next(), &|part| part == IN_MEMORY)
        && is(parts.next(), &|part| part.bytes().all(|byte| byte.is_ascii_digit()));
    match parts.as_path() {
        name if in_memory && name != Path::new("") => name.display(),
        _ => path.display(),
    }
}

/// So many of something, which has a singular.
pub fn counted(count: u64, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_in_memory_is_called_as_its_user_called_it() {
        let shown = |path: &str| known_as(path).to_string();
        assert_eq!(shown("memory:/12/depth/a.ply"), "depth/a.ply");
        for other in ["memory:/12", "memory:/x/a.ply", "a/memory:/1/b", "/memory:/1/b", "a.ply", ""] {
            assert_eq!(shown(other), other);
        }
    }

    #[test]
    fn no_number_takes_a_line() {
        let shown = [0.0, 0.5, -12345.678, 1e-9, 1e300, -2.5e-300, f64::NAN, f64::from(0.1_f32), 16_777_217.0]
            .map(|x| Shown(x).to_string());
        assert_eq!(shown, ["0", "0.5", "-12345.678", "1e-9", "1e300", "-2.5e-300", "NaN", "0.1", "16777217"]);
        assert_eq!(Shown::digits(0.048_858_845_389_326_65, 4).to_string(), "0.04886");
        assert_eq!(Shown::digits(1_234_567.0, 2).to_string(), "1200000");
    }
}
