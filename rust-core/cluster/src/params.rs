//! The parameters of clustering.

use base::error::Result;
use base::params::{Default, ParamSpec, Unit};

const fn count(name: &'static str, default: Default, min: f64, max: f64, text: &'static str) -> ParamSpec {
    ParamSpec { operation: "cluster", name, unit: Unit::Count, default, min, min_excluded: false, max, text }
}

/// Parameters of clustering.
pub const PARAMS: &[ParamSpec] = &[
    count(
        "vertices",
        Default::FromData("a tenth of the input's vertices"),
        1.0,
        4e9,
        "Vertices wanted. More come only if the input's topology needs them, at most as many as the input has when cut to a manifold.",
    ),
    count(
        "patches",
        Default::FromData("about a third of the vertices wanted"),
        1.0,
        4e9,
        "Patches wanted, instead of vertices: k patches give about 3 k vertices.",
    ),
    ParamSpec {
        operation: "cluster",
        name: "max_error",
        unit: Unit::WorldLength,
        default: Default::FromData("no limit"),
        min: 0.0,
        min_excluded: true,
        max: f64::INFINITY,
        text: "Largest distance of any point of the input from the result and of the result from the input, instead of a number of vertices: there are as many as it takes.",
    },
    ParamSpec {
        operation: "cluster",
        name: "adaptivity",
        unit: Unit::Ratio,
        default: Default::Value(1.0),
        min: 0.0,
        min_excluded: false,
        max: 2.0,
        text: "How much smaller triangles are where the surface bends: 0 makes them alike everywhere, 1 gives the least mean distance from the input.",
    },
    count(
        "iterations",
        Default::Value(40.0),
        0.0,
        10_000.0,
        "Most Lloyd steps at the final number of patches; fewer if they no longer gain.",
    ),
    count(
        "relaxation",
        Default::Value(50.0),
        0.0,
        10_000.0,
        "Most steps of the spring relaxation. 0 leaves the fans as they are.",
    ),
    count(
        "fitting",
        Default::Value(0.0),
        0.0,
        100.0,
        "Rounds in which vertices leave the surface for where it lies nearest in the mean square; 1 takes a third off the mean error, more lower the largest. 0 keeps them on it.",
    ),
    count("seed", Default::Value(0.0), 0.0, 4_294_967_295.0, "Which way round patches are split."),
    count(
        "threads",
        Default::Value(0.0),
        0.0,
        1024.0,
        "Worker threads, 0 for one a core. The result is the same for any number.",
    ),
];

/// How fine the result is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Resolution {
    /// A tenth of the input's vertices.
    Tenth,
    /// This many patches.
    Patches(u32),
    /// This many vertices.
    Vertices(u32),
    /// As many as it takes for every vertex of the input to lie this near to the result; world units.
    MaxError(f64),
}

/// What to cluster with; see [`PARAMS`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClusterParams {
    /// How fine the result is.
    pub resolution: Resolution,
    /// How much smaller triangles are where the surface bends.
    pub adaptivity: f64,
    /// Most Lloyd steps at the final number of patches.
    pub iterations: u32,
    /// Most steps of the spring relaxation.
    pub relaxation: u32,
    /// Rounds in which vertices leave the surface for where it lies nearest; 0 keeps them on it.
    pub fitting: u32,
    /// Which way round patches are split.
    pub seed: u32,
    /// Worker threads, 0 for one a core.
    pub threads: usize,
}

impl std::default::Default for ClusterParams {
    fn default() -> Self {
        ClusterParams {
            resolution: Resolution::Tenth,
            adaptivity: 1.0,
            iterations: 40,
            relaxation: 50,
            fitting: 0,
            seed: 0,
            threads: 0,
        }
    }
}

impl Resolution {
    /// Checks the value against its range.
    ///
    /// # Errors
    /// [`base::Error::Parameter`].
    pub fn validate(self) -> Result<()> {
        match self {
            Resolution::Tenth => Ok(()),
            Resolution::Vertices(n) => check("vertices", f64::from(n)),
            Resolution::Patches(k) => check("patches", f64::from(k)),
            Resolution::MaxError(e) => check("max_error", e),
        }
    }
}

impl ClusterParams {
    /// Checks each value against its range.
    ///
    /// # Errors
    /// [`base::Error::Parameter`] for the first one out of range.
    pub fn validate(&self) -> Result<()> {
        self.resolution.validate()?;
        check("adaptivity", self.adaptivity)?;
        check("iterations", f64::from(self.iterations))?;
        check("relaxation", f64::from(self.relaxation))?;
        check("fitting", f64::from(self.fitting))?;
        check("threads", self.threads as f64)
    }
}

fn check(name: &str, value: f64) -> Result<()> {
    base::params::named(PARAMS, "cluster", name).check(value).map(drop)
}
