//! Faults of a disk while a file is read.

use std::cell::Cell;
use std::io::{Error, ErrorKind, Result};

/// Faults of the reads of this thread.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Fault {
    /// All go well.
    None,
    /// So many go well, each giving few bytes. Then all fail.
    After(u64),
    /// Each gives few bytes. Each second one is interrupted, which is no failure.
    Interrupted(bool),
}

thread_local! {
    pub(super) static FAULT: Cell<Fault> = const { Cell::new(Fault::None) };
}

/// Most bytes a read gives while faults are tried: so that there are many reads to fail.
const FEW: usize = 97;

/// The part of a buffer that may be read now.
pub(super) fn read(buffer: &mut [u8]) -> Result<&mut [u8]> {
    let few = buffer.len().min(FEW);
    match FAULT.get() {
        Fault::None => Ok(buffer),
        Fault::After(0) => Err(Error::other("broken disk")),
        Fault::After(good) => {
            FAULT.set(Fault::After(good - 1));
            Ok(&mut buffer[..few])
        }
        Fault::Interrupted(now) => {
            FAULT.set(Fault::Interrupted(!now));
            if now { Err(ErrorKind::Interrupted.into()) } else { Ok(&mut buffer[..few]) }
        }
    }
}
