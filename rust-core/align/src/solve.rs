//! The steps from views to poses.

use std::collections::{BTreeMap, BTreeSet};

use glam::DAffine3;
use rayon::prelude::*;

use crate::assemble::{Standing, contradict};
use crate::coloured;
use crate::constraints::{Inside, Pick};
use crate::doubts::Doubted;
use crate::finding::{BALANCE, Finding, Limits, NEARLY, THROUGH_NEARLY, closest, fits};
use crate::group::Group;
use crate::judge::{Verdict, judge, tolerance, touching_share};
use crate::linear::{Matrix6, eigen};
use crate::misfit::Placed;
use crate::pair::Pair;
use crate::params::AlignParams;
use crate::reach::{Bound, ROUGH_REACH};
use crate::refine::Both;
use crate::relax::{Link, Net, Start, Tie, contacts};
use crate::search::{AtOdds, Found, search};
use crate::stages::FITTING;
use crate::turntable::Table;
use crate::uncertainty::covariances;
use crate::view::View;
use base::error::Result;
use base::progress::Progress;

/// The outcome, by the numbers inside.
pub(crate) struct Solved {
    pub groups: Vec<SolvedGroup>,
    pub pairs: Vec<Pair>,
    pub standings: Vec<Standing>,
    /// Scans that fit others, but nothing tells where they belong.
    pub doubted: Doubted,
    pub links: Vec<Looked>,
    pub limits: Limits,
    pub inside: Vec<bool>,
    pub rejected: Vec<[usize; 2]>,
    pub trusted: Vec<[usize; 2]>,
    pub picks: Vec<Pick>,
    /// The scans in the order of the recording, where they were followed.
    pub sequence: Option<Vec<usize>>,
    /// Pairs that the caller names, but against which others speak, and how many.
    pub outvoted: BTreeMap<[usize; 2], usize>,
    /// Fixed scans that contradict each other.
    pub at_odds: Vec<AtOdds>,
    pub bound: Bound,
    /// Whether there was a turntable, and where, if it was found.
    pub is_turned: bool,
    pub table: Option<Table>,
}

/// Scans in one frame.
pub(crate) struct SolvedGroup {
    /// Numbers and poses (world from local) of the scans. Those that moved with nothing else lie where they were given.
    pub members: Vec<(usize, DAffine3)>,
    /// In the gauges of the scans, in the order of the members.
    pub covariances: Vec<Matrix6>,
    /// The one whose pose is kept, unless others are fixed.
    pub frame: usize,
    /// Of a scan by itself that was joined, but is not held: how far it may be off.
    pub adrift: Option<f64>,
    /// Scans that fit others too far from where they were given, and how far that is.
    pub beyond: Vec<(usize, f64)>,
    /// Links that tints hold as well, and scans that points hold which the caller picked.
    pub coloured: BTreeSet<Link>,
    pub tied: BTreeSet<usize>,
}

impl Solved {
    /// The scans of a group that touch one of it most.
    pub fn beside<'v>(&self, views: &'v [View], group: &SolvedGroup, scan: usize) -> Vec<Placed<'v>> {
        let mut others: Vec<(f64, usize)> = self
            .links
            .iter()
            .filter_map(|looked| match looked.link {
                Link { a, b } if a == scan => Some((looked.verdict.touching(), b)),
                Link { a, b } if b == scan => Some((looked.verdict.touching(), a)),
                _ => None,
            })
            .collect();
        others.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.cmp(&y.1)));
        others.truncate(STRONGEST);
        others
            .into_iter()
            .filter_map(|(_, k)| Some(Placed { view: &views[k], world_from_local: group.pose(k)? }))
            .collect()
    }
}

impl SolvedGroup {
    pub fn pose(&self, scan: usize) -> Option<DAffine3> {
        self.members.iter().find(|member| member.0 == scan).map(|member| member.1)
    }

    pub fn has(&self, scan: usize) -> bool {
        self.members.iter().any(|member| member.0 == scan)
    }
}

/// Two scans of a group that touch, as they lie in the end.
pub(crate) struct Looked {
    pub link: Link,
    pub verdict: Verdict,
    /// Root mean square distance up to which they are taken for the same surface.
    pub closest: f64,
}

impl Looked {
    pub fn is_off(&self) -> bool {
        self.verdict.mean_square.sqrt() > self.closest
    }
}

/// The data that groups are settled by.
#[derive(Clone, Copy)]
struct Known<'a> {
    views: &'a [View],
    inside: &'a Inside,
    bound: &'a Bound,
    limits: &'a Limits,
    table: Option<&'a Table>,
    /// Whether the scans are frames that were followed from one to the next.
    is_followed: bool,
}

/// A group in its frame, and those of its scans that touch.
type Settled = (SolvedGroup, Vec<(Link, Verdict)>);

/// Scans are linked that touch by this share of one of them.
const LINK: f64 = 0.02;
/// Samples that tell whether two scans touch, and how.
const FEW: usize = 300;
const MANY: usize = 1000;

pub(crate) fn solve(views: &[View], params: &AlignParams, inside: &Inside, progress: &Progress<'_>) -> Result<Solved> {
    let bound = Bound::of(views, params, inside);
    let Found { pairs, standings, groups, doubted, table, sequence, outvoted, at_odds } =
        search(views, params, inside, &bound, progress)?;
    let told = inside.without(&outvoted.keys().copied().collect());
    // Points of pairs that hold nothing together would pull the scans apart that others hold.
    let is_held = |(_, standing): &(&Pair, &Standing)| matches!(standing, Standing::Joins | Standing::Agrees);
    let joined: BTreeSet<[usize; 2]> =
        pairs.iter().zip(&standings).filter(is_held).map(|(pair, _)| [pair.a, pair.b]).collect();
    let mut inside = told.clone();
    inside.picks.retain(|pick| joined.contains(&pick.scans));
    let inside = &inside;
    let limits = Limits::of(params);
    let is_followed = sequence.is_some();
    let known = Known { views, inside, bound: &bound, limits: &limits, table: table.as_ref(), is_followed };
    progress.stage(FITTING, views.len() as u64);
    let mut solved = Vec::new();
    let mut looked = Vec::new();
    for group in groups {
        progress.reach(looked.len() as u64);
        for (group, links) in held(&known, &group, progress)? {
            solved.push(group);
            looked.extend(links);
        }
    }
    let has_fixed = |group: &SolvedGroup| group.members.iter().any(|member| inside.is_fixed[member.0]);
    let area = |group: &SolvedGroup| group.members.iter().map(|member| views[member.0].reduced.area).sum::<f64>();
    let count = |group: &SolvedGroup| group.members.len();
    // Most scans first: the area of scans of something else may be larger.
    let rank = |x: &SolvedGroup, y: &SolvedGroup| {
        has_fixed(y).cmp(&has_fixed(x)).then(count(y).cmp(&count(x))).then(area(y).total_cmp(&area(x)))
    };
    solved.sort_by(rank);
    if bound.binds() && solved.first().is_some_and(|first| count(first) == 1 && !has_fixed(first)) {
        let contradictions = |group: &SolvedGroup| contradictions(views, &bound, group.frame, progress);
        let counts: Vec<usize> = solved.par_iter().map(contradictions).collect::<Result<_>>()?;
        let least = (0..solved.len()).min_by_key(|&k| counts[k]).unwrap_or(0);
        solved[..=least].rotate_right(1);
    }
    let links: Vec<Looked> = looked
        .into_iter()
        .map(|(link, verdict)| Looked { link, closest: closest(&verdict, &limits), verdict })
        .collect();
    let at_odds = with_near(views, inside, &links, at_odds, &limits, progress)?;
    Ok(Solved {
        groups: solved,
        pairs,
        standings,
        doubted,
        links,
        limits,
        inside: inside.is_fixed.clone(),
        rejected: inside.rejected.clone(),
        trusted: inside.trusted.clone(),
        picks: told.picks,
        sequence,
        outvoted,
        at_odds,
        bound,
        is_turned: inside.turned.is_some(),
        table,
    })
}

/// Fixed scans that lie on each other are believed to lie off only if they share so much: the place of those that share less is less sure.
const SHARED_BY_FIXED: f64 = 0.3;

/// Fixed scans that contradict each other, and those that touch and would fit better near by.
fn with_near(
    views: &[View],
    inside: &Inside,
    links: &[Looked],
    mut at_odds: Vec<AtOdds>,
    limits: &Limits,
    progress: &Progress<'_>,
) -> Result<Vec<AtOdds>> {
    let is_new = |link: &Link| at_odds.iter().all(|known| known.scans != [link.a, link.b]);
    let both_fixed = |link: &Link| inside.is_fixed[link.a] && inside.is_fixed[link.b];
    // Scans that lie off are all looked at, others in the pairs that share most: walls hide that frames slid along them.
    let shares = |looked: &&Looked| looked.verdict.overlap().into_iter().fold(1.0, f64::min) >= SHARED_BY_FIXED;
    let lying = links.iter().filter(|looked| !looked.is_off() && both_fixed(&looked.link)).filter(shares);
    let most = most_of_each(lying.map(|looked| (looked.verdict.touching(), looked.link)), STRONGEST);
    let off = links.iter().filter(|looked| looked.is_off()).map(|looked| looked.link);
    let asked: Vec<Link> = off.chain(most).filter(|link| both_fixed(link) && is_new(link)).collect();
    let near = asked.par_iter().map(|&Link { a, b }| {
        progress.check()?;
        let given = views[a].reduced.world_from_local().inverse() * views[b].reduced.world_from_local();
        let reach = ROUGH_REACH * views[a].reduced.radius.min(views[b].reduced.radius);
        let pair = Pair::near(views, a, b, &given, reach, limits);
        let motion = pair.modes.first().filter(|_| pair.finding == Finding::Sure);
        let cell = views[a].fine().cell.max(views[b].fine().cell);
        Ok(motion.and_then(|mode| AtOdds::of(views, [a, b], &mode.a_from_b, cell)))
    });
    at_odds.extend(near.collect::<Result<Vec<_>>>()?.into_iter().flatten());
    Ok(at_odds)
}

/// A group settled. It becomes several if it falls apart because pairs that joined it don't fit beside the others.
fn held(known: &Known<'_>, group: &Group, progress: &Progress<'_>) -> Result<Vec<Settled>> {
    let Known { views, inside, limits, .. } = *known;
    let (solved, links) = settle(known, group, progress)?;
    if let Some(parts) = within_reach(known, &solved, progress)? {
        return Ok(parts);
    }
    if known.is_followed
        && let Some(parts) = without_worst(known, &solved, &links, progress)?
    {
        return Ok(parts);
    }
    let holds = |(link, verdict): &&(Link, Verdict)| {
        let finding = fits([&views[link.a], &views[link.b]], verdict, limits);
        // Rough poses join what slides as well, so that all touch what holds them: these holds alone count then.
        let holds = match finding {
            Finding::Slides => !known.bound.binds(),
            other => matches!(other, Finding::Sure | Finding::Weak),
        };
        holds || inside.trusted.contains(&[link.a, link.b])
    };
    let mut part: Vec<usize> = (0..views.len()).collect();
    let join = |part: &mut Vec<usize>, [a, b]: [usize; 2]| {
        let (keep, gone) = (part[a].min(part[b]), part[a].max(part[b]));
        part.iter_mut().filter(|p| **p == gone).for_each(|p| *p = keep);
    };
    links.iter().filter(holds).for_each(|(link, _)| join(&mut part, [link.a, link.b]));
    let fixed: Vec<usize> = solved.members.iter().map(|member| member.0).filter(|&k| inside.is_fixed[k]).collect();
    fixed.windows(2).for_each(|two| join(&mut part, [two[0], two[1]]));
    let is_here = |[a, b]: &[usize; 2]| group.pose(*a).is_some() && group.pose(*b).is_some();
    inside.trusted.iter().filter(|pair| is_here(pair)).for_each(|pair| join(&mut part, *pair));
    let mut picked: Vec<[usize; 2]> = inside.picks.iter().map(|pick| pick.scans).filter(is_here).collect();
    picked.dedup();
    loop {
        let ends = |[a, b]: [usize; 2]| [part[a].min(part[b]), part[a].max(part[b])];
        let bears_out = |pair: [usize; 2]| {
            let between = links.iter().filter(|(link, _)| ends([link.a, link.b]) == ends(pair));
            between.into_iter().any(|(_, verdict)| may_lie_so(verdict, limits))
        };
        let apart = |pair: &&[usize; 2]| part[pair[0]] != part[pair[1]];
        let Some(&pair) = picked.iter().filter(apart).find(|pair| bears_out(**pair)) else { break };
        join(&mut part, pair);
    }
    let mut parts: BTreeMap<usize, Vec<(usize, DAffine3)>> = BTreeMap::new();
    for &(scan, pose) in &solved.members {
        parts.entry(part[scan]).or_default().push((scan, pose));
    }
    if parts.len() == 1 {
        return held_tight(known, solved, links, progress);
    }
    let mut all = Vec::new();
    for members in parts.into_values() {
        all.extend(held(known, &Group { members }, progress)?);
    }
    Ok(all)
}

/// Whether two scans that touch may lie so if the caller's points say it: their surfaces lie on each other, or much of one lies nearly on the
/// other, as a scan that is bent does, or one of which something moved.
fn may_lie_so(verdict: &Verdict, limits: &Limits) -> bool {
    let overlap = verdict.overlap();
    let is_close = verdict.mean_square.sqrt() <= closest(verdict, limits) || verdict.closeness() > 0.0;
    let is_near = overlap[0].max(overlap[1]) >= NEARLY && verdict.contradiction() <= THROUGH_NEARLY;
    (is_close && verdict.contradiction() <= SEEN_THROUGH) || is_near
}

/// A group without the frame that the others see through most, and that frame by itself. `None` where none is seen through by much.
fn without_worst(
    known: &Known<'_>,
    solved: &SolvedGroup,
    links: &[(Link, Verdict)],
    progress: &Progress<'_>,
) -> Result<Option<Vec<Settled>>> {
    let share = |scan: usize| {
        let own = links.iter().filter(|(link, _)| link.a == scan || link.b == scan);
        let sums = own.fold((0.0, 0.0), |sum, (_, verdict)| {
            (sum.0 + verdict.through[0] + verdict.through[1], sum.1 + verdict.touching())
        });
        sums.0 / (sums.0 + sums.1).max(f64::MIN_POSITIVE)
    };
    let is_told = |scan: usize| {
        let told = known.inside.trusted.iter().chain(known.inside.picks.iter().map(|pick| &pick.scans));
        known.inside.is_fixed[scan] || told.into_iter().any(|pair| pair.contains(&scan))
    };
    let shares = solved.members.iter().map(|member| (share(member.0), member.0)).filter(|(_, scan)| !is_told(*scan));
    let worst = shares.max_by(|x, y| x.0.total_cmp(&y.0).then(y.1.cmp(&x.1)));
    let Some((_, worst)) = worst.filter(|(share, _)| *share > SEEN_THROUGH) else { return Ok(None) };
    let (rest, out): (Vec<_>, Vec<_>) = solved.members.iter().copied().partition(|member| member.0 != worst);
    let mut all = held(known, &Group { members: rest }, progress)?;
    all.push(settle(known, &Group { members: out }, progress)?);
    Ok(Some(all))
}

/// Of what a frame's neighbours can tell, the share that may speak against where it lies.
const SEEN_THROUGH: f64 = 0.03;

/// A group whose scans do not all lie within reach of where they were given, as those that do and those that don't: these may fit each
/// other where they were given. `None` if all do.
fn within_reach(known: &Known<'_>, solved: &SolvedGroup, progress: &Progress<'_>) -> Result<Option<Vec<Settled>>> {
    let Known { views, inside, bound, .. } = *known;
    let beyond = |(scan, pose): &(usize, DAffine3)| match inside.is_fixed[*scan] {
        true => None,
        false => bound.beyond(views, *scan, pose).map(|moved| (*scan, moved)),
    };
    let outside: Vec<(usize, f64)> = solved.members.iter().filter_map(beyond).collect();
    if outside.is_empty() {
        return Ok(None);
    }
    let how_far = |scan: usize| outside.iter().find(|other| other.0 == scan).map(|(_, moved)| *moved);
    let (far, near): (Vec<_>, Vec<_>) = solved.members.iter().copied().partition(|(scan, _)| how_far(*scan).is_some());
    let mut all = Vec::new();
    for members in [near, far] {
        for (mut group, links) in held(known, &Group { members }, progress)? {
            let scans = group.members.iter().map(|member| member.0);
            group.beyond = scans.filter_map(|scan| Some((scan, how_far(scan)?))).collect();
            all.push((group, links));
        }
    }
    Ok(Some(all))
}

/// A group without those of its scans that may be so far off that it is not known where they are.
fn held_tight(
    known: &Known<'_>,
    solved: SolvedGroup,
    links: Vec<(Link, Verdict)>,
    progress: &Progress<'_>,
) -> Result<Vec<Settled>> {
    let Known { views, inside, .. } = *known;
    let is_told = |scan: usize| {
        inside.trusted.iter().chain(inside.picks.iter().map(|pick| &pick.scans)).any(|pair| pair.contains(&scan))
    };
    let deviation = |covariance: &Matrix6| eigen(covariance).0[5].max(0.0).sqrt();
    let adrift: Vec<(usize, f64)> = solved
        .members
        .iter()
        .zip(&solved.covariances)
        .map(|(&(scan, _), covariance)| (scan, deviation(covariance)))
        .filter(|&(scan, deviation)| deviation > ADRIFT * views[scan].reduced.spacing && !is_told(scan))
        .collect();
    if adrift.is_empty() {
        return Ok(vec![(solved, links)]);
    }
    let rest = solved.members.iter().filter(|(scan, _)| adrift.iter().all(|other| other.0 != *scan));
    let mut all = held(known, &Group { members: rest.copied().collect() }, progress)?;
    for (scan, deviation) in adrift {
        let alone = Group { members: vec![(scan, views[scan].reduced.world_from_local())] };
        let (group, links) = settle(known, &alone, progress)?;
        all.push((SolvedGroup { adrift: Some(deviation), ..group }, links));
    }
    Ok(all)
}

/// A scan that may be off by so many distances of samples has no place.
const ADRIFT: f64 = 3.0;

/// All scans of a group at once: which of them touch, poses that fit all of these, twice.
fn settle(known: &Known<'_>, group: &Group, progress: &Progress<'_>) -> Result<Settled> {
    let Known { views, inside, limits, table, .. } = *known;
    let has_fixed = group.members.iter().any(|member| inside.is_fixed[member.0]);
    let frame = frame_of(known, group, progress)?;
    let mut poses = vec![None; views.len()];
    let world_from_group = match group.pose(frame) {
        Some(pose) if !has_fixed => views[frame].reduced.world_from_local() * pose.inverse(),
        _ => DAffine3::IDENTITY,
    };
    for &(scan, pose) in &group.members {
        poses[scan] = Some(world_from_group * pose);
    }
    let mut is_fixed = inside.is_fixed.clone();
    if !has_fixed {
        is_fixed[frame] = true;
        poses[frame] = Some(views[frame].reduced.world_from_local());
    }
    let mut members: Vec<usize> = group.members.iter().map(|member| member.0).collect();
    members.sort_unstable();
    let cell = |pick: &Pick| pick.scans.iter().map(|&scan| views[scan].coarse.cell).fold(0.0, f64::max);
    // Clicks are off by a cell.
    let of_picks: Vec<Tie> = inside.picks.iter().map(|pick| Tie { pick: *pick, exact: cell(pick) }).collect();
    let of_table = table.map(|table| table.ties(views, &members, frame)).unwrap_or_default();
    let mut net = Net { views, poses, is_fixed, links: Vec::new(), ties: Vec::new(), coloured: BTreeSet::new() };
    let mut near = touching(&net, &members, inside, progress)?;
    for start in [Start::Near, Start::Settled] {
        let found = links(&net, &near, FEW, progress)?;
        near = found.iter().map(|(link, _)| *link).collect();
        let needed = of_picks.iter().filter(|tie| !is_held_by_shape(views, &found, tie, limits));
        net.ties = needed.chain(&of_table).copied().collect();
        net.links = strongest(&found);
        net.coloured = coloured(views, &found, limits);
        net.relax(start, progress)?;
    }
    let links = links(&net, &near, MANY, progress)?;
    net.links = strongest(&links);
    net.coloured = coloured(views, &links, limits);
    let covariances = covariances(&net, progress)?;
    let group = SolvedGroup {
        covariances: members.iter().map(|&scan| covariances[scan]).collect(),
        members: members.iter().map(|&scan| (scan, net.poses[scan].expect("members have poses"))).collect(),
        frame,
        adrift: None,
        beyond: Vec::new(),
        coloured: net.coloured,
        tied: members.into_iter().filter(|&scan| ties_of(inside, scan) >= HOLDING).collect(),
    };
    Ok((group, links))
}

/// The scan of a group whose given pose is kept: one beside which the fewest others lie too far from where they were given, then one that the
/// fewest scans contradict there, then the largest. A wrong pose so takes no right ones along.
fn frame_of(known: &Known<'_>, group: &Group, progress: &Progress<'_>) -> Result<usize> {
    let Known { views, inside, bound, .. } = *known;
    // Numbers rise as areas fall.
    let mut members = group.members.clone();
    members.sort_unstable_by_key(|member| member.0);
    let beyond = |&(frame, pose): &(usize, DAffine3)| {
        let world_from_group = views[frame].reduced.world_from_local() * pose.inverse();
        let is_beyond = |&&(scan, pose): &&(usize, DAffine3)| {
            !inside.is_fixed[scan] && bound.beyond(views, scan, &(world_from_group * pose)).is_some()
        };
        members.iter().filter(is_beyond).count()
    };
    let (largest, _) = members[0];
    if !bound.binds() || beyond(&members[0]) == 0 {
        return Ok(largest);
    }
    let counts: Vec<usize> = members.iter().map(beyond).collect();
    let least = counts.iter().copied().min().unwrap_or(0);
    let best: Vec<usize> =
        members.iter().zip(counts).filter(|(_, count)| *count == least).map(|(member, _)| member.0).collect();
    let contradicted =
        best.par_iter().map(|&scan| contradictions(views, bound, scan, progress)).collect::<Result<Vec<usize>>>()?;
    let first = (0..best.len()).min_by_key(|&k| contradicted[k]);
    Ok(first.map_or(largest, |k| best[k]))
}

/// By how many others a scan is contradicted where all were given: they see through each other further than rough poses may be off. Only the
/// largest are asked, so that the time does not grow with the square of their number.
fn contradictions(views: &[View], bound: &Bound, scan: usize, progress: &Progress<'_>) -> Result<usize> {
    let given = |k: usize| views[k].reduced.world_from_local();
    let does_contradict = |other: usize| {
        let tolerance = bound.reach(scan).max(bound.reach(other));
        contradict([&views[scan], &views[other]], &(given(scan).inverse() * given(other)), tolerance)
    };
    let mut count = 0;
    for other in (0..views.len().min(ASKED)).filter(|other| *other != scan) {
        progress.check()?;
        count += usize::from(does_contradict(other));
    }
    Ok(count)
}

/// So many scans are asked whether another may lie where it was given.
const ASKED: usize = 32;

/// Whether two scans that points join fit so that shape alone holds them: points choose a place, and shape where in it.
fn is_held_by_shape(views: &[View], links: &[(Link, Verdict)], tie: &Tie, limits: &Limits) -> bool {
    let [a, b] = tie.pick.scans;
    let of_tie = links.iter().find(|(link, _)| *link == Link { a: a.min(b), b: a.max(b) });
    of_tie.is_some_and(|(_, verdict)| fits([&views[a.min(b)], &views[a.max(b)]], verdict, limits) == Finding::Sure)
}

fn ties_of(inside: &Inside, scan: usize) -> usize {
    inside.picks.iter().filter(|pick| pick.scans.contains(&scan)).count()
}

/// So many points hold a scan.
const HOLDING: usize = 3;

/// Pairs of the scans that may touch as they lie: of each scan those that may touch it most, but for those that the caller
/// forbids.
fn touching(net: &Net<'_>, members: &[usize], inside: &Inside, progress: &Progress<'_>) -> Result<Vec<Link>> {
    let pairs: Vec<Link> = members
        .iter()
        .flat_map(|&a| members.iter().filter(move |&&b| b > a).map(move |&b| Link { a, b }))
        .filter(|link| !inside.rejected.contains(&[link.a, link.b]))
        .collect();
    let shares = pairs.par_iter().map(|&link| {
        progress.check()?;
        Ok(motion(net, link)
            .map_or(0.0, |motion| touching_share([&net.views[link.a], &net.views[link.b]], &motion, 0.0)))
    });
    let shares: Vec<f64> = shares.collect::<Result<_>>()?;
    let touching = pairs.into_iter().zip(shares).filter(|(_, share)| *share > 0.0);
    Ok(most_of_each(touching.map(|(link, share)| (share, link)), LOOKED_AT))
}

/// Of each scan the links that count most for it.
fn most_of_each(links: impl Iterator<Item = (f64, Link)>, most: usize) -> Vec<Link> {
    let mut of_scan: BTreeMap<usize, Vec<(f64, Link)>> = BTreeMap::new();
    for (value, link) in links {
        of_scan.entry(link.a).or_default().push((value, link));
        of_scan.entry(link.b).or_default().push((value, link));
    }
    let mut kept = Vec::new();
    for mut links in of_scan.into_values() {
        links.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.cmp(&y.1)));
        kept.extend(links.into_iter().take(most).map(|(_, link)| link));
    }
    kept.sort_unstable();
    kept.dedup();
    kept
}

fn motion(net: &Net<'_>, link: Link) -> Option<DAffine3> {
    Some(net.poses[link.a]?.inverse() * net.poses[link.b]?)
}

/// Those of the links where scans touch, as they lie now.
fn links(net: &Net<'_>, among: &[Link], samples: usize, progress: &Progress<'_>) -> Result<Vec<(Link, Verdict)>> {
    let looked = among.par_iter().map(|&link| {
        progress.check()?;
        let Some(motion) = motion(net, link) else { return Ok(None) };
        let both = [&net.views[link.a], &net.views[link.b]];
        let levels = Both::new(both[0].fine(), both[1].fine(), samples);
        let verdict = judge(both, &levels, &motion, tolerance(both));
        let overlap = verdict.overlap();
        Ok((overlap[0].max(overlap[1]) >= LINK).then_some((link, verdict)))
    });
    Ok(looked.collect::<Result<Vec<_>>>()?.into_iter().flatten().collect())
}

/// The links that hold the poses: their number grows with the scans alone.
fn strongest(links: &[(Link, Verdict)]) -> Vec<Link> {
    most_of_each(links.iter().map(|(link, verdict)| (verdict.touching(), *link)), STRONGEST)
}

/// The links that tints are to hold as well: those of scans that none holds by shape.
fn coloured(views: &[View], links: &[(Link, Verdict)], limits: &Limits) -> BTreeSet<Link> {
    if !limits.use_colour {
        return BTreeSet::new();
    }
    let is_held = |scan: usize| {
        let holds =
            |(link, verdict): &(Link, Verdict)| (link.a == scan || link.b == scan) && verdict.hold.balance() >= BALANCE;
        links.iter().any(holds)
    };
    let all = links.iter().map(|(link, _)| *link);
    all.filter(|link| coloured::can_tell([&views[link.a], &views[link.b]]) && !(is_held(link.a) && is_held(link.b)))
        .collect()
}

/// Links of each scan that hold it, and that are looked at.
const STRONGEST: usize = 8;
const LOOKED_AT: usize = 24;

/// Root mean square distance of the surfaces of all pairs that touch, along their normals.
pub(crate) fn residual(views: &[View], group: &SolvedGroup, links: &[Link]) -> Option<f64> {
    let mut poses = vec![None; views.len()];
    group.members.iter().for_each(|&(scan, pose)| poses[scan] = Some(pose));
    let net = Net {
        views,
        poses,
        is_fixed: vec![false; views.len()],
        links: Vec::new(),
        ties: Vec::new(),
        coloured: BTreeSet::new(),
    };
    let (mut sum, mut weight) = (0.0, 0.0);
    for link in links {
        for contact in contacts(&net, *link, MANY, 1.5) {
            sum += contact.area * contact.distance() * contact.distance();
            weight += contact.area;
        }
    }
    (weight > 0.0).then(|| (sum / weight).sqrt())
}
