//! How far a quad of four corners lies from the samples seen in it, along their rays.
//!
//! A quad's diagonal makes two triangles of it, and one diagonal makes a ridge where the other makes a valley: as seen from
//! the sensor, of the four planes through three corners each, one diagonal's surface is the nearer one of its two planes
//! everywhere and the other's the farther one. So both surfaces are known along a ray without asking on which side of
//! a diagonal it runs.
//!
//! | sight | what is linear on a plane |
//! |---|---|
//! | flat: orthographic | the height, in column and row |
//! | pinhole | the inverse of the depth, in column and row |
//! | free: spherical, point grids | nothing: each ray is cut with each plane |

use glam::DVec3;

use crate::range_image::{DepthKind, Projection, RangeImage, Samples, Viewing};

/// Sums over the samples of a quad, for one of its diagonals, in world units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sums {
    pub sum: f64,
    pub squares: f64,
    pub max: f64,
}

/// Sums for both diagonals: corner 0 to 2 first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct QuadSums {
    pub diagonals: [Sums; 2],
    /// Valid pixels.
    pub valid: u32,
    /// All pixels.
    pub pixels: u32,
}

/// A vertex of a grid: its pixel and its place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    pub site: [u32; 2],
    /// What is linear in column and row, if anything is.
    pub value: f64,
    /// In the sensor's frame.
    pub point: DVec3,
}

/// An image as something to measure quads against.
pub(super) trait Sight: Sync {
    /// A quad ready to be measured.
    type Quad;

    /// The quad of four corners, in turn.
    fn quad(&self, corners: &[Corner; 4]) -> Self::Quad;

    /// Adds the samples of `row` from column `start` to before `end` to the lanes.
    fn add(&self, quad: &Self::Quad, row: usize, start: usize, end: usize, lanes: &mut Lanes);

    /// Whether the surface that the lanes call first belongs to the diagonal from corner 0 to 2.
    fn first_is_even(&self, quad: &Self::Quad) -> bool;
}

/// Pixels looked at together.
const LANES: usize = 4;

/// Running sums, a lane a pixel: fixed in number, so that sums do not depend on the machine.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Lanes {
    sums: [[f64; LANES]; 2],
    squares: [[f64; LANES]; 2],
    max: [[f64; LANES]; 2],
    valid: [f64; LANES],
}

impl Lanes {
    /// Takes in the distances of the first and the second surface at some pixels; `seen` is 1 at valid ones, else 0.
    #[inline(always)]
    fn take(&mut self, errors: [[f64; LANES]; 2], seen: [f64; LANES]) {
        for s in 0..2 {
            for l in 0..LANES {
                self.sums[s][l] += errors[s][l];
                self.squares[s][l] += errors[s][l] * errors[s][l];
                self.max[s][l] = if errors[s][l] > self.max[s][l] { errors[s][l] } else { self.max[s][l] };
            }
        }
        for l in 0..LANES {
            self.valid[l] += seen[l];
        }
    }

    /// The sums of the lanes, for the diagonals in their order.
    pub fn finish(&self, first_is_even: bool, pixels: u32) -> QuadSums {
        let sum = |v: &[f64; LANES]| (v[0] + v[1]) + (v[2] + v[3]);
        let of = |s: usize| Sums {
            sum: sum(&self.sums[s]),
            squares: sum(&self.squares[s]),
            max: self.max[s].iter().copied().fold(0.0, f64::max),
        };
        let diagonals = if first_is_even { [of(0), of(1)] } else { [of(1), of(0)] };
        QuadSums { diagonals, valid: sum(&self.valid) as u32, pixels }
    }
}

/// The four planes through three corners each, over column and row: value at `origin` and slopes down and right.
pub(super) struct LinearQuad {
    origin: [f64; 2],
    /// Values at the origin and slopes: two planes of the surface that is the larger one, two of the other.
    planes: [[f64; 3]; 4],
    even_is_larger: bool,
}

fn linear(corners: &[Corner; 4]) -> LinearQuad {
    let origin = corners[0].site.map(f64::from);
    let at = corners.map(|c| {
        let [row, col] = c.site.map(f64::from);
        [row - origin[0], col - origin[1], c.value]
    });
    let plane = |a: usize, b: usize, c: usize| -> [f64; 3] {
        let [a, b, c] = [at[a], at[b], at[c]];
        let (b, c) = ([b[0] - a[0], b[1] - a[1], b[2] - a[2]], [c[0] - a[0], c[1] - a[1], c[2] - a[2]]);
        let area = b[0] * c[1] - b[1] * c[0];
        let down = (b[2] * c[1] - b[1] * c[2]) / area;
        let right = (b[0] * c[2] - b[2] * c[0]) / area;
        [a[2] - (down * a[0] + right * a[1]), down, right]
    };
    let even = [plane(0, 1, 2), plane(0, 2, 3)];
    let odd = [plane(0, 1, 3), plane(1, 2, 3)];
    let [row, col, value] = at[1];
    let even_is_larger = value >= even[1][0] + (even[1][1] * row + even[1][2] * col);
    let planes = if even_is_larger { [even[0], even[1], odd[0], odd[1]] } else { [odd[0], odd[1], even[0], even[1]] };
    LinearQuad { origin, planes, even_is_larger }
}

impl LinearQuad {
    /// Calls `take(values, larger, smaller)` for the pixels of a piece of a row, some at a time; NaN past its end.
    #[inline(always)]
    fn run(
        &self,
        values: &[f64],
        row: usize,
        start: usize,
        mut take: impl FnMut(usize, [f64; LANES], [f64; LANES], [f64; LANES]),
    ) {
        let down = row as f64 - self.origin[0];
        let base = self.planes.map(|[value, slope, _]| value + slope * down);
        let right = self.planes.map(|[_, _, slope]| slope);
        let from = start as f64 - self.origin[1];
        let mut block = |at: usize, values: [f64; LANES]| {
            let (mut larger, mut smaller) = ([0.0; LANES], [0.0; LANES]);
            for l in 0..LANES {
                let x = from + (at + l) as f64;
                let [p, q, r, s] = std::array::from_fn(|k| base[k] + right[k] * x);
                larger[l] = if p > q { p } else { q };
                smaller[l] = if r < s { r } else { s };
            }
            take(at, values, larger, smaller);
        };
        let (blocks, rest) = values.as_chunks::<LANES>();
        for (k, &values) in blocks.iter().enumerate() {
            block(k * LANES, values);
        }
        if !rest.is_empty() {
            let mut last = [f64::NAN; LANES];
            last[..rest.len()].copy_from_slice(rest);
            block(blocks.len() * LANES, last);
        }
    }
}

/// Orthographic images: the value is linear.
pub(super) struct Flat<'a> {
    pub values: &'a [f64],
    pub cols: usize,
    /// No error counts for more: where a quad is seen edge-on it would have no bound.
    pub most: f64,
}

impl Sight for Flat<'_> {
    type Quad = LinearQuad;

    fn quad(&self, corners: &[Corner; 4]) -> LinearQuad {
        linear(corners)
    }

    #[inline]
    fn add(&self, quad: &LinearQuad, row: usize, start: usize, end: usize, lanes: &mut Lanes) {
        let values = &self.values[row * self.cols + start..row * self.cols + end];
        let most = self.most;
        quad.run(values, row, start, |_, values, larger, smaller| {
            let (mut errors, mut seen) = ([[0.0; LANES]; 2], [0.0; LANES]);
            for l in 0..LANES {
                let valid = !values[l].is_nan();
                let bounded = |e: f64| if e < most { e } else { most };
                let (first, second) = (bounded((values[l] - larger[l]).abs()), bounded((values[l] - smaller[l]).abs()));
                errors[0][l] = if valid { first } else { 0.0 };
                errors[1][l] = if valid { second } else { 0.0 };
                seen[l] = if valid { 1.0 } else { 0.0 };
            }
            lanes.take(errors, seen);
        });
    }

    fn first_is_even(&self, quad: &LinearQuad) -> bool {
        quad.even_is_larger
    }
}

/// Pinhole images: the inverse of the depth is linear.
pub(super) struct Pinhole<'a> {
    pub values: &'a [f64],
    pub cols: usize,
    pub most: f64,
    pub focal: [f64; 2],
    pub centre: [f64; 2],
    pub depth: DepthKind,
}

impl Sight for Pinhole<'_> {
    type Quad = LinearQuad;

    fn quad(&self, corners: &[Corner; 4]) -> LinearQuad {
        linear(corners)
    }

    #[inline]
    fn add(&self, quad: &LinearQuad, row: usize, start: usize, end: usize, lanes: &mut Lanes) {
        let values = &self.values[row * self.cols + start..row * self.cols + end];
        let y = (row as f64 - self.centre[1]) / self.focal[1];
        let (y, most) = (y * y + 1.0, self.most);
        let (planar, scale, centre) = (self.depth == DepthKind::Planar, 1.0 / self.focal[0], self.centre[0]);
        quad.run(values, row, start, |at, values, larger, smaller| {
            let (mut errors, mut seen) = ([[0.0; LANES]; 2], [0.0; LANES]);
            for l in 0..LANES {
                let x = ((start + at + l) as f64 - centre) * scale;
                let stretch = (x * x + y).sqrt();
                let range = if planar { values[l] * stretch } else { values[l] };
                let valid = !range.is_nan();
                let bounded = |e: f64| if e < most { e } else { most };
                let behind = |inverse: f64| bounded((stretch / inverse - range).abs());
                let (first, second) = (behind(larger[l]), behind(smaller[l]));
                errors[0][l] = if valid { first } else { 0.0 };
                errors[1][l] = if valid { second } else { 0.0 };
                seen[l] = if valid { 1.0 } else { 0.0 };
            }
            lanes.take(errors, seen);
        });
    }

    fn first_is_even(&self, quad: &LinearQuad) -> bool {
        quad.even_is_larger
    }
}

/// Spherical images and point grids: rays are cut with planes in space.
///
/// The quad whose pixels surround a pixel in the grid counts as the one its ray meets; along curved edges the plane of
/// the neighbour may be the one that is met in truth.
pub(super) struct Free<'a> {
    pub points: Points<'a>,
    pub cols: usize,
    pub most: f64,
    /// All rays run this way, or start at the origin of the points.
    pub viewing: Viewing,
}

/// The samples in the sensor's frame.
pub(super) enum Points<'a> {
    Given(&'a [[f32; 3]]),
    Made(Vec<DVec3>),
}

impl Points<'_> {
    /// Of any image.
    pub fn of(image: &RangeImage) -> Points<'_> {
        match image.samples() {
            Samples::Points(points) => Points::Given(points),
            Samples::Values(_) => {
                let mut points = vec![DVec3::NAN; image.len()];
                image.for_each_valid(|row, col, point| points[row * image.cols() + col] = point);
                Points::Made(points)
            }
        }
    }

    #[inline(always)]
    fn get(&self, index: usize) -> DVec3 {
        match self {
            Points::Given(points) => {
                let [x, y, z] = points[index];
                DVec3::new(x.into(), y.into(), z.into())
            }
            Points::Made(points) => points[index],
        }
    }
}

/// A point and the normal of each of the four planes; the first two are those of the diagonal from corner 0 to 2.
pub(super) struct FreeQuad {
    planes: [(DVec3, DVec3); 4],
    /// Whether the surface of that diagonal is the nearer one of its planes; the other's is the farther one.
    even_is_nearer: bool,
}

impl Free<'_> {
    /// Distance along the ray of the sample at `point` from it to a plane; NaN where they don't meet.
    #[inline(always)]
    fn behind(&self, (on_plane, normal): (DVec3, DVec3), point: DVec3) -> f64 {
        let direction = match self.viewing {
            Viewing::Parallel(direction) => direction,
            Viewing::From(eye) => point - eye,
        };
        (on_plane - point).dot(normal) / direction.dot(normal) * direction.length()
    }
}

impl Sight for Free<'_> {
    type Quad = FreeQuad;

    fn quad(&self, corners: &[Corner; 4]) -> FreeQuad {
        let [a, b, c, d] = corners.map(|c| c.point);
        let plane = |a: DVec3, b: DVec3, c: DVec3| (a, (b - a).cross(c - a).normalize_or_zero());
        let planes = [plane(a, b, c), plane(a, c, d), plane(a, b, d), plane(b, c, d)];
        let even_is_nearer = self.behind(planes[1], b) >= 0.0;
        FreeQuad { planes, even_is_nearer }
    }

    fn add(&self, quad: &FreeQuad, row: usize, start: usize, end: usize, lanes: &mut Lanes) {
        for (k, index) in (row * self.cols + start..row * self.cols + end).enumerate() {
            let point = self.points.get(index);
            if point.is_nan() {
                continue;
            }
            let [p, q, r, s] = quad.planes.map(|plane| self.behind(plane, point));
            let (even, odd) = if quad.even_is_nearer { (p.min(q), r.max(s)) } else { (p.max(q), r.min(s)) };
            let bounded = |e: f64| if e.abs() < self.most { e.abs() } else { self.most };
            let (mut errors, mut seen) = ([[0.0; LANES]; 2], [0.0; LANES]);
            (errors[0][k % LANES], errors[1][k % LANES], seen[k % LANES]) = (bounded(even), bounded(odd), 1.0);
            lanes.take(errors, seen);
        }
    }

    fn first_is_even(&self, _quad: &FreeQuad) -> bool {
        true
    }
}

/// What is linear in column and row for a vertex of range `range` at a pixel; the range where nothing is.
pub(super) fn linear_value(projection: &Projection, [row, col]: [u32; 2], range: f64) -> f64 {
    match projection {
        Projection::Pinhole { depth: DepthKind::Planar, .. } => 1.0 / range,
        Projection::Pinhole { focal, centre, depth: DepthKind::Ray } => {
            let (x, y) = ((f64::from(col) - centre[0]) / focal[0], (f64::from(row) - centre[1]) / focal[1]);
            (x * x + y * y + 1.0).sqrt() / range
        }
        _ => range,
    }
}
