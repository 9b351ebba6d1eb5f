//! Range images: a grid of pixels, each valid or not, each with a viewing ray.
//!
//! | file | what |
//! |---|---|
//! | `projection` | pixel -> point and ray, for every kind of sensor |
//! | `pixels` | the image itself |
//! | `samples` | the valid pixels in compact form, with their neighbours |
//! | `spacing` | sample spacing of an image, and the edge limit that comes from it |
//! | `normals` | normals from the grid, oriented toward the sensor |
//! | `curvature` | second difference of the range |
//! | `confidence` | cosine to the ray, ramped to zero at jumps and borders \[CL96\] |
//! | `cloud` | the samples as points |
//! | `attributes` | attributes of pixels besides their samples, as attributes of the vertices they become |
//! | `steps` | steps that depths are multiples of |
//! | `noise` | standard deviation of the noise, from the data alone |
//! | `smooth` | noise taken out along the rays |
//! | `repeats` | images that were enlarged by repeating pixels, in their own size |
//! | `far` | values that stand for nothing, left out |

mod pixels;

pub mod projection;

pub mod samples;

pub mod spacing;

mod steps;

pub mod normals;

pub mod curvature;

pub mod confidence;

mod attributes;

mod cloud;

pub mod noise;

pub mod pitch;

pub mod far;

pub mod repeats;

pub(crate) mod blocks;

pub mod smooth;

#[cfg(any(test, feature = "test-images"))]
pub mod test_images;

pub use pixels::{RangeImage, Samples, is_rigid};
pub use projection::{DepthKind, Projection, Viewing};
