//! The parameters of clustering.

use base::params::{angle, count, length, ratio};

base::alternatives! {
    /// How fine the result is.
    pub enum Resolution of "cluster" {
        /// Vertices wanted. More come only if the input's topology needs them, at most as many as the input has when cut to a manifold.
        Vertices(u32) = vertices: count("Vertices").from_data("a tenth of the input's vertices").at_least(1.0).at_most(4e9),
        /// Patches wanted, instead of vertices: k patches give about 3 k vertices.
        Patches(u32) = patches: count("Patches").from_data("about a third of the vertices wanted").at_least(1.0).at_most(4e9),
        /// Largest distance of any point of the input from the result and of the result from the input, instead of a number of vertices:
        /// there are as many as it takes.
        MaxError(f64) = max_error: length("Max error").from_data("none, a number of vertices is asked for").above(0.0),
        /// Most triangles wanted, instead of vertices. So many come, or one fewer. More come only if the input's topology needs them, at
        /// most as many as the input has.
        Triangles(u32) = triangles: count("Triangles").from_data("about a tenth of the input's").at_least(1.0).at_most(4e9)
            .since("0.2"),
    }
    or
    /// A tenth of the input's vertices.
    Tenth
}

base::params! {
    /// How a mesh, or points, are clustered.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct ClusterParams of "cluster" with threads {
        /// How fine the result is.
        resolution: Resolution,
        /// How much smaller triangles are where the surface bends: 0 makes them alike everywhere, 1 gives the least mean distance from the
        /// input.
        adaptivity: f64 = ratio("Adaptivity").default(1.0).at_most(2.0),
        /// Most Lloyd steps at the final number of patches. Fewer if they no longer gain.
        iterations: u32 = count("Iterations").default(40.0).at_most(10_000.0),
        /// Most steps of the spring relaxation.
        relaxation: u32 = count("Relaxation").default(50.0).at_most(10_000.0).off("the fans stay as they are"),
        /// Rounds in which vertices leave the surface for where it lies nearest in the mean square. 1 takes a third off the mean error,
        /// more lower the largest.
        fitting: u32 = count("Fitting").at_most(100.0).off("vertices stay on the surface"),
        /// Smallest angle of triangles that may have any shape for the least mean square distance, instead of one as even as can be.
        /// Vertices leave the surface, in as many rounds as `fitting` says, but at least two. 30 degrees leave a third of the mean error at
        /// the same number of vertices, in up to five times the time.
        min_angle: f64 = angle("Min angle").at_most(std::f64::consts::FRAC_PI_6).off("triangles are as even as can be"),
        /// Edges whose triangles turn by at least this angle are kept as edges of the result, where they make lines a few of its edges
        /// long: those of parts and buildings. Noise makes no such lines.
        feature_angle: f64 = angle("Feature angle").default(40_f64.to_radians()).at_most(std::f64::consts::PI).off("no edge is kept"),
        /// Direction in which round patches are split.
        seed: u32 = count("Seed").at_most(4_294_967_295.0),
    }
}
