//! The driver: the stages in their order, and again with other parameters.

use std::borrow::Borrow;

use glam::DVec3;

use super::found::{Found, canonical};
use super::noise::INTERPOLATED;
use super::orient::{Witness, orient};
use super::params::{Closure, ReconstructParams, Threshold, Topology};
use super::plane::Plane;
use super::prepare::{Samples, prepare};
use super::report::{Dropped, Reason, ReconstructReport, Reconstructed};
use super::seen::{Seen, Sighted};
use super::smooth::{Smooth, Smoothing, smoothed};
use super::space::Space;
use base::error::{Error, Result};
use base::magnitude;
use base::memory;
use base::progress::{Progress, Seconds};
use geom::span;
use mesh::point_cloud::PointCloud;
use mesh::{Attribute, Crs, TriMesh};

/// At the peak. Measured: 350 on noisy surfaces, 660 on a sphere.
const BYTES_A_POINT: f64 = 400.0;
base::stages! {
    /// Stages with their shares of the time ...
    pub PLAN:
    SMOOTHING = "smoothing", 0.2;
    TETRAHEDRALIZING = "tetrahedralizing", 0.5;
    SEPARATING = "finding inside and outside", 0.2;
    BUILDING = "building the surface", 0.1;
}

/// Reconstructs a surface from a cloud. To try several parameters use a [`Reconstructor`].
///
/// # Errors
/// See [`Reconstructor::surface`].
pub fn run(cloud: &PointCloud, params: &ReconstructParams, progress: &Progress<'_>) -> Result<Reconstructed> {
    Reconstructor::new(cloud)?.into_surface(params, progress)
}

/// Like [`run`] in less memory: the places of the cloud's points are given back as soon as they are sorted, 24 bytes each.
///
/// # Errors
/// See [`Reconstructor::surface`].
pub fn run_owned(cloud: PointCloud, params: &ReconstructParams, progress: &Progress<'_>) -> Result<Reconstructed> {
    Reconstructor::new(cloud)?.into_surface_of_its_own(params, progress)
}
base::stages! {
    /// ... and of those that depend on the parameters.
    PLAN_AGAIN:
    SEPARATING_AGAIN = "finding inside and outside", 0.3;
    BUILDING_AGAIN = "building the surface", 0.7;
}

/// A cloud from which surfaces are made, with other parameters in a fraction of the time: what depends on the points only
/// is kept. `C` is a reference to the cloud, or shares it.
///
/// The surface does not depend on the surfaces before.
pub struct Reconstructor<C> {
    cloud: C,
    sensors: Vec<DVec3>,
    /// Point that parts of the surface are turned to, whoever saw them.
    toward: Option<DVec3>,
    prepared: Option<Prepared>,
    /// Whether what depends on the points only is kept for the next surface.
    is_kept: bool,
}

/// State that depends on the points only.
struct Prepared {
    samples: Samples,
    /// Smoothing of them.
    smooth: Smooth,
    smoothing: Smoothing,
    shape: Shape,
    /// Times that this took.
    seconds: Seconds,
}

/// Span of the samples, divided.
enum Shape {
    Plane(Plane),
    Space(Space),
}

impl<C: Borrow<PointCloud> + Sync + Send> Reconstructor<C> {
    /// Takes a cloud. O(1): the points are tetrahedralized for the first surface.
    ///
    /// # Errors
    /// Attributes of another length than the points. A sensor that isn't finite.
    pub fn new(cloud: C) -> Result<Self> {
        let points = cloud.borrow();
        Crs::lengths(points.crs.as_ref())?;
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
        let sensors: Vec<DVec3> = points.sensor.into_iter().collect();
        check_sensors(&sensors, count)?;
        Ok(Reconstructor { cloud, sensors, toward: None, prepared: None, is_kept: true })
    }

    /// The cloud.
    pub fn cloud(&self) -> &PointCloud {
        self.cloud.borrow()
    }

    /// Says where the points were seen from, in the cloud's frame, instead of the cloud's own sensor. It is one place for all, or one per
    /// point, three NaN if that is not known. Parts of the surface are then turned towards it. If points carry noise it also tells the
    /// sides of thin walls apart, and what is inside. Open surfaces span no jumps, over which sensors looked from one point past it at
    /// another, and no gaps and holes through which points were seen. A surface that was seen from one side only is closed only if that is
    /// asked for. A jump is told only between points whose sensors are all known. If those of every second point are not, there are none.
    /// Goes before the cloud's normals, which count where it is not known.
    ///
    /// # Errors
    /// Neither one place nor one per point. A coordinate that isn't finite.
    pub fn seen_from(&mut self, sensors: Vec<DVec3>) -> Result<()> {
        let points = self.cloud().positions.len();
        if sensors.len() != 1 && sensors.len() != points {
            let given = sensors.len();
            return Err(Error::input(format!("{given} sensor origins for {points} points: give one, or one a point")));
        }
        check_sensors(&sensors, points)?;
        self.sensors = if sensors.iter().all(is_unknown) { Vec::new() } else { sensors };
        // The points are smoothed by them.
        self.prepared = None;
        Ok(())
    }

    /// Turns parts of the surface towards a place in the cloud's frame, whatever normals and sensors say. Nothing else follows from it: the
    /// points need not have been seen from there.
    ///
    /// # Errors
    /// A coordinate that isn't finite.
    pub fn turn_toward(&mut self, place: DVec3) -> Result<()> {
        magnitude::place("toward, the place that the surface is turned to,", place)?;
        self.toward = Some(place);
        Ok(())
    }

    /// Makes a surface: the first in O(n log n) in practice for n points, others in a fifth of the time or less.
    ///
    /// # Errors
    /// Parameters out of range. Fewer than three different points, or all on one line. A closed surface asked for of points in one plane.
    /// Points without a surface. [`Error::OutOfMemory`]. [`Error::Cancelled`].
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
        // Points that were smoothed otherwise are of no use.
        self.prepared.take_if(|prepared| prepared.smooth != Smooth::of(params));
        progress.plan(if self.prepared.is_none() { PLAN } else { PLAN_AGAIN });
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
        let stages = match &self.prepared {
            Some(prepared) => {
                progress.count_from(prepared.seconds.clone());
                [SEPARATING_AGAIN, BUILDING_AGAIN]
            }
            None => {
                self.prepared = Some(self.prepare(params, release, progress)?);
                [SEPARATING, BUILDING]
            }
        };
        let (mut found, mut report) = self.facets(params, stages, progress)?;
        canonical(&mut found.triangles, progress)?;
        report.turned_parts = self.orient(&mut found.triangles, found.is_outward, progress)?;
        let mut made = self.finish(found.triangles, &found.enclosed, report, progress)?;
        progress.lap("surface");
        made.report.seconds = progress.seconds();
        Ok(made)
    }

    /// State that depends on the points only: sorted, smoothed, and what they span divided.
    fn prepare(
        &mut self,
        params: &ReconstructParams,
        release: impl FnOnce(&mut C),
        progress: &Progress<'_>,
    ) -> Result<Prepared> {
        let positions = &self.cloud().positions;
        memory::expect_each(positions.len(), BYTES_A_POINT, 0.0, "a surface through", "points")?;
        let samples = prepare(positions, progress)?;
        release(&mut self.cloud);
        progress.lap("sort");
        Prepared::new(samples, self.seen(), params, progress)
    }

    /// The facets of the surface in any order and turned either way, and what is known so far. `stages` are those of the plan that find the
    /// sides and the surface.
    fn facets(
        &mut self,
        params: &ReconstructParams,
        stages: [usize; 2],
        progress: &Progress<'_>,
    ) -> Result<(Found, ReconstructReport)> {
        let is_kept = self.is_kept;
        let seen = Seen { normals: self.cloud.borrow().normals.as_deref(), sensors: &self.sensors };
        let Prepared { samples, smoothing, shape, .. } = self.prepared.as_mut().expect("made before the surface");
        let mut report = ReconstructReport {
            points: samples.given(),
            noise: smoothing.noise.deviation / samples.factor,
            spacing: smoothing.noise.spacing / samples.factor,
            smoothing: smoothing.radius / samples.factor,
            ..ReconstructReport::default()
        };
        let found = match shape {
            Shape::Plane(plane) => {
                progress.stage(stages[1], 1);
                plane.surface(&samples.points, params, &mut report, progress)?
            }
            Shape::Space(space) => {
                space.surface(Sighted { samples, seen }, params, stages, is_kept, &mut report, progress)?
            }
        };
        if found.triangles.is_empty() {
            return Err(no_surface(params));
        }
        if params.threshold == Threshold::Global {
            report.threshold /= samples.factor;
        }
        Ok((found, report))
    }

    fn seen(&self) -> Seen<'_> {
        Seen { normals: self.cloud().normals.as_deref(), sensors: &self.sensors }
    }

    fn samples(&self) -> &Samples {
        &self.prepared.as_ref().expect("made before the surface").samples
    }

    fn orient(&self, triangles: &mut [[u32; 3]], is_outward: bool, progress: &Progress<'_>) -> Result<usize> {
        let samples = self.samples();
        let seen = self.seen();
        let toward = self.toward.map(|place| place * samples.factor);
        let front = |v: u32| match toward {
            Some(place) => (place - samples.points[v as usize]).normalize_or_zero(),
            None => Sighted { samples, seen }.front(v as usize),
        };
        let is_told = toward.is_some() || !seen.is_nothing();
        let witness = if is_told { Witness::Fronts(&front) } else { Witness::None };
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
        let Smoothing { moved, measured, .. } = &self.prepared.as_ref().expect("made before the surface").smoothing;
        let mut squares = 0.0;
        for (i, (sample, &point)) in samples.points.iter().zip(&samples.input).enumerate() {
            if let Some(position) = positions.get_mut(number[point as usize] as usize) {
                *position = *measured.get(i).unwrap_or(sample) / samples.factor;
                squares += moved.get(i).map_or(0.0, |moved| moved * moved);
            }
        }
        report.moved = (squares / used.len().max(1) as f64).sqrt() / samples.factor;
        progress.check()?;
        let mut mesh = TriMesh::new(positions, triangles);
        mesh.crs = cloud.crs_of_frame();
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

impl Prepared {
    fn new(samples: Samples, seen: Seen<'_>, params: &ReconstructParams, progress: &Progress<'_>) -> Result<Self> {
        progress.stage(SMOOTHING, 3 * samples.points.len() as u64);
        let (mut samples, mut smoothing) = smoothed(samples, seen, Smooth::of(params), progress)?;
        let corners = span::of(&samples.points, progress)?;
        if corners.len() < 3 {
            return Err(no_plane(&samples));
        }
        progress.lap("smooth");
        progress.stage(TETRAHEDRALIZING, samples.points.len() as u64);
        let shape = match corners[..] {
            [a, b, c] => Shape::Plane(Plane::new(&samples.points, [a, b, c], progress)?),
            _ => match Plane::along(&mut samples, &mut smoothing, progress)? {
                Some(plane) => Shape::Plane(plane),
                None => {
                    let is_noisy = smoothing.noise.spacings() > INTERPOLATED;
                    Shape::Space(Space::new(&mut samples.points, is_noisy, params.threads, progress)?)
                }
            },
        };
        progress.lap("tetrahedralize");
        Ok(Prepared { samples, smooth: Smooth::of(params), smoothing, shape, seconds: progress.seconds() })
    }
}

/// Whether a sensor stands for one that is not known, if there is one per point.
fn is_unknown(sensor: &DVec3) -> bool {
    sensor.is_nan_mask().all()
}

/// Refuses sensors that are nowhere, or too far away to be computed with.
fn check_sensors(sensors: &[DVec3], points: usize) -> Result<()> {
    let is_each = sensors.len() > 1 && sensors.len() == points;
    let is_place = |sensor: &DVec3| sensor.is_finite() || (is_each && is_unknown(sensor));
    if let Some(i) = sensors.iter().position(|sensor| !is_place(sensor)) {
        let number = if sensors.len() > 1 { format!(" {i}") } else { String::new() };
        let remedy = if is_each {
            "three finite coordinates, or three NaN where it is not known"
        } else {
            "three finite coordinates, or no sensor where it is not known"
        };
        let at = magnitude::shown(sensors[i]);
        return Err(Error::input(format!("sensor origin{number} lies at {at}, which is no place: give {remedy}")));
    }
    if !is_each || !sensors.iter().any(is_unknown) {
        return magnitude::points("sensor origin", sensors);
    }
    let known = |sensor: &DVec3| if is_unknown(sensor) { DVec3::ZERO } else { *sensor };
    magnitude::points("sensor origin", &sensors.iter().map(known).collect::<Vec<_>>())
}

/// Reason why there is no surface through samples that span no plane.
fn no_plane(samples: &Samples) -> Error {
    let (given, different) = (samples.given(), samples.points.len());
    Error::input(if different < 3 {
        format!(
            "a surface needs at least 3 different points with finite coordinates, but of {given} given, {different} are"
        )
    } else {
        format!("the {different} different points lie on one line, which bounds no surface: give points beside it, too")
    })
}

fn no_surface(params: &ReconstructParams) -> Error {
    if params.topology == Topology::Free {
        return Error::input(
            "no surface was found: a free topology carves wherever a facet is above the threshold, and nothing was \
                left. Raise the factor, or let the topology be manifold.",
        );
    }
    let remedy = match params.closure {
        Closure::Auto => "Give samples of a surface",
        Closure::Closed | Closure::Open => "Let the closure be auto",
    };
    Error::input(format!(
        "no surface was found: the points fill a volume or lie along curves, or are too noisy for what was asked. {remedy}."
    ))
}
