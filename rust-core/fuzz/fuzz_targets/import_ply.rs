//! Any bytes as a PLY file: read or refused, never a panic, memory bounded by the file's size; what was read is
//! valid.

#![no_main]

use std::path::PathBuf;
use std::sync::OnceLock;

use libfuzzer_sys::fuzz_target;
use surfrecon::import::{self, Content};

/// The file, written anew for every input.
fn path() -> &'static PathBuf {
    static PATH: OnceLock<PathBuf> = OnceLock::new();
    PATH.get_or_init(|| tempfile::tempdir().expect("a scratch folder").keep().join("scan.ply"))
}

fuzz_target!(|bytes: &[u8]| {
    std::fs::write(path(), bytes).expect("the scratch folder can be written");
    let Ok(set) = import::open(path()) else { return };
    for scan in &set.scans {
        let _ = scan.preview_points(100);
        match scan.read() {
            Ok(Content::RangeImage(image)) => {
                image.validate().expect("what was read is valid");
                assert!(image.len() <= bytes.len(), "{} pixels from {} bytes", image.len(), bytes.len());
            }
            Ok(Content::Mesh(mesh)) => {
                mesh.validate().expect("what was read is valid");
                assert!(mesh.positions.len() <= bytes.len() && mesh.triangles.len() <= bytes.len());
            }
            Ok(Content::Points(cloud)) => assert!(cloud.positions.len() <= bytes.len()),
            Err(_) => {}
        }
    }
});
