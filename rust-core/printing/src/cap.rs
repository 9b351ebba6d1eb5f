//! The flat faces that close a surface along a plane: a constrained Delaunay triangulation of what its edges there enclose.
//!
//! Edges of the surface in the plane bound the cap, however many loops they form and however these are nested. Vertices at one place are
//! taken as one, and where the surface then hangs together at a vertex or an edge only, it is parted there again. So loops that meet in
//! vertices or edges of the input leave a manifold.

use rustc_hash::FxHashMap;

use base::error::Result;
use base::progress::{Pace, Progress};
use geom::delaunay2::region;

use super::cut::Open;
use super::made::Made;
use super::section::Section;

const NONE: u32 = u32::MAX;

/// Closes a surface along the plane that it is open at. Says whether that was possible: it is not if the edges in the plane cross each other
/// or enclose nothing. The surface is not to be used then. Vertices keep their numbers, and some may be left without a face.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn cap(open: &mut Open, plane: Section, progress: &Progress<'_>) -> Result<bool> {
    let places = Places::of(open, plane, progress)?;
    let of = |v: u32| places.of[v as usize];
    // Vertices of one place make edges and faces that have no extent.
    let is_whole = |t: &[u32; 3]| {
        let [a, b, c] = t.map(of);
        let is_same = |a: u32, b: u32| a != NONE && a == b;
        !(is_same(a, b) || is_same(b, c) || is_same(c, a))
    };
    open.made.retain(|_, t| is_whole(t));
    let rims = open.rims.iter().map(|ends| ends.map(of)).filter(|ends| ends[0] != ends[1]);
    let rims: Vec<[u32; 2]> = rims.collect();
    let points: Vec<_> = places.vertices.iter().map(|&v| plane.seen(open.made.positions[v as usize])).collect();
    let Some(triangles) = region(&points, &rims, progress)? else { return Ok(false) };
    let first = open.made.triangles.len();
    for [a, b, c] in triangles {
        // They face away from the kept side.
        open.made.triangle([a, c, b].map(|place| places.vertices[place as usize]), None, true);
    }
    part(&mut open.made, &places, first, progress)
}

/// The different places in the plane.
struct Places {
    /// Of each vertex in the plane. [`NONE`] for all others.
    of: Vec<u32>,
    /// A vertex at each.
    vertices: Vec<u32>,
}

impl Places {
    fn of(open: &Open, plane: Section, progress: &Progress<'_>) -> Result<Self> {
        let mut all: Vec<([f64; 2], u32)> = Vec::with_capacity(open.in_plane.len());
        all.extend(open.in_plane.iter().map(|&v| (plane.seen(open.made.positions[v as usize]).to_array(), v)));
        // `seen` may turn 0 into -0.
        let order = |a: &[f64; 2], b: &[f64; 2]| {
            (a[0] + 0.0).total_cmp(&(b[0] + 0.0)).then((a[1] + 0.0).total_cmp(&(b[1] + 0.0)))
        };
        progress.sort(&mut all, &|a, b| order(&a.0, &b.0).then(a.1.cmp(&b.1)))?;
        let mut places = Places { of: vec![NONE; open.made.positions.len()], vertices: Vec::new() };
        for (i, (place, v)) in all.iter().enumerate() {
            if i == 0 || order(&all[i - 1].0, place).is_ne() {
                places.vertices.push(*v);
            }
            places.of[*v as usize] = places.vertices.len() as u32 - 1;
        }
        Ok(places)
    }
}

/// A directed edge of a face that ends in the plane.
struct Side {
    /// Its ends, the smaller first: places in the plane, and vertices beside it.
    key: [u64; 2],
    is_forward: bool,
    is_cap: bool,
    /// The corner of the face that it begins at, and the one it ends at.
    corners: [u32; 2],
    /// Its ends by their own numbers, the smaller first. Vertices at one place have several.
    vertices: [u32; 2],
}

/// Faces around an edge that hang together over it, by their sides.
type Pairs<'s> = [Option<(&'s Side, &'s Side)>; 2];

/// Says which corners are one vertex: those of faces that hang together over edges. Says whether each edge has two faces then.
fn part(made: &mut Made, places: &Places, first_cap: usize, progress: &Progress<'_>) -> Result<bool> {
    let mut pace = Pace::new(progress);
    let place = |v: u32| places.of[v as usize];
    let mut faces = Vec::new();
    for (t, corners) in made.triangles.iter().enumerate() {
        pace.after(2)?;
        if corners.iter().any(|&v| place(v) != NONE) {
            faces.push(t);
        }
    }
    let sides = sides(made, places, &faces, first_cap, progress)?;
    let mut groups = Vec::new();
    for group in sides.chunk_by(|a, b| a.key == b.key) {
        pace.after(8)?;
        match pairs(group) {
            Some(pairs) => groups.push(pairs),
            // Edges of several vertices at one place, which touch.
            None => {
                for group in group.chunk_by(|a, b| a.vertices == b.vertices) {
                    let Some(pairs) = pairs(group) else { return Ok(false) };
                    groups.push(pairs);
                }
            }
        }
    }
    let Some(mut joined) = joined(&mut groups, faces.len(), &mut pace)? else { return Ok(false) };
    // The first vertex that asks for a number keeps it.
    let mut vertex_of: FxHashMap<u32, u32> = FxHashMap::default();
    let mut is_taken = vec![false; made.positions.len()];
    for (slot, &t) in faces.iter().enumerate() {
        pace.after(4)?;
        for k in 0..3 {
            let v = made.triangles[t][k];
            if place(v) == NONE {
                continue;
            }
            let root = joined.root(3 * slot as u32 + k as u32);
            let known = vertex_of.get(&root).copied();
            let number = known.unwrap_or_else(|| match std::mem::replace(&mut is_taken[v as usize], true) {
                true => made.vertex(made.positions[v as usize], made.origins[v as usize]),
                false => v,
            });
            vertex_of.insert(root, number);
            made.triangles[t][k] = number;
        }
    }
    Ok(true)
}

/// The edges of some faces that end in the plane, those of one key together.
fn sides(
    made: &Made,
    places: &Places,
    faces: &[usize],
    first_cap: usize,
    progress: &Progress<'_>,
) -> Result<Vec<Side>> {
    let mut pace = Pace::new(progress);
    let place = |v: u32| places.of[v as usize];
    let key = |v: u32| if place(v) == NONE { u64::from(v) } else { 1 << 32 | u64::from(place(v)) };
    let mut sides = Vec::with_capacity(3 * faces.len());
    for (slot, &t) in faces.iter().enumerate() {
        pace.after(4)?;
        let corners = made.triangles[t];
        for k in 0..3 {
            let (from, to) = (corners[k], corners[(k + 1) % 3]);
            if place(from) != NONE || place(to) != NONE {
                let (a, b) = (key(from), key(to));
                let corners = [3 * slot as u32 + k as u32, 3 * slot as u32 + (k as u32 + 1) % 3];
                let vertices = [from.min(to), from.max(to)];
                sides.push(Side {
                    key: [a.min(b), a.max(b)],
                    is_forward: a < b,
                    is_cap: t >= first_cap,
                    corners,
                    vertices,
                });
            }
        }
    }
    let rank = |side: &Side| (side.key, side.vertices, side.is_cap, side.is_forward, side.corners);
    progress.sort(&mut sides, &|a, b| rank(a).cmp(&rank(b)))?;
    Ok(sides)
}

/// Each face of the surface goes with the cap beside it, or with the other one where there is no cap. `None` for more faces than two of
/// each, and for two of one direction.
fn pairs(group: &[Side]) -> Option<Pairs<'_>> {
    let [kept, kept_back, cap, cap_back] = of_group(group);
    let pairs = match [kept.is_some(), kept_back.is_some(), cap.is_some(), cap_back.is_some()] {
        [true, true, true, true] => [kept.zip(cap_back), kept_back.zip(cap)],
        [true, true, false, false] => [kept.zip(kept_back), None],
        [false, false, true, true] => [cap.zip(cap_back), None],
        [true, false, false, true] => [kept.zip(cap_back), None],
        [false, true, true, false] => [kept_back.zip(cap), None],
        _ => return None,
    };
    (2 * pairs.iter().flatten().count() == group.len()).then_some(pairs)
}

/// The sides of the surface forward and back, and those of the cap.
fn of_group(group: &[Side]) -> [Option<&Side>; 4] {
    [(false, true), (false, false), (true, true), (true, false)]
        .map(|(is_cap, is_forward)| group.iter().find(|side| side.is_cap == is_cap && side.is_forward == is_forward))
}

/// Joins the corners of faces that hang together. If the two pairs at an edge become one at both of its ends, it would be an edge of four
/// faces: there the surface goes with itself, and the cap with itself. `None` if that does not help.
fn joined(groups: &mut [Pairs<'_>], faces: usize, pace: &mut Pace<'_>) -> Result<Option<Joined>> {
    for _ in 0..2 {
        let mut joined = Joined((0..3 * faces as u32).collect());
        for (one, other) in groups.iter().flat_map(|pairs| pairs.iter().flatten()) {
            pace.after(4)?;
            joined.join(one.corners[0], other.corners[1]);
            joined.join(one.corners[1], other.corners[0]);
        }
        let mut is_manifold = true;
        for pairs in groups.iter_mut() {
            let [Some((a, b)), Some((c, d))] = *pairs else { continue };
            pace.after(4)?;
            let ends = |side: &Side| if side.is_forward { side.corners } else { [side.corners[1], side.corners[0]] };
            if (0..2).all(|end| joined.root(ends(a)[end]) == joined.root(ends(c)[end])) {
                is_manifold = false;
                *pairs = [Some((a, c)), Some((b, d))];
            }
        }
        if is_manifold {
            return Ok(Some(joined));
        }
    }
    Ok(None)
}

/// Corners that are one vertex. The root of each set is its smallest number.
struct Joined(Vec<u32>);

impl Joined {
    fn root(&mut self, mut corner: u32) -> u32 {
        while self.0[corner as usize] != corner {
            let above = self.0[corner as usize];
            self.0[corner as usize] = self.0[above as usize];
            corner = above;
        }
        corner
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}
