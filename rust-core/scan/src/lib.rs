//! The virtual range scanner: mesh + camera -> range image whose truth is known.
//!
//! | file | what |
//! |---|---|
//! | `params` | the errors that a scanner makes |
//! | `camera` | place of a scanner, and how its pixels see; rings of cameras |
//! | `rays` | the rays of a camera's pixels, in tiles that run close together |
//! | `noise` | errors of a real scanner: noise, steps, dropouts, a wrong pose |
//! | `driver` | the image: rays through all pixels, and what is reported of their hits |
//! | `shapes` | meshes to scan whose distances are known exactly |
//! | `sculpture` | the rich shape of the demo: a serpent around a column |

mod operation;
mod params;

mod camera;
mod noise;
mod rays;

mod driver;

pub mod sculpture;

pub use camera::{TurntableViews, VirtualCamera, turntable};
pub use driver::scan;
pub use mesh::measure::bounds;
pub use mesh::shapes;
pub use operation::OPERATION;
pub use params::{SCHEMA, ScanParams};

/// The former name of [`VirtualCamera`].
#[deprecated(since = "0.2.0", note = "it is called `VirtualCamera`")]
pub type Camera = VirtualCamera;

/// The former name of [`TurntableViews`].
#[deprecated(since = "0.2.0", note = "it is called `TurntableViews`")]
pub type Turntable = TurntableViews;

#[cfg(test)]
mod tests;
