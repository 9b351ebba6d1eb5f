//! The allocator of this module, which counts: what a host's report of memory and the tests of leaks read.
//!
//! Python and NumPy keep allocators of their own; what NumPy arrays made here hold is a vector of Rust and counts.
#![allow(unsafe_code)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use pyo3::prelude::*;

struct Counting;

static NOW: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn taken(bytes: usize) {
    let now = NOW.fetch_add(bytes, Relaxed) + bytes;
    // Mostly it isn't the most, and then nothing is written.
    if now > MOST.load(Relaxed) {
        MOST.fetch_max(now, Relaxed);
    }
}

fn given(bytes: usize) {
    NOW.fetch_sub(bytes, Relaxed);
}

// SAFETY: every call is handed on to the system's allocator unchanged; only numbers are kept beside it.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the contract of `alloc`.
        let pointer = unsafe { System.alloc(layout) };
        if !pointer.is_null() {
            taken(layout.size());
        }
        pointer
    }

    // Not the default one, which would write the zeros of pages that the system hands out as zeros.
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the contract of `alloc_zeroed`.
        let pointer = unsafe { System.alloc_zeroed(layout) };
        if !pointer.is_null() {
            taken(layout.size());
        }
        pointer
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        given(layout.size());
        // SAFETY: the caller keeps the contract of `dealloc`, and `pointer` came from the system's allocator.
        unsafe { System.dealloc(pointer, layout) }
    }

    // Not the default one, which would copy what the system can move.
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, bytes: usize) -> *mut u8 {
        // SAFETY: the caller keeps the contract of `realloc`, and `pointer` came from the system's allocator.
        let moved = unsafe { System.realloc(pointer, layout, bytes) };
        if !moved.is_null() {
            taken(bytes);
            given(layout.size());
        }
        moved
    }
}

/// Bytes that this library holds on the heap in this process: its objects and arrays, and what running calls work with.
///
/// Copies that NumPy or a host made of them don't count.
#[pyfunction]
pub fn memory_in_use() -> usize {
    NOW.load(Relaxed)
}

/// The most bytes that this library held at a time since the last call with ``restart``, or since it was loaded.
///
/// Args:
///     restart: count anew from what is held now.
#[pyfunction]
#[pyo3(signature = (*, restart = false))]
pub fn memory_peak(restart: bool) -> usize {
    let most = MOST.load(Relaxed);
    if restart {
        MOST.store(NOW.load(Relaxed), Relaxed);
    }
    most
}
