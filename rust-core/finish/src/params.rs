//! The parameters of finishing.

use base::error::{Error, Result};
use base::params::{choice, count, flag, length, ratio};
use close::{Openings, UpAxis};

base::alternatives! {
    /// How light the model is.
    pub enum Lightness of "finish" {
        /// Triangles of the first level. At most so many, as far as the shape of the surface allows it.
        Triangles(u32) = triangles: count("Triangles").from_data("10,000").at_least(4.0).at_most(200_000.0).since("0.2"),
        /// Largest distance of the first level from the surface, and of the surface from it, instead of a number of triangles.
        MaxError(f64) = max_error: length("Max error").from_data("none, a number of triangles is asked for").above(0.0).since("0.2"),
    }
    or
    /// 10,000 triangles.
    Usual
}

base::params! {
    /// How a surface becomes a light model with textures. Lengths are in its unit.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct FinishParams of "finish" with threads {
        /// How light the model is.
        lightness: Lightness,
        /// Columns and rows of the images of the first level, in texels.
        texture: u32 = count("Texture").default(2048.0).at_least(64.0).at_most(16_384.0).since("0.2"),
        /// Levels of detail. Each has a quarter of the triangles of the one before, or twice its largest error. Its images have half as many
        /// columns and rows.
        levels: u32 = count("Levels").default(1.0).at_least(1.0).at_most(8.0).since("0.2"),
        /// Connected parts with fewer triangles than this share of the largest part's are dropped.
        min_component_share: f64 = ratio("Smallest part (share)").default(0.01).at_most(1.0).off("all are kept").since("0.2"),
        /// Openings that are closed. Nothing is filled where a scan saw through by more than a cell and a half.
        close: Openings = choice("Close", Openings::CHOICES).default(3.0).since("0.2"),
        /// Nothing is filled below the lowest point, so that what stood on the ground gets a flat foot instead of a round one.
        flat_base: bool = flag("Flat base").off("parts that nobody saw from below continue as their sides bend").since("0.2"),
        /// Direction away from the ground, where there is a flat base.
        base_up: UpAxis = choice("Up of the base", UpAxis::CHOICES).since("0.2"),
        /// Texels that stay free around each chart, twice as many between two. Mipmaps of level n need 2^n.
        padding: u32 = count("Padding").default(4.0).at_most(256.0).since("0.2"),
        /// Poses of the cameras are moved a little until the photos agree with each other on the surface.
        refine_cameras: bool = flag("Refine cameras").on().off("cameras stay where they are").since("0.2"),
        /// Photos are made equally bright, channel by channel: exposure and white balance differ from photo to photo.
        match_exposure: bool = flag("Match exposure").on().off("colours are taken as they are").since("0.2"),
        /// Of three photos and more that see a place the brightest is left out where it is brighter than the others: reflections of lamps
        /// only add light.
        drop_highlights: bool = flag("Drop highlights").on().off("highlights are averaged with the rest").since("0.2"),
        /// A normal map is made, in the tangent space of MikkTSpace, y up.
        normal_map: bool = flag("Normal map").on().off("none is made").since("0.2"),
        /// Rays per place of the map of ambient occlusion. 16 suffice for most.
        occlusion_rays: u32 = count("Occlusion rays").at_most(4096.0).off("none is made").since("0.2"),
    }
}

impl FinishParams {
    /// Refuses options that have no use with the others, or no room.
    ///
    /// # Errors
    /// [`Error::Input`] says what to change.
    pub(super) fn go_together(&self) -> Result<()> {
        let least = self.texture >> (self.levels - 1);
        let problem = if self.flat_base && matches!(self.close, Openings::None | Openings::Holes) {
            "flat_base is given, but has no use unless more than holes is closed: give close = all or seen, too"
                .to_owned()
        } else if self.base_up != UpAxis::Z && !self.flat_base {
            "base_up is given without flat_base, but has no use then: give flat_base, too".to_owned()
        } else if self.padding.saturating_mul(4) >= least {
            format!(
                "padding is {} texels, but must be less than a quarter of the {least} texels of the last level. Use less padding, fewer \
                 levels or a larger texture.",
                self.padding
            )
        } else {
            return Ok(());
        };
        Err(Error::input(problem))
    }
}
