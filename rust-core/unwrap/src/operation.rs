//! Names and texts for hosts, of the operation.

use base::operation::{Command, DataKind, Filter, Operation, Operator};
use base::report::Report as _;

/// The declaration of the operation.
pub const OPERATION: Operation = Operation {
    name: "unwrap",
    text: "Gives a mesh texture coordinates: charts in one tile or several, without flips and without overlaps.",
    since: "0.2",
    takes: &[DataKind::Mesh],
    gives: &[DataKind::Mesh],
    params: Some(crate::params::SCHEMA),
    report: &[crate::report::UnwrapReport::SCHEMA],
    command: Some(Command {
        name: "unwrap",
        files: "MESH",
        summary: "a mesh to the same with texture coordinates",
        text: "Gives a mesh texture coordinates. No triangle is flipped and no two overlap. Files .obj, .glb and .ply hold them.",
    }),
    blender: Some(Operator {
        id: "unwrap",
        label: "Unwrap",
        text: "Give the active mesh a UV map of charts that are packed into tiles, without flips and overlaps",
    }),
    meshlab: Some(Filter {
        label: "Texture: Unwrap",
        id: "compute_texcoord_by_unwrapping_per_wedge",
        text: "Gives the current layer texture coordinates of the corners of its faces: charts that are packed into one tile or \
               several. No face is flipped and no two overlap. Vertices and faces stay as they are.<br>Any faces are welcome: open, \
               closed, of many parts. Edges that do not join two faces of the same orientation become seams.<br>The log has the figures.",
        menus: &["Texture"],
        layers: "SINGLE_MESH",
    }),
};
