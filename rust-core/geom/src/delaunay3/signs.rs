//! The two signs that decide everything: on which side of a plane, inside or outside of a sphere.
//!
//! Each is decided by the first of three stages that can. The first is a floating-point determinant of coordinates relative to the point
//! being inserted, with a bound on its error. The second is the same with a bound from the lengths involved. The third is exact arithmetic
//! (`geom::predicates`). If five points lie on one sphere, a symbolic perturbation decides. Each point is lifted a little off the
//! paraboloid, the more the later it comes in the order of x, then y, then z \[DT11\]. It looks at coordinates only, so the
//! tetrahedralization does not depend on how points are numbered.

use glam::DVec3;

use crate::predicates::{self, Arithmetic};

/// Relative error of a 3x3 determinant, in products of the lengths of its rows: 10 roundings, and a permanent of at most
/// 1.155 times that product \[CLL06\].
const PLANE_ERROR: f64 = 16.0 * f64::EPSILON / 2.0;
/// The same for the determinant of the sphere: 17 roundings, and the sum of four such products.
const SPHERE_ERROR: f64 = 32.0 * f64::EPSILON / 2.0;
/// More than all that underflow can add, for coordinates of which the largest is about 1.
const UNDERFLOW: f64 = 1e-300;

/// A vertex as seen from the point being inserted.
#[derive(Clone, Copy, Default)]
pub(super) struct Seen {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) z: f64,
    /// Squared distance.
    pub(super) w: f64,
}

impl Seen {
    #[inline(always)]
    pub(super) fn new(vertex: DVec3, from: DVec3) -> Self {
        let d = vertex - from;
        Seen { x: d.x, y: d.y, z: d.z, w: d.x * d.x + d.y * d.y + d.z * d.z }
    }

    /// As [`is_after`] compares the vertex with the point.
    #[inline(always)]
    fn is_after_origin(&self) -> bool {
        (self.x > 0.0) | ((self.x == 0.0) & ((self.y > 0.0) | ((self.y == 0.0) & (self.z > 0.0))))
    }
}

/// Six times the signed volumes of the cell with each vertex in turn replaced by the point: all positive if the point is
/// inside.
#[inline(always)]
pub(super) fn volumes([a, b, c, d]: [&Seen; 4]) -> [f64; 4] {
    let ab = a.x * b.y - a.y * b.x;
    let ac = a.x * c.y - a.y * c.x;
    let ad = a.x * d.y - a.y * d.x;
    let bc = b.x * c.y - b.y * c.x;
    let bd = b.x * d.y - b.y * d.x;
    let cd = c.x * d.y - c.y * d.x;
    [
        b.z * cd - c.z * bd + d.z * bc,
        c.z * ad - a.z * cd - d.z * ac,
        a.z * bd - b.z * ad + d.z * ab,
        b.z * ac - a.z * bc - c.z * ab,
    ]
}

/// Means to find signs for one set of points.
pub(super) struct Signs<'a> {
    pub(super) points: &'a [DVec3],
    arithmetic: Arithmetic,
    /// Factor of all error bounds: 0 where floating point makes no error, infinite where it can't be trusted.
    doubt: f64,
    /// Bound on the error of a volume, whatever the cell.
    plane_bound: f64,
}

impl<'a> Signs<'a> {
    /// For points of which no two are farther apart than `extent` along an axis.
    pub(super) fn new(points: &'a [DVec3], extent: f64, arithmetic: Arithmetic) -> Self {
        let doubt = match arithmetic {
            Arithmetic::Double => 0.0,
            Arithmetic::Big { normal: false } => f64::INFINITY,
            _ => 1.0,
        };
        let plane_bound = doubt * (PLANE_ERROR * (1.75 * extent).powi(3) + UNDERFLOW);
        Signs { points, arithmetic, doubt, plane_bound }
    }

    /// Bound on the error of the sphere's determinant for vertices within `distance_squared` of the point.
    pub(super) fn sphere_bound(&self, distance_squared: f64) -> f64 {
        self.doubt * (4.0 * SPHERE_ERROR * distance_squared * distance_squared * distance_squared.sqrt() + UNDERFLOW)
    }

    pub(super) fn plane_bound(&self) -> f64 {
        self.plane_bound
    }

    /// Sign of the volume of a, b, c, d: 1 if positively oriented.
    pub(super) fn orientation(&self, vertices: [u32; 4]) -> i8 {
        predicates::volume_sign(vertices.map(|v| self.points[v as usize]), self.arithmetic)
    }

    /// Sign of `volume`, which is that of the cell `vertices` with slot `slot` replaced by the point `p`.
    #[inline]
    pub(super) fn side(&self, volume: f64, seen: [&Seen; 4], vertices: [u32; 4], slot: usize, p: u32) -> i8 {
        let lengths: f64 = (0..4).filter(|&k| k != slot).map(|k| seen[k].w.sqrt()).product();
        let bound = self.doubt * (PLANE_ERROR * lengths + UNDERFLOW);
        if volume.abs() > bound {
            return sign(volume);
        }
        if self.doubt == 0.0 {
            return 0;
        }
        let mut replaced = vertices;
        replaced[slot] = p;
        self.orientation(replaced)
    }

    /// Whether `p` is inside the sphere around a positively oriented cell. `determinant` is the value that the first stage could not trust.
    #[cold]
    #[inline(never)]
    pub(super) fn is_inside(
        &self,
        determinant: f64,
        volumes: [f64; 4],
        seen: [&Seen; 4],
        vertices: [u32; 4],
        p: u32,
    ) -> bool {
        if self.doubt == 0.0 {
            if determinant != 0.0 {
                return determinant > 0.0;
            }
        } else {
            let lengths = seen.map(|s| s.w.sqrt());
            let bound = SPHERE_ERROR * lengths.iter().product::<f64>() * lengths.iter().sum::<f64>();
            if determinant.abs() > self.doubt * (bound + UNDERFLOW) {
                return determinant > 0.0;
            }
            let five = [vertices[0], vertices[1], vertices[2], vertices[3], p].map(|v| self.points[v as usize]);
            let exact = predicates::sphere_sign(five, self.arithmetic);
            if exact != 0 {
                return exact > 0;
            }
        }
        self.is_inside_perturbed(volumes, seen, vertices, p)
    }

    /// The same for five points on one sphere.
    fn is_inside_perturbed(&self, volumes: [f64; 4], seen: [&Seen; 4], vertices: [u32; 4], p: u32) -> bool {
        // Those lifted more than the point, which relative coordinates tell since the sign of a difference is exact; once
        // the point's own turn comes it is above the others.
        let is_left = |slot: usize| seen[slot].is_after_origin();
        let mut left = [is_left(0), is_left(1), is_left(2), is_left(3)];
        while left != [false; 4] {
            let mut greatest = 4;
            let mut at = DVec3::ZERO;
            for slot in 0..4 {
                if left[slot] {
                    let corner = self.points[vertices[slot] as usize];
                    if greatest == 4 || is_after(corner, at) {
                        (greatest, at) = (slot, corner);
                    }
                }
            }
            let side = self.side(volumes[greatest], seen, vertices, greatest, p);
            if side != 0 {
                return side > 0;
            }
            left[greatest] = false;
        }
        false
    }
}

/// Whether `a` comes after `b` in the order of x, then y, then z. Without branches, which could not be foretold.
#[inline(always)]
fn is_after(a: DVec3, b: DVec3) -> bool {
    (a.x > b.x) | ((a.x == b.x) & ((a.y > b.y) | ((a.y == b.y) & (a.z > b.z))))
}

fn sign(x: f64) -> i8 {
    i8::from(x > 0.0) - i8::from(x < 0.0)
}
