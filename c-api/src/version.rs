//! Version of this library.

use std::ffi::c_char;

/// Number of the binary interface this header describes. It grows when a program built against an older header would no longer work.
/// Compare it with srf_abi_version().
pub const SRF_ABI_VERSION: u32 = 2;

/// Version of the library this header belongs to: major number.
pub const SRF_VERSION_MAJOR: u32 = 0;
/// Minor number. Before 1.0 it grows with every change that breaks programs.
pub const SRF_VERSION_MINOR: u32 = 2;
/// Patch number.
pub const SRF_VERSION_PATCH: u32 = 0;

/// The three as one number that compares: 1000000 * major + 1000 * minor + patch.
pub const SRF_VERSION: u32 = 2000;

/// A whole number in words of digits.
const fn number(digits: &str) -> u32 {
    let (bytes, mut value, mut i) = (digits.as_bytes(), 0, 0);
    while i < bytes.len() {
        value = 10 * value + (bytes[i] - b'0') as u32;
        i += 1;
    }
    value
}

const _: () = {
    assert!(SRF_VERSION_MAJOR == number(env!("CARGO_PKG_VERSION_MAJOR")));
    assert!(SRF_VERSION_MINOR == number(env!("CARGO_PKG_VERSION_MINOR")));
    assert!(SRF_VERSION_PATCH == number(env!("CARGO_PKG_VERSION_PATCH")));
    assert!(SRF_VERSION == 1_000_000 * SRF_VERSION_MAJOR + 1000 * SRF_VERSION_MINOR + SRF_VERSION_PATCH);
};

const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "\0");

/// Version of the loaded library, for example "0.2.0". Static text, never NULL. Since 0.1.
#[unsafe(no_mangle)]
pub extern "C" fn srf_version() -> *const c_char {
    VERSION.as_ptr().cast()
}

/// Version of the loaded library as a number that compares, for example with SRF_VERSION of the header. Since 0.2.
#[unsafe(no_mangle)]
pub extern "C" fn srf_version_number() -> u32 {
    SRF_VERSION
}

/// Number of the binary interface of the loaded library. It must equal SRF_ABI_VERSION of the header the program was built with. Since 0.1.
#[unsafe(no_mangle)]
pub extern "C" fn srf_abi_version() -> u32 {
    SRF_ABI_VERSION
}
