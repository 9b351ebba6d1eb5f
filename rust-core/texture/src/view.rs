//! A photo's camera in its place: where it sees a point of the detailed surface, and whether it does.
//!
//! The surface is drawn into a buffer of depths first. It decides for most points at once. At edges a ray does.

use glam::{DAffine3, DVec2, DVec3};

use base::error::Result;
use base::progress::{Pace, Progress};
use geom::bvh::Ray;
use image::frame::Camera;
use image::photo::Depths;

use super::behind::Detail;

/// Longest side of the buffer of depths.
const LONGEST: usize = 1024;
/// Pixels of the buffer over which a surface may rise towards the camera without hiding itself.
const SLOPE: f64 = 1.5;
/// The same for measured depths, whose pixels are means.
const MEASURED_SLOPE: f64 = 2.5;
/// Measured depths are trusted to this share of them.
const MEASURED: f64 = 0.02;
/// A ray ends this share of its length before its point: what is nearer belongs to the same place.
const SHORT: f64 = 1e-4;
/// Least cosine between normal and ray of a surface that is seen.
const GRAZING: f64 = 0.1;
/// Depths that differ by less than this share of them are about the same.
const ABOUT: f64 = 0.05;
/// Share of the image's shorter side over which weights rise from its border.
const BORDER: f64 = 0.05;
/// Weight of a place whose pixel also shows what lies before or behind it: it decides only where no photo sees better.
const AT_EDGE: f64 = 1e-3;

/// A camera and the depths of what it sees.
pub struct View {
    camera: Camera,
    camera_from_origin: DAffine3,
    eye: DVec3,
    drawn: Buffer,
    measured: Option<Buffer>,
}

/// The pixel at which a point is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Column and row, centres of pixels at whole numbers.
    pub at: DVec2,
    /// Cosine between normal and ray.
    pub cosine: f64,
    /// Weight of the photo for it, by angle, resolution and border.
    pub weight: f64,
    /// Whether its pixel shows this surface alone.
    pub is_clear: bool,
}

impl View {
    /// A camera. Its pose is relative to [`Detail::origin`].
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn new(
        camera: Camera,
        origin_from_camera: DAffine3,
        detail: &Detail<'_>,
        depths: Option<&Depths>,
        progress: &Progress<'_>,
    ) -> Result<Self> {
        let camera_from_origin = origin_from_camera.inverse();
        let drawn = Buffer::drawn(&camera, &camera_from_origin, detail, progress)?;
        let measured = depths.map(|depths| {
            let is_measured = |&z: &f32| if z > 0.0 { z } else { f32::INFINITY };
            Buffer::new(depths.size, depths.values.iter().map(is_measured).collect(), &camera)
        });
        Ok(View { camera, camera_from_origin, eye: origin_from_camera.translation, drawn, measured })
    }

    /// Whether so many pixels to all sides of a place nothing is seen but what lies at about its depth.
    pub fn is_wide(&self, at: DVec2, point: DVec3, radius: f64) -> bool {
        let depth = self.camera_from_origin.transform_point3(point).z;
        let sides = [DVec2::X, DVec2::NEG_X, DVec2::Y, DVec2::NEG_Y];
        sides.into_iter().all(|side| self.drawn.is_about(at + side * radius, depth))
    }

    /// The point in the camera's frame, and its pixel.
    #[inline]
    fn project(&self, point: DVec3) -> (DVec3, DVec2) {
        let p = self.camera_from_origin.transform_point3(point);
        (p, DVec2::from(self.camera.focal) * DVec2::new(p.x, p.y) / p.z + DVec2::from(self.camera.centre))
    }

    /// The pixel that shows a point of the surface, relative to [`Detail::origin`]. `None` if the point is hidden, turned away or outside,
    /// and without `edges` also if that is not clear.
    #[inline]
    pub fn see(&self, point: DVec3, normal: DVec3, detail: &Detail<'_>, edges: bool) -> Option<Seen> {
        let to_eye = self.eye - point;
        let distance = to_eye.length();
        let cosine = normal.dot(to_eye) / distance;
        if !(cosine >= GRAZING) {
            return None;
        }
        let (p, at) = self.project(point);
        let [columns, rows] = self.camera.size.unwrap_or_default();
        let last = DVec2::new(columns as f64 - 1.0, rows as f64 - 1.0);
        if !(p.z > 0.0 && at.cmpge(DVec2::ZERO).all() && at.cmple(last).all()) {
            return None;
        }
        let slope = (1.0 - cosine * cosine).max(0.0).sqrt() / cosine;
        let is_clear = match self.drawn.judge(at, p.z, SLOPE * slope) {
            Judged::Seen => true,
            Judged::Hidden => return None,
            _ if !edges => return None,
            Judged::SeenAtEdge => false,
            Judged::Undecided => {
                let ray = Ray { origin: self.eye + detail.origin, direction: -to_eye };
                if detail.bvh.first_hit(&ray, 0.0, 1.0 - SHORT).is_some() {
                    return None;
                }
                false
            }
        };
        if let Some(measured) = &self.measured
            && measured.is_hidden(at, p.z, MEASURED_SLOPE * slope)
        {
            return None;
        }
        let inside = at.min(last - at).min_element() / (BORDER * last.min_element()).max(1.0);
        let resolution = self.camera.focal[0] * self.camera.focal[1] / (p.z * p.z);
        let weight = cosine * cosine * resolution * inside.clamp(0.01, 1.0) * if is_clear { 1.0 } else { AT_EDGE };
        Some(Seen { at, cosine, weight, is_clear })
    }
}

enum Judged {
    Seen,
    SeenAtEdge,
    Hidden,
    Undecided,
}

/// Depths of the nearest surface: smallest and largest of each pixel, those to the right, below and in between.
struct Buffer {
    size: [usize; 2],
    /// Pixels of the buffer for one of the photo.
    scale: DVec2,
    /// Size of a pixel of the buffer at depth 1.
    pixel: f64,
    nearest: Vec<f32>,
    farthest: Vec<f32>,
}

impl Buffer {
    fn new(size: [usize; 2], depths: Vec<f32>, camera: &Camera) -> Self {
        let [columns, rows] = camera.size.unwrap_or_default();
        let scale = DVec2::new(size[0] as f64 / columns as f64, size[1] as f64 / rows as f64);
        let pixel = 1.0 / (camera.focal[0] * scale.x).abs().min((camera.focal[1] * scale.y).abs());
        let nearest = of_four(&depths, size[0], f32::min);
        let farthest = of_four(&depths, size[0], f32::max);
        Buffer { size, scale, pixel, nearest, farthest }
    }

    /// The detailed surface, drawn.
    fn drawn(
        camera: &Camera,
        camera_from_origin: &DAffine3,
        detail: &Detail<'_>,
        progress: &Progress<'_>,
    ) -> Result<Self> {
        let [columns, rows] = camera.size.unwrap_or_default();
        let factor = columns.max(rows).div_ceil(LONGEST);
        let size = [columns.div_ceil(factor), rows.div_ceil(factor)];
        let small = camera.scaled_to(size);
        let camera_from_world = *camera_from_origin * DAffine3::from_translation(-detail.origin);
        let mut depths = vec![f32::INFINITY; size[0] * size[1]];
        let mut pace = Pace::new(progress);
        let points: Vec<DVec3> = detail.mesh.positions.iter().map(|&p| camera_from_world.transform_point3(p)).collect();
        let farthest = points.iter().map(|p| p.z).fold(0.0, f64::max);
        for triangle in &detail.mesh.triangles {
            pace.after(16)?;
            let corners = triangle.map(|v| points[v as usize]);
            let near = 1e-6 * farthest;
            if corners.iter().all(|p| p.z >= near) {
                draw(corners, &small, size, &mut depths, &mut pace)?;
            } else {
                let clipped = before(corners, near);
                for k in 2..clipped.len() {
                    draw([clipped[0], clipped[k - 1], clipped[k]], &small, size, &mut depths, &mut pace)?;
                }
            }
        }
        Ok(Self::new(size, depths, camera))
    }

    fn at(&self, at: DVec2) -> usize {
        // The four around a place; in the last column and row there are two.
        let of = |x: f64, scale: f64, count: usize| (((x + 0.5) * scale - 0.5) as usize).min(count.max(2) - 2);
        of(at.y, self.scale.y, self.size[1]) * self.size[0] + of(at.x, self.scale.x, self.size[0])
    }

    fn is_about(&self, at: DVec2, depth: f64) -> bool {
        let i = self.at(at);
        let is_near = |other: f32| (f64::from(other) - depth).abs() < ABOUT * depth;
        is_near(self.nearest[i]) && is_near(self.farthest[i])
    }

    #[inline]
    fn judge(&self, at: DVec2, depth: f64, slope: f64) -> Judged {
        let i = self.at(at);
        let room = depth * (slope * self.pixel + 1e-5);
        if depth <= f64::from(self.nearest[i]) + room {
            let is_at_edge = depth + 8.0 * room < f64::from(self.farthest[i]);
            return if is_at_edge { Judged::SeenAtEdge } else { Judged::Seen };
        }
        if depth > f64::from(self.farthest[i]) + room { Judged::Hidden } else { Judged::Undecided }
    }

    fn is_hidden(&self, at: DVec2, depth: f64, slope: f64) -> bool {
        let farthest = f64::from(self.farthest[self.at(at)]);
        depth > farthest * (1.0 + MEASURED) + depth * slope * self.pixel
    }
}

/// The smallest or largest of each value and those to the right, below and in between.
fn of_four(values: &[f32], columns: usize, of: fn(f32, f32) -> f32) -> Vec<f32> {
    let mut found = values.to_vec();
    found.iter_mut().zip(&values[1..]).for_each(|(found, &next)| *found = of(*found, next));
    for i in 0..values.len().saturating_sub(columns) {
        found[i] = of(found[i], found[i + columns]);
    }
    found
}

/// The part of a triangle beyond a depth.
fn before(corners: [DVec3; 3], near: f64) -> Vec<DVec3> {
    let mut clipped = Vec::with_capacity(4);
    for k in 0..3 {
        let (p, q) = (corners[k], corners[(k + 1) % 3]);
        if p.z >= near {
            clipped.push(p);
        }
        if (p.z >= near) != (q.z >= near) {
            clipped.push(p + (q - p) * ((near - p.z) / (q.z - p.z)));
        }
    }
    clipped
}

/// Draws a triangle in front of the camera. The inverse of the depth is linear in the image.
fn draw(
    corners: [DVec3; 3],
    camera: &Camera,
    [columns, rows]: [usize; 2],
    depths: &mut [f32],
    pace: &mut Pace<'_>,
) -> Result<()> {
    let at = |p: DVec3| DVec2::from(camera.focal) * DVec2::new(p.x, p.y) / p.z + DVec2::from(camera.centre);
    let [a, b, c] = corners.map(at);
    let whole = (b - a).perp_dot(c - a);
    if whole == 0.0 || !whole.is_finite() {
        return Ok(());
    }
    let (low, high) = (a.min(b).min(c).ceil().max(DVec2::ZERO), a.max(b).max(c).floor());
    let [right, bottom] = [high.x.min(columns as f64 - 1.0), high.y.min(rows as f64 - 1.0)];
    if low.x > right || low.y > bottom {
        return Ok(());
    }
    let inverse = corners.map(|p| 1.0 / p.z);
    // Weights of the first two corners, linear in the image, and their steps along a row.
    let weight = |p: DVec2, q: DVec2, at: DVec2| (p - at).perp_dot(q - at) / whole;
    let steps = [(b.y - c.y) / whole, (c.y - a.y) / whole];
    for row in low.y as usize..=bottom as usize {
        pace.after((right - low.x) as usize)?;
        let first = DVec2::new(low.x, row as f64);
        let [u, v] = [weight(b, c, first), weight(c, a, first)];
        let there = &mut depths[row * columns + low.x as usize..=row * columns + right as usize];
        for (i, depth) in there.iter_mut().enumerate() {
            let [u, v] = [u + steps[0] * i as f64, v + steps[1] * i as f64];
            let w = 1.0 - u - v;
            if u >= 0.0 && v >= 0.0 && w >= 0.0 {
                *depth = depth.min((1.0 / (u * inverse[0] + v * inverse[1] + w * inverse[2])) as f32);
            }
        }
    }
    Ok(())
}
