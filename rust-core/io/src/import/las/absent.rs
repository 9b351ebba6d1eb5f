//! In place of the reader, in a build without the feature `las`: files are recognized, and what is missing is said.

use super::file::Input;
use super::{Content, Scan};
use base::error::{Error, Result};
use base::progress::Progress;

pub(super) fn sniff(start: &[u8]) -> bool {
    start.starts_with(b"LASF")
}

pub(super) fn parse(_: &mut dyn Input, _: u64, scan: &Scan, _: &Progress<'_>) -> Result<Content> {
    let remedy = "build it with surfrecon's feature `las`, or convert the file to PLY or XYZ";
    Err(Error::format(&scan.path, "whole file", format!("this program was built without LAS and LAZ; {remedy}")))
}

#[test]
fn what_is_missing_is_said() {
    for name in ["points.las", "points.laz"] {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/seeds/import_scan").join(name);
        let Err(error) = super::open(&path).and_then(|set| set.scans[0].read()) else { panic!("{name} was read") };
        let error = error.to_string();
        assert!(error.contains("points.la") && error.contains("feature `las`"), "{error}");
    }
}
