//! Geometry that knows no mesh type: arrays of points and triangles in, indices and numbers out.
//!
//! | file | what |
//! |---|---|
//! | `bvh` | bounding volume hierarchy: first hits of rays, closest points |
//! | `neighbours` | nearest neighbours among fixed points |

pub mod bvh;
pub mod neighbours;
