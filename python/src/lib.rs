//! The Python module `surfrecon._native`: NumPy in, NumPy out. It knows the core and Python, and no host.
//!
//! | file | what |
//! |---|---|
//! | `align` | Scans without poses to one frame, at once or read once and as often as wanted |
//! | `allocator` | The allocator of this module, which counts: what a host's report of memory and the tests of leaks read |
//! | `arrays` | NumPy arrays <-> slices and vectors |
//! | `background` | A call on a thread of its own: started, watched, cancelled, waited for |
//! | `calling` | Calls of Python's functions from threads of ours while files are read and written |
//! | `check_print` | Checks of a mesh before it is printed |
//! | `close` | Closing the openings of a surface |
//! | `cluster` | Clustering: a dense mesh, or points, to a coarse mesh of well-shaped triangles |
//! | `constraints` | Knowledge of the caller about scans to be aligned: numbers of scans, picks, a turntable |
//! | `context` | Settings for a part of a program |
//! | `crs` | Coordinate reference systems as Python has them: texts |
//! | `edit` | Edits of a scan: samples kept or removed, another size and place |
//! | `errors` | The core's errors and panics -> the exceptions of `surfrecon._errors` |
//! | `forks` | Forks of the interpreter's process, which the core has to be told of |
//! | `frame` | `Scan`: one of a set, still in its file |
//! | `incremental` | A merge of scans that were merged before |
//! | `job` | Long calls in the background, for hosts whose main thread must stay free |
//! | `log` | Messages of calls to Python: to the logger `surfrecon`, or to the function of a context |
//! | `measure` | Distances of points, and of a whole surface, to a mesh |
//! | `memory_folder` | Files that are no files of the system: folders in memory, and Python's file objects where a path is expected |
//! | `merge` | The merge and its report |
//! | `merge_tasks` | A merge that several processes do: what `surfrecon.distributed` is made of |
//! | `merge_to_file` | The merge of more scans than memory holds |
//! | `merger` | Scans that are merged again as they change |
//! | `mesh` | `Mesh`: a triangle mesh that never changes |
//! | `operations` | The core's operations: what each takes and gives, and what it is called where |
//! | `params` | The core's parameter table, and parameters from keyword arguments |
//! | `paths` | Paths as Python has them: texts, bytes of the system's own coding, and objects that say one of these |
//! | `photo` | `Photo`: a photo whose camera is known |
//! | `pickling` | Objects as pickle takes them: a kind and the parts of that, from which `_again` makes the object in another process, to the bit |
//! | `point_cloud` | `PointCloud`: what a file of points without a grid reads as |
//! | `prepare_print` | Closed meshes made ready for printing |
//! | `progress` | A Python callback and Ctrl-C -> the core's progress |
//! | `projection` | How pixels see: a dict with `kind` and its parameters, both ways |
//! | `quads` | Quad grids: a range image to a regular grid of quads |
//! | `range_image` | `RangeImage`: a grid of samples with its projection and pose |
//! | `ready` | Scans made ready to be aligned, drawn to others by hand and compared: what of it is free of Python's classes |
//! | `reconstruct` | Scattered points -> surface |
//! | `regions` | Boxes and planes: regions of the world that samples are kept or removed by |
//! | `report` | Reports: what calls found, each a dictionary whose figures are attributes as well (`surfrecon._reports`) |
//! | `scan` | The virtual range scanner |
//! | `scans` | Opening and reading files |
//! | `sculpt` | Sculpting: a range image to few triangles within a tolerance |
//! | `select` | Keeps, removes and transforms scans of every kind |
//! | `settings` | Settings of the whole library in this process |
//! | `similarity` | True size and ground: one similarity for all scans |
//! | `sources` | Scans as Python hands them over |
//! | `texture` | Images of meshes, made of photos |
//! | `unpickling` | Objects made again of what `crate::pickling` gave pickle, to the bit |
//! | `unwrap` | Meshes with texture coordinates |
//! | `vertices` | `GridCamera`, and images of the vertices that a host keeps |

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
mod check_print;
mod close;
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
mod photo;
mod pickling;
mod point_cloud;
mod prepare_print;
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
mod texture;
mod unpickling;
mod unwrap;
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
    use crate::check_print::{Checked, check_print};
    #[pymodule_export]
    use crate::close::{Closed, close};
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
    use crate::photo::Photo;
    #[pymodule_export]
    use crate::point_cloud::PointCloud;
    #[pymodule_export]
    use crate::prepare_print::{Prepared, prepare_print};
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
    use crate::scans::{
        _open_many, ScanSet, crs_note, formats, open, provenance, read, recording_of, write, write_scans,
    };
    #[pymodule_export]
    use crate::sculpt::{Sculpted, Sculptor, sculpt};
    #[pymodule_export]
    use crate::select::{dominant_plane, keep, remove, transformed};
    #[pymodule_export]
    use crate::settings::{memory_limit, set_memory_limit};
    #[pymodule_export]
    use crate::similarity::{Similarity, ground, true_size};
    #[pymodule_export]
    use crate::texture::{TextureTile, Textured, texture};
    #[pymodule_export]
    use crate::unpickling::_again;
    #[pymodule_export]
    use crate::unwrap::{Unwrapped, unwrap};
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
