//! Parts: cut by planes across the axes into boxes that the printer holds.

use std::cmp::Ordering;

use base::error::{Error, Result, Shown};
use base::progress::Progress;
use glam::DVec3;
use mesh::measure::bounds;
use mesh::{Attribute, TriMesh};

use super::made::{PART, append};
use super::params::PrepareParams;
use super::report::{PrepareProblem, PrepareReport};
use super::section::{Section, axis_of};
use super::single::Precision;
use super::slice;

/// Most parts along an axis, and in all: more is a unit that was mistaken.
const MOST: f64 = 100.0;
const MOST_IN_ALL: f64 = 1000.0;

/// Cuts a closed mesh into equal boxes no larger than the printer. Each part is closed by itself, and the caps of neighbours lie on each
/// other. The face attribute `part` numbers them from 0, along x first, then along y and z.
///
/// # Errors
/// [`Error::Input`] if there would be more than 100 along an axis or 1,000 in all, or the mesh can't be cut between them. [`Error::Cancelled`].
pub fn split_parts(
    mesh: &mut TriMesh,
    params: &PrepareParams,
    report: &mut PrepareReport,
    progress: &Progress<'_>,
) -> Result<()> {
    let sizes = sizes(params);
    let (lo, hi) = bounds(&mesh.positions).unwrap_or_default();
    let counts = [0, 1, 2].map(|axis| sizes[axis].map_or(1.0, |(_, size)| ((hi[axis] - lo[axis]) / size).ceil()));
    refuse_many(sizes, counts, hi - lo)?;
    let mut parts = vec![std::mem::take(mesh)];
    // The last axis first, so that parts come in the order of x.
    for axis in [2, 1, 0] {
        let (extent, count) = (hi[axis] - lo[axis], counts[axis]);
        let planes: Vec<f64> = (1..count as usize).map(|k| lo[axis] + extent * (k as f64 / count)).collect();
        let mut pieces = Vec::new();
        for part in parts {
            pieces.extend(along(part, axis, &planes, report, progress)?);
        }
        parts = pieces;
    }
    report.parts = parts.len();
    *mesh = joined(parts);
    Ok(())
}

/// Refuses more parts than anybody prints, of a mesh of this size.
fn refuse_many(sizes: [Option<(&str, f64)>; 3], counts: [f64; 3], extent: DVec3) -> Result<()> {
    for axis in 0..3 {
        let Some((name, size)) = sizes[axis].filter(|_| counts[axis] > MOST) else { continue };
        return Err(Error::input(format!(
            "{name} is {}, but the mesh is {} long there: at most {MOST} parts are made, give at least {}",
            Shown::digits(size, 4),
            Shown::digits(extent[axis], 4),
            Shown::digits(extent[axis] / MOST, 4)
        )));
    }
    let count: f64 = counts.iter().product();
    if count > MOST_IN_ALL {
        return Err(Error::input(format!(
            "the printer's size cuts the mesh into {count} parts: at most {MOST_IN_ALL} are made, give a larger printer"
        )));
    }
    Ok(())
}

/// The pieces of a part between planes across an axis, from the lowest.
fn along(
    part: TriMesh,
    axis: usize,
    planes: &[f64],
    report: &mut PrepareReport,
    progress: &Progress<'_>,
) -> Result<Vec<TriMesh>> {
    let mut pieces = Vec::new();
    let mut rest = part;
    for &at in planes {
        let plane = Section { axis, is_upward: true, at }.rounded(Precision::of(&rest));
        let lies = |side: Ordering| rest.positions.iter().any(|&place| plane.side(place) == side);
        if !lies(Ordering::Less) {
            continue;
        }
        if !lies(Ordering::Greater) {
            break;
        }
        let slice::Sliced { parts: [above, below], plane: found } = slice::both(&rest, plane, progress)?;
        if found != plane {
            let text = format!(
                "Parts meet at {} along {}, {} beside the place of equal parts: rounding would make faces cross there",
                Shown::digits(found.at, 4),
                ["x", "y", "z"][axis],
                Shown::digits((found.at - at).abs(), 2)
            );
            report.note(PrepareProblem::PartMoved, text);
        }
        pieces.push(below.finish(&rest));
        rest = above.finish(&rest);
    }
    pieces.push(rest);
    Ok(pieces)
}

/// Names and sizes of the printer along x, y and z, as far as they are given.
fn sizes(params: &PrepareParams) -> [Option<(&'static str, f64)>; 3] {
    let [width, depth, height] = [
        ("printer_width", params.printer_width),
        ("printer_depth", params.printer_depth),
        ("printer_height", params.printer_height),
    ]
    .map(|(name, size)| size.map(|size| (name, size)));
    match axis_of(params.print_up).0 {
        0 => [height, width, depth],
        1 => [width, height, depth],
        _ => [width, depth, height],
    }
}

/// All parts as one mesh, whose faces know their part.
fn joined(parts: Vec<TriMesh>) -> TriMesh {
    let mut numbers = Vec::new();
    let mut whole = TriMesh::default();
    for (number, part) in parts.into_iter().enumerate() {
        numbers.extend(std::iter::repeat_n(number as i32, part.triangles.len()));
        let first = whole.positions.len() as u32;
        if number == 0 {
            whole = part;
            continue;
        }
        whole.positions.extend(part.positions);
        whole.triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + first)));
        let pairs = |into: &mut [Attribute], from: Vec<Attribute>| {
            into.iter_mut().zip(from).for_each(|(into, from)| append(&mut into.data, from.data));
        };
        pairs(&mut whole.vertex_attributes, part.vertex_attributes);
        pairs(&mut whole.face_attributes, part.face_attributes);
    }
    whole.face_attributes.retain(|attribute| attribute.name != PART);
    whole.face_attributes.push(Attribute::i32(PART, numbers));
    whole
}
