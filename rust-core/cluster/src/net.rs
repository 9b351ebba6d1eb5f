//! The mesh that is being made: nodes that know their place on the surface, and triangles over them.

use glam::DVec3;

use std::sync::Arc;

use super::creases::Creases;
pub use super::surface::{CORNER, area_vector};
use super::surface::{NONE, Place, Surface};
use crate::report::TriangleShapes;
use base::error::Result;
use base::progress::Progress;
use mesh::TriMesh;

/// Nodes and triangles.
#[derive(Clone)]
pub struct Net {
    pub points: Vec<DVec3>,
    /// Triangle of the surface on which each node lies.
    pub places: Vec<u32>,
    /// Half-edge of the surface's border on which a node lies and slides, else `NONE`.
    pub rails: Vec<u32>,
    pub triangles: Vec<[u32; 3]>,
    /// Nodes at corners of the border, which stay where they are. Empty if none does.
    pub held: Vec<bool>,
    /// Half-edge of a crease on which a node lies and slides, `CORNER` at its corner, else `NONE`.
    pub ways: Vec<u32>,
    /// Edges along creases by their ends, the smaller first, in order.
    pub ridges: Vec<[u32; 2]>,
    pub creases: Arc<Creases>,
}

impl Net {
    /// Nodes come with the half-edges of border and crease that they lie on.
    pub fn new(nodes: Vec<(Place, u32, u32)>, triangles: Vec<[u32; 3]>, ridges: Vec<[u32; 2]>) -> Self {
        Net {
            points: nodes.iter().map(|n| n.0.point).collect(),
            places: nodes.iter().map(|n| n.0.triangle).collect(),
            rails: nodes.iter().map(|n| n.1).collect(),
            ways: nodes.iter().map(|n| n.2).collect(),
            triangles,
            held: Vec::new(),
            ridges,
            creases: Arc::default(),
        }
    }

    /// Quality of the triangles, and their angles in steps of 5 degrees.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn shape(&self, progress: &Progress<'_>) -> Result<TriangleShapes> {
        let mesh = TriMesh::new(self.points.clone(), self.triangles.clone());
        TriangleShapes::of(&mesh, progress)
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

    /// Whether a node lies on a crease.
    #[inline]
    pub fn on_crease(&self, node: u32) -> bool {
        self.ways[node as usize] != NONE
    }

    /// Whether a node is held at a corner of the border.
    #[inline]
    pub fn is_held(&self, node: u32) -> bool {
        self.held.get(node as usize).copied().unwrap_or(false)
    }

    /// Whether a node stays where it is.
    #[inline]
    pub fn is_fixed(&self, node: u32) -> bool {
        self.is_held(node) || self.ways[node as usize] == CORNER
    }

    /// Whether the edge between two nodes lies on a crease.
    #[inline]
    pub fn is_ridge(&self, a: u32, b: u32) -> bool {
        self.on_crease(a) && self.on_crease(b) && self.ridges.binary_search(&[a.min(b), a.max(b)]).is_ok()
    }

    /// Lets go of corners and creases.
    pub fn let_go(&mut self) {
        self.held = Vec::new();
        self.ways.fill(NONE);
        self.ridges = Vec::new();
    }

    /// The place of a node.
    pub fn spot(&self, node: u32) -> Spot {
        let v = node as usize;
        Spot { point: self.points[v], place: self.places[v], rail: self.rails[v], way: self.ways[v] }
    }

    /// Gives nodes the numbers in `number`. Those without one have gone.
    pub fn renumber(&mut self, number: &[u32]) {
        let stays = |v: usize| number[v] != NONE;
        let mut v = 0;
        self.points.retain(|_| (stays(v), v += 1).0);
        for of_nodes in [&mut self.places, &mut self.rails, &mut self.ways] {
            v = 0;
            of_nodes.retain(|_| (stays(v), v += 1).0);
        }
    }

    /// The place nearest to `p` to which `node` may go. If it is fixed, that is its own place. Else it is on its border or crease, or on
    /// the surface nearby.
    pub fn project(&self, surface: &Surface, node: usize, p: DVec3) -> Spot {
        let from = self.spot(node as u32);
        if self.is_fixed(node as u32) {
            return from;
        }
        self.project_from(surface, &from, p)
    }

    /// The place nearest to `p` to which a node at `from` may go.
    pub fn project_from(&self, surface: &Surface, from: &Spot, p: DVec3) -> Spot {
        match from.rail {
            NONE if from.way != NONE => {
                let (point, way) = self.creases.walk(surface, p, from.way);
                Spot { point, place: way / 3, rail: NONE, way }
            }
            NONE => {
                let place = surface.walk(p, from.place);
                Spot { point: place.point, place: place.triangle, rail: NONE, way: NONE }
            }
            rail => {
                let (point, rail) = surface.walk_border(p, rail);
                Spot { point, place: rail / 3, rail, way: NONE }
            }
        }
    }

    /// Puts a node where [`Net::project`] said.
    pub fn put(&mut self, node: usize, spot: Spot) {
        self.points[node] = spot.point;
        self.places[node] = spot.place;
        self.rails[node] = spot.rail;
        self.ways[node] = spot.way;
    }
}

/// The size that a net is to have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Size {
    Nodes(usize),
    Triangles(usize),
}

impl Size {
    /// The number of what it counts.
    pub fn count(self) -> usize {
        let (Size::Nodes(n) | Size::Triangles(n)) = self;
        n
    }

    /// The same of another number.
    pub fn of(self, n: usize) -> Size {
        match self {
            Size::Nodes(_) => Size::Nodes(n),
            Size::Triangles(_) => Size::Triangles(n),
        }
    }

    /// The one of two numbers that it counts.
    pub fn choose(self, nodes: usize, triangles: usize) -> usize {
        match self {
            Size::Nodes(_) => nodes,
            Size::Triangles(_) => triangles,
        }
    }

    /// The number that a net has of what it counts.
    pub fn had(self, net: &Net) -> usize {
        self.choose(net.points.len(), net.triangles.len())
    }

    /// Nodes inside the surface by which a net is larger. Each has two triangles: one too many counts as a node.
    pub fn beyond(self, net: &Net) -> usize {
        self.had(net).saturating_sub(self.count()).div_ceil(self.choose(1, 2))
    }

    /// Nodes inside the surface by which a net is smaller.
    pub fn missing(self, net: &Net) -> usize {
        self.count().saturating_sub(self.had(net)) / self.choose(1, 2)
    }
}

/// The place that a node may go to.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    pub point: DVec3,
    pub place: u32,
    pub rail: u32,
    pub way: u32,
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
