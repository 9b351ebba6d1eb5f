//! The parameters of texturing.

use base::params::{count, flag};

base::params! {
    /// How a mesh gets its textures.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct TextureParams of "texture" with threads {
        /// Columns and rows of a tile, in texels.
        size: u32 = count("Size").default(2048.0).at_least(16.0).at_most(16_384.0).since("0.2"),
        /// Poses of the cameras are moved a little until the photos agree with each other on the surface.
        refine_cameras: bool = flag("Refine cameras").on().off("cameras stay where they are").since("0.2"),
        /// Photos are made equally bright, channel by channel: exposure and white balance differ from photo to photo.
        match_exposure: bool = flag("Match exposure").on().off("colours are taken as they are").since("0.2"),
        /// Of three photos and more that see a place the brightest is left out where it is brighter than the others: reflections of lamps
        /// only add light.
        drop_highlights: bool = flag("Drop highlights").on().off("highlights are averaged with the rest").since("0.2"),
        /// A normal map is made, in the tangent space of MikkTSpace, y up.
        normal_map: bool = flag("Normal map").off("none is made").since("0.2"),
        /// A map of the height of the detailed surface over the mesh is made.
        height_map: bool = flag("Height map").off("none is made").since("0.2"),
        /// Rays per place of the map of ambient occlusion. 16 suffice for most.
        occlusion_rays: u32 = count("Occlusion rays").at_most(4096.0).off("none is made").since("0.2"),
    }
}
