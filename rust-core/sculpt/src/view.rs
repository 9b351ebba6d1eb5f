//! A pixel as the digging sees it: where the sensor sees it, and how far away its sample lies.
//!
//! Seen from the sensor a straight edge is straight, whatever the projection. So the mesh is a planar triangulation of what the sensor
//! sees, and a triangle gives every ray that it covers one range. The four kinds of rays differ in two things only. One is the exact sign
//! that says on which side of an edge a pixel is seen. The other is the formula of that range.
//!
//! | rays | seen at | range of a triangle along a ray |
//! |---|---|---|
//! | flat: orthographic | pixel lattice | linear in column and row |
//! | pinhole | pixel lattice | its inverse is linear in column and row |
//! | parallel: point grid, parallel rays | plane across the rays | linear there |
//! | central: point grid or spherical image, rays from a point | directions | its inverse is linear in the direction |

use glam::{DVec2, DVec3};

use geom::predicates::{orient2d, orient3d};
use image::range_image::{DepthKind, RangeImage};

/// One pixel as the sensor sees it.
pub(super) trait Site: Copy + Send + Sync {
    /// A triangle as a function from rays to ranges.
    type Plane: Copy;

    /// Whether sites lie on the pixel lattice: straight borders of the domain are straight lines then.
    const ON_LATTICE: bool;

    /// Positive if `a`, `b`, `c` turn like columns toward rows, negative if the other way, 0 if they are seen on a line:
    /// exactly.
    fn turn(a: &Self, b: &Self, c: &Self) -> f64;

    /// Whether a triangle of three pixels, seen as a sliver, is wide enough for rounding not to move its edges across it.
    /// On the lattice all are.
    #[inline(always)]
    fn is_wide(_a: &Self, _b: &Self, _c: &Self) -> bool {
        true
    }

    /// The triangle of the samples of three pixels that are not seen on a line.
    fn plane(a: &Self, b: &Self, c: &Self) -> Self::Plane;

    /// Signed distance along the ray of `p` from its sample to the triangle, world units. Infinite if the ray never meets the triangle's
    /// plane.
    fn error(plane: &Self::Plane, p: &Self) -> f64;

    /// Column and row, where pixels lie on a lattice.
    #[inline(always)]
    fn place(&self) -> Option<[f64; 2]> {
        None
    }

    /// The place where the pixel is seen, for angles. Rows of a lattice lie `aspect` columns apart.
    fn seen(&self, aspect: f64) -> DVec3;

    /// A value that is linear on a triangle as seen from the sensor: height, or the inverse of the range.
    fn value(&self) -> f64;

    /// The point of another value on the ray of this sample.
    fn at(&self, value: f64) -> Self;

    /// Value of a triangle on the ray of `p`, less that of its sample.
    fn offset(plane: &Self::Plane, p: &Self) -> f64;

    /// Smallest and largest offset within a tolerance.
    fn room(&self, tolerance: f64) -> [f64; 2];
}

/// Offsets of the inverse of a length within a tolerance.
fn inverse_room(length: f64, inverse: f64, tolerance: f64) -> [f64; 2] {
    let nearest = length - tolerance;
    let highest = if nearest > 0.0 { 1.0 / nearest } else { f64::INFINITY };
    [1.0 / (length + tolerance) - inverse, highest - inverse]
}

/// A site on the pixel lattice, where straight edges in space are straight edges of the lattice.
pub(super) trait LatticeSite: Site {
    /// Like [`Site::error`] for a pixel seen on the edge from `a` to `b`, at the share `t` of its length.
    fn error_on_edge(a: &Self, b: &Self, t: f64, p: &Self) -> f64;
}

/// All pixels of an image.
pub(super) trait View: Sync {
    /// Its kind of pixel.
    type Site: Site;

    /// Pixel `index`, which must be valid.
    fn site(&self, index: u32) -> Self::Site;
}

/// An orthographic pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct FlatSite {
    /// Column and row, whole numbers.
    x: f64,
    y: f64,
    value: f64,
}

/// `origin`, value there, slopes along both axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct LinearPlane {
    x: f64,
    y: f64,
    value: f64,
    slope: [f64; 2],
}

impl LinearPlane {
    #[inline(always)]
    fn through(a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> Self {
        let (bx, by, cx, cy) = (b[0] - a[0], b[1] - a[1], c[0] - a[0], c[1] - a[1]);
        let (bw, cw) = (b[2] - a[2], c[2] - a[2]);
        let area = bx * cy - by * cx;
        let slope = [(bw * cy - cw * by) / area, (cw * bx - bw * cx) / area];
        LinearPlane { x: a[0], y: a[1], value: a[2], slope }
    }

    /// Value at a place, less `subtracted`: differences first, so that far-away surfaces keep their digits.
    #[inline(always)]
    fn above(&self, x: f64, y: f64, subtracted: f64) -> f64 {
        (self.value - subtracted) + (self.slope[0] * (x - self.x) + self.slope[1] * (y - self.y))
    }
}

impl Site for FlatSite {
    type Plane = LinearPlane;

    const ON_LATTICE: bool = true;

    #[inline(always)]
    fn turn(a: &Self, b: &Self, c: &Self) -> f64 {
        // Exact: an image has fewer than 2^32 pixels, so twice the area of a triangle of theirs is below 2^33.
        (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)
    }

    #[inline(always)]
    fn plane(a: &Self, b: &Self, c: &Self) -> LinearPlane {
        LinearPlane::through([a.x, a.y, a.value], [b.x, b.y, b.value], [c.x, c.y, c.value])
    }

    #[inline(always)]
    fn error(plane: &LinearPlane, p: &Self) -> f64 {
        plane.above(p.x, p.y, p.value)
    }

    #[inline(always)]
    fn place(&self) -> Option<[f64; 2]> {
        Some([self.x, self.y])
    }

    fn seen(&self, aspect: f64) -> DVec3 {
        DVec3::new(self.x, self.y * aspect, 0.0)
    }

    fn value(&self) -> f64 {
        self.value
    }

    fn at(&self, value: f64) -> Self {
        FlatSite { value, ..*self }
    }

    fn offset(plane: &LinearPlane, p: &Self) -> f64 {
        Self::error(plane, p)
    }

    fn room(&self, tolerance: f64) -> [f64; 2] {
        [-tolerance, tolerance]
    }
}

impl LatticeSite for FlatSite {
    fn error_on_edge(a: &Self, b: &Self, t: f64, p: &Self) -> f64 {
        (a.value - p.value) + t * (b.value - a.value)
    }
}

/// Orthographic images.
pub(super) struct FlatView<'a> {
    pub values: &'a [f64],
    pub cols: u32,
}

impl View for FlatView<'_> {
    type Site = FlatSite;

    #[inline]
    fn site(&self, index: u32) -> FlatSite {
        FlatSite {
            x: f64::from(index % self.cols),
            y: f64::from(index / self.cols),
            value: self.values[index as usize],
        }
    }
}

/// A pixel of a pinhole image.
#[derive(Clone, Copy, Debug)]
pub(super) struct PinholeSite {
    x: f64,
    y: f64,
    /// Distance from the image plane through the centre of projection, positive, and its inverse.
    depth: f64,
    pub inverse: f64,
    /// Distance along the ray by depth.
    stretch: f64,
}

impl PinholeSite {
    #[inline(always)]
    fn error_of(&self, inverse: f64) -> f64 {
        if inverse > 0.0 { (1.0 / inverse - self.depth) * self.stretch } else { f64::INFINITY }
    }
}

impl Site for PinholeSite {
    type Plane = LinearPlane;

    const ON_LATTICE: bool = true;

    #[inline(always)]
    fn turn(a: &Self, b: &Self, c: &Self) -> f64 {
        (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)
    }

    #[inline(always)]
    fn plane(a: &Self, b: &Self, c: &Self) -> LinearPlane {
        LinearPlane::through([a.x, a.y, a.inverse], [b.x, b.y, b.inverse], [c.x, c.y, c.inverse])
    }

    #[inline(always)]
    fn error(plane: &LinearPlane, p: &Self) -> f64 {
        p.error_of(plane.above(p.x, p.y, 0.0))
    }

    #[inline(always)]
    fn place(&self) -> Option<[f64; 2]> {
        Some([self.x, self.y])
    }

    fn seen(&self, aspect: f64) -> DVec3 {
        DVec3::new(self.x, self.y * aspect, 0.0)
    }

    fn value(&self) -> f64 {
        self.inverse
    }

    fn at(&self, value: f64) -> Self {
        PinholeSite { depth: 1.0 / value, inverse: value, ..*self }
    }

    fn offset(plane: &LinearPlane, p: &Self) -> f64 {
        plane.above(p.x, p.y, p.inverse)
    }

    fn room(&self, tolerance: f64) -> [f64; 2] {
        inverse_room(self.depth, self.inverse, tolerance / self.stretch)
    }
}

impl LatticeSite for PinholeSite {
    fn error_on_edge(a: &Self, b: &Self, t: f64, p: &Self) -> f64 {
        p.error_of(a.inverse + t * (b.inverse - a.inverse))
    }
}

/// Pinhole images.
pub(super) struct PinholeView<'a> {
    pub values: &'a [f64],
    pub cols: u32,
    pub focal: [f64; 2],
    pub centre: [f64; 2],
    pub depth: DepthKind,
}

impl View for PinholeView<'_> {
    type Site = PinholeSite;

    fn site(&self, index: u32) -> PinholeSite {
        let (x, y) = (f64::from(index % self.cols), f64::from(index / self.cols));
        let through = DVec3::new((x - self.centre[0]) / self.focal[0], (y - self.centre[1]) / self.focal[1], 1.0);
        let stretch = through.length();
        let depth = match self.depth {
            DepthKind::Planar => self.values[index as usize],
            DepthKind::Ray => self.values[index as usize] / stretch,
        };
        PinholeSite { x, y, depth, inverse: 1.0 / depth, stretch }
    }
}

/// Height of the thinnest triangle off the lattice by its longest edge, as seen from the sensor.
const LEAST_WIDTH: f64 = 1e-4;

/// A point of a grid seen along parallel rays.
#[derive(Clone, Copy, Debug)]
pub(super) struct ParallelSite {
    pub seen: DVec2,
    /// Along the rays, toward the sensor.
    pub height: f64,
}

impl Site for ParallelSite {
    type Plane = LinearPlane;

    const ON_LATTICE: bool = false;

    #[inline(always)]
    fn turn(a: &Self, b: &Self, c: &Self) -> f64 {
        f64::from(orient2d(a.seen, b.seen, c.seen))
    }

    fn is_wide(a: &Self, b: &Self, c: &Self) -> bool {
        let (ab, ac, bc) = (b.seen - a.seen, c.seen - a.seen, c.seen - b.seen);
        let longest = ab.length_squared().max(ac.length_squared()).max(bc.length_squared());
        ab.perp_dot(ac) > LEAST_WIDTH * longest
    }

    #[inline(always)]
    fn plane(a: &Self, b: &Self, c: &Self) -> LinearPlane {
        let [a, b, c] = [a, b, c].map(|p| [p.seen.x, p.seen.y, p.height]);
        LinearPlane::through(a, b, c)
    }

    #[inline(always)]
    fn error(plane: &LinearPlane, p: &Self) -> f64 {
        plane.above(p.seen.x, p.seen.y, p.height)
    }

    fn seen(&self, _aspect: f64) -> DVec3 {
        self.seen.extend(0.0)
    }

    fn value(&self) -> f64 {
        self.height
    }

    fn at(&self, value: f64) -> Self {
        ParallelSite { height: value, ..*self }
    }

    fn offset(plane: &LinearPlane, p: &Self) -> f64 {
        Self::error(plane, p)
    }

    fn room(&self, tolerance: f64) -> [f64; 2] {
        [-tolerance, tolerance]
    }
}

/// Point grids seen along parallel rays.
pub(super) struct ParallelView<'a> {
    pub image: &'a RangeImage,
    pub right: DVec3,
    pub up: DVec3,
    pub toward: DVec3,
}

impl View for ParallelView<'_> {
    type Site = ParallelSite;

    fn site(&self, index: u32) -> ParallelSite {
        let p = self.image.point_in_sensor(index as usize);
        ParallelSite { seen: DVec2::new(p.dot(self.right), p.dot(self.up)), height: p.dot(self.toward) }
    }
}

/// A sample seen from a point: its place relative to that point, or the opposite of it where the grid is mirrored.
#[derive(Clone, Copy, Debug)]
pub(super) struct CentralSite(pub DVec3);

impl Site for CentralSite {
    /// The plane's normal by its distance: its product with a point of the plane is 1.
    type Plane = DVec3;

    const ON_LATTICE: bool = false;

    #[inline(always)]
    fn turn(a: &Self, b: &Self, c: &Self) -> f64 {
        -f64::from(orient3d(a.0, b.0, c.0, DVec3::ZERO))
    }

    fn is_wide(a: &Self, b: &Self, c: &Self) -> bool {
        let [a, b, c] = [a.0, b.0, c.0].map(DVec3::normalize_or_zero);
        let (ab, ac, bc) = (b - a, c - a, c - b);
        let longest = ab.length_squared().max(ac.length_squared()).max(bc.length_squared());
        ab.cross(ac).dot(a).abs() > LEAST_WIDTH * longest
    }

    #[inline(always)]
    fn plane(a: &Self, b: &Self, c: &Self) -> DVec3 {
        let normal = (b.0 - a.0).cross(c.0 - a.0);
        normal / normal.dot(a.0)
    }

    #[inline(always)]
    fn error(plane: &DVec3, p: &Self) -> f64 {
        let inverse = plane.dot(p.0);
        if inverse > 0.0 { (1.0 / inverse - 1.0) * p.0.length() } else { f64::INFINITY }
    }

    fn seen(&self, _aspect: f64) -> DVec3 {
        self.0.normalize_or_zero()
    }

    /// Ranges are counted in that of the sample.
    fn value(&self) -> f64 {
        1.0
    }

    fn at(&self, value: f64) -> Self {
        CentralSite(self.0 / value)
    }

    fn offset(plane: &DVec3, p: &Self) -> f64 {
        plane.dot(p.0) - 1.0
    }

    fn room(&self, tolerance: f64) -> [f64; 2] {
        inverse_room(1.0, 1.0, tolerance / self.0.length())
    }
}

/// Spherical images and point grids seen from a point.
pub(super) struct CentralView<'a> {
    pub image: &'a RangeImage,
    pub eye: DVec3,
    pub sign: f64,
}

impl View for CentralView<'_> {
    type Site = CentralSite;

    fn site(&self, index: u32) -> CentralSite {
        CentralSite((self.image.point_in_sensor(index as usize) - self.eye) * self.sign)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::FlatSite;

    /// A sample of value 0 at a column and row.
    pub fn flat_site(col: i64, row: i64) -> FlatSite {
        FlatSite { x: col as f64, y: row as f64, value: 0.0 }
    }
}
