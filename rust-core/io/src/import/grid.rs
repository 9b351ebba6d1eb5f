//! Grids of measured points as they come out of files: pixels in any order, coordinates that may lie far out.

use std::path::Path;

use glam::{DAffine3, DVec3};

use super::file::reserve;
use super::{Content, Scan};
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
    /// What is taken off the coordinates, decided by the first of each: whole numbers, which lose nothing.
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
            None => *self.origin[axis].insert(if value.abs() > FAR { value.round() } else { 0.0 }),
        };
        self.points[pixel][axis] = (value - origin) as f32;
    }

    /// The range image, seen from `eye` in the frame of the points.
    pub(super) fn into_content(mut self, eye: DVec3, scan: &Scan) -> Result<Content> {
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
