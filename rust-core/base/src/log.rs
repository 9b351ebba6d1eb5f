//! Messages of calls: what a person may want to know of a call, or should look at. The log of the call's context gets them, else that of
//! the process. At first nobody gets them.

use std::sync::{Arc, PoisonError, RwLock};

use surfrecon_allocator::{ACCOUNTS, current};

use crate::fork;

/// Importance of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// For people who want to know, for example how a file was understood.
    Info,
    /// For people to look at, for example a part of the input that was left out.
    Warning,
}

/// Gets messages, on the thread of the call that has something to tell.
pub type Listener = Arc<dyn Fn(Level, &str) + Send + Sync>;

/// Receiver of messages.
#[derive(Clone, Default)]
pub enum Log {
    /// The one that the process has named. The process itself tells nobody.
    #[default]
    OfProcess,
    /// Somebody.
    To(Listener),
    /// Nobody.
    Silent,
}

/// By account.
static LOGS: [RwLock<Log>; ACCOUNTS] = [const { RwLock::new(Log::OfProcess) }; ACCOUNTS];

/// Sets who is told by calls in the whole process but for contexts with a log of their own.
pub fn set(log: Log) {
    set_of(0, log);
}

/// Sets who is told by the calls of an account.
pub(crate) fn set_of(account: usize, log: Log) {
    let former = {
        let _fork = fork::prevent();
        std::mem::replace(&mut *LOGS[account].write().unwrap_or_else(PoisonError::into_inner), log)
    };
    // Only now: it may hold what is the host's.
    drop(former);
}

/// Tells whoever listens to the call that this thread works for.
pub fn tell(level: Level, text: &str) {
    let log = {
        let _fork = fork::prevent();
        let of = |account: usize| LOGS[account].read().unwrap_or_else(PoisonError::into_inner).clone();
        match of(current()) {
            Log::OfProcess => of(0),
            own => own,
        }
    };
    if let Log::To(listener) = log {
        listener(level, text);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;
    use crate::context::{Context, choose};
    use crate::memory::guarded;

    #[test]
    fn contexts_tell_whom_they_name_else_whom_the_process_does() {
        let heard = Arc::new(Mutex::new(Vec::new()));
        let to = |who: &'static str| {
            let heard = heard.clone();
            Log::To(Arc::new(move |level, text: &str| heard.lock().unwrap().push((who, level, text.to_owned()))))
        };
        let contexts = [Context::new().unwrap(), Context::new().unwrap(), Context::new().unwrap()];
        set(to("process"));
        contexts[0].set_log(to("first"));
        contexts[2].set_log(Log::Silent);
        for (k, context) in contexts.iter().enumerate() {
            choose(Some(context.clone()));
            guarded(|| {
                tell(Level::Warning, &k.to_string());
                Ok::<_, crate::Error>(())
            })
            .unwrap();
        }
        choose(None);
        set(Log::OfProcess);
        tell(Level::Info, "nobody");
        let expected = [("first", Level::Warning, "0".to_owned()), ("process", Level::Warning, "1".to_owned())];
        assert_eq!(*heard.lock().unwrap(), expected);
        // Nothing that listeners hold outlives the context.
        assert_eq!(Arc::strong_count(&heard), 2);
        drop(contexts);
        assert_eq!(Arc::strong_count(&heard), 1);
    }
}
