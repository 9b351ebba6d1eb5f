//! Loops that nothing else closes. A fan around one vertex is moved to where it neither crosses anything nor lies in seen space, or triangles
//! over the loop's own vertices do without one. A loop for which there is neither is cut along a short chord, and so are its parts.

use std::collections::BTreeMap;

use glam::DVec3;
use rustc_hash::FxHashSet;

use base::error::Result;
use base::progress::Progress;
use geom::delaunay2::polygon;
use geom::span;
use geom::triangles::cross;
use mesh::holes::{self, Bounds};

use super::crossing::Crossed;
use super::retreat::is_in_seen_space;
use super::stitch::Growing;
use super::surface::normal;
use super::visibility::Envelope;
use super::{bridge, clear};

/// Loops of more edges are cut first: one vertex is no shape for them.
const MOST_EDGES: usize = 64;
/// Places at which the vertex is tried, in cells along the normal from the loop's middle.
const TRIED: [f64; 7] = [0.0, -0.25, -0.5, -1.0, -1.5, -2.0, -3.0];
/// After these, as shares of the loop's radius: behind a crumb that lies just before the rest.
const SHALLOW: [f64; 3] = [-0.4, -0.2, -0.1];
/// Outwards, in cells.
const OUTWARDS: [f64; 3] = [0.25, 0.5, 1.0];
/// After these, places all around the middle, the nearest first: their pitch as a share of the loop's radius, and how many there are on
/// each side of it.
const PITCH: f64 = 0.25;
const AROUND: i32 = 3;
/// They lie beside the planes through the middle, as measured vertices lie in planes of the merge's grid: there triangles touch.
const BESIDE: DVec3 = DVec3::new(0.13, 0.07, 0.09);
/// Chords of a loop that are tried, the shortest for the way that they cut off first.
const CHORDS: usize = 24;
/// Ends of chords that are tried lie this part of the loop's edges apart.
const APART: usize = 64;
/// The triangle over a chord that stands for it where it is asked whether it crosses anything: its height as a share of its length.
const SLIVER: f64 = 1e-3;

/// Cosine between the normals of a triangle of a fan and the one beside it, beyond which they lie on each other. A fan of such triangles
/// alone encloses nothing.
const FOLDED: f64 = -0.999;

/// Rings of filled triangles around loops that stay open that go, so that wider loops are closed instead.
const RINGS: usize = 3;

/// Closes the loops for which a place is found, or triangles are, wholly or in part. Around those that stay open the fill is taken away and
/// made anew, if fewer edges are open then. No edge is added that was there before.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn close_loops(
    surface: &mut Growing,
    envelope: Option<Envelope<'_>>,
    cell: f64,
    progress: &Progress<'_>,
) -> Result<()> {
    close_once(surface, envelope, cell, progress)?;
    let mut open = surface.open_edges(progress)?;
    for rings in 1..=RINGS {
        if open.is_empty() {
            break;
        }
        let before = surface.filled();
        let mut around = open.clone();
        for _ in 0..rings {
            let mut is_marked = vec![false; surface.positions.len()];
            around.iter().flatten().for_each(|&v| is_marked[v as usize] = true);
            surface.take_away_around(&is_marked, progress)?;
            around = surface.open_edges(progress)?;
        }
        close_once(surface, envelope, cell, progress)?;
        around = surface.open_edges(progress)?;
        if around.len() < open.len() {
            open = around;
        } else {
            surface.restore(before);
        }
    }
    Ok(())
}

fn close_once(surface: &mut Growing, envelope: Option<Envelope<'_>>, cell: f64, progress: &Progress<'_>) -> Result<()> {
    let open = surface.open_with_triangles(progress)?;
    if open.is_empty() {
        return Ok(());
    }
    let normals: BTreeMap<u32, DVec3> = open
        .iter()
        .map(|(edge, triangle)| (edge[0], normal(triangle.map(|v| surface.positions[v as usize]))))
        .collect();
    let edges: Vec<[u32; 2]> = open.iter().map(|open| open.0).collect();
    let (loops, _) = holes::sort_out(&edges, |v| surface.positions[v as usize], |_| f64::INFINITY);
    let taken = bridge::between(&surface.triangles, |v| normals.contains_key(&v), progress)?;
    let crossed = Crossed::new(&surface.positions, &surface.triangles, progress)?;
    let mut around: Vec<[i32; 3]> = Vec::new();
    for i in -AROUND..=AROUND {
        for j in -AROUND..=AROUND {
            around.extend((-AROUND..=AROUND).map(|k| [i, j, k]));
        }
    }
    around.sort_by_key(|at| at.iter().map(|i| i * i).sum::<i32>());
    let mut patches = Patches {
        measured: surface.measured[0],
        positions: &mut surface.positions,
        normals,
        taken,
        crossed,
        envelope,
        cell,
        around,
        corners: Vec::new(),
        triangles: Vec::new(),
        progress,
    };
    let mut left: Vec<Vec<u32>> = loops.into_iter().rev().collect();
    let mut is_in_part = false;
    while let Some(vertices) = left.pop() {
        progress.check()?;
        if !patches.close(&vertices)? {
            match patches.cut(&vertices)? {
                Some(parts) => left.extend(parts),
                None => is_in_part = true,
            }
        }
    }
    let added = patches.triangles;
    surface.triangles.extend(added);
    if is_in_part {
        // A part that stays open beside parts that are closed may leave a vertex with several fans.
        surface.take_away(&vec![false; surface.triangles.len()], progress)?;
    }
    Ok(())
}

/// The surface and what closes its loops.
struct Patches<'a, 'p> {
    measured: usize,
    positions: &'a mut Vec<DVec3>,
    /// At the vertices of the loops.
    normals: BTreeMap<u32, DVec3>,
    /// Pairs of vertices of loops that an edge connects, the smaller number first.
    taken: FxHashSet<[u32; 2]>,
    crossed: Crossed,
    envelope: Option<Envelope<'a>>,
    cell: f64,
    around: Vec<[i32; 3]>,
    /// Of the triangles that were added, with their boxes.
    corners: Vec<(Bounds, [DVec3; 3])>,
    triangles: Vec<[u32; 3]>,
    progress: &'a Progress<'p>,
}

impl Patches<'_, '_> {
    /// Closes a loop as a whole. Returns whether that was possible.
    fn close(&mut self, vertices: &[u32]) -> Result<bool> {
        let n = vertices.len();
        let places = self.places(vertices);
        if n > MOST_EDGES {
            return self.flat(vertices, &places);
        }
        let middle = places.iter().sum::<DVec3>() / n as f64;
        let up = self.up(vertices);
        let radius = places.iter().map(|place| place.distance(middle)).fold(0.0, f64::max);
        let [tried, outwards] = [&TRIED[..], &OUTWARDS].map(|offsets| offsets.iter().map(|cells| cells * self.cell));
        let offsets: Vec<f64> = tried.chain(SHALLOW.map(|share| share * radius)).chain(outwards).collect();
        for offset in offsets {
            if self.fan(vertices, &places, middle + offset * up)? {
                return Ok(true);
            }
        }
        let may_connect = |a: usize, b: usize| self.may_connect(vertices[a], vertices[b]);
        let is_clear = |t: [usize; 3]| self.is_clear(t.map(|k| places[k]), t.map(|k| self.is_measured(vertices[k])));
        if let Some(over) = clear::triangulate(&places, may_connect, is_clear, self.progress)? {
            over.iter().for_each(|t| self.add(t.map(|k| vertices[k])));
            return Ok(true);
        }
        if self.flat(vertices, &places)? {
            return Ok(true);
        }
        for i in 0..self.around.len() {
            let offset = DVec3::from(self.around[i].map(f64::from)) + BESIDE;
            if self.fan(vertices, &places, middle + PITCH * radius * offset)? {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Adds the fan around a place if it fits. Returns whether it did.
    fn fan(&mut self, vertices: &[u32], places: &[DVec3], apex: DVec3) -> Result<bool> {
        let n = vertices.len();
        let fan: Vec<[DVec3; 3]> = (0..n).map(|i| [places[i], places[(i + 1) % n], apex]).collect();
        let is_folded = |(v, &triangle): (&u32, &[DVec3; 3])| {
            self.normals.get(v).is_some_and(|beside| beside.dot(normal(triangle)) < FOLDED)
        };
        if vertices.iter().zip(&fan).all(is_folded) {
            return Ok(false);
        }
        for (i, &triangle) in fan.iter().enumerate() {
            let meets = fan[..i].iter().any(|&other| cross(triangle, other));
            if meets || !self.is_free(triangle)? {
                return Ok(false);
            }
        }
        for (i, &triangle) in fan.iter().enumerate() {
            let is_measured = [vertices[i], vertices[(i + 1) % n]].map(|v| self.is_measured(v));
            if !self.is_unseen(triangle, [is_measured[0], is_measured[1], false])? {
                return Ok(false);
            }
        }
        let centre = self.positions.len() as u32;
        self.positions.push(apex);
        (0..n).for_each(|i| self.add([vertices[i], vertices[(i + 1) % n], centre]));
        Ok(true)
    }

    /// Adds triangles over the loop's own vertices that do not overlap as seen along the axis nearest to the normal, if all are clear. Returns
    /// whether they were.
    fn flat(&mut self, vertices: &[u32], places: &[DVec3]) -> Result<bool> {
        let up = self.up(vertices).abs();
        let axis = (0..3).fold(0, |best, axis| if up[axis] > up[best] { axis } else { best });
        let mut seen = places.to_vec();
        seen.iter_mut().for_each(|place| place[axis] = 0.0);
        let [a, b, c] = span::of(&seen, self.progress)?[..] else { return Ok(false) };
        let Some(triangles) = polygon(&seen, [a, b, c], self.progress)? else { return Ok(false) };
        let n = vertices.len() as u32;
        for t in &triangles {
            let corners = t.map(|k| places[k as usize]);
            let is_edge = |[a, b]: [u32; 2]| (a + 1) % n == b || (b + 1) % n == a;
            let [a, b, c] = *t;
            let mut sides = [[a, b], [b, c], [c, a]].into_iter().filter(|side| !is_edge(*side));
            let is_new = sides.all(|[a, b]| self.may_connect(vertices[a as usize], vertices[b as usize]));
            if !is_new || !self.is_clear(corners, t.map(|k| self.is_measured(vertices[k as usize])))? {
                return Ok(false);
            }
        }
        triangles.iter().for_each(|t| self.add(t.map(|k| vertices[k as usize])));
        Ok(true)
    }

    /// The two parts of a loop along the first clear chord.
    fn cut(&mut self, vertices: &[u32]) -> Result<Option<[Vec<u32>; 2]>> {
        let n = vertices.len();
        let places = self.places(vertices);
        let mut along = vec![0.0; n + 1];
        for i in 0..n {
            along[i + 1] = along[i] + places[i].distance(places[(i + 1) % n]);
        }
        let mut chords: Vec<(f64, [usize; 2])> = Vec::new();
        for i in 0..n {
            self.progress.check()?;
            for j in i + 2..n.min(i + n - 1) {
                let way = along[j] - along[i];
                let ratio = places[i].distance(places[j]) / way.min(along[n] - way);
                chords.push((ratio, [i, j]));
            }
        }
        self.progress.sort(&mut chords, &|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))?;
        let up = self.up(vertices);
        // Chords whose ends lie near those of one that was tried are no others.
        let near = n / APART + 1;
        let mut tried: Vec<[usize; 2]> = Vec::new();
        for (_, [i, j]) in chords {
            if tried.len() == CHORDS {
                break;
            }
            if tried.iter().any(|[a, b]| a.abs_diff(i).max(b.abs_diff(j)) < near) {
                continue;
            }
            tried.push([i, j]);
            let (a, b) = (places[i], places[j]);
            let sliver = [a, b, 0.5 * (a + b) + SLIVER * a.distance(b) * up];
            let [from, to] = [vertices[i], vertices[j]];
            if self.may_connect(from, to)
                && self.is_clear(sliver, [self.is_measured(from), self.is_measured(to), false])?
            {
                self.taken.insert([from.min(to), from.max(to)]);
                return Ok(Some([vertices[i..=j].to_vec(), [&vertices[j..], &vertices[..=i]].concat()]));
            }
        }
        Ok(None)
    }

    fn add(&mut self, triangle: [u32; 3]) {
        let corners = triangle.map(|v| self.positions[v as usize]);
        self.corners.push((Bounds::of(corners), corners));
        let [a, b, c] = triangle;
        self.taken.extend([[a, b], [b, c], [c, a]].map(|[a, b]| [a.min(b), a.max(b)]));
        self.triangles.push(triangle);
    }

    /// Whether a triangle is free of the surface and of what was added, and out of seen space. Also of each corner whether it was measured.
    fn is_clear(&self, triangle: [DVec3; 3], is_measured: [bool; 3]) -> Result<bool> {
        Ok(self.is_free(triangle)? && self.is_unseen(triangle, is_measured)?)
    }

    /// Whether a triangle has an area, and meets neither the surface nor what was added.
    fn is_free(&self, triangle: [DVec3; 3]) -> Result<bool> {
        let bounds = Bounds::of(triangle);
        let meets = |(other, corners): &(Bounds, [DVec3; 3])| other.meets(&bounds) && cross(triangle, *corners);
        Ok(normal(triangle) != DVec3::ZERO
            && !self.corners.iter().any(meets)
            && !self.crossed.is_met(triangle, self.progress)?)
    }

    /// Whether a triangle lies out of seen space.
    fn is_unseen(&self, triangle: [DVec3; 3], is_measured: [bool; 3]) -> Result<bool> {
        self.progress.check()?;
        Ok(!self.envelope.is_some_and(|envelope| is_in_seen_space(triangle, is_measured, envelope, self.cell)))
    }

    fn may_connect(&self, a: u32, b: u32) -> bool {
        !self.taken.contains(&[a.min(b), a.max(b)])
    }

    fn is_measured(&self, vertex: u32) -> bool {
        (vertex as usize) < self.measured
    }

    fn places(&self, vertices: &[u32]) -> Vec<DVec3> {
        vertices.iter().map(|&v| self.positions[v as usize]).collect()
    }

    /// Mean normal at the vertices of a loop.
    fn up(&self, vertices: &[u32]) -> DVec3 {
        vertices.iter().filter_map(|v| self.normals.get(v)).sum::<DVec3>().normalize_or_zero()
    }
}
