//! Any bytes as a file of frames, an archive or a list of them, and as the images of a frame. They are read or refused, never a panic, and
//! never more than the images may unpack to.

#![no_main]

use std::path::PathBuf;
use std::sync::OnceLock;

use libfuzzer_sys::fuzz_target;
use surfrecon::import;

/// The scratch folder, the same for every input.
fn folder() -> &'static PathBuf {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| tempfile::tempdir().expect("a scratch folder").keep())
}

fuzz_target!(|bytes: &[u8]| import::fuzzing::frames(bytes, folder()));
