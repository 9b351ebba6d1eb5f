//! Stage 0: the samples in an order of their own, whatever order they come in; no duplicates, nothing but numbers.

use glam::DVec3;
use rayon::prelude::*;

use super::{Dropped, Reason};
use crate::error::{Error, Result};

/// Samples sorted along a space-filling curve, equal ones once.
pub(super) struct Samples {
    pub(super) points: Vec<DVec3>,
    /// Place of each in the input.
    pub(super) input: Vec<u32>,
    /// Points of the input that are not among the samples.
    pub(super) dropped: Vec<Dropped>,
}

/// Sorts the samples: neighbours in space become neighbours in memory, and numbers no longer depend on the input's order.
pub(super) fn prepare(positions: &[DVec3]) -> Result<Samples> {
    if u32::try_from(positions.len()).is_err() {
        return Err(Error::input(format!("{} points are more than the 4,294,967,295 that fit", positions.len())));
    }
    let finite = |p: &&DVec3| p.is_finite();
    let low = positions.iter().filter(finite).fold(DVec3::INFINITY, |m, p| m.min(*p));
    let high = positions.iter().filter(finite).fold(DVec3::NEG_INFINITY, |m, p| m.max(*p));
    let mut dropped = Vec::new();
    let mut order = Vec::with_capacity(positions.len());
    for (i, position) in positions.iter().enumerate() {
        if position.is_finite() {
            order.push((curve(*position, low, high), i as u32));
        } else {
            dropped.push(Dropped { point: i as u32, reason: Reason::NotFinite });
        }
    }
    let at = |i: u32| positions[i as usize].to_array();
    let compare = |a: u32, b: u32| at(a).partial_cmp(&at(b)).expect("finite coordinates compare");
    order.par_sort_unstable_by(|a, b| a.0.cmp(&b.0).then_with(|| compare(a.1, b.1)).then(a.1.cmp(&b.1)));
    let mut samples =
        Samples { points: Vec::with_capacity(order.len()), input: Vec::with_capacity(order.len()), dropped };
    for (_, i) in order {
        // Adding zero makes -0 and 0 one.
        let point = positions[i as usize] + 0.0;
        if samples.points.last() == Some(&point) {
            samples.dropped.push(Dropped { point: i, reason: Reason::Duplicate });
        } else {
            samples.points.push(point);
            samples.input.push(i);
        }
    }
    Ok(samples)
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
