//! Colours of vertices that no scan has a colour of: those, and what lies beside them, are in memory together.

use rustc_hash::FxHashMap;

use super::near_colours::{self, Seen};
use crate::surface::extract::Surface;
use crate::surface::tile::Tiles;
use crate::surface::whole::{Corners, Whole};
use base::error::Result;
use base::progress::Progress;

/// The colours of vertices of alpha 0, by their numbers.
///
/// # Errors
/// A tile can't be read. Cancelled.
pub fn fill_in<T: Tiles>(whole: &Whole<T>, progress: &Progress<'_>) -> Result<FxHashMap<u64, [u8; 4]>> {
    let mut beside = Beside::default();
    let mut seen = 0;
    whole.each_triangle(progress, |t| beside.add(t))?;
    whole.each_vertex(progress, |_, _, colour| seen += u64::from(colour[3] != 0))?;
    let Beside { mut surface, vertices, .. } = beside;
    let is_bare: Vec<bool> = surface.colour.iter().map(|colour| colour[3] == 0).collect();
    let apart = near_colours::fill_in_along(&mut surface, progress)?;
    if !apart.is_empty() {
        let mut sample = Seen::of(seen);
        whole.each_vertex(progress, |_, place, colour| sample.add(place, colour))?;
        sample.fill_in(&mut surface, &apart, progress)?;
    }
    Ok(vertices.into_iter().zip(surface.colour).zip(is_bare).filter(|of| of.1).map(|of| of.0).collect())
}

/// Triangles at vertices without a colour.
#[derive(Default)]
struct Beside {
    surface: Surface,
    place_of: FxHashMap<u64, u32>,
    vertices: Vec<u64>,
}

impl Beside {
    fn add(&mut self, corners: Corners) {
        if corners.iter().all(|corner| corner.2[3] != 0) {
            return;
        }
        let triangle = corners.map(|(v, place, colour)| {
            let next = self.vertices.len() as u32;
            let at = *self.place_of.entry(v).or_insert(next);
            if at == next {
                self.vertices.push(v);
                self.surface.positions.push(place);
                self.surface.colour.push(colour);
            }
            at
        });
        self.surface.triangles.push(triangle);
    }
}
