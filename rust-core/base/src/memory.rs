//! Memory that a call will take, found out before it is taken. Also what follows if it can't be had all the same.
//!
//! Linux promises more memory than it has and ends somebody's process when it is asked to keep the promise, so work is refused before it
//! begins. Estimates can err, and not everything is estimated: so hosts make the account of `surfrecon-allocator` their allocator and wrap
//! each call in [`guarded`]. The sum of all calls then stays below the limit and below what was free, and a refused allocation ends the
//! call with an error.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::Ordering;

use surfrecon_allocator::{Refused, current, held_by, set_ceiling};
pub use surfrecon_allocator::{held, peak, restart_peak};

use crate::allowed::{self, CALLS, calls, ceiling, limit_for, limit_here, settle};
pub use crate::allowed::{address_space, size};
use crate::context;
use crate::error::{Error, Result};

/// Less is not worth asking the system, which takes a tenth of a millisecond.
const ALWAYS_THERE: f64 = 16e6;

/// Bytes of messages, buffers and jobs, beside those that estimates count.
const SMALL: f64 = 1e5;
const SHARE_OF_SMALL: f64 = 0.01;

/// Sets the most memory that calls may take, in bytes: together, if several run at a time. `None`, the default, and 0 stand for all that is
/// free. It is for the whole process but for contexts with a limit of their own. It holds from now on, also for memory that running calls
/// go on to take. Memory that a host takes and keeps meanwhile counts as theirs. Memory that it had before does not, however much it is,
/// unless another call was running all the time since.
pub fn set_limit(bytes: Option<u64>) {
    allowed::set_limit_of(0, bytes);
}

/// The limit that [`set_limit`] set. `None` for no limit.
pub fn limit() -> Option<u64> {
    allowed::limit_of(0)
}

/// Bytes that the last call, or those that are running, were estimated to take, of the context that this thread works for or chose. 0 if
/// nothing was worth an estimate.
pub fn foreseen() -> u64 {
    let _context = context::Call::begin();
    calls().foreseen.load(Ordering::Relaxed)
}

/// Runs a call of a host, in the context that its thread [chose](context::choose): what it takes is kept below the limit, and an allocation
/// that is refused is an error. Both only where `surfrecon_allocator::Account` is the program's allocator. Other panics go on.
///
/// # Errors
/// The result of `call`, or [`Error::OutOfMemory`].
pub fn guarded<R, E: From<Error>>(call: impl FnOnce() -> Result<R, E>) -> Result<R, E> {
    surfrecon_allocator::install();
    let _context = context::Call::begin();
    let running = Running::begin();
    // All that the panic left half done is dropped with the closure, or its owner looks after it.
    let outcome = catch_unwind(AssertUnwindSafe(call));
    drop(running);
    outcome.unwrap_or_else(|panic| match refused(&*panic) {
        Some(error) => Err(error.into()),
        None => resume_unwind(panic),
    })
}

/// Does a part of a call that may be done another way: `None` where an allocation was refused, and what it had taken is given back. Other
/// panics go on.
pub fn attempted<R>(part: impl FnOnce() -> R) -> Option<R> {
    match catch_unwind(AssertUnwindSafe(part)) {
        Ok(done) => Some(done),
        Err(panic) if panic.is::<Refused>() => None,
        Err(panic) => resume_unwind(panic),
    }
}

/// The error that a panic stands for, if it began with a refused allocation.
pub fn refused(panic: &(dyn Any + Send)) -> Option<Error> {
    let Refused { bytes } = panic.downcast_ref()?;
    Some(Error::OutOfMemory(not_had(*bytes as f64)))
}

// Asking what is free would take memory.
fn not_had(bytes: f64) -> String {
    let allowed = allowed::in_words();
    format!("{} more could not be had{allowed}: use less data or coarser parameters, or raise the limit", size(bytes))
}

/// A call that is running, on the account that it began with.
struct Running(usize);

impl Running {
    fn begin() -> Self {
        let account = current();
        let _settling = settle(account);
        let calls = &CALLS[account];
        let others = calls.running.fetch_add(1, Ordering::SeqCst);
        let is_limited = limit_for(account).is_some();
        // A process that was forked in the middle of a call has its count, and nobody who will ever end it.
        let left_behind = others > 0 && is_limited && calls.process.load(Ordering::Relaxed) != std::process::id();
        if left_behind {
            calls.running.store(1, Ordering::Relaxed);
        }
        if others == 0 || left_behind {
            // Not for nothing: it takes longer than the shortest calls.
            if is_limited {
                calls.process.store(std::process::id(), Ordering::Relaxed);
            }
            calls.before.store(held_by(account), Ordering::Relaxed);
            calls.foreseen.store(0, Ordering::Relaxed);
            set_ceiling(account, ceiling(account));
        }
        Running(account)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _settling = settle(self.0);
        let one_less = |running: usize| Some(running.saturating_sub(1));
        if CALLS[self.0].running.fetch_update(Ordering::Relaxed, Ordering::Relaxed, one_less) == Ok(1) {
            set_ceiling(self.0, isize::MAX);
        }
    }
}

/// Bytes that the running calls of the context hold already.
pub fn taken() -> f64 {
    match calls().running.load(Ordering::Relaxed) {
        0 => 0.0,
        _ => held_by(current()).saturating_sub(calls().before.load(Ordering::Relaxed)).max(0) as f64,
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
    let limit = limit_here().map_or(f64::INFINITY, |bytes| bytes as f64);
    if bytes <= ALWAYS_THERE.min(limit - taken()) {
        return Ok(());
    }
    let (available, there) = available();
    if bytes <= available {
        return Ok(());
    }
    Err(Error::OutOfMemory(format!(
        "{} needs about {}, {} are {there}: {}",
        what(),
        size(bytes),
        size(available),
        remedy(available)
    )))
}

/// Notes what the running calls are estimated to take in all, by work that compares it with what there is itself.
pub fn note(bytes: f64) {
    calls().foreseen.fetch_max((bytes * (1.0 + SHARE_OF_SMALL) + SMALL) as u64, Ordering::Relaxed);
}

/// The limit on the memory of all calls that work for the same as this thread, however much they have taken. `None` if none was set.
pub fn limit_of_calls() -> Option<u64> {
    limit_here()
}

/// Bytes that a call may take now, and whether they are `free` or only `allowed`. Infinite where neither is known.
pub fn available() -> (f64, &'static str) {
    let limit = limit_here().map_or(f64::INFINITY, |bytes| (bytes as f64 - taken()).max(0.0));
    // Asking takes memory itself: half a megabyte on Windows.
    let free = if limit <= ALWAYS_THERE { f64::INFINITY } else { free() };
    if limit < free { (limit, "allowed") } else { (free, "free") }
}

/// An empty vector with room for `count` entries.
///
/// # Errors
/// [`Error::OutOfMemory`] if there is less, or the system refuses it. `what` names it and begins the sentence.
pub fn reserved<T>(count: usize, what: impl Fn() -> String) -> Result<Vec<T>> {
    let bytes = size_of::<T>() as f64 * count as f64;
    expect(bytes, &what, "use less, or raise the limit")?;
    let mut all = Vec::new();
    all.try_reserve_exact(count).map_err(|_| Error::OutOfMemory(format!("{}: {}", what(), not_had(bytes))))?;
    Ok(all)
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
