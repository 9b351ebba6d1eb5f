//! Structs that start with their size and grow only at the end, so that programs built against another version of the
//! header still work.

use bytemuck::Pod;

use crate::pointer;
use crate::status::{Failure, srf_status::*};

/// Larger structs are taken for memory that was never initialized.
const LARGEST: usize = 1 << 16;

/// Whether a struct can have that size.
fn can_be(size: usize) -> bool {
    (8..=LARGEST).contains(&size) && size.is_multiple_of(8)
}

/// The size that the caller's struct says it has.
fn size_of_given<T>(name: &str, given: *const T) -> Result<usize, Failure> {
    let size = pointer::read::<u32>(&format!("{name}.struct_size"), given.cast())? as usize;
    if !can_be(size) {
        let text = format!("{name}.struct_size is {size}: fill the struct with its _init function first");
        return Err(Failure::new(SRF_ERR_STRUCT_SIZE, text));
    }
    Ok(size)
}

/// The caller's struct over `defaults`, which NULL stands for. Fields an older header lacks keep their defaults. Fields of a newer one are
/// fine as long as they are zero.
pub fn read<T: Pod>(name: &str, given: *const T, defaults: T) -> Result<T, Failure> {
    if given.is_null() {
        return Ok(defaults);
    }
    let size = size_of_given(name, given)?;
    let bytes = pointer::bytes(name, given.cast(), size)?;
    let known = size.min(size_of::<T>());
    if let Some(i) = bytes[known..].iter().position(|&byte| byte != 0) {
        let text = format!(
            "{name} is from a newer header: the byte at offset {} is set, this library knows {known} bytes. Use a newer library.",
            known + i
        );
        return Err(Failure::new(SRF_ERR_STRUCT_SIZE, text));
    }
    let mut value = defaults;
    bytemuck::bytes_of_mut(&mut value)[..known].copy_from_slice(&bytes[..known]);
    Ok(value)
}

/// Checks, before any work, that a result struct can be written.
pub fn writable<T>(name: &str, out: *const T) -> Result<(), Failure> {
    size_of_given(name, out).map(|_| ())
}

/// Writes as much of a result as the caller's struct has room for, zeros beyond what this library knows. Its size stays.
pub fn write<T: Pod>(name: &str, out: *mut T, value: T) -> Result<(), Failure> {
    put(name, out, size_of_given(name, out.cast_const())?, value)
}

/// Writes a struct of the caller, of so many bytes, that is to be initialized.
pub fn init<T: Pod>(name: &str, out: *mut T, size: usize, value: T) -> Result<(), Failure> {
    pointer::writable(name, out)?;
    if !can_be(size) {
        let text = format!("size is {size}: call the macro without _sized, which knows the size of {name}");
        return Err(Failure::new(SRF_ERR_STRUCT_SIZE, text));
    }
    put(name, out, size, value)
}

/// Writes the first `size` bytes of a struct that starts with them, and zeros beyond what it has.
fn put<T: Pod>(name: &str, out: *mut T, size: usize, value: T) -> Result<(), Failure> {
    let mut bytes = bytemuck::bytes_of(&value).to_vec();
    bytes.resize(size, 0);
    bytes[..4].copy_from_slice(&(size as u32).to_ne_bytes());
    pointer::copy_out(name, out.cast::<u8>(), &bytes)
}
