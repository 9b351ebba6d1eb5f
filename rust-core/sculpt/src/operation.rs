//! Names and texts for hosts, of the operation.

use base::operation::{Command, DataKind, Filter, Operation, Operator};
use base::report::Report as _;

/// The declaration of the operation.
pub const OPERATION: Operation = Operation {
    name: "sculpt",
    text: "Makes a mesh of few triangles of a range image, within a tolerance of every sample.",
    since: "0.1",
    takes: &[DataKind::Image],
    gives: &[DataKind::Mesh],
    params: Some(crate::params::SCHEMA),
    report: &[crate::report::SculptReport::SCHEMA, crate::certify::Certificate::SCHEMA],
    command: Some(Command {
        name: "sculpt",
        files: "SCAN",
        summary: "a range image to few triangles within a tolerance",
        text: "Makes a mesh of few triangles of one range image, which stays within a tolerance of every sample.",
    }),
    blender: Some(Operator {
        id: "sculpt",
        label: "Sculpt Scan",
        text: "Simplify the active scan to a mesh of few triangles that stays within a tolerance of every sample",
    }),
    meshlab: Some(Filter {
        label: "Surface Reconstruction: Range Image Sculpting",
        id: "generate_surface_reconstruction_range_image_sculpting",
        text: "Approximates the <b>range image</b> in the current layer by a mesh of few triangles in which every sample \
               lies within the tolerance, along the ray it was measured by. Jumps and missing samples stay open. The \
               error is measured on the result and returned. The quality of each vertex is the error around it.<br>The \
               layer must know its grid: import it with <i>Import Range Images</i>. It is not \
               changed.<br><br>See:<br><i>A. D. Sappa, M. A. Garcia</i><br><b>\"Coarse-to-fine approximation of range \
               images with bounded error adaptive triangular meshes\"</b><br>Journal of Electronic Imaging 16(2), 2007",
        menus: &["RangeMap", "Remeshing"],
        layers: "SINGLE_MESH",
    }),
};
