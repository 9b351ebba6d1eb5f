//! Pointers of the caller, checked and used in one place.

use crate::status::{Failure, srf_status};

/// Writes a result through a pointer of the caller; `name` is the argument's, for the message.
///
/// The caller of the C function answers for the pointer: the header says that it is not NULL and may be written.
pub fn write<T>(name: &str, out: *mut T, value: T) -> Result<(), Failure> {
    if out.is_null() {
        return Err(Failure::new(srf_status::SRF_ERR_NULL, format!("{name} must not be NULL")));
    }
    // SAFETY: not NULL, and by the header's contract valid for a write of a T; `write` does not read what was there.
    unsafe { out.write_unaligned(value) };
    Ok(())
}
