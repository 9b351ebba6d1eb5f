//! Names and texts for hosts, of the operation.

use base::operation::{DataKind, Operation, Operator};

/// The declaration of the operation.
pub const OPERATION: Operation = Operation {
    name: "scan",
    text: "Makes range images of any mesh, with the errors that a scanner makes.",
    since: "0.1",
    takes: &[DataKind::Mesh],
    gives: &[DataKind::Image],
    params: Some(crate::SCHEMA),
    report: &[],
    command: None,
    blender: Some(Operator {
        id: "virtual_scan",
        label: "Virtual Scan",
        text: "Scan the selected objects with the scene's cameras as a real scanner would, with the noise and gaps asked for",
    }),
    meshlab: None,
};
