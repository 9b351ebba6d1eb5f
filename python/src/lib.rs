//! The Python module `surfrecon._native`: NumPy in, NumPy out. It knows the core and Python, and no host.
//!
//! | file | what |
//! |---|---|
//! | `arrays` | NumPy arrays <-> slices and vectors; the only `unsafe` of this crate but the allocator's |
//! | `errors` | the core's errors and panics -> the exceptions of `surfrecon._errors` |
//! | `progress` | a Python callback and Ctrl-C -> the core's progress |
//! | `settings`, `context` | the most memory a call may take; that, threads and a log for a part of a program |
//! | `log` | what calls tell -> the module `logging`, or the function of a context |
//! | `forks` | forks of the process wait until nobody is at a table |
//! | `allocator` | counts the memory that is held |
//! | `params` | the core's parameter table |
//! | `range_image`, `mesh`, `point_cloud` | the data types |
//! | `paths` | texts and bytes that name files |
//! | `pickling`, `unpickling` | these, and scans, as pickle takes them; made again |
//! | `projection` | how pixels see, as a dict |
//! | `vertices` | a range image as vertices that a host keeps |
//! | `scans`, `frame` | opening and reading files; a scan in its file, frames of recordings |
//! | `regions` | boxes and planes |
//! | `similarity` | true size and ground |
//! | `edit` | what becomes of a scan: kept, removed, transformed |
//! | `select` | that for scans of every kind; the dominant plane |
//! | `sources` | scans as Python hands them over |
//! | `constraints` | what the caller knows of scans that are aligned |
//! | `aligner` | scans made ready to be aligned, drawn to others by hand, and compared |
//! | `align` | scans without poses to one frame |
//! | `merge`, `merger`, `incremental` | the merge and its report; once more, as scans change |
//! | `merge_to_file` | that of more scans than memory holds |
//! | `merge_tasks` | that by several processes |
//! | `sculpt` | a range image to few triangles |
//! | `cluster` | a dense mesh to well-shaped triangles |
//! | `quads` | a range image to a grid of quads |
//! | `reconstruct` | scattered points to a surface |
//! | `measure` | distances of points and of surfaces |
//! | `scan` | the virtual range scanner |
//! | `job` | a long call on a thread of its own, for hosts |

#![allow(
    clippy::doc_lazy_continuation,
    reason = "doc comments are docstrings of Python, whose examples show what comes out"
)]

// modules
mod align;
mod allocator;
mod arrays;
mod background;
mod calling;
mod cluster;
mod constraints;
mod context;
mod crs;
mod edit;
mod errors;
mod forks;
mod frame;
mod incremental;
mod job;
mod log;
mod measure;
mod memory_folder;
mod merge;
mod merge_tasks;
mod merge_to_file;
mod merger;
mod mesh;
mod operations;
mod params;
mod paths;
mod pickling;
mod point_cloud;
mod progress;
mod projection;
mod quads;
mod range_image;
mod ready;
mod reconstruct;
mod regions;
mod report;
mod scan;
mod scans;
mod sculpt;
mod select;
mod settings;
mod similarity;
mod sources;
mod unpickling;
mod vertices;
// end

use pyo3::prelude::*;

#[pymodule]
mod _native {
    use pyo3::prelude::*;

    // exports
    #[pymodule_export]
    use crate::align::{Aligner, Alignment, align};
    #[pymodule_export]
    use crate::allocator::{memory_foreseen, memory_in_use, memory_peak};
    #[pymodule_export]
    use crate::cluster::{Clustered, cluster, cluster_levels};
    #[pymodule_export]
    use crate::constraints::Pick;
    #[pymodule_export]
    use crate::context::Context;
    #[pymodule_export]
    use crate::frame::{Frame, Scan};
    #[pymodule_export]
    use crate::job::Job;
    #[pymodule_export]
    use crate::measure::{distances, nearest_triangles, surface_distance};
    #[pymodule_export]
    use crate::memory_folder::{MemoryFolder, MemoryPath};
    #[pymodule_export]
    use crate::merge::{MergeResult, merge};
    #[pymodule_export]
    use crate::merge_tasks::{_end_merge_tasks, _merge_stages, _merge_task, _merge_tasks_to_file};
    #[pymodule_export]
    use crate::merge_to_file::{_check_file_in_pieces, _part_path, merge_to_file};
    #[pymodule_export]
    use crate::merger::Merger;
    #[pymodule_export]
    use crate::mesh::{Mesh, linear_colours};
    #[pymodule_export]
    use crate::operations::{Operation, all};
    #[pymodule_export]
    use crate::params::{_nearest, Parameter, parameters};
    #[pymodule_export]
    use crate::point_cloud::PointCloud;
    #[pymodule_export]
    use crate::quads::{QuadGrid, Spline, adaptive_quads};
    #[pymodule_export]
    use crate::range_image::RangeImage;
    #[pymodule_export]
    use crate::reconstruct::{Reconstructed, Reconstructor, reconstruct};
    #[pymodule_export]
    use crate::regions::{OrientedBox, Plane};
    #[pymodule_export]
    use crate::report::{Figure, figures};
    #[pymodule_export]
    use crate::scan::{Camera, sculpture, turntable, virtual_scan};
    #[pymodule_export]
    use crate::scans::{ScanSet, crs_note, formats, open, provenance, read, recording_of, write, write_scans};
    #[pymodule_export]
    use crate::sculpt::{Sculpted, Sculptor, sculpt};
    #[pymodule_export]
    use crate::select::{dominant_plane, keep, remove, transformed};
    #[pymodule_export]
    use crate::settings::{memory_limit, set_memory_limit};
    #[pymodule_export]
    use crate::similarity::{Similarity, ground, true_size};
    #[pymodule_export]
    use crate::unpickling::_again;
    #[pymodule_export]
    use crate::vertices::GridCamera;
    // end

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        crate::calling::watch_the_end(module.py())?;
        crate::forks::watch();
        crate::log::to_logger(module.py())?;
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
