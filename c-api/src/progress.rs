//! Progress and cancelling.

use std::ffi::{CString, c_char, c_void};
use std::ops::ControlFlow;

use surfrecon::{Error, Progress, Tick};

use crate::cancel::srf_cancel;
use crate::status::Failure;
use crate::{handle, pointer};

/// Asked about every 30 ms during a long call, on the thread that made the call. stage: what is being done, for people. fraction: the share
/// of the whole call that is done, 0 to 1, never falling, and 1 in the last report of a call that succeeds. message: both as one line.
/// user: as given in srf_progress. The texts are UTF-8 and valid during the call of the function. Answer 0 to go on, anything else to
/// cancel. The call then returns SRF_ERR_CANCELLED within a tenth of a second and leaves nothing behind. The answer once all is done
/// changes nothing. Must not unwind.
#[allow(non_camel_case_types)]
pub type srf_progress_fn =
    Option<unsafe extern "C" fn(stage: *const c_char, fraction: f64, message: *const c_char, user: *mut c_void) -> i32>;

/// Watcher of a long call, and the switch that cancels it. NULL where one is asked for: nobody and nothing.
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct srf_progress {
    /// Asked during the call. NULL for nobody.
    pub report: srf_progress_fn,
    /// Handed to report as it is.
    pub user: *mut c_void,
    /// Cancels the call once it is set, by whatever thread, also where it was before the call began. NULL for nothing. It may be freed
    /// during the call, and be given to several calls at once.
    pub cancel: *const srf_cancel,
}

/// Work that reports to the caller's progress, at its end too if it succeeds.
pub fn watched<R>(
    progress: *const srf_progress,
    work: impl FnOnce(&Progress<'static>) -> Result<R, Failure>,
) -> Result<R, Failure> {
    let progress = reporting(progress)?;
    let done = work(&progress)?;
    progress.finish();
    Ok(done)
}

/// The progress of the core that reports to the caller's.
fn reporting(progress: *const srf_progress) -> Result<Progress<'static>, Failure> {
    let Some(srf_progress { report, user, cancel }) = pointer::read_struct(progress) else {
        return Ok(Progress::none());
    };
    let cancel = if cancel.is_null() { None } else { Some(handle::get("progress.cancel", cancel)?) };
    if report.is_none() && cancel.is_none() {
        return Ok(Progress::none());
    }
    let is_set = move || cancel.as_ref().is_some_and(|cancel| cancel.is_set());
    // Some work is over before anybody is asked.
    if is_set() {
        return Err(Error::Cancelled.into());
    }
    // The core calls it on the calling thread alone, so the pointer goes nowhere it did not come from.
    let user = user.expose_provenance();
    Ok(Progress::new(move |tick: Tick| {
        if is_set() {
            return ControlFlow::Break(());
        }
        let Some(report) = report else { return ControlFlow::Continue(()) };
        let text = |text: String| CString::new(text).unwrap_or_default();
        let stage = text(tick.stage.to_owned());
        let message = text(format!("{}, {:.0} %", tick.stage, 100.0 * tick.fraction));
        let user = std::ptr::with_exposed_provenance_mut(user);
        match pointer::call_progress(report, &stage, tick.fraction, &message, user) {
            0 => ControlFlow::Continue(()),
            _ => ControlFlow::Break(()),
        }
    }))
}
