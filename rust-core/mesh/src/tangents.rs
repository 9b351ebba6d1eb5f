//! Tangents of corners, as MikkTSpace makes them: with others normal maps would shade differently.

use glam::DVec3;
use mikktspace::Geometry;

use crate::TriMesh;

/// Tangents of the corners of all triangles: direction, and the sign of the bitangent. `uv` has the texture coordinates of vertices, to the
/// right and upwards.
///
/// # Cost
/// Grows with the triangles. It can't be interrupted.
pub fn of_corners(mesh: &TriMesh, normals: &[DVec3], uv: &dyn Fn(usize) -> [f32; 2]) -> Vec<[[f32; 4]; 3]> {
    let tangents = vec![[[1.0, 0.0, 0.0, 1.0]; 3]; mesh.triangles.len()];
    let mut corners = Corners { mesh, normals, uv, tangents };
    // It answers that there is no triangle.
    let _ = mikktspace::generate_tangents(&mut corners);
    corners.tangents
}

struct Corners<'a> {
    mesh: &'a TriMesh,
    normals: &'a [DVec3],
    uv: &'a dyn Fn(usize) -> [f32; 2],
    tangents: Vec<[[f32; 4]; 3]>,
}

impl Corners<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.mesh.triangles[face][corner] as usize
    }
}

impl Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.mesh.triangles.len()
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.mesh.positions[self.vertex(face, corner)].as_vec3().to_array()
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.normals[self.vertex(face, corner)].as_vec3().to_array()
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        (self.uv)(self.vertex(face, corner))
    }

    fn set_tangent_encoded(&mut self, tangent: [f32; 4], face: usize, corner: usize) {
        self.tangents[face][corner] = tangent;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mirrored_triangle_has_the_other_sign() {
        let positions = vec![DVec3::ZERO, DVec3::X, DVec3::ONE.with_z(0.0), DVec3::Y];
        let mesh = TriMesh::new(positions, vec![[0, 1, 2], [0, 2, 3]]);
        let normals = [DVec3::Z; 4];
        let flat = of_corners(&mesh, &normals, &|v| [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]][v]);
        assert_eq!(flat, [[[1.0, 0.0, 0.0, 1.0]; 3]; 2]);
        let folded = of_corners(&mesh, &normals, &|v| [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [1.0, 0.0]][v]);
        assert_eq!(folded[0], [[1.0, 0.0, 0.0, 1.0]; 3]);
        assert!(folded[1].iter().all(|tangent| tangent[1] > 0.99 && tangent[3] == -1.0), "{folded:?}");
    }
}
