//! The driver: the stages in their order, for any number of tolerances.

use std::borrow::Borrow;

use super::borders::{Border, Fenced, Hugging, Region, Straight};
use super::domain::Domain;
use super::ladder::Ladder;
use super::mend::{self, Bound};
use super::params::{SculptParams, Tolerance};
use super::pieces::Pieces;
use super::rays::{Rays, aspect};
use super::report::{SculptReport, Sculpted};
use super::search::Search;
use super::star::Rules;
use super::view::{LatticeSite, View};
use super::windows::Windowed;
use super::{certify, finish, polish};
use base::error::{Error, Result, Shown};
use base::memory;
use base::progress::{Progress, Seconds};
use image::range_image::RangeImage;
use image::triangulate::no_triangle;
use mesh::Crs;
use mesh::dump::{self, Stage};

/// At the peak. Measured: 85 for a coarse tolerance, 180 for none.
const BYTES_A_PIXEL: f64 = 80.0;
/// While a mesh is made: a place of the image, a triangle. Also a valid pixel if vertices may leave their samples.
const BYTES_A_PLACE: f64 = 24.0;
const BYTES_A_TRIANGLE: f64 = 78.0;
const BYTES_OFF_SAMPLES: f64 = 62.0;
/// Before that, to find where it may be: what of it stays.
pub(super) const BYTES_OF_DOMAIN: f64 = 30.0;
/// Pixels that are looked at to find how rough an image is.
const LOOKED_AT: usize = 1 << 16;

/// Sculpts an image: [`Sculptor::new`] and [`Sculptor::refine`] in one call.
///
/// # Guarantees
/// * The ray of every sample that has a triangle in the step-discontinuity triangulation meets the mesh once, within the tolerance. The
///   certificate measures it, and is compared with the tolerance before anything is returned. No error in the result is above the number
///   that was asked for, by rounding either. Triangles that hide behind others, because a point grid folds as seen along its rays or a scan
///   goes around more than once, count as jumps. The report counts them.
/// * Seen from the sensor the mesh covers exactly those triangles' area, once. With `simplify_borders` it covers at most half a pixel more
///   along rows and columns, none of it a pixel that was not covered. All triangles face the sensor and have an area there. The mesh is a
///   manifold with boundary. Its vertices are samples, unless `interpolate` is off.
/// * The same image gives the same mesh for any number of threads, and in any unit that is a power of two times another.
///
/// # Cost
/// n pixels: O(n log n) expected time. From 128 x 128 to 4096 x 4096 pixels of made terrain, at 0.041 % of its depth extent, the CPU time
/// falls from 1.7 to 0.4 microseconds per pixel, as the share of them that the mesh needs falls. Memory stays near 100 bytes per pixel
/// beside the image.
///
/// # Errors
/// An image that gives no triangle. Parameters out of range, attributes of the wrong length, more than 2^32 - 2 pixels, a coordinate too
/// large, a world in degrees. [`base::Error::Cancelled`].
///
/// Source: \[SG07\], with the differences listed at the module.
pub fn run(image: &RangeImage, params: &SculptParams, progress: &Progress<'_>) -> Result<Sculpted> {
    params.validate()?;
    if let Tolerance::Absolute(tolerance) = params.tolerance {
        foresee(image, params, tolerance, BYTES_OF_DOMAIN)?;
    }
    progress.plan(&[("triangulating", 1.0)]);
    Sculptor::prepare_for(false, image, params, progress)?.refine(params.tolerance, progress)
}

/// An image ready to be sculpted to one tolerance after the other. `I` is a reference to it, or shares it.
///
/// The result of a tolerance does not depend on the tolerances before, but comes sooner. The digging starts from the last rung of its
/// ladder above it, which is kept (about 6 bytes per pixel).
pub struct Sculptor<I> {
    image: I,
    params: SculptParams,
    domain: Domain,
    /// Times of making it.
    prepared: Seconds,
    ladder: Ladder,
}

base::stages! {
    /// Stages with their shares of the time: for a tolerance ...
    PLAN:
    DIGGING = "digging", 0.35;
    REMOVING = "removing vertices", 0.55;
    MEASURING = "measuring the error", 0.1;
}
base::stages! {
    /// ... and for a number of triangles.
    SEARCH_PLAN:
    SEARCHING = "searching the tolerance", 0.95;
    MEASURING_FOUND = "measuring the error", 0.05;
}

/// Most tolerances tried by [`Sculptor::at_most`] ...
const MOST_TRIALS: u64 = 24;
/// ... which is content with this share of the triangles allowed.
const CLOSE: f64 = 0.98;

/// A mesh is coarse if it has fewer triangles than all samples make by this factor ...
const COARSE: usize = 16;
/// ... and small if it has fewer than this.
const SMALL: usize = 8192;

/// A mesh not yet measured.
pub(super) struct Dug {
    pieces: Pieces,
    /// Triangles before the polish.
    triangles: usize,
    pub(super) bound: Bound,
}

/// Refuses a tolerance for whose mesh there is not enough memory. `domain` bytes per valid pixel are taken before. The number of triangles
/// follows from how rough the image is: a pixel that lies farther than the tolerance from the middle between its neighbours is a vertex,
/// mostly.
pub(super) fn foresee(image: &RangeImage, params: &SculptParams, tolerance: f64, domain: f64) -> Result<()> {
    let (mut rough, mut looked_at) = (0_u32, 0_u32);
    // Odd, so that it is no multiple of an even number of columns.
    let step = (image.len() / LOOKED_AT) | 1;
    for pixel in (1..image.len().saturating_sub(1)).step_by(step) {
        let off = image.range(pixel) - image.range(pixel - 1).midpoint(image.range(pixel + 1));
        looked_at += u32::from(!off.is_nan());
        rough += u32::from(off.abs() > tolerance);
    }
    let share = f64::from(rough) / f64::from(looked_at.max(1));
    let triangles = (1.65 * share + 0.05).min(2.0);
    let each = domain + if params.interpolate { BYTES_A_TRIANGLE * triangles } else { BYTES_OFF_SAMPLES };
    let doing = format!("a mesh within {} of", Shown(tolerance));
    memory::expect_each(image.valid_count(), each, BYTES_A_PLACE * image.len() as f64, &doing, "valid pixels")
}

impl<I: Borrow<RangeImage> + Sync> Sculptor<I> {
    /// Finds where the mesh may be. O(pixels).
    ///
    /// # Errors
    /// An image that gives no triangle. Parameters out of range, attributes of the wrong length, more than 2^32 - 2 pixels, a coordinate
    /// too large, a world in degrees.
    pub fn new(image: I, params: &SculptParams) -> Result<Self> {
        Self::prepare(image, params, &Progress::none())
    }

    /// [`Sculptor::new`] that reports and stops when it is cancelled.
    ///
    /// # Errors
    /// As [`Sculptor::new`]. [`Error::Cancelled`].
    pub fn prepare(image: I, params: &SculptParams, progress: &Progress<'_>) -> Result<Self> {
        Self::prepare_for(true, image, params, progress)
    }

    /// For one tolerance, or for `many`: to these it comes back with a part of the digging done.
    pub(super) fn prepare_for(many: bool, image: I, params: &SculptParams, progress: &Progress<'_>) -> Result<Self> {
        params.validate()?;
        Crs::lengths(image.borrow().crs.as_ref())?;
        let pixels = image.borrow().valid_count();
        memory::expect_each(pixels, BYTES_A_PIXEL, image.borrow().len() as f64, "sculpting", "valid pixels")?;
        progress.count_from(Seconds::new());
        let pool = base::threads::pool(params.threads)?;
        let triangulation = &params.triangulation;
        let domain = progress.watch(|| pool.install(|| Domain::new(image.borrow(), triangulation, progress)))?;
        if domain.triangles.is_empty() {
            return Err(no_triangle(image.borrow(), triangulation));
        }
        let ladder = Ladder::new(domain.extent(), many);
        progress.lap("domain");
        Ok(Sculptor { image, params: *params, domain, prepared: progress.seconds(), ladder })
    }

    /// Difference between the farthest and the nearest range of the covered samples.
    pub fn depth_extent(&self) -> f64 {
        self.domain.extent()
    }

    /// The mesh within `tolerance`, finer or coarser than any before.
    ///
    /// # Errors
    /// A tolerance out of range. An error that single precision can't hold. [`Error::Cancelled`].
    pub fn refine(&self, tolerance: Tolerance, progress: &Progress<'_>) -> Result<Sculpted> {
        let tolerance = tolerance.in_world(self.depth_extent())?;
        foresee(self.image.borrow(), &self.params, tolerance, 0.0)?;
        progress.plan(PLAN);
        let pool = base::threads::pool(self.params.threads)?;
        progress.run(&pool, || {
            progress.count_from(self.prepared.clone());
            progress.stage(DIGGING, 1);
            let dug = self.dig(tolerance, &|| progress.stage(REMOVING, 1), progress)?;
            progress.stage(MEASURING, 1);
            self.finish(dug, progress)
        })
    }

    /// The mesh of the smallest tolerance found that has at most `triangles` triangles: those of a tolerance within a few
    /// percent, as the number of triangles does not fall strictly with the tolerance. Its tolerance is in the report.
    /// Costs up to 24 meshes.
    ///
    /// # Errors
    /// [`Error::Input`] if even a mesh without a tolerance has more. [`Error::Cancelled`].
    pub fn at_most(&self, triangles: usize, progress: &Progress<'_>) -> Result<Sculpted> {
        progress.plan(SEARCH_PLAN);
        let pool = base::threads::pool(self.params.threads)?;
        progress.run(&pool, || {
            progress.count_from(self.prepared.clone());
            progress.stage(SEARCHING, MOST_TRIALS);
            // No sample lies farther from a mesh of samples; unless rays diverge much, which a factor allows for.
            let mut high = (16.0 * self.depth_extent()).min(f64::MAX);
            let mut best = self.dig(high, &|| (), progress)?;
            let fewest = best.pieces.triangles.len();
            if fewest > triangles {
                let name = match self.image.borrow().name.as_str() {
                    "" => "the image",
                    name => name,
                };
                // Borders as they are in the image may take most of them.
                let borders = if self.params.simplify_borders { "" } else { "simplify_borders, " };
                return Err(Error::input(format!(
                    "{name}: at most {triangles} triangles are asked for, but no fewer than {fewest} cover it. Allow \
                        more, {borders}or raise edge_limit so that jumps tear fewer borders open."
                )));
            }
            let mut low = high * (-40.0_f64).exp2();
            for _ in 1..MOST_TRIALS {
                progress.advance(1)?;
                let middle = low.sqrt() * high.sqrt();
                if best.pieces.triangles.len() as f64 >= CLOSE * triangles as f64 || !(low < middle && middle < high) {
                    break;
                }
                let dug = self.dig(middle, &|| (), progress)?;
                if dug.pieces.triangles.len() <= triangles {
                    (best, high) = (dug, middle);
                } else {
                    low = middle;
                }
            }
            progress.stage(MEASURING_FOUND, 1);
            loop {
                let sculpted = self.finish(best, progress)?;
                if sculpted.report.triangles <= triangles {
                    return Ok(sculpted);
                }
                // Mending took more than there were left: a little farther.
                high *= 1.0 + 1e-3;
                best = self.dig(high, &|| (), progress)?;
            }
        })
    }

    /// A chain of levels of detail: [`Sculptor::refine`] for each tolerance.
    ///
    /// # Errors
    /// A tolerance out of range, before any work is done. [`Error::Cancelled`].
    pub fn levels(&self, tolerances: &[Tolerance], progress: &Progress<'_>) -> Result<Vec<Sculpted>> {
        for tolerance in tolerances {
            tolerance.in_world(self.depth_extent())?;
        }
        tolerances.iter().map(|&tolerance| self.refine(tolerance, progress)).collect()
    }

    /// Digs and polishes. `dug` is called in between.
    pub(super) fn dig(&self, tolerance: f64, dug: &(dyn Fn() + Sync), progress: &Progress<'_>) -> Result<Dug> {
        let [nearest, farthest] = self.domain.range;
        let bound = Bound::new(tolerance, nearest.abs().max(farthest.abs()));
        match Rays::new(self.image.borrow(), self.domain.mirrored) {
            Rays::Flat(view) => self.dig_tiles(&view, bound, dug, progress),
            Rays::Pinhole(view) => self.dig_tiles(&view, bound, dug, progress),
            Rays::Parallel(view) => self.peel(&view, bound, dug, progress),
            Rays::Central(view) => self.peel(&view, bound, dug, progress),
        }
    }

    /// Coarse to fine: digs tiles, then polishes.
    fn dig_tiles<V: View>(
        &self,
        view: &V,
        bound: Bound,
        dug: &(dyn Fn() + Sync),
        progress: &Progress<'_>,
    ) -> Result<Dug>
    where
        V::Site: LatticeSite,
    {
        let domain = &self.domain;
        let pieces = self.ladder.dig(view, domain, bound.dug, progress)?;
        progress.lap("dig");
        dug();
        if self.params.simplify_borders {
            self.polish(view, &Hugging { domain }, pieces, bound, progress)
        } else {
            self.polish(view, &Straight { domain, on_lattice: true }, pieces, bound, progress)
        }
    }

    /// Fine to coarse, where pixels are on no lattice: polishes the step-discontinuity triangulation.
    fn peel<V: View>(&self, view: &V, bound: Bound, dug: &(dyn Fn() + Sync), progress: &Progress<'_>) -> Result<Dug>
    where
        V::Site: Windowed,
    {
        dug();
        let domain = &self.domain;
        let pieces = Pieces::full(&domain.triangles);
        if self.params.simplify_borders {
            self.polish(view, &Fenced::new(view, domain), pieces, bound, progress)
        } else {
            self.polish(view, &Straight { domain, on_lattice: false }, pieces, bound, progress)
        }
    }

    fn polish<V: View>(
        &self,
        view: &V,
        border: &dyn Border,
        mut pieces: Pieces,
        bound: Bound,
        progress: &Progress<'_>,
    ) -> Result<Dug> {
        let region = Region { domain: &self.domain, border };
        self.dump("sculpt-1-dug", &pieces, progress)?;
        let triangles = pieces.triangles.len();
        let mut rules = Rules {
            tolerance: bound.dug,
            least_sine_squared: self.params.min_angle.sin().powi(2),
            aspect: aspect(self.image.borrow()),
            shake: None,
        };
        // Off the lattice the polish is all there is.
        let wanted = self.params.effort > 0 || !<V::Site as super::view::Site>::ON_LATTICE;
        let (mut pass, mut gained) = (0, true);
        while wanted && let Some(cut) = polish::next_cut(pass, &self.domain, pieces.triangles.len(), gained) {
            let before = pieces.triangles.len();
            // A coarse mesh gains most, and a small one costs little.
            let gains = COARSE * triangles < self.domain.triangles.len() || triangles < SMALL;
            let search = if pass == 1 && gains { Search::Light } else { Search::None };
            pieces = polish::pass(view, region, &pieces, cut, &rules, search, progress)?;
            gained = pieces.triangles.len() < before;
            pass += 1;
        }
        self.dump("sculpt-2-polished", &pieces, progress)?;
        progress.lap("polish");
        let free = !self.params.interpolate && self.params.effort > 0;
        let search = if free { Search::Free } else { Search::Full };
        rules.tolerance = if free { bound.free } else { bound.dug };
        let (mut round, mut share) = (0, 1.0);
        while (self.params.effort > 1 || free)
            && let Some(cut) = polish::next_search(round, &self.domain, pieces.triangles.len(), share)
        {
            let before = pieces.triangles.len();
            rules.shake = (round >= 2).then_some(round);
            pieces = polish::pass(view, region, &pieces, cut, &rules, search, progress)?;
            share = (before as f64 - pieces.triangles.len() as f64) / before as f64;
            round += 1;
        }
        progress.lap("search");
        Ok(Dug { pieces, triangles, bound })
    }

    /// Measures the mesh, and mends it until it keeps the bound.
    pub(super) fn finish(&self, dug: Dug, progress: &Progress<'_>) -> Result<Sculpted> {
        let Dug { mut pieces, triangles: dug_triangles, bound } = dug;
        let (image, pixels) = (self.image.borrow(), &self.domain.pixels);
        let (mut mesh, measured) = loop {
            let mesh = finish::mesh(image, &self.domain, &pieces, progress)?;
            progress.lap("mesh");
            let measured = certify::measure(image, pixels, &mesh, progress)?;
            progress.lap("certify");
            let of_domain = pixels.iter().find(|&&p| bound.is_broken_by(measured.errors[p as usize])).copied();
            // If rounding lets pixels coincide, others may be covered, too.
            let of_others = || measured.errors.iter().position(|e| !e.is_nan() && bound.is_broken_by(*e));
            let Some(broken) = of_domain.or_else(|| of_others().map(|p| p as u32)) else { break (mesh, measured) };
            pieces = self.mend(&pieces, &measured.errors, &bound, progress)?.ok_or_else(|| {
                let [col, row] = self.domain.place(broken);
                Error::input(format!(
                    "{}: around pixel ({row}, {col}) samples are too close to each other and too far from the \
                        origin: double precision can't tell their rays apart. Move the image nearer to the origin.",
                    image.called()
                ))
            })?;
        };
        let certificate = certify::summarize(image, &mesh, measured, progress)?;
        // Those of pixels and faces are told in single precision.
        if certificate.max_error > f64::from(f32::MAX) {
            return Err(Error::input(format!(
                "an error of {} is more than single precision can hold: use a larger unit, or a smaller tolerance",
                Shown(certificate.max_error)
            )));
        }
        finish::add_errors(&mut mesh, &certificate.face_errors, progress)?;
        // The bound leaves so much for rounding the coordinates in a file.
        let room = (bound.certified - certificate.max_error) / certificate.steepness;
        mesh.rounding_room = Some(room.max(0.0));
        mesh.crs = image.crs_of_frame();
        progress.lap("certify");
        let report = SculptReport {
            tolerance: bound.tolerance,
            depth_extent: self.depth_extent(),
            full_triangles: self.domain.triangles.len(),
            hidden_triangles: self.domain.hidden,
            dug_triangles,
            triangles: pieces.triangles.len(),
            isolated_pixels: self.domain.isolated,
            seconds: progress.seconds(),
        };
        Ok(Sculpted { mesh, certificate, report })
    }

    fn dump(&self, name: &str, pieces: &Pieces, progress: &Progress<'_>) -> Result<()> {
        dump::stage(name, || {
            let mesh = finish::mesh(self.image.borrow(), &self.domain, pieces, progress).unwrap_or_default();
            Stage { positions: mesh.positions, triangles: mesh.triangles, values: Vec::new() }
        })
    }

    fn mend(&self, pieces: &Pieces, errors: &[f64], bound: &Bound, progress: &Progress<'_>) -> Result<Option<Pieces>> {
        match Rays::new(self.image.borrow(), self.domain.mirrored) {
            Rays::Flat(view) => mend::mend(&view, pieces, errors, bound, progress),
            Rays::Pinhole(view) => mend::mend(&view, pieces, errors, bound, progress),
            Rays::Parallel(view) => mend::mend(&view, pieces, errors, bound, progress),
            Rays::Central(view) => mend::mend(&view, pieces, errors, bound, progress),
        }
    }
}
