//! From pairs to groups: the surest pairs first, and no join that any sensor speaks against \[HH03\].

use glam::DAffine3;

use crate::finding::Finding;
use crate::judge::glance;
use crate::linear::apart;
use crate::pair::Pair;
use crate::view::View;

/// Scans that lie in one frame: their numbers and poses in it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Group {
    pub members: Vec<(usize, DAffine3)>,
}

impl Group {
    pub fn pose(&self, scan: usize) -> Option<DAffine3> {
        self.members.iter().find(|member| member.0 == scan).map(|member| member.1)
    }
}

/// What became of a pair.
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
    /// It was not sure.
    Unused,
}

/// Samples of a scan for a look at a join.
const SAMPLES: usize = 150;
/// A join is refused if so much of a scan is seen through, and so much of what can be told speaks against it.
const THROUGH: [f64; 2] = [0.08, 0.3];
/// Pairs agree if they put a scan within so many coarse cells of the same place.
const AGREE: f64 = 3.0;

/// Whether scans of two groups, the second moved, see through each other.
fn contradicts(views: &[View], first: &Group, second: &Group, motion: &DAffine3) -> bool {
    first.members.iter().any(|&(i, pose_i)| {
        second.members.iter().any(|&(j, pose_j)| {
            let i_from_j = pose_i.inverse() * *motion * pose_j;
            let both = [&views[i], &views[j]];
            if i_from_j.translation.length() > both[0].reduced.radius + both[1].reduced.radius {
                return false;
            }
            let samples = both.map(|view| view.coarse.spread(SAMPLES));
            let tolerance = 2.0 * both[0].coarse.cell.max(both[1].coarse.cell);
            glance(both, [&samples[0], &samples[1]], &i_from_j, tolerance).is_some_and(|seen| {
                let share = (seen.through[0] / seen.total[0]).max(seen.through[1] / seen.total[1]);
                share > THROUGH[0] && seen.contradiction() > THROUGH[1]
            })
        })
    })
}

/// Joins `groups` by the pairs that are sure or trusted, the best first. Returns the groups, and what became of each pair.
pub(crate) fn assemble(
    views: &[View],
    pairs: &[Pair],
    groups: Vec<Group>,
    is_trusted: impl Fn(&Pair) -> bool,
) -> (Vec<Group>, Vec<Standing>) {
    let mut groups: Vec<Option<Group>> = groups.into_iter().map(Some).collect();
    let mut group_of = vec![0; views.len()];
    for (number, group) in groups.iter().enumerate() {
        group.iter().flat_map(|group| &group.members).for_each(|member| group_of[member.0] = number);
    }
    let mut standings = vec![Standing::Unused; pairs.len()];
    let mut order: Vec<(bool, f64, usize)> = Vec::new();
    for (k, pair) in pairs.iter().enumerate() {
        let trusted = is_trusted(pair) && !pair.modes.is_empty();
        if trusted || pair.finding == Finding::Sure {
            order.push((trusted, pair.modes[0].verdict.score(), k));
        }
    }
    order.sort_by(|x, y| y.0.cmp(&x.0).then(y.1.total_cmp(&x.1)).then(x.2.cmp(&y.2)));
    for (trusted, _, k) in order {
        let pair = &pairs[k];
        let a_from_b = pair.modes[0].a_from_b;
        let pose = |group: &Option<Group>, scan| {
            group.as_ref().and_then(|group| group.pose(scan)).expect("scans are in their groups")
        };
        let (ga, gb) = (group_of[pair.a], group_of[pair.b]);
        let (pose_a, pose_b) = (pose(&groups[ga], pair.a), pose(&groups[gb], pair.b));
        if ga == gb {
            let radius = views[pair.a].reduced.radius.min(views[pair.b].reduced.radius);
            let cell = views[pair.a].coarse.cell.max(views[pair.b].coarse.cell);
            let is_same = apart(&(pose_a.inverse() * pose_b), &a_from_b, radius) < AGREE * cell;
            standings[k] = if is_same { Standing::Agrees } else { Standing::Disagrees };
            continue;
        }
        let (Some(first), Some(second)) = (groups[ga].take(), groups[gb].take()) else {
            unreachable!("both were looked into")
        };
        let motion = pose_a * a_from_b * pose_b.inverse();
        if !trusted && contradicts(views, &first, &second, &motion) {
            standings[k] = Standing::SeenThrough;
            (groups[ga], groups[gb]) = (Some(first), Some(second));
            continue;
        }
        standings[k] = Standing::Joins;
        // The frame of fixed scans, which come first, stays.
        let (keep, moved, motion) = if gb < ga { (second, first, motion.inverse()) } else { (first, second, motion) };
        let (kept, gone) = (ga.min(gb), ga.max(gb));
        let mut joined = keep;
        for (scan, pose) in moved.members {
            group_of[scan] = kept;
            joined.members.push((scan, motion * pose));
        }
        groups[kept] = Some(joined);
        groups[gone] = None;
    }
    (groups.into_iter().flatten().collect(), standings)
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
