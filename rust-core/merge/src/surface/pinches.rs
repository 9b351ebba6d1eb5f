//! Stage 7b: vertices where two fans of triangles meet only in a point are split, one vertex a fan.
//!
//! Around an edge of the grid lie four cells. If two opposite ones are valid and the others are not, their triangles share the edge's
//! vertex and nothing else. Stage 5 gives most such cells up. The rest are split here, so that the result is manifold whatever the input.

use glam::DVec3;
use rustc_hash::FxHashMap;

use super::extract::{self, Surface};
use super::passes;
use crate::crossings::lattice::Lattice;
use base::error::Result;
use base::progress::Progress;
use base::work;

/// Distance, in cells, between the vertices of the fans along their edge of the grid. A fill may join them by an edge.
const APART: f64 = 1.0 / 32.0;

/// Splits all pinched vertices, the lowest first. The new vertices follow the others. Returned is which vertex each of them was split from.
pub fn split(surface: &mut Surface, lattice: &Lattice, progress: &Progress<'_>) -> Result<Vec<u32>> {
    // Every fan that isn't closed has one boundary side starting at its vertex.
    let mut starting: Vec<u32> = surface.boundary.iter().map(|side| side[0]).collect();
    starting.sort_unstable();
    let mut pinched: Vec<u32> = starting.windows(2).filter(|w| w[0] == w[1]).map(|w| w[0]).collect();
    pinched.dedup();
    let mut copied = Vec::new();
    if pinched.is_empty() {
        return Ok(copied);
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
    // Of each pinched vertex, its sides of the boundary: a side keeps its place whatever its ends are called by then.
    let mut sides: FxHashMap<u32, Vec<usize>> = FxHashMap::default();
    passes::each(surface.boundary.len(), progress, |side| {
        for v in surface.boundary[side].into_iter().filter(|&v| is_pinched[v as usize]) {
            sides.entry(v).or_default().push(side);
        }
    })?;
    let mut before = FxHashMap::default();
    for &vertex in &pinched {
        progress.check()?;
        let at = around.remove(&vertex).expect("every pinched vertex has its list");
        let fans = fans(&surface.triangles, vertex, &at);
        copied.extend((1..fans.len()).map(|_| vertex));
        separate(surface, &mut before, lattice, vertex, fans, &sides[&vertex]);
    }
    Ok(copied)
}

/// The triangles at a vertex, `at`, in parts that share more vertices than this one. O(k log k) for k triangles.
fn fans(triangles: &[[u32; 3]], vertex: u32, at: &[usize]) -> Vec<Vec<usize>> {
    let mut spokes: Vec<(u32, usize)> = at
        .iter()
        .enumerate()
        .flat_map(|(place, &t)| triangles[t].into_iter().filter(|&v| v != vertex).map(move |v| (v, place)))
        .collect();
    spokes.sort_unstable_by(|a, b| {
        work::step();
        a.cmp(b)
    });
    // The triangles at each spoke, and the spokes of each triangle.
    let spokes: Vec<&[(u32, usize)]> = spokes.chunk_by(|a, b| a.0 == b.0).collect();
    let mut spokes_of = vec![Vec::with_capacity(2); at.len()];
    for (spoke, ends) in spokes.iter().enumerate() {
        ends.iter().for_each(|&(_, place)| spokes_of[place].push(spoke));
    }
    let (mut is_taken, mut is_passed) = (vec![false; at.len()], vec![false; spokes.len()]);
    let mut fans = Vec::new();
    for first in (0..at.len()).rev() {
        if is_taken[first] {
            continue;
        }
        is_taken[first] = true;
        let mut fan = vec![first];
        let mut next = 0;
        while next < fan.len() {
            for &spoke in &spokes_of[fan[next]] {
                if std::mem::replace(&mut is_passed[spoke], true) {
                    continue;
                }
                for &(_, place) in spokes[spoke] {
                    work::step();
                    if !std::mem::replace(&mut is_taken[place], true) {
                        fan.push(place);
                    }
                }
            }
            next += 1;
        }
        fans.push(fan.into_iter().map(|place| at[place]).collect());
    }
    fans
}

/// Gives each fan at `vertex` a vertex of its own, in a row along the grid line it lies on, in the order in which the fans lie along it.
/// `sides`: the places of the vertex's sides of the boundary. `before`: where vertices were that have been moved.
fn separate(
    surface: &mut Surface,
    before: &mut FxHashMap<u32, DVec3>,
    lattice: &Lattice,
    vertex: u32,
    mut fans: Vec<Vec<usize>>,
    sides: &[usize],
) {
    let v = vertex as usize;
    let position = surface.positions[v];
    // The axis along which the vertex is furthest from a node.
    let cells = position / lattice.voxel;
    let off = (cells - cells.round()).abs();
    let axis = (0..3).max_by(|&a, &b| off[a].total_cmp(&off[b])).unwrap_or(0);
    // Places, not numbers, decide, and those before any was moved: which fan, or which vertex, was found first must not matter.
    fans.sort_by_cached_key(|fan| {
        let others = fan.iter().flat_map(|&t| surface.triangles[t]).filter(|&u| u != vertex);
        let place = |u: u32| before.get(&u).copied().unwrap_or(surface.positions[u as usize]);
        let mut places: Vec<DVec3> = others.map(place).collect();
        let off = |p: &DVec3| p[axis] - position[axis];
        let side: i32 = places.iter().map(off).map(|d| i32::from(d > 0.0) - i32::from(d < 0.0)).sum();
        places.sort_unstable_by_key(|p| p.to_array().map(ordered));
        (side, places.iter().map(|p| p.to_array().map(ordered)).collect::<Vec<_>>())
    });
    before.insert(vertex, position);
    let middle = (fans.len() - 1) as f64 / 2.0;
    // No vertex of the row is nearer to a node than others are, unless the row is longer than an edge.
    let inset = (extract::APART + APART * middle).min(0.5);
    let fraction = cells[axis] - cells[axis].floor();
    let shift = fraction.clamp(inset, 1.0 - inset) - fraction;
    surface.scan[v] = -1;
    // A side of the boundary is a fan's if a triangle of the fan has it.
    let mut fan_of: FxHashMap<[u32; 2], usize> = FxHashMap::default();
    for (rank, fan) in fans.iter().enumerate() {
        for [a, b, c] in fan.iter().map(|&t| surface.triangles[t]) {
            fan_of.extend([[a, b], [b, c], [c, a]].map(|side| (side, rank)));
        }
    }
    let sides: Vec<(usize, usize)> =
        sides.iter().filter_map(|&side| Some((side, *fan_of.get(&surface.boundary[side])?))).collect();
    let mut names = vec![vertex];
    for (rank, fan) in fans.iter().enumerate() {
        let mut moved = position;
        moved[axis] += (shift + APART * (rank as f64 - middle)) * lattice.voxel;
        if rank == 0 {
            surface.positions[v] = moved;
        } else {
            let copy = surface.positions.len() as u32;
            before.insert(copy, position);
            surface.positions.push(moved);
            surface.confidence.push(surface.confidence[v]);
            surface.noise.push(surface.noise[v]);
            surface.colour.push(surface.colour[v]);
            surface.scan.push(-1);
            names.push(copy);
            for &t in fan {
                surface.triangles[t].iter_mut().for_each(|corner| rename(corner, vertex, copy));
            }
        }
    }
    for (side, rank) in sides {
        work::step();
        surface.boundary[side].iter_mut().for_each(|end| rename(end, vertex, names[rank]));
    }
}

fn rename(vertex: &mut u32, from: u32, to: u32) {
    if *vertex == from {
        *vertex = to;
    }
}

/// A key that orders finite numbers as they are.
fn ordered(x: f64) -> i64 {
    let bits = x.to_bits() as i64;
    bits ^ (((bits >> 63) as u64) >> 1) as i64
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::{TriMesh, check};

    fn surface(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Surface {
        let count = positions.len();
        let boundary = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
        Surface {
            positions,
            confidence: vec![1.0; count],
            noise: vec![0.0; count],
            colour: vec![[9; 4]; count],
            scan: vec![0; count],
            triangles,
            boundary,
            ..Surface::default()
        }
    }

    /// Splits and returns the steps it took. The result is manifold and its boundary that of its triangles.
    fn steps(mut surface: Surface, pinches: usize) -> u64 {
        let lattice = Lattice::new(1.0, DVec3::ZERO, [0; 3]).unwrap();
        let (split, steps) = work::counted(|| split(&mut surface, &lattice, &Progress::none()).unwrap());
        assert_eq!(split.iter().collect::<std::collections::BTreeSet<_>>().len(), pinches);
        let report = check(&TriMesh::new(surface.positions, surface.triangles.clone()));
        assert!(report.is_manifold() && report.boundary_edges == surface.boundary.len(), "{report}");
        let mut sides: Vec<[u32; 2]> =
            surface.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
        sides.sort_unstable();
        surface.boundary.sort_unstable();
        assert_eq!(surface.boundary, sides);
        steps
    }

    #[test]
    fn work_grows_with_the_number_of_pinches() {
        // Bow ties: two triangles at a vertex each.
        let work = |count: u32| {
            let corner = |i: u32| DVec3::new(f64::from(i) * 4.0 + 0.5, 0.0, 0.0);
            let places = [[0.0, 0.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0], [1.0, 1.0]];
            let bow_tie = |i: u32| places.map(|[x, y]| corner(i) + DVec3::new(x, y, 0.0));
            let triangles = |i: u32| [[0, 1, 2], [0, 3, 4]].map(|t| t.map(|v| 5 * i + v));
            steps(
                surface((0..count).flat_map(bow_tie).collect(), (0..count).flat_map(triangles).collect()),
                count as usize,
            )
        };
        let (one, two) = (work(5_000), work(10_000));
        assert!(one >= 5_000 && 10 * two <= 23 * one, "{one} {two}");
    }

    #[test]
    fn work_grows_with_the_number_of_fans_at_a_vertex() {
        let work = |count: u32| {
            let at = |i: u32| f64::from(i) / f64::from(2 * count) * std::f64::consts::TAU;
            let rim = (0..2 * count).map(|i| DVec3::new(0.5 + at(i).cos(), at(i).sin(), 0.25));
            let positions = std::iter::once(DVec3::new(0.5, 0.0, 0.0)).chain(rim).collect();
            steps(surface(positions, (0..count).map(|i| [0, 2 * i + 1, 2 * i + 2]).collect()), 1)
        };
        let (one, two) = (work(2_000), work(4_000));
        assert!(one >= 2_000 && 10 * two <= 23 * one, "{one} {two}");
    }
}
