//! Fills that turn a surface inside out: its outside would become the inside of a body.
//!
//! Behind a surface thinner than a cell, or nearer to its base, the field has no node inside. The fill then lies before the surface.

use base::error::Result;
use base::progress::Progress;
use mesh::measure::area;

use super::cut;
use super::doubts::looks_inward;
use super::stitch::Growing;

/// Volume of a flat piece by its area to the power of 1.5: that of a ball is 0.09.
const LEAST_VOLUME: f64 = 1e-6;

/// Whether each triangle is of a closed piece that its fill turned inside out, or that encloses nothing. A piece whose outside is inside may be the inside of a
/// thing: without lines of sight it then looks toward its own middle. With them its inside is wider than `tolerance`, as scans saw into it.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn find(surface: &Growing, tolerance: Option<f64>, progress: &Progress<'_>) -> Result<Vec<bool>> {
    let (piece, count) = cut::pieces(&surface.triangles, progress)?;
    let mut is_open = vec![false; surface.positions.len()];
    cut::border(&surface.triangles, progress)?.into_iter().flatten().for_each(|v| is_open[v as usize] = true);
    let mut pieces = vec![Piece::default(); count];
    for (t, corners) in surface.triangles.iter().enumerate() {
        let piece = &mut pieces[piece[t] as usize];
        let [a, b, c] = surface.corners(t);
        let first = *piece.first.get_or_insert(a);
        piece.volume += (a - first).dot((b - first).cross(c - first)) / 6.0;
        piece.area += area([a, b, c]);
        piece.is_filled |= t >= surface.measured[1];
        piece.is_open |= corners.iter().any(|&v| is_open[v as usize]);
    }
    let mut is_turned = vec![false; count];
    for (number, piece_of) in pieces.iter().enumerate() {
        if piece_of.is_open || !piece_of.is_filled || piece_of.volume > LEAST_VOLUME * piece_of.area.powf(1.5) {
            continue;
        }
        is_turned[number] = match tolerance {
            Some(tolerance) => -piece_of.volume <= tolerance * piece_of.area,
            None if piece_of.volume >= 0.0 => true,
            None => {
                let measured = (0..surface.measured[1]).filter(|&t| piece[t] as usize == number);
                !looks_inward(measured.map(|t| surface.corners(t)))
            }
        };
    }
    Ok(piece.into_iter().map(|number| is_turned[number as usize]).collect())
}

/// A piece of a surface.
#[derive(Clone, Default)]
struct Piece {
    /// A corner of it, which volumes are measured from.
    first: Option<glam::DVec3>,
    volume: f64,
    area: f64,
    is_filled: bool,
    is_open: bool,
}
