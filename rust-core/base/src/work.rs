//! Work counted in tests: how it grows with the input can be stated, times can't.

#[cfg(any(test, feature = "count"))]
thread_local! {
    static STEPS: std::cell::Cell<u64> = const { std::cell::Cell::new(0) };
}

/// Counts one step. Does nothing outside of tests.
#[inline(always)]
pub fn step() {
    #[cfg(any(test, feature = "count"))]
    STEPS.with(|steps| steps.set(steps.get() + 1));
}

/// The result of `run`, and the steps it took on this thread.
#[cfg(any(test, feature = "count"))]
pub fn counted<T>(run: impl FnOnce() -> T) -> (T, u64) {
    let before = STEPS.get();
    let result = run();
    (result, STEPS.get() - before)
}
