//! Stage 4: which nodes are inside, and where the surface passes between them.
//!
//! The crossings of an edge tell the nodes of its line how far from the surface they are, along the normal: a **vote**. A node's label is
//! the sign of the mean of its votes, and between nodes of different labels a vertex lies where that mean, taken as linear, is zero. A vote
//! weighs as much as the sample is trusted, less where it is noisy, and with the square of the normal's component along the line. Over
//! three lines these add up to one. So a crossing of a grazing line, whose place says little, has little to say, and all axes see the same
//! surface. The mean of distances is the least squares surface of independent errors \[CL96\]. Taken at nodes a little to both sides of the
//! surface only, it has no bias.
//!
//! If one clean scan is all that speaks of a node, the crossings of the node's edges label it, as in the paper. If all crossings of clean
//! scans nearby lie in one edge, its vertex is their mean. So a single clean scan is not resampled.

pub mod fuse;
pub mod nodes;
mod smooth;
mod votes;

pub use votes::{BrickLabels, BrickVertices, Bundles, Labels, Plane, Vertex, Vertices, VoteRule};
