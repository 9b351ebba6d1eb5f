//! Contexts: parts of one program that share the library. Each has threads, a limit on memory and pools of its own, so that none of them
//! has to live with what another one set.
//!
//! A thread [chooses](choose) a context, and the calls that it makes from then on (`memory::guarded`) are that context's. The memory that
//! they take is on its account, and their workers are its own threads, which work for nobody else. A call keeps the context it began with.
//! Values that live on after a call keep its account ([`Owned`]), and are taken off it by whatever thread gives them back.

use std::cell::RefCell;
use std::sync::Arc;

pub use crate::account::{ContextAccount, Entered, Owned};
use crate::error::Result;
use crate::log::{self, Log};
use crate::{allowed, threads};

/// A part of a program with settings of its own.
pub struct Context {
    account: ContextAccount,
}

impl Context {
    /// One with the settings of the process.
    ///
    /// # Errors
    /// [`crate::error::Error::OutOfMemory`] where there are more than a thousand.
    pub fn new() -> Result<Arc<Self>> {
        let account = ContextAccount::new()?;
        threads::set_default(account.number(), 0);
        log::set_of(account.number(), Log::OfProcess);
        Ok(Arc::new(Context { account }))
    }

    /// A number below 1024. No other context has it as long as this one lives, or anything that was made under it.
    pub fn number(&self) -> usize {
        self.account.number()
    }

    /// Worker threads of calls whose parameters say 0. The default is 0: the process's number.
    pub fn set_threads(&self, threads: u32) {
        threads::set_default(self.number(), threads);
    }

    /// The number that [`Self::set_threads`] set.
    pub fn threads(&self) -> u32 {
        threads::default_of(self.number())
    }

    /// The most memory that the calls of this context may take together. `memory::set_limit` says the same of the process. `None`, the
    /// default, and 0 stand for as much as is said there.
    pub fn set_memory_limit(&self, bytes: Option<u64>) {
        allowed::set_limit_of(self.number(), bytes);
    }

    /// The limit that [`Self::set_memory_limit`] set.
    pub fn memory_limit(&self) -> Option<u64> {
        allowed::limit_of(self.number())
    }

    /// Sets who gets the messages of its calls.
    pub fn set_log(&self, log: Log) {
        log::set_of(self.number(), log);
    }

    /// Bytes that its calls and what they made hold now.
    pub fn held(&self) -> usize {
        usize::try_from(surfrecon_allocator::held_by(self.number())).unwrap_or(0)
    }
}

impl Drop for Context {
    fn drop(&mut self) {
        threads::end(self.number());
        log::set_of(self.number(), Log::Silent);
    }
}

/// The context of a thread's calls.
#[derive(Clone)]
pub enum Chosen {
    /// As whoever this thread works for: nobody, or the call whose worker it is.
    Inherited,
    /// None.
    Process,
    /// A context. A worker of its own must not keep that as its choice: it lasts as long as the context, which would last as long as it.
    Context(Arc<Context>),
}

thread_local! {
    static CHOSEN: RefCell<Chosen> = const { RefCell::new(Chosen::Inherited) };
}

/// The calls that this thread makes from now on are those of `context`, or of none. Returns the choice before. A call that is running, and
/// calls its caller's function, goes on with its first choice.
pub fn choose(context: Option<Arc<Context>>) -> Option<Arc<Context>> {
    match exchange(context.map_or(Chosen::Process, Chosen::Context)) {
        Chosen::Context(former) => Some(former),
        _ => None,
    }
}

/// [`choose`] for who puts back what was chosen before.
pub fn exchange(chosen: Chosen) -> Chosen {
    // No thread chooses anything once it ends.
    CHOSEN.try_with(|former| former.replace(chosen)).unwrap_or(Chosen::Inherited)
}

/// The context that was [chosen](choose) for this thread.
pub fn chosen() -> Option<Arc<Context>> {
    match CHOSEN.try_with(|chosen| chosen.borrow().clone()) {
        Ok(Chosen::Context(context)) => Some(context),
        _ => None,
    }
}

/// A call, with the context it began with.
pub(crate) struct Call {
    // Dropped in this order: nobody works for a context that ends.
    _entered: Option<Entered>,
    _context: Option<Arc<Context>>,
}

impl Call {
    pub(crate) fn begin() -> Self {
        // No thread chooses anything once it ends.
        match CHOSEN.try_with(|chosen| chosen.borrow().clone()).unwrap_or(Chosen::Inherited) {
            Chosen::Inherited => Call { _entered: None, _context: None },
            Chosen::Process => Call { _entered: Some(ContextAccount(0).enter()), _context: None },
            Chosen::Context(context) => Call { _entered: Some(context.account.enter()), _context: Some(context) },
        }
    }
}

#[cfg(test)]
mod tests {
    use surfrecon_allocator::current;

    use super::*;
    use crate::{Error, memory};

    fn number() -> usize {
        memory::guarded(|| Ok::<usize, Error>(current())).unwrap()
    }

    #[test]
    fn a_thread_works_for_what_it_chose_and_a_call_for_what_it_began_with() {
        let (a, b) = (Context::new().unwrap(), Context::new().unwrap());
        assert!(a.number() != b.number() && number() == 0 && chosen().is_none());
        assert!(choose(Some(a.clone())).is_none());
        assert_eq!((number(), current()), (a.number(), 0));
        memory::guarded(|| {
            assert!(Arc::ptr_eq(&choose(Some(b.clone())).unwrap(), &a));
            assert_eq!((current(), number()), (a.number(), b.number()));
            assert!(Arc::ptr_eq(&choose(None).unwrap(), &b));
            assert_eq!((current(), number()), (a.number(), 0));
            let of_a = a.number();
            assert_eq!(std::thread::spawn(move || (number(), of_a)).join().unwrap(), (0, of_a));
            Ok::<(), Error>(())
        })
        .unwrap();
        assert!(chosen().is_none() && number() == 0);
    }

    #[test]
    fn a_limit_of_no_bytes_is_none() {
        let context = Context::new().unwrap();
        context.set_memory_limit(Some(1 << 40));
        assert_eq!(context.memory_limit(), Some(1 << 40));
        context.set_memory_limit(Some(0));
        assert_eq!(context.memory_limit(), None);
    }

    #[test]
    fn workers_are_the_contexts_own_and_so_are_their_calls() {
        let context = Context::new().unwrap();
        choose(Some(context.clone()));
        context.set_threads(3);
        let pool = memory::guarded(|| threads::pool(0)).unwrap();
        choose(None);
        let others = memory::guarded(|| threads::pool(3)).unwrap();
        assert!(pool.current_num_threads() == 3 && !Arc::ptr_eq(&pool, &others));
        let of_workers = |pool: &rayon::ThreadPool| pool.broadcast(|_| (current(), number()));
        assert_eq!(of_workers(&pool), [(context.number(), context.number()); 3]);
        assert_eq!(of_workers(&others), [(0, 0); 3]);
    }

    #[test]
    fn a_context_lives_as_long_as_a_call_and_its_number_as_long_as_what_it_made() {
        let context = Context::new().unwrap();
        let number = context.number();
        choose(Some(context));
        let made = memory::guarded(|| {
            // Nobody has it any more but this call.
            drop(choose(None));
            assert_eq!(current(), number);
            assert!(threads::pool(2).is_ok());
            Ok::<_, Error>(Owned::new(vec![1_u8; 100]))
        })
        .unwrap();
        assert_eq!(made.account.number(), number);
        assert_ne!(Context::new().unwrap().number(), number, "it has what is given back on it");
        assert_eq!(made.clone().account.number(), 0);
        assert_eq!(made.into_inner().len(), 100);
    }
}
