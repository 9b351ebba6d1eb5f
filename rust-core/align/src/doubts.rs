//! Heaps of frames of rooms that repeat themselves: what holds together there, but is spoken against by the heap as a whole.
//!
//! Equal desks, doors and flights of stairs fold onto each other, and pairs of frames that show them are sure of one place, the wrong one.
//! No pair tells that. Other pairs do, which are as sure of another place and are refused, and the frames that fit nothing.

use std::collections::BTreeMap;

use crate::assemble::{FEW_SCANS, Standing};
use crate::constraints::Inside;
use crate::finding::{Finding, RIVAL};
use crate::group::Group;
use crate::pair::Pair;
use crate::view::View;

/// Reason why frames that fit each other are not taken for placed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Doubt {
    /// Pairs that are as sure put them elsewhere.
    Elsewhere,
    /// They are few, and most frames of the heap fit none of them.
    Few,
}

/// Frames that fit each other, and why they are not taken for placed.
#[derive(Clone, Debug)]
pub(crate) struct Doubted {
    pub scans: Vec<usize>,
    pub doubt: Doubt,
}

/// A group is in doubt if what is refused of pairs that are sure is more than this share of what holds it. Of 44 heaps of rooms that do not
/// repeat themselves four had any, at most 0.17. Of three heaps that had folded it was 0.24, 0.31 and 1.5.
const REFUSED: f64 = 0.22;
/// So are all if that is more than one of so many of the frames that are joined: the room repeats itself.
///
/// Groups of up to five frames are in doubt if they are no more than one of so many of the heap's, and no group is larger. Of 44 heaps of rooms
/// that do not repeat themselves eight had no larger group, all of them right. Of 36 that do, 22 had none, and 14 of these were wrong.
const ONE_OF: usize = 3;

/// Takes frames that are in doubt out of the groups of a heap of a room, each into a group of its own: groups with too much against them, then
/// frames that pairs as sure put elsewhere, then groups that are few. Their pairs are not used. Scans of which the caller says where they
/// belong stay, with their groups.
pub(crate) fn take_out(
    views: &[View],
    inside: &Inside,
    pairs: &[Pair],
    groups: &mut Vec<Group>,
    standings: &mut [Standing],
) -> Vec<Doubted> {
    let is_told = |scan: usize| {
        let told = inside.trusted.iter().chain(inside.picks.iter().map(|pick| &pick.scans));
        inside.is_fixed[scan] || told.into_iter().any(|pair| pair.contains(&scan))
    };
    let scans = views.iter().filter(|view| view.reduced.area > 0.0);
    let (count, of_room) =
        scans.fold((0, 0), |(count, of_room), view| (count + 1, of_room + usize::from(view.is_of_room())));
    if count <= FEW_SCANS || 2 * of_room < count {
        return Vec::new();
    }
    let is_open = |scan: usize| !is_told(scan);
    let mut heap = Heap { pairs, standings, group_of: vec![0; views.len()] };
    let mut parts: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (number, group) in groups.iter().enumerate().filter(|(_, group)| group.members.len() > 1) {
        let mut scans: Vec<usize> = group.members.iter().map(|member| member.0).collect();
        scans.sort_unstable();
        scans.iter().for_each(|&scan| heap.group_of[scan] = number + 1);
        parts.insert(number + 1, scans);
    }
    let mut doubted: Vec<Doubted> = Vec::new();
    let is_all_open = |scans: &[usize]| scans.iter().all(|&scan| is_open(scan));
    // Before any frame is taken out: a frame that is refused speaks against the others as well.
    let against = |(_, scans): &(&usize, &Vec<usize>)| is_all_open(scans) && heap.is_refused(scans);
    let mut against: Vec<usize> = parts.iter().filter(against).map(|(&number, _)| number).collect();
    let refused: usize = against.iter().map(|number| parts[number].len()).sum();
    if ONE_OF * refused > parts.values().map(Vec::len).sum() {
        against = parts.iter().filter(|(_, scans)| is_all_open(scans)).map(|(&number, _)| number).collect();
    }
    for number in against {
        let scans = parts.remove(&number).expect("it is one of the parts");
        heap.let_go(&scans);
        doubted.push(Doubted { scans, doubt: Doubt::Elsewhere });
    }
    for scans in parts.values_mut() {
        while let Some(side) = heap.elsewhere(scans, &is_open) {
            scans.retain(|scan| !side.contains(scan));
            heap.let_go(&side);
            doubted.push(Doubted { scans: side, doubt: Doubt::Elsewhere });
        }
    }
    let is_few = |scans: &Vec<usize>| scans.len() <= FEW_SCANS && ONE_OF * scans.len() <= count;
    if parts.values().all(|scans| is_few(scans) && is_all_open(scans)) {
        for (_, scans) in std::mem::take(&mut parts).into_iter().filter(|(_, scans)| scans.len() > 1) {
            heap.let_go(&scans);
            doubted.push(Doubted { scans, doubt: Doubt::Few });
        }
    }
    let mut alone = Vec::new();
    for (number, group) in groups.iter_mut().enumerate() {
        let kept = parts.get(&(number + 1));
        if group.members.len() > 1 {
            let (stay, out) =
                group.members.iter().copied().partition(|(scan, _)| kept.is_some_and(|kept| kept.contains(scan)));
            group.members = stay;
            alone.extend(out.into_iter().map(|member: (usize, glam::DAffine3)| Group { members: vec![member] }));
        }
    }
    groups.retain(|group| !group.members.is_empty());
    groups.extend(alone);
    doubted
}

struct Heap<'a> {
    pairs: &'a [Pair],
    standings: &'a mut [Standing],
    /// The number of the group of each scan, 0 for scans by themselves.
    group_of: Vec<usize>,
}

impl Heap<'_> {
    /// Pairs that hold groups together, each with what it says.
    fn holding(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        self.with(|pair, standing| {
            matches!(pair.finding, Finding::Sure | Finding::Weak)
                && matches!(standing, Standing::Joins | Standing::Agrees)
        })
    }

    /// Pairs that are sure and say something else.
    fn refused(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        self.with(|pair, standing| {
            pair.finding == Finding::Sure && matches!(standing, Standing::SeenThrough | Standing::Disagrees)
        })
    }

    fn with(&self, is_one: impl Fn(&Pair, Standing) -> bool) -> impl Iterator<Item = (usize, usize, f64)> {
        let both = self.pairs.iter().zip(self.standings.iter());
        both.filter(move |(pair, standing)| is_one(pair, **standing))
            .map(|(pair, _)| (pair.a, pair.b, pair.modes[0].verdict.score().max(0.0)))
    }

    /// Whether so much is refused of what pairs of a group say that it may have folded.
    fn is_refused(&self, scans: &[usize]) -> bool {
        let of_group = |scan: usize| scans.contains(&scan);
        let held: f64 =
            self.holding().filter(|(a, b, _)| of_group(*a) && of_group(*b)).map(|(_, _, score)| score).sum();
        let refused: f64 =
            self.refused().filter(|(a, b, _)| of_group(*a) || of_group(*b)).map(|(_, _, score)| score).sum();
        refused > REFUSED * held
    }

    /// Scans of a group that pairs put elsewhere which say nearly as much as those that hold them to the rest: one scan, or those on the smaller
    /// side of a pair that alone joins both sides. A scan that is in no group says nothing here: it may be of another room.
    fn elsewhere(&self, scans: &[usize], is_open: impl Fn(usize) -> bool) -> Option<Vec<usize>> {
        let ones = scans.iter().map(|&scan| vec![scan]);
        let sides: Vec<Vec<usize>> = ones.chain(self.sides(scans)).collect();
        let mut worst: Option<(f64, Vec<usize>)> = None;
        for side in sides.into_iter().filter(|side| side.iter().all(|&scan| is_open(scan))) {
            let parts = |a: usize, b: usize| side.contains(&a) != side.contains(&b);
            let held = self.holding().filter(|(a, b, _)| parts(*a, *b)).map(|(_, _, score)| score).sum::<f64>();
            let is_told = |a: usize, b: usize| self.group_of[a] > 0 && self.group_of[b] > 0;
            let refused = self.refused().filter(|(a, b, _)| parts(*a, *b) && is_told(*a, *b));
            let share = refused.map(|(_, _, score)| score).sum::<f64>() / held.max(f64::MIN_POSITIVE);
            if share > RIVAL && worst.as_ref().is_none_or(|(most, _)| share > *most) {
                worst = Some((share, side));
            }
        }
        worst.map(|(_, side)| side)
    }

    /// The smaller sides of pairs without which a group falls in two.
    fn sides(&self, scans: &[usize]) -> Vec<Vec<usize>> {
        let held: Vec<(usize, usize)> =
            self.holding().map(|(a, b, _)| (a, b)).filter(|(a, b)| scans.contains(a) && scans.contains(b)).collect();
        let mut sides = Vec::new();
        for &without in &held {
            let mut side = vec![without.0];
            let mut looked = 0;
            while let Some(&scan) = side.get(looked) {
                looked += 1;
                for &(a, b) in held.iter().filter(|pair| **pair != without) {
                    let next = if a == scan {
                        b
                    } else if b == scan {
                        a
                    } else {
                        continue;
                    };
                    if !side.contains(&next) {
                        side.push(next);
                    }
                }
            }
            if side.len() == scans.len() {
                continue;
            }
            side.sort_unstable();
            let other: Vec<usize> = scans.iter().copied().filter(|scan| !side.contains(scan)).collect();
            // Ties: the side of the largest scan stays.
            let is_smaller = (side.len(), other[0]) < (other.len(), side[0]);
            sides.push(if is_smaller { side } else { other });
        }
        sides
    }

    /// Pairs that hold scans to others are not used.
    fn let_go(&mut self, scans: &[usize]) {
        for (pair, standing) in self.pairs.iter().zip(self.standings.iter_mut()) {
            if scans.contains(&pair.a) || scans.contains(&pair.b) {
                *standing = Standing::Unused;
            }
        }
        scans.iter().for_each(|&scan| self.group_of[scan] = 0);
    }
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;
    use image::source::ScanSource;

    use super::*;
    use crate::arrangements_tests::frames;
    use crate::constraints::Constraints;
    use crate::judge::{Mode, Verdict};
    use crate::params::AlignParams;
    use base::progress::Progress;

    const HELD: Standing = Standing::Joins;
    const REFUSED: Standing = Standing::SeenThrough;

    /// Groups that are left of `groups` in a heap of so many frames, scans by themselves left out, and what is in doubt; checks that pairs of
    /// scans that were taken out are not used.
    fn taken_out(
        count: usize,
        groups: &[&[usize]],
        pairs: &[(usize, usize, f64, Standing)],
        constraints: &Constraints,
    ) -> (Vec<Vec<usize>>, Vec<(Vec<usize>, Doubt)>) {
        let frame = frames(1).remove(0);
        let views = crate::driver::read(&vec![&frame as &dyn ScanSource; count], &Progress::none()).unwrap().0;
        let order: Vec<usize> = (0..count).collect();
        let inside = constraints.renumbered(&AlignParams::default(), &order, &views, None);
        let mut standings: Vec<Standing> = pairs.iter().map(|pair| pair.3).collect();
        let of = |&(a, b, score, _): &(usize, usize, f64, Standing)| {
            let verdict = Verdict { on: [0.5 * score; 2], total: [1.0; 2], ..Verdict::default() };
            let modes = vec![Mode { a_from_b: DAffine3::IDENTITY, verdict }];
            Pair { a, b, modes, finding: Finding::Sure, beyond: None }
        };
        let pairs: Vec<Pair> = pairs.iter().map(of).collect();
        let is_in = |scan: usize| groups.iter().any(|group| group.contains(&scan));
        let single = (0..count).filter(|&scan| !is_in(scan)).map(|scan| vec![scan]);
        let all = groups.iter().map(|group| group.to_vec()).chain(single);
        let member = |scan: usize| (scan, DAffine3::IDENTITY);
        let mut groups: Vec<Group> =
            all.map(|scans| Group { members: scans.into_iter().map(member).collect() }).collect();
        let doubted = take_out(&views, &inside, &pairs, &mut groups, &mut standings);
        let scans = |group: &Group| group.members.iter().map(|member| member.0).collect::<Vec<usize>>();
        let mut all: Vec<usize> = groups.iter().flat_map(scans).collect();
        all.sort_unstable();
        assert_eq!(all, order);
        let is_out = |scan: &usize| doubted.iter().any(|doubted| doubted.scans.contains(scan));
        let out = pairs.iter().zip(&standings).filter(|(pair, _)| is_out(&pair.a) || is_out(&pair.b));
        assert!(out.into_iter().all(|(_, standing)| *standing == Standing::Unused));
        let left = groups.iter().map(scans).filter(|scans| scans.len() > 1).collect();
        (left, doubted.into_iter().map(|doubted| (doubted.scans, doubted.doubt)).collect())
    }

    /// Two groups, the second held well.
    const TWO: [&[usize]; 2] = [&[0, 1, 2, 3, 4, 5], &[6, 7, 8]];
    const HOLDING: [(usize, usize, f64, Standing); 6] = [
        (0, 1, 3.0, HELD),
        (0, 2, 3.0, HELD),
        (1, 2, 3.0, HELD),
        (2, 3, 3.0, HELD),
        (6, 7, 3.0, HELD),
        (7, 8, 3.0, HELD),
    ];

    fn two(pairs: &[(usize, usize, f64, Standing)], told: &Constraints) -> (Vec<Vec<usize>>, Vec<(Vec<usize>, Doubt)>) {
        taken_out(9, &TWO, &[&HOLDING, pairs].concat(), told)
    }

    #[test]
    fn a_frame_that_a_pair_puts_elsewhere_is_in_doubt() {
        let nothing = Constraints::default();
        let pairs = |refused: f64| [(3, 4, 3.0, HELD), (4, 5, 1.0, HELD), (5, 6, refused, REFUSED)];
        let all = TWO.map(<[usize]>::to_vec).to_vec();
        assert_eq!(two(&pairs(0.3), &nothing), (all.clone(), vec![]));
        let rest = vec![vec![0, 1, 2, 3, 4], vec![6, 7, 8]];
        assert_eq!(two(&pairs(0.5), &nothing), (rest, vec![(vec![5], Doubt::Elsewhere)]));
        let fixed = Constraints { fixed: vec![5], ..Constraints::default() };
        assert_eq!(two(&pairs(0.5), &fixed), (all.clone(), vec![]));
        // A frame that fits nothing else may be of another room.
        let strange = [(3, 4, 3.0, HELD), (4, 5, 1.0, HELD), (5, 9, 0.5, REFUSED)];
        let (groups, doubted) = taken_out(10, &TWO, &[&HOLDING[..], &strange].concat(), &nothing);
        assert_eq!((groups, doubted), (all, vec![]));
    }

    #[test]
    fn so_are_those_beyond_a_pair_that_alone_joins_them() {
        let pairs = [(3, 4, 1.0, HELD), (4, 5, 3.0, HELD), (5, 6, 0.5, REFUSED)];
        let (groups, doubted) = two(&pairs, &Constraints::default());
        assert_eq!((groups, doubted), (vec![vec![0, 1, 2, 3], vec![6, 7, 8]], vec![(vec![4, 5], Doubt::Elsewhere)]));
    }

    #[test]
    fn a_group_of_which_much_is_refused_is_in_doubt() {
        let pairs = |refused: f64| [(3, 4, 3.0, HELD), (3, 5, 5.0, HELD), (4, 5, 5.0, HELD), (2, 9, refused, REFUSED)];
        let groups =
            |refused: f64, told: &Constraints| taken_out(10, &TWO, &[&HOLDING[..], &pairs(refused)].concat(), told);
        let (all, nothing) = (TWO.map(<[usize]>::to_vec).to_vec(), Constraints::default());
        assert_eq!(groups(5.0, &nothing), (all.clone(), vec![]));
        let doubted = vec![(TWO[0].to_vec(), Doubt::Elsewhere)];
        // Most of what is joined is refused, so that the rest is in doubt as well.
        assert_eq!(groups(6.0, &nothing), (vec![], [doubted, vec![(TWO[1].to_vec(), Doubt::Elsewhere)]].concat()));
        let other = [&HOLDING[..], &pairs(0.0)[..3], &[(8, 9, 2.0, REFUSED)]].concat();
        let left = (vec![TWO[0].to_vec()], vec![(TWO[1].to_vec(), Doubt::Elsewhere)]);
        assert_eq!(taken_out(10, &TWO, &other, &nothing), left);
        let trusted = Constraints { trusted: vec![[0, 1]], ..Constraints::default() };
        assert_eq!(groups(6.0, &trusted), (all, vec![]));
    }

    #[test]
    fn few_of_many_are_in_doubt() {
        let (pairs, nothing) = ([(0, 1, 3.0, HELD), (1, 2, 3.0, HELD)], Constraints::default());
        let three: Vec<usize> = vec![0, 1, 2];
        assert_eq!(taken_out(8, &[&three], &pairs, &nothing), (vec![three.clone()], vec![]));
        assert_eq!(taken_out(9, &[&three], &pairs, &nothing), (vec![], vec![(three.clone(), Doubt::Few)]));
        let fixed = Constraints { fixed: vec![1], ..Constraints::default() };
        assert_eq!(taken_out(9, &[&three], &pairs, &fixed), (vec![three.clone()], vec![]));
        // Of five scans and fewer each is much.
        let two: Vec<usize> = vec![0, 1];
        assert_eq!(taken_out(5, &[&two], &pairs[..1], &nothing), (vec![two], vec![]));
    }
}
