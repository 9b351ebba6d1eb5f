//! Adaptive quad grids: one range image -> a regular grid of quads that is dense where the surface bends. \[GSB97\]
//!
//! | stage | file | in -> out |
//! |---|---|---|
//! | 1 | `gaps` | image -> image without single invalid pixels |
//! | 2 | `density` | ranges -> 8-bit curvature -> how much each pixel attracts vertices |
//! | 3 | `tiles` | image -> tiles that share a line of pixels |
//! | 4 | `curves` | density -> vertical curves |
//! | 5 | `rows` | density along curves -> vertices |
//! | 6 | `stitch`, `snap` | vertices -> one grid of pixels without folds, drawn onto the surface's border |
//! | 7 | `measure`, `quad_distance` | grid and image -> errors, and the better diagonal of each quad |
//! | 8 | `place`, `finish`, `grid` | grid -> quads and triangles in space |
//! | 9 | `spline` | grid -> B-spline surface |
//!
//! `candidate` has stages 4 to 7 of one layout. `choose` runs them again and again where an error is asked for.
//!
//! Differences from the paper: (1) curvature is measured in a share of the depth extent, so the user's unit does not matter. (2) The
//! density is a power of the curvature, not its logarithm, with a floor spread evenly. The paper's log x gives curvatures 0 and 1 no
//! density at all. Of 96 real scans it met a good part no better than a uniform grid does. `exponent = 0` is log(1 + x). (3) The density is
//! averaged over a few quads, so lines run smoothly. `smoothing = 0` is the paper's. (4) No vertex is repeated and no quad folds over. (5)
//! Invalid pixels are masked: they attract nothing (unless given a curvature), vertices beside the surface move onto it, and quads on the
//! background are left out. (6) If the uniform grid of the same size lies nearer to the image, gentler densities and one without smoothing
//! are tried, and at last the uniform grid is the answer.

mod operation;
mod params;
mod report;
mod stages;

// 1. single-pixel gaps
mod gaps;

// 2. curvature and density
mod density;

// 3. tiles
mod tiles;

// 4. vertical curves
mod curves;

// 5. rows
mod rows;

// 6. one grid
mod snap;
mod stitch;

// 7. errors
mod measure;
mod quad_distance;

// 8. the result
mod finish;
mod grid;
mod place;

// 9. a surface through the grid
mod spline;

// The grid of one layout, and of the layout that keeps an error
mod candidate;
mod choose;

mod driver;

pub use driver::run;
pub use grid::QuadGrid;
pub use operation::OPERATION;
pub use params::{QuadParams, SCHEMA, Target};
pub use report::QuadReport;
pub use spline::{Fit, OPERATION as SPLINE_OPERATION, SCHEMA as SPLINE_SCHEMA, Spline, SplineParams};

#[cfg(test)]
mod tests;
