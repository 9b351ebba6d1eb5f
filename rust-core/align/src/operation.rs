//! Names and texts for hosts, of the operation.

use base::operation::{Command, DataKind, Filter, Operation, Operator};
use base::report::Report as _;

/// The declaration of the operation.
pub const OPERATION: Operation = Operation {
    name: "align",
    text: "Finds where scans lie that have no poses, or rough ones.",
    since: "0.1",
    takes: &[DataKind::Scans],
    gives: &[DataKind::Poses],
    params: Some(crate::params::SCHEMA),
    report: &[crate::report::AlignReport::SCHEMA],
    command: Some(Command {
        name: "align",
        files: "SCANS",
        summary: "scans without poses to one frame",
        text: "Finds where scans lie that have no poses, and writes a list that places their files. What could lie in \
               several places, or nowhere, is left out and named with the reason; that is no error.",
    }),
    blender: Some(Operator {
        id: "align",
        label: "Align Scans",
        text: "Move and turn the selected scans to where they fit each other; those with locked location and rotation stay",
    }),
    meshlab: Some(Filter {
        label: "Align Scans",
        id: "compute_matrix_by_scan_alignment",
        text: "Brings the <b>visible</b> layers, range images, oriented meshes or points with normals, to one frame, \
               wherever they lie: what looks alike is found, no starting position is needed. The <b>current</b> layer \
               stays; the others' matrices are set, their vertices are not moved.<br>A layer is placed only where it is \
               sure: where it shares enough with another, is held against turning and sliding, and fits in one place. \
               Others stay where they are, and the log says why and what to do. The result does not depend on the order \
               of the layers or the number of processors.",
        menus: &["RangeMap", "Layer"],
        layers: "VARIABLE",
    }),
};
