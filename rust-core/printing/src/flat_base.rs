//! The base: what lies below a height is cut off, and the cut is closed flat.

use std::cmp::Ordering;

use base::error::{Error, Result, Shown};
use base::progress::Progress;
use mesh::TriMesh;
use mesh::measure::{area, bounds};

use super::params::PrepareParams;
use super::report::{PrepareProblem, PrepareReport};
use super::section::{Section, axis_of};
use super::single::Precision;
use super::slice;

/// Heights of a base that is not given, of that of the mesh. It lies at the first where it is nearly as wide as at the last.
const SHARES: [f64; 4] = [0.002, 0.005, 0.01, 0.02];
/// Share of the area at the last height that is nearly as wide.
const WIDE: f64 = 0.5;

/// Cuts a closed mesh off at a height above its lowest point. All vertices above keep their bits, and those of the base have one coordinate.
/// Gives the plane of the base.
///
/// # Errors
/// [`Error::Input`] if nothing lies above that height, or the mesh can't be cut there. [`Error::Cancelled`].
pub fn flat_base(
    mesh: &mut TriMesh,
    params: &PrepareParams,
    report: &mut PrepareReport,
    progress: &Progress<'_>,
) -> Result<Section> {
    let foot = Foot::of(mesh, params);
    let (plane, lowest) = (foot.plane(params, 1.0).rounded(Precision::of(mesh)), foot.lowest);
    let height = params.base_height.unwrap_or(foot.height);
    if !mesh.positions.iter().any(|&place| plane.side(place) == Ordering::Greater) {
        return Err(Error::input(format!(
            "base_height is {}, but the mesh is {} high along {}: give less than that",
            Shown(height),
            Shown::digits(foot.extent, 4),
            params.print_up.name()
        )));
    }
    let mut base = plane;
    if mesh.positions.iter().any(|&place| plane.side(place) == Ordering::Less) {
        let slice::Sliced { parts: [part], plane } = slice::side(mesh, plane, progress)?;
        *mesh = part.finish(mesh);
        base = plane;
    }
    let height_of = (base.at - lowest).abs();
    report.base_height = Some(height_of);
    let lies = |t: usize| mesh.corners(t).iter().all(|&corner| base.side(corner) == Ordering::Equal);
    let faces: Vec<usize> = (0..mesh.triangles.len()).filter(|&t| lies(t)).collect();
    report.base_faces = faces.len();
    report.base_area = faces.iter().map(|&t| area(mesh.corners(t))).sum();
    if base != plane {
        let text = format!(
            "The base lies {} above the lowest point, {} beside the height asked for: rounding would make faces cross there",
            Shown::digits(height_of, 4),
            Shown::digits((base.at - plane.at).abs(), 2)
        );
        report.note(PrepareProblem::BaseMoved, text);
    }
    if report.base_faces == 0 {
        let text = "The mesh does not stand on a face, and nothing lies below the base: give a larger height";
        report.note(PrepareProblem::NothingBelow, text.to_owned());
    }
    Ok(base)
}

/// The lowest part of a mesh.
pub struct Foot {
    /// Coordinate of the lowest point along up.
    lowest: f64,
    /// Size along up.
    extent: f64,
    /// Height of the base if none is given.
    height: f64,
}

impl Foot {
    pub fn of(mesh: &TriMesh, params: &PrepareParams) -> Self {
        let (axis, is_upward) = axis_of(params.print_up);
        let (lo, hi) = bounds(&mesh.positions).unwrap_or_default();
        let (lowest, extent) = (if is_upward { lo[axis] } else { hi[axis] }, hi[axis] - lo[axis]);
        let is_known = params.base_height.is_some() || stands(mesh, axis, lowest);
        Foot { lowest, extent, height: if is_known { 0.0 } else { low_and_wide(mesh, params, extent) } }
    }

    /// The plane of the base in the mesh as it is, if it is to be scaled by a factor.
    pub fn plane(&self, params: &PrepareParams, scale: f64) -> Section {
        let (axis, is_upward) = axis_of(params.print_up);
        let height = params.base_height.map_or(self.height, |height| height / scale);
        Section { axis, is_upward, at: if is_upward { self.lowest + height } else { self.lowest - height } }
    }
}

/// Whether a face lies in the lowest plane.
fn stands(mesh: &TriMesh, axis: usize, lowest: f64) -> bool {
    (0..mesh.triangles.len()).any(|t| mesh.corners(t).iter().all(|corner| corner[axis] == lowest))
}

/// The lowest height above the lowest point at which the mesh is nearly as wide as a 50th of its height up.
fn low_and_wide(mesh: &TriMesh, params: &PrepareParams, extent: f64) -> f64 {
    let up = params.print_up.direction();
    let lowest = mesh.positions.iter().map(|place| place.dot(up)).fold(f64::INFINITY, f64::min);
    // Of a closed surface, the faces above a plane look up by the area that they enclose in it.
    let mut areas = [0.0; SHARES.len()];
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(t);
        let above = (a + b + c).dot(up) / 3.0 - lowest;
        let upward = 0.5 * (b - a).cross(c - a).dot(up);
        for (area, share) in areas.iter_mut().zip(SHARES) {
            *area += if above > share * extent { upward } else { 0.0 };
        }
    }
    let widest = areas[SHARES.len() - 1];
    let first = areas.iter().position(|area| *area >= WIDE * widest).unwrap_or(SHARES.len() - 1);
    SHARES[first] * extent
}
