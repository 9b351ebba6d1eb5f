//! Texts as C wants them.

use std::ffi::CString;

/// C ends a text at its first zero byte: what follows such a byte must not be lost.
pub fn c_text(text: &str) -> CString {
    CString::new(text.replace('\0', "\u{fffd}")).unwrap_or_default()
}
