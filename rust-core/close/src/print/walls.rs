//! Thickness of the wall behind a face: by a ray and by a ball.
//!
//! The ball touches the face's centre from inside and is the largest one that no face enters, found by shrinking. \[MBC12\] It bounds the
//! ray from below: a ray that leaves a wedge slantwise, or slips past an edge, says more than the wall has. Beside a convex edge the ball
//! is small, though nothing there is thin. So it counts only if the face that it meets faces away from its own.

use glam::DVec3;
use rayon::prelude::*;

use base::error::Result;
use base::progress::Progress;
use geom::bvh::{Bvh, Ray};
use mesh::TriMesh;

use crate::surface;

/// Steps of a ball, which shrinks in each.
const STEPS: usize = 40;
/// A ball has shrunk to its end where the next would be smaller by less than this share. So a wall may be thinner than said by this share.
/// In round bodies many faces nearly touch the same ball. With a smaller share each of them would be looked at.
pub const END: f64 = 0.02;
/// Most cosine between the normals of the two sides of a wall.
const TURNED: f64 = -0.5;

/// Thickness behind the centre of a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wall {
    /// Distance from the centre to the next face against the normal. Infinite if there is none.
    pub ray: f64,
    /// Diameter of the largest ball inside that touches the centre, at most `ray`. Infinite if nothing is met.
    pub ball: f64,
    /// The ball's diameter if the face that it meets is turned by 120 degrees or more, so that both are sides of a wall. Else the ray.
    pub thickness: f64,
}

const NONE: Wall = Wall { ray: f64::INFINITY, ball: f64::INFINITY, thickness: f64::INFINITY };

/// Of each face.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn measure(mesh: &TriMesh, bvh: &Bvh<'_>, progress: &Progress<'_>) -> Result<Vec<Wall>> {
    let mut walls = vec![NONE; mesh.triangles.len()];
    walls.par_chunks_mut(256).enumerate().try_for_each(|(chunk, walls)| {
        walls.iter_mut().enumerate().for_each(|(i, wall)| *wall = behind(mesh, bvh, 256 * chunk + i));
        progress.advance(walls.len() as u64)
    })?;
    Ok(walls)
}

fn behind(mesh: &TriMesh, bvh: &Bvh<'_>, t: usize) -> Wall {
    let corners = mesh.corners(t);
    let (centre, normal) = ((corners[0] + corners[1] + corners[2]) / 3.0, surface::normal(corners));
    if normal == DVec3::ZERO {
        return NONE;
    }
    // The face itself is met at rounding's distance.
    let size = corners[0].distance(corners[1]).max(corners[1].distance(corners[2])).max(centre.abs().max_element());
    let ray = Ray { origin: centre, direction: -normal };
    let Some(hit) = bvh.first_hit(&ray, 1e-12 * size, f64::INFINITY) else { return NONE };
    let (mut radius, mut met) = (0.5 * hit.t, hit.triangle);
    for _ in 0..STEPS {
        // The smaller ball touches the centre, too, but for rounding.
        let smaller = radius * (1.0 - END);
        let within = smaller * (1.0 - 1e-9) - 1e-12 * size;
        if within <= 0.0 {
            break;
        }
        let Some(nearest) = bvh.closest_point_within(centre - smaller * normal, within) else { break };
        let way = centre - nearest.point;
        (radius, met) = (0.5 * way.length_squared() / way.dot(normal), nearest.triangle);
    }
    let is_wall = surface::normal(mesh.corners(met as usize)).dot(normal) <= TURNED;
    Wall { ray: hit.t, ball: 2.0 * radius, thickness: if is_wall { 2.0 * radius } else { hit.t } }
}
