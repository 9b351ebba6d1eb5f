//! Stage 9: holes up to a length. [MI04, sec. 3.4]

use glam::DVec3;

use super::components::{self, Kept};
use super::extract::Surface;
use super::lattice::Lattice;
use super::tile::Part;
use super::{CLOSING, MergeParams, MergeReport, peel, refuse_nothing};
use base::error::Result;
use base::progress::Progress;
use mesh::holes::{self, Reason, successors, walk};

/// By default holes are closed up to a boundary of this many voxels ...
const HOLE_VOXELS: f64 = 100.0;
/// ... and of at most this share of the diagonal of the bounding box of the part they are in.
const HOLE_SHARE: f64 = 0.2;

/// Stage 9: closes the holes that `params` name, or up to the default length; what that takes off and makes small is dropped.
///
/// # Errors
/// Nothing is left; cancelled.
pub fn close(
    kept: &mut Kept,
    lattice: &Lattice,
    params: &MergeParams,
    report: &mut MergeReport,
    progress: &Progress<'_>,
) -> Result<()> {
    progress.stage(CLOSING, 1);
    let limit = Limit::of(params, report, kept.size);
    let least = components::least(&kept.parts, params.min_component_share);
    let holes = close_holes(&mut kept.surface, &kept.parts, &kept.part_of, limit, least, lattice, progress)?;
    report.holes = [holes.closed, holes.open];
    (0..2).for_each(|i| report.dropped_components[i] += holes.dropped[i]);
    if !holes.bare.is_empty() {
        components::drop_vertices(&mut kept.surface, &holes.bare, progress)?;
        refuse_nothing(kept.surface.triangles.len() as u64, report.voxel, params.min_component_share)?;
    }
    Ok(())
}

/// What was closed and what wasn't.
pub struct Closed {
    /// Holes closed.
    pub closed: u64,
    /// Boundary loops left open.
    pub open: u64,
    /// Pieces that came off and were dropped, and their triangles.
    pub dropped: [u64; 2],
    /// Vertices that have no triangle any more.
    pub bare: Vec<u32>,
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

impl Limit {
    /// As asked for, or the default for what is of this size; said in the report.
    pub fn of(params: &MergeParams, report: &mut MergeReport, size: DVec3) -> Self {
        let length = params.max_hole_length.unwrap_or((HOLE_VOXELS * report.voxel).min(HOLE_SHARE * size.length()));
        report.max_hole_length = length;
        match params.max_hole_length {
            Some(length) => Limit::Length(length),
            None => Limit::OfPart(length, HOLE_SHARE),
        }
    }

    /// That of a part.
    pub fn of_part(&self, part: &Part) -> f64 {
        match *self {
            Limit::Length(length) => length,
            Limit::OfPart(length, share) => length.min(share * part.low.distance(part.high)),
        }
    }

    /// That of no part.
    pub fn length(&self) -> f64 {
        let (Limit::Length(length) | Limit::OfPart(length, _)) = *self;
        length
    }
}

/// Closes all holes with a boundary within `limit`; `part_of` is the part of each vertex. Pieces of fewer than `least` triangles that come
/// off where that needs it are dropped.
///
/// # Errors
/// Cancelled.
pub fn close_holes(
    surface: &mut Surface,
    parts: &[Part],
    part_of: &[u32],
    limit: Limit,
    least: f64,
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
    let peeled = peel::close_stuck(surface, &stuck, |vertices| limits.of(vertices), least, lattice, progress)?;
    Ok(Closed {
        closed: report.closed as u64 + peeled.closed,
        open: report.open.len() as u64 - peeled.holes,
        dropped: peeled.dropped,
        bare: peeled.bare,
    })
}

/// The limit of each loop.
struct Limits<'a> {
    length: f64,
    /// Of each part.
    of_part: Vec<f64>,
    /// The part of each vertex.
    part_of: &'a [u32],
}

impl<'a> Limits<'a> {
    fn new(parts: &[Part], part_of: &'a [u32], limit: Limit) -> Self {
        Limits { length: limit.length(), of_part: parts.iter().map(|part| limit.of_part(part)).collect(), part_of }
    }

    fn of(&self, vertices: &[u32]) -> f64 {
        // Vertices that were split off lie beside others of their part.
        let part = vertices.iter().find_map(|&v| self.part_of.get(v as usize));
        part.and_then(|&part| self.of_part.get(part as usize)).copied().unwrap_or(self.length)
    }
}
