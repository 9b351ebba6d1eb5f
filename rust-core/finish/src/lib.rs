//! Finishing: a merged surface, with its scans and photos -> a light model with textures, in one or more levels of detail.
//!
//! | step | file | in -> out |
//! |---|---|---|
//! | 1 | `parts` | surface -> without its small parts |
//! | 2 | crate `close` | surface, scans -> closed, if that is asked for: the detailed surface |
//! | 3 | crate `cluster` | detailed surface -> light meshes, with a certified error |
//! | 4 | crate `unwrap` | light mesh -> with texture coordinates |
//! | 5 | crate `texture` | light mesh, detailed surface, photos -> images |

mod params;
mod report;

// 1. what is wanted of the surface
mod parts;

// the steps in their order
mod driver;

pub use driver::finish;
pub use params::{FinishParams, Lightness, SCHEMA};
pub use report::{FinishReport, Finished, FinishedLevel, TexturedLevel};

#[cfg(test)]
mod tests;
