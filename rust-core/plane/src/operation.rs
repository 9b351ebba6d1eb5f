//! Names and texts for hosts, of the operation.

use base::operation::{DataKind, Filter, Operation, Operator};

/// The declaration of the operation.
pub const OPERATION: Operation = Operation {
    name: "plane",
    text: "Finds the plane that most samples of scans lie on: a table, or the ground.",
    since: "0.1",
    takes: &[DataKind::Scans],
    gives: &[DataKind::Plane],
    params: Some(crate::SCHEMA),
    report: &[],
    command: None,
    blender: Some(Operator {
        id: "remove_background",
        label: "Remove Background",
        text: "Find the plane that the selected scans stand on, a table or the floor, and remove it with what lies below",
    }),
    meshlab: Some(Filter {
        label: "Remove Background",
        id: "meshing_remove_background",
        text: "Finds the plane that most vertices of the <b>visible</b> layers lie on, a table, a turntable or the \
               ground, and removes what lies on it and below. Above is the side that range images see, and the outside of \
               meshes. If no plane stands out, that is said and nothing is changed. The result does not depend on the \
               order of the layers or the number of processors.",
        menus: &["RangeMap", "Cleaning"],
        layers: "VARIABLE",
    }),
};
