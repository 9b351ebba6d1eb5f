//! Stages 5 to 7: the surface from the labels of the nodes, block by block, and what is put together of the blocks. \[MI04, sec. 3.4\]

pub mod anomalies;
pub mod artificial;
pub mod extract;
pub mod numbering;
pub mod parts;
pub mod passes;
pub mod pinches;
pub mod table;
pub mod tile;
pub mod tiles;
pub mod whole;
