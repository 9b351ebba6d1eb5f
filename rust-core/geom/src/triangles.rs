//! Do two triangles cross?

use glam::{DVec2, DVec3};

use super::predicates::{orient2d, orient3d};

/// Whether two closed triangles have a point in common beyond the corners and the edge they share. Corners are shared if they are at the
/// same place. So triangles that only touch cross, unless they touch in shared corners. Two triangles over a shared edge cross if they lie
/// on top of each other. A triangle whose corners lie on a line crosses nothing. Exact. See [`super::predicates`].
pub fn cross(s: [DVec3; 3], t: [DVec3; 3]) -> bool {
    // Turns shared corners to the front, in the same order in both.
    let (mut s, mut t, mut shared) = (s, t, 0);
    for i in 0..3 {
        if let Some(j) = (shared..3).find(|&j| t[j] == s[i]) {
            s.swap(shared, i);
            t.swap(shared, j);
            shared += 1;
        }
    }
    match shared {
        0 => apart(s, t),
        1 => share_corner(s, t),
        2 => share_edge(s, t),
        _ => !is_degenerate(s),
    }
}

fn is_degenerate(t: [DVec3; 3]) -> bool {
    Flat::of(t).is_none()
}

fn sides_of(plane: [DVec3; 3], points: [DVec3; 3]) -> [i8; 3] {
    points.map(|p| orient3d(plane[0], plane[1], plane[2], p))
}

fn apart(s: [DVec3; 3], t: [DVec3; 3]) -> bool {
    let same = |d: [i8; 3]| d[0] != 0 && d[0] == d[1] && d[0] == d[2];
    let t_beside_s = sides_of(s, t);
    if same(t_beside_s) {
        return false;
    }
    let s_beside_t = sides_of(t, s);
    if same(s_beside_t) {
        return false;
    }
    if t_beside_s == [0; 3] || s_beside_t == [0; 3] {
        let (Some(flat), false) = (Flat::of(t), is_degenerate(s)) else { return false };
        let (s, t) = (flat.project(s), flat.project(t));
        return (0..3).any(|i| segment_meets(s[i], s[(i + 1) % 3], t)) || contains(s, t[0]);
    }
    // If the planes differ, an edge of one goes through the other. One that lies in the other's plane needs no test: its neighbours, or the
    // other's edges, meet the same points.
    (0..3).any(|i| pierces(s, i, s_beside_t, t)) || (0..3).any(|i| pierces(t, i, t_beside_s, s))
}

/// Whether edge `i` of `s` goes through the plane of `t` within `t`. `sides` are those of the corners of `s`.
fn pierces(s: [DVec3; 3], i: usize, sides: [i8; 3], t: [DVec3; 3]) -> bool {
    let j = (i + 1) % 3;
    if sides[i] * sides[j] > 0 || (sides[i] == 0 && sides[j] == 0) {
        return false;
    }
    let turns = [(0, 1), (1, 2), (2, 0)].map(|(a, b)| orient3d(s[i], s[j], t[a], t[b]));
    turns.iter().all(|&o| o >= 0) || turns.iter().all(|&o| o <= 0)
}

/// The triangles have their first corner in common. If they have more in common it lies on a ray from there, which leaves
/// one of them through the opposite edge before it leaves the other.
fn share_corner(s: [DVec3; 3], t: [DVec3; 3]) -> bool {
    let beside = |plane: [DVec3; 3], p| orient3d(plane[0], plane[1], plane[2], p);
    let s_sides = [0, beside(t, s[1]), beside(t, s[2])];
    if s_sides[1] * s_sides[2] > 0 {
        // The edge opposite to the common corner stays on one side of t, so all of s does.
        return false;
    }
    let t_sides = [0, beside(s, t[1]), beside(s, t[2])];
    if s_sides == [0; 3] || t_sides == [0; 3] {
        let (Some(flat), false) = (Flat::of(t), is_degenerate(s)) else { return false };
        let (s, t) = (flat.project(s), flat.project(t));
        return segment_meets(s[1], s[2], t) || segment_meets(t[1], t[2], s);
    }
    pierces(s, 1, s_sides, t) || pierces(t, 1, t_sides, s)
}

/// The triangles have their first two corners in common.
fn share_edge(s: [DVec3; 3], t: [DVec3; 3]) -> bool {
    if orient3d(s[0], s[1], s[2], t[2]) != 0 {
        return false;
    }
    let (Some(flat), false) = (Flat::of(t), is_degenerate(s)) else { return false };
    let (s, t) = (flat.project(s), flat.project(t));
    orient2d(s[0], s[1], s[2]) == orient2d(t[0], t[1], t[2])
}

/// A coordinate plane onto which a triangle projects without losing its area.
struct Flat(usize);

impl Flat {
    /// The plane that shows most of the triangle. `None` if its corners lie on a line.
    fn of(t: [DVec3; 3]) -> Option<Flat> {
        let normal = (t[1] - t[0]).cross(t[2] - t[0]).abs();
        let mut axes = [0, 1, 2];
        axes.sort_by(|&a, &b| normal[b].total_cmp(&normal[a]));
        axes.into_iter().map(Flat).find(|flat| {
            let [a, b, c] = flat.project(t);
            orient2d(a, b, c) != 0
        })
    }

    fn project(&self, t: [DVec3; 3]) -> [DVec2; 3] {
        t.map(|p| match self.0 {
            0 => DVec2::new(p.y, p.z),
            1 => DVec2::new(p.z, p.x),
            _ => DVec2::new(p.x, p.y),
        })
    }
}

fn contains([a, b, c]: [DVec2; 3], p: DVec2) -> bool {
    let turns = [orient2d(a, b, p), orient2d(b, c, p), orient2d(c, a, p)];
    turns.iter().all(|&o| o >= 0) || turns.iter().all(|&o| o <= 0)
}

fn segment_meets(p: DVec2, q: DVec2, t: [DVec2; 3]) -> bool {
    contains(t, p) || contains(t, q) || (0..3).any(|i| segments_meet(p, q, t[i], t[(i + 1) % 3]))
}

fn segments_meet(a: DVec2, b: DVec2, c: DVec2, d: DVec2) -> bool {
    let (oc, od) = (orient2d(a, b, c), orient2d(a, b, d));
    let (oa, ob) = (orient2d(c, d, a), orient2d(c, d, b));
    if [oa, ob, oc, od] == [0; 4] {
        // On one line: their extents overlap along both axes.
        return a.min(b).cmple(c.max(d)).all() && c.min(d).cmple(a.max(b)).all();
    }
    oc * od <= 0 && oa * ob <= 0
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn v(x: f64, y: f64, z: f64) -> DVec3 {
        DVec3::new(x, y, z)
    }

    /// Both orders of the arguments and all orders of the corners must agree.
    fn cross_in_all_orders(s: [DVec3; 3], t: [DVec3; 3]) -> bool {
        let expected = cross(s, t);
        for [i, j, k] in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]] {
            let turned = [s[i], s[j], s[k]];
            assert_eq!(cross(turned, t), expected);
            assert_eq!(cross(t, turned), expected);
        }
        expected
    }

    const FLOOR: [DVec3; 3] = [DVec3::ZERO, DVec3::new(4.0, 0.0, 0.0), DVec3::new(0.0, 4.0, 0.0)];

    #[test]
    fn without_shared_corners() {
        let through = [v(1.0, 1.0, -1.0), v(1.0, 1.0, 1.0), v(9.0, 9.0, 0.5)];
        assert!(cross_in_all_orders(FLOOR, through));
        assert!(!cross_in_all_orders(FLOOR, through.map(|p| p + DVec3::Z * 1.5)));
        assert!(!cross_in_all_orders(FLOOR, through.map(|p| p + DVec3::X * 3.0)));
        let touching = [v(1.0, 1.0, 0.0), v(1.0, 1.0, 1.0), v(2.0, 1.0, 1.0)];
        assert!(cross_in_all_orders(FLOOR, touching), "a corner on the face");
        assert!(!cross_in_all_orders(FLOOR, touching.map(|p| p + DVec3::Z * f64::MIN_POSITIVE.sqrt())));
        let edge_on_face = [v(1.0, 1.0, 0.0), v(2.0, 1.0, 0.0), v(1.0, 1.0, 3.0)];
        assert!(cross_in_all_orders(FLOOR, edge_on_face));
        let edge_over_face = [v(-9.0, 1.0, 0.0), v(9.0, 1.0, 0.0), v(1.0, 1.0, 3.0)];
        assert!(cross_in_all_orders(FLOOR, edge_over_face), "an edge in the plane, its ends outside");
        let along_edge = [v(-1.0, 0.0, 0.0), v(5.0, 0.0, 0.0), v(1.0, 0.0, 3.0)];
        assert!(cross_in_all_orders(FLOOR, along_edge), "an edge along an edge");
    }

    #[test]
    fn in_one_plane() {
        let moved = |x: f64, y: f64| FLOOR.map(|p| p + v(x, y, 0.0));
        assert!(cross_in_all_orders(FLOOR, moved(1.0, 1.0)));
        assert!(!cross_in_all_orders(FLOOR, moved(3.0, 3.0)));
        assert!(cross_in_all_orders(FLOOR, moved(2.0, 2.0)), "a corner on an edge");
        assert!(cross_in_all_orders(FLOOR, FLOOR.map(|p| p * 0.1 + v(1.0, 1.0, 0.0))), "one within the other");
        let tilted = |t: [DVec3; 3]| t.map(|p| v(p.x, p.y, p.x + 2.0 * p.y));
        assert!(cross_in_all_orders(tilted(FLOOR), tilted(moved(1.0, 1.0))));
        assert!(!cross_in_all_orders(tilted(FLOOR), tilted(moved(3.0, 3.0))));
    }

    #[test]
    fn with_a_shared_corner() {
        let with = |b, c| [DVec3::ZERO, b, c];
        assert!(!cross_in_all_orders(FLOOR, with(v(-1.0, 0.0, 1.0), v(0.0, -1.0, 1.0))));
        assert!(cross_in_all_orders(FLOOR, with(v(1.0, 1.0, -1.0), v(1.0, 1.0, 1.0))), "goes through the face");
        assert!(cross_in_all_orders(FLOOR, with(v(9.0, 9.0, -1.0), v(9.0, 9.0, 1.0))), "reaches beyond the face");
        assert!(!cross_in_all_orders(FLOOR, with(v(-1.0, -1.0, -1.0), v(-1.0, -1.0, 1.0))));
        assert!(!cross_in_all_orders(FLOOR, with(v(-1.0, 0.0, 0.0), v(0.0, -1.0, 0.0))), "beside it in the plane");
        assert!(cross_in_all_orders(FLOOR, with(v(1.0, 0.5, 0.0), v(-1.0, 9.0, 0.0))), "over it in the plane");
        assert!(cross_in_all_orders(FLOOR, with(v(2.0, 0.0, 0.0), v(0.0, -1.0, 0.0))), "along an edge");
    }

    #[test]
    fn with_a_shared_edge() {
        let with = |apex| [v(4.0, 0.0, 0.0), DVec3::ZERO, apex];
        assert!(!cross_in_all_orders(FLOOR, with(v(1.0, -1.0, 0.0))));
        assert!(!cross_in_all_orders(FLOOR, with(v(1.0, 1.0, 1e-300))));
        assert!(cross_in_all_orders(FLOOR, with(v(1.0, 1.0, 0.0))));
        assert!(cross_in_all_orders(FLOOR, FLOOR));
    }

    #[test]
    fn degenerate_triangles_cross_nothing() {
        let line = [v(1.0, 1.0, -1.0), v(1.0, 1.0, 0.0), v(1.0, 1.0, 1.0)];
        let point = [v(1.0, 1.0, 0.0); 3];
        let in_plane = [v(-1.0, 1.0, 0.0), v(1.0, 1.0, 0.0), v(9.0, 1.0, 0.0)];
        let at_corner = [DVec3::ZERO, v(1.0, 1.0, 0.0), v(2.0, 2.0, 0.0)];
        for t in [line, point, in_plane, at_corner] {
            assert!(!cross_in_all_orders(FLOOR, t) && !cross_in_all_orders(t, t));
        }
    }

    /// In small whole numbers everything can be found by sampling: points of both triangles in exact barycentric steps.
    fn small() -> impl Strategy<Value = [DVec3; 3]> {
        let p = || (0..4_i32, 0..4_i32, 0..3_i32).prop_map(|(x, y, z)| v(x.into(), y.into(), z.into()));
        [p(), p(), p()]
    }

    proptest! {
        #[test]
        fn agrees_with_segments_against_triangles_in_whole_numbers(s in small(), t in small()) {
            let shared: Vec<DVec3> = s.into_iter().filter(|p| t.contains(p)).collect();
            if is_degenerate(s) || is_degenerate(t) {
                prop_assert!(!cross_in_all_orders(s, t));
            } else {
                // The common points form a convex set, whose corners are crossings of an edge with the other triangle
                // (in or through its plane). It is more than what is shared if one of them lies elsewhere, or if there
                // are three shared corners.
                let mut common: Vec<DVec3> = Vec::new();
                for (a, b) in [(s, t), (t, s)] {
                    for i in 0..3 {
                        common.extend(ends_of_common_part(a[i], a[(i + 1) % 3], b));
                    }
                }
                let on_shared = |p: &DVec3| match shared[..] {
                    [a] => p.distance(a) < 1e-9,
                    [a, b] => (*p - a).cross(b - a).length() < 1e-9 * (b - a).length() + 1e-12,
                    _ => false,
                };
                let expected = shared.len() == 3 || common.iter().any(|p| !on_shared(p));
                prop_assert_eq!(cross_in_all_orders(s, t), expected, "{:?}", common);
            }
        }
    }

    /// First and last point of a segment in a triangle, by clipping. Whole numbers up to 3 leave no doubt about signs.
    fn ends_of_common_part(p: DVec3, q: DVec3, t: [DVec3; 3]) -> Vec<DVec3> {
        let normal = (t[1] - t[0]).cross(t[2] - t[0]);
        let (dp, dq) = ((p - t[0]).dot(normal), (q - t[0]).dot(normal));
        let (mut from, mut to) = (0.0_f64, 1.0_f64);
        if dp == 0.0 && dq == 0.0 {
            // In the plane: the part within all three edges.
        } else if dp * dq > 0.0 {
            return vec![];
        } else {
            from = dp / (dp - dq);
            to = from;
        }
        for i in 0..3 {
            let inward = normal.cross(t[(i + 1) % 3] - t[i]);
            let (a, b) = ((p - t[i]).dot(inward), (q - t[i]).dot(inward));
            // a + u (b - a) >= 0
            if a == b {
                if a < 0.0 {
                    return vec![];
                }
            } else if b > a {
                from = from.max(a / (a - b));
            } else {
                to = to.min(a / (a - b));
            }
        }
        if from > to + 1e-9 { vec![] } else { vec![p + (q - p) * from, p + (q - p) * to] }
    }
}
