//! Settings of the whole library in this process.

use pyo3::prelude::*;
use surfrecon::memory;

/// Sets the most memory that a call may take, in bytes, as far as it can be foreseen.
///
/// What would need more, or more than is free, raises ``MemoryError`` before it begins. ``None``, the default, allows all
/// that is free.
#[pyfunction]
pub fn set_memory_limit(bytes: Option<u64>) {
    memory::set_limit(bytes);
}

/// What ``set_memory_limit`` set: bytes, or ``None``.
#[pyfunction]
pub fn memory_limit() -> Option<u64> {
    memory::limit()
}
