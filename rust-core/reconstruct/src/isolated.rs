//! Whether outliers lie around points that otherwise carry no noise.
//!
//! Sparse parts of a surface, its creases and its borders lie apart as outliers do. Alone none of these can be told from an outlier. But
//! samples of a surface lie along it, however few they are, and outliers fill space: all that lie apart are asked together.

use glam::DVec3;
use rayon::prelude::*;

use super::patch::{Frame, Weighted};
use base::error::Result;
use base::progress::Progress;
use geom::neighbours::{Few, KdTree};

/// Spacings within which a sample that lies apart has no other. Of a million samples at random over a surface none does.
const APART: f64 = 3.0;

/// Samples before and after one on the curve, among which others near it are looked for at first, and then.
const WINDOWS: [usize; 2] = [4, 64];

/// Samples that lie apart, at least ...
const LEAST: usize = 16;
/// ... and as a share of all, at least and at most.
const SHARE: [f64; 2] = [1e-3, 0.25];

/// Of these, so many are asked ...
const ASKED: usize = 2048;
/// ... with so many neighbours, themselves included, of all samples ...
const AROUND: usize = 16;
/// ... and of those that lie apart.
const AMONG: usize = 9;

/// Least thickness of neighbours that fill space, beside their length. Also the share of neighbours that have it.
const THICK: f64 = 0.2;
const THICK_SHARE: f64 = 0.75;

/// Dimension in which those that lie apart do, at least: 3 in space, 2 on a surface.
const DIMENSION: f64 = 2.4;

/// Of samples in the order of the curve, with the spacing as measured. `tree` is made if there is anything to look at. Cost: that of one
/// pass where no sample lies apart.
pub(super) fn are_around(
    samples: &[DVec3],
    spacing: f64,
    tree: &mut Option<KdTree>,
    progress: &Progress<'_>,
) -> Result<bool> {
    let within = (APART * spacing).powi(2);
    let least = LEAST.max((SHARE[0] * samples.len() as f64) as usize);
    let mut apart: Vec<usize> = (0..samples.len()).collect();
    for window in WINDOWS {
        let is_apart = |&i: &usize| {
            let others = i.saturating_sub(window)..(i + window + 1).min(samples.len());
            !others.into_iter().any(|j| j != i && samples[j].distance_squared(samples[i]) <= within)
        };
        apart = apart.into_par_iter().filter(is_apart).collect();
        progress.check()?;
        if apart.len() < least {
            return Ok(false);
        }
    }
    if tree.is_none() {
        *tree = Some(KdTree::try_new(samples, progress)?);
    }
    let tree = tree.as_ref().expect("just made");
    let is_apart = |few: &mut Few, i: usize| {
        tree.nearest_few(samples[i], 2, f64::INFINITY, few);
        few.furthest().is_some_and(|squared| squared > within).then_some(i)
    };
    let apart: Vec<usize> = apart.into_par_iter().map_init(Few::default, is_apart).flatten().collect();
    if apart.len() < least || apart.len() as f64 > SHARE[1] * samples.len() as f64 {
        return Ok(false);
    }
    fill_space(samples, &apart, tree, progress)
}

/// Whether samples that lie apart do so in all directions, by what is around each and by how many of them are how near to each other.
fn fill_space(samples: &[DVec3], apart: &[usize], tree: &KdTree, progress: &Progress<'_>) -> Result<bool> {
    let places: Vec<DVec3> = apart.iter().map(|&i| samples[i]).collect();
    let among = KdTree::try_new(&places, progress)?;
    let count = places.len().min(ASKED);
    let ask = |(few, near): &mut (Few, Vec<Weighted>), k: usize| -> Result<(bool, f64)> {
        progress.check()?;
        let place = places[(2 * k + 1) * places.len() / (2 * count)];
        tree.nearest_few(place, AROUND, f64::INFINITY, few);
        near.clear();
        near.extend(few.iter().map(|(i, _)| (samples[i as usize], 1.0)));
        let is_thick = Frame::new(place, near).is_some_and(|frame| frame.thickness() > THICK);
        among.nearest_few(place, AMONG, f64::INFINITY, few);
        let mut squared: Vec<f64> = few.iter().map(|(_, squared)| squared).collect();
        squared.sort_unstable_by(f64::total_cmp);
        // Of the nearest itself is one. The mean is one by the dimension [LB04].
        let furthest = squared[squared.len() - 1];
        let ratios = squared[1..].iter().map(|squared| 0.5 * (furthest / squared).ln());
        Ok((is_thick, ratios.sum::<f64>() / (squared.len() - 1) as f64))
    };
    let asked: Vec<(bool, f64)> = (0..count)
        .into_par_iter()
        .with_min_len(16)
        .map_init(<(Few, Vec<Weighted>)>::default, ask)
        .collect::<Result<_>>()?;
    let thick = asked.iter().filter(|(is_thick, _)| *is_thick).count();
    let slope = asked.iter().map(|(_, slope)| slope).sum::<f64>() / count as f64;
    Ok(thick as f64 >= THICK_SHARE * count as f64 && DIMENSION * slope <= 1.0)
}
