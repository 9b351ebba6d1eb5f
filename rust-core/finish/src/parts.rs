//! Parts of the surface: small ones are dropped.

use base::error::Result;
use base::progress::Progress;
use mesh::connected;
use mesh::{Attribute, TriMesh};

/// The surface without the parts that have fewer triangles than a share of the largest. Also how many parts and triangles went.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn without_small(mesh: &TriMesh, share: f64, progress: &Progress<'_>) -> Result<(TriMesh, [u64; 2])> {
    let part = connected::parts(mesh.positions.len(), &mesh.triangles, progress)?;
    let mut faces = vec![0_u64; mesh.positions.len()];
    mesh.triangles.iter().for_each(|corners| faces[part[corners[0] as usize] as usize] += 1);
    let least = share * faces.iter().max().copied().unwrap_or(0) as f64;
    let is_small = |count: u64| count > 0 && (count as f64) < least;
    let gone = faces.iter().filter(|&&count| is_small(count));
    let dropped = [gone.clone().count() as u64, gone.sum()];
    let kept = |t: &usize| !is_small(faces[part[mesh.triangles[*t][0] as usize] as usize]);
    let triangles: Vec<usize> = (0..mesh.triangles.len()).filter(kept).collect();
    Ok((of_triangles(mesh, &triangles), dropped))
}

/// Some triangles as a mesh of their own, with all attributes. Vertices that none of them uses are left out.
fn of_triangles(mesh: &TriMesh, triangles: &[usize]) -> TriMesh {
    let mut place = vec![u32::MAX; mesh.positions.len()];
    triangles.iter().flat_map(|&t| mesh.triangles[t]).for_each(|v| place[v as usize] = 0);
    let vertices: Vec<usize> = (0..place.len()).filter(|&v| place[v] == 0).collect();
    vertices.iter().enumerate().for_each(|(i, &v)| place[v] = i as u32);
    let gathered = |attributes: &[Attribute], places: &[usize]| attributes.iter().map(|of| of.gather(places)).collect();
    TriMesh {
        positions: vertices.iter().map(|&v| mesh.positions[v]).collect(),
        triangles: triangles.iter().map(|&t| mesh.triangles[t].map(|v| place[v as usize])).collect(),
        vertex_attributes: gathered(&mesh.vertex_attributes, &vertices),
        face_attributes: gathered(&mesh.face_attributes, triangles),
        ..mesh.clone()
    }
}
