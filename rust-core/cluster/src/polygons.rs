//! Stages 3 and 4: which patches are neighbours, and the polygon of each. \[KMT, sec. 4.1, 4.2\]
//!
//! On a mesh a patch is the part of the surface nearer, along the mesh, to its vertices than to others (their dual cells). So patches are
//! neighbours if they share a mesh edge, three meet in a face whose corners have three labels, and never do four meet in a point. A border
//! of the mesh is a neighbour too: the nodes on it are where two patches meet. Between two of them there is one more on the border of the
//! patch, without which the border would be coarser than the rest.

use std::collections::BTreeMap;

use super::creases::Pieces;
use super::surface::{NONE, Surface};

/// The place of a node of a polygon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PolygonSpot {
    /// A face in which three patches meet.
    Face(u32),
    /// A half-edge on the border, between two patches.
    BorderEdge(u32),
    /// A vertex on the border, amid a patch.
    BorderVertex(u32),
    /// A half-edge along a crease, between two patches.
    Crease(u32),
}

/// The circles around patches, each a cycle of nodes with the patch on its left.
#[derive(Default)]
pub struct Polygons {
    pub spots: Vec<PolygonSpot>,
    /// Nodes of circle c: `nodes[starts[c]..starts[c + 1]]`.
    pub starts: Vec<u32>,
    pub nodes: Vec<u32>,
    /// Patch of each circle. A patch that is a disk has one circle.
    pub patches: Vec<u32>,
}

impl Polygons {
    /// Traces the circles of all patches, with nodes where creases cross them.
    pub fn trace(surface: &Surface, labels: &[u32], pieces: Option<&Pieces<'_>>) -> Self {
        let mut tracer = Tracer {
            surface,
            labels,
            pieces,
            at_crease: BTreeMap::new(),
            at_face: vec![NONE; surface.triangles.len()],
            at_border: vec![NONE; if surface.border_in.iter().any(|&h| h != NONE) { surface.points.len() } else { 0 }],
            done: vec![false; surface.twins.len()],
            polygons: Polygons { starts: vec![0], ..Polygons::default() },
            run: Vec::new(),
        };
        for h in 0..surface.twins.len() as u32 {
            if !tracer.done[h as usize] && tracer.cuts(h) {
                tracer.circle(h);
            }
        }
        tracer.polygons
    }

    /// Nodes of a circle.
    pub fn circle(&self, c: usize) -> &[u32] {
        &self.nodes[self.starts[c] as usize..self.starts[c + 1] as usize]
    }
}

struct Tracer<'a> {
    surface: &'a Surface,
    labels: &'a [u32],
    pieces: Option<&'a Pieces<'a>>,
    /// Node of each edge of a crease between two labels, by its first half-edge.
    at_crease: BTreeMap<u32, u32>,
    /// Node of each face with three labels.
    at_face: Vec<u32>,
    /// Node of each border half-edge between two labels, at the vertex it leaves.
    at_border: Vec<u32>,
    /// Half-edges out of a patch that a circle has passed: one for each patch of a face.
    done: Vec<bool>,
    polygons: Polygons,
    /// Vertices of the border between two nodes.
    run: Vec<u32>,
}

impl Tracer<'_> {
    fn label(&self, v: u32) -> u32 {
        self.labels[v as usize]
    }

    fn cuts(&self, h: u32) -> bool {
        self.label(self.surface.from(h)) != self.label(self.surface.to(h))
    }

    /// Follows the circle that leaves its patch over half-edge `start`.
    fn circle(&mut self, start: u32) {
        let patch = self.label(self.surface.from(start));
        let mut h = start;
        loop {
            self.done[h as usize] = true;
            h = self.cross(h);
            if h == start {
                break;
            }
        }
        self.polygons.patches.push(patch);
        self.polygons.starts.push(self.polygons.nodes.len() as u32);
    }

    /// From a half-edge v -> w out of the patch through its face, and along the border if it leads there, to the next.
    fn cross(&mut self, h: u32) -> u32 {
        let s = self.surface;
        let (v, w) = (s.from(h), s.to(h));
        let x = s.to(Surface::next(h));
        let patch = self.label(v);
        if self.pieces.is_some_and(|p| p.joins(s, self.labels, h)) {
            self.node_at_crease(h);
        }
        // The edge by which the circle leaves the face, as its half-edge in this face, and the patch's end of it.
        let (exit, inner) = if self.label(x) == patch {
            (Surface::next(h), x)
        } else {
            if self.label(x) != self.label(w) {
                self.node_at_face(h / 3);
            }
            (Surface::previous(h), v)
        };
        match s.twins[exit as usize] {
            NONE => self.along_border(exit, inner),
            twin => twin,
        }
    }

    /// Along the border from half-edge `edge` between two patches to the next such one. `v` is the patch's end of it.
    fn along_border(&mut self, edge: u32, mut v: u32) -> u32 {
        let patch = self.label(v);
        self.node_at_border(edge);
        self.run.clear();
        loop {
            self.run.push(v);
            let h = self.surface.first[v as usize];
            let w = self.surface.to(h);
            if self.label(w) != patch {
                let on_crease = |v: &&u32| self.pieces.is_some_and(|p| p.has(**v, patch));
                let middle = self.run.iter().find(on_crease).unwrap_or(&self.run[self.run.len() / 2]);
                self.polygons.spots.push(PolygonSpot::BorderVertex(*middle));
                self.polygons.nodes.push(self.polygons.spots.len() as u32 - 1);
                self.node_at_border(h);
                return h;
            }
            v = w;
        }
    }

    fn node_at_face(&mut self, t: u32) {
        let node = &mut self.at_face[t as usize];
        if *node == NONE {
            *node = self.polygons.spots.len() as u32;
            self.polygons.spots.push(PolygonSpot::Face(t));
        }
        self.polygons.nodes.push(*node);
    }

    fn node_at_crease(&mut self, h: u32) {
        let first = h.min(self.surface.twins[h as usize]);
        let new = self.polygons.spots.len() as u32;
        let node = *self.at_crease.entry(first).or_insert(new);
        if node == new {
            self.polygons.spots.push(PolygonSpot::Crease(first));
        }
        self.polygons.nodes.push(node);
    }

    fn node_at_border(&mut self, h: u32) {
        let node = &mut self.at_border[self.surface.from(h) as usize];
        if *node == NONE {
            *node = self.polygons.spots.len() as u32;
            self.polygons.spots.push(PolygonSpot::BorderEdge(h));
        }
        self.polygons.nodes.push(*node);
    }
}
