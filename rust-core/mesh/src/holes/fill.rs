//! All stages for one hole, and what to do if the result crosses something.

use std::collections::BTreeSet;

use glam::DVec3;

use super::fair;
use super::minimal::Loop;
use super::near::{Bounds, Mesh};
use super::patch::Patch;
use base::error::Result;
use base::progress::Progress;
use geom::triangles;

/// A closed hole.
pub(super) struct Fill {
    patch: Patch,
}

impl Fill {
    /// Whether it crosses one of the others.
    pub fn crosses(&self, others: &[&Fill]) -> bool {
        let obstacles = others.iter().flat_map(|other| other.corners());
        crosses(&self.corners(), &obstacles.collect::<Vec<_>>())
    }

    fn corners(&self) -> Vec<[DVec3; 3]> {
        corners(&self.patch)
    }

    /// Vertices and triangles that it appends.
    pub fn size(&self) -> [usize; 2] {
        [self.patch.points.len() - self.patch.loop_len, self.patch.triangles.len()]
    }

    /// Appends the fill to the mesh. `hole` are the vertices of its loop.
    pub fn append(
        &self,
        hole: &[u32],
        positions: &mut Vec<DVec3>,
        triangles: &mut Vec<[u32; 3]>,
        sources: &mut Vec<[u32; 3]>,
    ) {
        let (n, first) = (self.patch.loop_len, positions.len() as u32);
        let global = |v: u32| hole.get(v as usize).copied().unwrap_or_else(|| first + v - n as u32);
        positions.extend_from_slice(&self.patch.points[n..]);
        triangles.extend(self.patch.triangles.iter().map(|t| t.map(global)));
        sources.extend(self.patch.sources.iter().map(|s| s.map(global)));
    }
}

/// Closes a hole: faired, else only refined, else only triangulated, whichever first crosses nothing and gives no new vertex an edge below
/// `shortest`. `near` are the triangles of the mesh in the hole's region, `others` fills it must not cross.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub(super) fn close(
    mesh: Mesh<'_>,
    hole: &[u32],
    near: &[u32],
    others: &[&Fill],
    shortest: f64,
    progress: &Progress<'_>,
) -> Result<Option<Fill>> {
    let rim = Rim::new(mesh, hole, near.iter().copied());
    let points: Vec<DVec3> = hole.iter().map(|&v| mesh.positions[v as usize]).collect();
    let plain = Loop { points: &points, outside: &rim.normals, taken: &rim.taken }.triangulate(progress)?;
    let coarse = match plain {
        // A loop around a single triangle would get that triangle's other side.
        Some(triangles) if hole.len() > 3 || !rim.is_lone_triangle => Patch::new(points, rim.scale.clone(), triangles),
        _ => Patch::fan(points, rim.scale.clone()),
    };
    let mut refined = coarse.clone();
    refined.refine(&rim.taken, progress)?;
    let region = mesh.region(hole);
    let mut obstacles: Vec<[DVec3; 3]> = near.iter().map(|&t| mesh.corners(t)).collect();
    obstacles.extend(others.iter().flat_map(|other| other.corners()));
    let stays_clear = |patch: &Patch| {
        let bounds = Bounds::of(patch.points.iter().copied());
        region.encloses(&bounds) && !crosses(&corners(patch), &obstacles)
    };
    let faired = fair::fair(&refined, &rim.triangles, progress)?;
    for patch in [faired, refined, coarse] {
        progress.check()?;
        if patch.shortest_new_edge() >= shortest && stays_clear(&patch) {
            return Ok(Some(Fill { patch }));
        }
    }
    Ok(None)
}

fn corners(patch: &Patch) -> Vec<[DVec3; 3]> {
    (0..patch.triangles.len()).map(|t| patch.corners(t)).collect()
}

/// The mesh along a loop.
pub(super) struct Rim {
    /// Unit normal of the triangle at the edge from vertex i to the next.
    pub normals: Vec<Option<DVec3>>,
    /// Mean length of the edges at each vertex.
    scale: Vec<f64>,
    /// Pairs of the loop's vertices that an edge connects.
    pub taken: BTreeSet<[u32; 2]>,
    /// Triangles with a vertex of the loop: corners, and which vertices of the loop they are.
    triangles: Vec<([DVec3; 3], [Option<u32>; 3])>,
    /// Whether a triangle has three vertices of the loop that has only three.
    pub is_lone_triangle: bool,
}

impl Rim {
    pub fn new(mesh: Mesh<'_>, hole: &[u32], near: impl IntoIterator<Item = u32>) -> Self {
        let n = hole.len();
        let mut order: Vec<(u32, u32)> = hole.iter().enumerate().map(|(i, &v)| (v, i as u32)).collect();
        order.sort_unstable();
        // Most triangles of the region have no vertex of the loop; a bit for each remainder tells most of them apart.
        let mut remainders = [0_u64; 4];
        let place = |v: u32| ((v >> 6 & 3) as usize, v & 63);
        for &v in hole {
            let (word, bit) = place(v);
            remainders[word] |= 1 << bit;
        }
        let in_loop = |v: u32| {
            let (word, bit) = place(v);
            if remainders[word] >> bit & 1 == 0 {
                return None;
            }
            order.binary_search_by_key(&v, |o| o.0).ok().map(|k| order[k].1)
        };
        let mut rim = Rim {
            normals: vec![None; n],
            scale: Vec::new(),
            taken: BTreeSet::new(),
            triangles: Vec::new(),
            is_lone_triangle: false,
        };
        let mut lengths = vec![(0.0, 0.0); n];
        for t in near {
            let corners = mesh.triangles[t as usize].map(in_loop);
            if corners == [None; 3] {
                continue;
            }
            let points = mesh.corners(t);
            rim.is_lone_triangle |= n == 3 && corners.iter().all(Option::is_some);
            rim.triangles.push((points, corners));
            for i in 0..3 {
                let j = (i + 1) % 3;
                let length = points[i].distance(points[j]);
                for v in [corners[i], corners[j]].into_iter().flatten() {
                    lengths[v as usize].0 += length;
                    lengths[v as usize].1 += 1.0;
                }
                if let (Some(a), Some(b)) = (corners[i], corners[j]) {
                    // The mesh runs through the loop's edges backwards.
                    if a == (b + 1) % n as u32 {
                        rim.normals[b as usize] = (points[1] - points[0]).cross(points[2] - points[0]).try_normalize();
                    }
                    rim.taken.insert([a.min(b), a.max(b)]);
                }
            }
        }
        rim.scale = lengths.iter().map(|&(sum, count)| if count > 0.0 { sum / count } else { 0.0 }).collect();
        // Slivers around a vertex must not make the fill fine there.
        let mean = rim.scale.iter().sum::<f64>() / n as f64;
        rim.scale.iter_mut().for_each(|s| *s = s.max(0.5 * mean));
        rim
    }
}

/// Whether triangles cross themselves or an obstacle.
pub(super) fn crosses(own: &[[DVec3; 3]], obstacles: &[[DVec3; 3]]) -> bool {
    let whole = Bounds::of(own.iter().flatten().copied());
    let extent = whole.max - whole.min;
    let axis = (0..3).max_by(|&a, &b| extent[a].total_cmp(&extent[b])).unwrap_or(0);
    // Along the longest axis, whatever overlaps a triangle begins before it ends.
    let boxed = |t: &[DVec3; 3]| (Bounds::of(*t), *t);
    let mut others: Vec<_> = obstacles.iter().map(boxed).filter(|(bounds, _)| bounds.meets(&whole)).collect();
    let mut own: Vec<_> = own.iter().map(boxed).collect();
    let begin = |a: &(Bounds, [DVec3; 3])| a.0.min[axis];
    own.sort_by(|a, b| begin(a).total_cmp(&begin(b)));
    others.sort_by(|a, b| begin(a).total_cmp(&begin(b)));
    let meet = |a: &(Bounds, [DVec3; 3]), b: &(Bounds, [DVec3; 3])| a.0.meets(&b.0) && triangles::cross(a.1, b.1);
    for (k, a) in own.iter().enumerate() {
        let end = a.0.max[axis];
        if own[k + 1..].iter().take_while(|b| begin(b) <= end).any(|b| meet(a, b)) {
            return true;
        }
    }
    // Both lists in step: each pair is met at the one that begins later.
    let (mut i, mut j) = (0, 0);
    let (mut open_own, mut open_others): (Vec<usize>, Vec<usize>) = (Vec::new(), Vec::new());
    while i < own.len() && (j < others.len() || !open_others.is_empty()) {
        if j == others.len() || begin(&own[i]) <= begin(&others[j]) {
            open_others.retain(|&o| others[o].0.max[axis] >= begin(&own[i]));
            if open_others.iter().any(|&o| meet(&own[i], &others[o])) {
                return true;
            }
            open_own.push(i);
            i += 1;
        } else {
            open_own.retain(|&o| own[o].0.max[axis] >= begin(&others[j]));
            if open_own.iter().any(|&o| meet(&own[o], &others[j])) {
                return true;
            }
            open_others.push(j);
            j += 1;
        }
    }
    // The rest of the others may still meet the last of the patch.
    others[j..].iter().any(|b| {
        open_own.retain(|&o| own[o].0.max[axis] >= begin(b));
        open_own.iter().any(|&o| meet(&own[o], b))
    })
}
