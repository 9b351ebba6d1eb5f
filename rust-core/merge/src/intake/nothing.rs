//! Scans that have nothing to merge.

use base::error::Error;

/// The error where no scan has a triangle.
pub fn nothing_to_merge() -> Error {
    Error::input(
        "no scan has a triangle, so there is nothing to merge: check the scans, check what was kept of them, or raise edge_limit",
    )
}
