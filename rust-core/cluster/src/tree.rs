//! A k-d tree of patch centres whose answers are those of a loop over all of them: ties go to the smaller index.

use glam::DVec3;

/// Centres looked at one by one at the bottom.
const LEAF: usize = 8;

/// The tree. Its middle entries split their ranges.
pub struct CentreTree {
    entries: Vec<(DVec3, u32)>,
    axes: Vec<u8>,
}

impl CentreTree {
    pub fn new(centres: &[DVec3]) -> Self {
        let mut entries: Vec<_> = centres.iter().enumerate().map(|(i, &c)| (c, i as u32)).collect();
        let mut axes = vec![0; entries.len()];
        arrange(&mut entries, &mut axes);
        CentreTree { entries, axes }
    }

    /// The nearest centre to `p` and its squared distance, if it is nearer than `best` or as near and before it.
    pub fn first_nearest(&self, p: DVec3, known: (f64, u32)) -> (f64, u32) {
        let mut best = known;
        self.search(
            0,
            self.entries.len(),
            p,
            &mut |squared, centre| {
                if squared < best.0 || squared == best.0 && centre < best.1 {
                    best = (squared, centre);
                }
                best.0
            },
            known.0,
        );
        best
    }

    /// The `count` nearest centres to `p` with their squared distances, nearest first, the first of equally near ones.
    pub fn nearest(&self, p: DVec3, count: usize, found: &mut Vec<(f64, u32)>) {
        found.clear();
        self.search(
            0,
            self.entries.len(),
            p,
            &mut |squared, centre| {
                let place = found.partition_point(|f| (f.0, f.1) < (squared, centre));
                if place < count {
                    if found.len() == count {
                        found.pop();
                    }
                    found.insert(place, (squared, centre));
                }
                if found.len() == count { found[count - 1].0 } else { f64::INFINITY }
            },
            f64::INFINITY,
        );
    }

    /// Offers entries that may lie within the squared distance that `offer` returned last. Returns that distance.
    fn search(
        &self,
        first: usize,
        end: usize,
        p: DVec3,
        offer: &mut impl FnMut(f64, u32) -> f64,
        mut within: f64,
    ) -> f64 {
        if end - first <= LEAF {
            for &(centre, index) in &self.entries[first..end] {
                within = offer(centre.distance_squared(p), index);
            }
            return within;
        }
        let middle = first + (end - first) / 2;
        let (centre, index) = self.entries[middle];
        let axis = usize::from(self.axes[middle]);
        let side = p[axis] - centre[axis];
        let (near, far) =
            if side < 0.0 { ((first, middle), (middle + 1, end)) } else { ((middle + 1, end), (first, middle)) };
        within = self.search(near.0, near.1, p, offer, within);
        // Rounding of a squared length may put an equally near centre a little nearer.
        if side * side * (1.0 - 1e-12) <= within {
            within = offer(centre.distance_squared(p), index);
            within = self.search(far.0, far.1, p, offer, within);
        }
        within
    }
}

fn arrange(entries: &mut [(DVec3, u32)], axes: &mut [u8]) {
    if entries.len() <= LEAF {
        return;
    }
    let low = entries.iter().fold(DVec3::INFINITY, |m, e| m.min(e.0));
    let high = entries.iter().fold(DVec3::NEG_INFINITY, |m, e| m.max(e.0));
    let axis = (high - low).max_position();
    let middle = entries.len() / 2;
    entries.select_nth_unstable_by(middle, |a, b| a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1)));
    axes[middle] = axis as u8;
    let (left, right) = entries.split_at_mut(middle);
    let (left_axes, right_axes) = axes.split_at_mut(middle);
    arrange(left, left_axes);
    arrange(&mut right[1..], &mut right_axes[1..]);
}
