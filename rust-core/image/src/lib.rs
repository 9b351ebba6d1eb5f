//! Range images, their triangulation, and the scans that a merge reads.

pub mod oriented;
pub mod range_image;
pub mod rigid;
pub mod sight;
pub mod source;
pub mod triangulate;

pub use range_image::RangeImage;
