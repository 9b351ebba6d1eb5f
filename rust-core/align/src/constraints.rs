//! Knowledge of the caller about the scans.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use crate::params::{AlignParams, Start, Turntable};
use crate::view::View;
use base::error::{Error, Result, Shown};

/// A point that two scans show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pick {
    /// The scans, by their numbers.
    pub scans: [usize; 2],
    /// The place of the point, in each scan's own frame.
    pub points: [DVec3; 2],
    /// Outward normals there, in the scans' frames, where known: two picks with normals already give a pose.
    pub normals: Option<[DVec3; 2]>,
    /// Its weight: 1 counts as much as a two-thousandth of the smaller scan's surface, so that it chooses a place, and shape where in it.
    pub weight: f64,
}

impl Pick {
    /// The same, the scan with the smaller number first.
    fn sorted(mut self) -> Self {
        if self.scans[0] > self.scans[1] {
            self.scans.reverse();
            self.points.reverse();
            self.normals = self.normals.map(|[a, b]| [b, a]);
        }
        self
    }
}

/// Weights of picks that make a difference and leave numbers sound.
const WEIGHTS: std::ops::RangeInclusive<f64> = 1e-6..=1e6;
/// Most that a turntable may have been turned, in radians: degrees by mistake are more.
const MOST_TURNED: f64 = 100.0;
/// A pick lies no further from a scan, by its size.
const ASTRAY: f64 = 2.0;
/// Picks lie in a line if none is further from it than this share of their distance along it. The sine of a normal beside that line.
const LINE: f64 = 0.02;

/// The axis of a turntable, in the frame that all scans were taken in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    /// A point of it.
    pub point: DVec3,
    /// Its direction, of any length but 0.
    pub direction: DVec3,
}

/// Knowledge of the caller: empty by default.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Constraints {
    /// Scans that stay where they are, by their numbers.
    pub fixed: Vec<usize>,
    /// Points that two scans show.
    pub picks: Vec<Pick>,
    /// Pairs of scans that touch: what fits them best is used, even if it is not sure.
    pub trusted: Vec<[usize; 2]>,
    /// Pairs of scans that must not be compared.
    pub rejected: Vec<[usize; 2]>,
    /// The axis of the turntable that the object stood on. Found where it is not given and `turntable` says that there was one.
    pub axis: Option<Axis>,
    /// By how much the turntable was turned when each scan was taken, in radians, counter-clockwise where the axis points to the
    /// viewer. Either way round if the axis is not given. Empty where that is not known.
    pub angles: Vec<f64>,
}

impl Constraints {
    /// Refuses constraints that don't go together for so many scans.
    ///
    /// # Errors
    /// A number of a scan that isn't there. A pair of a scan with itself, or both trusted and rejected. Numbers that are not finite, a
    /// weight that is not positive, a normal or an axis without direction. Picks of two scans that are the same point of one of them, or
    /// three and more that lie in a line. Angles for another number of scans.
    pub fn validate(&self, count: usize) -> Result<()> {
        let known = |what: &str, scan: usize| match scan < count {
            true => Ok(()),
            false => Err(Error::input(format!("{what} names scan {scan}, but there are {count} (counted from 0)"))),
        };
        let pair = |what: &str, scans: [usize; 2]| {
            known(what, scans[0])?;
            known(what, scans[1])?;
            if scans[0] == scans[1] {
                return Err(Error::input(format!("{what} names scan {} twice: it takes two scans", scans[0])));
            }
            Ok(())
        };
        for &scan in &self.fixed {
            known("fixed", scan)?;
        }
        for &scans in &self.trusted {
            pair("trusted", scans)?;
            if self.rejected.iter().any(|other| *other == scans || *other == [scans[1], scans[0]]) {
                return Err(Error::input(format!(
                    "scans {} and {} are both trusted and rejected: choose one of the \
                    two",
                    scans[0], scans[1]
                )));
            }
        }
        for &scans in &self.rejected {
            pair("rejected", scans)?;
        }
        for (number, pick) in self.picks.iter().enumerate() {
            let what = format!("pick {number}");
            pair(&what, pick.scans)?;
            if !pick.points.iter().all(|point| point.is_finite()) {
                return Err(Error::input(format!("{what}: all coordinates must be finite")));
            }
            if !WEIGHTS.contains(&pick.weight) {
                let (least, most) = WEIGHTS.into_inner();
                return Err(Error::input(format!("{what}: its weight must be {least} to {most}, got {}", pick.weight)));
            }
            if pick.normals.is_some_and(|normals| normals.iter().any(|n| !(n.length() > 0.0 && n.is_finite()))) {
                return Err(Error::input(format!("{what}: a normal must be finite and not 0")));
            }
        }
        self.picks_tell_poses()?;
        if let Some(axis) = &self.axis
            && !(axis.point.is_finite() && axis.direction.is_finite() && axis.direction.length() > 0.0)
        {
            return Err(Error::input("the turntable's axis must have finite numbers and a direction that is not 0"));
        }
        if !self.angles.is_empty() && self.angles.len() != count {
            let given = self.angles.len();
            return Err(Error::input(format!(
                "{given} angles of the turntable are given for {count} scans: give one a scan"
            )));
        }
        if let Some(place) = self.angles.iter().position(|angle| !(angle.abs() <= MOST_TURNED)) {
            let angle = self.angles[place];
            return Err(Error::input(format!(
                "the turntable's angle of scan {place} must be a number of radians up to {MOST_TURNED}, got {angle}"
            )));
        }
        Ok(())
    }

    /// Refuses picks that are equal, and three or more that lie in a line, about which the scans may turn: a fit of them is one of many.
    fn picks_tell_poses(&self) -> Result<()> {
        let mut of_pair: BTreeMap<[usize; 2], Vec<(usize, Pick)>> = BTreeMap::new();
        for (number, &pick) in self.picks.iter().enumerate() {
            let pick = pick.sorted();
            of_pair.entry(pick.scans).or_default().push((number, pick));
        }
        for (scans, picks) in &of_pair {
            for (side, scan) in scans.iter().enumerate() {
                let points: Vec<DVec3> = picks.iter().map(|(_, pick)| pick.points[side]).collect();
                let mut known: BTreeMap<[u64; 3], usize> = BTreeMap::new();
                for ((number, _), point) in picks.iter().zip(&points) {
                    if let Some(first) = known.insert(point.to_array().map(|x| (x + 0.0).to_bits()), *number) {
                        return Err(Error::input(format!(
                            "picks {first} and {number} are the same point of scan {scan}: pick points that lie apart in both scans"
                        )));
                    }
                }
                let normals: Vec<DVec3> =
                    picks.iter().filter_map(|(_, pick)| Some(pick.normals?[side].normalize())).collect();
                if is_enough(points.len(), normals.len()) && lie_in_line(&points, &normals) {
                    return Err(Error::input(format!(
                        "the {} picks of scans {} and {} lie in a line in scan {scan}. The scans may turn about it: pick a point beside it.",
                        points.len(),
                        scans[0],
                        scans[1]
                    )));
                }
            }
        }
        Ok(())
    }

    /// Refuses points that lie far from the scans that they are picked in.
    pub(crate) fn lie_on(&self, order: &[usize], views: &[View]) -> Result<()> {
        for (number, pick) in self.picks.iter().enumerate() {
            for (scan, point) in pick.scans.into_iter().zip(pick.points) {
                let inside = order.iter().position(|&number| number == scan).expect("the scan is there");
                let (far, size) = (point.distance(views[inside].reduced.middle), 2.0 * views[inside].reduced.radius);
                if far > ASTRAY * size {
                    return Err(Error::input(format!(
                        "pick {number}: its point in scan {scan} lies {} from the scan's middle, which is {} large: points are in the scan's own \
                         frame",
                        Shown::digits(far, 2),
                        Shown::digits(size, 2)
                    )));
                }
            }
        }
        Ok(())
    }

    /// Refuses angles beside equal ones.
    pub(crate) fn suits(&self, params: &AlignParams) -> Result<()> {
        if !self.angles.is_empty() && params.turntable == Turntable::Equal {
            return Err(Error::input("both angles and equal steps of the turntable are asked for: choose one of them"));
        }
        Ok(())
    }

    /// The same by the numbers inside, where `order` gives the number that each scan had, and in local frames.
    pub(crate) fn renumbered(
        &self,
        params: &AlignParams,
        order: &[usize],
        views: &[View],
        in_time: Option<&[(usize, u64)]>,
    ) -> Inside {
        let mut inside_of = vec![0; order.len()];
        order.iter().enumerate().for_each(|(inside, &number)| inside_of[number] = inside);
        let pair = |scans: &[usize; 2]| {
            let [a, b] = scans.map(|scan| inside_of[scan]);
            [a.min(b), a.max(b)]
        };
        let mut is_fixed = vec![false; order.len()];
        self.fixed.iter().for_each(|&scan| is_fixed[inside_of[scan]] = true);
        let mut picks: Vec<Pick> = Vec::new();
        for pick in &self.picks {
            let scans = pick.scans.map(|scan| inside_of[scan]);
            let mut pick = Pick { scans, ..*pick }.sorted();
            for side in 0..2 {
                pick.points[side] -= views[pick.scans[side]].reduced.middle;
            }
            pick.normals = pick.normals.map(|normals| normals.map(DVec3::normalize));
            picks.push(pick);
        }
        // Sums must not depend on the order given.
        let key =
            |pick: &Pick| (pick.scans, pick.points.map(|p| p.to_array().map(f64::to_bits)), pick.weight.to_bits());
        picks.sort_by_key(key);
        let mut trusted: Vec<[usize; 2]> = self.trusted.iter().map(pair).collect();
        let mut rejected: Vec<[usize; 2]> = self.rejected.iter().map(pair).collect();
        trusted.sort_unstable();
        rejected.sort_unstable();
        let equal =
            || (0..order.len()).map(|number| std::f64::consts::TAU * number as f64 / order.len() as f64).collect();
        let angles: Option<Vec<f64>> = match (self.angles.is_empty(), params.turntable) {
            (false, _) => Some(self.angles.clone()),
            (true, Turntable::Equal) => Some(equal()),
            (true, _) => None,
        };
        let is_turned = params.turntable != Turntable::No || self.axis.is_some() || angles.is_some();
        let angles = angles.map(|angles| order.iter().map(|&number| angles[number]).collect());
        let turned = is_turned.then_some(Told { axis: self.axis, angles });
        let in_order = |numbers: &[(usize, u64)], is_told: bool| {
            let (frames, places) = numbers.iter().map(|&(number, place)| (inside_of[number], place)).unzip();
            Some(Ordered { frames, places, is_told })
        };
        let sequence = match (params.start, in_time) {
            (Start::Sequence, None) => {
                Some(Ordered { frames: inside_of.clone(), places: (0..order.len() as u64).collect(), is_told: true })
            }
            (Start::Sequence, Some(numbers)) => in_order(numbers, true),
            (Start::Auto, Some(numbers)) if !is_turned => in_order(numbers, false),
            _ => None,
        };
        Inside { is_fixed, picks, trusted, rejected, turned, sequence }
    }
}

/// Whether so many picks, some of them with normals, give the pose of one scan beside another.
pub(crate) fn is_enough(picks: usize, with_normals: usize) -> bool {
    picks >= 3 || (picks == 2 && with_normals == 2)
}

/// Whether points lie in a line, and normals there along it.
fn lie_in_line(points: &[DVec3], normals: &[DVec3]) -> bool {
    let farthest = |from: DVec3| {
        points.iter().copied().max_by(|a, b| a.distance(from).total_cmp(&b.distance(from))).unwrap_or(from)
    };
    let one = farthest(points[0]);
    let along = farthest(one) - one;
    let direction = along.normalize_or_zero();
    let beside = |v: DVec3| v.cross(direction).length();
    points.iter().all(|p| beside(*p - one) <= LINE * along.length())
        && normals.iter().all(|normal| beside(*normal) <= LINE)
}

/// [`Constraints`] by the numbers inside. Of each pair the smaller first.
#[derive(Clone)]
pub(crate) struct Inside {
    pub is_fixed: Vec<bool>,
    pub picks: Vec<Pick>,
    pub trusted: Vec<[usize; 2]>,
    pub rejected: Vec<[usize; 2]>,
    pub turned: Option<Told>,
    /// The order of a recording, where each scan follows the one before.
    pub sequence: Option<Ordered>,
}

/// Scans in the order they were taken in.
#[derive(Clone)]
pub(crate) struct Ordered {
    pub frames: Vec<usize>,
    /// Their places in the recording, which count frames that are missing.
    pub places: Vec<u64>,
    /// Whether the caller says that each follows the one before. Otherwise the recording's list alone does.
    pub is_told: bool,
}

/// Knowledge of a turntable.
#[derive(Clone)]
pub(crate) struct Told {
    pub axis: Option<Axis>,
    pub angles: Option<Vec<f64>>,
}

impl Inside {
    pub fn is_trusted(&self, a: usize, b: usize) -> bool {
        self.trusted.contains(&[a, b]) || self.picks_of(a, b).next().is_some()
    }

    pub fn picks_of(&self, a: usize, b: usize) -> impl Iterator<Item = &Pick> {
        self.picks.iter().filter(move |pick| pick.scans == [a, b])
    }

    /// The same without what the caller says of some pairs.
    pub fn without(&self, pairs: &BTreeSet<[usize; 2]>) -> Self {
        let mut inside = self.clone();
        inside.trusted.retain(|pair| !pairs.contains(pair));
        inside.picks.retain(|pick| !pairs.contains(&pick.scans));
        inside
    }
}
