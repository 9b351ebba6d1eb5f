//! Parts of a distance field: distances that are exact or slightly short, with a colour.

use glam::DVec3;

/// The distance of a point from a part, and the part's colour there (linear, 0 to 1).
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    pub distance: f64,
    pub colour: DVec3,
}

impl Part {
    /// A part that is nowhere near.
    pub const FAR: Part = Part { distance: 1e9, colour: DVec3::ZERO };

    pub fn new(distance: f64, colour: DVec3) -> Self {
        Part { distance, colour }
    }

    /// The nearer of the two.
    pub fn or(self, other: Part) -> Part {
        if other.distance < self.distance { other } else { self }
    }

    /// Both, with a fillet of about the size `k` where they meet.
    pub fn blend(self, other: Part, k: f64) -> Part {
        let share = (0.5 + 0.5 * (other.distance - self.distance) / k).clamp(0.0, 1.0);
        Part {
            distance: smooth_min(self.distance, other.distance, k),
            colour: other.colour.lerp(self.colour, smooth_step(0.3, 0.7, share)),
        }
    }

    /// The colour, encoded.
    pub fn srgb(&self) -> [u8; 4] {
        let encode = |x: f64| {
            let x = x.clamp(0.0, 1.0);
            let x = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
            (255.0 * x).round() as u8
        };
        [encode(self.colour.x), encode(self.colour.y), encode(self.colour.z), 255]
    }
}

/// The smaller of two distances, rounded off where they differ by less than `k`.
pub(super) fn smooth_min(a: f64, b: f64, k: f64) -> f64 {
    let h = (k - (a - b).abs()).max(0.0) / k;
    a.min(b) - 0.25 * h * h * k
}

/// The larger of two distances, rounded off.
pub(super) fn smooth_max(a: f64, b: f64, k: f64) -> f64 {
    -smooth_min(-a, -b, k)
}

/// 0 up to `from`, 1 from `to` on.
pub(super) fn smooth_step(from: f64, to: f64, x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// A bone: the tube from `a` to `b` whose radius changes from `ra` to `rb`.
pub(super) fn bone(p: DVec3, a: DVec3, b: DVec3, ra: f64, rb: f64) -> f64 {
    let t = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
    p.distance(a.lerp(b, t)) - (ra + (rb - ra) * t)
}

/// A bent tube through the points, tapering from `ra` to `rb`.
pub(super) fn tube(p: DVec3, points: &[DVec3], ra: f64, rb: f64) -> f64 {
    let n = (points.len() - 1) as f64;
    let radius = |i: usize| ra + (rb - ra) * i as f64 / n;
    (1..points.len()).fold(f64::INFINITY, |d, i| d.min(bone(p, points[i - 1], points[i], radius(i - 1), radius(i))))
}

/// An ellipsoid's distance, to first order.
pub(super) fn ellipsoid(p: DVec3, radii: DVec3) -> f64 {
    let (k0, k1) = ((p / radii).length(), (p / (radii * radii)).length());
    if k1 == 0.0 { -radii.min_element() } else { k0 * (k0 - 1.0) / k1 }
}
