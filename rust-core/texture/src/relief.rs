//! Normal map and height map: the shape of the detailed surface over the mesh.

use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;

use mesh::tangents;

use super::atlas::Texel;
use super::behind::{Place, on_target};
use super::target::TextureTarget;

/// Tangents of the corners.
pub fn tangents(target: &TextureTarget<'_>, normals: &[DVec3]) -> Vec<[[f32; 4]; 3]> {
    tangents::of_corners(target.mesh, normals, &|v| target.uv[v].as_vec2().to_array())
}

/// Normals of the places in the tangent space of their texels, as renderers take them apart: tangent and normal are mixed from
/// the corners and not made unit vectors, the bitangent is their product.
pub fn normal_map(
    texels: &[Texel],
    places: &[Place],
    target: &TextureTarget<'_>,
    normals: &[DVec3],
    tangents: &[[[f32; 4]; 3]],
) -> Vec<[u8; 3]> {
    let of = |(texel, place): (&Texel, &Place)| {
        let t = texel.triangle as usize;
        let [b, c] = texel.weights.map(f64::from);
        let shares = [1.0 - b - c, b, c];
        let corners = target.mesh.triangles[t];
        let mix = |of: &dyn Fn(usize) -> DVec3| (0..3).map(|k| of(k) * shares[k]).sum::<DVec3>();
        let normal = mix(&|k| normals[corners[k] as usize]);
        let tangent =
            mix(&|k| DVec3::new(tangents[t][k][0].into(), tangents[t][k][1].into(), tangents[t][k][2].into()));
        let bitangent = normal.cross(tangent) * f64::from(tangents[t][0][3]);
        let frame = DMat3::from_cols(tangent, bitangent, normal);
        let wanted = DVec3::from(place.normal.map(f64::from));
        let inside = if frame.determinant().abs() > 1e-9 { frame.inverse() * wanted } else { DVec3::Z };
        let inside = inside.try_normalize().unwrap_or(DVec3::Z);
        inside.to_array().map(|x| ((x * 127.0).round() + 128.0).clamp(0.0, 255.0) as u8)
    };
    texels.par_iter().zip(places).map(of).collect()
}

/// Heights of the places over their texels, along the normal of the mesh.
pub fn heights(
    texels: &[Texel],
    places: &[Place],
    target: &TextureTarget<'_>,
    normals: &[DVec3],
    origin: DVec3,
) -> Vec<f32> {
    let of = |(texel, place): (&Texel, &Place)| {
        let (point, normal) = on_target(texel, target, normals);
        ((DVec3::from(place.point.map(f64::from)) + origin - point).dot(normal)) as f32
    };
    texels.par_iter().zip(places).map(of).collect()
}

/// Heights in steps of a range.
pub fn in_steps(heights: &[f32], [low, high]: [f64; 2]) -> Vec<u16> {
    let step = if high > low { f64::from(u16::MAX) / (high - low) } else { 0.0 };
    heights
        .iter()
        .map(|&height| ((f64::from(height) - low) * step).round().clamp(0.0, f64::from(u16::MAX)) as u16)
        .collect()
}

/// Any two axes across a direction.
pub fn across(normal: DVec3) -> [DVec3; 2] {
    let u = normal.any_orthonormal_vector();
    [u, normal.cross(u)]
}

/// Point `i` of `count` spread evenly over the unit square.
pub fn in_square(i: u32, count: u32) -> DVec2 {
    let radical = f64::from(i.reverse_bits()) / f64::from(u32::MAX);
    DVec2::new((f64::from(i) + 0.5) / f64::from(count), radical)
}
