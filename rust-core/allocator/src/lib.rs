//! The allocator of a library that lives inside somebody's program.
//!
//! [`Account`] counts what is held, by all and by each who has an account of their own, keeps that below a ceiling, and has a
//! reserve for the small allocations that winding up takes: an error's text, a job's node. A larger one that the system or the
//! ceiling refuses unwinds with [`Refused`], which the border to the host turns into an error ([`install`]). Without it Rust ends
//! the program, and with it the host and its user's unsaved work.
//!
//! Rust's stable library can't say what follows a refused allocation. This crate uses `alloc_error_hook`, whose documented use
//! this is; where the compiler does not grant it ([`unwinds`]), a refused allocation ends the program as everywhere in Rust.

#![cfg_attr(alloc_error_hook, feature(alloc_error_hook))]
#![allow(unsafe_code)]

mod accounts;
mod reserve;

use std::alloc::{GlobalAlloc, Layout, System};

pub use accounts::{ACCOUNTS, close, current, held, held_by, open, peak, restart_peak, set_ceiling, switch};
use accounts::{charge, discharge};
use reserve::{RESERVE, SMALL};

/// What unwinds from an allocation that was refused: look for it in the payload of a caught panic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Refused {
    /// What was asked for.
    pub bytes: usize,
}

/// From now on a refused allocation unwinds with [`Refused`] instead of ending the program, where that [can be had](unwinds).
/// No panic hook is called: nothing is printed.
pub fn install() {
    #[cfg(alloc_error_hook)]
    std::alloc::set_alloc_error_hook(|layout| {
        std::panic::resume_unwind(Box::new(Refused { bytes: layout.size() }));
    });
}

/// Whether refused allocations can unwind in this build.
pub const fn unwinds() -> bool {
    cfg!(alloc_error_hook)
}

/// An allocator with accounts: make it the `#[global_allocator]`. All of a program are on one account, but for those who [`switch`]
/// to another.
pub struct Account<A = System>(pub A);

impl<A: GlobalAlloc> Account<A> {
    #[inline]
    fn obtain(layout: Layout, from: impl FnOnce() -> *mut u8) -> *mut u8 {
        if !charge(layout.size()) {
            return std::ptr::null_mut();
        }
        let pointer = from();
        if !pointer.is_null() {
            return pointer;
        }
        let pointer = RESERVE.take(layout);
        if pointer.is_null() {
            discharge(layout.size());
        }
        pointer
    }
}

// SAFETY: blocks come from `A` or from the reserve, each of which keeps the contract, and go back where they came from, which
// their addresses tell; beside them only numbers are kept. Nothing here panics or allocates.
unsafe impl<A: GlobalAlloc> GlobalAlloc for Account<A> {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the contract of `alloc`.
        Self::obtain(layout, || unsafe { self.0.alloc(layout) })
    }

    // Not the default one, which would write the zeros of pages that the system hands out as zeros.
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the contract of `alloc_zeroed`; the reserve's blocks are zero.
        Self::obtain(layout, || unsafe { self.0.alloc_zeroed(layout) })
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        discharge(layout.size());
        if !RESERVE.give_back(pointer) {
            // SAFETY: the caller keeps the contract of `dealloc`; what isn't the reserve's came from `A`.
            unsafe { self.0.dealloc(pointer, layout) }
        }
    }

    // Not the default one, which would copy what the system can move.
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, bytes: usize) -> *mut u8 {
        if !RESERVE.has(pointer) {
            let more = bytes.saturating_sub(layout.size());
            if more > 0 && !charge(more) {
                return std::ptr::null_mut();
            }
            // SAFETY: the caller keeps the contract of `realloc`; the block came from `A`.
            let moved = unsafe { self.0.realloc(pointer, layout, bytes) };
            if !moved.is_null() {
                if bytes < layout.size() {
                    discharge(layout.size() - bytes);
                }
                return moved;
            }
            if more > 0 {
                discharge(more);
            }
            if bytes > SMALL {
                return moved;
            }
        }
        // SAFETY: a size that the caller may ask `realloc` for makes a layout with the old alignment.
        let wanted = unsafe { Layout::from_size_align_unchecked(bytes, layout.align()) };
        // SAFETY: `wanted` isn't empty by the contract of `realloc`.
        let moved = unsafe { self.alloc(wanted) };
        if !moved.is_null() {
            // SAFETY: both blocks are at least so long and different; the old one is the caller's to give back.
            unsafe {
                std::ptr::copy_nonoverlapping(pointer, moved, layout.size().min(bytes));
                self.dealloc(pointer, layout);
            }
        }
        moved
    }
}
