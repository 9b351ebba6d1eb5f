//! Settings of the whole library in this process.

use pyo3::prelude::*;
use surfrecon::memory;

use crate::errors::input_error;

/// Sets the most memory that calls may take, in bytes; together, where several run at a time.
///
/// What is foreseen to need more, or more than is free, raises ``MemoryError`` before it begins; what turns out to need more
/// raises it then, and nothing is left behind. What Python and NumPy allocate does not count. ``None``, the default, allows
/// all that is free.
///
/// Raises:
///     InputError: a negative number.
#[pyfunction]
pub fn set_memory_limit(bytes: Option<i64>) -> PyResult<()> {
    let limit = bytes.map(|given| {
        u64::try_from(given).map_err(|_| input_error(format!("bytes must be >= 0, or None for no limit, got {given}")))
    });
    memory::set_limit(limit.transpose()?);
    Ok(())
}

/// What ``set_memory_limit`` set: bytes, or ``None``.
#[pyfunction]
pub fn memory_limit() -> Option<u64> {
    memory::limit()
}
