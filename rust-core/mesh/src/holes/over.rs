//! Holes closed over their loops alone, for surfaces that go through given points and no others.
//!
//! Noise crumples a surface, so that each fill of a loop crosses triangles beside it, or its chords are edges already. Then one of these
//! gives way, and the loop runs around it. Else all at the loop's vertices give way, and the vertices are given up.

use std::cell::OnceCell;
use std::collections::BTreeSet;

use glam::DVec3;
use rayon::prelude::*;

use super::boxes::meeting;
use super::fill::{Rim, crosses};
use super::loops::{sort_out, trace};
use super::minimal::Loop;
use super::near::{self, Bounds, Mesh, gather};
use base::error::Result;
use base::progress::Progress;

/// Loops of more edges are closed as they are or not at all: each triangle beside one may have to be tried.
const FEW: usize = 32;

/// Times that loops are tried: what closes one may be in the way of another, and gone the next time.
const ROUNDS: usize = 3;

/// A loop closed.
struct Lid {
    triangles: Vec<[u32; 3]>,
    /// Triangles that gave way, rising.
    removed: Vec<u32>,
}

/// A loop that is open.
struct Hole {
    vertices: Vec<u32>,
    region: Bounds,
    /// Once nothing closes it: where something has to change before anything can.
    resists: Option<Bounds>,
}

/// Like [`super::close`] without new vertices, and gives the triangles back. Those around a hole may give way, so that vertices may lose
/// theirs. Over a loop of three edges there is but one triangle, which is taken whatever it crosses. A loop stays open if `is_wanted`
/// denies the triangles that would close it.
///
/// Cost: as [`super::close`], and for loops of up to 32 edges that resist that many times as much. Up to three times that if other loops
/// near them were closed.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn close_over_loops(
    positions: &[DVec3],
    mut triangles: Vec<[u32; 3]>,
    boundary: &[[u32; 2]],
    limit: impl FnMut(&[u32]) -> f64,
    is_wanted: impl Fn(&[[u32; 3]]) -> Result<bool> + Sync,
    progress: &Progress<'_>,
) -> Result<Vec<[u32; 3]>> {
    let (holes, _) = sort_out(boundary, |v| positions[v as usize], limit);
    let region = |hole: &[u32]| near::region(Mesh { positions, triangles: &[] }.region(hole));
    let mut holes: Vec<Hole> =
        holes.into_iter().map(|vertices| Hole { region: region(&vertices), vertices, resists: None }).collect();
    let mut border: Vec<u32> = boundary.iter().map(|edge| edge[0]).collect();
    border.sort_unstable();
    for _ in 0..ROUNDS {
        if holes.iter().all(|hole| hole.resists.is_some()) {
            break;
        }
        let mesh = Mesh { positions, triangles: &triangles };
        let lids = round(mesh, &mut holes, &mut border, &is_wanted, progress)?;
        if lids.is_empty() {
            break;
        }
        let mut removed: Vec<u32> = lids.iter().flat_map(|lid| lid.removed.iter().copied()).collect();
        removed.sort_unstable();
        let added = lids.into_iter().flat_map(|lid| lid.triangles);
        let mut changed: Vec<[u32; 3]> = removed.iter().map(|&t| triangles[t as usize]).collect();
        let mut removed = removed.into_iter().peekable();
        let mut place = 0..;
        triangles.retain(|_| removed.next_if_eq(&place.next().expect("endless")).is_none());
        let first = triangles.len();
        triangles.extend(added);
        changed.extend(&triangles[first..]);
        let reaches: Vec<Bounds> = holes.iter().map(|hole| hole.resists.unwrap_or(hole.region)).collect();
        let changes = gather(Mesh { positions, triangles: &changed }, &reaches, progress)?;
        for (hole, _) in holes.iter_mut().zip(changes).filter(|(_, near)| !near.is_empty()) {
            hole.resists = None;
        }
    }
    Ok(triangles)
}

/// Tries the holes once that do not resist. Those that are closed are holes no more, and their vertices leave the border.
fn round(
    mesh: Mesh<'_>,
    holes: &mut Vec<Hole>,
    border: &mut Vec<u32>,
    is_wanted: impl Fn(&[[u32; 3]]) -> Result<bool> + Sync,
    progress: &Progress<'_>,
) -> Result<Vec<Lid>> {
    let (tried, regions): (Vec<usize>, Vec<Bounds>) =
        holes.iter().enumerate().filter(|(_, hole)| hole.resists.is_none()).map(|(i, hole)| (i, hole.region)).unzip();
    let surroundings = gather(mesh, &regions, progress)?;
    let close = |i: usize, others: &[[DVec3; 3]]| {
        let (near, boxes) = (&surroundings[i], OnceCell::new());
        let place = Place { mesh, near, boxes, region: regions[i], others, border };
        Ok(match place.close(&holes[tried[i]].vertices, progress)? {
            Some(lid) if is_wanted(&lid.triangles)? => Some(lid),
            _ => None,
        })
    };
    let mut lids: Vec<Option<Lid>> = (0..tried.len()).into_par_iter().map(|i| close(i, &[])).collect::<Result<_>>()?;
    let is_open = |i: &usize| lids[*i].is_none();
    let reach = |i: usize| (tried[i], reach(mesh, &holes[tried[i]], &surroundings[i]));
    let resisting: Vec<(usize, Bounds)> = (0..tried.len()).into_par_iter().filter(is_open).map(reach).collect();
    // In the order of the holes, one that crosses an earlier one is made anew with those in view, or dropped.
    let boxes: Vec<(usize, Bounds)> =
        lids.iter().enumerate().filter(|(_, lid)| lid.is_some()).map(|(i, _)| (i, regions[i])).collect();
    let corners = |t: [u32; 3]| t.map(|v| mesh.positions[v as usize]);
    for group in meeting(&boxes, progress)?.chunk_by(|a, b| a.0 == b.0) {
        let later = group[0].0;
        let earlier: Vec<&Lid> = group.iter().filter_map(|&(_, i)| lids[i].as_ref()).collect();
        let others: Vec<[DVec3; 3]> = earlier.iter().flat_map(|lid| &lid.triangles).map(|&t| corners(t)).collect();
        let clashes = |lid: &Lid| {
            let own: Vec<[DVec3; 3]> = lid.triangles.iter().map(|&t| corners(t)).collect();
            crosses(&own, &others)
        };
        if lids[later].as_ref().is_some_and(&clashes) {
            let anew = close(later, &others)?.filter(|lid| !clashes(lid));
            lids[later] = anew;
        }
    }
    // Those for which triangles give way go after the others, and share no vertex with any.
    let mut lids: Vec<(Lid, usize)> =
        lids.into_iter().zip(tried).filter_map(|(lid, hole)| Some((lid?, hole))).collect();
    lids.sort_by_key(|(lid, _)| !lid.removed.is_empty());
    let mut touched = vec![false; mesh.positions.len()];
    let mut is_closed = vec![false; holes.len()];
    lids.retain(|(lid, hole)| {
        let gone = lid.removed.iter().map(|&t| mesh.triangles[t as usize]);
        let vertices: Vec<u32> = lid.triangles.iter().copied().chain(gone).flatten().collect();
        is_closed[*hole] = lid.removed.is_empty() || !vertices.iter().any(|&v| touched[v as usize]);
        if is_closed[*hole] {
            vertices.iter().for_each(|&v| touched[v as usize] = true);
        }
        is_closed[*hole]
    });
    for (hole, reach) in resisting {
        holes[hole].resists = Some(reach);
    }
    let mut closed: Vec<u32> = lids.iter().flat_map(|(_, hole)| holes[*hole].vertices.iter().copied()).collect();
    closed.sort_unstable();
    border.retain(|vertex| closed.binary_search(vertex).is_err());
    let mut is_closed = is_closed.into_iter();
    holes.retain(|_| !is_closed.next().expect("one a hole"));
    Ok(lids.into_iter().map(|(lid, _)| lid).collect())
}

/// All that the search for a lid depends on lies in this box: the triangles near it, and the vertices next to the hole's, which may be on
/// the border.
fn reach(mesh: Mesh<'_>, hole: &Hole, near: &[u32]) -> Bounds {
    let mut vertices = hole.vertices.clone();
    vertices.sort_unstable();
    let mut reach = hole.region;
    for &t in near {
        if mesh.triangles[t as usize].iter().any(|v| vertices.binary_search(v).is_ok()) {
            mesh.corners(t).into_iter().for_each(|corner| reach.add(corner));
        }
    }
    reach
}

/// Surroundings of a hole.
struct Place<'a> {
    mesh: Mesh<'a>,
    /// Triangles in the region.
    near: &'a [u32],
    /// Their boxes, from when they are first asked for.
    boxes: OnceCell<Vec<Bounds>>,
    region: Bounds,
    /// Triangles that close other holes.
    others: &'a [[DVec3; 3]],
    /// All vertices of boundaries, rising.
    border: &'a [u32],
}

impl Place<'_> {
    fn close(&self, hole: &[u32], progress: &Progress<'_>) -> Result<Option<Lid>> {
        if let Some(triangles) = self.over(hole, &[], progress)? {
            return Ok(Some(Lid { triangles, removed: Vec::new() }));
        }
        if hole.len() > FEW {
            return Ok(None);
        }
        for i in 0..hole.len() {
            let edge = [hole[(i + 1) % hole.len()], hole[i]];
            let Some((beside, apex)) = self.beside(edge) else { continue };
            if hole.contains(&apex) || self.border.binary_search(&apex).is_ok() {
                continue;
            }
            let mut longer = hole.to_vec();
            longer.insert(i + 1, apex);
            if let Some(triangles) = self.over(&longer, &[beside], progress)? {
                return Ok(Some(Lid { triangles, removed: vec![beside] }));
            }
        }
        let Some((rim, star)) = self.star(hole) else { return Ok(None) };
        Ok(self.over(&rim, &star, progress)?.map(|triangles| Lid { triangles, removed: star }))
    }

    /// The triangles at a hole's vertices, rising, and the loop around them all, if it is one.
    fn star(&self, hole: &[u32]) -> Option<(Vec<u32>, Vec<u32>)> {
        let corners = |t: &u32| self.mesh.triangles[*t as usize];
        let star: Vec<u32> =
            self.near.iter().copied().filter(|t| corners(t).iter().any(|v| hole.contains(v))).collect();
        let edges = || star.iter().map(corners).flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]]);
        let inner: BTreeSet<[u32; 2]> = edges().collect();
        let is_rim = |[a, b]: &[u32; 2]| !(inner.contains(&[*b, *a]) || hole.contains(a) && hole.contains(b));
        let rim: Vec<[u32; 2]> = edges().filter(is_rim).map(|[a, b]| [b, a]).collect();
        if rim.iter().any(|[a, _]| hole.contains(a) || self.border.binary_search(a).is_ok()) {
            return None;
        }
        let mut loops = trace(&rim);
        let around = loops.pop()?;
        (loops.is_empty() && around.is_simple && around.vertices.len() == rim.len()).then_some((around.vertices, star))
    }

    /// The triangle with a directed edge, and its third vertex.
    fn beside(&self, [from, to]: [u32; 2]) -> Option<(u32, u32)> {
        self.near.iter().find_map(|&t| {
            let [a, b, c] = self.mesh.triangles[t as usize];
            let apex = [([a, b], c), ([b, c], a), ([c, a], b)].into_iter().find(|(edge, _)| *edge == [from, to])?.1;
            Some((t, apex))
        })
    }

    /// Triangles over a loop that cross nothing but those that are `gone`, which rise.
    fn over(&self, hole: &[u32], gone: &[u32], progress: &Progress<'_>) -> Result<Option<Vec<[u32; 3]>>> {
        let is_left = |t: &u32| gone.binary_search(t).is_err();
        let rim = Rim::new(self.mesh, hole, self.near.iter().copied().filter(is_left));
        // A loop around a single triangle would get that triangle's other side.
        if hole.len() == 3 && rim.is_lone_triangle {
            return Ok(None);
        }
        let points: Vec<DVec3> = hole.iter().map(|&v| self.mesh.positions[v as usize]).collect();
        let lid = Loop { points: &points, outside: &rim.normals, taken: &rim.taken }.triangulate(progress)?;
        let Some(lid) = lid.filter(|_| self.region.encloses(&Bounds::of(points.iter().copied()))) else {
            return Ok(None);
        };
        if hole.len() == 3 {
            return Ok(Some(vec![[hole[0], hole[1], hole[2]]]));
        }
        let own: Vec<[DVec3; 3]> = lid.iter().map(|t| t.map(|v| points[v as usize])).collect();
        // Of all that is near only what is in the way: the same for one loop after the other.
        let boxes = self.boxes.get_or_init(|| self.near.iter().map(|&t| Bounds::of(self.mesh.corners(t))).collect());
        let whole = Bounds::of(points.iter().copied());
        let in_the_way = self.near.iter().zip(boxes).filter(|&(t, bounds)| bounds.meets(&whole) && is_left(t));
        let mut obstacles: Vec<[DVec3; 3]> = in_the_way.map(|(&t, _)| self.mesh.corners(t)).collect();
        obstacles.extend(self.others);
        Ok((!crosses(&own, &obstacles)).then(|| lid.into_iter().map(|t| t.map(|v| hole[v as usize])).collect()))
    }
}
