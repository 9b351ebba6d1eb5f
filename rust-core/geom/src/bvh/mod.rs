//! Bounding volume hierarchy over triangles: nearest hit of rays, closest point.
//!
//! | file | what | source |
//! |---|---|---|
//! | `node`, `hierarchy` | the tree, and what it is over | |
//! | `build` | binned surface area heuristic, in parallel | \[Wald07\] |
//! | `ray` | watertight ray/triangle test in f64 | \[WBW13\] |
//! | `packet` | 64 rays at once: f32 filter in four lanes, decided by `ray` | \[ORM08\], \[WBW13\] |
//! | `closest` | closest point of a triangle and of the whole hierarchy | \[Ericson05, sec. 5.1.5\] |
//!
//! Every answer is decided in f64 on the caller's coordinates. The f32 boxes only choose which triangles are looked at. They are grown by
//! more than their own rounding and that of the rays, so they never hide a triangle. Answers therefore are those of a loop over all
//! triangles, to the bit, and the same for single rays, packets and any thread count.

// 1. the tree
mod build;
mod hierarchy;
mod node;
// 2. one ray
mod ray;
// 3. many rays
mod packet;
// 4. the closest point
mod closest;

pub use closest::{Closest, Feature};
pub use hierarchy::Bvh;
pub use packet::PACKET;
pub use ray::{Hit, Ray};

#[cfg(test)]
mod tests;
