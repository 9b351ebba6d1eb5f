//! Names and texts for hosts, of the operation.

use base::operation::{Command, DataKind, Filter, Operation, Operator};
use base::report::Report as _;

/// The declaration of the operation.
pub const OPERATION: Operation = Operation {
    name: "reconstruct",
    text: "Makes a surface through scattered points, closed or open.",
    since: "0.1",
    takes: &[DataKind::Points],
    gives: &[DataKind::Mesh],
    params: Some(crate::params::SCHEMA),
    report: &[crate::report::ReconstructReport::SCHEMA],
    command: Some(Command {
        name: "reconstruct",
        files: "POINTS",
        summary: "a surface through scattered points",
        text: "Makes a surface through scattered points, closed or open. Of a mesh the vertices are taken, of a range \
               image the samples.",
    }),
    blender: Some(Operator {
        id: "reconstruct",
        label: "Surface from Points",
        text: "Make a surface through the vertices or points of the selected objects, whatever faces they have",
    }),
    meshlab: Some(Filter {
        label: "Surface Reconstruction: Delaunay Carving",
        id: "generate_surface_reconstruction_delaunay_carving",
        text: "Makes a surface through the <b>vertices of the current layer</b>, whatever faces it has, over their 3D \
               Delaunay tetrahedralization: closed or open, manifold, through every point the sampling lets it reach. No \
               points are made, and none moved unless they carry noise, which <i>Smoothing</i> is about. Outliers, copies \
               and vertices that are no finite numbers are left out and counted. The custom vertex attribute \
               <i>source_point</i> says which point each vertex was.<br>Of a range image that the import filter made it \
               is known from where it was seen: the surface is turned there, and where it is open it spans no \
               jumps.<br>The layer is not changed.<br><br>See:<br><i>A. Rodríguez, J. M. Espadero, D. López, L. \
               Pastor</i><br><b>\"Delaunay surface reconstruction from scattered points\"</b><br>DGCI 2000, LNCS 1953",
        menus: &["Remeshing"],
        layers: "SINGLE_MESH",
    }),
};
