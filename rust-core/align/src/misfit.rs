//! Misfits that no rigid pose explains: where surfaces that should be one lie apart, and what may be the reason.

use glam::{DAffine3, DVec3, IVec3};
use rustc_hash::FxHashMap;

use crate::finding::{APART, Limits};
use crate::judge::{PIECE, tolerance};
use crate::level::expected;
use crate::linear::solve;
use crate::neighbours::Neighbours;
use crate::refine::{Both, Contact};
use crate::view::View;

/// Why surfaces lie apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Cause {
    /// It would fit if it were so many times as large.
    Scale(f64),
    /// A part lies elsewhere while the rest fits: its middle in the world, and its share of what others show as well.
    Moved { middle: DVec3, share: f64 },
    /// Bent all over.
    Warp,
}

/// Surfaces are looked for so many tolerances away.
const REACH: f64 = 3.0;
/// Samples, over all scans beside it, and of each at least.
const SAMPLES: usize = 3000;
const LEAST_SAMPLES: usize = 200;
/// Fewer contacts tell nothing.
const FEWEST: usize = 100;
/// A piece that lies so many times too far has moved.
const FAR: f64 = 2.0;
const RIDGE: f64 = 1e-6;
/// A change of size is the reason if it takes away so much of the mean square that is too much, and so much of all of it.
const EXPLAINED: f64 = 0.6;
const LEAST_GAIN: f64 = 0.4;
/// Less is nobody's wrong unit or calibration.
const LEAST_SCALE: f64 = 0.002;
/// The same surfaces lie so far apart, by that of a scan's own neighbours.
const FLOOR: f64 = 0.6;
/// A part that moved is at most this share of the surface.
const PART: f64 = 0.45;
/// Parts that moved lie together: their spread, by that of all.
const TOGETHER: f64 = 0.6;
/// Least area that moved, as a share.
const LEAST: f64 = 0.02;
const STEPS: usize = 8;

/// A scan that lies in place.
pub(crate) struct Placed<'v> {
    pub view: &'v View,
    pub world_from_local: DAffine3,
}

/// Contacts of a scan with others, in the world, the scan's points second.
fn contacts(scan: &Placed<'_>, others: &[Placed<'_>]) -> Vec<Contact> {
    let samples = SAMPLES.div_ceil(others.len().max(1)).max(LEAST_SAMPLES);
    let mut found = Vec::new();
    for other in others {
        let both = Both::new(other.view.fine(), scan.view.fine(), samples);
        let other_from_scan = other.world_from_local.inverse() * scan.world_from_local;
        let reach = REACH * tolerance([other.view, scan.view]);
        both.contacts(&other_from_scan, reach, |contact| found.push(contact.moved(&other.world_from_local)));
    }
    found
}

/// Why a scan that lies in place doesn't fit the others exactly. `None` if it does, or touches too little to tell.
pub(crate) fn cause(scan: &Placed<'_>, others: &[Placed<'_>], limits: &Limits) -> Option<Cause> {
    let contacts = contacts(scan, others);
    if contacts.len() < FEWEST {
        return None;
    }
    let expected = others.iter().map(|other| expected([other.view.fine(), scan.view.fine()])).fold(0.0, f64::max);
    let closest = limits.tolerance.unwrap_or(APART * expected);
    let before = mean_square(&contacts);
    // The mean square that stays in any case, by noise and by what lies between samples.
    let floor = (FLOOR * expected).powi(2);
    if before > floor
        && let Some((scale, after)) = scaled(scan, others)
        && (scale - 1.0).abs() > LEAST_SCALE
        && before - after > EXPLAINED * (before - floor).max(LEAST_GAIN * before)
    {
        return Some(Cause::Scale(scale));
    }
    let pieces = pieces(&contacts, PIECE * scan.view.fine().cell);
    let (moved, rest): (Vec<&Piece>, Vec<&Piece>) =
        pieces.iter().partition(|piece| piece.distance.abs() > FAR * closest);
    let area = |of: &[&Piece]| of.iter().map(|piece| piece.area).sum::<f64>();
    let share = area(&moved) / (area(&moved) + area(&rest));
    let rest = rest.iter().map(|p| p.area * p.distance * p.distance).sum::<f64>() / area(&rest);
    let (middle, width) = spread(&moved);
    let whole = spread(&pieces.iter().collect::<Vec<_>>()).1;
    if (LEAST..PART).contains(&share) && rest.sqrt() < closest && width < TOGETHER * whole {
        return Some(Cause::Moved { middle, share });
    }
    // Noise explains so much, whatever is asked for.
    (before.sqrt() > closest.max(APART * expected)).then_some(Cause::Warp)
}

/// The middle of pieces, and how far from it they lie, as a root mean square.
fn spread(pieces: &[&Piece]) -> (DVec3, f64) {
    let area: f64 = pieces.iter().map(|piece| piece.area).sum();
    let middle = pieces.iter().map(|piece| piece.area * piece.middle).sum::<DVec3>() / area;
    let square = pieces.iter().map(|piece| piece.area * piece.middle.distance_squared(middle)).sum::<f64>() / area;
    (middle, square.sqrt())
}

/// Along normals.
fn mean_square(contacts: &[Contact]) -> f64 {
    let sum: f64 = contacts.iter().map(|contact| contact.area * contact.distance() * contact.distance()).sum();
    sum / contacts.iter().map(|contact| contact.area).sum::<f64>().max(f64::MIN_POSITIVE)
}

/// The size at which a scan fits the others best, and the mean square distance then.
fn scaled(scan: &Placed<'_>, others: &[Placed<'_>]) -> Option<(f64, f64)> {
    let mut pose = scan.world_from_local;
    let radius = scan.view.reduced.radius.max(f64::MIN_POSITIVE);
    let here = |pose: DAffine3| Placed { view: scan.view, world_from_local: pose };
    for _ in 0..STEPS {
        let middle = pose.translation;
        let mut squares = [[0.0; 7]; 7];
        let mut right = [0.0; 7];
        for contact in contacts(&here(pose), others) {
            let arm = (contact.b - middle) / radius;
            let n = contact.normal;
            let turn = arm.cross(n);
            let row = [turn.x, turn.y, turn.z, n.x, n.y, n.z, arm.dot(n)];
            for i in 0..7 {
                for j in 0..7 {
                    squares[i][j] += contact.area * row[i] * row[j];
                }
                right[i] -= contact.area * contact.distance() * row[i];
            }
        }
        let ridge = RIDGE * (0..7).map(|i| squares[i][i]).sum::<f64>();
        (0..7).for_each(|i| squares[i][i] += ridge);
        let x = solve(&squares, &right)?;
        let turn = glam::DQuat::from_scaled_axis(DVec3::new(x[0], x[1], x[2]) / radius);
        let shift = DVec3::new(x[3], x[4], x[5]);
        let step = DAffine3::from_scale_rotation_translation(DVec3::splat(1.0 + x[6] / radius), turn, shift);
        pose = DAffine3::from_translation(middle) * step * DAffine3::from_translation(-middle) * pose;
    }
    let scale = pose.matrix3.determinant().abs().cbrt();
    Some((scale, mean_square(&contacts(&here(pose), others))))
}

/// A piece of surface, some cells wide.
struct Piece {
    middle: DVec3,
    /// Mean, along normals.
    distance: f64,
    area: f64,
}

/// Contacts gathered by pieces, whose means are nearly free of noise.
fn pieces(contacts: &[Contact], width: f64) -> Vec<Piece> {
    let mut places: FxHashMap<IVec3, usize> = FxHashMap::default();
    let mut pieces: Vec<Piece> = Vec::new();
    for contact in contacts {
        let at = *places.entry((contact.a / width).floor().as_ivec3()).or_insert_with(|| {
            pieces.push(Piece { middle: DVec3::ZERO, distance: 0.0, area: 0.0 });
            pieces.len() - 1
        });
        let piece = &mut pieces[at];
        piece.middle += contact.area * contact.a;
        piece.distance += contact.area * contact.distance();
        piece.area += contact.area;
    }
    for piece in &mut pieces {
        piece.middle /= piece.area;
        piece.distance /= piece.area;
    }
    pieces
}

/// How far a scan's surface lies outside of others', by its finer level's points: means over a few cells, nearly free of noise. NaN
/// where none of the others is near.
pub(crate) struct Map {
    cell: f64,
    points: Vec<DVec3>,
    values: Vec<f64>,
    grid: Neighbours,
}

/// Cells over which distances are averaged.
const SMOOTH: f64 = 2.5;

impl Map {
    /// By about so many points of the scan.
    pub fn new(scan: &Placed<'_>, others: &[Placed<'_>], samples: usize) -> Self {
        let level = scan.view.fine();
        let (mut sums, mut counts) = (vec![0.0; level.len()], vec![0.0; level.len()]);
        let chosen = level.spread(samples);
        for other in others {
            let other_from_scan = other.world_from_local.inverse() * scan.world_from_local;
            let far = scan.view.reduced.radius + other.view.reduced.radius;
            if other_from_scan.translation.length() > far {
                continue;
            }
            let (there, reach) = (other.view.fine(), REACH * tolerance([scan.view, other.view]));
            for k in chosen.iter().map(|&k| k as usize) {
                let at = other_from_scan.transform_point3(level.points[k]);
                let Some((n, _)) = there.near.nearest_within(at, reach) else { continue };
                let (n, normal) = (n as usize, other_from_scan.transform_vector3(level.normals[k]));
                if !there.is_border[n] && there.normals[n].dot(normal) > 0.6 {
                    let mean = (there.normals[n] + normal).normalize();
                    sums[k] += (at - there.points[n]).dot(mean);
                    counts[k] += 1.0;
                }
            }
        }
        let met: Vec<usize> = (0..level.len()).filter(|&k| counts[k] > 0.0).collect();
        let points: Vec<DVec3> = met.iter().map(|&k| level.points[k]).collect();
        let values: Vec<f64> = met.iter().map(|&k| sums[k] / counts[k]).collect();
        let grid = Neighbours::new(&points, SMOOTH * level.cell);
        Map { cell: level.cell, points, values, grid }
    }

    /// At a point of the scan, in its local frame.
    pub fn at(&self, at: DVec3) -> f64 {
        let mut near = Vec::new();
        let radius = SMOOTH * self.cell;
        self.grid.within(at, radius, &mut near);
        let (mut sum, mut weight) = (0.0, 0.0);
        for &k in &near {
            let share = 1.0 - (self.points[k as usize].distance(at) / radius).powi(2);
            sum += share * self.values[k as usize];
            weight += share;
        }
        if weight > 0.0 { sum / weight } else { f64::NAN }
    }

    /// Root mean square of what is left once noise is averaged out. `None` where nothing is near.
    pub fn root_mean_square(&self) -> Option<f64> {
        let values: Vec<f64> = self.points.iter().map(|&p| self.at(p)).collect();
        (!values.is_empty()).then(|| (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt())
    }
}
