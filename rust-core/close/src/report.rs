//! Report of closing, with the openings that it left.

use base::progress::Seconds;
use mesh::TriMesh;

/// Reasons why an opening was left open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LeftOpen {
    /// No opening was to be closed.
    NotAsked,
    /// Its boundary is longer than the longest hole.
    TooLong,
    /// Seen space does not surround what lies before it: a rim, or a border of what was scanned.
    NotEnclosed,
    /// A scan saw through where it would be closed.
    SeenThrough,
    /// Any fill would cross the surface.
    Crossing,
}

impl LeftOpen {
    /// It in words.
    pub const fn words(self) -> &'static str {
        match self {
            LeftOpen::NotAsked => "openings stay as they are",
            LeftOpen::TooLong => "its boundary is longer than the longest hole",
            LeftOpen::NotEnclosed => "no scan saw round it, so that it may be a rim or the end of what was scanned",
            LeftOpen::SeenThrough => "a scan saw through where it would be closed",
            LeftOpen::Crossing => "whatever would close it crosses the surface",
        }
    }
}

/// An opening: boundary loops that one fill joins.
#[derive(Clone, Debug, PartialEq)]
pub struct OpeningReport {
    /// Of each of its loops the vertex of the smallest number, rising.
    pub vertices: Vec<u32>,
    /// Edges of its loops.
    pub edges: usize,
    /// Sum of their lengths.
    pub length: f64,
    /// Area that was filled.
    pub area: f64,
    /// Reason why it, or a part of it, was left open. `None` if it is closed.
    pub left_open: Option<LeftOpen>,
    /// Faces that were filled where a scan saw through, as `force` asked for.
    pub forced_faces: usize,
}

/// The figures of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CloseReport {
    /// Size of a cell used, world units. The fill has twice that size, more where memory asks for it.
    pub cell: f64,
    /// Size of a cell of the fill.
    pub fill_cell: f64,
    /// Merge distance used, world units.
    pub merge_distance: f64,
    /// Longest hole used, world units. Infinite if length does not matter.
    pub max_hole_length: f64,
    /// Whether scans said where nothing is. Without, openings are closed by their shape alone.
    pub has_sight: bool,
    /// All openings, in the order of their smallest vertices.
    pub openings: Vec<OpeningReport>,
    /// Vertices and faces that were added.
    pub added: [usize; 2],
    /// Area of the faces that were added, and of the surface before.
    pub areas: [f64; 2],
    /// Length of the longest boundary of an opening that was closed.
    pub largest_opening: f64,
    /// Open edges that are left.
    pub open_edges: usize,
    /// Whether the result is a closed manifold, by [`mesh::check()`].
    pub is_closed: bool,
    /// Names of the stages with their wall-clock seconds.
    pub seconds: Seconds,
}

impl CloseReport {
    /// Openings that were closed.
    pub fn closed(&self) -> impl Iterator<Item = &OpeningReport> {
        self.openings.iter().filter(|opening| opening.left_open.is_none())
    }

    /// Openings that stay open, wholly or in part, with the reason.
    pub fn left_open(&self) -> impl Iterator<Item = (&OpeningReport, LeftOpen)> {
        self.openings.iter().filter_map(|opening| Some((opening, opening.left_open?)))
    }
}

/// Result of closing.
#[derive(Clone, Debug, PartialEq)]
pub struct Closed {
    /// The measured surface, to the bit, then the fill. `interpolated` marks filled vertices, `hole_fill` filled faces, `forced` those that
    /// were filled where a scan saw through.
    pub mesh: TriMesh,
    /// Figures of the run.
    pub report: CloseReport,
}
