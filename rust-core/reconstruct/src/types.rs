//! What goes in and what comes out.

use base::error::Result;
use base::params::{Default, ParamSpec, Unit};
use mesh::TriMesh;

/// Parameters of the reconstruction.
pub const PARAMS: &[ParamSpec] = &[
    ParamSpec {
        operation: "reconstruct",
        name: "factor",
        unit: Unit::Ratio,
        default: Default::Value(1.0),
        min: 1.0,
        min_excluded: false,
        max: 2.0,
        text: "Makes the threshold on the perimeters of facets larger. Larger closes more gaps and keeps more stray points.",
    },
    ParamSpec {
        operation: "reconstruct",
        name: "threads",
        unit: Unit::Count,
        default: Default::Value(0.0),
        min: 0.0,
        min_excluded: false,
        max: 1024.0,
        text: "Worker threads, 0 for one a core. The result is the same for any number.",
    },
];

/// What the perimeter of a facet is compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Threshold {
    /// The mean over the whole surface, as in the paper.
    Global,
    /// The spacing of the samples around it: sparse parts may have large facets.
    Local,
}

/// What the surface may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Topology {
    /// The paper's carving: closed, but not manifold where parts touch, and without the samples carved away.
    Free,
    /// No edge and no vertex that isn't manifold.
    Manifold,
}

/// Whether the samples are of a closed surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Closure {
    /// Closed if a closed surface goes through more than half of the samples at once, or through 99 % in the end; else open.
    Auto,
    /// Closed: gaps in the sampling are spanned by large facets.
    Closed,
    /// Facets above the threshold are left out, so that gaps stay open.
    Open,
}

/// How to reconstruct; see [`PARAMS`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReconstructParams {
    /// What perimeters are compared with.
    pub threshold: Threshold,
    /// What the surface may be.
    pub topology: Topology,
    /// Whether the samples are of a closed surface; only with [`Topology::Manifold`].
    pub closure: Closure,
    /// Factor of the threshold.
    pub factor: f64,
    /// Worker threads, 0 for one a core.
    pub threads: usize,
}

impl std::default::Default for ReconstructParams {
    fn default() -> Self {
        ReconstructParams {
            threshold: Threshold::Local,
            topology: Topology::Manifold,
            closure: Closure::Auto,
            factor: 1.0,
            threads: 0,
        }
    }
}

impl ReconstructParams {
    /// Checks the ranges.
    ///
    /// # Errors
    /// [`base::Error::Parameter`] for the first one out of range.
    pub fn validate(&self) -> Result<()> {
        PARAMS[0].check(self.factor)?;
        PARAMS[1].check(self.threads as f64)?;
        Ok(())
    }
}

/// Why a point is not on the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// A coordinate isn't a finite number.
    NotFinite,
    /// At the same place as a point before it.
    Duplicate,
    /// Inside the closed surface, out of its reach.
    Inside,
    /// Outside the surface: too far away for the threshold, or carved away.
    Outside,
}

/// A point that is not on the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dropped {
    /// Its place in the cloud.
    pub point: u32,
    /// Why.
    pub reason: Reason,
}

/// The figures of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReconstructReport {
    /// Points given.
    pub points: usize,
    /// Points on the surface.
    pub used: usize,
    /// Points not on the surface, in the order of their numbers.
    pub dropped: Vec<Dropped>,
    /// Delaunay tetrahedra.
    pub tetrahedra: usize,
    /// Whether the surface is closed: it has no border, also not one of a gap or of facets left out.
    pub closed: bool,
    /// The threshold used: a perimeter with a global one, a perimeter in mean spacings of the facet's samples with a
    /// local one.
    pub threshold: f64,
    /// Times the mean perimeter was taken, with the paper's carving.
    pub rounds: usize,
    /// Cells that changed sides to make the surface manifold, and samples brought onto it afterwards.
    pub repaired: [usize; 2],
    /// Facets left out: those over gaps, and those that kept the surface from being manifold.
    pub cut_facets: usize,
    /// Parts turned over by normals, sensors or direction.
    pub turned_parts: usize,
    /// Names of the stages with their wall-clock seconds.
    pub seconds: Vec<(&'static str, f64)>,
}

impl ReconstructReport {
    /// Points dropped for a reason.
    pub fn dropped_for(&self, reason: Reason) -> usize {
        self.dropped.iter().filter(|dropped| dropped.reason == reason).count()
    }
}

/// Result of a reconstruction.
///
/// The mesh stands in the cloud's own frame; its vertices are the used points in the order of the cloud. Vertex attributes:
/// `source_point` (i32, place in the cloud), `colour`, `intensity` and `normal_x`, `normal_y`, `normal_z` where the cloud has
/// them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reconstructed {
    /// The surface.
    pub mesh: TriMesh,
    /// Figures of the run.
    pub report: ReconstructReport,
}
