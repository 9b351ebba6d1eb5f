//! What goes in and what comes out.

use base::params::{choice, length, ratio};
use base::progress::Seconds;
use mesh::TriMesh;

base::choices! {
    /// What the perimeter of a facet is compared with.
    pub enum Threshold {
        /// The spacing of the points around it: sparse parts may have large facets.
        Local = "local" "Local",
        /// The mean over the whole surface, as in the paper.
        Global = "global" "Global",
    }
}

base::choices! {
    /// What the surface may be.
    pub enum Topology {
        /// Every edge has at most two facets, every vertex one fan of them.
        Manifold = "manifold" "Manifold",
        /// The paper's carving: closed, but not manifold where parts touch, and without the points carved away.
        Free = "free" "Free",
    }
}

base::choices! {
    /// Whether the points are of a closed surface.
    pub enum Closure {
        /// Closed if a closed surface goes through more than half of the points at once, or through 5 % at once and 99 % in the end, unless sensors saw it from one side only, or points carry noise and more than 15 % of the area would be in facets above the threshold. Else open: grown from the most certain facet on, parts joined over facets up to 4 times as large as the threshold, or 16 times where they continue a part smoothly, small holes closed; what lies further apart stays apart.
        Auto = "auto" "Auto",
        /// Gaps in the sampling are spanned by large facets.
        Closed = "closed" "Closed",
        /// Facets above the threshold are left out, so that gaps stay open.
        Open = "open" "Open",
    }
}

base::choices! {
    /// What is done about the noise of points.
    pub enum NoisyPoints {
        /// They are moved to the surface that those around them tell; outliers, also around points that carry no noise, are left out.
        Moved = "moved" "Moved to the surface",
        /// The surface is found as with `moved`, and goes through the points as they were measured; noise may make it cross itself.
        PutBack = "put_back" "Put back where measured",
        /// Nothing is smoothed and no outlier left out, whatever noise the points carry and whatever the smoothing is: where noise is half a spacing or more no surface may be found, or one full of holes.
        AsClean = "as_clean" "Taken as clean",
    }
}

base::params! {
    /// How a surface is made through scattered points.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct ReconstructParams of "reconstruct" with threads {
        /// Makes the threshold on the perimeters of facets larger. Larger closes more gaps and keeps more stray points.
        factor: f64 = ratio("Factor").default(1.0).at_least(1.0).at_most(2.0),
        /// What the perimeter of a facet is compared with.
        threshold: Threshold = choice("Threshold", Threshold::CHOICES),
        /// What the surface may be.
        topology: Topology = choice("Topology", Topology::CHOICES),
        /// Whether the points are of a closed surface; only with a manifold topology.
        closure: Closure = choice("Closure", Closure::CHOICES),
        /// The surface is the one that points within this distance tell, and those far from any surface are left out. Larger takes away more noise, and what is thin: bars thinner than twice this may tear. Smaller may leave good points out; less than the usual distance to the 16 nearest points counts as that distance.
        smooth: Option<f64> = length("Smoothing")
            .from_data("where the noise of 1,024 points or more is more than 0.2 spacings, that at which points are best foretold by the others; else points stay")
            .above(0.0).since("0.2"),
        /// What is done about the noise of points.
        noisy_points: NoisyPoints = choice("Noisy points", NoisyPoints::CHOICES).since("0.2"),
    }
}

/// Why a point is not on the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// A coordinate isn't a finite number.
    NotFinite,
    /// At the same place as a point before it; of points that are flat but for noise, also right above another.
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
    /// Why.
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
        /// Radius within which the surface was smoothed; 0 if it goes through the points. Where points that carry noise lie much closer together or further apart than usual, it was so many times smaller or larger there.
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
