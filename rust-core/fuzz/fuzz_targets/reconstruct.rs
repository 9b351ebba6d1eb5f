//! Surfaces of any points.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| surfrecon::reconstruct::fuzzing::points(bytes));
