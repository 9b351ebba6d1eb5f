//! From a heap of scans without poses to one frame.
//!
//! | files | steps |
//! |---|---|
//! | `driver` | scans read once, and aligned, drawn or measured as often as wanted |
//! | `level`, `visibility` | a scan's surface by few points and by more, and what its sensor saw through |
//! | `features`, `correspond`, `retrieve` | points that look alike, and scans that may touch |
//! | `hypothesise`, `refine`, `judge` | motions that many like points agree on, made exact and judged |
//! | `finding`, `symmetries`, `walls` | whether a motion is sure: not where a scan repeats itself, nor where walls alone fit |
//! | `sequence`, `turntable` | motions from frame to frame of a recording, and on a turntable about its axis |
//! | `tint`, `coloured` | motions by colours where shape leaves them open |
//! | `reach`, `gravity` | motions only near poses that are rough, and only as gravity allows |
//! | `doubts` | groups that the heap as a whole speaks against |
//! | `assemble`, `relax`, `uncertainty` | groups, all poses at once, and how far they may be off |
//! | `misfit` | differences that no pose explains |
//! | `report`, `summary`, `rivals`, `words`, `names` | the report |
//! | `snap` | one scan alone, by hand |
//!
//! A scan is placed only if overlap, balance and uniqueness pass: never guessed. Nothing is drawn at random, and scans are
//! taken by size and content, so that results are the same bytes for any number of threads and any order of the scans.

#[cfg(test)]
mod arrangements_tests;
mod assemble;
mod blocks;
mod coloured;
mod constraints;
mod correspond;
mod doubts;
mod driver;
mod envelope;
mod features;
mod finding;
mod gravity;
mod group;
mod hypothesise;
mod judge;
mod level;
mod linear;
mod misfit;
mod modes;
mod names;
mod near;
mod neighbours;
mod operation;
mod pair;
mod params;
mod reach;
mod refine;
mod relax;
mod report;
mod retrieve;
mod rivals;
mod search;
mod sequence;
mod snap;
mod solve;
mod stages;
mod summary;
mod symmetries;
mod tint;
mod turntable;
mod uncertainty;
mod view;
mod visibility;
mod walls;
mod words;

pub use constraints::{Axis, Constraints, Pick};
pub use driver::{Prepared, run};
pub use image::oriented::OrientedPoints;
pub use image::source::{Moment, PlacedCloud, ScanSource};
pub use operation::OPERATION;
pub use params::{AlignParams, SCHEMA, Start, Turntable};
pub use report::{AlignReport, AlignedPair, AlignedScan, Alignment, Freedom, PairState, ScanState, TurntableFound};
pub use snap::Snap;
