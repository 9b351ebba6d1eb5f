//! The result of preparing a print, and its figures.

use base::progress::Seconds;
use base::report::Remark;
use mesh::{AttributeData, TriMesh};

use super::made::{Made, PART};

base::choices! {
    /// Steps of preparing a print that were not done as they were asked for.
    pub enum PrepareProblem {
        /// The plane of the base lies a hair beside the height that was asked for.
        BaseMoved = "base_moved" "Base moved",
        /// Nothing lies below the base.
        NothingBelow = "nothing_below" "Nothing below the base",
        /// Some walls find no room to become thicker.
        StillThin = "still_thin" "Still thin",
        /// The mesh is nowhere thick enough for a cavity.
        NothingHollow = "nothing_hollow" "Nothing hollow",
        /// A hole of that diameter finds no room.
        NoDrain = "no_drain" "No drain",
        /// Some cavities have no hole.
        ShutCavities = "shut_cavities" "Shut cavities",
        /// The plane between two parts lies a hair beside the place that makes them equal.
        PartMoved = "part_moved" "Part moved",
        /// The side has another length than was asked for.
        SizeMissed = "size_missed" "Size missed",
        /// Some vertices lie closer together than single precision tells apart, as STL and 3MF have it.
        TooFine = "too_fine" "Too fine",
    }
}

/// A step that was not done as it was asked for, for a person.
pub type PrepareNote = Remark<PrepareProblem>;

base::report! {
    /// The figures of preparing a print. Lengths are in the unit of the result.
    #[derive(Default)]
    pub struct PrepareReport {
        /// Steps that were not done as they were asked for, with the reason.
        notes: Vec<PrepareNote> = warning("Notes", PrepareProblem::CHOICES).since("0.2"),
        /// Factor by which the mesh was scaled. 1 if it was not.
        scale: f64 = ratio("Scale").since("0.2"),
        /// Size along x, y and z.
        size: [f64; 3] = length("Size").parts(&[
            ("size_x", "Size along x."),
            ("size_y", "Size along y."),
            ("size_z", "Size along z."),
        ]).since("0.2"),
        /// Volume before all steps, in the cube of the unit of the input.
        volume_before: f64 = number("Volume before").since("0.2"),
        /// Volume of the result.
        volume: f64 = number("Volume").since("0.2"),
        /// Largest distance by which a vertex that was kept moved, but for scaling.
        deviation: f64 = length("Deviation").since("0.2"),
        /// Faces that were added. The attribute added marks them.
        added_faces: usize = count("Added faces").since("0.2"),
        /// Height of the base above the lowest point. There is none if no base was asked for.
        base_height: Option<f64> = length("Height of the base").optional().since("0.2"),
        /// Faces of the base.
        base_faces: usize = count("Faces of the base").since("0.2"),
        /// Area of the base without a hole in it, in the square of the unit.
        base_area: f64 = number("Area of the base").since("0.2"),
        /// Thickness of the thinnest wall before walls were thickened, measured behind the centres of faces. There is none if that was not
        /// asked for, or no wall is thinner than twice that.
        wall_before: Option<f64> = length("Thinnest wall before").optional().since("0.2"),
        /// Thickness of the thinnest wall after that. Faces beside a wall tilt when its sides move apart. So a wall at a sharp edge may be
        /// thinner than the thinnest before.
        wall_after: Option<f64> = length("Thinnest wall after").optional().since("0.2"),
        /// Faces that moved when walls were thickened.
        moved_faces: usize = count("Moved faces").since("0.2"),
        /// Faces of the result whose walls are thinner than asked for. The attribute thin marks them.
        thin_faces: usize = count("Faces with thin walls").since("0.2"),
        /// Cell in which the cavity was made. The walls are as thick as asked for within one.
        hollow_cell: Option<f64> = length("Cell of the cavity").optional().since("0.2"),
        /// Least distance of the cavity from the surface. It is measured at the vertices and the centres of the faces of the cavity. There
        /// is none without a cavity.
        thinnest_wall: Option<f64> = length("Thinnest wall of the cavity").optional().since("0.2"),
        /// Largest distance of the cavity from the surface, measured likewise.
        thickest_wall: Option<f64> = length("Thickest wall of the cavity").optional().since("0.2"),
        /// Cavities that no hole leads into.
        shut_cavities: usize = count("Shut cavities").since("0.2"),
        /// Diameter of the largest hole that would find room. There is none if no drain was asked for.
        drain_room: Option<f64> = length("Room for a drain").optional().since("0.2"),
        /// Whether a hole was made.
        is_drained: bool = flag("Drained").since("0.2"),
        /// Parts that it was cut into. 1 if it was not cut.
        parts: usize = count("Parts").since("0.2"),
        /// Wall-clock seconds by the name of the stage.
        seconds: Seconds = stages().since("0.2"),
    }
}

impl PrepareReport {
    /// Adds a note.
    pub(super) fn note(&mut self, kind: PrepareProblem, text: String) {
        self.notes.push(PrepareNote { kind, text });
    }
}

/// A mesh that is ready for printing.
#[derive(Clone, Debug, PartialEq)]
pub struct PreparedPrint {
    /// The mesh. Its face attribute `added` marks what was made up. If it was cut, `part` has the number of the part of each face.
    pub mesh: TriMesh,
    /// The figures.
    pub report: PrepareReport,
}

impl PreparedPrint {
    /// The parts that the printer holds, each as a mesh. The mesh itself if it was not cut.
    pub fn parts(&self) -> Vec<TriMesh> {
        match self.mesh.face_attribute(PART) {
            Some(_) => (0..self.report.parts).filter_map(|number| part(&self.mesh, number)).collect(),
            None => vec![self.mesh.clone()],
        }
    }
}

/// The faces of a mesh whose attribute `part` has a number, as a mesh with all attributes. `None` if there are none.
pub fn part(mesh: &TriMesh, number: usize) -> Option<TriMesh> {
    let AttributeData::I32(numbers) = mesh.face_attribute(PART)? else { return None };
    let mut made = Made::of(mesh);
    made.retain(|t, _| usize::try_from(numbers[t]) == Ok(number));
    made.compact();
    Some(made.finish(mesh)).filter(|part| !part.triangles.is_empty())
}
