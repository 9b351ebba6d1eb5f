//! Names and texts for hosts, of the operation.

use base::operation::{DataKind, Operation};
use base::report::Report as _;

/// The declaration of the operation. No host but the languages has it yet.
pub const OPERATION: Operation = Operation {
    name: "texture",
    text: "Makes the images of a mesh with texture coordinates, from photos and from the detailed surface that it stands for.",
    since: "0.2",
    takes: &[DataKind::Mesh],
    gives: &[DataKind::Textures],
    params: Some(crate::params::SCHEMA),
    report: &[crate::report::TextureReport::SCHEMA],
    command: None,
    blender: None,
    meshlab: None,
};
