//! Heaps of frames of rooms that repeat themselves: few frames that hold together, while most of the heap fits none of them, or pairs that
//! fit as well and put frames elsewhere.
//!
//! Equal desks, doors and flights of stairs fold onto each other, and pairs of frames that show them are sure of one place, the wrong one.
//! No pair tells that, and what would tell is left out of the group.

use crate::assemble::{FEW_SCANS, Standing};
use crate::constraints::Inside;
use crate::finding::Finding;
use crate::group::Group;
use crate::pair::Pair;
use crate::view::View;

/// Groups of up to five frames are in doubt if they are no more than one of so many of the heap's, and no group is larger. Of 44 heaps of rooms
/// that do not repeat themselves eight had no larger group, all of them right. Of 36 that do, 22 had none, and 14 of these were wrong.
const ONE_OF: usize = 3;
/// A room repeats itself if one of so many pairs that hold, or more, is refused beside these.
const REFUSED: usize = 20;
/// Frames of another room that looks alike are refused as well. So many of which more pairs are refused than hold count for nothing.
const STRANGE: usize = 2;
/// Of fewer scans two strange ones that join a group are refused as much as a room that repeats itself. Measured were heaps of 12 to 20.
const MANY_SCANS: usize = 12;

/// Why scans that fit others have no place all the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Doubt {
    /// They are few of the heap.
    Few,
    /// Pairs that fit as well put scans of the heap elsewhere.
    Repeats,
}

/// Scans that are in doubt, and why.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Doubted {
    pub scans: Vec<usize>,
    pub why: Option<Doubt>,
}

/// Takes the groups of a heap of a room apart if all of them are few or the room repeats itself, and says which scans they were of. Their
/// pairs are not used. Groups stay where the caller says of a scan of them where it belongs.
pub(crate) fn take_out(
    views: &[View],
    inside: &Inside,
    pairs: &[Pair],
    groups: &mut Vec<Group>,
    standings: &mut [Standing],
) -> Doubted {
    let is_told = |scan: usize| {
        let told = inside.trusted.iter().chain(inside.picks.iter().map(|pick| &pick.scans));
        inside.is_fixed[scan] || told.into_iter().any(|pair| pair.contains(&scan))
    };
    let scans = views.iter().filter(|view| view.reduced.area > 0.0);
    let (count, of_room) =
        scans.fold((0, 0), |(count, of_room), view| (count + 1, of_room + usize::from(view.is_of_room())));
    if count <= FEW_SCANS || 2 * of_room < count {
        return Doubted::default();
    }
    let is_few = |group: &Group| group.members.len() <= FEW_SCANS && ONE_OF * group.members.len() <= count;
    let joined = || groups.iter().filter(|group| group.members.len() > 1);
    if joined().flat_map(|group| &group.members).any(|member| is_told(member.0)) {
        return Doubted::default();
    }
    let why = match joined().all(is_few) {
        true => Doubt::Few,
        false if count >= MANY_SCANS && repeats(pairs, standings) => Doubt::Repeats,
        false => return Doubted::default(),
    };
    let mut out: Vec<usize> = joined().flat_map(|group| group.members.iter().map(|member| member.0)).collect();
    out.sort_unstable();
    for (pair, standing) in pairs.iter().zip(standings) {
        if out.contains(&pair.a) || out.contains(&pair.b) {
            *standing = Standing::Unused;
        }
    }
    let members = std::mem::take(groups).into_iter().flat_map(|group| group.members);
    *groups = members.map(|member| Group { members: vec![member] }).collect();
    Doubted { scans: out, why: Some(why) }
}

/// Whether pairs that fit put scans elsewhere than the groups do, other than those of few strange scans.
fn repeats(pairs: &[Pair], standings: &[Standing]) -> bool {
    let all = || pairs.iter().zip(standings);
    let is_held = |standing: &Standing| matches!(standing, Standing::Joins | Standing::Agrees);
    let held: Vec<&Pair> = all().filter(|(_, standing)| is_held(standing)).map(|(pair, _)| pair).collect();
    let is_refused = |(pair, standing): &(&Pair, &Standing)| {
        matches!(pair.finding, Finding::Sure | Finding::Weak)
            && matches!(standing, Standing::SeenThrough | Standing::Disagrees)
    };
    let mut refused: Vec<&Pair> = all().filter(is_refused).map(|(pair, _)| pair).collect();
    for _ in 0..STRANGE {
        let of = |pairs: &[&Pair], scan: usize| pairs.iter().filter(|pair| pair.a == scan || pair.b == scan).count();
        let scans = refused.iter().flat_map(|pair| [pair.a, pair.b]);
        let strange = scans.map(|scan| (of(&refused, scan), scan)).filter(|&(count, scan)| count > of(&held, scan));
        let Some((_, worst)) = strange.max_by(|x, y| x.0.cmp(&y.0).then(y.1.cmp(&x.1))) else { break };
        refused.retain(|pair| pair.a != worst && pair.b != worst);
    }
    !refused.is_empty() && REFUSED * refused.len() >= held.len()
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;
    use image::source::ScanSource;

    use super::*;
    use crate::arrangements_tests::frames;
    use crate::constraints::Constraints;
    use crate::finding::Finding;
    use crate::judge::{Mode, Verdict};
    use crate::params::AlignParams;
    use base::progress::Progress;

    /// The same frame again and again.
    fn heap(count: usize) -> Vec<View> {
        let frame = frames(1).remove(0);
        crate::driver::read(&vec![&frame as &dyn ScanSource; count], &Progress::none()).unwrap().0
    }

    fn pair(a: usize, b: usize) -> Pair {
        let modes = vec![Mode { a_from_b: DAffine3::IDENTITY, verdict: Verdict::default() }];
        Pair { a, b, modes, finding: Finding::Sure, beyond: None }
    }

    /// Scans that are taken out of a heap with groups of the first ones, of these sizes. Pairs of scans that follow each other join them, and
    /// the `refused` pairs say something else.
    fn taken_out(views: &[View], sizes: &[usize], refused: &[[usize; 2]], constraints: &Constraints) -> Doubted {
        let count = views.len();
        let order: Vec<usize> = (0..count).collect();
        let inside = constraints.renumbered(&AlignParams::default(), &order, views, None);
        let member = |scan: usize| (scan, DAffine3::IDENTITY);
        let (mut groups, mut pairs) = (Vec::new(), Vec::new());
        let mut first = 0;
        for size in sizes.iter().copied().chain(vec![1; count - sizes.iter().sum::<usize>()]) {
            groups.push(Group { members: (first..first + size).map(member).collect() });
            pairs.extend((first..first + size - 1).map(|a| pair(a, a + 1)));
            first += size;
        }
        let mut standings = vec![Standing::Joins; pairs.len()];
        pairs.extend(refused.iter().map(|&[a, b]| pair(a, b)));
        standings.resize(pairs.len(), Standing::SeenThrough);
        let before = standings.clone();
        let out = take_out(views, &inside, &pairs, &mut groups, &mut standings);
        assert_eq!(groups[0].members.len(), if out.scans.is_empty() { sizes[0] } else { 1 });
        assert_eq!(groups.iter().flat_map(|group| &group.members).count(), count);
        for ((pair, standing), before) in pairs.iter().zip(&standings).zip(before) {
            let is_out = out.scans.contains(&pair.a) || out.scans.contains(&pair.b);
            assert_eq!(*standing, if is_out { Standing::Unused } else { before });
        }
        out
    }

    #[test]
    fn few_of_many_are_in_doubt() {
        let (views, nothing) = (heap(18), Constraints::default());
        let out =
            |count: usize, joined: usize, constraints| taken_out(&views[..count], &[joined], &[], constraints).scans;
        assert_eq!(out(8, 3, &nothing), []);
        assert_eq!(out(9, 3, &nothing), [0, 1, 2]);
        assert_eq!(out(15, 5, &nothing), [0, 1, 2, 3, 4]);
        // Six say enough.
        assert_eq!(out(18, 6, &nothing), []);
        // Of five scans and fewer each is much.
        assert_eq!(out(5, 2, &nothing), []);
        let fixed = Constraints { fixed: vec![1], ..Constraints::default() };
        let trusted = Constraints { trusted: vec![[0, 1]], ..Constraints::default() };
        assert_eq!((out(9, 3, &fixed), out(9, 3, &trusted)), (vec![], vec![]));
    }

    #[test]
    fn of_a_room_that_repeats_itself_all_are_in_doubt() {
        let (views, nothing) = (heap(30), Constraints::default());
        let why = |sizes: &[usize], refused: &[[usize; 2]]| taken_out(&views, sizes, refused, &nothing).why;
        assert_eq!(why(&[8], &[]), None);
        // Scans of a group that say something else, and three that hold together.
        assert_eq!(why(&[8], &[[0, 5]]), Some(Doubt::Repeats));
        assert_eq!(why(&[8, 3], &[[0, 9]]), Some(Doubt::Repeats));
        // Of strange scans, by themselves or in a group, more pairs are refused than hold. Of two they count for nothing.
        assert_eq!(why(&[8], &[[0, 9], [1, 9], [2, 10]]), None);
        assert_eq!(why(&[8], &[[1, 7], [3, 7], [4, 9]]), None);
        assert_eq!(why(&[8], &[[0, 9], [1, 10], [2, 11]]), Some(Doubt::Repeats));
        // One of 20 that hold says something, and one of more says nothing yet.
        assert_eq!(why(&[21], &[[0, 5]]), Some(Doubt::Repeats));
        assert_eq!(why(&[22], &[[0, 5]]), None);
        let of = |count: usize| taken_out(&views[..count], &[8], &[[0, 5]], &nothing).why;
        assert_eq!((of(MANY_SCANS - 1), of(MANY_SCANS)), (None, Some(Doubt::Repeats)));
        let out = taken_out(&views, &[8, 3], &[[0, 9]], &nothing);
        assert_eq!(out.scans, (0..11).collect::<Vec<_>>());
        let trusted = Constraints { trusted: vec![[0, 1]], ..Constraints::default() };
        assert_eq!(taken_out(&views, &[8, 3], &[[0, 9]], &trusted), Doubted::default());
    }
}
