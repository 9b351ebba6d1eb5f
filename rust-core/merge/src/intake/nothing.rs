//! Scans that have nothing to merge.

use std::f64::consts::FRAC_PI_2;

use base::error::{Error, Shown};
use image::triangulate::TriangulateParams;

/// The error where no scan has a triangle. It names the limits that are narrower than by default.
pub fn nothing_to_merge(triangulation: &TriangulateParams) -> Error {
    let TriangulateParams { edge_limit, grazing_limit } = *triangulation;
    let degrees = Shown(grazing_limit.to_degrees());
    Error::input(match edge_limit {
        Some(edge) if grazing_limit < FRAC_PI_2 => format!(
            "no scan has a triangle, so there is nothing to merge. Check the scans and what was kept of them, or raise grazing_limit, which is \
                {degrees} degrees, or edge_limit, which is {}.",
            Shown(edge)
        ),
        Some(edge) => format!(
            "no scan has a triangle, so there is nothing to merge. Check the scans and what was kept of them, or raise edge_limit, which is {}.",
            Shown(edge)
        ),
        None if grazing_limit < FRAC_PI_2 => format!(
            "no scan has a triangle, so there is nothing to merge. Check the scans and what was kept of them, or raise grazing_limit, which is \
                {degrees} degrees."
        ),
        None => "no scan has a triangle, so there is nothing to merge: check the scans, check what was kept of them, or raise edge_limit".to_owned(),
    })
}
