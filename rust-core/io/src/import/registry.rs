//! The registry of formats: what each is called, how it is recognized, which functions read it, and what of it can be written.
//! A further format is a module and a line here: dialogs of hosts, lists in every language and the fuzz target follow from it.

use std::path::Path;
use std::sync::Arc;

use glam::DVec3;

use super::options::ReadOptions;
use super::scan::{Content, FileScan};
use super::set::{OpenNamed, ScanSet};
use super::text::{lines_of, whole_lines};
use super::{
    archive, camera, conf, e57, file, frames, gltf, las, obj, pcd, ply, points, project, ptx, raster, stl, three_mf,
    trajectory,
};
use base::error::{Error, Result, known_as};
use base::nearest::nearest;
use base::progress::Progress;
use image::frame::Camera;

/// A file format: how to recognize it and how to read it.
pub struct Format {
    /// Name for people.
    pub name: &'static str,
    /// Usual endings of the file's name, without the dot, in lower case.
    pub extensions: &'static [&'static str],
    /// The ending under which `export` writes the format, and what it can write so. `None` if it is read only.
    pub written: Option<(&'static str, &'static [Holding])>,
    /// Whether a file starts like one of this format.
    sniff: fn(&[u8]) -> bool,
    pub(super) role: Role,
}

/// The content of files of a format.
pub(super) enum Role {
    /// Scans.
    Scans {
        /// Lists the scans. Reads headers, no more.
        open: fn(&Path, &Arc<ReadOptions>) -> Result<ScanSet>,
        /// Reads one scan.
        read: fn(&FileScan, &Progress<'_>) -> Result<Content>,
        /// Some points of a scan, cheaply if that can be, in its own frame.
        preview: fn(&FileScan, usize) -> Result<Vec<DVec3>>,
    },
    /// Names and places of scans that lie in other files.
    List(fn(&Path, &Arc<ReadOptions>, OpenNamed, &Progress<'_>) -> Result<ScanSet>),
    /// Frames of a recording, all in this file or listed by it.
    Recording(fn(&Path, &Arc<ReadOptions>, &Progress<'_>) -> Result<ScanSet>),
    /// The camera of depth images.
    Camera(fn(&Path) -> Result<Camera>),
    /// Poses of a sequence of images.
    Trajectory(fn(&Path) -> Result<trajectory::Trajectory>),
}

impl Format {
    /// Whether files of this format hold no scans themselves but list, place or describe scans in other files.
    pub fn is_side_file(&self) -> bool {
        !matches!(self.role, Role::Scans { .. } | Role::Recording(_))
    }
}

base::choices! {
    /// The content of a file.
    pub enum Holding {
        /// A mesh of triangles.
        Mesh = "mesh" "Mesh",
        /// A mesh of quads.
        Quads = "quads" "Quads",
        /// Scattered points.
        Points = "points" "Points",
        /// One range image.
        Image = "image" "Range image",
        /// Range images with their poses.
        Images = "images" "Range images",
    }
}

impl Format {
    /// A format whose scans `open` lists, and a parser reads whole.
    const fn of(name: &'static str, extensions: &'static [&'static str], sniff: fn(&[u8]) -> bool, role: Role) -> Self {
        Format { name, extensions, written: None, sniff, role }
    }

    /// With what `export` writes of it, under that ending.
    const fn written(mut self, extension: &'static str, holdings: &'static [Holding]) -> Self {
        self.written = Some((extension, holdings));
        self
    }
}

/// The role of files that a parser reads whole: one scan each, or those that `open` lists.
macro_rules! parsed {
    ($($module:ident)::+) => { parsed!($($module)::+, open: file::single) };
    ($($module:ident)::+, open: $open:path) => {
        Role::Scans {
            open: $open,
            read: |scan, progress| file::parsed(scan, progress, $($module)::+::parse),
            preview: |scan, count| file::thinned(scan, $($module)::+::parse, count),
        }
    };
}

/// A format of one scan a file.
macro_rules! whole {
    ($name:literal, $extensions:expr, $($module:ident)::+) => {
        Format::of($name, &$extensions, $($module)::+::sniff, parsed!($($module)::+))
    };
}

/// A format whose module opens, reads and previews by itself.
macro_rules! own {
    ($name:literal, $extensions:expr, $module:ident) => {{
        use $module::{open, preview, read, sniff};
        Format::of($name, &$extensions, sniff, Role::Scans { open, read, preview })
    }};
}

/// A format of several scans a file, each parsed whole.
macro_rules! several {
    ($name:literal, $extensions:expr, $module:ident) => {
        Format::of($name, &$extensions, $module::sniff, parsed!($module, open: $module::open))
    };
}

/// The formats that can be read. If several could have written a file's first bytes, the stricter comes first.
static FORMATS: &[Format] = &[
    own!("PLY (range grid, mesh or points)", ["ply"], ply)
        .written("ply", &[Holding::Mesh, Holding::Quads, Holding::Points, Holding::Image]),
    Format::of("VRIP list of placed scans", &["conf"], conf::sniff, Role::List(conf::open))
        .written("conf", &[Holding::Image, Holding::Images]),
    several!("PTX (terrestrial scans)", ["ptx"], ptx).written("ptx", &[Holding::Image, Holding::Images]),
    whole!("PCD (organized or not)", ["pcd"], pcd),
    several!("E57 (terrestrial scans)", ["e57"], e57).written("e57", &[Holding::Image, Holding::Images]),
    whole!("LAS or LAZ (aerial and mobile scans)", ["las", "laz"], las),
    whole!("glTF mesh", ["glb", "gltf"], gltf).written("glb", &[Holding::Mesh]),
    Format::of("STL mesh", &["stl"], stl::sniff, parsed!(stl, open: stl::open)).written("stl", &[Holding::Mesh]),
    own!("3MF mesh", ["3mf"], three_mf).written("3mf", &[Holding::Mesh]),
    Format::of("MeshLab project", &["mlp"], project::sniff_mlp, Role::List(project::open_mlp)),
    Format::of("MeshLab alignment", &["aln"], project::sniff_aln, Role::List(project::open_aln)),
    whole!("PNG (height map, terrain RGB or depth)", ["png"], raster::png),
    whole!("PGM (height map or depth)", ["pgm"], raster::pgm),
    whole!("PFM (height map or depth)", ["pfm"], raster::pfm),
    whole!("OpenEXR (depth)", ["exr"], raster::exr),
    whole!("TIFF (height map or depth)", ["tif", "tiff"], raster::tiff),
    whole!("NumPy array (height map, depth or points)", ["npy"], raster::npy),
    whole!("ESRI ASCII grid", ["asc"], raster::esri),
    Format::of(
        "recording of frames (Record3D, or a zipped folder)",
        &["r3d"],
        archive::sniff,
        Role::Recording(frames::open_archive),
    ),
    Format::of("frames of nerfstudio", &["json"], frames::sniff_transforms, Role::List(frames::open_transforms)),
    Format::of("ScanNet frames", &["sens"], frames::sens::sniff, Role::Recording(frames::open_sens)),
    Format::of("camera of depth images", &["json"], camera::sniff, Role::Camera(camera::read)),
    Format::of(
        "trajectory (Open3D log, TUM and others)",
        &["log", "freiburg", trajectory::AXIS_ANGLE],
        trajectory::sniff,
        Role::Trajectory(trajectory::read),
    ),
    // Has no mark of its own: recognized by the ending of its name.
    whole!("SRTM tile", ["hgt"], raster::hgt),
    whole!("OBJ mesh", ["obj"], obj).written("obj", &[Holding::Mesh, Holding::Quads]),
    // Last: any lines of numbers are points.
    own!("points in text", ["xyz", "pts", "asc", "txt", "csv"], points),
];

/// Bytes of a file that its format is recognized by.
const SNIFFED: usize = 4096;

/// Bytes of JSON that its format is recognized by: its keys come in any order.
const SNIFFED_OF_JSON: usize = 1 << 20;

/// The start of a file, as much as its format is recognized by, and its length.
fn start_of(path: &Path) -> Result<(Vec<u8>, u64)> {
    let (start, length) = file::read_start(path, SNIFFED)?;
    let is_long_json = length > SNIFFED as u64;
    if is_long_json && file::start_of_text(&start).trim_start().starts_with('{') {
        return file::read_start(path, SNIFFED_OF_JSON);
    }
    Ok((start, length))
}

/// The formats that can be read, and which of them can be written.
pub fn formats() -> &'static [Format] {
    FORMATS
}

/// Endings of the names of files that can hold this, without the dot.
pub fn written_endings(holding: Holding) -> impl Iterator<Item = &'static str> {
    FORMATS.iter().filter_map(|format| format.written).filter(move |(_, all)| all.contains(&holding)).map(|(e, _)| e)
}

/// Endings of the names of files that are scans, without the dot, each once.
pub(super) fn scan_endings() -> impl Iterator<Item = &'static str> {
    let all = || FORMATS.iter().filter(|format| matches!(format.role, Role::Scans { .. })).flat_map(|f| f.extensions);
    all().enumerate().filter(move |(place, ending)| !all().take(*place).any(|other| other == *ending)).map(|(_, e)| *e)
}

/// Checks, before anything is written, that the name of a file ends like a format that can hold this. Returns the ending.
///
/// # Errors
/// [`Error::Input`] with the endings there are.
pub fn ending_for(path: &Path, holding: Holding) -> Result<&'static str> {
    let given = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let known: Vec<&str> = written_endings(holding).collect();
    if let Some(ending) = known.iter().find(|known| **known == given) {
        return Ok(ending);
    }
    let dotted: Vec<String> = known.iter().map(|ending| format!(".{ending}")).collect();
    let (last, before) = dotted.split_last().expect("everything can be written");
    let list = if before.is_empty() { last.clone() } else { format!("{} or {last}", before.join(", ")) };
    let held = match holding {
        Holding::Mesh => "a mesh",
        Holding::Quads => "quads",
        Holding::Points => "points",
        Holding::Image => "a range image",
        Holding::Images => "range images",
    };
    let shown = known_as(path);
    // A name such as `.ply` has no ending: all of it is what a hidden file is called.
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    if let Some(ending) = known.iter().find(|known| name.strip_prefix('.') == Some(**known)) {
        return Err(Error::input(format!(
            "{shown}: there is no name before .{ending}: call it scan.{ending}, for example"
        )));
    }
    let meant =
        nearest(&given, known.iter().copied()).map_or_else(String::new, |near| format!(". Did you mean .{near}?"));
    Err(Error::input(format!("{shown}: the name must end in {list} to hold {held}{meant}")))
}

/// Whether what a file holds says what it is, whatever its name.
pub(super) fn is_known_by_content(path: &Path) -> Result<bool> {
    let (start, _) = start_of(path)?;
    Ok(FORMATS.iter().any(|format| (format.sniff)(&start)))
}

/// Whether a file says at its start that it is a surface which was merged from scans: by its provenance.
pub(super) fn is_merged(path: &Path) -> Result<bool> {
    let (start, _) = start_of(path)?;
    let says = |mark: &str| memchr::memmem::find(&start, mark.as_bytes()).is_some();
    Ok(MERGED.iter().any(|mark| says(mark)))
}

/// Provenance of the commands that merge, as PLY and OBJ have it, and as glTF has.
const MERGED: [&str; 4] = [
    " surfrecon {\"command\":\"merge\"}",
    " surfrecon {\"command\":\"plan\"}",
    "\"surfrecon\":{\"command\":\"merge\",",
    "\"surfrecon\":{\"command\":\"plan\",",
];

/// Whether a format is points in text, the last: any lines of numbers could be these.
fn is_any(format: &Format) -> bool {
    FORMATS.last().is_some_and(|last| std::ptr::eq(last, format))
}

/// Whether a file is read as points in text.
pub(super) fn is_any_text(path: &Path) -> bool {
    format_of(path).is_ok_and(is_any)
}

/// Whether a file is surely of its format. Texts that only end like points may be notes of people.
pub(super) fn is_sure(path: &Path) -> bool {
    format_of(path).is_ok_and(|format| !is_any(format)) || is_known_by_content(path).unwrap_or(false)
}

/// Whether most lines that a text starts with are of numbers alone, three or more. True for what can't be read.
pub(super) fn has_numbers(path: &Path) -> bool {
    let Ok((start, _)) = start_of(path) else { return true };
    let text = String::from_utf8_lossy(whole_lines(&start));
    let is_blank = |c: char| c.is_ascii_whitespace() || c == ',' || c == ';';
    let is_of_numbers = |line: &str| {
        let words = || line.split(is_blank).filter(|word| !word.is_empty());
        words().count() >= 3 && words().all(|word| word.parse::<f64>().is_ok())
    };
    let lines = || lines_of(&text).map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    lines().filter(|line| is_of_numbers(line)).count() * 2 > lines().count()
}

/// The format of a file: by its content, else by the ending of its name, so that its reader can say what is wrong.
pub(super) fn format_of(path: &Path) -> Result<&'static Format> {
    let (start, length) = start_of(path)?;
    let named = |extension: &str| FORMATS.iter().find(|format| format.extensions.contains(&extension));
    let of_poses = named(trajectory::AXIS_ANGLE).filter(|_| trajectory::is_named_so(path));
    if let Some(format) = FORMATS.iter().find(|format| (format.sniff)(&start)) {
        return Ok(of_poses.filter(|_| is_any(format)).unwrap_or(format));
    }
    if let Some(format) = of_poses {
        return Ok(format);
    }
    // A binary one has no mark, but a length that says it.
    if let Some(format) = named("stl").filter(|_| stl::has_length_of_binary(&start, length)) {
        return Ok(format);
    }
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    named(&extension).ok_or_else(|| {
        let known: Vec<String> = FORMATS.iter().map(|f| format!("{}: .{}", f.name, f.extensions.join(", ."))).collect();
        Error::format(path, "start of file", format!("unknown format: known are {}", known.join("; ")))
    })
}
