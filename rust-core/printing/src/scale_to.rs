//! Scaling: a side of the result becomes as long as asked.

use std::cmp::Ordering;

use glam::DVec3;

use base::error::Result;
use base::magnitude;
use base::progress::Progress;
use mesh::TriMesh;
use mesh::holes::Bounds;

use super::flat_base::Foot;
use super::params::{PrepareParams, ScaleSide};
use super::report::PrepareReport;
use super::section::{Section, axis_of};

/// Times that the factor is found anew for what the base cuts off. Each time the error falls by the share of the height that goes.
const ROUNDS: usize = 60;
/// Relative error at which it is known.
const KNOWN: f64 = 1e-15;

/// Scales all coordinates, and with them all sides, by one factor. The side has its length once the base is cut. Their frame is another
/// one then.
///
/// # Errors
/// [`base::Error::Input`] if coordinates become too large. [`base::Error::Cancelled`].
pub fn scale_to(
    mesh: &mut TriMesh,
    length: f64,
    params: &PrepareParams,
    report: &mut PrepareReport,
    progress: &Progress<'_>,
) -> Result<()> {
    let mut scale = length / side(extent(mesh, None), params);
    if params.flat_base {
        let foot = Foot::of(mesh, params);
        for _ in 0..ROUNDS {
            progress.check()?;
            // Nothing of it may lie above the base.
            let left = side(extent(mesh, Some(foot.plane(params, scale))), params);
            let next = if left > 0.0 { length / left } else { scale };
            let is_known = (next - scale).abs() <= KNOWN * scale;
            scale = next;
            if is_known {
                break;
            }
        }
    }
    report.scale = magnitude::divisor("the factor that scales the mesh", scale)?;
    if report.scale == 1.0 {
        return Ok(());
    }
    mesh.positions.iter_mut().for_each(|place| *place *= report.scale);
    (mesh.crs, mesh.rounding_room) = (None, None);
    magnitude::points("vertex", &mesh.positions)
}

/// The side that a length is given for.
pub fn side(bounds: Bounds, params: &PrepareParams) -> f64 {
    let size = bounds.max - bounds.min;
    match params.scale_side {
        ScaleSide::Longest => size.max_element(),
        ScaleSide::Height => size[axis_of(params.print_up).0],
    }
}

/// The box of the faces, or of what a plane keeps of them.
pub fn extent(mesh: &TriMesh, plane: Option<Section>) -> Bounds {
    let faces = (0..mesh.triangles.len()).map(|t| mesh.corners(t));
    let Some(plane) = plane else { return Bounds::of(faces.flatten()) };
    let on_edge = |from: DVec3, to: DVec3| {
        let is_cut = plane.side(from) == Ordering::Less && plane.side(to) == Ordering::Greater;
        is_cut.then(|| from + (to - from) * ((plane.at - from[plane.axis]) / (to - from)[plane.axis]))
    };
    Bounds::of(faces.flat_map(|[a, b, c]| {
        let kept = [a, b, c].map(|place| (plane.side(place) != Ordering::Less).then_some(place));
        let cut = [(a, b), (b, c), (c, a), (b, a), (c, b), (a, c)].map(|(from, to)| on_edge(from, to));
        kept.into_iter().chain(cut).flatten()
    }))
}
