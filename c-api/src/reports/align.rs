//! Figures of align. Written by `make generate` from their declaration in the core: change that.

use crate::guard::guard;
use crate::pose::srf_pose;
use crate::sized;
use crate::status::srf_status;

/// State of the scan: placed, kept, or neither.
#[allow(non_camel_case_types, dead_code)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_scan_state {
    /// It has no place: the reason says why.
    SRF_SCAN_STATE_UNPLACED = 1,
    /// Its pose was found.
    SRF_SCAN_STATE_PLACED = 2,
    /// Its pose is as given: the caller fixed it, or it is the frame of the others.
    SRF_SCAN_STATE_KEPT = 3,
    /// It was joined with others, but nothing joins these with the first group.
    SRF_SCAN_STATE_APART = 4,
    /// Its pose is as given: that was rough, and nothing decides where it belongs. The reason says why.
    SRF_SCAN_STATE_UNDECIDED = 5,
}

/// State of the pair: it fits, or why it is not used.
#[allow(non_camel_case_types, dead_code)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_pair_state {
    /// No motion was found that lays one on the other.
    SRF_PAIR_STATE_NOTHING = 1,
    /// They overlap and fit, where they lie in the end.
    SRF_PAIR_STATE_FITS = 2,
    /// They overlap where they lie in the end, but surfaces lie further apart than noise explains: warp, or something
    /// moved.
    SRF_PAIR_STATE_MISFIT = 3,
    /// They fit, but may turn or slide on each other: not used.
    SRF_PAIR_STATE_SLIDES = 4,
    /// They fit in several places: not used.
    SRF_PAIR_STATE_AMBIGUOUS = 5,
    /// The shared part stood still before the sensor while the rest moved: not used.
    SRF_PAIR_STATE_BACKGROUND = 6,
    /// They fit by themselves, but other scans' sensors saw through there: not used.
    SRF_PAIR_STATE_SEEN_THROUGH = 7,
    /// They fit by themselves, but other pairs, that fit better, rough poses or the order of a recording say otherwise: not
    /// used.
    SRF_PAIR_STATE_DISAGREES = 8,
    /// The caller rejected it.
    SRF_PAIR_STATE_REJECTED = 9,
}

/// A way that a scan may move without leaving the surfaces it lies on.
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_freedom {
    /// Whether it is a turn about an axis. Otherwise it is a slide. 1 or 0.
    pub turns: u64,
    /// Unit direction of the axis, or of the slide, in the world.
    pub direction: [f64; 3],
    /// A point of the axis, in the world.
    pub point: [f64; 3],
}

/// A scan that was aligned: its pose, and how sure that is. Starts with its size. Prepared by srf_aligned_scan_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_aligned_scan {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// State of the scan: placed, kept, or neither. A value of srf_scan_state, such as SRF_SCAN_STATE_UNPLACED.
    pub state: u64,
    /// Number of its group. 0 is the group that is placed. There is none where the scan is joined with no other. Then it is
    /// UINT64_MAX.
    pub group: u64,
    /// Its pose in its group, which is rigid. For the first group it is the result. Scans of others lie together where the
    /// largest of them was given. There is none where the scan has no group. Then it is all 0.
    pub world_from_scan: srf_pose,
    /// Covariance of a small motion of it in the world: a turn about `middle` in radians, then a shift. Zero for scans that
    /// are kept.
    pub covariance: [[f64; 6]; 6],
    /// The middle of its points, in the world.
    pub middle: [f64; 3],
    /// One standard deviation of the place of its points: the largest over the scan. It is at least the scan's size where
    /// nothing holds it, the reach where it stays undecided, and infinite where it has no place. In the unit of the scans.
    pub deviation: f64,
    /// Number of freedoms. Ways that nothing holds it.
    pub freedoms_count: u64,
    /// Ways that nothing holds it. Those behind them are 0.
    pub freedoms: [srf_freedom; 6],
    /// Share of its surface that lies on the scan that shares most with it.
    pub overlap: f64,
    /// Root mean square distance to the surfaces of others, along normals. 0 where there are none. In the unit of the
    /// scans.
    pub residual: f64,
    /// Root mean square of how far it lies from the others where noise is averaged out. No rigid pose explains that, but
    /// warp does. Bending within a few samples counts as well, so that some of it is always there. In the unit of the
    /// scans.
    pub misfit: f64,
    /// Median distance of its samples. In the unit of the scans.
    pub spacing: f64,
}

/// Prepares a struct of figures. Call srf_aligned_scan_init(report), which adds the size that this header knows.
/// report   not NULL
/// size     sizeof(srf_aligned_scan): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_aligned_scan_init_sized(report: *mut srf_aligned_scan, size: usize) -> srf_status {
    guard(|| sized::init::<srf_aligned_scan>("report", report, size, bytemuck::Zeroable::zeroed()))
}

/// Two scans that were compared, and how well they fit. Starts with its size. Prepared by srf_aligned_pair_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_aligned_pair {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Their numbers, the smaller first.
    pub scans: [u64; 2],
    /// State of the pair: it fits, or why it is not used. A value of srf_pair_state, such as SRF_PAIR_STATE_NOTHING.
    pub state: u64,
    /// Share of either surface that lies on the other.
    pub overlap: [f64; 2],
    /// Root mean square distance of the surfaces where they touch, along normals. In the unit of the scans.
    pub residual: f64,
    /// How well the pair is held against turning and sliding: 1 at best, 0 where it may turn or slide.
    pub balance: f64,
    /// Of what the sensors can tell, the share that speaks against the pair.
    pub seen_through: f64,
    /// Places in which one fits the other.
    pub places: u64,
    /// Number of freedoms. Ways that one may turn or slide on the other.
    pub freedoms_count: u64,
    /// Ways that one may turn or slide on the other. Those behind them are 0.
    pub freedoms: [srf_freedom; 6],
}

/// Prepares a struct of figures. Call srf_aligned_pair_init(report), which adds the size that this header knows.
/// report   not NULL
/// size     sizeof(srf_aligned_pair): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_aligned_pair_init_sized(report: *mut srf_aligned_pair, size: usize) -> srf_status {
    guard(|| sized::init::<srf_aligned_pair>("report", report, size, bytemuck::Zeroable::zeroed()))
}

/// Scans that were aligned, and their pairs. Starts with its size. Prepared by srf_align_report_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_align_report {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Number of scans. Each scan, in the order given.
    pub scans_count: u64,
    /// Number of pairs. The pairs of which anything was found, by their numbers.
    pub pairs_count: u64,
    /// Number of groups. Numbers of the scans of each group, the placed one first. Only scans that are joined with others,
    /// or kept, are in one.
    pub groups_count: u64,
    /// Pairs that were compared.
    pub compared: u64,
    /// Root mean square distance of the surfaces of all pairs that touch, along normals. There is none where none touch.
    /// Then it is SRF_FROM_DATA. In the unit of the scans.
    pub residual: f64,
    /// Turntable: A point of the axis.
    pub turntable_point: [f64; 3],
    /// Turntable: Unit direction of the axis.
    pub turntable_direction: [f64; 3],
    /// Number of messages. Sentences that the user should know.
    pub messages_count: u64,
    /// Scans that lie in one frame: those that were placed, and those kept. 0 where a single one was kept for want of a
    /// place for others.
    pub placed: u64,
}

/// Prepares a struct of figures. Call srf_align_report_init(report), which adds the size that this header knows.
/// report   not NULL
/// size     sizeof(srf_align_report): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_align_report_init_sized(report: *mut srf_align_report, size: usize) -> srf_status {
    guard(|| sized::init::<srf_align_report>("report", report, size, bytemuck::Zeroable::zeroed()))
}
