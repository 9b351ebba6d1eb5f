//! The parameters of quad grids.

use base::error::{Error, Result};
use base::params::{Default, ParamSpec, Unit};

const fn spec(name: &'static str, unit: Unit, default: Default, range: [f64; 2], text: &'static str) -> ParamSpec {
    ParamSpec { operation: "quads", name, unit, default, min: range[0], min_excluded: false, max: range[1], text }
}

/// As many vertices along a side as an image may have pixels.
const MOST: f64 = 67_108_864.0;

/// Parameters of quad grids.
pub const PARAMS: &[ParamSpec] = &[
    spec(
        "tiles_down",
        Unit::Count,
        Default::FromData("one tile every 64 rows of pixels, at least one"),
        [1.0, MOST],
        "Tiles from top to bottom. Every tile gets the same number of rows: more tiles spread them more evenly over the image.",
    ),
    spec(
        "tiles_across",
        Unit::Count,
        Default::FromData("one tile every 64 columns of pixels, at least one"),
        [1.0, MOST],
        "Tiles from left to right. Every tile gets the same number of columns: more tiles spread them more evenly over the image.",
    ),
    spec(
        "rows",
        Unit::Count,
        Default::Value(9.0),
        [2.0, MOST],
        "Rows of vertices a tile, both borders counted; the whole grid has (rows - 1) * tiles_down + 1. Not used where an error is asked for.",
    ),
    spec(
        "columns",
        Unit::Count,
        Default::Value(9.0),
        [2.0, MOST],
        "Columns of vertices a tile, both borders counted; the whole grid has (columns - 1) * tiles_across + 1. Not used where an error is asked for.",
    ),
    spec(
        "max_error",
        Unit::WorldLength,
        Default::FromData("no limit: rows and columns are used as given"),
        [0.0, f64::INFINITY],
        "Chooses rows and columns so that no sample is farther from the grid along its ray. Smaller values give more quads.",
    ),
    spec(
        "rms_error",
        Unit::WorldLength,
        Default::FromData("no limit: rows and columns are used as given"),
        [0.0, f64::INFINITY],
        "Chooses rows and columns so that the root of the mean square distance of the samples to the grid along their rays is at most this. Smaller values give more quads.",
    ),
    spec(
        "gap_passes",
        Unit::Count,
        Default::Value(1.0),
        [0.0, 1024.0],
        "How often invalid pixels are filled with the mean of their valid neighbours, 0 for never.",
    ),
    spec(
        "gap_neighbours",
        Unit::Count,
        Default::Value(8.0),
        [1.0, 8.0],
        "Valid ones among the eight neighbours that an invalid pixel needs to be filled: 8 fills single pixels, fewer grow into larger gaps, a pixel a pass.",
    ),
    ParamSpec {
        min_excluded: true,
        ..spec(
            "curvature_unit",
            Unit::Ratio,
            Default::Value(1e-3),
            [0.0, f64::INFINITY],
            "What counts as 1 in the 8-bit curvature image, as a share of the depth extent. Smaller values let fine relief attract vertices, and noise as well.",
        )
    },
    spec(
        "curvature_limit",
        Unit::Count,
        Default::Value(255.0),
        [1.0, 255.0],
        "Largest value of the curvature image: stronger curvature, such as that of jumps, attracts no more vertices than this.",
    ),
    spec(
        "exponent",
        Unit::Ratio,
        Default::Value(0.7),
        [0.0, 4.0],
        "Density of vertices as this power of the curvature K; 0 is the logarithm of the paper, log(1 + K). Larger values draw more vertices to strong curvature.",
    ),
    spec(
        "floor",
        Unit::Ratio,
        Default::Value(2.0),
        [0.0, 1e6],
        "Density spread evenly, as a share of the mean density: 0 leaves flat regions without vertices, large values give a uniform grid.",
    ),
    spec(
        "smoothing",
        Unit::Ratio,
        Default::Value(2.0),
        [0.0, 16.0],
        "Size of the window that the density is averaged over, in quads: 0 samples each row of pixels for itself, as the paper does; larger values give smoother lines.",
    ),
    spec(
        "background_curvature",
        Unit::Count,
        Default::FromData("none: the background attracts no vertices beyond the floor"),
        [0.0, 255.0],
        "Curvature given to invalid pixels, as in the paper (5 and 20 there). Larger values draw vertices to the background.",
    ),
    spec(
        "coverage",
        Unit::Ratio,
        Default::Value(0.5),
        [0.0, 1.0],
        "Smallest share of valid pixels that a quad of the mesh may have; with more than 0 its corners must be valid too. 0 keeps every quad, over the background as well.",
    ),
    spec(
        "threads",
        Unit::Count,
        Default::Value(0.0),
        [0.0, 1024.0],
        "Worker threads, 0 for one a core. The result is the same for any number.",
    ),
];

/// An error that rows and columns are chosen for, in world units along the samples' rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// No sample farther from the grid.
    Max(f64),
    /// Root of the mean square distance.
    Rms(f64),
}

/// What to make a quad grid with; see [`PARAMS`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuadParams {
    /// Tiles from top to bottom; `None`: one every 64 rows of pixels.
    pub tiles_down: Option<usize>,
    /// Tiles from left to right; `None`: one every 64 columns of pixels.
    pub tiles_across: Option<usize>,
    /// Rows of vertices a tile, both borders counted.
    pub rows: usize,
    /// Columns of vertices a tile, both borders counted.
    pub columns: usize,
    /// Chooses rows and columns for this error instead.
    pub target: Option<Target>,
    /// How often gaps are filled.
    pub gap_passes: usize,
    /// Valid neighbours, of eight, that a gap needs to be filled.
    pub gap_neighbours: usize,
    /// What counts as 1 in the curvature image, as a share of the depth extent.
    pub curvature_unit: f64,
    /// Largest value of the curvature image.
    pub curvature_limit: u8,
    /// Density as a power of the curvature; 0: its logarithm.
    pub exponent: f64,
    /// Evenly spread density, as a share of the mean.
    pub floor: f64,
    /// Window the density is averaged over, in quads.
    pub smoothing: f64,
    /// Curvature of invalid pixels.
    pub background_curvature: Option<u8>,
    /// Smallest share of valid pixels of a quad of the mesh.
    pub coverage: f64,
    /// Worker threads, 0 for one a core.
    pub threads: usize,
}

fn default_of(name: &str) -> f64 {
    find(name).value()
}

fn find(name: &str) -> &'static ParamSpec {
    base::params::named(PARAMS, "quads", name)
}

impl std::default::Default for QuadParams {
    fn default() -> Self {
        QuadParams {
            tiles_down: None,
            tiles_across: None,
            rows: default_of("rows") as usize,
            columns: default_of("columns") as usize,
            target: None,
            gap_passes: default_of("gap_passes") as usize,
            gap_neighbours: default_of("gap_neighbours") as usize,
            curvature_unit: default_of("curvature_unit"),
            curvature_limit: default_of("curvature_limit") as u8,
            exponent: default_of("exponent"),
            floor: default_of("floor"),
            smoothing: default_of("smoothing"),
            background_curvature: None,
            coverage: default_of("coverage"),
            threads: default_of("threads") as usize,
        }
    }
}

impl QuadParams {
    /// Checks each value against its range.
    ///
    /// # Errors
    /// [`Error::Parameter`] for the first one out of range.
    pub fn validate(&self) -> Result<()> {
        let count = |n: usize| Some(n as f64);
        let target = |wanted: fn(Target) -> Option<f64>| self.target.and_then(wanted);
        for (name, value) in [
            ("tiles_down", self.tiles_down.and_then(count)),
            ("tiles_across", self.tiles_across.and_then(count)),
            ("rows", count(self.rows)),
            ("columns", count(self.columns)),
            ("max_error", target(|t| if let Target::Max(e) = t { Some(e) } else { None })),
            ("rms_error", target(|t| if let Target::Rms(e) = t { Some(e) } else { None })),
            ("gap_passes", count(self.gap_passes)),
            ("gap_neighbours", count(self.gap_neighbours)),
            ("curvature_unit", Some(self.curvature_unit)),
            ("curvature_limit", Some(f64::from(self.curvature_limit))),
            ("exponent", Some(self.exponent)),
            ("floor", Some(self.floor)),
            ("smoothing", Some(self.smoothing)),
            ("background_curvature", self.background_curvature.map(f64::from)),
            ("coverage", Some(self.coverage)),
            ("threads", count(self.threads)),
        ] {
            if let Some(value) = value {
                find(name).check(value)?;
            }
        }
        Ok(())
    }

    /// A target from two options of which at most one is given.
    ///
    /// # Errors
    /// [`Error::Input`] if both are given.
    pub fn target_of(max_error: Option<f64>, rms_error: Option<f64>) -> Result<Option<Target>> {
        match (max_error, rms_error) {
            (Some(_), Some(_)) => Err(Error::input("give max_error or rms_error, not both")),
            (max, rms) => Ok(max.map(Target::Max).or(rms.map(Target::Rms))),
        }
    }
}
