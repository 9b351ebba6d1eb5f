//! On which side of an edge many pixels are seen, 64 of them at once.
//!
//! On the lattice, and as long as no corner of a star lies far from its vertex, columns and rows relative to the vertex are small whole
//! numbers. They are so small that single precision is exact, and eight pixels are compared by the same few instructions. The signs are
//! those of [`Site::turn`] in any case.

use wide::f32x8;

use super::view::Site;

/// Pixels compared in one go.
const LANES: usize = 8;

/// Columns and rows from the vertex to its farthest corner for which single precision is exact: twice the area of a triangle
/// of such places is less than 2^24. The pixels lie between the corners.
const FAR: f32 = 1024.0;

/// Places of a star's pixels and corners from its vertex, the first pixel.
#[derive(Default)]
pub(super) struct Lanes {
    /// Columns and rows of the pixels, filled up to whole groups of [`LANES`]. None if places are not exact.
    x: Vec<f32x8>,
    y: Vec<f32x8>,
    corners: Vec<[f32; 2]>,
}

impl Lanes {
    /// Takes over the star's corners and pixels.
    pub fn set<S: Site>(&mut self, corners: &[S], pixels: &[S]) {
        self.x.clear();
        self.y.clear();
        self.corners.clear();
        let Some(origin) = pixels[0].place() else { return };
        let relative = |site: &S| {
            let [x, y] = site.place().unwrap_or(origin);
            [(x - origin[0]) as f32, (y - origin[1]) as f32]
        };
        self.corners.extend(corners.iter().map(relative));
        if self.corners.iter().flatten().any(|c| c.abs() > FAR) {
            return;
        }
        for group in pixels.chunks(LANES) {
            let (mut x, mut y) = ([0.0; LANES], [0.0; LANES]);
            for (lane, site) in group.iter().enumerate() {
                [x[lane], y[lane]] = relative(site);
            }
            self.x.push(x.into());
            self.y.push(y.into());
        }
    }

    /// Of the pixels of `word`, a bit each: seen on the positive side of the edge from corner `i` to `j`, and on the
    /// positive side or on the edge. Bits beyond the last pixel mean nothing.
    #[inline]
    pub fn sides<S: Site>(&self, corners: &[S], pixels: &[S], i: usize, j: usize, word: usize) -> [u64; 2] {
        const GROUPS: usize = 64 / LANES;
        let (mut positive, mut not_negative) = (0, 0);
        if self.x.is_empty() {
            for (bit, site) in pixels[word * 64..].iter().take(64).enumerate() {
                let turn = S::turn(&corners[i], &corners[j], site);
                positive |= u64::from(turn > 0.0) << bit;
                not_negative |= u64::from(turn >= 0.0) << bit;
            }
            return [positive, not_negative];
        }
        let (a, b) = (self.corners[i], self.corners[j]);
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let level = f32x8::splat(dx * a[1] - dy * a[0]);
        let (dx, dy) = (f32x8::splat(dx), f32x8::splat(dy));
        let groups = word * GROUPS..(word * GROUPS + GROUPS).min(self.x.len());
        for (group, (&x, &y)) in self.x[groups.clone()].iter().zip(&self.y[groups]).enumerate() {
            let turn = dx * y - dy * x;
            positive |= u64::from(turn.simd_gt(level).to_bitmask()) << (group * LANES);
            not_negative |= u64::from(turn.simd_ge(level).to_bitmask()) << (group * LANES);
        }
        [positive, not_negative]
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::view::{FlatSite, tests::flat_site};
    use super::*;

    proptest! {
        #[test]
        fn sides_are_the_exact_signs(
            vertex in (0..70_000_i64, 0..50_000_i64), far in prop_oneof![Just(5_i64), Just(40), Just(1024), Just(2000)],
            places in prop::collection::vec((-1.0..=1.0_f64, -1.0..=1.0_f64), 4..200),
        ) {
            let site = |&(x, y): &(f64, f64)| -> FlatSite {
                flat_site(vertex.0 + (x * far as f64).round() as i64, vertex.1 + (y * far as f64).round() as i64)
            };
            let mut sites: Vec<FlatSite> = places.iter().map(site).collect();
            // As in a star: the pixels lie between the corners.
            let corners = [(-1.0, -1.0), (1.0, -0.5), (0.25, 1.0), places[0]].map(|p| site(&p));
            sites.insert(0, site(&(0.0, 0.0)));
            let mut lanes = Lanes::default();
            lanes.set(&corners, &sites);
            for (i, j) in [(0, 1), (0, 2), (1, 2), (0, 3), (2, 3)] {
                for word in 0..sites.len().div_ceil(64) {
                    let [positive, not_negative] = lanes.sides(&corners, &sites, i, j, word);
                    for (bit, site) in sites[word * 64..].iter().take(64).enumerate() {
                        let turn = FlatSite::turn(&corners[i], &corners[j], site);
                        prop_assert_eq!(positive >> bit & 1 != 0, turn > 0.0);
                        prop_assert_eq!(not_negative >> bit & 1 != 0, turn >= 0.0);
                    }
                }
            }
        }
    }
}
