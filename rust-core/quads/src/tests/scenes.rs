//! Random images and parameters.

use proptest::prelude::*;

use image::range_image::RangeImage;
use image::range_image::test_images::{as_point_grid, projections};

use super::QuadParams;

/// Hills, a step, noise, and holes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scene {
    pub rows: usize,
    pub cols: usize,
    pub seed: u64,
    pub holes: f64,
    pub roughness: f64,
    pub step: f64,
}

/// A number in [0, 1) from a pixel and a seed.
pub(super) fn noise(seed: u64, i: u64) -> f64 {
    let mut x = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ i.wrapping_mul(0xd134_2543_de82_ef95);
    for _ in 0..3 {
        x = (x ^ x >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    }
    (x >> 11) as f64 / (1_u64 << 53) as f64
}

impl Scene {
    pub fn value(&self, row: f64, col: f64) -> f64 {
        let i = (row * 1000.0 + col) as u64;
        let block = noise(self.seed, (row / 7.0) as u64 * 77 + (col / 5.0) as u64);
        if noise(self.seed ^ 1, i) < self.holes || block < self.holes {
            return f64::NAN;
        }
        let hills = 0.3 * (row * 0.21 + self.seed as f64 % 7.0).sin() * (col * 0.17).cos();
        let step = if col > 0.6 * self.cols as f64 { self.step } else { 0.0 };
        2.0 + hills + step + self.roughness * (noise(self.seed ^ 2, i) - 0.5)
    }

    /// The scene as each kind of sensor sees it. The middle pixel is valid.
    pub fn seen(&self, kind: usize) -> RangeImage {
        let (rows, cols) = (self.rows, self.cols);
        let mut values: Vec<f64> = (0..rows * cols).map(|i| self.value((i / cols) as f64, (i % cols) as f64)).collect();
        values[rows / 2 * cols + cols / 2] = 2.0;
        let image = RangeImage::from_values(rows, cols, values, projections(rows, cols)[kind % 16]).unwrap();
        if kind >= 16 { as_point_grid(&image) } else { image }
    }
}

pub(super) fn scenes() -> impl Strategy<Value = Scene> {
    (
        (2..60_usize, 2..60_usize, any::<u64>()),
        prop_oneof![Just(0.0), 0.0..0.4_f64],
        prop_oneof![Just(0.0), Just(0.01), Just(0.3)],
        prop_oneof![Just(0.0), Just(0.5)],
    )
        .prop_map(|((rows, cols, seed), holes, roughness, step)| Scene {
            rows,
            cols,
            seed,
            holes,
            roughness,
            step,
        })
}

pub(super) fn params() -> impl Strategy<Value = QuadParams> {
    (
        (1..4_usize, 1..4_usize, 2..7_usize, 2..7_usize),
        (0..3_usize, 1..9_usize),
        prop_oneof![Just(0.0), 0.0..2.0_f64],
        prop_oneof![Just(0.0), 0.0..3.0_f64],
        prop_oneof![Just(0.0), 0.1..2.0_f64],
        prop_oneof![Just(0.0), Just(0.5), Just(1.0)],
        any::<bool>(),
    )
        .prop_map(
            |(
                (v, h, rows, columns),
                (gap_passes, gap_neighbours),
                floor,
                smoothing,
                exponent,
                coverage,
                background,
            )| {
                QuadParams {
                    tiles_down: Some(v),
                    tiles_across: Some(h),
                    rows,
                    columns,
                    gap_passes,
                    gap_neighbours,
                    floor,
                    smoothing,
                    exponent,
                    coverage,
                    background_curvature: background.then_some(20),
                    threads: 2,
                    ..QuadParams::default()
                }
            },
        )
}
