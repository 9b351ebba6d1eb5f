//! Structs of the header by the numbers after their first eight bytes. Written by `make generate`.

use crate::types::Sized;

pub type ReadOptions = Sized<16>;

pub type WriteOptions = Sized<4>;

pub type TriangulateParams = Sized<2>;

pub type PlaneParams = Sized<3>;

pub type AlignParams = Sized<6>;

pub type MergeParams = Sized<10>;

pub type SculptParams = Sized<8>;

pub type QuadsParams = Sized<15>;

pub type SplineParams = Sized<3>;

pub type ReconstructParams = Sized<6>;

pub type ClusterParams = Sized<11>;

pub type CloseParams = Sized<8>;

pub type CheckPrintParams = Sized<8>;

pub type PreparePrintParams = Sized<13>;

pub type UnwrapParams = Sized<6>;

pub type TextureParams = Sized<7>;

pub type ScanParams = Sized<10>;

pub type AlignedScan = Sized<105>;

/// Places of the figures of [`AlignedScan`].
#[allow(dead_code, reason = "tests look at some")]
pub mod aligned_scan {
    pub const STATE: usize = 0;
    pub const GROUP: usize = 1;
    pub const WORLD_FROM_SCAN: usize = 2;
    pub const COVARIANCE: usize = 18;
    pub const MIDDLE: usize = 54;
    pub const DEVIATION: usize = 57;
    pub const FREEDOMS_COUNT: usize = 58;
    pub const FREEDOMS: usize = 59;
    pub const OVERLAP: usize = 101;
    pub const RESIDUAL: usize = 102;
    pub const MISFIT: usize = 103;
    pub const SPACING: usize = 104;
}

pub type AlignedPair = Sized<52>;

/// Places of the figures of [`AlignedPair`].
#[allow(dead_code, reason = "tests look at some")]
pub mod aligned_pair {
    pub const SCANS: usize = 0;
    pub const STATE: usize = 2;
    pub const OVERLAP: usize = 3;
    pub const RESIDUAL: usize = 5;
    pub const BALANCE: usize = 6;
    pub const SEEN_THROUGH: usize = 7;
    pub const PLACES: usize = 8;
    pub const FREEDOMS_COUNT: usize = 9;
    pub const FREEDOMS: usize = 10;
}

pub type AlignReport = Sized<13>;

/// Places of the figures of [`AlignReport`].
#[allow(dead_code, reason = "tests look at some")]
pub mod align_report {
    pub const SCANS_COUNT: usize = 0;
    pub const PAIRS_COUNT: usize = 1;
    pub const GROUPS_COUNT: usize = 2;
    pub const COMPARED: usize = 3;
    pub const RESIDUAL: usize = 4;
    pub const TURNTABLE_POINT: usize = 5;
    pub const TURNTABLE_DIRECTION: usize = 8;
    pub const MESSAGES_COUNT: usize = 11;
    pub const PLACED: usize = 12;
}

pub type MergeReport = Sized<31>;

/// Places of the figures of [`MergeReport`].
#[allow(dead_code, reason = "tests look at some")]
pub mod merge_report {
    pub const SCANS: usize = 0;
    pub const INPUT_TRIANGLES: usize = 1;
    pub const VOXEL: usize = 2;
    pub const VOXEL_REASON: usize = 3;
    pub const MERGE_DISTANCE: usize = 4;
    pub const MAX_HOLE_LENGTH: usize = 5;
    pub const OVERLAP_RESIDUAL: usize = 6;
    pub const NOISE: usize = 7;
    pub const NOISE_ACROSS: usize = 8;
    pub const NOISE_STEP: usize = 9;
    pub const NOISE_CORRELATION: usize = 10;
    pub const GRID: usize = 11;
    pub const INTERSECTIONS: usize = 14;
    pub const SEEN_THROUGH: usize = 15;
    pub const FUSED_INTERSECTIONS: usize = 16;
    pub const ARTIFICIAL_INTERSECTIONS: usize = 17;
    pub const FACES_DIRECT: usize = 18;
    pub const FACES_SETTLED: usize = 19;
    pub const FACES_FILLING: usize = 20;
    pub const HOLES_CLOSED: usize = 21;
    pub const HOLES_OPEN: usize = 22;
    pub const DROPPED_COMPONENTS: usize = 23;
    pub const DROPPED_FACES: usize = 24;
    pub const WORKING_BYTES: usize = 25;
    pub const IN_FILES: usize = 26;
    pub const SHORTEST_EDGE: usize = 27;
    pub const HOLES_SEEN_THROUGH: usize = 28;
    pub const FILLED_AREA: usize = 29;
    pub const FILLED_SHARE: usize = 30;
}

pub type SculptReport = Sized<14>;

/// Places of the figures of [`SculptReport`].
#[allow(dead_code, reason = "tests look at some")]
pub mod sculpt_report {
    pub const TOLERANCE: usize = 0;
    pub const DEPTH_EXTENT: usize = 1;
    pub const FULL_TRIANGLES: usize = 2;
    pub const HIDDEN_TRIANGLES: usize = 3;
    pub const DUG_TRIANGLES: usize = 4;
    pub const TRIANGLES: usize = 5;
    pub const ISOLATED_PIXELS: usize = 6;
    pub const MAX_ERROR: usize = 7;
    pub const MAX_ERROR_SINGLE: usize = 8;
    pub const RMS_ERROR: usize = 9;
    pub const P95_ERROR: usize = 10;
    pub const WORST_ROW: usize = 11;
    pub const WORST_COL: usize = 12;
    pub const COVERED_PIXELS: usize = 13;
}

pub type QuadReport = Sized<17>;

/// Places of the figures of [`QuadReport`].
#[allow(dead_code, reason = "tests look at some")]
pub mod quads_report {
    pub const TILES_DOWN: usize = 0;
    pub const TILES_ACROSS: usize = 1;
    pub const DEPTH_EXTENT: usize = 2;
    pub const RELATIVE_ERROR: usize = 3;
    pub const UNIFORM_RELATIVE_ERROR: usize = 4;
    pub const RMS_ERROR: usize = 5;
    pub const UNIFORM_RMS_ERROR: usize = 6;
    pub const MAX_ERROR: usize = 7;
    pub const UNIFORM_MAX_ERROR: usize = 8;
    pub const IS_UNIFORM: usize = 9;
    pub const VALID_PIXELS: usize = 10;
    pub const MISSED_PIXELS: usize = 11;
    pub const UNIFORM_MISSED_PIXELS: usize = 12;
    pub const GAPS_FILLED: usize = 13;
    pub const UNFOLDED: usize = 14;
    pub const SNAPPED: usize = 15;
    pub const QUADS: usize = 16;
}

pub type ReconstructReport = Sized<19>;

/// Places of the figures of [`ReconstructReport`].
#[allow(dead_code, reason = "tests look at some")]
pub mod reconstruct_report {
    pub const POINTS: usize = 0;
    pub const USED: usize = 1;
    pub const TETRAHEDRA: usize = 2;
    pub const CLOSED: usize = 3;
    pub const THRESHOLD: usize = 4;
    pub const ROUNDS: usize = 5;
    pub const REPAIRED: usize = 6;
    pub const GATHERED: usize = 7;
    pub const CUT_FACETS: usize = 8;
    pub const TURNED_PARTS: usize = 9;
    pub const NOT_FINITE: usize = 10;
    pub const DUPLICATES: usize = 11;
    pub const INSIDE: usize = 12;
    pub const OUTSIDE: usize = 13;
    pub const NOISE: usize = 14;
    pub const SPACING: usize = 15;
    pub const SMOOTHING: usize = 16;
    pub const MOVED: usize = 17;
    pub const OUTLIERS: usize = 18;
}

pub type ClusterReport = Sized<18>;

/// Places of the figures of [`ClusterReport`].
#[allow(dead_code, reason = "tests look at some")]
pub mod cluster_report {
    pub const PATCHES: usize = 0;
    pub const VERTICES: usize = 1;
    pub const TRIANGLES: usize = 2;
    pub const SEPARATED: usize = 3;
    pub const DISSOLVED: usize = 4;
    pub const HALVED: usize = 5;
    pub const CUT_EDGES: usize = 6;
    pub const OFF_SURFACE: usize = 7;
    pub const ENERGY: usize = 8;
    pub const BEFORE_MEAN_SMALLEST_ANGLE: usize = 9;
    pub const BEFORE_SMALLEST_ANGLE: usize = 10;
    pub const BEFORE_LARGEST_ANGLE: usize = 11;
    pub const AFTER_MEAN_SMALLEST_ANGLE: usize = 12;
    pub const AFTER_SMALLEST_ANGLE: usize = 13;
    pub const AFTER_LARGEST_ANGLE: usize = 14;
    pub const MAX_ERROR: usize = 15;
    pub const KEPT_INPUT: usize = 16;
    pub const RMS_ERROR: usize = 17;
}

pub type CloseReport = Sized<21>;

/// Places of the figures of [`CloseReport`].
#[allow(dead_code, reason = "tests look at some")]
pub mod close_report {
    pub const CELL: usize = 0;
    pub const FILL_CELL: usize = 1;
    pub const MERGE_DISTANCE: usize = 2;
    pub const MAX_HOLE_LENGTH: usize = 3;
    pub const HAS_SIGHT: usize = 4;
    pub const CLOSED: usize = 5;
    pub const LEFT_NOT_ASKED: usize = 6;
    pub const LEFT_TOO_LONG: usize = 7;
    pub const LEFT_NOT_ENCLOSED: usize = 8;
    pub const LEFT_SEEN_THROUGH: usize = 9;
    pub const LEFT_CROSSING: usize = 10;
    pub const LEFT_BASE: usize = 11;
    pub const LEFT_INSIDE_OUT: usize = 12;
    pub const LARGEST_OPENING: usize = 13;
    pub const ADDED_VERTICES: usize = 14;
    pub const ADDED_TRIANGLES: usize = 15;
    pub const FILLED_AREA: usize = 16;
    pub const FILLED_SHARE: usize = 17;
    pub const FORCED_TRIANGLES: usize = 18;
    pub const OPEN_EDGES: usize = 19;
    pub const IS_CLOSED: usize = 20;
}

pub type PrintReport = Sized<23>;

/// Places of the figures of [`PrintReport`].
#[allow(dead_code, reason = "tests look at some")]
pub mod check_print_report {
    pub const IS_CLOSED: usize = 0;
    pub const IS_MANIFOLD: usize = 1;
    pub const OPENINGS: usize = 2;
    pub const OPEN_EDGES: usize = 3;
    pub const NON_MANIFOLD_EDGES: usize = 4;
    pub const NON_MANIFOLD_VERTICES: usize = 5;
    pub const MISORIENTED_EDGES: usize = 6;
    pub const CROSSING_PAIRS: usize = 7;
    pub const CROSSING_FACES: usize = 8;
    pub const BODIES: usize = 9;
    pub const SIZE_X: usize = 10;
    pub const SIZE_Y: usize = 11;
    pub const SIZE_Z: usize = 12;
    pub const IS_FITTING: usize = 13;
    pub const VOLUME: usize = 14;
    pub const WEIGHT: usize = 15;
    pub const WALL_LIMIT: usize = 16;
    pub const THINNEST_WALL: usize = 17;
    pub const THINNEST_FACE: usize = 18;
    pub const THIN_FACES: usize = 19;
    pub const WALL_SPACING: usize = 20;
    pub const OVERHANG_FACES: usize = 21;
    pub const OVERHANG_AREA: usize = 22;
}

pub type PrepareReport = Sized<22>;

/// Places of the figures of [`PrepareReport`].
#[allow(dead_code, reason = "tests look at some")]
pub mod prepare_print_report {
    pub const SCALE: usize = 0;
    pub const SIZE_X: usize = 1;
    pub const SIZE_Y: usize = 2;
    pub const SIZE_Z: usize = 3;
    pub const VOLUME_BEFORE: usize = 4;
    pub const VOLUME: usize = 5;
    pub const DEVIATION: usize = 6;
    pub const ADDED_FACES: usize = 7;
    pub const BASE_HEIGHT: usize = 8;
    pub const BASE_FACES: usize = 9;
    pub const BASE_AREA: usize = 10;
    pub const WALL_BEFORE: usize = 11;
    pub const WALL_AFTER: usize = 12;
    pub const MOVED_FACES: usize = 13;
    pub const THIN_FACES: usize = 14;
    pub const HOLLOW_CELL: usize = 15;
    pub const THINNEST_WALL: usize = 16;
    pub const THICKEST_WALL: usize = 17;
    pub const SHUT_CAVITIES: usize = 18;
    pub const DRAIN_ROOM: usize = 19;
    pub const IS_DRAINED: usize = 20;
    pub const PARTS: usize = 21;
}

pub type UnwrapReport = Sized<10>;

/// Places of the figures of [`UnwrapReport`].
#[allow(dead_code, reason = "tests look at some")]
pub mod unwrap_report {
    pub const CHARTS: usize = 0;
    pub const CHARTS_BEFORE: usize = 1;
    pub const TILES: usize = 2;
    pub const USED: usize = 3;
    pub const TEXELS_PER_UNIT: usize = 4;
    pub const STRETCH: usize = 5;
    pub const STRETCH_P95: usize = 6;
    pub const COLLAPSED: usize = 7;
    pub const COLLAPSED_AREA: usize = 8;
    pub const MOVED: usize = 9;
}

pub type TexturedPhoto = Sized<5>;

/// Places of the figures of [`TexturedPhoto`].
#[allow(dead_code, reason = "tests look at some")]
pub mod textured_photo {
    pub const TEXELS: usize = 0;
    pub const GAIN: usize = 1;
    pub const MOVED: usize = 4;
}

pub type TextureReport = Sized<8>;

/// Places of the figures of [`TextureReport`].
#[allow(dead_code, reason = "tests look at some")]
pub mod texture_report {
    pub const TILES: usize = 0;
    pub const TEXELS: usize = 1;
    pub const SEEN: usize = 2;
    pub const PHOTOS_COUNT: usize = 3;
    pub const DIFFERENCE_BEFORE: usize = 4;
    pub const DIFFERENCE_AFTER: usize = 5;
    pub const LOWEST: usize = 6;
    pub const HIGHEST: usize = 7;
}

pub type CheckReport = Sized<20>;

/// Places of the figures of [`CheckReport`].
#[allow(dead_code, reason = "tests look at some")]
pub mod check_report {
    pub const TRIANGLES: usize = 0;
    pub const VERTICES: usize = 1;
    pub const UNUSED_VERTICES: usize = 2;
    pub const NON_FINITE_VERTICES: usize = 3;
    pub const OUT_OF_RANGE_TRIANGLES: usize = 4;
    pub const DEGENERATE_TRIANGLES: usize = 5;
    pub const ZERO_AREA_TRIANGLES: usize = 6;
    pub const DUPLICATE_TRIANGLES: usize = 7;
    pub const EDGES: usize = 8;
    pub const BOUNDARY_EDGES: usize = 9;
    pub const NON_MANIFOLD_EDGES: usize = 10;
    pub const MISORIENTED_EDGES: usize = 11;
    pub const NON_MANIFOLD_VERTICES: usize = 12;
    pub const COMPONENTS: usize = 13;
    pub const LARGEST_COMPONENT: usize = 14;
    pub const BOUNDARY_LOOPS: usize = 15;
    pub const EULER_CHARACTERISTIC: usize = 16;
    pub const IS_MANIFOLD: usize = 17;
    pub const IS_CLOSED: usize = 18;
    pub const GENUS: usize = 19;
}

pub type Snap = Sized<66>;

/// Places of the figures of [`Snap`].
#[allow(dead_code, reason = "tests look at some")]
pub mod snap_report {
    pub const WORLD_FROM_SCAN: usize = 0;
    pub const STATE: usize = 16;
    pub const TOUCHES_COUNT: usize = 17;
    pub const OVERLAP: usize = 18;
    pub const RESIDUAL: usize = 19;
    pub const BALANCE: usize = 20;
    pub const SEEN_THROUGH: usize = 21;
    pub const MOVED: usize = 22;
    pub const FREEDOMS_COUNT: usize = 23;
    pub const FREEDOMS: usize = 24;
}

pub type DistanceReport = Sized<9>;

/// Places of the figures of [`DistanceReport`].
#[allow(dead_code, reason = "tests look at some")]
pub mod distance_report {
    pub const COUNT: usize = 0;
    pub const MEAN: usize = 1;
    pub const RMS: usize = 2;
    pub const P95: usize = 3;
    pub const MAX: usize = 4;
    pub const BIAS: usize = 5;
    pub const WORST: usize = 6;
    pub const REACHED: usize = 7;
    pub const BOUND: usize = 8;
}

pub type LeftOutReport = Sized<5>;

/// Places of the figures of [`LeftOutReport`].
#[allow(dead_code, reason = "tests look at some")]
pub mod left_out_report {
    pub const OF: usize = 0;
    pub const LOW_CONFIDENCE: usize = 1;
    pub const OUT_OF_REACH: usize = 2;
    pub const BLACK_RIM: usize = 3;
    pub const FAR: usize = 4;
}
