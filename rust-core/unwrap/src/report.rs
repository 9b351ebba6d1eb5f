//! The result of unwrapping, and its figures.

use glam::DVec2;

use base::progress::Seconds;
use mesh::TriMesh;

base::report! {
    /// The figures of unwrapping.
    #[derive(Default)]
    pub struct UnwrapReport {
        /// Charts.
        charts: usize = count("Charts").since("0.2"),
        /// Charts before small ones were joined to their neighbours.
        charts_before: usize = count("Charts before joining").since("0.2"),
        /// Tiles.
        tiles: usize = count("Tiles").since("0.2"),
        /// Share of the tiles that triangles cover.
        used: f64 = ratio("Used").since("0.2"),
        /// Texels per unit of length: the root of the texels that triangles cover over their area on the surface.
        texels_per_unit: f64 = number("Texels per unit").since("0.2"),
        /// Mean stretch over the surface. The stretch of a triangle is the larger of its longest stretched length and the inverse of its
        /// shortest one, as a multiple of the texels per unit. 1 is none.
        stretch: f64 = number("Stretch").since("0.2"),
        /// Nineteen twentieths of the surface are stretched less.
        stretch_p95: f64 = number("Stretch, 95 %").since("0.2"),
        /// Triangles that have no area in the texture: degenerate ones, and those too thin for single precision.
        collapsed: usize = count("Triangles without area").since("0.2"),
        /// Their share of the surface.
        collapsed_area: f64 = ratio("Share without area").since("0.2"),
        /// Vertices that were moved as single precision turned one of their triangles.
        moved: usize = count("Vertices moved").since("0.2"),
        /// Wall-clock seconds by the name of the stage.
        seconds: Seconds = stages().since("0.2"),
    }
}

/// Result of unwrapping.
#[derive(Clone, Debug, PartialEq)]
pub struct Unwrapped {
    /// The mesh with the same triangles in the same order. Vertices on seams come once per chart. Attributes ride along. What follows
    /// here is in it as attributes, too: `s` and `t` have the texture coordinates of the vertices, `source_vertex` their sources, and
    /// `chart` the charts of the triangles.
    pub mesh: TriMesh,
    /// Texture coordinates, one per vertex of `mesh`: multiples of 2^-24 that single precision holds.
    pub uv: Vec<DVec2>,
    /// The vertex of the input that each vertex was.
    pub source: Vec<u32>,
    /// The chart of each triangle. -1 for one without area in the texture.
    pub chart: Vec<i32>,
    /// Figures of the run.
    pub report: UnwrapReport,
}
