//! Names and texts for hosts, of the operation.

use base::operation::{Command, DataKind, Filter, Operation, Operator};
use base::report::Report as _;

/// The declaration of the operation.
pub const OPERATION: Operation = Operation {
    name: "quads",
    text: "Makes a regular grid of quads of a range image, dense where the surface bends.",
    since: "0.1",
    takes: &[DataKind::Image],
    gives: &[DataKind::Quads],
    params: Some(crate::params::SCHEMA),
    report: &[crate::report::QuadReport::SCHEMA],
    command: Some(Command {
        name: "quads",
        files: "SCAN",
        summary: "a range image to a regular grid of quads",
        text: "Makes a regular grid of quads of one range image, dense where the surface bends.",
    }),
    blender: Some(Operator {
        id: "quads",
        label: "Quad Grid",
        text: "Make a regular grid of quads of the active scan, dense where the surface bends",
    }),
    meshlab: Some(Filter {
        label: "Surface Reconstruction: Adaptive Quad Grid",
        id: "generate_surface_reconstruction_adaptive_quad_grid",
        text: "Turns the <b>range image</b> in the current layer into a regular grid of quads that is dense where the \
               surface bends. Its mean error is at most that of the uniform grid of the same size, and both are returned. \
               Quads over missing samples are left out. Texture coordinates are those of the image.<br>On request another \
               layer gets the tensor-product B-spline surface through the grid.<br>The layer must know its grid: import \
               it with <i>Import Range Images</i>. It is not changed.<br><br>See:<br><i>M. A. Garcia, A. D. Sappa, L. \
               Basanez</i><br><b>\"Fast generation of adaptive quadrilateral meshes from range images\"</b><br>IEEE \
               International Conference on Robotics and Automation, 1997",
        menus: &["RangeMap", "Remeshing", "Polygonal"],
        layers: "SINGLE_MESH",
    }),
};
