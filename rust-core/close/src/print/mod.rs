//! Checks of a mesh before it is printed: closed, manifold, without crossings. Also bodies, volume, weight, size, walls and overhangs.
//!
//! Nothing is repaired. Topology is judged by [`mesh::check()`], crossings by exact predicates, walls by the mesh's hierarchy of boxes:
//! none of it shares code with closing.

mod operation;
mod params;
mod report;
#[doc(hidden)]
pub mod walls;

pub use super::bodies::Body;
pub use operation::OPERATION;
pub use params::{PrintParams, SCHEMA};
pub use report::{Checked, Fault, Finding, PrintReport};
pub use walls::Wall;

use glam::DVec3;
use rayon::prelude::*;

use base::error::{Error, Result};
use base::magnitude;
use base::memory;
use base::progress::Progress;
use geom::bvh::Bvh;
use mesh::measure::area;
use mesh::{Attribute, TriMesh, try_check};

use super::bodies::Bodies;
use super::crossing;
use super::surface::normal;

base::stages! {
    /// Stages with their shares of the time.
    PLAN:
    TOPOLOGY = "checking", 0.2;
    CROSSINGS = "looking for crossings", 0.3;
    WALLS = "measuring walls", 0.5;
}

/// At the peak: a copy of the mesh, its edges, its boxes and its walls.
const BYTES_A_TRIANGLE: f64 = 250.0;

/// Checks a mesh. Its faces get the attributes `wall`, `crossing` and `overhang`, which replace older ones of these names.
///
/// # Guarantees
/// The same result for any number of threads. Crossings are decided exactly, within the range of [`geom::predicates`].
///
/// # Cost
/// Time O(n log n) for n faces of which few cross, and about 250 bytes per face. With a large `max_wall`, many faces of a round body are equally near to the middle of the
/// same ball: one search looks at all of them. Neighbours share what it finds, unless noise turns them away from each other. Then a round
/// body takes up to O(n^2). The example `print_figures` measures both.
///
/// # Errors
/// Parameters out of range. A mesh without triangles, with an index out of range or a coordinate that is not finite. [`base::Error::OutOfMemory`].
/// [`base::Error::Cancelled`].
pub fn check_print(mesh: &TriMesh, params: &PrintParams, progress: &Progress<'_>) -> Result<Checked> {
    params.validate()?;
    mesh.validate()?;
    if mesh.triangles.is_empty() {
        return Err(Error::input("the mesh has no triangles, but must have some: give a surface"));
    }
    magnitude::points("vertex", &mesh.positions)?;
    memory::expect_each(mesh.triangles.len(), BYTES_A_TRIANGLE, 0.0, "checking the print of", "triangles")?;
    progress.plan(PLAN);
    let pool = base::threads::pool(params.threads)?;
    progress.run(&pool, || run(mesh, params, progress))
}

fn run(mesh: &TriMesh, params: &PrintParams, progress: &Progress<'_>) -> Result<Checked> {
    progress.stage(TOPOLOGY, 1);
    let mut report = PrintReport::default();
    report.set_topology(try_check(mesh, &progress.unseen())?);
    let bodies = Bodies::new(mesh, report.is_closed, progress)?;
    report.bodies = bodies.list.len();
    // Vertices that no face uses are not printed.
    let used: Vec<DVec3> = mesh.triangles.iter().flatten().map(|&v| mesh.positions[v as usize]).collect();
    let (lo, hi) = mesh::measure::bounds(&used).unwrap_or_default();
    drop(used);
    report.size = (hi - lo).to_array();
    report.is_fitting = params.too_short(report.size).is_empty();
    report.volume = report.is_closed.then(|| bodies.list.iter().map(|body| body.volume).sum::<f64>());
    report.weight = report.volume.zip(params.density).map(|(volume, density)| volume * density);
    progress.lap(PLAN[TOPOLOGY].0);
    progress.stage(CROSSINGS, 1);
    report.crossings = crossing::pairs(&mesh.positions, &mesh.triangles, |_| true, progress)?;
    report.crossing_pairs = report.crossings.len();
    progress.lap(PLAN[CROSSINGS].0);
    progress.stage(WALLS, mesh.triangles.len() as u64);
    let bvh = Bvh::build_with(&mesh.positions, &mesh.triangles, params.threads, progress)?;
    report.wall_limit = params.wall_limit((hi - lo).length());
    report.set_walls(walls::measure(mesh, &bvh, report.wall_limit, progress)?, params.min_wall);
    report.wall_spacing = (0..mesh.triangles.len()).map(|t| reach(mesh.corners(t))).fold(0.0, f64::max);
    let overhangs = overhangs(mesh, params);
    report.overhang_faces = overhangs.iter().filter(|overhang| **overhang).count();
    report.overhang_area =
        (0..overhangs.len()).filter(|&t| overhangs[t]).fold(0.0, |sum, t| sum + area(mesh.corners(t)));
    let mut crossing = vec![false; mesh.triangles.len()];
    report.crossings.iter().flatten().for_each(|&t| crossing[t as usize] = true);
    report.crossing_faces = crossing.iter().filter(|crossing| **crossing).count();
    let first_fault = if report.is_manifold { None } else { mesh::first_fault(mesh, &progress.unseen())? };
    report.find(mesh, bodies, first_fault, params);
    progress.lap(PLAN[WALLS].0);
    report.seconds = progress.seconds();

    let wall = report.walls.iter().map(|wall| wall.thickness.min(report.wall_limit) as f32).collect();
    let mut mesh = mesh.clone();
    for attribute in
        [Attribute::f32("wall", wall), Attribute::bool("crossing", crossing), Attribute::bool("overhang", overhangs)]
    {
        mesh.face_attributes.retain(|older| older.name != attribute.name);
        mesh.face_attributes.push(attribute);
    }
    Ok(Checked { mesh, report })
}

fn reach(corners: [DVec3; 3]) -> f64 {
    let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
    corners.iter().map(|corner| corner.distance(centre)).fold(0.0, f64::max)
}

/// Faces that look down more steeply than the angle, but for those that lie on the ground.
fn overhangs(mesh: &TriMesh, params: &PrintParams) -> Vec<bool> {
    let up = params.print_up.direction();
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

#[cfg(test)]
mod tests;
