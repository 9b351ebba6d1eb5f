//! The driver: the stages in their order, for one resolution or a chain of them.

use std::sync::Arc;

use super::connect::Repairs;
use super::creases::{Creases, Pieces, sharp_edges};
use super::flip::Goal;
use super::kmeans::KMeans;
use super::net::{Net, Size};
use super::params::{ClusterParams, Resolution};
use super::polygons::Polygons;
use super::report::{ClusterReport, Clustered, TriangleShapes};
use super::subcluster;
use super::surface::Surface;
use super::{collapse, density, fans, features, finish, fit, flip, mend, polish, relax};
use base::error::Result;
use base::magnitude;
use base::memory;
use base::progress::{Plan, Progress};
use geom::bvh::Bvh;
use mesh::certify;
use mesh::dump::{self, Stage};
use mesh::measure::DistanceReport;
use mesh::point_cloud::PointCloud;
use mesh::{AttributeData, Crs, TriMesh};
use reconstruct::{self, ReconstructParams, Reconstructor};

/// At the peak, where the error is measured: the tree over the input's triangles, and the parts of them that are in doubt. Measured: 190 of a
/// head, where the largest error is in few places, and 900 of a ball, where it is everywhere. Where vertices leave the surface, their terms
/// take 370 before that.
const BYTES_A_TRIANGLE: f64 = 500.0;
const BYTES_A_VERTEX: f64 = 105.0;

base::stages! {
    /// Stages with their shares of the time: of a mesh ...
    pub PLAN:
    CLUSTERING = "clustering", 1.0;
}
/// ... and of points, which become a mesh first, by the stages of another operation.
const POINTS_PLAN: Plan = &[
    reconstruct::PLAN[0],
    reconstruct::PLAN[1],
    reconstruct::PLAN[2],
    reconstruct::PLAN[3],
    (PLAN[CLUSTERING].0, 0.5),
];
/// Steps that splitting and mending take of a level's progress, besides those that the parameters bound.
const OTHER_STEPS: u64 = 130;
/// Rounds for a largest error that are taken as its progress.
const USUAL_REFINEMENTS: u64 = 12;

/// Lloyd steps end when one gains less than this share of the energy.
const CONVERGED: f64 = 2e-4;
/// The same where the patches' nodes are taken away again and moved.
const NEARLY_CONVERGED: f64 = 2e-3;
/// Patches from which it is measured then where they err most: a third of fewer tells nothing of the rest.
const MEASURED: usize = 200;
/// Relaxation steps after each round of flips.
const STEPS_A_ROUND: usize = 20;

/// Clusters a mesh at one resolution.
///
/// # Guarantees
/// * The result is an oriented manifold with boundary that has the topology of the input: components, boundary loops and genus. If the
///   input is none, its edges of more than two triangles, or of two that turn against each other, are cut, and vertices where several fans
///   meet are doubled.
/// * Its vertices lie on the input's surface, unless `fitting` or `min_angle` lets them leave it. Those of its border lie on the input's
///   border.
/// * With `min_angle` no triangle has a smaller angle, unless borders, creases or the topology leave it no other place.
/// * With [`Resolution::Triangles`] there are as many triangles as asked for, or one fewer. More come only where the topology needs them,
///   fewer only where the input has no place for so many.
/// * No point of the input is farther than [`ClusterReport::max_error`] from the result, and none of the result farther from the input:
///   between the vertices, too. With [`Resolution::MaxError`] that is no more than was asked for.
/// * If nothing coarser than the input is found that does what was asked for, the result is the input itself, cut as said above.
/// * The same input gives the same mesh for any number of threads.
///
/// # Cost
/// n vertices, k patches: O((n + k log k) s) time for s Lloyd steps, about 3 + 2 log2 k of them while splitting and up to `iterations`
/// more. O(v) for v resulting vertices and each relaxation step. O(n log v + v log n) for measuring. With `min_angle` O(n + v log v) more.
/// About 300 bytes per triangle, up to 1,000 where the error is the same everywhere, as on a ball.
///
/// # Errors
/// Parameters out of range. Bad indices or coordinates, no triangle. [`base::Error::Cancelled`].
pub fn run(mesh: &TriMesh, params: &ClusterParams, progress: &Progress<'_>) -> Result<Clustered> {
    let mut levels = levels(mesh, &[params.resolution], params, progress)?;
    Ok(levels.remove(0))
}

/// A chain of levels of detail from one run: the finer levels go on splitting the patches of the coarser ones. Results are
/// in the order of `resolutions`, whose place in `params` is not looked at.
///
/// # Errors
/// As [`run`].
pub fn levels(
    mesh: &TriMesh,
    resolutions: &[Resolution],
    params: &ClusterParams,
    progress: &Progress<'_>,
) -> Result<Vec<Clustered>> {
    params.validate()?;
    resolutions.iter().try_for_each(|r| r.validate())?;
    Crs::lengths(mesh.crs.as_ref())?;
    progress.plan(PLAN);
    let pool = base::threads::pool(params.threads)?;
    progress.run(&pool, || chain(mesh, resolutions, params, CLUSTERING, progress))
}

/// Clusters points at one resolution: the surface through them, as [`reconstruct::run`] finds it, is clustered.
///
/// Labels are those of the points, -1 for points that are not on that surface. [`ClusterReport::off_surface`] counts these. A largest error
/// holds for the points on it. The result stands in the cloud's own frame. Colours, intensities and normals ride along as vertex
/// attributes.
///
/// # Errors
/// As [`run`], and those of [`reconstruct::run`]: fewer than three different points, or all on one line, or no surface.
pub fn run_points(cloud: &PointCloud, params: &ClusterParams, progress: &Progress<'_>) -> Result<Clustered> {
    let mut levels = levels_of_points(cloud, &[params.resolution], params, progress)?;
    Ok(levels.remove(0))
}

/// A chain of levels of detail of points. See [`run_points`] and [`levels`].
///
/// # Errors
/// As [`run_points`].
pub fn levels_of_points(
    cloud: &PointCloud,
    resolutions: &[Resolution],
    params: &ClusterParams,
    progress: &Progress<'_>,
) -> Result<Vec<Clustered>> {
    params.validate()?;
    resolutions.iter().try_for_each(|r| r.validate())?;
    progress.plan(POINTS_PLAN);
    let pool = base::threads::pool(params.threads)?;
    progress.run(&pool, || {
        let reconstruct = ReconstructParams { threads: params.threads, ..ReconstructParams::default() };
        let through = Reconstructor::new(cloud)?.into_surface_within(&reconstruct, progress)?;
        let (mut mesh, sources) = (through.mesh, "source_point");
        let Some(AttributeData::I32(points)) = mesh.vertex_attribute(sources).cloned() else {
            unreachable!("every surface through points says which they are")
        };
        // The point that a vertex was says nothing about the vertices of the result.
        mesh.vertex_attributes.retain(|a| a.name != sources);
        let through_points = through.report.seconds.iter().map(|lap| lap.1).sum();
        progress.count_from(vec![("surface through the points", through_points)]);
        let mut chain = chain(&mesh, resolutions, params, reconstruct::PLAN.len(), progress)?;
        for level in &mut chain {
            let mut labels = vec![-1; cloud.positions.len()];
            for (&point, &label) in points.iter().zip(&level.labels) {
                labels[point as usize] = label;
            }
            level.labels = labels;
            level.report.off_surface = through.report.dropped.len();
        }
        Ok(chain)
    })
}

/// The levels of a chain, on the pool. `stage` of the plan is the clustering.
fn chain(
    mesh: &TriMesh,
    resolutions: &[Resolution],
    params: &ClusterParams,
    stage: usize,
    progress: &Progress<'_>,
) -> Result<Vec<Clustered>> {
    magnitude::points("vertex", &mesh.positions)?;
    let triangles = mesh.triangles.len();
    let vertices = BYTES_A_VERTEX * mesh.positions.len() as f64;
    memory::expect_each(triangles, BYTES_A_TRIANGLE, vertices, "clustering", "triangles")?;
    progress.stage(stage, resolutions.iter().map(|&r| steps(r, params)).sum());
    let surface = Surface::new(mesh, progress)?;
    let sharp = sharp_edges(&surface, params.feature_angle, progress)?;
    let job = Job { input: mesh, weights: point_weights(&surface), surface, sharp, params };
    // Coarse to fine; bounds on the error find their own number last.
    let mut order: Vec<usize> = (0..resolutions.len()).collect();
    order.sort_by_key(|&i| job.patches(resolutions[i]).unwrap_or(usize::MAX));
    let mut kmeans = KMeans::new(&job.surface.points, &job.weights, u64::from(params.seed));
    let mut results: Vec<Option<Clustered>> = vec![None; resolutions.len()];
    progress.lap("surface");
    let prepared = progress.seconds();
    let mut done = 0;
    for i in order {
        progress.count_from(prepared.clone());
        let mut level = match resolutions[i] {
            Resolution::MaxError(error) => job.within(&kmeans, error, progress)?,
            resolution => job.level(&mut kmeans, resolution, progress)?,
        };
        level.report.seconds = progress.seconds();
        results[i] = Some(level);
        // Levels converge sooner than they may.
        done += steps(resolutions[i], params);
        progress.reach(done);
    }
    Ok(results.into_iter().flatten().collect())
}

/// Steps of Lloyd's and of the relaxation that a level takes at most, nearly: what its progress counts.
fn steps(resolution: Resolution, params: &ClusterParams) -> u64 {
    let (lloyd, relaxation) = (u64::from(params.iterations), u64::from(params.relaxation));
    match resolution {
        Resolution::MaxError(_) => USUAL_REFINEMENTS * (relaxation + OTHER_STEPS),
        _ => lloyd + relaxation + OTHER_STEPS,
    }
}

/// Areas, but never nothing: a point without area has its place in a patch all the same.
fn point_weights(surface: &Surface) -> Vec<f64> {
    let mean = surface.areas.iter().sum::<f64>() / surface.areas.len() as f64;
    if !(mean > 0.0) {
        return vec![1.0; surface.areas.len()];
    }
    surface.areas.iter().map(|a| a.max(1e-9 * mean)).collect()
}

pub(super) struct Job<'a> {
    input: &'a TriMesh,
    pub(super) surface: Surface,
    weights: Vec<f64>,
    /// Edges that creases are made of.
    sharp: Vec<u32>,
    pub(super) params: &'a ClusterParams,
}

/// The fate of nodes beside thin rims.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Rims {
    /// They slide onto the rims.
    Drawn,
    /// They stay: a largest error finds places that are off by itself, in round after round.
    AsTheyCome,
}

/// Patches that are disks, and the polygons around them.
pub(super) struct Disks {
    labels: Vec<u32>,
    patches: usize,
    polygons: Polygons,
    creases: Arc<Creases>,
    repairs: Repairs,
    energy: f64,
}

impl Disks {
    /// Nodes of their fans.
    pub(super) fn nodes(&self) -> usize {
        self.patches + self.polygons.spots.len()
    }

    /// The number of what `wanted` counts that their fans have.
    pub(super) fn size(&self, wanted: Size) -> usize {
        wanted.choose(self.nodes(), self.polygons.nodes.len())
    }
}

impl<'a> Job<'a> {
    /// One level that is not bounded by an error. `kmeans` is that of a coarser level, and this level's afterwards.
    fn level(&self, kmeans: &mut KMeans<'a>, resolution: Resolution, progress: &Progress<'_>) -> Result<Clustered> {
        let wanted = self.wanted(resolution);
        if wanted.is_some_and(|w| w.count() < self.input_size(w)) && self.is_coarsest() {
            return self.input_itself(progress);
        }
        let patches = self.patches(resolution).expect("no bound on the error");
        let coarser = kmeans.clone();
        let mut disks = self.disks(&coarser, kmeans, patches, progress)?;
        // Of the nodes that patches make to spare it takes no certain number.
        let enough = |w: Size| self.params.min_angle > 0.0 && 4 * disks.size(w) >= 5 * w.count();
        if let Some(wanted) = wanted.filter(|&w| !enough(w)).map(|w| self.made(w)) {
            disks = self.with_nodes(&coarser, kmeans, disks, patches, wanted, progress)?;
        }
        progress.lap("patches");
        match self.make(disks, wanted, self.params.relaxation, Rims::Drawn, progress)? {
            Some(made) => self.measured(made, progress),
            None => self.input_itself(progress),
        }
    }

    /// A level with its largest error, both ways.
    fn measured(&self, made: Made, progress: &Progress<'_>) -> Result<Clustered> {
        let reference = self.cut_input();
        let threads = rayon::current_num_threads();
        let from = |mesh: &TriMesh, other: &TriMesh, known: f64| {
            let bvh = Bvh::build_with(&other.positions, &other.triangles, threads, progress)?;
            certify::certify_within(mesh, other, &bvh, known, progress)
        };
        let there = from(&reference, &made.mesh, 0.0)?;
        let back = from(&made.mesh, &reference, there.reached)?;
        progress.lap("measure");
        Ok(made.into_result(there.vertices.summary, there.bound.max(back.bound)))
    }

    /// The number of what `wanted` counts that the input has when it is cut to a manifold.
    fn input_size(&self, wanted: Size) -> usize {
        wanted.choose(self.surface.points.len(), self.surface.triangles.len())
    }

    /// Whether no surface of the input's topology has fewer vertices, each part being a single triangle.
    fn is_coarsest(&self) -> bool {
        3 * self.surface.triangles.len() == self.surface.points.len()
    }

    /// Splits to `patches` from the coarser level, or from one patch if that has more, and makes the patches disks.
    pub(super) fn disks(
        &self,
        coarser: &KMeans<'a>,
        kmeans: &mut KMeans<'a>,
        patches: usize,
        progress: &Progress<'_>,
    ) -> Result<Disks> {
        *kmeans = if coarser.centres.len() <= patches { coarser.clone() } else { coarser.restarted() };
        // The patches that err most are found while they are few, and again as they become more. With a least angle they are but a start.
        let to_the_least = self.params.min_angle > 0.0;
        let parts: &[usize] = match self.params.adaptivity > 0.0 {
            true if to_the_least && patches < MEASURED => &[],
            true if to_the_least => &[3],
            true => &[4, 2, 1],
            false => &[],
        };
        for part in parts {
            kmeans.split_to(patches / part, progress)?;
            let (labels, patches) = (&kmeans.labels, kmeans.centres.len());
            let weights = density::weights(
                &self.surface,
                &self.sharp,
                &self.weights,
                labels,
                patches,
                self.params.adaptivity,
                progress,
            )?;
            kmeans.set_weights(weights);
        }
        kmeans.split_to(patches, progress)?;
        let tolerance = if to_the_least { NEARLY_CONVERGED } else { CONVERGED };
        kmeans.lloyd(self.params.iterations as usize, tolerance, progress)?;
        self.repaired(kmeans, progress)
    }

    pub(super) fn repaired(&self, kmeans: &KMeans<'_>, progress: &Progress<'_>) -> Result<Disks> {
        let surface = &self.surface;
        let creases = Creases::of(surface, &self.sharp, kmeans.centres.len(), progress)?;
        let drawn;
        let kmeans = if creases.is_empty() {
            kmeans
        } else {
            let mut copy = kmeans.clone();
            creases.attract(surface, &mut copy, progress)?;
            drawn = copy;
            &drawn
        };
        let mut labels = kmeans.labels.clone();
        let (patches, mut polygons, repairs) = subcluster::make_disks(surface, &self.weights, &mut labels, progress)?;
        if !creases.is_empty() {
            let pieces = Pieces::of(&creases, surface, &labels, patches);
            polygons = Polygons::trace(surface, &labels, Some(&pieces));
        }
        Ok(Disks { labels, patches, polygons, creases: Arc::new(creases), repairs, energy: kmeans.energy() })
    }

    /// Fans of the patches, relaxed. `None` if the topology leaves more than is wanted, and more than the input has.
    pub(super) fn make(
        &self,
        disks: Disks,
        wanted: Option<Size>,
        relaxation: u32,
        rims: Rims,
        progress: &Progress<'_>,
    ) -> Result<Option<Made>> {
        let surface = &self.surface;
        dump::stage("cluster-1-patches", || Stage {
            values: disks.labels.iter().map(|&label| label as i32 + 1).collect(),
            ..self.stage_of(self.cut_input())
        })?;
        let creases = Arc::clone(&disks.creases);
        let pieces = (!creases.is_empty()).then(|| Pieces::of(&creases, surface, &disks.labels, disks.patches));
        let mut net =
            fans::mesh(surface, &self.weights, &disks.labels, disks.patches, &disks.polygons, pieces.as_ref());
        net.creases = Arc::clone(&creases);
        let before = net.shape(progress)?;
        dump::stage("cluster-2-fans", || self.stage_of(finish::mesh(surface, self.input, net.clone())))?;
        progress.lap("fans");
        let steps = relaxation as usize;
        let few = steps.min(STEPS_A_ROUND);
        relax::relax(surface, &mut net, steps, progress)?;
        let to_the_least = self.params.min_angle > 0.0;
        let too_large = |net: &Net| wanted.is_some_and(|w| w.had(net) > w.count().max(self.input_size(w)));
        if let Some(wanted) = wanted.filter(|_| !to_the_least) {
            collapse::collapse(surface, &mut net, wanted, progress)?;
            if too_large(&net) {
                return Ok(None);
            }
        }
        if steps > 0 {
            for goal in [Goal::Valence, Goal::Valence, Goal::Angle] {
                flip::flips(&mut net, goal, progress)?;
                relax::relax(surface, &mut net, few, progress)?;
            }
            mend::mend(surface, &mut net, wanted, progress)?;
            mend::release(surface, &mut net, progress)?;
            features::keep(surface, &mut net, progress)?;
        }
        if rims == Rims::Drawn && steps > 0 && !to_the_least {
            polish::rims(surface, &mut net, progress)?;
        }
        net.let_go();
        progress.lap("relax");
        let rounds = self.params.fitting as usize;
        if to_the_least {
            polish::polish(surface, &mut net, wanted, rounds, self.params.min_angle, progress)?;
            if too_large(&net) {
                return Ok(None);
            }
        } else {
            fit::fit(surface, &mut net, rounds, progress)?;
        }
        progress.lap("fit");
        self.finish(disks, net, before, progress).map(Some)
    }

    fn finish(&self, disks: Disks, net: Net, before: TriangleShapes, progress: &Progress<'_>) -> Result<Made> {
        let labels = self.labels(disks.labels.iter().copied());
        let after = net.shape(progress)?;
        let mesh = finish::mesh(&self.surface, self.input, net);
        let report = ClusterReport {
            patches: disks.patches,
            vertices: mesh.positions.len(),
            triangles: mesh.triangles.len(),
            energy: disks.energy / self.surface.frame.length_inward(1.0).powi(4),
            separated: disks.repairs.separated,
            dissolved: disks.repairs.dissolved,
            halved: disks.repairs.halved,
            cut_edges: self.surface.cut_edges,
            before,
            after,
            ..ClusterReport::default()
        };
        Ok(Made { mesh, labels, report })
    }

    /// A mesh to look at.
    fn stage_of(&self, mesh: TriMesh) -> Stage {
        Stage { positions: mesh.positions, triangles: mesh.triangles, values: Vec::new() }
    }

    /// Labels of the input's vertices from those of the surface's.
    fn labels(&self, of_surface: impl Iterator<Item = u32>) -> Vec<i32> {
        let mut labels = vec![-1; self.input.positions.len()];
        for (&origin, label) in self.surface.origins.iter().zip(of_surface) {
            labels[origin as usize] = label as i32;
        }
        labels
    }

    /// The input cut to a manifold, without attributes.
    pub(super) fn cut_input(&self) -> TriMesh {
        let positions = self.surface.origins.iter().map(|&v| self.input.positions[v as usize]).collect();
        TriMesh::new(positions, self.surface.triangles.clone())
    }

    /// The input as the result, cut where it is no manifold.
    pub(super) fn input_itself(&self, progress: &Progress<'_>) -> Result<Clustered> {
        let mut mesh = self.cut_input();
        let places: Vec<usize> = self.surface.origins.iter().map(|&v| v as usize).collect();
        mesh.vertex_attributes = self.input.vertex_attributes.iter().map(|a| a.gather(&places)).collect();
        let shapes = TriangleShapes::of(&mesh, progress)?;
        let report = ClusterReport {
            patches: mesh.positions.len(),
            vertices: mesh.positions.len(),
            triangles: mesh.triangles.len(),
            cut_edges: self.surface.cut_edges,
            before: shapes.clone(),
            after: shapes,
            kept_input: true,
            ..ClusterReport::default()
        };
        Ok(Clustered { labels: self.labels(0..mesh.positions.len() as u32), mesh, report })
    }
}

/// A result without its times.
pub(super) struct Made {
    pub(super) mesh: TriMesh,
    labels: Vec<i32>,
    report: ClusterReport,
}

impl Made {
    /// With the distances of the input's vertices to the mesh, and with the distance that no point of one is farther from the other.
    pub(super) fn into_result(self, deviation: DistanceReport, max_error: f64) -> Clustered {
        let rms_error = deviation.rms;
        let report = ClusterReport { deviation, max_error, rms_error, ..self.report };
        Clustered { mesh: self.mesh, labels: self.labels, report }
    }
}
