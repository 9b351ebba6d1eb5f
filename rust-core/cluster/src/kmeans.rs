//! Stage 1: k-means by splitting, exact and fast. \[KMT, sec. 3.1\] \[LBG80\]
//!
//! From one patch to k: the patch of largest energy is split in two along its main axis, by halves of the energy's heap. After each
//! doubling follow a few Lloyd steps. Each Lloyd step finds the nearest centre of every point exactly. A point of patch a can be nearer to
//! another centre b only if |a b| < 2 |p a|. So the list of a's nearest centres, sorted by their distance from a, is looked at until that
//! fails. A point for which the list is too short asks the tree of all centres. Sums run over the points in their order on one thread (they
//! cost a tenth of the search). So the result is that of naive Lloyd steps, to the bit, for any number of threads.

use std::borrow::Cow;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::surface::main_axis;
use super::tree::CentreTree;
use base::error::Result;
use base::progress::Progress;

/// Points handled between two looks at the progress.
const CHUNK: usize = 4096;
/// Nearest centres listed for each centre.
const LISTED: usize = 24;
/// Lloyd steps after each doubling.
const STEPS_WHILE_SPLITTING: usize = 2;
/// Relative difference below which two distances may change places by rounding.
const MARGIN: f64 = 1.0 - 1e-12;

/// Points and their partition into patches.
#[derive(Clone)]
pub struct KMeans<'a> {
    points: &'a [DVec3],
    weights: Cow<'a, [f64]>,
    /// The weights given at first.
    original: &'a [f64],
    seed: u64,
    pub centres: Vec<DVec3>,
    /// Patch of each point.
    pub labels: Vec<u32>,
    /// Squared distance of each point to its centre.
    squared: Vec<f64>,
}

impl<'a> KMeans<'a> {
    /// One patch. Weights are positive.
    pub fn new(points: &'a [DVec3], weights: &'a [f64], seed: u64) -> Self {
        let mut one = KMeans {
            points,
            weights: Cow::Borrowed(weights),
            original: weights,
            seed,
            centres: vec![DVec3::ZERO],
            labels: vec![0; points.len()],
            squared: vec![0.0; points.len()],
        };
        one.move_centres();
        one.measure();
        one
    }

    /// Weighted sum of squared distances.
    pub fn energy(&self) -> f64 {
        self.squared.iter().zip(self.weights.iter()).map(|(d, w)| d * w).sum()
    }

    /// Takes other weights from here on.
    pub fn set_weights(&mut self, weights: Vec<f64>) {
        self.weights = Cow::Owned(weights);
    }

    /// One patch again, with the weights given at first.
    pub fn restarted(&self) -> Self {
        KMeans::new(self.points, self.original, self.seed)
    }

    /// Splits every patch that has a marked point.
    pub fn split_marked(&mut self, marked: &[bool]) {
        let mut split = vec![false; self.centres.len()];
        for (&label, _) in self.labels.iter().zip(marked).filter(|l| *l.1) {
            split[label as usize] = true;
        }
        let (starts, mut list) = self.members();
        for patch in (0..split.len()).filter(|&p| split[p]) {
            let members = &mut list[starts[patch] as usize..starts[patch + 1] as usize];
            if let Some(middle) = self.halve(patch as u32, members) {
                self.part(patch as u32, members, middle);
            }
        }
    }

    /// Makes the members from `middle` on a patch of their own. Returns the energies of both.
    fn part(&mut self, patch: u32, members: &[u32], middle: usize) -> [f64; 2] {
        let new = self.centres.len() as u32;
        self.centres.push(DVec3::ZERO);
        [(patch, &members[..middle]), (new, &members[middle..])].map(|(patch, members)| {
            let centre = mean(self.points, &self.weights, members);
            self.centres[patch as usize] = centre;
            let mut energy = 0.0;
            for &i in members {
                let i = i as usize;
                self.labels[i] = patch;
                self.squared[i] = self.points[i].distance_squared(centre);
                energy += self.squared[i] * self.weights[i];
            }
            energy
        })
    }

    /// Splits until there are `k` patches, or no patch has two different points.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn split_to(&mut self, k: usize, progress: &Progress<'_>) -> Result<()> {
        while self.centres.len() < k {
            let before = self.centres.len();
            self.split_once(k.min(2 * before), progress)?;
            if self.centres.len() == before {
                break;
            }
            for _ in 0..STEPS_WHILE_SPLITTING {
                self.step(progress)?;
            }
        }
        Ok(())
    }

    /// Lloyd steps until the energy falls by less than `tolerance` of itself, at most `most`.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn lloyd(&mut self, most: usize, tolerance: f64, progress: &Progress<'_>) -> Result<usize> {
        let mut energy = self.energy();
        for done in 0..most {
            self.step(progress)?;
            let lower = self.energy();
            if !(energy - lower > tolerance * energy) {
                return Ok(done + 1);
            }
            energy = lower;
        }
        Ok(most)
    }

    /// One Lloyd step: every centre to the mean of its points, every point to its nearest centre, of equally near ones
    /// the first.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn step(&mut self, progress: &Progress<'_>) -> Result<()> {
        self.move_centres();
        progress.advance(1)?;
        self.assign(progress)
    }

    /// Patches in segments of one list of points: where each starts, and the list.
    fn members(&self) -> (Vec<u32>, Vec<u32>) {
        members(&self.labels, self.centres.len())
    }

    /// Every centre to the mean of its points.
    pub fn move_centres(&mut self) {
        let mut sums = vec![(DVec3::ZERO, 0.0); self.centres.len()];
        for ((&p, &w), &label) in self.points.iter().zip(self.weights.iter()).zip(&self.labels) {
            let sum = &mut sums[label as usize];
            sum.0 += p * w;
            sum.1 += w;
        }
        for (centre, (sum, weight)) in self.centres.iter_mut().zip(sums) {
            // A patch without points keeps its centre.
            if weight > 0.0 {
                *centre = sum / weight;
            }
        }
    }

    fn measure(&mut self) {
        for ((squared, p), &label) in self.squared.iter_mut().zip(self.points).zip(&self.labels) {
            *squared = p.distance_squared(self.centres[label as usize]);
        }
    }

    /// Every point to its nearest centre, of equally near ones the first.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn assign(&mut self, progress: &Progress<'_>) -> Result<()> {
        let centres = &self.centres;
        let tree = CentreTree::new(centres);
        let listed = LISTED.min(centres.len() - 1);
        // For each centre its nearest ones, nearest first.
        let mut lists = vec![Listed { gap: f64::INFINITY, centre: 0 }; listed * centres.len()];
        if listed > 0 {
            lists.par_chunks_mut(listed * 64).enumerate().try_for_each(|(chunk, lists)| {
                let mut near = Vec::new();
                for (i, list) in lists.chunks_mut(listed).enumerate() {
                    let a = chunk * 64 + i;
                    tree.nearest(centres[a], listed + 1, &mut near);
                    let others = near.iter().filter(|n| n.1 != a as u32).take(listed);
                    for (slot, &(squared, centre)) in list.iter_mut().zip(others) {
                        *slot = Listed { gap: squared.sqrt() * MARGIN, centre };
                    }
                }
                progress.check()
            })?;
        }
        let complete = listed + 1 == centres.len();
        self.labels
            .par_chunks_mut(CHUNK)
            .zip(self.squared.par_chunks_mut(CHUNK))
            .zip(self.points.par_chunks(CHUNK))
            .try_for_each(|((labels, squared), points)| {
                for ((label, squared), &p) in labels.iter_mut().zip(squared).zip(points) {
                    let a = *label as usize;
                    let own = p.distance_squared(centres[a]);
                    let reach = 2.0 * own.sqrt();
                    let (mut best, mut nearest) = (own, a as u32);
                    let mut decided = complete;
                    for l in &lists[a * listed..(a + 1) * listed] {
                        if l.gap > reach {
                            decided = true;
                            break;
                        }
                        let d = p.distance_squared(centres[l.centre as usize]);
                        if d < best || d == best && l.centre < nearest {
                            (best, nearest) = (d, l.centre);
                        }
                    }
                    if !decided {
                        (best, nearest) = tree.first_nearest(p, (best, nearest));
                    }
                    (*label, *squared) = (nearest, best);
                }
                progress.check()
            })
    }

    /// Splits the patches of largest energy, one after the other, until there are `k`.
    fn split_once(&mut self, k: usize, progress: &Progress<'_>) -> Result<()> {
        let (starts, mut list) = self.members();
        progress.check()?;
        let mut heap: BinaryHeap<Candidate> = (0..self.centres.len())
            .map(|patch| {
                let (start, end) = (starts[patch] as usize, starts[patch + 1] as usize);
                let energy =
                    list[start..end].iter().map(|&i| self.squared[i as usize] * self.weights[i as usize]).sum();
                Candidate { energy, patch: patch as u32, start, end }
            })
            .collect();
        while self.centres.len() < k
            && let Some(worst) = heap.pop()
        {
            if self.centres.len().is_multiple_of(64) {
                progress.check()?;
            }
            let members = &mut list[worst.start..worst.end];
            let Some(middle) = self.halve(worst.patch, members) else { continue };
            let new = self.centres.len() as u32;
            let [first, second] = self.part(worst.patch, members, middle);
            let (start, cut, end) = (worst.start, worst.start + middle, worst.end);
            heap.push(Candidate { energy: first, patch: worst.patch, start, end: cut });
            heap.push(Candidate { energy: second, patch: new, start: cut, end });
        }
        Ok(())
    }

    /// Orders the members of a patch so that those on one side of its centre come first. Returns how many they are.
    fn halve(&self, patch: u32, members: &mut [u32]) -> Option<usize> {
        halve(self.points, &self.weights, members, nudge(self.seed, patch))
    }
}

/// A centre near another one.
#[derive(Clone, Copy)]
struct Listed {
    /// Least distance.
    gap: f64,
    centre: u32,
}

/// A patch to split.
struct Candidate {
    energy: f64,
    patch: u32,
    start: usize,
    end: usize,
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        self.energy.total_cmp(&other.energy).then(other.patch.cmp(&self.patch))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Candidate {}

/// Points of each of `patches` patches as segments of one list: where each starts, and the list.
pub fn members(labels: &[u32], patches: usize) -> (Vec<u32>, Vec<u32>) {
    let mut starts = vec![0_u32; patches + 1];
    for &label in labels {
        starts[label as usize + 1] += 1;
    }
    for patch in 0..patches {
        starts[patch + 1] += starts[patch];
    }
    let mut list = vec![0; labels.len()];
    let mut fill = starts.clone();
    for (i, &label) in labels.iter().enumerate() {
        list[fill[label as usize] as usize] = i as u32;
        fill[label as usize] += 1;
    }
    (starts, list)
}

fn mean(points: &[DVec3], weights: &[f64], members: &[u32]) -> DVec3 {
    let (sum, weight) = members.iter().fold((DVec3::ZERO, 0.0), |(sum, weight), &i| {
        (sum + points[i as usize] * weights[i as usize], weight + weights[i as usize])
    });
    sum / weight
}

/// Orders `members` so that those on one side of the plane through their mean, across their main axis, come first. Returns how many they
/// are. `None` if they all lie in one place.
pub fn halve(points: &[DVec3], weights: &[f64], members: &mut [u32], nudge: DVec3) -> Option<usize> {
    if members.len() < 2 {
        return None;
    }
    let centre = mean(points, weights, members);
    let mut covariance = DMat3::ZERO;
    for &i in members.iter() {
        let d = points[i as usize] - centre;
        let wd = d * weights[i as usize];
        covariance += DMat3::from_cols(wd * d.x, wd * d.y, wd * d.z);
    }
    let axis = main_axis(covariance) + nudge;
    let mut middle = 0;
    for j in 0..members.len() {
        if (points[members[j] as usize] - centre).dot(axis) < 0.0 {
            members.swap(middle, j);
            middle += 1;
        }
    }
    (middle > 0 && middle < members.len()).then_some(middle)
}

/// A small vector that depends on the seed and the patch alone: which way a round patch is split. \[SLF14\]
fn nudge(seed: u64, patch: u32) -> DVec3 {
    let mut state = seed ^ (u64::from(patch) << 32);
    let mut next = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    DVec3::new(next(), next(), next()) * 0.1
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A Lloyd step as it is defined.
    fn naive_step(points: &[DVec3], weights: &[f64], centres: &mut [DVec3], labels: &mut [u32]) -> f64 {
        for (patch, centre) in centres.iter_mut().enumerate() {
            let of_patch = || (0..points.len()).filter(|&i| labels[i] == patch as u32);
            let weight = of_patch().fold(0.0, |sum, i| sum + weights[i]);
            if weight > 0.0 {
                *centre = of_patch().fold(DVec3::ZERO, |sum, i| sum + points[i] * weights[i]) / weight;
            }
        }
        let mut energy = 0.0;
        for i in 0..points.len() {
            let distance = |c: usize| points[i].distance_squared(centres[c]);
            labels[i] = (0..centres.len()).fold(0, |b, c| if distance(c) < distance(b) { c } else { b }) as u32;
            energy += distance(labels[i] as usize) * weights[i];
        }
        energy
    }

    fn cloud() -> impl Strategy<Value = Vec<DVec3>> {
        let whole = prop::collection::vec([-4..4_i32, -4..4, -40..40], 1..400)
            .prop_map(|v| v.iter().map(|p| DVec3::from(p.map(f64::from))).collect());
        let real = prop::collection::vec([-1.0..1.0_f64, -1.0..1.0, -0.1..0.1], 1..400)
            .prop_map(|v| v.into_iter().map(DVec3::from).collect());
        prop_oneof![whole, real]
    }

    proptest! {
        /// Theorem: from the same start the same labels and centres as naive Lloyd, step by step and to the bit, also with equally near
        /// centres and duplicates. And the energy never rises.
        #[test]
        fn lloyd_is_lloyd(points in cloud(), patches in 1..120_usize, threads in 1..4_usize) {
            let weights: Vec<f64> = (0..points.len()).map(|i| 1.0 + (i % 7) as f64).collect();
            let pool = base::threads::pool(threads).unwrap();
            pool.install(|| {
                let mut fast = KMeans::new(&points, &weights, 7);
                fast.split_to(patches, &Progress::none()).unwrap();
                prop_assert!(fast.centres.len() <= patches);
                let (mut centres, mut labels) = (fast.centres.clone(), fast.labels.clone());
                let mut energy = f64::INFINITY;
                for _ in 0..8 {
                    fast.step(&Progress::none()).unwrap();
                    let naive = naive_step(&points, &weights, &mut centres, &mut labels);
                    prop_assert_eq!(&fast.labels, &labels);
                    prop_assert_eq!(&fast.centres, &centres);
                    prop_assert!((fast.energy() - naive).abs() <= 1e-12 * naive);
                    prop_assert!(fast.energy() <= energy * (1.0 + 1e-12));
                    energy = fast.energy();
                }
                Ok(())
            })?;
        }

        /// Theorem: splitting stops only where no patch has two different points left.
        #[test]
        fn splitting_reaches_every_point(points in cloud()) {
            let weights = vec![1.0; points.len()];
            let mut kmeans = KMeans::new(&points, &weights, 1);
            kmeans.split_to(points.len(), &Progress::none()).unwrap();
            let mut different: Vec<_> = points.iter().map(|p| (*p + 0.0).to_array().map(f64::to_bits)).collect();
            different.sort_unstable();
            different.dedup();
            prop_assert!(kmeans.centres.len() >= different.len().min(points.len()) / 2);
            prop_assert!(kmeans.energy() <= 1e-9 + 0.5 * points.len() as f64);
        }
    }
}
