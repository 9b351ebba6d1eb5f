//! The allocator of this module, which counts: what a host's report of memory and the tests of leaks read.
//!
//! Python and NumPy keep allocators of their own. The content of NumPy arrays made here is a vector of Rust and counts.

use crate::params::no_others;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfrecon::memory;
use surfrecon_allocator::Account;

#[global_allocator]
static ALLOCATOR: Account = Account(std::alloc::System);

/// Bytes that this library holds on the heap in this process: its objects and arrays, and what running calls work with.
///
/// Copies that NumPy or a host made of them don't count.
///
/// >>> mesh = surfrecon.merge(scans).mesh
/// >>> surfrecon.memory_in_use() > mesh.positions.nbytes
/// True
#[pyfunction]
pub fn memory_in_use() -> usize {
    memory::held()
}

/// The most bytes that this library held at a time since the last call with ``restart``, or since it was loaded.
///
/// >>> before = surfrecon.memory_peak(restart=True)
/// >>> result = surfrecon.merge(scans)
/// >>> surfrecon.memory_peak() > surfrecon.memory_in_use()
/// True
///
/// Args:
///     restart: count anew from what is held now.
#[pyfunction]
#[pyo3(signature = (*, restart = false, **others), text_signature = "(*, restart=False)")]
pub fn memory_peak(restart: bool, others: Option<&Bound<'_, PyDict>>) -> PyResult<usize> {
    no_others("memory_peak", others)?;
    let most = memory::peak();
    if restart {
        memory::restart_peak();
    }
    Ok(most)
}

/// Bytes that the last call was estimated to take before it began. 0 where nothing was worth an estimate.
///
/// >>> result = surfrecon.merge(scans)
/// >>> surfrecon.memory_foreseen() > 0
/// True
#[pyfunction]
pub fn memory_foreseen() -> u64 {
    memory::foreseen()
}
