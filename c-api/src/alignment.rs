//! What an alignment found.

use std::ffi::{CString, c_char};

use surfrecon::align::{AlignReport, AlignedPair, AlignedScan, Freedom, PairState, ScanState};

use crate::array::{self, srf_array};
use crate::files::at;
use crate::guard::guard;
use crate::handle::{self, handle};
use crate::pose::{self, srf_pose};
use crate::settings::SRF_FROM_DATA;
use crate::status::srf_status;
use crate::text::c_text;
use crate::{pointer, sized};

/// What was found, with texts as C wants them.
pub struct Aligned {
    report: AlignReport,
    reasons: Vec<CString>,
    messages: Vec<CString>,
    lines: Vec<CString>,
    /// By how much the turntable was turned, NaN where that is not known.
    angles: Vec<f64>,
}

impl From<AlignReport> for Aligned {
    fn from(report: AlignReport) -> Self {
        Aligned {
            reasons: report.scans.iter().map(|scan| c_text(&scan.reason)).collect(),
            messages: report.messages.iter().map(|message| c_text(message)).collect(),
            lines: report.lines().iter().map(|line| c_text(line)).collect(),
            angles: report.turntable.iter().flat_map(|table| &table.angles).map(|a| a.unwrap_or(f64::NAN)).collect(),
            report,
        }
    }
}

/// What an alignment found: the poses and how sure they are. Released with srf_alignment_free().
#[allow(non_camel_case_types)]
pub struct srf_alignment {
    _opaque: [u8; 0],
}

handle!(srf_alignment, Aligned);

/// What became of a scan.
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_scan_state {
    /// It has no place: srf_alignment_reason() says why.
    SRF_SCAN_STATE_UNPLACED = 0,
    /// Its pose was found.
    SRF_SCAN_STATE_PLACED = 1,
    /// Its pose is as given: it is fixed, or the frame of the others.
    SRF_SCAN_STATE_KEPT = 2,
    /// It was joined with others, but nothing joins these with the first group.
    SRF_SCAN_STATE_APART = 3,
    /// Its pose is as given: that was rough, and nothing decides where it belongs. srf_alignment_reason() says why.
    SRF_SCAN_STATE_UNDECIDED = 4,
}

impl From<ScanState> for srf_scan_state {
    fn from(state: ScanState) -> Self {
        match state {
            ScanState::Unplaced => srf_scan_state::SRF_SCAN_STATE_UNPLACED,
            ScanState::Placed => srf_scan_state::SRF_SCAN_STATE_PLACED,
            ScanState::Kept => srf_scan_state::SRF_SCAN_STATE_KEPT,
            ScanState::Apart => srf_scan_state::SRF_SCAN_STATE_APART,
            ScanState::Undecided => srf_scan_state::SRF_SCAN_STATE_UNDECIDED,
        }
    }
}

/// What became of a pair of scans.
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_pair_state {
    /// No motion was found that lays one on the other.
    SRF_PAIR_STATE_NOTHING = 0,
    /// They overlap and fit, where they lie in the end.
    SRF_PAIR_STATE_FITS = 1,
    /// They overlap where they lie in the end, but lie further apart than noise explains: warp, or something moved.
    SRF_PAIR_STATE_MISFIT = 2,
    /// They fit, but may turn or slide on each other: not used.
    SRF_PAIR_STATE_SLIDES = 3,
    /// They fit in several places: not used.
    SRF_PAIR_STATE_AMBIGUOUS = 4,
    /// What they share stood still before the sensor while the rest moved: not used.
    SRF_PAIR_STATE_BACKGROUND = 5,
    /// They fit by themselves, but other scans' sensors saw through there: not used.
    SRF_PAIR_STATE_SEEN_THROUGH = 6,
    /// They fit by themselves, but other pairs, that fit better, say otherwise: not used.
    SRF_PAIR_STATE_DISAGREES = 7,
    /// The caller rejected it.
    SRF_PAIR_STATE_REJECTED = 8,
}

impl From<PairState> for srf_pair_state {
    fn from(state: PairState) -> Self {
        match state {
            PairState::Nothing => srf_pair_state::SRF_PAIR_STATE_NOTHING,
            PairState::Fits => srf_pair_state::SRF_PAIR_STATE_FITS,
            PairState::Misfit => srf_pair_state::SRF_PAIR_STATE_MISFIT,
            PairState::Slides => srf_pair_state::SRF_PAIR_STATE_SLIDES,
            PairState::Ambiguous => srf_pair_state::SRF_PAIR_STATE_AMBIGUOUS,
            PairState::Background => srf_pair_state::SRF_PAIR_STATE_BACKGROUND,
            PairState::SeenThrough => srf_pair_state::SRF_PAIR_STATE_SEEN_THROUGH,
            PairState::Disagrees => srf_pair_state::SRF_PAIR_STATE_DISAGREES,
            PairState::Rejected => srf_pair_state::SRF_PAIR_STATE_REJECTED,
        }
    }
}

/// A way that a scan may move without leaving the surfaces it lies on: a turn about an axis, or a slide.
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_freedom {
    /// 1 for a turn, 0 for a slide.
    pub turns: u32,
    /// 0.
    pub reserved: u32,
    /// Unit direction of the axis, or of the slide, in the world.
    pub direction: [f64; 3],
    /// A point of the axis, in the world.
    pub point: [f64; 3],
}

/// Ways to move that a pose has.
const WAYS: usize = 6;

/// Ways to move as the caller gets them: how many, then each.
pub fn ways(free: &[Freedom]) -> (u32, [srf_freedom; WAYS]) {
    let mut all: [srf_freedom; WAYS] = bytemuck::Zeroable::zeroed();
    for (way, freedom) in all.iter_mut().zip(free) {
        *way = srf_freedom {
            turns: freedom.turns.into(),
            reserved: 0,
            direction: freedom.direction.to_array(),
            point: freedom.point.to_array(),
        };
    }
    (free.len().min(WAYS) as u32, all)
}

/// Figures of an alignment. Starts with its size; prepared by srf_align_report_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_align_report {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// Scans that were added.
    pub scans: u32,
    /// Scans of the first group, which have a pose: those placed and those kept.
    pub placed: u32,
    /// Groups of scans that are joined with each other.
    pub groups: u32,
    /// Messages for srf_alignment_message().
    pub messages: u32,
    /// Lines for srf_alignment_line().
    pub lines: u32,
    /// Pairs of scans of which anything was found, for srf_alignment_pair().
    pub pairs: u64,
    /// Pairs that were compared.
    pub compared: u64,
    /// Root mean square distance of the surfaces of all pairs that touch, along normals, in the unit of the scans; SRF_FROM_DATA
    /// where none do.
    pub residual: f64,
}

impl From<&Aligned> for srf_align_report {
    fn from(aligned: &Aligned) -> Self {
        let report = &aligned.report;
        srf_align_report {
            struct_size: size_of::<Self>() as u32,
            scans: report.scans.len() as u32,
            placed: report.placed() as u32,
            groups: report.groups.len() as u32,
            messages: aligned.messages.len() as u32,
            lines: aligned.lines.len() as u32,
            pairs: report.pairs.len() as u64,
            compared: report.compared as u64,
            residual: report.residual.unwrap_or(SRF_FROM_DATA),
        }
    }
}

/// What was found of a scan. Lengths are in the unit of the scans. Starts with its size; prepared by srf_aligned_scan_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_aligned_scan {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// What became of it: a value of srf_scan_state.
    pub state: u32,
    /// Number of its group: 0 is the one that is placed. UINT32_MAX where it is joined with none.
    pub group: u32,
    /// Ways that it may turn or slide and nothing holds it.
    pub free_ways: u32,
    /// Its pose in its group, rigid: of the first group the result; scans of others lie together where the largest of them was given.
    /// All 0 where it has no group.
    pub world_from_scan: srf_pose,
    /// Covariance of a small motion of it in the world, row after row: turn about middle (radians), then shift. 0 where it is kept.
    pub covariance: [[f64; 6]; 6],
    /// The middle of its points, in the world.
    pub middle: [f64; 3],
    /// One standard deviation of the place of its points: the largest over the scan; at least its size where nothing holds it, infinite
    /// where it has no place.
    pub deviation: f64,
    /// The free ways; 0 behind them.
    pub freedoms: [srf_freedom; 6],
    /// Share of its surface that lies on the scan that shares most with it.
    pub overlap: f64,
    /// Root mean square distance to the surfaces of others, along normals; 0 where there are none.
    pub residual: f64,
    /// Root mean square of how far it lies from the others where noise is averaged out: what no rigid pose explains, such as warp.
    /// Bending within a few samples counts as well, so that some of it is always there. srf_aligner_misfit() says where.
    pub misfit: f64,
    /// Median distance of its samples.
    pub spacing: f64,
}

impl From<&AlignedScan> for srf_aligned_scan {
    fn from(scan: &AlignedScan) -> Self {
        let (free_ways, freedoms) = ways(&scan.free);
        srf_aligned_scan {
            struct_size: size_of::<Self>() as u32,
            state: srf_scan_state::from(scan.state) as u32,
            group: scan.group.map_or(u32::MAX, |group| group as u32),
            free_ways,
            world_from_scan: scan.world_from_scan.map_or_else(bytemuck::Zeroable::zeroed, pose::pose),
            covariance: scan.covariance,
            middle: scan.middle.to_array(),
            deviation: scan.deviation,
            freedoms,
            overlap: scan.overlap,
            residual: scan.residual,
            misfit: scan.misfit,
            spacing: scan.spacing,
        }
    }
}

/// What was found of two scans. Starts with its size; prepared by srf_aligned_pair_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_aligned_pair {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// What became of the pair: a value of srf_pair_state.
    pub state: u32,
    /// Numbers of the scans, the smaller first.
    pub scans: [u32; 2],
    /// Places in which one fits the other.
    pub places: u32,
    /// Ways that one may turn or slide on the other.
    pub free_ways: u32,
    /// The free ways; 0 behind them.
    pub freedoms: [srf_freedom; 6],
    /// Share of either surface that lies on the other.
    pub overlap: [f64; 2],
    /// Root mean square distance of the surfaces where they touch, along normals, in the unit of the scans.
    pub residual: f64,
    /// How well the pair is held against turning and sliding: 1 at best, 0 where it may.
    pub balance: f64,
    /// Of what the sensors can tell, the share that speaks against it.
    pub seen_through: f64,
}

impl From<&AlignedPair> for srf_aligned_pair {
    fn from(pair: &AlignedPair) -> Self {
        let (free_ways, freedoms) = ways(&pair.free);
        srf_aligned_pair {
            struct_size: size_of::<Self>() as u32,
            state: srf_pair_state::from(pair.state) as u32,
            scans: pair.scans.map(|scan| scan as u32),
            places: pair.places as u32,
            free_ways,
            freedoms,
            overlap: pair.overlap,
            residual: pair.residual,
            balance: pair.balance,
            seen_through: pair.seen_through,
        }
    }
}

/// Prepares a struct for srf_alignment_report(). Call srf_align_report_init(report), which adds the size that this header knows.
/// report   not NULL
/// size     sizeof(srf_align_report): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_align_report_init_sized(report: *mut srf_align_report, size: usize) -> srf_status {
    guard(|| sized::init::<srf_align_report>("report", report, size, bytemuck::Zeroable::zeroed()))
}

/// Prepares a struct for srf_alignment_scan(). Call srf_aligned_scan_init(scan), which adds the size that this header knows.
/// scan     not NULL
/// size     sizeof(srf_aligned_scan): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_aligned_scan_init_sized(scan: *mut srf_aligned_scan, size: usize) -> srf_status {
    guard(|| sized::init::<srf_aligned_scan>("scan", scan, size, bytemuck::Zeroable::zeroed()))
}

/// Prepares a struct for srf_alignment_pair(). Call srf_aligned_pair_init(pair), which adds the size that this header knows.
/// pair     not NULL
/// size     sizeof(srf_aligned_pair): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_aligned_pair_init_sized(pair: *mut srf_aligned_pair, size: usize) -> srf_status {
    guard(|| sized::init::<srf_aligned_pair>("pair", pair, size, bytemuck::Zeroable::zeroed()))
}

/// Releases what an alignment found, with its texts.
/// alignment  NULL does nothing
/// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_alignment_free(alignment: *mut srf_alignment) -> srf_status {
    guard(|| handle::free("alignment", alignment))
}

/// The figures of an alignment.
/// alignment   not NULL
/// out_report  initialized by srf_align_report_init(); not NULL
/// returns     SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_alignment_report(
    alignment: *const srf_alignment,
    out_report: *mut srf_align_report,
) -> srf_status {
    guard(|| sized::write("out_report", out_report, handle::get("alignment", alignment)?.as_ref().into()))
}

/// What was found of a scan.
/// alignment  not NULL
/// index      number of the scan, in the order of adding
/// out_scan   initialized by srf_aligned_scan_init(); not NULL
/// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_alignment_scan(
    alignment: *const srf_alignment,
    index: usize,
    out_scan: *mut srf_aligned_scan,
) -> srf_status {
    guard(|| {
        let aligned = handle::get("alignment", alignment)?;
        sized::write("out_scan", out_scan, srf_aligned_scan::from(at(&aligned.report.scans, index)?))
    })
}

/// What was found of a pair of scans; pairs that are not listed have nothing in common.
/// alignment  not NULL
/// index      less than the number of pairs in the report; they are listed by their scans' numbers
/// out_pair   initialized by srf_aligned_pair_init(); not NULL
/// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_alignment_pair(
    alignment: *const srf_alignment,
    index: usize,
    out_pair: *mut srf_aligned_pair,
) -> srf_status {
    guard(|| {
        let aligned = handle::get("alignment", alignment)?;
        sized::write("out_pair", out_pair, srf_aligned_pair::from(at(&aligned.report.pairs, index)?))
    })
}

/// The turntable that the object stood on.
/// alignment      not NULL
/// out_found      receives 1, or 0 where there was none or its axis was not found: then nothing else is written; not NULL
/// out_point      room for 3 doubles: a point of its axis, in the frame that the scans were taken in; NULL if not wanted
/// out_direction  room for 3 doubles: the unit direction of its axis; NULL if not wanted
/// out_angles     receives a view that stays until the alignment is freed, an SRF_TYPE_F64 a scan: by how much it was turned then, from 0 to
///                2 pi, counter-clockwise where the axis points to the viewer; 0 at the first scan that is placed, NaN at those that
///                are not. NULL if not wanted
/// returns        SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_alignment_turntable(
    alignment: *const srf_alignment,
    out_found: *mut u32,
    out_point: *mut f64,
    out_direction: *mut f64,
    out_angles: *mut srf_array,
) -> srf_status {
    guard(|| {
        pointer::writable("out_found", out_found)?;
        let aligned = handle::get("alignment", alignment)?;
        let Some(table) = &aligned.report.turntable else { return pointer::write("out_found", out_found, 0) };
        let numbers =
            [("out_point", out_point, table.axis.point), ("out_direction", out_direction, table.axis.direction)];
        for (name, out, value) in numbers.into_iter().filter(|(_, out, _)| !out.is_null()) {
            pointer::copy_out(name, out, &value.to_array())?;
        }
        if !out_angles.is_null() {
            pointer::write("out_angles", out_angles, array::values(&aligned.angles))?;
        }
        pointer::write("out_found", out_found, 1)
    })
}

/// Why a scan is not placed, and what to do.
/// alignment   not NULL
/// index       number of the scan, in the order of adding
/// out_reason  receives a text that stays until the alignment is freed, empty for a scan that is placed; not NULL
/// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_alignment_reason(
    alignment: *const srf_alignment,
    index: usize,
    out_reason: *mut *const c_char,
) -> srf_status {
    guard(|| {
        let aligned = handle::get("alignment", alignment)?;
        pointer::write("out_reason", out_reason, at(&aligned.reasons, index)?.as_ptr())
    })
}

/// What a person should know of the whole, a sentence.
/// alignment    not NULL
/// index        less than the number of messages in the report
/// out_message  receives a text that stays until the alignment is freed, on SRF_OK only; not NULL
/// returns      SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_alignment_message(
    alignment: *const srf_alignment,
    index: usize,
    out_message: *mut *const c_char,
) -> srf_status {
    guard(|| {
        let aligned = handle::get("alignment", alignment)?;
        pointer::write("out_message", out_message, at(&aligned.messages, index)?.as_ptr())
    })
}

/// A line for logs: first the whole, then each scan, then the messages.
/// alignment  not NULL
/// index      less than the number of lines in the report
/// out_line   receives a text that stays until the alignment is freed, on SRF_OK only; not NULL
/// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_alignment_line(
    alignment: *const srf_alignment,
    index: usize,
    out_line: *mut *const c_char,
) -> srf_status {
    guard(|| {
        let aligned = handle::get("alignment", alignment)?;
        pointer::write("out_line", out_line, at(&aligned.lines, index)?.as_ptr())
    })
}
