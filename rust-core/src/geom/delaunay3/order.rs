//! The order in which points are inserted: randomized rounds, each about eight times the one before, along a Hilbert
//! curve within each \[ACR03, Ski04\].
//!
//! Neighbours on the curve are neighbours in space, so the walk to the next point is short and its cells are in the
//! cache; the rounds keep any input, however sorted, from building long slivers that later points must destroy.

use glam::DVec3;
use rayon::prelude::*;

/// Bits of each axis on the curve.
const BITS: u32 = 20;
/// log2 of the ratio between rounds.
const RATIO: u32 = 3;
/// Points that the first round holds at least.
const FIRST: usize = 512;

/// Indices of the points in the order of insertion, and where each round starts.
pub(super) fn insertion_order(points: &[DVec3], lowest: DVec3, extent: f64) -> (Vec<u32>, Vec<usize>) {
    let scale = f64::from(1_u32 << BITS) / extent;
    let last = (0..).find(|round| points.len() >> (RATIO * (round + 1)) < FIRST).unwrap_or(0);
    let mut keys: Vec<(u64, u32)> = points
        .par_iter()
        .enumerate()
        .map(|(i, &p)| {
            let back = (random(i as u64).trailing_zeros() / RATIO).min(last);
            let at = (p - lowest) * scale;
            (u64::from(last - back) << (3 * BITS) | hilbert([at.x, at.y, at.z]), i as u32)
        })
        .collect();
    keys.par_sort_unstable();
    let rounds = (0..=last).map(|round| keys.partition_point(|k| k.0 >> (3 * BITS) < u64::from(round))).collect();
    (keys.into_iter().map(|k| k.1).collect(), rounds)
}

/// Splitmix64 \[SLF14\].
fn random(i: u64) -> u64 {
    let z = i.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The place on the curve of a point of the cube of side `2^BITS`; what lies outside is taken to its border.
fn hilbert(at: [f64; 3]) -> u64 {
    // A cast saturates, and takes NaN to 0.
    let cell = |x: f64| (x as u32).min((1 << BITS) - 1);
    let mut x = [cell(at[0]), cell(at[1]), cell(at[2])];
    for bit in (1..BITS).rev() {
        let below = (1 << bit) - 1;
        for i in 0..3 {
            let is_set = 0_u32.wrapping_sub(x[i] >> bit & 1);
            let exchanged = (x[0] ^ x[i]) & below & !is_set;
            x[0] ^= below & is_set ^ exchanged;
            x[i] ^= exchanged;
        }
    }
    x[1] ^= x[0];
    x[2] ^= x[1];
    let mut flip = 0;
    for bit in 1..BITS {
        flip ^= 0_u32.wrapping_sub(x[2] >> bit & 1) & ((1 << bit) - 1);
    }
    spread(x[0] ^ flip) << 2 | spread(x[1] ^ flip) << 1 | spread(x[2] ^ flip)
}

/// Leaves two zero bits between the bits of `x`, of which the lowest 21 count.
fn spread(x: u32) -> u64 {
    let mut x = u64::from(x);
    x = (x | x << 32) & 0x001f_0000_0000_ffff;
    x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_visits_every_cell_and_steps_to_a_neighbour() {
        // The coarse levels of the curve: cells of a cube of 8^3.
        let side: i32 = 8;
        let coarse = f64::from(1_u32 << BITS) / f64::from(side);
        let mut cells: Vec<(u64, [i32; 3])> = (0..side.pow(3))
            .map(|i| {
                let at = [i % side, i / side % side, i / side / side];
                (hilbert(at.map(|x| (f64::from(x) + 0.5) * coarse)) >> (3 * (BITS - 3)), at)
            })
            .collect();
        cells.sort_unstable();
        for (i, cell) in cells.iter().enumerate() {
            assert_eq!(cell.0, i as u64);
        }
        for pair in cells.windows(2) {
            let steps: i32 = (0..3).map(|i| (pair[0].1[i] - pair[1].1[i]).abs()).sum();
            assert_eq!(steps, 1, "{pair:?}");
        }
    }

    #[test]
    fn every_point_comes_once_in_rounds_that_grow() {
        let points: Vec<DVec3> = (0..20_000).map(|i| DVec3::new(f64::from(i % 100), f64::from(i / 100), 0.0)).collect();
        let (mut order, rounds) = insertion_order(&points, DVec3::ZERO, 200.0);
        assert_eq!(rounds[0], 0);
        let lengths: Vec<usize> = rounds.windows(2).map(|w| w[1] - w[0]).collect();
        assert!(lengths.windows(2).all(|w| w[0] < w[1]), "{rounds:?}");
        order.sort_unstable();
        assert!(order.iter().enumerate().all(|(i, &p)| p == i as u32));
    }
}
