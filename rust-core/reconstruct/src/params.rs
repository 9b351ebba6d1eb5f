//! The input, but for points.

use base::params::{choice, length, ratio};

base::choices! {
    /// Length that the perimeter of a facet is compared with.
    pub enum Threshold {
        /// The spacing of the points around it: sparse parts may have large facets.
        Local = "local" "Local",
        /// The mean over the whole surface, as in the paper.
        Global = "global" "Global",
    }
}

base::choices! {
    /// Form of the surface.
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
        /// Closed if a closed surface goes through more than half of the points at once, or through 5 % at once and 99 % in the end. But
        /// not if sensors saw it from one side only, or if points carry noise and more than 15 % of the area would be in facets above the
        /// threshold. Else it is open and grows from the most certain facet on. Parts are joined over facets up to 4 times as large as the
        /// threshold, or 16 times where they continue a part smoothly. Small holes are closed. Parts that lie further apart stay apart.
        Auto = "auto" "Auto",
        /// Gaps in the sampling are spanned by large facets.
        Closed = "closed" "Closed",
        /// Facets above the threshold are left out, so that gaps stay open.
        Open = "open" "Open",
    }
}

base::choices! {
    /// Treatment of the noise of points.
    pub enum NoisyPoints {
        /// They are moved to the surface that those around them tell. Outliers, also around points that carry no noise, are left out.
        Moved = "moved" "Moved to the surface",
        /// The surface is found as with `moved`, and goes through the points as they were measured. Noise may make it cross itself.
        PutBack = "put_back" "Put back where measured",
        /// Nothing is smoothed and no outlier left out, whatever noise the points carry and whatever the smoothing is. If noise is half a
        /// spacing or more, no surface may be found, or one full of holes.
        AsClean = "as_clean" "Taken as clean",
    }
}

base::params! {
    /// How a surface is made through scattered points.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct ReconstructParams of "reconstruct" with threads {
        /// Makes the threshold on the perimeters of facets larger. Larger closes more gaps and keeps more stray points.
        factor: f64 = ratio("Factor").default(1.0).at_least(1.0).at_most(2.0),
        /// Length that the perimeter of a facet is compared with.
        threshold: Threshold = choice("Threshold", Threshold::CHOICES),
        /// Form of the surface.
        topology: Topology = choice("Topology", Topology::CHOICES),
        /// Whether the points are of a closed surface. Only with a manifold topology.
        closure: Closure = choice("Closure", Closure::CHOICES),
        /// The surface is the one that points within this distance tell, and those far from any surface are left out. Larger takes away
        /// more noise, and what is thin: bars thinner than twice this may tear. Smaller may leave good points out. Less than the usual
        /// distance to the 16 nearest points counts as that distance.
        smooth: Option<f64> = length("Smoothing")
            .from_data("the distance at which points are best foretold by the others, if the noise of 1,024 points or more is more than 0.2 spacings, else points stay")
            .above(0.0).since("0.2"),
        /// Treatment of the noise of points.
        noisy_points: NoisyPoints = choice("Noisy points", NoisyPoints::CHOICES).since("0.2"),
    }
}
