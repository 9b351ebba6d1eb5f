//! The order in which points are inserted: randomized rounds, each about eight times the one before, along a Hilbert
//! curve within each \[ACR03, Ham06\].
//!
//! Neighbours on the curve are neighbours in space, so the walk to the next point is short and its cells are in the cache. The rounds keep
//! any input, however sorted, from building long slivers that later points must destroy.

use glam::DVec3;
use rayon::prelude::*;

use base::error::Result;
use base::progress::Progress;

/// Bits of each axis on the curve.
const BITS: u32 = 20;
/// log2 of the ratio between rounds.
const RATIO: u32 = 3;
/// Points that the first round holds at least.
const FIRST: usize = 512;

/// Indices of the points in the order of insertion, and where each round starts. `lowest` and `extent` are those of the
/// points multiplied by `factor`.
pub(super) fn insertion_order(
    points: &[DVec3],
    factor: f64,
    lowest: DVec3,
    extent: f64,
    progress: &Progress<'_>,
) -> Result<(Vec<u32>, Vec<usize>)> {
    let scale = f64::from(1_u32 << BITS) / extent;
    let last = (0..).find(|round| points.len() >> (RATIO * (round + 1)) < FIRST).unwrap_or(0);
    let mut keys: Vec<(u64, u32)> = points
        .par_iter()
        .enumerate()
        .map(|(i, &p)| {
            let back = (random(i as u64).trailing_zeros() / RATIO).min(last);
            let at = (p * factor - lowest) * scale;
            (u64::from(last - back) << (3 * BITS) | hilbert([at.x, at.y, at.z]), i as u32)
        })
        .collect();
    progress.check()?;
    progress.sort(&mut keys, &Ord::cmp)?;
    let rounds = (0..=last).map(|round| keys.partition_point(|k| k.0 >> (3 * BITS) < u64::from(round))).collect();
    Ok((keys.into_iter().map(|k| k.1).collect(), rounds))
}

/// Splitmix64 \[SLF14\].
fn random(i: u64) -> u64 {
    let z = i.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The place on the curve of a point of the cube of side `2^BITS`. Points outside are taken to its border.
fn hilbert(at: [f64; 3]) -> u64 {
    // A cast saturates, and takes NaN to 0.
    let [x, y, z] = at.map(|x| spread((x as u32).min((1 << BITS) - 1)));
    let octants = x << 2 | y << 1 | z;
    let (mut place, mut turned) = (0, 0);
    for level in (0..BITS / LEVELS).rev() {
        let step = STEPS[turned][(octants >> (3 * LEVELS * level)) as usize & (STEPS[0].len() - 1)];
        place = place << (3 * LEVELS) | u64::from(step) & (STEPS[0].len() as u64 - 1);
        turned = usize::from(step >> (3 * LEVELS));
    }
    place
}

/// Levels of the curve that one look into the table goes down.
const LEVELS: u32 = 2;
/// Ways the curve may run through a cube: three axes along which, eight corners from which.
const WAYS: usize = 24;
/// For each way through a cube and each of its parts: that part's place along the curve, and above it the way through it.
static STEPS: [[u16; 1 << (3 * LEVELS)]; WAYS] = steps();

/// \[Ham06\], algorithm 2: the way is 3 corner + axis. Octants along the curve differ in one bit, as in a Gray code.
const fn steps() -> [[u16; 1 << (3 * LEVELS)]; WAYS] {
    let mut steps = [[0; 1 << (3 * LEVELS)]; WAYS];
    let mut way = 0;
    while way < WAYS {
        let mut octants = 0;
        while octants < steps[way].len() {
            let (mut corner, mut axis) = (way as u32 / 3, way as u32 % 3);
            let mut place = 0;
            let mut level = LEVELS;
            while level > 0 {
                level -= 1;
                let gray = rotate_right((octants as u32 >> (3 * level) & 7) ^ corner, axis + 1);
                let along = gray ^ gray >> 1 ^ gray >> 2;
                let (entry, direction) = if along == 0 {
                    (0, 0)
                } else {
                    let even = (along - 1) & !1;
                    (
                        even ^ even >> 1,
                        if along & 1 == 0 { (along - 1).trailing_ones() } else { along.trailing_ones() } % 3,
                    )
                };
                corner ^= rotate_right(entry, 3 - (axis + 1) % 3);
                axis = (axis + direction + 1) % 3;
                place = place << 3 | along;
            }
            steps[way][octants] = ((corner * 3 + axis) << (3 * LEVELS) | place) as u16;
            octants += 1;
        }
        way += 1;
    }
    steps
}

/// Of three bits.
const fn rotate_right(bits: u32, by: u32) -> u32 {
    let by = by % 3;
    (bits >> by | bits << (3 - by)) & 7
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
        let (mut order, rounds) = insertion_order(&points, 1.0, DVec3::ZERO, 200.0, &Progress::none()).unwrap();
        assert_eq!(rounds[0], 0);
        let lengths: Vec<usize> = rounds.windows(2).map(|w| w[1] - w[0]).collect();
        assert!(lengths.windows(2).all(|w| w[0] < w[1]), "{rounds:?}");
        order.sort_unstable();
        assert!(order.iter().enumerate().all(|(i, &p)| p == i as u32));
    }
}
