//! The closest point of a triangle \[Ericson05, sec. 5.1.5\] and of the whole hierarchy.

use glam::DVec3;

use super::hierarchy::Bvh;
use super::node::{Node, STACK};

/// The part of a triangle on which a closest point lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feature {
    /// Corner 0, 1 or 2.
    Corner(u8),
    /// The edge opposite corner 0, 1 or 2.
    Edge(u8),
    /// Between the edges.
    Inside,
}

/// The point of a mesh closest to a query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// Its place.
    pub point: DVec3,
    /// Distance from the query, squared.
    pub distance_squared: f64,
    /// The triangle. Of several as near, the one of the smallest index.
    pub triangle: u32,
    /// Weights of its corners. Not negative, their sum is 1 up to rounding.
    pub barycentric: [f64; 3],
    /// Its place on the triangle.
    pub feature: Feature,
}

impl Closest {
    /// Distance from the query.
    pub fn distance(&self) -> f64 {
        self.distance_squared.sqrt()
    }

    /// The point of one triangle closest to `query`. `triangle` is the triangle's number.
    pub fn on_triangle(query: DVec3, corners: &[DVec3; 3], triangle: u32) -> Closest {
        Self::of(query, corners, triangle)
    }

    pub(super) fn beats(&self, other: &Option<Closest>) -> bool {
        match other {
            None => true,
            Some(o) => {
                self.distance_squared < o.distance_squared
                    || self.distance_squared == o.distance_squared && self.triangle < o.triangle
            }
        }
    }

    pub(super) fn of(query: DVec3, corners: &[DVec3; 3], triangle: u32) -> Closest {
        let (barycentric, feature) = weights(query, corners);
        // An offset from one corner keeps the precision of small triangles far from the origin.
        let (e1, e2) = (corners[1] - corners[0], corners[2] - corners[0]);
        let offset = match feature {
            Feature::Corner(0) => DVec3::ZERO,
            Feature::Corner(1) => e1,
            Feature::Corner(_) => e2,
            _ => e1 * barycentric[1] + e2 * barycentric[2],
        };
        let distance_squared = ((query - corners[0]) - offset).length_squared();
        Closest { point: corners[0] + offset, distance_squared, triangle, barycentric, feature }
    }
}

/// Squared sine of the angle below which a triangle is so thin that rounding blurs which of its parts is closest. Any point
/// found lies on the triangle, so a generous value costs time only.
const SLIVER: f64 = 1e-6;

/// Weights of the corners at the point closest to `p`. Projections onto the edges find the region of `p`, so a degenerate triangle is
/// treated as the segment or the point that it is.
fn weights(p: DVec3, &[a, b, c]: &[DVec3; 3]) -> ([f64; 3], Feature) {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return ([1.0, 0.0, 0.0], Feature::Corner(0));
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return ([0.0, 1.0, 0.0], Feature::Corner(1));
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return ([0.0, 0.0, 1.0], Feature::Corner(2));
    }
    let area_c = d1 * d4 - d3 * d2;
    let area_b = d5 * d2 - d1 * d6;
    let area_a = d3 * d6 - d5 * d4;
    let whole = area_a + area_b + area_c;
    let mut best = (f64::INFINITY, [1.0, 0.0, 0.0], Feature::Corner(0));
    if area_a > 0.0 && area_b > 0.0 && area_c > 0.0 && whole.is_normal() {
        let weights = [area_a / whole, area_b / whole, area_c / whole];
        if whole > SLIVER * ab.length_squared() * ac.length_squared() {
            return (weights, Feature::Inside);
        }
        best = ((ap - (ab * weights[1] + ac * weights[2])).length_squared(), weights, Feature::Inside);
    }
    // On an edge, or rounding leaves in question which part it is: the nearest decides.
    let edges = [(b, c, 0u8), (c, a, 1), (a, b, 2)];
    for (from, to, opposite) in edges {
        let along = to - from;
        let t = ((p - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        let t = if t.is_nan() { 0.0 } else { t };
        let distance = ((p - from) - along * t).length_squared();
        if distance < best.0 {
            let (i, j) = ((opposite as usize + 1) % 3, (opposite as usize + 2) % 3);
            let mut weights = [0.0; 3];
            (weights[i], weights[j]) = (1.0 - t, t);
            let feature = match t {
                0.0 => Feature::Corner(i as u8),
                1.0 => Feature::Corner(j as u8),
                _ => Feature::Edge(opposite),
            };
            best = (distance, weights, feature);
        }
    }
    (best.1, best.2)
}

impl Bvh<'_> {
    /// The point of the mesh closest to `query`. `None` for an empty mesh or a query that is not finite.
    pub fn closest_point(&self, query: DVec3) -> Option<Closest> {
        self.closest_point_from(query, None)
    }

    /// [`Bvh::closest_point`], to the bit, sooner where `known`, the closest point of any one of the triangles, is near.
    pub fn closest_point_from(&self, query: DVec3, known: Option<Closest>) -> Option<Closest> {
        let most = known.as_ref().map_or(f64::INFINITY, |known| known.distance_squared);
        self.closest(query, known, most)
    }

    /// [`Bvh::closest_point`] if it lies within a distance, else `None`. Costs little where nothing does.
    pub fn closest_point_within(&self, query: DVec3, distance: f64) -> Option<Closest> {
        self.closest(query, None, distance * distance)
    }

    /// The closest point of the mesh within the square root of `most`, else the best known.
    fn closest(&self, query: DVec3, mut best: Option<Closest>, most: f64) -> Option<Closest> {
        if self.nodes.is_empty() || !query.is_finite() {
            return None;
        }
        let point = self.frame.to_frame(query);
        let to_frame = self.frame.scale * self.frame.scale;
        // Boxes are grown by more than any rounding near the mesh; the factor is for queries far from it.
        let limit_of = |squared: f64| squared * to_frame * (1.0 + 1e-12);
        let mut limit = limit_of(most);
        let mut stack = [(0u32, 0.0f64); STACK];
        let mut used = 0;
        let mut next = Some((0u32, distance_squared(&self.nodes[0], point)));
        loop {
            let (index, distance) = match next.take() {
                Some(visit) => visit,
                None if used == 0 => return best,
                None => {
                    used -= 1;
                    stack[used]
                }
            };
            if distance > limit {
                continue;
            }
            let node = &self.nodes[index as usize];
            if node.count > 0 {
                for slot in node.slots(&self.slots) {
                    let found = Closest::of(query, &self.corners(slot), slot.triangle);
                    if found.distance_squared <= most && found.beats(&best) {
                        limit = limit_of(found.distance_squared);
                        best = Some(found);
                    }
                }
                continue;
            }
            let (left, right) = (index + 1, node.link);
            let to_left = distance_squared(&self.nodes[left as usize], point);
            let to_right = distance_squared(&self.nodes[right as usize], point);
            let (near, far) = if to_left <= to_right {
                ((left, to_left), (right, to_right))
            } else {
                ((right, to_right), (left, to_left))
            };
            stack[used] = far;
            used += 1;
            next = Some(near);
        }
    }
}

/// Squared distance from a point to a box, in the frame.
fn distance_squared(node: &Node, point: DVec3) -> f64 {
    let outside = (node.lo().as_dvec3() - point).max(point - node.hi().as_dvec3()).max(DVec3::ZERO);
    outside.length_squared()
}
