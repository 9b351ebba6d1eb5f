//! The part of a closed surface on one side of a plane, open along it.
//!
//! Vertices in the plane count as beyond it. So the kept part is that of a plane a hair further on, moved back: faces in the plane go, and
//! edges that end in it are cut at their ends.

use std::cmp::Ordering;

use glam::DVec3;
use rustc_hash::FxHashMap;

use base::error::Result;
use base::progress::{Pace, Progress};
use mesh::TriMesh;

use super::made::{Made, Origin};
use super::section::Section;
use super::single::Precision;

const NONE: u32 = u32::MAX;

/// A surface that is open along a plane.
pub struct Open {
    pub made: Made,
    /// Its edges in the plane, in the direction of their faces.
    pub rims: Vec<[u32; 2]>,
    /// Its vertices in the plane.
    pub in_plane: Vec<u32>,
}

/// Keeps one side of a closed, oriented manifold. Kept vertices keep their bits. Cut ones have exactly the plane's coordinate.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn cut(mesh: &TriMesh, plane: Section, progress: &Progress<'_>) -> Result<Open> {
    let mut pace = Pace::new(progress);
    let mut cutter = Cutter {
        mesh,
        plane,
        precision: Precision::of(mesh),
        open: Open { made: Made::default(), rims: Vec::new(), in_plane: Vec::new() },
        numbers: vec![NONE; mesh.positions.len()],
        cuts: FxHashMap::default(),
    };
    let is_kept: Vec<bool> = mesh.positions.iter().map(|&p| plane.side(p) == Ordering::Greater).collect();
    for (v, _) in is_kept.iter().enumerate().filter(|(_, kept)| **kept) {
        cutter.numbers[v] = cutter.open.made.vertex(mesh.positions[v], Origin::Kept(v as u32));
    }
    for (t, corners) in mesh.triangles.iter().enumerate() {
        pace.after(4)?;
        match corners.iter().filter(|&&v| is_kept[v as usize]).count() {
            0 => {}
            3 => {
                let corners = corners.map(|v| cutter.numbers[v as usize]);
                cutter.open.made.triangle(corners, Some(t as u32), false);
            }
            kept => cutter.triangle(t, kept == 2, &is_kept),
        }
    }
    Ok(cutter.open)
}

struct Cutter<'a> {
    mesh: &'a TriMesh,
    plane: Section,
    precision: Precision,
    open: Open,
    /// Of each vertex that was kept or lies in the plane.
    numbers: Vec<u32>,
    /// Vertices on edges, the smaller end first.
    cuts: FxHashMap<[u32; 2], u32>,
}

impl Cutter<'_> {
    /// Keeps a part of a triangle: beside two corners, or one.
    fn triangle(&mut self, t: usize, has_two: bool, is_kept: &[bool]) {
        let corners = self.mesh.triangles[t];
        // The corner that is alone on its side comes first.
        let alone = (0..3).find(|&k| is_kept[corners[k] as usize] != has_two).expect("one is alone");
        let [a, b, c] = [0, 1, 2].map(|k| corners[(alone + k) % 3]);
        let (ab, ca) = if has_two { (self.on(b, a), self.on(c, a)) } else { (self.on(a, b), self.on(a, c)) };
        let face = Some(t as u32);
        if !has_two {
            self.open.made.triangle([self.numbers[a as usize], ab, ca], face, true);
            self.open.rims.push([ab, ca]);
            return;
        }
        let [b, c] = [b, c].map(|v| self.numbers[v as usize]);
        if ab == ca {
            // The third corner lies in the plane.
            self.open.made.triangle([ab, b, c], face, false);
            return;
        }
        let at = |v: u32| self.open.made.positions[v as usize];
        // The shorter diagonal.
        let (one, other) = match at(b).distance_squared(at(ca)) <= at(c).distance_squared(at(ab)) {
            true => ([ab, b, ca], [b, c, ca]),
            false => ([ab, b, c], [ab, c, ca]),
        };
        self.open.made.triangle(one, face, true);
        self.open.made.triangle(other, face, true);
        self.open.rims.push([ca, ab]);
    }

    /// The vertex in the plane between one that is kept and one that is not.
    fn on(&mut self, kept: u32, other: u32) -> u32 {
        let [from, to] = [kept.min(other), kept.max(other)];
        let [a, b] = [from, to].map(|v| self.mesh.positions[v as usize]);
        let place = self.mesh.positions[other as usize];
        if self.plane.side(place) == Ordering::Equal {
            if self.numbers[other as usize] == NONE {
                let number = self.open.made.vertex(place, Origin::Kept(other));
                self.numbers[other as usize] = number;
                self.open.in_plane.push(number);
            }
            return self.numbers[other as usize];
        }
        if let Some(&known) = self.cuts.get(&[from, to]) {
            return known;
        }
        let (place, share) = between(a, b, self.plane, self.precision);
        let number = self.open.made.vertex(place, Origin::Between([from, to], share));
        self.cuts.insert([from, to], number);
        self.open.in_plane.push(number);
        number
    }
}

/// The place in the plane between two on either side of it, and its share of the way. It does not leave the box around them.
fn between(a: DVec3, b: DVec3, plane: Section, precision: Precision) -> (DVec3, f64) {
    let axis = plane.axis;
    let share = ((plane.at - a[axis]) / (b[axis] - a[axis])).clamp(0.0, 1.0);
    // From the nearer end, where rounding is least.
    let place = if share <= 0.5 {
        a + (b - a) * share
    } else {
        b + (a - b) * ((plane.at - b[axis]) / (a[axis] - b[axis])).clamp(0.0, 1.0)
    };
    let mut place = precision.place(place).clamp(a.min(b), a.max(b));
    place[axis] = plane.at;
    (place, share)
}
