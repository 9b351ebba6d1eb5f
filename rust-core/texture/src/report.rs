//! The result of texturing, and its figures.

use glam::DAffine3;

/// The images of a tile: square, row by row from the top. Values of covered texels go on into the background.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tile {
    /// Base colour, sRGB.
    pub colour: Vec<[u8; 3]>,
    /// Source of each colour: values of [`mask`](crate::mask).
    pub mask: Vec<u8>,
    /// Normals in tangent space, y up: 128 is 0.
    pub normal: Option<Vec<[u8; 3]>>,
    /// Heights from [`TextureReport::heights`]' first to its second.
    pub height: Option<Vec<u16>>,
    /// Ambient occlusion: 255 where all directions are open. As light, not as sRGB.
    pub occlusion: Option<Vec<u8>>,
}

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
    /// Heights that 0 and 65,535 of the height map stand for, in the unit of the mesh.
    pub heights: Option<[f64; 2]>,
    /// Names of the stages with their wall-clock seconds.
    pub seconds: Vec<(&'static str, f64)>,
}

/// Result of texturing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Textured {
    /// Columns and rows of a tile.
    pub size: u32,
    /// The tiles.
    pub tiles: Vec<Tile>,
    /// Tangents of the corners of the mesh's triangles, as MikkTSpace makes them: direction, and the sign of the bitangent. Only
    /// with a normal map.
    pub tangents: Option<Vec<[[f32; 4]; 3]>>,
    /// Poses of the cameras as they were used, in the order in which the photos were given.
    pub world_from_camera: Vec<DAffine3>,
    /// Figures of the run.
    pub report: TextureReport,
}
