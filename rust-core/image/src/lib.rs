//! Range images, their triangulation, the scans that a merge reads, the frames that cameras record, and photos.

pub mod frame;
pub mod oriented;
pub mod photo;
pub mod places;
pub mod range_image;
pub mod rigid;
pub mod select;
pub mod source;
pub mod triangulate;
pub mod vertices;
pub mod visibility;

pub use range_image::RangeImage;
