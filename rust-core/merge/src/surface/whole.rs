//! The surface of all tiles as it is put together: what is kept of the tiles, what is added and changed where holes are closed, and
//! windows of that as surfaces of their own.

use std::collections::BTreeMap;

use rustc_hash::{FxHashMap, FxHashSet};

use super::extract::{Case, Row, Surface};
use super::numbering::{GONE, NONE, Numbered, Numbers};
use super::parts::Chosen;
use super::tile::Tiles;
use base::error::Result;
use base::progress::Progress;
use glam::DVec3;
use mesh::holes::{self, Bounds};

/// A triangle's corner: number, place, colour.
type Corner = (u64, DVec3, [u8; 4]);
/// A triangle's corners.
pub type Corners = [Corner; 3];

/// The whole surface.
pub struct Whole<T> {
    pub tiles: T,
    pub chosen: Chosen,
    pub numbers: Numbers,
    /// The box around each tile's vertices, those of other tiles among them.
    pub boxes: Vec<Bounds>,
    /// The part that was added: its vertices and triangles follow those of the tiles. Without the corners of the triangles ...
    pub added: Surface,
    /// ... which are numbers of all vertices.
    pub corners: Vec<[u64; 3]>,
    /// Vertices of tiles that triangles that were added have, as they are there, by their numbers.
    pub rims: BTreeMap<u64, Row>,
    /// The parts of the surface, the added among it, that are not as they were.
    pub changes: Changes,
}

/// Changes of vertices and triangles, by their numbers.
#[derive(Default)]
pub struct Changes {
    /// Vertices that lie elsewhere, and whether they are on a scan still.
    pub moved: FxHashMap<u64, (DVec3, i32)>,
    /// Triangles that are gone.
    pub removed: FxHashSet<u64>,
    /// Triangles with other corners.
    pub renamed: FxHashMap<u64, [u64; 3]>,
    /// Vertices without a triangle, rising.
    pub bare: Vec<u64>,
}

/// Some of the surface.
#[derive(Default)]
pub struct Window {
    /// It as a surface, without its boundary.
    pub surface: Surface,
    /// Numbers of its vertices, rising.
    pub vertices: Vec<u64>,
    /// Numbers of its triangles, rising.
    pub triangles: Vec<u64>,
    /// Parts of its vertices. [`NONE`] of those that were added.
    pub part_of: Vec<u32>,
}

impl<T: Tiles> Whole<T> {
    /// The chosen part of the tiles.
    ///
    /// # Errors
    /// A tile can't be read. Cancelled.
    pub fn new(tiles: T, chosen: Chosen, progress: &Progress<'_>) -> Result<Self> {
        let numbers = Numbers::new(&tiles, &chosen, progress)?;
        let bounds = |tile: usize| Ok(Bounds::of(tiles.positions(tile)?.iter().copied()));
        let boxes = (0..tiles.count()).map(bounds).collect::<Result<_>>()?;
        let (added, corners, rims, changes) = Default::default();
        Ok(Whole { tiles, chosen, numbers, boxes, added, corners, rims, changes })
    }

    /// A tile with its numbers.
    pub fn tile(&self, i: usize) -> Result<Numbered<'_>> {
        Ok(self.numbers.of_tile(i, self.tiles.get(i)?, &self.chosen))
    }

    /// Vertices of tiles and those that were added.
    pub fn vertices(&self) -> u64 {
        self.numbers.vertices + self.added.positions.len() as u64
    }

    /// Triangles of tiles and those that were added.
    pub fn triangles(&self) -> u64 {
        self.numbers.triangles + self.corners.len() as u64
    }

    /// The longest side of the boxes of triangles that were added.
    pub fn longest_added(&self) -> f64 {
        let known = self.numbers.vertices;
        let place = |v: u64| match v.checked_sub(known) {
            Some(added) => self.added.positions[added as usize],
            None => self.rims[&v].position,
        };
        let size = |t: &[u64; 3]| {
            let bounds = Bounds::of(t.map(place));
            (bounds.max - bounds.min).max_element()
        };
        self.corners.iter().map(size).fold(0.0, f64::max)
    }

    /// The triangles whose boxes meet any of these regions.
    ///
    /// # Errors
    /// A tile can't be read. Cancelled.
    pub fn window(&self, regions: &[Bounds], progress: &Progress<'_>) -> Result<Window> {
        let mut found = Gathered::default();
        for (i, bounds) in self.boxes.iter().enumerate() {
            let regions: Vec<Bounds> = regions.iter().filter(|region| region.meets(bounds)).copied().collect();
            if regions.is_empty() {
                continue;
            }
            let numbered = self.tile(i)?;
            let tile = &numbered.tile;
            let surface = &tile.surface;
            let near = holes::near(&surface.positions, &surface.triangles, &regions, progress)?;
            let mut near: Vec<u32> = near.concat();
            near.sort_unstable();
            near.dedup();
            for t in near.into_iter().map(|t| t as usize) {
                let Some(number) = numbered.triangle(t) else { continue };
                let part = |v: usize| self.chosen.part(i, tile.part_of[v]);
                found.add(surface, t, number, |v| numbered.vertex(v), part);
            }
        }
        let known = self.numbers.vertices;
        if !self.corners.is_empty() {
            // The added triangles among the vertices that they have.
            let mut surface = Surface::default();
            self.rims.values().for_each(|&row| surface.push(row));
            surface.append_vertices(&self.added, 0..self.added.positions.len());
            let rim: Vec<u64> = self.rims.keys().copied().collect();
            let local = |v: u64| match v.checked_sub(known) {
                Some(added) => (rim.len() as u64 + added) as u32,
                None => rim.partition_point(|&other| other < v) as u32,
            };
            surface.triangles = self.corners.iter().map(|t| t.map(local)).collect();
            surface.cases = self.added.cases.clone();
            let vertices: Vec<u64> = rim.iter().copied().chain(known..self.vertices()).collect();
            let near = holes::near(&surface.positions, &surface.triangles, regions, progress)?;
            let mut near: Vec<u32> = near.concat();
            near.sort_unstable();
            near.dedup();
            for t in near {
                let number = self.numbers.triangles + u64::from(t);
                found.add(&surface, t as usize, number, |v| vertices[v], |_| NONE);
            }
        }
        Ok(found.into_window())
    }
}

impl<T: Tiles> Whole<T> {
    /// Calls `each` with the corners of every triangle.
    ///
    /// # Errors
    /// A tile can't be read. Cancelled.
    pub fn each_triangle(&self, progress: &Progress<'_>, mut each: impl FnMut(Corners)) -> Result<()> {
        for i in 0..self.tiles.count() {
            progress.check()?;
            let numbered = self.tile(i)?;
            self.triangles_of(&numbered).for_each(|(_, corners, _)| each(corners));
        }
        self.added_triangles().for_each(|(_, corners, _)| each(corners));
        Ok(())
    }

    /// The triangles of a tile that are there still: numbers, rising in each brick, corners and cases.
    pub fn triangles_of<'a>(&'a self, of: &'a Numbered<'_>) -> impl Iterator<Item = (u64, Corners, Case)> + 'a {
        let surface = &of.tile.surface;
        let corner = |v: u32| {
            let (v, number) = (v as usize, of.vertex(v as usize));
            self.corner(number, surface.positions[v], surface.colour[v])
        };
        let kept = (0..surface.triangles.len()).filter_map(|t| Some((of.triangle(t)?, t)));
        kept.filter(|kept| self.is_there(kept.0)).map(move |(number, t)| {
            let mut corners = surface.triangles[t].map(corner);
            if let Some(renamed) = self.changes.renamed.get(&number) {
                // Other corners are added ones.
                for (corner, &v) in corners.iter_mut().zip(renamed).filter(|(corner, v)| corner.0 != **v) {
                    *corner = self.added_corner(v);
                }
            }
            (number, corners, surface.cases[t])
        })
    }

    /// The triangles that were added and are there still: numbers, rising, corners and cases.
    pub fn added_triangles(&self) -> impl Iterator<Item = (u64, Corners, Case)> + '_ {
        let all = (self.numbers.triangles..).zip(self.corners.iter().zip(&self.added.cases));
        all.filter(|of| self.is_there(of.0)).map(|(number, (corners, &case))| {
            let corners = self.changes.renamed.get(&number).unwrap_or(corners);
            (number, corners.map(|v| self.added_corner(v)), case)
        })
    }

    fn is_there(&self, triangle: u64) -> bool {
        !self.changes.removed.contains(&triangle)
    }

    fn added_corner(&self, v: u64) -> Corner {
        match v.checked_sub(self.numbers.vertices) {
            Some(at) => self.corner(v, self.added.positions[at as usize], self.added.colour[at as usize]),
            None => self.corner(v, self.rims[&v].position, self.rims[&v].colour),
        }
    }

    /// A corner that was at `before`.
    fn corner(&self, v: u64, before: DVec3, colour: [u8; 4]) -> Corner {
        (v, self.changes.moved.get(&v).map_or(before, |moved| moved.0), colour)
    }

    /// Calls `each` with the number, place and colour of every vertex.
    ///
    /// # Errors
    /// A tile can't be read. Cancelled.
    pub fn each_vertex(&self, progress: &Progress<'_>, mut each: impl FnMut(u64, DVec3, [u8; 4])) -> Result<()> {
        let mut call = |v: u64, place: DVec3, colour: [u8; 4]| {
            if self.changes.bare.binary_search(&v).is_err() {
                each(v, self.changes.moved.get(&v).map_or(place, |moved| moved.0), colour);
            }
        };
        for i in 0..self.tiles.count() {
            progress.check()?;
            let numbered = self.tile(i)?;
            let surface = &numbered.tile.surface;
            let kept = (0..numbered.tile.own).map(|v| (v, numbered.vertex(v))).filter(|of| of.1 != GONE);
            kept.for_each(|(v, number)| call(number, surface.positions[v], surface.colour[v]));
        }
        let added = self.added.positions.iter().zip(&self.added.colour);
        (self.numbers.vertices..).zip(added).for_each(|(v, (&place, &colour))| call(v, place, colour));
        Ok(())
    }
}

/// Triangles with their vertices, as they are found.
#[derive(Default)]
struct Gathered {
    surface: Surface,
    place_of: FxHashMap<u64, u32>,
    vertices: Vec<u64>,
    part_of: Vec<u32>,
    triangles: Vec<u64>,
}

impl Gathered {
    fn add(
        &mut self,
        surface: &Surface,
        t: usize,
        number: u64,
        vertex: impl Fn(usize) -> u64,
        part: impl Fn(usize) -> u32,
    ) {
        let corners = surface.triangles[t].map(|v| {
            let v = v as usize;
            let next = self.vertices.len() as u32;
            let place = *self.place_of.entry(vertex(v)).or_insert(next);
            if place == next {
                self.vertices.push(vertex(v));
                self.part_of.push(part(v));
                self.surface.push(surface.row(v));
            } else if self.part_of[place as usize] == NONE {
                self.part_of[place as usize] = part(v);
            }
            place
        });
        self.surface.triangles.push(corners);
        self.surface.cases.push(surface.cases[t]);
        self.triangles.push(number);
    }

    /// In the order of the numbers.
    fn into_window(self) -> Window {
        let mut order: Vec<u32> = (0..self.vertices.len() as u32).collect();
        order.sort_unstable_by_key(|&v| self.vertices[v as usize]);
        let mut place = vec![0; order.len()];
        (0..).zip(&order).for_each(|(new, &old)| place[old as usize] = new);
        let mut window = Window::default();
        for &old in &order {
            let old = old as usize;
            window.surface.push(self.surface.row(old));
            window.vertices.push(self.vertices[old]);
            window.part_of.push(self.part_of[old]);
        }
        let mut order: Vec<usize> = (0..self.triangles.len()).collect();
        order.sort_unstable_by_key(|&t| self.triangles[t]);
        for t in order {
            window.surface.triangles.push(self.surface.triangles[t].map(|v| place[v as usize]));
            window.surface.cases.push(self.surface.cases[t]);
            window.triangles.push(self.triangles[t]);
        }
        window
    }
}

impl Window {
    /// Place of a vertex that it has.
    pub fn local(&self, vertex: u64) -> Option<u32> {
        self.vertices.binary_search(&vertex).ok().map(|place| place as u32)
    }
}
