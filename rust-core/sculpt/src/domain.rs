//! The domain, where the mesh may be: the union of the triangles of the step-discontinuity triangulation, less those that hide behind
//! others.
//!
//! ```text
//!  a --- b     Each cell of 2 x 2 pixels holds up to two of its four half cells; a half cell is named by the corner
//!  |     |     that it leaves out. a is corner 0, b 1, c 2, d 3.
//!  d --- c
//! ```

use super::folds;
use super::rays::Rays;
use base::error::{Error, Result};
use base::progress::Progress;
use image::range_image::{Projection, RangeImage};
use image::triangulate::{TriangulateParams, triangles_over_pixels};

/// The part of the image plane that the mesh covers, over pixel indices.
pub(super) struct Domain {
    pub rows: u32,
    pub cols: u32,
    /// One bit per half cell present, by the corner it leaves out. `(rows - 1) * (cols - 1)` cells, row by row.
    cells: Vec<u8>,
    /// The step-discontinuity triangles as pixels, turning like columns toward rows.
    pub triangles: Vec<[u32; 3]>,
    /// Pixels with a triangle, rising.
    pub pixels: Vec<u32>,
    /// Whether triangles that turn like columns toward rows turn clockwise seen from the sensor.
    pub mirrored: bool,
    /// Valid pixels without a triangle.
    pub isolated: usize,
    /// Triangles left out because they hide behind others.
    pub hidden: usize,
    /// Nearest and farthest range of the covered pixels.
    pub range: [f64; 2],
}

impl Domain {
    /// Triangulates the image. O(pixels).
    ///
    /// # Errors
    /// As [`image::triangulate::triangulate`]. [`Error::Cancelled`].
    pub fn new(image: &RangeImage, params: &TriangulateParams, progress: &Progress<'_>) -> Result<Self> {
        if image.rows() > u32::MAX as usize || image.cols() > u32::MAX as usize {
            return Err(Error::input(format!(
                "{}: an image may have at most 2^32 - 2 rows and columns, but this one has {} x {}",
                image.called(),
                image.rows(),
                image.cols()
            )));
        }
        let (mut over_pixels, mut pixels) = triangles_over_pixels(image, params, progress)?;
        let (rows, cols) = (image.rows() as u32, image.cols() as u32);
        let cell_cols = cols.saturating_sub(1) as usize;
        let mut domain = Domain {
            rows,
            cols,
            cells: vec![0; cell_cols * rows.saturating_sub(1) as usize],
            triangles: Vec::new(),
            pixels: Vec::new(),
            mirrored: false,
            isolated: 0,
            hidden: 0,
            range: [f64::INFINITY, f64::NEG_INFINITY],
        };
        let ahead = |pixel: u32| match image.projection() {
            // A sample behind the sensor is seen by no ray.
            Projection::Pinhole { .. } | Projection::Spherical { .. } => image.range(pixel as usize) > 0.0,
            _ => true,
        };
        over_pixels.retain(|&[a, b, c]| ahead(a) && ahead(b) && ahead(c));
        domain.mirrored = over_pixels.first().is_some_and(|&t| turns_back(t, cols));
        if domain.mirrored {
            over_pixels.iter_mut().for_each(|t| t.swap(1, 2));
        }
        progress.check()?;
        let seen_triangles = over_pixels.len();
        if folds::possible(image) {
            let hidden = match Rays::new(image, domain.mirrored) {
                Rays::Parallel(view) => folds::hidden(&view, &over_pixels, progress)?,
                Rays::Central(view) => folds::hidden(&view, &over_pixels, progress)?,
                Rays::Flat(_) | Rays::Pinhole(_) => vec![false; over_pixels.len()],
            };
            let mut hidden = hidden.into_iter();
            over_pixels.retain(|_| !hidden.next().unwrap_or(false));
        }
        over_pixels.shrink_to_fit();
        domain.hidden = seen_triangles - over_pixels.len();
        progress.check()?;
        let mut used = vec![false; image.len()];
        let mut row = 0;
        for block in progress.blocks(&over_pixels) {
            for &triangle in block? {
                domain.add(triangle, &mut row);
                triangle.iter().for_each(|&p| used[p as usize] = true);
            }
        }
        progress.check()?;
        domain.triangles = over_pixels;
        domain.isolated = pixels.len();
        pixels.retain(|&p| used[p as usize]);
        domain.isolated -= pixels.len();
        domain.pixels = pixels;
        for block in progress.blocks(&domain.pixels) {
            for &p in block? {
                let range = image.range(p as usize);
                domain.range = [domain.range[0].min(range), domain.range[1].max(range)];
            }
        }
        Ok(domain)
    }

    /// Notes the half cell of a triangle. `row` is that of the cell before: triangles come cell by cell, which spares most
    /// divisions.
    fn add(&mut self, triangle: [u32; 3], row: &mut u32) {
        let first = triangle[0].min(triangle[1]).min(triangle[2]);
        if first.checked_sub(*row * self.cols).is_none_or(|col| col >= self.cols) {
            *row = first / self.cols;
        }
        let col = first - *row * self.cols;
        let has = |offset: u32| triangle.contains(&(first + offset));
        // The first pixel is corner a, or b if the one below its left neighbour belongs to the triangle. In an image of two
        // columns that one is its right neighbour, too.
        let (col, missing) = if col > 0 && has(self.cols - 1) && (self.cols > 2 || col == 1) {
            (col - 1, 0)
        } else if !has(1) {
            (col, 1)
        } else if has(self.cols) {
            (col, 2)
        } else {
            (col, 3)
        };
        self.cells[*row as usize * (self.cols as usize - 1) + col as usize] |= 1 << missing;
    }

    /// Difference between the farthest and the nearest range, 0 without any.
    pub fn extent(&self) -> f64 {
        (self.range[1] - self.range[0]).max(0.0)
    }

    /// The half cells of the cell whose upper left pixel is (`row`, `col`). None outside of the image.
    #[inline]
    pub fn halves(&self, row: i64, col: i64) -> u8 {
        let (rows, cols) = (i64::from(self.rows) - 1, i64::from(self.cols) - 1);
        if row < 0 || col < 0 || row >= rows || col >= cols {
            return 0;
        }
        self.cells[(row * cols + col) as usize]
    }

    /// Whether the domain lies above and below the edge from pixel (`row`, `col`) to its right neighbour.
    #[inline]
    pub fn beside_horizontal(&self, row: i64, col: i64) -> [bool; 2] {
        // Above it is the edge d c, below it is a b: all half cells but those that leave out one of the ends.
        [self.halves(row - 1, col) & 0b0011 != 0, self.halves(row, col) & 0b1100 != 0]
    }

    /// Whether the domain lies left and right of the edge from pixel (`row`, `col`) to the one below.
    #[inline]
    pub fn beside_vertical(&self, row: i64, col: i64) -> [bool; 2] {
        [self.halves(row, col - 1) & 0b1001 != 0, self.halves(row, col) & 0b0110 != 0]
    }

    /// Number of fans of triangles that meet at a pixel: 1 inside and on ordinary borders, more where the domain touches
    /// itself in that pixel only.
    pub fn fans(&self, pixel: u32) -> u32 {
        let (row, col) = (i64::from(pixel / self.cols), i64::from(pixel % self.cols));
        // The cells around the pixel, turning like columns toward rows, with the corner that the pixel is in each: two
        // eighths of the plane a cell, the first one beside the edge to the next corner.
        let around = [(0, 0, 0), (0, -1, 1), (-1, -1, 2), (-1, 0, 3)];
        let mut eighths = 0_u8;
        for (i, (down, right, corner)) in around.into_iter().enumerate() {
            let halves = self.halves(row + down, col + right);
            let without = |step: u32| halves >> ((corner + step) % 4) & 1 != 0;
            eighths |= u8::from(without(2) || without(3)) << (2 * i);
            eighths |= u8::from(without(2) || without(1)) << (2 * i + 1);
        }
        (eighths & !eighths.rotate_left(1)).count_ones().max(u32::from(eighths != 0))
    }

    /// Column and row of a pixel.
    #[inline]
    pub fn place(&self, pixel: u32) -> [i64; 2] {
        [i64::from(pixel % self.cols), i64::from(pixel / self.cols)]
    }

    /// The pixel at a column and row of the image.
    #[inline]
    pub fn pixel(&self, place: [i64; 2]) -> u32 {
        (place[1] * i64::from(self.cols) + place[0]) as u32
    }

    /// Whether a straight edge between two pixels lies on the border of the domain, from the side where the domain lies on its left:
    /// turning from it like columns toward rows. Other edges along a row, column or diagonal are told apart from it. Borders along others
    /// are none of a domain.
    pub fn is_border(&self, from: u32, to: u32) -> bool {
        let (a, b) = (self.place(from), self.place(to));
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        if dx != 0 && dy != 0 && dx.abs() != dy.abs() {
            return false;
        }
        // The first unit of the edge tells for all.
        self.is_border_step(a, [a[0] + dx.signum(), a[1] + dy.signum()])
    }

    /// Whether the step from a pixel to one of its eight neighbours is an edge of the border with the domain on its left.
    pub fn is_border_step(&self, [x, y]: [i64; 2], to: [i64; 2]) -> bool {
        let beside = |[outer, inner]: [bool; 2]| inner && !outer;
        let swapped = |[a, b]: [bool; 2]| [b, a];
        match (to[0] - x, to[1] - y) {
            (1, 0) => beside(self.beside_horizontal(y, x)),
            (-1, 0) => beside(swapped(self.beside_horizontal(y, x - 1))),
            (0, 1) => beside(swapped(self.beside_vertical(y, x))),
            (0, -1) => beside(self.beside_vertical(y - 1, x)),
            (1, 1) => self.halves(y, x) == 0b0010,
            (-1, -1) => self.halves(y - 1, x - 1) == 0b1000,
            (1, -1) => self.halves(y - 1, x) == 0b0001,
            (-1, 1) => self.halves(y, x - 1) == 0b0100,
            _ => false,
        }
    }

    /// Whether the border of the domain goes through a pixel of it.
    pub fn is_on_border(&self, pixel: u32) -> bool {
        let [x, y] = self.place(pixel);
        let around = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1]];
        around.into_iter().any(|[dx, dy]| self.is_border_step([x, y], [x + dx, y + dy]))
    }
}

/// Whether three neighbouring pixels turn like rows toward columns.
fn turns_back(triangle: [u32; 3], cols: u32) -> bool {
    let [(ax, ay), (bx, by), (cx, cy)] = triangle.map(|p| (i64::from(p % cols), i64::from(p / cols)));
    (bx - ax) * (cy - ay) - (by - ay) * (cx - ax) < 0
}
