//! A few megabytes that nobody touches until the system has no more: then small allocations come from here.

use std::alloc::Layout;
use std::cell::UnsafeCell;
use std::sync::atomic::{AtomicU64, Ordering};

/// Largest allocation that the reserve serves, and that may pass the ceiling.
pub const SMALL: usize = 4 << 10;
/// Pages that are never written take address space and no memory.
const BYTES: usize = 4 << 20;
/// Blocks begin at multiples of this: `crossbeam`, which worker threads stand on, asks for 128, and ends the process without.
const ALIGN: usize = 128;

#[repr(C, align(4096))]
pub struct Reserve {
    bytes: UnsafeCell<[u8; BYTES]>,
    /// Blocks that are out, and where the next one begins: high and low half. With none out it begins anew.
    state: AtomicU64,
}

// SAFETY: `state` gives each byte to one caller at a time.
unsafe impl Sync for Reserve {}

pub static RESERVE: Reserve = Reserve { bytes: UnsafeCell::new([0; BYTES]), state: AtomicU64::new(0) };

impl Reserve {
    /// A block of zeros, or null.
    #[cold]
    pub fn take(&self, layout: Layout) -> *mut u8 {
        // With what lies in front of a block.
        if layout.size() > SMALL + ALIGN || layout.align() > ALIGN {
            return std::ptr::null_mut();
        }
        let step = layout.size().next_multiple_of(ALIGN) as u64;
        let taken = self.state.fetch_update(Ordering::Acquire, Ordering::Relaxed, |state| {
            let end = (state & 0xFFFF_FFFF) + step;
            (end <= BYTES as u64).then_some(((state >> 32) + 1) << 32 | end)
        });
        let Ok(before) = taken else { return std::ptr::null_mut() };
        let place = self.bytes.get().cast::<u8>().wrapping_add((before & 0xFFFF_FFFF) as usize);
        // SAFETY: the block lies within the bytes, and no other caller has it.
        unsafe { place.write_bytes(0, layout.size()) };
        place
    }

    /// Whether a block is one of these.
    #[inline]
    pub fn has(&self, pointer: *const u8) -> bool {
        (pointer as usize).wrapping_sub(self.bytes.get() as usize) < BYTES
    }

    /// Takes a block back that is one of these. Returns false if it is none.
    #[inline]
    pub fn give_back(&self, pointer: *const u8) -> bool {
        if !self.has(pointer) {
            return false;
        }
        let _ = self.state.fetch_update(Ordering::Release, Ordering::Relaxed, |state| {
            let out = (state >> 32) - 1;
            Some(if out == 0 { 0 } else { out << 32 | state & 0xFFFF_FFFF })
        });
        true
    }
}
