//! Reading scans: what a file of scans opens as.
//!
//! | file | what |
//! |---|---|
//! | `registry` | the formats: how each is recognized and read |
//! | `opening` | files and folders opened as one set |
//! | `set`, `scan` | a set of scans; one scan of it: where it is |
//! | `reading` | a scan read, by the registry |
//! | `ply` | range grids, meshes and points |
//! | `conf` | VRIP's lists of placed scans |
//! | `overlap` | meaning of the quaternions of such a list |
//! | `points` | scattered points in text: XYZ, PTS, ASC |
//! | `las` | scattered points of aerial scanners: LAS, LAZ |
//! | `ptx`, `e57`, `pcd` | grids of points of scanners and depth cameras |
//! | `obj`, `stl`, `gltf`, `three_mf` | meshes |
//! | `project` | MeshLab's projects and alignments |
//! | `folder` | a folder: its only list, or all of its scans |
//! | `frames` | recordings of depth cameras and phones: a module a layout |
//! | `grid` | such grids while they are read |
//! | `colour` | the number that colours count to |
//! | `polygons` | faces of more than three corners as triangles |
//! | `raster` | height maps and depth images: hgt, PNG, PGM, PFM, EXR, TIFF, ESRI grids, npy |
//! | `geo_keys` | the keys of GeoTIFF, which LAS has too |
//! | `crs` | the coordinate reference system that a file names, and what else our own say of where they are from |
//! | `camera`, `trajectory`, `pose` | side files: intrinsics, poses of a sequence, the pose of one scan |
//! | `listed_scan`, `placing`, `placing_by_name`, `placing_by_numbers` | the scan that a list names for a pose; the pose of each scan that is opened with a list |
//! | `numbering` | numbers of frames, and times, in names |
//! | `options` | options that tell what the files don't say |
//! | `edits`, `editing` | selections of a scan, and its true size and place |
//! | `archive` | zip archives, read where they lie |
//! | `kept` | a scan as text, from which another process makes it again |
//! | `file`, `window`, `text` | regular files, whole or in part; a window that moves along one; its lines |
//!
//! A file is recognized by its content. The ending of its name decides only where the content could be anything.

mod archive;
mod camera;
mod colour;
pub(crate) mod conf;
mod crs;
mod e57;
mod editing;
mod edits;
mod file;
mod folder;
pub(crate) mod frames;
mod geo_keys;
mod gltf;
mod grid;
mod kept;
#[cfg(feature = "las")]
mod las;
#[cfg(not(feature = "las"))]
#[path = "las_absent.rs"]
mod las;
pub(crate) mod listed_scan;
pub(crate) mod numbering;
mod obj;
mod opening;
mod operation;
mod options;
mod overlap;
mod pcd;
mod placing;
mod placing_by_name;
mod placing_by_numbers;
mod ply;
mod points;
mod polygons;
mod pose;
mod project;
mod ptx;
mod raster;
mod reading;
pub(crate) mod registry;
mod scan;
mod set;
mod stl;
mod text;
mod three_mf;
mod trajectory;
mod window;

#[cfg(any(test, fuzzing))]
mod damage;
#[cfg(test)]
mod faults;
#[cfg(test)]
pub(crate) mod faults_tests;
#[cfg(any(test, fuzzing))]
pub mod fuzzing;
#[cfg(test)]
mod matrices_tests;

pub use crs::provenance;
pub use frames::{PhotoOptions, PhotoSet, RecordedPhoto, photos};
pub use image::frame::Camera;
pub use kept::Kept;
pub use opening::{Taking, open, open_as, open_many, open_with, recording_of};
pub use operation::OPERATION;
pub use options::{CameraAxes, PixelMeaning, PoseSense, ReadOptions, SCHEMA};
pub use registry::{Format, formats};
pub use scan::{Content, FileScan};
pub use set::ScanSet;

/// The former name of [`FileScan`].
#[deprecated(since = "0.2.0", note = "called FileScan")]
pub type Scan = FileScan;
