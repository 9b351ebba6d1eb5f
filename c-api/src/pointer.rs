//! Pointers of the caller, checked and used in one place. The caller of the C function answers for what the header says of
//! them: that they are aligned for nothing more than a byte, and that as many bytes can be read or written as are named.

use std::ffi::{CStr, c_char, c_void};

use bytemuck::{AnyBitPattern, NoUninit};

use crate::status::{Failure, srf_status::*};

fn not_null<T>(name: &str, pointer: *const T) -> Result<(), Failure> {
    if pointer.is_null() {
        return Err(Failure::new(SRF_ERR_NULL, format!("{name} must not be NULL")));
    }
    Ok(())
}

/// Writes a result through a pointer of the caller; `name` is the argument's, for the message.
pub fn write<T>(name: &str, out: *mut T, value: T) -> Result<(), Failure> {
    not_null(name, out)?;
    // SAFETY: not NULL, and by the header's contract valid for a write of a T; `write` does not read what was there.
    unsafe { out.write_unaligned(value) };
    Ok(())
}

/// Checks a pointer that will be written to once the work is done, so that no work is done in vain.
pub fn writable<T>(name: &str, out: *mut T) -> Result<(), Failure> {
    not_null(name, out)
}

/// The value behind a pointer.
pub fn read<T: AnyBitPattern>(name: &str, pointer: *const T) -> Result<T, Failure> {
    not_null(name, pointer)?;
    // SAFETY: not NULL, and by the header's contract valid for a read of a T, of which every bit pattern is one.
    Ok(unsafe { pointer.read_unaligned() })
}

/// The struct of pointers and numbers behind a pointer; `None` for NULL.
pub fn read_struct<T: Copy>(pointer: *const T) -> Option<T> {
    // SAFETY: not NULL, and by the header's contract a T that the caller has filled in.
    (!pointer.is_null()).then(|| unsafe { pointer.read_unaligned() })
}

/// The `count` bytes at a pointer.
pub fn bytes<'a>(name: &str, pointer: *const u8, count: usize) -> Result<&'a [u8], Failure> {
    if count == 0 {
        return Ok(&[]);
    }
    not_null(name, pointer)?;
    if count > isize::MAX as usize {
        return Err(Failure::new(SRF_ERR_INPUT, format!("{name}: {count} bytes are more than there can be")));
    }
    // SAFETY: not NULL, and by the header's contract `count` bytes can be read there for the length of the call.
    Ok(unsafe { std::slice::from_raw_parts(pointer, count) })
}

/// Copies `count` values to where the caller wants them.
pub fn copy_out<T: NoUninit>(name: &str, out: *mut T, values: &[T]) -> Result<(), Failure> {
    if values.is_empty() {
        return Ok(());
    }
    not_null(name, out)?;
    let bytes: &[u8] = bytemuck::cast_slice(values);
    // SAFETY: not NULL, and by the header's contract as many bytes can be written there; nothing of ours lies there.
    unsafe { std::ptr::copy_nonoverlapping(bytes.as_ptr(), out.cast::<u8>(), bytes.len()) };
    Ok(())
}

/// A text that ends with a zero byte.
pub fn text<'a>(name: &str, pointer: *const c_char) -> Result<&'a str, Failure> {
    not_null(name, pointer)?;
    // SAFETY: not NULL, and by the header's contract a text that ends with a zero byte and stays for the length of the call.
    let text = unsafe { CStr::from_ptr(pointer) };
    text.to_str().map_err(|_| Failure::new(SRF_ERR_INPUT, format!("{name} is not UTF-8: {}", text.to_string_lossy())))
}

/// The `count` pointers at a pointer.
pub fn pointers<T>(name: &str, pointer: *const *const T, count: usize) -> Result<Vec<*const T>, Failure> {
    let size = size_of::<*const T>();
    let length = count
        .checked_mul(size)
        .ok_or_else(|| Failure::new(SRF_ERR_INPUT, format!("{name}: {count} pointers are more than there can be")))?;
    let bytes = bytes(name, pointer.cast(), length)?;
    Ok((0..count)
        // SAFETY: within the bytes just checked; a pointer is read, not followed.
        .map(|i| unsafe { bytes.as_ptr().add(i * size).cast::<*const T>().read_unaligned() })
        .collect())
}

/// The `count` numbers at a pointer.
pub fn numbers<T: AnyBitPattern>(name: &str, pointer: *const T, count: usize) -> Result<Vec<T>, Failure> {
    let length = count
        .checked_mul(size_of::<T>())
        .ok_or_else(|| Failure::new(SRF_ERR_INPUT, format!("{name}: {count} numbers are more than there can be")))?;
    let bytes = bytes(name, pointer.cast(), length)?;
    Ok(bytes.chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned).collect())
}

/// Calls the caller's progress function.
pub fn call_progress(
    function: unsafe extern "C" fn(*const c_char, f64, *const c_char, *mut c_void) -> i32,
    stage: &CStr,
    fraction: f64,
    message: &CStr,
    user: *mut c_void,
) -> i32 {
    // SAFETY: the header's contract: a function of this type that does not unwind, given back the caller's own pointer.
    unsafe { function(stage.as_ptr(), fraction, message.as_ptr(), user) }
}

/// Calls the caller's log function.
pub fn call_log(
    function: unsafe extern "C" fn(i32, *const c_char, *mut c_void),
    level: i32,
    text: &CStr,
    user: *mut c_void,
) {
    // SAFETY: the header's contract: a function of this type that does not unwind, given back the caller's own pointer.
    unsafe { function(level, text.as_ptr(), user) }
}

/// Calls the caller's function that makes something behind a handle of type `H`.
pub fn call_make<H>(
    function: unsafe extern "C" fn(*mut c_void, *mut *mut H) -> i32,
    user: *mut c_void,
    out_made: &mut *mut H,
) -> i32 {
    // SAFETY: the header's contract: a function of this type that does not unwind and may be called on any thread, given back the
    // caller's own pointer, and room for a handle.
    unsafe { function(user, out_made) }
}
