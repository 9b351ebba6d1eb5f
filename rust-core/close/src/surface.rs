//! The measured surface, made to be asked: its borders, and on which side of it a place lies.

use glam::DVec3;

use base::error::{Error, Result};
use base::magnitude;
use base::progress::{Pace, Progress};
use geom::bvh::{Bvh, Closest, Feature};
use mesh::measure::angles;
use mesh::{TriMesh, try_check};

use super::rows::NONE;

/// The measured surface.
pub struct Surface<'a> {
    pub mesh: &'a TriMesh,
    pub bvh: Bvh<'a>,
    /// Over the edge opposite each corner: the triangle there, [`NONE`] on a border.
    across: Vec<[u32; 3]>,
    /// Angle-weighted. \[BA05\]
    vertex_normals: Vec<DVec3>,
    is_on_border: Vec<bool>,
}

/// A place beside the surface.
#[derive(Clone, Copy, Debug)]
pub struct Beside {
    /// Distance, negative behind the surface.
    pub distance: f64,
    /// Whether the nearest point of the surface lies on its border: then the side is that of the nearest face only.
    pub is_at_border: bool,
}

impl<'a> Surface<'a> {
    /// Of a mesh that [`mesh::check`] calls a manifold.
    ///
    /// # Errors
    /// [`Error::Input`] for any other mesh, with what is wrong and what to do. [`Error::OutOfMemory`]. [`Error::Cancelled`].
    pub fn new(mesh: &'a TriMesh, threads: usize, progress: &Progress<'_>) -> Result<Self> {
        refuse(mesh, progress)?;
        let bvh = Bvh::build_with(&mesh.positions, &mesh.triangles, threads, progress)?;
        let mut pace = Pace::new(progress);
        // Each edge with its triangle and the corner opposite. Both triangles of an edge come one after the other.
        let mut sides: Vec<([u32; 2], u32, u8)> = Vec::with_capacity(3 * mesh.triangles.len());
        let mut vertex_normals = vec![DVec3::ZERO; mesh.positions.len()];
        for (t, corners) in mesh.triangles.iter().enumerate() {
            pace.after(16)?;
            let (normal, angles) = (normal(mesh.corners(t)), angles(mesh.corners(t)));
            for k in 0..3 {
                vertex_normals[corners[k] as usize] += normal * angles[k];
                let [from, to] = side(*corners, k);
                sides.push(([from.min(to), from.max(to)], t as u32, k as u8));
            }
        }
        progress.sort(&mut sides, &|a, b| a.cmp(b))?;
        let mut across = vec![[NONE; 3]; mesh.triangles.len()];
        let mut is_on_border = vec![false; mesh.positions.len()];
        for edge in sides.chunk_by(|a, b| a.0 == b.0) {
            pace.after(2)?;
            match *edge {
                [(_, one, k), (_, other, l)] => {
                    across[one as usize][k as usize] = other;
                    across[other as usize][l as usize] = one;
                }
                _ => edge[0].0.iter().for_each(|&v| is_on_border[v as usize] = true),
            }
        }
        Ok(Surface { mesh, bvh, across, vertex_normals, is_on_border })
    }

    /// Side and distance of a place. `None` for a surface without triangles. The nearest triangle of a place near to it, if there is one in
    /// `hint`, finds the same sooner. It is replaced by that of this place.
    pub fn beside_from(&self, place: DVec3, hint: &mut Option<u32>) -> Option<Beside> {
        let known = hint.map(|t| Closest::on_triangle(place, &self.mesh.corners(t as usize), t));
        let closest = self.bvh.closest_point_from(place, known)?;
        *hint = Some(closest.triangle);
        Some(self.side_of(place, &closest))
    }

    /// [`Surface::beside_from`] of places within a distance, `None` farther away. Costs little where nothing is near.
    pub fn beside_within(&self, place: DVec3, distance: f64, hint: &mut Option<u32>) -> Option<Beside> {
        let known = hint.map(|t| Closest::on_triangle(place, &self.mesh.corners(t as usize), t));
        let closest = match known.filter(|known| known.distance() <= distance) {
            Some(known) => self.bvh.closest_point_from(place, Some(known)),
            None => self.bvh.closest_point_within(place, distance),
        }?;
        *hint = Some(closest.triangle);
        Some(self.side_of(place, &closest))
    }

    fn side_of(&self, place: DVec3, closest: &Closest) -> Beside {
        let t = closest.triangle as usize;
        let own = || normal(self.mesh.corners(t));
        let (normal, is_at_border) = match closest.feature {
            Feature::Inside => (own(), false),
            Feature::Corner(k) => {
                let v = self.mesh.triangles[t][k as usize] as usize;
                (self.vertex_normals[v], self.is_on_border[v])
            }
            Feature::Edge(k) => match self.across[t][k as usize] {
                NONE => (own(), true),
                other => (own() + normal(self.mesh.corners(other as usize)), false),
            },
        };
        let distance = closest.distance();
        let is_behind = (place - closest.point).dot(normal) < 0.0;
        Beside { distance: if is_behind { -distance } else { distance }, is_at_border }
    }

    /// The border's edges, each in the direction of its triangle, with that triangle, in the order of the triangles.
    pub fn border(&self) -> Vec<([u32; 2], [u32; 3])> {
        let open = |(t, across): (usize, &[u32; 3])| {
            let (corners, across) = (self.mesh.triangles[t], *across);
            (0..3).filter(move |&k| across[k] == NONE).map(move |k| (side(corners, k), corners))
        };
        self.across.iter().enumerate().flat_map(open).collect()
    }
}

/// The edge opposite corner `k` in the direction of its triangle.
pub fn side(corners: [u32; 3], k: usize) -> [u32; 2] {
    [corners[(k + 1) % 3], corners[(k + 2) % 3]]
}

/// Of a triangle. Zero if it has no area.
pub fn normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a).normalize_or_zero()
}

fn refuse(mesh: &TriMesh, progress: &Progress<'_>) -> Result<()> {
    mesh.validate()?;
    magnitude::points("vertex", &mesh.positions)?;
    if mesh.triangles.is_empty() {
        return Err(Error::input("the mesh has no triangles: there is nothing to close"));
    }
    let report = try_check(mesh, &progress.unseen())?;
    if !report.is_manifold() {
        return Err(Error::input(format!(
            "the mesh must be an oriented manifold, but it has {report}: merge its scans again, or repair these places first"
        )));
    }
    Ok(())
}
