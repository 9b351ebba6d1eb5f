//! Settings of a merge that are no parameters: where bricks begin, and what follows where cells do not fit into memory.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::crossings::bundles;

/// Settings that no parameter says.
pub struct Setup {
    /// The corner that bricks are counted from.
    pub corner: [i64; 3],
    /// Crossings of a worker that are kept one by one. If there are more they are added up.
    pub kept: u64,
    /// Bricks along each side of a block. Else all is one.
    pub block: Option<i32>,
    pub fit: Fit,
}

/// Means if cells do not fit into memory.
pub struct Fit {
    /// Bytes that there are at most.
    pub memory: f64,
    /// Whether cells are never larger than given or measured.
    pub keeps_to_cells: bool,
    /// Answered: whether it was foreseen that these cells do not fit ...
    pub is_refused: AtomicBool,
    /// ... and the surface alone may.
    pub surface_may_fit: AtomicBool,
}

impl Fit {
    /// At most so many bytes.
    pub fn within(memory: Option<u64>) -> Self {
        let memory = memory.map_or(f64::INFINITY, |bytes| bytes as f64);
        Fit {
            memory,
            keeps_to_cells: false,
            is_refused: AtomicBool::new(false),
            surface_may_fit: AtomicBool::new(false),
        }
    }

    /// Nothing is foreseen yet.
    pub fn begin(&self) {
        self.is_refused.store(false, Ordering::Relaxed);
        self.surface_may_fit.store(false, Ordering::Relaxed);
    }

    /// Whether a merge in files may fit where this one did not.
    pub fn leaves_hope(&self) -> bool {
        self.surface_may_fit.load(Ordering::Relaxed) || !self.is_refused.load(Ordering::Relaxed)
    }
}

impl Default for Setup {
    fn default() -> Self {
        Setup { corner: [0; 3], kept: bundles::MANY, block: None, fit: Fit::within(None) }
    }
}
