//! Pointers of the caller, checked and used in one place. The caller of the C function answers for what the header says of them. They are
//! aligned for nothing more than a byte, and as many bytes can be read or written as are named.

use std::ffi::{CStr, c_char, c_void};

use bytemuck::{AnyBitPattern, NoUninit};

use crate::status::{Failure, srf_status::*};

fn not_null<T>(name: &str, pointer: *const T) -> Result<(), Failure> {
    if pointer.is_null() {
        return Err(Failure::new(SRF_ERR_NULL, format!("{name} must not be NULL")));
    }
    Ok(())
}

/// Writes a result through a pointer of the caller. `name` is the argument's, for the message.
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

/// The struct of pointers and numbers behind a pointer. `None` for NULL.
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
        return Err(Failure::new(SRF_ERR_PARAMETER, format!("{name}: {count} bytes are more than there can be")));
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
    let length = count.checked_mul(size).ok_or_else(|| {
        Failure::new(SRF_ERR_PARAMETER, format!("{name}: {count} pointers are more than there can be"))
    })?;
    let bytes = bytes(name, pointer.cast(), length)?;
    Ok((0..count)
        // SAFETY: within the bytes just checked; a pointer is read, not followed.
        .map(|i| unsafe { bytes.as_ptr().add(i * size).cast::<*const T>().read_unaligned() })
        .collect())
}

/// The `count` numbers at a pointer.
pub fn numbers<T: AnyBitPattern>(name: &str, pointer: *const T, count: usize) -> Result<Vec<T>, Failure> {
    let length = count.checked_mul(size_of::<T>()).ok_or_else(|| {
        Failure::new(SRF_ERR_PARAMETER, format!("{name}: {count} numbers are more than there can be"))
    })?;
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

/// Calls the caller's function that reads bytes of a file. Returns how many.
pub fn call_read(
    function: unsafe extern "C" fn(*mut c_void, u64, *mut c_void, usize, *mut usize) -> i32,
    user: *mut c_void,
    at: u64,
    buffer: &mut [u8],
    out_count: &mut usize,
) -> i32 {
    // SAFETY: the header's contract: a function of this type that does not unwind and may be called on any thread, given back the
    // caller's own pointer; it writes at most as many bytes as the buffer has.
    unsafe { function(user, at, buffer.as_mut_ptr().cast(), buffer.len(), out_count) }
}

/// Calls the caller's function that takes bytes of a file, or `None` at its end.
pub fn call_write(
    function: unsafe extern "C" fn(*mut c_void, *const c_char, *const c_void, usize) -> i32,
    user: *mut c_void,
    name: &CStr,
    bytes: Option<&[u8]>,
) -> i32 {
    let (place, count) = bytes.map_or((std::ptr::null(), 0), |bytes| (bytes.as_ptr().cast(), bytes.len()));
    // SAFETY: the header's contract: a function of this type that does not unwind and may be called on any thread, given back the
    // caller's own pointer; it reads no more than is named.
    unsafe { function(user, name.as_ptr(), place, count) }
}

/// Calls the caller's function that releases its own pointer.
pub fn call_release(function: unsafe extern "C" fn(*mut c_void), user: *mut c_void) {
    // SAFETY: the header's contract: a function of this type that does not unwind and may be called on any thread, given back the
    // caller's own pointer once, at the end.
    unsafe { function(user) }
}

/// Run by `make miri` alone: tests of the library are others' programs.
#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_and_written_wherever_they_lie() {
        // Odd addresses, and not a byte beyond what was named.
        let mut bytes = [0xEE_u8; 2 + 3 * 8];
        let values = [1.5_f64, -2.0, f64::INFINITY];
        let place = bytes[1..].as_mut_ptr().cast::<f64>();
        copy_out("out", place, &values).unwrap();
        assert_eq!((bytes[0], bytes[25]), (0xEE, 0xEE));
        let place = bytes[1..].as_ptr().cast::<f64>();
        assert_eq!(numbers("in", place, 3).unwrap(), values);
        assert_eq!(read("in", place).unwrap(), 1.5);
        write("out", bytes[2..].as_mut_ptr().cast::<u64>(), u64::MAX).unwrap();
        assert_eq!(bytes[2..10], [0xFF; 8]);
        assert_eq!(super::bytes("in", bytes.as_ptr(), 26).unwrap().len(), 26);
    }

    #[test]
    fn pointers_and_structs_keep_what_they_point_to() {
        let (a, b) = (7_u32, 9_u32);
        let packed: [*const u32; 2] = [&raw const a, &raw const b];
        let found = pointers("in", packed.as_ptr(), 2).unwrap();
        // SAFETY: both live here.
        assert_eq!(found.iter().map(|&p| unsafe { *p }).collect::<Vec<_>>(), [7, 9]);
        let [first, _] = read_struct(&raw const packed).unwrap();
        // SAFETY: it lives here.
        assert_eq!(unsafe { *first }, 7);
        assert!(read_struct::<[u8; 3]>(std::ptr::null()).is_none());
    }

    #[test]
    fn texts_end_at_their_zero() {
        assert_eq!(text("name", c"Ärger".as_ptr()).unwrap(), "Ärger");
        assert!(text("name", c"\xFF".as_ptr()).is_err());
    }

    #[test]
    fn nothing_is_read_where_nothing_is_named() {
        let dangling = std::ptr::without_provenance::<f64>(8);
        assert!(numbers("in", dangling, 0).unwrap().is_empty());
        copy_out::<f64>("out", std::ptr::without_provenance_mut(8), &[]).unwrap();
        assert!(bytes("in", std::ptr::null(), 1).is_err() && bytes("in", std::ptr::null(), 0).is_ok());
        assert!(numbers("in", dangling, usize::MAX).is_err() && bytes("in", dangling.cast(), usize::MAX).is_err());
        assert!(pointers("in", dangling.cast::<*const u8>(), usize::MAX).is_err());
        assert!(read::<u8>("in", std::ptr::null()).is_err() && writable::<u8>("out", std::ptr::null_mut()).is_err());
    }

    #[test]
    fn functions_of_the_caller_get_their_own_pointer_back() {
        unsafe extern "C" fn count(_: *const c_char, fraction: f64, _: *const c_char, user: *mut c_void) -> i32 {
            // SAFETY: the pointer given below.
            unsafe { *user.cast::<f64>() += fraction };
            5
        }
        let mut sum = 0.25_f64;
        let user = (&raw mut sum).cast();
        assert_eq!(call_progress(count, c"stage", 0.5, c"", user), 5);
        assert_eq!(sum, 0.75);
    }
}
