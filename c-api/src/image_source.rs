//! Scans whose range images the caller makes when they are needed.

use std::borrow::Cow;
use std::ffi::c_void;

use glam::DAffine3;
use surfrecon::source::{Loading, OrientedSurface, ScanSource};
use surfrecon::triangulate::TriangulateParams;
use surfrecon::{Error, Progress, RangeImage};

use crate::image::{Image, srf_image};
use crate::pose::{self, srf_pose};
use crate::status::{self, Failure, srf_status::*};
use crate::{handle, last_error, pointer};

/// Makes the range image of a scan, for example with srf_image_from_frame(). user: as given in srf_image_source. out_image: receives a
/// handle that nobody else uses, which the library then frees, also if the answer is an error. Its pose and its name are passed over: those
/// of adding count. Called on threads of the library or on the thread that made the call, for several scans at once, and for a scan more
/// than once. Each time it must make the same image, or the result is none of any scan. It may call any function of this library. While it
/// is in one that takes longer it may be called for another scan on the same thread, so it must hold no lock then that it takes itself.
/// Answer SRF_OK, or the status of what went wrong. The call for which it was made then ends, with SRF_ERR_CANCELLED or
/// SRF_ERR_OUT_OF_MEMORY for these, else with SRF_ERR_INPUT. Its text has the scan's name and what srf_last_error_message() says on the
/// thread of this function (srf_set_last_error() says it). A call that is cancelled waits for those that are being made. Must not unwind,
/// nor leave by longjmp().
#[allow(non_camel_case_types)]
pub type srf_image_fn = Option<unsafe extern "C" fn(user: *mut c_void, out_image: *mut *mut srf_image) -> i32>;

/// Maker of the image of a scan when it is needed, so that it need not stay in memory: not before a run, and a few times in it at most.
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct srf_image_source {
    /// Makes it. Not NULL.
    pub make: srf_image_fn,
    /// Handed to make as it is. Must stay until what it was added to is freed and no call works with it.
    pub user: *mut c_void,
}

/// A scan whose image is made when it is needed, placed and named by the caller.
#[derive(Clone)]
pub struct MadeScan {
    pub name: String,
    pub world_from_sensor: DAffine3,
    make: unsafe extern "C" fn(*mut c_void, *mut *mut srf_image) -> i32,
    /// The caller's pointer as a number: it goes back to where it came from, on whatever thread.
    user: usize,
}

impl MadeScan {
    /// The scan of the arguments that the caller handed over.
    pub fn of(
        source: *const srf_image_source,
        world_from_sensor: *const srf_pose,
        name: *const std::ffi::c_char,
    ) -> Result<Self, Failure> {
        let Some(source) = pointer::read_struct(source) else {
            return Err(Failure::new(SRF_ERR_NULL, "source must not be NULL"));
        };
        let Some(make) = source.make else {
            return Err(Failure::new(SRF_ERR_NULL, "source.make must not be NULL"));
        };
        Ok(MadeScan {
            name: pointer::text("name", name)?.to_owned(),
            world_from_sensor: pose::read_rigid("world_from_sensor", world_from_sensor)?,
            make,
            user: source.user.expose_provenance(),
        })
    }

    /// Has the caller make it.
    fn made(&self, progress: &Progress<'_>) -> surfrecon::Result<RangeImage> {
        progress.check()?;
        let mut made = std::ptr::null_mut();
        let user = std::ptr::with_exposed_provenance_mut(self.user);
        let (answer, text) = status::said(|| pointer::call_make(self.make, user, &mut made));
        let wrong = |text: &str| Error::input(format!("{}: {text}", self.name));
        if answer != SRF_OK as i32 {
            // An image that it made nevertheless is nobody's else.
            if !made.is_null() {
                drop(handle::take("out_image of the source", made));
            }
            return Err(self.failed(answer, &text));
        }
        if made.is_null() {
            return Err(wrong("the source made no image and gave no reason: out_image must not be NULL"));
        }
        let Image { mut image, .. } = handle::take("out_image of the source", made).map_err(|e| wrong(&e.text))?;
        image.world_from_sensor = self.world_from_sensor;
        image.name.clone_from(&self.name);
        Ok(image)
    }

    fn failed(&self, answer: i32, text: &str) -> Error {
        if answer == SRF_ERR_CANCELLED as i32 {
            return Error::Cancelled;
        }
        let why = if text.is_empty() { last_error::short_text(answer) } else { text };
        let text = format!("{}: the source could not make its image: {why}", self.name);
        if answer == SRF_ERR_OUT_OF_MEMORY as i32 { Error::OutOfMemory(text) } else { Error::input(text) }
    }
}

impl ScanSource for MadeScan {
    fn name(&self) -> &str {
        &self.name
    }

    fn load(&self, loading: &Loading, progress: &Progress<'_>) -> surfrecon::Result<OrientedSurface> {
        self.made(progress)?.load(loading, progress)
    }

    fn image(&self, progress: &Progress<'_>) -> surfrecon::Result<Option<Cow<'_, RangeImage>>> {
        Ok(Some(Cow::Owned(self.made(progress)?)))
    }

    fn content(&self, triangulation: &TriangulateParams, progress: &Progress<'_>) -> surfrecon::Result<u64> {
        self.made(progress)?.content(triangulation, progress)
    }
}
