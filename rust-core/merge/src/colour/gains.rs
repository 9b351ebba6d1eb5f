//! Brightness of each scan beside the others, by channel, from the colours that scans have of the same places.
//!
//! Two members of an edge are colours of the same place. The logarithm of their ratio is the difference of the two scans' exposures, but
//! for errors. All of these together say what each scan has to be multiplied by. It is least squares with gains kept near 1, as \[BL07\]
//! have it of images, in logarithms. Highlights and places that are not the same are left out, as they fit nothing.

use rayon::prelude::*;

use crate::crossings::edge_colours::Member;
use crate::crossings::edge_sums::EdgeSums;
use crate::crossings::scan_order::ScanOrder;
use crate::field::Bundles;
use crate::params::MergeParams;
use crate::report::MergeReport;
use base::error::Result;
use base::progress::Progress;
use mesh::srgb;

/// About so many edges a scan are looked at, chosen by their colours. Of all scans no fewer and no more than these.
const EDGES_A_SCAN: usize = 128;
const EDGES: [usize; 2] = [1 << 13, 1 << 16];
/// Units of a logarithm.
const UNIT: f64 = 4096.0;
/// Bytes outside of these are clipped, or so dark that they say nothing of a ratio.
const TOLD: std::ops::RangeInclusive<u8> = 24..=250;
/// The logarithm of a ratio that is not told.
const NOT_TOLD: i16 = i16::MIN;
/// Ratios that are larger, a factor of eight, are of different things.
const LARGEST: i16 = 8517;
/// Gains are pulled to 1 as if so many pairs of each scan had shown it, and a share of those there are.
const PRIOR: f64 = 1.0;
const PRIOR_SHARE: f64 = 1e-3;
/// Rounds in which pairs are left out that fit the gains of the round before worse than so many deviations ...
const ROUNDS: usize = 4;
const DEVIATIONS: f64 = 2.5;
/// ... which are at least this.
const LEAST_DEVIATION: f64 = 0.01;
/// The standard deviation of normally distributed errors, by their median size.
const SIGMA: f64 = 1.482_6;
/// Nobody sees gains that differ from 1 by less than this.
const SEEN: f64 = 0.01;
/// Gains that are smaller than so many of their own deviations are chance.
const SURE: f64 = 4.0;
/// Steps of the solver: each takes an error of the distance of a scan and its neighbours.
const STEPS: usize = 500;
const ACCURACY: f64 = 1e-10;

/// Two scans at the same place: their numbers, of them the first less, and for each channel by how much the logarithm of the first one's
/// light is the larger.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Pair {
    scans: [u32; 2],
    differences: [i16; 3],
}

/// Measures the factors that make the scans equally bright, where that is asked for and any is coloured, and says them in the report.
///
/// # Errors
/// Cancelled.
pub fn tell(
    bundles: &Bundles,
    scan_order: &ScanOrder<'_>,
    coloured: bool,
    params: &MergeParams,
    report: &mut MergeReport,
    progress: &Progress<'_>,
) -> Result<()> {
    if params.match_exposure && coloured {
        report.colour_gains = measure(bundles, scan_order, progress)?;
        progress.lap("colours");
    }
    Ok(())
}

/// The factors for red, green and blue that make the scans equally bright. Empty if they are, or none overlap. O(sums + scans).
///
/// # Errors
/// Cancelled.
fn measure(bundles: &Bundles, scan_order: &ScanOrder<'_>, progress: &Progress<'_>) -> Result<Vec<[f64; 3]>> {
    let each = || bundles.list.par_iter().map(|bundle| &bundle.list);
    let sample = Sample::of(each().map(|list| shared(list).count()).sum(), scan_order.len());
    let of_bundle = |list: &Vec<EdgeSums>| {
        progress.check()?;
        Ok(sample.pairs(list))
    };
    solve(each().map(of_bundle).collect::<Result<Vec<_>>>()?.concat(), scan_order, progress)
}

/// The same, of the scans in order, from pairs of a [`Sample`] of all sums, in any order.
///
/// # Errors
/// Cancelled.
pub fn solve(mut pairs: Vec<Pair>, scan_order: &ScanOrder<'_>, progress: &Progress<'_>) -> Result<Vec<[f64; 3]>> {
    let scans = scan_order.len();
    let place = |number: u32| scan_order.place(number).expect("it is of a scan of the order") as u32;
    pairs.iter_mut().for_each(|pair| pair.scans = pair.scans.map(place));
    pairs.par_sort_unstable();
    progress.check()?;
    if pairs.is_empty() {
        return Ok(Vec::new());
    }
    let mut logarithms = vec![[0.0; 3]; scans];
    let mut is_seen = false;
    for channel in 0..3 {
        let found = Channel::new(&pairs, channel, scans).solve(progress)?;
        is_seen |= found.is_seen();
        logarithms.iter_mut().zip(&found.logarithms).for_each(|(of, &logarithm)| of[channel] = logarithm);
    }
    // In steps that nobody sees: so one scan more or less seldom changes the colours of others.
    let factor = |logarithm: f64| ((logarithm / SEEN).round() * SEEN).exp();
    let factors = || logarithms.iter().map(|of| of.map(factor)).collect();
    Ok(if is_seen { factors() } else { Vec::new() })
}

/// The sums that several scans have colours of.
pub fn shared(list: &[EdgeSums]) -> impl Iterator<Item = &EdgeSums> {
    list.iter().filter(|edge| edge.only_scan().is_none() && edge.members().iter().nth(1).is_some())
}

/// Edges that are looked at.
pub struct Sample {
    every: u64,
    logarithms: [i16; 256],
}

impl Sample {
    /// Of so many that are shared, for so many scans.
    pub fn of(shared: usize, scans: usize) -> Self {
        let edges = (EDGES_A_SCAN * scans).clamp(EDGES[0], EDGES[1]);
        let logarithm =
            |byte: usize| (UNIT * (f64::from(srgb::light(byte as u8).max(1)) / 65_535.0).ln()).round() as i16;
        Sample { every: (shared / edges).next_power_of_two() as u64, logarithms: std::array::from_fn(logarithm) }
    }

    /// The pairs on those of a list.
    pub fn pairs(&self, list: &[EdgeSums]) -> Vec<Pair> {
        let mut pairs = Vec::new();
        for edge in shared(list).filter(|edge| edge.members().hash() >> 32 & (self.every - 1) == 0) {
            let members: Vec<Member> = edge.members().iter().collect();
            for (i, a) in members.iter().enumerate() {
                pairs.extend(members[i + 1..].iter().filter_map(|b| pair(a, b, &self.logarithms)));
            }
        }
        pairs
    }
}

/// The pair that two members of an edge make. `None` if they are of the same scan, or too different.
fn pair(a: &Member, b: &Member, logarithms: &[i16; 256]) -> Option<Pair> {
    let [first, second] = if a.scan < b.scan { [a, b] } else { [b, a] };
    let difference = |channel: usize| {
        let bytes = [first, second].map(|member| member.colour[channel]);
        if bytes.iter().all(|byte| TOLD.contains(byte)) {
            let [first, second] = bytes.map(|byte| logarithms[usize::from(byte)]);
            first - second
        } else {
            NOT_TOLD
        }
    };
    let differences = [0, 1, 2].map(difference);
    let is_told = |&of: &i16| of != NOT_TOLD;
    let is_same = differences.iter().filter(|of| is_told(of)).all(|of| of.abs() <= LARGEST);
    let is_pair = first.scan != second.scan && differences.iter().any(is_told) && is_same;
    is_pair.then_some(Pair { scans: [first.scan, second.scan], differences })
}

/// The pairs of one channel.
struct Channel {
    /// The scans of each couple, and where its differences end.
    couples: Vec<([u32; 2], usize)>,
    /// Rising within each couple.
    differences: Vec<i16>,
    scans: usize,
}

/// The gains of one channel.
struct Found {
    /// Of each scan.
    logarithms: Vec<f64>,
    /// Standard deviation of a pair.
    deviation: f64,
    /// Pairs of each scan.
    counts: Vec<f64>,
}

impl Found {
    /// Whether any gain is more than chance, and seen.
    fn is_seen(&self) -> bool {
        (self.logarithms.iter().zip(&self.counts))
            .any(|(of, count)| of.abs() > SEEN.max(SURE * self.deviation / count.max(1.0).sqrt()))
    }
}

/// Of a couple of scans the number of pairs and the mean of what they say.
struct Link {
    scans: [usize; 2],
    count: f64,
    mean: f64,
}

impl Channel {
    fn new(pairs: &[Pair], channel: usize, scans: usize) -> Self {
        let (mut couples, mut differences) = (Vec::new(), Vec::new());
        for of_couple in pairs.chunk_by(|a, b| a.scans == b.scans) {
            let first = differences.len();
            differences.extend(of_couple.iter().map(|pair| pair.differences[channel]).filter(|&of| of != NOT_TOLD));
            differences[first..].sort_unstable();
            if differences.len() > first {
                couples.push((of_couple[0].scans, differences.len()));
            }
        }
        Channel { couples, differences, scans }
    }

    /// Couples with their differences, rising.
    fn couples(&self) -> impl Iterator<Item = ([usize; 2], &[i16])> {
        let starts = std::iter::once(0).chain(self.couples.iter().map(|couple| couple.1));
        starts
            .zip(&self.couples)
            .map(|(start, &(scans, end))| (scans.map(|scan| scan as usize), &self.differences[start..end]))
    }

    fn solve(&self, progress: &Progress<'_>) -> Result<Found> {
        let medians = self.couples().map(|(scans, of)| Link {
            scans,
            count: of.len() as f64,
            mean: f64::from(of[of.len() / 2]) / UNIT,
        });
        let mut links: Vec<Link> = medians.collect();
        let mut found = Found { logarithms: vec![0.0; self.scans], deviation: 0.0, counts: Vec::new() };
        for _ in 0..ROUNDS {
            found.logarithms = balanced(&links, self.scans, progress)?;
            found.deviation = self.deviation(&found.logarithms);
            links = self.fitting(&found.logarithms, DEVIATIONS * found.deviation);
        }
        found.counts = vec![0.0; self.scans];
        links.iter().for_each(|link| link.scans.iter().for_each(|&scan| found.counts[scan] += link.count));
        Ok(found)
    }

    /// The mean of a couple's differences that these gains would give.
    fn expected(logarithms: &[f64], scans: [usize; 2]) -> f64 {
        UNIT * (logarithms[scans[1]] - logarithms[scans[0]])
    }

    /// Standard deviation of the differences by how far they are off in the middle.
    fn deviation(&self, logarithms: &[f64]) -> f64 {
        let off = self.couples().flat_map(|(scans, of)| {
            let expected = Self::expected(logarithms, scans);
            of.iter().map(move |&of| (f64::from(of) - expected).abs())
        });
        let mut off: Vec<f64> = off.collect();
        let middle = off.len() / 2;
        if off.is_empty() {
            return LEAST_DEVIATION;
        }
        (SIGMA * *off.select_nth_unstable_by(middle, f64::total_cmp).1 / UNIT).max(LEAST_DEVIATION)
    }

    /// The means of the differences that fit.
    fn fitting(&self, logarithms: &[f64], within: f64) -> Vec<Link> {
        let fitting = |(scans, of): ([usize; 2], &[i16])| {
            let expected = Self::expected(logarithms, scans);
            let from = of.partition_point(|&of| f64::from(of) < expected - UNIT * within);
            let to = of.partition_point(|&of| f64::from(of) <= expected + UNIT * within);
            let (count, sum) = ((to - from) as f64, of[from..to].iter().map(|&of| i64::from(of)).sum::<i64>());
            (to > from).then(|| Link { scans, count, mean: sum as f64 / count / UNIT })
        };
        self.couples().filter_map(fitting).collect()
    }
}

/// The logarithms of gains that fit the links best, by conjugate gradients. Sums run in the order of the links.
fn balanced(links: &[Link], scans: usize, progress: &Progress<'_>) -> Result<Vec<f64>> {
    let mut diagonal = vec![0.0; scans];
    let mut rest = vec![0.0; scans];
    for &Link { scans: [a, b], count, mean } in links {
        diagonal[a] += count;
        diagonal[b] += count;
        rest[a] -= count * mean;
        rest[b] += count * mean;
    }
    diagonal.iter_mut().for_each(|of| *of += PRIOR + PRIOR_SHARE * *of);
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let scaled = |of: &[f64]| of.iter().zip(&diagonal).map(|(of, diagonal)| of / diagonal).collect::<Vec<f64>>();
    let mut found = vec![0.0; scans];
    let mut direction = scaled(&rest);
    let mut size = dot(&rest, &direction);
    let enough = ACCURACY * size;
    for _ in 0..STEPS {
        if size <= enough {
            break;
        }
        progress.check()?;
        let mut image: Vec<f64> = direction.iter().zip(&diagonal).map(|(of, diagonal)| of * diagonal).collect();
        for &Link { scans: [a, b], count, .. } in links {
            image[a] -= count * direction[b];
            image[b] -= count * direction[a];
        }
        let step = size / dot(&direction, &image);
        found.iter_mut().zip(&direction).for_each(|(of, direction)| *of += step * direction);
        rest.iter_mut().zip(&image).for_each(|(of, image)| *of -= step * image);
        let next = scaled(&rest);
        let before = std::mem::replace(&mut size, dot(&rest, &next));
        direction.iter_mut().zip(&next).for_each(|(of, next)| *of = next + size / before * *of);
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Evenly spread numbers between 0 and 1.
    fn spread(i: usize) -> f64 {
        (i as f64 * 0.618_033_988_75).fract()
    }

    /// Pairs of scans of these exposures, each with so many of those that follow it. `error` is added to what each pair says.
    fn pairs_of(exposures: &[f64], next: usize, error: impl Fn(usize) -> f64) -> Vec<Pair> {
        let mut pairs = Vec::new();
        for a in 0..exposures.len() {
            for b in a + 1..(a + next + 1).min(exposures.len()) {
                for k in 0..50 {
                    let difference = (exposures[a] / exposures[b]).ln() + error(50 * (a + 7 * b) + k);
                    pairs.push(Pair { scans: [a as u32, b as u32], differences: [(UNIT * difference) as i16; 3] });
                }
            }
        }
        pairs.sort_unstable();
        pairs
    }

    /// The largest relative error of the gains of a channel, a common factor aside.
    fn error_of(pairs: &[Pair], exposures: &[f64]) -> f64 {
        let found = Channel::new(pairs, 1, exposures.len()).solve(&Progress::none()).unwrap();
        let off: Vec<f64> = found.logarithms.iter().zip(exposures).map(|(of, exposure)| of + exposure.ln()).collect();
        let mean = off.iter().sum::<f64>() / off.len() as f64;
        off.iter().map(|of| (of - mean).abs()).fold(0.0, f64::max)
    }

    fn exposures(scans: usize) -> Vec<f64> {
        (0..scans).map(|i| 0.7 + 0.6 * spread(i)).collect()
    }

    #[test]
    fn exposures_are_found_beside_noise_and_highlights() {
        for (scans, next) in [(2, 1), (12, 3), (200, 10)] {
            let exposures = exposures(scans);
            assert!(error_of(&pairs_of(&exposures, next, |_| 0.0), &exposures) < 0.01, "{scans} scans");
            let noise = |k: usize| 0.1 * (spread(k) - 0.5) + if k.is_multiple_of(7) { 0.4 } else { 0.0 };
            assert!(error_of(&pairs_of(&exposures, next, noise), &exposures) < 0.02, "{scans} scans");
        }
    }

    #[test]
    fn chains_keep_the_ratio_of_neighbours() {
        let exposures: Vec<f64> = (0..300).map(|i| 1.0 + 0.3 * f64::from(i % 2)).collect();
        let pairs = pairs_of(&exposures, 1, |k| 0.2 * (spread(k) - 0.5));
        let found = Channel::new(&pairs, 1, exposures.len()).solve(&Progress::none()).unwrap().logarithms;
        for i in 1..exposures.len() {
            let off = found[i] - found[i - 1] + (exposures[i] / exposures[i - 1]).ln();
            assert!(off.abs() < 0.03, "{i}: {off}");
        }
    }

    #[test]
    fn the_prior_settles_what_nothing_tells() {
        // Two scans overlap, the third does not.
        let found = Channel::new(&pairs_of(&[0.8, 1.2], 1, |_| 0.0), 0, 3).solve(&Progress::none()).unwrap();
        assert_eq!(found.logarithms[2], 0.0);
        assert!((found.logarithms[0] + found.logarithms[1]).abs() < 1e-9);
        assert!(found.is_seen());
        let equal = Channel::new(&pairs_of(&[1.0, 1.0], 1, |k| 0.1 * (spread(k) - 0.5)), 0, 2);
        assert!(!equal.solve(&Progress::none()).unwrap().is_seen());
    }

    #[test]
    fn what_is_clipped_says_nothing() {
        let member = |scan, byte| Member { scan, weight: 1, colour: [byte, 100, 3] };
        let logarithms = [0; 256];
        let told = |a: Member, b: Member| pair(&a, &b, &logarithms).map(|pair| pair.differences);
        assert_eq!(told(member(0, 255), member(1, 100)), Some([NOT_TOLD, 0, NOT_TOLD]));
        assert_eq!(told(member(0, 200), member(1, 100)), Some([0, 0, NOT_TOLD]));
        assert_eq!(told(member(1, 200), member(1, 100)), None);
    }
}
