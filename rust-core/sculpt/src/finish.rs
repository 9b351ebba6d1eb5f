//! From triangles over pixels to a mesh with attributes.

use glam::DVec3;

use super::domain::Domain;
use super::pieces::Pieces;
use super::rays::Rays;
use base::error::Result;
use base::progress::Progress;
use image::range_image::RangeImage;
use mesh::{Attribute, TriMesh};

/// The mesh in the sensor's frame, without errors. Triangles turn counter-clockwise seen from the sensor. If the domain touches itself in a
/// pixel, each fan of triangles gets a vertex of its own.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub(super) fn mesh(image: &RangeImage, domain: &Domain, pieces: &Pieces, progress: &Progress<'_>) -> Result<TriMesh> {
    let (pixels, triangles) = number_vertices(image.len(), domain, &pieces.triangles, progress)?;
    let mut positions: Vec<DVec3> = Vec::with_capacity(pixels.len());
    for block in progress.blocks(&pixels) {
        positions.extend(block?.iter().map(|&p| image.point_in_sensor(p as usize)));
    }
    if !pieces.moved.is_empty() {
        let (rays, values) = (Rays::new(image, domain.mirrored), pieces.values(image.len()));
        for (position, &p) in positions.iter_mut().zip(&pixels) {
            let value = values[p as usize];
            if !value.is_nan() {
                *position = rays.point(image, p, value);
            }
        }
    }
    let mut mesh = TriMesh::new(positions, triangles);
    let cols = domain.cols;
    let attributes = &mut mesh.vertex_attributes;
    progress.check()?;
    attributes.push(Attribute::i32("range_row", pixels.iter().map(|&p| (p / cols) as i32).collect()));
    attributes.push(Attribute::i32("range_col", pixels.iter().map(|&p| (p % cols) as i32).collect()));
    let floats = [("confidence", &image.confidence), ("intensity", &image.intensity)];
    for (name, values) in floats {
        if let Some(values) = values {
            progress.check()?;
            attributes.push(Attribute::f32(name, pixels.iter().map(|&p| values[p as usize]).collect()));
        }
    }
    if let Some(colours) = &image.colour {
        progress.check()?;
        attributes.push(Attribute::colour("colour", pixels.iter().map(|&p| colours[p as usize]).collect()));
    }
    Ok(mesh)
}

/// Adds the errors of the faces, and to each vertex the largest one of its faces.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub(super) fn add_errors(mesh: &mut TriMesh, face_errors: &[f32], progress: &Progress<'_>) -> Result<()> {
    let mut of_vertices = vec![0.0_f32; mesh.positions.len()];
    let mut errors = face_errors.iter();
    for block in progress.blocks(&mesh.triangles) {
        for (triangle, &error) in block?.iter().zip(&mut errors) {
            for &v in triangle {
                of_vertices[v as usize] = of_vertices[v as usize].max(error);
            }
        }
    }
    mesh.vertex_attributes.push(Attribute::f32("error", of_vertices));
    mesh.face_attributes.push(Attribute::f32("error", face_errors.to_vec()));
    Ok(())
}

/// The pixel of each vertex, rising, and the triangles over vertices.
fn number_vertices(
    count: usize,
    domain: &Domain,
    triangles: &[[u32; 3]],
    progress: &Progress<'_>,
) -> Result<(Vec<u32>, Vec<[u32; 3]>)> {
    let mut number = vec![0_u32; count];
    for block in progress.blocks(triangles) {
        block?.iter().flatten().for_each(|&p| number[p as usize] = 1);
    }
    let mut pixels = Vec::new();
    for (p, slot) in number.iter_mut().enumerate() {
        if *slot != 0 {
            *slot = pixels.len() as u32;
            pixels.push(p as u32);
        }
    }
    let turn = |[a, b, c]: [u32; 3]| if domain.mirrored { [a, c, b] } else { [a, b, c] };
    let mut numbered: Vec<[u32; 3]> = Vec::with_capacity(triangles.len());
    for block in progress.blocks(triangles) {
        numbered.extend(block?.iter().map(|&triangle| turn(triangle.map(|p| number[p as usize]))));
    }
    // Triangles at pixels where the domain touches itself, in order of pixel.
    let mut at_pinches: Vec<(u32, u32)> = Vec::new();
    let mut pinched: Vec<bool> = Vec::with_capacity(pixels.len());
    for block in progress.blocks(&pixels) {
        pinched.extend(block?.iter().map(|&p| domain.fans(p) > 1));
    }
    if pinched.contains(&true) {
        for (t, triangle) in numbered.iter().enumerate() {
            at_pinches.extend(triangle.iter().filter(|&&v| pinched[v as usize]).map(|&v| (v, t as u32)));
        }
    }
    progress.check()?;
    at_pinches.sort_unstable();
    for group in at_pinches.chunk_by(|a, b| a.0 == b.0) {
        let v = group[0].0;
        let mut left: Vec<u32> = group.iter().map(|g| g.1).collect();
        let mut first_fan = true;
        while let Some(start) = left.pop() {
            // Everything that shares an edge at `v`, directly or through others.
            let mut fan = vec![start];
            let mut reached = 0;
            while reached < fan.len() {
                let here = numbered[fan[reached] as usize];
                reached += 1;
                left.retain(|&t| {
                    let joined = numbered[t as usize].iter().any(|w| *w != v && here.contains(w));
                    if joined {
                        fan.push(t);
                    }
                    !joined
                });
            }
            if !std::mem::replace(&mut first_fan, false) {
                let own = pixels.len() as u32;
                pixels.push(pixels[v as usize]);
                for t in fan {
                    for corner in &mut numbered[t as usize] {
                        if *corner == v {
                            *corner = own;
                        }
                    }
                }
            }
        }
    }
    Ok((pixels, numbered))
}
