//! Photos with their cameras, in the order of their names: no other order matters.

use glam::DAffine3;

use crate::frame::Camera;
use base::error::{Error, Result};
use base::magnitude;

/// A photo whose camera is known. Its pixels are asked for when they are needed, several times if need be: they are not kept.
pub trait Photo: Sync {
    /// Name, different from those of all other photos.
    fn name(&self) -> &str;

    /// Camera, whose size is that of the photo. Without distortion.
    fn camera(&self) -> Camera;

    /// Pose of the camera: x to the right, y down, z forward.
    fn world_from_camera(&self) -> DAffine3;

    /// The pixels.
    ///
    /// # Errors
    /// What kept them from being read.
    fn pixels(&self) -> Result<Pixels>;

    /// Depths that the camera measured beside the photo, if it did.
    ///
    /// # Errors
    /// What kept them from being read.
    fn depths(&self) -> Result<Option<Depths>> {
        Ok(None)
    }
}

/// Pixels of a photo.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pixels {
    /// Columns and rows.
    pub size: [usize; 2],
    /// sRGB, row by row from the upper left.
    pub colours: Vec<[u8; 3]>,
}

/// Depths along the axis of the photo's camera, in the unit of the surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Depths {
    /// Columns and rows: those of the photo, or of a smaller image of the same view.
    pub size: [usize; 2],
    /// Depths, row by row. 0 or NaN where nothing was measured.
    pub values: Vec<f32>,
}

/// A photo whose pixels lie in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct PhotoInMemory {
    /// Its name.
    pub name: String,
    /// Its camera, with a size.
    pub camera: Camera,
    /// Pose of the camera.
    pub world_from_camera: DAffine3,
    /// The pixels.
    pub pixels: Pixels,
    /// Depths beside it.
    pub depths: Option<Depths>,
}

impl Photo for PhotoInMemory {
    fn name(&self) -> &str {
        &self.name
    }

    fn camera(&self) -> Camera {
        self.camera
    }

    fn world_from_camera(&self) -> DAffine3 {
        self.world_from_camera
    }

    fn pixels(&self) -> Result<Pixels> {
        Ok(self.pixels.clone())
    }

    fn depths(&self) -> Result<Option<Depths>> {
        Ok(self.depths.clone())
    }
}

/// Places of the photos in the order of their names.
///
/// # Errors
/// [`Error::Input`] for a camera that is not usable or without a size, and for two photos of one name.
pub fn in_order(photos: &[&dyn Photo]) -> Result<Vec<usize>> {
    let mut order: Vec<usize> = (0..photos.len()).collect();
    order.sort_by(|&a, &b| photos[a].name().cmp(photos[b].name()));
    for pair in order.windows(2) {
        let name = photos[pair[0]].name();
        if name == photos[pair[1]].name() {
            return Err(Error::input(format!("two photos are called {name}: names must differ")));
        }
    }
    order.iter().try_for_each(|&i| check(photos[i]))?;
    Ok(order)
}

/// Checks the camera of a photo and its pose. Reads no pixels.
///
/// # Errors
/// [`Error::Input`] for a camera that is not usable or without a size, and for a pose that is not rigid.
pub fn check(photo: &dyn Photo) -> Result<()> {
    let (name, camera) = (photo.name(), photo.camera());
    camera.validate().map_err(|error| Error::input(format!("{name}: {error}")))?;
    if camera.size.is_none_or(|size| size.contains(&0)) {
        return Err(Error::input(format!("{name}: the camera has no size, but needs columns and rows of its photo")));
    }
    let pose = photo.world_from_camera();
    magnitude::place(&format!("{name}: the position of the camera"), pose.translation)?;
    let turn = pose.matrix3;
    let is_rigid = (turn * turn.transpose() - glam::DMat3::IDENTITY).to_cols_array().iter().all(|x| x.abs() < 1e-4);
    if !is_rigid || turn.determinant() < 0.0 {
        return Err(Error::input(format!(
            "{name}: the pose of the camera must be a rotation and a translation. Take scale and mirroring out of it."
        )));
    }
    Ok(())
}

/// The pixels of a photo, if they are as its camera says.
///
/// # Errors
/// [`Error::Input`] for another size. The error that kept them from being read.
pub fn pixels(photo: &dyn Photo) -> Result<Pixels> {
    let pixels = photo.pixels()?;
    let [columns, rows] = pixels.size;
    let camera = photo.camera().size.unwrap_or_default();
    if pixels.size != camera {
        return Err(Error::input(format!(
            "{}: the photo has {columns} x {rows} pixels, but its camera {} x {}: scale the camera or the photo",
            photo.name(),
            camera[0],
            camera[1]
        )));
    }
    if columns.checked_mul(rows) != Some(pixels.colours.len()) {
        return Err(Error::input(format!(
            "{}: the photo of {columns} x {rows} pixels must have as many, got {}",
            photo.name(),
            pixels.colours.len()
        )));
    }
    Ok(pixels)
}

/// The depths beside a photo, if there are any and they are whole.
///
/// # Errors
/// [`Error::Input`] for a size that is none or does not suit their number. The error that kept them from being read.
pub fn depths(photo: &dyn Photo) -> Result<Option<Depths>> {
    let Some(depths) = photo.depths()? else { return Ok(None) };
    let [columns, rows] = depths.size;
    if depths.values.is_empty() || columns.checked_mul(rows) != Some(depths.values.len()) {
        return Err(Error::input(format!(
            "{}: depths of {columns} x {rows} pixels must be as many values, got {}",
            photo.name(),
            depths.values.len()
        )));
    }
    Ok(Some(depths))
}
