//! The driver: the stages in their order.

use rustc_hash::FxHashSet;

use base::error::Result;
use base::memory;
use base::progress::Progress;
use image::source::ScanSource;
use mesh::measure::{area, bounds};
use mesh::{Crs, TriMesh, check};

use super::field::{self, Extent};
use super::openings::{self, Border, Opening};
use super::params::{CloseParams, Openings};
use super::report::{CloseReport, Closed, LeftOpen, OpeningReport};
use super::stitch::Growing;
use super::surface::Surface;
use super::visibility::{Envelope, Ground, Scans, Visibility};
use super::{attributes, cut, fan, level, retreat};

base::stages! {
    /// Stages with their shares of the time.
    PLAN:
    READING = "reading lines of sight", 0.1;
    PREPARING = "looking at the surface", 0.1;
    SOLVING = "solving for the fill", 0.5;
    JOINING = "joining the fill", 0.25;
    JUDGING = "judging openings", 0.05;
}

/// Cells of the merge in a cell of the fill.
const FILL_CELLS: f64 = 2.0;
/// The default cell by the median edge of a merge: its vertices lie on the edges of cells.
const CELL_BY_EDGE: f64 = 1.3;
/// The default longest hole, in cells.
const HOLE_CELLS: f64 = 100.0;
/// Share of an opening's fill that may lie in seen space and be left open as small holes. Beyond it the opening stays as it was.
const LITTLE: f64 = 0.05;
/// Times that fills in seen space move back, or are closed anew where they can't.
const RETREATS: usize = 3;
/// The most steps in a cell of the fill, so that tiny cells of the merge take no endless time.
const MOST_STEPS: f64 = 16.0;
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
/// Time O(n log n) for n triangles, and O(m) for the m cells of the fill's grid, at most 6 million. About 100 bytes per cell and 400 per
/// triangle, and 11 per pixel of the scans. In larger things cells are larger. Openings smaller than two of them are closed by the mesh
/// alone. \[Lie03\]
///
/// # Errors
/// Parameters out of range. A mesh that is no oriented manifold: the error says what is wrong. Scans of another coordinate reference system,
/// or that can't be read. [`base::Error::OutOfMemory`]. [`base::Error::Cancelled`].
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

fn planned(
    mesh: &TriMesh,
    params: &CloseParams,
    progress: &Progress<'_>,
    run: impl FnOnce() -> Result<Closed> + Send,
) -> Result<Closed> {
    params.validate()?;
    memory::expect_each(mesh.triangles.len(), BYTES_A_TRIANGLE, 0.0, "closing", "triangles")?;
    progress.plan(PLAN);
    let pool = base::threads::pool(params.threads)?;
    progress.run(&pool, run)
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
    progress.stage(PREPARING, 1);
    let has_sight = !visibility.is_blind();
    let up = params.base_up.direction();
    let height = mesh.positions.iter().map(|place| place.dot(up)).fold(f64::INFINITY, f64::min);
    let ground = Ground { visibility, up, height };
    let visibility: &dyn Visibility = if params.flat_base { &ground } else { visibility };
    let surface = Surface::new(mesh, params.threads, progress)?;
    let border = Border::new(&surface);
    let mut report = measures(mesh, has_sight, params);
    progress.lap(PLAN[PREPARING].0);
    let mut forced = vec![false; mesh.triangles.len()];
    let mut result = TriMesh { crs: mesh.crs.clone(), ..TriMesh::new(mesh.positions.clone(), mesh.triangles.clone()) };
    let longest = report.max_hole_length.unwrap_or(f64::INFINITY);
    let wanted = wanted(&border, params.openings, longest);
    if wanted {
        let envelope = Envelope { visibility, tolerance: report.merge_distance };
        let judge = Envelope { tolerance: report.merge_distance + 0.5 * report.cell, ..envelope };
        progress.stage(SOLVING, field::STEPS);
        let extent = extent(mesh, report.cell);
        let (grid, field) = field::solve(&surface, &extent, envelope, progress)?;
        report.fill_cell = grid.cell;
        progress.lap(PLAN[SOLVING].0);
        progress.stage(JOINING, 1);
        let level = level::extract(&grid, &field, |a, b, t| level::between(&grid, a, b, t), progress)?;
        let fill = cut::beyond_borders(&level, &surface, grid.cell, progress)?;
        let mut growing = Growing::new(&surface, &fill);
        retreat::retreat(&mut growing, envelope, step(&report), progress)?;
        growing.join(grid.cell, progress)?;
        for _ in 0..RETREATS {
            retreat::retreat(&mut growing, envelope, step(&report), progress)?;
            growing.repair(progress)?;
            let seen = retreat::in_seen_space(&growing, judge, step(&report), progress)?;
            if params.force || !seen.contains(&true) {
                break;
            }
            growing.close_anew_around(&seen, progress)?;
        }
        let judge = Judge { surface: &surface, border: &border, params, envelope, strict: judge };
        judge.mend(&mut growing, step(&report), progress)?;
        growing.drop_loose(progress)?;
        progress.lap(PLAN[JOINING].0);
        progress.stage(JUDGING, 1);
        forced = judge.settle(&mut growing, &mut report, progress)?;
        growing.drop_unused();
        (result.positions, result.triangles) = (growing.positions, growing.triangles);
    } else {
        report.openings = (0..border.loops.len() as u32)
            .map(|number| opening_report(&border, &[number], Some(reason_alone(params.openings))))
            .collect();
    }
    attributes::extend(&mut result, mesh, &forced, progress)?;
    finish(&mut report, &result, mesh);
    progress.lap(PLAN[JUDGING].0);
    report.seconds = progress.seconds();
    Ok(Closed { mesh: result, report })
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

/// The length that fills are looked at and moved by: a cell of the merge.
fn step(report: &CloseReport) -> f64 {
    report.cell.max(report.fill_cell / MOST_STEPS)
}

/// Whether anything is to be closed.
fn wanted(border: &Border, openings: Openings, longest: f64) -> bool {
    openings != Openings::None && border.loops.iter().any(|edge_loop| edge_loop.length <= longest)
}

fn reason_alone(openings: Openings) -> LeftOpen {
    if openings == Openings::None { LeftOpen::NotAsked } else { LeftOpen::TooLong }
}

fn extent(mesh: &TriMesh, cell: f64) -> Extent {
    let (lo, hi) = bounds(&mesh.positions).expect("a mesh with triangles has vertices");
    Extent::new(lo, hi, FILL_CELLS * cell)
}

/// The judge of which fills stay.
struct Judge<'a> {
    surface: &'a Surface<'a>,
    border: &'a Border,
    params: &'a CloseParams,
    envelope: Envelope<'a>,
    strict: Envelope<'a>,
}

impl Judge<'_> {
    /// Takes the few faces in seen space away that could not move back, and closes small loops that are open by fans.
    fn mend(&self, growing: &mut Growing, cell: f64, progress: &Progress<'_>) -> Result<()> {
        if self.params.force {
            return fan::close_loops(growing, None, cell, progress);
        }
        let seen = retreat::in_seen_space(growing, self.strict, cell, progress)?;
        let mut goes = vec![false; growing.triangles.len()];
        for opening in openings::find(growing, self.border, progress)? {
            let [all, in_seen] = areas(growing, &opening, &seen);
            for &t in opening.triangles.iter().filter(|_| in_seen <= LITTLE * all) {
                goes[t as usize] = seen[t as usize];
            }
        }
        growing.take_away(&goes, progress)?;
        fan::close_loops(growing, Some(self.strict), cell, progress)
    }

    /// Takes fills away that are not asked for, or lie in seen space. Writes the report's openings. Returns which faces are forced.
    fn settle(&self, growing: &mut Growing, report: &mut CloseReport, progress: &Progress<'_>) -> Result<Vec<bool>> {
        let seen = retreat::in_seen_space(growing, self.strict, step(report), progress)?;
        let found = openings::find(growing, self.border, progress)?;
        let mut goes = vec![false; growing.triangles.len()];
        for opening in &found {
            let refused = self.reason(opening, growing, report, progress)?;
            let [all, in_seen] = areas(growing, opening, &seen);
            let is_seen = !self.params.force && in_seen > 0.0;
            let goes_whole = refused.is_some() || is_seen && in_seen > LITTLE * all;
            for &t in &opening.triangles {
                goes[t as usize] = goes_whole || is_seen && seen[t as usize];
            }
            let reason = refused.or(is_seen.then_some(LeftOpen::SeenThrough));
            report.openings.push(opening_report(self.border, &opening.loops, reason));
        }
        let kept = growing.take_away(&goes, progress)?;
        let forced: Vec<bool> = kept.iter().map(|&t| seen[t as usize]).collect();
        self.count(growing, report, &forced, progress)?;
        Ok(forced)
    }

    /// Reason why an opening is not to be closed, whatever was seen in it.
    fn reason(
        &self,
        opening: &Opening,
        growing: &Growing,
        report: &CloseReport,
        progress: &Progress<'_>,
    ) -> Result<Option<LeftOpen>> {
        if opening.triangles.is_empty() {
            return Ok(Some(LeftOpen::Crossing));
        }
        let length: f64 = opening.loops.iter().map(|&number| self.border.loops[number as usize].length).sum();
        if report.max_hole_length.is_some_and(|longest| length > longest) {
            return Ok(Some(LeftOpen::TooLong));
        }
        let is_open = self.params.openings == Openings::Seen
            && !openings::is_enclosed(opening, growing, self.surface, self.envelope, step(report), progress)?;
        Ok(is_open.then_some(LeftOpen::NotEnclosed))
    }

    /// Fills in the areas of what stayed. A fill that has an open edge of its own is not closed.
    fn count(
        &self,
        growing: &Growing,
        report: &mut CloseReport,
        forced: &[bool],
        progress: &Progress<'_>,
    ) -> Result<()> {
        let found = openings::find(growing, self.border, progress)?;
        let place_of = |loops: &[u32]| {
            let vertex = self.border.loops[loops[0] as usize].vertex;
            report.openings.iter().position(|opening| opening.vertices.contains(&vertex))
        };
        let places: Vec<Option<usize>> = found.iter().map(|opening| place_of(&opening.loops)).collect();
        let open: FxHashSet<u32> = growing.open_edges(progress)?.into_iter().flatten().collect();
        for (opening, place) in found.iter().zip(places) {
            let Some(place) = place else { continue };
            let corners = opening.triangles.iter().flat_map(|&t| growing.triangles[t as usize]);
            let is_open = opening.triangles.is_empty() || corners.into_iter().any(|v| open.contains(&v));
            let of = &mut report.openings[place];
            of.area += opening.triangles.iter().map(|&t| area(growing.corners(t as usize))).sum::<f64>();
            of.forced_faces += opening.triangles.iter().filter(|&&t| forced[t as usize]).count();
            if is_open && of.left_open.is_none() {
                of.left_open = Some(LeftOpen::Crossing);
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
    report.count_openings(mesh);
    let judged = check(result);
    report.open_edges = judged.boundary_edges;
    report.is_closed = judged.is_closed();
}
