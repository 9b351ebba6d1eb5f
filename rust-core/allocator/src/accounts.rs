//! Accounts of those who share the library within a program, beside that of the program itself.
//!
//! A thread works for one at a time: what it takes is charged to that. Each block says who paid for it ([`Payer`]), so whoever gives it
//! back, it is taken off the account it was charged to. Either is one addition to the account's number, so that an allocation costs the
//! same with and without accounts of others, but for a look at who the thread works for.

use std::cell::Cell;
use std::sync::atomic::{AtomicIsize, AtomicU32, AtomicUsize, Ordering::Relaxed};

use crate::reserve::SMALL;

/// Number of accounts. Number 0 is the program's.
pub const ACCOUNTS: usize = 1024;

/// While others have accounts, [`peak`] does not look at smaller allocations: adding all accounts up takes longer.
const LARGE: usize = 16 << 10;

#[repr(align(64))]
struct Shared {
    held: AtomicIsize,
    ceiling: AtomicIsize,
    /// Number of times that it was closed.
    closed: AtomicU32,
}

static ALL: [Shared; ACCOUNTS] =
    [const { Shared { held: AtomicIsize::new(0), ceiling: AtomicIsize::new(isize::MAX), closed: AtomicU32::new(0) } };
        ACCOUNTS];

/// The account that a block is charged to, as long as it is not closed. Then it is the program's.
#[derive(Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub struct Payer {
    account: u32,
    closed: u32,
}

impl Payer {
    const PROGRAM: Payer = Payer { account: 0, closed: 0 };

    /// The account that this thread works for.
    #[inline]
    pub fn here() -> Self {
        if OPEN.load(Relaxed) == 0 { Payer::PROGRAM } else { Payer::of(current()) }
    }

    #[inline]
    fn of(account: usize) -> Self {
        Payer { account: account as u32, closed: ALL[account].closed.load(Relaxed) }
    }

    /// Charges bytes. Returns false if they may not be had.
    #[inline]
    pub fn charge(self, bytes: usize) -> bool {
        let Some(held) = add(&ALL[self.account as usize], bytes) else { return false };
        if OPEN.load(Relaxed) == 0 {
            note(usize::try_from(held).unwrap_or(0));
        } else if bytes >= LARGE {
            note(self::held());
        }
        true
    }

    /// Takes bytes off what it holds.
    #[inline]
    pub fn discharge(self, bytes: usize) {
        let account = if self == Payer::of(self.account as usize) { self.account as usize } else { 0 };
        ALL[account].held.fetch_sub(bytes as isize, Relaxed);
    }
}

/// Accounts that are in use, without the program's.
static OPEN: AtomicUsize = AtomicUsize::new(0);
/// The highest number that one ever had.
static HIGHEST: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

thread_local! {
    static CURRENT: Cell<usize> = const { Cell::new(0) };
}

/// The account that this thread works for. 0 unless [`switch`] said another one.
#[inline]
pub fn current() -> usize {
    CURRENT.get()
}

/// Has this thread work for that account from now on. Returns the one before.
///
/// # Panics
/// If there is no account of that number.
pub fn switch(account: usize) -> usize {
    assert!(account < ACCOUNTS, "{account}");
    CURRENT.replace(account)
}

/// Bytes held now, on all accounts. 0 in a program that has another allocator.
pub fn held() -> usize {
    let all: isize = ALL[..=HIGHEST.load(Relaxed)].iter().map(|account| account.held.load(Relaxed)).sum();
    usize::try_from(all).unwrap_or(0)
}

/// Bytes that an account holds now.
pub fn held_by(account: usize) -> isize {
    ALL[account].held.load(Relaxed)
}

/// Most bytes held at a time since the last [`restart_peak`], or since the program began.
pub fn peak() -> usize {
    MOST.load(Relaxed)
}

/// Counts the peak anew from what is held now.
pub fn restart_peak() {
    MOST.store(held(), Relaxed);
}

/// Refuses an allocation that would bring [`held_by`] above `bytes`, but for small ones. `isize::MAX` for no ceiling.
pub fn set_ceiling(account: usize, bytes: isize) {
    ALL[account].ceiling.store(bytes, Relaxed);
}

/// Takes an account other than the program's into use: it holds nothing and has no ceiling.
pub fn open(account: usize) {
    // A thread may have looked before it was closed whom to give back to, and done it since.
    ALL[0].held.fetch_add(ALL[account].held.swap(0, Relaxed), Relaxed);
    set_ceiling(account, isize::MAX);
    HIGHEST.fetch_max(account, Relaxed);
    OPEN.fetch_add(1, Relaxed);
}

/// Takes an account out of use that no thread works for. The bytes that it holds still are the program's.
pub fn close(account: usize) {
    ALL[account].closed.fetch_add(1, Relaxed);
    ALL[0].held.fetch_add(ALL[account].held.swap(0, Relaxed), Relaxed);
    OPEN.fetch_sub(1, Relaxed);
}

/// Bytes that the account then holds. None if it may not.
#[inline]
fn add(account: &Shared, bytes: usize) -> Option<isize> {
    let held = account.held.fetch_add(bytes as isize, Relaxed).wrapping_add(bytes as isize);
    if held > account.ceiling.load(Relaxed) && bytes > SMALL {
        account.held.fetch_sub(bytes as isize, Relaxed);
        return None;
    }
    Some(held)
}

/// Mostly it isn't the most, and then nothing is written.
#[inline]
fn note(held: usize) {
    if held > MOST.load(Relaxed) {
        MOST.fetch_max(held, Relaxed);
    }
}
