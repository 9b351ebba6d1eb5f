//! Report of closing, with the openings that it left.

use base::error::Shown;
use base::progress::Seconds;
use base::report::Remark;
use mesh::TriMesh;

base::choices! {
    /// Reasons why an opening was left open.
    pub enum LeftOpen {
        /// No opening was to be closed.
        NotAsked = "not_asked" "Not asked for",
        /// Its boundary is longer than the longest hole.
        TooLong = "too_long" "Too long",
        /// Seen space does not surround what lies before it: a rim, or a border of what was scanned.
        NotEnclosed = "not_enclosed" "A rim",
        /// A scan saw through where it would be closed.
        SeenThrough = "seen_through" "Seen through",
        /// Any fill would cross the surface.
        Crossing = "crossing" "Would cross the surface",
        /// The flat base cuts through where it would be closed.
        Base = "base" "Cut by the base",
        /// The surface is so thin there that its fill would turn it inside out.
        InsideOut = "inside_out" "Would turn inside out",
    }
}

impl LeftOpen {
    /// The reason with its remedy.
    const fn words(self) -> &'static str {
        match self {
            LeftOpen::NotAsked => "openings are none: choose all, seen or holes",
            LeftOpen::TooLong => "its boundary is longer than max_hole_length: raise that, or choose all",
            LeftOpen::NotEnclosed => "no scan saw round it, so that it may be a rim: choose all to close it",
            LeftOpen::SeenThrough => {
                "a scan saw through where it would be closed: closing with force fills it, and marks that"
            }
            LeftOpen::Crossing => {
                "each fill crosses the surface: give the cell of the merge or a smaller one, or edit the surface there"
            }
            LeftOpen::Base => "the flat base leaves its fill no room: close without it",
            LeftOpen::InsideOut => "its fill would turn the surface inside out: close with a smaller cell",
        }
    }
}

base::choices! {
    /// Doubts about a surface and its scans.
    pub enum Doubt {
        /// A scan does not meet the surface.
        Elsewhere = "elsewhere" "A scan elsewhere",
        /// Scans saw through behind the surface.
        InsideOut = "inside_out" "Seems inside out",
        /// Without scans: the surface looks toward its own middle.
        LooksInward = "looks_inward" "Looks inward",
    }
}

/// A doubt, for a person.
pub type CloseWarning = Remark<Doubt>;

/// An opening that was left open, for a person.
pub type OpenPlace = Remark<LeftOpen>;

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

base::report! {
    /// The figures of closing.
    #[derive(Default)]
    pub struct CloseReport {
        /// Size of a cell of the merge that was used.
        cell: f64 = length("Cell").since("0.2"),
        /// Size of a cell of the fill. It is twice a cell of the merge, more where memory asks for it. 0 if nothing was filled.
        fill_cell: f64 = length("Cell of the fill").since("0.2"),
        /// Merge distance that was used.
        merge_distance: f64 = length("Merge distance").since("0.2"),
        /// Longest boundary that was closed. There is none where length does not matter.
        max_hole_length: Option<f64> = length("Closed up to").optional().since("0.2"),
        /// Whether scans said where nothing is. Without them openings are closed by their shape alone.
        has_sight: bool = flag("Keeps out of seen space").since("0.2"),
        /// Openings closed.
        closed: usize = count("Openings closed").since("0.2"),
        /// Openings left open, wholly or in part, by reason.
        left: [usize; 7] = count("Left open, by reason").parts(&[
            ("left_not_asked", "Openings left open as none was to be closed."),
            ("left_too_long", "Openings left open as their boundaries are longer than the longest hole."),
            ("left_not_enclosed", "Openings left open as they may be rims."),
            ("left_seen_through", "Openings left open as a scan saw through where they would be closed."),
            ("left_crossing", "Openings left open as each fill would cross the surface."),
            ("left_base", "Openings left open as the flat base cuts their fills."),
            ("left_inside_out", "Openings left open as their fills would turn the surface inside out."),
        ]).since("0.2"),
        /// The openings left open, each with its place, its reason and what to do.
        open: Vec<OpenPlace> = warning("Left open", LeftOpen::CHOICES).since("0.2"),
        /// Doubts about the surface and its scans: a surface that seems to be inside out, scans that do not meet it.
        warnings: Vec<CloseWarning> = warning("Warnings", Doubt::CHOICES).since("0.2"),
        /// Length of the longest boundary of an opening that was closed.
        largest_opening: f64 = length("Largest opening closed").since("0.2"),
        /// Vertices and triangles that were added.
        added: [usize; 2] = count("Vertices, triangles added").parts(&[
            ("added_vertices", "Vertices that were added."),
            ("added_triangles", "Triangles that were added."),
        ]).since("0.2"),
        /// Area of the triangles that were added, in the square of the unit of the surface.
        filled_area: f64 = number("Area filled").since("0.2"),
        /// Share of the result's area that was filled.
        filled_share: f64 = ratio("Filled").since("0.2"),
        /// Triangles that were filled where a scan saw through, as was asked for.
        forced_triangles: usize = count("Filled in seen space").since("0.2"),
        /// Edges that are left open.
        open_edges: usize = count("Open edges").since("0.2"),
        /// Whether the result is a closed manifold.
        is_closed: bool = flag("Closed").since("0.2"),
        /// Wall-clock seconds by the name of the stage.
        seconds: Seconds = stages().since("0.2"),
    }
    besides {
        /// All openings, in the order of their smallest vertices.
        openings: Vec<OpeningReport>,
        /// Depth of the base from which on fills have room, if it was less.
        base_room: Option<f64>,
    }
}

impl CloseReport {
    /// Openings that stay open, wholly or in part, with the reason.
    pub fn left_open(&self) -> impl Iterator<Item = (&OpeningReport, LeftOpen)> {
        self.openings.iter().filter_map(|opening| Some((opening, opening.left_open?)))
    }

    /// Sums the openings up, which name vertices of `mesh`.
    pub(crate) fn count_openings(&mut self, mesh: &TriMesh) {
        let closed = || self.openings.iter().filter(|opening| opening.left_open.is_none());
        let largest_opening = closed().map(|opening| opening.length).fold(0.0, f64::max);
        self.closed = closed().count();
        self.largest_opening = largest_opening;
        self.forced_triangles = self.openings.iter().map(|opening| opening.forced_faces).sum();
        let open: Vec<OpenPlace> =
            self.left_open().map(|(opening, kind)| OpenPlace { kind, text: self.told(opening, kind, mesh) }).collect();
        self.left = [0; 7];
        open.iter().for_each(|place| self.left[place.kind as usize] += 1);
        self.open = open;
    }

    /// Place and size of an opening, the reason why it is open, and the remedy.
    fn told(&self, opening: &OpeningReport, reason: LeftOpen, mesh: &TriMesh) -> String {
        let vertex = opening.vertices[0];
        let [x, y, z] = mesh.positions[vertex as usize].to_array().map(|x| Shown::digits(x, 4));
        let length = Shown::digits(opening.length, 3);
        let open = if opening.area > 0.0 { "partly open" } else { "open" };
        let words = match (reason, self.base_room) {
            (LeftOpen::Base, Some(room)) => format!(
                "the flat base leaves its fill no room: close without it, or with a larger base_depth, from {} on",
                Shown::digits(room, 2)
            ),
            _ => reason.words().to_owned(),
        };
        format!("The opening at vertex {vertex}, at ({x}, {y}, {z}), {length} around, is {open}: {words}.")
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
