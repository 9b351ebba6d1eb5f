//! Clustering: a dense mesh, or points -> a coarse mesh of well-shaped triangles, at any resolution. \[KMT\]
//!
//! | stage | file | in -> out |
//! |---|---|---|
//! | 0 | `reconstruct` | points -> the surface through them |
//! | 1 | `kmeans`, `tree` | vertices -> k patches, each of the points nearest to its centre |
//! | | `creases` | sharp edges -> the creases that the result keeps; patches -> patches with their centres on them |
//! | 2 | `subcluster`, `connect` | patches -> patches that are disks |
//! | 3, 4 | `polygons` | patches -> the polygon around each, from its neighbours |
//! | 5 | `fans`, `collapse` | polygons -> triangles around the patches' centres |
//! | 6 | `relax`, `flip`, `mend`, `features`, `fit` | triangles -> well-shaped ones on the same surface, or nearer to it |
//! | | `quadrics`, `polish` | with a least angle: fewer triangles of any shape that has it, nearest to the surface |
//! | 7 | `finish` | net -> mesh with the input's attributes |
//!
//! Differences from the paper: (1) Lloyd steps are exact but look at a few centres a point, and one split doubles the
//! patches instead of adding one. (2) Patches are made disks with three or more nodes each, so that the result has the
//! input's topology whatever k is; the number of patches grows where it must. (3) On a border, each patch gets a node between its
//! corners, or borders would be coarser than the rest. (4) Patches are smaller where they err more. (5) A number of vertices can
//! be asked for; the few that k patches make too many are collapsed. (6) Beside the springs, edges are
//! flipped and sharp angles mended. (7) A spring has a least natural length, or any part of the net could shrink to a point.
//! (8) On request vertices leave the surface for where it lies nearest; with a least angle triangles take any shape, too.
//! (9) Patches are drawn onto creases, along which edges run then. (10) Points become the surface through them first, whose edges say which patches are neighbours: balls around patches, as in the
//! paper, join the two sides of a thin wall and leave the topology to chance.

mod params;

// The input as a manifold
mod surface;

// 1. patches
mod creases;
mod density;
mod kmeans;
mod tree;

// 2. disks
mod connect;
mod subcluster;

// 3, 4. polygons
mod polygons;

// 5. fans
mod collapse;
mod fans;
mod net;

// 6. relaxation
mod features;
mod fit;
mod flip;
mod mend;
mod polish;
mod quadrics;
mod relax;

// 7. the mesh
mod finish;

// The stages in their order, once or until a largest error is kept
mod bounded;
mod driver;
mod resolution;

pub use driver::{levels, levels_of_points, run, run_points};
pub use params::{ClusterParams, Resolution, SCHEMA};

use mesh::TriMesh;
use mesh::measure::{Quality, Summary};

/// The figures of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ClusterReport {
    /// Patches.
    pub patches: usize,
    /// Vertices of the result.
    pub vertices: usize,
    /// Triangles of the result.
    pub triangles: usize,
    /// Weighted sum of the squared distances of the input's vertices to their centres, after the last Lloyd step.
    pub energy: f64,
    /// Parts of patches that became patches as they were not connected to the rest.
    pub separated: usize,
    /// Parts and patches that were given to their neighbours.
    pub dissolved: usize,
    /// Patches that were halved as they were no disks.
    pub halved: usize,
    /// Points given that are not on the surface through them; 0 for a mesh.
    pub off_surface: usize,
    /// Edges of the input that were cut as they don't join two triangles of the same orientation.
    pub cut_edges: usize,
    /// Triangles of the fans, before they were relaxed.
    pub before: Quality,
    /// Triangles of the result.
    pub after: Quality,
    /// Angles of the fans, three a triangle, in steps of 5 degrees.
    pub angles_before: Vec<usize>,
    /// Angles of the result likewise.
    pub angles_after: Vec<usize>,
    /// Distances of the input's vertices to the result, measured anew on it; only where a largest error was asked for.
    pub deviation: Option<Summary>,
    /// No point of the input is farther from the result, and none of the result farther from the input, where a largest error
    /// was asked for: not above it. 0 for the input itself.
    pub bound: Option<f64>,
    /// Whether the result is the input, as nothing coarser was found within the largest error, or has its topology.
    pub kept_input: bool,
    /// Names of the stages with their wall-clock seconds.
    pub seconds: Vec<(&'static str, f64)>,
}

/// Result of clustering.
#[derive(Clone, Debug, PartialEq)]
pub struct Clustered {
    /// The surface, with the input's vertex attributes.
    pub mesh: TriMesh,
    /// Patch of each vertex of the input, -1 for one that no triangle uses; of points, -1 for one not on the surface through
    /// them.
    pub labels: Vec<i32>,
    /// Figures of the run.
    pub report: ClusterReport,
}

#[cfg(test)]
mod tests;
