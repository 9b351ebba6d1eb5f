//! Why scans are not placed, and what the user should know, in sentences.

use std::collections::BTreeMap;

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use crate::assemble::{Standing, contradict};
use crate::constraints::{Pick, is_enough};
use crate::doubts::Doubt;
use crate::finding::{APART, Finding, Limits, NEARLY, THROUGH_NEARLY, closest, fits};
use crate::gravity::{most_tipped, tipped};
use crate::judge::{Mode, Verdict};
use crate::misfit::{Cause, Placed, cause};
use crate::pair::Pair;
use crate::params::AlignParams;
use crate::report::{AlignReport, AlignedScan, Freedom, ScanState, freedoms};
use crate::rivals::{Rivals, rivals};
use crate::search::{AtOdds, motion_of};
use crate::snap::{Snap, Stays, snap};
use crate::solve::Solved;
use crate::view::View;
use base::error::{Result, Shown, counted};
use base::progress::Progress;

/// A scan so many times larger or smaller than the median is in another unit.
const OTHER_UNIT: f64 = 30.0;

fn median_radius(views: &[View]) -> f64 {
    let mut radii: Vec<f64> = views.iter().map(|view| view.reduced.radius).filter(|r| *r > 0.0).collect();
    radii.sort_by(f64::total_cmp);
    radii.get(radii.len() / 2).copied().unwrap_or(0.0)
}

/// Why a scan has no place.
pub(crate) struct Reason {
    /// A sentence with what to do.
    pub text: String,
    /// Whether it may lie where it was given: nothing that was found speaks against that.
    pub is_open: bool,
}

/// Why a scan has no place.
pub(crate) fn reason(
    views: &[View],
    solved: &Solved,
    names: &[&str],
    scans: &[AlignedScan],
    k: usize,
    progress: &Progress<'_>,
) -> Result<Reason> {
    let reduced = &views[k].reduced;
    let closed = |text: String| Ok(Reason { text, is_open: false });
    if against(views, solved, k) {
        return closed(
            "others see through where it was given: check its pose and raise reach, or leave it out if it is of something else".to_owned(),
        );
    }
    let open = |text: String| Ok(Reason { text, is_open: true });
    if reduced.area <= 0.0 {
        return closed(match &reduced.damage {
            Some(damage) => format!("it {damage}"),
            None => "it has no surface: no sample has neighbours".to_owned(),
        });
    }
    // Few samples lie near each other, whatever their unit.
    match views[k].fine().len() {
        1 => return open("it has too little surface: 1 point of it is left where samples are averaged".to_owned()),
        few if few < TOO_FEW => {
            return open(format!("it has too little surface: {few} points of it are left where samples are averaged"));
        }
        _ => {}
    }
    let median = median_radius(views);
    if reduced.radius > OTHER_UNIT * median || OTHER_UNIT * reduced.radius < median {
        let [own, usual] = [2.0 * reduced.radius, 2.0 * median].map(|size| Shown::digits(size, 2));
        return closed(format!(
            "it is {own} large where others are {usual}: is it in another unit? Scale it, or say its unit when it is read"
        ));
    }
    if let Some(text) = doubted(solved, names, k) {
        return open(text);
    }
    let apart = scans[k].state == ScanState::Apart;
    let sure_one = || {
        let fits = |pair: &&Pair| (pair.a == k || pair.b == k) && pair.finding == Finding::Sure;
        solved.pairs.iter().filter(fits).max_by(|x, y| touching(x).total_cmp(&touching(y)))
    };
    let joined = |text: String| if apart { format!("its group fits nothing else: {text}") } else { text };
    let of_scan = || solved.pairs.iter().filter(|pair| (pair.a == k || pair.b == k) && !pair.modes.is_empty());
    let other = |pair: &Pair| names[if pair.a == k { pair.b } else { pair.a }];
    let most = |x: &&Pair, y: &&Pair| touching(x).total_cmp(&touching(y));
    let adrift =
        solved.groups.iter().find(|group| group.frame == k && group.members.len() == 1).and_then(|group| group.adrift);
    let sure = of_scan().filter(|pair| pair.finding == Finding::Sure).max_by(most);
    if let (Some(deviation), Some(pair)) = (adrift, sure) {
        return open(format!(
            "it fits {:?}, but too little holds it: its place is known to {} at best, so scan more of what both show",
            other(pair),
            Shown::digits(deviation, 2)
        ));
    }
    let group = solved.groups.iter().find(|group| group.has(k));
    if let Some((_, moved)) = group.and_then(|group| group.beyond.iter().find(|(scan, _)| *scan == k)) {
        let there = too_far(*moved, solved.bound.reach(k));
        return closed(format!("it fits other scans {there}: check its pose, or raise reach"));
    }
    if let Some(text) = misplaced(views, solved, names, k) {
        return open(text);
    }
    if let Some((pair, which)) = sure.zip(fixed_at_odds(names, solved)) {
        return open(joined(format!(
            "it fits {:?}, but fixed scans contradict each other, {which}: check their poses, or fix one of them alone",
            other(pair)
        )));
    }
    // A scan of a room that nearly lies on others may be anywhere.
    if !views[k].is_of_room()
        && let Some(text) = nearly(views, solved, names, k, progress)?
    {
        return open(joined(text));
    }
    let telling = of_scan().filter_map(|pair| Some((pair, why_not(views, solved, pair, other(pair))?)));
    if let Some((_, text)) = telling.max_by(|(x, _), (y, _)| most(x, y)) {
        return open(joined(text));
    }
    let far = solved.pairs.iter().zip(&solved.standings).filter(|(pair, _)| pair.a == k || pair.b == k);
    let far = far.filter_map(|(pair, standing)| Some((pair, beyond(views, solved, pair, *standing, k)?)));
    if let Some((pair, moved)) = far.min_by(|(_, x), (_, y)| x.total_cmp(y)) {
        let there = too_far(moved, solved.bound.reach(k));
        return closed(joined(format!(
            "it fits {:?} {there}: check its pose and raise reach, or scan more of what both show",
            other(pair)
        )));
    }
    let standings = solved.pairs.iter().zip(&solved.standings);
    let is_through =
        |(pair, standing): &(&Pair, &Standing)| (pair.a == k || pair.b == k) && **standing == Standing::SeenThrough;
    if let Some((pair, _)) = standings.into_iter().find(is_through) {
        return open(joined(format!("it fits {:?}, but other scans saw through where that would put it", other(pair))));
    }
    if let Some(pair) = sure_one().filter(|_| apart) {
        let first = solved.groups.first().map_or(&[][..], |group| &group.members[..]);
        let own = group.map_or(&[][..], |group| &group.members[..]);
        if own.iter().all(|(x, _)| first.iter().all(|(y, _)| is_rejected(solved, *x, *y))) {
            return open(format!(
                "it fits {:?}, but all pairs of these with the first group are rejected: allow one that touches",
                other(pair)
            ));
        }
        return open(format!(
            "it fits {:?}, but nothing joins these with the first group: they are of something else, or share too little with it",
            other(pair)
        ));
    }
    let others = (0..views.len()).filter(|&other| other != k && views[other].reduced.area > 0.0);
    if others.clone().next().is_none() {
        return open("no other scan has a surface that it could fit".to_owned());
    }
    if others.clone().all(|other| is_rejected(solved, k, other)) {
        return open("all its pairs with other scans are rejected: allow one that touches it".to_owned());
    }
    if solved.table.is_some() {
        return open(joined(
            "no turn about the turntable's axis was found by which it fits another scan. Check the axis and the angles, or leave \
                it out if it did not stand on the table."
                .to_owned(),
        ));
    }
    let remedy = if solved.bound.binds() { "pairs of points" } else { "a rough pose, or pairs of points" };
    open(joined(format!(
        "no place was found where it fits another scan: it is of something else, or shares less than a third: give it {remedy}"
    )))
}

fn is_rejected(solved: &Solved, a: usize, b: usize) -> bool {
    solved.rejected.contains(&[a.min(b), a.max(b)])
}

/// Picks of two scans, by their numbers.
fn picks_of(solved: &Solved, [a, b]: [usize; 2]) -> Vec<&Pick> {
    solved.picks.iter().filter(|pick| pick.scans == [a, b]).collect()
}

/// By how many degrees the picks of two scans tip one of them, where gravity does not allow that.
fn tipped_by(views: &[View], solved: &Solved, [a, b]: [usize; 2]) -> Option<f64> {
    let cell = views[a].coarse.cell.max(views[b].coarse.cell);
    tipped([&views[a], &views[b]], &motion_of(&picks_of(solved, [a, b]), cell)?)
}

/// Why a scan that the caller's points join with another has no place beside it.
fn misplaced(views: &[View], solved: &Solved, names: &[&str], k: usize) -> Option<String> {
    let mut picked: Vec<[usize; 2]> = solved.picks.iter().map(|pick| pick.scans).filter(|s| s.contains(&k)).collect();
    picked.dedup();
    let group = solved.groups.iter().find(|group| group.has(k))?;
    picked.into_iter().find_map(|pair| {
        let other = if pair[0] == k { pair[1] } else { pair[0] };
        let found = solved.pairs.iter().position(|found| [found.a, found.b] == pair)?;
        if solved.pairs[found].modes.is_empty() {
            let degrees = tipped_by(views, solved, pair)?;
            return Some(format!(
                "your points would tip it by {degrees:.0} degrees beside {:?}, and gravity allows {}: check them",
                names[other],
                most_tipped()
            ));
        }
        let is_lost = solved.standings[found] == Standing::Joins && !group.has(other);
        is_lost.then(|| "your points place it where it overlaps no other scan: check them".to_owned())
    })
}

/// Why a scan that fits others has no place all the same.
fn doubted(solved: &Solved, names: &[&str], k: usize) -> Option<String> {
    let why = solved.doubted.why.filter(|_| solved.doubted.scans.contains(&k))?;
    let pairs = solved.pairs.iter().filter(|pair| pair.finding == Finding::Sure && (pair.a == k || pair.b == k));
    let best = pairs.max_by(|x, y| touching(x).total_cmp(&touching(y)));
    let other = |pair: &Pair| format!("{:?}", names[if pair.a == k { pair.b } else { pair.a }]);
    let best = best.map_or("other scans".to_owned(), other);
    Some(match why {
        Doubt::Few => format!(
            "it fits {best}, but {} of {} scans that fit each other are too few to tell one place from another that looks alike. Align the \
             recording as a sequence, give rough poses, or a pair of points that both show.",
            solved.doubted.scans.len(),
            solved.inside.len()
        ),
        Doubt::Repeats => format!(
            "it fits {best}, but the room repeats itself, and pairs that fit as well contradict each other. Align the recording as a sequence, \
             give rough poses, or a pair of points that both show."
        ),
    })
}

/// Whether scans that are placed see through a scan where it was given, further off than rough poses may be.
fn against(views: &[View], solved: &Solved, k: usize) -> bool {
    let Some(group) = solved.groups.first().filter(|group| solved.bound.binds() && !group.has(k)) else { return false };
    let given = views[k].reduced.world_from_local();
    group.members.iter().any(|&(other, pose)| {
        let both = [&views[other], &views[k]];
        let reach = [other, k].map(|scan| solved.bound.reach(scan));
        contradict(both, &(pose.inverse() * given), reach[0].max(reach[1]))
    })
}

fn too_far(moved: f64, reach: f64) -> String {
    let [moved, reach] = [moved, reach].map(|length| Shown::digits(length, 2));
    format!("only where it would lie {moved} from where it was given, and reach allows {reach}")
}

/// How far from where it was given a pair would put a scan `k` that is not placed because of that.
fn beyond(views: &[View], solved: &Solved, pair: &Pair, standing: Standing, k: usize) -> Option<f64> {
    let a_from_b = match standing {
        Standing::Beyond => pair.modes[0].a_from_b,
        _ => pair.beyond?,
    };
    let (other, other_from_k) = if pair.a == k { (pair.b, a_from_b.inverse()) } else { (pair.a, a_from_b) };
    let placed = solved.groups.first().and_then(|group| group.pose(other));
    let world_from_other = placed.unwrap_or_else(|| views[other].reduced.world_from_local());
    solved.bound.beyond(views, k, &(world_from_other * other_from_k))
}

fn touching(pair: &Pair) -> f64 {
    pair.modes[0].verdict.touching()
}

/// Why a scan `k` is not joined to `other` by a pair of both. `None` if they plainly have nothing to do with each other.
fn why_not(views: &[View], solved: &Solved, pair: &Pair, other: &str) -> Option<String> {
    let verdict = &pair.modes[0].verdict;
    match pair.finding {
        Finding::Ambiguous => Some(format!(
            "it fits {other:?} in {} places, and no other scan decides: give it {}a pair of points that both show",
            pair.places(views, &solved.limits),
            if solved.bound.binds() { "" } else { "a rough pose, or " }
        )),
        Finding::Walls => {
            let order = match (solved.bound.binds(), solved.sequence.is_some()) {
                (true, _) => "",
                (false, true) => "give it a rough pose, or ",
                (false, false) => "align the recording as a sequence, give it a rough pose, or ",
            };
            Some(format!(
                "it shares hardly more than walls, floor or ceiling with {other:?}, which fit elsewhere as well: \
                    {order}scan more of what stands in the room"
            ))
        }
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
        Finding::Loose if is_noise(verdict) => Some(format!(
            "it fits {other:?}, but lies {} apart there, which noise explains, and tolerance allows {}: raise it, or leave it out",
            Shown::digits(verdict.mean_square.sqrt(), 2),
            Shown::digits(closest(verdict, &solved.limits), 2)
        )),
        Finding::Little if would_fit(views, solved, pair) => {
            let [share, least] = [overlap(verdict), solved.limits.min_overlap].map(|share| 100.0 * share);
            Some(format!(
                "it fits {other:?}, but shares {share:.0} % with it there, and min_overlap asks for {least:.0} %: lower it"
            ))
        }
        Finding::Background => Some(format!(
            "most of what it shares with {other:?} stands still before the sensor while the rest moved: remove the background or the stage"
        )),
        _ => None,
    }
}

/// Share of a scan on the other, of the two that shares more.
fn overlap(verdict: &Verdict) -> f64 {
    verdict.overlap().into_iter().fold(0.0, f64::max)
}

/// Whether two scans that share less than the caller asks for fit by the overlap that is asked for by default.
fn would_fit(views: &[View], solved: &Solved, pair: &Pair) -> bool {
    let limits = Limits { min_overlap: AlignParams::default().min_overlap, ..solved.limits };
    let verdict = &pair.modes[0].verdict;
    let finding = fits([&views[pair.a], &views[pair.b]], verdict, &limits);
    overlap(verdict) < solved.limits.min_overlap && matches!(finding, Finding::Sure | Finding::Weak)
}

/// The reason that keeps a scan `k`, which nearly fits the first group, from fitting it. `None` where it isn't near, or nothing does.
fn nearly(
    views: &[View],
    solved: &Solved,
    names: &[&str],
    k: usize,
    progress: &Progress<'_>,
) -> Result<Option<String>> {
    let Some(group) = solved.groups.first().filter(|group| !group.has(k)) else { return Ok(None) };
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
        snap(&views[k], start, &others, reach, &solved.limits, progress)
    };
    let snaps: Vec<Snap> = starts.par_iter().map(drawn).collect::<Result<_>>()?;
    let score = |snap: &Snap| snap.overlap * (1.0 - snap.seen_through / THROUGH_NEARLY);
    let is_within = |snap: &Snap| {
        let world_from_local = snap.world_from_scan * DAffine3::from_translation(views[k].reduced.middle);
        solved.bound.beyond(views, k, &world_from_local).is_none()
    };
    let best = snaps.into_iter().filter(is_within).max_by(|x, y| score(x).total_cmp(&score(y)));
    let Some(best) = best.filter(|best| best.overlap >= NEARLY && best.seen_through <= THROUGH_NEARLY) else {
        return Ok(None);
    };
    let scan = Placed {
        view: &views[k],
        world_from_local: best.world_from_scan * DAffine3::from_translation(views[k].reduced.middle),
    };
    let beside: Vec<Placed<'_>> = others
        .iter()
        .filter(|other| best.touches.contains(&other.number))
        .map(|other| Placed { view: other.view, world_from_local: other.world_from_local })
        .collect();
    let Some(cause) = cause(&scan, &beside, &solved.limits) else { return Ok(None) };
    let beside: Vec<&str> = best.touches.iter().map(|&other| names[other]).collect();
    let remedy = match cause {
        Cause::Scale(_) => "scale it",
        Cause::Moved { .. } => "cut off what moved",
        Cause::Warp => {
            "check the scanner's calibration, place it by pairs of points, or leave it out if it is of something else"
        }
    };
    Ok(Some(format!("it nearly fits {}, but {}: {remedy}", quoted(&beside), because(cause))))
}

/// Motions of which a scan's may be the one.
const TRIED: usize = 12;

fn because(cause: Cause) -> String {
    match cause {
        Cause::Scale(scale) => format!("it would fit better if it were {} times as large", Shown::digits(scale, 4)),
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

/// Messages for the user on all scans.
pub(crate) fn say(
    report: &mut AlignReport,
    views: &[View],
    order: &[usize],
    names: &[&str],
    scans: &[AlignedScan],
    solved: &Solved,
    progress: &Progress<'_>,
) -> Result<()> {
    let named = |state: ScanState| {
        let mut found: Vec<usize> = (0..scans.len()).filter(|&k| scans[k].state == state).collect();
        found.sort_by_key(|&k| order[k]);
        found.into_iter().map(|k| names[k]).collect::<Vec<&str>>()
    };
    if solved.is_turned && solved.table.is_none() {
        report.messages.push(
            "the turntable was not found, and not used. Pairs of scans that are sure by themselves must turn about \
                one axis, by the angles given or by equal ones. Angles are in radians, in the order of the scans. \
                They count the object's turn counter-clockwise, seen with the axis pointing to the viewer."
                .to_owned(),
        );
    }
    let undecided = named(ScanState::Undecided);
    if !undecided.is_empty() {
        report.messages.push(match undecided.len() {
            1 => format!("{:?} stays where it was given: nothing decides where it belongs", undecided[0]),
            n => format!(
                "{n} scans stay where they were given: nothing decides where they belong: {}",
                quoted(&undecided)
            ),
        });
    }
    let unplaced = named(ScanState::Unplaced);
    if !unplaced.is_empty() {
        report.messages.push(match unplaced.len() {
            1 => format!("{:?} is not placed", unplaced[0]),
            n => format!("{n} scans are not placed: {}", quoted(&unplaced)),
        });
    }
    if report.groups.len() > 1 {
        report.messages.push(format!(
            "nothing joins {} groups of scans: give {}a pair of points that two of them show",
            report.groups.len(),
            if solved.bound.binds() { "" } else { "rough poses, or " }
        ));
    }
    report.messages.extend(several_places(views, order, names, solved, progress)?);
    report.messages.extend(in_doubt(order, names, solved));
    report.messages.extend(equal(views, order, names));
    report.messages.extend(lost(views, names, scans, solved));
    report.messages.extend(told(views, names, solved));
    report.messages.extend(fixed_at_odds(names, solved).map(|which| {
        format!("fixed scans contradict each other: {which}. Check their poses, or fix one of them alone.")
    }));
    report.messages.extend(too_exact(solved));
    // Beside scans that contradict each other nothing is bent, or of another size.
    if let Some(group) = solved.groups.first().filter(|_| solved.at_odds.is_empty()) {
        let causes = group.members.par_iter().map(|&(k, pose)| {
            progress.check()?;
            let scan = Placed { view: &views[k], world_from_local: pose };
            Ok(cause(&scan, &solved.beside(views, group, k), &solved.limits).map(|cause| (k, cause)))
        });
        let mut causes: Vec<(usize, Cause)> = causes.collect::<Result<Vec<_>>>()?.into_iter().flatten().collect();
        causes.sort_by_key(|(k, _)| order[*k]);
        for (k, cause) in causes {
            report.messages.push(format!("{:?} does not fit the others exactly: {}", names[k], because(cause)));
        }
    }
    Ok(())
}

/// Scans that hold the same samples, by groups.
fn equal(views: &[View], order: &[usize], names: &[&str]) -> Option<String> {
    let mut of_content: BTreeMap<u64, Vec<usize>> = BTreeMap::new();
    for (k, view) in views.iter().enumerate().filter(|(_, view)| view.reduced.area > 0.0) {
        of_content.entry(view.reduced.content).or_default().push(k);
    }
    let mut groups: Vec<Vec<usize>> = of_content.into_values().filter(|scans| scans.len() > 1).collect();
    groups.iter_mut().for_each(|scans| scans.sort_by_key(|&k| order[k]));
    groups.sort_by_key(|scans| order[scans[0]]);
    let named = |scans: &Vec<usize>| scans.iter().map(|&k| names[k]).collect::<Vec<&str>>();
    match &groups[..] {
        [] => None,
        [scans] if scans.len() == 2 => {
            Some(format!("{:?} and {:?} hold the same samples: leave one out", names[scans[0]], names[scans[1]]))
        }
        [scans] => Some(format!(
            "{} scans hold the same samples, leave all but one out: {}",
            scans.len(),
            quoted(&named(scans))
        )),
        several => {
            let shown: Vec<String> =
                several.iter().take(MOST_NAMED).map(|scans| format!("({})", quoted(&named(scans)))).collect();
            Some(format!(
                "{} groups of scans hold the same samples each, leave all but one of each out: {}{}",
                several.len(),
                shown.join(", "),
                if several.len() > MOST_NAMED { " and others" } else { "" }
            ))
        }
    }
}

/// Groups that fit the placed scans in several places.
fn several_places(
    views: &[View],
    order: &[usize],
    names: &[&str],
    solved: &Solved,
    progress: &Progress<'_>,
) -> Result<Vec<String>> {
    let mut said = Vec::new();
    for group in solved.groups.iter().skip(1).filter(|group| group.members.len() > 1) {
        let Some(Rivals { count, shift, turn }) = rivals(views, solved, group, progress)? else { continue };
        let mut scans: Vec<usize> = group.members.iter().map(|member| member.0).collect();
        scans.sort_by_key(|&k| order[k]);
        let scans: Vec<&str> = scans.into_iter().map(|k| names[k]).collect();
        let (number, scans, shift) = (scans.len(), quoted(&scans), Shown::digits(shift, 2));
        let way = if turn < 0.1 { String::new() } else { format!(" and a turn of {:.0} degrees", turn.to_degrees()) };
        said.push(format!(
            "{number} scans fit the placed ones in {count} places, {shift}{way} apart, and nothing decides: {scans}"
        ));
    }
    Ok(said)
}

/// Frames of rooms that fit each other, but nothing tells where they belong.
fn in_doubt(order: &[usize], names: &[&str], solved: &Solved) -> Option<String> {
    let why = solved.doubted.why?;
    let mut scans = solved.doubted.scans.clone();
    scans.sort_by_key(|&k| order[k]);
    let scans: Vec<&str> = scans.into_iter().map(|k| names[k]).collect();
    let (count, all) = (scans.len(), names.len());
    let named = quoted(&scans);
    (count > 0).then(|| match why {
        Doubt::Few => {
            format!("{count} scans fit each other, too few of {all} to tell places that look alike from each other: {named}")
        }
        Doubt::Repeats => {
            format!("{count} scans of {all} fit each other in a room that repeats itself, where nothing tells their places: {named}")
        }
    })
}

/// Places where track of a recording was lost, and whether it was found again.
fn lost(views: &[View], names: &[&str], scans: &[AlignedScan], solved: &Solved) -> Vec<String> {
    let frames = solved.sequence.as_deref().unwrap_or_default();
    let mut said: Vec<String> = Vec::new();
    for [before, after] in frames.windows(2).map(|two| [two[0], two[1]]) {
        let is_of_both = |pair: &&Pair| [pair.a, pair.b] == [before.min(after), before.max(after)];
        let is_found = scans[before].group.is_some() && scans[before].group == scans[after].group;
        // Fixed scans are not compared.
        if solved.inside[before] && solved.inside[after] {
            continue;
        }
        let found = solved.pairs.iter().find(is_of_both);
        let why = match found.map(|pair| pair.finding) {
            Some(Finding::Sure | Finding::Weak) if is_found => continue,
            _ if [before, after].iter().any(|&k| views[k].reduced.area <= 0.0) => "one of them has no surface",
            _ if is_rejected(solved, before, after) => "the pair is rejected",
            Some(Finding::Loose) if found.is_some_and(|pair| is_noise(&pair.modes[0].verdict)) => {
                "noise puts what both show further apart than tolerance allows"
            }
            Some(Finding::Ambiguous) => "they fit in several places",
            Some(Finding::Walls) => "they share hardly more than walls, which fit elsewhere as well",
            Some(Finding::Sure | Finding::Weak) => "other frames do not confirm how they fit",
            Some(Finding::Slides) => "what both show can turn or slide",
            Some(Finding::Loose) => "what both show lies further apart than noise explains",
            Some(Finding::SeenThrough | Finding::Background) => "something moved, or one shows another place",
            _ if solved.table.is_some() => "no turn about the turntable's axis makes them fit",
            _ => "they share too little",
        };
        let then = if is_found { "other frames say how they lie" } else { "they are not in one group" };
        said.push(format!("track was lost between {:?} and {:?}: {why}, and {then}", names[before], names[after]));
    }
    let more = said.len().saturating_sub(MOST_LOST);
    said.truncate(MOST_LOST);
    if more > 0 {
        said.push(match more {
            1 => "track was lost once more".to_owned(),
            _ => format!("track was lost {more} more times"),
        });
    }
    said
}

/// Places where track was lost that are named.
const MOST_LOST: usize = 5;

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

/// Messages on what the caller says that doesn't agree with the scans.
fn told(views: &[View], names: &[&str], solved: &Solved) -> Vec<String> {
    let mut said = Vec::new();
    let group_of = |scan: usize| solved.groups.iter().find(|group| group.has(scan));
    let pair_of = |a: usize, b: usize| solved.pairs.iter().find(|pair| [pair.a, pair.b] == [a.min(b), a.max(b)]);
    let mut picked: Vec<[usize; 2]> = solved.picks.iter().map(|pick| pick.scans).collect();
    picked.sort_unstable();
    picked.dedup();
    for [a, b] in picked {
        let picks = || solved.picks.iter().filter(|pick| pick.scans == [a, b]);
        let (count, with_normals) = (picks().count(), picks().filter(|pick| pick.normals.is_some()).count());
        let is_open = pair_of(a, b).is_some_and(|pair| pair.modes.is_empty());
        if is_open && !is_enough(count, with_normals) {
            said.push(format!(
                "too few points are picked in {:?} and {:?} to tell how they lie: {count}. Their shape does not tell it either. Pick three that \
                    lie in no line, or two with the normals there.",
                names[a], names[b]
            ));
            continue;
        }
        if let Some(degrees) = tipped_by(views, solved, [a, b]).filter(|_| is_open) {
            said.push(format!(
                "the {count} points picked in {:?} and {:?} would tip one of them by {degrees:.0} degrees, and gravity allows {}. Check that \
                    each is the same point of the surface.",
                names[a],
                names[b],
                most_tipped()
            ));
            continue;
        }
        if is_open {
            said.push(format!(
                "no place was found for the {} points picked in {:?} and {:?}. Check that each is the same point of \
                    the surface, and that they lie equally far apart in both.",
                count, names[a], names[b]
            ));
            continue;
        }
        let far = group_of(a).filter(|group| group.has(b)).and_then(|group| {
            let off = |pick: &Pick| {
                let [there, here] =
                    [0, 1].map(|side| Some(group.pose(pick.scans[side])?.transform_point3(pick.points[side])));
                Some(there?.distance(here?))
            };
            picks().filter_map(off).max_by(f64::total_cmp)
        });
        if let Some(far) = far.filter(|far| *far > FAR_PICK * views[a].coarse.cell.max(views[b].coarse.cell)) {
            said.push(format!(
                "points picked in {:?} and {:?} lie {} apart in the result",
                names[a],
                names[b],
                Shown::digits(far, 2)
            ));
        }
    }
    for &[a, b] in &solved.trusted {
        let link = solved.links.iter().find(|looked| [looked.link.a, looked.link.b] == [a, b]);
        let what = match (pair_of(a, b).map(|pair| pair.finding), link) {
            (None | Some(Finding::Nothing), _) | (_, None) => "do not touch",
            (_, Some(link)) if link.is_off() => "do not fit exactly",
            (Some(Finding::Ambiguous | Finding::Walls), _) => "fit in several places: the likeliest was taken",
            (Some(Finding::Slides), _) => "may turn or slide on each other",
            (Some(Finding::Loose | Finding::SeenThrough | Finding::Little | Finding::Background), _) => {
                "fit badly: one of many places was taken"
            }
            _ => continue,
        };
        said.push(format!("{:?} and {:?} are trusted to touch, but {what}", names[a], names[b]));
    }
    for ([a, b], more) in &solved.outvoted {
        said.push(format!(
            "{:?} and {:?} were said to touch, and were not held together: {more} more pairs that fit by themselves hold without that. \
                Check the pair and its points, or reject those pairs.",
            names[*a], names[*b]
        ));
    }
    if solved.at_odds.is_empty() && solved.inside.iter().filter(|fixed| **fixed).count() > 1 {
        let others = solved
            .pairs
            .iter()
            .zip(&solved.standings)
            .filter(|(pair, standing)| pair.finding == Finding::Sure && **standing == Standing::Disagrees);
        let others: Vec<&Pair> = others.map(|(pair, _)| pair).collect();
        if let Some(first) = others.first() {
            said.push(format!(
                "scans that are fixed may not lie where they belong: {} that fit by themselves say otherwise, {:?} and {:?} for one",
                if others.len() == 1 { "1 pair".to_owned() } else { format!("{} pairs", others.len()) }, names[first.a], names[first.b]
            ));
        }
    }
    said
}

/// Fixed scans that contradict each other, the worst first.
fn fixed_at_odds(names: &[&str], solved: &Solved) -> Option<String> {
    let mut worst: Vec<&AtOdds> = solved.at_odds.iter().collect();
    worst.sort_by(|x, y| y.far.total_cmp(&x.far).then(x.scans.cmp(&y.scans)));
    let shown = worst.iter().take(MOST_NAMED).map(|at_odds| {
        let [a, b] = at_odds.scans;
        format!("{:?} and {:?} are off by {}", names[a], names[b], Shown::digits(at_odds.far, 2))
    });
    let shown: Vec<String> = shown.collect();
    match worst.len().saturating_sub(MOST_NAMED) {
        _ if worst.is_empty() => None,
        0 => Some(shown.join(", ")),
        more => Some(format!("{} and {more} more", shown.join(", "))),
    }
}

/// Pairs of which more is asked for than noise allows.
fn too_exact(solved: &Solved) -> Option<String> {
    let tolerance = solved.limits.tolerance?;
    let refused = solved.pairs.iter().filter(|pair| pair.finding == Finding::Loose);
    let refused = refused.map(|pair| &pair.modes[0].verdict).filter(|verdict| is_noise(verdict));
    let far: Vec<f64> = refused.map(|verdict| verdict.mean_square.sqrt()).collect();
    let most = far.iter().copied().fold(0.0, f64::max);
    (!far.is_empty()).then(|| {
        format!(
            "tolerance, {}, is smaller than the noise: {} refused that noise alone puts up to {} apart. Raise it, or leave it out.",
            Shown::digits(tolerance, 2),
            counted(far.len() as u64, "pair of scans was", "pairs of scans were"),
            Shown::digits(most, 2)
        )
    })
}

/// Whether surfaces lie no further apart than noise explains.
fn is_noise(verdict: &Verdict) -> bool {
    verdict.mean_square.sqrt() <= APART * verdict.expected
}

/// Picked points that lie so many coarse cells apart in the end are not the same.
const FAR_PICK: f64 = 3.0;

/// Names in a message.
const MOST_NAMED: usize = 5;

fn quoted(names: &[&str]) -> String {
    let shown: Vec<String> = names.iter().take(MOST_NAMED).map(|name| format!("{name:?}")).collect();
    let rest = names.len().saturating_sub(MOST_NAMED);
    if rest > 0 { format!("{} and {rest} more", shown.join(", ")) } else { shown.join(", ") }
}
