//! The stages that progress tells of.

base::stages! {
    /// Stages with their shares of the time: of all, of reading alone, of aligning what is read.
    pub PLAN, READING_ALONE, ALIGNING:
    READING = "reading scans", 0.3, 1.0, 0.0;
    COMPARING = "comparing scans", 0.5, 0.0, 0.7;
    FITTING = "fitting all scans", 0.2, 0.0, 0.3;
}

base::stages! {
    /// The stage of placing one scan by hand.
    pub SNAPPING_PLAN:
    SNAPPING = "placing the scan", 1.0;
}

base::stages! {
    /// The stage of measuring what no pose explains.
    pub MEASURING_PLAN:
    MEASURING = "measuring the misfit", 1.0;
}
