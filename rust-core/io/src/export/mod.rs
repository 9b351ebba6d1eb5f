//! Writing results: meshes, points, range grids and the lists that place scans.
//!
//! | file | what |
//! |---|---|
//! | `ply` | meshes, points and Stanford range grids, text or binary |
//! | `conf` | VRIP's lists of placed scans |
//! | `poses` | MeshLab's and TUM's |
//! | `glb` | binary glTF: meshes with colours and custom attributes |
//! | `images`, `jpeg` | images of a mesh as PNG and JPEG files |
//! | `tiles` | a mesh by the tiles of its images |
//! | `three_mf` | 3MF: meshes with their unit and colours, for printing |
//! | `obj`, `stl` | meshes for programs that read nothing else |
//! | `mtl` | OBJ with materials and images beside it |
//! | `by_ending` | any of these by the ending of the file's name |
//! | `scans` | PTX and E57: range images seen from a point |
//! | `import::registry` | content of formats, and their endings |
//! | `crs` | coordinate reference systems that files can't tell |
//! | `provenance` | provenance that results tell |
//! | `archive` | zip archives, for 3MF |
//! | `atomic` | every file appears whole or not at all |
//! | `temporary`, `crate::memory_folder` | the file until then, and files that killed writers have left |
//! | `names` | names that Windows calls no file |

mod archive;
pub(crate) mod atomic;
mod by_ending;
mod conf;
mod crs;
#[cfg(test)]
pub(crate) mod faults;
mod glb;
mod images;
pub(crate) mod jpeg;
mod mtl;
mod names;
mod obj;
mod operation;
mod ply;
mod poses;
mod provenance;
mod scans;
#[cfg(test)]
mod sheet;
mod stl;
mod temporary;
mod three_mf;
mod tiles;

pub use crate::import::registry::{Holding, ending_for, written_endings};
pub use by_ending::{
    Encoding, SCHEMA, WriteOptions, check_file_in_pieces, check_mesh_file, write_mesh, write_mesh_in_pieces,
    write_textured_mesh,
};
pub use conf::{PlacedFile, write_conf, write_scan_list};
pub use crs::{crs_note, tell_left_out};
pub use glb::{GlbNode, GlbOptions, Up, write_glb};
pub use images::{ImageFormat, ImageOptions};
pub use mtl::write_textured_obj;
pub use obj::{Polygons, write_obj, write_obj_polygons};
pub use operation::OPERATION;
pub use ply::{
    PlyEncoding, PlyOptions, PositionType, part_path, range_grid_frame, write_ply, write_ply_in_pieces,
    write_points_ply, write_quads_ply, write_range_grid_ply,
};
pub use poses::{PlacedScan, write_poses, write_trajectory};
pub(crate) use provenance::{CRS_COMMENT, CRS_EXTRA};
pub use provenance::{E57_NAMESPACE, LONGEST, Provenance};
pub use scans::{write_e57, write_ptx};
pub use stl::write_stl;
pub use three_mf::write_3mf;
