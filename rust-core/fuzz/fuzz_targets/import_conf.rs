//! Any bytes as a list of placed scans, beside two real ones: read or refused, never a panic, and nothing outside the
//! list's folder is named.

#![no_main]

use std::path::PathBuf;
use std::sync::OnceLock;

use libfuzzer_sys::fuzz_target;
use surfrecon::import;

const SCAN: &[u8] = include_bytes!("../seeds/import_ply/grid_text.ply");

/// The folder with the scans `a.ply` and `b.ply`, the same for every input.
fn folder() -> &'static PathBuf {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a scratch folder").keep();
        for name in ["a.ply", "b.ply"] {
            std::fs::write(folder.join(name), SCAN).expect("the scratch folder can be written");
        }
        folder
    })
}

fuzz_target!(|bytes: &[u8]| {
    if !import::fuzzing::conf(bytes, folder()) {
        return;
    }
    let path = folder().join("scans.conf");
    std::fs::write(&path, bytes).expect("the scratch folder can be written");
    let Ok(set) = import::open(&path) else { return };
    for scan in &set.scans {
        let inside =
            scan.path.canonicalize().is_ok_and(|path| path.starts_with(folder().canonicalize().expect("there")));
        assert!(inside, "{} lies outside the list's folder", scan.path.display());
        assert!(scan.world_from_sensor.is_finite(), "{}", scan.world_from_sensor);
        let _ = scan.read();
    }
});
