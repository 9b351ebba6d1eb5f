//! The C library: `include/surfrecon.h` is generated from these files and is the manual.
//!
//! | file | what |
//! |---|---|
//! | `align` | Aligning scans whose poses are unknown or rough: one pose each, in one frame |
//! | `alignment` | The result of an alignment |
//! | `allocator` | Memory from the system, or from functions of the program's |
//! | `array` | Arrays across the border: borrowed ones in, views of our own out |
//! | `bounds` | Extent of content: its amount, where it lies, and its places in single precision |
//! | `cancel` | Cancelling from another thread, or from a handler of a signal |
//! | `check_print` | Checks before printing |
//! | `close` | Closed surfaces |
//! | `cloud` | Points without connectivity |
//! | `cluster` | Clustering a dense mesh, or points, to a coarse mesh of well-shaped triangles |
//! | `context` | Contexts: parts of one program that share the library, each with settings of its own |
//! | `crs` | Coordinate reference systems of surveys |
//! | `files` | Reading files |
//! | `folder` | Folders in memory |
//! | `fork` | Forks of the host's program, which the core has to be told of |
//! | `formats` | The files that can be read |
//! | `frame` | Frames of depth cameras in memory: depths with the colours and confidences that were recorded beside them, to a range image |
//! | `given` | Fields of structs of parameters, and what a caller gives in them |
//! | `guard` | No panic gets out: it would end the host |
//! | `handle` | Handles: what the caller holds is a number that looks like a pointer and is never followed |
//! | `image` | Range images |
//! | `image_source` | Scans whose range images the caller makes when they are needed |
//! | `last_error` | Outcomes of calls: the text of the last error, and of a status |
//! | `measure` | Measuring |
//! | `merge` | Merging registered scans into one surface |
//! | `merger` | The scans of a merge: added, replaced, removed, and what is kept of them from run to run |
//! | `mesh` | Meshes |
//! | `params` | Structs of parameters, a file an operation, and how what is in them becomes the core's parameters |
//! | `photo` | Photos whose cameras are known |
//! | `pointer` | Pointers of the caller, checked and used in one place |
//! | `pose` | Poses across the border |
//! | `prepare_print` | Preparing a print |
//! | `progress` | Progress and cancelling |
//! | `projection` | Projections by what they mean |
//! | `provenance` | Provenance: what files say of where they are from |
//! | `quads` | Quad grids of range images |
//! | `reconstruct` | Making a surface through scattered points |
//! | `region` | Boxes, planes and masks that samples are kept or removed by |
//! | `report` | Structs of figures: how the core's reports become them |
//! | `reports` | Structs of figures, a file a report |
//! | `scan` | The virtual range scanner |
//! | `sculpt` | Sculpting a range image to few triangles within a tolerance |
//! | `select` | Selections: the parts of scans that are kept or removed, and the size and place that they are given |
//! | `settings` | Settings of the whole library in this program, which contexts have others beside: worker threads, memory and the log |
//! | `sized` | Structs that start with their size and grow only at the end, so that programs built against another version of the header still work |
//! | `snap` | Scans placed by hand: one drawn to the others, and how far it lies off them |
//! | `sources` | Scans as merges and alignments take them: range images, placed meshes, scans of files, images that the caller makes |
//! | `spline` | B-spline surfaces through quad grids |
//! | `status` | The outcome of a call, and what is kept of the last failure |
//! | `text` | Texts as C wants them |
//! | `texture` | The images of a mesh, made of photos and of the detailed surface that it stands for |
//! | `unwrap` | Texture coordinates |
//! | `version` | Version of this library |
//! | `vertices` | Range images as hosts keep them: a mesh of a vertex a valid pixel, whatever its user does with it |
//! | `write` | Writing files |
//!
//! `unsafe` blocks are in `pointer` and `allocator` alone, a function of the system is declared in `fork`. The lint is lifted for the whole
//! crate because exporting a symbol counts as unsafe too.

#![allow(unsafe_code)]
// The comments become the header's, where each argument's line is its contract.
#![allow(clippy::missing_safety_doc)]

/// Everything this library allocates is on its account: see `surfrecon::memory`.
#[global_allocator]
static ALLOCATOR: surfrecon_allocator::Account<allocator::Memory> = surfrecon_allocator::Account(allocator::Memory);

// modules
mod align;
mod alignment;
mod allocator;
mod array;
mod bounds;
mod cancel;
mod check_print;
mod close;
mod cloud;
mod cluster;
mod context;
mod crs;
mod files;
mod folder;
mod fork;
mod formats;
mod frame;
mod given;
mod guard;
mod handle;
mod image;
mod image_source;
mod last_error;
mod measure;
mod merge;
mod merger;
mod mesh;
mod params;
mod photo;
mod pointer;
mod pose;
mod prepare_print;
mod progress;
mod projection;
mod provenance;
mod quads;
mod reconstruct;
mod region;
mod report;
mod reports;
mod scan;
mod sculpt;
mod select;
mod settings;
mod sized;
mod snap;
mod sources;
mod spline;
mod status;
mod text;
mod texture;
mod unwrap;
mod version;
mod vertices;
mod write;
// end
