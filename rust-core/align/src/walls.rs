//! Rooms: walls, floor and ceiling fit each other in many places. Only the things that stand beside them tell where a scan belongs.
//!
//! The module `envelope` says of each point whether it is of a wall.

use glam::DAffine3;

use crate::finding::{Finding, Limits, RIVAL, fits};
use crate::judge::{Mode, tolerance};
use crate::view::View;
use crate::visibility::Seen;

/// Samples of each scan that tell what two scans share beside walls.
const MANY: usize = 2000;
/// Walls decide where two scans share less beside walls than this share of all that they share, unless ...
const WALLED: f64 = 0.5;
/// ... it is this share at least, and no more than this share of it and of what is seen through is seen through. In rooms like boxes,
/// 11 of 159 right pairs had less than 0.08, and none was seen through. Of 86 wrong pairs 80 had less, 5 were seen through by more, and one passed.
const TELLING: f64 = 0.08;
const THROUGH: f64 = 0.03;

/// A place of two scans among walls, if what stands there says so: of the motions that fit, the one by which most besides walls lies on
/// each other, and what it is beside the others. `None` where enough besides walls fits by the first motion, or there are no walls.
pub(crate) fn beside_walls(views: [&View; 2], modes: &[Mode], limits: &Limits) -> Option<(Mode, Finding)> {
    let [mine, other] = views.map(View::walls);
    if !mine.contains(&true) || !other.contains(&true) {
        return None;
    }
    let fits = |mode: &Mode| fits(views, &mode.verdict, limits);
    let first = modes.first()?;
    let mut told: Vec<(f64, Mode)> = Vec::new();
    let mut refused = Finding::Walls;
    for mode in modes.iter().filter(|mode| matches!(fits(mode), Finding::Sure | Finding::Weak)) {
        let (telling, through) = telling(views, &mode.a_from_b);
        let all = mode.verdict.touching();
        if told.is_empty() && std::ptr::eq(mode, first) && telling >= WALLED * all {
            return None;
        }
        if telling < TELLING * all {
            continue;
        }
        if through > THROUGH * (telling + through) {
            refused = Finding::SeenThrough;
        } else {
            told.push((telling, *mode));
        }
    }
    told.sort_by(|x, y| y.0.total_cmp(&x.0));
    Some(match told[..] {
        [] => (*first, refused),
        [(best, mode), (next, _), ..] if next > RIVAL * best => (mode, Finding::Ambiguous),
        [(_, mode), ..] => (mode, fits(&mode)),
    })
}

/// Share of what two frames that follow each other show besides walls, and of what is seen through, that may be seen through: somebody walks
/// through, but most stays. In another room nearly nothing does.
const MOVED: f64 = 0.3;

/// Comparison of what two scans show besides walls.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Beside {
    /// The same, or there are no walls.
    Same,
    /// Too little to tell.
    Little,
    /// Something else.
    Other,
}

/// Compares what stands besides walls in two scans that lie on each other.
pub(crate) fn beside(views: [&View; 2], mode: &Mode) -> Beside {
    if views.iter().any(|view| !view.walls().contains(&true)) {
        return Beside::Same;
    }
    let (telling, through) = telling(views, &mode.a_from_b);
    if through > MOVED * (telling + through) {
        Beside::Other
    } else if telling < TELLING * mode.verdict.touching() {
        Beside::Little
    } else {
        Beside::Same
    }
}

/// Areas of both scans, by a few samples: that of no wall on no wall of the other, and that which the other sees through, walls as well.
pub(crate) fn telling(views: [&View; 2], a_from_b: &DAffine3) -> (f64, f64) {
    let motions = [a_from_b.inverse(), *a_from_b];
    let tolerance = tolerance(views);
    let (mut telling, mut through) = (0.0, 0.0);
    for side in 0..2 {
        let (mine, other) = (views[side].fine(), views[1 - side].fine());
        let walls = [views[side].walls(), views[1 - side].walls()];
        let depth_map = views[1 - side].depth_map();
        for k in mine.spread(MANY).into_iter().map(|k| k as usize) {
            let at = motions[side].transform_point3(mine.points[k]);
            let normal = motions[side].transform_vector3(mine.normals[k]);
            let is_on = |n: usize| {
                let is_close = (at - other.points[n]).dot(normal).abs() < tolerance;
                !walls[1][n] && is_close && other.normals[n].dot(normal) > 0.6
            };
            let near = || other.near.nearest_within(at, 2.0 * mine.cell + tolerance);
            if !walls[0][k] && near().is_some_and(|(n, _)| is_on(n as usize)) {
                telling += mine.areas[k];
            } else if depth_map.is_some_and(|map| map.see(at, normal, 2.0 * tolerance) == Seen::Through) {
                through += mine.areas[k];
            }
        }
    }
    (telling, through)
}
