//! The result of clustering, and its figures.

use crate::surface;
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
    pub(crate) fn of(mesh: &TriMesh, progress: &Progress<'_>) -> Result<Self> {
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
        /// No point of the input is farther from the mesh, and none of the mesh farther from the input, measured on the mesh. Some point is
        /// nearly as far: the bound is seldom more than 1 % above it, unless a largest error was asked for. 0 for the input itself.
        max_error: f64 = length("Largest error"),
        /// Root mean square of the distances of the input's vertices from the mesh.
        rms_error: f64 = length("RMS error").since("0.2"),
        /// Whether the mesh is the input, as nothing coarser was found within the largest error, or has its topology.
        kept_input: bool = flag("The input itself"),
        /// Wall-clock seconds by the name of the stage.
        seconds: Seconds = stages(),
    }
    besides {
        /// Distances of the input's vertices to the result.
        deviation: DistanceReport,
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
