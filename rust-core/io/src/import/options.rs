//! Options that tell what files don't say themselves.

use base::error::Result;
use base::params::{choice, flag, length, ratio};
use image::frame::Camera;
use image::range_image::DepthKind;
use mesh::Crs;

base::choices! {
    /// How images store numbers.
    pub enum PixelMeaning {
        /// Numbers if the image is grey. Terrain RGB if it is coloured and every pixel then lies between -500 and 9000 m.
        Auto = "auto" "Auto",
        /// A number per pixel.
        Number = "number" "Numbers",
        /// Mapbox: -10000 + (65536 R + 256 G + B) / 10.
        TerrainRgb = "terrain_rgb" "Terrain RGB",
        /// Mapzen: 256 R + G + B / 256 - 32768.
        Terrarium = "terrarium" "Terrarium",
    }
}

base::choices! {
    /// Direction of poses.
    pub enum PoseSense {
        /// As the layout has them, unless the frames lie on each other only in the other sense.
        Auto = "auto" "Auto",
        /// From the camera to the world.
        CameraToWorld = "camera_to_world" "Camera to world",
        /// From the world to the camera.
        WorldToCamera = "world_to_camera" "World to camera",
    }
}

base::choices! {
    /// Axes of the cameras that poses place.
    pub enum CameraAxes {
        /// As the layout has them, unless the frames lie on each other only with the other axes.
        Auto = "auto" "Auto",
        /// y down, looking along z, as OpenCV and Open3D have them.
        YDown = "y_down" "y down, along z",
        /// y up, looking along -z, as OpenGL, Blender and ARKit have them.
        YUp = "y_up" "y up, along -z",
    }
}

base::params! {
    /// Facts that files do not say themselves.
    #[derive(Clone, Debug, PartialEq)]
    pub struct ReadOptions of "open" {
        /// Factor by which the numbers of an image are multiplied. Larger values make heights and depths larger.
        scale: Option<f64> = ratio("Value scale")
            .from_data("0.001 for whole numbers seen by a camera (millimetres), else 1").above(0.0),
        /// Number that is added to the numbers of an image afterwards.
        offset: f64 = ratio("Value offset").at_least(f64::NEG_INFINITY),
        /// Distance of neighbouring pixels of a height map. Larger values make it wider.
        step: Option<f64> = length("Pixel size").from_data("the size in the file, else 1").above(0.0),
        /// The number of an image, before scaling, that means no sample. It counts besides those that the format itself defines.
        invalid: Option<f64> = ratio("Invalid value").from_data("none").any_number(),
        /// Quantity that the pixels of depth images measure.
        depth: DepthKind = choice("Depth", DepthKind::CHOICES),
        /// How images store numbers.
        pixels: PixelMeaning = choice("Pixels", PixelMeaning::CHOICES),
        /// Largest size of what one compressed file unpacks to, in GiB. Larger values let larger files be read. Small ones refuse files
        /// that unpack to more than they should.
        max_decoded_gib: f64 = ratio("Largest unpacked size (GiB)").default(4.0).above(0.0).at_most(1e6),
        /// Lists may name files outside their own folder.
        allow_outside: bool = flag("Allow outside").off("such lists are refused"),
        /// Direction of the poses of a recording or of a list of poses.
        poses: PoseSense = choice("Poses", PoseSense::CHOICES).since("0.2"),
        /// Axes of the cameras that the poses of a recording or of a list of poses place.
        axes: CameraAxes = choice("Camera axes", CameraAxes::CHOICES).since("0.2"),
    }
    besides {
        /// Makes images depth images, seen by this camera. `None`: they are height maps seen from above.
        camera: Option<Camera>,
        /// The coordinate reference system that all lie in, whatever the files name.
        crs: Option<Crs>,
    }
    checked by camera_is_usable
}

impl ReadOptions {
    fn camera_is_usable(&self) -> Result<()> {
        self.camera.map_or(Ok(()), |camera| camera.validate())
    }

    /// Bytes that one file may unpack to.
    pub(super) fn max_decoded_bytes(&self) -> u64 {
        (self.max_decoded_gib * (1_u64 << 30) as f64) as u64
    }
}
