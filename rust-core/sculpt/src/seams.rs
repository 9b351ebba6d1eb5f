//! The pixels that must be vertices before the digging starts: the border of the domain, and enough of each line between tiles to keep it
//! within the tolerance. So tiles can be dug independently and still fit.

use super::domain::Domain;
use super::view::{LatticeSite, View};

/// Side of a tile in pixels. Neighbouring tiles share a line of pixels. Tests look across many seams.
pub(super) const TILE: u32 = if cfg!(test) { 16 } else { 128 };

/// Origins of the tiles along an axis of `count` pixels.
pub(super) fn tile_origins(count: u32) -> Vec<u32> {
    if count < 2 { Vec::new() } else { (0..count - 1).step_by(TILE as usize).collect() }
}

/// The first of a falling row of tolerances for which each pixel must be a vertex.
#[derive(Clone)]
pub(super) struct Required {
    from: Vec<u8>,
    tolerances: u8,
}

/// Must be a vertex for no tolerance yet.
const NEVER: u8 = u8::MAX;

impl Required {
    /// For any tolerance: the border of the domain.
    pub fn new(domain: &Domain) -> Self {
        let mut from = vec![NEVER; domain.rows as usize * domain.cols as usize];
        if domain.rows > 1 && domain.cols > 1 {
            mark_border(domain, &mut from);
        }
        Required { from, tolerances: 0 }
    }

    /// Adds a tolerance below those before, 254 of them at most.
    pub fn add<V: View>(&mut self, view: &V, domain: &Domain, tolerance: f64)
    where
        V::Site: LatticeSite,
    {
        let level = self.tolerances;
        self.tolerances += 1;
        if domain.rows < 2 || domain.cols < 2 {
            return;
        }
        let (rows, cols) = (i64::from(domain.rows), i64::from(domain.cols));
        let mut seam = Seam { view, tolerance, level, from: &mut self.from, stack: Vec::new() };
        for row in tile_origins(domain.rows).into_iter().chain([domain.rows - 1]).map(i64::from) {
            seam.simplify(cols, |col| domain.beside_horizontal(row, col), |col| (row * cols + col) as usize);
        }
        for col in tile_origins(domain.cols).into_iter().chain([domain.cols - 1]).map(i64::from) {
            seam.simplify(rows, |row| domain.beside_vertical(row, col), |row| (row * cols + col) as usize);
        }
    }

    /// Whether a pixel must be a vertex for the tolerance of that number.
    #[inline]
    pub fn has(&self, pixel: u32, tolerance: u8) -> bool {
        self.from[pixel as usize] <= tolerance
    }
}

/// Marks both ends of every unit edge and diagonal that lies on the border of the domain but not on a line between tiles.
fn mark_border(domain: &Domain, from: &mut [u8]) {
    let (rows, cols) = (i64::from(domain.rows), i64::from(domain.cols));
    let on_line = |i: i64, count: i64| i % i64::from(TILE) == 0 || i == count - 1;
    for row in 0..rows {
        let row_on_line = on_line(row, rows);
        for col in 0..cols {
            let p = (row * cols + col) as usize;
            if col + 1 < cols && !row_on_line {
                let [above, below] = domain.beside_horizontal(row, col);
                if above != below {
                    from[p] = 0;
                    from[p + 1] = 0;
                }
            }
            if row + 1 < rows && !on_line(col, cols) {
                let [left, right] = domain.beside_vertical(row, col);
                if left != right {
                    from[p] = 0;
                    from[p + cols as usize] = 0;
                }
            }
            if let Some([start, end]) = lone_diagonal(domain.halves(row, col)) {
                from[p + start.0 + start.1 * cols as usize] = 0;
                from[p + end.0 + end.1 * cols as usize] = 0;
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
    level: u8,
    from: &'a mut [u8],
    stack: Vec<[i64; 2]>,
}

impl<V: View> Seam<'_, V>
where
    V::Site: LatticeSite,
{
    /// Marks enough pixels of a line of `count` pixels. `beside` tells on which sides the edge from a pixel to the next
    /// one has the domain.
    fn simplify(&mut self, count: i64, beside: impl Fn(i64) -> [bool; 2], pixel: impl Fn(i64) -> usize) {
        let mut start = 0;
        while start + 1 < count {
            let sides = beside(start);
            let mut end = start + 1;
            // A run ends where the domain changes, at the corners of tiles and where the border leaves the line.
            while end + 1 < count
                && end % i64::from(TILE) != 0
                && self.from[pixel(end)] == NEVER
                && beside(end) == sides
            {
                end += 1;
            }
            if sides[0] || sides[1] {
                self.mark(pixel(start));
                self.mark(pixel(end));
                self.split(start, end, &pixel);
            }
            start = end;
        }
    }

    fn mark(&mut self, pixel: usize) {
        self.from[pixel] = self.from[pixel].min(self.level);
    }

    /// Marks the worst pixel between two vertices until all are within the tolerance.
    fn split(&mut self, start: i64, end: i64, pixel: impl Fn(i64) -> usize) {
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
                self.mark(pixel(middle));
                self.stack.push([start, middle]);
                self.stack.push([middle, end]);
            }
        }
    }
}
