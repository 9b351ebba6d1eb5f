//! Arguments of functions in calls that are wrong everywhere.

use std::ffi::c_void;

use crate::library::{Handle, LogFn};

/// The argument of a function in a call that is wrong everywhere: zeros, or handles that never were.
pub trait Argument {
    const IS_HANDLE: bool = false;
    fn zero() -> Self;
    fn junk(scratch: *mut c_void) -> Self;
}

impl Argument for Handle {
    const IS_HANDLE: bool = true;
    fn zero() -> Self {
        Handle::NULL
    }
    fn junk(_: *mut c_void) -> Self {
        Handle(std::ptr::without_provenance_mut(0x1234))
    }
}

impl<T> Argument for *mut T {
    fn zero() -> Self {
        std::ptr::null_mut()
    }
    fn junk(scratch: *mut c_void) -> Self {
        scratch.cast()
    }
}

impl<T> Argument for *const T {
    fn zero() -> Self {
        std::ptr::null()
    }
    fn junk(_: *mut c_void) -> Self {
        std::ptr::null()
    }
}

impl Argument for LogFn {
    fn zero() -> Self {
        None
    }
    fn junk(_: *mut c_void) -> Self {
        None
    }
}

macro_rules! numbers {
    ($($t:ty),*) => {$(
        impl Argument for $t {
            fn zero() -> Self {
                0 as $t
            }
            fn junk(_: *mut c_void) -> Self {
                1 as $t
            }
        }
    )*};
}
numbers!(u64, u32, i32, usize, f64);
