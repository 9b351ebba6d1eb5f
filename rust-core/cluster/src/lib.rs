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
//! Differences from the paper: (1) Lloyd steps are exact but look at a few centres per point, and one split doubles the patches instead of
//! adding one. (2) Patches are made disks with three or more nodes each, so that the result has the input's topology whatever k is. The
//! number of patches grows where it must. (3) On a border, each patch gets a node between its corners, or borders would be coarser than the
//! rest. (4) Patches are smaller where they err more. (5) A number of vertices can be asked for. The few that k patches make too many are
//! collapsed. (6) Beside the springs, edges are flipped and sharp angles mended. (7) A spring has a least natural length, or any part of
//! the net could shrink to a point. (8) On request vertices leave the surface for where it lies nearest. With a least angle triangles take
//! any shape, too. Nodes beside thin rims are drawn onto them. (9) Patches are drawn onto creases, along which edges run
//! then. (10) Points become the surface through them first, whose edges say which patches are neighbours. Balls around patches, as in the
//! paper, join the two sides of a thin wall and leave the topology to chance.

mod operation;
mod params;
mod report;

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

#[doc(hidden)]
pub use driver::PLAN;
pub use driver::{levels, levels_of_points, run, run_points};
pub use operation::OPERATION;
pub use params::{ClusterParams, Resolution, SCHEMA};
pub use report::{ClusterReport, Clustered, TriangleShapes};

#[cfg(test)]
mod tests;
