//! The parameters of unwrapping.

use base::params::{angle, count, ratio};

base::alternatives! {
    /// How large the charts are in the texture.
    pub enum ChartScale of "unwrap" {
        /// Tiles to fill, as densely as they hold the charts.
        Tiles(u32) = tiles: count("Tiles").from_data("one").at_least(1.0).at_most(100.0).since("0.2"),
        /// Texels per unit of length on the surface, in as many tiles as that takes.
        TexelsPerUnit(f64) = texels_per_unit: ratio("Texels per unit").from_data("as many as fit the tiles").above(0.0)
            .since("0.2"),
    }
    or
    /// One tile.
    OneTile
}

base::params! {
    /// How a mesh gets its texture coordinates.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct UnwrapParams of "unwrap" with threads {
        /// How large the charts are in the texture.
        extent: ChartScale,
        /// Columns and rows of a tile, in texels.
        size: u32 = count("Size").default(2048.0).at_least(16.0).at_most(16_384.0).since("0.2"),
        /// Texels that stay free around each chart, twice as many between two. Mipmaps of level n need 2^n.
        padding: u32 = count("Padding").default(4.0).at_most(256.0).since("0.2"),
        /// Largest angle between the normal of a triangle and the mean normal of its chart. Smaller angles make flatter charts and more of
        /// them.
        cone: f64 = angle("Cone").default(70_f64.to_radians()).at_least(1_f64.to_radians()).at_most(89_f64.to_radians()).since("0.2"),
        /// Largest factor by which the area of a triangle in the texture may differ from its share of the chart, either way. Charts that
        /// exceed it are split.
        max_stretch: f64 = ratio("Max stretch").default(4.0).at_least(1.1).at_most(1000.0).since("0.2"),
    }
    checked by room
}

impl UnwrapParams {
    /// Padding leaves most of a tile.
    fn room(&self) -> base::Result<()> {
        if self.padding.saturating_mul(4) < self.size {
            return Ok(());
        }
        Err(base::Error::input(format!(
            "padding is {} texels for tiles of {}, but must be less than a quarter of the size: use less padding or larger tiles",
            self.padding, self.size
        )))
    }
}
