//! The pixels that must be vertices before the digging starts: the border of the domain, and enough of each line between
//! tiles to keep it within the tolerance, so that tiles can be dug independently and still fit.

use super::domain::Domain;
use super::view::{LatticeSite, View};

/// Side of a tile in pixels. Neighbouring tiles share a line of pixels. Tests look across many seams.
pub(super) const TILE: u32 = if cfg!(test) { 16 } else { 128 };

/// Origins of the tiles along an axis of `count` pixels.
pub(super) fn tile_origins(count: u32) -> Vec<u32> {
    if count < 2 { Vec::new() } else { (0..count - 1).step_by(TILE as usize).collect() }
}

/// A flag a pixel: whether it must be a vertex.
pub(super) fn required<V: View>(view: &V, domain: &Domain, tolerance: f64) -> Vec<bool>
where
    V::Site: LatticeSite,
{
    let mut required = vec![false; domain.rows as usize * domain.cols as usize];
    if domain.rows < 2 || domain.cols < 2 {
        return required;
    }
    mark_border(domain, &mut required);
    let (rows, cols) = (i64::from(domain.rows), i64::from(domain.cols));
    let mut seam = Seam { view, tolerance, stack: Vec::new() };
    for row in tile_origins(domain.rows).into_iter().chain([domain.rows - 1]).map(i64::from) {
        let pixel = |col: i64| (row * cols + col) as usize;
        seam.simplify(cols, |col| domain.beside_horizontal(row, col), pixel, &mut required);
    }
    for col in tile_origins(domain.cols).into_iter().chain([domain.cols - 1]).map(i64::from) {
        let pixel = |row: i64| (row * cols + col) as usize;
        seam.simplify(rows, |row| domain.beside_vertical(row, col), pixel, &mut required);
    }
    required
}

/// Marks both ends of every unit edge and diagonal that lies on the border of the domain but not on a line between tiles.
fn mark_border(domain: &Domain, required: &mut [bool]) {
    let (rows, cols) = (i64::from(domain.rows), i64::from(domain.cols));
    let on_line = |i: i64, count: i64| i % i64::from(TILE) == 0 || i == count - 1;
    for row in 0..rows {
        let row_on_line = on_line(row, rows);
        for col in 0..cols {
            let p = (row * cols + col) as usize;
            if col + 1 < cols && !row_on_line {
                let [above, below] = domain.beside_horizontal(row, col);
                if above != below {
                    required[p] = true;
                    required[p + 1] = true;
                }
            }
            if row + 1 < rows && !on_line(col, cols) {
                let [left, right] = domain.beside_vertical(row, col);
                if left != right {
                    required[p] = true;
                    required[p + cols as usize] = true;
                }
            }
            if let Some([from, to]) = lone_diagonal(domain.halves(row, col)) {
                required[p + from.0 + from.1 * cols as usize] = true;
                required[p + to.0 + to.1 * cols as usize] = true;
            }
        }
    }
}

/// Ends of the diagonal of a cell that holds one half only, as steps right and down from its upper left pixel.
pub(super) fn lone_diagonal(halves: u8) -> Option<[(usize, usize); 2]> {
    match halves {
        0b0001 | 0b0100 => Some([(1, 0), (0, 1)]),
        0b0010 | 0b1000 => Some([(0, 0), (1, 1)]),
        _ => None,
    }
}

/// Chooses vertices along lines between tiles.
struct Seam<'a, V> {
    view: &'a V,
    tolerance: f64,
    stack: Vec<[i64; 2]>,
}

impl<V: View> Seam<'_, V>
where
    V::Site: LatticeSite,
{
    /// Marks enough pixels of a line of `count` pixels. `beside` tells on which sides the edge from a pixel to the next
    /// one has the domain.
    fn simplify(
        &mut self,
        count: i64,
        beside: impl Fn(i64) -> [bool; 2],
        pixel: impl Fn(i64) -> usize,
        required: &mut [bool],
    ) {
        let mut start = 0;
        while start + 1 < count {
            let sides = beside(start);
            let mut end = start + 1;
            // A run ends where the domain changes, at the corners of tiles and where the border leaves the line.
            while end + 1 < count && end % i64::from(TILE) != 0 && !required[pixel(end)] && beside(end) == sides {
                end += 1;
            }
            if sides[0] || sides[1] {
                required[pixel(start)] = true;
                required[pixel(end)] = true;
                self.split(start, end, &pixel, required);
            }
            start = end;
        }
    }

    /// Marks the worst pixel between two vertices until all are within the tolerance.
    fn split(&mut self, start: i64, end: i64, pixel: impl Fn(i64) -> usize, required: &mut [bool]) {
        self.stack.push([start, end]);
        while let Some([start, end]) = self.stack.pop() {
            let site = |i: i64| self.view.site(pixel(i) as u32);
            let (a, b) = (site(start), site(end));
            let mut worst = (self.tolerance, None);
            for i in start + 1..end {
                let t = (i - start) as f64 / (end - start) as f64;
                let error = LatticeSite::error_on_edge(&a, &b, t, &site(i)).abs();
                if error > worst.0 {
                    worst = (error, Some(i));
                }
            }
            if let (_, Some(middle)) = worst {
                required[pixel(middle)] = true;
                self.stack.push([start, middle]);
                self.stack.push([middle, end]);
            }
        }
    }
}
