//! Thickness of the wall behind a face: by a ray and by a ball.
//!
//! The ball touches the face's centre from inside. It shrinks until no face enters it by more than a share. \[MBC12\] It bounds the ray
//! from below: a ray that leaves a wedge slantwise, or slips past an edge, says more than the wall has. Beside a convex edge the ball is
//! small, though nothing there is thin. So it counts only if the face that it meets faces away from its own.

use glam::DVec3;
use rayon::prelude::*;

use base::error::Result;
use base::progress::Progress;
use geom::bvh::{Bvh, Ray};
use mesh::TriMesh;

use crate::surface;

/// No face is nearer to the middle of a ball than its radius less this share. In round bodies many faces nearly touch the same ball: with a
/// smaller share more of them are looked at.
pub const END: f64 = 0.02;
/// Faces that are measured one after the other. They know of each other's balls.
const CHUNK: usize = 1024;
/// Balls that such faces know of.
const KEPT: usize = 32;
/// Most cosine between the normals of the two sides of a wall.
const TURNED: f64 = -0.5;

/// Thickness behind the centre of a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wall {
    /// Distance from the centre to the next face against the normal. Infinite if there is none.
    pub ray: f64,
    /// Diameter of a ball whose middle lies half of it behind the centre. It is at least that of the largest ball inside that touches the
    /// centre, and at most `ray` and the limit. The ball around the same middle that is smaller by [`END`] lies inside. Infinite if
    /// nothing is met.
    pub ball: f64,
    /// The ball's diameter if the face that it meets is turned by 120 degrees or more, so that both are sides of a wall. Else the ray, at
    /// most the limit. Infinite if nothing is met.
    pub thickness: f64,
}

const NONE: Wall = Wall { ray: f64::INFINITY, ball: f64::INFINITY, thickness: f64::INFINITY };

/// Walls behind each face, measured up to the thickness `limit`.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn measure(mesh: &TriMesh, bvh: &Bvh<'_>, limit: f64, progress: &Progress<'_>) -> Result<Vec<Wall>> {
    let order: Vec<u32> = bvh.order().collect();
    let measured: Result<Vec<Vec<Wall>>> = order
        .par_chunks(CHUNK)
        .map(|chunk| {
            let mut clear = Clear::default();
            let walls = chunk.iter().map(|&t| behind(mesh, bvh, t as usize, limit, &mut clear)).collect();
            progress.advance(chunk.len() as u64)?;
            Ok(walls)
        })
        .collect();
    let mut walls = vec![NONE; mesh.triangles.len()];
    for (&t, wall) in order.iter().zip(measured?.into_iter().flatten()) {
        walls[t as usize] = wall;
    }
    Ok(walls)
}

/// The last balls that were found to lie inside. Faces of a round body have nearly the same ball, which all of them touch. So to search for
/// the nearest face would visit nearly all, for each face anew.
#[derive(Default)]
struct Clear {
    balls: [(DVec3, f64); KEPT],
    next: usize,
}

impl Clear {
    fn add(&mut self, middle: DVec3, radius: f64) {
        self.balls[self.next] = (middle, radius);
        self.next = (self.next + 1) % KEPT;
    }

    /// Whether the ball lies within one of them.
    fn holds(&self, middle: DVec3, radius: f64) -> bool {
        self.balls.iter().any(|&(known, most)| {
            let room = most - radius;
            room >= 0.0 && known.distance_squared(middle) <= room * room
        })
    }
}

fn behind(mesh: &TriMesh, bvh: &Bvh<'_>, t: usize, limit: f64, clear: &mut Clear) -> Wall {
    let corners = mesh.corners(t);
    let (centre, normal) = ((corners[0] + corners[1] + corners[2]) / 3.0, surface::normal(corners));
    if normal == DVec3::ZERO {
        return NONE;
    }
    // The face itself is met at rounding's distance.
    let size = corners[0].distance(corners[1]).max(corners[1].distance(corners[2])).max(centre.abs().max_element());
    let ray = Ray { origin: centre, direction: -normal };
    let Some(hit) = bvh.first_hit(&ray, 1e-12 * size, f64::INFINITY) else { return NONE };
    let (mut radius, mut met) = (0.5 * hit.t.min(limit), hit.triangle);
    // Each round makes it smaller by half of END or more: the face that is met lies so far within.
    loop {
        let (middle, inside) = (centre - radius * normal, radius * (1.0 - END));
        if inside <= 1e-12 * size || clear.holds(middle, inside) {
            break;
        }
        // A larger ball than is needed: then more others lie within it.
        let larger = radius * (1.0 - 0.5 * END);
        let Some(nearest) = bvh.closest_point_within(middle, larger) else {
            clear.add(middle, larger);
            break;
        };
        if nearest.distance() >= inside {
            clear.add(middle, nearest.distance());
            break;
        }
        let way = centre - nearest.point;
        (radius, met) = (0.5 * way.length_squared() / way.dot(normal), nearest.triangle);
    }
    let is_wall = surface::normal(mesh.corners(met as usize)).dot(normal) <= TURNED;
    Wall { ray: hit.t, ball: 2.0 * radius, thickness: if is_wall { 2.0 * radius } else { hit.t.min(limit) } }
}
