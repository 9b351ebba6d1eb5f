//! The C library as a stranger meets it: the built file is loaded by name, and every function is called, rightly and wrongly. The header is
//! compiled, and programs run under sanitizers.
#![allow(unsafe_code, clippy::print_stdout, clippy::unwrap_used)]

mod arguments;
mod calls;
mod examples;
mod generated;
mod header;
mod library;
mod programs;
mod returned;
mod server;
mod structs;
mod types;
mod views;
