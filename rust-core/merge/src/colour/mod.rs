//! Colours: scans made equally bright, and vertices that no scan has a colour of.

pub mod bare_colours;
pub mod gains;
pub mod near_colours;
