//! Memory that a context leaves behind when it is closed while calls of the program run. In a process of its own, whose memory nobody else
//! takes.
#![allow(clippy::unwrap_used)]

use std::alloc::System;

use surfrecon_allocator::Account;
use surfrecon_base::context::{Context, choose};
use surfrecon_base::{Error, memory};

#[global_allocator]
static ALLOCATOR: Account<System> = Account(System);

const MB: usize = 1 << 20;

/// Theorem: calls of the program may take what they may take, whatever a context leaves meanwhile, and no more.
#[test]
fn what_a_closed_account_leaves_is_not_taken_for_that_of_the_calls_that_run() {
    memory::set_limit(Some(16 * MB as u64));
    let context = Context::new().unwrap();
    context.set_memory_limit(Some(1 << 30));
    choose(Some(context.clone()));
    let left = memory::guarded(|| Ok::<_, Error>(vec![1_u8; 32 * MB])).unwrap();
    choose(None);
    memory::guarded(|| {
        drop(context);
        let taken = vec![2_u8; 12 * MB];
        assert_eq!(taken.len() + left.len(), 44 * MB);
        Ok::<_, Error>(())
    })
    .unwrap();
    // Nor is there room for more than that afterwards.
    for _ in 0..2 {
        let refused = memory::guarded(|| Ok::<_, Error>(vec![3_u8; 17 * MB].len()));
        assert!(matches!(refused, Err(Error::OutOfMemory(_))), "{refused:?}");
    }
}
