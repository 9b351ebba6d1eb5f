//! Digging by greedy insertion: each tile starts with its border and gets the pixel that lies farthest from the mesh,
//! until none lies farther than the tolerance. A pixel enters when the digging reaches it, none before. A tile dug to one
//! tolerance can be dug on to a smaller one.

use std::collections::BinaryHeap;

use super::delaunay::{Delaunay, NONE, Spot, next_of, row_col, spot, turn};
use super::domain::Domain;
use super::pieces::Pieces;
use super::seams::{Required, TILE, lone_diagonal};
use super::view::{LatticeSite, Site, View};
use base::error::Result;
use base::progress::Progress;

/// Checks for cancelling come once in this many insertions.
const CHECK: u32 = 1024;

/// A triangle to be refined. The largest error comes first, then the first pixel, so that ties have one outcome.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Entry {
    /// Bits of a positive number, which sort as the number does.
    error: u64,
    pixel: Spot,
    triangle: u32,
}

/// The pixel of a triangle that lies farthest from it.
#[derive(Clone, Copy)]
struct Worst {
    error: f64,
    pixel: Spot,
}

impl Worst {
    const NONE: Worst = Worst { error: 0.0, pixel: NONE };

    fn entry(self, triangle: u32) -> Entry {
        Entry { error: self.error.to_bits(), pixel: self.pixel, triangle }
    }
}

/// The mesh of a tile, dug to some tolerance, from which it can be dug on.
#[derive(Clone)]
pub(super) struct Tile {
    /// Row and column of the upper left pixel, and of the lower right one from there.
    origin: [u32; 2],
    last: [u32; 2],
    /// Columns of the image.
    cols: u32,
    mesh: Delaunay,
    worst: Vec<Worst>,
    /// Whether each triangle lies in the domain.
    inside: Vec<bool>,
}

impl Tile {
    /// The tile whose upper left pixel is `origin` (row, column), with the pixels that are required for the first tolerance. None if there
    /// is nothing of the domain.
    pub fn new(domain: &Domain, required: &Required, origin: [u32; 2]) -> Option<Self> {
        let last = [0, 1].map(|axis| {
            let count = if axis == 0 { domain.rows } else { domain.cols };
            TILE.min(count - 1 - origin[axis])
        });
        let any = (0..last[0])
            .any(|r| (0..last[1]).any(|c| domain.halves(i64::from(origin[0] + r), i64::from(origin[1] + c)) != 0));
        if !any {
            return None;
        }
        let mesh = Delaunay::new(last[0], last[1]);
        let mut tile = Tile { origin, last, cols: domain.cols, mesh, worst: Vec::new(), inside: Vec::new() };
        tile.insert_required(required);
        tile.settle_border(domain);
        tile.classify(domain);
        tile.list_pixels();
        Some(tile)
    }

    fn pixel(&self, spot: Spot) -> u32 {
        let (row, col) = row_col(spot);
        (self.origin[0] + row) * self.cols + self.origin[1] + col
    }

    fn is_on_border(&self, spot: Spot) -> bool {
        let (row, col) = row_col(spot);
        row == 0 || col == 0 || row == self.last[0] || col == self.last[1]
    }

    /// Inserts the required pixels in an order that looks random, which takes n log n time, expected.
    fn insert_required(&mut self, required: &Required) {
        let mut spots = Vec::new();
        for row in 0..=self.last[0] {
            for col in 0..=self.last[1] {
                let corner = (row == 0 || row == self.last[0]) && (col == 0 || col == self.last[1]);
                let spot = spot(row, col);
                if !corner && required.has(self.pixel(spot), 0) {
                    spots.push(spot);
                }
            }
        }
        // Multiplying by an odd number permutes the spots.
        spots.sort_unstable_by_key(|s| s.wrapping_mul(0x9e37_79b1).rotate_right(13));
        let opposite = spot(self.last[0], self.last[1]);
        for &s in &spots {
            self.mesh.list(u32::from(turn(0, opposite, s) >= 0), s);
        }
        let mut open = vec![0, 1];
        while let Some(t) = open.pop() {
            let p = self.mesh.first[t as usize];
            if p != NONE {
                self.mesh.insert(p, t);
                open.append(&mut self.mesh.touched);
            }
        }
    }

    /// Makes the diagonals on the border of the domain edges.
    fn settle_border(&mut self, domain: &Domain) {
        let mut at_vertex = Vec::new();
        for row in 0..self.last[0] {
            for col in 0..self.last[1] {
                let halves = domain.halves(i64::from(self.origin[0] + row), i64::from(self.origin[1] + col));
                if let Some([from, to]) = lone_diagonal(halves) {
                    if at_vertex.is_empty() {
                        at_vertex = vec![NONE; self.mesh.next.len()];
                        for (h, &corner) in self.mesh.corners.iter().enumerate() {
                            at_vertex[self.mesh.index(corner)] = h as u32;
                        }
                    }
                    let [from, to] = [from, to].map(|(right, down)| spot(row + down as u32, col + right as u32));
                    self.mesh.settle_diagonal(from, to, &mut at_vertex);
                }
            }
        }
        self.mesh.touched.clear();
    }

    /// Finds the triangles that lie in the domain. As its whole border consists of edges, a triangle lies in it if its
    /// centroid does.
    fn classify(&mut self, domain: &Domain) {
        self.inside = (0..self.mesh.len() as usize)
            .map(|t| {
                let corners: [Spot; 3] = std::array::from_fn(|i| self.mesh.corners[3 * t + i]);
                let (row, col) =
                    corners.iter().map(|&c| row_col(c)).fold((0, 0), |sum, place| (sum.0 + place.0, sum.1 + place.1));
                // A centroid on the edge of a cell or on a diagonal lies inside of the triangle, as do both sides then.
                let ([row, col], [down, right]) = ([row / 3, col / 3], [row % 3, col % 3]);
                let halves = domain.halves(i64::from(self.origin[0] + row), i64::from(self.origin[1] + col));
                match halves {
                    0b0001 => right + down >= 3,
                    0b0010 => down >= right,
                    0b0100 => right + down <= 3,
                    0b1000 => right >= down,
                    halves => halves != 0,
                }
            })
            .collect();
    }

    /// Puts every pixel that is no vertex into the list of one triangle that it is seen in.
    fn list_pixels(&mut self) {
        const FREE: u32 = NONE - 1;
        self.mesh.next.fill(FREE);
        for &corner in &self.mesh.corners {
            let index = self.mesh.index(corner);
            self.mesh.next[index] = NONE;
        }
        for t in 0..self.mesh.len() {
            if !self.inside[t as usize] {
                continue;
            }
            let corners: [Spot; 3] = std::array::from_fn(|i| self.mesh.corners[3 * t as usize + i]);
            for_each_spot(corners, |spot| {
                let index = self.mesh.index(spot);
                if self.mesh.next[index] == FREE {
                    self.mesh.list(t, spot);
                }
            });
        }
    }

    /// Inserts the pixels on the lines between tiles that are required for a tolerance after the first one. Returns the
    /// triangles that changed.
    fn split_lines(&mut self, required: &Required, level: u8) -> Vec<u32> {
        let mut changed = Vec::new();
        let mut open: Vec<u32> = (0..self.mesh.len()).filter(|&t| self.inside[t as usize]).collect();
        while let Some(t) = open.pop() {
            if !self.mesh.twins[3 * t as usize..][..3].contains(&NONE) {
                continue;
            }
            let mut spot = self.mesh.first[t as usize];
            while spot != NONE && !(self.is_on_border(spot) && required.has(self.pixel(spot), level)) {
                spot = self.mesh.next[self.mesh.index(spot)];
            }
            if spot != NONE {
                self.mesh.insert(spot, t);
                self.inside.resize(self.mesh.len() as usize, true);
                changed.extend(&self.mesh.touched);
                open.append(&mut self.mesh.touched);
            }
        }
        changed.sort_unstable();
        changed.dedup();
        changed
    }

    /// The triangles in the domain with their pixels. A pixel on a line between tiles goes to one of them only.
    pub fn pieces(&self, domain: &Domain) -> Pieces {
        let mut pieces = Pieces::default();
        let in_last = [0, 1].map(|axis| {
            let count = if axis == 0 { domain.rows } else { domain.cols };
            self.origin[axis] + self.last[axis] == count - 1
        });
        let ours = |spot: Spot| {
            let (row, col) = row_col(spot);
            (row < self.last[0] || in_last[0]) && (col < self.last[1] || in_last[1])
        };
        // If a tile's own half of a line lies outside of the domain, its neighbour's holds the pixel.
        let elsewhere = |spot: Spot| {
            !ours(spot) && {
                let (row, col) = row_col(spot);
                let (row, col) = (i64::from(self.origin[0] + row), i64::from(self.origin[1] + col));
                if row_col(spot).0 == self.last[0] && !in_last[0] {
                    domain.beside_horizontal(row, col)[1]
                } else {
                    domain.beside_vertical(row, col)[1]
                }
            }
        };
        for t in (0..self.mesh.len() as usize).filter(|&t| self.inside[t]) {
            let mut pixel = self.mesh.first[t];
            while pixel != NONE {
                if !elsewhere(pixel) {
                    pieces.pixels.push(self.pixel(pixel));
                }
                pixel = self.mesh.next[self.mesh.index(pixel)];
            }
            pieces.push(std::array::from_fn(|i| self.pixel(self.mesh.corners[3 * t + i])));
        }
        pieces
    }
}

/// A tile while pixels are inserted.
pub(super) struct Digging<'a, V: View> {
    view: &'a V,
    pub tile: Tile,
    /// By index in the tile, once there is need for one. Of pixels outside of the domain they mean nothing.
    sites: Vec<V::Site>,
    tolerance: f64,
    heap: BinaryHeap<Entry>,
}

impl<'a, V: View> Digging<'a, V>
where
    V::Site: LatticeSite,
{
    pub fn new(view: &'a V, tile: Tile) -> Self {
        Digging { view, tile, sites: Vec::new(), tolerance: 0.0, heap: BinaryHeap::new() }
    }

    /// Inserts what is required for the tolerance of number `level`, then the worst pixel until all are within `tolerance`
    /// (world units). Levels come one after the other.
    pub fn dig(&mut self, required: &Required, level: u8, tolerance: f64, progress: &Progress<'_>) -> Result<()> {
        // A smooth image has many tiles with few pixels to insert.
        progress.check()?;
        let tile = &mut self.tile;
        let mut changed = tile.split_lines(required, level);
        if tile.worst.is_empty() {
            changed = (0..tile.mesh.len()).collect();
        }
        tile.worst.resize(tile.mesh.len() as usize, Worst::NONE);
        for &t in &changed {
            tile.worst[t as usize] = Worst::NONE;
        }
        let open = |(t, worst): (usize, &Worst)| (worst.error > tolerance).then(|| worst.entry(t as u32));
        self.heap = tile.worst.iter().enumerate().filter_map(open).collect();
        self.tolerance = tolerance;
        if self.heap.is_empty() && changed.is_empty() {
            return Ok(());
        }
        if self.sites.is_empty() {
            let [rows, cols] = tile.last.map(|last| last + 1);
            self.sites.reserve_exact(rows as usize * cols as usize);
            for row in 0..rows {
                let start = tile.pixel(spot(row, 0));
                self.sites.extend((start..start + cols).map(|pixel| self.view.site(pixel)));
            }
        }
        changed.into_iter().for_each(|t| self.judge(t));
        self.run(progress)
    }

    /// Inserts the worst pixel until all are within the tolerance.
    fn run(&mut self, progress: &Progress<'_>) -> Result<()> {
        let mut inserted = 0;
        while let Some(Entry { pixel, triangle, .. }) = self.heap.pop() {
            if self.tile.worst[triangle as usize].pixel != pixel {
                continue;
            }
            inserted += 1;
            if inserted % CHECK == 0 {
                progress.check()?;
            }
            let tile = &mut self.tile;
            tile.mesh.insert(pixel, triangle);
            // Edges on the border never flip, so that all new triangles lie in the domain.
            tile.inside.resize(tile.mesh.len() as usize, true);
            tile.worst.resize(tile.mesh.len() as usize, Worst::NONE);
            let mut touched = std::mem::take(&mut tile.mesh.touched);
            for &t in &touched {
                tile.worst[t as usize] = Worst::NONE;
            }
            touched.sort_unstable();
            touched.dedup();
            for &t in &touched {
                self.judge(t);
            }
            touched.clear();
            self.tile.mesh.touched = touched;
        }
        Ok(())
    }

    /// Finds the worst pixel of a triangle.
    fn judge(&mut self, t: u32) {
        let mesh = &self.tile.mesh;
        let mut pixel = mesh.first[t as usize];
        if pixel == NONE {
            return;
        }
        let [a, b, c] = [0, 1, 2].map(|i| self.sites[mesh.index(mesh.corners[3 * t as usize + i])]);
        let plane = Site::plane(&a, &b, &c);
        let mut worst = Worst::NONE;
        while pixel != NONE {
            let index = mesh.index(pixel);
            let error = Site::error(&plane, &self.sites[index]).abs();
            // The line between two tiles is settled for both.
            if error > worst.error && !self.tile.is_on_border(pixel) {
                worst = Worst { error, pixel };
            }
            pixel = mesh.next[index];
        }
        self.tile.worst[t as usize] = worst;
        if worst.error > self.tolerance {
            self.heap.push(worst.entry(t));
        }
    }
}

/// Calls `visit` for the lattice points of a closed triangle.
fn for_each_spot(corners: [Spot; 3], mut visit: impl FnMut(Spot)) {
    let places = corners.map(|c| {
        let (row, col) = row_col(c);
        (i64::from(row), i64::from(col))
    });
    let [top, bottom] = [places.iter().map(|p| p.0).min(), places.iter().map(|p| p.0).max()].map(|r| r.unwrap_or(0));
    for row in top..=bottom {
        let (mut from, mut to) = (0, i64::from(u16::MAX));
        for i in 0..3 {
            let ((ay, ax), (by, bx)) = (places[i], places[next_of(i as u32) as usize]);
            // (bx - ax) (row - ay) - (by - ay) (col - ax) >= 0
            let (rise, offset) = (by - ay, (bx - ax) * (row - ay) + (by - ay) * ax);
            if rise > 0 {
                to = to.min(offset.div_euclid(rise));
            } else if rise < 0 {
                // col >= offset / rise, rounded up.
                from = from.max(-(offset.div_euclid(-rise)));
            }
        }
        for col in from..=to {
            visit(spot(row as u32, col as u32));
        }
    }
}
