//! Names and weights of the stages, for progress.

base::stages! {
    /// Stages with their shares of the time.
    pub PLAN:
    READING = "reading lines of sight", 0.1;
    PREPARING = "looking at the surface", 0.1;
    SOLVING = "solving for the fill", 0.5;
    JOINING = "joining the fill", 0.25;
    JUDGING = "judging openings", 0.05;
}
