//! Colour images with cameras of their own.

use glam::DAffine3;

use super::camera::Camera;

/// A colour image with its own camera.
#[derive(Clone, Debug, PartialEq)]
pub struct ColourImage {
    /// Its camera. The size is the image's.
    pub camera: Camera,
    /// sRGB, row by row from the upper left.
    pub pixels: Vec<[u8; 3]>,
    /// Takes points of the depth sensor's frame into that of this camera.
    pub colour_from_depth: DAffine3,
    /// Whether pixels that undistorting left black surround the image: what is seen through them is left out.
    pub black_rim: bool,
}

impl ColourImage {
    /// Columns and rows.
    pub fn size(&self) -> [usize; 2] {
        self.camera.size.unwrap_or_default()
    }
}
