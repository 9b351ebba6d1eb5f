//! From pairs to groups: the surest pairs first, and no join that any sensor speaks against \[HH03\].

use std::collections::{BTreeMap, BTreeSet};

use glam::DAffine3;

use crate::finding::Finding;
use crate::group::Group;
use crate::judge::{Verdict, glance};
use crate::linear::apart;
use crate::pair::Pair;
use crate::reach::Bound;
use crate::sequence::{Joins, Steps};
use crate::view::View;

/// The outcome of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Standing {
    /// It joined two groups.
    Joins,
    /// It says the same as others that did.
    Agrees,
    /// It says something else.
    Disagrees,
    /// Sensors of other scans see through where it would put them.
    SeenThrough,
    /// It may join two pieces of a recording once those between them have their places.
    Waits,
    /// It would put scans beyond reach of where they were given.
    Beyond,
    /// It was not sure.
    Unused,
}

/// Samples of a scan for a look at a join.
const SAMPLES: usize = 150;
/// A join is refused if so much of a scan is seen through, and so much of what can be told speaks against it ...
const THROUGH: [f64; 2] = [0.08, 0.3];
/// ... or if so much of what all sensors of both groups can tell together speaks against it. Right joins of real scans had at most 0.0011
/// and of noisy rooms nothing. Wrong ones of box-shaped rooms, where corners fit corners, had 0.01 to 0.2, a few 0.002.
const JOINTLY: f64 = 0.005;
/// Of up to so many scans of a room a pair that is sure is believed. More scans have many more pairs, of which some are sure by chance:
/// there a pair that holds less than this, or shares less of one scan and of the other, is confirmed by another one. Of 60 virtual heaps
/// four had frames placed wrongly by such a pair. A twentieth of the frames is left out for them.
pub const FEW_SCANS: usize = 5;
const HELD: f64 = 0.01;
const SHARED: [f64; 2] = [0.2, 0.4];
/// Pairs agree if they put a scan within so many coarse cells of the same place.
pub(crate) const AGREE: f64 = 3.0;

/// A few samples of two scans, to `tolerance` or two coarse cells. `None` where they are out of each other's sight.
pub(crate) fn glanced(both: [&View; 2], a_from_b: &DAffine3, tolerance: f64) -> Option<Verdict> {
    if a_from_b.translation.length() > both[0].reduced.radius + both[1].reduced.radius {
        return None;
    }
    let samples = both.map(|view| view.coarse.spread(SAMPLES));
    let cells = 2.0 * both[0].coarse.cell.max(both[1].coarse.cell);
    glance(both, [&samples[0], &samples[1]], a_from_b, cells.max(tolerance))
}

fn is_through(seen: &Verdict) -> bool {
    let share = (seen.through[0] / seen.total[0]).max(seen.through[1] / seen.total[1]);
    share > THROUGH[0] && seen.contradiction() > THROUGH[1]
}

/// Whether two scans see through each other much, further off than `tolerance`.
pub(crate) fn contradict(both: [&View; 2], a_from_b: &DAffine3, tolerance: f64) -> bool {
    glanced(both, a_from_b, tolerance).is_some_and(|seen| is_through(&seen))
}

/// Whether scans of two groups, the second moved, see through each other: two of them much, or all together.
pub(crate) fn contradicts(views: &[View], first: &Group, second: &Group, motion: &DAffine3) -> bool {
    let (mut through, mut touching) = (0.0, 0.0);
    for &(i, pose_i) in &first.members {
        for &(j, pose_j) in &second.members {
            let i_from_j = pose_i.inverse() * *motion * pose_j;
            let both = [&views[i], &views[j]];
            let Some(seen) = glanced(both, &i_from_j, 0.0) else { continue };
            if is_through(&seen) {
                return true;
            }
            through += seen.through[0] + seen.through[1];
            touching += seen.touching();
        }
    }
    through > JOINTLY * (through + touching)
}

/// Limits of the places that scans may take.
#[derive(Clone, Copy)]
pub(crate) struct Limit<'a> {
    pub bound: &'a Bound,
    pub steps: Option<&'a Steps>,
    pub is_fixed: &'a [bool],
}

/// Groups while pairs join them.
struct Assembly<'a> {
    views: &'a [View],
    pairs: &'a [Pair],
    groups: Vec<Option<Group>>,
    limit: Limit<'a>,
    group_of: Vec<usize>,
    standings: Vec<Standing>,
}

/// Joins `groups` by the pairs that are sure or trusted, the best first. Then by pairs that are weak or doubted where two say the same.
/// Rough poses hold what may slide: with them then by pairs that slide. Never by those that would put a scan beyond reach.
/// Returns the groups, and the outcome of each pair.
pub(crate) fn assemble(
    views: &[View],
    pairs: &[Pair],
    groups: Vec<Group>,
    limit: Limit<'_>,
    is_trusted: impl Fn(&Pair) -> bool,
) -> (Vec<Group>, Vec<Standing>) {
    let mut group_of = vec![0; views.len()];
    for (number, group) in groups.iter().enumerate() {
        group.members.iter().for_each(|member| group_of[member.0] = number);
    }
    let standings = vec![Standing::Unused; pairs.len()];
    let groups = groups.into_iter().map(Some).collect();
    let mut assembly = Assembly { views, pairs, groups, limit, group_of, standings };
    let mut doubted = doubted(views.len(), pairs);
    if limit.steps.is_none() && !limit.bound.binds() && views.len() > FEW_SCANS {
        doubted.iter_mut().zip(pairs).for_each(|(is_doubted, pair)| *is_doubted |= is_thin(views, pair));
    }
    if let Some(steps) = limit.steps {
        let is_open = |pair: &Pair| steps.is_uneven(pair) && shares_little(pair);
        doubted.iter_mut().zip(pairs).for_each(|(is_doubted, pair)| *is_doubted |= is_open(pair));
    }
    let mut order: Vec<(bool, f64, usize)> = Vec::new();
    for (k, pair) in pairs.iter().enumerate() {
        let trusted = is_trusted(pair) && !pair.modes.is_empty();
        if trusted || (pair.finding == Finding::Sure && !doubted[k]) {
            order.push((trusted, pair.modes[0].verdict.score(), k));
        }
    }
    order.sort_by(|x, y| y.0.cmp(&x.0).then(y.1.total_cmp(&x.1)).then(x.2.cmp(&y.2)));
    let mut weak: Vec<(f64, usize)> = (0..pairs.len())
        .filter(|&k| (pairs[k].finding == Finding::Weak || doubted[k]) && !is_trusted(&pairs[k]))
        .map(|k| (pairs[k].modes[0].verdict.score(), k))
        .collect();
    weak.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.cmp(&y.1)));
    let weak: Vec<usize> = weak.into_iter().map(|(_, k)| k).collect();
    if let Some(steps) = limit.steps {
        // Frames that were followed first, weak pairs as well: others fit elsewhere too where what was recorded repeats itself.
        let is_first = |k: usize| steps.is_followed(&pairs[k]);
        let first: Vec<(bool, f64, usize)> =
            order.iter().copied().filter(|&(trusted, _, k)| trusted || is_first(k)).collect();
        let first_weak: Vec<usize> = weak.iter().copied().filter(|&k| is_first(k)).collect();
        assembly.join_as_said(&first, &first_weak);
    }
    assembly.join_as_said(&order, &weak);
    for &k in &weak {
        if assembly.are_together(k) {
            assembly.join(k, false);
        }
    }
    if limit.bound.binds() {
        let mut sliding: Vec<(f64, usize)> = (0..pairs.len())
            .filter(|&k| pairs[k].finding == Finding::Slides)
            .map(|k| (pairs[k].modes[0].verdict.score(), k))
            .collect();
        sliding.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.cmp(&y.1)));
        for (_, k) in sliding {
            if !assembly.are_together(k) {
                assembly.join(k, false);
            }
        }
    }
    (assembly.groups.into_iter().flatten().collect(), assembly.standings)
}

/// Pairs that are sure of scans that fit most others in several places: what repeats itself is in one place alone by chance.
fn doubted(count: usize, pairs: &[Pair]) -> Vec<bool> {
    let mut balance = vec![0_i32; count];
    for pair in pairs {
        let by = match pair.finding {
            Finding::Sure => 1,
            Finding::Ambiguous => -1,
            _ => 0,
        };
        balance[pair.a] += by;
        balance[pair.b] += by;
    }
    let is_doubted = |pair: &Pair| pair.finding == Finding::Sure && balance[pair.a].min(balance[pair.b]) < 0;
    pairs.iter().map(is_doubted).collect()
}

/// Whether a pair of two views of a room is sure by little.
fn is_thin(views: &[View], pair: &Pair) -> bool {
    if pair.finding != Finding::Sure || ![pair.a, pair.b].iter().all(|&scan| views[scan].is_of_room()) {
        return false;
    }
    pair.modes[0].verdict.hold.balance() < HELD || shares_little(pair)
}

/// Whether a pair that is sure shares little.
fn shares_little(pair: &Pair) -> bool {
    let overlap = || pair.modes[0].verdict.overlap().into_iter();
    let is_little = || overlap().fold(1.0, f64::min) < SHARED[0] || overlap().fold(0.0, f64::max) < SHARED[1];
    pair.finding == Finding::Sure && is_little()
}

impl Assembly<'_> {
    fn group(&self, scan: usize) -> &Group {
        self.groups[self.group_of[scan]].as_ref().expect("scans are in their groups")
    }

    fn pose(&self, scan: usize) -> DAffine3 {
        self.group(scan).pose(scan).expect("scans are in their groups")
    }

    fn are_together(&self, k: usize) -> bool {
        self.group_of[self.pairs[k].a] == self.group_of[self.pairs[k].b]
    }

    /// The motion of the second scan's group to the first's by which a pair would join them.
    fn motion(&self, k: usize) -> DAffine3 {
        let Pair { a, b, modes, .. } = &self.pairs[k];
        self.pose(*a) * modes[0].a_from_b * self.pose(*b).inverse()
    }

    /// Joins by pairs that are sure or trusted, and by weak ones where two say the same.
    fn join_as_said(&mut self, order: &[(bool, f64, usize)], weak: &[usize]) {
        loop {
            self.join_all(order);
            let before = self.joined();
            while let Some(k) = self.confirmed(weak) {
                self.join(k, false);
            }
            // Pairs that waited may wait for these.
            if self.limit.steps.is_none() || self.joined() == before {
                break;
            }
            self.wait_no_more(weak);
        }
    }

    /// Joins by pairs, each with whether it is trusted, the best first. Those that wait for others again, until none joins.
    fn join_all(&mut self, order: &[(bool, f64, usize)]) {
        loop {
            let before = self.joined();
            for &(trusted, _, k) in order {
                if matches!(self.standings[k], Standing::Unused | Standing::Waits) {
                    self.join(k, trusted);
                }
            }
            if self.limit.steps.is_none() || self.joined() == before {
                return;
            }
        }
    }

    /// How many pairs have joined groups.
    fn joined(&self) -> usize {
        self.standings.iter().filter(|standing| **standing == Standing::Joins).count()
    }

    /// Lets those of the pairs that wait be tried again.
    fn wait_no_more(&mut self, pairs: &[usize]) {
        for &k in pairs {
            if self.standings[k] == Standing::Waits {
                self.standings[k] = Standing::Unused;
            }
        }
    }

    /// Joins the groups of a pair's scans, unless sensors speak against it. Says whether it agrees with what is joined.
    fn join(&mut self, k: usize, trusted: bool) {
        let Pair { a, b, ref modes, .. } = self.pairs[k];
        if self.are_together(k) {
            let both = [&self.views[a], &self.views[b]];
            let radius = both[0].reduced.radius.min(both[1].reduced.radius);
            let cell = both[0].coarse.cell.max(both[1].coarse.cell);
            let a_from_b = self.pose(a).inverse() * self.pose(b);
            let is_same = apart(&a_from_b, &modes[0].a_from_b, radius) < AGREE * cell;
            self.standings[k] = if is_same { Standing::Agrees } else { Standing::Disagrees };
            return;
        }
        let motion = self.motion(k);
        let is_followed = self.limit.steps.is_some_and(|steps| steps.is_followed(&self.pairs[k]));
        if !trusted && !is_followed && contradicts(self.views, self.group(a), self.group(b), &motion) {
            self.standings[k] = Standing::SeenThrough;
            return;
        }
        let groups = [self.group(a), self.group(b)];
        let steps = self.limit.steps.filter(|_| !trusted);
        match steps.map_or(Joins::Now, |steps| steps.joins(self.views, &self.pairs[k], groups, &motion)) {
            Joins::Now => {}
            Joins::Later => {
                self.standings[k] = Standing::Waits;
                return;
            }
            Joins::Never => {
                self.standings[k] = Standing::Disagrees;
                return;
            }
        }
        // The frame of fixed scans, which come first, stays.
        let (first, second) = (self.group_of[a], self.group_of[b]);
        let (kept, gone, motion) =
            if second < first { (second, first, motion.inverse()) } else { (first, second, motion) };
        let members = |group: usize| &self.groups[group].as_ref().expect("scans are in their groups").members;
        let moved = members(gone).iter().map(|&(scan, pose)| (scan, motion * pose));
        let joined: Vec<(usize, DAffine3)> = members(kept).iter().copied().chain(moved).collect();
        let slack = |scan: usize| AGREE * self.views[scan].coarse.cell;
        if !trusted && !self.limit.bound.allows_all(self.views, &joined, self.limit.is_fixed, slack) {
            self.standings[k] = Standing::Beyond;
            return;
        }
        self.standings[k] = Standing::Joins;
        joined.iter().for_each(|(scan, _)| self.group_of[*scan] = kept);
        self.groups[gone] = None;
        self.groups[kept] = Some(Group { members: joined });
    }

    /// The best of the weak pairs whose word is confirmed: by another one of the same two groups, or by two that lead through a third
    /// group.
    fn confirmed(&self, weak: &[usize]) -> Option<usize> {
        let is_open = |&&pair: &&usize| self.standings[pair] == Standing::Unused && !self.are_together(pair);
        let open: Vec<usize> = weak.iter().filter(is_open).copied().collect();
        // Both ways: from the second group to the first.
        let mut words: BTreeMap<[usize; 2], Vec<(usize, DAffine3)>> = BTreeMap::new();
        let mut beside: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
        for &pair in &open {
            let [a, b] = [self.pairs[pair].a, self.pairs[pair].b].map(|scan| self.group_of[scan]);
            let motion = self.motion(pair);
            words.entry([a, b]).or_default().push((pair, motion));
            words.entry([b, a]).or_default().push((pair, motion.inverse()));
            beside.entry(a).or_default().insert(b);
            beside.entry(b).or_default().insert(a);
        }
        let is_confirmed = |&pair: &usize| {
            let Pair { a, b, .. } = self.pairs[pair];
            let both = [&self.views[a], &self.views[b]];
            let radius = both[0].reduced.radius.min(both[1].reduced.radius);
            let cell = both[0].coarse.cell.max(both[1].coarse.cell);
            let (first, second) = (self.group_of[a], self.group_of[b]);
            let (at, own) = (self.pose(b), self.motion(pair));
            let is_same = |motion: &DAffine3| apart(&(own * at), &(*motion * at), radius) < AGREE * cell;
            let direct = words[&[first, second]].iter().any(|(other, motion)| *other != pair && is_same(motion));
            let through = |third: &usize| {
                let (Some(one), Some(two)) = (words.get(&[first, *third]), words.get(&[*third, second])) else {
                    return false;
                };
                one.iter().any(|(_, one)| two.iter().any(|(_, two)| is_same(&(*one * *two))))
            };
            direct || beside[&first].intersection(&beside[&second]).any(through)
        };
        open.iter().copied().find(is_confirmed)
    }
}

/// Each scan by itself, but for those that are fixed: these are one group, the first.
pub(crate) fn apart_at_first(views: &[View], is_fixed: &[bool]) -> Vec<Group> {
    let fixed: Vec<(usize, DAffine3)> =
        (0..views.len()).filter(|&k| is_fixed[k]).map(|k| (k, views[k].reduced.world_from_local())).collect();
    let mut groups = Vec::new();
    if !fixed.is_empty() {
        groups.push(Group { members: fixed });
    }
    groups.extend((0..views.len()).filter(|&k| !is_fixed[k]).map(|k| Group { members: vec![(k, DAffine3::IDENTITY)] }));
    groups
}

#[cfg(test)]
mod tests {
    use image::range_image::{Projection, RangeImage};
    use image::source::ScanSource;

    use super::*;
    use crate::arrangements_tests::frames;
    use crate::constraints::Ordered;
    use crate::judge::{Hold, Mode};
    use crate::params::AlignParams;
    use base::progress::Progress;

    const FRAMES: usize = 8;

    /// The same bowl again and again: a sensor that stands still.
    fn views() -> Vec<View> {
        let bowl = |k: usize| 0.01 * (((k / 40) as f64 - 20.0).powi(2) + ((k % 40) as f64 - 17.0).powi(2));
        let projection = Projection::Orthographic { first: [0.0; 2], step: [1.0; 2] };
        let image = RangeImage::from_values(40, 40, (0..1600).map(bowl).collect(), projection).unwrap();
        let sources = [&image as &dyn ScanSource; FRAMES];
        crate::driver::read(&sources, &Progress::none()).unwrap().0
    }

    /// Eight frames that were followed in pairs, and between these by weak ones. Then one more pair that is sure, which puts the last at a
    /// distance from the first. Where each frame lies.
    fn beside_what_was_followed(far: f64) -> Vec<Option<f64>> {
        let views = views();
        let pair = |a: usize, b: usize, finding: Finding, far: f64| {
            let a_from_b = DAffine3::from_translation(far * glam::DVec3::X);
            Pair { a, b, modes: vec![Mode { a_from_b, verdict: Verdict::default() }], finding, beyond: None }
        };
        let sure = [[0, 1], [2, 3], [4, 5], [6, 7]].map(|[a, b]| pair(a, b, Finding::Sure, 0.0));
        let weak = [[1, 2], [0, 2], [3, 4], [2, 4], [5, 6]].map(|[a, b]| pair(a, b, Finding::Weak, 0.0));
        let mut pairs: Vec<Pair> = sure.into_iter().chain(weak).collect();
        let order = Ordered { frames: (0..FRAMES).collect(), places: (0..FRAMES as u64).collect(), is_told: true };
        let steps = Steps::new(&views, &order, &pairs);
        pairs.extend([pair(0, 4, Finding::Sure, far), pair(0, 7, Finding::Sure, far)]);
        let params = AlignParams::default();
        let is_fixed = [false; FRAMES];
        let inside = crate::constraints::Constraints::default().renumbered(&params, &order.frames, &views, None);
        let limit = Limit { bound: &Bound::of(&views, &params, &inside), steps: Some(&steps), is_fixed: &is_fixed };
        let (groups, _) = assemble(&views, &pairs, apart_at_first(&views, &is_fixed), limit, |_| false);
        let first = groups.iter().find(|group| group.pose(0).is_some()).expect("it has a group");
        (0..FRAMES).map(|k| first.pose(k).map(|pose| pose.translation.x)).collect()
    }

    /// Theorem: frames that were followed lie where that says, though a pair that is sure puts them elsewhere. So equal doors of a corridor
    /// turn no step back.
    #[test]
    fn frames_that_were_followed_come_first() {
        let near = 0.05 * views()[0].reduced.radius;
        assert_eq!(beside_what_was_followed(near)[..6], [Some(0.0); 6]);
    }

    /// Theorem: a pair joins no pieces between which the sensor would have moved much further than from frame to frame elsewhere.
    #[test]
    fn the_sensor_does_not_leap() {
        let radius = views()[0].reduced.radius;
        let places = |share: f64| beside_what_was_followed(share * radius)[6..].to_vec();
        assert_eq!(places(0.05), [Some(0.05 * radius); 2]);
        assert_eq!(places(0.2), [None; 2]);
    }

    /// A piece of a recording that waits for one between is joined once that has its place by pairs that are weak.
    #[test]
    fn what_waits_is_tried_again_after_weak_pairs_joined() {
        let views = views();
        let pair = |a: usize, b: usize, finding: Finding| {
            let mode = Mode { a_from_b: DAffine3::IDENTITY, verdict: Verdict::default() };
            Pair { a, b, modes: vec![mode], finding, beyond: None }
        };
        let sure = [[0, 1], [2, 3], [3, 4], [4, 5], [6, 7]].map(|[a, b]| pair(a, b, Finding::Sure));
        let weak = [[1, 2], [0, 2]].map(|[a, b]| pair(a, b, Finding::Weak));
        let followed: Vec<Pair> = sure.into_iter().chain(weak).collect();
        let order = Ordered { frames: (0..FRAMES).collect(), places: (0..FRAMES as u64).collect(), is_told: true };
        let steps = Steps::new(&views, &order, &followed);
        let mut pairs = followed;
        pairs.push(pair(1, 6, Finding::Sure));
        let params = AlignParams::default();
        let is_fixed = [false; FRAMES];
        let inside = crate::constraints::Constraints::default().renumbered(&params, &order.frames, &views, None);
        let limit = Limit { bound: &Bound::of(&views, &params, &inside), steps: Some(&steps), is_fixed: &is_fixed };
        let (groups, standings) = assemble(&views, &pairs, apart_at_first(&views, &is_fixed), limit, |_| false);
        assert_eq!(groups.len(), 1, "{standings:?}");
        assert_eq!(standings.last(), Some(&Standing::Joins));
    }

    /// Of many frames of a room, pairs that are sure by little join nothing but where another one says the same.
    #[test]
    fn of_many_frames_of_a_room_little_joins_nothing_by_itself() {
        let frame = frames(1).remove(0);
        let groups = |count: usize, joined: &[[usize; 2]], overlap: [f64; 2], balance: f64| {
            let views = crate::driver::read(&vec![&frame as &dyn ScanSource; count], &Progress::none()).unwrap().0;
            let pair = |&[a, b]: &[usize; 2]| {
                let mut hold = Hold::default();
                hold.values[0] = balance;
                let verdict = Verdict { on: overlap, total: [1.0; 2], hold, ..Verdict::default() };
                let modes = vec![Mode { a_from_b: DAffine3::IDENTITY, verdict }];
                Pair { a, b, modes, finding: Finding::Sure, beyond: None }
            };
            let pairs: Vec<Pair> = joined.iter().map(pair).collect();
            let (params, order) = (AlignParams::default(), (0..count).collect::<Vec<_>>());
            let is_fixed = vec![false; count];
            let inside = crate::constraints::Constraints::default().renumbered(&params, &order, &views, None);
            let limit = Limit { bound: &Bound::of(&views, &params, &inside), steps: None, is_fixed: &is_fixed };
            assemble(&views, &pairs, apart_at_first(&views, &is_fixed), limit, |_| false).0.len()
        };
        let (much, little) = ([0.5; 2], [0.15, 0.5]);
        assert_eq!(groups(FEW_SCANS + 1, &[[0, 1]], much, 0.1), FEW_SCANS);
        for (overlap, balance) in [(little, 0.1), ([0.3; 2], 0.1), (much, 0.005)] {
            assert_eq!(groups(FEW_SCANS, &[[0, 1]], overlap, balance), FEW_SCANS - 1);
            assert_eq!(groups(FEW_SCANS + 1, &[[0, 1]], overlap, balance), FEW_SCANS + 1, "{overlap:?} {balance}");
            assert_eq!(groups(FEW_SCANS + 1, &[[0, 1], [0, 2], [1, 2]], overlap, balance), FEW_SCANS - 1);
        }
    }
}
