//! The cavity: all that lies deeper than the walls are thick. Its surface is the level set of the distance on a grid.
//!
//! Distances are exact at the nodes beside the level set. Everywhere else a sign suffices: distances grow no faster than places move, so
//! that one distance decides a whole block of nodes.

use std::cmp::Ordering;

use glam::DVec3;
use rayon::prelude::*;

use base::error::{Error, Result, Shown};
use base::memory;
use base::progress::{Pace, Progress};
use close::grid::Grid;
use close::{crossing, level};
use geom::bvh::{Bvh, Closest, Feature};
use mesh::TriMesh;
use mesh::measure::{angles, bounds, total_area};

use super::made::{BYTES_A_TRIANGLE, Made, Origin};
use super::params::{LEAST_CELLS, PrepareParams};
use super::report::{PrepareProblem, PrepareReport};
use super::section::Section;
use super::single::Precision;
use super::slice;

/// The default cell in the thickness of a wall.
const CELLS: f64 = 4.0;
/// The longest side has at most so many cells by default, unless the walls need more.
const ALONG: f64 = 256.0;
/// Nodes of a block along each axis.
const BLOCK: usize = 8;
/// Times that nodes of crossing faces are given back to the walls.
const ROUNDS: usize = 20;
/// At the peak of sampling: a node of the grid, and a face of the mesh with its boxes.
const BYTES_A_NODE: f64 = 13.0;
const BYTES_A_SAMPLED_FACE: f64 = 110.0;
/// Faces of a level set in an area of one cell squared. Its area is taken to be the mesh's.
const FACES_A_CELL: f64 = 2.0;

/// A cavity.
pub struct Cavity {
    /// Its faces are those from here on.
    pub first_face: usize,
    /// Its flat floor.
    pub floor: Option<Section>,
}

/// Hollows a closed mesh. Its vertices keep their bits, and its faces come first. Beside a `base` to be drained the cavity has a flat floor,
/// one wall above it. Gives nothing, and says so, if the mesh is nowhere thicker than two walls.
///
/// # Errors
/// [`Error::OutOfMemory`] for a grid that does not fit. [`Error::Cancelled`].
pub fn hollow(
    mesh: &mut TriMesh,
    wall: f64,
    base: Option<Section>,
    params: &PrepareParams,
    report: &mut PrepareReport,
    progress: &Progress<'_>,
) -> Result<Option<Cavity>> {
    let (lo, hi) = bounds(&mesh.positions).unwrap_or_default();
    let cell = cell(hi - lo, wall, params);
    report.hollow_cell = Some(cell);
    let nothing = |report: &mut PrepareReport| {
        let text = format!("The mesh is nowhere thicker than two walls of {}: give thinner ones", Shown(wall));
        report.note(PrepareProblem::NothingHollow, text);
    };
    if (hi - lo).min_element() <= 2.0 * wall {
        nothing(report);
        return Ok(None);
    }
    foresee(mesh, hi - lo, cell)?;
    let precision = Precision::of(mesh);
    let mut grid = Grid::around(lo + wall, hi - wall, cell, 2.0 * cell);
    let floor_at = base.map(|base| base.moved(if base.is_upward { wall } else { -wall }).rounded(precision));
    if let Some(plane) = floor_at {
        // Between two layers of nodes, so that no edge of the level set lies in it.
        let layers = (plane.at - grid.origin[plane.axis]) / cell;
        grid.origin[plane.axis] += cell * (layers - layers.floor() - 0.5);
    }
    let depths = Depths::new(mesh, wall, base, progress)?;
    let mut field = depths.field(&grid, progress)?;
    let mut cavity = level_set(&grid, &mut field, precision, progress)?;
    let mut floor = None;
    if let Some(plane) = floor_at {
        let lies = |side: Ordering| cavity.positions.iter().any(|&place| plane.side(place) == side);
        if !lies(Ordering::Greater) {
            cavity = TriMesh::default();
        } else if lies(Ordering::Less) {
            let slice::Sliced { parts: [part], plane } = slice::side(&cavity, plane, progress)?;
            cavity = part.finish(&cavity);
            floor = Some(plane);
        }
    }
    if cavity.triangles.is_empty() {
        nothing(report);
        return Ok(None);
    }
    let (thinnest, thickest) = walls(&cavity, &depths.whole, progress)?;
    (report.thinnest_wall, report.thickest_wall) = (Some(thinnest), Some(thickest));
    drop(depths);
    let mut made = Made::of(mesh);
    let first_face = made.triangles.len();
    let first = made.positions.len() as u32;
    cavity.positions.iter().for_each(|&place| _ = made.vertex(place, Origin::New));
    for [a, b, c] in cavity.triangles {
        // Seen from the walls a cavity is inside out.
        made.triangle([a, c, b].map(|v| v + first), None, true);
    }
    *mesh = made.finish(mesh);
    Ok(Some(Cavity { first_face, floor }))
}

/// The cell of a cavity in a mesh of this size.
fn cell(size: DVec3, wall: f64, params: &PrepareParams) -> f64 {
    let finest = (wall / CELLS).max(size.max_element() / ALONG).min(wall / LEAST_CELLS);
    params.hollow_cell.unwrap_or(finest)
}

/// Refuses a cavity whose grid does not fit, as far as it is known at the beginning: neither a base nor a length changes the size.
///
/// # Errors
/// [`Error::OutOfMemory`].
pub fn refuse_large_grid(mesh: &TriMesh, params: &PrepareParams) -> Result<()> {
    let (lo, hi) = bounds(&mesh.positions).unwrap_or_default();
    match params.hollow.filter(|_| params.scale_to.is_none() && !params.flat_base) {
        Some(wall) if (hi - lo).min_element() > 2.0 * wall => foresee(mesh, hi - lo, cell(hi - lo, wall, params)),
        _ => Ok(()),
    }
}

/// Refuses a grid that does not fit, before any of it is made.
fn foresee(mesh: &TriMesh, size: DVec3, cell: f64) -> Result<()> {
    let nodes: f64 = (size / cell + 16.0).to_array().iter().product();
    let faces = mesh.triangles.len() as f64;
    let made = faces + FACES_A_CELL * total_area(mesh) / (cell * cell);
    let bytes = (BYTES_A_NODE * nodes + BYTES_A_SAMPLED_FACE * faces).max(BYTES_A_TRIANGLE * made);
    let remedy = "give a larger hollow_cell or thicker walls";
    memory::expect(bytes, || format!("a cavity on a grid of {nodes:.0} nodes"), remedy)?;
    if nodes >= f64::from(u32::MAX) {
        return Err(Error::OutOfMemory(format!("a cavity on a grid of {nodes:.0} nodes is more than 2^32: {remedy}")));
    }
    Ok(())
}

/// The surface of the cavity, which no two faces of cross. Places where they would are left to the walls.
fn level_set(grid: &Grid, field: &mut [f64], precision: Precision, progress: &Progress<'_>) -> Result<TriMesh> {
    for _ in 0..ROUNDS {
        let place = |a, b, share| level::between([a, b].map(|node| grid.place(node)), share);
        let mut cavity = level::extract(grid.cells(), field, place, progress)?;
        cavity.positions.iter_mut().for_each(|place| *place = precision.place(*place));
        let crossings = crossing::pairs(&cavity.positions, &cavity.triangles, |_| true, progress)?;
        if crossings.is_empty() {
            return Ok(cavity);
        }
        for &t in crossings.iter().flatten() {
            let centre = cavity.corners(t as usize).iter().sum::<DVec3>() / 3.0;
            let (first, fraction) = grid.cell_of(centre);
            grid.corners(first, fraction).iter().for_each(|&(node, _)| field[node] = field[node].max(grid.cell));
        }
    }
    Ok(TriMesh::default())
}

/// Least and largest distance of a cavity from a surface.
fn walls(cavity: &TriMesh, surface: &Bvh<'_>, progress: &Progress<'_>) -> Result<(f64, f64)> {
    let centres = (0..cavity.triangles.len()).map(|t| cavity.corners(t).iter().sum::<DVec3>() / 3.0);
    let places: Vec<DVec3> = cavity.positions.iter().copied().chain(centres).collect();
    let extremes: Vec<(f64, f64)> = places
        .par_chunks(1024)
        .map(|places| {
            progress.check()?;
            let distances = places.iter().filter_map(|&place| surface.closest_point(place)).map(|near| near.distance());
            Ok(distances.fold((f64::INFINITY, 0.0_f64), |(least, most), d| (least.min(d), most.max(d))))
        })
        .collect::<Result<_>>()?;
    Ok(extremes.iter().fold((f64::INFINITY, 0.0), |(least, most), d| (least.min(d.0), most.max(d.1))))
}

/// Distances below the surface.
struct Depths<'a> {
    mesh: &'a TriMesh,
    wall: f64,
    whole: Bvh<'a>,
    /// All faces but those of a base, which a floor is cut for.
    sides: Option<Bvh<'a>>,
    is_base: Vec<bool>,
    normals: Normals,
}

impl<'a> Depths<'a> {
    fn new(mesh: &'a TriMesh, wall: f64, base: Option<Section>, progress: &Progress<'_>) -> Result<Self> {
        let threads = rayon::current_num_threads();
        let build = |triangles: &[[u32; 3]]| Bvh::build_with(&mesh.positions, triangles, threads, progress);
        let lies = |t: &[u32; 3]| {
            base.is_some_and(|base| t.iter().all(|&v| base.side(mesh.positions[v as usize]) == Ordering::Equal))
        };
        let is_base: Vec<bool> = mesh.triangles.iter().map(lies).collect();
        let others = mesh.triangles.iter().zip(&is_base).filter(|(_, is_base)| !**is_base).map(|(t, _)| *t);
        let sides = if base.is_some() { Some(build(&others.collect::<Vec<_>>())?) } else { None };
        let (whole, normals) = (build(&mesh.triangles)?, Normals::of(mesh, progress)?);
        Ok(Depths { mesh, wall, whole, sides, is_base, normals })
    }

    /// Negative in the cavity. At nodes farther than a cell from its surface the sign alone is right.
    fn field(&self, grid: &Grid, progress: &Progress<'_>) -> Result<Vec<f64>> {
        let layer = grid.counts[0] * grid.counts[1];
        let mut field = vec![grid.cell; grid.len()];
        field.par_chunks_mut(BLOCK * layer).enumerate().try_for_each(|(slab, field)| {
            let mut pace = Pace::new(progress);
            let layers = field.len() / layer;
            for j in (0..grid.counts[1]).step_by(BLOCK) {
                for i in (0..grid.counts[0]).step_by(BLOCK) {
                    let first = [i, j, BLOCK * slab];
                    let counts = [BLOCK.min(grid.counts[0] - i), BLOCK.min(grid.counts[1] - j), layers];
                    self.block(grid, first, counts, field, &mut pace)?;
                }
            }
            Ok(())
        })?;
        // The surface is closed at the outer bound.
        for node in 0..grid.len() {
            if grid.is_outermost(node) {
                field[node] = grid.cell;
            }
        }
        Ok(field)
    }

    /// The nodes of a block, whose layers begin at the slab's first.
    fn block(
        &self,
        grid: &Grid,
        first: [usize; 3],
        counts: [usize; 3],
        field: &mut [f64],
        pace: &mut Pace<'_>,
    ) -> Result<()> {
        pace.after(256)?;
        let corner = grid.place(grid.index(first));
        let size = grid.cell * DVec3::from(counts.map(|n| (n - 1) as f64));
        let (middle, radius) = (corner + 0.5 * size, 0.5 * size.length());
        let whole = self.whole.closest_point(middle);
        let depth = self.depth(middle, whole);
        let layer = grid.counts[0] * grid.counts[1];
        let at = |i: usize, j: usize, k: usize| first[0] + i + grid.counts[0] * (first[1] + j) + layer * k;
        let room = radius + grid.cell;
        if depth < self.wall - room {
            return Ok(());
        }
        if depth > self.wall + room && whole.is_some_and(|near| near.distance() > radius) {
            if self.is_inside(middle, whole) {
                for k in 0..counts[2] {
                    for j in 0..counts[1] {
                        field[at(0, j, k)..at(0, j, k) + counts[0]].fill(-grid.cell);
                    }
                }
            }
            return Ok(());
        }
        for k in 0..counts[2] {
            for j in 0..counts[1] {
                // Nodes to come whose value is that of the last, as far as signs go.
                let (mut known, mut value) = (0, grid.cell);
                let mut last = None;
                for i in 0..counts[0] {
                    if known == 0 {
                        pace.after(128)?;
                        let place = corner + grid.cell * DVec3::from([i, j, k].map(|n| n as f64));
                        let guess = last.map(|t| Closest::on_triangle(place, &self.mesh.corners(t as usize), t));
                        let whole = self.whole.closest_point_from(place, guess);
                        last = whole.map(|near| near.triangle);
                        let below = self.wall - self.depth(place, whole);
                        let is_inside = below >= 0.0 || self.is_inside(place, whole);
                        value = if is_inside { below } else { grid.cell };
                        // A cell remains between the last of them and both the level set and the surface.
                        let free = below.abs().min(if below < 0.0 {
                            whole.map_or(0.0, |near| near.distance())
                        } else {
                            f64::INFINITY
                        });
                        known = ((free / grid.cell - 1.0).max(0.0) as usize) + 1;
                    } else {
                        value = value.signum() * grid.cell;
                    }
                    known -= 1;
                    field[at(i, j, k)] = value;
                }
            }
        }
        Ok(())
    }

    /// Distance to the surface that walls are measured from.
    fn depth(&self, place: DVec3, whole: Option<Closest>) -> f64 {
        let sides = self.sides.as_ref().filter(|_| whole.is_some_and(|near| self.is_base[near.triangle as usize]));
        let near = sides.map_or(whole, |sides| sides.closest_point(place));
        near.map_or(f64::INFINITY, |near| near.distance())
    }

    fn is_inside(&self, place: DVec3, whole: Option<Closest>) -> bool {
        whole.is_some_and(|near| (place - near.point).dot(self.normals.at(self.mesh, &near)) < 0.0)
    }
}

/// Normals that tell the side of a place by its nearest point. \[BA05\]
struct Normals {
    vertices: Vec<DVec3>,
    /// The ends of each edge, in the direction of its face, with the face.
    edges: Vec<([u32; 2], u32)>,
}

impl Normals {
    fn of(mesh: &TriMesh, progress: &Progress<'_>) -> Result<Self> {
        let mut pace = Pace::new(progress);
        let mut vertices = vec![DVec3::ZERO; mesh.positions.len()];
        let mut edges = Vec::with_capacity(3 * mesh.triangles.len());
        for (t, corners) in mesh.triangles.iter().enumerate() {
            pace.after(8)?;
            let (normal, angles) = (normal(mesh, t), angles(mesh.corners(t)));
            for k in 0..3 {
                vertices[corners[k] as usize] += normal * angles[k];
                edges.push(([corners[(k + 1) % 3], corners[(k + 2) % 3]], t as u32));
            }
        }
        progress.sort(&mut edges, &|a, b| a.cmp(b))?;
        Ok(Normals { vertices, edges })
    }

    fn at(&self, mesh: &TriMesh, near: &Closest) -> DVec3 {
        let (t, corners) = (near.triangle as usize, mesh.triangles[near.triangle as usize]);
        match near.feature {
            Feature::Inside => normal(mesh, t),
            Feature::Corner(k) => self.vertices[corners[k as usize] as usize],
            Feature::Edge(k) => {
                let [from, to] = [1, 2].map(|step| corners[(k as usize + step) % 3]);
                let beyond = self.edges.binary_search_by(|edge| edge.0.cmp(&[to, from]));
                normal(mesh, t) + beyond.map_or(DVec3::ZERO, |at| normal(mesh, self.edges[at].1 as usize))
            }
        }
    }
}

fn normal(mesh: &TriMesh, t: usize) -> DVec3 {
    let [a, b, c] = mesh.corners(t);
    (b - a).cross(c - a).normalize_or_zero()
}
