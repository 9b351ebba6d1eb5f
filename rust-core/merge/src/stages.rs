//! The stages that progress tells of.

base::stages! {
    /// Stages of the merge with their shares of its time. From [`FILLING`] on they are those of `close`, for surfaces that are closed.
    pub PLAN, CLOSED_PLAN:
    MEASURING = "measuring the scans", 0.05, 0.02;
    DISCRETIZING = "reading scans, finding intersections", 0.5, 0.2;
    FUSING = "fusing intersections", 0.1, 0.04;
    LOOKING = "looking through", 0.05, 0.02;
    LABELLING = "labelling nodes", 0.05, 0.02;
    BUILDING = "building the surface", 0.17, 0.07;
    CLOSING = "closing holes", 0.05, 0.0;
    WRITING = "writing the surface", 0.03, 0.01;
    FILLING = "reading lines of sight", 0.0, 0.06;
    PREPARING = "looking at the surface", 0.0, 0.06;
    SOLVING = "solving for the fill", 0.0, 0.3;
    JOINING = "joining the fill", 0.0, 0.15;
    JUDGING = "judging openings", 0.0, 0.05;
}
