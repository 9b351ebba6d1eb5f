//! Parameters of align. Written by `make generate` from their declaration in the core: change that.

use crate::given::{Fields, Given};
use crate::guard::guard;
use crate::settings::SRF_FROM_DATA;
use crate::sized;
use crate::status::srf_status;

/// Facts that are known of the poses of the scans.
#[allow(non_camel_case_types, dead_code)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_start {
    /// As the scans say: `sequence` where all are frames of one recording that follow each other in time and at least half
    /// of them fit the frame before, `unknown` otherwise.
    SRF_START_AUTO = 1,
    /// Nothing: each scan may lie anywhere, whatever pose it has.
    SRF_START_UNKNOWN = 2,
    /// They are near where they belong: no scan is placed further from its pose than `reach`.
    SRF_START_ROUGH = 3,
    /// Nothing, but each scan was taken a moment after the one before it, by a sensor that moved little: in the order of
    /// the recording that they are frames of, else in the order given.
    SRF_START_SEQUENCE = 4,
}

/// Whether the object turned on a table while the sensor stood still: then only turns about one axis are looked for, unless none is found, which is said.
#[allow(non_camel_case_types, dead_code)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_turntable {
    /// No, or not known.
    SRF_TURNTABLE_NO = 1,
    /// By angles that are found, or given, about an axis that is found, or given: the same one in the frames of all scans.
    SRF_TURNTABLE_TURNED = 2,
    /// A whole turn in equal steps, in the order of the scans.
    SRF_TURNTABLE_EQUAL = 3,
}

/// How scans are brought to one frame. Lengths are in the unit of the scans. Starts with its size. Set to the defaults by
/// srf_align_params_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_align_params {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// Worker threads, at most 1024. 0, the default, for the number of srf_set_threads(). Results are the same for any
    /// number.
    pub threads: u32,
    /// Facts that are known of the poses of the scans. A value of srf_start, default SRF_START_AUTO.
    pub start: u64,
    /// With rough poses, how far off they may be: no sample of a scan is placed further from where its pose has it. A scan
    /// that fits no nearer is left out, and the report says how far that would be. > 0. SRF_FROM_DATA, the default: a tenth
    /// of the scan's size.
    pub reach: f64,
    /// Whether the object turned on a table while the sensor stood still: then only turns about one axis are looked for,
    /// unless none is found, which is said. A value of srf_turntable, default SRF_TURNTABLE_NO.
    pub turntable: u64,
    /// Surfaces that lie further apart, as a root mean square, don't fit. > 0. SRF_FROM_DATA, the default: a fifth of the
    /// distance of the points that are compared, 8,000 to a scan, or more where noise asks for it.
    pub tolerance: f64,
    /// Scans fit only if one of them lies on the other with at least this share of its surface. 0 to 1, default 0.03.
    pub min_overlap: f64,
    /// Colours or intensities decide where shape lets scans turn or slide, or fits in several places. Off: shape alone
    /// counts. 1 or 0, default 1.
    pub use_colour: u64,
}

impl Fields for srf_align_params {
    fn defaults() -> Self {
        srf_align_params {
            struct_size: size_of::<Self>() as u32,
            threads: 0,
            start: 1,
            reach: SRF_FROM_DATA,
            turntable: 1,
            tolerance: SRF_FROM_DATA,
            min_overlap: 0.03,
            use_colour: 1,
        }
    }

    fn given(&self) -> Vec<(&'static str, Given)> {
        vec![
            ("threads", Given::Threads(self.threads)),
            ("start", Given::Whole(self.start)),
            ("reach", Given::Double(self.reach)),
            ("turntable", Given::Whole(self.turntable)),
            ("tolerance", Given::Double(self.tolerance)),
            ("min_overlap", Given::Double(self.min_overlap)),
            ("use_colour", Given::Whole(self.use_colour)),
        ]
    }
}

/// Sets the defaults. Call srf_align_params_init(params), which adds the size that this header knows.
/// params   not NULL
/// size     sizeof(srf_align_params): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_align_params_init_sized(params: *mut srf_align_params, size: usize) -> srf_status {
    guard(|| sized::init("params", params, size, srf_align_params::defaults()))
}
