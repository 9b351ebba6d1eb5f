//! The net as a mesh in the caller's coordinates, with the input's attributes.

use super::net::Net;
use super::surface::{Place, Surface};
use mesh::{Attribute, AttributeData, TriMesh, texture};

/// Positions are on the surface. Floats and colours are interpolated there, integers and flags are those of the nearest corner. Texture
/// coordinates are left out: triangles may cross seams.
pub fn mesh(surface: &Surface, input: &TriMesh, net: Net) -> TriMesh {
    let mut mesh = TriMesh::new(net.points.iter().map(|&p| surface.frame.outward(p)).collect(), net.triangles);
    mesh.crs = input.crs.clone();
    if input.vertex_attributes.is_empty() {
        return mesh;
    }
    let places: Vec<([u32; 3], [f64; 3])> = net
        .points
        .iter()
        .zip(&net.places)
        .map(|(&point, &triangle)| {
            let corners = surface.triangles[triangle as usize].map(|v| surface.origins[v as usize]);
            (corners, surface.barycentric(Place { point, triangle }))
        })
        .collect();
    let nearest = |&(corners, weights): &([u32; 3], [f64; 3])| {
        let k = if weights[1] > weights[0] { 1 } else { 0 };
        corners[if weights[2] > weights[k] { 2 } else { k }] as usize
    };
    let blend = |&(corners, weights): &([u32; 3], [f64; 3]), value: &dyn Fn(usize) -> f64| {
        (0..3).map(|k| value(corners[k] as usize) * weights[k]).sum::<f64>()
    };
    for attribute in input.vertex_attributes.iter().filter(|attribute| !texture::has_name(&attribute.name)) {
        let data = match &attribute.data {
            AttributeData::F32(v) => {
                AttributeData::F32(places.iter().map(|p| blend(p, &|i| f64::from(v[i])) as f32).collect())
            }
            AttributeData::Colour(v) => {
                let channel = |p: &_, c: usize| blend(p, &|i| f64::from(v[i][c])).round() as u8;
                AttributeData::Colour(places.iter().map(|p| std::array::from_fn(|c| channel(p, c))).collect())
            }
            AttributeData::I32(v) => AttributeData::I32(places.iter().map(|p| v[nearest(p)]).collect()),
            AttributeData::Bool(v) => AttributeData::Bool(places.iter().map(|p| v[nearest(p)]).collect()),
        };
        mesh.vertex_attributes.push(Attribute { name: attribute.name.clone(), data });
    }
    mesh
}
