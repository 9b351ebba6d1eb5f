//! Names and texts for hosts, of writing files.

use base::operation::{DataKind, Operation, Operator};

/// The declaration of the operation.
pub const OPERATION: Operation = Operation {
    name: "write",
    text: "Writes meshes into files.",
    since: "0.1",
    takes: &[DataKind::Mesh],
    gives: &[DataKind::Files],
    params: Some(super::SCHEMA),
    report: &[],
    command: None,
    blender: Some(Operator {
        id: "export_scans",
        label: "Export Range Scans",
        text: "Export the selected range scans with their grids and poses",
    }),
    meshlab: None,
};
