//! The figures of a quad grid.

use base::progress::Seconds;

base::report! {
    /// The figures of a quad grid. Errors are distances along the samples' rays to the planes of the triangles of the pixels' quads, over
    /// all valid pixels of the image but those missed, with each quad cut along its better diagonal. On the background the grid continues
    /// the surface.
    #[derive(Default)]
    pub struct QuadReport {
        /// Tiles from top to bottom and from left to right.
        tiles: [usize; 2] = count("Tiles").parts(&[
            ("tiles_down", "Tiles from top to bottom."),
            ("tiles_across", "Tiles from left to right."),
        ]),
        /// Difference between the farthest and the nearest range of the valid pixels.
        depth_extent: f64 = length("Depth extent"),
        /// Mean error as a share of the depth extent, the paper's relative error. 0 where all ranges are equal.
        relative_error: f64 = ratio("Relative error"),
        /// Relative error of the uniform grid of the same size.
        uniform_relative_error: f64 = ratio("Of the uniform grid"),
        /// Root of the mean square error.
        rms_error: f64 = length("RMS error"),
        /// Root of the mean square error of the uniform grid.
        uniform_rms_error: f64 = length("RMS error of the uniform grid"),
        /// Largest error.
        max_error: f64 = length("Largest error"),
        /// Largest error of the uniform grid.
        uniform_max_error: f64 = length("Largest error of the uniform grid"),
        /// Whether the result is the uniform grid, as the adaptive one lay no nearer. Vertices snapped to the border moved all the same.
        is_uniform: bool = flag("Uniform"),
        /// Valid pixels of the image.
        valid_pixels: usize = count("Valid pixels"),
        /// Valid pixels whose rays do not meet the planes of their quad in front of the sensor. They have no error.
        missed_pixels: usize = count("Missed pixels"),
        /// Missed pixels of the uniform grid.
        uniform_missed_pixels: usize = count("Missed by the uniform grid"),
        /// Invalid pixels that were filled.
        gaps_filled: usize = count("Gaps filled"),
        /// Vertices that were moved so that no quad folds over.
        unfolded: usize = count("Vertices unfolded"),
        /// Vertices that were moved from the background onto the border of the surface.
        snapped: usize = count("Vertices snapped"),
        /// Quads of the mesh: those that are not on the background.
        quads: usize = count("Quads"),
        /// Wall-clock seconds by the name of the stage.
        seconds: Seconds = stages(),
    }
}
