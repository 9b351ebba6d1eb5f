//! Forks of the host's program. The child has none of the threads of its parent but the one that forked; a lock that another
//! held would stay locked for ever. So a fork waits until nobody is at the library's tables, which takes no longer than
//! copying what a handle stands for.

use std::cell::RefCell;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

static GATE: RwLock<()> = RwLock::new(());

thread_local! {
    /// The gate, closed by this thread while it forks.
    static CLOSED: RefCell<Option<RwLockWriteGuard<'static, ()>>> = const { RefCell::new(None) };
}

/// No thread forks until the answer is dropped. For short work without calls of the caller's functions, and once a thread.
pub fn prevent() -> RwLockReadGuard<'static, ()> {
    static WATCHED: AtomicBool = AtomicBool::new(false);
    if !WATCHED.load(Ordering::Relaxed) {
        // Two threads may both come here first: `close` and `open` are fine twice.
        watch();
        WATCHED.store(true, Ordering::Relaxed);
    }
    GATE.read().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(unix)]
fn watch() {
    type Handler = Option<extern "C" fn()>;
    // SAFETY: the function of POSIX. It takes what it is given by value and runs it around each fork, until the library is
    // unloaded.
    unsafe extern "C" {
        safe fn pthread_atfork(prepare: Handler, parent: Handler, child: Handler) -> std::ffi::c_int;
    }
    // It fails for want of memory, and then forks are as they would be without it.
    let _ = pthread_atfork(Some(close), Some(open), Some(open));
}

#[cfg(not(unix))]
fn watch() {}

#[cfg_attr(not(unix), expect(dead_code, reason = "nothing forks there"))]
extern "C" fn close() {
    CLOSED.with_borrow_mut(|closed| {
        if closed.is_none() {
            *closed = Some(GATE.write().unwrap_or_else(PoisonError::into_inner));
        }
    });
}

#[cfg_attr(not(unix), expect(dead_code, reason = "nothing forks there"))]
extern "C" fn open() {
    CLOSED.take();
}
