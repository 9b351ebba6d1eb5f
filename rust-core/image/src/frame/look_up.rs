//! The colour of each sample: where the colour camera sees the sample's point, unless a nearer one hides it.

use glam::DAffine3;

use super::rim::Rim;
use super::{Camera, ColourImage};
use crate::range_image::{Projection, RangeImage};
use base::error::Result;
use base::progress::{Pace, Progress};
use mesh::srgb::Mix;

/// A sample is hidden by one that is nearer to the colour camera by more than this factor. Surfaces seen at up to 80 degrees don't hide
/// themselves, and a nearer surface of a thirtieth of the distance is no other colour's worth.
const NEARER: f32 = 1.03;

/// The colours and places that were looked up.
pub(super) struct Found {
    /// A colour per pixel. Alpha is 0 where none is seen.
    pub(super) colours: Vec<[u8; 4]>,
    /// Pixels with a sample that is seen in the image's black rim, ascending.
    pub(super) in_rim: Vec<usize>,
}

/// Looks up the colours of all samples. Bilinear between pixels.
pub(super) fn colours(depth: &RangeImage, image: &ColourImage, progress: &Progress<'_>) -> Result<Found> {
    let rim = image.black_rim.then(|| Rim::of(image));
    if rim.is_none() && is_registered(depth, image) {
        let colours = image.pixels.iter().map(|&[r, g, b]| [r, g, b, u8::MAX]).collect();
        return Ok(Found { colours, in_rim: Vec::new() });
    }
    let seen = project(depth, image, progress)?;
    // From the same place nothing hides what the other camera sees.
    let nearest = (image.colour_from_depth.translation.length() > 0.0).then(|| Nearest::of(&seen, depth, image));
    let mut found = Found { colours: vec![[0; 4]; depth.len()], in_rim: Vec::new() };
    let mut pace = Pace::new(progress);
    for (pixel, &[col, row, z]) in seen.iter().enumerate() {
        pace.after(1)?;
        if z.is_nan() || nearest.as_ref().is_some_and(|nearest| nearest.hides(col, row, z)) {
            continue;
        }
        if rim.as_ref().is_some_and(|rim| rim.holds(row.round() as usize, col.round() as usize)) {
            found.in_rim.push(pixel);
            continue;
        }
        found.colours[pixel] = between(image, col, row);
    }
    Ok(found)
}

/// Whether the colour image has a pixel for each of depth, and sees the same through it.
fn is_registered(depth: &RangeImage, image: &ColourImage) -> bool {
    let same =
        |camera: &Camera, focal: &[f64; 2], centre: &[f64; 2]| camera.focal == *focal && camera.centre == *centre;
    image.size() == [depth.cols(), depth.rows()]
        && image.colour_from_depth == DAffine3::IDENTITY
        && matches!(depth.projection(), Projection::Pinhole { focal, centre, .. } if same(&image.camera, focal, centre))
}

/// Column, row and depth of each sample in the colour camera. NaN where there is none or it lies outside of the image.
fn project(depth: &RangeImage, image: &ColourImage, progress: &Progress<'_>) -> Result<Vec<[f32; 3]>> {
    let [cols, rows] = image.size();
    let mut seen = vec![[f32::NAN; 3]; depth.len()];
    let (width, colour_from_depth) = (depth.cols(), image.colour_from_depth);
    let visit = |row: usize, col: usize, point| {
        let point = colour_from_depth.transform_point3(point);
        let [x, y] = image.camera.project(point);
        let is_inside = (-0.5..cols as f64 - 0.5).contains(&x) && (-0.5..rows as f64 - 0.5).contains(&y);
        if point.z > 0.0 && is_inside {
            // A place that rounds up to the next pixel would lie outside.
            let inside = |at: f64, count: usize| (at as f32).clamp(0.0, (count - 1) as f32);
            seen[row * width + col] = [inside(x, cols), inside(y, rows), point.z as f32];
        }
    };
    depth.try_for_each_valid(visit, progress)?;
    Ok(seen)
}

/// The nearest sample around each place of the colour image, in cells as wide as samples lie apart there.
struct Nearest {
    cols: usize,
    rows: usize,
    per_pixel: [f32; 2],
    z: Vec<f32>,
}

impl Nearest {
    fn of(seen: &[[f32; 3]], depth: &RangeImage, image: &ColourImage) -> Nearest {
        let [cols, rows] = image.size();
        // Samples lie as far apart as the focal lengths' ratio; never less than a pixel.
        let focal = match depth.projection() {
            Projection::Pinhole { focal, .. } => focal.map(f64::abs),
            _ => image.camera.focal.map(f64::abs),
        };
        let per_pixel = [0, 1].map(|axis| (focal[axis] / image.camera.focal[axis].abs()).min(1.0) as f32);
        let count = |length: usize, per_pixel: f32| (length as f32 * per_pixel) as usize + 1;
        let (cols, rows) = (count(cols, per_pixel[0]), count(rows, per_pixel[1]));
        let mut nearest = Nearest { cols, rows, per_pixel, z: vec![f32::INFINITY; cols * rows] };
        for &[col, row, z] in seen.iter().filter(|seen| !seen[2].is_nan()) {
            let [row, col] = nearest.cell(col, row);
            let cell = &mut nearest.z[row * cols + col];
            *cell = cell.min(z);
        }
        nearest
    }

    fn cell(&self, col: f32, row: f32) -> [usize; 2] {
        [(row * self.per_pixel[1]) as usize, (col * self.per_pixel[0]) as usize]
    }

    /// Whether a sample seen there at this depth is hidden. The cells around count: samples leave some empty.
    fn hides(&self, col: f32, row: f32, z: f32) -> bool {
        let [row, col] = self.cell(col, row);
        let around = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
        around(row, self.rows)
            .flat_map(|row| around(col, self.cols).map(move |col| row * self.cols + col))
            .any(|cell| self.z[cell] * NEARER < z)
    }
}

/// The colour between the pixels around a place inside the image.
fn between(image: &ColourImage, col: f32, row: f32) -> [u8; 4] {
    let [cols, rows] = image.size();
    let (left, top) = (col as usize, row as usize);
    let (right, bottom) = ((left + 1).min(cols - 1), (top + 1).min(rows - 1));
    let (x, y) = (col - left as f32, row - top as f32);
    let at = |row: usize, col: usize| image.pixels[row * cols + col];
    let corners = [at(top, left), at(top, right), at(bottom, left), at(bottom, right)];
    let weights = [(1.0 - x) * (1.0 - y), x * (1.0 - y), (1.0 - x) * y, x * y];
    let mut mix = Mix::default();
    corners.iter().zip(weights).for_each(|(&[r, g, b], weight)| mix.add_share([r, g, b, u8::MAX], weight));
    mix.colour()
}
