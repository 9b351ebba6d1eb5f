//! The driver: the steps in their order.

use base::error::{Error, Result, Shown, counted};
use base::memory;
use base::progress::Progress;
use close::bodies::{Bodies, Lies};
use close::crossing_pairs;
use mesh::measure::{bounds, enclosed_volume};
use mesh::{AttributeData, Crs, TriMesh, try_check};

use super::drain::{drain, shut_cavities};
use super::flat_base::flat_base;
use super::hollow::{hollow, refuse_large_grid};
use super::made::{ADDED, BYTES_A_TRIANGLE, mark};
use super::params::PrepareParams;
use super::report::{PrepareProblem, PrepareReport, PreparedPrint};
use super::scale_to::{extent, scale_to, side};
use super::section::Section;
use super::single;
use super::split_parts::split_parts;
use super::thicken::{THIN, thicken};

base::stages! {
    /// Stages with their shares of the time.
    PLAN:
    CHECKING = "checking", 0.2;
    BASE = "cutting the base", 0.15;
    WALLS = "thickening walls", 0.3;
    CAVITY = "hollowing out", 0.4;
    DRAIN = "draining", 0.1;
    PARTS = "cutting into parts", 0.15;
}

/// Times that size, base and walls are made, so that the side has its length with thicker walls.
const TURNS: usize = 4;
/// Relative error of that length which is near enough. Walls jump by more when the size changes a little.
const NEAR: f64 = 1e-4;

/// Makes a closed mesh ready for printing, by the steps whose parameters are given, in this order: scaled, cut off flat, thickened,
/// hollowed out, drained, cut into parts.
///
/// ```
/// use surfrecon_printing::{PrepareParams, prepare_print};
/// # let mesh = mesh::shapes::Shape::Sphere { radius: 1.0 }.mesh(8);
/// # let progress = base::Progress::none();
/// let params = PrepareParams { scale_to: Some(0.1), flat_base: true, ..PrepareParams::default() };
/// let prepared = prepare_print(&mesh, &params, &progress)?;
/// assert!(mesh::check(&prepared.mesh).is_closed());
/// # Ok::<(), base::Error>(())
/// ```
///
/// # Guarantees
/// * The result is a closed, oriented manifold, and no two of its faces cross. Both are decided exactly. If it is cut into parts, this holds
///   for each part ([`PreparedPrint::parts`]): caps of neighbours lie on each other.
/// * A cavity lies as deep as asked for within a cell. The distance is measured.
/// * No body jumps into another, whatever walls move.
/// * Vertices keep their bits, but for scaling, thin walls and single precision. No wall moves inward, or farther than the one that is asked
///   for. The report says by how much any moved.
/// * All coordinates are numbers of single precision, as STL and 3MF hold them, and multiples of the smallest step that it knows at the
///   largest of them. If faces would cross in it, all stay in double precision, and a note says so.
/// * Faces that were made up have the face attribute `added`. Vertices on cuts have the means of their edges' ends.
/// * The same result for any number of threads.
///
/// # Cost
/// Time O(n log n) for n faces of which few boxes meet. About 200 bytes per face, also of a cavity, or 13 bytes per node of its grid.
///
/// # Errors
/// Parameters out of range. A mesh that is open, no oriented manifold, or crosses itself: the error says what to do. So does that of a body
/// that is inside out or lies in the solid of another. A base with nothing above it. [`Error::OutOfMemory`]. [`Error::Cancelled`].
pub fn prepare_print(mesh: &TriMesh, params: &PrepareParams, progress: &Progress<'_>) -> Result<PreparedPrint> {
    params.validate()?;
    params.go_together()?;
    mesh.validate()?;
    base::magnitude::points("vertex", &mesh.positions)?;
    Crs::lengths(mesh.crs.as_ref())?;
    memory::expect_each(mesh.triangles.len(), BYTES_A_TRIANGLE, 0.0, "preparing the print of", "triangles")?;
    refuse_large_grid(mesh, params)?;
    progress.plan(PLAN);
    let pool = base::threads::pool(params.threads)?;
    progress.run(&pool, || steps(mesh, params, progress))
}

fn steps(mesh: &TriMesh, params: &PrepareParams, progress: &Progress<'_>) -> Result<PreparedPrint> {
    progress.stage(CHECKING, 1);
    let mut report = PrepareReport { scale: 1.0, ..PrepareReport::default() };
    report.volume_before = refuse(mesh, progress)?;
    let mut mesh = mesh.clone();
    mark(&mut mesh);
    progress.lap(PLAN[CHECKING].0);
    let base = shaped(&mut mesh, params, &mut report, progress)?;
    progress.stage(CAVITY, 1);
    let cavity = match params.hollow {
        Some(wall) => {
            let drained = base.filter(|_| params.drain.is_some() && report.base_faces > 0);
            hollow(&mut mesh, wall, drained, params, &mut report, progress)?
        }
        None => None,
    };
    progress.lap(PLAN[CAVITY].0);
    progress.stage(DRAIN, 1);
    if let (Some(base), Some(cavity)) = (base, &cavity) {
        drain(&mut mesh, base, cavity, params, &mut report, progress)?;
    }
    if cavity.is_some() {
        report.shut_cavities = shut_cavities(&mesh, progress)?;
    } else if params.drain.is_some() {
        report.note(
            PrepareProblem::NoDrain,
            "There is no cavity that a hole could lead into: give thinner walls".to_owned(),
        );
    }
    if report.is_drained && report.shut_cavities > 0 {
        let count = counted(report.shut_cavities as u64, "cavity", "cavities");
        report.note(
            PrepareProblem::ShutCavities,
            format!("The drain leads into one cavity, and {count} stay shut: give thicker walls"),
        );
    }
    progress.lap(PLAN[DRAIN].0);
    progress.stage(PARTS, 1);
    report.parts = 1;
    if params.has_printer() {
        split_parts(&mut mesh, params, &mut report, progress)?;
    }
    progress.lap(PLAN[PARTS].0);
    let bounds = extent(&mesh, None);
    report.size = (bounds.max - bounds.min).to_array();
    report.volume = enclosed_volume(&mesh);
    report.added_faces = marked(&mesh, ADDED);
    if let Some(min_wall) = params.min_wall {
        tell_thin(&mesh, min_wall, &mut report);
    }
    single::tell(&mesh, &mut report, progress)?;
    report.seconds = progress.seconds();
    Ok(PreparedPrint { mesh, report })
}

/// The mesh in its size, on its base, with its walls. If thicker walls make the side longer that a length is asked for, these steps are
/// done again with a smaller one. Gives the plane of the base.
fn shaped(
    mesh: &mut TriMesh,
    params: &PrepareParams,
    report: &mut PrepareReport,
    progress: &Progress<'_>,
) -> Result<Option<Section>> {
    let (whole, before) = (std::mem::take(mesh), report.clone());
    let mut length = params.scale_to;
    let mut turn = 0;
    loop {
        turn += 1;
        (*mesh, *report) = (whole.clone(), before.clone());
        if let Some(length) = length {
            scale_to(mesh, length, params, report, progress)?;
        }
        single::round(mesh, progress)?;
        progress.stage(BASE, 1);
        let base = match params.flat_base {
            true => Some(flat_base(mesh, params, report, progress)?),
            false => None,
        };
        progress.lap(PLAN[BASE].0);
        progress.stage(WALLS, 1);
        if let Some(min_wall) = params.min_wall {
            refuse_thick(mesh, min_wall)?;
            thicken(mesh, min_wall, base.filter(|_| report.base_faces > 0), report, progress)?;
        }
        progress.lap(PLAN[WALLS].0);
        let longer = params.scale_to.map_or(1.0, |asked| side(extent(mesh, None), params) / asked);
        if (longer - 1.0).abs() <= NEAR {
            return Ok(base);
        }
        if turn == TURNS {
            let (side, asked) = (side(extent(mesh, None), params), params.scale_to.unwrap_or_default());
            let (side, asked) = (Shown::digits(side, 4), Shown::digits(asked, 4));
            let text = format!("The side is {side} long, not {asked}: walls as thick as asked for take more room");
            report.note(PrepareProblem::SizeMissed, text);
            return Ok(base);
        }
        length = length.map(|length| length / longer);
    }
}

/// Faces that an attribute marks.
fn marked(mesh: &TriMesh, name: &str) -> usize {
    match mesh.face_attribute(name) {
        Some(AttributeData::Bool(marks)) => marks.iter().filter(|mark| **mark).count(),
        _ => 0,
    }
}

/// Says how many faces of the result have thin walls. Cuts may have parted some.
fn tell_thin(mesh: &TriMesh, min_wall: f64, report: &mut PrepareReport) {
    report.thin_faces = marked(mesh, THIN);
    if report.thin_faces > 0 {
        let count = counted(report.thin_faces as u64, "face still has", "faces still have");
        let text = format!(
            "{count} walls thinner than {}, at sharp edges or where there is no room: print it larger. The attribute thin marks them",
            Shown(min_wall)
        );
        report.note(PrepareProblem::StillThin, text);
    }
}

/// Refuses a wall that is thicker than the mesh is long: its unit is another one.
fn refuse_thick(mesh: &TriMesh, min_wall: f64) -> Result<()> {
    let longest = bounds(&mesh.positions).map_or(0.0, |(lo, hi)| (hi - lo).max_element());
    if min_wall > longest {
        return Err(Error::input(format!(
            "min_wall is {}, but the longest side of the mesh is {}: give less than that, in the unit of the mesh",
            Shown::digits(min_wall, 4),
            Shown::digits(longest, 4)
        )));
    }
    Ok(())
}

/// Refuses a mesh that encloses no space, with what to do. Gives the volume.
fn refuse(mesh: &TriMesh, progress: &Progress<'_>) -> Result<f64> {
    if mesh.triangles.is_empty() {
        return Err(Error::input("the mesh has no triangles, but must have some: give a closed mesh"));
    }
    let topology = try_check(mesh, &progress.unseen())?;
    if !topology.is_manifold() {
        return Err(Error::input(format!(
            "the mesh must be a closed, oriented manifold, but it has {topology}: merge its scans again, or repair these places first"
        )));
    }
    if topology.boundary_edges > 0 {
        return Err(Error::input(format!(
            "the mesh has {}: close it first, by the operation close",
            counted(topology.boundary_loops as u64, "opening", "openings")
        )));
    }
    let crossings = crossing_pairs(mesh, progress)?;
    if let Some([one, other]) = crossings.first() {
        return Err(Error::input(format!(
            "{} of faces cross, the first are {one} and {other}: check the print to see all, and repair these places first",
            counted(crossings.len() as u64, "pair", "pairs")
        )));
    }
    let volume = enclosed_volume(mesh);
    if volume == 0.0 {
        return Err(Error::input("the mesh encloses no volume: give it a thickness first"));
    }
    let bodies = Bodies::new(mesh, true, progress)?;
    let of_kind = |kind: Lies| {
        let mut all = bodies.list.iter().filter(|body| body.lies() == kind);
        let first = all.next()?;
        let [x, y, z] = first.place.to_array().map(|x| Shown::digits(x, 4));
        Some((1 + all.count() as u64, format!("({x}, {y}, {z})")))
    };
    if let Some((count, place)) = of_kind(Lies::InsideOut) {
        let count = counted(count, "body is", "bodies are");
        return Err(Error::input(format!("{count} inside out, the first at {place}: flip its faces first")));
    }
    if let Some((count, place)) = of_kind(Lies::Nested) {
        let count = counted(count, "body lies", "bodies lie");
        return Err(Error::input(format!(
            "{count} in the solid of another, the first at {place}: remove it first, or flip its faces if it is a cavity"
        )));
    }
    Ok(volume)
}
