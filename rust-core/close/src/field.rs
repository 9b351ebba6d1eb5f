//! The field of the closed surface: a start, then the fill's distances as smooth as can be, outside of what was seen.
//!
//! From coarse to fine, and on each grid several times: nodes near the zero level are solved for, those beyond have the distances of the
//! level of the last time, values and slopes. So the squared Laplacian over the band is, up to a factor, the squared mean curvature of the
//! level, and a part of a ball is continued as a ball. Coarse grids carry this over large openings in a few solves.
//! Finer grids lie around openings alone: elsewhere the surface is measured.

use glam::DVec3;
use rayon::prelude::*;

use base::error::Result;
use base::memory;
use base::progress::Progress;

use super::grid::Grid;
use super::nodes::Nodes;
use super::plate::Plate;
use super::surface::Surface;
use super::visibility::Envelope;
use super::{distance, known, poisson, thickness};

/// Distance from its zero level within which the field is solved for, in cells.
const BAND: f64 = 4.0;
/// The grids: cells of the finest in a cell, and times that it is solved.
const GRIDS: [(f64, usize); 4] = [(8.0, 2), (4.0, 1), (2.0, 1), (1.0, 1)];
/// Largest cell, as a share of the greatest distance of the start from the surface: coarser ones lose thin parts and carry nothing farther.
const OPENING_CELL: f64 = 0.75;
/// Cells of the finest grid in a cell of the start's.
const START: f64 = 2.0;
/// The start is thinner where its level lies farther from the surface than this many walls.
const SWOLLEN: f64 = 1.5;
/// Distance of the outer bound from the surface: a share of its longest side, and cells.
const MARGIN: f64 = 0.15;
const MARGIN_CELLS: f64 = 12.0;
/// Nodes of the next finer grid reach so far from the level that fills, in cells: it may move by a half of them.
const MARKED: usize = 4;
/// The field is solved for up to so far from the level that fills, along each axis, in cells. Beyond it the surface is measured.
const BESIDE: usize = 6;
/// Most nodes of the start's grid: cells are larger where it takes more.
const MOST_NODES: f64 = 2e6;
/// Of the start, at the peak. Measured.
const BYTES_A_NODE: f64 = 200.0;
/// Steps that progress counts.
pub const STEPS: u64 = 7;

/// States of nodes.
const NOT_ASKED: u8 = 0;
const SEEN: u8 = 1;
const NOT_SEEN: u8 = 2;

/// Space that the grids cover, and how finely.
#[derive(Clone, Copy, Debug)]
pub struct Extent {
    lo: DVec3,
    hi: DVec3,
    cell: f64,
    margin: f64,
}

impl Extent {
    /// Of a box in cells of this size, or larger ones if these were too many.
    pub fn new(lo: DVec3, hi: DVec3, cell: f64) -> Self {
        let margin = MARGIN * (hi - lo).max_element();
        let size = hi - lo + 2.0 * margin;
        let least = (size.x * size.y * size.z / MOST_NODES).cbrt().max(size.max_element() / MOST_NODES);
        let cell = cell.max(least / START);
        Extent { lo, hi, cell, margin: margin + MARGIN_CELLS * cell }
    }

    fn grid(&self, cells: f64) -> Grid {
        Grid::around(self.lo, self.hi, cells * self.cell, self.margin)
    }
}

/// Solves for the field. Returns the nodes of the finest grid around openings and its values, negative inside. Where a scan saw that
/// nothing is they are not negative.
///
/// # Errors
/// [`base::Error::OutOfMemory`]. [`base::Error::Cancelled`].
pub fn solve(
    surface: &Surface<'_>,
    extent: &Extent,
    envelope: Envelope<'_>,
    progress: &Progress<'_>,
) -> Result<(Nodes, Vec<f64>)> {
    solve_around(surface, extent, MARKED, envelope, progress)
}

/// [`solve`] with nodes so far around openings.
pub fn solve_around(
    surface: &Surface<'_>,
    extent: &Extent,
    marked: usize,
    envelope: Envelope<'_>,
    progress: &Progress<'_>,
) -> Result<(Nodes, Vec<f64>)> {
    let Start { mut nodes, mut field, mut level, coarsest, depth } = start(surface, extent, envelope, progress)?;
    progress.advance(1)?;
    let used = GRIDS.iter().position(|&(cells, _)| cells * extent.cell <= coarsest).unwrap_or(GRIDS.len() - 1);
    for &(cells, times) in &GRIDS[used..] {
        let grid = extent.grid(cells);
        let next = match grid.cell > nodes.grid.cell {
            true => Nodes::all(grid)?,
            false => nodes.finer(&nodes.grown(level, marked, progress)?, grid, progress)?,
        };
        field = nodes.resampled(&field, &next, progress)?;
        nodes = next;
        level = Vec::new();
        for _ in 0..times {
            (field, level) = once(surface, &nodes, depth, field, envelope, progress)?;
            progress.advance(1)?;
        }
    }
    Ok((nodes, field))
}

/// The field to begin with.
struct Start {
    nodes: Nodes,
    field: Vec<f64>,
    /// The nodes at the part of its level that fills.
    level: Vec<bool>,
    /// Largest cell to be used.
    coarsest: f64,
    /// Distances are known so deep behind the surface.
    depth: f64,
}

/// A screened Poisson surface. Where all that was measured from both sides is thin, it does not swell behind the rest.
fn start(surface: &Surface<'_>, extent: &Extent, envelope: Envelope<'_>, progress: &Progress<'_>) -> Result<Start> {
    let grid = extent.grid(START);
    let nodes = grid.len();
    let bytes = BYTES_A_NODE * nodes as f64;
    memory::expect(bytes, || format!("closing on a grid of {nodes} nodes"), "give a larger cell, or raise the limit")?;
    let mut field: Vec<f64> = poisson::start(surface.mesh, &grid, progress)?.into_iter().map(|x| -x).collect();
    let nodes = Nodes::all(grid)?;
    let (width, level) = look(surface, &nodes, &field, envelope, progress)?;
    let wall = thickness::of_walls(surface, progress)?;
    if width <= SWOLLEN * wall {
        return Ok(Start { nodes, field, level, coarsest: OPENING_CELL * width, depth: f64::INFINITY });
    }
    let is_far = |n: usize| surface.bvh.closest_point_within(nodes.place(n), SWOLLEN * wall).is_none();
    field.par_chunks_mut(1 << 10).enumerate().try_for_each(|(chunk, field)| {
        progress.check()?;
        for (i, value) in field.iter_mut().enumerate().filter(|(_, value)| **value < 0.0) {
            if is_far((chunk << 10) + i) {
                *value = f64::MIN_POSITIVE;
            }
        }
        Ok(())
    })?;
    let (width, level) = look(surface, &nodes, &field, envelope, progress)?;
    // Deeper than half of the wall its other side is nearer, seen or not.
    Ok(Start { nodes, field, level, coarsest: wall.min(OPENING_CELL * width), depth: 0.5 * wall })
}

/// Looks at the start, out of seen space. Returns the largest distance of its level from the surface, and the nodes at the part of the level
/// that fills.
fn look(
    surface: &Surface<'_>,
    nodes: &Nodes,
    field: &[f64],
    envelope: Envelope<'_>,
    progress: &Progress<'_>,
) -> Result<(f64, Vec<bool>)> {
    let mut seen = vec![NOT_ASKED; nodes.len()];
    let inside: Vec<u32> = (0..nodes.len() as u32).filter(|&n| field[n as usize] < 0.0).collect();
    ask(nodes, envelope, &inside, &mut seen, progress)?;
    let is_inside = |node: usize| field[node] < 0.0 && seen[node] != SEEN;
    let at_level: Vec<u32> =
        inside.into_iter().filter(|&n| is_inside(n as usize) && !nodes.beside(n as usize).all(is_inside)).collect();
    // The distance where the start has its level itself, and whether the node is at the fill.
    let found: Vec<Vec<(f64, bool)>> = at_level
        .par_chunks(256)
        .map(|numbers| {
            progress.check()?;
            let mut hint = None;
            let look = |&node: &u32| {
                let node = node as usize;
                let beside = surface.beside_from(nodes.place(node), &mut hint);
                let distance = beside.map_or(f64::INFINITY, |beside| beside.distance.abs());
                let is_of_start = nodes.beside(node).any(|other| field[other] >= 0.0);
                let is_measured =
                    beside.is_some_and(|beside| !beside.is_at_border) && distance <= known::LAYERS * nodes.grid.cell;
                (if is_of_start { distance } else { 0.0 }, !is_measured)
            };
            Ok(numbers.iter().map(look).collect())
        })
        .collect::<Result<_>>()?;
    let found = found.concat();
    let mut level = vec![false; nodes.len()];
    for (&node, &(_, fills)) in at_level.iter().zip(&found) {
        level[node as usize] = fills;
    }
    for ([from, _], _) in surface.border() {
        let (first, _) = nodes.grid.cell_of(surface.mesh.positions[from as usize]);
        level[first] = true;
    }
    Ok((found.into_iter().map(|found| found.0).fold(0.0, f64::max), level))
}

/// One solve, with distances known so deep behind the surface. Returns the field, and the nodes at the part of its level that fills.
fn once(
    surface: &Surface<'_>,
    nodes: &Nodes,
    depth: f64,
    mut field: Vec<f64>,
    envelope: Envelope<'_>,
    progress: &Progress<'_>,
) -> Result<(Vec<f64>, Vec<bool>)> {
    let known = known::near(surface, nodes, depth, progress)?;
    let mut is_known = vec![false; nodes.len()];
    known.iter().for_each(|&(node, _)| is_known[node as usize] = true);
    let mut seen = vec![NOT_ASKED; nodes.len()];
    let inside: Vec<u32> =
        (0..nodes.len() as u32).filter(|&n| !is_known[n as usize] && field[n as usize] < 0.0).collect();
    ask(nodes, envelope, &inside, &mut seen, progress)?;
    for &node in inside.iter().filter(|&&node| seen[node as usize] == SEEN) {
        field[node as usize] = f64::MIN_POSITIVE;
    }
    for (node, value) in field.iter_mut().enumerate() {
        if *value < 0.0 && nodes.is_outermost(node) {
            *value = f64::MIN_POSITIVE;
        }
    }
    let mut field = distance::signed(nodes, &field, &known, progress)?;
    let fills = nodes.grown(level_that_fills(nodes, &field, &is_known), BESIDE, progress)?;
    let reach = BAND * nodes.grid.cell;
    let is_free = |n: usize| fills[n] && !is_known[n] && field[n].abs() <= reach && nodes.is_within(n);
    let free: Vec<u32> = (0..nodes.len() as u32).filter(|&n| is_free(n as usize)).collect();
    ask(nodes, envelope, &free, &mut seen, progress)?;
    let is_seen: Vec<bool> = free.iter().map(|&node| seen[node as usize] == SEEN).collect();
    Plate { nodes, free: &free, is_seen: &is_seen }.solve(&mut field, progress)?;
    let level = level_that_fills(nodes, &field, &is_known);
    Ok((field, level))
}

/// Nodes at the level where it was not measured.
fn level_that_fills(nodes: &Nodes, field: &[f64], is_known: &[bool]) -> Vec<bool> {
    let crosses = |node: usize, other: usize| (field[other] < 0.0) != (field[node] < 0.0);
    (0..nodes.len()).map(|node| !is_known[node] && nodes.beside(node).any(|other| crosses(node, other))).collect()
}

/// Asks what was seen at nodes that were not asked about yet.
fn ask(nodes: &Nodes, envelope: Envelope<'_>, asked: &[u32], seen: &mut [u8], progress: &Progress<'_>) -> Result<()> {
    if envelope.visibility.is_blind() {
        return Ok(());
    }
    let new: Vec<u32> = asked.iter().copied().filter(|&node| seen[node as usize] == NOT_ASKED).collect();
    let answers: Vec<Vec<u8>> = new
        .par_chunks(512)
        .map(|numbers| {
            progress.check()?;
            let answer = |&node: &u32| if envelope.is_seen(nodes.place(node as usize)) { SEEN } else { NOT_SEEN };
            Ok(numbers.iter().map(answer).collect())
        })
        .collect::<Result<_>>()?;
    for (node, answer) in new.iter().zip(answers.into_iter().flatten()) {
        seen[*node as usize] = answer;
    }
    Ok(())
}
