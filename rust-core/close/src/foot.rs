//! The flat foot: filled vertices of the lowest faces go down to the plane of the base.
//!
//! The level set lies up to a cell above that plane, and not flat.

use glam::DVec3;

use base::error::Result;
use base::progress::Progress;

use super::crossing;
use super::retreat::{self, NearMeasured};
use super::stitch::Growing;
use super::surface::normal;
use super::visibility::Envelope;

/// Cosine between down and the normal of a face of the foot.
const LOOKS_DOWN: f64 = 0.7;
/// Cosine between the normals of a face before and after, at least: faces that turn farther keep their places.
const TURNED: f64 = 0.3;
/// Times that faces are looked for which must keep their places, before all do.
const LOOKS: usize = 20;

/// Moves the vertices down that lie within `reach` above the plane. Where faces would turn over, cross others or enter seen space they stay.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn flatten(
    surface: &mut Growing,
    up: DVec3,
    height: f64,
    reach: f64,
    seen: Option<Envelope<'_>>,
    step: f64,
    progress: &Progress<'_>,
) -> Result<()> {
    let filled = surface.measured[1]..surface.triangles.len();
    let mut is_moved = vec![false; surface.positions.len()];
    for t in filled.clone().filter(|&t| normal(surface.corners(t)).dot(up) < -LOOKS_DOWN) {
        for v in surface.triangles[t].map(|v| v as usize).into_iter().filter(|&v| v >= surface.measured[0]) {
            let above = surface.positions[v].dot(up) - height;
            is_moved[v] = above > 0.0 && above <= reach;
        }
    }
    let before = surface.positions.clone();
    let known =
        seen.map(|seen| retreat::in_seen_space(surface, seen, step, NearMeasured::Passed, progress)).transpose()?;
    for _ in 0..LOOKS {
        if !is_moved.contains(&true) {
            break;
        }
        for (v, place) in surface.positions.iter_mut().enumerate() {
            // The coordinate along up is that of the plane, exactly.
            *place = if is_moved[v] { before[v] * (DVec3::ONE - up.abs()) + height * up } else { before[v] };
        }
        let moves = |t: usize| surface.triangles[t].iter().any(|&v| is_moved[v as usize]);
        let mut stuck: Vec<usize> = filled
            .clone()
            .filter(|&t| moves(t))
            .filter(|&t| {
                let old = surface.triangles[t].map(|v| before[v as usize]);
                normal(surface.corners(t)).dot(normal(old)) < TURNED
            })
            .collect();
        if stuck.is_empty() {
            let pairs = crossing::pairs(&surface.positions, &surface.triangles, moves, progress)?;
            stuck = pairs.into_iter().flatten().map(|t| t as usize).filter(|&t| moves(t)).collect();
        }
        if let (true, Some(seen), Some(known)) = (stuck.is_empty(), seen, &known) {
            surface.forget_around(&is_moved);
            let now = retreat::in_seen_space(surface, seen, step, NearMeasured::Passed, progress)?;
            stuck = filled.clone().filter(|&t| now[t] && !known[t]).collect();
        }
        if stuck.is_empty() {
            return Ok(());
        }
        stuck.into_iter().flat_map(|t| surface.triangles[t]).for_each(|v| is_moved[v as usize] = false);
    }
    surface.positions = before;
    Ok(())
}
