//! Sums of the crossings of one edge of the grid, of one sign. As many are kept for a thousand scans of a place as for one.
//!
//! Sums are whole numbers, so that neither the order of the scans nor how they are shared among threads can matter.

use bytemuck::{Pod, Zeroable};

use super::crossing::{Crossing, LINE_MASK, OnLine};
use super::edge_colours::Members;

/// The crossings of an edge that walks along its line meet with one sign. Sums are in units of 1 / [`UNIT`].
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct EdgeSums {
    /// Line within the bundle (bits 0 to 9), flags, and in the upper 18 bits half the distance to the next edge of the other sign below and
    /// above.
    packed: u32,
    /// Cell along the line.
    pub cell: i32,
    /// Scan of largest trust, of several the first.
    pub scan: u32,
    /// Its trust.
    largest_trust: f32,
    count: u32,
    /// Standard deviations of the samples, in units of 1 / 1024 cell.
    deviation: u32,
    /// Colours of some of the scans.
    colours: Members,
    trust: u64,
    /// Weights of the votes, and in `slope` the weights times the normal's component along the line.
    weight: i64,
    slope: i64,
    /// Of one crossing the bits of its place on the edge. Else weights times places.
    place: i64,
    /// Weights times how far along the normal the surface is from the edge's lower node.
    offset: i64,
}

const ENTERS: u32 = LINE_MASK + 1;
/// Crossings of several scans.
const MIXED: u32 = ENTERS << 1;
/// Crossings of noisy samples.
const NOISY: u32 = MIXED << 1;

/// Weights of a million scans fit, and the faintest, of grazing lines in deep noise, have a dozen bits.
const UNIT: f64 = (1_u64 << 42) as f64;
const TRUST_UNIT: f64 = (1_u64 << 32) as f64;
/// Rooms have 9 bits each and are in units of 1 / 128 cell. The largest is far.
const ROOM_SHIFTS: [u32; 2] = [14, 23];
const ROOM_UNITS: f64 = 128.0;
const ROOM_FAR: u32 = (1 << 9) - 1;

/// Weight of a vote at borders, where trust is 0. At trust 1 or more it is 1.
const LEAST_SHARE: f64 = 0.25;
/// Noise, in cells, that halves the weight of a vote.
const HALVES: f64 = 0.1;

/// Weight of a crossing's vote before its line counts.
fn vote(c: &Crossing) -> f64 {
    let precision = if c.is_clean() { 1.0 } else { 1.0 / (1.0 + (c.deviation() / HALVES).powi(2)) };
    (LEAST_SHARE + (1.0 - LEAST_SHARE) * f64::from(c.weight.clamp(0.0, 1.0))) * precision
}

impl From<&Crossing> for EdgeSums {
    fn from(c: &Crossing) -> Self {
        let (normal, fraction) = (f64::from(c.normal), f64::from(c.fraction));
        let weight = vote(c) * normal * normal;
        let sum = |x: f64| (x * UNIT).round() as i64;
        EdgeSums {
            packed: c.line() as u32 | if c.enters() { ENTERS } else { 0 } | if c.is_clean() { 0 } else { NOISY },
            cell: c.cell,
            scan: c.scan(),
            largest_trust: c.weight,
            count: 1,
            deviation: c.deviation_units().into(),
            colours: Members::of(c.scan(), c.colour, vote(c)),
            trust: (f64::from(c.weight) * TRUST_UNIT) as u64,
            weight: sum(weight),
            slope: sum(weight * normal),
            place: c.fraction.to_bits().into(),
            offset: sum(weight * (normal * fraction + c.residual())),
        }
    }
}

impl OnLine for EdgeSums {
    fn line(&self) -> usize {
        (self.packed & LINE_MASK) as usize
    }

    fn cell(&self) -> i32 {
        self.cell
    }
}

impl EdgeSums {
    /// The key that sums are sorted by, and the same for those that can be added.
    pub fn key(&self) -> (u32, i32, u32) {
        (self.packed & LINE_MASK, self.cell, self.packed & ENTERS)
    }

    /// Adds another of the same edge and sign.
    pub fn add(&mut self, other: &EdgeSums) {
        self.packed |= other.packed | if self.scan == other.scan { 0 } else { MIXED };
        let place = self.weighted_place().saturating_add(other.weighted_place());
        // Trust is not NaN.
        if (other.largest_trust, self.scan) > (self.largest_trust, other.scan) {
            (self.largest_trust, self.scan) = (other.largest_trust, other.scan);
        }
        self.count = self.count.saturating_add(other.count);
        self.deviation = self.deviation.saturating_add(other.deviation);
        self.colours.add(&other.colours);
        self.trust = self.trust.saturating_add(other.trust);
        self.weight = self.weight.saturating_add(other.weight);
        self.slope = self.slope.saturating_add(other.slope);
        self.place = place;
        self.offset = self.offset.saturating_add(other.offset);
    }

    /// Whether a walk along the line enters the object here.
    #[inline]
    pub fn enters(&self) -> bool {
        self.packed & ENTERS != 0
    }

    /// Whether no sample is noisier than what a crossing tells.
    #[inline]
    pub fn is_clean(&self) -> bool {
        self.packed & NOISY == 0
    }

    /// The only scan, if there is one.
    #[inline]
    pub fn only_scan(&self) -> Option<u32> {
        (self.packed & MIXED == 0).then_some(self.scan)
    }

    /// Sum of the weights of the votes.
    #[inline]
    pub fn weight(&self) -> f64 {
        self.weight as f64
    }

    /// Mean component of the normal along the line.
    #[inline]
    pub fn normal(&self) -> f64 {
        self.slope as f64 / (self.weight as f64).max(1.0)
    }

    /// Mean place on the edge. To the bit that of a single crossing.
    #[inline]
    pub fn fraction(&self) -> f64 {
        if self.count == 1 { self.single_place() } else { self.place as f64 / (self.weight as f64).max(1.0) }
    }

    fn single_place(&self) -> f64 {
        f32::from_bits(self.place as u32).into()
    }

    fn weighted_place(&self) -> i64 {
        if self.count == 1 { (self.weight as f64 * self.single_place()).round() as i64 } else { self.place }
    }

    /// Mean of how much further along the normal the surface lies, in cells.
    #[inline]
    pub fn residual(&self) -> f64 {
        self.offset as f64 / (self.weight as f64).max(1.0) - self.normal() * self.fraction()
    }

    /// Mean standard deviation of the samples, in cells.
    pub fn deviation(&self) -> f64 {
        f64::from(self.deviation) / f64::from(self.count) / Crossing::DEVIATION_UNITS
    }

    /// Crossings.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Sum of the trust in the samples.
    pub fn trust(&self) -> f64 {
        if self.count == 1 { self.largest_trust.into() } else { self.trust as f64 / TRUST_UNIT }
    }

    /// The trust in the scan trusted most.
    pub fn largest_trust(&self) -> f32 {
        self.largest_trust
    }

    /// Colours of some of the scans, of all where they are few.
    #[inline]
    pub fn members(&self) -> &Members {
        &self.colours
    }

    /// Place along the line, in cells.
    #[inline]
    pub fn along(&self) -> f64 {
        f64::from(self.cell) + self.fraction()
    }

    /// Notes how far, in cells, those of the other sign lie below and above it on the line.
    pub fn set_room(&mut self, below: f64, above: f64) {
        for (distance, shift) in [below, above].into_iter().zip(ROOM_SHIFTS) {
            let room = (0.5 * distance.max(0.0) * ROOM_UNITS).min(ROOM_FAR.into()) as u32;
            self.packed = self.packed & !(ROOM_FAR << shift) | room << shift;
        }
    }

    /// Distance, in cells, within which it may speak of nodes below or above: half way to the next of the other sign.
    #[inline]
    pub fn room(&self, above: bool) -> f64 {
        let room = self.packed >> ROOM_SHIFTS[usize::from(above)] & ROOM_FAR;
        if room == ROOM_FAR { f64::INFINITY } else { f64::from(room) / ROOM_UNITS }
    }
}

/// The sums of a line's crossings, which are sorted along it, added to `all` in order.
pub fn edge_line(line: &[Crossing], all: &mut Vec<EdgeSums>) {
    for of_edge in line.chunk_by(|a, b| a.cell == b.cell) {
        for enters in [false, true] {
            let mut of_sign = of_edge.iter().filter(|c| c.enters() == enters).map(EdgeSums::from);
            if let Some(mut edge) = of_sign.next() {
                of_sign.for_each(|other| edge.add(&other));
                all.push(edge);
            }
        }
    }
}

/// Adds the sums of a sorted list to those of another.
pub fn add_up(all: &mut Vec<EdgeSums>, list: &[EdgeSums]) {
    let mut new: Vec<EdgeSums> = Vec::new();
    let mut at = 0;
    for edge in list {
        at += all[at..].iter().take_while(|known| known.key() < edge.key()).count();
        match all.get_mut(at) {
            Some(known) if known.key() == edge.key() => known.add(edge),
            _ => new.push(*edge),
        }
    }
    // From the end, so that none is in the way of another; no larger than needed, since this is what memory is taken by.
    let (mut from, mut to) = (all.len(), all.len() + new.len());
    all.reserve_exact(new.len());
    all.resize(to, EdgeSums::default());
    for edge in new.iter().rev() {
        let later = all[..from].iter().rev().take_while(|known| known.key() > edge.key()).count();
        all.copy_within(from - later..from, to - later);
        (from, to) = (from - later, to - later - 1);
        all[to] = *edge;
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use proptest::prelude::*;

    use super::*;

    fn crossing() -> impl Strategy<Value = Crossing> {
        let place = (0_u32..6, 0_u32..5, -2..3_i32, 0.0_f32..1.0);
        (place, -1.0_f32..1.0, 0.0_f32..2.0, -0.5..0.5_f64, prop::sample::select(vec![0.0, 0.1, 3.0])).prop_map(
            |((line, scan, cell, fraction), normal, weight, residual, deviation)| {
                let normal = if normal == 0.0 { 0.5 } else { normal };
                let colour = [(fraction * 256.0) as u8, 7, 9, [255, 255, 100, 0][scan as usize % 4]];
                let mut crossing = Crossing::new(line, scan, cell, fraction, normal, weight, colour);
                crossing.set_noise(residual, deviation);
                crossing
            },
        )
    }

    fn twin(crossings: &[Crossing]) -> Vec<EdgeSums> {
        let mut all: BTreeMap<(u32, i32, u32), EdgeSums> = BTreeMap::new();
        for edge in crossings.iter().map(EdgeSums::from) {
            all.entry(edge.key()).and_modify(|known| known.add(&edge)).or_insert(edge);
        }
        all.into_values().collect()
    }

    proptest! {
        #[test]
        fn neither_order_nor_splits_matter(crossings in prop::collection::vec(crossing(), 0..60), cuts in [0..60_usize, 0..60]) {
            let expected = twin(&crossings);
            let mut turned = crossings.clone();
            turned.reverse();
            prop_assert_eq!(&twin(&turned), &expected);
            let mut cuts = cuts.map(|cut| cut.min(crossings.len()));
            cuts.sort_unstable();
            let mut all = Vec::new();
            for part in [&crossings[cuts[1]..], &crossings[..cuts[0]], &crossings[cuts[0]..cuts[1]]] {
                add_up(&mut all, &twin(part));
            }
            prop_assert_eq!(&all, &expected);
        }

        #[test]
        fn a_single_crossing_is_itself(c in crossing()) {
            let edge = EdgeSums::from(&c);
            prop_assert_eq!(edge.fraction(), f64::from(c.fraction));
            prop_assert_eq!((edge.line(), edge.cell, edge.enters()), (c.line(), c.cell, c.enters()));
            prop_assert_eq!((edge.only_scan(), edge.is_clean()), (Some(c.scan()), c.is_clean()));
            // Of the faintest votes, on grazing lines in deep noise, least is known.
            if c.normal.abs() > 0.05 {
                prop_assert!((edge.normal() - f64::from(c.normal)).abs() < 1e-4);
                prop_assert!((edge.residual() - c.residual()).abs() < 1e-4);
            }
            prop_assert!((edge.trust() - f64::from(c.weight)).abs() < 1e-6);
        }
    }
}
