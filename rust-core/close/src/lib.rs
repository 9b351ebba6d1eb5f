//! Closing: the openings of a measured surface are filled smoothly, but never where a scan saw that nothing is. Also checks for printing.
//!
//! | stage | file | in -> out |
//! |---|---|---|
//! | | `doubts` | mesh, scans -> what seems wrong with them |
//! | | `surface`, `visibility` | mesh, scans -> what can be asked: which side a place lies on, whether it was seen through |
//! | 1 | `grid`, `nodes`, `rows`, `known` | surface -> signed distances at the nodes beside it |
//! | 2 | `poisson`, `multigrid`, `conjugate`, `thickness` | surface -> a start that is closed at the outer bound, and no thicker than what was seen. \[KH13\] |
//! | 3 | `field`, `distance`, `plate` | start -> the smoothest field that keeps what was measured and is not negative in seen space |
//! | 4 | `level`, `table` | field -> its level set, closed. \[LC87\] |
//! | 5 | `cut`, `retreat` | level set -> what of it lies beyond the borders, out of seen space |
//! | 6 | `bridge`, `stitch`, `fan`, `clear` | fill, border -> one surface |
//! | 7 | `openings`, `judge`, `turned` | surface -> the fills that stay, and openings with the reason why they are left |
//! | | `foot` | the foot over a flat base lies in its plane |
//! | 8 | `attributes` | the filled part is marked |
//! | | `attempt` | the stages in their order, in cells of one size |
//! | | `attempts`, `cells` | attempts in other cells, for as long as fills are stuck |
//! | | `driver` | what is handed in is checked |
//! | | `print`, `crossing`, `bodies` | checks before printing |

mod operation;
mod params;
mod report;

// what is asked, all along
mod surface;
mod visibility;

// 1. the grid, and what is known on it
#[doc(hidden)]
pub mod grid;
mod known;
mod nodes;
mod rows;

// 2. the start
mod conjugate;
mod multigrid;
mod poisson;
mod thickness;

// 3. the field
mod distance;
mod field;
mod plate;

// 4. its level set
#[doc(hidden)]
pub mod level;
mod table;

// 5. the part that fills
mod cut;
mod retreat;

// 6. joined to the border
mod bridge;
mod clear;
#[doc(hidden)]
pub mod crossing;
mod fan;
mod foot;
mod stitch;

// 7. which openings
mod judge;
mod openings;
mod turned;

// what seems wrong with what was handed in
mod doubts;

// 8. marked
mod attributes;

// the stages in their order, in cells of one size or several
mod attempt;
mod attempts;
mod cells;
mod driver;
mod stages;

// checks before printing
#[doc(hidden)]
pub mod bodies;
pub mod print;

pub use crossing::crossing_pairs;
#[doc(hidden)]
pub use driver::close_on_this_pool;
pub use driver::{close, close_seen_by};
pub use operation::OPERATION;
pub use params::{CloseParams, Openings, SCHEMA, UpAxis};
pub use report::{CloseReport, CloseWarning, Closed, Doubt, LeftOpen, OpenPlace, OpeningReport};
#[doc(hidden)]
pub use stages::PLAN;
pub use visibility::{Blind, Scans, Visibility};

#[cfg(test)]
mod tests;
