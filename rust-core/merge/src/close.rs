//! Stage 9: holes up to a length. [MI04, sec. 3.4]

use super::extract::Surface;
use super::holes::{self, Reason, successors, walk};
use super::lattice::Lattice;
use super::parts::Part;
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

/// Closes all holes with a boundary within `limit`; `part_of` is the part of each vertex.
///
/// # Errors
/// Cancelled.
pub fn close_holes(
    surface: &mut Surface,
    parts: &[Part],
    part_of: &[u32],
    limit: Limit,
    lattice: &Lattice,
    progress: &Progress<'_>,
) -> Result<Closed> {
    let limits = Limits::new(parts, part_of, limit);
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
struct Limits<'a> {
    length: f64,
    /// Of each part; empty if all have the same.
    of_part: Vec<f64>,
    /// The part of each vertex.
    part_of: &'a [u32],
}

impl<'a> Limits<'a> {
    fn new(parts: &[Part], part_of: &'a [u32], limit: Limit) -> Self {
        let within = |length: f64, share: f64| {
            parts.iter().map(move |part| length.min(share * part.low.distance(part.high))).collect()
        };
        match limit {
            Limit::Length(length) => Limits { length, of_part: Vec::new(), part_of },
            Limit::OfPart(length, share) => Limits { length, of_part: within(length, share), part_of },
        }
    }

    fn of(&self, vertices: &[u32]) -> f64 {
        // Vertices that were split off lie beside others of their part.
        let part = vertices.iter().find_map(|&v| self.part_of.get(v as usize));
        part.and_then(|&part| self.of_part.get(part as usize)).copied().unwrap_or(self.length)
    }
}
