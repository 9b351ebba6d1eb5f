//! The stages that progress tells of.

base::stages! {
    /// Stages with their shares of the time.
    pub PLAN:
    FILLING = "filling gaps", 0.15;
    CURVATURE = "curvature", 0.15;
    SAMPLING = "sampling", 0.3;
    MEASURING = "measuring the error", 0.4;
}
