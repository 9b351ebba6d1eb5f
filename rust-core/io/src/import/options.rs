//! What files don't say themselves, told by the caller.

use super::camera::Camera;
use base::error::{Error, Result};
use base::params::{Default as ParamDefault, ParamSpec, Unit};

/// Parameters of reading.
pub const PARAMS: &[ParamSpec] = &[
    ParamSpec {
        operation: "open",
        name: "scale",
        unit: Unit::Ratio,
        default: ParamDefault::FromData("0.001 for whole numbers seen by a camera (millimetres), else 1"),
        min: 0.0,
        min_excluded: true,
        max: f64::INFINITY,
        text: "What a number of an image is multiplied with. Larger values make heights and depths larger.",
    },
    ParamSpec {
        operation: "open",
        name: "step",
        unit: Unit::WorldLength,
        default: ParamDefault::FromData("what the file says, else 1"),
        min: 0.0,
        min_excluded: true,
        max: f64::INFINITY,
        text: "Distance of neighbouring pixels of a height map. Larger values make it wider.",
    },
    ParamSpec {
        operation: "open",
        name: "max_decoded_gib",
        unit: Unit::Ratio,
        default: ParamDefault::Value(4.0),
        min: 0.0,
        min_excluded: true,
        max: 1e6,
        text: "Largest size of what one compressed file unpacks to, in GiB. Larger values let larger files be read; small ones refuse files that unpack to more than they should.",
    },
];

/// How the numbers of an image's pixels are stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PixelMeaning {
    /// Numbers if the image is grey; terrain RGB if it is coloured and every pixel then lies between -500 and 9000 m.
    #[default]
    Auto,
    /// A number a pixel.
    Number,
    /// Mapbox: -10000 + (65536 R + 256 G + B) / 10.
    TerrainRgb,
    /// Mapzen: 256 R + G + B / 256 - 32768.
    Terrarium,
}

/// What files don't say themselves; see [`PARAMS`]. The default reads what is plain in the file.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadOptions {
    /// Makes images depth images, seen by this camera; `None`: they are height maps seen from above.
    pub camera: Option<Camera>,
    /// What a number of an image is multiplied with.
    pub scale: Option<f64>,
    /// What is added afterwards.
    pub offset: f64,
    /// Distance of the pixels of a height map.
    pub step: Option<f64>,
    /// The number that means no sample, before scaling; besides what the format itself defines.
    pub invalid: Option<f64>,
    /// How the numbers of an image are stored.
    pub pixels: PixelMeaning,
    /// Largest size of what one compressed file unpacks to, in GiB.
    pub max_decoded_gib: f64,
    /// Whether a list may name files outside its own folder.
    pub allow_outside: bool,
}

impl Default for ReadOptions {
    fn default() -> Self {
        ReadOptions {
            camera: None,
            scale: None,
            offset: 0.0,
            step: None,
            invalid: None,
            pixels: PixelMeaning::Auto,
            max_decoded_gib: 4.0,
            allow_outside: false,
        }
    }
}

impl ReadOptions {
    /// Checks each value against its range.
    ///
    /// # Errors
    /// [`Error::Parameter`], or [`Error::Input`] for a camera or an offset that isn't usable.
    pub fn validate(&self) -> Result<()> {
        for (spec, value) in PARAMS.iter().zip([self.scale, self.step, Some(self.max_decoded_gib)]) {
            if let Some(value) = value {
                spec.check(value)?;
            }
        }
        if !self.offset.is_finite() {
            return Err(Error::input(format!("offset must be a finite number, got {}", self.offset)));
        }
        self.camera.map_or(Ok(()), |camera| camera.projection().validate())
    }

    /// Bytes that one file may unpack to.
    pub(super) fn max_decoded_bytes(&self) -> u64 {
        (self.max_decoded_gib * (1_u64 << 30) as f64) as u64
    }
}
