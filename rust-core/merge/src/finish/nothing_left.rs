//! Surfaces of which nothing is left.

use base::error::{Error, Result, Shown};

/// Refuses a surface of which nothing is left.
///
/// # Errors
/// There is no triangle.
pub fn refuse_nothing(triangles: u64, voxel: f64, min_share: f64) -> Result<()> {
    if triangles > 0 {
        return Ok(());
    }
    let or_share = if min_share > 0.0 { ", or a smaller min_component_share" } else { "" };
    Err(Error::input(format!(
        "nothing is left of the surface: choose a voxel smaller than {} (in the unit of the scans){or_share}",
        Shown::digits(voxel, 4)
    )))
}
