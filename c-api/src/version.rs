//! Which library this is.

use std::ffi::c_char;

/// Number of the binary interface this header describes. It grows when a program built against an older header would no
/// longer work; compare it with srf_abi_version().
pub const SRF_ABI_VERSION: u32 = 1;

const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "\0");

/// Version of the loaded library, for example "0.1.0". Static text, never NULL. Since 0.1.
#[unsafe(no_mangle)]
pub extern "C" fn srf_version() -> *const c_char {
    VERSION.as_ptr().cast()
}

/// Number of the binary interface of the loaded library; it must equal SRF_ABI_VERSION of the header the program was
/// built with. Since 0.1.
#[unsafe(no_mangle)]
pub extern "C" fn srf_abi_version() -> u32 {
    SRF_ABI_VERSION
}
