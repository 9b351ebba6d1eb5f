//! The verdict on a triangle of the exterior mesh, in the image: invalid, unreliable or reliable (sections 3.3.1 and 3.4).

use glam::DVec3;

use crate::domain::Domain;
use image::range_image::RangeImage;

/// The verdict on a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    /// Nothing yet.
    Unknown,
    /// A sample lies farther away than the tolerance.
    Invalid,
    /// Within the tolerance, but it covers no pixel besides its corners, or is seen at a grazing angle.
    Unreliable,
    /// Part of the result.
    Reliable,
    /// No longer part of the mesh.
    Gone,
}

/// Triangles seen at less than 93 degrees to the viewing direction are unreliable: its cosine.
const GRAZING: f64 = -0.052_335_956_242_943_83;

/// Neighbours that meet at more than 160 degrees are slivers: its cosine.
const SLIVER: f64 = -0.939_692_620_785_908_4;

/// Places along each edge of an unreliable triangle that must lie near the surface.
const PLACES: [f64; 3] = [0.25, 0.5, 0.75];

/// Judges triangles over pixels.
pub(super) struct Judge<'a> {
    image: &'a RangeImage,
    heights: &'a [f64],
    domain: &'a Domain,
    tolerance: f64,
    cols: u32,
}

impl<'a> Judge<'a> {
    pub fn new(image: &'a RangeImage, heights: &'a [f64], domain: &'a Domain, tolerance: f64) -> Self {
        Judge { image, heights, domain, tolerance, cols: image.cols() as u32 }
    }

    fn place(&self, p: u32) -> [i64; 2] {
        [i64::from(p % self.cols), i64::from(p / self.cols)]
    }

    /// Twice the area in pixels: positive if the triangle turns like columns toward rows.
    pub fn turn(&self, triangle: [u32; 3]) -> i64 {
        let [a, b, c] = triangle.map(|p| self.place(p));
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    }

    /// The verdict on a triangle by the samples seen in it.
    pub fn validate(&self, triangle: [u32; 3]) -> Verdict {
        let area = self.turn(triangle);
        if area == 0 {
            return Verdict::Unreliable;
        }
        let [a, b, c] = triangle.map(|p| self.place(p));
        let z = triangle.map(|p| self.heights[p as usize]);
        let range = |axis: usize| (a[axis].min(b[axis]).min(c[axis]), a[axis].max(b[axis]).max(c[axis]));
        let ((left, right), (top, bottom)) = (range(0), range(1));
        let sign = area.signum();
        let mut seen = 0;
        for y in top..=bottom {
            for x in left..=right {
                // Twice the areas opposite to b and c, in the triangle's own turn.
                let of_b = sign * ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0]));
                let of_c = sign * ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]));
                if of_b < 0 || of_c < 0 || of_b + of_c > area.abs() {
                    continue;
                }
                let pixel = (y * i64::from(self.cols) + x) as usize;
                if !self.image.is_valid(pixel) {
                    continue;
                }
                seen += 1;
                let area = area.abs() as f64;
                let (s, t) = (of_b as f64 / area, of_c as f64 / area);
                let error = (z[0] - self.heights[pixel]) + s * (z[1] - z[0]) + t * (z[2] - z[0]);
                if !(error.abs() <= self.tolerance) {
                    return Verdict::Invalid;
                }
            }
        }
        let normal = self.normal(triangle);
        // The sensor looks along -z.
        let grazing = -normal.z > GRAZING * normal.length();
        if seen <= 3 || grazing { Verdict::Unreliable } else { Verdict::Reliable }
    }

    /// The normal of a triangle in space, outward, of any length.
    fn normal(&self, triangle: [u32; 3]) -> DVec3 {
        let [a, b, c] = triangle.map(|p| self.image.point_in_sensor(p as usize));
        let normal = (b - a).cross(c - a);
        if self.domain.mirrored { -normal } else { normal }
    }

    /// Whether two neighbours meet at an angle as slivers do. Triangles seen edge-on have no normal: they do.
    pub fn is_sharp(&self, one: [u32; 3], other: [u32; 3]) -> bool {
        if self.turn(one) == 0 || self.turn(other) == 0 {
            return true;
        }
        let (a, b) = (self.normal(one), self.normal(other));
        !(a.dot(b) >= SLIVER * a.length() * b.length())
    }

    /// Whether nine places along the edges lie within the tolerance of the surface of all samples. Where there is no such
    /// surface nothing is asked for.
    pub fn holds_along_edges(&self, [a, b, c]: [u32; 3]) -> bool {
        [(a, b), (b, c), (c, a)].into_iter().all(|(from, to)| {
            let ([x0, y0], [x1, y1]) = (self.place(from), self.place(to));
            let (z0, z1) = (self.heights[from as usize], self.heights[to as usize]);
            PLACES.into_iter().all(|t| {
                let (x, y) = (x0 as f64 + t * (x1 - x0) as f64, y0 as f64 + t * (y1 - y0) as f64);
                let z = z0 + t * (z1 - z0);
                self.surface(x, y).is_none_or(|surface| (z - surface).abs() <= self.tolerance)
            })
        })
    }

    /// Height of the step-discontinuity triangulation at a column and row.
    fn surface(&self, x: f64, y: f64) -> Option<f64> {
        let (col, row) = (x.floor().min(f64::from(self.cols) - 2.0), y.floor().min(f64::from(self.domain.rows) - 2.0));
        let (s, t) = (x - col, y - row);
        let halves = self.domain.halves(row as i64, col as i64);
        let first = row as usize * self.cols as usize + col as usize;
        let at = |down: usize, right: usize| self.heights[first + down * self.cols as usize + right];
        // By the corner left out: 0 upper left, 1 upper right, 2 lower right, 3 lower left.
        let linear = |origin: f64, along: f64, across: f64, u: f64, v: f64| {
            origin + u * (along - origin) + v * (across - origin)
        };
        if halves & 0b0001 != 0 && s + t >= 1.0 {
            return Some(linear(at(1, 1), at(1, 0), at(0, 1), 1.0 - s, 1.0 - t));
        }
        if halves & 0b0100 != 0 && s + t <= 1.0 {
            return Some(linear(at(0, 0), at(0, 1), at(1, 0), s, t));
        }
        if halves & 0b0010 != 0 && t >= s {
            return Some(linear(at(1, 0), at(1, 1), at(0, 0), s, 1.0 - t));
        }
        if halves & 0b1000 != 0 && s >= t {
            return Some(linear(at(0, 1), at(0, 0), at(1, 1), 1.0 - s, t));
        }
        None
    }
}
