//! Memory from the system, or from functions of the program's.

use std::alloc::{GlobalAlloc, Layout, System};
use std::ffi::{CStr, c_void};
use std::sync::OnceLock;

use crate::pointer;
use crate::status::{remember_fixed, srf_status, srf_status::*};

/// Gives size bytes, at least 1, that begin at a multiple of alignment, a power of two. NULL where there are none.
#[allow(non_camel_case_types)]
pub type srf_allocate_fn =
    Option<unsafe extern "C" fn(user: *mut c_void, size: usize, alignment: usize) -> *mut c_void>;

/// Makes a block of old_size bytes one of new_size, which may lie elsewhere and begins with what the old one held, as far as that fits.
/// NULL where that can't be: the block then stays as it was.
#[allow(non_camel_case_types)]
pub type srf_reallocate_fn = Option<
    unsafe extern "C" fn(
        user: *mut c_void,
        block: *mut c_void,
        old_size: usize,
        new_size: usize,
        alignment: usize,
    ) -> *mut c_void,
>;

/// Takes a block back, with the size and the alignment that it was asked for with.
#[allow(non_camel_case_types)]
pub type srf_deallocate_fn =
    Option<unsafe extern "C" fn(user: *mut c_void, block: *mut c_void, size: usize, alignment: usize)>;

/// Source of the library's memory. Its functions are called on any thread, on several at once, at any time until the process has ended, and
/// within any call of this library. So they must not call it, nor unwind.
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct srf_allocator {
    /// Not NULL.
    pub allocate: srf_allocate_fn,
    /// NULL for a new block and a copy.
    pub reallocate: srf_reallocate_fn,
    /// Not NULL.
    pub deallocate: srf_deallocate_fn,
    /// Handed to them as it is.
    pub user: *mut c_void,
}

struct Functions {
    allocate: unsafe extern "C" fn(*mut c_void, usize, usize) -> *mut c_void,
    reallocate: Option<unsafe extern "C" fn(*mut c_void, *mut c_void, usize, usize, usize) -> *mut c_void>,
    deallocate: unsafe extern "C" fn(*mut c_void, *mut c_void, usize, usize),
    /// The caller's pointer as a number: it goes back to where it came from, on whatever thread.
    user: usize,
}

impl Functions {
    fn user(&self) -> *mut c_void {
        std::ptr::with_exposed_provenance_mut(self.user)
    }
}

/// Set before the first block, or never: so each block goes back where it came from.
static FUNCTIONS: OnceLock<Functions> = OnceLock::new();

/// Base of the library's accounts.
pub struct Memory;

// SAFETY: blocks come from the system, which keeps the contract, or from functions of the caller that keep it by the header's words, never
// from both. Nothing here panics or allocates.
unsafe impl GlobalAlloc for Memory {
    #[inline]
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        match FUNCTIONS.get() {
            // SAFETY: the caller keeps the contract.
            None => unsafe { System.alloc(layout) },
            // SAFETY: a function of that type that does not unwind, given its own pointer.
            Some(all) => unsafe { (all.allocate)(all.user(), layout.size(), layout.align()).cast() },
        }
    }

    #[inline]
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        if FUNCTIONS.get().is_none() {
            // SAFETY: the caller keeps the contract.
            return unsafe { System.alloc_zeroed(layout) };
        }
        // SAFETY: the caller keeps the contract.
        let block = unsafe { self.alloc(layout) };
        if !block.is_null() {
            // SAFETY: as many bytes were given.
            unsafe { block.write_bytes(0, layout.size()) };
        }
        block
    }

    #[inline]
    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        match FUNCTIONS.get() {
            // SAFETY: the caller keeps the contract.
            None => unsafe { System.dealloc(block, layout) },
            // SAFETY: a function of that type that does not unwind, given its own pointer and a block of its own.
            Some(all) => unsafe { (all.deallocate)(all.user(), block.cast(), layout.size(), layout.align()) },
        }
    }

    #[inline]
    unsafe fn realloc(&self, block: *mut u8, layout: Layout, bytes: usize) -> *mut u8 {
        let Some(all) = FUNCTIONS.get() else {
            // SAFETY: the caller keeps the contract.
            return unsafe { System.realloc(block, layout, bytes) };
        };
        if let Some(reallocate) = all.reallocate {
            // SAFETY: a function of that type that does not unwind, given its own pointer and a block of its own.
            return unsafe { reallocate(all.user(), block.cast(), layout.size(), bytes, layout.align()).cast() };
        }
        // SAFETY: a function of that type that does not unwind, given its own pointer.
        let moved: *mut u8 = unsafe { (all.allocate)(all.user(), bytes, layout.align()).cast() };
        if !moved.is_null() {
            // SAFETY: both blocks are at least so long and different; the old one is the caller's to give back.
            unsafe {
                moved.copy_from_nonoverlapping(block, layout.size().min(bytes));
                self.dealloc(block, layout);
            }
        }
        moved
    }
}

/// Takes the library's memory from functions of the program's, for the whole process and once. Call it before any other function of this
/// library, but for those that tell its version or the last error, and while no other thread is in one. If it is refused it may be called
/// again. The memory is counted and limited as the system's is. Memory that they refuse is SRF_ERR_OUT_OF_MEMORY. Not taken from them:
/// stacks of worker threads, what the system's own functions take, and a few small blocks in want of memory.
/// allocator  not NULL
/// returns    SRF_OK, SRF_ERR_INPUT if the library holds memory already, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_set_allocator(allocator: *const srf_allocator) -> srf_status {
    // No [`guard`](crate::guard::guard), whose failures take memory: who is refused may ask again.
    match set(allocator) {
        Ok(()) => SRF_OK,
        Err((status, text)) => {
            remember_fixed(text);
            status
        }
    }
}

fn set(allocator: *const srf_allocator) -> Result<(), (srf_status, &'static CStr)> {
    let Some(given) = pointer::read_struct(allocator) else {
        return Err((SRF_ERR_NULL, c"allocator must not be NULL"));
    };
    let (Some(allocate), Some(deallocate)) = (given.allocate, given.deallocate) else {
        return Err((SRF_ERR_NULL, c"allocator.allocate and allocator.deallocate must not be NULL"));
    };
    let late = c"the library holds memory already: call srf_set_allocator() before any other function, once";
    if surfrecon::memory::held() != 0 {
        return Err((SRF_ERR_INPUT, late));
    }
    let user = given.user.expose_provenance();
    let functions = Functions { allocate, reallocate: given.reallocate, deallocate, user };
    FUNCTIONS.set(functions).map_err(|_| (SRF_ERR_INPUT, late))
}
