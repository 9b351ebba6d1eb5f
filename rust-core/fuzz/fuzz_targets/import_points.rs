//! Any bytes as a file of points in text: read or refused with a line, never a panic. Content that was read is valid.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| surfrecon::import::fuzzing::points(bytes));
