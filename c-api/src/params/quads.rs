//! Parameters of quads. Written by `make generate` from their declaration in the core: change that.

use crate::given::{Fields, Given};
use crate::guard::guard;
use crate::settings::SRF_FROM_DATA;
use crate::sized;
use crate::status::srf_status;

/// How a quad grid is made. Starts with its size. Set to the defaults by srf_quads_params_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_quads_params {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// Worker threads, at most 1024. 0, the default, for the number of srf_set_threads(). Results are the same for any
    /// number.
    pub threads: u32,
    /// Tiles from top to bottom. Every tile gets the same number of rows: more tiles spread them more evenly over the
    /// image. 1 to 67108864. 0, the default: one tile every 64 rows of pixels, at least one.
    pub tiles_down: u64,
    /// Tiles from left to right. Every tile gets the same number of columns: more tiles spread them more evenly over the
    /// image. 1 to 67108864. 0, the default: one tile every 64 columns of pixels, at least one.
    pub tiles_across: u64,
    /// Rows of vertices per tile, both borders counted. Neighbouring tiles share the row between them. Not used where an
    /// error is asked for. 2 to 67108864, default 9.
    pub rows: u64,
    /// Columns of vertices per tile, both borders counted. Neighbouring tiles share the column between them. Not used where
    /// an error is asked for. 2 to 67108864, default 9.
    pub columns: u64,
    /// Chooses rows and columns so that no sample is farther from the grid along its ray. Smaller values give more quads.
    /// >= 0. SRF_FROM_DATA, the default: no limit, rows and columns are used as given.
    pub max_error: f64,
    /// Chooses rows and columns so that the root of the mean square distance of the samples to the grid along their rays is
    /// at most this. Smaller values give more quads. >= 0. SRF_FROM_DATA, the default: no limit, rows and columns are used
    /// as given.
    pub rms_error: f64,
    /// How often invalid pixels are filled with the mean of their valid neighbours. 0: never. 0 to 1024, default 1.
    pub gap_passes: u64,
    /// Valid ones among the eight neighbours that an invalid pixel needs to be filled: 8 fills single pixels, fewer grow
    /// into larger gaps, a pixel a pass. 1 to 8, default 8.
    pub gap_neighbours: u64,
    /// Curvature that counts as 1 in the 8-bit curvature image, as a share of the depth extent. Smaller values let fine
    /// relief attract vertices, and noise as well. > 0, default 0.001.
    pub curvature_unit: f64,
    /// Largest value of the curvature image: stronger curvature, such as that of jumps, attracts no more vertices than
    /// this. 1 to 255, default 255.
    pub curvature_limit: u64,
    /// Density of vertices as this power of the curvature K. Larger values draw more vertices to strong curvature. 0: the
    /// logarithm of the paper, log(1 + K). 0 to 4, default 0.7.
    pub exponent: f64,
    /// Density spread evenly, as a share of the mean density. Large values give a uniform grid. 0: flat regions are left
    /// without vertices. 0 to 1000000, default 2.
    pub floor: f64,
    /// Size of the window that the density is averaged over, in quads. Larger values give smoother lines. 0: each row of
    /// pixels is sampled for itself, as in the paper. 0 to 16, default 2.
    pub smoothing: f64,
    /// Curvature given to invalid pixels, as in the paper (5 and 20 there). Larger values draw vertices to the background.
    /// A whole number. 0 to 255. SRF_FROM_DATA, the default: none, the background attracts no vertices beyond the floor.
    pub background_curvature: f64,
    /// Smallest share of valid pixels that a quad of the mesh may have. With more than 0 its corners must be valid too. 0:
    /// every quad is kept, over the background as well. 0 to 1, default 0.5.
    pub coverage: f64,
}

impl Fields for srf_quads_params {
    fn defaults() -> Self {
        srf_quads_params {
            struct_size: size_of::<Self>() as u32,
            threads: 0,
            tiles_down: 0,
            tiles_across: 0,
            rows: 9,
            columns: 9,
            max_error: SRF_FROM_DATA,
            rms_error: SRF_FROM_DATA,
            gap_passes: 1,
            gap_neighbours: 8,
            curvature_unit: 0.001,
            curvature_limit: 255,
            exponent: 0.7,
            floor: 2.0,
            smoothing: 2.0,
            background_curvature: SRF_FROM_DATA,
            coverage: 0.5,
        }
    }

    fn given(&self) -> Vec<(&'static str, Given)> {
        vec![
            ("threads", Given::Threads(self.threads)),
            ("tiles_down", Given::Whole(self.tiles_down)),
            ("tiles_across", Given::Whole(self.tiles_across)),
            ("rows", Given::Whole(self.rows)),
            ("columns", Given::Whole(self.columns)),
            ("max_error", Given::Double(self.max_error)),
            ("rms_error", Given::Double(self.rms_error)),
            ("gap_passes", Given::Whole(self.gap_passes)),
            ("gap_neighbours", Given::Whole(self.gap_neighbours)),
            ("curvature_unit", Given::Double(self.curvature_unit)),
            ("curvature_limit", Given::Whole(self.curvature_limit)),
            ("exponent", Given::Double(self.exponent)),
            ("floor", Given::Double(self.floor)),
            ("smoothing", Given::Double(self.smoothing)),
            ("background_curvature", Given::Double(self.background_curvature)),
            ("coverage", Given::Double(self.coverage)),
        ]
    }
}

/// Sets the defaults. Call srf_quads_params_init(params), which adds the size that this header knows.
/// params   not NULL
/// size     sizeof(srf_quads_params): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_quads_params_init_sized(params: *mut srf_quads_params, size: usize) -> srf_status {
    guard(|| sized::init("params", params, size, srf_quads_params::defaults()))
}
