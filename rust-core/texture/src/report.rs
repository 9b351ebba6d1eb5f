//! The result of texturing, and its figures.

use glam::DAffine3;

use mesh::TileImages;

/// Report of a photo.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PhotoReport {
    /// Name of the photo.
    pub name: String,
    /// Factors of its light: red, green, blue.
    pub gain: [f64; 3],
    /// Distance by which its camera was moved: pixels, in the root mean square over the surface.
    pub moved: f64,
    /// Texels that it sees.
    pub texels: u64,
    /// Reason why nothing was taken of it. `None` for a photo that was used.
    pub left_out: Option<String>,
}

/// The figures of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TextureReport {
    /// Texels that triangles cover.
    pub texels: u64,
    /// Those that a photo sees.
    pub seen: u64,
    /// Photos, in the order of their names.
    pub photos: Vec<PhotoReport>,
    /// Grey by which the photos differ from their mean, of 255, in the root mean square: before and after cameras were moved.
    pub differences: Option<[f64; 2]>,
    /// Names of the stages with their wall-clock seconds.
    pub seconds: Vec<(&'static str, f64)>,
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
