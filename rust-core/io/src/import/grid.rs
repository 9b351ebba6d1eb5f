//! Grids of measured points as they come out of files: pixels in any order, coordinates that may lie far out.

use std::path::Path;

use glam::{DAffine3, DVec3};

use super::file::reserve;
use super::scan::{Content, FileScan};
use base::error::{Error, Result};
use image::range_image::{RangeImage, Viewing};

/// Coordinates beyond this get an origin of their own, so that single precision keeps half a thousandth of the unit.
const FAR: f64 = 4096.0;

/// Points of a grid and what comes with them. Pixels never set are invalid, as are points at exactly (0, 0, 0) and
/// points that aren't finite.
pub(super) struct PointGrid {
    rows: usize,
    cols: usize,
    points: Vec<[f32; 3]>,
    /// Whole numbers that are taken off the coordinates, decided by the first of each that is not zero. They lose nothing.
    origin: [Option<f64>; 3],
    pub(super) intensity: Option<Vec<f32>>,
    pub(super) colour: Option<Vec<[u8; 4]>>,
}

impl PointGrid {
    /// A grid whose number of pixels was checked against the file.
    pub(super) fn new(rows: usize, cols: usize, intensity: bool, colour: bool, path: &Path) -> Result<Self> {
        fn filled<T: Clone>(count: usize, with: T, path: &Path) -> Result<Vec<T>> {
            let mut list = reserve(count, path)?;
            list.resize(count, with);
            Ok(list)
        }
        let count = rows * cols;
        Ok(PointGrid {
            rows,
            cols,
            points: filled(count, [f32::NAN; 3], path)?,
            origin: [None; 3],
            intensity: if intensity { Some(filled(count, 0.0, path)?) } else { None },
            colour: if colour { Some(filled(count, [0; 4], path)?) } else { None },
        })
    }

    /// The point of a pixel.
    #[inline(always)]
    pub(super) fn set(&mut self, pixel: usize, point: [f64; 3]) {
        if point == [0.0; 3] {
            return;
        }
        for axis in 0..3 {
            self.set_coordinate(pixel, axis, point[axis]);
        }
    }

    /// One coordinate of a pixel, for files that hold one after the other.
    #[inline(always)]
    pub(super) fn set_coordinate(&mut self, pixel: usize, axis: usize, value: f64) {
        let origin = match self.origin[axis] {
            Some(origin) => origin,
            None if value == 0.0 || !value.is_finite() => 0.0,
            None => self.decide_origin(axis, value),
        };
        self.points[pixel][axis] = (value - origin) as f32;
    }

    /// Decides what is taken off an axis by its first coordinate that is not zero, also off the zeros before it.
    #[cold]
    fn decide_origin(&mut self, axis: usize, value: f64) -> f64 {
        let origin = if value.abs() > FAR { value.round() } else { 0.0 };
        self.origin[axis] = Some(origin);
        if origin != 0.0 {
            for point in &mut self.points {
                // NaN of pixels never set stays.
                point[axis] -= origin as f32;
            }
        }
        origin
    }

    /// The range image, seen from `eye` in the frame of the points.
    pub(super) fn into_content(mut self, eye: DVec3, scan: &FileScan) -> Result<Content> {
        let origin = DVec3::from_array(self.origin.map(|o| o.unwrap_or(0.0)));
        let zero = (-origin).as_vec3().to_array();
        for point in self.points.iter_mut().filter(|point| **point == zero) {
            *point = [f32::NAN; 3];
        }
        let mut image = RangeImage::from_points(self.rows, self.cols, self.points, Viewing::From(eye - origin))
            .map_err(|error| Error::format(&scan.path, "whole scan", error.to_string()))?;
        image.name = scan.name.clone();
        image.world_from_sensor = scan.world_from_sensor * DAffine3::from_translation(origin);
        image.intensity = self.intensity;
        image.colour = self.colour;
        Ok(Content::RangeImage(image))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(points: &[[f64; 3]]) -> RangeImage {
        let scan = FileScan::new(Path::new("x"));
        let mut grid = PointGrid::new(1, points.len(), false, false, &scan.path).unwrap();
        for (pixel, point) in points.iter().enumerate() {
            for (axis, &value) in point.iter().enumerate() {
                grid.set_coordinate(pixel, axis, value);
            }
        }
        match grid.into_content(DVec3::ZERO, &scan).unwrap() {
            Content::RangeImage(image) => image,
            other => panic!("{other:?}"),
        }
    }

    /// Theorem: the place of a sample does not depend on what stands before it, zeros least of all.
    #[test]
    fn zeros_before_an_origin_stay_zeros() {
        let nothing = [0.0; 3];
        let missing = [f64::NAN; 3];
        for far in [5000.0, -9000.25, 4e6] {
            let points = [nothing, missing, [9000.0, 0.0, 0.0], [9001.0, -0.0, 2.0], [9000.0, far, 0.0], nothing];
            let turned: Vec<[f64; 3]> = points.iter().map(|&[x, y, z]| [z, x, y]).collect();
            for points in [points.to_vec(), turned] {
                let image = image(&points);
                for (pixel, &point) in points.iter().enumerate() {
                    let is_sample = point != nothing && point[0].is_finite();
                    assert_eq!(image.is_valid(pixel), is_sample, "{pixel} of {points:?}");
                    if is_sample {
                        assert_eq!(image.point_in_world(pixel), DVec3::from_array(point));
                    }
                }
            }
        }
    }
}
