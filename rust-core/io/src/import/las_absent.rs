//! In place of the reader, in a build without the feature `las`: files are recognized, and what is missing is said.

use super::file::Input;
use super::{Content, FileScan};
use base::error::{Error, Result};
use base::progress::Progress;

pub(super) fn sniff(start: &[u8]) -> bool {
    start.starts_with(b"LASF")
}

pub(super) fn parse(_: &mut dyn Input, _: u64, scan: &FileScan, _: &Progress<'_>) -> Result<Content> {
    let remedy = "build it with surfrecon's feature `las`, or convert the file to PLY or XYZ";
    Err(Error::format(&scan.path, "whole file", format!("this program was built without LAS and LAZ: {remedy}")))
}
