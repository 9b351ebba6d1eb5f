//! Contexts: parts of one program that share the library, each with settings of its own.

use std::cell::Cell;
use std::ffi::c_void;
use std::sync::Arc;

use surfrecon::context::{Context, choose};

use crate::guard::guard;
use crate::handle::{self, handle};
use crate::pointer;
use crate::settings::{self, srf_log_fn};
use crate::status::srf_status;

/// Threads, a limit on memory and a log for a part of a program, for example for one of several plugins of a host: what it has none of
/// is the process's (srf_set_threads(), srf_set_memory_limit(), srf_set_log()). Released with srf_context_free().
#[allow(non_camel_case_types)]
pub struct srf_context {
    _opaque: [u8; 0],
}

handle!(srf_context, Arc<Context>);

thread_local! {
    /// The handle of what this thread uses.
    static USED: Cell<*mut srf_context> = const { Cell::new(std::ptr::null_mut()) };
}

/// Makes a context. Its worker threads are its own, started when they are first needed.
/// out_context  receives a new handle on SRF_OK only; not NULL
/// returns      SRF_OK, SRF_ERR_NULL, SRF_ERR_OUT_OF_MEMORY where there are 1023 already; what was made under one counts as it until that
///              is freed, too. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_context_create(out_context: *mut *mut srf_context) -> srf_status {
    guard(|| {
        pointer::writable("out_context", out_context)?;
        let context = Context::new()?;
        settings::set_log(context.number(), None, std::ptr::null_mut());
        handle::give("out_context", out_context, context)
    })
}

/// Releases a context. Calls that began under it end under it, and threads that use it go on with it until they use another one. What
/// was made under it stays.
/// context    NULL does nothing
/// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_context_free(context: *mut srf_context) -> srf_status {
    guard(|| handle::free("context", context))
}

/// Calls that this thread makes from now on are made under this context; other threads are not concerned. A function of yours that
/// is called by the library on one of its own threads is under the context of the call that it serves; where it uses another one, it must
/// put back the former one at its end.
/// context      NULL for none: the settings of the process
/// out_former   receives what this thread used before, NULL for none, which may have been freed since; NULL if not wanted
/// returns      SRF_OK, SRF_ERR_HANDLE: all is as it was. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_context_use(context: *mut srf_context, out_former: *mut *mut srf_context) -> srf_status {
    guard(|| {
        let chosen = match context.is_null() {
            true => None,
            false => Some(Arc::clone(handle::get("context", context.cast_const())?.as_ref())),
        };
        drop(choose(chosen));
        let former = USED.replace(context);
        if out_former.is_null() { Ok(()) } else { pointer::write("out_former", out_former, former) }
    })
}

/// Worker threads of calls under a context whose parameters say 0. Results are the same for any number.
/// context    not NULL
/// threads    at most 1024; 0, the default, for the number of srf_set_threads()
/// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_context_set_threads(context: *mut srf_context, threads: u32) -> srf_status {
    guard(|| {
        let context = handle::get("context", context.cast_const())?;
        settings::check_threads(threads)?;
        context.set_threads(threads);
        Ok(())
    })
}

/// Number set by srf_context_set_threads().
/// context      not NULL
/// out_threads  receives the number on SRF_OK only; not NULL
/// returns      SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_context_threads(context: *const srf_context, out_threads: *mut u32) -> srf_status {
    guard(|| pointer::write("out_threads", out_threads, handle::get("context", context)?.threads()))
}

/// Most memory that calls under a context may take; together, where several run at a time. What others take, under another context or
/// under none, does not count, nor does their limit concern this one. Memory that a call hands out (srf_mesh) is no longer taken once it
/// is freed, by whatever thread.
/// context    not NULL
/// bytes      0, the default, for as much as srf_set_memory_limit() says
/// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_context_set_memory_limit(context: *mut srf_context, bytes: u64) -> srf_status {
    guard(|| {
        handle::get("context", context.cast_const())?.set_memory_limit(Some(bytes).filter(|bytes| *bytes != 0));
        Ok(())
    })
}

/// Memory of a context.
/// context    not NULL
/// out_limit  receives the number set by srf_context_set_memory_limit(); NULL if not wanted
/// out_held   receives the bytes that its calls, and what was made under it, hold now; NULL if not wanted
/// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_context_memory(
    context: *const srf_context,
    out_limit: *mut u64,
    out_held: *mut u64,
) -> srf_status {
    guard(|| {
        let context = handle::get("context", context)?;
        let give = |name, out: *mut u64, value| if out.is_null() { Ok(()) } else { pointer::write(name, out, value) };
        give("out_limit", out_limit, context.memory_limit().unwrap_or(0))?;
        give("out_held", out_held, context.held() as u64)
    })
}

/// Who gets the messages of calls under a context from now on.
/// context    not NULL
/// log        NULL, the default, for who gets those of the process (srf_set_log()); a function that does nothing, for nobody
/// user       handed to log as it is; must stay usable until another log is set or the context freed, and calls under it have returned
/// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_context_set_log(
    context: *mut srf_context,
    log: srf_log_fn,
    user: *mut c_void,
) -> srf_status {
    guard(|| {
        settings::set_log(handle::get("context", context.cast_const())?.number(), log, user);
        Ok(())
    })
}
