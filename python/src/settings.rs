//! Settings of the whole library in this process.

use pyo3::exceptions::PyOverflowError;
use pyo3::prelude::*;
use surfrecon::memory;

use crate::errors::input_error;

/// Sets the most memory that calls may take, in bytes, together where several run at a time.
///
/// A call that is foreseen to need more, or more than is free, raises ``MemoryError`` before it begins. A call that turns out to need
/// more raises it then, and nothing is left behind. It limits calls, not what they leave: what was handed out before (meshes, images) does not
/// count, however much it is, unless another call was running all the time since. Memory that Python and NumPy allocate does not count either.
/// ``None``, the default, and 0 allow all that is free. Calls in a ``Context`` with a limit of its own have that one instead.
///
/// >>> surfrecon.set_memory_limit(8 * 10**9)
/// >>> result = surfrecon.merge(scans)
/// >>> surfrecon.set_memory_limit(None)  # all that is free
///
/// Raises:
///     InputError: a negative number, or one that 64 bits can't hold.
#[pyfunction]
pub fn set_memory_limit(bytes: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
    memory::set_limit(bytes.map(|given| limit_of("bytes", given)).transpose()?.flatten());
    Ok(())
}

/// A number of bytes that memory is to be limited to. `None` for 0, which is no limit.
pub fn limit_of(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Option<u64>> {
    let bytes = given.extract::<u64>().map_err(|error| {
        if !error.is_instance_of::<PyOverflowError>(given.py()) {
            return error;
        }
        // Python writes no number of thousands of digits.
        let got = given.str().map_or_else(|_| "one of more digits".to_owned(), |text| text.to_string());
        input_error(format!("{name} must be >= 0 and < 2^64, 0 or None for no limit, got {got}"))
    })?;
    Ok((bytes > 0).then_some(bytes))
}

/// The limit that ``set_memory_limit`` set: bytes, or ``None``.
///
/// >>> surfrecon.set_memory_limit(8 * 10**9)
/// >>> surfrecon.memory_limit()
/// 8000000000
/// >>> surfrecon.set_memory_limit(None)
#[pyfunction]
pub fn memory_limit() -> Option<u64> {
    memory::limit()
}
