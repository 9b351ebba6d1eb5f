//! Openings: loops of the measured border with the fill between them, and which of them are to be closed.

use glam::DVec3;
use rustc_hash::FxHashMap;

use base::error::Result;
use base::progress::{Pace, Progress};
use geom::bvh::Ray;
use mesh::holes;

use super::cut;
use super::stitch::Growing;
use super::surface::{Surface, normal};
use super::visibility::Envelope;

/// Share of the directions before a fill that have to end at the surface or in seen space.
const ENCLOSED: f64 = 0.5;
/// Places of an opening that are looked from, and directions over all of space.
const PLACES: usize = 24;
const DIRECTIONS: usize = 64;

/// The measured border.
pub struct Border {
    /// Loop of each border vertex.
    of_vertex: FxHashMap<u32, u32>,
    pub loops: Vec<Loop>,
}

/// A loop of the measured border.
#[derive(Clone, Copy, Debug)]
pub struct Loop {
    /// Its vertex of the smallest number.
    pub vertex: u32,
    pub edges: usize,
    pub length: f64,
}

impl Border {
    /// Of the measured surface.
    pub fn new(surface: &Surface<'_>) -> Self {
        let border: Vec<[u32; 2]> = surface.border().into_iter().map(|border| border.0).collect();
        let next = holes::successors(&border);
        let mut starts: Vec<u32> = border.iter().map(|edge| edge[0]).collect();
        starts.sort_unstable();
        let mut found = Border { of_vertex: FxHashMap::default(), loops: Vec::new() };
        for vertex in starts {
            if found.of_vertex.contains_key(&vertex) {
                continue;
            }
            let sides = holes::walk(vertex, &next);
            let number = found.loops.len() as u32;
            found.of_vertex.extend(sides.iter().map(|side| (side[0], number)));
            let place = |v: u32| surface.mesh.positions[v as usize];
            let length = sides.iter().map(|&[a, b]| place(a).distance(place(b))).sum();
            found.loops.push(Loop { vertex, edges: sides.len(), length });
        }
        found
    }

    /// The vertices of some loops, in any order.
    pub fn vertices<'a>(&'a self, loops: &'a [u32]) -> impl Iterator<Item = u32> + 'a {
        self.of_vertex.iter().filter(|(_, number)| loops.contains(number)).map(|(&v, _)| v)
    }
}

/// Loops that one connected fill joins.
pub struct Opening {
    /// Numbers of loops, rising.
    pub loops: Vec<u32>,
    /// Filled triangles, rising.
    pub triangles: Vec<u32>,
}

/// The openings in the order of their first loops. One without a fill stayed open.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn find(surface: &Growing, border: &Border, progress: &Progress<'_>) -> Result<Vec<Opening>> {
    let filled = &surface.triangles[surface.measured[1]..];
    let (piece, count) = cut::pieces(filled, progress)?;
    // Loops first, then pieces, in one forest.
    let loops = border.loops.len();
    let mut parent: Vec<u32> = (0..(loops + count) as u32).collect();
    // The way to the root is halved at each visit.
    fn root(parent: &mut [u32], mut at: u32) -> u32 {
        while parent[at as usize] != at {
            parent[at as usize] = parent[parent[at as usize] as usize];
            at = parent[at as usize];
        }
        at
    }
    let mut pace = Pace::new(progress);
    for (t, corners) in filled.iter().enumerate() {
        pace.after(4)?;
        for v in corners {
            if let Some(&number) = border.of_vertex.get(v) {
                let [a, b] = [number, loops as u32 + piece[t]].map(|at| root(&mut parent, at));
                parent[a.max(b) as usize] = a.min(b);
            }
        }
    }
    let mut place = vec![u32::MAX; loops];
    let mut openings: Vec<Opening> = Vec::new();
    for number in 0..loops as u32 {
        let first = root(&mut parent, number) as usize;
        if place[first] == u32::MAX {
            place[first] = openings.len() as u32;
            openings.push(Opening { loops: Vec::new(), triangles: Vec::new() });
        }
        openings[place[first] as usize].loops.push(number);
    }
    for t in 0..filled.len() {
        let first = root(&mut parent, loops as u32 + piece[t]) as usize;
        if first < loops {
            openings[place[first] as usize].triangles.push((surface.measured[1] + t) as u32);
        }
    }
    Ok(openings)
}

/// Whether seen space or the surface surrounds what lies before an opening: at least half of the directions end there.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn is_enclosed(
    opening: &Opening,
    growing: &Growing,
    surface: &Surface<'_>,
    envelope: Envelope<'_>,
    cell: f64,
    progress: &Progress<'_>,
) -> Result<bool> {
    let Some((lo, hi)) = mesh::measure::bounds(&surface.mesh.positions) else { return Ok(false) };
    let farthest = lo.distance(hi);
    let stride = opening.triangles.len().div_ceil(PLACES).max(1);
    let (mut ended, mut asked) = (0, 0);
    for &t in opening.triangles.iter().step_by(stride) {
        let corners = growing.corners(t as usize);
        let (centre, normal) = ((corners[0] + corners[1] + corners[2]) / 3.0, normal(corners));
        for direction in (0..DIRECTIONS).map(direction).filter(|d| d.dot(normal) > 0.2) {
            progress.check()?;
            asked += 1;
            let ray = Ray { origin: centre, direction };
            let is_met = surface.bvh.first_hit(&ray, 2.0 * cell, farthest).is_some();
            let steps = (farthest / cell) as usize;
            let ends = is_met || (1..steps).any(|i| envelope.is_seen(centre + direction * (i as f64 * cell)));
            ended += usize::from(ends);
        }
    }
    Ok(asked > 0 && ended as f64 >= ENCLOSED * f64::from(asked))
}

/// One of the directions, evenly spread.
fn direction(i: usize) -> DVec3 {
    let z = 1.0 - (2 * i + 1) as f64 / DIRECTIONS as f64;
    let turn = i as f64 * std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let across = (1.0 - z * z).sqrt();
    DVec3::new(across * turn.cos(), across * turn.sin(), z)
}
