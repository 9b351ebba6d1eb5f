//! The point of the detailed surface behind each texel: the closest one that faces the same way.

use glam::DVec3;
use rayon::prelude::*;

use base::error::Result;
use base::progress::Progress;
use geom::bvh::{Bvh, Closest, Ray};
use mesh::{TriMesh, normals};

use super::atlas::Texel;
use super::target::TextureTarget;

/// Texels between two checks.
const BLOCK: usize = 1024;
/// Surfaces behind one another that a ray looks through for one that faces its texel.
const LAYERS: usize = 8;
/// Such a one is looked for so many times as far as the closest point.
const REACH: f64 = 8.0;

/// The detailed surface.
pub struct Detail<'a> {
    /// The mesh.
    pub mesh: &'a TriMesh,
    /// Its hierarchy.
    pub bvh: &'a Bvh<'a>,
    /// Normals of its vertices.
    pub normals: &'a [DVec3],
    /// Points of texels are relative to it.
    pub origin: DVec3,
}

/// A place on the detailed surface. In single precision, relative to [`Detail::origin`]: there is one per texel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Place {
    /// Its place.
    pub point: [f32; 3],
    /// Normal of the surface, smooth.
    pub normal: [f32; 3],
    /// Triangle.
    pub triangle: u32,
    /// Weights of its second and third corner.
    pub weights: [f32; 2],
}

/// Places behind the texels.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn places(
    texels: &[Texel],
    target: &TextureTarget<'_>,
    normals: &[DVec3],
    detail: &Detail<'_>,
    progress: &Progress<'_>,
) -> Result<Vec<Place>> {
    let mut places = vec![Place::default(); texels.len()];
    places.par_chunks_mut(BLOCK).zip(texels.par_chunks(BLOCK)).try_for_each(|(places, texels)| {
        // Neighbours lie near each other.
        let mut near = None;
        for (place, texel) in places.iter_mut().zip(texels) {
            let (point, normal) = on_target(texel, target, normals);
            *place = detail.behind(point, normal, &mut near);
        }
        progress.advance(texels.len() as u64)
    })?;
    Ok(places)
}

/// The point of a texel on the mesh, and its smooth normal.
pub fn on_target(texel: &Texel, target: &TextureTarget<'_>, normals: &[DVec3]) -> (DVec3, DVec3) {
    let t = texel.triangle as usize;
    let [b, c] = texel.weights.map(f64::from);
    let mix = |[p, q, r]: [DVec3; 3]| p + (q - p) * b + (r - p) * c;
    let corners = target.mesh.corners(t);
    let smooth = mix(target.mesh.triangles[t].map(|v| normals[v as usize])).normalize_or_zero();
    let flat = normals::of_triangle(corners);
    (mix(corners), if smooth.dot(flat) > 0.0 { smooth } else { flat })
}

impl Detail<'_> {
    /// The place that belongs to a point of the mesh.
    fn behind(&self, point: DVec3, normal: DVec3, near: &mut Option<u32>) -> Place {
        let known = near.map(|t| Closest::on_triangle(point, &self.mesh.corners(t as usize), t));
        let Some(closest) = self.bvh.closest_point_from(point, known) else { return Place::default() };
        *near = Some(closest.triangle);
        let found = self.place(closest.triangle, closest.barycentric);
        if self.faces(closest.triangle, normal) {
            return found;
        }
        // The other side of a thin wall is nearer: this side lies along the normal.
        let reach = REACH * closest.distance().max(f64::from(f32::EPSILON) * point.distance(self.origin));
        let mut nearest = None;
        for direction in [normal, -normal] {
            let mut from = 0.0;
            for _ in 0..LAYERS {
                let Some(hit) = self.bvh.first_hit(&Ray { origin: point, direction }, from, reach) else { break };
                if self.faces(hit.triangle, normal) {
                    if nearest.is_none_or(|(t, _)| hit.t < t) {
                        nearest = Some((hit.t, self.place(hit.triangle, hit.barycentric)));
                    }
                    break;
                }
                from = hit.t.next_up() * (1.0 + 1e-12);
            }
        }
        // Nothing of it is there: the texel's own point and side, which photos from the other side do not see.
        nearest.map_or_else(
            || Place {
                point: (point - self.origin).as_vec3().to_array(),
                normal: normal.as_vec3().to_array(),
                ..found
            },
            |(_, place)| place,
        )
    }

    fn faces(&self, triangle: u32, normal: DVec3) -> bool {
        normals::of_triangle(self.mesh.corners(triangle as usize)).dot(normal) > 0.0
    }

    fn place(&self, triangle: u32, [a, b, c]: [f64; 3]) -> Place {
        let corners = self.mesh.corners(triangle as usize);
        let flat = normals::of_triangle(corners);
        let [p, q, r] = self.mesh.triangles[triangle as usize].map(|v| self.normals[v as usize]);
        let smooth = (p * a + q * b + r * c).normalize_or_zero();
        let normal = if smooth.dot(flat) > 0.0 { smooth } else { flat };
        let point = (corners[0] - self.origin) + (corners[1] - corners[0]) * b + (corners[2] - corners[0]) * c;
        Place {
            point: point.as_vec3().to_array(),
            normal: normal.as_vec3().to_array(),
            triangle,
            weights: [b as f32, c as f32],
        }
    }
}
