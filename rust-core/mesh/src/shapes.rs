//! Meshes whose distances are known exactly: truth for tests and measurements.
//!
//! All are centred at the origin and closed, but for the plane.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use crate::TriMesh;

/// A shape that is its formula. Lengths are in world units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// Ball of this radius.
    Sphere {
        /// Radius.
        radius: f64,
    },
    /// Ring about the z axis.
    Torus {
        /// Radius of the ring's centre line.
        major: f64,
        /// Radius of the tube, below `major`.
        minor: f64,
    },
    /// Box with edges along the axes.
    Cuboid {
        /// Half of its size.
        half: DVec3,
    },
    /// Rectangle in the plane z = 0 that faces +z.
    Plane {
        /// Half of its size.
        half: DVec2,
    },
    /// Cylinder about the z axis, with its two discs.
    Cylinder {
        /// Radius.
        radius: f64,
        /// Half of its height.
        half_height: f64,
    },
}

impl Shape {
    /// Exact distance of a point from the surface. Negative inside (never for the plane).
    pub fn distance(&self, p: DVec3) -> f64 {
        match *self {
            Shape::Sphere { radius } => p.length() - radius,
            Shape::Torus { major, minor } => DVec2::new(p.truncate().length() - major, p.z).length() - minor,
            Shape::Cuboid { half } => {
                let q = p.abs() - half;
                q.max(DVec3::ZERO).length() + q.max_element().min(0.0)
            }
            Shape::Plane { half } => (p.truncate().abs() - half).max(DVec2::ZERO).extend(p.z).length(),
            Shape::Cylinder { radius, half_height } => {
                let q = DVec2::new(p.truncate().length() - radius, p.z.abs() - half_height);
                q.max(DVec2::ZERO).length() + q.max_element().min(0.0)
            }
        }
    }

    /// The shape as triangles whose vertices lie on it exactly. Their number grows with the square of `detail`, the number of pieces of a
    /// quarter turn or of an edge, at least 1. Flat parts are exact, curved ones are inscribed.
    pub fn mesh(&self, detail: usize) -> TriMesh {
        let n = detail.max(1);
        match *self {
            Shape::Sphere { radius } => patches(n, &cube_sides(DVec3::ONE), &|p| even(p).normalize() * radius),
            Shape::Torus { major, minor } => torus(4 * n, 2 * n, major, minor),
            Shape::Cuboid { half } => patches(n, &cube_sides(half), &|p| p),
            Shape::Plane { half } => patches(n, &[[DVec3::ZERO, half.x * DVec3::X, half.y * DVec3::Y]], &|p| p),
            Shape::Cylinder { radius, half_height } => cylinder(n, radius, half_height),
        }
    }
}

/// Centre and two half edges of the sides of a box, turning counter-clockwise seen from outside.
fn cube_sides(half: DVec3) -> [[DVec3; 3]; 6] {
    let (x, y, z) = (half.x * DVec3::X, half.y * DVec3::Y, half.z * DVec3::Z);
    [[x, y, z], [-x, z, y], [y, z, x], [-y, x, z], [z, x, y], [-z, y, x]]
}

/// From the cube to a cube whose grid lines are evenly spaced seen from its centre.
fn even(p: DVec3) -> DVec3 {
    p.map(|x| (x * PI / 4.0).tan())
}

/// Square patches of 2n x 2n quads each, sewn together where their vertices are equal, bent by `place`.
fn patches(n: usize, sides: &[[DVec3; 3]], place: &dyn Fn(DVec3) -> DVec3) -> TriMesh {
    let mut mesh = TriMesh::default();
    let mut known = std::collections::HashMap::new();
    let n = 2 * n as i64;
    for [centre, u, v] in sides {
        let mut vertex = |i: i64, j: i64| {
            let (s, t) = ((2 * i - n) as f64 / n as f64, (2 * j - n) as f64 / n as f64);
            let p = *centre + *u * s + *v * t;
            let key = (p + 0.0).to_array().map(f64::to_bits);
            *known.entry(key).or_insert_with(|| {
                mesh.positions.push(place(p));
                mesh.positions.len() as u32 - 1
            })
        };
        for i in 0..n {
            for j in 0..n {
                let [a, b, c, d] = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
                mesh.triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    mesh
}

fn torus(around: usize, across: usize, major: f64, minor: f64) -> TriMesh {
    let across = across.max(3);
    let mut mesh = TriMesh::default();
    for i in 0..around {
        let (sin, cos) = (TAU * i as f64 / around as f64).sin_cos();
        for j in 0..across {
            let (s, c) = (TAU * j as f64 / across as f64).sin_cos();
            let r = major + minor * c;
            mesh.positions.push(DVec3::new(r * cos, r * sin, minor * s));
        }
    }
    let at = |i: usize, j: usize| (i % around * across + j % across) as u32;
    for i in 0..around {
        for j in 0..across {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

fn cylinder(n: usize, radius: f64, half_height: f64) -> TriMesh {
    let around = 4 * n;
    // Circles from the centre of the lower disc to that of the upper one.
    let mut circles = Vec::new();
    circles.extend((1..=n).map(|k| (radius * k as f64 / n as f64, -half_height)));
    circles.extend((1..2 * n).map(|k| (radius, half_height * (k as f64 / n as f64 - 1.0))));
    circles.extend((1..=n).rev().map(|k| (radius * k as f64 / n as f64, half_height)));
    let mut mesh = TriMesh::default();
    for &(r, z) in &circles {
        for j in 0..around {
            let (sin, cos) = (TAU * j as f64 / around as f64).sin_cos();
            mesh.positions.push(DVec3::new(r * cos, r * sin, z));
        }
    }
    let at = |i: usize, j: usize| (i * around + j % around) as u32;
    let (south, north) = (mesh.positions.len() as u32, mesh.positions.len() as u32 + 1);
    mesh.positions.extend([DVec3::new(0.0, 0.0, -half_height), DVec3::new(0.0, 0.0, half_height)]);
    let last = circles.len() - 1;
    for j in 0..around {
        mesh.triangles.push([south, at(0, j + 1), at(0, j)]);
        mesh.triangles.push([north, at(last, j), at(last, j + 1)]);
        for i in 0..last {
            let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAPES: [Shape; 5] = [
        Shape::Sphere { radius: 2.0 },
        Shape::Torus { major: 2.0, minor: 0.7 },
        Shape::Cuboid { half: DVec3::new(1.0, 2.0, 0.5) },
        Shape::Plane { half: DVec2::new(1.0, 3.0) },
        Shape::Cylinder { radius: 1.5, half_height: 0.8 },
    ];

    #[test]
    fn vertices_lie_on_the_shape_and_triangles_face_outward() {
        for shape in SHAPES {
            let mesh = shape.mesh(6);
            mesh.validate().unwrap();
            assert!(mesh.positions.iter().all(|&p| shape.distance(p).abs() < 1e-12), "{shape:?}");
            for t in 0..mesh.triangles.len() {
                let [a, b, c] = mesh.corners(t);
                let normal = (b - a).cross(c - a).normalize();
                let centre = (a + b + c) / 3.0;
                let step = 0.3;
                assert!(shape.distance(centre + normal * step) > 0.5 * step, "{shape:?}");
            }
        }
    }

    #[test]
    fn closed_shapes_are_closed() {
        for shape in SHAPES {
            let mesh = shape.mesh(5);
            let mut edges = std::collections::HashMap::new();
            for [a, b, c] in &mesh.triangles {
                for (from, to) in [(a, b), (b, c), (c, a)] {
                    assert_eq!(edges.insert((*from, *to), ()), None, "{shape:?}");
                }
            }
            let open = edges.keys().filter(|(a, b)| !edges.contains_key(&(*b, *a))).count();
            assert_eq!(open > 0, matches!(shape, Shape::Plane { .. }), "{shape:?}: {open}");
        }
    }
}
