//! Scans of something that turned on a table before a sensor that stood still: one axis, in the frame that all were taken in, and an
//! angle a scan.
//!
//! The axis is that of the motions of pairs that are sure, where most of them agree (a screw without pitch). Then a pair has one
//! unknown, or none where angles are known, so that what turns or slides by itself, a vase or a plate, has a place.

use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DMat3, DQuat, DVec3};

use crate::constraints::{Pick, Told};
use crate::finding::{BALANCE, Finding, Limits, find_where, fits};
use crate::judge::{Hold, Mode, Verdict, judge, tolerance};
use crate::linear::{apart, eigen};
use crate::pair::Pair;
use crate::reach::Bound;
use crate::refine::Both;
use crate::relax::Tie;
use crate::view::View;

/// Samples that tell which angles are worth a look, and for steps and verdicts.
const GLANCE: usize = 120;
const FEW: usize = 400;
const MANY: usize = 1000;
/// Most angles that are looked at.
const MOST_ANGLES: usize = 4000;
/// Angles that are refined.
const ROUGH: usize = 8;
const STEPS: usize = 10;
/// Motions turn about the same axis if a scan lies within so many coarse cells of the same place.
const AGREE: f64 = 3.0;
/// Share of the pairs that are sure by themselves that must turn as the table does: else it is another, or its angles are.
const BELIEVED: f64 = 0.75;
/// Scans that shape alone doesn't hold must share so much: slivers touch where the axis is wrong.
const TOUCHES: f64 = 0.2;
/// Turns by less say little of their axis.
const LEAST_TURN: f64 = 0.1;
/// The weight of the axis in the poses of all scans, as of a pick.
const WEIGHT: f64 = 200.0;
/// How far the axis may be off, in cells, as a deviation.
const EXACT: f64 = 0.1;

/// The axis, and the angles if they are known, by the numbers inside.
#[derive(Clone, Debug)]
pub(crate) struct Table {
    pub point: DVec3,
    /// Unit.
    pub direction: DVec3,
    /// By which the object was turned, of each scan.
    pub angles: Option<Vec<f64>>,
}

/// A motion between the frames that two scans were taken in, as a turn about an axis.
struct Turn {
    direction: DVec3,
    /// 0 to pi.
    angle: f64,
}

impl Turn {
    fn of(motion: &DAffine3) -> Self {
        let (direction, angle) = DQuat::from_mat3(&motion.matrix3).normalize().to_axis_angle();
        if angle > PI { Turn { direction: -direction, angle: TAU - angle } } else { Turn { direction, angle } }
    }
}

/// The motion between the frames that two scans were taken in.
fn own(views: &[View], a: usize, b: usize, a_from_b: &DAffine3) -> DAffine3 {
    let [middle_a, middle_b] = [a, b].map(|k| views[k].reduced.middle);
    DAffine3::from_translation(middle_a) * *a_from_b * DAffine3::from_translation(-middle_b)
}

/// A turn about a line.
fn about(point: DVec3, direction: DVec3, angle: f64) -> DAffine3 {
    let turn = DAffine3::from_axis_angle(direction, angle);
    DAffine3::from_translation(point) * turn * DAffine3::from_translation(-point)
}

impl Table {
    /// As the pairs that are sure say, near where the caller has it, if he does. As he has it where no pair says anything. `None` where
    /// pairs don't agree with each other, with the angles, or with him.
    pub fn find(told: &Told, views: &[View], pairs: &[&Pair]) -> Option<Self> {
        let sure = |pair: &&&Pair| matches!(pair.finding, Finding::Sure | Finding::Weak);
        let motion = |pair: &&Pair| own(views, pair.a, pair.b, &pair.modes[0].a_from_b);
        let motions: Vec<(&Pair, DAffine3)> = pairs.iter().filter(sure).map(|pair| (*pair, motion(pair))).collect();
        let given = told.axis.map(|axis| Table {
            point: axis.point,
            direction: axis.direction.normalize(),
            angles: told.angles.clone(),
        });
        let turned: Vec<&(&Pair, DAffine3)> =
            motions.iter().filter(|(_, motion)| Turn::of(motion).angle > LEAST_TURN).collect();
        let through = |(_, motion): &&(&Pair, DAffine3)| {
            [1.0, -1.0].into_iter().filter_map(|sign| Table::through(&[(motion, sign)], told)).collect::<Vec<_>>()
        };
        let candidates: Vec<Table> = match &given {
            Some(table) => vec![table.clone()],
            None => turned.iter().flat_map(through).collect(),
        };
        let mut best: Option<(f64, Table)> = None;
        for table in candidates {
            let agrees = |(pair, _): &&&(&Pair, DAffine3)| table.is_on(views, pair);
            let agreeing: Vec<&&(&Pair, DAffine3)> = turned.iter().filter(agrees).collect();
            // One motion has an axis always; angles that are known can belie it.
            let enough = if told.angles.is_some() { 1 } else { 2 };
            let is_believed = agreeing.len() as f64 >= BELIEVED * turned.len() as f64;
            let score: f64 = agreeing.iter().map(|(pair, _)| pair.modes[0].verdict.touching()).sum();
            if agreeing.len() < enough || !is_believed || best.as_ref().is_some_and(|(most, _)| score <= *most) {
                continue;
            }
            let toward = |motion: &DAffine3| {
                if Turn::of(motion).direction.dot(table.direction) < 0.0 { -1.0 } else { 1.0 }
            };
            let all: Vec<(&DAffine3, f64)> = agreeing.iter().map(|(_, motion)| (motion, toward(motion))).collect();
            best = Table::through(&all, told).map(|table| (score, table)).or(best);
        }
        match best {
            Some((_, table)) => Some(table),
            None => given.filter(|_| turned.is_empty()),
        }
    }

    /// The axis that turns have in common, those of negative signs taken the other way round. `None` if there is none.
    fn through(motions: &[(&DAffine3, f64)], told: &Told) -> Option<Self> {
        let mut direction = DVec3::ZERO;
        for (motion, sign) in motions {
            let turn = Turn::of(motion);
            direction += *sign * turn.angle * turn.direction;
        }
        let direction = direction.try_normalize()?;
        // Points of the axis don't move: (1 - R) p = t, across the axis.
        let mut squares = DMat3::ZERO;
        let mut right = DVec3::ZERO;
        for (motion, _) in motions {
            let rows = DMat3::IDENTITY - motion.matrix3;
            squares += rows.transpose() * rows;
            right += rows.transpose() * motion.translation;
        }
        let (values, vectors) = eigen(&squares.transpose().to_cols_array_2d());
        let mut point = DVec3::ZERO;
        for (value, vector) in values.iter().zip(&vectors).skip(1) {
            let vector = DVec3::from(*vector);
            if *value <= LEAST_TURN * LEAST_TURN {
                return None;
            }
            point += vector.dot(right) / value * vector;
        }
        Some(Table { point, direction, angles: told.angles.clone() })
    }

    /// Whether a pair's motion is a turn of the table.
    pub fn is_on(&self, views: &[View], pair: &Pair) -> bool {
        let Some(mode) = pair.modes.first() else { return false };
        let motion = self.motion(views, pair.a, pair.b, self.angle(views, pair.a, pair.b, &mode.a_from_b));
        let radius = views[pair.a].reduced.radius.min(views[pair.b].reduced.radius);
        let cell = views[pair.a].coarse.cell.max(views[pair.b].coarse.cell);
        apart(&motion, &mode.a_from_b, radius) < AGREE * cell
    }

    /// The turn from the second scan to the first: as it is known, else that of the motion.
    fn angle(&self, views: &[View], a: usize, b: usize, a_from_b: &DAffine3) -> f64 {
        self.known(a, b).unwrap_or_else(|| {
            let turn = DQuat::from_mat3(&own(views, a, b, a_from_b).matrix3).normalize();
            2.0 * turn.xyz().dot(self.direction).atan2(turn.w)
        })
    }

    /// By how much it was turned at each scan whose pose is found.
    pub fn turns(&self, world_from_scan: &[Option<DAffine3>]) -> Vec<Option<f64>> {
        let first = world_from_scan.iter().flatten().next().copied();
        let turn = |pose: &DAffine3| {
            let first_from_scan = first.expect("there is a pose").inverse() * *pose;
            let turn = DQuat::from_mat3(&first_from_scan.matrix3).normalize();
            // A turn by a little less than none would be a whole turn.
            let angle = (-2.0 * turn.xyz().dot(self.direction).atan2(turn.w)).rem_euclid(TAU);
            if TAU - angle < 1e-9 { 0.0 } else { angle }
        };
        world_from_scan.iter().map(|pose| pose.as_ref().map(turn)).collect()
    }

    fn known(&self, a: usize, b: usize) -> Option<f64> {
        self.angles.as_ref().map(|angles| angles[a] - angles[b])
    }

    fn motion(&self, views: &[View], a: usize, b: usize, angle: f64) -> DAffine3 {
        let [middle_a, middle_b] = [a, b].map(|k| views[k].reduced.middle);
        DAffine3::from_translation(-middle_a)
            * about(self.point, self.direction, angle)
            * DAffine3::from_translation(middle_b)
    }

    /// Searches two scans for the turn between them, or looks at the one that is known.
    pub fn pair(&self, views: &[View], a: usize, b: usize, bound: &Bound, limits: &Limits) -> Pair {
        let both = [&views[a], &views[b]];
        let angles = self.known(a, b).map_or_else(|| self.likely(views, a, b), |angle| vec![angle]);
        let fine = Both::new(both[0].fine(), both[1].fine(), MANY);
        let mode = |angle: f64| {
            let a_from_b = self.motion(views, a, b, angle);
            Mode { a_from_b, verdict: judge(both, &fine, &a_from_b, tolerance(both)) }
        };
        let is_allowed = |mode: &Mode| bound.allows(views, [a, b], &mode.a_from_b);
        let mut modes: Vec<Mode> = angles.into_iter().map(mode).filter(is_allowed).collect();
        modes.sort_by(|x, y| y.verdict.score().total_cmp(&x.verdict.score()));
        let fit = |verdict: &Verdict| match fits(both, verdict, limits) {
            Finding::Slides | Finding::Weak
                if self.holds(both[0], &verdict.hold)
                    && verdict.overlap().into_iter().fold(0.0, f64::max) > TOUCHES =>
            {
                Finding::Sure
            }
            finding => finding,
        };
        Pair { a, b, finding: find_where(&modes, fit), modes, beyond: None }
    }

    /// Turns at which two scans may fit, refined, different ones.
    fn likely(&self, views: &[View], a: usize, b: usize) -> Vec<f64> {
        let both = [&views[a], &views[b]];
        if both.iter().any(|view| view.is_empty()) {
            return Vec::new();
        }
        let cell = both[0].coarse.cell.max(both[1].coarse.cell);
        let away = (both[1].reduced.middle - self.point).reject_from(self.direction).length();
        let step = cell / (away + both[1].reduced.radius);
        // A surface far from the axis has a place in a few of them at most.
        let count = ((TAU / step).ceil() as usize).clamp(8, MOST_ANGLES);
        let step = TAU / count as f64;
        let glance = Both::new(&both[0].coarse, &both[1].coarse, GLANCE);
        let scores: Vec<f64> = (0..count)
            .map(|k| judge(both, &glance, &self.motion(views, a, b, k as f64 * step), 1.5 * cell).score())
            .collect();
        let is_peak = |&k: &usize| {
            let [before, after] = [(k + count - 1) % count, (k + 1) % count].map(|k| scores[k]);
            scores[k] > 0.0 && scores[k] >= before && scores[k] > after
        };
        let mut peaks: Vec<usize> = (0..count).filter(is_peak).collect();
        peaks.sort_by(|&x, &y| scores[y].total_cmp(&scores[x]).then(x.cmp(&y)));
        peaks.truncate(ROUGH);
        let coarse = Both::new(&both[0].coarse, &both[1].coarse, FEW);
        let fine = Both::new(both[0].fine(), both[1].fine(), FEW);
        let width = tolerance(both);
        let mut found: Vec<f64> = Vec::new();
        for peak in peaks {
            let rough = self.refined(views, [a, b], &coarse, peak as f64 * step, 2.0 * cell);
            let angle = self.refined(views, [a, b], &fine, rough, 2.0 * width);
            let off = |other: &f64| ((angle - other + PI).rem_euclid(TAU) - PI).abs();
            if found.iter().all(|other| off(other) > 1.5 * step) {
                found.push(angle);
            }
        }
        found
    }

    /// The turn made exact: point-to-plane ICP with one unknown.
    fn refined(&self, views: &[View], [a, b]: [usize; 2], levels: &Both<'_>, start: f64, reach: f64) -> f64 {
        let mut angle = start;
        let point = self.point - views[a].reduced.middle;
        for _ in 0..STEPS {
            let (mut square, mut right, mut far) = (0.0, 0.0, 0.0_f64);
            levels.contacts(&self.motion(views, a, b, angle), reach, |contact| {
                let by = self.direction.cross(contact.b - point);
                let row = by.dot(contact.normal);
                let weight = contact.area * (-(2.0 * contact.distance() / reach).powi(2)).exp();
                square += weight * row * row;
                right -= weight * row * contact.distance();
                far = far.max(by.length());
            });
            if square <= 0.0 {
                break;
            }
            let by = right / square;
            angle += by;
            if by.abs() * far < 0.01 * reach {
                break;
            }
        }
        angle
    }

    /// Whether what may turn or slide by itself is held on the table.
    fn holds(&self, first: &View, hold: &Hold) -> bool {
        if self.angles.is_some() {
            return true;
        }
        let shift = self.direction.cross(hold.middle - (self.point - first.reduced.middle));
        let turn = self.direction * hold.radius;
        let way = [turn.x, turn.y, turn.z, shift.x, shift.y, shift.z];
        let length: f64 = way.iter().map(|x| x * x).sum();
        let along = |vector: &[f64; 6]| vector.iter().zip(&way).map(|(x, y)| x * y).sum::<f64>();
        let held: f64 = hold.values.iter().zip(&hold.vectors).map(|(value, v)| value * along(v) * along(v)).sum();
        held / length > BALANCE
    }

    /// Ties of a group's scans to the axis: points of it that all of them share, and of what turned, where angles are known.
    pub fn ties(&self, views: &[View], members: &[usize], frame: usize) -> Vec<Tie> {
        let across = self.direction.any_orthonormal_vector();
        let mut ties = Vec::new();
        for &scan in members.iter().filter(|&&scan| scan != frame) {
            let [a, b] = [scan.min(frame), scan.max(frame)];
            let radius = views[frame].reduced.radius;
            let mut pick = |places: [DVec3; 2]| {
                let points = [places[0] - views[a].reduced.middle, places[1] - views[b].reduced.middle];
                let pick = Pick { scans: [a, b], points, normals: None, weight: WEIGHT };
                ties.push(Tie { pick, exact: EXACT * views[frame].fine().cell });
            };
            let along = (views[frame].reduced.middle - self.point).dot(self.direction);
            for end in [along - radius, along + radius] {
                pick([self.point + end * self.direction; 2]);
            }
            if let Some(angles) = &self.angles {
                let at = self.point + along * self.direction + radius * across;
                pick([a, b].map(|k| about(self.point, self.direction, angles[k]).transform_point3(at)));
            }
        }
        ties
    }
}
