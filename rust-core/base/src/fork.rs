//! Forks of a host's program. The child has none of the threads of its parent but the one that forked. A lock that another held would stay
//! locked for ever. So locks that are held for a moment, of tables and lists, are held behind [`prevent`], and a fork waits until nobody is
//! there. Whoever knows of forks calls [`close`] before and [`open`] after each, on the thread that forks.

use std::cell::{Cell, RefCell};
use std::sync::{PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

static GATE: RwLock<()> = RwLock::new(());

thread_local! {
    /// The gate, closed by this thread while it forks.
    static CLOSED: RefCell<Option<RwLockWriteGuard<'static, ()>>> = const { RefCell::new(None) };
    /// Number of times that this thread keeps it open.
    static INSIDE: Cell<usize> = const { Cell::new(0) };
}

/// Somebody whom forks wait for.
pub struct Prevented {
    // A thread keeps it open once, and needs nothing while it forks itself.
    _gate: Option<RwLockReadGuard<'static, ()>>,
}

/// No thread forks until the answer is dropped. For short work without calls of the host's functions, also where it drops what was the
/// host's.
pub fn prevent() -> Prevented {
    let first = INSIDE.replace(INSIDE.get() + 1) == 0;
    let forks = CLOSED.try_with(|closed| closed.borrow().is_some()).unwrap_or(false);
    Prevented { _gate: (first && !forks).then(|| GATE.read().unwrap_or_else(PoisonError::into_inner)) }
}

impl Drop for Prevented {
    fn drop(&mut self) {
        INSIDE.set(INSIDE.get() - 1);
    }
}

/// This thread is going to fork. It waits for no longer than it takes to copy what a handle stands for. Twice is as good as once.
pub fn close() {
    let _ = CLOSED.try_with(|closed| {
        let mut closed = closed.borrow_mut();
        // A handler of a signal that forks in the midst of such work would wait for itself.
        if closed.is_none() && INSIDE.get() == 0 {
            *closed = Some(GATE.write().unwrap_or_else(PoisonError::into_inner));
        }
    });
}

/// This thread has forked: called in the parent and in the child.
pub fn open() {
    let _ = CLOSED.try_with(RefCell::take);
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_fork_waits_for_others_and_never_for_itself() {
        static CLOSED_BY_OTHER: AtomicBool = AtomicBool::new(false);
        let (outer, inner) = (prevent(), prevent());
        // As from a handler of a signal.
        close();
        open();
        drop(outer);
        let other = std::thread::spawn(|| {
            close();
            close();
            CLOSED_BY_OTHER.store(true, Ordering::SeqCst);
            // Handlers of others for the same fork may call the library.
            drop(prevent());
            open();
        });
        std::thread::sleep(Duration::from_millis(30));
        assert!(CLOSED_BY_OTHER.load(Ordering::SeqCst), "the inner one keeps nothing open");
        drop(inner);
        other.join().unwrap();
    }
}
