//! Messages of a build without the feature `las` about files that need it. Apart from the other tests: only this one is compiled for a
//! build of that kind.
#![cfg(not(feature = "las"))]
#![allow(clippy::unwrap_used)]

use std::path::Path;

use surfrecon_io::import::open;

#[test]
fn what_is_missing_is_said() {
    for name in ["points.las", "points.laz"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/seeds/import_scan").join(name);
        let error = open(&path).unwrap().scans[0].read().unwrap_err().to_string();
        assert!(error.contains("points.la") && error.contains("feature `las`"), "{error}");
    }
}
