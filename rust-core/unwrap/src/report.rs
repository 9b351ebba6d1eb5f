//! The result of unwrapping, and its figures.

use glam::DVec2;

use mesh::TriMesh;

/// The figures of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct UnwrapReport {
    /// Charts.
    pub charts: usize,
    /// Charts before small ones were joined to their neighbours.
    pub charts_before: usize,
    /// Tiles.
    pub tiles: usize,
    /// Share of the tiles that triangles cover.
    pub used: f64,
    /// Texels per unit of length: the root of the texels that triangles cover over their area on the surface.
    pub texels_per_unit: f64,
    /// Stretch of a triangle: the larger of its longest stretched length and its shortest one's inverse, as a multiple of
    /// `texels_per_unit`. 1 is none. Mean over the surface.
    pub stretch: f64,
    /// Nineteen twentieths of the surface are stretched less.
    pub stretch_p95: f64,
    /// Triangles that have no area in the texture: degenerate ones, and those too thin for single precision.
    pub collapsed: usize,
    /// Their share of the surface.
    pub collapsed_area: f64,
    /// Vertices that were moved as single precision turned one of their triangles.
    pub moved: usize,
    /// Names of the stages with their wall-clock seconds.
    pub seconds: Vec<(&'static str, f64)>,
}

/// Result of unwrapping.
#[derive(Clone, Debug, PartialEq)]
pub struct Unwrapped {
    /// The mesh with the same triangles in the same order. Vertices on seams come once per chart. Attributes ride along.
    pub mesh: TriMesh,
    /// Texture coordinates, one per vertex of `mesh`: numbers that single precision holds.
    pub uv: Vec<DVec2>,
    /// The vertex of the input that each vertex was.
    pub source: Vec<u32>,
    /// The chart of each triangle. -1 for one without area in the texture.
    pub chart: Vec<i32>,
    /// Figures of the run.
    pub report: UnwrapReport,
}
