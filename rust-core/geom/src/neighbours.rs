//! Nearest neighbours among fixed points.

use glam::DVec3;

use base::error::Result;
use base::progress::Progress;

/// Points searched one by one at the bottom of the tree.
const LEAF: usize = 12;

/// Points below which a range is arranged on one thread.
const ONE_THREAD: usize = 1 << 13;

/// A balanced k-d tree over a fixed set of points. Building costs O(n log n), a query O(log n) for points that aren't crowded. Memory 29
/// bytes per point.
#[derive(Clone, Debug, Default)]
pub struct KdTree {
    /// Points in the order of the tree: the middle of each range splits it.
    points: Vec<DVec3>,
    /// Place of each in the list given.
    indices: Vec<u32>,
    /// Axis along which the range with this middle is split.
    axes: Vec<u8>,
    low: DVec3,
    high: DVec3,
}

impl KdTree {
    /// Builds the tree. Points with a coordinate that isn't finite are left out.
    ///
    /// # Panics
    /// With 2^32 points or more.
    pub fn new(points: &[DVec3]) -> Self {
        Self::arranged(points, &|| false)
    }

    /// Like [`KdTree::new`], and stops within milliseconds.
    ///
    /// # Errors
    /// [`base::error::Error::Cancelled`].
    ///
    /// # Panics
    /// With 2^32 points or more.
    pub fn try_new(points: &[DVec3], progress: &Progress<'_>) -> Result<Self> {
        progress.check()?;
        let tree = Self::arranged(points, &|| progress.is_stopping());
        progress.check()?;
        Ok(tree)
    }

    fn arranged(points: &[DVec3], is_stopping: &(impl Fn() -> bool + Sync)) -> Self {
        assert!(u32::try_from(points.len()).is_ok(), "{} points are too many for a tree", points.len());
        let mut entries: Vec<(DVec3, u32)> =
            points.iter().enumerate().filter(|(_, p)| p.is_finite()).map(|(i, p)| (*p, i as u32)).collect();
        let mut axes = vec![0; entries.len()];
        arrange(&mut entries, &mut axes, is_stopping);
        let low = entries.iter().fold(DVec3::INFINITY, |m, e| m.min(e.0));
        let high = entries.iter().fold(DVec3::NEG_INFINITY, |m, e| m.max(e.0));
        KdTree {
            points: entries.iter().map(|e| e.0).collect(),
            indices: entries.iter().map(|e| e.1).collect(),
            axes,
            low,
            high,
        }
    }

    /// Number of points in the tree.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// The points, in the tree's own order.
    pub fn points(&self) -> &[DVec3] {
        &self.points
    }

    /// The point nearest to `query`: its place in the list given and its distance. `None` without points, or if `query` isn't finite. Of
    /// several equally near points always the same is found, but it is not said which.
    pub fn nearest(&self, query: DVec3) -> Option<(u32, f64)> {
        self.nearest_within(query, f64::INFINITY)
    }

    /// The nearest point closer to `query` than `limit`.
    pub fn nearest_within(&self, query: DVec3, limit: f64) -> Option<(u32, f64)> {
        if !query.is_finite() {
            return None;
        }
        let outside = (self.low - query).max(query - self.high).max(DVec3::ZERO).length_squared();
        let mut best = Best { squared: limit * limit, place: usize::MAX };
        if outside < best.squared {
            self.search(0, self.points.len(), query, &mut best);
        }
        (best.place != usize::MAX).then(|| (self.indices[best.place], best.squared.sqrt()))
    }

    /// The `count` points nearest to `query`, of those closer than `limit`: `found` is cleared and receives them in no order.
    /// Of equally near ones those that come first in the list given. Nothing is found if `query` isn't finite.
    pub fn nearest_few(&self, query: DVec3, count: usize, limit: f64, found: &mut Few) {
        found.found.clear();
        found.count = count;
        found.limit = limit * limit;
        found.is_full = false;
        if query.is_finite() && count > 0 {
            self.search_few(0, self.points.len(), query, found);
            found.select();
        }
    }

    fn search_few(&self, first: usize, end: usize, query: DVec3, found: &mut Few) {
        if end - first <= LEAF {
            for place in first..end {
                found.offer(self.indices[place], self.points[place].distance_squared(query));
            }
            return;
        }
        let middle = first + (end - first) / 2;
        let point = self.points[middle];
        let axis = usize::from(self.axes[middle]);
        found.offer(self.indices[middle], point.distance_squared(query));
        let side = query[axis] - point[axis];
        let (near, far) =
            if side < 0.0 { ((first, middle), (middle + 1, end)) } else { ((middle + 1, end), (first, middle)) };
        self.search_few(near.0, near.1, query, found);
        // Equally near ones may come first in the list.
        if side * side <= found.limit {
            self.search_few(far.0, far.1, query, found);
        }
    }

    fn search(&self, first: usize, end: usize, query: DVec3, best: &mut Best) {
        if end - first <= LEAF {
            for place in first..end {
                best.offer(place, self.points[place].distance_squared(query));
            }
            return;
        }
        let middle = first + (end - first) / 2;
        let point = self.points[middle];
        let axis = usize::from(self.axes[middle]);
        best.offer(middle, point.distance_squared(query));
        let side = query[axis] - point[axis];
        let (near, far) =
            if side < 0.0 { ((first, middle), (middle + 1, end)) } else { ((middle + 1, end), (first, middle)) };
        self.search(near.0, near.1, query, best);
        if side * side < best.squared {
            self.search(far.0, far.1, query, best);
        }
    }
}

/// The nearest so far.
struct Best {
    squared: f64,
    place: usize,
}

impl Best {
    #[inline(always)]
    fn offer(&mut self, place: usize, squared: f64) {
        if squared < self.squared {
            *self = Best { squared, place };
        }
    }
}

/// The nearest few points of a query. Kept and refilled, so that many queries allocate once.
#[derive(Clone, Debug, Default)]
pub struct Few {
    /// Squared distances, whose bits compare as they do, and indices: while searching some more than asked for.
    found: Vec<(u64, u32)>,
    count: usize,
    /// Squared. None further away is taken.
    limit: f64,
    /// Whether the limit is the distance of one found.
    is_full: bool,
}

/// As many more are found, by so many times those that are asked for and at least so many, before the furthest are left out.
const MORE: f64 = 0.5;
const LEAST_MORE: usize = 8;

impl Few {
    /// Number of those found.
    pub fn len(&self) -> usize {
        self.found.len()
    }

    /// Whether none was.
    pub fn is_empty(&self) -> bool {
        self.found.is_empty()
    }

    /// Place in the list given and squared distance of each.
    pub fn iter(&self) -> impl Iterator<Item = (u32, f64)> {
        self.found.iter().map(|&(squared, index)| (index, f64::from_bits(squared)))
    }

    /// Squared distance of the furthest. `None` without any.
    pub fn furthest(&self) -> Option<f64> {
        self.found.iter().max().map(|&(squared, _)| f64::from_bits(squared))
    }

    #[inline]
    fn offer(&mut self, index: u32, squared: f64) {
        // Up to the limit where it is that of one found, below it where it was given.
        if if self.is_full { squared > self.limit } else { squared >= self.limit } {
            return;
        }
        self.found.push((squared.to_bits(), index));
        let more = if self.is_full { LEAST_MORE.max((MORE * self.count as f64) as usize) } else { 0 };
        if self.found.len() == self.count + more {
            self.select();
        }
    }

    /// Leaves the nearest, as many as asked for.
    fn select(&mut self) {
        if self.found.len() >= self.count {
            let (_, furthest, _) = self.found.select_nth_unstable(self.count - 1);
            (self.limit, self.is_full) = (f64::from_bits(furthest.0), true);
            self.found.truncate(self.count);
        }
    }
}

/// Sorts entries into tree order: the middle of a range splits it along its longest side.
fn arrange(entries: &mut [(DVec3, u32)], axes: &mut [u8], is_stopping: &(impl Fn() -> bool + Sync)) {
    if entries.len() <= LEAF || (entries.len() >= ONE_THREAD && is_stopping()) {
        return;
    }
    let low = entries.iter().fold(DVec3::INFINITY, |m, e| m.min(e.0));
    let high = entries.iter().fold(DVec3::NEG_INFINITY, |m, e| m.max(e.0));
    let axis = (high - low).max_position();
    let middle = entries.len() / 2;
    // Ties by index: the tree does not depend on how the selection works.
    entries.select_nth_unstable_by(middle, |a, b| a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1)));
    axes[middle] = axis as u8;
    let (left, right) = entries.split_at_mut(middle);
    let (left_axes, right_axes) = axes.split_at_mut(middle);
    let (right, right_axes) = (&mut right[1..], &mut right_axes[1..]);
    if left.len() < ONE_THREAD {
        arrange(left, left_axes, is_stopping);
        arrange(right, right_axes, is_stopping);
    } else {
        rayon::join(|| arrange(left, left_axes, is_stopping), || arrange(right, right_axes, is_stopping));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn brute_force(points: &[DVec3], query: DVec3) -> f64 {
        points.iter().map(|p| p.distance(query)).fold(f64::INFINITY, f64::min)
    }

    proptest! {
        /// Theorem: the distance is the smallest there is, also among duplicates and points in a row.
        #[test]
        fn finds_what_brute_force_finds(
            points in prop::collection::vec([-4..4_i32, -4..4, -40..40], 1..300),
            queries in prop::collection::vec([-50.0..50.0_f64, -5.0..5.0, -5.0..5.0], 1..20),
        ) {
            let points: Vec<DVec3> = points.iter().map(|p| DVec3::from(p.map(f64::from))).collect();
            let tree = KdTree::new(&points);
            for query in queries.iter().map(|q| DVec3::from(*q)) {
                let (index, distance) = tree.nearest(query).unwrap();
                let smallest = brute_force(&points, query);
                prop_assert!((distance - smallest).abs() <= 1e-12 * smallest);
                prop_assert_eq!(points[index as usize].distance_squared(query).sqrt(), distance);
                prop_assert!(tree.nearest_within(query, smallest * 0.999).is_none());
                prop_assert!(tree.nearest_within(query, smallest * 1.001 + 1e-9).is_some());
            }
        }
    }

    proptest! {
        /// Theorem: the nearest few are those that come first when all are sorted, also among duplicates.
        #[test]
        fn the_nearest_few_are_those_of_brute_force(
            points in prop::collection::vec([-4..4_i32, -4..4, -4..40], 1..200),
            query in [-5..5_i32, -5..5, -5..45],
            count in 0_usize..40,
            limit in 0_u32..60,
        ) {
            let points: Vec<DVec3> = points.iter().map(|p| DVec3::from(p.map(f64::from))).collect();
            let query = DVec3::from(query.map(f64::from));
            // Whole numbers: distances are exact, and many equal.
            let limit = if limit > 50 { f64::INFINITY } else { f64::from(limit) };
            let mut all: Vec<(f64, u32)> = (0..).zip(&points).map(|(i, p)| (p.distance_squared(query), i)).collect();
            all.retain(|near| near.0 < limit * limit);
            all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            all.truncate(count);
            let mut few = Few::default();
            KdTree::new(&points).nearest_few(query, count, limit, &mut few);
            let mut found: Vec<(f64, u32)> = few.iter().map(|(index, squared)| (squared, index)).collect();
            found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            prop_assert_eq!(found, all);
        }
    }

    #[test]
    fn nothing_to_find() {
        assert!(KdTree::new(&[]).nearest(DVec3::ZERO).is_none());
        assert!(KdTree::new(&[DVec3::NAN]).nearest(DVec3::ZERO).is_none());
        assert!(KdTree::new(&[DVec3::ZERO]).nearest(DVec3::NAN).is_none());
        assert_eq!(KdTree::new(&[DVec3::NAN, DVec3::ONE]).nearest(DVec3::ONE), Some((1, 0.0)));
        assert_eq!(KdTree::new(&[DVec3::ONE; 1000]).nearest(DVec3::ZERO).unwrap().1, DVec3::ONE.length());
    }
}
