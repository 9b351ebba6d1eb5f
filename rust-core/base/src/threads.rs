//! Our own thread pools: we live inside other people's programs and leave the global pool alone.
//!
//! Such a program may fork. The child has the memory of its parent as it was at that moment, but of its threads only the one that forked. A
//! pool that came along has no workers. A lock that another thread held stays locked for ever. So a process has pools of its own, and
//! nothing here waits for a lock whose holder may have been left behind.

use std::cell::Cell;
use std::fmt::Display;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};

use surfrecon_allocator::{ACCOUNTS, current, switch};

use crate::account::ContextAccount;
use crate::error::{Error, Result};
use crate::{allowed, fork};

/// A value that one thread at a time works with, and whoever else comes is told why it can't be had instead of waiting.
pub struct Exclusive<T> {
    value: Mutex<T>,
    /// Process that took the value last.
    process: AtomicU32,
}

/// Reasons why an [`Exclusive`] value can't be had.
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

    /// The value once it is free, for values that are taken for a moment only. `None` if it was left behind.
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

/// Turns to work with something: one thread's at a time, for as long as that likes. In a forked process the turn is nobody's, whoever's it
/// was in its parent.
#[derive(Default)]
pub struct Turns(Mutex<(u32, Arc<Mutex<()>>)>);

impl Turns {
    /// Works when it is this thread's turn.
    pub fn take<R>(&self, work: impl FnOnce() -> R) -> R {
        let of_process = {
            let _fork = fork::prevent();
            let here = std::process::id();
            let mut turns = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            if turns.0 != here {
                *turns = (here, Arc::default());
            }
            turns.1.clone()
        };
        let _turn = of_process.lock().unwrap_or_else(PoisonError::into_inner);
        work()
    }
}

/// Address space that a thread takes to start: its stack, and what it keeps for itself.
const ROOM_OF_A_THREAD: f64 = (3 << 20) as f64;

/// Worker threads if a call does not say how many, by account. 0 if none is said.
static DEFAULTS: [AtomicU32; ACCOUNTS] = [const { AtomicU32::new(0) }; ACCOUNTS];

/// Worker threads of calls that ask for 0: 0, the default, for one per core, or, of an account other than the process's, for that one's
/// number.
pub(crate) fn set_default(account: usize, threads: u32) {
    DEFAULTS[account].store(threads, Ordering::Relaxed);
}

/// The number that was set for an account.
pub(crate) fn default_of(account: usize) -> u32 {
    DEFAULTS[account].load(Ordering::Relaxed)
}

/// Worker threads of calls that ask for 0, in the whole process but for contexts with a number of their own. The default is 0: one per
/// core.
pub fn set_threads(threads: u32) {
    set_default(0, threads);
}

/// The number that [`set_threads`] set.
pub fn threads() -> u32 {
    default_of(0)
}

/// A pool, for whom its threads work, and how many there are.
struct Pool {
    account: usize,
    threads: usize,
    pool: Arc<rayon::ThreadPool>,
}

/// The pools of a process.
struct Pools {
    process: u32,
    list: Vec<Pool>,
}

static POOLS: Exclusive<Pools> = Exclusive::new(Pools { process: 0, list: Vec::new() });

/// The pools of this process. `None` if they can't be kept for later calls.
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
    fn of(&self, account: usize, threads: usize) -> Option<Arc<rayon::ThreadPool>> {
        let found = self.list.iter().find(|pool| pool.account == account && pool.threads == threads);
        found.map(|pool| pool.pool.clone())
    }
}

/// The pool of `threads` threads of the context that this thread works for. 0 stands for the number that was set, or one per core. Pools
/// are kept for later calls of the same process.
///
/// # Errors
/// [`Error::OutOfMemory`] if the system refuses the threads.
pub fn pool(threads: usize) -> Result<Arc<rayon::ThreadPool>> {
    let account = current();
    let asked = u32::try_from(threads).unwrap_or(u32::MAX);
    let said = [asked, default_of(account), default_of(0)].into_iter().find(|&threads| threads != 0);
    let threads = match said {
        None => std::thread::available_parallelism().map_or(1, usize::from),
        Some(n) => n.min(1024) as usize,
    };
    if let Some(pool) = pools().and_then(|pools| pools.of(account, threads)) {
        return Ok(pool);
    }
    let made = Arc::new(new(threads)?);
    let Some(mut pools) = pools() else { return Ok(made) };
    // Another thread may have made one meanwhile.
    if let Some(pool) = pools.of(account, threads) {
        return Ok(pool);
    }
    pools.list.push(Pool { account, threads, pool: made.clone() });
    Ok(made)
}

/// Ends the pools of an account that no call works for any more.
pub(crate) fn end(account: usize) {
    let ended: Vec<Pool> = match pools() {
        Some(mut pools) => pools.list.extract_if(.., |pool| pool.account == account).collect(),
        None => return,
    };
    // Others may have pools meanwhile.
    drop(ended);
}

thread_local! {
    static OF_WORKER: Cell<usize> = const { Cell::new(0) };
}

/// The account of the context whose worker this thread is. 0 for threads that are none's.
pub fn of_worker() -> usize {
    OF_WORKER.get()
}

/// A pool of so many threads that nobody else has. They work for whom this thread works for.
///
/// # Errors
/// [`Error::OutOfMemory`] if the system refuses the threads.
pub(crate) fn new(threads: usize) -> Result<rayon::ThreadPool> {
    let refused = |why: &dyn Display| {
        Error::OutOfMemory(format!("{threads} worker threads could not be started ({why}): ask for fewer"))
    };
    // A thread that starts and then finds no room for its first words ends the process, and nobody can catch that.
    if allowed::address_space() < ROOM_OF_A_THREAD * threads as f64 {
        return Err(refused(&"too little address space is left"));
    }
    let account = ContextAccount::of_this_thread();
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .start_handler(move |_| {
            switch(account.number());
            OF_WORKER.set(account.number());
        })
        .exit_handler(|_| {
            switch(0);
        })
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
    fn turns_are_taken_one_at_a_time_and_left_behind_by_a_fork() {
        let turns = Turns::default();
        let inside = AtomicU32::new(0);
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    turns.take(|| {
                        assert_eq!(inside.fetch_add(1, Ordering::Relaxed), 0);
                        std::thread::sleep(std::time::Duration::from_millis(2));
                        inside.fetch_sub(1, Ordering::Relaxed);
                    });
                });
            }
        });
        turns.take(|| {
            // As a child finds it that was forked from a process of another number meanwhile.
            turns.0.lock().unwrap().0 += 1;
            turns.take(|| ());
        });
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
