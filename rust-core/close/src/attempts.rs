//! Attempts one after the other, for as long as fills are stuck: where the level set runs beside the border is another chance.

use base::error::{Error, Result};
use base::progress::Progress;
use mesh::measure::area;
use mesh::{TriMesh, check};

use super::attempt::{Attempt, State, Tried};
use super::judge::opening_report;
use super::openings::Border;
use super::params::{CloseParams, FILL_CELLS, Openings};
use super::report::{CloseReport, Closed, LeftOpen};
use super::stages::{JUDGING, PLAN, PREPARING};
use super::surface::Surface;
use super::visibility::{Blind, Ground, Visibility};
use super::{attributes, cells};

/// The default cell by the median edge of a merge: its vertices lie on the edges of cells.
const CELL_BY_EDGE: f64 = 1.3;
/// The default longest hole, in cells.
const HOLE_CELLS: f64 = 100.0;
/// Attempts by the number of cells to a cell of the fill: as it is, finer, coarser.
pub const FINENESS: [f64; 3] = [1.0, 1.25, 0.8];

/// Closes a surface. `fineness` has the cells of each attempt, to a cell of the fill. An attempt takes over the fills of the one before
/// that are not stuck.
pub fn run(
    mesh: &TriMesh,
    visibility: &dyn Visibility,
    params: &CloseParams,
    fineness: &[f64],
    progress: &Progress<'_>,
) -> Result<Closed> {
    progress.stage(PREPARING, 1);
    let has_sight = !visibility.is_blind();
    let up = params.base_up.direction();
    let lowest = mesh.positions.iter().map(|place| place.dot(up)).fold(f64::INFINITY, f64::min);
    let height = lowest - params.base_depth;
    let (ground, bare_ground) = (Ground { visibility, up, height }, Ground { visibility: &Blind, up, height });
    let visibility: &dyn Visibility = if params.flat_base { &ground } else { visibility };
    let mut report = measures(mesh, has_sight, params);
    let mut state = State::new(mesh);
    let mut best: Option<Tried> = None;
    let mut fineness = fineness.to_vec();
    if params.flat_base && fineness.len() > 1 {
        fineness.splice(0..0, cells::over_base(mesh, up, height, FILL_CELLS * report.cell));
    }
    if params.flat_base {
        let room = cells::depth_needed(mesh, up, height, FILL_CELLS * report.cell);
        report.base_room = Some(room).filter(|room| *room > params.base_depth);
    }
    let (mut turn, mut is_for_walls) = (0, false);
    while let Some(&finer) = fineness.get(turn) {
        let surface = Surface::new(&state.mesh, params.threads, progress)?;
        let border = Border::new(&surface);
        progress.lap(PLAN[PREPARING].0);
        refuse_loose(&state.mesh, &border)?;
        if !wanted(&border, params.openings, report.max_hole_length.unwrap_or(f64::INFINITY)) {
            let left = Some(reason_alone(params.openings));
            let openings = (0..border.loops.len() as u32).map(|number| opening_report(&border, &[number], left));
            state.closed.extend(openings);
            break;
        }
        let floor: Option<&dyn Visibility> = if params.flat_base { Some(&bare_ground) } else { None };
        let attempt =
            Attempt { surface: &surface, border: &border, state: &state, params, visibility, floor, height, finer };
        let (tried, rest, fill_cell) = match attempt.run(&report, progress) {
            // Without memory for finer cells there are the others.
            Err(Error::OutOfMemory(_)) if finer > 1.0 && turn + 1 < fineness.len() => {
                turn += 1;
                continue;
            }
            found => found?,
        };
        if !is_for_walls && fineness.len() > 1 {
            is_for_walls = true;
            let walls = cells::for_walls(&surface, &border, &tried.openings, fill_cell * finer, progress)?;
            fineness.splice(turn + 1..turn + 1, walls);
        }
        let is_best = best.as_ref().is_none_or(|best| tried.open_edges < best.open_edges);
        if is_best {
            (best, report.fill_cell) = (Some(tried), fill_cell);
        }
        match rest {
            Some(rest) => state = rest,
            None if is_best => break,
            // Cells that are worse end nothing.
            None => {}
        }
        turn += 1;
        progress.stage(PREPARING, 1);
    }
    let found = best.unwrap_or(Tried { mesh: state.mesh, forced: state.forced, openings: state.closed, open_edges: 0 });
    let mut result = TriMesh { crs: mesh.crs.clone(), ..found.mesh };
    report.openings = found.openings;
    attributes::extend(&mut result, mesh, &found.forced, progress)?;
    finish(&mut report, &result, mesh);
    progress.lap(PLAN[JUDGING].0);
    report.seconds = progress.seconds();
    Ok(Closed { mesh: result, report })
}

/// Lengths as given or measured.
pub fn measures(mesh: &TriMesh, has_sight: bool, params: &CloseParams) -> CloseReport {
    let cell = params.cell.unwrap_or_else(|| CELL_BY_EDGE * mesh.median_edge());
    let longest = params.max_hole_length.unwrap_or(HOLE_CELLS * cell);
    CloseReport {
        cell,
        fill_cell: FILL_CELLS * cell,
        merge_distance: params.merge_distance.unwrap_or(cell),
        max_hole_length: (params.openings == Openings::Holes).then_some(longest),
        has_sight,
        ..CloseReport::default()
    }
}

/// Refuses triangles that hang together nowhere.
fn refuse_loose(mesh: &TriMesh, border: &Border) -> Result<()> {
    let count = mesh.triangles.len();
    if count > 1 && border.loops.iter().map(|edge_loop| edge_loop.edges).sum::<usize>() == 3 * count {
        return Err(Error::input(format!(
            "no two of the {count} triangles share an edge, and each would be closed by itself: merge vertices at one place first"
        )));
    }
    Ok(())
}

/// Whether anything is to be closed.
fn wanted(border: &Border, openings: Openings, longest: f64) -> bool {
    openings != Openings::None && border.loops.iter().any(|edge_loop| edge_loop.length <= longest)
}

fn reason_alone(openings: Openings) -> LeftOpen {
    if openings == Openings::None { LeftOpen::NotAsked } else { LeftOpen::TooLong }
}

/// The figures of the whole.
fn finish(report: &mut CloseReport, result: &TriMesh, mesh: &TriMesh) {
    let first = mesh.triangles.len();
    report.added = [result.positions.len() - mesh.positions.len(), result.triangles.len() - first];
    let sum = |range: std::ops::Range<usize>| range.map(|t| area(result.corners(t))).sum();
    let [filled, measured]: [f64; 2] = [sum(first..result.triangles.len()), sum(0..first)];
    report.filled_area = filled;
    report.filled_share = if filled > 0.0 { filled / (filled + measured) } else { 0.0 };
    report.count_openings(result);
    let judged = check(result);
    report.open_edges = judged.boundary_edges;
    report.is_closed = judged.is_closed();
}
