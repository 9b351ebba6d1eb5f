//! Any bytes as a PLY file: read or refused, never a panic, the same whatever the size of the reader's window. Content that was read is
//! valid, is no larger than the file allows and can be previewed.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| surfrecon::import::fuzzing::ply(bytes));
