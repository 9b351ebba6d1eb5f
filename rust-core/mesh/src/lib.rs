//! Triangle and quad meshes with attributes, and the independent checks and measures on them.
//!
//! | file | what |
//! |---|---|
//! | `tri_mesh` | triangle meshes and their attributes |
//! | `connected` | parts of meshes |
//! | `crs` | coordinate reference systems of surveys, by name |
//! | `check` | manifold, oriented, finite, no degenerate or duplicate triangle; components, boundary loops, genus |
//! | `holes/` | boundary loops closed |
//! | `quads` | meshes of quads |
//! | `sink` | meshes that are handed over piece by piece |
//! | `extent` | extent of coordinates, and their precision |
//! | `certify` | a bound that holds everywhere between two surfaces |
//! | `normals` | normals of triangles and vertices |
//! | `point_cloud` | points without connectivity |
//! | `shapes` | meshes of analytic shapes |
//! | `measure/` | exact distances of points to a mesh; areas, angles, volume |
//! | `srgb` | colours as light, and means of them |
//! | `texture` | texture coordinates of vertices |
//! | `images` | images on a mesh with texture coordinates |
//! | `tangents` | tangents of corners, for normal maps |
//! | `dump` | stages of operations as files, for those who work on them |

pub mod certify;
pub mod check;
pub mod connected;
pub mod crs;
pub mod dump;
pub mod extent;
#[doc(hidden)]
pub mod holes;
pub mod images;
pub mod measure;
pub mod normals;
pub mod point_cloud;
pub mod quads;
pub mod shapes;
pub mod sink;
pub mod srgb;
pub mod tangents;
pub mod texture;
mod tri_mesh;

pub use check::{
    CheckReport, OPERATION as CHECK_OPERATION, check, check_welded, first_fault, try_check, try_check_welded,
};
pub use crs::Crs;
pub use extent::Extent;
pub use images::{Tile, TileImages};
pub use point_cloud::PointCloud;
pub use quads::QuadMesh;
pub use tri_mesh::{Attribute, AttributeData, TriMesh};

/// The former name of [`CheckReport`].
#[deprecated(since = "0.2.0", note = "called CheckReport")]
pub type MeshReport = CheckReport;
