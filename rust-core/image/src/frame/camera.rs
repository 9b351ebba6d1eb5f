//! Pinhole cameras. Pixel centres lie at whole numbers: the first pixel's area begins at -0.5.

use glam::DVec3;

use crate::range_image::{DepthKind, Projection};
use base::error::{Error, Result, Shown};

/// A pinhole camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// fx and fy in pixels.
    pub focal: [f64; 2],
    /// cx and cy in pixels, pixel centres at whole numbers.
    pub centre: [f64; 2],
    /// Columns and rows of its images, where known: images of another size are refused, or have it scaled to them.
    pub size: Option<[usize; 2]>,
}

impl Camera {
    /// A camera whose images may have any size.
    pub fn new(focal: [f64; 2], centre: [f64; 2]) -> Self {
        Camera { focal, centre, size: None }
    }

    /// A camera whose images have so many columns and rows.
    pub fn sized(focal: [f64; 2], centre: [f64; 2], size: [usize; 2]) -> Self {
        Camera { focal, centre, size: Some(size) }
    }

    /// Projection of its pixels if they measure this depth.
    pub fn projection(&self, depth: DepthKind) -> Projection {
        Projection::Pinhole { focal: self.focal, centre: self.centre, depth }
    }

    /// Checks that the parameters can be computed with, and that columns run to the right. Rows may run up: those of rendered data sets do.
    ///
    /// # Errors
    /// [`base::Error::Input`] naming the parameter and its value.
    pub fn validate(&self) -> Result<()> {
        self.projection(DepthKind::Planar).validate()?;
        if self.focal[0] < 0.0 {
            return Err(Error::input(format!(
                "the camera's focal length fx must be above 0, got {}: the images would be mirrored (fy may be below 0, where y runs up)",
                Shown(self.focal[0])
            )));
        }
        Ok(())
    }

    /// The same camera for its image at another size, which shows the same: c' = (c + 1/2) w'/w - 1/2. A camera of
    /// unknown size becomes one of this size.
    pub fn scaled_to(&self, size: [usize; 2]) -> Camera {
        let Some(from) = self.size else { return Camera { size: Some(size), ..*self } };
        let factor = [0, 1].map(|axis| size[axis] as f64 / from[axis] as f64);
        Camera {
            focal: [0, 1].map(|axis| self.focal[axis] * factor[axis]),
            centre: [0, 1].map(|axis| (self.centre[axis] + 0.5) * factor[axis] - 0.5),
            size: Some(size),
        }
    }

    /// Column and row of where it sees a point of its frame, which lies in front of it.
    #[inline]
    pub(super) fn project(&self, point: DVec3) -> [f64; 2] {
        let [x, y] = [point.x / point.z, point.y / point.z];
        [self.focal[0] * x + self.centre[0], self.focal[1] * y + self.centre[1]]
    }
}
