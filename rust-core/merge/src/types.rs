//! What a merge is asked for, and what it gives.

use base::error::counted;
use base::log::{self, Level};
use base::params::{flag, length, ratio};
use base::progress::Seconds;
use image::triangulate::TriangulateParams;
use mesh::TriMesh;

base::params! {
    /// How registered scans are merged into one surface. Lengths are in the unit of the scans.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct MergeParams of "merge" with threads {
        /// Size of a cell of the grid. Smaller keeps more detail and costs time and memory with its inverse square.
        voxel: Option<f64> = length("Voxel")
            .from_data("1.5 times the mean distance of neighbouring samples; more where noise, the distance between overlapping scans or the memory there is ask for it").above(0.0),
        /// Surfaces of different scans closer than this, facing the same way, become one. At least a voxel; choose it above the residual of the registration and below the thinnest wall.
        merge_distance: Option<f64> = length("Merge distance")
            .from_data("from the voxel and the measured distance between overlapping scans"),
        /// Holes whose boundary is at most this long are closed.
        max_hole_length: Option<f64> = length("Max hole length")
            .from_data("100 voxels, but at most a fifth of the diagonal of the connected part the hole is in")
            .off("all are left open"),
        /// Connected parts with fewer triangles than this share of the largest part's are dropped. What no scan saw, between layers of badly placed scans or out of their noise, is dropped in any case.
        min_component_share: f64 = ratio("Smallest part (share)").default(0.0).at_most(1.0).off("all are kept that scans are evidence of"),
        /// Colours of scans that overlap are made equally bright before they are averaged: exposure and white balance differ from scan to scan. By up to a factor of eight: what differs more is of different things.
        match_exposure: bool = flag("Match exposure").on().off("colours are averaged as they are").since("0.2"),
        /// How range images are triangulated.
        triangulation: TriangulateParams,
    }
}

base::choices! {
    /// What decided the size of a cell.
    pub enum VoxelReason {
        /// The caller gave it.
        Given = "given" "as given",
        /// 1.5 times the mean distance of neighbouring samples.
        Spacing = "spacing" "1.5 times the spacing of the samples",
        /// Half the median standard deviation of the samples.
        Noise = "noise" "half the noise of the samples",
        /// 1.5 times the median distance between scans that overlap.
        Distance = "distance" "1.5 times the distance between overlapping scans",
        /// Coarser than that, so that it fits into memory: by the limit and the scans alone, or, where there is no limit, by what is free
        /// at that moment.
        Memory = "memory" "coarser, to fit into memory",
    }
}

base::choices! {
    /// What a warning of a merge is about.
    pub enum WarningKind {
        /// No scan has a pose: all are depth images that stand at one place.
        NoPoses = "no_poses" "No poses",
        /// Scans that overlap lie many times their noise, and the distance of their samples, apart.
        Apart = "apart" "Far apart",
        /// Files of scans are damaged: what they held is left out.
        Damaged = "damaged" "Damaged",
    }
}

/// Something that a person should look at before the surface is used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// What it is about.
    pub kind: WarningKind,
    /// What was found, and what to do.
    pub text: String,
}

impl VoxelReason {
    /// It in words.
    pub const fn words(self) -> &'static str {
        Self::CHOICES[self as usize].label
    }
}

/// The figures of a run, among them those of the paper's Tables 1 and 2.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MergeReport {
    /// Scans merged.
    pub scans: usize,
    /// Names of the scans, in their order: the attribute `source_scan` is the place in here, -1 where `interpolated`.
    pub scan_names: Vec<String>,
    /// Triangles of all scans.
    pub input_triangles: u64,
    /// Cell size used, world units.
    pub voxel: f64,
    /// What decided that.
    pub voxel_reason: VoxelReason,
    /// Merge distance used, world units.
    pub merge_distance: f64,
    /// Longest boundary that was closed, world units.
    pub max_hole_length: f64,
    /// Median distance between overlapping scans along grid lines, as measured; `None` where none overlap.
    pub overlap_residual: Option<f64>,
    /// Median standard deviation of the samples along their rays, as measured; 0 where scans are clean.
    pub noise: f64,
    /// Of the range images, the median standard deviation of their samples across the rays, that follows from how noise grows on
    /// surfaces seen at an angle; world units.
    pub noise_across: f64,
    /// Of the range images, the median step that values along the ray are multiples of, world units; 0 for none.
    pub noise_step: f64,
    /// Of the range images, the median number of pixels over which errors depend on each other: 1 for white noise.
    pub noise_correlation: f64,
    /// Cells spanned by the scans along x, y and z.
    pub grid: [u64; 3],
    /// Intersections of scans with grid lines.
    pub intersections: u64,
    /// Edges of the grid whose intersections were dropped: more scans see through there than have a surface there.
    pub seen_through: u64,
    /// Intersections left after fusing.
    pub fused_intersections: u64,
    /// Artificial intersections that became vertices.
    pub artificial_intersections: u64,
    /// Faces made directly (case a), after analysis of the neighbouring cells (case b), by hole filling (case c).
    pub faces: [u64; 3],
    /// Holes closed, and boundary loops left open.
    pub holes: [u64; 2],
    /// Components dropped, those that no scan saw and those of less than `min_component_share`, and the faces they had.
    pub dropped_components: [u64; 2],
    /// What the red, green and blue light of each scan, in the order of `scan_names`, was multiplied by to make all equally bright;
    /// empty where they are, or do not overlap, or differ by more than a factor of eight, or that was not asked for.
    pub colour_gains: Vec<[f64; 3]>,
    /// Largest number of bytes held by intersections and the surface at once.
    pub working_bytes: u64,
    /// Whether stages left in files what they leave for each other.
    pub in_files: bool,
    /// Scans that plainly do not lie where they belong, or that were damaged, and what to do; empty where all is well.
    pub warnings: Vec<Warning>,
    /// Names of the stages with their wall-clock seconds.
    pub seconds: Seconds,
}

impl MergeReport {
    /// Tells the log what a person should look at, or may want to know.
    pub fn tell(&self) {
        // Of damage those who read the files tell.
        let warnings = self.warnings.iter().filter(|warning| warning.kind != WarningKind::Damaged);
        warnings.for_each(|warning| log::tell(Level::Warning, &warning.text));
        let [_, open] = self.holes;
        if open > 0 {
            let loops = counted(open, "open boundary loop", "open boundary loops");
            let text = format!("the merged surface has {loops}; max_hole_length says which close");
            log::tell(Level::Info, &text);
        }
        let [parts, faces] = self.dropped_components;
        if parts > 0 {
            let parts = counted(parts, "part was dropped", "parts were dropped");
            let triangles = counted(faces, "triangle", "triangles");
            let text = format!("{parts}, {triangles}: no scan saw them, or min_component_share says they are small");
            log::tell(Level::Info, &text);
        }
    }
}

/// Result of a merge.
///
/// Vertex attributes: `confidence` (f32, summed over the scans at the vertex), `noise` (f32, standard deviation of the samples
/// along their rays, as measured, 0 where they are clean), `interpolated` (bool: on no scan exactly,
/// artificial or filling a hole), `source_scan` (i32, the scan of largest weight, -1 where interpolated), `colour` if any scan
/// has colours: averaged in linear light; alpha 0 where no scan has one, with the nearest colour of the surface there. Face
/// attribute: `hole_fill` (bool).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Merged {
    /// The surface, in the world.
    pub mesh: TriMesh,
    /// Figures of the run.
    pub report: MergeReport,
}
