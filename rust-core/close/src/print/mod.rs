//! Checks of a mesh before it is printed: closed, manifold, without crossings. Also parts, volume, weight, walls and overhangs.
//!
//! Nothing is repaired. Topology is judged by [`mesh::check()`], crossings by exact predicates, walls by the mesh's hierarchy of boxes:
//! none of it shares code with closing.

mod params;
#[doc(hidden)]
pub mod walls;

pub use params::{PrintParams, SCHEMA};
pub use walls::Wall;

use glam::DVec3;
use rayon::prelude::*;

use base::error::{Result, counted};
use base::magnitude;
use base::progress::Progress;
use geom::bvh::Bvh;
use mesh::measure::area;
use mesh::{CheckReport, TriMesh, try_check};

use super::surface::normal;
use super::{crossing, cut};

base::stages! {
    /// Stages with their shares of the time.
    PLAN:
    TOPOLOGY = "checking", 0.2;
    CROSSINGS = "looking for crossings", 0.3;
    WALLS = "measuring walls", 0.5;
}

/// A part of the mesh, joined over edges.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PrintPart {
    /// Its faces.
    pub faces: usize,
    /// Its area.
    pub area: f64,
    /// Its volume. Negative for a cavity, and for a part that is inside out. Of an open part it depends on where the origin lies.
    pub volume: f64,
}

/// Findings of the checks.
#[derive(Clone, Debug, PartialEq)]
pub struct PrintReport {
    /// Closed, manifold, oriented.
    pub topology: CheckReport,
    /// Pairs of faces that cross, the smaller number first, rising. Exact.
    pub crossings: Vec<[u32; 2]>,
    /// Parts in the order of their first faces.
    pub parts: Vec<PrintPart>,
    /// Size along x, y and z.
    pub size: DVec3,
    /// Volume of all parts together. `None` unless the mesh is closed.
    pub volume: Option<f64>,
    /// Volume times density. `None` without either.
    pub weight: Option<f64>,
    /// Thickness of the wall behind the centre of each face. Infinite behind a face without area.
    pub walls: Vec<Wall>,
    /// The face whose wall is thinnest, the first of several. `None` if no face has anything behind it.
    pub thinnest: Option<u32>,
    /// Largest distance of a corner from the centre of its face. Walls are measured at centres: where faces are larger than walls are
    /// thick, a wall may be thinner between them.
    pub farthest_from_centre: f64,
    /// Of each face whether it hangs over by more than the angle and does not lie on the ground.
    pub overhangs: Vec<bool>,
    /// Area of those faces.
    pub overhang_area: f64,
    /// Faults with their remedies, a sentence each. Empty if the mesh can be printed.
    pub findings: Vec<String>,
}

/// Checks a mesh.
///
/// # Guarantees
/// The same report for any number of threads. Crossings are decided exactly.
///
/// # Cost
/// Time O(n log n) for n faces of which few cross.
///
/// # Errors
/// Parameters out of range. A mesh with an index out of range or a coordinate that is not finite. [`base::Error::OutOfMemory`].
/// [`base::Error::Cancelled`].
pub fn check_print(mesh: &TriMesh, params: &PrintParams, progress: &Progress<'_>) -> Result<PrintReport> {
    params.validate()?;
    mesh.validate()?;
    magnitude::points("vertex", &mesh.positions)?;
    progress.plan(PLAN);
    let pool = base::threads::pool(params.threads)?;
    progress.run(&pool, || run(mesh, params, progress))
}

fn run(mesh: &TriMesh, params: &PrintParams, progress: &Progress<'_>) -> Result<PrintReport> {
    progress.stage(TOPOLOGY, 1);
    let topology = try_check(mesh, &progress.unseen())?;
    let parts = parts(mesh, progress)?;
    progress.stage(CROSSINGS, 1);
    let crossings = crossing::pairs(&mesh.positions, &mesh.triangles, |_| true, progress)?;
    progress.stage(WALLS, mesh.triangles.len() as u64);
    let bvh = Bvh::build_with(&mesh.positions, &mesh.triangles, params.threads, progress)?;
    let walls = walls::measure(mesh, &bvh, progress)?;
    let overhangs = overhangs(mesh, params);
    let (lo, hi) = mesh::measure::bounds(&mesh.positions).unwrap_or_default();
    let volume = topology.is_closed().then(|| parts.iter().map(|part| part.volume).sum::<f64>());
    let least = |least: Option<u32>, t: u32| match least {
        Some(other) if walls[other as usize].thickness <= walls[t as usize].thickness => Some(other),
        _ => Some(t),
    };
    let has_wall = |&t: &u32| walls[t as usize].thickness.is_finite();
    let thinnest = (0..walls.len() as u32).filter(has_wall).fold(None, least);
    let overhang_area = (0..overhangs.len()).filter(|&t| overhangs[t]).map(|t| area(mesh.corners(t))).sum();
    let mut report = PrintReport {
        topology,
        crossings,
        parts,
        size: hi - lo,
        volume,
        weight: volume.zip(params.density).map(|(volume, density)| volume * density),
        thinnest,
        farthest_from_centre: (0..mesh.triangles.len()).map(|t| reach(mesh.corners(t))).fold(0.0, f64::max),
        walls,
        overhangs,
        overhang_area,
        findings: Vec::new(),
    };
    report.findings = findings(&report, params);
    Ok(report)
}

fn reach(corners: [DVec3; 3]) -> f64 {
    let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
    corners.iter().map(|corner| corner.distance(centre)).fold(0.0, f64::max)
}

fn parts(mesh: &TriMesh, progress: &Progress<'_>) -> Result<Vec<PrintPart>> {
    let (piece, count) = cut::pieces(&mesh.triangles, progress)?;
    let origin = mesh.positions.first().copied().unwrap_or_default();
    let mut parts = vec![PrintPart::default(); count];
    for (t, &piece) in piece.iter().enumerate() {
        let part = &mut parts[piece as usize];
        let [a, b, c] = mesh.corners(t).map(|p| p - origin);
        part.faces += 1;
        part.area += area([a, b, c]);
        part.volume += a.dot(b.cross(c)) / 6.0;
    }
    Ok(parts)
}

/// Faces that look down more steeply than the angle, but for those that lie on the ground.
fn overhangs(mesh: &TriMesh, params: &PrintParams) -> Vec<bool> {
    let up = params.up.direction();
    let ground = mesh.positions.iter().map(|p| p.dot(up)).fold(f64::INFINITY, f64::min);
    let limit = params.overhang.sin();
    (0..mesh.triangles.len())
        .into_par_iter()
        .map(|t| {
            let corners = mesh.corners(t);
            -normal(corners).dot(up) > limit && corners.iter().any(|corner| corner.dot(up) > ground)
        })
        .collect()
}

fn findings(report: &PrintReport, params: &PrintParams) -> Vec<String> {
    let mut findings = Vec::new();
    let topology = &report.topology;
    if !topology.is_manifold() {
        findings.push(format!(
            "The mesh is no oriented manifold: {topology}. Merge its scans again, or repair these places."
        ));
    } else if topology.boundary_edges > 0 {
        let loops = counted(topology.boundary_loops as u64, "opening", "openings");
        findings.push(format!("The mesh has {loops}. Close them."));
    }
    if !report.crossings.is_empty() {
        let pairs = counted(report.crossings.len() as u64, "pair of faces crosses", "pairs of faces cross");
        findings.push(format!("{pairs}. Move or remove these faces."));
    }
    if report.volume.is_some_and(|volume| volume < 0.0) {
        findings.push("The mesh is inside out. Flip its faces.".to_owned());
    }
    if let (Some(least), Some(face)) = (params.min_wall, report.thinnest)
        && report.walls[face as usize].thickness < least
    {
        let thin = report.walls.iter().filter(|wall| wall.thickness < least).count();
        let wall = base::error::Shown::digits(report.walls[face as usize].thickness, 3);
        findings.push(format!(
            "{} thinner than {least}. The thinnest is {wall} at face {face}. Thicken it, or print it larger.",
            counted(thin as u64, "face has a wall", "faces have walls")
        ));
    }
    if report.overhang_area > 0.0 {
        let faces = report.overhangs.iter().filter(|overhang| **overhang).count();
        let degrees = params.overhang.to_degrees();
        findings.push(format!(
            "{} by more than {degrees:.0} degrees. Turn the object, or print it with supports.",
            counted(faces as u64, "face hangs over", "faces hang over")
        ));
    }
    findings
}

#[cfg(test)]
mod tests;
