//! Sizes of cells that fit into what a fill has to close: thin walls, and the space between a surface and its base.
//!
//! They are given as cells to a cell of the merge.

use glam::DVec3;
use rustc_hash::FxHashSet;

use base::error::Result;
use base::progress::Progress;
use mesh::TriMesh;
use mesh::measure::area;

use super::openings::Border;
use super::params::OVER_BASE;
use super::report::{LeftOpen, OpeningReport};
use super::surface::{Surface, normal};
use super::thickness;

/// Cells of a fill in the thickness of a wall that it closes.
const IN_WALL: f64 = 2.0;
/// The second size by the first: where the level set runs beside the border is another chance.
const STILL_FINER: f64 = 1.4;
/// The finest size.
const MOST: f64 = 6.0;
/// The finest size over a base, if the grid has no more nodes than these there, in so many layers. It is at least the other.
const MOST_OVER_BASE: f64 = 16.0;
const LEAST_OVER_BASE: f64 = 4.0;
const MOST_NODES: f64 = 1e6;
const LAYERS: f64 = 14.0;
/// By this factor a number is larger than itself rounded to two digits, at most.
const ROUNDED: f64 = 1.06;
/// Cosine between up and the normal of a surface that looks up.
pub const LOOKS_UP: f64 = 0.5;

/// Sizes that fit into the walls around openings whose fills cross something. None if the walls are thick.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn for_walls(
    surface: &Surface<'_>,
    border: &Border,
    openings: &[OpeningReport],
    fill_cell: f64,
    progress: &Progress<'_>,
) -> Result<Vec<f64>> {
    let is_stuck = |vertex: u32| {
        let mut stuck = openings.iter().filter(|opening| opening.left_open == Some(LeftOpen::Crossing));
        stuck.any(|opening| opening.vertices.contains(&vertex))
    };
    let loops: Vec<u32> =
        (0..border.loops.len() as u32).filter(|&number| is_stuck(border.loops[number as usize].vertex)).collect();
    let vertices: FxHashSet<u32> = border.vertices(&loops).collect();
    let is_beside = |t: &u32| surface.mesh.triangles[*t as usize].iter().any(|v| vertices.contains(v));
    let triangles: Vec<u32> = (0..surface.mesh.triangles.len() as u32).filter(is_beside).collect();
    let wall = thickness::at(surface, &triangles, progress)?;
    let finer = wall.map_or(0.0, |wall| IN_WALL * fill_cell / wall);
    Ok(if finer > 1.0 { [1.0, STILL_FINER].map(|times| (times * finer).min(MOST)).to_vec() } else { Vec::new() })
}

/// Sizes that fit between the parts of a surface that look up and the base below. None if there is room for the usual ones, or none for
/// the finest.
pub fn over_base(mesh: &TriMesh, up: DVec3, height: f64, fill_cell: f64) -> Vec<f64> {
    let (room, finest) = room_over_base(mesh, up, height, fill_cell);
    let finer = OVER_BASE * fill_cell / room;
    if finer > 1.0 && finer <= finest { vec![finer, (STILL_FINER * finer).min(finest)] } else { Vec::new() }
}

/// Depth of a base from which on fills have room in the finest cells, also if it is rounded to two digits.
pub fn depth_needed(mesh: &TriMesh, up: DVec3, height: f64, fill_cell: f64) -> f64 {
    ROUNDED * OVER_BASE * fill_cell / room_over_base(mesh, up, height, fill_cell).1
}

/// Height above the base at which a surface looks up, and the finest size there.
fn room_over_base(mesh: &TriMesh, up: DVec3, height: f64, fill_cell: f64) -> (f64, f64) {
    let all = (0..mesh.triangles.len()).map(|t| mesh.corners(t));
    let (mut room, mut over) = (f64::INFINITY, 0.0);
    for corners in all.filter(|corners| normal(*corners).dot(up) > LOOKS_UP) {
        over += area(corners);
        room = corners.iter().map(|corner| corner.dot(up) - height).fold(room, f64::min);
    }
    let finest = fill_cell * (MOST_NODES / (LAYERS * over)).sqrt();
    (room, finest.clamp(LEAST_OVER_BASE, MOST_OVER_BASE))
}
