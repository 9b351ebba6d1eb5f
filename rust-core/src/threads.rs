//! Our own thread pools: we live inside other people's programs and leave the global pool alone.

use std::sync::{Arc, Mutex, PoisonError};

use crate::error::{Error, Result};

static POOLS: Mutex<Vec<(usize, Arc<rayon::ThreadPool>)>> = Mutex::new(Vec::new());

/// The pool of `threads` threads, 0 for one a core; pools are kept for later calls.
///
/// # Errors
/// [`Error::OutOfMemory`] if the system refuses the threads.
pub fn pool(threads: usize) -> Result<Arc<rayon::ThreadPool>> {
    let threads = match threads {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        n => n.min(1024),
    };
    let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, pool)) = pools.iter().find(|p| p.0 == threads) {
        return Ok(pool.clone());
    }
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|i| format!("surfrecon-{i}"))
        .build()
        .map_err(|e| Error::OutOfMemory(format!("{threads} worker threads could not be started ({e})")))?;
    let pool = Arc::new(pool);
    pools.push((threads, pool.clone()));
    Ok(pool)
}
