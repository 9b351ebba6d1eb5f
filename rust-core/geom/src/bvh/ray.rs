//! One ray: watertight triangle test in f64. \[WBW13\]
//!
//! The ray is sheared so that it runs along an axis through the origin. A triangle is hit if the origin lies in its projection. Both
//! triangles at an edge see the same two projected points, and the sign of the difference of two rounded products is the exact sign or
//! zero. Zero counts as inside, hence no ray passes between them.
//!
//! Ours: the origin is first moved along the ray to the point nearest the mesh's centre. So a far sensor costs no precision beyond that of
//! its own ray. Differences that nearly vanish are taken exactly.

use glam::DVec3;
use robust::{Coord, orient2d};

use super::hierarchy::Bvh;
use super::node::{Frame, GROWTH, Node, STACK};

/// A ray, from its origin along its direction, which may have any length but zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// The point that distances count from.
    pub origin: DVec3,
    /// Distances are multiples of it.
    pub direction: DVec3,
}

/// A ray meets a triangle at `origin + t * direction`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance in multiples of the ray's direction.
    pub t: f64,
    /// The triangle.
    pub triangle: u32,
    /// Weights of its corners. They are not negative, and their sum is 1 up to rounding.
    pub barycentric: [f64; 3],
    /// Whether the triangle is seen from behind (its corners turn clockwise).
    pub from_behind: bool,
}

impl Hit {
    /// Nearer, or as near and of a smaller index.
    fn beats(&self, other: &Option<Hit>) -> bool {
        match other {
            None => true,
            Some(o) => self.t < o.t || self.t == o.t && self.triangle < o.triangle,
        }
    }

    pub(super) fn keep_best(self, best: &mut Option<Hit>) -> bool {
        let better = self.beats(best);
        if better {
            *best = Some(self);
        }
        better
    }
}

/// A ray prepared for the triangle test.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sheared {
    /// The ray's point nearest the mesh's centre.
    pub origin: DVec3,
    /// The axes: `axes[2]` is the one the ray runs along.
    axes: [usize; 3],
    shear: [f64; 2],
    inverse: f64,
    /// `t` of `origin`.
    shift: f64,
    pub t_min: f64,
    pub t_max: f64,
}

impl Sheared {
    /// `None` if the ray is not usable or passes the mesh by.
    pub fn new(ray: &Ray, t_min: f64, t_max: f64, frame: &Frame) -> Option<Self> {
        let length_squared = ray.direction.length_squared();
        if !(length_squared > 0.0 && length_squared.is_finite() && ray.origin.is_finite() && t_min <= t_max) {
            return None;
        }
        let shift = (frame.centre - ray.origin).dot(ray.direction) / length_squared;
        let origin = ray.origin + ray.direction * shift;
        // The mesh lies in the ball of radius sqrt(3) in its frame.
        let inside = frame.to_frame(origin).length_squared() <= 3.1;
        if !inside {
            return None;
        }
        let d = ray.direction;
        let size = d.abs();
        let z = if size.x >= size.y && size.x >= size.z {
            0
        } else if size.y >= size.z {
            1
        } else {
            2
        };
        let (mut x, mut y) = ((z + 1) % 3, (z + 2) % 3);
        if d[z] < 0.0 {
            // Keeps the sense of rotation.
            (x, y) = (y, x);
        }
        Some(Sheared {
            origin,
            axes: [x, y, z],
            shear: [d[x] / d[z], d[y] / d[z]],
            inverse: 1.0 / d[z],
            shift,
            t_min,
            t_max,
        })
    }

    /// The triangle test.
    pub fn meet(&self, corners: &[DVec3; 3], triangle: u32) -> Option<Hit> {
        let [x, y, z] = self.axes;
        let [a, b, c] = corners.map(|p| {
            let p = (p - self.origin).to_array();
            [p[x] - self.shear[0] * p[z], p[y] - self.shear[1] * p[z], p[z]]
        });
        let (u, v, w) = (cross(&c, &b), cross(&a, &c), cross(&b, &a));
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let whole = u + v + w;
        if whole == 0.0 || !whole.is_finite() {
            return None;
        }
        let weights = [u / whole, v / whole, w / whole];
        let depth = weights[0] * a[2] + weights[1] * b[2] + weights[2] * c[2];
        let t = self.shift + depth * self.inverse;
        (t >= self.t_min && t <= self.t_max).then_some(Hit {
            t,
            triangle,
            barycentric: weights,
            from_behind: whole < 0.0,
        })
    }

    /// `t` as a distance from `origin` in the boxes' frame, of a direction of length `length` there.
    pub fn along(&self, t: f64, length: f64) -> f64 {
        (t - self.shift) * length
    }
}

/// `p[0] * q[1] - p[1] * q[0]`, its sign exact, its value good to 2^-30. Swapping `p` and `q` negates it exactly.
///
/// Triangles seen edge on need the value as well as the sign: their weights are ratios of differences that nearly vanish.
#[inline]
fn cross(p: &[f64; 3], q: &[f64; 3]) -> f64 {
    let (a, b) = (p[0] * q[1], p[1] * q[0]);
    let difference = a - b;
    if difference.abs() >= (a.abs() + b.abs()) * CANCELLED { difference } else { cross_precisely(p, q, a, b) }
}

/// Share of the products that must be left for their plain difference to be good enough.
const CANCELLED: f64 = 1.0 / (1 << 22) as f64;

#[cold]
fn cross_precisely(p: &[f64; 3], q: &[f64; 3], a: f64, b: f64) -> f64 {
    // The parts of the products that rounding took.
    let (lost_a, lost_b) = (p[0].mul_add(q[1], -a), p[1].mul_add(q[0], -b));
    let difference = (a - b) + (lost_a - lost_b);
    if difference != 0.0 {
        return difference;
    }
    let coord = |p: &[f64; 3]| Coord { x: p[0], y: p[1] };
    orient2d(coord(p), coord(q), Coord { x: 0.0, y: 0.0 })
}

/// Smallest direction component in the frame that is told from zero. Moving a point by it times the longest way through the mesh stays far
/// below [`GROWTH`], and its inverse keeps all products finite.
pub(super) const FLAT: f64 = 1.0 / (1u64 << 40) as f64;

impl Bvh<'_> {
    /// The nearest triangle that the ray meets with `t_min <= t <= t_max`. Both may be infinite.
    ///
    /// A ray whose direction is zero or not finite meets nothing.
    pub fn first_hit(&self, ray: &Ray, t_min: f64, t_max: f64) -> Option<Hit> {
        let sheared = Sheared::new(ray, t_min, t_max, &self.frame)?;
        if self.nodes.is_empty() {
            return None;
        }
        let length = ray.direction.length();
        let direction = ray.direction / length;
        let length = length * self.frame.scale;
        let origin = self.frame.to_frame(sheared.origin);
        let inverse = direction.map(|d| if d.abs() < FLAT { FLAT.copysign(d) } else { d }).recip();
        let from = sheared.along(t_min, length) - GROWTH;
        let mut to = sheared.along(t_max, length) + GROWTH;
        let mut best: Option<Hit> = None;
        let mut stack = [(0u32, 0.0f64); STACK];
        let mut used = 0;
        let mut next = enter(&self.nodes[0], origin, inverse, from, to).map(|near| (0u32, near));
        loop {
            let (index, near) = match next.take() {
                Some(visit) => visit,
                None if used == 0 => return best,
                None => {
                    used -= 1;
                    stack[used]
                }
            };
            if near > to {
                continue;
            }
            let node = &self.nodes[index as usize];
            if node.count > 0 {
                for slot in node.slots(&self.slots) {
                    if let Some(hit) = sheared.meet(&self.corners(slot), slot.triangle)
                        && hit.keep_best(&mut best)
                    {
                        to = sheared.along(hit.t, length) + GROWTH;
                    }
                }
                continue;
            }
            let (left, right) = (index + 1, node.link);
            let near_left = enter(&self.nodes[left as usize], origin, inverse, from, to);
            let near_right = enter(&self.nodes[right as usize], origin, inverse, from, to);
            next = match (near_left, near_right) {
                (Some(l), Some(r)) => {
                    let (first, second) = if l <= r { ((left, l), (right, r)) } else { ((right, r), (left, l)) };
                    stack[used] = second;
                    used += 1;
                    Some(first)
                }
                (Some(l), None) => Some((left, l)),
                (None, Some(r)) => Some((right, r)),
                (None, None) => None,
            };
        }
    }
}

/// The place where the ray enters the node's box, if it does between `from` and `to`.
fn enter(node: &Node, origin: DVec3, inverse: DVec3, from: f64, to: f64) -> Option<f64> {
    let a = (node.lo().as_dvec3() - origin) * inverse;
    let b = (node.hi().as_dvec3() - origin) * inverse;
    let near = a.min(b).max_element().max(from);
    let far = a.max(b).min_element().min(to);
    (near <= far).then_some(near)
}
