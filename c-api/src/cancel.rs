//! Cancelling from another thread, or from a handler of a signal.
//!
//! Such a handler may interrupt this library anywhere, also where it holds a lock or allocates. So `srf_cancel_set` looks at places of
//! atomics that are never given back, beside the table of handles.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::guard::guard;
use crate::handle::{self, handle};
use crate::pointer;
use crate::status::{Failure, srf_status, srf_status::*};

/// A switch that cancels the calls it is handed to (srf_progress), from any thread. Released with srf_cancel_free().
#[allow(non_camel_case_types)]
pub struct srf_cancel {
    _opaque: [u8; 0],
}

handle!(srf_cancel, Cancel);

/// A place holds 0 if nobody has it. Else it holds [`TAKEN`], the number of its handle, a multiple of 16, until that is freed, and [`SET`]
/// once it is set. It is one word, so that a setter can't hit the next one that has the place.
type Place = AtomicUsize;

const SET: usize = 1;
const TAKEN: usize = 2;

/// Places, twice as many in each block as in that before it.
static BLOCKS: [OnceLock<Box<[Place]>>; 24] = [const { OnceLock::new() }; 24];
const FIRST: usize = 64;

fn places() -> impl Iterator<Item = &'static Place> {
    BLOCKS.iter().map_while(OnceLock::get).flatten()
}

/// A place that nobody else has until it is dropped.
pub struct Cancel(&'static Place);

impl Cancel {
    fn with_number(number: usize) -> Result<Self, Failure> {
        loop {
            let free = |place: &&Place| {
                place.compare_exchange(0, TAKEN | number, Ordering::Relaxed, Ordering::Relaxed).is_ok()
            };
            if let Some(place) = places().find(free) {
                return Ok(Cancel(place));
            }
            let Some((size, block)) = BLOCKS.iter().enumerate().find(|(_, block)| block.get().is_none()) else {
                return Err(Failure::new(SRF_ERR_OUT_OF_MEMORY, "there are too many srf_cancel: free some"));
            };
            let _ = block.set((0..FIRST << size).map(|_| Place::new(0)).collect());
        }
    }

    /// Whether calls that have it are to stop.
    pub fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed) & SET != 0
    }
}

impl Drop for Cancel {
    fn drop(&mut self) {
        self.0.store(0, Ordering::Relaxed);
    }
}

/// Makes a switch that cancels calls. It is not set.
/// out_cancel  receives a new handle on SRF_OK only. Not NULL
/// returns     SRF_OK, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_cancel_create(out_cancel: *mut *mut srf_cancel) -> srf_status {
    guard(|| handle::give_numbered("out_cancel", out_cancel, Cancel::with_number))
}

/// Releases it. A call that has it goes on, and can no longer be cancelled by it.
/// cancel     NULL does nothing
/// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_cancel_free(cancel: *mut srf_cancel) -> srf_status {
    guard(|| {
        if cancel.is_null() {
            return Ok(());
        }
        let kept = handle::get("cancel", cancel.cast_const())?;
        handle::free("cancel", cancel)?;
        kept.0.fetch_and(SET | TAKEN, Ordering::Relaxed);
        Ok(())
    })
}

/// Cancels all calls that have it, and those that begin with it from now on: they return SRF_ERR_CANCELLED within a tenth of a second.
/// Async-signal-safe: it looks at atomics and stores one, takes no lock and no memory, and changes neither errno nor the text of the last
/// error, also where it fails. So a handler of SIGINT may call it.
/// cancel     not NULL
/// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_cancel_set(cancel: *mut srf_cancel) -> srf_status {
    if cancel.is_null() {
        return SRF_ERR_NULL;
    }
    let with_set = |state: usize| (state & !(SET | TAKEN) == cancel.addr()).then_some(state | SET);
    let set = |place: &Place| place.fetch_update(Ordering::Relaxed, Ordering::Relaxed, with_set).is_ok();
    if places().any(set) { SRF_OK } else { SRF_ERR_HANDLE }
}

/// Takes that back for calls that begin from now on. One that is running and has not yet noticed may go on as well.
/// cancel     not NULL
/// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_cancel_reset(cancel: *mut srf_cancel) -> srf_status {
    guard(|| {
        handle::get("cancel", cancel.cast_const())?.0.fetch_and(!SET, Ordering::Relaxed);
        Ok(())
    })
}

/// Whether it is set.
/// cancel      not NULL
/// out_is_set  receives 1 or 0 on SRF_OK only. Not NULL
/// returns     SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_cancel_is_set(cancel: *const srf_cancel, out_is_set: *mut u32) -> srf_status {
    guard(|| pointer::write("out_is_set", out_is_set, u32::from(handle::get("cancel", cancel)?.is_set())))
}
