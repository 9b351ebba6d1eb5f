//! Forks of the host's program, which the core has to be told of.

pub use surfrecon::fork::prevent;

/// From the first time on, forks wait until nobody is at a table of the library.
#[cfg(unix)]
pub fn watch() {
    use std::sync::atomic::{AtomicBool, Ordering};

    type Handler = Option<extern "C" fn()>;
    // SAFETY: the function of POSIX. It takes what it is given by value and runs it around each fork, until the library is
    // unloaded.
    unsafe extern "C" {
        safe fn pthread_atfork(prepare: Handler, parent: Handler, child: Handler) -> std::ffi::c_int;
    }
    static WATCHED: AtomicBool = AtomicBool::new(false);
    if !WATCHED.load(Ordering::Relaxed) {
        // Two threads may both come here first: both handlers are fine twice. It fails for want of memory, and then forks are as they would
        // be without it.
        let _ = pthread_atfork(Some(close), Some(open), Some(open));
        WATCHED.store(true, Ordering::Relaxed);
    }
}

#[cfg(not(unix))]
pub fn watch() {}

#[cfg(unix)]
extern "C" fn close() {
    surfrecon::fork::close();
}

#[cfg(unix)]
extern "C" fn open() {
    surfrecon::fork::open();
}
