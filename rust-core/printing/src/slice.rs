//! Closed parts of a closed surface beside a plane: cut, capped and looked at.
//!
//! Vertices on edges are rounded to single precision, so that a thin triangle may turn over or edges in the plane may cross. The plane then
//! moves by a hair.

use base::error::{Error, Result, Shown};
use base::progress::Progress;
use close::crossing;
use mesh::{TriMesh, try_check};

use super::cap::cap;
use super::cut::cut;
use super::made::Made;
use super::section::Section;
use super::single::Precision;

/// Planes that are tried beside the one that is asked for.
const TRIES: i32 = 12;
/// Distance of the first of them, as a share of the size of the mesh, and by how much farther each of the others lies.
const fn hair(precision: Precision) -> (f64, f64) {
    match precision {
        Precision::Single { .. } => (1e-7, 2.0),
        Precision::Double => (1e-12, 4.0),
    }
}

/// Some closed parts of a mesh, and the plane between them.
pub struct Sliced<const N: usize> {
    pub parts: [Made; N],
    pub plane: Section,
}

/// The kept side of a plane, or of one a hair beyond it.
///
/// # Errors
/// [`Error::Input`] if none near the plane leaves a manifold without crossings. [`Error::Cancelled`].
pub fn side(mesh: &TriMesh, plane: Section, progress: &Progress<'_>) -> Result<Sliced<1>> {
    near(mesh, plane, progress, |plane| Ok(kept(mesh, plane, progress)?.map(|part| [part])))
}

/// Both sides of a plane, the kept one first.
///
/// # Errors
/// As [`side`].
pub fn both(mesh: &TriMesh, plane: Section, progress: &Progress<'_>) -> Result<Sliced<2>> {
    near(mesh, plane, progress, |plane| {
        let Some(one) = kept(mesh, plane, progress)? else { return Ok(None) };
        Ok(kept(mesh, plane.reversed(), progress)?.map(|other| [one, other]))
    })
}

fn near<const N: usize>(
    mesh: &TriMesh,
    plane: Section,
    progress: &Progress<'_>,
    parts: impl Fn(Section) -> Result<Option<[Made; N]>>,
) -> Result<Sliced<N>> {
    let (lo, hi) = mesh::measure::bounds(&mesh.positions).unwrap_or_default();
    let size = (hi - lo).max_element().max(lo.abs().max(hi.abs()).max_element() * 1e-3);
    let upward = if plane.is_upward { 1.0 } else { -1.0 };
    let precision = Precision::of(mesh);
    let (first, farther) = hair(precision);
    for hair in 0..=TRIES {
        progress.check()?;
        let by = if hair == 0 { 0.0 } else { upward * size * first * farther.powi(hair - 1) };
        let plane = plane.moved(by).rounded(precision);
        if let Some(parts) = parts(plane)? {
            return Ok(Sliced { parts, plane });
        }
    }
    Err(Error::input(format!(
        "the mesh can't be cut at {} along {}, where rounding makes its faces cross: cut it elsewhere",
        Shown(plane.at),
        ["x", "y", "z"][plane.axis]
    )))
}

/// `None` if rounding leaves no manifold, or crossings.
fn kept(mesh: &TriMesh, plane: Section, progress: &Progress<'_>) -> Result<Option<Made>> {
    let mut open = cut(mesh, plane, progress)?;
    if !cap(&mut open, plane, progress)? {
        return Ok(None);
    }
    open.made.compact();
    Ok(is_sound(&open.made, progress)?.then_some(open.made))
}

/// Whether a surface is a closed manifold whose fresh triangles cross nothing, exactly.
///
/// # Errors
/// [`Error::Cancelled`].
pub fn is_sound(made: &Made, progress: &Progress<'_>) -> Result<bool> {
    let bare = TriMesh::new(made.positions.clone(), made.triangles.clone());
    if !try_check(&bare, &progress.unseen())?.is_closed() {
        return Ok(false);
    }
    Ok(crossing::pairs(&made.positions, &made.triangles, |t| made.is_fresh[t], progress)?.is_empty())
}
