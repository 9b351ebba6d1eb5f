//! The mesh that is being made: nodes that know their place on the surface, and triangles over them.

use glam::DVec3;

use super::surface::{NONE, Place, Surface, looking};
use base::error::Result;
use base::progress::Progress;
use mesh::TriMesh;
use mesh::measure::{self, Quality};

/// Nodes and triangles.
#[derive(Clone)]
pub struct Net {
    pub points: Vec<DVec3>,
    /// Triangle of the surface on which each node lies.
    pub places: Vec<u32>,
    /// Half-edge of the surface's border on which a node lies and slides, else `NONE`.
    pub rails: Vec<u32>,
    pub triangles: Vec<[u32; 3]>,
    /// Nodes that stay where they are; empty if none does.
    pub held: Vec<bool>,
}

impl Net {
    pub fn new(places: Vec<Place>, rails: Vec<u32>, triangles: Vec<[u32; 3]>) -> Self {
        let (points, places) = places.into_iter().map(|p| (p.point, p.triangle)).unzip();
        Net { points, places, rails, triangles, held: Vec::new() }
    }

    /// Quality of the triangles, and their angles in steps of 5 degrees.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn shape(&self, progress: &Progress<'_>) -> Result<(Quality, Vec<usize>)> {
        let mesh = TriMesh::new(self.points.clone(), self.triangles.clone());
        let mut histogram = vec![0; 36];
        let mut seen = 0;
        let quality = measure::quality_while(&mesh, |angles| {
            looking(seen, progress)?;
            seen += 1;
            angles.iter().for_each(|angle| histogram[((angle.to_degrees() / 5.0) as usize).min(35)] += 1);
            Ok(())
        })?;
        Ok((quality, histogram))
    }

    /// Twice the area of triangle `t` times its normal.
    #[inline]
    pub fn area_vector(&self, t: usize) -> DVec3 {
        area_vector(self.triangles[t].map(|v| self.points[v as usize]))
    }

    /// Whether a node slides along the border.
    #[inline]
    pub fn on_rail(&self, node: u32) -> bool {
        self.rails[node as usize] != NONE
    }

    /// Whether a node stays where it is.
    #[inline]
    pub fn is_held(&self, node: u32) -> bool {
        self.held.get(node as usize).copied().unwrap_or(false)
    }

    /// The place nearest to `p` to which `node` may go: where it is, if it is held; on its border, or on the surface near where it is.
    pub fn project(&self, surface: &Surface, node: usize, p: DVec3) -> Spot {
        let from = Spot { point: self.points[node], place: self.places[node], rail: self.rails[node] };
        if self.is_held(node as u32) {
            return from;
        }
        Self::project_from(surface, &from, p)
    }

    /// The place nearest to `p` to which a node at `from` may go.
    pub fn project_from(surface: &Surface, from: &Spot, p: DVec3) -> Spot {
        match from.rail {
            NONE => {
                let place = surface.walk(p, from.place);
                Spot { point: place.point, place: place.triangle, rail: NONE }
            }
            rail => {
                let (point, rail) = surface.walk_border(p, rail);
                Spot { point, place: rail / 3, rail }
            }
        }
    }

    /// Puts a node where [`Net::project`] said.
    pub fn put(&mut self, node: usize, spot: Spot) {
        self.points[node] = spot.point;
        self.places[node] = spot.place;
        self.rails[node] = spot.rail;
    }
}

/// Where a node may go.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    pub point: DVec3,
    pub place: u32,
    pub rail: u32,
}

/// Twice the area of a triangle times its normal.
#[inline]
pub fn area_vector([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// Smallest angle of a triangle, in radians.
#[inline]
pub fn smallest_angle([a, b, c]: [DVec3; 3]) -> f64 {
    // The one opposite the shortest edge.
    let (ab, bc, ca) = (b - a, c - b, a - c);
    let (ll_ab, ll_bc, ll_ca) = (ab.length_squared(), bc.length_squared(), ca.length_squared());
    let dot = if ll_ab <= ll_bc && ll_ab <= ll_ca {
        -bc.dot(ca)
    } else if ll_bc <= ll_ca {
        -ca.dot(ab)
    } else {
        -ab.dot(bc)
    };
    ab.cross(bc).length().atan2(dot)
}

/// Triangles around each node: corners `3 t + k` of node v are `corners[starts[v]..starts[v + 1]]`.
pub struct Stars {
    pub starts: Vec<u32>,
    pub corners: Vec<u32>,
}

impl Stars {
    pub fn of(triangles: &[[u32; 3]], nodes: usize) -> Self {
        let mut starts = vec![0_u32; nodes + 1];
        for &v in triangles.iter().flatten() {
            starts[v as usize + 1] += 1;
        }
        for v in 0..nodes {
            starts[v + 1] += starts[v];
        }
        let mut corners = vec![0; 3 * triangles.len()];
        let mut fill = starts.clone();
        for (t, triangle) in triangles.iter().enumerate() {
            for (k, &v) in triangle.iter().enumerate() {
                corners[fill[v as usize] as usize] = (3 * t + k) as u32;
                fill[v as usize] += 1;
            }
        }
        Stars { starts, corners }
    }

    #[inline]
    pub fn around(&self, v: usize) -> &[u32] {
        &self.corners[self.starts[v] as usize..self.starts[v + 1] as usize]
    }
}
