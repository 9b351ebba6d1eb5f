//! The settings: what a virtual scanner adds to the truth.

use base::error::Result;
use base::magnitude;
use base::params::{angle, count, flag, length, ratio};

base::params! {
    /// Errors that a virtual scanner adds to the truth. The defaults add nothing.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct ScanParams of "scan" with threads {
        /// Standard deviation of the Gaussian noise along each ray.
        noise: f64 = length("Noise"),
        /// Growth of the noise where the surface is seen at a grazing angle: it is multiplied by 1 + growth * (1 / cos - 1), with the
        /// cosine between ray and normal, at least 0.05.
        noise_grazing: f64 = ratio("Noise grazing").at_most(100.0),
        /// Values are rounded to multiples of this step.
        quantum: f64 = length("Quantum").off("they stay as they are"),
        /// Share of the pixels that give no value, whatever they see.
        dropout: f64 = ratio("Dropout").at_most(1.0),
        /// Share of further pixels that give no value where the ray grazes the surface. It falls with (1 - cos)^4 to 0 where the ray is
        /// perpendicular to the surface.
        dropout_grazing: f64 = ratio("Dropout grazing").at_most(1.0),
        /// Largest distance from the sensor at which a surface is seen. Orthographic sensors are infinitely far away and take none.
        max_range: Option<f64> = length("Max range").from_data("none, everything in sight is seen").above(0.0),
        /// Triangles seen from behind give values too.
        backfaces: bool = flag("Backfaces").off("they hide what is behind them and give none"),
        /// Standard deviation, along each axis, of the error of the reported position: how badly the scans are registered.
        pose_shift: f64 = length("Pose shift"),
        /// Standard deviation of the angle of the error of the reported orientation, about the centre of what was seen.
        pose_turn: f64 = angle("Pose turn").at_most(std::f64::consts::PI),
        /// Number all randomness follows from. Give each scan its own.
        seed: u64 = count("Seed").at_most(9_007_199_254_740_992.0),
    }
    checked by lengths
}

impl ScanParams {
    /// No length is larger than coordinates may be.
    fn lengths(&self) -> Result<()> {
        magnitude::coordinate("noise", self.noise)?;
        magnitude::coordinate("quantum", self.quantum)?;
        magnitude::coordinate("pose_shift", self.pose_shift).map(drop)
    }
}
