//! The whole surface where it is one tile in memory: what has changed of it is changed there.

use crate::surface::extract::{Surface, refuse_many};
use crate::surface::numbering::NONE;
use crate::surface::passes;
use crate::surface::tile::{Tile, Tiles};
use crate::surface::whole::{Changes, Whole};
use base::error::Result;
use base::progress::Progress;

impl<T: Tiles> Whole<T> {
    /// All of it, taken out. Nothing where it is several tiles, or in files.
    ///
    /// # Errors
    /// More vertices than there are numbers for in memory. Cancelled.
    pub fn take_surface(&mut self, progress: &Progress<'_>) -> Result<Option<Surface>> {
        let Some(Tile { mut surface, part_of, .. }) = self.tiles.take_only() else { return Ok(None) };
        if self.chosen.kept.contains(&false) {
            keep_vertices(&mut surface, |v| self.chosen.is_kept(0, part_of[v]), progress)?;
        }
        // Of what is in memory there are not more.
        refuse_many(self.vertices())?;
        let here = |corners: &[u64; 3]| corners.map(|v| v as u32);
        let Whole { added, corners, changes: Changes { moved, removed, renamed, bare }, .. } = self;
        surface.append_vertices(added, 0..added.positions.len());
        surface.triangles.extend(corners.iter().map(here));
        surface.cases.extend_from_slice(&added.cases);
        for (&v, &(place, scan)) in &*moved {
            (surface.positions[v as usize], surface.scan[v as usize]) = (place, scan);
        }
        renamed.iter().for_each(|(&t, corners)| surface.triangles[t as usize] = here(corners));
        if !removed.is_empty() {
            let stays = |t: usize| !removed.contains(&(t as u64));
            passes::retain(&mut surface.cases, progress, |t, _| stays(t))?;
            passes::retain(&mut surface.triangles, progress, |t, _| stays(t))?;
        }
        if !bare.is_empty() {
            keep_vertices(&mut surface, |v| bare.binary_search(&(v as u64)).is_err(), progress)?;
        }
        Ok(Some(surface))
    }
}

/// Keeps the vertices that are to be kept, and the triangles between them.
fn keep_vertices(surface: &mut Surface, is_kept: impl Fn(usize) -> bool, progress: &Progress<'_>) -> Result<()> {
    let mut next = 0;
    let number = passes::made(surface.positions.len(), progress, |v| {
        if !is_kept(v) {
            return NONE;
        }
        next += 1;
        next - 1
    })?;
    let keep = |v: usize| number[v] != NONE;
    passes::retain(&mut surface.positions, progress, |v, _| keep(v))?;
    passes::retain(&mut surface.confidence, progress, |v, _| keep(v))?;
    passes::retain(&mut surface.noise, progress, |v, _| keep(v))?;
    passes::retain(&mut surface.colour, progress, |v, _| keep(v))?;
    passes::retain(&mut surface.scan, progress, |v, _| keep(v))?;
    let Surface { triangles, cases, .. } = surface;
    passes::retain(cases, progress, |t, _| keep(triangles[t][0] as usize))?;
    passes::retain(triangles, progress, |_, t| keep(t[0] as usize))?;
    passes::each(triangles.len(), progress, |t| triangles[t] = triangles[t].map(|v| number[v as usize]))
}
