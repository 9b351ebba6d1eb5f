//! The result of a merge.

use base::error::counted;
use base::log::{self, Level};
use base::progress::Seconds;
use base::report::Remark;
use mesh::TriMesh;

base::choices! {
    /// The rule that decided the size of a cell.
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
    /// Subject of a warning of a merge.
    pub enum WarningKind {
        /// No scan has a pose: all are depth images that stand at one place.
        NoPoses = "no_poses" "No poses",
        /// Scans that overlap lie many times their noise, and the distance of their samples, apart.
        Apart = "apart" "Far apart",
        /// Files of scans are damaged: what they held is left out.
        Damaged = "damaged" "Damaged",
        /// An opening that was to be closed is open.
        Open = "open" "Left open",
    }
}

/// Something that a person should look at before the surface is used.
pub type Warning = Remark<WarningKind>;

base::report! {
    /// The figures of a merge, among them those of the paper's tables.
    #[derive(Default)]
    pub struct MergeReport {
        /// Scans merged.
        scans: usize = count("Scans"),
        /// Names of the scans, in their order, not in that in which they were given. The attribute `source_scan` is the place in here, and
        /// -1 where `interpolated`.
        scan_names: Vec<String> = text("Names of the scans").list(),
        /// Triangles of all scans.
        input_triangles: u64 = count("Their triangles"),
        /// Size of a cell that was used.
        voxel: f64 = length("Voxel"),
        /// Rule that decided the size of a cell.
        voxel_reason: VoxelReason = choice("Chosen as", VoxelReason::CHOICES),
        /// Merge distance that was used.
        merge_distance: f64 = length("Merge distance"),
        /// Longest boundary that was closed.
        max_hole_length: f64 = length("Closed up to"),
        /// Median distance between overlapping scans along grid lines, as measured. There is none where no scans overlap.
        overlap_residual: Option<f64> = length("Scans disagree by").optional(),
        /// Median standard deviation of the samples along their rays, as measured. 0 where scans are clean.
        noise: f64 = length("Noise of the samples"),
        /// Median standard deviation of the samples of range images across the rays. It follows from how noise grows on surfaces seen at an
        /// angle.
        noise_across: f64 = length("Across the rays"),
        /// Median step that values of range images along the ray are multiples of. 0 for none.
        noise_step: f64 = length("In steps of"),
        /// Median number of pixels of range images over which errors depend on each other. 1 for white noise.
        noise_correlation: f64 = number("Shared over"),
        /// Cells that the scans span along x, y and z.
        grid: [u64; 3] = count("Grid").array(3),
        /// Intersections of scans with grid lines.
        intersections: u64 = count("Intersections"),
        /// Edges of the grid whose intersections were dropped since more scans see through there than have a surface there. A triangle has
        /// about one and a half.
        seen_through: u64 = count("Dropped as seen through"),
        /// Intersections left after fusing.
        fused_intersections: u64 = count("Fused intersections"),
        /// Artificial intersections that became vertices.
        artificial_intersections: u64 = count("Artificial intersections"),
        /// Triangles made directly (case a), after analysis of the neighbouring cells (case b), by filling holes (case c).
        faces: [u64; 3] = count("Triangles of case a, b, c").parts(&[
            ("faces_direct", "Triangles made directly (case a)."),
            ("faces_settled", "Triangles made after analysis of the neighbouring cells (case b)."),
            ("faces_filling", "Triangles that fill holes (case c)."),
        ]),
        /// Length of the shortest edge of the surface. It is at least a hundredth of a cell.
        shortest_edge: f64 = length("Shortest edge").since("0.2"),
        /// Holes closed, and boundary loops left open.
        holes: [u64; 2] = count("Holes closed, left").parts(&[
            ("holes_closed", "Holes closed."),
            ("holes_open", "Boundary loops left open."),
        ]),
        /// Holes of these that are open as a scan saw through where they would be closed.
        holes_seen_through: u64 = count("Left open as seen through").since("0.2"),
        /// Area that was filled, in the square of the unit of the scans. There is none where holes alone were closed.
        filled_area: Option<f64> = number("Area filled").optional().since("0.2"),
        /// Share of the area of the surface that was filled. There is none where holes alone were closed.
        filled_share: Option<f64> = ratio("Filled").optional().since("0.2"),
        /// Connected parts dropped, and the triangles they had. These are parts that no scan saw, and those that are too small.
        dropped_components: [u64; 2] = count("Stray parts dropped, triangles").parts(&[
            ("dropped_components", "Connected parts dropped: those that no scan saw, and those that are too small."),
            ("dropped_faces", "Triangles of the parts that were dropped."),
        ]),
        /// Factors that the red, green and blue light of each scan was multiplied by to make all equally bright, in the order of the names.
        /// The list is empty if they are equally bright, do not overlap, differ by more than a factor of eight, or this was not asked for.
        colour_gains: Vec<[f64; 3]> = number("Exposures matched by").list_of(3),
        /// Largest number of bytes that intersections and the surface held at once.
        working_bytes: u64 = bytes("Memory"),
        /// Whether stages left in files what they leave for each other.
        in_files: bool = flag("In files"),
        /// Scans that plainly do not lie where they belong, or that were damaged, and what to do. Empty where all is well.
        warnings: Vec<Warning> = warning("Warnings", WarningKind::CHOICES),
        /// Wall-clock seconds by the name of the stage.
        seconds: Seconds = stages(),
    }
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
            let text = format!("the merged surface has {loops}: close and max_hole_length say which close");
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
/// Vertex attributes: `confidence` (f32, summed over the scans at the vertex), `noise` (f32, standard deviation of the samples along their
/// rays, as measured, 0 where they are clean), `interpolated` (bool: on no scan exactly, artificial or filling a hole), `source_scan` (i32,
/// the scan of largest weight, -1 where interpolated), `colour` if any scan has colours. Colours are averaged in linear light. Alpha is 0
/// where no scan has one, with the nearest colour of the surface there. Face attribute: `hole_fill` (bool).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Merged {
    /// The surface, in the world.
    pub mesh: TriMesh,
    /// Figures of the run.
    pub report: MergeReport,
}
