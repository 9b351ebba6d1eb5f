//! Distance of a quad of four corners from the samples seen in it, along their rays.
//!
//! A quad's diagonal makes two triangles of it, and one diagonal makes a ridge where the other makes a valley. Four planes run through
//! three corners each. As seen from the sensor, one diagonal's surface is the nearer one of its two planes everywhere and the other's the
//! farther one. So both surfaces are known along a ray without asking on which side of a diagonal it runs.
//!
//! | sight | a value that is linear on a plane |
//! |---|---|
//! | flat: orthographic | the height, in column and row |
//! | pinhole | the inverse of the depth, in column and row |
//! | free: spherical, point grids | nothing: each ray is cut with each plane |

use glam::DVec3;
use wide::f64x4;

use image::range_image::{DepthKind, Projection, RangeImage, Samples, Viewing};

/// Sums over the samples of a quad, for one of its diagonals, in world units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sums {
    pub sum: f64,
    pub squares: f64,
    pub max: f64,
    /// Valid pixels whose rays meet no plane of the surface in front of the sensor: they have no error.
    pub missed: usize,
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
    /// The value that is linear in column and row, if any is.
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
    sums: [f64x4; 2],
    squares: [f64x4; 2],
    max: [f64x4; 2],
    met: [f64x4; 2],
    valid: f64x4,
}

impl Lanes {
    /// Takes in the distances of the first and the second surface at some pixels, as far as they are `valid`. Infinite or NaN if a surface
    /// is not met.
    #[inline(always)]
    fn take(&mut self, errors: [f64x4; 2], valid: f64x4) {
        for (s, error) in errors.into_iter().enumerate() {
            let met = valid & error.simd_lt(f64x4::splat(f64::INFINITY));
            let error = met & error;
            self.sums[s] += error;
            self.squares[s] += error * error;
            self.max[s] = self.max[s].fast_max(error);
            self.met[s] += met & f64x4::ONE;
        }
        self.valid += valid & f64x4::ONE;
    }

    /// The sums of the lanes, for the diagonals in their order.
    pub fn finish(&self, first_is_even: bool, pixels: u32) -> QuadSums {
        let sum = |v: f64x4| {
            let v = v.to_array();
            (v[0] + v[1]) + (v[2] + v[3])
        };
        let of = |s: usize| Sums {
            sum: sum(self.sums[s]),
            squares: sum(self.squares[s]),
            max: self.max[s].to_array().into_iter().fold(0.0, f64::max),
            missed: (sum(self.valid) - sum(self.met[s])) as usize,
        };
        let diagonals = if first_is_even { [of(0), of(1)] } else { [of(1), of(0)] };
        QuadSums { diagonals, valid: sum(self.valid) as u32, pixels }
    }
}

/// The next pixels of a row. NaN past its end.
#[inline(always)]
fn block(values: &[f64]) -> f64x4 {
    match values.first_chunk::<LANES>() {
        Some(&block) => f64x4::new(block),
        None => f64x4::new(std::array::from_fn(|l| values.get(l).copied().unwrap_or(f64::NAN))),
    }
}

/// 0, 1, 2, 3.
const STEPS: f64x4 = f64x4::new([0.0, 1.0, 2.0, 3.0]);

/// The four planes through three corners each, over column and row: value at `origin` and slopes down and right.
pub(super) struct LinearQuad {
    origin: [f64; 2],
    /// Values at the origin and slopes: two planes of the surface that is the larger one, two of the other.
    planes: [[f64; 3]; 4],
    even_is_larger: bool,
}

#[inline(always)]
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
    // Three corners in a line have no plane, and no pixels of their own.
    let pair = |[first, second]: [[f64; 3]; 2]| match (first[1].is_finite(), second[1].is_finite()) {
        (false, true) => [second, second],
        (true, false) => [first, first],
        _ => [first, second],
    };
    let even = pair([plane(0, 1, 2), plane(0, 2, 3)]);
    let odd = pair([plane(0, 1, 3), plane(1, 2, 3)]);
    let [row, col, value] = at[1];
    let even_is_larger = value >= even[1][0] + (even[1][1] * row + even[1][2] * col);
    let planes = if even_is_larger { [even[0], even[1], odd[0], odd[1]] } else { [odd[0], odd[1], even[0], even[1]] };
    LinearQuad { origin, planes, even_is_larger }
}

/// An image on which the value is linear.
trait LinearSight {
    /// Data that are the same for all pixels of a row.
    type Row: Copy;

    fn row(&self, row: usize) -> Self::Row;

    /// Distances along the rays of the pixels of a row at `cols` between their samples, with these stored values, and a linear value.
    fn errors(&self, row: Self::Row, cols: f64x4, values: f64x4, surfaces: [f64x4; 2]) -> [f64x4; 2];
}

/// Adds a piece of a row to the lanes.
#[inline(always)]
fn add_linear<S: LinearSight>(
    sight: &S,
    mut values: &[f64],
    quad: &LinearQuad,
    [row, start]: [usize; 2],
    lanes: &mut Lanes,
) {
    let along = sight.row(row);
    let down = row as f64 - quad.origin[0];
    let base = quad.planes.map(|[value, slope, _]| f64x4::splat(value + slope * down));
    let right = quad.planes.map(|[_, _, slope]| f64x4::splat(slope));
    let mut cols = f64x4::splat(start as f64) + STEPS;
    while !values.is_empty() {
        let here = block(values);
        let x = cols - f64x4::splat(quad.origin[1]);
        let [p, q, r, s] = [0, 1, 2, 3].map(|k| base[k] + right[k] * x);
        let errors = sight.errors(along, cols, here, [p.fast_max(q), r.fast_min(s)]);
        lanes.take(errors, !here.is_nan());
        cols += f64x4::splat(LANES as f64);
        values = &values[LANES.min(values.len())..];
    }
}

/// Orthographic images: the value is linear.
pub(super) struct Flat<'a> {
    pub values: &'a [f64],
    pub cols: usize,
}

impl LinearSight for Flat<'_> {
    type Row = ();

    #[inline(always)]
    fn row(&self, _row: usize) {}

    #[inline(always)]
    fn errors(&self, (): (), _cols: f64x4, values: f64x4, surfaces: [f64x4; 2]) -> [f64x4; 2] {
        surfaces.map(|surface| (values - surface).abs())
    }
}

impl Sight for Flat<'_> {
    type Quad = LinearQuad;

    #[inline(always)]
    fn quad(&self, corners: &[Corner; 4]) -> LinearQuad {
        linear(corners)
    }

    #[inline(always)]
    fn add(&self, quad: &LinearQuad, row: usize, start: usize, end: usize, lanes: &mut Lanes) {
        let values = &self.values[row * self.cols + start..row * self.cols + end];
        add_linear(self, values, quad, [row, start], lanes);
    }

    fn first_is_even(&self, quad: &LinearQuad) -> bool {
        quad.even_is_larger
    }
}

/// Pinhole images: the inverse of the depth is linear.
pub(super) struct Pinhole<'a> {
    pub values: &'a [f64],
    pub cols: usize,
    pub focal: [f64; 2],
    pub centre: [f64; 2],
    pub depth: DepthKind,
}

impl LinearSight for Pinhole<'_> {
    /// The square of the length of the row's direction beside x.
    type Row = f64;

    #[inline(always)]
    fn row(&self, row: usize) -> f64 {
        let y = (row as f64 - self.centre[1]) / self.focal[1];
        y * y + 1.0
    }

    #[inline(always)]
    fn errors(&self, y: f64, cols: f64x4, values: f64x4, surfaces: [f64x4; 2]) -> [f64x4; 2] {
        let x = (cols - f64x4::splat(self.centre[0])) * f64x4::splat(1.0 / self.focal[0]);
        let stretch = (x * x + f64x4::splat(y)).sqrt();
        let range = if self.depth == DepthKind::Planar { values * stretch } else { values };
        surfaces.map(|inverse| (stretch / inverse - range).abs())
    }
}

impl Sight for Pinhole<'_> {
    type Quad = LinearQuad;

    #[inline(always)]
    fn quad(&self, corners: &[Corner; 4]) -> LinearQuad {
        linear(corners)
    }

    #[inline(always)]
    fn add(&self, quad: &LinearQuad, row: usize, start: usize, end: usize, lanes: &mut Lanes) {
        let values = &self.values[row * self.cols + start..row * self.cols + end];
        add_linear(self, values, quad, [row, start], lanes);
    }

    fn first_is_even(&self, quad: &LinearQuad) -> bool {
        quad.even_is_larger
    }
}

/// Spherical images and point grids: rays are cut with planes in space.
///
/// The quad whose pixels surround a pixel in the grid counts as the one its ray meets. Along curved edges the plane of the neighbour may be
/// the one that is met in truth.
pub(super) struct Free<'a> {
    pub points: Points<'a>,
    pub cols: usize,
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

    /// Coordinates of some points from `start` on, but before `end`. NaN from there on.
    #[inline(always)]
    fn block(&self, start: usize, end: usize) -> [f64x4; 3] {
        let mut points = [[f64::NAN; 3]; LANES];
        match self {
            Points::Given(given) => {
                for (point, given) in points.iter_mut().zip(&given[start..end]) {
                    *point = given.map(f64::from);
                }
            }
            Points::Made(made) => {
                for (point, made) in points.iter_mut().zip(&made[start..end]) {
                    *point = made.to_array();
                }
            }
        }
        std::array::from_fn(|axis| f64x4::new(points.map(|point| point[axis])))
    }
}

/// The four planes through three corners each. The first two are those of the diagonal from corner 0 to 2.
pub(super) struct FreeQuad {
    planes: [FreePlane; 4],
    /// Whether the surface of that diagonal is the nearer one of its planes. The other's is the farther one.
    even_is_nearer: bool,
}

/// The points p with `normal . p == offset`: p in the sensor's frame, or from the eye. If all rays run the same way, `normal . direction`
/// is 1.
#[derive(Clone, Copy)]
struct FreePlane {
    normal: DVec3,
    offset: f64,
}

impl FreePlane {
    fn is_seen(&self) -> bool {
        self.normal.is_finite() && self.normal != DVec3::ZERO
    }
}

impl Free<'_> {
    #[inline(always)]
    fn plane(&self, a: DVec3, b: DVec3, c: DVec3) -> FreePlane {
        let normal = (b - a).cross(c - a).normalize_or_zero();
        match self.viewing {
            Viewing::Parallel(direction) => {
                let normal = normal / direction.dot(normal);
                FreePlane { normal, offset: normal.dot(a) }
            }
            Viewing::From(eye) => FreePlane { normal, offset: normal.dot(a - eye) },
        }
    }

    /// Distances along the rays of the samples at `points` from them to some planes. If a ray meets one not at all or behind the eye, the
    /// plane is infinitely far: so the nearer and the farther one of two are what they are in front.
    #[inline(always)]
    fn behind<const N: usize>(&self, planes: [FreePlane; N], points: [f64x4; 3]) -> [f64x4; N] {
        let dot =
            |n: DVec3, p: [f64x4; 3]| f64x4::splat(n.x) * p[0] + f64x4::splat(n.y) * p[1] + f64x4::splat(n.z) * p[2];
        match self.viewing {
            Viewing::Parallel(_) => planes.map(|plane| f64x4::splat(plane.offset) - dot(plane.normal, points)),
            Viewing::From(eye) => {
                let eye = eye.to_array().map(f64x4::splat);
                let rays: [f64x4; 3] = std::array::from_fn(|axis| points[axis] - eye[axis]);
                let lengths = (rays[0] * rays[0] + rays[1] * rays[1] + rays[2] * rays[2]).sqrt();
                planes.map(|plane| {
                    let cut = f64x4::splat(plane.offset) / dot(plane.normal, rays);
                    let ahead = cut.simd_gt(f64x4::ZERO).select(cut, f64x4::splat(f64::INFINITY));
                    (ahead - f64x4::ONE) * lengths
                })
            }
        }
    }
}

impl Sight for Free<'_> {
    type Quad = FreeQuad;

    #[inline(always)]
    fn quad(&self, corners: &[Corner; 4]) -> FreeQuad {
        let [a, b, c, d] = corners.map(|c| c.point);
        // Three corners in a line, or in a plane that runs along the rays, have no surface to be seen.
        let pair = |[first, second]: [FreePlane; 2]| match (first.is_seen(), second.is_seen()) {
            (false, true) => [second, second],
            (true, false) => [first, first],
            _ => [first, second],
        };
        let even = pair([self.plane(a, b, c), self.plane(a, c, d)]);
        let odd = pair([self.plane(a, b, d), self.plane(b, c, d)]);
        let planes = [even[0], even[1], odd[0], odd[1]];
        let [behind] = self.behind([planes[1]], b.to_array().map(f64x4::splat));
        FreeQuad { planes, even_is_nearer: behind.to_array()[0] >= 0.0 }
    }

    #[inline(always)]
    fn add(&self, quad: &FreeQuad, row: usize, start: usize, end: usize, lanes: &mut Lanes) {
        let end = row * self.cols + end;
        for index in (row * self.cols + start..end).step_by(LANES) {
            let points = self.points.block(index, end);
            let [p, q, r, s] = self.behind(quad.planes, points);
            let (even, odd) =
                if quad.even_is_nearer { (p.fast_min(q), r.fast_max(s)) } else { (p.fast_max(q), r.fast_min(s)) };
            lanes.take([even.abs(), odd.abs()], !points[0].is_nan());
        }
    }

    fn first_is_even(&self, _quad: &FreeQuad) -> bool {
        true
    }
}

/// The value that is linear in column and row for a vertex of range `range` at a pixel. The range if nothing is.
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
