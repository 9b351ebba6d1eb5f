//! One attempt in cells of one size: the stages in their order.

use glam::DVec3;

use base::error::Result;
use base::progress::Progress;
use mesh::TriMesh;
use mesh::measure::bounds;

use super::field::{self, Extent};
use super::judge::{Judge, Settled};
use super::openings::Border;
use super::params::{CloseParams, FILL_CELLS};
use super::report::{CloseReport, LeftOpen, OpeningReport};
use super::retreat::NearMeasured;
use super::stages::{JOINING, JUDGING, PLAN, SOLVING};
use super::stitch::Growing;
use super::surface::Surface;
use super::visibility::{Envelope, Visibility};
use super::{cut, foot, level, retreat};

/// Times that fills in seen space move back, or are closed anew where they can't.
const RETREATS: usize = 3;
/// The most steps in a cell of the fill, so that tiny cells of the merge take no endless time.
const MOST_STEPS: f64 = 16.0;
/// More stuck fills than this are of scans that contradict each other, whatever the cells.
const MOST_STUCK: usize = 8;

/// The surface as far as it is closed.
pub struct State {
    /// Without attributes. What was measured comes first.
    pub mesh: TriMesh,
    /// Of each of its faces.
    pub forced: Vec<bool>,
    /// The openings that are closed by now.
    pub closed: Vec<OpeningReport>,
}

impl State {
    /// Nothing of it.
    pub fn new(mesh: &TriMesh) -> Self {
        State {
            mesh: TriMesh::new(mesh.positions.clone(), mesh.triangles.clone()),
            forced: vec![false; mesh.triangles.len()],
            closed: Vec::new(),
        }
    }
}

/// The result of an attempt.
pub struct Tried {
    pub mesh: TriMesh,
    pub forced: Vec<bool>,
    pub openings: Vec<OpeningReport>,
    pub open_edges: usize,
}

/// One way through the stages.
pub struct Attempt<'a> {
    pub surface: &'a Surface<'a>,
    pub border: &'a Border,
    pub state: &'a State,
    pub params: &'a CloseParams,
    pub visibility: &'a dyn Visibility,
    /// The ground alone: it holds for forced faces, too.
    pub floor: Option<&'a dyn Visibility>,
    /// Height of the ground.
    pub height: f64,
    /// Cells to a cell of the merge.
    pub finer: f64,
}

impl Attempt<'_> {
    /// The surface closed, and, if openings are left whose fills cross something, the surface without these fills. Also the cell of the
    /// fill.
    pub fn run(&self, report: &CloseReport, progress: &Progress<'_>) -> Result<(Tried, Option<State>, f64)> {
        let &Attempt { surface, border, params, visibility, .. } = self;
        let envelope = Envelope { visibility, tolerance: report.merge_distance };
        let strict = Envelope { tolerance: report.merge_distance + 0.5 * report.cell, ..envelope };
        progress.stage(SOLVING, field::STEPS);
        let extent = extent(surface.mesh, params, report.cell / self.finer);
        let (nodes, field) = field::solve(surface, &extent, envelope, progress)?;
        let fill_cell = nodes.grid.cell;
        progress.lap(PLAN[SOLVING].0);
        progress.stage(JOINING, 1);
        let place = |a, b, t| level::between([a, b].map(|node| nodes.place(node)), t);
        let level = level::extract(nodes.cells(), &field, place, progress)?;
        drop((nodes, field));
        let fill = cut::beyond_borders(&level, surface, fill_cell, progress)?;
        let mut growing = Growing::new(surface, &fill);
        let step = report.cell.max(fill_cell / MOST_STEPS);
        retreat::retreat(&mut growing, envelope, step, progress)?;
        growing.join(fill_cell, progress)?;
        for _ in 0..RETREATS {
            retreat::retreat(&mut growing, envelope, step, progress)?;
            growing.repair(progress)?;
            let seen = retreat::in_seen_space(&growing, strict, step, NearMeasured::Passed, progress)?;
            if params.force || !seen.contains(&true) {
                break;
            }
            growing.close_anew_around(&seen, progress)?;
        }
        let max_hole_length = report.max_hole_length;
        let floor = self.floor.map(|visibility| Envelope { visibility, ..strict });
        let has_sight = report.has_sight;
        let judge = Judge { surface, border, params, envelope, strict, floor, step, max_hole_length, has_sight };
        judge.mend(&mut growing, progress)?;
        growing.drop_loose(progress)?;
        progress.lap(PLAN[JOINING].0);
        progress.stage(JUDGING, 1);
        let mut settled = judge.settle(&mut growing, progress)?;
        let known = self.state.forced.len();
        settled.forced[..known].copy_from_slice(&self.state.forced);
        let open_edges = growing.open_edges(progress)?.len();
        let stuck = settled.openings.iter().filter(|opening| opening.left_open == Some(LeftOpen::Crossing)).count();
        let rest =
            if (1..=MOST_STUCK).contains(&stuck) { Some(self.without(&growing, &settled, progress)?) } else { None };
        judge.blame_base(&mut settled.openings);
        if self.floor.is_some() {
            let seen = Some(strict).filter(|_| !params.force);
            foot::flatten(&mut growing, params.base_up.direction(), self.height, fill_cell, seen, step, progress)?;
        }
        let openings = [&self.state.closed[..], &settled.openings].concat();
        growing.drop_unused();
        let mesh = TriMesh::new(growing.positions, growing.triangles);
        Ok((Tried { mesh, forced: settled.forced, openings, open_edges }, rest, fill_cell))
    }

    /// The surface without fills that are stuck.
    fn without(&self, growing: &Growing, settled: &Settled, progress: &Progress<'_>) -> Result<State> {
        let mut growing = growing.clone();
        let kept = growing.take_away(&settled.stuck, progress)?;
        growing.drop_unused();
        let closed = settled.openings.iter().filter(|opening| opening.left_open.is_none()).cloned();
        Ok(State {
            mesh: TriMesh::new(growing.positions, growing.triangles),
            forced: kept.iter().map(|&t| settled.forced[t as usize]).collect(),
            closed: self.state.closed.iter().cloned().chain(closed).collect(),
        })
    }
}

/// Of the surface down to its base.
fn extent(mesh: &TriMesh, params: &CloseParams, cell: f64) -> Extent {
    let (lo, hi) = bounds(&mesh.positions).expect("a mesh with triangles has vertices");
    let down = if params.flat_base { -params.base_depth * params.base_up.direction() } else { DVec3::ZERO };
    Extent::new(lo.min(lo + down), hi.max(hi + down), FILL_CELLS * cell)
}
