//! Texturing: a light mesh with texture coordinates, the detailed surface it stands for and photos of it -> images.
//!
//! | stage | file | in -> out |
//! |---|---|---|
//! | 1 | `image::photo`, `target` | photos, mesh -> both checked, photos in the order of their names |
//! | 2 | `samples` | mesh -> places all over the surface, to compare photos at |
//! | 3 | `gains` | photos -> what each one's light is multiplied by |
//! | 4 | `poses` | cameras -> cameras under which the photos agree |
//! | 5 | `atlas` | mesh -> texels, tile by tile |
//! | 6 | `behind` | texels -> places on the detailed surface |
//! | 7 | `view`, `light`, `blend` | places, photos one after the other -> colours |
//! | 8 | `fill` | colours -> colours everywhere |
//! | | `relief`, `occlusion` | texels, places -> normal map, height map, ambient occlusion |
//!
//! No cage is needed: the place behind a texel is the closest point that faces the same way. Photos are not kept: while one is
//! looked at, memory holds it and the texels of one tile.

mod operation;
mod params;
mod report;

// Values of the mask that comes with a texture
pub mod mask;

// 1. the input
mod target;

// 2. to 4. photos that agree
mod gains;
mod poses;
mod samples;

// 5. to 7. colours
mod atlas;
mod behind;
mod blend;
mod light;
mod view;

// 8. colours everywhere
mod fill;

// Maps of the shape
mod occlusion;
mod relief;

// The stages in their order
mod driver;

pub use driver::run;
#[doc(hidden)]
pub use driver::{PLAN, refuse_colourless};
pub use operation::OPERATION;
pub use params::{SCHEMA, TextureParams};
pub use report::{TextureReport, Textured, TexturedPhoto};

#[cfg(test)]
mod tests;
