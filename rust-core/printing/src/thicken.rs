//! Thin walls made thicker: their vertices move outward by half of what the ball inside a wall lacks, from each side.
//!
//! Displacements fade out around thin places. Faces that would cross keep their vertices back, so that no step leaves a crossing. So do
//! bodies that would jump into others or turn over without a crossing. Faces that stay thin are marked.

use std::cmp::Ordering;

use glam::DVec3;

use base::error::Result;
use base::progress::{Pace, Progress};
use close::bodies::Bodies;
use close::crossing;
use close::print::walls;
use geom::bvh::Bvh;
use mesh::holes::Bounds;
use mesh::measure::angles;
use mesh::{Attribute, TriMesh};

use super::report::PrepareReport;
use super::section::Section;
use super::single::Precision;

/// Name of the attribute of faces whose walls stay thin.
pub const THIN: &str = "thin";
/// Walls are measured up to so many times the thinnest one that is asked for: thicker ones take longer to measure, and need nothing.
const MEASURED: f64 = 2.0;
/// Most times that walls are measured and moved apart.
const ROUNDS: usize = 8;
/// Rings of edges around thin faces over which displacements fade out.
const RINGS: usize = 10;
/// Times that the displacement at crossing faces is halved, before they stay where they are.
const HALVINGS: u8 = 3;
/// Times that crossings are looked for in a round, before nothing moves in it.
const LOOKS: usize = 40;
/// A round that makes the thin walls lack so much of what they lacked before is the last.
const SLOW: f64 = 0.95;

/// Moves the sides of thin walls apart. Connectivity stays, and no vertex moves farther than `min_wall`. Vertices of a base stay in its plane.
///
/// # Errors
/// [`base::Error::OutOfMemory`]. [`base::Error::Cancelled`].
pub fn thicken(
    mesh: &mut TriMesh,
    min_wall: f64,
    base: Option<Section>,
    report: &mut PrepareReport,
    progress: &Progress<'_>,
) -> Result<()> {
    let before = mesh.positions.clone();
    let mut lacks = lacks(mesh, min_wall, progress)?;
    report.wall_before = lacks.thinnest;
    let bodies = Bodies::new(mesh, true, progress)?;
    let mut stand = (mesh.positions.clone(), lacks.clone());
    for _ in 0..ROUNDS {
        if lacks.sum == 0.0 || !spread(mesh, &bodies, &lacks, &before, min_wall, base, progress)? {
            break;
        }
        let earlier = lacks.sum;
        lacks = self::lacks(mesh, min_wall, progress)?;
        if lacks.sum < stand.1.sum {
            stand = (mesh.positions.clone(), lacks.clone());
        }
        if lacks.sum > SLOW * earlier {
            break;
        }
    }
    (mesh.positions, lacks) = stand;
    let is_moved = |&v: &u32| mesh.positions[v as usize] != before[v as usize];
    report.moved_faces = mesh.triangles.iter().filter(|t| t.iter().any(is_moved)).count();
    let moves = before.iter().zip(&mesh.positions).map(|(a, b)| a.distance(*b));
    report.deviation = moves.fold(0.0, f64::max);
    report.wall_after = lacks.thinnest;
    let is_thin: Vec<bool> = lacks.of.iter().map(|&lack| lack > 0.0).collect();
    mesh.rounding_room = None;
    mesh.face_attributes.retain(|attribute| attribute.name != THIN);
    mesh.face_attributes.push(Attribute::bool(THIN, is_thin));
    Ok(())
}

/// Walls behind faces, by the thickness that is missing.
#[derive(Clone)]
struct Lacks {
    /// Of each face. 0 where the wall is thick enough.
    of: Vec<f64>,
    sum: f64,
    /// `None` if no wall is thinner than is measured.
    thinnest: Option<f64>,
}

fn lacks(mesh: &TriMesh, min_wall: f64, progress: &Progress<'_>) -> Result<Lacks> {
    let bvh = Bvh::build_with(&mesh.positions, &mesh.triangles, rayon::current_num_threads(), progress)?;
    let limit = MEASURED * min_wall;
    let walls = walls::measure(mesh, &bvh, limit, &progress.unseen())?;
    let lack = |thickness: f64| if thickness < min_wall * (1.0 - walls::END) { min_wall - thickness } else { 0.0 };
    let of: Vec<f64> = walls.iter().map(|wall| lack(wall.thickness)).collect();
    let thinnest = walls.iter().map(|wall| wall.thickness).fold(f64::INFINITY, f64::min);
    Ok(Lacks { sum: of.iter().sum(), of, thinnest: Some(thinnest).filter(|thinnest| *thinnest < limit) })
}

/// Moves vertices outward by half of what the walls behind their faces lack, and never farther than `most` from where they were `before`.
/// Says whether any moved.
fn spread(
    mesh: &mut TriMesh,
    bodies: &Bodies,
    lacks: &Lacks,
    before: &[DVec3],
    most: f64,
    base: Option<Section>,
    progress: &Progress<'_>,
) -> Result<bool> {
    let mut ways = ways(mesh, lacks, &mut Pace::new(progress))?;
    for ((way, place), before) in ways.iter_mut().zip(&mesh.positions).zip(before) {
        *way = *before + (*place + *way - *before).clamp_length_max(most) - *place;
    }
    if let Some(base) = base {
        for (way, place) in ways.iter_mut().zip(&mesh.positions) {
            if base.side(*place) == Ordering::Equal {
                way[base.axis] = 0.0;
            } else if base.side(*place + *way) != Ordering::Greater {
                *way = DVec3::ZERO;
            }
        }
    }
    let precision = Precision::of(mesh);
    let mut halvings = vec![0_u8; ways.len()];
    for _ in 0..LOOKS {
        let moved = |place: DVec3, way: DVec3| if way == DVec3::ZERO { place } else { precision.place(place + way) };
        let places: Vec<DVec3> = mesh.positions.iter().zip(&ways).map(|(&place, &way)| moved(place, way)).collect();
        let is_moved = |t: usize| mesh.triangles[t].iter().any(|&v| places[v as usize] != mesh.positions[v as usize]);
        let mut faces = crossing::pairs(&places, &mesh.triangles, is_moved, progress)?.concat();
        if faces.is_empty() {
            faces = leading_into_others(mesh, bodies, &places, progress)?;
        }
        if faces.is_empty() {
            let is_any = places != mesh.positions;
            mesh.positions = places;
            return Ok(is_any);
        }
        let mut vertices: Vec<u32> = faces.iter().flat_map(|&t| mesh.triangles[t as usize]).collect();
        vertices.sort_unstable();
        vertices.dedup();
        for v in vertices {
            let v = v as usize;
            halvings[v] += 1;
            ways[v] = if halvings[v] > HALVINGS { DVec3::ZERO } else { 0.5 * ways[v] };
        }
    }
    Ok(false)
}

/// The faces whose way to their new places meets that of a body which lies in other bodies there, or is turned over. No two faces cross
/// before or after: the body jumped.
fn leading_into_others(mesh: &TriMesh, bodies: &Bodies, places: &[DVec3], progress: &Progress<'_>) -> Result<Vec<u32>> {
    let now = bodies.at(places, &mesh.triangles, true, progress)?;
    let jumped: Vec<bool> = now.iter().zip(&bodies.list).map(|(now, before)| now.lies_unlike(before)).collect();
    if !jumped.contains(&true) {
        return Ok(Vec::new());
    }
    let way = |t: u32| {
        let corners = mesh.triangles[t as usize].map(|v| v as usize);
        Bounds::of(corners.into_iter().flat_map(|v| [mesh.positions[v], places[v]]))
    };
    let faces = || 0..mesh.triangles.len() as u32;
    let of_jumped = faces().filter(|&t| jumped[bodies.of[t as usize] as usize]).map(way);
    let all = Bounds::of(of_jumped.flat_map(|bounds| [bounds.min, bounds.max]));
    Ok(faces().filter(|&t| way(t).meets(&all)).collect())
}

/// Displacements of the vertices. Those of thin faces move along the mean normal of these faces alone, so that borders of plates go straight
/// up and down. Those around them follow less and less. None goes inward.
fn ways(mesh: &TriMesh, lacks: &Lacks, pace: &mut Pace<'_>) -> Result<Vec<DVec3>> {
    let mut normals = vec![(DVec3::ZERO, 0.0); mesh.positions.len()];
    let mut most = vec![0.0_f64; mesh.positions.len()];
    let mut outward = vec![DVec3::ZERO; mesh.positions.len()];
    for (t, corners) in mesh.triangles.iter().enumerate() {
        pace.after(2)?;
        let [a, b, c] = mesh.corners(t);
        corners.iter().for_each(|&v| outward[v as usize] += (b - a).cross(c - a));
    }
    for (t, corners) in mesh.triangles.iter().enumerate().filter(|(t, _)| lacks.of[*t] > 0.0) {
        pace.after(8)?;
        let [a, b, c] = mesh.corners(t);
        let (normal, angles) = ((b - a).cross(c - a).normalize_or_zero(), angles([a, b, c]));
        for k in 0..3 {
            let v = corners[k] as usize;
            normals[v] = (normals[v].0 + normal * angles[k], normals[v].1 + angles[k]);
            most[v] = most[v].max(0.5 * lacks.of[t]);
        }
    }
    let own = |v: usize| (normals[v].1 > 0.0).then(|| normals[v].0 * (most[v] / normals[v].1));
    let mut ways: Vec<DVec3> = (0..normals.len()).map(|v| own(v).unwrap_or_default()).collect();
    for _ in 0..RINGS {
        let mut sums = vec![(DVec3::ZERO, 0.0); ways.len()];
        for t in &mesh.triangles {
            pace.after(4)?;
            for k in 0..3 {
                let (from, to) = (t[k] as usize, t[(k + 1) % 3] as usize);
                sums[from] = (sums[from].0 + ways[to], sums[from].1 + 1.0);
            }
        }
        for v in 0..ways.len() {
            if normals[v].1 == 0.0 && sums[v].1 > 0.0 {
                ways[v] = sums[v].0 / sums[v].1;
            }
        }
    }
    // By so much the enclosed volume would shrink.
    for (way, outward) in ways.iter_mut().zip(outward) {
        let inward = way.dot(outward).min(0.0);
        if inward < 0.0 {
            *way -= outward * (inward / outward.length_squared());
        }
    }
    Ok(ways)
}
