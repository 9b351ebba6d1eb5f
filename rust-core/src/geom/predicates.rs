//! Signs of determinants, exact for all coordinates that neither overflow nor underflow: the one place where topology is
//! decided.
//!
//! A sign is 1, 0 or -1. The arithmetic is that of the crate `robust` (adaptive precision behind a floating-point filter,
//! after Shewchuk 1997).

use glam::{DVec2, DVec3};
use robust::{Coord, Coord3D};

fn sign(x: f64) -> i8 {
    i8::from(x > 0.0) - i8::from(x < 0.0)
}

/// 1 if a, b, c turn counter-clockwise, -1 if clockwise, 0 if they lie on a line.
pub fn orient2d(a: DVec2, b: DVec2, c: DVec2) -> i8 {
    let [a, b, c] = [a, b, c].map(|p| Coord { x: p.x, y: p.y });
    sign(robust::orient2d(a, b, c))
}

/// 1 if d lies on the side of the plane of a, b, c from which these turn clockwise, -1 if on the other, 0 if in the plane.
pub fn orient3d(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> i8 {
    let [a, b, c, d] = [a, b, c, d].map(|p| Coord3D { x: p.x, y: p.y, z: p.z });
    sign(robust::orient3d(a, b, c, d))
}
