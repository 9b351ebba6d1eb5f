//! The stages that progress tells of.

use base::progress::Plan;

base::stages! {
    /// Stages with their shares of the time ...
    pub PLAN:
    READING = "reading scans", 0.3;
    COMPARING = "comparing scans", 0.5;
    FITTING = "fitting all scans", 0.2;
}
/// ... and those of its parts by themselves, in the same places.
pub const READING_ALONE: Plan = &[(PLAN[READING].0, 1.0)];
pub const ALIGNING: Plan = &[(PLAN[READING].0, 0.0), (PLAN[COMPARING].0, 0.7), (PLAN[FITTING].0, 0.3)];
pub const SNAPPING: Plan = &[("placing the scan", 1.0)];
pub const MEASURING: Plan = &[("measuring the misfit", 1.0)];
