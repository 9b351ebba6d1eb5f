//! Pairs are searched until all scans are joined: the likeliest first, then those between groups, then these thoroughly.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;
use std::sync::OnceLock;

use glam::DAffine3;
use rayon::prelude::*;

use crate::assemble::{AGREE, Limit, Standing, apart_at_first, assemble};
use crate::constraints::{Inside, Ordered, Pick, Told, is_enough};
use crate::doubts::{Doubted, take_out};
use crate::finding::{Finding, Limits, find};
use crate::gravity::keeps_up;
use crate::group::Group;
use crate::hypothesise::Effort;
use crate::judge::touching_share;
use crate::linear::apart;
use crate::pair::Pair;
use crate::params::AlignParams;
use crate::reach::{Bound, ROUGH_REACH, moved};
use crate::retrieve::likeness;
use crate::sequence::{Steps, followed};
use crate::stages::COMPARING;
use crate::turntable::Table;
use crate::view::View;
use base::error::Result;
use base::progress::Progress;
use geom::rigid_fit::RigidFit;

/// Partners of each scan that are tried first, and of each group in each round after that.
const FIRST: usize = 5;
const OF_GROUP: usize = 24;
/// Partners of each piece of a recording: the frames of one show the same.
const OF_PIECE: usize = 6;
/// Partners of each scan with a rough pose, those that share most where they were given: looked at near there, and wherever they fit.
const NEAREST: usize = 24;
const BESIDE: usize = 8;
/// Up to so many scans all pairs between groups are searched in the end, if need be.
const FEW_SCANS: usize = 40;
/// Partners of each fixed scan: those that share most with it where it stands, and those that look most like it.
const FIXED: usize = 4;
/// Rounds of joining groups.
const ROUNDS: usize = 6;

/// Least share of the frames of a recording that fit the one before, if nobody says that they are a sequence.
const FOLLOWED: f64 = 0.5;

/// The outcome of the search.
pub(crate) struct Found {
    pub pairs: Vec<Pair>,
    pub standings: Vec<Standing>,
    pub groups: Vec<Group>,
    /// Scans that fit others, but nothing tells where they belong.
    pub doubted: Doubted,
    /// The turntable, where there was one and it was found.
    pub table: Option<Table>,
    /// The scans in the order of the recording, where they were followed.
    pub sequence: Option<Vec<usize>>,
    /// Pairs that the caller names, but against which others speak: how many more of these hold without it.
    pub outvoted: BTreeMap<[usize; 2], usize>,
    /// Fixed scans that contradict each other.
    pub at_odds: Vec<AtOdds>,
}

/// Two fixed scans that do not lie beside each other as scans that fit both have them, and how far the second is off.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AtOdds {
    pub scans: [usize; 2],
    pub far: f64,
}

impl AtOdds {
    /// Of two fixed scans, if they do not lie as a motion that fits has them. `slack` is how far they may be off.
    pub fn of(views: &[View], scans: [usize; 2], a_from_b: &DAffine3, slack: f64) -> Option<Self> {
        let both = scans.map(|scan| &views[scan]);
        let [given_a, given_b] = both.map(|view| view.reduced.world_from_local());
        let far = apart(&(given_a.inverse() * given_b), a_from_b, both[0].reduced.radius.min(both[1].reduced.radius));
        (far > slack).then(|| AtOdds { scans, far: moved(both[1], &(given_a * *a_from_b)) })
    }
}

/// So many pairs that are sure must be lost to one that the caller names, so that they win: twice as many if that fits by itself.
const OUTVOTED: usize = 3;
/// Pairs that the caller names, of which it is tried whether others hold without it.
const SUSPECTED: usize = 16;

struct Search<'a, 'p> {
    views: &'a [View],
    inside: &'a Inside,
    limits: Limits,
    bound: &'a Bound,
    progress: &'a Progress<'p>,
    /// How much scans look like each other. Found when first asked for.
    likeness: OnceLock<Vec<Vec<f64>>>,
    pairs: BTreeMap<[usize; 2], Pair>,
    /// Those that were searched thoroughly.
    thorough: BTreeSet<[usize; 2]>,
    table: Option<Table>,
    /// How far the sensor moves from frame to frame, of a recording.
    steps: Option<Steps>,
    outvoted: BTreeMap<[usize; 2], usize>,
    /// Pairs of scans with rough poses that are looked at wherever they fit.
    beside: BTreeSet<[usize; 2]>,
}

/// Finds pairs and joins them to groups.
pub(crate) fn search(
    views: &[View],
    params: &AlignParams,
    inside: &Inside,
    bound: &Bound,
    progress: &Progress<'_>,
) -> Result<Found> {
    let limits = Limits::of(params);
    let mut search = Search {
        views,
        inside,
        limits,
        bound,
        progress,
        likeness: OnceLock::new(),
        pairs: BTreeMap::new(),
        thorough: BTreeSet::new(),
        table: None,
        steps: None,
        outvoted: BTreeMap::new(),
        beside: BTreeSet::new(),
    };
    let count = views.len();
    progress.stage(COMPARING, (count * (count - 1) / 2).min(count * OF_GROUP) as u64);
    search.told()?;
    if bound.binds() {
        search.near(params)?;
    }
    let alone: Vec<usize> = (0..count).collect();
    if let Some(told) = &inside.turned {
        search.turned(told)?;
    }
    match &inside.sequence {
        Some(order) if search.followed(order)? => {}
        _ => search.round(likeliest(search.likeness()?, &alone, FIRST, |_| true), Effort::Quick)?,
    }
    let mut found = search.joined();
    for effort in [Effort::Quick, Effort::Thorough] {
        for _ in 0..ROUNDS {
            if found.0.len() == 1 {
                break;
            }
            let most = match (&search.steps, count) {
                (Some(_), _) => OF_PIECE,
                (None, ..=FEW_SCANS) => usize::MAX,
                (None, _) => OF_GROUP,
            };
            let group_of = numbers(&found.0, count);
            let wanted = likeliest(search.likeness()?, &group_of, most, |pair| {
                search.is_open(*pair)
                    && search.is_new(*pair, effort)
                    && (!bound.binds() || search.beside.contains(pair))
            });
            if wanted.is_empty() {
                break;
            }
            let before = found.0.len();
            search.round(wanted, effort)?;
            found = search.joined();
            // Scans that are less alike join no more.
            if search.steps.is_none() && count > FEW_SCANS && found.0.len() == before {
                break;
            }
        }
    }
    let (mut groups, mut standings) = found;
    let at_odds = search.at_odds(&standings)?;
    let outvoted = std::mem::take(&mut search.outvoted);
    let pairs: Vec<Pair> = search.pairs.into_values().collect();
    let is_heap = search.steps.is_none() && search.table.is_none() && !bound.binds();
    let doubted = match is_heap {
        true => take_out(views, inside, &pairs, &mut groups, &mut standings),
        false => Doubted::default(),
    };
    let sequence = search.steps.and(inside.sequence.as_ref()).map(|order| order.frames.clone());
    Ok(Found { pairs, standings, groups, doubted, table: search.table, sequence, outvoted, at_odds })
}

/// Pairs of scans of different groups: of each group the likeliest with any other.
fn likeliest(
    likeness: &[Vec<f64>],
    group_of: &[usize],
    most: usize,
    is_wanted: impl Fn(&[usize; 2]) -> bool,
) -> Vec<[usize; 2]> {
    let count = group_of.len();
    let mut of_group: BTreeMap<usize, Vec<(f64, [usize; 2])>> = BTreeMap::new();
    for a in 0..count {
        for b in (0..count).filter(|&b| group_of[b] != group_of[a]) {
            let pair = [a.min(b), a.max(b)];
            if is_wanted(&pair) {
                of_group.entry(group_of[a]).or_default().push((likeness[a][b], pair));
            }
        }
    }
    let mut wanted = Vec::new();
    for mut pairs in of_group.into_values() {
        pairs.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.cmp(&y.1)));
        wanted.extend(pairs.into_iter().take(most).map(|(_, pair)| pair));
    }
    wanted.sort_unstable();
    wanted.dedup();
    wanted
}

/// Of each scan the pairs of the largest value.
fn most_of_each(pairs: &[(f64, [usize; 2])], most: usize) -> BTreeSet<[usize; 2]> {
    let mut of_scan: BTreeMap<usize, Vec<(f64, [usize; 2])>> = BTreeMap::new();
    for &(value, pair) in pairs {
        pair.iter().for_each(|scan| of_scan.entry(*scan).or_default().push((value, pair)));
    }
    let mut kept = BTreeSet::new();
    for mut pairs in of_scan.into_values() {
        pairs.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.cmp(&y.1)));
        kept.extend(pairs.into_iter().take(most).map(|(_, pair)| pair));
    }
    kept
}

/// Of each scan on a turntable those that were taken just before and after.
fn neighbours(angles: &[f64]) -> Vec<[usize; 2]> {
    let turn = |k: usize| angles[k].rem_euclid(TAU);
    let mut order: Vec<usize> = (0..angles.len()).collect();
    order.sort_by(|&a, &b| turn(a).total_cmp(&turn(b)).then(a.cmp(&b)));
    let count = order.len();
    let beside = |k: usize| (1..=2).map(move |by| (k, (k + by) % count));
    let pairs = (0..count).flat_map(beside).map(|(x, y)| [order[x].min(order[y]), order[x].max(order[y])]);
    let mut pairs: Vec<[usize; 2]> = pairs.filter(|[a, b]| a != b).collect();
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}

fn numbers(groups: &[Group], count: usize) -> Vec<usize> {
    let mut group_of = vec![0; count];
    for (number, group) in groups.iter().enumerate() {
        group.members.iter().for_each(|member| group_of[member.0] = number);
    }
    group_of
}

impl Search<'_, '_> {
    fn likeness(&self) -> Result<&[Vec<f64>]> {
        if let Some(found) = self.likeness.get() {
            return Ok(found);
        }
        let found = likeness(self.views, self.progress)?;
        Ok(self.likeness.get_or_init(|| found))
    }

    fn round(&mut self, wanted: Vec<[usize; 2]>, effort: Effort) -> Result<()> {
        let (views, limits, bound) = (self.views, self.limits, self.bound);
        let wanted: Vec<[usize; 2]> = wanted.into_iter().filter(|pair| self.is_new(*pair, effort)).collect();
        let table = self.table.clone();
        let search = |a: usize, b: usize| match &table {
            Some(table) => table.pair(views, a, b, bound, &limits),
            None => Pair::search(views, a, b, effort, bound, &limits),
        };
        self.add(&wanted, |a, b| Some(search(a, b)))?;
        if effort == Effort::Thorough {
            self.thorough.extend(wanted);
        }
        Ok(())
    }

    /// Whether a pair was not searched yet, or not so thoroughly and is not sure.
    fn is_new(&self, pair: [usize; 2], effort: Effort) -> bool {
        match self.pairs.get(&pair) {
            None => true,
            Some(found) => {
                let is_told = self.inside.is_trusted(pair[0], pair[1]);
                effort == Effort::Thorough
                    && self.table.is_none()
                    && found.finding != Finding::Sure
                    && !is_told
                    && !self.is_decided(pair)
                    && !self.thorough.contains(&pair)
            }
        }
    }

    /// Whether a thorough search of two scans would find no more: of a room. Walls fit walls by very many motions, and more of
    /// these are no better: of 576 pairs of virtual rooms that were searched thoroughly, half of all time, none came out right that was not
    /// found quickly, and one wrong.
    fn is_decided(&self, pair: [usize; 2]) -> bool {
        !self.bound.binds() && pair.iter().all(|&scan| self.views[scan].is_of_room())
    }

    fn add(&mut self, wanted: &[[usize; 2]], find: impl Fn(usize, usize) -> Option<Pair> + Sync) -> Result<()> {
        let found = wanted.par_iter().filter(|pair| self.is_open(**pair)).map(|&[a, b]| {
            self.progress.advance(1)?;
            Ok(find(a, b))
        });
        let found: Vec<Option<Pair>> = found.collect::<Result<_>>()?;
        self.pairs.extend(found.into_iter().flatten().map(|pair| ([pair.a, pair.b], pair)));
        Ok(())
    }

    /// Whether two scans may be compared at all.
    fn is_open(&self, [a, b]: [usize; 2]) -> bool {
        let both_fixed = self.inside.is_fixed[a] && self.inside.is_fixed[b];
        !both_fixed && !self.inside.rejected.contains(&[a, b])
    }

    fn joined(&mut self) -> (Vec<Group>, Vec<Standing>) {
        let pairs: Vec<Pair> = self.pairs.values().cloned().collect();
        let (groups, standings) = self.beside_told(&pairs);
        let is_wrong = |(pair, standing): (&Pair, &Standing)| {
            pair.finding == Finding::Sure && *standing == Standing::Disagrees && !self.is_trusted(pair)
        };
        let repeats = pairs.iter().zip(&standings).any(is_wrong);
        match &mut self.steps {
            Some(steps) if repeats && !steps.repeats => {
                steps.repeats = true;
                self.beside_told(&pairs)
            }
            _ => (groups, standings),
        }
    }

    fn is_trusted(&self, pair: &Pair) -> bool {
        self.inside.is_trusted(pair.a, pair.b) && !self.outvoted.contains_key(&[pair.a, pair.b])
    }

    /// The pairs joined, but for those that are outvoted.
    fn assembled(&self, pairs: &[Pair], outvoted: &BTreeMap<[usize; 2], usize>) -> (Vec<Group>, Vec<Standing>) {
        let groups = apart_at_first(self.views, &self.inside.is_fixed);
        let limit = Limit { bound: self.bound, steps: self.steps.as_ref(), is_fixed: &self.inside.is_fixed };
        let is_out = |pair: &Pair| outvoted.contains_key(&[pair.a, pair.b]);
        let is_trusted = |pair: &Pair| self.inside.is_trusted(pair.a, pair.b) && !is_out(pair);
        if outvoted.is_empty() {
            return assemble(self.views, pairs, groups, limit, is_trusted);
        }
        let mut left = pairs.to_vec();
        left.iter_mut().filter(|pair| is_out(pair)).for_each(|pair| pair.finding = Finding::Nothing);
        let (groups, mut standings) = assemble(self.views, &left, groups, limit, is_trusted);
        let out = pairs.iter().zip(&mut standings).filter(|(pair, _)| is_out(pair) && !pair.modes.is_empty());
        out.for_each(|(_, standing)| *standing = Standing::Disagrees);
        (groups, standings)
    }

    /// The pairs joined. A pair that the caller names is left out if that lets many more hold that are sure: what it joins is then against
    /// all that these say. Pairs of rooms that fit by themselves are not, since a room may repeat itself and only the caller know where.
    fn beside_told(&mut self, pairs: &[Pair]) -> (Vec<Group>, Vec<Standing>) {
        let mut out = BTreeMap::new();
        let mut found = self.assembled(pairs, &out);
        self.outvoted.clear();
        if self.inside.trusted.is_empty() && self.inside.picks.is_empty() {
            return found;
        }
        let is_untold = |pair: &Pair| pair.finding == Finding::Sure && !self.inside.is_trusted(pair.a, pair.b);
        let count = |standings: &[Standing], wanted: fn(&Standing) -> bool| {
            pairs.iter().zip(standings).filter(|(pair, standing)| is_untold(pair) && wanted(standing)).count()
        };
        let holds = |standing: &Standing| matches!(standing, Standing::Joins | Standing::Agrees);
        let is_refused = |standing: &Standing| matches!(standing, Standing::Disagrees | Standing::SeenThrough);
        let needed = |pair: &Pair| match pair.finding {
            Finding::Sure if [pair.a, pair.b].iter().all(|&scan| self.views[scan].is_of_room()) => usize::MAX,
            Finding::Sure => 2 * OUTVOTED,
            _ => OUTVOTED,
        };
        while count(&found.1, is_refused) >= OUTVOTED {
            let mut refused = vec![0; self.views.len()];
            for (pair, _) in
                pairs.iter().zip(&found.1).filter(|(pair, standing)| is_untold(pair) && is_refused(standing))
            {
                refused[pair.a] += 1;
                refused[pair.b] += 1;
            }
            let mut suspected: Vec<(usize, &Pair)> = pairs
                .iter()
                .zip(&found.1)
                .filter(|(pair, standing)| **standing == Standing::Joins && self.inside.is_trusted(pair.a, pair.b))
                .map(|(pair, _)| (refused[pair.a] + refused[pair.b], pair))
                .filter(|(against, pair)| *against > 0 && needed(pair) < usize::MAX)
                .collect();
            suspected.sort_by_key(|(against, pair)| (std::cmp::Reverse(*against), pair.a, pair.b));
            suspected.truncate(SUSPECTED);
            let held = count(&found.1, holds);
            let mut best: Option<(usize, [usize; 2], _)> = None;
            for (_, pair) in suspected {
                let mut fewer = out.clone();
                fewer.insert([pair.a, pair.b], 0);
                let without = self.assembled(pairs, &fewer);
                let more = count(&without.1, holds).saturating_sub(held);
                if more >= needed(pair) && best.as_ref().is_none_or(|best| more > best.0) {
                    best = Some((more, [pair.a, pair.b], without));
                }
            }
            let Some((more, pair, without)) = best else { break };
            out.insert(pair, more);
            found = without;
        }
        self.outvoted = out;
        found
    }

    /// Pairs of fixed scans that are sure: as they stand if they fit there, else wherever they fit. They join nothing.
    fn fixed_pairs(&self) -> Result<Vec<Pair>> {
        let (views, limits, unbound) = (self.views, self.limits, Bound::unbound());
        let fixed: Vec<usize> = (0..views.len()).filter(|&k| self.inside.is_fixed[k] && !views[k].is_empty()).collect();
        let pairs = fixed.iter().flat_map(|&a| fixed.iter().filter(move |&&b| b > a).map(move |&b| [a, b]));
        let all: Vec<[usize; 2]> = pairs.filter(|pair| !self.inside.rejected.contains(pair)).collect();
        if all.is_empty() {
            return Ok(Vec::new());
        }
        let given =
            |a: usize, b: usize| views[a].reduced.world_from_local().inverse() * views[b].reduced.world_from_local();
        let shares = all.par_iter().map(|&[a, b]| {
            self.progress.check()?;
            let (both, there) = ([&views[a], &views[b]], given(a, b));
            let back = touching_share([both[1], both[0]], &there.inverse(), 0.0);
            Ok((touching_share(both, &there, 0.0) + back, [a, b]))
        });
        let mut shares: Vec<(f64, [usize; 2])> = shares.collect::<Result<_>>()?;
        shares.retain(|(share, _)| *share > 0.0);
        let likeness = self.likeness()?;
        // Rooms repeat themselves: frames that do not touch may fit all the same.
        let is_of_rooms = |pair: &[usize; 2]| pair.iter().all(|&scan| views[scan].is_of_room());
        let like: Vec<(f64, [usize; 2])> =
            all.into_iter().filter(|pair| !is_of_rooms(pair)).map(|[a, b]| (likeness[a][b], [a, b])).collect();
        let mut wanted = most_of_each(&shares, FIXED);
        wanted.extend(most_of_each(&like, FIXED));
        let found = wanted.into_par_iter().map(|[a, b]| {
            self.progress.check()?;
            let there = Pair::given(views, a, b, &given(a, b), &limits);
            let fits_there = matches!(there.finding, Finding::Sure | Finding::Weak | Finding::Slides);
            Ok(if fits_there { there } else { Pair::search(views, a, b, Effort::Quick, &unbound, &limits) })
        });
        let mut found: Vec<Pair> = found.collect::<Result<_>>()?;
        found.retain(|pair| pair.finding == Finding::Sure);
        Ok(found)
    }

    /// Fixed scans that contradict each other: those that lie elsewhere beside each other where all scans are joined as if none was fixed.
    /// That is looked at if pairs that are sure are refused, or say that fixed scans belong elsewhere.
    fn at_odds(&self, standings: &[Standing]) -> Result<Vec<AtOdds>> {
        let slack = |a: usize, b: usize| AGREE * self.views[a].coarse.cell.max(self.views[b].coarse.cell);
        let of_fixed = self.fixed_pairs()?;
        let is_elsewhere = |pair: &Pair| {
            AtOdds::of(self.views, [pair.a, pair.b], &pair.modes[0].a_from_b, slack(pair.a, pair.b)).is_some()
        };
        let is_refused = |(pair, standing): (&Pair, &Standing)| {
            pair.finding == Finding::Sure && matches!(standing, Standing::Disagrees | Standing::SeenThrough)
        };
        let fixed = self.inside.is_fixed.iter().filter(|is_fixed| **is_fixed).count();
        let is_in_doubt = of_fixed.iter().any(is_elsewhere) || self.pairs.values().zip(standings).any(is_refused);
        if fixed < 2 || !is_in_doubt {
            return Ok(Vec::new());
        }
        let mut pairs: Vec<Pair> = self.pairs.values().cloned().chain(of_fixed).collect();
        let is_out = |pair: &Pair| self.outvoted.contains_key(&[pair.a, pair.b]);
        pairs.iter_mut().filter(|pair| is_out(pair)).for_each(|pair| pair.finding = Finding::Nothing);
        let (free, unbound) = (vec![false; self.views.len()], Bound::unbound());
        let limit = Limit { bound: &unbound, steps: self.steps.as_ref(), is_fixed: &free };
        let (groups, _) =
            assemble(self.views, &pairs, apart_at_first(self.views, &free), limit, |pair| self.is_trusted(pair));
        let mut found = Vec::new();
        for group in &groups {
            let mut members: Vec<(usize, DAffine3)> =
                group.members.iter().copied().filter(|member| self.inside.is_fixed[member.0]).collect();
            members.sort_by_key(|member| member.0);
            for (k, &(a, of_a)) in members.iter().enumerate() {
                for &(b, of_b) in &members[k + 1..] {
                    found.extend(AtOdds::of(self.views, [a, b], &(of_a.inverse() * of_b), slack(a, b)));
                }
            }
        }
        Ok(found)
    }

    /// Pairs that the caller names.
    fn told(&mut self) -> Result<()> {
        let mut told: Vec<[usize; 2]> = self.inside.trusted.clone();
        told.extend(self.inside.picks.iter().map(|pick| pick.scans));
        told.sort_unstable();
        told.dedup();
        let (views, inside, bound, limits) = (self.views, self.inside, self.bound, self.limits);
        self.add(&told, |a, b| Some(picked(views, inside, a, b, bound, &limits)))
    }

    /// Finds the turntable's axis where it is not given, by pairs that need none, and takes these for what they are on it.
    fn turned(&mut self, told: &Told) -> Result<()> {
        let alone: Vec<usize> = (0..self.views.len()).collect();
        for most in [FIRST, OF_GROUP] {
            self.round(likeliest(self.likeness()?, &alone, most, |_| true), Effort::Quick)?;
            let pairs: Vec<&Pair> = self.pairs.values().collect();
            self.table = Table::find(told, self.views, &pairs);
            if self.table.is_some() {
                break;
            }
        }
        let Some(table) = self.table.clone() else { return Ok(()) };
        let (views, inside, bound, limits) = (self.views, self.inside, self.bound, self.limits);
        let is_told = |pair: &Pair| inside.is_trusted(pair.a, pair.b);
        // Motions elsewhere are no turns. Pairs without a motion, or without a sure one, may get theirs on the table.
        self.pairs.retain(|_, pair| {
            is_told(pair) || (matches!(pair.finding, Finding::Sure | Finding::Weak) && table.is_on(views, pair))
        });
        let neighbours = table.angles.as_deref().map(neighbours).unwrap_or_default();
        let wanted: Vec<[usize; 2]> =
            neighbours.into_iter().filter(|pair| self.pairs.get(pair).is_none_or(|pair| !is_told(pair))).collect();
        self.add(&wanted, |a, b| Some(table.pair(views, a, b, bound, &limits)))
    }

    /// Frames of a recording, each beside the next. Says whether they are taken for a sequence.
    fn followed(&mut self, order: &Ordered) -> Result<bool> {
        let mut found = followed(self.views, &order.frames, &self.limits, self.progress)?;
        found.retain(|pair| self.is_open([pair.a, pair.b]) && !self.pairs.contains_key(&[pair.a, pair.b]));
        let steps = Steps::new(self.views, order, &found);
        let is_taken = order.is_told || steps.share() >= FOLLOWED;
        // Single frames that are far apart in a recording are a heap, in which pairs that follow each other are nothing special.
        if is_taken {
            self.pairs.extend(found.into_iter().map(|pair| ([pair.a, pair.b], pair)));
            self.steps = Some(steps);
        }
        Ok(is_taken)
    }

    /// Pairs that touch, or nearly do, where the scans lie as they are given.
    fn near(&mut self, params: &AlignParams) -> Result<()> {
        let views = self.views;
        let reach = |a: usize, b: usize| {
            params.reach.unwrap_or(ROUGH_REACH * views[a].reduced.radius.max(views[b].reduced.radius))
        };
        let motion =
            |a: usize, b: usize| views[a].reduced.world_from_local().inverse() * views[b].reduced.world_from_local();
        let touch = |&[a, b]: &[usize; 2]| {
            let far = motion(a, b).translation.length();
            far < views[a].reduced.radius + views[b].reduced.radius + reach(a, b)
        };
        let all = (0..views.len()).flat_map(|a| (a + 1..views.len()).map(move |b| [a, b]));
        let near: Vec<[usize; 2]> = all.filter(touch).collect();
        let shares = near.par_iter().map(|&[a, b]| {
            self.progress.check()?;
            let both = [&views[a], &views[b]];
            let given = motion(a, b);
            let share = |margin: f64| {
                touching_share(both, &given, margin) + touching_share([both[1], both[0]], &given.inverse(), margin)
            };
            // Surfaces that touch may not do so yet, as poses are off.
            let far = share(self.bound.apart(a, b));
            Ok((if far > 0.0 { far + share(0.0) } else { 0.0 }, [a, b]))
        });
        let mut shares: Vec<(f64, [usize; 2])> = shares.collect::<Result<_>>()?;
        shares.retain(|(share, _)| *share > 0.0);
        self.beside = most_of_each(&shares, BESIDE);
        let nearest = most_of_each(&shares, NEAREST);
        let wanted: Vec<[usize; 2]> = nearest.into_iter().filter(|pair| !self.pairs.contains_key(pair)).collect();
        let (bound, limits) = (self.bound, self.limits);
        self.add(&wanted, |a, b| {
            let start = motion(a, b);
            let pair = Pair::near(views, a, b, &start, reach(a, b), &limits);
            let is_allowed = pair.modes.first().is_some_and(|mode| bound.allows(views, [a, b], &mode.a_from_b));
            (is_allowed && matches!(pair.finding, Finding::Sure | Finding::Weak | Finding::Slides)).then_some(pair)
        })
    }
}

/// Picks are exact to so many coarse cells.
pub(crate) const PICKED: f64 = 6.0;

/// How far apart a motion of two scans leaves the points of a pick, at most.
pub(crate) fn furthest(picks: &[&Pick], a_from_b: &DAffine3) -> f64 {
    picks.iter().map(|pick| a_from_b.transform_point3(pick.points[1]).distance(pick.points[0])).fold(0.0, f64::max)
}

/// The motion of two scans that their picks give, by coarse cells of a width. `None` where they are too few.
pub(crate) fn motion_of(picks: &[&Pick], cell: f64) -> Option<DAffine3> {
    let with_normals = picks.iter().filter(|pick| pick.normals.is_some()).count();
    if !is_enough(picks.len(), with_normals) {
        return None;
    }
    let mut fit = RigidFit::new();
    for pick in picks {
        fit.point(pick.points[1], pick.points[0], pick.weight);
        if let Some(normals) = pick.normals {
            fit.direction(normals[1], normals[0], pick.weight * (4.0 * cell) * (4.0 * cell));
        }
    }
    fit.solve()
}

/// The motion of two scans that the caller joins: by picks where they give one, else the likeliest that agrees with them.
fn picked(views: &[View], inside: &Inside, a: usize, b: usize, bound: &Bound, limits: &Limits) -> Pair {
    let picks: Vec<&Pick> = inside.picks_of(a, b).collect();
    let both = [&views[a], &views[b]];
    let cell = both[0].coarse.cell.max(both[1].coarse.cell);
    let off = |motion: &DAffine3| furthest(&picks, motion);
    if let Some(start) = motion_of(&picks, cell) {
        let nothing = Pair { a, b, modes: Vec::new(), finding: Finding::Nothing, beyond: None };
        if off(&start) > PICKED * cell {
            return nothing;
        }
        let mut pair = Pair::near(views, a, b, &start, PICKED * cell, limits);
        pair.modes.retain(|mode| off(&mode.a_from_b) < PICKED * cell && keeps_up(both, &mode.a_from_b));
        return match pair.modes.is_empty() {
            false => pair,
            true if keeps_up(both, &start) => Pair::given(views, a, b, &start, limits),
            true => nothing,
        };
    }
    let mut pair = Pair::search(views, a, b, Effort::Thorough, bound, limits);
    pair.modes.retain(|mode| picks.is_empty() || off(&mode.a_from_b) < PICKED * cell);
    // Fewer picks choose among the places that shape gives, and must leave one.
    if !picks.is_empty() && !inside.trusted.contains(&[a, b]) {
        pair.finding = find([&views[a], &views[b]], &pair.modes, limits);
        if !matches!(pair.finding, Finding::Sure | Finding::Weak) {
            pair.modes.clear();
        }
    }
    if pair.modes.is_empty() {
        pair.finding = Finding::Nothing;
    }
    pair
}
