//! Contexts: parts of one program that share the library, each with settings of its own.

use std::cell::Cell;
use std::ffi::c_void;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use surfrecon::context::{Chosen, Context, exchange};
use surfrecon::log::Log;
use surfrecon::threads::of_worker;
use surfrecon_allocator::{ACCOUNTS, current};

use crate::guard::guard;
use crate::handle::{self, handle};
use crate::pointer;
use crate::settings::{self, srf_log_fn};
use crate::status::{Failure, srf_status};

/// Threads, a limit on memory and a log for a part of a program, for example for one of several plugins of a host. What it has none of
/// it takes from the process (srf_set_threads(), srf_set_memory_limit(), srf_set_log()). Released with srf_context_free().
#[allow(non_camel_case_types)]
pub struct srf_context {
    _opaque: [u8; 0],
}

handle!(srf_context, Arc<Context>);

thread_local! {
    /// The handle of what this thread uses, once it has said that. Until then it is that of the call which the thread works for.
    static USED: Cell<Option<*mut srf_context>> = const { Cell::new(None) };
}

/// The handle of each account's context, also once that is freed. 0 for none.
static HANDLES: [AtomicUsize; ACCOUNTS] = [const { AtomicUsize::new(0) }; ACCOUNTS];

fn handle_of(account: usize) -> *mut srf_context {
    std::ptr::without_provenance_mut(HANDLES[account].load(Ordering::Relaxed))
}

/// The context of a thread from now on that uses one. In a call under that one it is the thread's first one, also if the handle was freed
/// since. `of_call` is the account of the call that this thread works for.
fn chosen(context: *mut srf_context, of_call: usize) -> Result<Chosen, Failure> {
    if context.is_null() {
        return Ok(Chosen::Process);
    }
    if handle_of(of_worker()) == context {
        return Ok(Chosen::Inherited);
    }
    match handle::get("context", context.cast_const()) {
        Ok(context) => Ok(Chosen::Context(Arc::clone(context.as_ref()))),
        Err(_) if handle_of(of_call) == context => Ok(Chosen::Inherited),
        Err(failure) => Err(failure),
    }
}

/// Makes a context. Its worker threads are its own, started when they are first needed.
/// out_context  receives a new handle on SRF_OK only. Not NULL
/// returns      SRF_OK, SRF_ERR_NULL, SRF_ERR_OUT_OF_MEMORY where there are 1023 already. Things made under one count as it until they are
///              freed, too. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_context_create(out_context: *mut *mut srf_context) -> srf_status {
    guard(|| {
        pointer::writable("out_context", out_context)?;
        let context = Context::new()?;
        let number = context.number();
        handle::give_numbered("out_context", out_context, |handle| {
            HANDLES[number].store(handle, Ordering::Relaxed);
            Ok(context)
        })
    })
}

/// Releases a context. Calls that began under it end under it, and threads that use it go on with it until they use another one. But
/// nothing is told to a log any more under it. Things made under it stay.
/// context    NULL does nothing
/// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_context_free(context: *mut srf_context) -> srf_status {
    guard(|| {
        if context.is_null() {
            return Ok(());
        }
        let kept = handle::get("context", context.cast_const())?;
        handle::free("context", context)?;
        kept.set_log(Log::Silent);
        Ok(())
    })
}

/// Calls that this thread makes from now on are made under this context. Other threads are not concerned. A function of yours that is
/// called by the library on one of its own threads is under the context of the call that it serves. If it uses another one, it must put
/// back the former one at its end. That works as well if that one was freed meanwhile.
/// context      NULL for none: the settings of the process
/// out_former   receives what this thread used before, NULL for none, which may have been freed since. NULL if not wanted
/// returns      SRF_OK, SRF_ERR_HANDLE: all is as it was. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_context_use(context: *mut srf_context, out_former: *mut *mut srf_context) -> srf_status {
    // Of the call that called the caller, before this one is under what the thread uses.
    let of_call = current();
    guard(|| {
        let chosen = chosen(context, of_call)?;
        let used = (!matches!(chosen, Chosen::Inherited)).then_some(context);
        drop(exchange(chosen));
        let former = USED.replace(used).unwrap_or_else(|| handle_of(of_call));
        if out_former.is_null() { Ok(()) } else { pointer::write("out_former", out_former, former) }
    })
}

/// Worker threads of calls under a context whose parameters say 0. Results are the same for any number.
/// context    not NULL
/// threads    at most 1024. 0, the default, for the number of srf_set_threads()
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
/// out_threads  receives the number on SRF_OK only. Not NULL
/// returns      SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_context_threads(context: *const srf_context, out_threads: *mut u32) -> srf_status {
    guard(|| pointer::write("out_threads", out_threads, handle::get("context", context)?.threads()))
}

/// Most memory that calls under a context may take. It is for all together, if several run at a time. Memory of others, under another
/// context or under none, does not count, nor does their limit concern this one. It limits calls, not what they leave. Meshes, images and
/// the like that were handed out before do not count, however much they are, unless another call of the context was running all the time
/// since. srf_context_memory() says how much that is. Memory that is given back, by whatever thread, is no longer taken.
/// context    not NULL
/// bytes      0, the default, for as much as srf_set_memory_limit() says
/// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_context_set_memory_limit(context: *mut srf_context, bytes: u64) -> srf_status {
    guard(|| {
        handle::get("context", context.cast_const())?.set_memory_limit(Some(bytes));
        Ok(())
    })
}

/// Memory of a context.
/// context    not NULL
/// out_limit  receives the number set by srf_context_set_memory_limit(). NULL if not wanted
/// out_held   receives the bytes that its calls, and what was made under it, hold now. NULL if not wanted
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

/// Sets who gets the messages of calls under a context from now on.
/// context    not NULL
/// log        NULL, the default, for who gets those of the process (srf_set_log()). A function that does nothing, for nobody
/// user       handed to log as it is. Must stay usable until another log is set or the context freed, and calls under it that were running
///            then have returned
/// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_context_set_log(
    context: *mut srf_context,
    log: srf_log_fn,
    user: *mut c_void,
) -> srf_status {
    guard(|| {
        handle::get("context", context.cast_const())?.set_log(settings::log_of(log, user));
        Ok(())
    })
}
