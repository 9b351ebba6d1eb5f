//! The result: a grid of vertices, as quads and as triangles.

use glam::DVec3;

use super::report::QuadReport;
use image::range_image::{Projection, RangeImage, Viewing};
use mesh::{Attribute, Crs, QuadMesh, TriMesh};

/// A regular grid of quads over a range image: rows x cols vertices, row by row, each on a pixel.
///
/// Seen on the pixels, columns rise strictly along each row of the grid, rows down each column, and all quads are convex: the
/// grid tiles the image from corner to corner.
#[derive(Clone, Debug, PartialEq)]
pub struct QuadGrid {
    /// Rows of vertices.
    pub rows: usize,
    /// Columns of vertices.
    pub cols: usize,
    /// Pixel of each vertex: row, column.
    pub pixels: Vec<[u32; 2]>,
    /// Place of each vertex in the sensor's frame: the sample, or where there is none a continuation of the others.
    pub positions: Vec<DVec3>,
    /// Vertices on pixels without a sample.
    pub background: Vec<bool>,
    /// Quads, (rows - 1) x (cols - 1), whose better diagonal runs from the upper right corner to the lower left one.
    pub odd_diagonals: Vec<bool>,
    /// Largest distance of the samples in each quad from it along their rays, world units.
    pub quad_errors: Vec<f32>,
    /// Quads that are part of the mesh. The others lie on the background.
    pub kept: Vec<bool>,
    /// Whether the sensor sees the image mirrored: the corners as listed turn counter-clockwise then, else clockwise.
    pub mirrored: bool,
    /// Rows and columns of pixels.
    pub image_size: [usize; 2],
    /// Attributes of the vertices, taken from their pixels.
    pub attributes: Vec<Attribute>,
    /// The system that the places are in. `None` if that is not known, and if the image has a pose.
    pub crs: Option<Crs>,
    /// Figures of the run.
    pub report: QuadReport,
}

impl QuadGrid {
    /// Corners of a quad: upper left, upper right, lower right, lower left.
    pub fn corners(&self, quad: usize) -> [usize; 4] {
        let a = quad / (self.cols - 1) * self.cols + quad % (self.cols - 1);
        [a, a + 1, a + self.cols + 1, a + self.cols]
    }

    /// Image coordinates of a vertex: 0 to 1 from the left and from the bottom, as textures are addressed.
    pub fn uv(&self, vertex: usize) -> [f32; 2] {
        let [row, col] = self.pixels[vertex].map(f64::from);
        let [last_row, last_col] = self.image_size.map(|n| (n as f64 - 1.0).max(1.0));
        [(col / last_col) as f32, (1.0 - row / last_row) as f32]
    }

    /// The kept quads with the vertices they use, in the sensor's frame. Quads turn counter-clockwise seen from the sensor.
    ///
    /// Vertex attributes: `range_row`, `range_col` (i32, the pixel), `grid_row`, `grid_col` (i32, the place in the grid), and `colour`,
    /// `intensity`, `confidence` if the image has them. Face attribute: `error` (f32, world units). If two kept quads touch in a vertex
    /// only, each has its own.
    pub fn mesh(&self) -> QuadMesh {
        // Corner c of quad q is vertex `own[..]`; quads joined over a kept side share it.
        let unset = u32::MAX;
        let mut used = vec![[unset; 2]; self.rows * self.cols];
        let mut of_vertex = Vec::new();
        let mut quads = Vec::new();
        let mut errors = Vec::new();
        let across = self.cols - 1;
        let is_kept = |i: usize, j: usize| i < self.rows - 1 && j < across && self.kept[i * across + j];
        for quad in (0..self.kept.len()).filter(|&q| self.kept[q]) {
            let (i, j) = (quad / across, quad % across);
            let mut corners = self.corners(quad).map(|v| v as u32);
            for (k, corner) in corners.iter_mut().enumerate() {
                let v = *corner as usize;
                // The two quads beside this one around the vertex, and the one opposite.
                let (down, right) = (usize::from(k >= 2), usize::from(k == 1 || k == 2));
                let (oi, oj) = ((i + 2 * down).wrapping_sub(1), (j + 2 * right).wrapping_sub(1));
                let alone = !is_kept(oi, j) && !is_kept(i, oj) && is_kept(oi, oj);
                // The lower one of two quads that only touch takes the second vertex.
                let slot = usize::from(alone && down == 0);
                if used[v][slot] == unset {
                    used[v][slot] = of_vertex.len() as u32;
                    of_vertex.push(v);
                }
                *corner = used[v][slot];
            }
            let [a, b, c, d] = corners;
            quads.push(if self.mirrored { [a, b, c, d] } else { [a, d, c, b] });
            errors.push(self.quad_errors[quad]);
        }
        let int =
            |name: &str, of: &dyn Fn(usize) -> i32| Attribute::i32(name, of_vertex.iter().map(|&v| of(v)).collect());
        let mut vertex_attributes = vec![
            int("range_row", &|v| self.pixels[v][0] as i32),
            int("range_col", &|v| self.pixels[v][1] as i32),
            int("grid_row", &|v| (v / self.cols) as i32),
            int("grid_col", &|v| (v % self.cols) as i32),
        ];
        vertex_attributes.extend(self.attributes.iter().map(|a| a.gather(&of_vertex)));
        QuadMesh {
            positions: of_vertex.iter().map(|&v| self.positions[v]).collect(),
            uvs: of_vertex.iter().map(|&v| self.uv(v)).collect(),
            quads,
            vertex_attributes,
            face_attributes: vec![Attribute::f32("error", errors)],
            crs: self.crs.clone(),
        }
    }

    /// The same as triangles, each quad cut along the diagonal that lies nearer to the image.
    pub fn triangles(&self) -> TriMesh {
        let odd: Vec<bool> = (0..self.kept.len()).filter(|&q| self.kept[q]).map(|q| self.odd_diagonals[q]).collect();
        // A mesh's quads start at the upper left corner, whichever way they turn.
        self.mesh().triangulated(|quad| odd[quad])
    }
}

/// Whether the sensor sees the image mirrored, most quads deciding.
pub(super) fn is_mirrored(image: &RangeImage, grid: [usize; 2], points: &[DVec3]) -> bool {
    if let Projection::Orthographic { step, .. } = image.projection() {
        return step[0] * step[1] > 0.0;
    }
    let toward = |point: DVec3| match image.projection() {
        Projection::PointGrid(Viewing::From(eye)) => point - *eye,
        Projection::PointGrid(Viewing::Parallel(direction)) => *direction,
        _ => point,
    };
    let [rows, cols] = grid;
    let mut votes = 0_i64;
    for i in 0..rows - 1 {
        for j in 0..cols - 1 {
            let a = i * cols + j;
            let normal = (points[a + 1] - points[a]).cross(points[a + cols] - points[a]);
            let side = normal.dot(toward(points[a]));
            votes += i64::from(side < 0.0) - i64::from(side > 0.0);
        }
    }
    votes > 0
}
