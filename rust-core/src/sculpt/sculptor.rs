//! The driver: the stages in their order, for any number of tolerances.

use std::time::Instant;

use rayon::prelude::*;

use super::domain::Domain;
use super::pieces::Pieces;
use super::star::Rules;
use super::view::{LatticeSite, Sight, View};
use super::{Certificate, SculptParams, SculptReport, Sculpted, Tolerance, certify, dig, finish, polish, seams};
use crate::error::Result;
use crate::progress::{Plan, Progress};
use crate::range_image::RangeImage;

/// An image ready to be sculpted to one tolerance after the other.
///
/// The result of a tolerance does not depend on the tolerances before.
pub struct Sculptor<'a> {
    image: &'a RangeImage,
    params: SculptParams,
    domain: Domain,
    seconds: f64,
}

/// Stages with their shares of the time.
const PLAN: Plan = &[("digging", 0.35), ("removing vertices", 0.55), ("measuring the error", 0.1)];

impl<'a> Sculptor<'a> {
    /// Finds where the mesh may be. O(pixels).
    ///
    /// # Errors
    /// Parameters out of range, attributes of the wrong length, more than 2^32 - 2 pixels.
    pub fn new(image: &'a RangeImage, params: &SculptParams) -> Result<Self> {
        params.validate()?;
        let start = Instant::now();
        let domain = Domain::new(image, &params.triangulation)?;
        Ok(Sculptor { image, params: *params, domain, seconds: start.elapsed().as_secs_f64() })
    }

    /// Difference between the farthest and the nearest range of the covered samples.
    pub fn depth_extent(&self) -> f64 {
        self.domain.extent()
    }

    /// The mesh within `tolerance`, finer or coarser than any before.
    ///
    /// # Errors
    /// A tolerance out of range; [`crate::Error::Cancelled`].
    pub fn refine(&self, tolerance: Tolerance, progress: &Progress<'_>) -> Result<Sculpted> {
        let tolerance = tolerance.in_world(self.depth_extent())?;
        progress.plan(PLAN);
        let pool = crate::threads::pool(self.params.threads)?;
        progress.run(&pool, || match Sight::new(self.image, self.domain.mirrored) {
            Sight::Flat(view) => self.dig(&view, tolerance, progress),
            Sight::Pinhole(view) => self.dig(&view, tolerance, progress),
            Sight::Parallel(view) => self.peel(&view, tolerance, progress),
            Sight::Central(view) => self.peel(&view, tolerance, progress),
        })
    }

    /// Coarse to fine: digs tiles, then polishes.
    fn dig<V: View>(&self, view: &V, tolerance: f64, progress: &Progress<'_>) -> Result<Sculpted>
    where
        V::Site: LatticeSite,
    {
        let domain = &self.domain;
        let mut clock = Clock::start(self.seconds);
        let required = seams::required(view, domain, tolerance);
        let cols = seams::tile_origins(domain.cols);
        let origins: Vec<[u32; 2]> =
            seams::tile_origins(domain.rows).into_iter().flat_map(|r| cols.iter().map(move |&c| [r, c])).collect();
        progress.stage(0, origins.len() as u64);
        let tiles = origins
            .into_par_iter()
            .map(|origin| {
                let tile = dig::dig_tile(view, domain, &required, tolerance, origin, progress)?;
                progress.advance(1)?;
                Ok(tile)
            })
            .collect::<Result<Vec<_>>>()?;
        let pieces = Pieces::join(tiles);
        clock.lap("dig");
        self.polish(view, pieces, tolerance, clock, progress)
    }

    /// Fine to coarse, where pixels are on no lattice: polishes the step-discontinuity triangulation.
    fn peel<V: View>(&self, view: &V, tolerance: f64, progress: &Progress<'_>) -> Result<Sculpted> {
        let clock = Clock::start(self.seconds);
        self.polish(view, Pieces::full(&self.domain.triangles), tolerance, clock, progress)
    }

    fn polish<V: View>(
        &self,
        view: &V,
        mut pieces: Pieces,
        tolerance: f64,
        mut clock: Clock,
        progress: &Progress<'_>,
    ) -> Result<Sculpted> {
        let dug_triangles = pieces.triangles.len();
        let rules = Rules { tolerance };
        progress.stage(1, 3);
        let (mut pass, mut gained) = (0, true);
        while self.params.effort > 0
            && let Some(cut) = polish::next_cut(pass, &self.domain, pieces.triangles.len(), gained)
        {
            let before = pieces.triangles.len();
            pieces = polish::pass(view, &self.domain, &pieces, cut, &rules, progress)?;
            progress.advance(1)?;
            gained = pieces.triangles.len() < before;
            pass += 1;
        }
        clock.lap("polish");
        self.finish(&pieces.triangles, tolerance, dug_triangles, clock, progress)
    }

    fn finish(
        &self,
        triangles: &[[u32; 3]],
        tolerance: f64,
        dug_triangles: usize,
        mut clock: Clock,
        progress: &Progress<'_>,
    ) -> Result<Sculpted> {
        progress.stage(2, 1);
        let mut mesh = finish::mesh(self.image, &self.domain, triangles);
        clock.lap("mesh");
        let certificate: Certificate = certify(self.image, &mesh, progress)?;
        finish::add_errors(&mut mesh, &certificate.face_errors);
        clock.lap("certify");
        let report = SculptReport {
            tolerance,
            depth_extent: self.depth_extent(),
            full_triangles: self.domain.triangles.len(),
            dug_triangles,
            triangles: triangles.len(),
            isolated_pixels: self.domain.isolated,
            seconds: clock.laps,
        };
        Ok(Sculpted { mesh, certificate, report })
    }
}

struct Clock {
    last: Instant,
    laps: Vec<(&'static str, f64)>,
}

impl Clock {
    fn start(domain: f64) -> Self {
        Clock { last: Instant::now(), laps: vec![("domain", domain)] }
    }

    fn lap(&mut self, name: &'static str) {
        let now = Instant::now();
        self.laps.push((name, (now - std::mem::replace(&mut self.last, now)).as_secs_f64()));
    }
}
