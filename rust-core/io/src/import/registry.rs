//! The registry of formats: what each is called, how it is recognized, and which functions read it. A further format is
//! a module and an entry here.

use std::path::Path;
use std::sync::Arc;

use glam::DVec3;

use super::{
    Camera, Content, ReadOptions, Scan, ScanSet, camera, conf, e57, file, gltf, las, obj, pcd, ply, points, project,
    ptx, raster, stl, trajectory,
};
use base::error::{Error, Result};
use base::progress::Progress;

/// A file format: how to recognize it and how to read it.
pub struct Format {
    /// Name for people.
    pub name: &'static str,
    /// Usual endings of the file's name, without the dot, in lower case.
    pub extensions: &'static [&'static str],
    /// Whether a file starts like one of this format.
    sniff: fn(&[u8]) -> bool,
    pub(super) role: Role,
}

/// What files of a format hold.
pub(super) enum Role {
    /// Scans.
    Scans {
        /// Lists the scans; reads headers, no more.
        open: fn(&Path, &Arc<ReadOptions>) -> Result<ScanSet>,
        /// Reads one scan.
        read: fn(&Scan, &Progress<'_>) -> Result<Content>,
        /// Some points of a scan, cheaply if that can be, in its own frame.
        preview: fn(&Scan, usize) -> Result<Vec<DVec3>>,
    },
    /// Names and places of scans that lie in other files.
    List(fn(&Path, &Arc<ReadOptions>, &Progress<'_>) -> Result<ScanSet>),
    /// The camera of depth images.
    Camera(fn(&Path) -> Result<Camera>),
    /// Poses of a sequence of images.
    Trajectory(fn(&Path) -> Result<trajectory::Trajectory>),
}

impl Format {
    /// Whether files of this format hold no scans themselves but list, place or describe scans in other files.
    pub fn is_side_file(&self) -> bool {
        !matches!(self.role, Role::Scans { .. })
    }
}

/// A format of one scan a file.
macro_rules! whole {
    ($name:literal, $extensions:expr, $($module:ident)::+) => {
        Format {
            name: $name,
            extensions: &$extensions,
            sniff: $($module)::+::sniff,
            role: Role::Scans {
                open: file::single,
                read: |scan, progress| file::parsed(scan, progress, $($module)::+::parse),
                preview: |scan, count| file::thinned(scan, $($module)::+::parse, count),
            },
        }
    };
}

/// A format of height maps and depth images.
macro_rules! raster {
    ($name:literal, $extensions:expr, $module:ident) => {
        whole!($name, $extensions, raster::$module)
    };
}

/// The formats that can be read. Where several could have written a file's first bytes, the stricter comes first.
static FORMATS: &[Format] = &[
    Format {
        name: "PLY (range grid, mesh or points)",
        extensions: &["ply"],
        sniff: ply::sniff,
        role: Role::Scans { open: ply::open, read: ply::read, preview: ply::preview },
    },
    Format {
        name: "VRIP list of placed scans",
        extensions: &["conf"],
        sniff: conf::sniff,
        role: Role::List(conf::open),
    },
    Format {
        name: "PTX (terrestrial scans)",
        extensions: &["ptx"],
        sniff: ptx::sniff,
        role: Role::Scans {
            open: ptx::open,
            read: |scan, progress| file::parsed(scan, progress, ptx::parse),
            preview: |scan, count| file::thinned(scan, ptx::parse, count),
        },
    },
    whole!("PCD (organized or not)", ["pcd"], pcd),
    Format {
        name: "E57 (terrestrial scans)",
        extensions: &["e57"],
        sniff: e57::sniff,
        role: Role::Scans {
            open: e57::open,
            read: |scan, progress| file::parsed(scan, progress, e57::parse),
            preview: |scan, count| file::thinned(scan, e57::parse, count),
        },
    },
    whole!("LAS or LAZ (aerial and mobile scans)", ["las", "laz"], las),
    whole!("glTF mesh", ["glb", "gltf"], gltf),
    whole!("STL mesh", ["stl"], stl),
    Format {
        name: "MeshLab project",
        extensions: &["mlp"],
        sniff: project::sniff_mlp,
        role: Role::List(project::open_mlp),
    },
    Format {
        name: "MeshLab alignment",
        extensions: &["aln"],
        sniff: project::sniff_aln,
        role: Role::List(project::open_aln),
    },
    raster!("PNG (height map, terrain RGB or depth)", ["png"], png),
    raster!("PGM (height map or depth)", ["pgm"], pgm),
    raster!("PFM (height map or depth)", ["pfm"], pfm),
    raster!("OpenEXR (depth)", ["exr"], exr),
    raster!("TIFF (height map or depth)", ["tif", "tiff"], tiff),
    raster!("NumPy array (height map, depth or points)", ["npy"], npy),
    raster!("ESRI ASCII grid", ["asc"], esri),
    Format {
        name: "camera of depth images",
        extensions: &["json"],
        sniff: camera::sniff,
        role: Role::Camera(camera::read),
    },
    Format {
        name: "trajectory (Open3D log or TUM)",
        extensions: &["log", "freiburg"],
        sniff: trajectory::sniff,
        role: Role::Trajectory(trajectory::read),
    },
    // Has no mark of its own: recognized by the ending of its name.
    raster!("SRTM tile", ["hgt"], hgt),
    whole!("OBJ mesh", ["obj"], obj),
    // Last: any lines of numbers are points.
    Format {
        name: "points in text",
        extensions: &["xyz", "pts", "asc", "txt", "csv"],
        sniff: points::sniff,
        role: Role::Scans { open: points::open, read: points::read, preview: points::preview },
    },
];

/// Bytes of a file that its format is recognized by.
const SNIFFED: usize = 4096;

/// The formats that can be read.
pub fn formats() -> &'static [Format] {
    FORMATS
}

/// The format of a file: by its content, else by the ending of its name, so that its reader can say what is wrong.
pub(super) fn format_of(path: &Path) -> Result<&'static Format> {
    let (start, length) = file::read_start(path, SNIFFED)?;
    if let Some(format) = FORMATS.iter().find(|format| (format.sniff)(&start)) {
        return Ok(format);
    }
    let named = |extension: &str| FORMATS.iter().find(|format| format.extensions.contains(&extension));
    // A binary one has no mark, but a length that says it.
    if let Some(format) = named("stl").filter(|_| stl::has_length_of_binary(&start, length)) {
        return Ok(format);
    }
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    named(&extension).ok_or_else(|| {
        let known: Vec<String> = FORMATS.iter().map(|f| format!("{}: .{}", f.name, f.extensions.join(", ."))).collect();
        Error::format(path, "start of file", format!("unknown format; known are {}", known.join("; ")))
    })
}
