//! Settings of the whole library in this program, which contexts have others beside: worker threads, memory and the log.

use std::ffi::{c_char, c_void};
use std::sync::Arc;

use surfrecon::log::{Level, Log, set};
use surfrecon::memory;

use crate::guard::guard;
use crate::pointer;
use crate::status::{Failure, srf_status, srf_status::*};
use crate::text::c_text;

/// A length, or another value, that is to be measured from the data.
pub const SRF_FROM_DATA: f64 = -1.0;

/// Importance of a message of the log.
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_log_level {
    /// For people who want to know, for example how a file was understood.
    SRF_LOG_LEVEL_INFO = 1,
    /// For people to look at, for example a part of the input that was left out.
    SRF_LOG_LEVEL_WARNING = 2,
}

/// Gets the messages of the log. level: a value of srf_log_level. text: UTF-8, valid during the call. user: the pointer given to
/// srf_set_log. Runs on the thread of the call that has something to tell. Must not unwind.
#[allow(non_camel_case_types)]
pub type srf_log_fn = Option<unsafe extern "C" fn(level: i32, text: *const c_char, user: *mut c_void)>;

/// The receiver that the caller has named.
pub fn log_of(log: srf_log_fn, user: *mut c_void) -> Log {
    let Some(log) = log else { return Log::OfProcess };
    let user = user.expose_provenance();
    Log::To(Arc::new(move |level, text| {
        let level = match level {
            Level::Info => srf_log_level::SRF_LOG_LEVEL_INFO,
            Level::Warning => srf_log_level::SRF_LOG_LEVEL_WARNING,
        };
        pointer::call_log(log, level as i32, &c_text(text), std::ptr::with_exposed_provenance_mut(user));
    }))
}

/// Worker threads of calls whose parameters say 0, unless made under a context with a number of its own. Results are the same for any
/// number.
/// threads    at most 1024. 0, the default, for one per core
/// returns    SRF_OK, SRF_ERR_PARAMETER. Since 0.1.
#[unsafe(no_mangle)]
pub extern "C" fn srf_set_threads(threads: u32) -> srf_status {
    guard(|| {
        check_threads(threads)?;
        surfrecon::threads::set_threads(threads);
        Ok(())
    })
}

/// Refuses a number of threads that can't be.
pub fn check_threads(threads: u32) -> Result<(), Failure> {
    if threads <= 1024 {
        return Ok(());
    }
    Err(Failure::new(SRF_ERR_PARAMETER, format!("threads must be >= 0 and <= 1024, got {threads}")))
}

/// Number set by srf_set_threads. Since 0.1.
#[unsafe(no_mangle)]
pub extern "C" fn srf_threads() -> u32 {
    surfrecon::threads::threads()
}

/// Most memory that calls may take, unless made under a context with a limit of its own. It is for all together, if several run at a time
/// under the same context or under none. It limits calls, not what they leave. Meshes, images and the like that were handed out before do
/// not count, however much they are, unless another call was running all the time since. A call that is foreseen to need more, or more than
/// is free, is refused with SRF_ERR_OUT_OF_MEMORY before it begins. A call that turns out to need more ends with it then, and leaves
/// nothing behind.
/// bytes      0, the default, for all that is free
/// returns    SRF_OK. Since 0.1.
#[unsafe(no_mangle)]
pub extern "C" fn srf_set_memory_limit(bytes: u64) -> srf_status {
    guard(|| {
        memory::set_limit(Some(bytes));
        Ok(())
    })
}

/// Number set by srf_set_memory_limit. Since 0.1.
#[unsafe(no_mangle)]
pub extern "C" fn srf_memory_limit() -> u64 {
    memory::limit().unwrap_or(0)
}

/// Sets who gets the messages of the log from now on, unless of calls under a context with a log of its own.
/// log        NULL for nobody, the default
/// user       handed to log as it is. Must stay usable until another log is set and calls on other threads have returned
/// returns    SRF_OK. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_set_log(log: srf_log_fn, user: *mut c_void) -> srf_status {
    guard(|| {
        set(log_of(log, user));
        Ok(())
    })
}

/// A value that SRF_FROM_DATA stands in for.
pub fn from_data(value: f64) -> Option<f64> {
    (value != SRF_FROM_DATA).then_some(value)
}
