//! Names and texts for hosts, of the operation.

use base::operation::{Command, DataKind, Filter, Operation, Operator};
use base::report::Report as _;

/// The declaration of the operation.
pub const OPERATION: Operation = Operation {
    name: "prepare_print",
    text: "Makes a closed mesh ready for printing: its size, a flat base, thicker walls, a cavity with a drain, parts.",
    since: "0.2",
    takes: &[DataKind::Mesh],
    gives: &[DataKind::Mesh],
    params: Some(crate::params::SCHEMA),
    report: &[crate::report::PrepareReport::SCHEMA],
    command: Some(Command {
        name: "prepare",
        files: "MESH",
        summary: "a closed mesh to one that a printer makes",
        text: "Makes a closed mesh ready for printing, by the steps that are asked for, in this order: its size, a flat base, thicker walls, \
               a cavity, a drain, parts that the printer holds. Each result is closed, and no faces cross. Each part becomes a file: \
               three parts of statue.stl are statue.stl, statue-2-of-3.stl and statue-3-of-3.stl.",
    }),
    blender: Some(Operator {
        id: "prepare_print",
        label: "Prepare for Printing",
        text: "Make the closed active mesh ready for printing: size, flat base, thicker walls, cavity with a drain, parts",
    }),
    meshlab: Some(Filter {
        label: "Prepare for Printing",
        id: "meshing_prepare_for_printing",
        text: "Makes the closed current layer ready for printing in 3D, by the steps that are asked for, in this order: its size, a flat \
               base, thicker walls, a cavity, a drain, parts that the printer holds. The result is a new layer, or one for each part. It is \
               closed, and no faces cross. <b>Faces that were added are selected.</b><br>The log has the figures.",
        menus: &["Remeshing"],
        layers: "SINGLE_MESH",
    }),
};
