//! Accounts of those who share the library within a program, each in use as long as somebody has it.

use std::ops::Deref;
use std::sync::atomic::{AtomicUsize, Ordering};

use surfrecon_allocator::{ACCOUNTS, close, current, held_by, open, switch};

use crate::allowed;
use crate::error::{Error, Result};

/// Nobody has the account.
const FREE: usize = 0;
/// It is being opened or closed. A larger number is one more than its holders.
const BUSY: usize = 1;

/// Of each account how many have it.
static HOLDERS: [AtomicUsize; ACCOUNTS] = [const { AtomicUsize::new(FREE) }; ACCOUNTS];

/// One who has an account: of those that have it, the last one closes it.
pub struct ContextAccount(pub(crate) usize);

impl ContextAccount {
    pub(crate) fn new() -> Result<Self> {
        let free =
            |holders: &&AtomicUsize| holders.compare_exchange(FREE, BUSY, Ordering::Acquire, Ordering::Relaxed).is_ok();
        let Some(number) = (1..ACCOUNTS).find(|&number| free(&&HOLDERS[number])) else {
            let most = ACCOUNTS - 1;
            return Err(Error::OutOfMemory(format!(
                "there are {most} contexts already, the most there can be: free some"
            )));
        };
        open(number);
        allowed::begin(number);
        HOLDERS[number].store(BUSY + 1, Ordering::Release);
        Ok(ContextAccount(number))
    }

    /// The account of the call that this thread works for, or that of none.
    pub fn of_this_thread() -> Self {
        // Somebody has it as long as the thread works for it.
        Self::shared(current())
    }

    fn shared(number: usize) -> Self {
        if number != 0 {
            HOLDERS[number].fetch_add(1, Ordering::Relaxed);
        }
        ContextAccount(number)
    }

    /// Its number: 0 of calls without a context.
    pub fn number(&self) -> usize {
        self.0
    }

    /// Has this thread work for it until the answer is dropped.
    pub fn enter(&self) -> Entered {
        Entered { former: switch(self.0), _account: self.clone() }
    }
}

impl Clone for ContextAccount {
    fn clone(&self) -> Self {
        Self::shared(self.0)
    }
}

impl Drop for ContextAccount {
    fn drop(&mut self) {
        if self.0 != 0 && HOLDERS[self.0].fetch_sub(1, Ordering::AcqRel) == BUSY + 1 {
            // Threads of a context that was dropped may end while the program's calls run: what is left is none of theirs.
            allowed::receive(held_by(self.0));
            close(self.0);
            HOLDERS[self.0].store(FREE, Ordering::Release);
        }
    }
}

/// A thread that works for an account.
pub struct Entered {
    former: usize,
    _account: ContextAccount,
}

impl Drop for Entered {
    fn drop(&mut self) {
        switch(self.former);
    }
}

/// A value that lives on after the call that made it, and keeps that call's account.
pub struct Owned<T> {
    // Dropped in this order.
    value: T,
    pub(crate) account: ContextAccount,
}

impl<T> Owned<T> {
    /// Of the call which this thread works for.
    pub fn new(value: T) -> Self {
        Owned { value, account: ContextAccount::of_this_thread() }
    }

    /// Whether its account is that of the call which this thread works for.
    pub fn is_of_this_thread(&self) -> bool {
        self.account.number() == current()
    }

    /// The value, which is owned no longer.
    pub fn into_inner(self) -> T {
        self.value
    }
}

impl<T: Default> Default for Owned<T> {
    fn default() -> Self {
        Owned::new(T::default())
    }
}

impl<T> Deref for Owned<T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.value
    }
}

impl<T> std::ops::DerefMut for Owned<T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.value
    }
}

impl<T: Clone> Clone for Owned<T> {
    fn clone(&self) -> Self {
        Owned::new(T::clone(self))
    }
}
