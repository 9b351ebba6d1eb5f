//! Points found by place.

use glam::DVec3;

/// Points found by place: all within a radius.
pub(crate) struct Neighbours {
    low: DVec3,
    side: f64,
    counts: [usize; 3],
    /// The first entry of each cell. The last is how many there are.
    starts: Vec<u32>,
    entries: Vec<(DVec3, u32)>,
}

/// Cells along the longest side.
const MOST_CELLS: f64 = 96.0;

impl Neighbours {
    /// Made for looking within `radius`. O(n).
    pub fn new(points: &[DVec3], radius: f64) -> Self {
        let low = points.iter().fold(DVec3::INFINITY, |m, p| m.min(*p));
        let high = points.iter().fold(DVec3::NEG_INFINITY, |m, p| m.max(*p));
        let extent = if points.is_empty() { DVec3::ZERO } else { high - low };
        let side = radius.max(extent.max_element() / MOST_CELLS).max(f64::MIN_POSITIVE);
        let counts = extent.to_array().map(|e| (e / side) as usize + 1);
        let mut grid = Neighbours { low, side, counts, starts: Vec::new(), entries: Vec::new() };
        let mut starts = vec![0_u32; counts.iter().product::<usize>() + 1];
        let cells: Vec<usize> = points.iter().map(|&p| grid.index(grid.cell(p))).collect();
        cells.iter().for_each(|&cell| starts[cell + 1] += 1);
        for cell in 1..starts.len() {
            starts[cell] += starts[cell - 1];
        }
        let mut next = starts.clone();
        grid.entries = vec![(DVec3::ZERO, 0); points.len()];
        for (k, (&cell, &point)) in cells.iter().zip(points).enumerate() {
            grid.entries[next[cell] as usize] = (point, k as u32);
            next[cell] += 1;
        }
        grid.starts = starts;
        grid
    }

    fn cell(&self, at: DVec3) -> [usize; 3] {
        let place = ((at - self.low) / self.side).to_array();
        [0, 1, 2].map(|axis| (place[axis].max(0.0) as usize).min(self.counts[axis] - 1))
    }

    fn index(&self, cell: [usize; 3]) -> usize {
        (cell[2] * self.counts[1] + cell[1]) * self.counts[0] + cell[0]
    }

    /// Indices of the points within `radius`, the place itself included.
    pub fn within(&self, at: DVec3, radius: f64, found: &mut Vec<u32>) {
        found.clear();
        let (low, high) = (self.cell(at - radius), self.cell(at + radius));
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                let row = [self.index([low[0], y, z]), self.index([high[0], y, z])];
                let entries = &self.entries[self.starts[row[0]] as usize..self.starts[row[1] + 1] as usize];
                found.extend(entries.iter().filter(|e| e.0.distance_squared(at) <= radius * radius).map(|e| e.1));
            }
        }
    }
}
