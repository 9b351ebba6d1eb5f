//! Names and texts for hosts, of reading files.

use base::operation::{DataKind, Filter, Operation, Operator};

/// The declaration of the operation.
pub const OPERATION: Operation = Operation {
    name: "open",
    text: "Opens files of scans, lists of them and recordings.",
    since: "0.1",
    takes: &[DataKind::Files],
    gives: &[DataKind::Scans],
    params: Some(super::options::SCHEMA),
    report: &[],
    command: None,
    blender: Some(Operator {
        id: "import_scans",
        label: "Import Range Scans",
        text: "Import range scans with their grids and poses, one object per scan",
    }),
    meshlab: Some(Filter {
        label: "Import Range Images",
        id: "create_range_images_from_file",
        text: "Opens a file of scans: every scan becomes a layer of its own, placed by its matrix. Range images keep \
               their grid: each vertex knows its row and column, so that the layer can be merged, sculpted and edited as \
               the range image it is. Confidence becomes the quality of the vertices. Colours are kept.<br>A recording of \
               a depth camera or a phone, the file of it or its folder, becomes a layer per frame, of many frames \
               some.<br>Unlike with <i>Import Mesh</i>, all scans of a file come at once, with their poses, and \
               structured PTX, E57 and PCD files become surfaces.",
        menus: &["RangeMap", "MeshCreation"],
        layers: "NONE",
    }),
};
