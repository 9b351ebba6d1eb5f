//! Memory that a call will take, found out before it is taken: an allocation that fails ends the program, and with it the
//! host and the user's unsaved work.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::{Error, Result};

/// Less is not worth asking the system, which takes a tenth of a millisecond.
const ALWAYS_THERE: f64 = 16e6;

static LIMIT: AtomicU64 = AtomicU64::new(u64::MAX);

/// Sets the most memory that one call may take, in bytes, as far as it can be foreseen; `None`, the default, for all that
/// is free. For the whole process.
pub fn set_limit(bytes: Option<u64>) {
    LIMIT.store(bytes.unwrap_or(u64::MAX), Ordering::Relaxed);
}

/// What [`set_limit`] set.
pub fn limit() -> Option<u64> {
    Some(LIMIT.load(Ordering::Relaxed)).filter(|bytes| *bytes != u64::MAX)
}

/// Refuses work that would need more memory than is free: `what` names the work and begins the sentence, `remedy` ends it.
pub(crate) fn expect(bytes: f64, what: impl FnOnce() -> String, remedy: &str) -> Result<()> {
    let limit = limit().map_or(f64::INFINITY, |bytes| bytes as f64);
    if bytes <= ALWAYS_THERE.min(limit) {
        return Ok(());
    }
    let (available, there) = available();
    if bytes <= available {
        return Ok(());
    }
    Err(Error::OutOfMemory(format!(
        "{} needs about {}, {} are {there}; {remedy}",
        what(),
        size(bytes),
        size(available)
    )))
}

/// Bytes that a call may take now, and whether they are `free` or only `allowed`. Infinite where neither is known.
pub(crate) fn available() -> (f64, &'static str) {
    let (free, limit) = (free(), limit().map_or(f64::INFINITY, |bytes| bytes as f64));
    if limit < free { (limit, "allowed") } else { (free, "free") }
}

/// Bytes in words.
pub(crate) fn size(bytes: f64) -> String {
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
fn address_space() -> f64 {
    let Some(most) = rustix::process::getrlimit(rustix::process::Resource::As).current else { return f64::INFINITY };
    let pages = std::fs::read_to_string("/proc/self/statm");
    let pages = pages.ok().and_then(|text| text.split(' ').next().and_then(|pages| pages.parse::<u64>().ok()));
    let used = pages.unwrap_or(0).saturating_mul(rustix::param::page_size() as u64);
    most.saturating_sub(used) as f64
}

#[cfg(not(target_os = "linux"))]
fn address_space() -> f64 {
    f64::INFINITY
}
