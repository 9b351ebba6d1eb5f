//! What is said of an alignment.

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use crate::assemble::Standing;
use crate::constraints::Axis;
use crate::finding::{Finding, Limits, RIVAL, fits};
use crate::judge::{Hold, Mode, Verdict};
use crate::linear::{Matrix6, eigen};
use crate::misfit::{Cause, Map, Placed, cause};
use crate::pair::Pair;
use crate::relax::Link;
use crate::snap::{Snap, Stays, snap};
use crate::solve::{Looked, Solved, SolvedGroup, residual};
use crate::view::View;
use base::error::Shown;
use base::progress::Progress;

/// Result of [`run`](crate::run).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Alignment {
    /// The pose of each scan, in the order given; `None` for those that aren't placed. All are rigid. A fixed scan's is its
    /// own to the bit, as is that of the largest scan where none is fixed.
    pub world_from_scan: Vec<Option<DAffine3>>,
    /// What was found.
    pub report: AlignReport,
}

base::choices! {
    /// What became of a scan.
    pub enum ScanState {
        /// It has no place: the reason says why.
        Unplaced = "unplaced" "Not placed",
        /// Its pose was found.
        Placed = "placed" "Placed",
        /// Its pose is as given: the caller fixed it, or it is the frame of the others.
        Kept = "kept" "Kept",
        /// It was joined with others, but nothing joins these with the first group.
        Apart = "apart" "In a group of its own",
    }
}

base::choices! {
    /// What became of a pair of scans.
    pub enum PairState {
        /// No motion was found that lays one on the other.
        Nothing = "nothing" "No match",
        /// They overlap and fit, where they lie in the end.
        Fits = "fits" "Fits",
        /// They overlap where they lie in the end, but surfaces lie further apart than noise explains: warp, or something moved.
        Misfit = "misfit" "Does not fit exactly",
        /// They fit, but may turn or slide on each other: not used.
        Slides = "slides" "May turn or slide",
        /// They fit in several places: not used.
        Ambiguous = "ambiguous" "Fits in several places",
        /// What they share stood still before the sensor while the rest moved: not used.
        Background = "background" "Background",
        /// They fit by themselves, but other scans' sensors saw through there: not used.
        SeenThrough = "seen_through" "Seen through",
        /// They fit by themselves, but other pairs, that fit better, say otherwise: not used.
        Disagrees = "disagrees" "Disagrees with others",
        /// The caller rejected it.
        Rejected = "rejected" "Rejected",
    }
}

/// A way that a scan may move without leaving the surfaces it lies on: a turn about an axis, or a slide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Freedom {
    /// Whether it is a turn.
    pub turns: bool,
    /// Unit direction of the axis, or of the slide, in the world.
    pub direction: DVec3,
    /// A point of the axis, in the world.
    pub point: DVec3,
}

/// What was found of a scan.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AlignedScan {
    /// Its name.
    pub name: String,
    /// What became of it.
    pub state: ScanState,
    /// Number of its group: 0 is the one that is placed. `None` where it is joined with none.
    pub group: Option<usize>,
    /// Its pose in its group: of the first group the result; scans of others lie together where the largest of them was given.
    pub world_from_scan: Option<DAffine3>,
    /// Covariance of a small motion of it in the world: turn about `middle` (radians), then shift. Zero for scans that are kept.
    pub covariance: [[f64; 6]; 6],
    /// What it turns about there: the middle of its points, in the world.
    pub middle: DVec3,
    /// One standard deviation of the place of its points: the largest over the scan.
    pub deviation: f64,
    /// Ways that nothing holds it.
    pub free: Vec<Freedom>,
    /// Share of its surface that lies on the scan that shares most with it.
    pub overlap: f64,
    /// Root mean square distance to the surfaces of others, along normals; 0 where there are none.
    pub residual: f64,
    /// Root mean square of how far it lies from the others where noise is averaged out: what no rigid pose explains, such as warp.
    /// Bending within a few samples counts as well, so that some of it is always there.
    pub misfit: f64,
    /// Median distance of its samples.
    pub spacing: f64,
    /// Why it is not placed, and what to do; empty if it is.
    pub reason: String,
}

/// What was found of two scans.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AlignedPair {
    /// Their numbers, the smaller first.
    pub scans: [usize; 2],
    /// What became of the pair.
    pub state: PairState,
    /// Share of either surface that lies on the other.
    pub overlap: [f64; 2],
    /// Root mean square distance of the surfaces where they touch, along normals.
    pub residual: f64,
    /// How well it is held against turning and sliding: 1 at best, 0 where it may.
    pub balance: f64,
    /// Of what the sensors can tell, the share that speaks against it.
    pub seen_through: f64,
    /// Places in which one fits the other.
    pub places: usize,
    /// Ways that it may turn or slide.
    pub free: Vec<Freedom>,
}

/// What was found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AlignReport {
    /// Each scan, in the order given.
    pub scans: Vec<AlignedScan>,
    /// The pairs of which anything was found, by their numbers.
    pub pairs: Vec<AlignedPair>,
    /// Numbers of the scans of each group, the placed one first; only scans that are joined with others, or kept.
    pub groups: Vec<Vec<usize>>,
    /// Pairs that were compared.
    pub compared: usize,
    /// Root mean square distance of the surfaces of all pairs that touch, along normals; `None` where none do.
    pub residual: Option<f64>,
    /// The turntable, where there was one and it was found.
    pub turntable: Option<TurntableFound>,
    /// What the user should know, a sentence each.
    pub messages: Vec<String>,
}

/// A turntable as it was found.
#[derive(Clone, Debug, PartialEq)]
pub struct TurntableFound {
    /// Its axis, in the frame that the scans were taken in; the direction is of length 1.
    pub axis: Axis,
    /// By how much it was turned at each scan, in radians from 0 to 2 pi, counter-clockwise where the axis points to the viewer; 0
    /// at the first scan that is placed. `None` for scans that aren't.
    pub angles: Vec<Option<f64>>,
}

impl AlignReport {
    /// The report as lines of text: each scan, then what the user should know. For logs.
    pub fn lines(&self) -> Vec<String> {
        let mut lines = vec![format!(
            "{} of {} scans placed; {} pairs compared, {} overlap and fit{}",
            self.placed(),
            self.scans.len(),
            self.compared,
            self.pairs.iter().filter(|pair| pair.state == PairState::Fits).count(),
            self.residual.map_or(String::new(), |residual| format!(", {} apart", Shown::digits(residual, 3))),
        )];
        for scan in &self.scans {
            let name = &scan.name;
            lines.push(match scan.state {
                ScanState::Kept => format!("{name}: stays where it is"),
                ScanState::Placed => format!(
                    "{name}: placed, to {}; shares {:.0} % with another; {} apart",
                    Shown::digits(scan.deviation, 2),
                    100.0 * scan.overlap,
                    Shown::digits(scan.residual, 3),
                ),
                ScanState::Apart | ScanState::Unplaced => format!("{name}: not placed: {}", scan.reason),
            });
        }
        lines.extend(self.messages.iter().cloned());
        lines
    }

    /// Scans that lie in one frame: those that were placed, and those kept that they were placed by. 0 where none was placed.
    pub fn placed(&self) -> usize {
        let count = |state| self.scans.iter().filter(|scan| scan.state == state).count();
        if count(ScanState::Placed) == 0 { 0 } else { count(ScanState::Placed) + count(ScanState::Kept) }
    }
}

/// The result by the caller's numbers: `order` gives the number of each scan inside, `names` their names.
pub(crate) fn alignment(names: &[String], views: &[View], order: &[usize], solved: Solved) -> Alignment {
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let mut report = AlignReport { compared: solved.pairs.len(), ..AlignReport::default() };
    let mut scans: Vec<AlignedScan> = (0..views.len()).map(|k| scan(views, k, names[k])).collect();
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
        }
        if is_first {
            let all: Vec<_> = links.iter().map(|looked| looked.link).collect();
            report.residual = residual(views, group, &all);
        }
    }
    report.pairs = pair_table(views, &solved, order, &scans);
    for (scan, misfit) in scans.iter_mut().zip(misfits_of(views, &solved)) {
        scan.misfit = misfit;
    }
    for k in 0..scans.len() {
        if matches!(scans[k].state, ScanState::Unplaced | ScanState::Apart) {
            scans[k].reason = reason(views, &solved, &names, &scans, k);
        }
    }
    say(&mut report, views, order, &names, &scans, &solved);
    let mut by_number: Vec<AlignedScan> = vec![AlignedScan::default(); scans.len()];
    for (entry, &number) in scans.into_iter().zip(order) {
        by_number[number] = entry;
    }
    let placed = |scan: &AlignedScan| scan.world_from_scan.filter(|_| scan.group == Some(0));
    let world_from_scan: Vec<Option<DAffine3>> = by_number.iter().map(placed).collect();
    let turntable = solved.table.as_ref().map(|table| TurntableFound {
        axis: Axis { point: table.point, direction: table.direction },
        angles: table.turns(&world_from_scan),
    });
    Alignment { world_from_scan, report: AlignReport { scans: by_number, turntable, ..report } }
}

/// How far each scan lies from the others of its group, noise averaged out.
fn misfits_of(views: &[View], solved: &Solved) -> Vec<f64> {
    let mut found = vec![0.0; views.len()];
    for group in &solved.groups {
        let of_scan = group.members.par_iter().map(|&(k, pose)| {
            let scan = Placed { view: &views[k], world_from_local: pose };
            (k, Map::new(&scan, &beside(views, solved, group, k)).root_mean_square().unwrap_or(0.0))
        });
        of_scan.collect::<Vec<_>>().into_iter().for_each(|(k, misfit)| found[k] = misfit);
    }
    found
}

impl SolvedGroup {
    fn pose(&self, scan: usize) -> Option<DAffine3> {
        self.members.iter().find(|member| member.0 == scan).map(|member| member.1)
    }

    fn has(&self, scan: usize) -> bool {
        self.members.iter().any(|member| member.0 == scan)
    }
}

fn scan(views: &[View], k: usize, name: &str) -> AlignedScan {
    AlignedScan {
        name: name.to_owned(),
        middle: views[k].reduced.world_from_local().translation,
        spacing: views[k].reduced.spacing,
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
                self.free.push(Freedom::of(vector, self.middle, radius));
            }
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

impl Freedom {
    /// Of a turn (times `radius`) and a shift about `middle`.
    fn of(vector: &[f64; 6], middle: DVec3, radius: f64) -> Self {
        let [turn, shift] = [0, 3].map(|i| DVec3::new(vector[i], vector[i + 1], vector[i + 2]));
        if turn.length() > 0.3 * shift.length() {
            let turn = turn / radius;
            // Points of the axis don't move: shift + turn x (point - middle) is along the axis.
            let point = middle + turn.cross(shift) / turn.length_squared();
            Freedom { turns: true, direction: turn.normalize(), point }
        } else {
            Freedom { turns: false, direction: shift.normalize_or_zero(), point: middle }
        }
    }
}

/// Ways that a pair may turn or slide, in the frame of `world_from_first`.
pub(crate) fn freedoms(hold: &Hold, world_from_first: &DAffine3) -> Vec<Freedom> {
    let free = hold.values.iter().zip(&hold.vectors).filter(|(value, _)| **value < crate::finding::BALANCE);
    free.map(|(_, vector)| {
        let freedom = Freedom::of(vector, hold.middle, hold.radius);
        Freedom {
            direction: world_from_first.transform_vector3(freedom.direction),
            point: world_from_first.transform_point3(freedom.point),
            ..freedom
        }
    })
    .collect()
}

/// The ways in words: "turn about the axis (0, 0, 1)".
fn ways(free: &[Freedom]) -> String {
    let direction = |d: DVec3| {
        let d = if d.to_array().into_iter().find(|x| x.abs() > 0.01).is_some_and(|x| x < 0.0) { -d } else { d };
        let [x, y, z] = d.to_array().map(|x| (100.0 * x).round() / 100.0 + 0.0);
        format!("({x}, {y}, {z})")
    };
    let turns: Vec<&Freedom> = free.iter().filter(|freedom| freedom.turns).collect();
    let slides: Vec<&Freedom> = free.iter().filter(|freedom| !freedom.turns).collect();
    match (turns.len(), slides.len()) {
        (3.., _) => "turn in any direction, as a ball does".to_owned(),
        (_, 2..) => "slide along its flat side".to_owned(),
        (1.., 1) => format!("turn about and slide along the direction {}", direction(slides[0].direction)),
        (1.., _) => format!("turn about an axis along {}", direction(turns[0].direction)),
        (0, 1) => format!("slide along the direction {}", direction(slides[0].direction)),
        (0, 0) => "turn or slide".to_owned(),
    }
}

fn state_of(pair: &Pair, standing: Standing) -> PairState {
    match (pair.finding, standing) {
        (_, Standing::SeenThrough) => PairState::SeenThrough,
        (_, Standing::Disagrees) => PairState::Disagrees,
        (Finding::Ambiguous, _) => PairState::Ambiguous,
        (Finding::Sure, _) | (Finding::Weak, Standing::Joins | Standing::Agrees) => PairState::Fits,
        (Finding::Slides | Finding::Weak, _) => PairState::Slides,
        (Finding::Background, _) => PairState::Background,
        _ => PairState::Nothing,
    }
}

fn pair_table(views: &[View], solved: &Solved, order: &[usize], scans: &[AlignedScan]) -> Vec<AlignedPair> {
    let mut table: std::collections::BTreeMap<[usize; 2], AlignedPair> = std::collections::BTreeMap::new();
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
                free,
            };
            table.insert(numbers, entry);
        };
    for (pair, &standing) in solved.pairs.iter().zip(&solved.standings) {
        let state = state_of(pair, standing);
        if state != PairState::Nothing {
            let first = &pair.modes[0].verdict;
            let world_from_first = scans[pair.a].world_from_scan.unwrap_or(views[pair.a].reduced.world_from_scan)
                * DAffine3::from_translation(views[pair.a].reduced.middle);
            put(
                pair.a,
                pair.b,
                state,
                Some(first),
                places(views, pair, &solved.limits),
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

fn places(views: &[View], pair: &Pair, limits: &Limits) -> usize {
    let both = [&views[pair.a], &views[pair.b]];
    let least = RIVAL * pair.modes[0].verdict.score();
    let fitting = |mode: &&Mode| {
        mode.verdict.score() >= least && matches!(fits(both, &mode.verdict, limits), Finding::Sure | Finding::Weak | Finding::Slides)
    };
    pair.modes.iter().filter(fitting).count()
}

/// A scan so many times larger or smaller than the median is in another unit.
const OTHER_UNIT: f64 = 30.0;

fn median_radius(views: &[View]) -> f64 {
    let mut radii: Vec<f64> = views.iter().map(|view| view.reduced.radius).filter(|r| *r > 0.0).collect();
    radii.sort_by(f64::total_cmp);
    radii.get(radii.len() / 2).copied().unwrap_or(0.0)
}

fn reason(views: &[View], solved: &Solved, names: &[&str], scans: &[AlignedScan], k: usize) -> String {
    let reduced = &views[k].reduced;
    if reduced.area <= 0.0 {
        return "it has no surface: no sample has neighbours".to_owned();
    }
    let median = median_radius(views);
    if reduced.radius > OTHER_UNIT * median || OTHER_UNIT * reduced.radius < median {
        let [own, usual] = [2.0 * reduced.radius, 2.0 * median].map(|size| Shown::digits(size, 2));
        return format!(
            "it is {own} large where others are {usual}: is it in another unit? Scale it, or say its unit when it is read"
        );
    }
    if views[k].fine().len() < TOO_FEW {
        return format!(
            "it has too little surface: {} points of it are left where samples are averaged",
            views[k].fine().len()
        );
    }
    let apart = scans[k].state == ScanState::Apart;
    let joined = |text: String| if apart { format!("its group fits nothing else; {text}") } else { text };
    let of_scan = || solved.pairs.iter().filter(|pair| (pair.a == k || pair.b == k) && !pair.modes.is_empty());
    let other = |pair: &Pair| names[if pair.a == k { pair.b } else { pair.a }];
    let most = |x: &&Pair, y: &&Pair| touching(x).total_cmp(&touching(y));
    let adrift =
        solved.groups.iter().find(|group| group.frame == k && group.members.len() == 1).and_then(|group| group.adrift);
    let sure = of_scan().filter(|pair| pair.finding == Finding::Sure).max_by(most);
    if let (Some(deviation), Some(pair)) = (adrift, sure) {
        return format!(
            "it fits {:?}, but where is known to no better than {}: too little holds it; scan more of what both show",
            other(pair),
            Shown::digits(deviation, 2)
        );
    }
    if let Some(text) = nearly(views, solved, names, k) {
        return joined(text);
    }
    let telling = of_scan().filter_map(|pair| Some((pair, why_not(views, solved, pair, other(pair))?)));
    if let Some((_, text)) = telling.max_by(|(x, _), (y, _)| most(x, y)) {
        return joined(text);
    }
    let standings = solved.pairs.iter().zip(&solved.standings);
    let is_through =
        |(pair, standing): &(&Pair, &Standing)| (pair.a == k || pair.b == k) && **standing == Standing::SeenThrough;
    if let Some((pair, _)) = standings.into_iter().find(is_through) {
        return joined(format!("it fits {:?}, but other scans saw through where that would put it", other(pair)));
    }
    joined("no place was found where it fits another scan: scan so that neighbours share a third of what they see, or give it a rough pose".to_owned())
}

fn touching(pair: &Pair) -> f64 {
    pair.modes[0].verdict.touching()
}

/// Why a scan `k` is not joined to `other` by a pair of both; `None` if they plainly have nothing to do with each other.
fn why_not(views: &[View], solved: &Solved, pair: &Pair, other: &str) -> Option<String> {
    let verdict = &pair.modes[0].verdict;
    match pair.finding {
        Finding::Ambiguous => Some(format!(
            "it fits {other:?} in {} places, and no other scan decides: give it a rough pose, or a pair of points that both show",
            places(views, pair, &solved.limits)
        )),
        Finding::Weak => Some(format!(
            "it fits {other:?}, but so little holds it that another scan must say the same, and none does: scan more around it"
        )),
        Finding::Slides => {
            let free = freedoms(&verdict.hold, &views[pair.a].reduced.world_from_local());
            Some(format!(
                "it fits {other:?} but can {}: give pairs of points that both show, or scan more around it",
                ways(&free)
            ))
        }
        Finding::Background => Some(format!(
            "most of what it shares with {other:?} stands still before the sensor while the rest moved: remove the background or the stage"
        )),
        _ => None,
    }
}

/// What keeps a scan `k` that nearly fits the first group from fitting it; `None` where it isn't near, or nothing does.
fn nearly(views: &[View], solved: &Solved, names: &[&str], k: usize) -> Option<String> {
    let group = solved.groups.first().filter(|group| !group.has(k))?;
    let stays = |&(scan, pose): &(usize, DAffine3)| Stays { number: scan, view: &views[scan], world_from_local: pose };
    let others: Vec<Stays<'_>> = group.members.iter().map(stays).collect();
    let of_pair = |pair: &Pair| {
        let (other, flips) = if pair.a == k { (pair.b, true) } else { (pair.a, false) };
        let there = group.pose(other).filter(|_| pair.a == k || pair.b == k);
        let pose = move |mode: &Mode| {
            let other_from_k = if flips { mode.a_from_b.inverse() } else { mode.a_from_b };
            there.map(|there| (mode.verdict.touching(), there * other_from_k))
        };
        pair.modes.iter().filter_map(pose).collect::<Vec<_>>()
    };
    let mut starts: Vec<(f64, DAffine3)> = solved.pairs.iter().flat_map(of_pair).collect();
    starts.sort_by(|x, y| y.0.total_cmp(&x.0));
    starts.truncate(TRIED);
    let drawn = |(_, start): &(f64, DAffine3)| {
        let reach = 3.0 * views[k].coarse.cell;
        snap(&views[k], start, &others, reach, &solved.limits, &Progress::none()).ok()
    };
    let snaps: Vec<Snap> = starts.par_iter().filter_map(drawn).collect();
    let score = |snap: &Snap| snap.overlap * (1.0 - snap.seen_through / THROUGH);
    let best = snaps.into_iter().max_by(|x, y| score(x).total_cmp(&score(y)))?;
    if best.overlap < NEARLY || best.seen_through > THROUGH {
        return None;
    }
    let scan = Placed {
        view: &views[k],
        world_from_local: best.world_from_scan * DAffine3::from_translation(views[k].reduced.middle),
    };
    let beside: Vec<Placed<'_>> = others
        .iter()
        .filter(|other| best.touches.contains(&other.number))
        .map(|other| Placed { view: other.view, world_from_local: other.world_from_local })
        .collect();
    let cause = cause(&scan, &beside, &solved.limits)?;
    let beside: Vec<&str> = best.touches.iter().map(|&other| names[other]).collect();
    let remedy = match cause {
        Cause::Scale(_) => "scale it",
        Cause::Moved { .. } => "cut off what moved",
        Cause::Warp => "check the scanner's calibration, or place it by pairs of points",
    };
    Some(format!("it nearly fits {}, but {}: {remedy}", quoted(&beside), because(cause)))
}

/// Motions of which a scan's may be the one.
const TRIED: usize = 12;
/// Least share of a scan that lies on the others if it nearly fits them, and most that may speak against it.
const NEARLY: f64 = 0.3;
const THROUGH: f64 = 0.25;

fn because(cause: Cause) -> String {
    match cause {
        Cause::Scale(scale) => format!("it would fit better if it were {} times as large", Shown::digits(scale, 3)),
        Cause::Moved { middle, share } => {
            let [x, y, z] = middle.to_array().map(|x| Shown::digits(x, 3).to_string());
            format!(
                "a part of it has moved, near ({x}, {y}, {z}): {:.0} % of what others show",
                (100.0 * share).max(1.0)
            )
        }
        Cause::Warp => "it is bent: it lies further off than noise explains".to_owned(),
    }
}

/// Points below which nothing can be compared.
const TOO_FEW: usize = 30;

fn say(
    report: &mut AlignReport,
    views: &[View],
    order: &[usize],
    names: &[&str],
    scans: &[AlignedScan],
    solved: &Solved,
) {
    let mut unplaced: Vec<usize> = (0..scans.len()).filter(|&k| scans[k].state == ScanState::Unplaced).collect();
    unplaced.sort_by_key(|&k| order[k]);
    let unplaced: Vec<&str> = unplaced.into_iter().map(|k| names[k]).collect();
    if !unplaced.is_empty() {
        report.messages.push(match unplaced.len() {
            1 => format!("{:?} is not placed", unplaced[0]),
            n => format!("{n} scans are not placed: {}", quoted(&unplaced)),
        });
    }
    if report.groups.len() > 1 {
        report.messages.push(format!(
            "nothing joins {} groups of scans: give rough poses, or a pair of points that two of them show",
            report.groups.len()
        ));
    }
    let same = (0..views.len()).flat_map(|a| (a + 1..views.len()).map(move |b| (a, b)));
    for (a, b) in
        same.filter(|&(a, b)| views[a].reduced.content == views[b].reduced.content && views[a].reduced.area > 0.0)
    {
        report.messages.push(format!("{:?} and {:?} hold the same samples: leave one out", names[a], names[b]));
    }
    if solved.is_turned && solved.table.is_none() {
        report.messages.push(
            "the turntable's axis was not found, since no two pairs of scans are sure by themselves and turn about the same one: give the axis"
                .to_owned(),
        );
    }
    if let Some(group) = solved.groups.first() {
        let causes = group.members.par_iter().map(|&(k, pose)| {
            let scan = Placed { view: &views[k], world_from_local: pose };
            cause(&scan, &beside(views, solved, group, k), &solved.limits).map(|cause| (k, cause))
        });
        let mut causes: Vec<(usize, Cause)> = causes.collect::<Vec<_>>().into_iter().flatten().collect();
        causes.sort_by_key(|(k, _)| order[*k]);
        for (k, cause) in causes {
            report.messages.push(format!("{:?} does not fit the others exactly: {}", names[k], because(cause)));
        }
    }
}

/// The scans of a group that touch one of it.
fn beside<'v>(views: &'v [View], solved: &Solved, group: &SolvedGroup, k: usize) -> Vec<Placed<'v>> {
    let others = solved.links.iter().filter_map(|looked| match looked.link {
        Link { a, b } if a == k => Some(b),
        Link { a, b } if b == k => Some(a),
        _ => None,
    });
    others.filter_map(|scan| Some(Placed { view: &views[scan], world_from_local: group.pose(scan)? })).collect()
}

/// At most five names.
fn quoted(names: &[&str]) -> String {
    let shown: Vec<String> = names.iter().take(5).map(|name| format!("{name:?}")).collect();
    let rest = names.len().saturating_sub(5);
    if rest > 0 { format!("{} and {rest} more", shown.join(", ")) } else { shown.join(", ") }
}
