//! Edits of a scan's samples after they are read: selections, and their true size.
//!
//! Selections are of the world as it was when they were made: they hold where the scan lay, and so stay with its samples when it is
//! placed elsewhere.

use std::sync::Arc;

use glam::DAffine3;

use image::select::Selection;

/// In the order in which they were asked for.
#[derive(Clone, Debug, Default)]
pub(crate) struct Edits(pub(super) Vec<Edit>);

#[derive(Clone, Debug)]
pub(super) enum Edit {
    Select(Arc<Placed>),
    Scale(f64),
}

/// A selection, and where the scan lay in the world that it is of.
#[derive(Debug)]
pub(super) struct Placed {
    pub(super) selection: Selection,
    pub(super) world_from_sensor: DAffine3,
}

impl Edits {
    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Whether there are selections.
    pub(super) fn leave_out(&self) -> bool {
        self.0.iter().any(|edit| matches!(edit, Edit::Select(_)))
    }
}
