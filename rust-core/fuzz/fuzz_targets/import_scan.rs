//! Any bytes as a file of every format that recognizes them: read or refused with a place, never a panic. Content that was read is valid.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| surfrecon::import::fuzzing::scan(bytes));
