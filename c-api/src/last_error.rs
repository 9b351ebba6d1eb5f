//! Outcomes of calls: the text of the last error, and of a status.

use std::ffi::{CStr, c_char};

use crate::guard::guard;
use crate::pointer;
use crate::status::{Failure, LAST_ERROR, remember, srf_status, srf_status::*};

/// Every status with its short text.
const TEXTS: [(srf_status, &CStr); 11] = [
    (SRF_OK, c"ok"),
    (SRF_ERR_PARAMETER, c"parameter out of range"),
    (SRF_ERR_INPUT, c"unusable input"),
    (SRF_ERR_FORMAT, c"damaged or unknown file"),
    (SRF_ERR_IO, c"reading or writing failed"),
    (SRF_ERR_OUT_OF_MEMORY, c"not enough memory"),
    (SRF_ERR_CANCELLED, c"cancelled"),
    (SRF_ERR_NULL, c"a pointer is NULL that must not be"),
    (SRF_ERR_INTERNAL, c"internal error"),
    (SRF_ERR_HANDLE, c"not a handle of the kind asked for"),
    (SRF_ERR_STRUCT_SIZE, c"unknown size of a struct"),
];

/// The short text of a status, of whatever number.
pub fn short_text(status: i32) -> &'static str {
    let known = TEXTS.iter().find(|(known, _)| *known as i32 == status);
    known.and_then(|(_, text)| text.to_str().ok()).unwrap_or("unknown status")
}

/// Text of the last error of this thread: what is wrong and, where there is one, the remedy. Empty if no call has failed, never NULL. Valid
/// until the next call that fails on this thread. UTF-8. Since 0.1.
#[unsafe(no_mangle)]
pub extern "C" fn srf_last_error_message() -> *const c_char {
    // `as_ptr` stays good after the borrow ends: only `remember` replaces the text.
    LAST_ERROR.try_with(|last| last.borrow().as_ptr()).unwrap_or(c"".as_ptr())
}

/// Says what went wrong in a function that the library calls (srf_image_source): becomes the text of the last error of this thread.
/// text       UTF-8. Not NULL
/// returns    SRF_OK, SRF_ERR_INPUT for text that is not UTF-8, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_set_last_error(text: *const c_char) -> srf_status {
    guard(|| {
        remember(pointer::text("text", text)?);
        Ok(())
    })
}

/// Short text of a status, for example "cancelled".
/// out_text   receives a static text on SRF_OK only. Not NULL
/// returns    SRF_OK, SRF_ERR_PARAMETER if there is no such status, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_status_text(status: i32, out_text: *mut *const c_char) -> srf_status {
    guard(|| {
        let known = TEXTS.iter().find(|(known, _)| *known as i32 == status);
        let (_, text) = known.ok_or_else(|| {
            let last = TEXTS[TEXTS.len() - 1].0 as i32;
            Failure::new(SRF_ERR_PARAMETER, format!("status must be >= 0 and <= {last}, got {status}"))
        })?;
        pointer::write("out_text", out_text, text.as_ptr())
    })
}
