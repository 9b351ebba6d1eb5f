//! Hands the surface over, at once where it is one in memory, else tile by tile: where each of its vertices and triangles belongs is
//! known.

use std::sync::Mutex;

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::WRITING;
use crate::colour::{bare_colours, near_colours};
use crate::crossings::scan_order::ScanPlaces;
use crate::surface::extract::{Case, Surface};
use crate::surface::numbering::{GONE, Numbered};
use crate::surface::passes;
use crate::surface::tile::Tiles;
use crate::surface::whole::{Corners, Whole};
use base::error::Result;
use base::progress::Progress;
use glam::DVec3;
use mesh::sink::{MeshOutline, MeshSink};
use mesh::{AttributeData, Crs, Extent};

/// Data of a surface that are told besides.
#[derive(Default)]
pub struct Besides {
    /// Whether any scan has colours.
    pub coloured: bool,
    /// The system that it lies in.
    pub crs: Option<Crs>,
    /// Places of the scans of its vertices in their order.
    pub places: ScanPlaces,
}

/// Figures of the triangles that were handed over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Written {
    /// Their number by case.
    pub faces: [u64; 3],
    /// Length of their shortest side, squared. Whatever their order, it is the same to the bit.
    shortest: f64,
}

impl Default for Written {
    fn default() -> Self {
        Written { faces: [0; 3], shortest: f64::INFINITY }
    }
}

impl Written {
    fn add(&mut self, [a, b, c]: [DVec3; 3], case: Case) {
        self.faces[case as usize] += 1;
        let sides = [a.distance_squared(b), b.distance_squared(c), c.distance_squared(a)];
        self.shortest = sides.into_iter().fold(self.shortest, f64::min);
    }

    fn and(self, other: Written) -> Written {
        let faces = [0, 1, 2].map(|case| self.faces[case] + other.faces[case]);
        Written { faces, shortest: self.shortest.min(other.shortest) }
    }

    /// Length of their shortest side.
    pub fn shortest_edge(&self) -> f64 {
        self.shortest.sqrt()
    }
}

/// Writes the surface, with colours if any scan has them: vertices that no scan has a colour of take one of those beside them.
///
/// # Errors
/// A tile can't be read. The sink's. Cancelled.
pub fn write<T: Tiles>(
    mut whole: Whole<T>,
    besides: Besides,
    sink: &mut dyn MeshSink,
    progress: &Progress<'_>,
) -> Result<Written> {
    progress.stage(WRITING, whole.tiles.count() as u64);
    if let Some(mut surface) = whole.take_surface(progress)? {
        if besides.coloured {
            near_colours::fill_in(&mut surface, progress)?;
        }
        return at_once(surface, besides, sink, progress);
    }
    let colours = if besides.coloured { Some(bare_colours::fill_in(&whole, progress)?) } else { None };
    in_pieces(&whole, colours.as_ref(), besides, sink, progress)
}

fn at_once(
    mut surface: Surface,
    Besides { coloured, crs, places }: Besides,
    sink: &mut dyn MeshSink,
    progress: &Progress<'_>,
) -> Result<Written> {
    let mut written = Written::default();
    passes::each(surface.cases.len(), progress, |t| {
        written.add(surface.triangles[t].map(|v| surface.positions[v as usize]), surface.cases[t]);
    })?;
    passes::each(surface.scan.len(), progress, |v| surface.scan[v] = places.told(surface.scan[v]))?;
    let mut mesh = surface.into_mesh(coloured, progress)?;
    mesh.crs = crs;
    sink.whole(mesh, progress)?;
    Ok(written)
}

/// `colours` are those of vertices that no scan has a colour of. Nothing where no scan has any.
fn in_pieces<T: Tiles>(
    whole: &Whole<T>,
    colours: Option<&FxHashMap<u64, [u8; 4]>>,
    Besides { crs, places, .. }: Besides,
    sink: &mut dyn MeshSink,
    progress: &Progress<'_>,
) -> Result<Written> {
    let mut removed: Vec<u64> = whole.changes.removed.iter().copied().collect();
    removed.sort_unstable();
    let out = Out { whole, colours, places, removed, sink: Mutex::new(sink) };
    let mut extent = Extent::default();
    whole.each_vertex(progress, |_, place, _| extent.add(place))?;
    let outline = MeshOutline {
        vertices: whole.vertices() - whole.changes.bare.len() as u64,
        triangles: whole.triangles() - out.removed.len() as u64,
        extent,
        crs,
        ..Surface::default().into_mesh(colours.is_some(), progress)?.outline()
    };
    out.to_sink(|sink| sink.begin(&outline))?;
    let tile = |i: usize| {
        progress.advance(1)?;
        out.tile(&whole.tile(i)?)
    };
    let written = (0..whole.tiles.count()).into_par_iter().with_max_len(1).map(tile).collect::<Result<Vec<_>>>()?;
    let added = out.added()?;
    Ok(written.into_iter().fold(added, Written::and))
}

struct Out<'a, T> {
    whole: &'a Whole<T>,
    colours: Option<&'a FxHashMap<u64, [u8; 4]>>,
    places: ScanPlaces,
    /// Triangles that are gone, rising.
    removed: Vec<u64>,
    sink: Mutex<&'a mut dyn MeshSink>,
}

/// Triangles whose numbers follow each other, as they are found.
#[derive(Default)]
struct Run {
    /// Number of the first.
    first: u64,
    triangles: Vec<[u64; 3]>,
    /// Whether they fill holes.
    fills: Vec<bool>,
}

impl Run {
    /// The number that follows.
    fn next(&self) -> u64 {
        self.first + self.triangles.len() as u64
    }
}

impl<T: Tiles> Out<'_, T> {
    fn to_sink(&self, call: impl FnOnce(&mut dyn MeshSink) -> Result<()>) -> Result<()> {
        call(&mut **self.sink.lock().unwrap_or_else(std::sync::PoisonError::into_inner))
    }

    /// Number of a vertex if those without a triangle are left out.
    fn vertex(&self, v: u64) -> u64 {
        v - self.whole.changes.bare.partition_point(|&bare| bare < v) as u64
    }

    fn tile(&self, numbered: &Numbered<'_>) -> Result<Written> {
        let tile = &numbered.tile;
        let own: Vec<(usize, u64)> = (0..tile.own).map(|v| (v, numbered.vertex(v))).filter(|of| of.1 != GONE).collect();
        for run in own.chunk_by(|a, b| a.1 + 1 == b.1) {
            self.vertices(&tile.surface, run.iter().copied())?;
        }
        self.triangles(self.whole.triangles_of(numbered))
    }

    fn added(&self) -> Result<Written> {
        let Whole { added, numbers, .. } = self.whole;
        self.vertices(added, (0..added.positions.len()).zip(numbers.vertices..))?;
        self.triangles(self.whole.added_triangles())
    }

    /// Hands over vertices of a surface, with their numbers, which follow each other.
    fn vertices(&self, surface: &Surface, list: impl Iterator<Item = (usize, u64)>) -> Result<()> {
        let changes = &self.whole.changes;
        let list: Vec<(usize, u64)> = list.filter(|v| changes.bare.binary_search(&v.1).is_err()).collect();
        let Some(&(_, first)) = list.first() else { return Ok(()) };
        let moved = |v: u64| changes.moved.get(&v);
        let positions: Vec<_> =
            list.iter().map(|&(at, v)| moved(v).map_or(surface.positions[at], |moved| moved.0)).collect();
        let scan = |&(at, v): &(usize, u64)| moved(v).map_or(surface.scan[at], |moved| moved.1);
        let scan: Vec<i32> = list.iter().map(|of| self.places.told(scan(of))).collect();
        let mut attributes = vec![
            AttributeData::F32(list.iter().map(|&(at, _)| surface.confidence[at]).collect()),
            AttributeData::F32(list.iter().map(|&(at, _)| surface.noise[at]).collect()),
            AttributeData::I32(scan.clone()),
            AttributeData::Bool(scan.iter().map(|&scan| scan < 0).collect()),
        ];
        if let Some(colours) = self.colours {
            let colour = |&(at, v): &(usize, u64)| colours.get(&v).copied().unwrap_or(surface.colour[at]);
            attributes.push(AttributeData::Colour(list.iter().map(colour).collect()));
        }
        self.to_sink(|sink| sink.vertices(self.vertex(first), &positions, &attributes))
    }

    /// Hands over triangles: those that follow each other, together.
    fn triangles(&self, list: impl Iterator<Item = (u64, Corners, Case)>) -> Result<Written> {
        let (mut written, mut run) = (Written::default(), Run::default());
        for (t, corners, case) in list {
            let number = t - self.removed.partition_point(|&removed| removed < t) as u64;
            if run.next() != number {
                self.hand_over(std::mem::take(&mut run))?;
                run.first = number;
            }
            run.triangles.push(corners.map(|corner| self.vertex(corner.0)));
            run.fills.push(case == Case::Fill);
            written.add(corners.map(|corner| corner.1), case);
        }
        self.hand_over(run)?;
        Ok(written)
    }

    fn hand_over(&self, Run { first, triangles, fills }: Run) -> Result<()> {
        if triangles.is_empty() {
            return Ok(());
        }
        self.to_sink(|sink| sink.triangles(first, &triangles, &[AttributeData::Bool(fills)]))
    }
}

#[cfg(test)]
mod tests;
