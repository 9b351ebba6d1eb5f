//! All placed scans at once: the poses that make every pair fit best together.
//!
//! Joint point-to-plane ICP over all pairs (Neugebauer 1997): contacts of all pairs give one system of normal equations, six
//! unknowns a scan. Matches are renewed at each step. Fixed scans aren't among the unknowns.

use std::collections::BTreeSet;

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use crate::blocks::{BlockSystem, Factor};
use crate::constraints::Pick;
use crate::judge::tolerance;
use crate::linear::{Matrix6, Vector6, motion, rigid};
use crate::refine::{Both, Contact};
use crate::view::View;
use base::error::Result;
use base::progress::Progress;

const RIDGE: f64 = 1e-6;
/// Points of each scan that look for their nearest in each other one.
const SAMPLES: usize = 600;
/// In sets of more scans half as many do: each has more neighbours.
const MANY_SCANS: usize = 40;
/// The weight of a pick, as a share of the smaller scan's area: little, so that it chooses a place, and shape where in it. Three picks half a
/// millimetre off raised the residual of two bunny scans from 0.17 to 0.31 mm at a hundredth.
const PICK: f64 = 0.0005;
const STEPS: usize = 12;
/// Steps that are smaller, in cells, end it.
const ENOUGH: f64 = 0.004;
/// How far contacts are looked for, and beyond what they weigh less than a third, in cells: at first, then.
const WIDE: (f64, f64) = (3.0, 1.0);
pub(crate) const NARROW: (f64, f64) = (1.5, 0.5);

/// Two scans that touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Link {
    pub a: usize,
    pub b: usize,
}

/// Scans with their poses, and which of them touch.
pub(crate) struct Net<'v> {
    pub views: &'v [View],
    /// Of each scan's local frame. `None` for those that aren't placed.
    pub poses: Vec<Option<DAffine3>>,
    pub is_fixed: Vec<bool>,
    pub links: Vec<Link>,
    pub ties: Vec<Tie>,
    /// The links that tints hold as well.
    pub coloured: BTreeSet<Link>,
}

/// Points of two scans that are held together.
#[derive(Clone, Copy)]
pub(crate) struct Tie {
    pub pick: Pick,
    /// How far they may be apart, as a deviation.
    pub exact: f64,
}

/// The contacts of a link, in the world.
pub(crate) fn contacts(net: &Net<'_>, link: Link, samples: usize, reach: f64) -> Vec<Contact> {
    let [a, b] = [link.a, link.b].map(|k| &net.views[k]);
    let (Some(pose_a), Some(pose_b)) = (net.poses[link.a], net.poses[link.b]) else { return Vec::new() };
    let width = tolerance([a, b]);
    let both = Both::new(a.fine(), b.fine(), samples);
    let mut found = Vec::new();
    let a_from_b = pose_a.inverse() * pose_b;
    both.contacts(&a_from_b, reach * width, |contact| found.push(contact));
    if net.coloured.contains(&link) {
        found.extend(both.by_tints(&a_from_b, &found));
    }
    found.iter().map(|contact| contact.moved(&pose_a)).collect()
}

/// The weight of a contact: its area, less the farther the surfaces lie apart. `scale` is in tolerances of the pair.
pub(crate) fn weight_of(net: &Net<'_>, link: Link, contact: &Contact, scale: f64) -> f64 {
    (-square_of(net, link, contact, scale)).exp() * contact.area
}

fn square_of(net: &Net<'_>, link: Link, contact: &Contact, scale: f64) -> f64 {
    let width = tolerance([&net.views[link.a], &net.views[link.b]]);
    (contact.distance() / (scale * width)).powi(2)
}

/// How well poses are known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Start {
    /// By pairs, each by itself.
    Near,
    /// By all pairs at once.
    Settled,
}

/// The purpose of normal equations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Use {
    /// A step towards the best poses.
    Step,
    /// How forces move poses: with what the weights lose as surfaces part, and without what noise of normals adds (that of two
    /// scans is not the same, so that the products of one's rows with the other's are free of it).
    Response,
}

/// The point that the unknowns of a scan turn about, and the unit of turns, so that all unknowns are lengths.
pub(crate) struct Gauge {
    pub middle: DVec3,
    pub radius: f64,
}

impl Gauge {
    pub fn of(view: &View, pose: &DAffine3) -> Self {
        Gauge { middle: pose.translation, radius: view.reduced.radius.max(f64::MIN_POSITIVE) }
    }

    /// How a distance along `normal` at `place` changes with the scan's motion.
    pub fn row(&self, place: DVec3, normal: DVec3) -> Vector6 {
        let arm = (place - self.middle).cross(normal) / self.radius;
        [arm.x, arm.y, arm.z, normal.x, normal.y, normal.z]
    }

    pub fn moved(&self, pose: &DAffine3, by: &Vector6) -> DAffine3 {
        let turn = DVec3::new(by[0], by[1], by[2]) / self.radius;
        let step = motion(turn, DVec3::new(by[3], by[4], by[5]));
        rigid(&(DAffine3::from_translation(self.middle) * step * DAffine3::from_translation(-self.middle) * *pose))
    }
}

/// The part of a link in the normal equations.
struct Share {
    aa: Matrix6,
    bb: Matrix6,
    ba: Matrix6,
    a: Vector6,
    b: Vector6,
}

fn outer(x: &Vector6, y: &Vector6, weight: f64, to: &mut Matrix6) {
    for (to, x) in to.iter_mut().zip(x) {
        to.iter_mut().zip(y).for_each(|(to, y)| *to += weight * x * y);
    }
}

impl Net<'_> {
    /// The unknown of each scan that has one.
    pub fn unknowns(&self) -> Vec<Option<usize>> {
        let mut count = 0;
        let unknown = |k: usize| {
            (self.poses[k].is_some() && !self.is_fixed[k]).then(|| {
                count += 1;
                count - 1
            })
        };
        (0..self.views.len()).map(unknown).collect()
    }

    /// Points of each scan that look for their nearest in each other one.
    pub fn samples(&self) -> usize {
        if self.poses.iter().flatten().count() > MANY_SCANS { SAMPLES / 2 } else { SAMPLES }
    }

    pub fn gauges(&self) -> Vec<Option<Gauge>> {
        self.views.iter().zip(&self.poses).map(|(view, pose)| pose.map(|pose| Gauge::of(view, &pose))).collect()
    }

    /// The normal equations at the poses as they are. `scale`: residuals beyond so many cells weigh less than a third.
    pub fn equations(&self, reach: f64, scale: f64, purpose: Use, progress: &Progress<'_>) -> Result<BlockSystem> {
        let unknowns = self.unknowns();
        let gauges = self.gauges();
        let share = |link: &Link| {
            progress.check()?;
            let mut share = Share { aa: [[0.0; 6]; 6], bb: [[0.0; 6]; 6], ba: [[0.0; 6]; 6], a: [0.0; 6], b: [0.0; 6] };
            let (Some(of_a), Some(of_b)) = (&gauges[link.a], &gauges[link.b]) else { return Ok(share) };
            for contact in contacts(self, *link, self.samples(), reach) {
                let residual = contact.distance();
                let weight = weight_of(self, *link, &contact, scale);
                let middle = 0.5 * (contact.a + contact.b);
                let rows = (of_a.row(middle, -contact.normal), of_b.row(middle, contact.normal));
                match purpose {
                    Use::Step => {
                        outer(&rows.0, &rows.0, weight, &mut share.aa);
                        outer(&rows.1, &rows.1, weight, &mut share.bb);
                        outer(&rows.1, &rows.0, weight, &mut share.ba);
                    }
                    Use::Response => {
                        let slope = 0.5 * weight * (1.0 - 2.0 * square_of(self, *link, &contact, scale));
                        for [one, other] in [contact.normals, [contact.normals[1], contact.normals[0]]] {
                            outer(&of_a.row(middle, -one), &of_a.row(middle, -other), slope, &mut share.aa);
                            outer(&of_b.row(middle, one), &of_b.row(middle, other), slope, &mut share.bb);
                            outer(&of_b.row(middle, one), &of_a.row(middle, -other), slope, &mut share.ba);
                        }
                    }
                }
                for i in 0..6 {
                    share.a[i] -= weight * residual * rows.0[i];
                    share.b[i] -= weight * residual * rows.1[i];
                }
            }
            Ok(share)
        };
        let shares: Vec<Share> = self.links.par_iter().map(share).collect::<Result<_>>()?;
        let mut system = BlockSystem::new(unknowns.iter().flatten().count());
        for (link, share) in self.links.iter().zip(&shares) {
            let (a, b) = (unknowns[link.a], unknowns[link.b]);
            if let Some(a) = a {
                system.add(a, a, &share.aa);
                system.right[a].iter_mut().zip(share.a).for_each(|(to, g)| *to += g);
            }
            if let Some(b) = b {
                system.add(b, b, &share.bb);
                system.right[b].iter_mut().zip(share.b).for_each(|(to, g)| *to += g);
            }
            if let (Some(a), Some(b)) = (a, b) {
                system.add(b, a, &share.ba);
            }
        }
        self.add_ties(&mut system, &unknowns, &gauges);
        for block in &mut system.diagonal {
            let ridge = RIDGE * (0..6).map(|i| block[i][i]).sum::<f64>() + f64::MIN_POSITIVE;
            (0..6).for_each(|i| block[i][i] += ridge);
        }
        Ok(system)
    }

    pub fn weight_of_pick(&self, pick: &Pick) -> f64 {
        let [a, b] = pick.scans.map(|scan| self.views[scan].reduced.area);
        PICK * pick.weight * a.min(b)
    }

    /// Points that the caller says are the same: three equations each.
    fn add_ties(&self, system: &mut BlockSystem, unknowns: &[Option<usize>], gauges: &[Option<Gauge>]) {
        for Tie { pick, .. } in &self.ties {
            let [a, b] = pick.scans;
            let (Some(of_a), Some(of_b), Some(pose_a), Some(pose_b)) =
                (&gauges[a], &gauges[b], self.poses[a], self.poses[b])
            else {
                continue;
            };
            let places = [pose_a.transform_point3(pick.points[0]), pose_b.transform_point3(pick.points[1])];
            let weight = self.weight_of_pick(pick);
            for axis in DVec3::AXES {
                let residual = (places[1] - places[0]).dot(axis);
                let rows = [of_a.row(places[0], -axis), of_b.row(places[1], axis)];
                for (scan, row) in [a, b].into_iter().zip(&rows) {
                    if let Some(unknown) = unknowns[scan] {
                        let mut block = [[0.0; 6]; 6];
                        outer(row, row, weight, &mut block);
                        system.add(unknown, unknown, &block);
                        system.right[unknown].iter_mut().zip(row).for_each(|(to, x)| *to -= weight * residual * x);
                    }
                }
                if let (Some(a), Some(b)) = (unknowns[a], unknowns[b]) {
                    let mut block = [[0.0; 6]; 6];
                    outer(&rows[1], &rows[0], weight, &mut block);
                    system.add(b, a, &block);
                }
            }
        }
    }

    /// Moves all scans that aren't fixed until they hardly move.
    pub fn relax(&mut self, start: Start, progress: &Progress<'_>) -> Result<()> {
        let wide = if start == Start::Near { 3 } else { 0 };
        for step in 0..STEPS {
            let (reach, scale) = if step < wide { WIDE } else { NARROW };
            let system = self.equations(reach, scale, Use::Step, progress)?;
            let Some(factor) = system.factor() else { return Ok(()) };
            let by = self.moved(&factor, &system.right);
            if step >= wide && by < ENOUGH {
                break;
            }
        }
        Ok(())
    }

    /// Solves and moves. Returns how far at most, in cells.
    fn moved(&mut self, factor: &Factor, right: &[Vector6]) -> f64 {
        let steps = factor.solve(right);
        let gauges = self.gauges();
        let mut most = 0.0_f64;
        for (k, unknown) in self.unknowns().into_iter().enumerate() {
            let (Some(unknown), Some(gauge), Some(pose)) = (unknown, &gauges[k], &mut self.poses[k]) else { continue };
            let by = &steps[unknown];
            most = most.max(by.iter().map(|x| x * x).sum::<f64>().sqrt() / self.views[k].fine().cell);
            *pose = gauge.moved(pose, by);
        }
        most
    }
}
