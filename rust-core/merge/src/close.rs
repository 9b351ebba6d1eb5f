//! Stage 9: holes up to a length. [MI04, sec. 3.4]

use rustc_hash::FxHashMap;

use super::components::parts;
use super::extract::Surface;
use super::holes::{self, Reason, successors, walk};
use super::lattice::Lattice;
use super::passes;
use super::peel;
use base::error::Result;
use base::progress::Progress;

/// What was closed and what wasn't.
pub struct Closed {
    /// Holes closed.
    pub closed: u64,
    /// Boundary loops left open.
    pub open: u64,
    /// Whether triangles were peeled, so that parts may have come off.
    pub peeled: bool,
}

/// The longest boundary to close.
#[derive(Clone, Copy)]
pub enum Limit {
    /// World units.
    Length(f64),
    /// World units, but at most this share of the diagonal of the bounding box of the connected part the hole is in: the
    /// rim of a part is no hole.
    OfPart(f64, f64),
}

/// Closes all holes with a boundary within `limit`.
///
/// # Errors
/// Cancelled.
pub fn close_holes(surface: &mut Surface, limit: Limit, lattice: &Lattice, progress: &Progress<'_>) -> Result<Closed> {
    let limits = Limits::new(surface, limit, progress)?;
    let boundary = std::mem::take(&mut surface.boundary);
    let report = holes::close(
        &mut surface.positions,
        &mut surface.triangles,
        &boundary,
        |vertices| limits.of(vertices),
        progress,
    )?;
    surface.adopt_fill(&report);
    let next = successors(&boundary);
    let mut stuck = Vec::new();
    for open in &report.open {
        let sides = walk(open.vertex, &next);
        surface.boundary.extend(&sides);
        if open.reason == Reason::Crossing {
            stuck.push(sides.iter().map(|side| side[0]).collect());
        }
    }
    let peeled = peel::close_stuck(surface, &stuck, |vertices| limits.of(vertices), lattice, progress)?;
    Ok(Closed {
        closed: report.closed as u64 + peeled.closed,
        open: report.open.len() as u64 - peeled.holes,
        peeled: peeled.holes > 0,
    })
}

/// The limit of each loop.
struct Limits {
    length: f64,
    /// The part of each vertex, and the limits of parts that have a boundary; empty if all have the same.
    parts: Vec<u32>,
    of_part: FxHashMap<u32, f64>,
}

impl Limits {
    fn new(surface: &Surface, limit: Limit, progress: &Progress<'_>) -> Result<Self> {
        let (length, share) = match limit {
            Limit::Length(length) => return Ok(Limits { length, parts: Vec::new(), of_part: FxHashMap::default() }),
            Limit::OfPart(length, share) => (length, share),
        };
        let parts = parts(surface.positions.len(), &surface.triangles, progress)?;
        let empty = (glam::DVec3::INFINITY, glam::DVec3::NEG_INFINITY);
        let mut boxes: FxHashMap<u32, _> = surface.boundary.iter().map(|s| (parts[s[0] as usize], empty)).collect();
        passes::each(parts.len(), progress, |v| {
            if let Some((low, high)) = boxes.get_mut(&parts[v]) {
                *low = low.min(surface.positions[v]);
                *high = high.max(surface.positions[v]);
            }
        })?;
        let within = |(low, high): (glam::DVec3, glam::DVec3)| length.min(share * low.distance(high));
        let of_part = boxes.into_iter().map(|(part, bounds)| (part, within(bounds))).collect();
        Ok(Limits { length, parts, of_part })
    }

    fn of(&self, vertices: &[u32]) -> f64 {
        // Vertices that were split off lie beside others of their part.
        let part = vertices.iter().find_map(|&v| self.parts.get(v as usize));
        part.and_then(|part| self.of_part.get(part)).copied().unwrap_or(self.length)
    }
}
