//! Stages 8 to 10 and what follows: parts that are kept, holes closed, the surface handed over, its distance to the scans. \[MI04, sec.
//! 3.4\]

pub mod close_holes;
pub mod close_openings;
pub mod components;
pub mod deviation;
mod in_place;
pub mod noise;
mod nothing_left;
mod retry_holes;
mod seen_fills;
mod stray;
pub mod write;

pub use nothing_left::refuse_nothing;
