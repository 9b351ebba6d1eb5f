//! Settings of the whole library in this program: worker threads, memory and the log.

use std::ffi::{c_char, c_void};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{PoisonError, RwLock};

use surfrecon::memory;

use crate::guard::guard;
use crate::status::{Failure, srf_status, srf_status::*};
use crate::text::c_text;
use crate::{fork, pointer};

/// A length, or another value, that is to be measured from the data.
pub const SRF_FROM_DATA: f64 = -1.0;

/// How important a message of the log is.
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_log_level {
    /// What a person may want to know, for example how a file was understood.
    SRF_LOG_LEVEL_INFO = 1,
    /// What a person should look at, for example a part of the input that was left out.
    SRF_LOG_LEVEL_WARNING = 2,
}

/// Gets the messages of the log: level, a value of srf_log_level; text, UTF-8, valid during the call; user, the pointer
/// given to srf_set_log. Runs on the thread of the call that has something to tell; must not unwind.
#[allow(non_camel_case_types)]
pub type srf_log_fn = Option<unsafe extern "C" fn(level: i32, text: *const c_char, user: *mut c_void)>;

static THREADS: AtomicU32 = AtomicU32::new(0);

type Log = (unsafe extern "C" fn(i32, *const c_char, *mut c_void), usize);

static LOG: RwLock<Option<Log>> = RwLock::new(None);

/// Worker threads of calls whose parameters say 0. Results are the same for any number.
/// threads    at most 1024; 0, the default, for one a core
/// returns    SRF_OK, SRF_ERR_PARAMETER. Since 0.1.
#[unsafe(no_mangle)]
pub extern "C" fn srf_set_threads(threads: u32) -> srf_status {
    guard(|| {
        if threads > 1024 {
            let text = format!("threads must be >= 0 and <= 1024, got {threads}");
            return Err(Failure::new(SRF_ERR_PARAMETER, text));
        }
        THREADS.store(threads, Ordering::Relaxed);
        Ok(())
    })
}

/// Number set by srf_set_threads. Since 0.1.
#[unsafe(no_mangle)]
pub extern "C" fn srf_threads() -> u32 {
    THREADS.load(Ordering::Relaxed)
}

/// Most memory that calls may take; together, where several run at a time. What is foreseen to need more, or more than is
/// free, is refused with SRF_ERR_OUT_OF_MEMORY before it begins; what turns out to need more ends with it then, and
/// leaves nothing behind.
/// bytes      0, the default, for all that is free
/// returns    SRF_OK. Since 0.1.
#[unsafe(no_mangle)]
pub extern "C" fn srf_set_memory_limit(bytes: u64) -> srf_status {
    guard(|| {
        memory::set_limit(Some(bytes).filter(|bytes| *bytes != 0));
        Ok(())
    })
}

/// Number set by srf_set_memory_limit. Since 0.1.
#[unsafe(no_mangle)]
pub extern "C" fn srf_memory_limit() -> u64 {
    memory::limit().unwrap_or(0)
}

/// Who gets the messages of the log from now on.
/// log        NULL for nobody, the default
/// user       handed to log as it is; must stay usable until another log is set and calls on other threads have returned
/// returns    SRF_OK. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_set_log(log: srf_log_fn, user: *mut c_void) -> srf_status {
    guard(|| {
        let _fork = fork::prevent();
        *LOG.write().unwrap_or_else(PoisonError::into_inner) = log.map(|log| (log, user.expose_provenance()));
        Ok(())
    })
}

/// Worker threads for a call whose parameters ask for `asked`.
pub fn threads(asked: u32) -> usize {
    if asked == 0 { THREADS.load(Ordering::Relaxed) as usize } else { asked as usize }
}

/// Tells the log.
pub fn tell(level: srf_log_level, text: &str) {
    let log = {
        let _fork = fork::prevent();
        *LOG.read().unwrap_or_else(PoisonError::into_inner)
    };
    if let Some((log, user)) = log {
        pointer::call_log(log, level as i32, &c_text(text), std::ptr::with_exposed_provenance_mut(user));
    }
}

/// A value that SRF_FROM_DATA stands in for.
pub fn from_data(value: f64) -> Option<f64> {
    (value != SRF_FROM_DATA).then_some(value)
}
