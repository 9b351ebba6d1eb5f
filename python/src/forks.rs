//! Forks of the interpreter's process, which the core has to be told of. Not by `os.register_at_fork`: between its functions and the fork
//! other threads of Python's run, and would wait, with the interpreter's lock, for the fork that waits for that.
#![allow(unsafe_code)]

/// From now on forks wait until nobody is at a table of the library.
#[cfg(unix)]
pub fn watch() {
    type Handler = Option<extern "C" fn()>;
    // SAFETY: the function of POSIX. It takes what it is given by value and runs it around each fork; Python unloads no module.
    unsafe extern "C" {
        safe fn pthread_atfork(prepare: Handler, parent: Handler, child: Handler) -> std::ffi::c_int;
    }
    // It fails for want of memory, and then forks are as they would be without it.
    let _ = pthread_atfork(Some(close), Some(open), Some(open));
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
