//! The result of finishing, and its figures.

use glam::DAffine3;

use base::progress::Seconds;
use base::report::Report as _;
use mesh::{TileImages, TriMesh};
use texture::TexturedPhoto;

base::report! {
    /// A level of detail.
    #[derive(Default)]
    pub struct FinishedLevel {
        /// Triangles.
        triangles: usize = count("Triangles").since("0.2"),
        /// No point of the surface is farther from the level, and none of the level farther from the surface.
        max_error: f64 = length("Largest error").since("0.2"),
        /// Root mean square of the distances of the surface's vertices from the level.
        rms_error: f64 = length("RMS error").since("0.2"),
        /// Columns and rows of its images.
        size: usize = count("Size").since("0.2"),
        /// Charts.
        charts: usize = count("Charts").since("0.2"),
        /// Share of the images that triangles cover.
        used: f64 = ratio("Used").since("0.2"),
        /// Texels per unit of length.
        texels_per_unit: f64 = number("Texels per unit").since("0.2"),
        /// Nineteen twentieths of the surface are stretched less in the images.
        stretch_p95: f64 = number("Stretch, 95 %").since("0.2"),
        /// Share of the covered texels that no photo sees.
        unseen: f64 = ratio("Unseen").since("0.2"),
    }
}

base::report! {
    /// The figures of finishing.
    #[derive(Default)]
    pub struct FinishReport {
        /// Parts that were dropped, and their triangles.
        dropped_components: [u64; 2] = count("Parts dropped").parts(&[
            ("dropped_components", "Connected parts that were dropped."),
            ("dropped_triangles", "Triangles of these parts."),
        ]).since("0.2"),
        /// Triangles of the detailed surface.
        detail: usize = count("Detailed triangles").since("0.2"),
        /// Openings of the surface that were closed.
        closed: usize = count("Openings closed").since("0.2"),
        /// Whether the detailed surface is closed.
        is_closed: bool = flag("Closed").since("0.2"),
        /// The levels of detail.
        levels: Vec<FinishedLevel> = nested("Levels", &FinishedLevel::SCHEMA).list().counted().since("0.2"),
        /// The photos, in the order in which they were given, as the first level used them.
        photos: Vec<TexturedPhoto> = nested("Photos", &TexturedPhoto::SCHEMA).list().counted().since("0.2"),
        /// Grey by which the photos differ from their mean, of 255, in the root mean square: before and after cameras were moved. There is
        /// none if no camera could be moved.
        differences: Option<[f64; 2]> = number("Difference of the photos").optional().parts(&[
            ("difference_before", "Grey by which the photos differed before cameras were moved."),
            ("difference_after", "Grey by which the photos differ after that."),
        ]).since("0.2"),
        /// Wall-clock seconds by the name of the stage.
        seconds: Seconds = stages().since("0.2"),
    }
}

/// A level of detail: a light mesh and its images.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TexturedLevel {
    /// The mesh. Its attributes are the texture coordinates `s` and `t`.
    pub mesh: TriMesh,
    /// Its images.
    pub images: TileImages,
}

/// Result of finishing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Finished {
    /// The detailed surface that the levels stand for: without small parts, and closed if that was asked for.
    pub detail: TriMesh,
    /// The levels of detail, the finest first.
    pub levels: Vec<TexturedLevel>,
    /// Poses of the photos' cameras as they were used, in the order in which the photos were given.
    pub world_from_camera: Vec<DAffine3>,
    /// Figures of the run.
    pub report: FinishReport,
}
