//! The parameters of quad grids.

use base::params::{count, length, ratio};

/// As many vertices along a side as an image may have pixels.
const MOST: f64 = 67_108_864.0;

base::alternatives! {
    /// An error that rows and columns are chosen for, in world units along the samples' rays.
    pub enum Target of "quads" {
        /// Chooses rows and columns so that no sample is farther from the grid along its ray. Smaller values give more quads.
        Max(f64) = max_error: length("Max error").from_data("no limit, rows and columns are used as given"),
        /// Chooses rows and columns so that the root of the mean square distance of the samples to the grid along their rays is at most
        /// this. Smaller values give more quads.
        Rms(f64) = rms_error: length("RMS error").from_data("no limit, rows and columns are used as given"),
    }
    or
    /// None: rows and columns are used as given.
    AsGiven
}

base::params! {
    /// How a quad grid is made.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct QuadParams of "quads" with threads {
        /// Tiles from top to bottom. Every tile gets the same number of rows: more tiles spread them more evenly over the image.
        tiles_down: Option<usize> = count("Tiles down")
            .from_data("one tile every 64 rows of pixels, at least one").at_least(1.0).at_most(MOST),
        /// Tiles from left to right. Every tile gets the same number of columns: more tiles spread them more evenly over the image.
        tiles_across: Option<usize> = count("Tiles across")
            .from_data("one tile every 64 columns of pixels, at least one").at_least(1.0).at_most(MOST),
        /// Rows of vertices per tile, both borders counted. Neighbouring tiles share the row between them. Not used where an error is asked
        /// for.
        rows: usize = count("Rows a tile").default(9.0).at_least(2.0).at_most(MOST),
        /// Columns of vertices per tile, both borders counted. Neighbouring tiles share the column between them. Not used where an error is
        /// asked for.
        columns: usize = count("Columns a tile").default(9.0).at_least(2.0).at_most(MOST),
        /// Chooses rows and columns for this error instead.
        target: Target,
        /// How often invalid pixels are filled with the mean of their valid neighbours.
        gap_passes: usize = count("Gap passes").default(1.0).at_most(1024.0).off("never"),
        /// Valid ones among the eight neighbours that an invalid pixel needs to be filled: 8 fills single pixels, fewer grow into larger
        /// gaps, a pixel a pass.
        gap_neighbours: usize = count("Gap neighbours").default(8.0).at_least(1.0).at_most(8.0),
        /// Curvature that counts as 1 in the 8-bit curvature image, as a share of the depth extent. Smaller values let fine relief attract
        /// vertices, and noise as well.
        curvature_unit: f64 = ratio("Curvature unit").default(1e-3).above(0.0),
        /// Largest value of the curvature image: stronger curvature, such as that of jumps, attracts no more vertices than this.
        curvature_limit: u8 = count("Curvature limit").default(255.0).at_least(1.0).at_most(255.0),
        /// Density of vertices as this power of the curvature K. Larger values draw more vertices to strong curvature.
        exponent: f64 = ratio("Exponent").default(0.7).at_most(4.0).off("the logarithm of the paper, log(1 + K)"),
        /// Density spread evenly, as a share of the mean density. Large values give a uniform grid.
        floor: f64 = ratio("Floor").default(2.0).at_most(1e6).off("flat regions are left without vertices"),
        /// Size of the window that the density is averaged over, in quads. Larger values give smoother lines.
        smoothing: f64 = ratio("Smoothing").default(2.0).at_most(16.0)
            .off("each row of pixels is sampled for itself, as in the paper"),
        /// Curvature given to invalid pixels, as in the paper (5 and 20 there). Larger values draw vertices to the background.
        background_curvature: Option<u8> = count("Background curvature")
            .from_data("none, the background attracts no vertices beyond the floor").at_most(255.0),
        /// Smallest share of valid pixels that a quad of the mesh may have. With more than 0 its corners must be valid too.
        coverage: f64 = ratio("Coverage").default(0.5).at_most(1.0).off("every quad is kept, over the background as well"),
    }
}
