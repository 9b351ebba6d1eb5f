//! Stage 6: vertices and triangles of the valid cells. [MI04, sec. 3.3]
//!
//! A vertex's number is its brick's first number, plus the vertices in the rows before, plus the bits before it in its row. So no table of
//! vertices is needed, and bricks write their parts of the mesh independently.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::anomalies::{BrickSurface, gather};
use super::passes;
use super::table::{EDGE_CORNERS, INTERIOR, Table, table};
use crate::crossings::lattice::{BRICK, BRICK_BITS, Lattice, row};
use crate::field::Vertices;
use base::error::{Error, Result};
use base::progress::Progress;
use mesh::holes::HoleReport;
use mesh::srgb::Mix;
use mesh::{Attribute, TriMesh};

/// A vertex that no crossing of its line gives a place: its edge, by axis and lower node.
#[derive(Clone, Copy, Debug)]
pub struct Artificial {
    /// Number of the vertex.
    pub vertex: u32,
    /// Axis of its edge.
    pub axis: u8,
    /// Lower node of its edge.
    pub node: [i32; 3],
    /// Whether its place is known: votes of other lines gave it.
    pub is_placed: bool,
}

/// Vertices of several edges of a node that are nearer to it are moved to this distance, in cells. So no side of a triangle of the surface
/// is shorter, and all stay distinct in single precision.
pub const APART: f64 = 1.0 / 96.0;

/// A vertex that lies in a node, or nearer to it than [`APART`].
#[derive(Clone, Copy, Debug)]
pub struct AtNode {
    /// Number of the vertex.
    pub vertex: u32,
    /// Axis of its edge.
    pub axis: u8,
    /// The node.
    pub node: [i32; 3],
    /// Whether the edge leads upward from the node.
    pub upward: bool,
}

/// The surface of all valid cells, before holes are closed.
#[derive(Clone, Default)]
pub struct Surface {
    /// Vertices in the world.
    pub positions: Vec<DVec3>,
    /// Trust, summed over the scans at the vertex.
    pub confidence: Vec<f32>,
    /// Standard deviation of the samples here along their rays, world units. 0: clean.
    pub noise: Vec<f32>,
    /// sRGB with straight alpha: 0 where no scan has a colour.
    pub colour: Vec<[u8; 4]>,
    /// Scan of largest weight, -1 for vertices that lie on no scan exactly: artificial ones, and those moved out of nodes.
    pub scan: Vec<i32>,
    /// Triangles, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Sides of triangles that have no second triangle, in the direction of their triangle.
    pub boundary: Vec<[u32; 2]>,
    /// Case of each triangle: how it came to be.
    pub cases: Vec<Case>,
}

/// Data of a vertex of a [`Surface`].
#[derive(Clone, Copy)]
pub struct Row {
    pub position: DVec3,
    pub confidence: f32,
    pub noise: f32,
    pub colour: [u8; 4],
    pub scan: i32,
}

impl Surface {
    /// Data of a vertex.
    pub fn row(&self, v: usize) -> Row {
        let (position, confidence, noise) = (self.positions[v], self.confidence[v], self.noise[v]);
        Row { position, confidence, noise, colour: self.colour[v], scan: self.scan[v] }
    }

    /// Appends a vertex.
    pub fn push(&mut self, Row { position, confidence, noise, colour, scan }: Row) {
        self.positions.push(position);
        self.confidence.push(confidence);
        self.noise.push(noise);
        self.colour.push(colour);
        self.scan.push(scan);
    }

    /// Bytes held by vertices and triangles.
    pub fn bytes(&self) -> u64 {
        let vertex = size_of::<DVec3>() + 2 * size_of::<f32>() + size_of::<[u8; 4]>() + size_of::<i32>();
        (self.positions.len() * vertex + self.triangles.len() * size_of::<[u32; 3]>()) as u64
    }

    /// Appends vertices of another surface.
    pub fn append_vertices(&mut self, other: &Surface, range: Range<usize>) {
        self.positions.extend_from_slice(&other.positions[range.clone()]);
        self.confidence.extend_from_slice(&other.confidence[range.clone()]);
        self.noise.extend_from_slice(&other.noise[range.clone()]);
        self.colour.extend_from_slice(&other.colour[range.clone()]);
        self.scan.extend_from_slice(&other.scan[range]);
    }

    /// Takes in the vertices and triangles that hole closing has appended: attributes are the mean of the vertices that
    /// each new one comes from.
    pub fn adopt_fill(&mut self, holes: &HoleReport) {
        let more = holes.sources.len();
        self.confidence.reserve_exact(more);
        self.noise.reserve_exact(more);
        self.colour.reserve_exact(more);
        self.scan.reserve_exact(more);
        self.cases.reserve_exact(self.triangles.len() - self.cases.len());
        for sources in &holes.sources {
            let sources = sources.map(|v| v as usize);
            let sum: f64 = sources.iter().map(|&v| f64::from(self.confidence[v])).sum();
            self.confidence.push((sum / 3.0) as f32);
            self.noise.push(sources.iter().map(|&v| self.noise[v]).sum::<f32>() / 3.0);
            let mut colour = Mix::default();
            sources.iter().for_each(|&v| colour.add(self.colour[v], 1));
            self.colour.push(colour.colour());
            self.scan.push(-1);
        }
        self.cases.resize(self.triangles.len(), Case::Fill);
    }

    /// The mesh with its attributes.
    ///
    /// # Errors
    /// Cancelled.
    pub fn into_mesh(self, coloured: bool, progress: &Progress<'_>) -> Result<TriMesh> {
        let hole_fill = passes::made(self.cases.len(), progress, |t| self.cases[t] == Case::Fill)?;
        let interpolated = passes::made(self.scan.len(), progress, |v| self.scan[v] < 0)?;
        let mut mesh = TriMesh::new(self.positions, self.triangles);
        mesh.vertex_attributes = vec![
            Attribute::f32("confidence", self.confidence),
            Attribute::f32("noise", self.noise),
            Attribute::i32("source_scan", self.scan),
            Attribute::bool("interpolated", interpolated),
        ];
        if coloured {
            mesh.vertex_attributes.push(Attribute::colour("colour", self.colour));
        }
        mesh.face_attributes = vec![Attribute::bool("hole_fill", hole_fill)];
        Ok(mesh)
    }
}

/// The surface of some bricks before it is changed, and what has to be.
pub struct Extracted {
    /// Vertices and triangles brick by brick.
    pub surface: Surface,
    /// Vertices without a crossing.
    pub artificial: Vec<Artificial>,
    /// Vertices in nodes.
    pub at_nodes: Vec<AtNode>,
    /// Sides of the boundary that each brick's triangles have.
    pub sides: Vec<u32>,
}

/// Case of a triangle: the cases a, b and c of the paper's Table 2.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Case {
    /// Made directly from the crossings of its cell.
    #[default]
    Direct,
    /// Its cell was settled by its neighbours.
    Settled,
    /// Fills a hole.
    Fill,
}

impl Case {
    /// By number.
    pub const ALL: [Case; 3] = [Case::Direct, Case::Settled, Case::Fill];
}

/// One brick's part of the surface to write.
struct Part<'a> {
    surface: &'a BrickSurface,
    first_vertex: u32,
    positions: &'a mut [DVec3],
    confidence: &'a mut [f32],
    noise: &'a mut [f32],
    colour: &'a mut [[u8; 4]],
    scan: &'a mut [i32],
    triangles: &'a mut [[u32; 3]],
    cases: &'a mut [Case],
}

/// Edge of a cell: axis and offset of its lower node from the cell's lowest corner.
const EDGE_AT: [(usize, [i32; 3]); 12] = {
    let mut at = [(0, [0; 3]); 12];
    let mut e = 0;
    while e < 12 {
        let corner = EDGE_CORNERS[e][0] as i32;
        at[e] = (e / 4, [corner & 1, corner >> 1 & 1, corner >> 2]);
        e += 1;
    }
    at
};

/// The neighbouring cell across each face.
const ACROSS_FACE: [[i32; 3]; 6] = [[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]];

/// All bricks with the number of their first vertex.
struct Bricks<'a> {
    list: &'a [Box<BrickSurface>],
    first_vertex: Vec<u32>,
    index: FxHashMap<[i32; 3], u32>,
}

impl Bricks<'_> {
    fn at(&self, brick: [i32; 3]) -> Option<(&BrickSurface, u32)> {
        self.index.get(&brick).map(|&i| (&*self.list[i as usize], self.first_vertex[i as usize]))
    }
}

/// Counts the triangles of a brick. `inside` of its upper neighbours is needed for the cells on its upper faces.
///
/// # Errors
/// Cancelled.
pub fn count_triangles(bricks: &mut [Box<BrickSurface>], progress: &Progress<'_>) -> Result<()> {
    let index: FxHashMap<[i32; 3], u32> = bricks.iter().enumerate().map(|(i, b)| (b.brick, i as u32)).collect();
    let table = table();
    let counts: Vec<u32> = bricks
        .par_iter()
        .map(|surface| {
            progress.check()?;
            let inside = corner_rows(surface, |brick| index.get(&brick).map(|&i| &bricks[i as usize].inside));
            let mut count = 0;
            for_each_cell(surface, |cell| count += table.count(configuration(&inside, cell)) as u32);
            Ok(count)
        })
        .collect::<Result<_>>()?;
    for (surface, count) in bricks.iter_mut().zip(counts) {
        surface.triangles = count;
    }
    Ok(())
}

const CORNER_WIDTH: usize = BRICK as usize + 2;
type CornerRows = [u64; CORNER_WIDTH * CORNER_WIDTH];

/// Rows of a brick with a margin of one.
fn corner_rows<'a>(surface: &BrickSurface, plane: impl Fn([i32; 3]) -> Option<&'a [u32; 1024]>) -> Box<CornerRows> {
    let mut rows = Box::new([0; CORNER_WIDTH * CORNER_WIDTH]);
    let b = surface.brick;
    gather(1, &mut rows[..], CORNER_WIDTH, |at| plane([b[0] + at[0], b[1] + at[1], b[2] + at[2]]));
    rows
}

fn for_each_cell(surface: &BrickSurface, mut each: impl FnMut([i32; 3])) {
    for z in 0..BRICK {
        for y in 0..BRICK {
            let mut bits = surface.valid[row(y, z)];
            while bits != 0 {
                each([bits.trailing_zeros() as i32, y, z]);
                bits &= bits - 1;
            }
        }
    }
}

#[inline]
fn configuration(inside: &CornerRows, [x, y, z]: [i32; 3]) -> u8 {
    let at = (z as usize + 1) * CORNER_WIDTH + y as usize + 1;
    let pair = |i: usize| (inside[i] >> (x + 1) & 3) as u8;
    pair(at) | pair(at + 1) << 2 | pair(at + CORNER_WIDTH) << 4 | pair(at + CORNER_WIDTH + 1) << 6
}

/// Writes the mesh of these bricks, which are in order.
///
/// # Errors
/// Cancelled.
pub fn extract(
    bricks: &mut [Box<BrickSurface>],
    found: &FxHashMap<[i32; 3], Vertices>,
    lattice: &Lattice,
    progress: &Progress<'_>,
) -> Result<Extracted> {
    count_triangles(bricks, progress)?;
    let mut first_vertex = Vec::with_capacity(bricks.len());
    let (mut vertices, mut triangles) = (0_usize, 0_usize);
    for surface in bricks.iter() {
        first_vertex.push(vertices as u32);
        vertices += surface.vertices as usize;
        triangles += surface.triangles as usize;
    }
    refuse_many(vertices as u64)?;
    let index = bricks.iter().enumerate().map(|(i, b)| (b.brick, i as u32)).collect();
    let bricks = Bricks { list: bricks, first_vertex, index };
    let mut surface = Surface {
        positions: passes::filled(DVec3::ZERO, vertices, progress)?,
        confidence: vec![0.0; vertices],
        noise: vec![0.0; vertices],
        colour: passes::filled([0; 4], vertices, progress)?,
        scan: passes::filled(-1, vertices, progress)?,
        triangles: vec![[0; 3]; triangles],
        cases: passes::filled(Case::Direct, triangles, progress)?,
        ..Surface::default()
    };
    let parts = split(&bricks, &mut surface);
    let table = table();
    let rest = parts
        .into_par_iter()
        .map(|mut part| {
            progress.advance(1)?;
            let (artificial, at_nodes) = part.place_vertices(found.get(&part.surface.brick), lattice);
            Ok((artificial, at_nodes, part.write_triangles(&bricks, &table)))
        })
        .collect::<Result<Vec<_>>>()?;
    let mut extracted = Extracted { surface, artificial: Vec::new(), at_nodes: Vec::new(), sides: Vec::new() };
    for (artificial, at_nodes, boundary) in rest {
        progress.check()?;
        extracted.artificial.extend(artificial);
        extracted.at_nodes.extend(at_nodes);
        extracted.sides.push(boundary.len() as u32);
        extracted.surface.boundary.extend(boundary);
    }
    Ok(extracted)
}

/// Refuses more vertices than a surface in memory has numbers for.
///
/// # Errors
/// [`Error::OutOfMemory`].
pub fn refuse_many(vertices: u64) -> Result<()> {
    match u32::try_from(vertices) {
        Ok(_) => Ok(()),
        Err(_) => Err(Error::OutOfMemory(format!(
            "the surface would have {vertices} vertices, more than 2^32: choose a larger voxel"
        ))),
    }
}

fn split<'a>(bricks: &'a Bricks<'a>, surface: &'a mut Surface) -> Vec<Part<'a>> {
    fn cut<'a, T>(rest: &mut &'a mut [T], count: u32) -> &'a mut [T] {
        let (head, tail) = std::mem::take(rest).split_at_mut(count as usize);
        *rest = tail;
        head
    }
    let (mut positions, mut confidence) = (&mut surface.positions[..], &mut surface.confidence[..]);
    let mut noise = &mut surface.noise[..];
    let (mut colour, mut scan) = (&mut surface.colour[..], &mut surface.scan[..]);
    let (mut triangles, mut cases) = (&mut surface.triangles[..], &mut surface.cases[..]);
    (bricks.list.iter().zip(&bricks.first_vertex))
        .map(|(surface, &first_vertex)| Part {
            surface,
            first_vertex,
            positions: cut(&mut positions, surface.vertices),
            confidence: cut(&mut confidence, surface.vertices),
            noise: cut(&mut noise, surface.vertices),
            colour: cut(&mut colour, surface.vertices),
            scan: cut(&mut scan, surface.vertices),
            triangles: cut(&mut triangles, surface.triangles),
            cases: cut(&mut cases, surface.triangles),
        })
        .collect()
}

impl Part<'_> {
    /// Places the vertices. Returns those whose edges have no fitting crossing, placed at the middle for now, and those that lie in nodes.
    fn place_vertices(&mut self, vertices: Option<&Vertices>, lattice: &Lattice) -> (Vec<Artificial>, Vec<AtNode>) {
        let surface = self.surface;
        let first_node = surface.brick.map(|b| b << BRICK_BITS);
        let mut placed = vec![false; surface.vertices as usize];
        let (mut artificial, mut at_nodes) = (Vec::new(), Vec::new());
        for axis in 0..3 {
            for vertex in vertices.map_or(&[][..], |vertices| &vertices[axis]) {
                let at = [0, 1, 2].map(|i| i32::from(vertex.node) >> (BRICK_BITS * i) & (BRICK - 1));
                let row = row(at[1], at[2]);
                let bit = 1_u32 << at[0];
                let used = surface.used[axis][row];
                // The lower node of an edge where the line enters the object is outside.
                if used & bit == 0 || vertex.enters == (surface.inside[row] & bit != 0) {
                    continue;
                }
                let slot = (surface.before[axis][row] + (used & (bit - 1)).count_ones()) as usize;
                let node = [0, 1, 2].map(|i| first_node[i] + at[i]);
                self.positions[slot] = lattice.world(node, axis, f64::from(vertex.fraction));
                placed[slot] = true;
                if vertex.scan < 0 {
                    let vertex = self.first_vertex + slot as u32;
                    artificial.push(Artificial { vertex, axis: axis as u8, node, is_placed: true });
                } else {
                    self.confidence[slot] = vertex.weight;
                    self.noise[slot] = (f64::from(vertex.noise) * lattice.voxel) as f32;
                    self.colour[slot] = vertex.colour;
                    self.scan[slot] = vertex.scan;
                }
                let upward = vertex.fraction < 0.5;
                if vertex.fraction.min(1.0 - vertex.fraction) < APART as f32 {
                    let mut node = node;
                    node[axis] += i32::from(!upward);
                    at_nodes.push(AtNode { vertex: self.first_vertex + slot as u32, axis: axis as u8, node, upward });
                }
            }
        }
        for axis in 0..3 {
            for z in 0..BRICK {
                for y in 0..BRICK {
                    let row = row(y, z);
                    let mut bits = surface.used[axis][row];
                    let mut slot = surface.before[axis][row] as usize;
                    while bits != 0 {
                        if !placed[slot] {
                            let at = [bits.trailing_zeros() as i32, y, z];
                            let node = [0, 1, 2].map(|i| first_node[i] + at[i]);
                            self.positions[slot] = lattice.world(node, axis, 0.5);
                            artificial.push(Artificial {
                                vertex: self.first_vertex + slot as u32,
                                axis: axis as u8,
                                node,
                                is_placed: false,
                            });
                        }
                        bits &= bits - 1;
                        slot += 1;
                    }
                }
            }
        }
        (artificial, at_nodes)
    }

    /// Writes the triangles. Returns the sides without a second triangle.
    fn write_triangles(&mut self, bricks: &Bricks<'_>, table: &Table) -> Vec<[u32; 2]> {
        let surface = self.surface;
        let inside = corner_rows(surface, |b| bricks.at(b).map(|s| &s.0.inside));
        let valid = corner_rows(surface, |b| bricks.at(b).map(|s| &s.0.valid));
        let b = surface.brick;
        let upper: Vec<_> = (0..8).map(|i| bricks.at([b[0] + (i & 1), b[1] + (i >> 1 & 1), b[2] + (i >> 2)])).collect();
        let vertex = |cell: [i32; 3], edge: u8| {
            let (axis, offset) = EDGE_AT[edge as usize];
            let at = [0, 1, 2].map(|i| cell[i] + offset[i]);
            let owner = (at[0] >> BRICK_BITS) | (at[1] >> BRICK_BITS) << 1 | (at[2] >> BRICK_BITS) << 2;
            let (owner, first) = upper[owner as usize].expect("an edge of a valid cell has a vertex");
            let row = row(at[1], at[2]);
            let below = (1_u32 << (at[0] & (BRICK - 1))) - 1;
            first + owner.before[axis][row] + (owner.used[axis][row] & below).count_ones()
        };
        let mut boundary = Vec::new();
        let mut next = 0;
        for_each_cell(surface, |cell| {
            let triangles = table.triangles(configuration(&inside, cell));
            if surface.settled[row(cell[1], cell[2])] >> cell[0] & 1 != 0 {
                self.cases[next..next + triangles.len()].fill(Case::Settled);
            }
            for triangle in triangles {
                let corners = triangle.edges.map(|edge| vertex(cell, edge));
                self.triangles[next] = corners;
                next += 1;
                for side in 0..3 {
                    let face = triangle.faces[side];
                    if face == INTERIOR {
                        continue;
                    }
                    let step = ACROSS_FACE[face as usize];
                    let [x, y, z] = [0, 1, 2].map(|i| (cell[i] + step[i] + 1) as usize);
                    if valid[z * CORNER_WIDTH + y] >> x & 1 == 0 {
                        boundary.push([corners[side], corners[(side + 1) % 3]]);
                    }
                }
            }
        });
        boundary
    }
}
