//! Settings for a part of a program.

use std::cell::RefCell;
use std::sync::Arc;

use pyo3::exceptions::{PyRuntimeError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use pyo3::{PyTraverseError, PyVisit};
use surfrecon::context::{self, Chosen, exchange};

use crate::errors::to_python;
use crate::log::Listener;
use crate::params;
use crate::settings::limit_of;

/// The contexts that a thread has entered and not left, in that order, and its choice before the first.
struct Entered {
    before: Chosen,
    contexts: Vec<Arc<context::Context>>,
}

thread_local! {
    static ENTERED: RefCell<Entered> = const { RefCell::new(Entered { before: Chosen::Inherited, contexts: Vec::new() }) };
}

/// Threads, a limit on memory and a log for what is called in a ``with`` block, for example by one of several add-ons of a host, so that none of
/// them has to live with what another one set.
///
/// Holds for the thread that runs the block, and for jobs that are started in it. It does not hold for other tasks of an event loop: don't
/// ``await`` in it. May be entered again, by several threads as well: their calls share the limit. Blocks may end in another order than they began:
/// generators do that. Calls are then under the block that was entered last of those that have not ended.
///
/// The limit is on calls, not on what they leave: what was handed out before (meshes, images) does not count, however much it is, unless
/// another call of the context was running all the time since.
///
/// >>> with surfrecon.Context(threads=2, memory_limit=4_000_000_000):
/// ...     merged = surfrecon.merge(scans)
///
/// Args:
///     threads: Worker threads of calls that are not told how many. 0 for one a core. Results are the same for any number.
///     memory_limit: Most memory that calls may take, in bytes, together where several run at a time. ``None`` and 0 for as much as
///         ``set_memory_limit`` says. Calls elsewhere do not count, and their limit does not concern calls here.
///     log: called as ``log(level, text)``, on the thread of the call that has something to tell: level as ``logging.INFO``, how files
///         were understood, or ``logging.WARNING``, what was left out or is open. A logger's method fits, ``logging.getLogger("mine").log``.
///         An exception of it fails no call. ``None`` for the logger ``surfrecon`` of the module ``logging``, which hears of calls without a
///         context, too.
///
/// Raises:
///     ParameterError: more than 1024 threads, or fewer than 0.
///     InputError: a limit that is no number of bytes.
///     TypeError: a log that can't be called.
#[pyclass(frozen, module = "surfrecon")]
pub struct Context {
    core: Arc<context::Context>,
    listener: Option<Arc<Listener>>,
}

#[pymethods]
impl Context {
    #[new]
    #[pyo3(signature = (*, threads = None, memory_limit = None, log = None, **others),
        text_signature = "(*, threads=0, memory_limit=None, log=None)")]
    fn new(
        threads: Option<&Bound<'_, PyAny>>,
        memory_limit: Option<&Bound<'_, PyAny>>,
        log: Option<Bound<'_, PyAny>>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        params::no_others("Context", others)?;
        let threads = params::threads(threads)? as u32;
        let limit = memory_limit.map(|given| limit_of("memory_limit", given)).transpose()?.flatten();
        if let Some(log) = log.as_ref().filter(|log| !log.is_callable()) {
            return Err(PyTypeError::new_err(format!(
                "log must be a function of level and text, got {}",
                log.get_type()
            )));
        }
        let core = context::Context::new().map_err(|error| to_python(&error))?;
        core.set_threads(threads);
        core.set_memory_limit(limit);
        let listener = log.map(|log| Listener::new(log.unbind()));
        if let Some(listener) = &listener {
            core.set_log(listener.log());
        }
        Ok(Context { core, listener })
    }

    /// Worker threads of calls that are not told how many.
    #[getter]
    fn threads(&self) -> u32 {
        self.core.threads()
    }

    /// Most memory that calls may take, in bytes, or ``None``.
    #[getter]
    fn memory_limit(&self) -> Option<u64> {
        self.core.memory_limit()
    }

    /// The function that is told the messages of calls, or ``None``.
    #[getter]
    fn log(&self, py: Python<'_>) -> Option<Py<PyAny>> {
        self.listener.as_ref().and_then(|listener| listener.function(py))
    }

    fn __traverse__(&self, visit: PyVisit<'_>) -> Result<(), PyTraverseError> {
        self.listener.as_ref().map_or(Ok(()), |listener| listener.traverse(&visit))
    }

    fn __clear__(&self) {
        if let Some(listener) = &self.listener {
            listener.forget();
        }
    }

    fn __enter__(slf: PyRef<'_, Self>) -> PyRef<'_, Self> {
        let former = exchange(Chosen::Context(slf.core.clone()));
        ENTERED.with_borrow_mut(|entered| {
            if entered.contexts.is_empty() {
                entered.before = former;
            }
            entered.contexts.push(slf.core.clone());
        });
        slf
    }

    #[pyo3(signature = (*_raised))]
    fn __exit__(&self, _raised: &Bound<'_, pyo3::types::PyTuple>) -> PyResult<()> {
        let left = ENTERED.with_borrow_mut(|entered| {
            let last = entered.contexts.iter().rposition(|context| Arc::ptr_eq(context, &self.core))?;
            let left = entered.contexts.remove(last);
            let now = match entered.contexts.last() {
                Some(context) => Chosen::Context(context.clone()),
                None => std::mem::replace(&mut entered.before, Chosen::Inherited),
            };
            Some((left, exchange(now)))
        });
        left.map(drop).ok_or_else(|| {
            PyRuntimeError::new_err("this thread has not entered the context: leave it where it was entered")
        })
    }

    fn __repr__(&self) -> String {
        let limit = self.memory_limit().map_or_else(|| "None".to_owned(), |bytes| bytes.to_string());
        format!("Context(threads={}, memory_limit={limit})", self.threads())
    }
}
