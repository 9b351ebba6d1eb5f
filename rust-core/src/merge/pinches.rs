//! Stage 7b: vertices where two fans of triangles meet only in a point are split, one vertex a fan.
//!
//! Around an edge of the grid lie four cells. Where two opposite ones are valid and the others are not, their triangles
//! share the edge's vertex and nothing else. Stage 5 gives most such cells up; what that leaves is split here, so that
//! the result is manifold whatever the input.

use rustc_hash::FxHashMap;

use super::lattice::Lattice;
use super::passes;
use super::reconstruct::Surface;
use crate::error::Result;
use crate::progress::Progress;

/// Distance, in cells, between the vertices of the fans along their edge of the grid.
const APART: f64 = 1.0 / 1024.0;

/// Splits all pinched vertices; returns how many.
pub fn split(surface: &mut Surface, lattice: &Lattice, progress: &Progress<'_>) -> Result<usize> {
    // Every fan that isn't closed has one boundary side starting at its vertex.
    let mut starting: Vec<u32> = surface.boundary.iter().map(|side| side[0]).collect();
    starting.sort_unstable();
    let mut pinched: Vec<u32> = starting.windows(2).filter(|w| w[0] == w[1]).map(|w| w[0]).collect();
    pinched.dedup();
    if pinched.is_empty() {
        return Ok(0);
    }
    let mut is_pinched = passes::filled(false, surface.positions.len(), progress)?;
    pinched.iter().for_each(|&v| is_pinched[v as usize] = true);
    let mut around: FxHashMap<u32, Vec<usize>> = pinched.iter().map(|&v| (v, Vec::new())).collect();
    passes::each(surface.triangles.len(), progress, |t| {
        for v in surface.triangles[t].iter().filter(|v| is_pinched[**v as usize]) {
            if let Some(list) = around.get_mut(v) {
                list.push(t);
            }
        }
    })?;
    for &vertex in &pinched {
        progress.check()?;
        let mut left = around.remove(&vertex).expect("every pinched vertex has its list");
        let mut fans = Vec::new();
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
            fans.push(fan);
        }
        separate(surface, lattice, vertex, fans);
    }
    Ok(pinched.len())
}

/// Gives each fan at `vertex` a vertex of its own, in a row along the grid line it lies on, in the order in which the fans
/// lie along it.
fn separate(surface: &mut Surface, lattice: &Lattice, vertex: u32, mut fans: Vec<Vec<usize>>) {
    let v = vertex as usize;
    let position = surface.positions[v];
    // The axis along which the vertex is furthest from a node.
    let cells = position / lattice.voxel;
    let off = (cells - cells.round()).abs();
    let axis = (0..3).max_by(|&a, &b| off[a].total_cmp(&off[b])).unwrap_or(0);
    // Places, not numbers, decide: which fan was found first must not matter.
    fans.sort_by_cached_key(|fan| {
        let others = || fan.iter().flat_map(|&t| surface.triangles[t]).filter(|&u| u != vertex);
        let place = |u: u32| surface.positions[u as usize] - position;
        let side: i32 = others().map(place).map(|d| i32::from(d[axis] > 0.0) - i32::from(d[axis] < 0.0)).sum();
        let lowest = others().map(|u| surface.positions[u as usize].to_array().map(ordered)).min();
        (side, lowest)
    });
    let middle = (fans.len() - 1) as f64 / 2.0;
    surface.scan[v] = -1;
    for (rank, fan) in fans.iter().enumerate() {
        let mut moved = position;
        moved[axis] += APART * lattice.voxel * (rank as f64 - middle);
        if rank == 0 {
            surface.positions[v] = moved;
        } else {
            let copy = surface.positions.len() as u32;
            surface.positions.push(moved);
            surface.confidence.push(surface.confidence[v]);
            surface.colour.push(surface.colour[v]);
            surface.scan.push(-1);
            rename(surface, vertex, copy, fan);
        }
    }
}

/// A key that orders finite numbers as they are.
fn ordered(x: f64) -> i64 {
    let bits = x.to_bits() as i64;
    bits ^ (((bits >> 63) as u64) >> 1) as i64
}

/// Puts `copy` in the place of `vertex` in a fan and in its boundary sides.
fn rename(surface: &mut Surface, vertex: u32, copy: u32, fan: &[usize]) {
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
