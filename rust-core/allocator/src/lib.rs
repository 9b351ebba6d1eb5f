//! The allocator of a library that lives inside somebody's program.
//!
//! [`Account`] counts what is held, by all and by each who has an account of their own. It keeps that below a ceiling. It has a reserve for
//! the small allocations that winding up takes: an error's text, a job's node. A larger one that the system or the ceiling refuses unwinds
//! with [`Refused`], which the border to the host turns into an error ([`install`]). Without it Rust ends the program, and with it the host
//! and its user's unsaved work.
//!
//! Rust's stable library can't say what follows a refused allocation. This crate uses `alloc_error_hook`, whose documented use this is. If
//! the compiler does not grant it ([`unwinds`]), a refused allocation ends the program as everywhere in Rust.

#![cfg_attr(alloc_error_hook, feature(alloc_error_hook))]
#![allow(unsafe_code)]

mod accounts;
mod reserve;

use std::alloc::{GlobalAlloc, Layout, System};

use accounts::Payer;
pub use accounts::{ACCOUNTS, close, current, held, held_by, open, peak, restart_peak, set_ceiling, switch};
use reserve::{RESERVE, SMALL};

/// Payload of the panic that unwinds from a refused allocation. Look for it in the payload of a caught panic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Refused {
    /// The bytes that were asked for.
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

/// A block with what lies in front of it: at its end, who paid.
struct Whole {
    layout: Layout,
    /// Bytes in front of the block, as many as keep its alignment.
    head: usize,
}

impl Whole {
    /// `None` for more than there can be.
    #[inline]
    fn of(block: Layout) -> Option<Self> {
        let head = block.align().max(16);
        let layout = Layout::from_size_align(block.size().checked_add(head)?, head).ok()?;
        Some(Whole { layout, head })
    }

    /// The layout of a block that is there.
    #[inline]
    fn made(block: Layout) -> Self {
        let head = block.align().max(16);
        // SAFETY: as `of`, which found it to be a layout when the block was made.
        let layout = unsafe { Layout::from_size_align_unchecked(block.size() + head, head) };
        Whole { layout, head }
    }

    /// Writes who paid. Returns the block.
    ///
    /// # Safety
    /// So many bytes as the layout has lie there, and are the caller's.
    #[inline]
    unsafe fn paid(&self, start: *mut u8, payer: Payer) -> *mut u8 {
        // SAFETY: the head is as long as its alignment, 16 or more, and a payer has 8 bytes and an alignment of 4.
        unsafe {
            let block = start.add(self.head);
            block.cast::<Payer>().sub(1).write(payer);
            block
        }
    }
}

/// The payer of a block.
///
/// # Safety
/// It is one of [`Account`].
#[inline]
unsafe fn payer_of(block: *mut u8) -> Payer {
    // SAFETY: written there when it was made.
    unsafe { block.cast::<Payer>().sub(1).read() }
}

impl<A: GlobalAlloc> Account<A> {
    #[inline]
    fn obtain(layout: Layout, from: impl FnOnce(Layout) -> *mut u8) -> *mut u8 {
        let payer = Payer::here();
        let Some(whole) = Whole::of(layout) else { return std::ptr::null_mut() };
        if !payer.charge(layout.size()) {
            return std::ptr::null_mut();
        }
        let mut start = from(whole.layout);
        if start.is_null() {
            start = RESERVE.take(whole.layout);
        }
        if start.is_null() {
            payer.discharge(layout.size());
            return start;
        }
        // SAFETY: it was just made.
        unsafe { whole.paid(start, payer) }
    }
}

// SAFETY: blocks come from `A` or from the reserve, each of which keeps the contract, and go back where they came from, which
// their addresses tell; beside them only numbers are kept, and in front of each, who paid for it. Nothing here panics or allocates.
unsafe impl<A: GlobalAlloc> GlobalAlloc for Account<A> {
    #[inline]
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the contract of `alloc`, and no layout here is empty.
        Self::obtain(layout, |whole| unsafe { self.0.alloc(whole) })
    }

    // Not the default one, which would write the zeros of pages that the system hands out as zeros.
    #[inline]
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the contract of `alloc_zeroed`; the reserve's blocks are zero.
        Self::obtain(layout, |whole| unsafe { self.0.alloc_zeroed(whole) })
    }

    #[inline]
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        let whole = Whole::made(layout);
        // SAFETY: a block of this allocator, with its head in front.
        unsafe {
            payer_of(pointer).discharge(layout.size());
            let start = pointer.sub(whole.head);
            if !RESERVE.give_back(start) {
                self.0.dealloc(start, whole.layout);
            }
        }
    }

    // Not the default one, which would copy what the system can move. What grows is charged to whom the thread works for.
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, bytes: usize) -> *mut u8 {
        let (size, old) = (layout.size(), Whole::made(layout));
        // SAFETY: a block of this allocator, with its head in front.
        let (former, start) = unsafe { (payer_of(pointer), pointer.sub(old.head)) };
        // SAFETY: a size that the caller may ask `realloc` for makes a layout with the old alignment.
        let wanted = unsafe { Layout::from_size_align_unchecked(bytes, layout.align()) };
        if !RESERVE.has(start) {
            let payer = if bytes > size { Payer::here() } else { former };
            let more = if payer == former { bytes.saturating_sub(size) } else { bytes };
            let Some(whole) = Whole::of(wanted) else { return std::ptr::null_mut() };
            if more > 0 && !payer.charge(more) {
                return std::ptr::null_mut();
            }
            // SAFETY: the caller keeps the contract of `realloc`; the block came from `A`.
            let moved = unsafe { self.0.realloc(start, old.layout, whole.layout.size()) };
            if !moved.is_null() {
                former.discharge(if payer == former { size.saturating_sub(bytes) } else { size });
                // SAFETY: it was just made.
                return unsafe { whole.paid(moved, payer) };
            }
            if more > 0 {
                payer.discharge(more);
            }
            if bytes > SMALL {
                return moved;
            }
        }
        // SAFETY: `wanted` isn't empty by the contract of `realloc`.
        let moved = unsafe { self.alloc(wanted) };
        if !moved.is_null() {
            // SAFETY: both blocks are at least so long and different; the old one is the caller's to give back.
            unsafe {
                std::ptr::copy_nonoverlapping(pointer, moved, size.min(bytes));
                self.dealloc(pointer, layout);
            }
        }
        moved
    }
}
