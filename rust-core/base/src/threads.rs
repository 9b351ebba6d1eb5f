//! Our own thread pools: we live inside other people's programs and leave the global pool alone.
//!
//! Such a program may fork. The child has the memory of its parent as it was at that moment, but of its threads only the
//! one that forked: a pool that came along has no workers, and a lock that another thread held stays locked for ever. So
//! a process has pools of its own, and nothing here waits for a lock whose holder may have been left behind.

use std::fmt::Display;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, TryLockError};

use crate::error::{Error, Result};
use crate::memory;

/// A value that one thread at a time works with, and whoever else comes is told why it can't be had instead of waiting.
pub struct Exclusive<T> {
    value: Mutex<T>,
    /// Process that took the value last.
    process: AtomicU32,
}

/// Why an [`Exclusive`] value can't be had.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Taken {
    /// Another thread works with it.
    InUse,
    /// A thread worked with it when this process was forked, and does not exist here: it will never be free.
    LeftBehind,
}

impl<T: Default> Default for Exclusive<T> {
    fn default() -> Self {
        Exclusive::new(T::default())
    }
}

impl<T> Exclusive<T> {
    /// A value that nobody works with.
    pub const fn new(value: T) -> Self {
        Exclusive { value: Mutex::new(value), process: AtomicU32::new(0) }
    }

    /// The value, until the guard is dropped. Never waits.
    ///
    /// # Errors
    /// Why it can't be had.
    pub fn take(&self) -> std::result::Result<MutexGuard<'_, T>, Taken> {
        let here = std::process::id();
        // Between taking the value and saying so lies a moment: who comes then looks again.
        for _ in 0..1000 {
            let value = match self.value.try_lock() {
                Ok(value) => value,
                Err(TryLockError::Poisoned(left)) => left.into_inner(),
                Err(TryLockError::WouldBlock) if self.process.load(Ordering::Relaxed) == here => {
                    return Err(Taken::InUse);
                }
                Err(TryLockError::WouldBlock) => {
                    std::thread::yield_now();
                    continue;
                }
            };
            self.process.store(here, Ordering::Relaxed);
            return Ok(value);
        }
        Err(Taken::LeftBehind)
    }

    /// The value once it is free, for values that are taken for a moment only; `None` where it was left behind.
    pub fn wait(&self) -> Option<MutexGuard<'_, T>> {
        loop {
            match self.take() {
                Ok(value) => return Some(value),
                Err(Taken::InUse) => std::thread::yield_now(),
                Err(Taken::LeftBehind) => return None,
            }
        }
    }
}

/// Address space that a thread takes to start: its stack, and what it keeps for itself.
const ROOM_OF_A_THREAD: f64 = (3 << 20) as f64;

/// The pools of a process, by their numbers of threads.
struct Pools {
    process: u32,
    list: Vec<(usize, Arc<rayon::ThreadPool>)>,
}

static POOLS: Exclusive<Pools> = Exclusive::new(Pools { process: 0, list: Vec::new() });

/// The pools of this process; `None` where they can't be kept for later calls.
fn pools() -> Option<MutexGuard<'static, Pools>> {
    let mut pools = POOLS.wait()?;
    let here = std::process::id();
    if pools.process != here {
        pools.process = here;
        // Dropping pools of the parent would wake workers that don't exist, through locks that may be held.
        std::mem::forget(std::mem::take(&mut pools.list));
    }
    Some(pools)
}

impl Pools {
    fn of(&self, threads: usize) -> Option<Arc<rayon::ThreadPool>> {
        self.list.iter().find(|pool| pool.0 == threads).map(|pool| pool.1.clone())
    }
}

/// The pool of `threads` threads, 0 for one a core; pools are kept for later calls of the same process.
///
/// # Errors
/// [`Error::OutOfMemory`] if the system refuses the threads.
pub fn pool(threads: usize) -> Result<Arc<rayon::ThreadPool>> {
    let threads = match threads {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        n => n.min(1024),
    };
    if let Some(pool) = pools().and_then(|pools| pools.of(threads)) {
        return Ok(pool);
    }
    let made = Arc::new(new(threads)?);
    let Some(mut pools) = pools() else { return Ok(made) };
    // Another thread may have made one meanwhile.
    if let Some(pool) = pools.of(threads) {
        return Ok(pool);
    }
    pools.list.push((threads, made.clone()));
    Ok(made)
}

/// A pool of so many threads that nobody else has.
///
/// # Errors
/// [`Error::OutOfMemory`] if the system refuses the threads.
pub(crate) fn new(threads: usize) -> Result<rayon::ThreadPool> {
    let refused =
        |why: &dyn Display| Error::OutOfMemory(format!("{threads} worker threads could not be started ({why})"));
    // A thread that starts and then finds no room for its first words ends the process, and nobody can catch that.
    if memory::address_space() < ROOM_OF_A_THREAD * threads as f64 {
        return Err(refused(&"too little address space is left"));
    }
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|i| format!("surfrecon-{i}"))
        .build()
        .map_err(|e| refused(&e))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_taken_by_one_at_a_time_and_is_not_waited_for_where_its_holder_is_not() {
        let value = Exclusive::new(1);
        let held = value.take().unwrap();
        assert_eq!(value.take().unwrap_err(), Taken::InUse);
        // As a child finds it that was forked from a process of another number.
        value.process.store(std::process::id() + 1, Ordering::Relaxed);
        assert_eq!(value.take().unwrap_err(), Taken::LeftBehind);
        assert!(value.wait().is_none());
        drop(held);
        *value.wait().unwrap() += 1;
        assert_eq!(*value.take().unwrap(), 2);
    }

    #[test]
    fn pools_are_kept_for_their_process_alone() {
        let before = pool(5).unwrap();
        assert_eq!(before.current_num_threads(), 5);
        pools().unwrap().process = 0;
        let after = pool(5).unwrap();
        assert!(!Arc::ptr_eq(&before, &after));
        assert_eq!(after.install(rayon::current_num_threads), 5);
    }
}
