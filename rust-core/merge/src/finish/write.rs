//! Hands the surface over, at once where it is one in memory, else tile by tile: where each of its vertices and triangles belongs is
//! known.

use std::sync::Mutex;

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::colour::{bare_colours, near_colours};
use crate::crossings::scan_order::ScanPlaces;
use crate::stages::WRITING;
use crate::surface::extract::{Case, Surface};
use crate::surface::numbering::{GONE, Numbered};
use crate::surface::passes;
use crate::surface::tile::Tiles;
use crate::surface::whole::Whole;
use base::error::Result;
use base::progress::Progress;
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

/// Writes the surface, with colours if any scan has them: vertices that no scan has a colour of take one of those beside them. Returns the
/// number of triangles of each case.
///
/// # Errors
/// A tile can't be read. The sink's. Cancelled.
pub fn write<T: Tiles>(
    mut whole: Whole<T>,
    besides: Besides,
    sink: &mut dyn MeshSink,
    progress: &Progress<'_>,
) -> Result<[u64; 3]> {
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
) -> Result<[u64; 3]> {
    let mut counts = [0; 3];
    passes::each(surface.cases.len(), progress, |t| counts[surface.cases[t] as usize] += 1)?;
    passes::each(surface.scan.len(), progress, |v| surface.scan[v] = places.told(surface.scan[v]))?;
    let mut mesh = surface.into_mesh(coloured, progress)?;
    mesh.crs = crs;
    sink.whole(mesh, progress)?;
    Ok(counts)
}

/// `colours` are those of vertices that no scan has a colour of. Nothing where no scan has any.
fn in_pieces<T: Tiles>(
    whole: &Whole<T>,
    colours: Option<&FxHashMap<u64, [u8; 4]>>,
    Besides { crs, places, .. }: Besides,
    sink: &mut dyn MeshSink,
    progress: &Progress<'_>,
) -> Result<[u64; 3]> {
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
    let counts = (0..whole.tiles.count()).into_par_iter().with_max_len(1).map(tile).collect::<Result<Vec<_>>>()?;
    let added = out.added()?;
    Ok(counts.into_iter().fold(added, |all, of| [0, 1, 2].map(|case| all[case] + of[case])))
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
    triangles: Vec<[u64; 3]>,
    cases: Vec<Case>,
}

impl<T: Tiles> Out<'_, T> {
    fn to_sink(&self, call: impl FnOnce(&mut dyn MeshSink) -> Result<()>) -> Result<()> {
        call(&mut **self.sink.lock().unwrap_or_else(std::sync::PoisonError::into_inner))
    }

    /// Number of a vertex if those without a triangle are left out.
    fn vertex(&self, v: u64) -> u64 {
        v - self.whole.changes.bare.partition_point(|&bare| bare < v) as u64
    }

    fn tile(&self, numbered: &Numbered<'_>) -> Result<[u64; 3]> {
        let tile = &numbered.tile;
        let own: Vec<(usize, u64)> = (0..tile.own).map(|v| (v, numbered.vertex(v))).filter(|of| of.1 != GONE).collect();
        for run in own.chunk_by(|a, b| a.1 + 1 == b.1) {
            self.vertices(&tile.surface, run.iter().copied())?;
        }
        let corners = |t: usize| tile.surface.triangles[t].map(|v| numbered.vertex(v as usize));
        let kept: Vec<(u64, usize)> =
            (0..tile.surface.triangles.len()).filter_map(|t| Some((numbered.triangle(t)?, t))).collect();
        let mut counts = [0; 3];
        for run in kept.chunk_by(|a, b| a.0 + 1 == b.0) {
            let found = self.triangles(run.iter().map(|&(number, t)| (number, corners(t), tile.surface.cases[t])))?;
            (0..3).for_each(|case| counts[case] += found[case]);
        }
        Ok(counts)
    }

    fn added(&self) -> Result<[u64; 3]> {
        let Whole { added, corners, numbers, .. } = self.whole;
        self.vertices(added, (0..added.positions.len()).zip(numbers.vertices..))?;
        let cases = corners.iter().zip(&added.cases);
        self.triangles((numbers.triangles..).zip(cases).map(|(t, (corners, case))| (t, *corners, *case)))
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

    /// Hands over triangles with their numbers, which follow each other, corners and cases. Counts the cases.
    fn triangles(&self, list: impl Iterator<Item = (u64, [u64; 3], Case)>) -> Result<[u64; 3]> {
        let (mut first, mut counts, mut run) = (None, [0; 3], Run::default());
        for (t, corners, case) in list {
            let before = self.removed.partition_point(|&removed| removed < t);
            if self.removed.get(before) == Some(&t) {
                continue;
            }
            first = first.or(Some(t - before as u64));
            let corners = self.whole.changes.renamed.get(&t).copied().unwrap_or(corners);
            run.triangles.push(corners.map(|v| self.vertex(v)));
            run.cases.push(case);
            counts[case as usize] += 1;
        }
        let Some(first) = first else { return Ok(counts) };
        let fills = run.cases.iter().map(|&case| case == Case::Fill).collect();
        self.to_sink(|sink| sink.triangles(first, &run.triangles, &[AttributeData::Bool(fills)]))?;
        Ok(counts)
    }
}

#[cfg(test)]
mod tests;
