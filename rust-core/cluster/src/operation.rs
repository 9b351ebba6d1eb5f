//! Names and texts for hosts, of the operation.

use base::operation::{Command, DataKind, Filter, Operation, Operator};
use base::report::Report as _;

/// The declaration of the operation.
pub const OPERATION: Operation = Operation {
    name: "cluster",
    text: "Replaces a dense mesh, or points, by a coarse mesh of well-shaped triangles.",
    since: "0.1",
    takes: &[DataKind::Mesh, DataKind::Points],
    gives: &[DataKind::Mesh],
    params: Some(crate::params::SCHEMA),
    report: &[crate::report::ClusterReport::SCHEMA],
    command: Some(Command {
        name: "cluster",
        files: "MESH",
        summary: "a dense mesh, or points, to few well-shaped triangles",
        text: "Replaces a dense mesh by a coarse one of well-shaped triangles, or by a chain of levels of detail.",
    }),
    blender: Some(Operator {
        id: "remesh",
        label: "Remesh",
        text: "Make a coarser mesh of well-shaped triangles from the active surface or points, or a chain of levels of detail",
    }),
    meshlab: Some(Filter {
        label: "Remeshing: Multiresolution Clustering",
        id: "meshing_multiresolution_clustering",
        text: "Replaces the dense surface in the current layer by one of <b>few, well-shaped triangles</b> of any number \
               of vertices, with the same components, holes and genus. Patches of the surface are found by k-means, \
               joined to a mesh, and relaxed on the surface. Of a layer without faces, the surface through its vertices \
               is taken. The layer is not changed.<br>With several <b>levels</b>, a chain of layers from one run. Edges \
               that are not manifold are cut.",
        menus: &["Remeshing"],
        layers: "SINGLE_MESH",
    }),
};
