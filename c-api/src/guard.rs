//! No panic gets out: it would end the host.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::fork;
use crate::status::{Failure, remember, srf_status};

/// Runs the body of an entry. A failure or a panic becomes a status, its text that of the last error.
pub fn guard(body: impl FnOnce() -> Result<(), Failure>) -> srf_status {
    fork::watch();
    // A body that panics has written nothing to the caller: results are written last.
    let failure = match catch_unwind(AssertUnwindSafe(|| surfrecon::memory::guarded(body))) {
        Ok(Ok(())) => return srf_status::SRF_OK,
        Ok(Err(failure)) => failure,
        Err(panic) => Failure::new(srf_status::SRF_ERR_INTERNAL, format!("internal error: {}", text_of(panic))),
    };
    remember(&failure.text);
    failure.status
}

fn text_of(panic: Box<dyn Any + Send>) -> String {
    match panic.downcast::<String>() {
        Ok(text) => *text,
        Err(panic) => panic.downcast_ref::<&str>().map_or_else(|| "no text".to_owned(), |text| (*text).to_owned()),
    }
}
