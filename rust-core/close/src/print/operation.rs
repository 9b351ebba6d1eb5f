//! Names and texts for hosts, of the operation.

use base::operation::{Command, DataKind, Filter, Operation, Operator};
use base::report::Report as _;

/// The declaration of the operation.
pub const OPERATION: Operation = Operation {
    name: "check_print",
    text: "Checks whether a mesh can be printed, and says what is in the way.",
    since: "0.2",
    takes: &[DataKind::Mesh],
    gives: &[DataKind::Mesh],
    params: Some(super::params::SCHEMA),
    report: &[super::report::PrintReport::SCHEMA],
    command: Some(Command {
        name: "check",
        files: "MESH",
        summary: "whether a mesh can be printed",
        text: "Checks a mesh before it is printed in 3D: closed, manifold, no crossing faces, walls, overhangs, size. Each finding is a \
               line with its remedy. The file that is written has the mesh with the face attributes wall, crossing and overhang.",
    }),
    blender: Some(Operator {
        id: "check_print",
        label: "Check for Printing",
        text: "Check whether the active mesh can be printed: openings, crossing faces, thin walls, overhangs and size",
    }),
    meshlab: Some(Filter {
        label: "Check for Printing",
        id: "compute_scalar_by_print_check_per_face",
        text: "Checks whether the current layer can be printed in 3D: closed, manifold, no crossing faces, walls, overhangs, size. \
               Nothing is repaired. <b>Faces that cross another or hang over are selected. The quality of each face is the thickness of \
               the wall behind it</b>, at most <i>Max wall</i>.<br>The log has the figures.",
        menus: &["Quality", "Selection"],
        layers: "SINGLE_MESH",
    }),
};
