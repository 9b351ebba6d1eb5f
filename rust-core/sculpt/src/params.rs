//! The parameters of sculpting.

use base::error::Result;
use base::params::{Default, ParamSpec, Unit};
use image::triangulate::TriangulateParams;

/// Parameters of sculpting.
pub const PARAMS: &[ParamSpec] = &[
    ParamSpec {
        operation: "sculpt",
        name: "tolerance",
        unit: Unit::WorldLength,
        default: Default::FromData("relative_tolerance times the depth extent of the covered samples"),
        min: 0.0,
        min_excluded: false,
        max: f64::INFINITY,
        text: "Largest distance between a sample and the mesh along the sample's ray. 0 reproduces every sample; larger values give fewer triangles.",
    },
    ParamSpec {
        operation: "sculpt",
        name: "relative_tolerance",
        unit: Unit::Ratio,
        default: Default::Value(0.001),
        min: 0.0,
        min_excluded: false,
        max: f64::INFINITY,
        text: "The tolerance as a share of the depth extent, the difference between the farthest and the nearest range of the covered samples.",
    },
    ParamSpec {
        operation: "sculpt",
        name: "effort",
        unit: Unit::Count,
        default: Default::Value(1.0),
        min: 0.0,
        min_excluded: false,
        max: 2.0,
        text: "Work spent on fewer triangles at the same tolerance: 0 digs only, 1 also removes vertices, for about twice the time, 2 searches for fewer yet, for about ten times the time.",
    },
    ParamSpec {
        operation: "sculpt",
        name: "interpolate",
        unit: Unit::Count,
        default: Default::Value(1.0),
        min: 0.0,
        min_excluded: false,
        max: 1.0,
        text: "1 makes every vertex a sample; 0 lets vertices leave their samples along the ray within the tolerance, for about a sixth fewer triangles than effort 2 and a little more time; with effort 0, which moves nothing, it has no effect.",
    },
    ParamSpec {
        operation: "sculpt",
        name: "min_angle",
        unit: Unit::Angle,
        default: Default::Value(0.0),
        min: 0.0,
        min_excluded: false,
        max: std::f64::consts::FRAC_PI_6,
        text: "Smallest angle, as seen from the sensor, of triangles made to replace others; those of the digging keep theirs. 10 degrees cost up to 12 % more triangles.",
    },
    ParamSpec {
        operation: "sculpt",
        name: "simplify_borders",
        unit: Unit::Count,
        default: Default::Value(0.0),
        min: 0.0,
        min_excluded: false,
        max: 1.0,
        text: "0 keeps open borders as they are in the image but for vertices on straight lines; 1 smooths them, too, for fewer triangles: the mesh reaches at most half a pixel beyond them, covers all that it did, and no other pixel. Needs an effort of at least 1.",
    },
    ParamSpec {
        operation: "sculpt",
        name: "threads",
        unit: Unit::Count,
        default: Default::Value(0.0),
        min: 0.0,
        min_excluded: false,
        max: 1024.0,
        text: "Worker threads, 0 for one a core. The result is the same for any number.",
    },
];

/// How far the mesh may lie from the samples, along their rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tolerance {
    /// World units.
    Absolute(f64),
    /// A share of the depth extent: the difference between the farthest and the nearest range of the covered samples.
    OfDepthExtent(f64),
}

impl Tolerance {
    /// In world units.
    ///
    /// # Errors
    /// [`base::Error::Parameter`] if negative or not finite.
    pub(super) fn in_world(self, depth_extent: f64) -> Result<f64> {
        self.validate()?;
        Ok(match self {
            Tolerance::Absolute(tolerance) => tolerance,
            // A sum of two finite numbers may be too large; no distance is larger than this.
            Tolerance::OfDepthExtent(share) => (share * depth_extent).min(f64::MAX),
        })
    }

    fn validate(self) -> Result<()> {
        match self {
            Tolerance::Absolute(tolerance) => PARAMS[0].check(tolerance),
            Tolerance::OfDepthExtent(share) => PARAMS[1].check(share),
        }
        .map(drop)
    }
}

/// What to sculpt with; see [`PARAMS`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SculptParams {
    /// Largest distance between a sample and the mesh along the sample's ray.
    pub tolerance: Tolerance,
    /// Work spent on fewer triangles, 0 to 2.
    pub effort: u32,
    /// Whether every vertex is a sample; otherwise vertices may leave theirs along the ray, within the tolerance.
    pub interpolate: bool,
    /// Smallest angle of triangles that replace others, as seen from the sensor, radians.
    pub min_angle: f64,
    /// Whether borders are simplified, too, within the tolerance and half a pixel.
    pub simplify_borders: bool,
    /// Where the mesh may be: jumps are left out.
    pub triangulation: TriangulateParams,
    /// Worker threads, 0 for one a core.
    pub threads: usize,
}

impl std::default::Default for SculptParams {
    fn default() -> Self {
        SculptParams {
            tolerance: Tolerance::OfDepthExtent(0.001),
            effort: 1,
            interpolate: true,
            min_angle: 0.0,
            simplify_borders: false,
            triangulation: TriangulateParams::default(),
            threads: 0,
        }
    }
}

impl SculptParams {
    /// Checks each value against its range.
    ///
    /// # Errors
    /// [`base::Error::Parameter`] for the first one out of range.
    pub fn validate(&self) -> Result<()> {
        self.tolerance.validate()?;
        self.triangulation.validate()?;
        for (name, value) in
            [("effort", f64::from(self.effort)), ("min_angle", self.min_angle), ("threads", self.threads as f64)]
        {
            base::params::named(PARAMS, "sculpt", name).check(value)?;
        }
        Ok(())
    }
}
