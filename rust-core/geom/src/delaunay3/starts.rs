//! Starts of the walks of a thread when the way from the last point leads through cells of other threads: at a cell of its own near the
//! point.
//!
//! Along the curve a thread's points leave its block and come back elsewhere. The cells of a surface span the space beside it, so the
//! way there is rarely its own.

use glam::DVec3;

use super::cells::{Cells, GHOST};
use super::region::{Block, Region};

/// Boxes along each axis at most, and points for a box that a surface passes through.
const MOST: f64 = 64.0;
const POINTS_A_BOX: f64 = 64.0;

/// Cells looked at for each box that a surface passes through.
const CELLS_A_BOX: usize = 8;

/// No cell.
const NONE: u32 = u32::MAX;

/// One of a thread's cells for each box of a grid over its points.
pub(super) struct Starts {
    low: DVec3,
    boxes_per_length: DVec3,
    side: usize,
    cells: Vec<u32>,
}

impl Starts {
    /// Of the cells there are before the threads begin, for a thread that inserts some of `count` points.
    pub(super) fn new(cells: &Cells, block: &Block, points: &[DVec3], count: usize) -> Self {
        let side = (count as f64 / POINTS_A_BOX).sqrt().clamp(2.0, MOST) as usize;
        let step = (cells.taken() as usize / (CELLS_A_BOX * side * side)).max(1);
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let mut own: Vec<(f64, u32, DVec3)> = Vec::new();
        for cell in (0..cells.taken()).step_by(step) {
            let vertices = cells.vertices(cell);
            // A number that was never in use has four times the same vertex.
            if !cells.is_used(cell) || vertices[0] == vertices[1] || vertices[3] == GHOST {
                continue;
            }
            if block.owns(vertices, points) {
                let [a, b, c, d] = vertices.map(|v| points[v as usize]);
                let length = a.distance_squared(b).max(a.distance_squared(c)).max(a.distance_squared(d));
                (low, high) = (low.min(a), high.max(a));
                own.push((length, cell, a));
            }
        }
        let boxes_per_length = side as f64 / (high - low).max(DVec3::splat(f64::MIN_POSITIVE));
        let mut starts = Starts { low, boxes_per_length, side, cells: vec![NONE; side * side * side] };
        // The smallest cell last, which stays: the others of a surface span the space beside it.
        own.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
        own.into_iter().for_each(|(_, cell, place)| starts.enter(place, cell));
        starts
    }

    /// Notes a cell at a place.
    #[inline]
    pub(super) fn enter(&mut self, place: DVec3, cell: u32) {
        let at = self.place(place);
        self.cells[at] = cell;
    }

    /// The cell noted last in the box of a place. Since then it may have made way for others of the same thread.
    pub(super) fn near(&self, place: DVec3) -> Option<u32> {
        Some(self.cells[self.place(place)]).filter(|&cell| cell != NONE)
    }

    fn place(&self, place: DVec3) -> usize {
        // A cast saturates, and takes NaN to 0.
        let at = ((place - self.low) * self.boxes_per_length).to_array().map(|x| (x as usize).min(self.side - 1));
        (at[2] * self.side + at[1]) * self.side + at[0]
    }
}
