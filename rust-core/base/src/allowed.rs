//! The memory that calls may take: the limits that were set, by account, and the address space that the system gives the process.

use std::sync::atomic::{AtomicBool, AtomicIsize, AtomicU32, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use surfrecon_allocator::{ACCOUNTS, current, set_ceiling};

use crate::fork::{self, Prevented};

/// State of the calls that work for one account.
pub(crate) struct Calls {
    /// Whether they have a limit of their own.
    is_limited: AtomicBool,
    /// This limit, in bytes.
    limit: AtomicU64,
    /// Calls that are running.
    pub(crate) running: AtomicUsize,
    /// The process that the first of them began in.
    pub(crate) process: AtomicU32,
    /// Bytes that the account held when the first of them began.
    pub(crate) before: AtomicIsize,
    /// The largest estimate since then, in bytes beyond that.
    pub(crate) foreseen: AtomicU64,
    /// Held by who begins or ends a call, or says what they may take: the account's ceiling goes with that.
    settling: Mutex<()>,
}

pub(crate) static CALLS: [Calls; ACCOUNTS] = [const {
    Calls {
        is_limited: AtomicBool::new(false),
        limit: AtomicU64::new(0),
        running: AtomicUsize::new(0),
        process: AtomicU32::new(0),
        before: AtomicIsize::new(0),
        foreseen: AtomicU64::new(0),
        settling: Mutex::new(()),
    }
}; ACCOUNTS];

/// Nobody else begins or ends a call of the account meanwhile, nor says what they may take.
pub(crate) struct Settling {
    // Dropped in this order.
    _alone: MutexGuard<'static, ()>,
    _fork: Prevented,
}

pub(crate) fn settle(account: usize) -> Settling {
    let fork = fork::prevent();
    Settling { _alone: CALLS[account].settling.lock().unwrap_or_else(PoisonError::into_inner), _fork: fork }
}

/// Those of the account that this thread works for.
pub(crate) fn calls() -> &'static Calls {
    &CALLS[current()]
}

/// Sets the most memory that the calls of an account may take together. Number 0 is for the process's calls and for all without a limit. 0
/// bytes are no limit.
pub(crate) fn set_limit_of(account: usize, bytes: Option<u64>) {
    let bytes = bytes.filter(|&bytes| bytes > 0);
    if let Some(bytes) = bytes {
        CALLS[account].limit.store(bytes, Ordering::SeqCst);
    }
    CALLS[account].is_limited.store(bytes.is_some(), Ordering::SeqCst);
    // The process's is also that of accounts without one. A call that begins is either seen here, or sees the limit.
    let concerned = if account == 0 { 0..ACCOUNTS } else { account..account + 1 };
    for account in concerned.filter(|&account| CALLS[account].running.load(Ordering::SeqCst) > 0) {
        let _settling = settle(account);
        if CALLS[account].running.load(Ordering::Relaxed) > 0 {
            set_ceiling(account, ceiling(account));
        }
    }
}

/// The most that an account may hold while calls are running.
pub(crate) fn ceiling(account: usize) -> isize {
    let limit = limit_for(account).map_or(isize::MAX, |limit| isize::try_from(limit).unwrap_or(isize::MAX));
    CALLS[account].before.load(Ordering::Relaxed).saturating_add(limit)
}

/// The program's account gets so many bytes of one that is closed: its calls that are running have not taken them.
pub(crate) fn receive(bytes: isize) {
    let _settling = settle(0);
    CALLS[0].before.fetch_add(bytes, Ordering::Relaxed);
    if CALLS[0].running.load(Ordering::Relaxed) > 0 {
        set_ceiling(0, ceiling(0));
    }
}

/// The limit of an account itself.
pub(crate) fn limit_of(account: usize) -> Option<u64> {
    let calls = &CALLS[account];
    calls.is_limited.load(Ordering::SeqCst).then(|| calls.limit.load(Ordering::SeqCst))
}

/// The limit that holds for an account.
pub(crate) fn limit_for(account: usize) -> Option<u64> {
    limit_of(account).or_else(|| limit_of(0))
}

/// The limit that holds for the call that this thread works for.
pub(crate) fn limit_here() -> Option<u64> {
    limit_for(current())
}

/// An account that others had before begins anew.
pub(crate) fn begin(account: usize) {
    CALLS[account].is_limited.store(false, Ordering::Relaxed);
    CALLS[account].running.store(0, Ordering::Relaxed);
    CALLS[account].before.store(0, Ordering::Relaxed);
    CALLS[account].foreseen.store(0, Ordering::Relaxed);
}

/// The limit as the end of a clause. Nothing if there is none.
pub(crate) fn in_words() -> String {
    limit_here().map_or_else(String::new, |limit| format!(", {} are allowed", size(limit as f64)))
}

/// The reason and the remedy where the system, or who stands between, gave a file no memory.
pub(crate) fn not_had_for_file() -> String {
    let remedy = if limit_here().is_some() { "raise the limit" } else { "close other programs" };
    format!("more could not be had{}: {remedy}", in_words())
}

/// Bytes in words.
pub fn size(bytes: f64) -> String {
    match bytes {
        b if b < 1e6 => format!("{:.0} kB", b / 1e3),
        b if b < 1e10 => format!("{:.0} MB", b / 1e6),
        b if b < 1e15 => format!("{:.0} GB", b / 1e9),
        b => format!("{:.0e} GB", b / 1e9),
    }
}

/// Bytes of address space that the process may still take, where the system limits it (`ulimit -v`).
#[cfg(target_os = "linux")]
pub fn address_space() -> f64 {
    let Some(most) = rustix::process::getrlimit(rustix::process::Resource::As).current else { return f64::INFINITY };
    let pages = std::fs::read_to_string("/proc/self/statm");
    let pages = pages.ok().and_then(|text| text.split(' ').next().and_then(|pages| pages.parse::<u64>().ok()));
    let used = pages.unwrap_or(0).saturating_mul(rustix::param::page_size() as u64);
    most.saturating_sub(used) as f64
}

/// Bytes of address space that the process may still take: other systems don't limit it.
#[cfg(not(target_os = "linux"))]
pub fn address_space() -> f64 {
    f64::INFINITY
}
