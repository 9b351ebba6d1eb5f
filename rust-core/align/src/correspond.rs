//! Points of two scans that look alike.

use glam::DVec3;

use crate::features::{Features, difference, difference_below};

/// Likest points kept of each.
const LIKEST: usize = 3;
/// Most pairs of points.
const MOST: usize = 900;

/// A point of one scan and one of the other that looks like it: indices in their lists of features.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Match {
    pub a: u32,
    pub b: u32,
    /// Difference, in that of the next likest that is not chosen. Less is better.
    pub ratio: f32,
}

type Likest = [(u32, u32); LIKEST + 1];

#[inline(always)]
fn offer(list: &mut Likest, difference: u32, other: u32) {
    if difference < list[LIKEST].0 {
        let mut place = LIKEST;
        while place > 0 && list[place - 1].0 > difference {
            list[place] = list[place - 1];
            place -= 1;
        }
        list[place] = (difference, other);
    }
}

/// For each point of either scan the likest of the other. Those that choose each other come first, the clearest first.
pub(crate) fn correspond(a: &Features, b: &Features) -> Vec<Match> {
    let none = [(u32::MAX, u32::MAX); LIKEST + 1];
    let mut of_a = vec![none; a.points.len()];
    let mut of_b = vec![none; b.points.len()];
    for (i, (mine, list)) in a.descriptors.iter().zip(&mut of_a).enumerate() {
        for (j, (other, others)) in b.descriptors.iter().zip(&mut of_b).enumerate() {
            let Some(d) = difference_below(mine, other, list[LIKEST].0.max(others[LIKEST].0)) else { continue };
            offer(list, d, j as u32);
            offer(others, d, i as u32);
        }
    }
    let ratio = |d: u32, list: &Likest| d as f32 / list[LIKEST].0.max(1) as f32;
    let mut matches = Vec::new();
    for (i, list) in of_a.iter().enumerate() {
        for &(d, j) in list[..LIKEST].iter().filter(|entry| entry.1 != u32::MAX) {
            let back = &of_b[j as usize];
            let is_mutual = back[..LIKEST].iter().any(|entry| entry.1 == i as u32);
            let rank = ratio(d, list).max(if is_mutual { ratio(d, back) } else { 0.0 });
            matches.push((!is_mutual, Match { a: i as u32, b: j, ratio: rank }));
        }
    }
    for (j, list) in of_b.iter().enumerate() {
        for &(d, i) in list[..LIKEST].iter().filter(|entry| entry.1 != u32::MAX) {
            if !of_a[i as usize][..LIKEST].iter().any(|entry| entry.1 == j as u32) {
                matches.push((true, Match { a: i, b: j as u32, ratio: ratio(d, list) }));
            }
        }
    }
    matches.sort_by(|x, y| {
        (x.0, x.1.ratio)
            .partial_cmp(&(y.0, y.1.ratio))
            .expect("no ratio is NaN")
            .then((x.1.a, x.1.b).cmp(&(y.1.a, y.1.b)))
    });
    matches.truncate(MOST);
    matches.into_iter().map(|m| m.1).collect()
}

/// Points of a scan that look like others of it, further away than `apart`: what repeats itself.
pub(crate) fn repeats(features: &Features, places: &[DVec3], apart: f64) -> Vec<Match> {
    let place = |k: usize| places[features.points[k] as usize];
    let count = features.points.len();
    let step = count.div_ceil(LOOKING).max(1);
    let mut matches = Vec::new();
    for i in (0..count).step_by(step) {
        let mut list: Likest = [(u32::MAX, u32::MAX); LIKEST + 1];
        for j in (0..count).filter(|&j| place(i).distance_squared(place(j)) > apart * apart) {
            offer(&mut list, difference(&features.descriptors[i], &features.descriptors[j]), j as u32);
        }
        let found = list[..LIKEST].iter().filter(|entry| entry.1 != u32::MAX);
        matches.extend(found.map(|&(d, j)| (d, Match { a: i as u32, b: j, ratio: 1.0 })));
    }
    matches.sort_by_key(|(d, m)| (*d, m.a, m.b));
    matches.truncate(MOST);
    matches.into_iter().map(|(_, m)| m).collect()
}

/// Points that look for others of the same scan.
const LOOKING: usize = 400;
