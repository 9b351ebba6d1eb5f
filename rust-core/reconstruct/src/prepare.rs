//! Stage 0: the samples in an order of their own, whatever order they come in. No duplicates, nothing but numbers.

use glam::DVec3;

use super::report::{Dropped, Reason};
use base::error::{Error, Result};
use base::progress::Progress;

/// Samples sorted along a space-filling curve, equal ones once.
pub(super) struct Samples {
    /// Multiplied by `factor`.
    pub(super) points: Vec<DVec3>,
    /// A power of two. 1 unless the coordinates are so large or small that products of them, or radii in single precision, would leave the
    /// range of floating point.
    pub(super) factor: f64,
    /// Place of each in the input.
    pub(super) input: Vec<u32>,
    /// Points of the input that are not among the samples.
    pub(super) dropped: Vec<Dropped>,
}

impl Samples {
    /// Points given, dropped ones included.
    pub(super) fn given(&self) -> usize {
        self.input.len() + self.dropped.len()
    }

    /// Drops some of the samples.
    pub(super) fn leave_out(&mut self, is_left_out: &[bool], reason: Reason) {
        let left_out = self.input.iter().zip(is_left_out).filter(|(_, is_left_out)| **is_left_out);
        self.dropped.extend(left_out.map(|(&point, _)| Dropped { point, reason }));
        keep(&mut self.points, is_left_out);
        keep(&mut self.input, is_left_out);
    }
}

/// Without the values of samples that are left out. There may be none of any sample.
pub(super) fn keep<T>(of_samples: &mut Vec<T>, is_left_out: &[bool]) {
    let mut is_left_out = is_left_out.iter();
    of_samples.retain(|_| !is_left_out.next().expect("one a sample"));
}

/// Sorts the samples: neighbours in space become neighbours in memory, and numbers no longer depend on the input's order.
pub(super) fn prepare(positions: &[DVec3], progress: &Progress<'_>) -> Result<Samples> {
    if u32::try_from(positions.len()).is_err() {
        return Err(Error::input(format!("{} points are more than the 4,294,967,295 that fit", positions.len())));
    }
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for block in progress.blocks(positions) {
        for position in block?.iter().filter(|p| p.is_finite()) {
            (low, high) = (low.min(*position), high.max(*position));
        }
    }
    let mut dropped = Vec::new();
    let mut order = Vec::with_capacity(positions.len());
    for range in progress.ranges(positions.len()) {
        for i in range? {
            if positions[i].is_finite() {
                order.push((curve(positions[i], low, high), i as u32));
            } else {
                dropped.push(Dropped { point: i as u32, reason: Reason::NotFinite });
            }
        }
    }
    let at = |i: u32| positions[i as usize].to_array();
    let compare = |a: u32, b: u32| at(a).partial_cmp(&at(b)).expect("finite coordinates compare");
    type Place = (u64, u32);
    let along = |a: &Place, b: &Place| a.0.cmp(&b.0).then_with(|| compare(a.1, b.1)).then(a.1.cmp(&b.1));
    progress.sort(&mut order, &along)?;
    let factor = factor(positions, &order, progress)?;
    let mut samples =
        Samples { points: Vec::with_capacity(order.len()), factor, input: Vec::with_capacity(order.len()), dropped };
    for block in progress.blocks(&order) {
        for &(_, i) in block? {
            // Adding zero makes -0 and 0 one.
            let point = positions[i as usize] * factor + 0.0;
            if samples.points.last() == Some(&point) {
                samples.dropped.push(Dropped { point: i, reason: Reason::Duplicate });
            } else {
                samples.points.push(point);
                samples.input.push(i);
            }
        }
    }
    Ok(samples)
}

/// Sizes from which no product of coordinates overflows or underflows, as exponents of two.
const ORDINARY: i32 = 60;

/// Factor that makes the size of most points ordinary, if that changes no bit of any. Else 1.
fn factor(positions: &[DVec3], order: &[(u64, u32)], progress: &Progress<'_>) -> Result<f64> {
    let mut sizes = Vec::with_capacity(order.len());
    for block in progress.blocks(order) {
        sizes.extend(block?.iter().map(|&(_, i)| positions[i as usize].abs().max_element()));
    }
    if sizes.is_empty() {
        return Ok(1.0);
    }
    // A few points far away say nothing about the others.
    let middle = sizes.len() / 2;
    let (_, &mut size, _) = sizes.select_nth_unstable_by(middle, f64::total_cmp);
    let exponent = size.log2();
    if !exponent.is_finite() || exponent.abs() < f64::from(ORDINARY) {
        return Ok(1.0);
    }
    let factor = (-exponent.round()).clamp(-1000.0, 1000.0).exp2();
    let is_exact = |&(_, i): &(u64, u32)| {
        let scaled = positions[i as usize] * factor;
        scaled.is_finite() && scaled / factor == positions[i as usize]
    };
    Ok(if order.iter().all(is_exact) { factor } else { 1.0 })
}

/// Steps of the curve along each axis, as a power of two.
const BITS: u32 = 20;

/// Place of a point along Morton's curve through the bounding cube.
fn curve(point: DVec3, low: DVec3, high: DVec3) -> u64 {
    // Halves, so that the difference of huge coordinates stays finite.
    let size = (high / 2.0 - low / 2.0).max_element();
    let share = (point / 2.0 - low / 2.0) / if size > 0.0 { size } else { 1.0 };
    let steps = share.to_array().map(|s| ((s * f64::from(1 << BITS)) as u64).min((1 << BITS) - 1));
    spread(steps[0]) << 2 | spread(steps[1]) << 1 | spread(steps[2])
}

/// Two zero bits after each bit.
fn spread(x: u64) -> u64 {
    let x = (x | x << 32) & 0x001F_0000_0000_FFFF;
    let x = (x | x << 16) & 0x001F_0000_FF00_00FF;
    let x = (x | x << 8) & 0x100F_00F0_0F00_F00F;
    let x = (x | x << 4) & 0x10C3_0C30_C30C_30C3;
    (x | x << 2) & 0x1249_2492_4924_9249
}
