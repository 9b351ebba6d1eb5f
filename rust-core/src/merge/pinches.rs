//! Stage 7b: vertices where two fans of triangles meet only in a point are split, one vertex a fan.
//!
//! Around an edge of the grid lie four cells. Where two opposite ones are valid and the others are not, their triangles
//! share the edge's vertex and nothing else. Stage 5 gives most such cells up; what that leaves is split here, so that
//! the result is manifold whatever the input.

use glam::DVec3;
use rustc_hash::FxHashMap;

use super::lattice::Lattice;
use super::reconstruct::Surface;

/// How far, in cells, the vertex of each fan is moved along its edge of the grid, toward its fan.
const APART: f64 = 1.0 / 1024.0;

/// Splits all pinched vertices; returns how many.
pub fn split(surface: &mut Surface, lattice: &Lattice) -> usize {
    // Every fan that isn't closed has one boundary side starting at its vertex.
    let mut starting: Vec<u32> = surface.boundary.iter().map(|side| side[0]).collect();
    starting.sort_unstable();
    let mut pinched: Vec<u32> = starting.windows(2).filter(|w| w[0] == w[1]).map(|w| w[0]).collect();
    pinched.dedup();
    if pinched.is_empty() {
        return 0;
    }
    let mut is_pinched = vec![false; surface.positions.len()];
    pinched.iter().for_each(|&v| is_pinched[v as usize] = true);
    let mut around: FxHashMap<u32, Vec<usize>> = pinched.iter().map(|&v| (v, Vec::new())).collect();
    for (t, triangle) in surface.triangles.iter().enumerate() {
        for v in triangle.iter().filter(|v| is_pinched[**v as usize]) {
            if let Some(list) = around.get_mut(v) {
                list.push(t);
            }
        }
    }
    for &vertex in &pinched {
        let mut left = around.remove(&vertex).expect("every pinched vertex has its list");
        let mut own = Some(vertex);
        let position = surface.positions[vertex as usize];
        while let Some(t) = left.pop() {
            let mut fan = vec![t];
            let mut next = 0;
            while next < fan.len() {
                let here = surface.triangles[fan[next]];
                next += 1;
                left.retain(|&other| {
                    let shared = surface.triangles[other].iter().filter(|v| **v != vertex && here.contains(v)).count();
                    if shared > 0 {
                        fan.push(other);
                    }
                    shared == 0
                });
            }
            separate(surface, lattice, vertex, own.take(), &fan, position);
        }
    }
    pinched.len()
}

/// Gives a fan at `vertex`, which lay at `position`, a vertex of its own: `keep`, or a new one.
fn separate(surface: &mut Surface, lattice: &Lattice, vertex: u32, keep: Option<u32>, fan: &[usize], position: DVec3) {
    let v = vertex as usize;
    // Along the grid line the vertex lies on: the axis where it is furthest from a node.
    let cells = position / lattice.voxel;
    let off = (cells - cells.round()).abs();
    let axis = (0..3).max_by(|&a, &b| off[a].total_cmp(&off[b])).unwrap_or(0);
    let side: i32 = fan
        .iter()
        .flat_map(|&t| surface.triangles[t])
        .map(|u| surface.positions[u as usize][axis] - position[axis])
        .map(|d| i32::from(d > 0.0) - i32::from(d < 0.0))
        .sum();
    let mut moved = position;
    moved[axis] += APART * lattice.voxel * f64::from(side.signum());
    let copy = keep.unwrap_or(surface.positions.len() as u32);
    surface.scan[v] = -1;
    if keep.is_some() {
        surface.positions[v] = moved;
        return;
    }
    surface.positions.push(moved);
    surface.confidence.push(surface.confidence[v]);
    surface.colour.push(surface.colour[v]);
    surface.scan.push(-1);
    for &t in fan {
        for corner in &mut surface.triangles[t] {
            if *corner == vertex {
                *corner = copy;
            }
        }
    }
    // A boundary side belongs to this fan if a triangle of the fan has it.
    let sides: Vec<[u32; 2]> = fan
        .iter()
        .flat_map(|&t| {
            let [a, b, c] = surface.triangles[t];
            [[a, b], [b, c], [c, a]]
        })
        .collect();
    for side in &mut surface.boundary {
        let renamed = side.map(|u| if u == vertex { copy } else { u });
        if renamed != *side && sides.contains(&renamed) {
            *side = renamed;
        }
    }
}
