//! On which side of a mesh a point is: the angle-weighted normals of its faces, edges and vertices \[BA05\].

use glam::DVec3;

use super::shape::angles;
use crate::TriMesh;
use base::error::Result;
use base::progress::Progress;
use geom::bvh::{Closest, Feature};

/// Triangles handled between two looks at the progress.
const BLOCK: usize = 1 << 16;

/// Normals of edges and vertices that tell the side of a point. \[BA05\]
pub(super) struct PseudoNormals {
    vertices: Vec<DVec3>,
    /// The edges whose smaller end is vertex v are `starts[v]..starts[v + 1]` of `edges`.
    starts: Vec<usize>,
    /// The larger end and the triangle, sorted.
    edges: Vec<[u32; 2]>,
}

impl PseudoNormals {
    pub fn new(mesh: &TriMesh, progress: &Progress<'_>) -> Result<Self> {
        let mut vertices = vec![DVec3::ZERO; mesh.positions.len()];
        let mut starts = vec![0_usize; mesh.positions.len() + 1];
        let blocks = || (0..mesh.triangles.len()).step_by(BLOCK).map(|t| t..(t + BLOCK).min(mesh.triangles.len()));
        for block in blocks() {
            progress.check()?;
            for t in block {
                let (corners, normal, angles) = (mesh.triangles[t], face_normal(mesh, t), angles(mesh.corners(t)));
                for k in 0..3 {
                    vertices[corners[k] as usize] += normal * angles[k];
                    starts[edge(corners, k)[0] as usize + 1] += 1;
                }
            }
        }
        for v in 1..starts.len() {
            starts[v] += starts[v - 1];
        }
        let mut next = starts.clone();
        let mut edges = vec![[0; 2]; 3 * mesh.triangles.len()];
        for block in blocks() {
            progress.check()?;
            for t in block {
                for k in 0..3 {
                    let [low, high] = edge(mesh.triangles[t], k);
                    let slot = &mut next[low as usize];
                    edges[*slot] = [high, t as u32];
                    *slot += 1;
                }
            }
        }
        for (v, range) in starts.windows(2).enumerate() {
            if v % BLOCK == 0 {
                progress.check()?;
            }
            // Around one vertex: a handful.
            edges[range[0]..range[1]].sort_unstable();
        }
        Ok(PseudoNormals { vertices, starts, edges })
    }

    /// A normal whose side of the closest point is the mesh's.
    pub fn at(&self, mesh: &TriMesh, closest: &Closest) -> DVec3 {
        let corners = mesh.triangles[closest.triangle as usize];
        match closest.feature {
            Feature::Inside => face_normal(mesh, closest.triangle as usize),
            Feature::Corner(k) => self.vertices[corners[k as usize] as usize],
            Feature::Edge(k) => {
                let [low, high] = edge(corners, k as usize);
                let edges = &self.edges[self.starts[low as usize]..self.starts[low as usize + 1]];
                let first = edges.partition_point(|edge| edge[0] < high);
                let shared = edges[first..].iter().take_while(|edge| edge[0] == high);
                shared.fold(DVec3::ZERO, |sum, edge| sum + face_normal(mesh, edge[1] as usize))
            }
        }
    }
}

/// The edge opposite corner `k`, the smaller end first.
fn edge(corners: [u32; 3], k: usize) -> [u32; 2] {
    let (a, b) = (corners[(k + 1) % 3], corners[(k + 2) % 3]);
    [a.min(b), a.max(b)]
}

fn face_normal(mesh: &TriMesh, t: usize) -> DVec3 {
    let [a, b, c] = mesh.corners(t);
    (b - a).cross(c - a).normalize_or_zero()
}
