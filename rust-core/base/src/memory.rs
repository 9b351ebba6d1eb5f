//! Memory that a call will take, found out before it is taken; and what follows where it can't be had all the same.
//!
//! Linux promises more memory than it has and ends somebody's process when it is asked to keep the promise: so work is
//! refused before it begins. Estimates can err, and not everything is estimated: so hosts make the account of
//! `surfrecon-allocator` their allocator and wrap each call in [`guarded`]. What calls take together then stays below the
//! limit and below what was free, and a refused allocation ends the call with an error.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicU32, AtomicU64, AtomicUsize, Ordering};

use surfrecon_allocator::{Refused, set_ceiling};
pub use surfrecon_allocator::{held, peak, restart_peak};

use crate::error::{Error, Result};

/// Less is not worth asking the system, which takes a tenth of a millisecond.
const ALWAYS_THERE: f64 = 16e6;

/// What messages, buffers and jobs take beside what estimates count.
const SMALL: f64 = 1e5;
const SHARE_OF_SMALL: f64 = 0.01;

static LIMIT: AtomicU64 = AtomicU64::new(u64::MAX);

/// Calls that are running.
static RUNNING: AtomicUsize = AtomicUsize::new(0);
/// The process that the first of them began in.
static PROCESS: AtomicU32 = AtomicU32::new(0);
/// What was held when the first of them began.
static BEFORE: AtomicUsize = AtomicUsize::new(0);
/// The largest estimate since then, in bytes beyond [`BEFORE`].
static FORESEEN: AtomicU64 = AtomicU64::new(0);

/// Sets the most memory that calls may take, in bytes: together, where several run at a time. `None`, the default, for all
/// that is free. For the whole process, and from now on: also for what running calls go on to take. What a host makes and
/// keeps meanwhile counts as theirs.
pub fn set_limit(bytes: Option<u64>) {
    LIMIT.store(bytes.unwrap_or(u64::MAX), Ordering::Relaxed);
    if RUNNING.load(Ordering::Relaxed) > 0 {
        set_ceiling(ceiling(BEFORE.load(Ordering::Relaxed)));
    }
}

/// What may be held where this much was before the first running call began.
fn ceiling(before: usize) -> usize {
    before.saturating_add(limit().map_or(usize::MAX, |limit| usize::try_from(limit).unwrap_or(usize::MAX)))
}

/// What [`set_limit`] set.
pub fn limit() -> Option<u64> {
    Some(LIMIT.load(Ordering::Relaxed)).filter(|bytes| *bytes != u64::MAX)
}

/// Bytes that the last call, or those that are running, were estimated to take; 0 where nothing was worth an estimate.
pub fn foreseen() -> u64 {
    FORESEEN.load(Ordering::Relaxed)
}

/// Runs a call of a host: what it takes is kept below the limit, and an allocation that is refused is an error. Both only
/// where `surfrecon_allocator::Account` is the program's allocator. Other panics go on.
///
/// # Errors
/// What `call` returns; [`Error::OutOfMemory`].
pub fn guarded<R, E: From<Error>>(call: impl FnOnce() -> Result<R, E>) -> Result<R, E> {
    surfrecon_allocator::install();
    let running = Running::begin();
    // Whatever the panic left half done is dropped with the closure, or its owner looks after it.
    let outcome = catch_unwind(AssertUnwindSafe(call));
    drop(running);
    outcome.unwrap_or_else(|panic| match refused(&*panic) {
        Some(error) => Err(error.into()),
        None => resume_unwind(panic),
    })
}

/// The error that a panic stands for, if it began with a refused allocation.
pub fn refused(panic: &(dyn Any + Send)) -> Option<Error> {
    let Refused { bytes } = panic.downcast_ref()?;
    Some(Error::OutOfMemory(not_had(*bytes as f64)))
}

// Asking what is free would take memory.
fn not_had(bytes: f64) -> String {
    format!("{} more could not be had; use less data or coarser parameters, or raise the limit", size(bytes))
}

struct Running;

impl Running {
    fn begin() -> Self {
        let others = RUNNING.fetch_add(1, Ordering::Relaxed);
        let is_limited = limit().is_some();
        // A process that was forked in the middle of a call has its count, and nobody who will ever end it.
        let left_behind = others > 0 && is_limited && PROCESS.load(Ordering::Relaxed) != std::process::id();
        if left_behind {
            RUNNING.store(1, Ordering::Relaxed);
        }
        if others == 0 || left_behind {
            // Not for nothing: it takes longer than the shortest calls.
            if is_limited {
                PROCESS.store(std::process::id(), Ordering::Relaxed);
            }
            let before = held();
            BEFORE.store(before, Ordering::Relaxed);
            FORESEEN.store(0, Ordering::Relaxed);
            set_ceiling(ceiling(before));
        }
        Running
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let one_less = |running: usize| Some(running.saturating_sub(1));
        if RUNNING.fetch_update(Ordering::Relaxed, Ordering::Relaxed, one_less) == Ok(1) {
            set_ceiling(usize::MAX);
        }
    }
}

/// Bytes that the running calls hold already.
pub fn taken() -> f64 {
    match RUNNING.load(Ordering::Relaxed) {
        0 => 0.0,
        _ => held().saturating_sub(BEFORE.load(Ordering::Relaxed)) as f64,
    }
}

/// Refuses work that would need more memory than is free: `what` names the work and begins the sentence, `remedy` ends it.
pub fn expect(bytes: f64, what: impl FnOnce() -> String, remedy: &str) -> Result<()> {
    expect_or(bytes, what, |_| remedy.to_owned())
}

/// [`expect`] by work that has begun, of what the call will have taken in all.
pub fn expect_in_all(bytes: f64, what: impl FnOnce() -> String, remedy: &str) -> Result<()> {
    expect((bytes - taken()).max(0.0), what, remedy)
}

/// Refuses a call on `count` of something, so many bytes each, that would need more memory than is free: for what a host
/// makes of the results of this crate.
///
/// # Errors
/// [`Error::OutOfMemory`]. `doing` begins the sentence: "sculpting 12 pixels needs ...".
pub fn foresee(count: usize, each: f64, doing: &str, things: &str) -> Result<()> {
    expect_each(count, each, 0.0, doing, things)
}

/// Refuses work on `count` of something, `fixed` bytes and so many each, that would need more memory than is free.
/// `doing` begins the sentence: "sculpting 12 pixels needs ...".
pub fn expect_each(count: usize, each: f64, fixed: f64, doing: &str, things: &str) -> Result<()> {
    let fit = |available: f64| match ((available - fixed) / each).floor() {
        n if n >= 1.0 => format!("about {n:.0} would fit"),
        _ => "free memory, or raise the limit".to_owned(),
    };
    expect_or(fixed + each * count as f64, || format!("{doing} {count} {things}"), fit)
}

fn expect_or(bytes: f64, what: impl FnOnce() -> String, remedy: impl FnOnce(f64) -> String) -> Result<()> {
    note(taken() + bytes);
    let limit = limit().map_or(f64::INFINITY, |bytes| bytes as f64);
    if bytes <= ALWAYS_THERE.min(limit - taken()) {
        return Ok(());
    }
    let (available, there) = available();
    if bytes <= available {
        return Ok(());
    }
    Err(Error::OutOfMemory(format!(
        "{} needs about {}, {} are {there}; {}",
        what(),
        size(bytes),
        size(available),
        remedy(available)
    )))
}

/// Notes what the running calls are estimated to take in all, by work that compares it with what there is itself.
pub fn note(bytes: f64) {
    FORESEEN.fetch_max((bytes * (1.0 + SHARE_OF_SMALL) + SMALL) as u64, Ordering::Relaxed);
}

/// Bytes that a call may take now, and whether they are `free` or only `allowed`. Infinite where neither is known.
pub fn available() -> (f64, &'static str) {
    let limit = limit().map_or(f64::INFINITY, |bytes| (bytes as f64 - taken()).max(0.0));
    // Asking takes memory itself: half a megabyte on Windows.
    let free = if limit <= ALWAYS_THERE { f64::INFINITY } else { free() };
    if limit < free { (limit, "allowed") } else { (free, "free") }
}

/// An empty vector with room for `count` entries.
///
/// # Errors
/// [`Error::OutOfMemory`] where there is less, or the system refuses it; `what` names it and begins the sentence.
pub fn reserved<T>(count: usize, what: impl Fn() -> String) -> Result<Vec<T>> {
    let bytes = size_of::<T>() as f64 * count as f64;
    expect(bytes, &what, "use less, or raise the limit")?;
    let mut all = Vec::new();
    all.try_reserve_exact(count).map_err(|_| Error::OutOfMemory(format!("{}: {}", what(), not_had(bytes))))?;
    Ok(all)
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

/// Bytes the system could give this process now.
fn free() -> f64 {
    let mut free = address_space();
    if sysinfo::IS_SUPPORTED_SYSTEM {
        let mut system = sysinfo::System::new();
        system.refresh_memory();
        let of_group = system.cgroup_limits().map_or(u64::MAX, |limits| limits.free_memory);
        match system.available_memory().min(of_group) {
            0 => {}
            bytes => free = free.min(bytes as f64),
        }
    }
    free
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
