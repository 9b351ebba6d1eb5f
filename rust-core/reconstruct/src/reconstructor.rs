//! The driver: the stages in their order, and again with other parameters.

use std::borrow::Borrow;
use std::time::Instant;

use glam::DVec3;

use super::complex::Complex;
use super::manifold::{Separated, Solid};
use super::orient::{Witness, orient};
use super::prepare::{Samples, prepare};
use super::sheet::{Choice, choices};
use super::{
    Closure, Dropped, Reason, ReconstructParams, ReconstructReport, Reconstructed, Threshold, Topology, canonical,
    carve_freely, close, open, separate,
};
use base::error::{Error, Result};
use base::magnitude;
use base::memory;
use base::progress::{Plan, Progress};
use geom::delaunay3::Delaunay3;
use mesh::point_cloud::PointCloud;
use mesh::{Attribute, TriMesh};

/// At the peak; measured, 350 on noisy surfaces, 660 on a sphere.
const BYTES_A_POINT: f64 = 400.0;
/// In all, a finite cell of the tetrahedralization or, where that is more, a point: for closed surfaces and for open ones.
/// Measured.
const BYTES_CLOSED: [f64; 2] = [75.0, 360.0];
/// Of samples that lie on a sphere to the last bits, whose tetrahedra have few cells a point.
const BYTES_DEGENERATE: [f64; 2] = [75.0, 670.0];
const FEW_CELLS: f64 = 4.0;
const BYTES_OPEN: [f64; 2] = [122.0, 690.0];

/// Part of all samples that a closed surface goes through at least, if what was enclosed at first met less than half:
/// the walls of a vessel may be thinner than its samples are apart. Of an open surface next to nothing is enclosed.
const ENCLOSED: f64 = 0.99;

/// Stages with their shares of the time ...
pub const PLAN: Plan =
    &[("tetrahedralizing", 0.6), ("finding inside and outside", 0.25), ("building the surface", 0.15)];
/// ... and of those that depend on the parameters.
const PLAN_AGAIN: Plan = &[("finding inside and outside", 0.3), ("building the surface", 0.7)];

/// A cloud from which surfaces are made, with other parameters in a fraction of the time: what depends on the points only
/// is kept. `C` is a reference to the cloud, or shares it.
///
/// The surface does not depend on the surfaces before.
pub struct Reconstructor<C> {
    cloud: C,
    sensors: Vec<DVec3>,
    cells: Option<Cells>,
    /// Whether what depends on the points only is kept for the next surface.
    is_kept: bool,
}

/// What depends on the points only.
struct Cells {
    samples: Samples,
    delaunay: Delaunay3,
    separated: Option<Separated>,
    choices: Option<Vec<Choice>>,
    seconds: Vec<(&'static str, f64)>,
}

impl<C: Borrow<PointCloud> + Sync + Send> Reconstructor<C> {
    /// Takes a cloud. O(1): the points are tetrahedralized for the first surface.
    ///
    /// # Errors
    /// Attributes of another length than the points.
    pub fn new(cloud: C) -> Result<Self> {
        let points = cloud.borrow();
        let count = points.positions.len();
        for (name, length) in [
            ("normals", points.normals.as_ref().map(Vec::len)),
            ("colours", points.colour.as_ref().map(Vec::len)),
            ("intensities", points.intensity.as_ref().map(Vec::len)),
        ] {
            if let Some(length) = length.filter(|length| *length != count) {
                return Err(Error::input(format!("{length} {name} for {count} points: give one a point")));
            }
        }
        Ok(Reconstructor { cloud, sensors: Vec::new(), cells: None, is_kept: true })
    }

    /// The cloud.
    pub fn cloud(&self) -> &PointCloud {
        self.cloud.borrow()
    }

    /// Says where the points were seen from, in the cloud's frame: one place for all, or one a point. Parts of the
    /// surface are then turned towards it. Goes before the cloud's normals.
    ///
    /// # Errors
    /// Neither one place nor one a point; a coordinate that isn't finite.
    pub fn seen_from(&mut self, sensors: Vec<DVec3>) -> Result<()> {
        let points = self.cloud().positions.len();
        if sensors.len() != 1 && sensors.len() != points {
            let given = sensors.len();
            return Err(Error::input(format!("{given} sensor origins for {points} points: give one, or one a point")));
        }
        magnitude::points("sensor origin", &sensors)?;
        self.sensors = sensors;
        Ok(())
    }

    /// Makes a surface: the first in O(n log n) in practice for n points, others in a fifth of the time or less.
    ///
    /// # Errors
    /// Parameters out of range; fewer than four different points, or all in one plane; points without a surface;
    /// [`Error::OutOfMemory`]; [`Error::Cancelled`].
    pub fn surface(&mut self, params: &ReconstructParams, progress: &Progress<'_>) -> Result<Reconstructed> {
        self.surface_with(params, |_| (), progress)
    }

    /// `release` is called once the points are sorted: their places in the cloud are not needed afterwards.
    fn surface_with(
        &mut self,
        params: &ReconstructParams,
        release: impl FnOnce(&mut C) + Send,
        progress: &Progress<'_>,
    ) -> Result<Reconstructed> {
        params.validate()?;
        let pool = base::threads::pool(params.threads)?;
        progress.plan(if self.cells.is_none() { PLAN } else { PLAN_AGAIN });
        progress.run(&pool, || self.make_surface(params, release, progress))
    }

    /// Like [`Reconstructor::surface`] for a single surface, in less memory.
    ///
    /// # Errors
    /// As [`Reconstructor::surface`].
    pub fn into_surface(mut self, params: &ReconstructParams, progress: &Progress<'_>) -> Result<Reconstructed> {
        self.is_kept = false;
        self.surface(params, progress)
    }

    /// Like [`Reconstructor::into_surface`] as the first stages, [`PLAN`], of another operation's work, within its pool.
    ///
    /// # Errors
    /// As [`Reconstructor::surface`].
    #[doc(hidden)]
    pub fn into_surface_within(mut self, params: &ReconstructParams, progress: &Progress<'_>) -> Result<Reconstructed> {
        params.validate()?;
        self.is_kept = false;
        self.make_surface(params, |_| (), progress)
    }

    fn make_surface(
        &mut self,
        params: &ReconstructParams,
        release: impl FnOnce(&mut C),
        progress: &Progress<'_>,
    ) -> Result<Reconstructed> {
        let first_stage = match self.cells {
            Some(_) => 0,
            None => {
                let started = Instant::now();
                let positions = &self.cloud().positions;
                let points = positions.len();
                memory::expect_each(points, BYTES_A_POINT, 0.0, "a surface through", "points")?;
                let samples = prepare(positions, progress)?;
                release(&mut self.cloud);
                self.cells = Some(Cells::new(samples, started, params.threads, progress)?);
                1
            }
        };
        let started = Instant::now();
        let is_kept = self.is_kept;
        let cells = self.cells.as_mut().expect("just made");
        let complex = Complex {
            points: &cells.samples.points,
            cells: cells.delaunay.cells(),
            finite: cells.delaunay.finite_count(),
        };
        let mut report = ReconstructReport {
            points: cells.samples.given(),
            tetrahedra: complex.finite,
            seconds: cells.seconds.clone(),
            ..ReconstructReport::default()
        };
        let foresee = |[each_cell, each_point]: [f64; 2]| {
            let (cells, points) = (complex.finite as f64, complex.points.len());
            let bytes = (each_cell * cells).max(each_point * points as f64);
            memory::expect_in_all(bytes, || format!("a surface through {points} points"), "use fewer")
        };
        let is_degenerate = (complex.finite as f64) < FEW_CELLS * complex.points.len() as f64;
        foresee(if is_degenerate { BYTES_DEGENERATE } else { BYTES_CLOSED })?;
        progress.stage(first_stage, 6 * complex.len() as u64);
        let (mut triangles, mut solid);
        // Facets of what divides inside from outside look outwards.
        let mut is_outward = true;
        if params.topology == Topology::Free {
            (triangles, solid) = carve_freely(complex, params, &mut report, progress)?;
        } else {
            let separated = match cells.separated.take() {
                Some(separated) => separated,
                None => separate(complex, progress)?,
            };
            cells.separated = is_kept.then(|| separated.clone());
            report.seconds.push(("separate", started.elapsed().as_secs_f64()));
            report.repaired[0] = separated.repaired;
            progress.stage(first_stage + 1, 1);
            solid = Solid::again(complex, separated);
            let on_surface = solid.on_surface(progress)?;
            let missed = on_surface.iter().filter(|is_on| !**is_on).count();
            let certain = params.closure == Closure::Closed || 2 * missed < complex.points.len();
            let possible = params.closure == Closure::Auto && missed < complex.points.len();
            let fallback = (!certain && possible).then(|| (solid.clone(), report.clone()));
            is_outward = certain || possible;
            let mut found = Vec::new();
            if is_outward {
                found = close(&mut solid, on_surface, params, &mut report, progress)?;
            }
            if let Some(before) = fallback
                && used(&found, complex.points.len()) < ENCLOSED * complex.points.len() as f64
            {
                (solid, report) = before;
                is_outward = false;
            }
            if !is_outward {
                foresee(BYTES_OPEN)?;
                if cells.choices.is_none() {
                    cells.choices = Some(choices(complex, &solid.incident, progress)?);
                }
                let choices = cells.choices.as_ref().expect("just made");
                found = open(complex, &solid.incident, choices, params, &mut report, progress)?;
            }
            triangles = found;
        }
        let enclosed = solid.enclosed(&triangles, progress)?;
        progress.check()?;
        if triangles.is_empty() {
            let remedy = match (params.topology, params.closure) {
                (Topology::Free, _) => "raise the factor, or let the topology be manifold",
                (_, Closure::Auto) => "give samples of a surface",
                _ => "let the closure be auto",
            };
            return Err(Error::input(format!(
                "no surface was found: the points fill a volume or lie along curves, or are too noisy for what was asked; \
                 {remedy}"
            )));
        }
        if params.threshold == Threshold::Global {
            report.threshold /= cells.samples.factor;
        }
        canonical(&mut triangles, progress)?;
        report.turned_parts = self.orient(&mut triangles, is_outward, progress)?;
        let mut made = self.finish(triangles, &enclosed, report, progress)?;
        made.report.seconds.push(("surface", started.elapsed().as_secs_f64()));
        Ok(made)
    }

    fn samples(&self) -> &Samples {
        &self.cells.as_ref().expect("made before the surface").samples
    }

    fn orient(&self, triangles: &mut [[u32; 3]], is_outward: bool, progress: &Progress<'_>) -> Result<usize> {
        let samples = self.samples();
        let of = |v: u32| samples.input[v as usize] as usize;
        let normals = self.cloud().normals.as_deref();
        let sensor = |v: u32| self.sensors[if self.sensors.len() == 1 { 0 } else { of(v) }] * samples.factor;
        let normal = |v: u32| {
            let normal = normals.map_or([0.0; 3], |normals| normals[of(v)]);
            DVec3::from(normal.map(f64::from)).normalize_or_zero()
        };
        let witness = match (self.sensors.is_empty(), normals) {
            (false, _) => Witness::Sensors(&sensor),
            (true, Some(_)) => Witness::Normals(&normal),
            (true, None) => Witness::None,
        };
        orient(&samples.points, triangles, is_outward, &witness, progress)
    }

    /// The mesh over the used points in the order of the cloud, and which points were dropped. `enclosed`: whether each
    /// sample that is not used lies inside.
    fn finish(
        &self,
        triangles: Vec<[u32; 3]>,
        enclosed: &[bool],
        mut report: ReconstructReport,
        progress: &Progress<'_>,
    ) -> Result<Reconstructed> {
        let (cloud, samples) = (self.cloud(), self.samples());
        let mut number = vec![u32::MAX; samples.given()];
        for block in progress.blocks(triangles.as_flattened()) {
            block?.iter().for_each(|&vertex| number[samples.input[vertex as usize] as usize] = 0);
        }
        report.dropped = samples.dropped.clone();
        for (&point, &is_enclosed) in samples.input.iter().zip(enclosed) {
            if number[point as usize] == u32::MAX {
                let reason = if is_enclosed { Reason::Inside } else { Reason::Outside };
                report.dropped.push(Dropped { point, reason });
            }
        }
        progress.check()?;
        report.dropped.sort_unstable_by_key(|dropped| dropped.point);
        let used: Vec<u32> = (0..number.len() as u32).filter(|&point| number[point as usize] == 0).collect();
        for (vertex, &point) in used.iter().enumerate() {
            number[point as usize] = vertex as u32;
        }
        report.used = used.len();
        let mut triangles = triangles;
        for range in progress.ranges(triangles.len()) {
            for vertex in triangles[range?].as_flattened_mut() {
                *vertex = number[samples.input[*vertex as usize] as usize];
            }
        }
        let mut positions = vec![DVec3::ZERO; used.len()];
        for (sample, &point) in samples.points.iter().zip(&samples.input) {
            if let Some(position) = positions.get_mut(number[point as usize] as usize) {
                *position = *sample / samples.factor;
            }
        }
        progress.check()?;
        let mut mesh = TriMesh::new(positions, triangles);
        let attributes = &mut mesh.vertex_attributes;
        attributes.push(Attribute::i32("source_point", used.iter().map(|&point| point as i32).collect()));
        if let Some(colour) = &cloud.colour {
            attributes.push(Attribute::colour("colour", used.iter().map(|&point| colour[point as usize]).collect()));
        }
        if let Some(intensity) = &cloud.intensity {
            let values = used.iter().map(|&point| intensity[point as usize]).collect();
            attributes.push(Attribute::f32("intensity", values));
        }
        if let Some(normals) = &cloud.normals {
            for (axis, name) in ["normal_x", "normal_y", "normal_z"].into_iter().enumerate() {
                let values = used.iter().map(|&point| normals[point as usize][axis]).collect();
                attributes.push(Attribute::f32(name, values));
            }
        }
        Ok(Reconstructed { mesh, report })
    }
}

/// Number of vertices that triangles have, of `count`.
fn used(triangles: &[[u32; 3]], count: usize) -> f64 {
    let mut is_used = vec![false; count];
    triangles.as_flattened().iter().for_each(|&vertex| is_used[vertex as usize] = true);
    is_used.into_iter().filter(|is| *is).count() as f64
}

impl Reconstructor<PointCloud> {
    /// Like [`Reconstructor::into_surface`], and gives back the places of the points as soon as they are sorted.
    pub(super) fn into_surface_of_its_own(
        mut self,
        params: &ReconstructParams,
        progress: &Progress<'_>,
    ) -> Result<Reconstructed> {
        self.is_kept = false;
        self.surface_with(params, |cloud| cloud.positions = Vec::new(), progress)
    }
}

impl Cells {
    /// `started`: when the sorting of the samples did.
    fn new(mut samples: Samples, started: Instant, threads: usize, progress: &Progress<'_>) -> Result<Self> {
        if samples.points.len() < 4 {
            return Err(Error::input(format!(
                "a surface needs at least 4 different points with finite coordinates; of {} given, {} are",
                samples.given(),
                samples.points.len()
            )));
        }
        progress.check()?;
        progress.stage(0, samples.points.len() as u64);
        let sorted = started.elapsed().as_secs_f64();
        let delaunay = Delaunay3::in_place(&mut samples.points, threads, progress)?;
        let seconds = vec![("sort", sorted), ("tetrahedralize", started.elapsed().as_secs_f64() - sorted)];
        Ok(Cells { samples, delaunay, separated: None, choices: None, seconds })
    }
}
