//! The base of every part of surfrecon: errors, the types of parameters, the largest numbers, progress and cancel as one value, contexts,
//! messages, the worker pools, and memory that is found out before it is taken.

mod account;
mod allowed;
pub mod context;
pub mod error;
pub mod fewer_threads;
pub mod fork;
pub mod log;
pub mod magnitude;
pub mod memory;
pub mod nearest;
pub mod operation;
pub mod params;
pub mod progress;
pub mod report;
pub mod threads;
pub mod tier;
pub mod work;

pub use error::{Error, Result};
pub use progress::{Progress, Tick};
