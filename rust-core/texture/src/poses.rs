//! Cameras refined by the photos: each is moved until it shows what the others show at the same places. After \[ZK14\]
//!
//! At samples of the surface the grey of each photo is compared with the mean of the *other* photos. Gauss and Newton's steps on six
//! numbers per photo, coarse to fine, robust. The surface stays as it is, and so it holds all cameras together.

use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3};
use rayon::prelude::*;

use base::error::Result;
use base::progress::Progress;
use geom::linear;
use image::frame::Camera;
use image::photo::{self, Photo, Pixels};

use super::behind::{Detail, Place};
use super::view::View;

/// Radii of the blur, in pixels of the photo ...
const BLURS: [f64; 3] = [4.0, 2.0, 1.0];
/// ... and steps at each.
const STEPS: usize = 5;
/// Pixels to all sides that a blur mixes in, in radii.
const BLURRED: f64 = 1.5;
/// Bytes that all grey photos together take at most. Larger ones are halved until they fit.
const BYTES: usize = 1 << 29;
/// Greys that differ by this many times the median difference have a quarter of their weight.
const ROBUST: f64 = 2.0;
/// Fewest samples that a camera is moved by.
const FEWEST: usize = 200;

/// A photo in grey, from 0 to 255, made smaller by a whole factor.
pub struct Grey {
    size: [usize; 2],
    factor: usize,
    values: Vec<u8>,
}

/// A camera in the making.
pub struct Posed<'a> {
    /// The camera.
    pub camera: Camera,
    /// Its pose, relative to [`Detail::origin`].
    pub origin_from_camera: DAffine3,
    /// The greys that it shows.
    pub grey: Grey,
    /// Factor of its greys.
    pub gain: f64,
    /// The photo, for the depths beside it.
    pub photo: &'a dyn Photo,
}

/// By which factor photos are made smaller, so that they are held in memory together.
pub fn factor(photos: usize, pixels: usize) -> usize {
    (1..64).find(|f| photos.saturating_mul(pixels / (f * f)) <= BYTES).unwrap_or(64)
}

impl Grey {
    /// A photo in grey, each pixel the mean of `factor` x `factor`.
    pub fn new(pixels: &Pixels, factor: usize) -> Self {
        let [columns, rows] = pixels.size;
        let size = [(columns / factor).max(1), (rows / factor).max(1)];
        let of = |i: usize| {
            let (row, column) = (i / size[0] * factor, i % size[0] * factor);
            let (mut sum, mut count) = (0, 0);
            for y in row..(row + factor).min(rows) {
                for colour in &pixels.colours[y * columns + column..y * columns + (column + factor).min(columns)] {
                    sum += 2 * u32::from(colour[0]) + 5 * u32::from(colour[1]) + u32::from(colour[2]);
                    count += 8;
                }
            }
            ((sum + count / 2) / count.max(1)) as u8
        };
        Grey { size, factor, values: (0..size[0] * size[1]).map(of).collect() }
    }

    /// Sharpness: how fast greys change from pixel to pixel, for the contrast there is: the mean square of second differences by that of
    /// differences four pixels apart, square root.
    pub fn sharpness(&self) -> f64 {
        let columns = self.size[0];
        let (mut fine, mut coarse) = (0.0, 0.0);
        for row in self.values.chunks_exact(columns) {
            for x in 4..columns.saturating_sub(4) {
                let at = |i: usize| f64::from(row[i]);
                fine += (2.0 * at(x) - at(x - 1) - at(x + 1)).powi(2);
                coarse += (at(x + 4) - at(x - 4)).powi(2);
            }
        }
        if coarse > 0.0 { (fine / coarse).sqrt() } else { 0.0 }
    }

    /// Nearly Gaussian: three means in a row, along rows and then along columns.
    fn blurred(&self, sigma: f64, progress: &Progress<'_>) -> Result<Smooth> {
        let sigma = sigma / self.factor as f64;
        let radius = ((4.0 * sigma * sigma + 1.0).sqrt() / 2.0).round() as usize;
        let mut values: Vec<f32> = self.values.iter().map(|&value| f32::from(value)).collect();
        for _ in 0..3 {
            progress.check()?;
            values = mean_along_rows(&values, self.size, radius);
        }
        values = turned(&values, self.size);
        let across = [self.size[1], self.size[0]];
        for _ in 0..3 {
            progress.check()?;
            values = mean_along_rows(&values, across, radius);
        }
        progress.check()?;
        Ok(Smooth { size: self.size, factor: self.factor as f64, values: turned(&values, across) })
    }
}

fn mean_along_rows(values: &[f32], [columns, _]: [usize; 2], radius: usize) -> Vec<f32> {
    let mut means = vec![0.0; values.len()];
    if radius == 0 {
        return values.to_vec();
    }
    for (row, means) in values.chunks_exact(columns).zip(means.chunks_exact_mut(columns)) {
        let at = |i: isize| f64::from(row[i.clamp(0, columns as isize - 1) as usize]);
        let r = radius as isize;
        let mut sum: f64 = (-r..=r).map(at).sum();
        for (i, mean) in means.iter_mut().enumerate() {
            *mean = (sum / (2 * r + 1) as f64) as f32;
            sum += at(i as isize + r + 1) - at(i as isize - r);
        }
    }
    means
}

fn turned(values: &[f32], [columns, rows]: [usize; 2]) -> Vec<f32> {
    let mut turned = Vec::with_capacity(values.len());
    for column in 0..columns {
        turned.extend((0..rows).map(|row| values[row * columns + column]));
    }
    turned
}

/// A blurred photo.
struct Smooth {
    size: [usize; 2],
    factor: f64,
    values: Vec<f32>,
}

impl Smooth {
    /// Grey and its slope per pixel of the photo. `None` outside.
    #[inline]
    fn at(&self, at: DVec2) -> Option<(f64, DVec2)> {
        let p = (at + 0.5) / self.factor - 0.5;
        let [columns, rows] = self.size;
        if !(p.x >= 0.0 && p.y >= 0.0 && p.x < columns as f64 - 1.0 && p.y < rows as f64 - 1.0) {
            return None;
        }
        let (x, y) = (p.x as usize, p.y as usize);
        let (fx, fy) = (p.x - x as f64, p.y - y as f64);
        let first = y * columns + x;
        let [a, b, c, d] = [first, first + 1, first + columns, first + columns + 1].map(|i| f64::from(self.values[i]));
        let (upper, lower) = (a + (b - a) * fx, c + (d - c) * fx);
        let slope = DVec2::new((b - a) * (1.0 - fy) + (d - c) * fy, lower - upper);
        Some((upper + (lower - upper) * fy, slope / self.factor))
    }
}

/// A sample in one photo.
struct Mark {
    sample: u32,
    weight: f32,
}

/// Moves the cameras. Differences of grey before and after, in the root mean square of the finest blur.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn refine(
    posed: &mut [Posed<'_>],
    samples: &[Place],
    detail: &Detail<'_>,
    progress: &Progress<'_>,
) -> Result<[f64; 2]> {
    let start: Vec<DAffine3> = posed.iter().map(|photo| photo.origin_from_camera).collect();
    let mut before = 0.0;
    let mut after = 0.0;
    for (level, blur) in BLURS.into_iter().enumerate() {
        let smooth: Vec<Smooth> =
            posed.par_iter().map(|photo| photo.grey.blurred(blur, progress)).collect::<Result<_>>()?;
        if level == BLURS.len() - 1 {
            // At the finest blur the poses as they were given are the judge.
            let moved: Vec<DAffine3> = posed.iter().map(|photo| photo.origin_from_camera).collect();
            restore(posed, &start);
            let marks = marks(posed, samples, blur, detail, progress)?;
            before = difference(posed, &smooth, &marks, samples);
            restore(posed, &moved);
        }
        let marks = marks(posed, samples, blur, detail, progress)?;
        for _ in 0..STEPS {
            let means = means(posed, &smooth, &marks, samples);
            let moves: Vec<Option<DAffine3>> = (0..posed.len())
                .into_par_iter()
                .map(|i| progress.advance(1).map(|()| step(&posed[i], &smooth[i], &marks[i], samples, &means)))
                .collect::<Result<_>>()?;
            for (photo, by) in posed.iter_mut().zip(moves) {
                if let Some(camera_from_camera) = by {
                    photo.origin_from_camera *= camera_from_camera;
                }
            }
        }
        after = difference(posed, &smooth, &marks, samples);
    }
    if after > before {
        restore(posed, &start);
        return Ok([before, before]);
    }
    Ok([before, after])
}

fn restore(posed: &mut [Posed<'_>], poses: &[DAffine3]) {
    posed.iter_mut().zip(poses).for_each(|(photo, pose)| photo.origin_from_camera = *pose);
}

/// The samples that each photo sees.
fn marks(
    posed: &[Posed<'_>],
    samples: &[Place],
    blur: f64,
    detail: &Detail<'_>,
    progress: &Progress<'_>,
) -> Result<Vec<Vec<Mark>>> {
    let of = |photo: &Posed<'_>| {
        let depths = photo::depths(photo.photo)?;
        let view = View::new(photo.camera, photo.origin_from_camera, detail, depths.as_ref(), progress)?;
        let mut marks = Vec::new();
        for (i, place) in samples.iter().enumerate() {
            if i % 1024 == 0 {
                progress.check()?;
            }
            let [point, normal] = [place.point, place.normal].map(|of| DVec3::from(of.map(f64::from)));
            // The blur must not mix in what lies behind.
            if let Some(seen) = view.see(point, normal, detail, false).filter(|seen| seen.cosine > 0.25)
                && view.is_wide(seen.at, point, BLURRED * blur)
            {
                marks.push(Mark { sample: i as u32, weight: (seen.cosine * seen.cosine) as f32 });
            }
        }
        Ok(marks)
    };
    posed.par_iter().map(of).collect()
}

impl Posed<'_> {
    /// A point in the camera's frame, and its pixel.
    #[inline]
    fn project(&self, camera_from_origin: &DAffine3, point: DVec3) -> (DVec3, DVec2) {
        let p = camera_from_origin.transform_point3(point);
        (p, DVec2::from(self.camera.focal) * DVec2::new(p.x, p.y) / p.z + DVec2::from(self.camera.centre))
    }
}

/// Sums of grey times weight and of weights, per sample.
fn means(posed: &[Posed<'_>], smooth: &[Smooth], marks: &[Vec<Mark>], samples: &[Place]) -> Vec<[f64; 3]> {
    let of = |i: usize| -> Vec<(u32, f64, f64)> {
        let from_origin = posed[i].origin_from_camera.inverse();
        let grey = |mark: &Mark| {
            let point = DVec3::from(samples[mark.sample as usize].point.map(f64::from));
            let (_, at) = posed[i].project(&from_origin, point);
            smooth[i].at(at).map(|(grey, _)| (mark.sample, grey * posed[i].gain, f64::from(mark.weight)))
        };
        marks[i].iter().filter_map(grey).collect()
    };
    let greys: Vec<Vec<(u32, f64, f64)>> = (0..posed.len()).into_par_iter().map(of).collect();
    let mut sums = vec![[0.0; 3]; samples.len()];
    for (sample, grey, weight) in greys.into_iter().flatten() {
        let sum = &mut sums[sample as usize];
        sum[0] += grey * weight;
        sum[1] += weight;
        sum[2] += grey * grey * weight;
    }
    sums
}

/// Root mean square of the greys' differences to their means.
fn difference(posed: &[Posed<'_>], smooth: &[Smooth], marks: &[Vec<Mark>], samples: &[Place]) -> f64 {
    let (mut squares, mut weights) = (0.0, 0.0);
    for [grey, weight, square] in means(posed, smooth, marks, samples) {
        if weight > 0.0 {
            squares += square - grey * grey / weight;
            weights += weight;
        }
    }
    if weights > 0.0 { (squares / weights).max(0.0).sqrt() } else { 0.0 }
}

/// One step of a camera: what to put behind its pose.
fn step(photo: &Posed<'_>, smooth: &Smooth, marks: &[Mark], samples: &[Place], means: &[[f64; 3]]) -> Option<DAffine3> {
    let from_origin = photo.origin_from_camera.inverse();
    let focal = DVec2::from(photo.camera.focal);
    let mut rows: Vec<([f64; 6], f64, f64)> = Vec::with_capacity(marks.len());
    let mut depths = 0.0;
    for mark in marks {
        let point = DVec3::from(samples[mark.sample as usize].point.map(f64::from));
        let (p, at) = photo.project(&from_origin, point);
        let Some((grey, slope)) = smooth.at(at).filter(|_| p.z > 0.0) else { continue };
        let (grey, slope, weight) = (grey * photo.gain, slope * photo.gain, f64::from(mark.weight));
        let [sum, weights, _] = means[mark.sample as usize];
        let others = weights - weight;
        if others < 1e-3 {
            continue;
        }
        let residual = grey - (sum - grey * weight) / others;
        // How grey changes as the point moves in the camera's frame.
        let along = slope * focal / p.z;
        let g = DVec3::new(along.x, along.y, -(along.x * p.x + along.y * p.y) / p.z);
        let turn = p.cross(g);
        depths += p.z;
        rows.push(([turn.x, turn.y, turn.z, g.x, g.y, g.z], residual, weight));
    }
    if rows.len() < FEWEST {
        return None;
    }
    let depth = depths / rows.len() as f64;
    let mut sizes: Vec<f64> = rows.iter().map(|row| row.1.abs()).collect();
    let middle = sizes.len() / 2;
    let usual = *sizes.select_nth_unstable_by(middle, f64::total_cmp).1;
    let scale = (ROBUST * 1.4826 * usual).max(0.5);
    let mut matrix = [[0.0; 6]; 6];
    let mut right = [0.0; 6];
    for (row, residual, weight) in &mut rows {
        // Shifts in units of the depth, so that they are of the size of turns.
        row[3..].iter_mut().for_each(|of| *of *= depth);
        let robust = *weight / (1.0 + (*residual / scale).powi(2)).powi(2);
        for i in 0..6 {
            right[i] -= robust * row[i] * *residual;
            for j in 0..6 {
                matrix[i][j] += robust * row[i] * row[j];
            }
        }
    }
    let trace: f64 = (0..6).map(|i| matrix[i][i]).sum();
    (0..6).for_each(|i| matrix[i][i] += 1e-6 * trace);
    let x = linear::solve(&matrix, &right)?;
    let (turn, shift) = (DVec3::new(x[0], x[1], x[2]), DVec3::new(x[3], x[4], x[5]) * depth);
    // Points move by it in the camera's frame, so the camera moves the other way.
    let points = DAffine3 { matrix3: DMat3::from_quat(DQuat::from_scaled_axis(turn)), translation: shift };
    Some(points.inverse())
}

/// Distance that pixels of the samples move between two poses, in the root mean square.
pub fn moved(camera: &Camera, from: &DAffine3, to: &DAffine3, samples: &[Place]) -> f64 {
    let [from, to] = [from, to].map(|pose| pose.inverse());
    let at = |pose: &DAffine3, point: DVec3| {
        let p = pose.transform_point3(point);
        (p.z > 0.0).then(|| DVec2::from(camera.focal) * DVec2::new(p.x, p.y) / p.z)
    };
    let (mut squares, mut count) = (0.0, 0.0);
    for place in samples.iter().step_by(16) {
        let point = DVec3::from(place.point.map(f64::from));
        if let (Some(a), Some(b)) = (at(&from, point), at(&to, point)) {
            squares += a.distance_squared(b);
            count += 1.0;
        }
    }
    if count > 0.0 { (squares / count).sqrt() } else { 0.0 }
}
