//! Digs all tiles down a ladder of tolerances, so that the next tolerance starts where the last one passed.
//!
//! The rungs are the depth extent divided by powers of four, a power of two, so that units don't matter. The digging passes every rung
//! above its tolerance. So it ends in the same mesh whether it starts at the top or at a rung that was kept.

use std::sync::{Arc, Mutex, PoisonError};

use rayon::prelude::*;

use super::domain::Domain;
use super::greedy_insertion::{Digging, Tile};
use super::pieces::Pieces;
use super::seams::{Required, tile_origins};
use super::view::{LatticeSite, View};
use base::error::Result;
use base::progress::Progress;

/// From a rung to the next.
const STEP: f64 = 0.25;

/// Rungs at most: what lies below the last one are the digits beyond the 24th of the extent.
const MOST: usize = 12;

/// Digs tiles, and keeps them as they were at the last rung.
pub(super) struct Ladder {
    /// The first rung.
    extent: f64,
    kept: Mutex<Option<Arc<Kept>>>,
    keeps: bool,
}

/// Tiles dug down to a rung.
struct Kept {
    /// Number of rungs that were passed.
    rungs: usize,
    origins: Vec<[u32; 2]>,
    /// One for each origin where there is any of the domain. None at all before the first rung.
    tiles: Vec<Option<Tile>>,
    required: Required,
}

impl Ladder {
    /// A ladder for the depth extent of a domain. `keeps` if there may be a next tolerance.
    pub fn new(extent: f64, keeps: bool) -> Self {
        Ladder { extent, kept: Mutex::new(None), keeps }
    }

    /// The rungs above a tolerance, the largest first.
    fn rungs(&self, tolerance: f64) -> Vec<f64> {
        let rungs = std::iter::successors(Some(self.extent), |rung| Some(rung * STEP));
        rungs.take_while(|&rung| rung > tolerance).take(MOST).collect()
    }

    /// The mesh of all tiles within `tolerance` (world units).
    pub fn dig<V: View>(&self, view: &V, domain: &Domain, tolerance: f64, progress: &Progress<'_>) -> Result<Pieces>
    where
        V::Site: LatticeSite,
    {
        let rungs = self.rungs(tolerance);
        let kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let start = kept.filter(|kept| kept.rungs <= rungs.len()).unwrap_or_else(|| Arc::new(Kept::top(domain)));
        let new_rungs = start.rungs..rungs.len();
        let keeps = self.keeps && !new_rungs.is_empty();
        let mut required = start.required.clone();
        rungs[new_rungs.clone()].iter().for_each(|&rung| required.add(view, domain, rung));
        let at_last_rung = keeps.then(|| required.clone());
        required.add(view, domain, tolerance);
        let dig = |(i, &origin): (usize, &[u32; 2])| {
            let tile = start.tiles.get(i).cloned().unwrap_or_else(|| Tile::new(domain, &required, origin));
            let Some(tile) = tile else { return Ok((None, Pieces::default())) };
            let mut digging = Digging::new(view, tile);
            for rung in new_rungs.clone() {
                digging.dig(&required, rung as u8, rungs[rung], progress)?;
            }
            let kept = keeps.then(|| digging.tile.clone());
            digging.dig(&required, rungs.len() as u8, tolerance, progress)?;
            Ok((kept, digging.tile.pieces(domain)))
        };
        let dug = start.origins.par_iter().enumerate().map(dig).collect::<Result<Vec<_>>>()?;
        let (tiles, pieces): (Vec<_>, Vec<_>) = dug.into_iter().unzip();
        if let Some(required) = at_last_rung {
            let kept = Kept { rungs: rungs.len(), origins: start.origins.clone(), tiles, required };
            *self.kept.lock().unwrap_or_else(PoisonError::into_inner) = Some(Arc::new(kept));
        }
        Ok(Pieces::join(pieces))
    }
}

impl Kept {
    /// Before the first rung.
    fn top(domain: &Domain) -> Self {
        let cols = tile_origins(domain.cols);
        let origins = tile_origins(domain.rows).into_iter().flat_map(|row| cols.iter().map(move |&col| [row, col]));
        Kept { rungs: 0, origins: origins.collect(), tiles: Vec::new(), required: Required::new(domain) }
    }
}
