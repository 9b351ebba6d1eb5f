//! Groups that fit the placed scans in several places: whole arrangements that explain the scans alike.

use glam::{DAffine3, DVec3};

use crate::assemble::{AGREE, contradicts};
use crate::finding::{Finding, RIVAL, fits};
use crate::group::Group;
use crate::linear::apart;
use crate::pair::Pair;
use crate::solve::{Solved, SolvedGroup};
use crate::view::View;
use base::error::Result;
use base::progress::Progress;

/// Places of a group beside the placed scans, of which nothing decides.
pub(crate) struct Rivals {
    pub count: usize,
    /// How far the middle of the group is moved from the likeliest to the next, and by how much it is turned, in radians.
    pub shift: f64,
    pub turn: f64,
}

/// Places that are looked at, the likeliest first.
const MOST: usize = 6;

/// The places of a group beside the first one that pairs of scans of both allow, and no line of sight refuses: those that let nearly as
/// much surface touch as the best. `None` where there are fewer than two.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub(crate) fn rivals(
    views: &[View],
    solved: &Solved,
    group: &SolvedGroup,
    progress: &Progress<'_>,
) -> Result<Option<Rivals>> {
    let Some(first) = solved.groups.first() else { return Ok(None) };
    let middle = DAffine3::from_translation(
        group.members.iter().map(|member| member.1.translation).sum::<DVec3>() / group.members.len() as f64,
    );
    let mut places: Vec<(f64, DAffine3)> = Vec::new();
    for (touching, motion) in solved.pairs.iter().flat_map(|pair| motions(views, solved, [first, group], pair)) {
        let cell = views[group.frame].coarse.cell;
        let is_same = |(_, other): &&mut (f64, DAffine3)| {
            apart(&(*other * middle), &(motion * middle), views[group.frame].reduced.radius) < AGREE * cell
        };
        match places.iter_mut().find(is_same) {
            Some(place) => place.0 += touching,
            None => places.push((touching, motion)),
        }
    }
    places.sort_by(|x, y| y.0.total_cmp(&x.0));
    places.truncate(MOST);
    let [one, other] = [first, group].map(|group| Group { members: group.members.clone() });
    let mut allowed = Vec::new();
    for (touching, motion) in places {
        progress.check()?;
        if !contradicts(views, &one, &other, &motion) {
            allowed.push((touching, motion));
        }
    }
    let best = allowed.first().map_or(0.0, |place| place.0);
    allowed.retain(|place| place.0 > RIVAL * best);
    let [(_, likeliest), (_, next), ..] = allowed[..] else { return Ok(None) };
    let between = (likeliest * middle).inverse() * next * middle;
    let trace = between.matrix3.x_axis.x + between.matrix3.y_axis.y + between.matrix3.z_axis.z;
    let turn = (0.5 * (trace - 1.0)).clamp(-1.0, 1.0).acos();
    Ok(Some(Rivals { count: allowed.len(), shift: between.translation.length(), turn }))
}

/// Motions of the second group by which a pair of scans of both fits, with the area that touches.
fn motions(views: &[View], solved: &Solved, [first, second]: [&SolvedGroup; 2], pair: &Pair) -> Vec<(f64, DAffine3)> {
    let (of_first, of_second) = if first.has(pair.a) { (pair.a, pair.b) } else { (pair.b, pair.a) };
    let (Some(one), Some(other)) = (first.pose(of_first), second.pose(of_second)) else { return Vec::new() };
    if !matches!(pair.finding, Finding::Sure | Finding::Weak | Finding::Ambiguous) {
        return Vec::new();
    }
    let both = [&views[pair.a], &views[pair.b]];
    let least = RIVAL * pair.modes[0].verdict.score();
    let holds = pair.modes.iter().filter(|mode| {
        mode.verdict.score() >= least
            && matches!(fits(both, &mode.verdict, &solved.limits), Finding::Sure | Finding::Weak)
    });
    let motion = |first_from_second: DAffine3| one * first_from_second * other.inverse();
    holds
        .map(|mode| {
            let first_from_second = if of_first == pair.a { mode.a_from_b } else { mode.a_from_b.inverse() };
            (mode.verdict.touching(), motion(first_from_second))
        })
        .collect()
}
