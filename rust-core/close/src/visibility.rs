//! Seen space: where scans saw that nothing is.

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use base::error::Result;
use base::memory;
use base::progress::Progress;
use image::range_image::RangeImage;
use image::range_image::noise::Noise;
use image::source::ScanSource;
use image::visibility::LinesOfSight;
use mesh::holes::Bounds;

/// Of an image at the peak, its noise being measured. Measured.
const BYTES_A_PIXEL: f64 = 60.0;

/// Lines of sight: they can be asked whether a place is empty.
pub trait Visibility: Sync {
    /// Whether nothing is at a place, for sure where what was measured may be off by `tolerance`, in world units. A place that is empty
    /// with one tolerance is with each smaller one.
    fn is_empty_at(&self, place: DVec3, tolerance: f64) -> bool;

    /// Whether nothing can be known anywhere.
    fn is_blind(&self) -> bool {
        false
    }
}

/// The visibility of surfaces without sensors: nothing is known of any place.
pub struct Blind;

impl Visibility for Blind {
    fn is_empty_at(&self, _: DVec3, _: f64) -> bool {
        false
    }

    fn is_blind(&self) -> bool {
        true
    }
}

/// The lines of sight of several scans. A place is empty if one of them saw past it, in all of 3 x 3 pixels, by more than the tolerance.
pub struct Scans {
    scans: Vec<Arc<LinesOfSight>>,
    /// Names of those that were read from sources, with boxes around what they measured.
    boxes: Vec<(String, Bounds)>,
}

impl Scans {
    /// Of images whose rays are known, with their noise measured. Others say nothing. As [`LinesOfSight::new`].
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn of_images(images: &[RangeImage], progress: &Progress<'_>) -> Result<Self> {
        let look = |image: &RangeImage| match LinesOfSight::are_known(image.projection()) {
            true => LinesOfSight::new(image, Noise::measure(image, progress)?, progress),
            false => Ok(None),
        };
        let scans: Vec<Option<LinesOfSight>> = images.par_iter().map(look).collect::<Result<_>>()?;
        Ok(Scans::new(scans.into_iter().flatten().map(Arc::new).collect()))
    }

    /// Of scans of any kind. Each is read once, and only its lines of sight are kept. Meshes and points say nothing.
    ///
    /// # Errors
    /// A scan that can't be read. [`base::Error::OutOfMemory`]. [`base::Error::Cancelled`].
    pub fn of_sources(sources: &[&dyn ScanSource], progress: &Progress<'_>) -> Result<Self> {
        let look = |source: &&dyn ScanSource| {
            progress.advance(1)?;
            let Some(image) = source.image(progress)? else { return Ok(None) };
            let pixels = image.rows() * image.cols();
            memory::foresee(pixels, BYTES_A_PIXEL, "reading lines of sight", "pixels")?;
            if !LinesOfSight::are_known(image.projection()) {
                return Ok(None);
            }
            let bounds = bounds(&image, progress)?;
            let scan = LinesOfSight::new(&image, Noise::measure(&image, progress)?, progress)?;
            Ok(scan.map(|scan| (scan, (source.name().to_owned(), bounds))))
        };
        let scans: Vec<Option<_>> = sources.par_iter().with_max_len(1).map(look).collect::<Result<_>>()?;
        let (scans, boxes): (Vec<LinesOfSight>, Vec<_>) = scans.into_iter().flatten().unzip();
        Ok(Scans { boxes, ..Scans::new(scans.into_iter().map(Arc::new).collect()) })
    }

    /// Of lines of sight that are made already.
    pub fn new(scans: Vec<Arc<LinesOfSight>>) -> Self {
        Scans { scans, boxes: Vec::new() }
    }

    /// Names of the scans that were read from sources, with boxes around what they measured.
    pub(crate) fn boxes(&self) -> &[(String, Bounds)] {
        &self.boxes
    }
}

/// Box around what an image measured.
fn bounds(image: &RangeImage, progress: &Progress<'_>) -> Result<Bounds> {
    let mut bounds = Bounds::of([]);
    image.try_for_each_valid(|_, _, point| bounds.add(image.world_from_sensor.transform_point3(point)), progress)?;
    Ok(bounds)
}

impl Visibility for Scans {
    fn is_empty_at(&self, place: DVec3, tolerance: f64) -> bool {
        self.scans.iter().any(|scan| scan.is_past(place, tolerance))
    }

    fn is_blind(&self) -> bool {
        self.scans.is_empty()
    }
}

/// Visibility, and the ground: nothing is below it.
pub(crate) struct Ground<'a> {
    pub visibility: &'a dyn Visibility,
    pub up: DVec3,
    /// Along the way up.
    pub height: f64,
}

impl Visibility for Ground<'_> {
    fn is_empty_at(&self, place: DVec3, tolerance: f64) -> bool {
        place.dot(self.up) < self.height || self.visibility.is_empty_at(place, tolerance)
    }
}

/// Visibility with the tolerance of one closing.
#[derive(Clone, Copy)]
pub(crate) struct Envelope<'a> {
    pub visibility: &'a dyn Visibility,
    pub tolerance: f64,
}

impl Envelope<'_> {
    /// Whether a scan saw through a place.
    pub fn is_seen(&self, place: DVec3) -> bool {
        self.visibility.is_empty_at(place, self.tolerance)
    }
}
