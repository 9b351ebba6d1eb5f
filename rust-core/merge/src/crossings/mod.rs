//! Crossings of scans with the lines of the grid, how they are kept, and what they come to by edge. \[MI04, sec. 3.1 and 3.2\]

pub mod bundles;
pub mod crossing;
pub mod discretize;
pub mod edge_colours;
pub mod edge_sums;
pub mod fine_details;
pub mod lattice;
pub mod lines;
pub mod scan_order;
