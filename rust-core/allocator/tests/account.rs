//! Calls that are allowed to callers of the allocator, with a system that has memory and with one that has none. `make miri` looks at each
//! access.
#![allow(unsafe_code, clippy::unwrap_used)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use surfrecon_allocator::{Account, close, current, held, held_by, open, peak, restart_peak, set_ceiling, switch};

/// One account for the whole process: one test at a time.
static ONE: Mutex<()> = Mutex::new(());
static HAS_MEMORY: AtomicBool = AtomicBool::new(true);

/// A system that may run out of memory.
struct Sometimes;

// SAFETY: the system's own, or null.
unsafe impl GlobalAlloc for Sometimes {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the contract.
        if HAS_MEMORY.load(Relaxed) { unsafe { System.alloc(layout) } } else { std::ptr::null_mut() }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps the contract.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, bytes: usize) -> *mut u8 {
        // SAFETY: the caller keeps the contract.
        if HAS_MEMORY.load(Relaxed) { unsafe { System.realloc(pointer, layout, bytes) } } else { std::ptr::null_mut() }
    }
}

static ACCOUNT: Account<Sometimes> = Account(Sometimes);

/// A block that is written and read to its end.
struct Block {
    pointer: *mut u8,
    layout: Layout,
    mark: u8,
}

impl Block {
    fn new(bytes: usize, align: usize, mark: u8) -> Option<Self> {
        let layout = Layout::from_size_align(bytes, align).ok()?;
        // SAFETY: no block here is empty.
        let pointer = unsafe { ACCOUNT.alloc(layout) };
        (!pointer.is_null()).then_some(())?;
        assert_eq!(pointer as usize % align, 0);
        // SAFETY: the block is ours.
        unsafe { pointer.write_bytes(mark, bytes) };
        Some(Block { pointer, layout, mark })
    }

    fn bytes(&self) -> &[u8] {
        // SAFETY: the block is ours, and written.
        unsafe { std::slice::from_raw_parts(self.pointer, self.layout.size()) }
    }

    fn is_whole(&self) -> bool {
        self.bytes().iter().all(|&byte| byte == self.mark)
    }

    /// Gives it another size. False leaves it as it is.
    fn resize(&mut self, bytes: usize) -> bool {
        let old = self.layout.size();
        // SAFETY: the block is ours, and no size here is 0 or too large.
        let pointer = unsafe { ACCOUNT.realloc(self.pointer, self.layout, bytes) };
        if pointer.is_null() {
            return false;
        }
        self.pointer = pointer;
        self.layout = Layout::from_size_align(bytes, self.layout.align()).unwrap();
        // SAFETY: what the block has more is ours.
        unsafe { pointer.add(old.min(bytes)).write_bytes(self.mark, bytes - old.min(bytes)) };
        true
    }
}

impl Drop for Block {
    fn drop(&mut self) {
        assert!(self.is_whole());
        // SAFETY: the block is ours, and nobody's from here on.
        unsafe { ACCOUNT.dealloc(self.pointer, self.layout) }
    }
}

#[test]
fn each_byte_is_counted_once() {
    let _one = ONE.lock();
    let before = held();
    restart_peak();
    let mut a = Block::new(1000, 8, 1).unwrap();
    let b = Block::new(3, 1, 2).unwrap();
    assert_eq!(held(), before + 1003);
    assert!(a.resize(5000) && a.is_whole() && a.resize(10) && a.is_whole());
    assert_eq!(held(), before + 13);
    drop((a, b));
    assert_eq!((held(), peak() >= before + 5003), (before, true));
    let layout = Layout::from_size_align(300, 16).unwrap();
    // SAFETY: not empty.
    let zeros = unsafe { ACCOUNT.alloc_zeroed(layout) };
    // SAFETY: the block is ours until it is given back.
    unsafe {
        assert!(std::slice::from_raw_parts(zeros, 300).iter().all(|&byte| byte == 0));
        ACCOUNT.dealloc(zeros, layout);
    }
    assert_eq!(held(), before);
}

#[test]
fn what_is_above_the_ceiling_is_refused_but_for_small_blocks() {
    let _one = ONE.lock();
    let before = held();
    set_ceiling(0, before as isize + 10_000);
    let mut a = Block::new(9000, 8, 1).unwrap();
    assert!(Block::new(5000, 8, 2).is_none());
    assert!(!a.resize(20_000) && a.is_whole());
    let small = Block::new(4000, 8, 3).unwrap();
    assert_eq!(held(), before + 13_000);
    drop((a, small));
    set_ceiling(0, isize::MAX);
    assert_eq!(held(), before);
}

#[test]
fn what_a_thread_takes_is_on_the_account_that_it_works_for() {
    let _one = ONE.lock();
    let (before, of_program) = (held(), held_by(0));
    open(7);
    open(9);
    assert_eq!((current(), switch(7)), (0, 0));
    let mut a = Block::new(10_000, 8, 1).unwrap();
    assert_eq!(switch(9), 7);
    let b = Block::new(20_000, 8, 2).unwrap();
    assert_eq!((held(), held_by(0), held_by(7), held_by(9)), (before + 30_000, of_program, 10_000, 20_000));
    set_ceiling(9, 25_000);
    assert!(Block::new(6000, 8, 3).is_none() && Block::new(4000, 8, 3).is_some());
    assert_eq!(switch(7), 9);
    // The ceiling of one is nobody else's.
    assert!(a.resize(60_000) && a.resize(50_000) && Block::new(6000, 8, 3).is_some());
    set_ceiling(7, 50_000);
    assert!(!a.resize(60_000) && a.is_whole());
    assert_eq!((held(), held_by(0), held_by(7), held_by(9)), (before + 70_000, of_program, 50_000, 20_000));
    drop(a);
    assert_eq!(switch(0), 7);
    // It is taken off the account that it was charged to, whoever gives it back.
    drop(b);
    assert_eq!((held(), held_by(0), held_by(7), held_by(9)), (before, of_program, 0, 0));
    close(9);
    close(7);
    assert_eq!((held(), held_by(0)), (before, of_program));
}

#[test]
fn what_grows_is_whose_who_grows_it_and_what_shrinks_stays() {
    let _one = ONE.lock();
    let of_program = held_by(0);
    [3, 4].into_iter().for_each(open);
    switch(3);
    let mut block = Block::new(10_000, 8, 1).unwrap();
    switch(4);
    assert!(block.resize(9000) && block.is_whole());
    assert_eq!((held_by(3), held_by(4)), (9000, 0));
    set_ceiling(4, 20_000);
    assert!(!block.resize(21_000) && block.is_whole());
    assert_eq!((held_by(3), held_by(4)), (9000, 0));
    assert!(block.resize(19_000) && block.is_whole());
    assert_eq!((held_by(3), held_by(4)), (0, 19_000));
    switch(0);
    // Closed with what it holds still, which is the program's from then on, also where another one has the number.
    close(4);
    assert_eq!(held_by(0), of_program + 19_000);
    open(4);
    drop(block);
    assert_eq!((held_by(0), held_by(4)), (of_program, 0));
    [3, 4].into_iter().for_each(close);
}

#[test]
fn without_memory_small_blocks_come_from_the_reserve() {
    let _one = ONE.lock();
    let before = held();
    let mut of_system = Block::new(100, 8, 9).unwrap();
    HAS_MEMORY.store(false, Relaxed);
    assert!(Block::new(5000, 8, 1).is_none());
    assert!(Block::new(100, 256, 1).is_none(), "blocks of the reserve begin at multiples of 128");
    // As `crossbeam` asks for it, on threads that end the process where there is none.
    assert!(Block::new(2304, 128, 1).is_some_and(|block| block.is_whole()));
    // From the system into the reserve, and within it.
    assert!(of_system.resize(200) && of_system.is_whole());
    let mut blocks: Vec<Block> = (0..40).map(|k| Block::new(1 + 97 * k, 64, k as u8).unwrap()).collect();
    assert!(blocks.iter().all(Block::is_whole));
    assert!(blocks[3].resize(4000) && !blocks[3].resize(5000));
    HAS_MEMORY.store(true, Relaxed);
    // From the reserve into the system.
    assert!(blocks[3].resize(5000) && blocks[3].is_whole());
    drop((blocks, of_system));
    assert_eq!(held(), before);
}

#[test]
fn the_reserve_is_shared_by_threads_and_begins_anew() {
    let _one = ONE.lock();
    let before = held();
    HAS_MEMORY.store(false, Relaxed);
    // More than it has, if it did not begin anew; Miri takes seconds for each.
    let (rounds, bytes) = if cfg!(miri) { (3, 70) } else { (300, 4096) };
    for _ in 0..rounds {
        std::thread::scope(|scope| {
            for mark in 0..4 {
                scope.spawn(move || {
                    let blocks: Vec<_> = (0..8).filter_map(|_| Block::new(bytes, 8, mark)).collect();
                    assert!(blocks.iter().all(Block::is_whole));
                });
            }
        });
    }
    if !cfg!(miri) {
        let all: Vec<_> = (0..1500).map_while(|_| Block::new(4096, 8, 7)).collect();
        assert_eq!(
            all.len(),
            992,
            "all of it: 4 MB, of which each takes 4096 bytes, its head, and what fills up to 128"
        );
    }
    HAS_MEMORY.store(true, Relaxed);
    assert_eq!(held(), before);
}
