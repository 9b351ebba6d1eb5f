//! The colour of each texel: the mean of the photos that see its place, without the brightest if that stands out.

use glam::DVec3;
use rayon::prelude::*;

use base::error::Result;
use base::progress::Progress;
use image::photo::Pixels;

use super::behind::{Detail, Place};
use super::light;
use super::view::View;

/// Places between two checks.
const BLOCK: usize = 2048;
/// Black and overexposed pixels count so much less: they decide only where nobody else sees.
const CLIPPED: f32 = 1e-3;
/// The brightest is left out if it is brighter than the mean of the others by this factor. Smaller factors take noise for highlights.
const HIGHLIGHT: f32 = 1.02;
/// Photos from which the brightest may be left out.
const FEWEST: u8 = 3;

/// The colour of a place in the photos so far: sums of light times weight, and the brightest of them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sum {
    light: [f32; 3],
    weight: f32,
    brightest: [f32; 3],
    brightest_weight: f32,
    count: u8,
    /// Whether a photo sees the place clearly.
    pub is_clear: bool,
}

/// Adds a photo, whose light is multiplied by `gain` first. Photos come one after the other: sums keep their order. How many
/// places it sees.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn add(
    sums: &mut [Sum],
    places: &[Place],
    (view, pixels): (&View, &Pixels),
    (gain, trust): ([f64; 3], f64),
    detail: &Detail<'_>,
    progress: &Progress<'_>,
) -> Result<u64> {
    let gain = gain.map(|of| of as f32);
    let of_block = |(sums, places): (&mut [Sum], &[Place])| {
        progress.advance(places.len() as u64)?;
        let mut seen = 0;
        for (sum, place) in sums.iter_mut().zip(places) {
            let [point, normal] = [place.point, place.normal].map(|of| DVec3::from(of.map(f64::from)));
            if let Some(there) = view.see(point, normal, detail, !sum.is_clear) {
                let (light, is_clipped) = light::between(pixels, there.at);
                let weight = (there.weight * trust) as f32 * if is_clipped { CLIPPED } else { 1.0 };
                sum.add([0, 1, 2].map(|k| light[k] * gain[k]), weight);
                sum.is_clear |= there.is_clear && !is_clipped;
                seen += 1;
            }
        }
        Ok(seen)
    };
    sums.par_chunks_mut(BLOCK).zip(places.par_chunks(BLOCK)).map(of_block).try_reduce(|| 0, |a, b| Ok(a + b))
}

impl Sum {
    fn add(&mut self, light: [f32; 3], weight: f32) {
        for (sum, of) in self.light.iter_mut().zip(light) {
            *sum += of * weight;
        }
        self.weight += weight;
        self.count = self.count.saturating_add(1);
        if self.count == 1 || light::level(light) > light::level(self.brightest) {
            (self.brightest, self.brightest_weight) = (light, weight);
        }
    }

    /// The mean light. `None` if no photo sees the place.
    pub fn mean(&self, drop_highlights: bool) -> Option<[f32; 3]> {
        if !(self.weight > 0.0) {
            return None;
        }
        let mean = |light: [f32; 3], weight: f32| light.map(|sum| sum / weight);
        let rest = self.weight - self.brightest_weight;
        // The little weight that a subtraction leaves is rounding.
        if drop_highlights && self.count >= FEWEST && rest > 1e-3 * self.weight {
            let others = [0, 1, 2].map(|k| (self.light[k] - self.brightest[k] * self.brightest_weight).max(0.0));
            let others = mean(others, rest);
            if light::level(self.brightest) > HIGHLIGHT * light::level(others) {
                return Some(others);
            }
        }
        Some(mean(self.light, self.weight))
    }
}
