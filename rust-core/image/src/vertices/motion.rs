//! Motion of a host's vertices, told by anchors: where some of them were, and where they are.
//!
//! 1. nowhere, if most lie where they were
//! 2. where they lie in a point or on a line, which leaves turns open: as the host's own matrix says, which must take them there
//! 3. moved, turned, scaled and mirrored all alike: Horn's closed form \[Horn87\], on mirrored points, too
//! 4. stretched or sheared all alike
//! 5. as 3, and some of them edited one by one: as at least half of them were moved
//! 6. otherwise the nearest to it, which tells no more than from where they are seen, about

use glam::{DAffine3, DMat3, DVec3};

use base::error::{Error, Result};
use geom::rigid_fit::RigidFit;

/// Tolerance for places of vertices, relative to the largest coordinate: some operations in single precision, each of which rounds by up to
/// 6e-8.
pub(super) const ROUNDING: f64 = 2e-6;

/// Anchors fix a turn about the line that they lie along if they spread so many times further from it than rounding moves
/// them.
const SPREAD: f64 = 64.0;

/// A stretch in all directions is read off so many anchors at least. Any four points fit one.
const OF_STRETCH: usize = 6;

/// Mirrored points that lie nearly in a plane are nearly those turned about it: they are taken for it where they fit so
/// many times better.
const BETTER: f64 = 4.0;

/// A motion of all vertices.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    /// The transform of points of the sensor's frame.
    pub host_from_sensor: DAffine3,
    /// Largest distance by which single precision may have moved any vertex, in the host's frame, however near the origin it lies now.
    floor: f64,
    /// Whether it took vertices there within that.
    pub is_known: bool,
    /// Of anchors in a plane: the other motion that took them there, which mirrors where this one turns.
    pub or_mirrored: Option<DAffine3>,
}

impl Motion {
    /// Largest distance by which single precision may have moved a vertex that lies there now, in the host's frame.
    pub fn rounding(&self, at: DVec3) -> f64 {
        self.floor.max(ROUNDING * at.abs().max_element())
    }
}

/// Places where vertices were and where they are, and the largest coordinate where they were.
struct Pairs<'a> {
    all: &'a [[DVec3; 2]],
    from: f64,
}

/// The motion that took the first of each pair to the second.
///
/// # Errors
/// [`Error::Input`] if all vertices lie in one place or in one plane now, which did not before, or if they were moved and so few
/// anchors are left that nothing tells how.
pub(super) fn recognized(all: &[[DVec3; 2]], world_from_host: &DAffine3) -> Result<Motion> {
    let from = all.iter().map(|[from, _]| from.abs().max_element()).fold(0.0, f64::max);
    let pairs = Pairs { all, from };
    let still = DAffine3::IDENTITY;
    if 2 * pairs.fitting(all, &still) > all.len() || all.is_empty() {
        return Ok(pairs.known(still));
    }
    pairs.refuse_a_single_place()?;
    if !pairs.fix_turns() {
        if pairs.fitting(all, world_from_host) == all.len() {
            return Ok(pairs.known(*world_from_host));
        }
        return Err(nothing_tells(all.len()));
    }
    let [nearest, mirrored] = similarities(all);
    let fits = |motion: &DAffine3| pairs.fitting(all, motion) == all.len();
    if let Some(motion) = nearest.filter(fits) {
        return Ok(Motion { or_mirrored: mirrored.filter(fits), ..pairs.known(motion) });
    }
    if let Some(motion) = stretch(all, from).filter(|motion| pairs.fitting(all, motion) == all.len()) {
        if !spans(motion.matrix3) {
            return Err(Error::input(
                "all vertices lie in one plane: they were scaled by 0 in one direction, and nothing tells from where \
                    they were seen. Undo it.",
            ));
        }
        return Ok(pairs.known(motion));
    }
    if let Some(motion) = pairs.of_most() {
        return Ok(pairs.known(motion));
    }
    Ok(pairs.guessed(nearest.unwrap_or_else(|| shift(all))))
}

/// Reason why vertices can't be placed of which so few anchors are left.
pub(super) fn nothing_tells(anchors: usize) -> Error {
    let left = match anchors {
        0 => "none of those whose places were known is left".to_owned(),
        1 => "only 1 of those whose places were known is left".to_owned(),
        count => format!("only {count} of those whose places were known are left, all on one line"),
    };
    Error::input(format!(
        "the vertices were moved or edited, and {left}: nothing tells from where they were seen. Delete fewer of \
            them, or move the whole object instead of its vertices."
    ))
}

impl Pairs<'_> {
    /// Number of some pairs that a motion fits.
    fn fitting(&self, pairs: &[[DVec3; 2]], motion: &DAffine3) -> usize {
        let motion = self.known(*motion);
        pairs.iter().filter(|pair| residual(&motion.host_from_sensor, pair) <= motion.rounding(pair[1])).count()
    }

    fn known(&self, host_from_sensor: DAffine3) -> Motion {
        let floor = ROUNDING * self.from * size(host_from_sensor.matrix3);
        Motion { host_from_sensor, floor, is_known: true, or_mirrored: None }
    }

    fn guessed(&self, host_from_sensor: DAffine3) -> Motion {
        Motion { is_known: false, ..self.known(host_from_sensor) }
    }

    /// Whether the anchors spread from the line that they lie along.
    fn fix_turns(&self) -> bool {
        let [first, _] = self.all[0];
        let farthest = |by: &dyn Fn(DVec3) -> f64| {
            let distances = self.all.iter().map(|[from, _]| (by(*from), *from));
            distances.fold((0.0, first), |best, next| if next.0 > best.0 { next } else { best })
        };
        let (length, far) = farthest(&|point| point.distance(first));
        if !(length > 0.0) {
            return false;
        }
        let along = (far - first) / length;
        let (thickness, _) = farthest(&|point| (point - first).cross(along).length());
        thickness > SPREAD * ROUNDING * self.from
    }

    fn refuse_a_single_place(&self) -> Result<()> {
        let extent = |k: usize| self.all.iter().map(|pair| pair[k].distance(self.all[0][k])).fold(0.0, f64::max);
        if extent(0) > SPREAD * ROUNDING * self.from && extent(1) == 0.0 {
            return Err(Error::input(
                "all vertices lie in one place: they were scaled by 0, and nothing tells from where they were seen. Undo it.",
            ));
        }
        Ok(())
    }

    /// The similarity that fits at least half of the anchors, found by leaving out the worst one after the other.
    fn of_most(&self) -> Option<DAffine3> {
        let mut kept = self.all.to_vec();
        let least = self.all.len().div_ceil(2).max(4);
        while kept.len() > least {
            let motion = similarities(&kept)[0]?;
            if self.fitting(&kept, &motion) == kept.len() {
                return Some(motion);
            }
            let residuals: Vec<f64> = kept.iter().map(|pair| residual(&motion, pair)).collect();
            let larger = |best: usize, i: usize| if residuals[i] > residuals[best] { i } else { best };
            kept.remove((1..kept.len()).fold(0, larger));
        }
        None
    }
}

fn residual(motion: &DAffine3, [from, to]: &[DVec3; 2]) -> f64 {
    motion.transform_point3(*from).distance(*to)
}

/// Factor of lengths, on average over directions.
pub(super) fn size(axes: DMat3) -> f64 {
    axes.determinant().abs().cbrt()
}

fn means(pairs: &[[DVec3; 2]]) -> [DVec3; 2] {
    [0, 1].map(|k| pairs.iter().map(|pair| pair[k]).sum::<DVec3>() / pairs.len() as f64)
}

/// Moves the middle of the points to where it is now.
fn shift(pairs: &[[DVec3; 2]]) -> DAffine3 {
    let [from, to] = means(pairs);
    DAffine3::from_translation(to - from)
}

/// The similarity with the least squares of distances, mirroring or not, and the other one.
fn similarities(pairs: &[[DVec3; 2]]) -> [Option<DAffine3>; 2] {
    let [from, to] = means(pairs);
    let worst = |motion: &DAffine3| pairs.iter().map(|pair| residual(motion, pair)).fold(0.0, f64::max);
    let candidate = |mirror: DVec3| {
        let mut fit = RigidFit::new();
        pairs.iter().for_each(|pair| fit.point(mirror * (pair[0] - from), pair[1] - to, 1.0));
        let turn = fit.solve()?.matrix3 * DMat3::from_diagonal(mirror);
        let along: f64 = pairs.iter().map(|pair| (turn * (pair[0] - from)).dot(pair[1] - to)).sum();
        let scale = along / pairs.iter().map(|pair| pair[0].distance_squared(from)).sum::<f64>();
        let axes = turn * scale;
        (scale > 0.0).then(|| DAffine3 { matrix3: axes, translation: to - axes * from })
    };
    match (candidate(DVec3::ONE), candidate(DVec3::new(-1.0, 1.0, 1.0))) {
        (Some(turned), Some(mirrored)) if BETTER * worst(&mirrored) < worst(&turned) => [Some(mirrored), Some(turned)],
        (None, mirrored) => [mirrored, None],
        both => both.into(),
    }
}

/// The affine transform with the least squares of distances, of points that spanned space.
fn stretch(pairs: &[[DVec3; 2]], largest: f64) -> Option<DAffine3> {
    if pairs.len() < OF_STRETCH {
        return None;
    }
    let [from, to] = means(pairs);
    let outer = |a: DVec3, b: DVec3| DMat3::from_cols(a * b.x, a * b.y, a * b.z);
    let (mut squares, mut products) = (DMat3::ZERO, DMat3::ZERO);
    for pair in pairs {
        // In units of the largest coordinate: the determinant below is of its sixth power.
        let before = (pair[0] - from) / largest;
        squares += outer(before, before);
        products += outer(pair[1] - to, before);
    }
    if !spans(squares) {
        return None;
    }
    let axes = products * squares.inverse() * largest.recip();
    Some(DAffine3 { matrix3: axes, translation: to - axes * from })
}

/// Whether axes span space: what is flatter than this fixes no third direction in single precision.
fn spans(axes: DMat3) -> bool {
    let longest = [axes.x_axis, axes.y_axis, axes.z_axis].map(DVec3::length).into_iter().fold(0.0, f64::max);
    axes.determinant().abs() > 1e-9 * longest.powi(3)
}
