//! Marching Intersections: registered scans -> one surface. \[MI04\]

pub mod source;

pub use source::{OrientedSurface, PlacedMesh, ScanSource};

use crate::error::{Error, Result};
use crate::mesh::TriMesh;
use crate::params::{Default, ParamSpec, Unit};
use crate::progress::Progress;
use crate::triangulate::TriangulateParams;

/// Parameters of the merge.
pub const PARAMS: &[ParamSpec] = &[
    ParamSpec {
        operation: "merge",
        name: "voxel",
        unit: Unit::WorldLength,
        default: Default::FromData("three times the mean nearest-neighbour distance within a scan"),
        min: 0.0,
        min_excluded: true,
        max: f64::INFINITY,
        text: "Size of a cell of the grid. Smaller keeps more detail and costs time and memory with its inverse square.",
    },
    ParamSpec {
        operation: "merge",
        name: "merge_distance",
        unit: Unit::WorldLength,
        default: Default::FromData("from the voxel and the measured distance between overlapping scans"),
        min: 0.0,
        min_excluded: false,
        max: f64::INFINITY,
        text: "Surfaces of different scans closer than this, facing the same way, become one. Choose it above the residual of the registration and below the thinnest wall.",
    },
    ParamSpec {
        operation: "merge",
        name: "max_hole_length",
        unit: Unit::WorldLength,
        default: Default::FromData("40 voxels"),
        min: 0.0,
        min_excluded: false,
        max: f64::INFINITY,
        text: "Holes whose boundary is at most this long are closed; 0 leaves all open.",
    },
    ParamSpec {
        operation: "merge",
        name: "min_component_share",
        unit: Unit::Ratio,
        default: Default::Value(0.01),
        min: 0.0,
        min_excluded: false,
        max: 1.0,
        text: "Connected parts with a smaller share of the triangles are dropped; 0 keeps all.",
    },
    ParamSpec {
        operation: "merge",
        name: "threads",
        unit: Unit::Count,
        default: Default::Value(0.0),
        min: 0.0,
        min_excluded: false,
        max: 1024.0,
        text: "Worker threads, 0 for one a core. The result is the same for any number.",
    },
];

/// What to merge with; see [`PARAMS`]. Lengths in world units; `None`: measured from the data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MergeParams {
    /// Size of a cell of the grid.
    pub voxel: Option<f64>,
    /// Surfaces of different scans closer than this, facing the same way, become one.
    pub merge_distance: Option<f64>,
    /// Longest boundary of a hole that is closed; `Some(0.0)` leaves all open.
    pub max_hole_length: Option<f64>,
    /// Connected parts with a smaller share of the triangles are dropped.
    pub min_component_share: f64,
    /// How range images are triangulated.
    pub triangulation: TriangulateParams,
    /// Worker threads, 0 for one a core.
    pub threads: usize,
}

impl std::default::Default for MergeParams {
    fn default() -> Self {
        MergeParams {
            voxel: None,
            merge_distance: None,
            max_hole_length: None,
            min_component_share: 0.01,
            triangulation: TriangulateParams::default(),
            threads: 0,
        }
    }
}

/// The figures of a run, among them those of the paper's Tables 1 and 2.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MergeReport {
    /// Scans merged.
    pub scans: usize,
    /// Triangles of all scans.
    pub input_triangles: u64,
    /// Cell size used, world units.
    pub voxel: f64,
    /// Merge distance used, world units.
    pub merge_distance: f64,
    /// Longest boundary that was closed, world units.
    pub max_hole_length: f64,
    /// Median distance between overlapping scans along grid lines, as measured; `None` where none overlap.
    pub overlap_residual: Option<f64>,
    /// Cells spanned by the scans along x, y and z.
    pub grid: [u64; 3],
    /// Intersections of scans with grid lines.
    pub intersections: u64,
    /// Intersections left after fusing.
    pub fused_intersections: u64,
    /// Artificial intersections that became vertices.
    pub artificial_intersections: u64,
    /// Faces made directly (case a), after analysis of the neighbouring cells (case b), by hole filling (case c).
    pub faces: [u64; 3],
    /// Holes closed, and boundary loops left open.
    pub holes: [u64; 2],
    /// Components dropped by `min_component_share` and the faces they had.
    pub dropped_components: [u64; 2],
    /// Largest number of bytes held by intersections and the surface at once.
    pub working_bytes: u64,
    /// Names of the stages with their wall-clock seconds.
    pub seconds: Vec<(&'static str, f64)>,
}

/// Result of a merge. Vertex attributes: `confidence` (f32), `interpolated` (bool), `colour` if every scan has colours; face attribute: `hole_fill` (bool).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Merged {
    /// The surface, in the world.
    pub mesh: TriMesh,
    /// Figures of the run.
    pub report: MergeReport,
}

/// Merges the scans into one surface.
///
/// # Errors
/// Parameters out of range; whatever loading a scan can meet; [`Error::Cancelled`].
pub fn run(_sources: &[&dyn ScanSource], _params: &MergeParams, _progress: &Progress<'_>) -> Result<Merged> {
    Err(Error::input("merge: under construction"))
}
