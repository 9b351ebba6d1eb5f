//! The report's figures, by the caller's numbers.

use std::collections::BTreeMap;

use glam::DAffine3;
use rayon::prelude::*;

use crate::assemble::Standing;
use crate::constraints::Axis;
use crate::finding::{FREE, Finding};
use crate::judge::Verdict;
use crate::linear::{Matrix6, eigen};
use crate::misfit::{Map, Placed};
use crate::names::told_apart;
use crate::pair::Pair;
use crate::report::{
    AlignReport, AlignedPair, AlignedScan, Alignment, Freedom, PairState, ScanState, TurntableFound, freedoms,
};
use crate::solve::{Looked, Solved, SolvedGroup, residual};
use crate::view::View;
use crate::words::{Reason, reason, say};
use base::error::Result;
use base::progress::Progress;

/// The result by the caller's numbers: `order` gives the number of each scan inside, `names` their names.
pub(crate) fn alignment(
    names: &[String],
    views: &[View],
    order: &[usize],
    solved: Solved,
    progress: &Progress<'_>,
) -> Result<Alignment> {
    let told_apart = told_apart(names, order);
    let shown: Vec<&str> = told_apart.iter().map(String::as_str).collect();
    let mut report = AlignReport { compared: solved.pairs.len(), ..AlignReport::default() };
    let mut scans: Vec<AlignedScan> = (0..views.len()).map(|k| scan(views, k, &names[k])).collect();
    for (number, group) in solved.groups.iter().enumerate() {
        let is_first = number == 0;
        if group.members.len() == 1 && !is_first {
            continue;
        }
        let place = report.groups.len();
        let mut numbers: Vec<usize> = group.members.iter().map(|member| order[member.0]).collect();
        numbers.sort_unstable();
        report.groups.push(numbers);
        let links: Vec<&Looked> = solved.links.iter().filter(|l| group.has(l.link.a) && group.has(l.link.b)).collect();
        for (&(k, pose), covariance) in group.members.iter().zip(&group.covariances) {
            let is_kept = solved.inside[k] || (k == group.frame && !group.members.iter().any(|m| solved.inside[m.0]));
            let entry = &mut scans[k];
            entry.state = match (is_first, is_kept) {
                (true, true) => ScanState::Kept,
                (true, false) => ScanState::Placed,
                (false, _) => ScanState::Apart,
            };
            entry.group = Some(place);
            let view = &views[k];
            entry.world_from_scan = Some(match is_kept {
                true => view.reduced.world_from_scan,
                false => pose * DAffine3::from_translation(-view.reduced.middle),
            });
            entry.middle = pose.translation;
            entry.placed(view, covariance);
            entry.touching(&links, k);
            if entry.state == ScanState::Placed && solved.table.is_none() {
                entry.slack(&links, k, views, group);
            }
        }
        if is_first {
            let all: Vec<_> = links.iter().map(|looked| looked.link).collect();
            report.residual = residual(views, group, &all);
        }
    }
    report.pairs = pair_table(views, &solved, order, &scans);
    for (scan, misfit) in scans.iter_mut().zip(misfits_of(views, &solved, progress)?) {
        scan.misfit = misfit;
    }
    let no_poses = solved.bound.no_poses(solved.groups.first().is_some_and(|group| group.members.len() > 1));
    for k in 0..scans.len() {
        if matches!(scans[k].state, ScanState::Unplaced | ScanState::Apart) {
            let why = match no_poses.filter(|_| views[k].reduced.area > 0.0) {
                Some(text) => Reason { text: text.to_owned(), is_open: false },
                None => reason(views, &solved, &shown, &scans, k, progress)?,
            };
            scans[k].reason = why.text;
            if solved.bound.binds() && why.is_open {
                scans[k].stays(&views[k], solved.bound.reach(k));
            }
        }
    }
    say(&mut report, views, order, &shown, &scans, &solved, progress)?;
    let mut by_number: Vec<AlignedScan> = vec![AlignedScan::default(); scans.len()];
    for (entry, &number) in scans.into_iter().zip(order) {
        by_number[number] = entry;
    }
    let has_place = |scan: &AlignedScan| scan.group == Some(0) || scan.state == ScanState::Undecided;
    let placed = |scan: &AlignedScan| scan.world_from_scan.filter(|_| has_place(scan));
    let world_from_scan: Vec<Option<DAffine3>> = by_number.iter().map(placed).collect();
    let turntable = solved.table.as_ref().map(|table| TurntableFound {
        axis: Axis { point: table.point, direction: table.direction },
        angles: table.turns(&world_from_scan),
    });
    Ok(Alignment { world_from_scan, report: AlignReport { scans: by_number, turntable, ..report } })
}

/// Points of a scan that tell how far it lies from the others.
const MISFIT_SAMPLES: usize = 2500;

/// How far each scan lies from the others of its group, noise averaged out.
fn misfits_of(views: &[View], solved: &Solved, progress: &Progress<'_>) -> Result<Vec<f64>> {
    let mut found = vec![0.0; views.len()];
    for group in &solved.groups {
        let of_scan = group.members.par_iter().map(|&(k, pose)| {
            progress.check()?;
            let scan = Placed { view: &views[k], world_from_local: pose };
            let map = Map::new(&scan, &solved.beside(views, group, k), MISFIT_SAMPLES);
            Ok((k, map.root_mean_square().unwrap_or(0.0)))
        });
        of_scan.collect::<Result<Vec<_>>>()?.into_iter().for_each(|(k, misfit)| found[k] = misfit);
    }
    Ok(found)
}

fn scan(views: &[View], k: usize, name: &str) -> AlignedScan {
    AlignedScan {
        name: name.to_owned(),
        middle: views[k].reduced.world_from_local().translation,
        spacing: views[k].reduced.spacing,
        deviation: f64::INFINITY,
        ..AlignedScan::default()
    }
}

impl AlignedScan {
    fn placed(&mut self, view: &View, covariance: &Matrix6) {
        let radius = view.reduced.radius.max(f64::MIN_POSITIVE);
        let unit = |i: usize| if i < 3 { radius } else { 1.0 };
        for i in 0..6 {
            for j in 0..6 {
                self.covariance[i][j] = covariance[i][j] / (unit(i) * unit(j));
            }
        }
        let (values, vectors) = eigen(covariance);
        self.deviation = values[5].max(0.0).sqrt();
        for (value, vector) in values.iter().zip(&vectors) {
            if value.max(0.0).sqrt() > HELD * view.fine().cell {
                self.freedoms.push(Freedom::of(vector, self.middle, radius));
            }
        }
    }

    /// Nothing decides where it belongs: it stays where it was given, which may be off by `reach`.
    fn stays(&mut self, view: &View, reach: f64) {
        self.state = ScanState::Undecided;
        self.world_from_scan = Some(view.reduced.world_from_scan);
        self.middle = view.reduced.world_from_local().translation;
        (self.covariance, self.deviation, self.freedoms) = ([[0.0; 6]; 6], reach, Vec::new());
    }

    /// The freedom of a scan that is trusted and holds by nothing: its covariance comes of noise alone.
    fn slack(&mut self, links: &[&Looked], k: usize, views: &[View], group: &SolvedGroup) {
        let of_scan = links.iter().filter(|looked| looked.link.a == k || looked.link.b == k);
        let Some(best) = of_scan.max_by(|x, y| x.verdict.hold.balance().total_cmp(&y.verdict.hold.balance())) else {
            return;
        };
        if best.verdict.hold.balance() < FREE && !group.tied.contains(&k) && !group.coloured.contains(&best.link) {
            let Some(world_from_first) = group.pose(best.link.a) else { return };
            self.freedoms = freedoms(&best.verdict.hold, &world_from_first);
            self.deviation = self.deviation.max(views[k].reduced.radius);
        }
    }

    fn touching(&mut self, links: &[&Looked], k: usize) {
        let (mut sum, mut weight) = (0.0, 0.0);
        for looked in links {
            let side = match k {
                _ if looked.link.a == k => 0,
                _ if looked.link.b == k => 1,
                _ => continue,
            };
            self.overlap = self.overlap.max(looked.verdict.overlap()[side]);
            sum += looked.verdict.touching() * looked.verdict.mean_square;
            weight += looked.verdict.touching();
        }
        self.residual = if weight > 0.0 { (sum / weight).sqrt() } else { 0.0 };
    }
}

/// A direction in which a pose may be off by so many cells is free.
const HELD: f64 = 1.0;

fn state_of(pair: &Pair, standing: Standing) -> PairState {
    match (pair.finding, standing) {
        (_, Standing::SeenThrough) => PairState::SeenThrough,
        (_, Standing::Disagrees | Standing::Waits | Standing::Beyond) => PairState::Disagrees,
        // Sure by itself, but not believed: its scans fit most others in several places.
        (Finding::Ambiguous | Finding::Walls, _) | (Finding::Sure, Standing::Unused) => PairState::Ambiguous,
        (Finding::Sure, _) | (Finding::Weak, Standing::Joins | Standing::Agrees) => PairState::Fits,
        (Finding::Slides | Finding::Weak, _) => PairState::Slides,
        (Finding::Background, _) => PairState::Background,
        _ => PairState::Nothing,
    }
}

fn pair_table(views: &[View], solved: &Solved, order: &[usize], scans: &[AlignedScan]) -> Vec<AlignedPair> {
    let mut table: BTreeMap<[usize; 2], AlignedPair> = BTreeMap::new();
    let mut put =
        |a: usize, b: usize, state: PairState, verdict: Option<&Verdict>, places: usize, free: Vec<Freedom>| {
            let flipped = order[a] > order[b];
            let mut numbers = [order[a], order[b]];
            let mut overlap = verdict.map_or([0.0; 2], Verdict::overlap);
            if flipped {
                numbers.reverse();
                overlap.reverse();
            }
            let entry = AlignedPair {
                scans: numbers,
                state,
                overlap,
                residual: verdict.map_or(0.0, |v| v.mean_square.sqrt()),
                balance: verdict.map_or(0.0, |v| v.hold.balance().min(1.0)),
                seen_through: verdict.map_or(0.0, Verdict::contradiction),
                places,
                freedoms: free,
            };
            table.insert(numbers, entry);
        };
    let is_beyond = |k: usize| solved.groups.iter().any(|group| group.beyond.iter().any(|(scan, _)| *scan == k));
    let are_together = |a: usize, b: usize| solved.groups.iter().any(|group| group.has(a) && group.has(b));
    for (pair, &standing) in solved.pairs.iter().zip(&solved.standings) {
        let state = match state_of(pair, standing) {
            // They fit, but not where rough poses have them.
            PairState::Fits if (is_beyond(pair.a) || is_beyond(pair.b)) && !are_together(pair.a, pair.b) => {
                PairState::Disagrees
            }
            state => state,
        };
        if state != PairState::Nothing {
            let first = &pair.modes[0].verdict;
            let world_from_first = scans[pair.a].world_from_scan.unwrap_or(views[pair.a].reduced.world_from_scan)
                * DAffine3::from_translation(views[pair.a].reduced.middle);
            put(
                pair.a,
                pair.b,
                state,
                Some(first),
                pair.places(views, &solved.limits),
                freedoms(&first.hold, &world_from_first),
            );
        }
    }
    for looked in &solved.links {
        let (a, b) = (looked.link.a, looked.link.b);
        let told = solved.pairs.iter().zip(&solved.standings).find(|(pair, _)| pair.a == a && pair.b == b);
        let disagreed = told.is_some_and(|(_, standing)| *standing == Standing::Disagrees);
        let state = match looked.is_off() {
            true => PairState::Misfit,
            false if disagreed => PairState::Disagrees,
            false => PairState::Fits,
        };
        put(a, b, state, Some(&looked.verdict), 1, Vec::new());
    }
    for &[a, b] in &solved.rejected {
        put(a, b, PairState::Rejected, None, 0, Vec::new());
    }
    table.into_values().collect()
}
