//! Surfaces from range scans.
//!
//! ```text
//!  files, host objects        one grid, one cloud, one mesh        verbs
//!  import ────────────────►   range_image ──► triangulate ──►      align ──► merge ──►  mesh ──► export
//!  scan (virtual scanner) ►   point_cloud ──► reconstruct ─────►              check, measure
//!  beneath all: geom, params, magnitude, progress, threads, memory, error
//! ```
//!
//! This crate names what others hold: each part is a crate of its own, under its own name there and here.
//!
#![doc = include_str!("tour.md")]

mod merge_in_files;
mod merge_tasks;
mod merge_to_file;
pub mod operations;
pub mod params;
pub mod reports;

#[doc(inline)]
pub use geom;
#[doc(inline)]
pub use image::{frame, photo, range_image, rigid, select, source, triangulate, vertices};
#[doc(inline)]
pub use io::{export, import, memory_folder};
#[doc(inline)]
pub use mesh::{self, point_cloud};

// operations
#[doc(inline)]
pub use align;
#[doc(inline)]
pub use close;
#[doc(inline)]
pub use cluster;
#[doc(inline)]
pub use merge;
#[doc(inline)]
pub use plane;
#[doc(inline)]
pub use printing;
#[doc(inline)]
pub use quads;
#[doc(inline)]
pub use reconstruct;
#[doc(inline)]
pub use scan;
#[doc(inline)]
pub use sculpt;
#[doc(inline)]
pub use texture;
#[doc(inline)]
pub use unwrap;
// end

/// Errors: what the caller got wrong and what to do.
pub mod error {
    pub use base::error::{Error, Result, Shown, counted};
    pub use base::nearest::{meant, nearest};
}

/// Limits of numbers.
pub mod magnitude {
    pub use base::magnitude::{LARGEST, SMALLEST};
}

/// Memory that a call will take, found out before it is taken. Also what follows if it can't be had all the same.
pub mod memory {
    pub use base::memory::{
        attempted, foresee, foreseen, guarded, held, limit, peak, refused, restart_peak, set_limit,
    };
}

/// Parts of a program that share the library, each with settings of its own.
pub mod context {
    pub use base::context::{Chosen, Context, Owned, choose, chosen, exchange};
}

/// Messages of calls: what a person may want to know of a call, or should look at.
pub mod log {
    pub use base::log::{Level, Listener, Log, set, tell};
}

/// Progress and cancelling as one value.
pub mod progress {
    pub use base::progress::{Plan, Progress, Seconds, Tick};
}

/// Pools of our own: we live inside other people's programs and leave the global pool alone.
pub mod threads {
    pub use base::threads::{Exclusive, Taken, Turns, of_worker, pool, set_threads, threads};
}

/// Forks of a host's program, which wait until nobody is at a table of this library.
pub mod fork {
    pub use base::fork::{Prevented, close, open, prevent};
}

/// The former name of [`reconstruct`].
#[deprecated(since = "0.2.0", note = "it is called `reconstruct`")]
pub mod scattered {
    pub use reconstruct::*;
}

pub use error::{Error, Result};
pub use image::RangeImage;
#[expect(deprecated, reason = "former names")]
pub use merge_in_files::{InFiles, merge_again_in_files, merge_in_files};
pub use merge_tasks::{TaskFolder, end_merge_tasks, merge_task, merge_tasks_to_file};
pub use merge_to_file::{IntoFile, merge_to_file};
pub use mesh::TriMesh;
pub use point_cloud::PointCloud;
pub use progress::{Progress, Tick};

/// Rust code in README.md, compiled.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
struct Readme;
