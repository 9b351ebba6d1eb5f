//! Names and texts for hosts, of the operation.

use base::operation::{Command, DataKind, Filter, Operation, Operator};
use base::report::Report as _;

/// The declaration of the operation.
pub const OPERATION: Operation = Operation {
    name: "merge",
    text: "Merges registered scans into one surface.",
    since: "0.1",
    takes: &[DataKind::Scans],
    gives: &[DataKind::Mesh],
    params: Some(crate::params::SCHEMA),
    report: &[crate::report::MergeReport::SCHEMA],
    command: Some(Command {
        name: "merge",
        files: "SCANS",
        summary: "placed scans to one surface",
        text: "Merges scans that have their poses into one welded surface, with colours and confidence.",
    }),
    blender: Some(Operator {
        id: "merge",
        label: "Merge Scans",
        text: "Merge the selected scans, or any selected oriented meshes, into one new surface",
    }),
    meshlab: Some(Filter {
        label: "Surface Reconstruction: Marching Intersections",
        id: "generate_surface_reconstruction_marching_intersections",
        text: "Merges the <b>visible</b> layers, aligned range images or any oriented meshes, into one welded surface \
               with colour and confidence. Overlaps are fused. Every other vertex stays on a line through \
               the original surface. Boundaries are kept, small holes are closed, and the result does not depend on the \
               order of the layers or the number of processors.<br>Layers are taken where their matrices place them, and \
               are not changed. If memory is short, temporary files hold the rest meanwhile. Limits of \
               edges and of grazing triangles are for range images as they were imported. Faces that were changed stay as \
               they are.<br><br>See:<br><i>C. Rocchini, P. Cignoni, F. Ganovelli, C. Montani, P. Pingi, R. \
               Scopigno</i><br><b>\"The Marching Intersections algorithm for merging range images\"</b><br>The Visual \
               Computer 20, 2004",
        menus: &["RangeMap", "Remeshing"],
        layers: "VARIABLE",
    }),
};
