//! The C library: `include/surfrecon.h` is generated from these files and is the manual.
//!
//! | file | what |
//! |---|---|
//! | `version` | version of this library |
//! | `status`, `last_error` | outcome of a call; what a caller asks about it |
//! | `settings`, `context` | threads, memory and log of the whole library, and of a part of a program |
//! | `allocator` | source of memory |
//! | `progress`, `cancel` | watchers of a long call, and switches that cancel it |
//! | `params` | structs of parameters, written by `make generate`, and how they become the core's |
//! | `report`, `reports` | how the core's reports become structs of figures, which `make generate` writes |
//! | `array`, `pose` | arrays and transforms across the border |
//! | `projection` | how pixels see, by what numbers mean |
//! | `image`, `frame`, `cloud`, `mesh`, `bounds` | content of scans, and its extent |
//! | `formats`, `files`, `write`, `align`, `alignment`, `snap`, `merger`, `merge`, `sculpt`, `quads`, `spline`, `reconstruct`, `cluster`, `scan`, `measure` | operations on it |
//! | `crs`, `provenance` | coordinate reference systems; what files say of where they are from |
//! | `vertices` | range images as vertices that hosts keep |
//! | `region`, `select` | parts of scans that are kept or removed; their true size and ground |
//! | `folder` | files in memory or behind functions of the caller |
//! | `image_source` | scans whose images the caller makes when they are needed |
//! | `sources` | scans as merges and alignments take them |
//! | `fork` | a forked process finds no lock held by a thread it does not have |
//! | `text` | texts as C wants them |
//! | `guard` | no panic gets out: every entry runs inside it |
//! | `handle` | handles are numbers, looked up in a table and never followed |
//! | `sized` | structs that grow only at the end |
//! | `pointer` | pointers of the caller, checked and used in one place |
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
mod cloud;
mod cluster;
mod context;
mod crs;
mod files;
mod folder;
mod fork;
mod formats;
mod frame;
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
mod pointer;
mod pose;
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
mod version;
mod vertices;
mod write;
// end
