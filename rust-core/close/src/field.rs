//! The field of the closed surface: a start, then the fill's distances as smooth as can be, outside of what was seen.
//!
//! From coarse to fine, and on each grid several times: nodes near the zero level are solved for, those beyond have the distances of the
//! level of the last time, values and slopes. So the squared Laplacian over the band is, up to a factor, the squared mean curvature of the
//! level, and a part of a ball is continued as a ball. Coarse grids carry this over large openings in a few solves.

use glam::DVec3;
use rayon::prelude::*;

use base::error::Result;
use base::memory;
use base::progress::Progress;

use super::grid::Grid;
use super::plate::Plate;
use super::surface::Surface;
use super::visibility::Envelope;
use super::{distance, known, poisson};

/// Distance from its zero level within which the field is solved for, in cells.
const BAND: f64 = 4.0;
/// The grids: cells of the finest in a cell, and times that it is solved.
const GRIDS: [(f64, usize); 4] = [(8.0, 2), (4.0, 1), (2.0, 1), (1.0, 1)];
/// Largest cell, as a share of the greatest distance of the start from the surface: coarser ones lose thin parts and carry nothing farther.
const OPENING_CELL: f64 = 0.75;
/// Cells of the finest grid in a cell of the start's.
const START: f64 = 2.0;
/// Distance of the outer bound from the surface: a share of its longest side, and cells.
const MARGIN: f64 = 0.15;
const MARGIN_CELLS: f64 = 12.0;
/// Most nodes of the finest grid: cells are larger where it takes more.
const MOST_NODES: f64 = 6e6;
/// At the peak. Measured.
const BYTES_A_NODE: f64 = 100.0;
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
        let cell = cell.max(least);
        Extent { lo, hi, cell, margin: margin + MARGIN_CELLS * cell }
    }

    fn grid(&self, cells: f64) -> Grid {
        Grid::around(self.lo, self.hi, cells * self.cell, self.margin)
    }
}

/// Solves for the field. Returns the finest grid and its values, negative inside and positive on the outer bound. Where a scan saw that
/// nothing is they are not negative.
///
/// # Errors
/// [`base::Error::OutOfMemory`]. [`base::Error::Cancelled`].
pub fn solve(
    surface: &Surface<'_>,
    extent: &Extent,
    envelope: Envelope<'_>,
    progress: &Progress<'_>,
) -> Result<(Grid, Vec<f64>)> {
    memory::expect_each(extent.grid(1.0).len(), BYTES_A_NODE, 0.0, "closing", "nodes of the fill's grid")?;
    let mut grid = extent.grid(START);
    let mut field: Vec<f64> = poisson::start(surface.mesh, &grid, progress)?.into_iter().map(|x| -x).collect();
    let coarsest = OPENING_CELL * width(surface, &grid, &field, envelope, progress)?;
    progress.advance(1)?;
    let used = GRIDS.iter().position(|&(cells, _)| cells * extent.cell <= coarsest).unwrap_or(GRIDS.len() - 1);
    let mut asked = vec![true; grid.len()];
    for &(cells, times) in &GRIDS[used..] {
        let next = extent.grid(cells);
        field = resampled(&grid, &field, &next, progress)?;
        asked = if cells == GRIDS[used].0 { vec![true; next.len()] } else { around(&grid, &asked, &next, progress)? };
        grid = next;
        let mut free = Vec::new();
        for _ in 0..times {
            (field, free) = once(surface, &grid, field, &asked, envelope, progress)?;
            progress.advance(1)?;
        }
        asked = free;
    }
    Ok((grid, field))
}

/// Largest distance of the start's level from the surface, out of seen space.
fn width(
    surface: &Surface<'_>,
    grid: &Grid,
    field: &[f64],
    envelope: Envelope<'_>,
    progress: &Progress<'_>,
) -> Result<f64> {
    let is_at_level =
        |node: usize| field[node] < 0.0 && grid.neighbours(node).into_iter().flatten().any(|other| field[other] >= 0.0);
    let nodes: Vec<usize> = (0..grid.len()).filter(|&node| is_at_level(node)).collect();
    let distances: Vec<f64> = nodes
        .par_chunks(256)
        .map(|nodes| {
            progress.check()?;
            let mut hint = None;
            let places = nodes.iter().map(|&node| grid.place(node)).filter(|place| !envelope.is_seen(*place));
            let distances = places.filter_map(|place| surface.beside_from(place, &mut hint)).map(|b| b.distance.abs());
            Ok(distances.fold(0.0, f64::max))
        })
        .collect::<Result<_>>()?;
    Ok(distances.into_iter().fold(0.0, f64::max))
}

/// The nodes of a grid that lie within about a cell of marked nodes of a coarser one.
fn around(coarse: &Grid, marked: &[bool], fine: &Grid, progress: &Progress<'_>) -> Result<Vec<bool>> {
    let mut grown = marked.to_vec();
    for stride in coarse.strides() {
        progress.check()?;
        let before = grown.clone();
        for node in stride..coarse.len() {
            grown[node] |= before[node - stride];
            grown[node - stride] |= before[node];
        }
    }
    let is_near = |node: usize| {
        let (first, fraction) = coarse.cell_of(fine.place(node));
        coarse.corners(first, fraction).iter().any(|corner| grown[corner.0])
    };
    let mut near = vec![false; fine.len()];
    near.par_chunks_mut(1 << 14).enumerate().try_for_each(|(chunk, near)| {
        progress.check()?;
        near.iter_mut().enumerate().for_each(|(i, near)| *near = is_near((chunk << 14) + i));
        Ok(())
    })?;
    Ok(near)
}

/// A field on another grid.
fn resampled(from: &Grid, field: &[f64], to: &Grid, progress: &Progress<'_>) -> Result<Vec<f64>> {
    let mut values = vec![0.0; to.len()];
    values.par_chunks_mut(1 << 14).enumerate().try_for_each(|(chunk, values)| {
        progress.check()?;
        for (i, value) in values.iter_mut().enumerate() {
            *value = from.sample(field, to.place((chunk << 14) + i));
        }
        Ok(())
    })?;
    Ok(values)
}

/// One solve. Nodes that are not `asked` for keep their values: they hold distances. Returns the field, and which nodes it was solved for.
fn once(
    surface: &Surface<'_>,
    grid: &Grid,
    mut field: Vec<f64>,
    asked: &[bool],
    envelope: Envelope<'_>,
    progress: &Progress<'_>,
) -> Result<(Vec<f64>, Vec<bool>)> {
    let known = known::near(surface, grid, asked, progress)?;
    let mut is_known = vec![false; grid.len()];
    known.iter().for_each(|&(node, _)| is_known[node as usize] = true);
    let mut seen = vec![NOT_ASKED; grid.len()];
    let inside: Vec<u32> = (0..grid.len() as u32)
        .filter(|&n| asked[n as usize] && !is_known[n as usize] && field[n as usize] < 0.0)
        .collect();
    ask(grid, envelope, &inside, &mut seen, progress)?;
    for &node in inside.iter().filter(|&&node| seen[node as usize] == SEEN) {
        field[node as usize] = f64::MIN_POSITIVE;
    }
    for (node, value) in field.iter_mut().enumerate() {
        if *value < 0.0 && grid.is_outermost(node) {
            *value = f64::MIN_POSITIVE;
        }
    }
    let mut field = distance::signed(grid, &field, &known, asked, progress)?;
    let is_free = |n: usize| asked[n] && !is_known[n] && field[n].abs() <= BAND * grid.cell && !grid.is_outermost(n);
    let is_free: Vec<bool> = (0..grid.len()).map(is_free).collect();
    let free: Vec<u32> = (0..grid.len() as u32).filter(|&n| is_free[n as usize]).collect();
    ask(grid, envelope, &free, &mut seen, progress)?;
    let is_seen: Vec<bool> = free.iter().map(|&node| seen[node as usize] == SEEN).collect();
    Plate { grid, free: &free, is_seen: &is_seen }.solve(&mut field, progress)?;
    Ok((field, is_free))
}

/// Asks what was seen at nodes that were not asked about yet.
fn ask(grid: &Grid, envelope: Envelope<'_>, nodes: &[u32], seen: &mut [u8], progress: &Progress<'_>) -> Result<()> {
    if envelope.visibility.is_blind() {
        return Ok(());
    }
    let new: Vec<u32> = nodes.iter().copied().filter(|&node| seen[node as usize] == NOT_ASKED).collect();
    let answers: Vec<Vec<u8>> = new
        .par_chunks(512)
        .map(|nodes| {
            progress.check()?;
            let answer = |&node: &u32| if envelope.is_seen(grid.place(node as usize)) { SEEN } else { NOT_SEEN };
            Ok(nodes.iter().map(answer).collect())
        })
        .collect::<Result<_>>()?;
    for (node, answer) in new.iter().zip(answers.into_iter().flatten()) {
        seen[*node as usize] = answer;
    }
    Ok(())
}
