//! Any bytes as a camera, a trajectory, a pose, a MeshLab project or alignment: read or refused, never a panic.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| surfrecon::import::fuzzing::side(bytes));
