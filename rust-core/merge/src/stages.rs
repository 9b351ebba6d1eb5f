//! The stages that progress tells of.

base::stages! {
    /// Stages of the merge with their shares of its time.
    pub PLAN:
    MEASURING = "measuring the scans", 0.05;
    DISCRETIZING = "reading scans, finding intersections", 0.5;
    FUSING = "fusing intersections", 0.1;
    LOOKING = "looking through", 0.05;
    LABELLING = "labelling nodes", 0.05;
    BUILDING = "building the surface", 0.17;
    CLOSING = "closing holes", 0.05;
    WRITING = "writing the surface", 0.03;
}
