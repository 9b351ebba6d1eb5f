//! Geometry that knows no mesh type: arrays of points and triangles in, indices and numbers out.
//!
//! | file | what |
//! |---|---|
//! | `bvh` | bounding volume hierarchy: first hits of rays, closest points |
//! | `delaunay2` | triangulation of points in one plane of space |
//! | `delaunay3` | tetrahedralization of points |
//! | `double_double` | numbers of twice the precision of doubles |
//! | `flow` | largest flows and smallest cuts of networks |
//! | `linear` | small symmetric matrices: systems of equations, eigenvalues |
//! | `neighbours` | nearest neighbours among fixed points |
//! | `predicates` | exact signs of determinants |
//! | `rigid_fit` | the rigid motion between two sets of points |
//! | `span` | whether points span a line, a plane or space |
//! | `triangles` | do two triangles cross |
//! | `wide` | determinants of integers of 62 bits |

pub mod bvh;
pub mod delaunay2;
pub mod delaunay3;
pub mod double_double;
pub mod flow;
pub mod linear;
pub mod neighbours;
pub mod predicates;
pub mod rigid_fit;
pub mod span;
pub mod triangles;
mod wide;
