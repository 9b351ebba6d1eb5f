//! Types that cross the border of the C library, as the header says them.

use std::ffi::{c_char, c_void};

pub use crate::generated::*;

/// A handle: never followed.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Handle(pub *mut c_void);

// SAFETY: a handle is a number that any thread may use.
unsafe impl Send for Handle {}
// SAFETY: as above.
unsafe impl Sync for Handle {}

impl Handle {
    pub const NULL: Handle = Handle(std::ptr::null_mut());
}

#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Array {
    pub data: *const c_void,
    pub count: usize,
    pub stride: usize,
    pub kind: u32,
    pub components: u32,
}

pub const F32: u32 = 1;
pub const F64: u32 = 2;
pub const I32: u32 = 3;
pub const U32: u32 = 4;
pub const U8: u32 = 5;
pub const U16: u32 = 6;

impl Array {
    pub const EMPTY: Array = Array { data: std::ptr::null(), count: 0, stride: 0, kind: 0, components: 0 };

    /// An array of `components` numbers an element.
    pub fn of<T>(values: &[T], kind: u32, components: u32) -> Self {
        let size = [4, 8, 4, 4, 1, 2][kind as usize - 1] * components as usize;
        Array { data: values.as_ptr().cast(), count: size_of_val(values) / size, stride: 0, kind, components }
    }

    /// The bytes of a view without gaps.
    pub fn bytes(&self) -> Vec<u8> {
        if self.count == 0 {
            return Vec::new();
        }
        // SAFETY: the library says so.
        unsafe { std::slice::from_raw_parts(self.data.cast::<u8>(), self.count * self.stride) }.to_vec()
    }
}

#[repr(C)]
pub struct Watch {
    pub report: Option<unsafe extern "C" fn(*const c_char, f64, *const c_char, *mut c_void) -> i32>,
    pub user: *mut c_void,
    pub cancel: Handle,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct ImageSource {
    pub make: Option<unsafe extern "C" fn(*mut c_void, *mut Handle) -> i32>,
    pub user: *mut c_void,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct FileSource {
    pub length: u64,
    pub read: Option<unsafe extern "C" fn(*mut c_void, u64, *mut c_void, usize, *mut usize) -> i32>,
    pub release: Option<unsafe extern "C" fn(*mut c_void)>,
    pub user: *mut c_void,
}

#[repr(C)]
#[derive(Clone, Copy)]
pub struct FileSink {
    pub write: Option<unsafe extern "C" fn(*mut c_void, *const c_char, *const c_void, usize) -> i32>,
    pub release: Option<unsafe extern "C" fn(*mut c_void)>,
    pub user: *mut c_void,
}

#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projection {
    pub kind: u32,
    pub reserved: u32,
    pub numbers: [f64; 4],
}

/// A struct of the header that starts with its size, by the numbers after its first eight bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sized<const N: usize> {
    pub size: u32,
    pub second: u32,
    pub numbers: [u64; N],
}

impl<const N: usize> Sized<N> {
    pub const ZERO: Self = Sized { size: 0, second: 0, numbers: [0; N] };

    pub fn f64(&self, index: usize) -> f64 {
        f64::from_bits(self.numbers[index])
    }

    pub fn set_f64(&mut self, index: usize, value: f64) {
        self.numbers[index] = value.to_bits();
    }
}

pub type Plane = Sized<9>;
pub type Pick = Sized<14>;
pub type Frame = Sized<37>;
pub type GridCamera = Sized<1287>;
pub type LogFn = Option<unsafe extern "C" fn(i32, *const c_char, *mut c_void)>;
