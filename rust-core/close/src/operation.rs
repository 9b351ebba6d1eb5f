//! Names and texts for hosts, of the operation.

use base::operation::{Command, DataKind, Filter, Operation, Operator};
use base::report::Report as _;

/// The declaration of the operation.
pub const OPERATION: Operation = Operation {
    name: "close",
    text: "Closes the openings of a surface with a smooth fill that stays out of what scans saw to be empty.",
    since: "0.2",
    takes: &[DataKind::Mesh, DataKind::Scans],
    gives: &[DataKind::Mesh],
    params: Some(crate::params::SCHEMA),
    report: &[crate::report::CloseReport::SCHEMA],
    command: Some(Command {
        name: "close",
        files: "MESH [SCANS...]",
        summary: "a surface with openings to a closed one, which keeps out of what scans saw to be empty",
        text: "Closes the openings of a surface. The range images that it was merged of say where nothing is: nothing is filled there. \
               Meshes and points say nothing. Without range images the shape of the surface alone decides.",
    }),
    blender: Some(Operator {
        id: "close_surface",
        label: "Close Surface",
        text: "Close the openings of the active surface with a smooth fill that stays out of what its scans saw to be empty",
    }),
    meshlab: Some(Filter {
        label: "Remeshing: Close Surface",
        id: "meshing_close_surface",
        text: "Closes the openings of the surface in the current layer, into a new layer. The fill continues the surface \
               smoothly, and crosses nothing. Vertices of the surface stay as they are. <b>The filled faces are \
               selected</b>.<br>The other visible layers that are range images are taken for its scans. Nothing is filled \
               where one of them saw through. Import them with <i>Import Range Images</i>. Without such layers nothing says \
               where space is empty, and the shape of the surface alone decides.<br>The log says how many openings stay open, \
               by reason.",
        menus: &["Remeshing"],
        layers: "SINGLE_MESH",
    }),
};
