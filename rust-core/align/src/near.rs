//! The point of a level nearest to a place: by a grid whose cells hold about a point each, and know how far the next is.
//!
//! A search looks for tens of millions of them, most where nothing is near. A tree, which is as good for any points, took a third of
//! all time. These lie evenly.

use glam::DVec3;

/// Most cells of a grid: 5 bytes each.
const CELLS: usize = 1 << 16;
/// Cells are as wide as the limits of most searches. They are wider where there would be too many, by so much at a time.
const WIDER: f64 = 1.2;
/// Farther than so many cells all is equally far.
const FAR: u8 = 6;

/// Points found by place: the nearest.
#[derive(Default)]
pub(crate) struct Near {
    low: DVec3,
    high: DVec3,
    side: f64,
    counts: [usize; 3],
    /// The first entry of each cell. The last is how many there are.
    starts: Vec<u32>,
    entries: Vec<(DVec3, u32)>,
    /// Steps, along any axis or diagonal, from each cell to the next that holds a point.
    away: Vec<u8>,
}

impl Near {
    /// Made for points that lie about `spacing` apart. O(n).
    pub fn new(points: &[DVec3], spacing: f64) -> Self {
        if points.is_empty() {
            return Near::default();
        }
        let low = points.iter().fold(DVec3::INFINITY, |m, p| m.min(*p));
        let high = points.iter().fold(DVec3::NEG_INFINITY, |m, p| m.max(*p));
        let along = |side: f64| ((high - low) / side).to_array().map(|count| count.floor() + 1.0);
        let mut side = spacing.max(f64::MIN_POSITIVE);
        while along(side).iter().product::<f64>() > CELLS as f64 {
            side *= WIDER;
        }
        let counts = along(side).map(|count| count as usize);
        let mut near = Near { low, high, side, counts, ..Near::default() };
        let mut starts = vec![0_u32; counts.iter().product::<usize>() + 1];
        let cells: Vec<usize> = points.iter().map(|&p| near.index(near.cell(p))).collect();
        cells.iter().for_each(|&cell| starts[cell + 1] += 1);
        near.away = starts[1..].iter().map(|&count| if count > 0 { 0 } else { FAR }).collect();
        for cell in 1..starts.len() {
            starts[cell] += starts[cell - 1];
        }
        let mut next = starts.clone();
        near.entries = vec![(DVec3::ZERO, 0); points.len()];
        for (k, (&cell, &point)) in cells.iter().zip(points).enumerate() {
            near.entries[next[cell] as usize] = (point, k as u32);
            next[cell] += 1;
        }
        near.starts = starts;
        near.spread();
        near
    }

    /// Steps from what holds points, one axis after the other: of a cell the least of the larger of steps along this axis and of those
    /// that were found along the others.
    fn spread(&mut self) {
        let strides = [1, self.counts[0], self.counts[0] * self.counts[1]];
        let mut line = Vec::new();
        for (axis, stride) in strides.into_iter().enumerate() {
            let count = self.counts[axis];
            for first in (0..self.away.len()).filter(|cell| cell / stride % count == 0) {
                line.clear();
                line.extend((0..count).map(|k| self.away[first + k * stride]));
                for k in 0..count {
                    let reach = usize::from(FAR);
                    let beside = k.saturating_sub(reach)..(k + reach + 1).min(count);
                    let least = beside.map(|other| line[other].max(other.abs_diff(k) as u8)).min();
                    self.away[first + k * stride] = least.expect("a cell is beside itself");
                }
            }
        }
    }

    #[inline(always)]
    fn cell(&self, at: DVec3) -> [usize; 3] {
        let place = (at - self.low) / self.side;
        let [x, y, z] = self.counts;
        [(place.x as usize).min(x - 1), (place.y as usize).min(y - 1), (place.z as usize).min(z - 1)]
    }

    #[inline(always)]
    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.counts[1] + y) * self.counts[0] + x
    }

    /// The nearest point closer to `at` than `limit`, and its distance. Of equally near ones the same, always.
    pub fn nearest_within(&self, at: DVec3, limit: f64) -> Option<(u32, f64)> {
        if self.entries.is_empty() || !at.is_finite() {
            return None;
        }
        // No point is nearer to a place outside of the box than to the place of the box that is nearest to it.
        let inside = at.max(self.low).min(self.high);
        let cell = self.cell(inside);
        let away = usize::from(self.away[self.index(cell)]);
        let squared = limit * limit;
        if (away > 1 && (away - 1) as f64 * self.side >= limit) || at.distance_squared(inside) >= squared {
            return None;
        }
        let corner = (inside - self.low) / self.side - DVec3::new(cell[0] as f64, cell[1] as f64, cell[2] as f64);
        let margin = corner.min(1.0 - corner).min_element();
        let mut best = Best { squared, place: u32::MAX };
        let mut steps = away.max(1);
        loop {
            let all = self.search(at, cell, steps, &mut best);
            // Points outside of the cells that were searched are no nearer than this.
            let searched = (steps as f64 + margin).max(0.0) * self.side;
            if all || searched * searched >= best.squared {
                break;
            }
            steps += steps.div_ceil(2);
        }
        (best.place != u32::MAX).then(|| (best.place, best.squared.sqrt()))
    }

    /// Looks at all cells within some steps of one. Says whether these were all.
    #[inline(always)]
    fn search(&self, at: DVec3, cell: [usize; 3], steps: usize, best: &mut Best) -> bool {
        let [x, y, z] = self.counts;
        let low = [cell[0].saturating_sub(steps), cell[1].saturating_sub(steps), cell[2].saturating_sub(steps)];
        let high = [(cell[0] + steps).min(x - 1), (cell[1] + steps).min(y - 1), (cell[2] + steps).min(z - 1)];
        for row_z in low[2]..=high[2] {
            for row_y in low[1]..=high[1] {
                let row = (row_z * y + row_y) * x;
                let (first, end) = (self.starts[row + low[0]] as usize, self.starts[row + high[0] + 1] as usize);
                for (point, place) in &self.entries[first..end] {
                    let squared = point.distance_squared(at);
                    if squared < best.squared {
                        *best = Best { squared, place: *place };
                    }
                }
            }
        }
        low == [0; 3] && high == [x - 1, y - 1, z - 1]
    }
}

/// The nearest so far.
struct Best {
    squared: f64,
    place: u32,
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::neighbours::KdTree;
    use proptest::prelude::*;

    proptest! {
        /// Theorem: points found are those that a tree finds, for any points, places and limits.
        #[test]
        fn points_found_are_those_of_a_tree(
            points in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 0..200),
            flat in prop::sample::select(vec![1.0, 0.1, 0.0]),
            spacing in prop::sample::select(vec![0.001, 0.05, 0.3, 5.0]),
            places in prop::collection::vec(prop::array::uniform3(-1.6..1.6_f64), 20),
            limit in prop::sample::select(vec![0.0, 0.02, 0.1, 0.5, 9.0]),
        ) {
            let points: Vec<DVec3> = points.into_iter().map(|[x, y, z]| DVec3::new(x, y, flat * z)).collect();
            let (near, tree) = (Near::new(&points, spacing), KdTree::new(&points));
            for at in places.into_iter().map(DVec3::from).chain(points.iter().copied()) {
                prop_assert_eq!(near.nearest_within(at, limit), tree.nearest_within(at, limit));
            }
        }
    }
}
