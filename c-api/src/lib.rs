//! The C library: `include/surfrecon.h` is generated from these files and is the manual.
//!
//! | file | what |
//! |---|---|
//! | `version` | which library this is |
//! | `status` | outcome of a call, and the text of the last error |
//! | `guard` | no panic gets out: every entry runs inside it |
//! | `pointer` | pointers of the caller, checked and used in one place |
//!
//! `unsafe` blocks are in `pointer` alone; the lint is lifted for the whole crate because exporting a symbol counts as
//! unsafe too.

#![allow(unsafe_code)]
// The comments become the header's, where each argument's line is its contract.
#![allow(clippy::missing_safety_doc)]

mod guard;
mod pointer;
mod status;
mod version;
