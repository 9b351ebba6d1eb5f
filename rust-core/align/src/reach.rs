//! How far scans with rough poses may be placed from where they were given.
//!
//! A scan's displacement is that of the corner of its box that moves most: the box of its samples along the axes of its own frame. Between
//! two poses distances are convex over space, so that no sample moves further.

use glam::{BVec3, DAffine3, DVec3};

use base::error::Shown;
use base::log::{self, Level};

use crate::constraints::Inside;
use crate::params::{AlignParams, Start};
use crate::view::View;

/// By default rough poses are off by this share of a scan's radius.
pub(crate) const ROUGH_REACH: f64 = 0.2;
/// Two scans may lie so many times both their reaches from where they were given beside each other: of what they do not share, corners
/// move further than what they share.
const LEVER: f64 = 1.5;

/// How far each scan may be placed from where it was given.
pub(crate) struct Bound {
    /// By the numbers inside, 0 for scans that are fixed. `None` where nothing is known of poses.
    reaches: Option<Vec<f64>>,
    /// Whether poses are said to be rough, but no scan has one.
    is_without_poses: bool,
    /// Whether all sensors then stand at one place as well: nobody has placed the scans. Else they may be in the world already.
    is_at_one_place: bool,
}

/// Why scans have no place where rough poses were said to be there.
const NO_POSES: &str = "no scan has a pose, and start = \"rough\" looks near poses alone. Say \"unknown\" instead, \
    or \"sequence\" for frames in their order, or give the poses.";

/// Says that a reach was given where it bounds nothing.
pub(crate) fn unused(params: &AlignParams) -> Option<String> {
    let reach = params.reach.filter(|_| params.start != Start::Rough)?;
    Some(format!(
        "reach, {}, is not used: it bounds rough poses, and start is not rough. Say start = \"rough\".",
        Shown(reach)
    ))
}

/// How far a scan lies from where it was given, by the corner of its box that moves most.
pub(crate) fn moved(view: &View, world_from_local: &DAffine3) -> f64 {
    let given = view.reduced.world_from_local();
    let [lo, hi] = view.reduced.bounds;
    let off = |corner: u32| {
        let at = DVec3::select(BVec3::new(corner & 1 > 0, corner & 2 > 0, corner & 4 > 0), hi, lo);
        world_from_local.transform_point3(at).distance(given.transform_point3(at))
    };
    (0..8).map(off).fold(0.0, f64::max)
}

impl Bound {
    pub fn of(views: &[View], params: &AlignParams, inside: &Inside) -> Self {
        let reach = |(k, view): (usize, &View)| match inside.is_fixed[k] {
            true => 0.0,
            false => params.reach.unwrap_or(ROUGH_REACH * view.reduced.radius),
        };
        let is_rough = params.start == Start::Rough;
        if let Some(words) = unused(params) {
            log::tell(Level::Warning, &words);
        }
        let is_unplaced = |view: &View| view.reduced.world_from_scan == DAffine3::IDENTITY;
        let is_without_poses = is_rough && !inside.is_fixed.contains(&true) && views.iter().all(is_unplaced);
        let eye = |view: &View| view.reduced.eye;
        let first = views.first().and_then(eye);
        Bound {
            reaches: is_rough.then(|| views.iter().enumerate().map(reach).collect()),
            is_without_poses,
            is_at_one_place: is_without_poses && first.is_some() && views.iter().all(|view| eye(view) == first),
        }
    }

    /// None.
    pub fn unbound() -> Self {
        Bound { reaches: None, is_without_poses: false, is_at_one_place: false }
    }

    /// Says that no scan has a pose, where rough poses were said to be there. Scans that are in the world already fit there, and some of them
    /// are placed.
    pub fn no_poses(&self, is_any_placed: bool) -> Option<&'static str> {
        (self.is_at_one_place || (self.is_without_poses && !is_any_placed)).then_some(NO_POSES)
    }

    /// Whether there is one.
    pub fn binds(&self) -> bool {
        self.reaches.is_some()
    }

    /// How far a scan may be placed from where it was given.
    pub fn reach(&self, scan: usize) -> f64 {
        self.reaches.as_ref().map_or(f64::INFINITY, |reaches| reaches[scan])
    }

    /// How far a scan would lie from where it was given, if that is too far.
    pub fn beyond(&self, views: &[View], scan: usize, world_from_local: &DAffine3) -> Option<f64> {
        if !self.binds() {
            return None;
        }
        let moved = moved(&views[scan], world_from_local);
        (moved > self.reach(scan)).then_some(moved)
    }

    /// How far a point of one of two scans may lie from where it was given beside the other.
    pub fn apart(&self, a: usize, b: usize) -> f64 {
        LEVER * (self.reach(a) + self.reach(b))
    }

    /// Whether two scans may lie so beside each other: both may be off, either way.
    pub fn allows(&self, views: &[View], [a, b]: [usize; 2], a_from_b: &DAffine3) -> bool {
        if !self.binds() {
            return true;
        }
        let [given_a, given_b] = [a, b].map(|k| views[k].reduced.world_from_local());
        let off = moved(&views[b], &(given_a * *a_from_b)).min(moved(&views[a], &(given_b * a_from_b.inverse())));
        off <= self.apart(a, b)
    }

    /// Whether the scans of a group that is not settled yet may lie as they do, to `slack`: without fixed scans the group's frame is that
    /// of the largest, the first, which may be off as well.
    pub fn allows_all(
        &self,
        views: &[View],
        members: &[(usize, DAffine3)],
        is_fixed: &[bool],
        slack: impl Fn(usize) -> f64,
    ) -> bool {
        let Some((frame, in_group)) = members.iter().min_by_key(|member| member.0) else { return true };
        if !self.binds() {
            return true;
        }
        let (world_from_group, off) = match members.iter().any(|member| is_fixed[member.0]) {
            true => (DAffine3::IDENTITY, 0.0),
            false => (views[*frame].reduced.world_from_local() * in_group.inverse(), self.reach(*frame)),
        };
        members.iter().all(|(scan, pose)| {
            moved(&views[*scan], &(world_from_group * *pose)) <= self.reach(*scan) + off + slack(*scan)
        })
    }
}
