//! The driver: the stages in their order.

use glam::DVec3;
use rustc_hash::FxHashSet;

use base::error::{Error, Result, Shown};
use base::memory;
use base::progress::Progress;
use image::source::ScanSource;
use mesh::measure::{area, bounds};
use mesh::{Crs, TriMesh, check};

use super::field::{self, Extent};
use super::openings::{self, Border, Opening};
use super::params::{CloseParams, FILL_CELLS, Openings};
use super::report::{CloseReport, Closed, LeftOpen, OpeningReport};
use super::stitch::Growing;
use super::surface::{Surface, normal};
use super::visibility::{Blind, Envelope, Ground, Scans, Visibility};
use super::{attributes, cells, cut, doubts, fan, foot, level, retreat, turned};

base::stages! {
    /// Stages with their shares of the time.
    PLAN:
    READING = "reading lines of sight", 0.1;
    PREPARING = "looking at the surface", 0.1;
    SOLVING = "solving for the fill", 0.5;
    JOINING = "joining the fill", 0.25;
    JUDGING = "judging openings", 0.05;
}

/// The default cell by the median edge of a merge: its vertices lie on the edges of cells.
const CELL_BY_EDGE: f64 = 1.3;
/// The smallest cell by the median edge: edges of a surface that was simplified are longer than its cells.
const LEAST_CELL: f64 = 0.01;
/// The default longest hole, in cells.
const HOLE_CELLS: f64 = 100.0;
/// Share of an opening's fill that may lie in seen space and be left open as small holes. Beyond it the opening stays as it was.
const LITTLE: f64 = 0.05;
/// Times that fills in seen space move back, or are closed anew where they can't.
const RETREATS: usize = 3;
/// The most steps in a cell of the fill, so that tiny cells of the merge take no endless time.
const MOST_STEPS: f64 = 16.0;
/// Fills that are stuck are tried anew in finer and in coarser cells: where the level set runs beside the border is another chance.
const FINENESS: [f64; 3] = [1.0, 1.25, 0.8];
/// More stuck fills than this are of scans that contradict each other, whatever the cells.
const MOST_STUCK: usize = 8;
/// At the peak. Measured.
const BYTES_A_TRIANGLE: f64 = 400.0;

/// Closes the openings of a surface with a smooth fill that stays out of what its scans saw to be empty.
///
/// `mesh` is an oriented manifold in the world of its scans. Range images whose rays are known say where nothing is. Meshes and points say
/// nothing. Without scans openings are closed by their shape alone.
///
/// # Guarantees
/// * Vertices and triangles of `mesh` come first in the result, to the bit and in their order. What is added is marked.
/// * The result is an oriented manifold. No added face crosses any other.
/// * No place of an added face was seen through by more than the merge distance and half a cell, but of forced faces. Places are looked at
///   every half cell, and farther than that from measured vertices.
/// * Openings that are not closed are in the report, with the reason.
/// * The same result for any number of threads and any order of the scans.
///
/// # Cost
/// Time O(n log n) for n triangles, and O(m) for m nodes of grids: one of at most 3 million with cells four times those of the merge over
/// everything, and one with cells twice as large around openings. About 400 bytes per triangle, 200 and 110 per node, and 11 per pixel of
/// the scans. In things so large that the first grid would have more nodes cells are larger. Openings smaller than two of them are closed by
/// the mesh alone. \[Lie03\]
///
/// # Errors
/// Parameters out of range, or of no use with the others. A mesh that is no oriented manifold: the error says what is wrong. Scans of another
/// coordinate reference system, or that can't be read. Scans none of which meets the surface. [`base::Error::OutOfMemory`].
/// [`base::Error::Cancelled`]. A warning tells of single scans that do not meet it, and of a surface that seems to be inside out.
pub fn close(
    mesh: &TriMesh,
    scans: &[&dyn ScanSource],
    params: &CloseParams,
    progress: &Progress<'_>,
) -> Result<Closed> {
    in_one_world(mesh, scans)?;
    planned(mesh, params, progress, || {
        progress.stage(READING, scans.len() as u64);
        let visibility = Scans::of_sources(scans, progress)?;
        refuse_blind_force(&visibility, params)?;
        doubts::tell_elsewhere(mesh, &visibility, measures(mesh, true, params).merge_distance)?;
        progress.lap(PLAN[READING].0);
        run(mesh, &visibility, params, progress)
    })
}

/// The same with lines of sight that are known already. It is [`super::Blind`] for surfaces without sensors.
///
/// # Errors
/// Those of [`close`].
pub fn close_seen_by(
    mesh: &TriMesh,
    visibility: &dyn Visibility,
    params: &CloseParams,
    progress: &Progress<'_>,
) -> Result<Closed> {
    planned(mesh, params, progress, || run(mesh, visibility, params, progress))
}

/// The same on the pool that it is called on: as a part of another operation, which has planned its stages. `params` have the threads of
/// that pool.
///
/// # Errors
/// Those of [`close`].
#[doc(hidden)]
pub fn close_on_this_pool(
    mesh: &TriMesh,
    visibility: &dyn Visibility,
    params: &CloseParams,
    progress: &Progress<'_>,
) -> Result<Closed> {
    foreseen(mesh, params)?;
    progress.plan(PLAN);
    run(mesh, visibility, params, progress)
}

fn planned(
    mesh: &TriMesh,
    params: &CloseParams,
    progress: &Progress<'_>,
    run: impl FnOnce() -> Result<Closed> + Send,
) -> Result<Closed> {
    params.go_together()?;
    foreseen(mesh, params)?;
    progress.plan(PLAN);
    let pool = base::threads::pool(params.threads)?;
    progress.run(&pool, run)
}

/// Refuses parameters out of range, and work that needs more memory than there is.
fn foreseen(mesh: &TriMesh, params: &CloseParams) -> Result<()> {
    params.validate()?;
    mesh.validate()?;
    refuse_deep_base(mesh, params)?;
    refuse_tiny_cell(mesh, params)?;
    memory::expect_each(mesh.triangles.len(), BYTES_A_TRIANGLE, 0.0, "closing", "triangles")
}

/// Refuses scans that lie in another coordinate reference system than the surface.
fn in_one_world(mesh: &TriMesh, scans: &[&dyn ScanSource]) -> Result<()> {
    let mut systems = vec![("the surface", mesh.crs.clone())];
    for scan in scans {
        systems.push((scan.name(), scan.crs()?));
    }
    Crs::common(systems).map(|_| ())
}

fn run(mesh: &TriMesh, visibility: &dyn Visibility, params: &CloseParams, progress: &Progress<'_>) -> Result<Closed> {
    let closed = run_in_cells(mesh, visibility, params, &FINENESS, progress)?;
    doubts::tell_turned(mesh, visibility, &closed, progress)?;
    Ok(closed)
}

/// Refuses force without scans that say where nothing is.
fn refuse_blind_force(scans: &Scans, params: &CloseParams) -> Result<()> {
    if params.force && scans.is_blind() {
        return Err(Error::input(
            "force is given, but has no use without scans that say where nothing is: give range images, too, or leave force out",
        ));
    }
    Ok(())
}

/// `fineness` has the cells of each attempt to a cell of the merge, for as long as fills are stuck.
pub(crate) fn run_in_cells(
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

/// The surface as far as it is closed.
struct State {
    /// Without attributes. What was measured comes first.
    mesh: TriMesh,
    /// Of each of its faces.
    forced: Vec<bool>,
    /// The openings that are closed by now.
    closed: Vec<OpeningReport>,
}

impl State {
    fn new(mesh: &TriMesh) -> Self {
        State {
            mesh: TriMesh::new(mesh.positions.clone(), mesh.triangles.clone()),
            forced: vec![false; mesh.triangles.len()],
            closed: Vec::new(),
        }
    }
}

/// The result of an attempt.
struct Tried {
    mesh: TriMesh,
    forced: Vec<bool>,
    openings: Vec<OpeningReport>,
    open_edges: usize,
}

/// One way through the stages.
struct Attempt<'a> {
    surface: &'a Surface<'a>,
    border: &'a Border,
    state: &'a State,
    params: &'a CloseParams,
    visibility: &'a dyn Visibility,
    /// The ground alone: it holds for forced faces, too.
    floor: Option<&'a dyn Visibility>,
    /// Height of the ground.
    height: f64,
    /// Cells to a cell of the merge.
    finer: f64,
}

impl Attempt<'_> {
    /// The surface closed, and, if openings are left whose fills cross something, the surface without these fills. Also the cell of the
    /// fill.
    fn run(&self, report: &CloseReport, progress: &Progress<'_>) -> Result<(Tried, Option<State>, f64)> {
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
            let seen = retreat::in_seen_space(&growing, strict, step, progress)?;
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

/// Lengths as given or measured.
fn measures(mesh: &TriMesh, has_sight: bool, params: &CloseParams) -> CloseReport {
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

/// Of the surface down to its base.
fn extent(mesh: &TriMesh, params: &CloseParams, cell: f64) -> Extent {
    let (lo, hi) = bounds(&mesh.positions).expect("a mesh with triangles has vertices");
    let down = if params.flat_base { -params.base_depth * params.base_up.direction() } else { DVec3::ZERO };
    Extent::new(lo.min(lo + down), hi.max(hi + down), FILL_CELLS * cell)
}

/// Refuses a cell so small that it is of another unit, and takes long for nothing.
fn refuse_tiny_cell(mesh: &TriMesh, params: &CloseParams) -> Result<()> {
    let edge = mesh.median_edge();
    match params.cell {
        Some(cell) if cell < LEAST_CELL * edge => Err(Error::input(format!(
            "cell is {}, but the median edge of the surface is {}: give at least a hundredth of that",
            Shown(cell),
            Shown::digits(edge, 4)
        ))),
        _ => Ok(()),
    }
}

/// Refuses a base so deep that the fill would be longer than all that was measured.
fn refuse_deep_base(mesh: &TriMesh, params: &CloseParams) -> Result<()> {
    let longest = bounds(&mesh.positions).map_or(0.0, |(lo, hi)| (hi - lo).max_element());
    if params.flat_base && params.base_depth > longest {
        return Err(Error::input(format!(
            "base_depth is {}, but the longest side of the surface is {}: give at most that",
            Shown::digits(params.base_depth, 4),
            Shown::digits(longest, 4)
        )));
    }
    Ok(())
}

/// The judge of which fills stay.
struct Judge<'a> {
    surface: &'a Surface<'a>,
    border: &'a Border,
    params: &'a CloseParams,
    envelope: Envelope<'a>,
    strict: Envelope<'a>,
    floor: Option<Envelope<'a>>,
    /// The length that fills are looked at and moved by: a cell of the merge.
    step: f64,
    /// The longest boundary that is closed.
    max_hole_length: Option<f64>,
    /// Whether scans say where nothing is.
    has_sight: bool,
}

/// The fills that stay.
struct Settled {
    /// Of each face, those that were measured among them.
    forced: Vec<bool>,
    /// Faces of fills that are open somewhere, since each way to close them crosses something.
    stuck: Vec<bool>,
    openings: Vec<OpeningReport>,
}

impl Judge<'_> {
    /// Takes the few faces in seen space away that could not move back, and closes small loops that are open by fans.
    fn mend(&self, growing: &mut Growing, progress: &Progress<'_>) -> Result<()> {
        let turned = self.turned(growing, progress)?;
        if turned.contains(&true) {
            growing.take_away(&turned, progress)?;
        }
        if self.params.force {
            return fan::close_loops(growing, self.floor, self.step, progress);
        }
        let seen = retreat::in_seen_space(growing, self.strict, self.step, progress)?;
        let mut goes = vec![false; growing.triangles.len()];
        for opening in openings::find(growing, self.border, progress)? {
            let [all, in_seen] = areas(growing, &opening, &seen);
            for &t in opening.triangles.iter().filter(|_| in_seen <= LITTLE * all) {
                goes[t as usize] = seen[t as usize];
            }
        }
        growing.take_away(&goes, progress)?;
        fan::close_loops(growing, Some(self.strict), self.step, progress)
    }

    /// Takes fills away that are not asked for, or lie in seen space.
    fn settle(&self, growing: &mut Growing, progress: &Progress<'_>) -> Result<Settled> {
        let seen = retreat::in_seen_space(growing, self.strict, self.step, progress)?;
        let below = match self.floor {
            Some(floor) => retreat::in_seen_space(growing, floor, self.step, progress)?,
            None => vec![false; growing.triangles.len()],
        };
        let found = openings::find(growing, self.border, progress)?;
        let mut goes = vec![false; growing.triangles.len()];
        let mut openings = Vec::new();
        for opening in &found {
            let refused = self.reason(opening, growing, progress)?;
            let [all, in_seen] = areas(growing, opening, &seen);
            let is_seen = !self.params.force && in_seen > 0.0;
            let goes_whole = refused.is_some() || is_seen && in_seen > LITTLE * all;
            for &t in &opening.triangles {
                goes[t as usize] = goes_whole || is_seen && seen[t as usize];
            }
            let is_of_base = opening.triangles.iter().all(|&t| below[t as usize] || !seen[t as usize]);
            let space = if is_of_base { LeftOpen::Base } else { LeftOpen::SeenThrough };
            let reason = refused.or(is_seen.then_some(space));
            openings.push(opening_report(self.border, &opening.loops, reason));
        }
        let kept = growing.take_away(&goes, progress)?;
        let forced = kept.iter().map(|&t| seen[t as usize]).collect();
        let mut settled = Settled { forced, stuck: vec![false; growing.triangles.len()], openings };
        self.count(growing, &mut settled, progress)?;
        self.take_turned_away(growing, &mut settled, progress)?;
        Ok(settled)
    }

    /// Reason why an opening is not to be closed, whatever was seen in it.
    fn reason(&self, opening: &Opening, growing: &Growing, progress: &Progress<'_>) -> Result<Option<LeftOpen>> {
        if opening.triangles.is_empty() {
            return Ok(Some(LeftOpen::Crossing));
        }
        let length: f64 = opening.loops.iter().map(|&number| self.border.loops[number as usize].length).sum();
        if self.max_hole_length.is_some_and(|longest| length > longest) {
            return Ok(Some(LeftOpen::TooLong));
        }
        let is_open = self.params.openings == Openings::Seen
            && !openings::is_enclosed(opening, growing, self.surface, self.envelope, self.step, progress)?;
        Ok(is_open.then_some(LeftOpen::NotEnclosed))
    }

    fn turned(&self, growing: &Growing, progress: &Progress<'_>) -> Result<Vec<bool>> {
        // Over a base nothing is the inside of a thing.
        let over_base = self.params.flat_base.then_some(f64::INFINITY);
        let tolerance = if self.has_sight { Some(self.strict.tolerance) } else { over_base };
        turned::find(growing, tolerance, progress)
    }

    /// Takes fills away that turn the surface inside out.
    fn take_turned_away(&self, growing: &mut Growing, settled: &mut Settled, progress: &Progress<'_>) -> Result<()> {
        let turned = self.turned(growing, progress)?;
        if !turned.contains(&true) {
            return Ok(());
        }
        let of_turned = turned.iter().zip(&growing.triangles).filter(|(turned, _)| **turned);
        let vertices: FxHashSet<u32> = of_turned.flat_map(|(_, corners)| *corners).collect();
        for opening in settled.openings.iter_mut().filter(|opening| vertices.contains(&opening.vertices[0])) {
            let reason = if self.params.flat_base { LeftOpen::Base } else { LeftOpen::InsideOut };
            *opening = OpeningReport { area: 0.0, forced_faces: 0, left_open: Some(reason), ..opening.clone() };
        }
        let kept = growing.take_away(&turned, progress)?;
        settled.forced = kept.iter().map(|&t| settled.forced[t as usize]).collect();
        settled.stuck = kept.iter().map(|&t| settled.stuck[t as usize]).collect();
        Ok(())
    }

    /// Gives the base as the reason, where the surface looks up right above it: no fill has room there.
    fn blame_base(&self, openings: &mut [OpeningReport]) {
        let Some(floor) = self.floor else { return };
        let up = self.params.base_up.direction();
        let down = FILL_CELLS * self.step * up;
        let lies_on_base = |t: usize| {
            let corners = self.surface.mesh.corners(t);
            floor.is_seen(corners[0] - down) && normal(corners).dot(up) > cells::LOOKS_UP
        };
        let mut stuck = openings.iter_mut().filter(|opening| opening.left_open == Some(LeftOpen::Crossing)).peekable();
        if stuck.peek().is_some() && (0..self.surface.mesh.triangles.len()).any(lies_on_base) {
            stuck.for_each(|opening| opening.left_open = Some(LeftOpen::Base));
        }
    }

    /// Fills in the areas of what stayed. A fill that has an open edge of its own is not closed.
    fn count(&self, growing: &Growing, settled: &mut Settled, progress: &Progress<'_>) -> Result<()> {
        let found = openings::find(growing, self.border, progress)?;
        let Settled { forced, stuck, openings } = settled;
        let open: FxHashSet<u32> = growing.open_edges(progress)?.into_iter().flatten().collect();
        for opening in &found {
            let vertex = self.border.loops[opening.loops[0] as usize].vertex;
            let Some(of) = openings.iter_mut().find(|of| of.vertices.contains(&vertex)) else { continue };
            let corners = opening.triangles.iter().flat_map(|&t| growing.triangles[t as usize]);
            let is_open = opening.triangles.is_empty() || corners.into_iter().any(|v| open.contains(&v));
            of.area += opening.triangles.iter().map(|&t| area(growing.corners(t as usize))).sum::<f64>();
            of.forced_faces += opening.triangles.iter().filter(|&&t| forced[t as usize]).count();
            if is_open && of.left_open.is_none() {
                of.left_open = Some(LeftOpen::Crossing);
                opening.triangles.iter().for_each(|&t| stuck[t as usize] = true);
            }
        }
        Ok(())
    }
}

/// Of an opening's fill, and of its part in seen space.
fn areas(growing: &Growing, opening: &Opening, seen: &[bool]) -> [f64; 2] {
    let mut areas = [0.0; 2];
    for &t in &opening.triangles {
        let own = area(growing.corners(t as usize));
        areas[0] += own;
        areas[1] += if seen[t as usize] { own } else { 0.0 };
    }
    areas
}

fn opening_report(border: &Border, loops: &[u32], left_open: Option<LeftOpen>) -> OpeningReport {
    let loops = || loops.iter().map(|&number| border.loops[number as usize]);
    OpeningReport {
        vertices: loops().map(|edge_loop| edge_loop.vertex).collect(),
        edges: loops().map(|edge_loop| edge_loop.edges).sum(),
        length: loops().map(|edge_loop| edge_loop.length).sum(),
        area: 0.0,
        left_open,
        forced_faces: 0,
    }
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
