//! Long calls in the background, for hosts whose main thread must stay free. Each operation's file has the methods that start it.

use pyo3::prelude::*;

use crate::background::Background;

/// A long call on a thread of its own: start it, ask for its progress, cancel it, fetch its result.
///
/// Its static methods start calls. Dropping a running job cancels it.
///
/// >>> job = surfrecon.Job.merge(scans)
/// >>> while not job.done():
/// ...     stage, share = job.progress()  # a host draws its window meanwhile
/// >>> mesh = job.result().mesh
#[pyclass(frozen, module = "surfrecon")]
pub struct Job {
    call: Background,
}

impl Job {
    /// A job of a call that was started, or the error of its arguments.
    pub fn of(call: PyResult<Background>) -> PyResult<Self> {
        Ok(Job { call: call? })
    }
}

#[pymethods]
impl Job {
    /// Name of the running stage, and the share of the whole that is done: 0 to 1, never falling.
    fn progress(&self) -> (&'static str, f64) {
        self.call.progress()
    }

    /// Asks the work to stop, which it does within a tenth of a second. ``result`` then raises ``Cancelled``.
    ///
    /// >>> job = surfrecon.Job.align(scans)
    /// >>> job.cancel()
    /// >>> try:
    /// ...     aligned = job.result()
    /// ... except surfrecon.Cancelled:
    /// ...     aligned = None
    fn cancel(&self) {
        self.call.cancel();
    }

    /// Whether the work has ended, in whatever way. Also true once the result was fetched, and in a process forked from the
    /// job's, where nobody works on it.
    ///
    /// A cancelled job has ended as soon as its work has. Its thread may still be giving memory back.
    fn done(&self) -> bool {
        self.call.done()
    }

    /// Waits for the end and hands out what the call returns, once only.
    ///
    /// Raises:
    ///     Cancelled: after ``cancel``.
    ///     RuntimeError: the result was fetched before, or another process started the job.
    ///     others: like the call itself.
    fn result<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.call.result(py)
    }

    fn __repr__(&self) -> String {
        let (stage, fraction) = self.progress();
        format!("<Job {stage} {:.0} %>", fraction * 100.0)
    }
}
