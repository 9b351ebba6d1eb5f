//! Heaps of frames of rooms that repeat themselves: few frames that hold together, while most of the heap fits none of them.
//!
//! Equal desks, doors and flights of stairs fold onto each other, and pairs of frames that show them are sure of one place, the wrong one.
//! No pair tells that, and what would tell is left out of the group.

use crate::assemble::{FEW_SCANS, Standing};
use crate::constraints::Inside;
use crate::group::Group;
use crate::pair::Pair;
use crate::view::View;

/// Groups of up to five frames are in doubt if they are no more than one of so many of the heap's, and no group is larger. Of 44 heaps of rooms
/// that do not repeat themselves eight had no larger group, all of them right. Of 36 that do, 22 had none, and 14 of these were wrong.
const ONE_OF: usize = 3;

/// Takes the groups of a heap of a room apart if all of them are few, and says which scans they were of. Their pairs are not used. Groups stay
/// where the caller says of a scan of them where it belongs.
pub(crate) fn take_out(
    views: &[View],
    inside: &Inside,
    pairs: &[Pair],
    groups: &mut Vec<Group>,
    standings: &mut [Standing],
) -> Vec<usize> {
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
    let is_few = |group: &Group| {
        let members = &group.members;
        members.len() <= FEW_SCANS && ONE_OF * members.len() <= count && members.iter().all(|member| !is_told(member.0))
    };
    let joined = || groups.iter().filter(|group| group.members.len() > 1);
    if !joined().all(is_few) {
        return Vec::new();
    }
    let mut out: Vec<usize> = joined().flat_map(|group| group.members.iter().map(|member| member.0)).collect();
    out.sort_unstable();
    for (pair, standing) in pairs.iter().zip(standings) {
        if out.contains(&pair.a) || out.contains(&pair.b) {
            *standing = Standing::Unused;
        }
    }
    let members = std::mem::take(groups).into_iter().flat_map(|group| group.members);
    *groups = members.map(|member| Group { members: vec![member] }).collect();
    out
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

    /// Scans that are taken out of a heap of so many frames, of which pairs join a group of the first `joined`.
    fn taken_out(count: usize, joined: usize, constraints: &Constraints) -> Vec<usize> {
        let frame = frames(1).remove(0);
        let views = crate::read(&vec![&frame as &dyn ScanSource; count], &Progress::none()).unwrap().0;
        let order: Vec<usize> = (0..count).collect();
        let inside = constraints.renumbered(&AlignParams::default(), &order, &views, None);
        let pair = |a: usize| {
            let modes = vec![Mode { a_from_b: DAffine3::IDENTITY, verdict: Verdict::default() }];
            Pair { a, b: a + 1, modes, finding: Finding::Sure, beyond: None }
        };
        let pairs: Vec<Pair> = (0..joined - 1).map(pair).collect();
        let mut standings = vec![Standing::Joins; pairs.len()];
        let member = |scan: usize| (scan, DAffine3::IDENTITY);
        let mut groups = vec![Group { members: (0..joined).map(member).collect() }];
        groups.extend((joined..count).map(|scan| Group { members: vec![member(scan)] }));
        let out = take_out(&views, &inside, &pairs, &mut groups, &mut standings);
        let (size, standing) = if out.is_empty() { (joined, Standing::Joins) } else { (1, Standing::Unused) };
        assert_eq!(groups[0].members.len(), size);
        assert_eq!(groups.iter().flat_map(|group| &group.members).count(), count);
        assert!(standings.iter().all(|found| *found == standing));
        out
    }

    #[test]
    fn few_of_many_are_in_doubt() {
        let nothing = Constraints::default();
        assert_eq!(taken_out(8, 3, &nothing), []);
        assert_eq!(taken_out(9, 3, &nothing), [0, 1, 2]);
        assert_eq!(taken_out(15, 5, &nothing), [0, 1, 2, 3, 4]);
        // Six say enough.
        assert_eq!(taken_out(18, 6, &nothing), []);
        // Of five scans and fewer each is much.
        assert_eq!(taken_out(5, 2, &nothing), []);
        let fixed = Constraints { fixed: vec![1], ..Constraints::default() };
        let trusted = Constraints { trusted: vec![[0, 1]], ..Constraints::default() };
        assert_eq!((taken_out(9, 3, &fixed), taken_out(9, 3, &trusted)), (vec![], vec![]));
    }
}
