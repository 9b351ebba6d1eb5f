//! The result of texturing, and its figures.

use glam::DAffine3;

use base::progress::Seconds;
use base::report::Report as _;
use mesh::TileImages;

base::report! {
    /// A photo, and how it was used.
    #[derive(Default)]
    pub struct TexturedPhoto {
        /// Its name.
        name: String = text("Photo").since("0.2"),
        /// Reason why nothing was taken of it. Empty for a photo that was used.
        reason: String = text("Reason").since("0.2"),
        /// Texels that it sees.
        texels: u64 = count("Texels seen").since("0.2"),
        /// Factors of its light: red, green, blue.
        gain: [f64; 3] = number("Gain").array(3).since("0.2"),
        /// Distance by which its camera was moved: pixels, in the root mean square over the surface.
        moved: f64 = number("Moved").since("0.2"),
    }
}

base::report! {
    /// The figures of texturing.
    #[derive(Default)]
    pub struct TextureReport {
        /// Tiles.
        tiles: usize = count("Tiles").since("0.2"),
        /// Texels that triangles cover.
        texels: u64 = count("Texels").since("0.2"),
        /// Texels that a photo sees.
        seen: u64 = count("Texels seen").since("0.2"),
        /// The photos, in the order in which they were given.
        photos: Vec<TexturedPhoto> = nested("Photos", &TexturedPhoto::SCHEMA).list().counted().since("0.2"),
        /// Grey by which the photos differ from their mean, of 255, in the root mean square: before and after cameras were moved. There is
        /// none if no camera could be moved.
        differences: Option<[f64; 2]> = number("Difference of the photos").optional().parts(&[
            ("difference_before", "Grey by which the photos differed before cameras were moved. There is none if no camera could be moved."),
            ("difference_after", "Grey by which the photos differ after that. There is none if no camera could be moved."),
        ]).since("0.2"),
        /// Heights that 0 and 65,535 of the height map stand for. There are none without a height map.
        heights: Option<[f64; 2]> = length("Heights").optional().parts(&[
            ("lowest", "Height that 0 of the height map stands for. There is none without a height map."),
            ("highest", "Height that 65,535 of the height map stands for. There is none without a height map."),
        ]).since("0.2"),
        /// Wall-clock seconds by the name of the stage.
        seconds: Seconds = stages().since("0.2"),
    }
}

/// Result of texturing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Textured {
    /// The images. Tangents only with a normal map. The masks have the values of [`mask`](crate::mask).
    pub images: TileImages,
    /// Poses of the cameras as they were used, in the order in which the photos were given.
    pub world_from_camera: Vec<DAffine3>,
    /// Figures of the run.
    pub report: TextureReport,
}
