//! Exposure: what each photo's light is multiplied by, channel by channel, so that all agree on the surface.
//!
//! Logarithms of blurred light at places that two photos see and more: each is the place's own plus the photo's. Places are
//! eliminated, so that one system of as many unknowns as photos is left, solved a few times with weights that leave out
//! what fits nobody.

use glam::DVec3;

use base::error::Result;
use base::progress::Progress;
use image::photo::Pixels;
use mesh::srgb;

use super::behind::{Detail, Place};
use super::light::is_clipped;
use super::view::View;

/// Pixels around one that are averaged: poses are not exact yet.
const BLUR: usize = 3;
/// Light below this share of white says nothing exact.
const DARK: f64 = 0.002;
/// Rounds of new weights.
const ROUNDS: usize = 6;
/// A difference of this logarithm has half its weight.
const USUAL: f64 = 0.05;
/// Evidence that the gain of a photo is 1, in places: photos that share none keep it.
const PRIOR: f64 = 1e-3;

/// Colours of a photo at the samples that it sees: number of the sample, logarithms of light.
pub type Shown = Vec<(u32, [f32; 3])>;

/// Looks at the samples in one photo.
pub fn shown(view: &View, pixels: &Pixels, samples: &[Place], detail: &Detail<'_>) -> Shown {
    let [columns, rows] = pixels.size;
    let mut shown = Vec::new();
    for (i, place) in samples.iter().enumerate() {
        let [point, normal] = [place.point, place.normal].map(|of| DVec3::from(of.map(f64::from)));
        let Some(seen) = view.see(point, normal, detail, false).filter(|seen| seen.cosine > 0.3) else { continue };
        let (x, y) = (seen.at.x.round() as usize, seen.at.y.round() as usize);
        if x < BLUR || y < BLUR || x + BLUR >= columns || y + BLUR >= rows {
            continue;
        }
        let mut light = [0_u64; 3];
        let mut is_whole = true;
        for row in y - BLUR..=y + BLUR {
            for colour in &pixels.colours[row * columns + x - BLUR..=row * columns + x + BLUR] {
                is_whole &= !is_clipped(*colour);
                light.iter_mut().zip(colour).for_each(|(sum, &byte)| *sum += u64::from(srgb::light(byte)));
            }
        }
        let count = ((2 * BLUR + 1) * (2 * BLUR + 1)) as f64 * f64::from(srgb::WHITE);
        let share = light.map(|sum| sum as f64 / count);
        if is_whole && share.iter().all(|&share| share > DARK) {
            shown.push((i as u32, share.map(|share| share.ln() as f32)));
        }
    }
    shown
}

/// Gains of the photos, whose logarithms have a mean of zero.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn solve(shown: &[Shown], samples: usize, progress: &Progress<'_>) -> Result<Vec<[f64; 3]>> {
    let by_sample = by_sample(shown, samples);
    let mut gains = vec![[1.0; 3]; shown.len()];
    for channel in 0..3 {
        let of = |photo: usize, entry: usize| f64::from(shown[photo][entry].1[channel]);
        let logs = one_channel(&by_sample, shown.len(), &of, progress)?;
        for (gain, log) in gains.iter_mut().zip(logs) {
            gain[channel] = log.exp();
        }
    }
    Ok(gains)
}

/// Photo and entry of each sample that two photos show or more.
fn by_sample(shown: &[Shown], samples: usize) -> Vec<Vec<(u32, u32)>> {
    let mut by_sample = vec![Vec::new(); samples];
    for (photo, of) in shown.iter().enumerate() {
        for (entry, (sample, _)) in of.iter().enumerate() {
            by_sample[*sample as usize].push((photo as u32, entry as u32));
        }
    }
    by_sample.retain(|photos| photos.len() > 1);
    by_sample
}

fn one_channel(
    by_sample: &[Vec<(u32, u32)>],
    photos: usize,
    of: &impl Fn(usize, usize) -> f64,
    progress: &Progress<'_>,
) -> Result<Vec<f64>> {
    let mut logs = vec![0.0; photos];
    for round in 0..ROUNDS {
        let mut matrix = vec![0.0; photos * photos];
        let mut right = vec![0.0; photos];
        for (number, sample) in by_sample.iter().enumerate() {
            if number % 4096 == 0 {
                progress.check()?;
            }
            let values: Vec<(usize, f64)> =
                sample.iter().map(|&(photo, entry)| (photo as usize, of(photo as usize, entry as usize))).collect();
            // A median is not drawn away by a reflection.
            let mut equal: Vec<f64> = values.iter().map(|(photo, value)| value + logs[*photo]).collect();
            equal.sort_by(f64::total_cmp);
            let middle = (equal[(equal.len() - 1) / 2] + equal[equal.len() / 2]) / 2.0;
            let weigh = |(photo, value): &(usize, f64)| match round {
                0 => 1.0,
                _ => 1.0 / (1.0 + ((value + logs[*photo] - middle) / USUAL).powi(2)).powi(2),
            };
            let weights: Vec<f64> = values.iter().map(weigh).collect();
            let whole: f64 = weights.iter().sum();
            let mean = values.iter().zip(&weights).map(|((_, value), weight)| value * weight).sum::<f64>() / whole;
            for (&(i, value), &weight) in values.iter().zip(&weights) {
                matrix[i * photos + i] += weight;
                right[i] -= weight * (value - mean);
                for (&(j, _), &other) in values.iter().zip(&weights) {
                    matrix[i * photos + j] -= weight * other / whole;
                }
            }
        }
        (0..photos).for_each(|i| matrix[i * photos + i] += PRIOR);
        logs = solved(matrix, right, progress)?;
    }
    let mean = logs.iter().sum::<f64>() / photos.max(1) as f64;
    Ok(logs.into_iter().map(|log| log - mean).collect())
}

/// The solution of a symmetric positive definite system, by Cholesky's factors.
fn solved(mut matrix: Vec<f64>, mut right: Vec<f64>, progress: &Progress<'_>) -> Result<Vec<f64>> {
    let n = right.len();
    for i in 0..n {
        progress.check()?;
        for j in 0..=i {
            let dot: f64 = (0..j).map(|k| matrix[i * n + k] * matrix[j * n + k]).sum();
            let rest = matrix[i * n + j] - dot;
            matrix[i * n + j] = if i == j { rest.max(PRIOR / 2.0).sqrt() } else { rest / matrix[j * n + j] };
        }
    }
    for i in 0..n {
        let dot: f64 = (0..i).map(|k| matrix[i * n + k] * right[k]).sum();
        right[i] = (right[i] - dot) / matrix[i * n + i];
    }
    for i in (0..n).rev() {
        let dot: f64 = (i + 1..n).map(|k| matrix[k * n + i] * right[k]).sum();
        right[i] = (right[i] - dot) / matrix[i * n + i];
    }
    Ok(right)
}
