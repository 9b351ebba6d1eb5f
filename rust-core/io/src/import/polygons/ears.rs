//! Polygons that touch or cross themselves: ears are cut off until a triangle is left.
//!
//! Files reach holes over bridges: edges that are walked there and back, with corners that share a place. An ear is a corner that turns
//! left whose triangle holds no other corner. Corners at the places of its own are none of these, unless the polygon passes through
//! the tip of the ear into it. If there is no such ear, as in polygons that cross themselves, less is asked for, step by step.

use glam::DVec2;

use base::error::Result;
use base::progress::Progress;
use geom::predicates::orient2d;

/// Most corners that are compared with ears of one polygon. From there on any corner is cut off.
const MOST: usize = 1 << 26;

/// Sorts of ears, from the best on.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Ear {
    /// It holds no other corner, not even on its edges.
    Clear,
    /// It holds no other corner inside.
    Touched,
    /// Its corners lie on a line.
    Flat,
    /// It turns left.
    Any,
    Forced,
}

impl Ear {
    /// The next best.
    fn worse(self) -> Ear {
        match self {
            Ear::Clear => Ear::Touched,
            Ear::Touched => Ear::Flat,
            Ear::Flat => Ear::Any,
            Ear::Any | Ear::Forced => Ear::Forced,
        }
    }
}

/// Corners that are left, in a circle.
struct Ring<'a> {
    seen: &'a [DVec2],
    next: Vec<u32>,
    previous: Vec<u32>,
    /// Corners that were compared with ears.
    compared: usize,
}

impl Ring<'_> {
    fn at(&self, corner: u32) -> DVec2 {
        self.seen[corner as usize]
    }

    fn around(&self, tip: u32) -> [u32; 3] {
        [self.previous[tip as usize], tip, self.next[tip as usize]]
    }

    fn is_ear(&mut self, corners: [u32; 3], wanted: Ear) -> bool {
        let [a, b, c] = corners.map(|corner| self.at(corner));
        if a == c {
            // A way there and back holds nothing.
            return true;
        }
        match (orient2d(a, b, c), wanted) {
            (_, Ear::Forced) | (1, Ear::Any) | (0, Ear::Flat) => true,
            (1, Ear::Clear | Ear::Touched) => self.is_clear(corners, wanted == Ear::Clear),
            _ => false,
        }
    }

    fn is_clear(&mut self, corners: [u32; 3], also_edges: bool) -> bool {
        let [a, b, c] = corners.map(|corner| self.at(corner));
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let mut other = self.next[corners[2] as usize];
        while other != corners[0] {
            self.compared += 1;
            let p = self.at(other);
            let is_near = p.cmpge(low).all() && p.cmple(high).all();
            if is_near && p == b {
                let [before, _, after] = self.around(other).map(|corner| self.at(corner));
                if [before, after].iter().any(|&q| orient2d(a, b, q) > 0 && orient2d(b, c, q) > 0) {
                    return false;
                }
            } else if is_near && p != a && p != c {
                let least = [orient2d(a, b, p), orient2d(b, c, p), orient2d(c, a, p)].into_iter().min();
                if least > Some(if also_edges { -1 } else { 0 }) {
                    return false;
                }
            }
            other = self.next[other as usize];
        }
        true
    }

    fn cut(&mut self, [a, _, c]: [u32; 3]) {
        self.next[a as usize] = c;
        self.previous[c as usize] = a;
    }
}

/// The triangles of a polygon of three corners or more that goes round counter-clockwise, two fewer than corners.
pub(super) fn cut_off(seen: &[DVec2], progress: &Progress<'_>) -> Result<Vec<[u32; 3]>> {
    let count = seen.len() as u32;
    let next = (1..count).chain([0]).collect();
    let previous = [count - 1].into_iter().chain(0..count - 1).collect();
    let mut ring = Ring { seen, next, previous, compared: 0 };
    let mut triangles = Vec::with_capacity(seen.len() - 2);
    let (mut tip, mut left) = (0, count);
    let (mut wanted, mut tried) = (Ear::Clear, 0);
    while left > 3 {
        progress.check()?;
        let corners = ring.around(tip);
        if ring.is_ear(corners, wanted) {
            triangles.push(corners);
            ring.cut(corners);
            left -= 1;
            tried = 0;
            wanted = Ear::Clear;
        } else {
            tried += 1;
        }
        tip = corners[2];
        if ring.compared > MOST {
            wanted = Ear::Forced;
        } else if tried == left {
            (wanted, tried) = (wanted.worse(), 0);
        }
    }
    triangles.push(ring.around(tip));
    Ok(triangles)
}
