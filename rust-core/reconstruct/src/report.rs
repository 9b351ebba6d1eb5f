//! The results.

use base::progress::Seconds;
use mesh::TriMesh;

/// Reasons why a point is not on the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// A coordinate isn't a finite number.
    NotFinite,
    /// At the same place as a point before it. Of points that are flat but for noise, also right above another.
    Duplicate,
    /// Inside the closed surface, out of its reach.
    Inside,
    /// Outside the surface: too far away for the threshold, or carved away.
    Outside,
    /// Much further from the others than they are from each other, or than their noise explains.
    Outlier,
}

/// A point that is not on the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dropped {
    /// Its place in the cloud.
    pub point: u32,
    /// The reason.
    pub reason: Reason,
}

base::report! {
    /// The figures of a surface through points.
    #[derive(Default)]
    pub struct ReconstructReport {
        /// Points given.
        points: usize = count("Points"),
        /// Points on the surface.
        used: usize = count("On the surface"),
        /// Delaunay tetrahedra. None where the points lie in one plane.
        tetrahedra: usize = count("Tetrahedra"),
        /// Whether the surface is closed: it has no border, also not one of a gap or of facets left out.
        closed: bool = flag("Closed"),
        /// The threshold that was used: a perimeter with a global one, in mean spacings of a facet's points with a local one.
        threshold: f64 = number("Threshold"),
        /// Times the mean perimeter was taken, with the paper's carving or in a plane.
        rounds: usize = count("Rounds of carving"),
        /// Tetrahedra that changed sides to make the surface manifold, and points brought onto it afterwards.
        repaired: [usize; 2] = count("Repaired, gathered").parts(&[
            ("repaired", "Tetrahedra that changed sides to make the surface manifold."),
            ("gathered", "Points brought onto the surface afterwards."),
        ]),
        /// Facets left out: those over gaps, and those that kept the surface from being manifold.
        cut_facets: usize = count("Facets left out"),
        /// Parts turned over by normals, sensors or direction.
        turned_parts: usize = count("Parts turned over"),
        /// Noise of the points as measured: their standard deviation across the surface. 0 for fewer than 1,024.
        noise: f64 = length("Noise of the points").since("0.2"),
        /// Side of a square of the surface that has one point, as measured.
        spacing: f64 = length("Spacing of the points").since("0.2"),
        /// Radius within which the surface was smoothed. 0 if it goes through the points. It was so many times smaller or larger where
        /// points that carry noise lie much closer together or further apart than usual.
        smoothing: f64 = length("Smoothed within").since("0.2"),
        /// Root mean square of the distances by which smoothing moved the points on the surface.
        moved: f64 = length("Points moved by").since("0.2"),
        /// Wall-clock seconds by the name of the stage.
        seconds: Seconds = stages(),
    }
    besides {
        /// Points not on the surface, in the order of their numbers.
        dropped: Vec<Dropped>,
    }
    derived {
        /// Points dropped since a coordinate isn't finite.
        not_finite = count("Dropped: not finite"),
        /// Points dropped since they are at the same place as a point before them.
        duplicates = count("Dropped: copies"),
        /// Points dropped inside of the surface.
        inside = count("Dropped: inside"),
        /// Points dropped outside of the surface.
        outside = count("Dropped: outside"),
        /// Points dropped since they are far from any surface that the others tell.
        outliers = count("Dropped: outliers").since("0.2"),
    }
}

impl ReconstructReport {
    /// Points dropped for a reason.
    pub fn dropped_for(&self, reason: Reason) -> usize {
        self.dropped.iter().filter(|dropped| dropped.reason == reason).count()
    }

    fn not_finite(&self) -> usize {
        self.dropped_for(Reason::NotFinite)
    }

    fn duplicates(&self) -> usize {
        self.dropped_for(Reason::Duplicate)
    }

    fn inside(&self) -> usize {
        self.dropped_for(Reason::Inside)
    }

    fn outside(&self) -> usize {
        self.dropped_for(Reason::Outside)
    }

    fn outliers(&self) -> usize {
        self.dropped_for(Reason::Outlier)
    }
}

/// Result of a reconstruction.
///
/// The mesh stands in the cloud's own frame. Its vertices are the used points in the order of the cloud. Vertex attributes: `source_point`
/// (i32, place in the cloud), `colour`, `intensity` and `normal_x`, `normal_y`, `normal_z` where the cloud has them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reconstructed {
    /// The surface.
    pub mesh: TriMesh,
    /// Figures of the run.
    pub report: ReconstructReport,
}
