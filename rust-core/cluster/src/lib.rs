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
//! any shape, too. (9) Patches are drawn onto creases, along which edges run then. (10) Points become the surface through them first, whose
//! edges say which patches are neighbours. Balls around patches, as in the paper, join the two sides of a thin wall and leave the topology
//! to chance.

mod operation;
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
pub use operation::OPERATION;
pub use params::{ClusterParams, Resolution, SCHEMA};

use base::error::Result;
use base::progress::{Progress, Seconds};
use base::report::Report;
use mesh::TriMesh;
use mesh::measure::{self, DistanceReport, Quality};

base::report! {
    /// Shapes of triangles: how well-shaped they are.
    #[derive(Default)]
    pub struct TriangleShapes {
        /// Mean over the triangles of their smallest angle. It is pi/3 where all are equilateral.
        mean_smallest_angle: f64 = angle("Mean smallest angle"),
        /// Smallest angle of all.
        smallest_angle: f64 = angle("Smallest angle"),
        /// Largest angle of all.
        largest_angle: f64 = angle("Largest angle"),
        /// Counts of all angles, three per triangle, in steps of 5 degrees.
        angles: Vec<usize> = count("Angles in steps of 5 degrees").list(),
    }
}

impl TriangleShapes {
    /// The shapes of a mesh's triangles.
    fn of(mesh: &TriMesh, progress: &Progress<'_>) -> Result<Self> {
        let mut angles = vec![0; 36];
        let mut seen = 0;
        let quality = measure::quality_while(mesh, |corners| {
            surface::looking(seen, progress)?;
            seen += 1;
            corners.iter().for_each(|angle| angles[((angle.to_degrees() / 5.0) as usize).min(35)] += 1);
            Ok(())
        })?;
        let Quality { mean_smallest_angle, smallest_angle, largest_angle, .. } = quality;
        Ok(TriangleShapes { mean_smallest_angle, smallest_angle, largest_angle, angles })
    }
}

base::report! {
    /// The figures of clustering.
    #[derive(Default)]
    pub struct ClusterReport {
        /// Patches made.
        patches: usize = count("Patches"),
        /// Vertices of the mesh.
        vertices: usize = count("Vertices"),
        /// Triangles of the mesh.
        triangles: usize = count("Triangles"),
        /// Parts of patches that became patches as they were not connected to the rest.
        separated: usize = count("Parts made patches"),
        /// Parts and patches that were given to their neighbours.
        dissolved: usize = count("Given to neighbours"),
        /// Patches that were halved as they were no disks.
        halved: usize = count("Patches halved"),
        /// Edges of the input that were cut as they don't join two triangles of the same orientation.
        cut_edges: usize = count("Edges cut"),
        /// Points that are not on the surface through them. 0 for a mesh.
        off_surface: usize = count("Points off the surface"),
        /// Weighted sum of the squared distances of the input's vertices to their centres, after the last step of k-means.
        energy: f64 = number("Energy"),
        /// Shapes of the triangles before they were relaxed.
        before: TriangleShapes = nested("Before", &<TriangleShapes as Report>::SCHEMA),
        /// Shapes of the triangles of the mesh.
        after: TriangleShapes = nested("After", &<TriangleShapes as Report>::SCHEMA),
        /// No point of the input is farther from the mesh, and none of the mesh farther from the input, measured on the mesh. 0 for the
        /// input itself. There is none where no largest error was asked for.
        max_error: Option<f64> = length("Largest error").optional(),
        /// Whether the mesh is the input, as nothing coarser was found within the largest error, or has its topology.
        kept_input: bool = flag("The input itself"),
        /// Wall-clock seconds by the name of the stage.
        seconds: Seconds = stages(),
    }
    besides {
        /// Distances of the input's vertices to the result, measured anew on it. Only if a largest error was asked for.
        deviation: Option<DistanceReport>,
    }
}

/// Result of clustering.
#[derive(Clone, Debug, PartialEq)]
pub struct Clustered {
    /// The surface, with the input's vertex attributes.
    pub mesh: TriMesh,
    /// Patch of each vertex of the input, -1 for one that no triangle uses. Of points, -1 for one not on the surface through them.
    pub labels: Vec<i32>,
    /// Figures of the run.
    pub report: ClusterReport,
}

#[cfg(test)]
mod tests;
