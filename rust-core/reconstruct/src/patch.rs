//! The surface around a place as nearby samples tell it: a height field of second order over the plane they lie along.

use glam::DVec3;

use base::error::Result;
use base::progress::Progress;
use geom::linear::{eigen, solve};

/// A place with axes: two along the surface, the third across it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    origin: DVec3,
    axes: [DVec3; 3],
    /// Root mean squares of the samples along the axes, about their weighted mean.
    extent: [f64; 3],
}

/// A sample near a place, and how much it counts.
pub(super) type Weighted = (DVec3, f64);

impl Frame {
    /// At `origin`, along the directions in which weighted samples are spread. `None` if none counts.
    pub(super) fn new(origin: DVec3, samples: &[Weighted]) -> Option<Frame> {
        let mut sums = Sums::default();
        samples.iter().for_each(|&(sample, weight)| sums.add(sample - origin, weight));
        sums.frame(origin)
    }

    /// In the middle of samples that count the same, its third axis up. In a vertical plane it points to large y, in one along y to large
    /// x. Axes turn counter-clockwise seen from there.
    pub(super) fn of_all(samples: &[DVec3], progress: &Progress<'_>) -> Result<Option<Frame>> {
        let Some(&first) = samples.first() else { return Ok(None) };
        let mut sums = Sums::default();
        for block in progress.blocks(samples) {
            block?.iter().for_each(|&sample| sums.add(sample - first, 1.0));
        }
        Ok(sums.frame(first + sums.places / sums.weight).map(|mut frame| {
            let [u, _, up] = frame.axes;
            let sign = [up.z, up.y, up.x].into_iter().find(|x| *x != 0.0).unwrap_or(1.0).signum();
            frame.axes = [u, (sign * up).cross(u), sign * up];
            frame
        }))
    }

    /// Along both axes of the surface, and height above it.
    pub(super) fn to_local(self, sample: DVec3) -> [f64; 3] {
        let d = sample - self.origin;
        self.axes.map(|axis| axis.dot(d))
    }

    /// The place at a height above the origin.
    pub(super) fn above(&self, height: f64) -> DVec3 {
        self.origin + self.axes[2] * height
    }

    /// The direction across the surface.
    pub(super) fn across(&self) -> DVec3 {
        self.axes[2]
    }

    /// The direction across the surface on whose side another lies. Zero for zero.
    pub(super) fn front(&self, towards: DVec3) -> DVec3 {
        let across = self.axes[2];
        let side = across.dot(towards);
        if side == 0.0 { DVec3::ZERO } else { side.signum() * across }
    }

    /// Extent across the surface by the largest along it.
    pub(super) fn thickness(&self) -> f64 {
        self.extent[2] / self.extent[0]
    }

    /// Radius of the disk over which samples are spread as these are.
    pub(super) fn radius(&self) -> f64 {
        2.0 * (self.extent[0] * self.extent[1]).sqrt()
    }
}

/// Sums over weighted samples.
#[derive(Default)]
struct Sums {
    weight: f64,
    places: DVec3,
    /// Those of which the second is no later than the first.
    products: [[f64; 3]; 3],
}

impl Sums {
    fn add(&mut self, place: DVec3, weight: f64) {
        self.weight += weight;
        self.places += weight * place;
        let d = place.to_array();
        for i in 0..3 {
            for j in 0..=i {
                self.products[i][j] += weight * d[i] * d[j];
            }
        }
    }

    fn frame(&self, origin: DVec3) -> Option<Frame> {
        if !(self.weight > 0.0) {
            return None;
        }
        let mean = (self.places / self.weight).to_array();
        let product = |i: usize, j: usize| self.products[i.max(j)][i.min(j)];
        let about_mean =
            std::array::from_fn(|i| std::array::from_fn(|j| product(i, j) / self.weight - mean[i] * mean[j]));
        let (values, vectors) = eigen::<3>(&about_mean);
        let extent = [values[2], values[1], values[0]].map(|value| value.max(0.0).sqrt());
        Some(Frame { origin, axes: [vectors[2], vectors[1], vectors[0]].map(DVec3::from), extent })
    }
}

/// Heights over a plane: 1, u, v, u^2, uv, v^2, lengths divided by `scale`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Quadric {
    factors: [f64; 6],
    scale: f64,
}

impl Quadric {
    /// The quadric with the least sum of weighted squares, of lower order if samples don't tell more. Also the sum of the weights.
    pub(super) fn fit(local: impl Iterator<Item = ([f64; 3], f64)>, scale: f64) -> Option<(Quadric, f64)> {
        // Of weight times powers of u and v, up to the second, of the third and the fourth order; and of the first of these times height.
        let (mut low, mut right, mut third, mut fourth) = ([0.0; 6], [0.0; 6], [0.0; 4], [0.0; 5]);
        for ([u, v, height], weight) in local {
            let (u, v) = (u / scale, v / scale);
            let [wu, wv] = [weight * u, weight * v];
            let [wuu, wuv, wvv] = [wu * u, wu * v, wv * v];
            let [wuuu, wuuv, wuvv, wvvv] = [wuu * u, wuu * v, wuv * v, wvv * v];
            let terms = [weight, wu, wv, wuu, wuv, wvv];
            add(&mut low, terms);
            add(&mut right, terms.map(|term| term * height));
            add(&mut third, [wuuu, wuuv, wuvv, wvvv]);
            add(&mut fourth, [wuuu * u, wuuu * v, wuuv * v, wuvv * v, wvvv * v]);
        }
        let [w, wu, wv, wuu, wuv, wvv] = low;
        let ([wuuu, wuuv, wuvv, wvvv], [wuuuu, wuuuv, wuuvv, wuvvv, wvvvv]) = (third, fourth);
        let mut squares = [
            [w, 0.0, 0.0, 0.0, 0.0, 0.0],
            [wu, wuu, 0.0, 0.0, 0.0, 0.0],
            [wv, wuv, wvv, 0.0, 0.0, 0.0],
            [wuu, wuuu, wuuv, wuuuu, 0.0, 0.0],
            [wuv, wuuv, wuvv, wuuuv, wuuvv, 0.0],
            [wvv, wuvv, wvvv, wuuvv, wuvvv, wvvvv],
        ];
        // Keeps what samples say nothing of near zero.
        let ridge = RIDGE * squares[0][0];
        (3..6).for_each(|i| squares[i][i] += ridge);
        let factors = solve(&squares, &right).or_else(|| {
            let mean = right[0] / squares[0][0];
            mean.is_finite().then_some([mean, 0.0, 0.0, 0.0, 0.0, 0.0])
        })?;
        factors.iter().all(|f| f.is_finite()).then_some((Quadric { factors, scale }, w))
    }

    /// Height of a place above the surface over a frame, and the direction in which it does, to first order.
    pub(super) fn above(&self, frame: &Frame, place: DVec3) -> (f64, DVec3) {
        let at = frame.to_local(place);
        let [u, v] = [at[0] / self.scale, at[1] / self.scale];
        let [_, along_u, along_v, uu, uv, vv] = self.factors;
        let slopes = [along_u + 2.0 * uu * u + uv * v, along_v + uv * u + 2.0 * vv * v].map(|slope| slope / self.scale);
        let normal = frame.axes[2] - frame.axes[0] * slopes[0] - frame.axes[1] * slopes[1];
        let length = normal.length();
        ((at[2] - self.height(at)) / length, normal / length)
    }

    pub(super) fn height(&self, at: [f64; 3]) -> f64 {
        row(at, self.scale).iter().zip(&self.factors).map(|(x, factor)| x * factor).sum()
    }
}

fn add<const N: usize>(sums: &mut [f64; N], terms: [f64; N]) {
    sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
}

/// Weight of the bend being zero, as a part of that of all samples.
const RIDGE: f64 = 1e-4;

fn row([u, v, _]: [f64; 3], scale: f64) -> [f64; 6] {
    let (u, v) = (u / scale, v / scale);
    [1.0, u, v, u * u, u * v, v * v]
}
