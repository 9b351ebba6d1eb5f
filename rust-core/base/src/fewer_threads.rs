//! Work that is begun anew by one thread where several hold more than can be had.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

use crate::error::{Error, Result};
use crate::{memory, threads};

/// Work of so many threads, a number as [`pool`](threads::pool) takes it. How much they hold at a time beside the data is chance. If that
/// was more than could be had, and `may_help` says so, one thread begins the work anew.
///
/// # Errors
/// Those of `work`.
pub fn where_memory_is_short<R>(
    count: usize,
    may_help: impl Fn() -> bool,
    work: impl Fn(usize) -> Result<R>,
) -> Result<R> {
    let are_several = || threads::pool(count).is_ok_and(|pool| pool.current_num_threads() > 1);
    // All that the panic left half done is dropped with the work, or its owner looks after it.
    match catch_unwind(AssertUnwindSafe(|| work(count))) {
        Ok(Err(Error::OutOfMemory(_))) if may_help() && are_several() => work(1),
        Err(panic) if memory::refused(&*panic).is_some() && are_several() => work(1),
        Ok(done) => done,
        Err(panic) => resume_unwind(panic),
    }
}
