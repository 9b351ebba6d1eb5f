//! PLY files: range grids as Stanford distributes them, meshes, point clouds.
//!
//! | file | what |
//! |---|---|
//! | `header` | elements and properties; line ends and stray lines of real files |
//! | `source` | values out of text or either binary encoding |
//! | `number` | numbers in text, exact and fast |
//! | `columns` | columns of properties |
//! | `elements` | elements in the order of the file |
//! | `body` | vertices, faces, strips, range grids |
//! | `preview` | some points of a file without reading all of it |
//! | `problem`, `fault`, `words` | faults of the file, or of one value, in words, with line or element |
//!
//! A file with an element `range_grid` is a range image seen along -z, rows and columns as in the file. Otherwise one with `face` or
//! `tristrips` is a mesh. Otherwise it is a point cloud. Unknown elements and properties are skipped.
//!
//! *What is refused*: counts that the rest of the file can't hold (before anything is allocated), anything after the
//! last element, lines with more or fewer values than properties, indices out of range, faces with fewer than three
//! vertices. *What is not*: several cells of a grid may name the same vertex, and vertices that no cell names are left
//! out. Coordinates that aren't finite make a pixel invalid, are left out of a cloud, and are an error in a mesh.
//!
//! Cost: one pass over the file. Memory for the result and a window of 256 KiB.

mod binary;
mod body;
mod columns;
mod elements;
mod fault;
mod header;
pub(crate) mod number;
mod preview;
mod problem;
mod source;
mod words;

use std::io::Read;
use std::path::Path;
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use self::binary::Binary;
use self::body::Vertices;
use self::columns::{Attributes, reserve};
use self::elements::{Cells, Parts, elements, vertex_plan};
use self::header::{Element, Encoding, Header, header_in, read_header};
use self::problem::{Parsed, Problem};
use self::source::{Ascii, NO_VERTEX, Source};
use super::file;
use super::options::ReadOptions;
use super::scan::{Content, FileScan};
use super::set::ScanSet;
use super::window::Window;
use base::error::{Error, Result};
use base::progress::Progress;
use image::range_image::{RangeImage, Viewing};
use mesh::TriMesh;
use mesh::point_cloud::PointCloud;

/// Coordinates of double precision farther from the origin than this many times their extent get an origin of their
/// own: single precision then keeps at least 2^-20 of the extent.
const FAR: f64 = 8.0;

/// Whether a file that starts like this is one.
pub(super) fn sniff(start: &[u8]) -> bool {
    header::sniff(start)
}

/// Opens a file as one scan. Reads its header only.
pub(super) fn open(path: &Path, options: &Arc<ReadOptions>) -> Result<ScanSet> {
    let (mut file, length) = file::open(path)?;
    let header = read_header(&mut file, length, path)?;
    let notes = header.notes.iter().map(|note| format!("{}: {note}", file::name(path))).collect();
    Ok(ScanSet { scans: vec![FileScan::with(path, options)], notes })
}

/// Reads a scan.
pub(super) fn read(scan: &FileScan, progress: &Progress<'_>) -> Result<Content> {
    let (mut file, length) = file::counted(&scan.path, progress)?;
    parse(&mut file, length, scan, progress).map_err(|problem| located(problem, &scan.path))
}

/// About `count` points of a scan, in its own frame.
pub(super) fn preview(scan: &FileScan, count: usize) -> Result<Vec<DVec3>> {
    let (mut file, length) = file::open(&scan.path)?;
    preview::points(&mut file, length, &scan.path, count)
}

/// The error of a file, with its line if it has one.
fn located(problem: Box<Problem>, path: &Path) -> Error {
    match file::open(path) {
        Ok((mut file, _)) => problem.locate(&mut file).into_error(path),
        Err(error) => error,
    }
}

/// Parses a whole file of `length` bytes.
fn parse(file: &mut dyn Read, length: u64, scan: &FileScan, progress: &Progress<'_>) -> Parsed<Content> {
    parse_in(Window::new(file, length), scan, progress)
}

fn parse_in(mut window: Window<'_>, scan: &FileScan, progress: &Progress<'_>) -> Parsed<Content> {
    let header = header_in(&mut window)?;
    let content = match header.encoding {
        Encoding::Ascii => content(&mut Ascii { window: &mut window }, &header, scan, progress),
        Encoding::LittleEndian => content(&mut Binary::<false> { window: &mut window }, &header, scan, progress),
        Encoding::BigEndian => content(&mut Binary::<true> { window: &mut window }, &header, scan, progress),
    };
    // An apparent end of the file was none.
    window.failure().map_or(content, |error| Err(Problem::io(error)))
}

fn content<S: Source>(source: &mut S, header: &Header, scan: &FileScan, progress: &Progress<'_>) -> Parsed<Content> {
    let (element, plan) = vertex_plan(header)?;
    if let Some(grid) = header.element("range_grid") {
        let (rows, cols) = grid_size(header, grid)?;
        return if plan.wide_positions() {
            let parts = elements::<S, DVec3>(source, header, element, &plan, cols)?;
            let (points, origin) = narrow(&parts.vertices.positions)?;
            let vertices = Vertices { positions: points, attributes: parts.vertices.attributes };
            range_image(vertices, parts.grid, [rows, cols as usize], origin, scan)
        } else {
            let parts = elements::<S, [f32; 3]>(source, header, element, &plan, cols)?;
            range_image(parts.vertices, parts.grid, [rows, cols as usize], DVec3::ZERO, scan)
        };
    }
    let parts = elements::<S, DVec3>(source, header, element, &plan, 1)?;
    let faces: Vec<&Element> = ["face", "tristrips"].into_iter().filter_map(|name| header.element(name)).collect();
    // Clouds often announce faces that they don't have; what has no vertices either was to be a mesh.
    let is_mesh = faces.iter().any(|element| element.count > 0 || parts.vertices.positions.is_empty());
    if is_mesh { mesh(parts, element, progress) } else { Ok(point_cloud(parts.vertices, scan)) }
}

fn grid_size(header: &Header, grid: &Element) -> Parsed<(usize, u64)> {
    let (Some(cols), Some(rows)) = (header.grid_cols, header.grid_rows) else {
        let problem = "a range grid needs the lines `obj_info num_cols` and `obj_info num_rows`";
        return Err(Problem::new("header", problem));
    };
    if rows.checked_mul(cols) != Some(grid.count) || cols == 0 {
        let problem =
            format!("num_rows {rows} x num_cols {cols} is not the number of cells of range_grid, {}", grid.count);
        return Err(Problem::new("header", problem));
    }
    Ok((rows as usize, cols))
}

/// Double to single precision around an origin of their own if they lie far out.
fn narrow(positions: &[DVec3]) -> Parsed<(Vec<[f32; 3]>, DVec3)> {
    let mut low = DVec3::INFINITY;
    let mut high = DVec3::NEG_INFINITY;
    for position in positions.iter().filter(|p| p.is_finite()) {
        low = low.min(*position);
        high = high.max(*position);
    }
    let far = low.abs().max(high.abs()).max_element() > FAR * (high - low).max_element();
    // Whole numbers, so that the shift itself can be written down shortly and loses nothing.
    let origin = if far { ((low + high) / 2.0).round() } else { DVec3::ZERO };
    let mut points = reserve(positions.len())?;
    points.extend(positions.iter().map(|p| (*p - origin).as_vec3().to_array()));
    Ok((points, origin))
}

fn range_image(
    mut vertices: Vertices<[f32; 3]>,
    grid: Cells,
    [rows, cols]: [usize; 2],
    origin: DVec3,
    scan: &FileScan,
) -> Parsed<Content> {
    let (points, cells) = match grid {
        Cells::Points(points) => (points, Vec::new()),
        Cells::Vertices(cells) => (gather(&vertices.positions, &cells, [f32::NAN; 3])?, cells),
    };
    drop(vertices.positions);
    let mut image = RangeImage::from_points(rows, cols, points, Viewing::ALONG_MINUS_Z)
        .map_err(|error| Problem::new("element range_grid", error.to_string()))?;
    image.name = scan.name.clone();
    image.world_from_sensor = scan.world_from_sensor * DAffine3::from_translation(origin);
    let attributes = &mut vertices.attributes;
    image.colour = attributes.colour.take().map(|colour| gather(&colour, &cells, [0; 4])).transpose()?;
    image.intensity = attributes.take_float("intensity").map(|v| gather(&v, &cells, 0.0)).transpose()?;
    image.confidence = attributes.take_float("confidence").map(|v| gather(&trusted(v), &cells, 0.0)).transpose()?;
    Ok(Content::RangeImage(image))
}

/// Confidences as they may be used: what isn't a finite number >= 0 means no trust.
fn trusted(mut confidence: Vec<f32>) -> Vec<f32> {
    for value in &mut confidence {
        if !(*value >= 0.0 && value.is_finite()) {
            *value = 0.0;
        }
    }
    confidence
}

/// The value of each cell's vertex.
fn gather<T: Copy>(values: &[T], cells: &[u32], none: T) -> Parsed<Vec<T>> {
    let mut gathered = reserve(cells.len())?;
    // NO_VERTEX is beyond every list.
    gathered.extend(cells.iter().map(|&cell| values.get(cell as usize).copied().unwrap_or(none)));
    debug_assert!(values.len() <= NO_VERTEX as usize);
    Ok(gathered)
}

fn mesh(mut parts: Parts<DVec3>, element: &Element, progress: &Progress<'_>) -> Parsed<Content> {
    if let Some(index) = parts.vertices.positions.iter().position(|p| !p.is_finite()) {
        let problem = "a coordinate of a mesh is not finite";
        return Err(Problem::new(words::place(element, index as u64), problem));
    }
    // Cancelled: who reads asks for that again.
    let cut = parts.polygons.cut(&parts.vertices.positions, &mut parts.triangles, progress);
    cut.map_err(|error| Problem::io(std::io::Error::other(error)))?;
    Ok(Content::Mesh(TriMesh {
        positions: parts.vertices.positions,
        triangles: parts.triangles,
        vertex_attributes: parts.vertices.attributes.into_mesh_attributes(),
        face_attributes: parts.face_attributes.map(Attributes::into_mesh_attributes).unwrap_or_default(),
        rounding_room: None,
        crs: None,
    }))
}

fn point_cloud(vertices: Vertices<DVec3>, scan: &FileScan) -> Content {
    let mut attributes = vertices.attributes;
    let mut cloud = PointCloud {
        positions: vertices.positions,
        intensity: attributes.take_float("intensity"),
        normals: attributes.normals,
        colour: attributes.colour,
        sensor: None,
        world_from_cloud: scan.world_from_sensor,
        crs: None,
    };
    if cloud.positions.iter().any(|p| !p.is_finite()) {
        let kept: Vec<bool> = cloud.positions.iter().map(|p| p.is_finite()).collect();
        retain(&mut cloud.positions, &kept);
        cloud.normals.iter_mut().for_each(|normals| retain(normals, &kept));
        cloud.colour.iter_mut().for_each(|colour| retain(colour, &kept));
        cloud.intensity.iter_mut().for_each(|intensity| retain(intensity, &kept));
    }
    Content::Points(cloud)
}

fn retain<T>(list: &mut Vec<T>, kept: &[bool]) {
    let mut index = 0;
    list.retain(|_| {
        index += 1;
        kept[index - 1]
    });
}

/// For tests and fuzzing: a file in memory must not make the reader panic, must give the same whatever the size of the
/// window, and what it gives must be valid.
#[cfg(any(test, fuzzing))]
pub(super) fn examine(bytes: &[u8]) {
    let scan = FileScan::new(Path::new("scan.ply"));
    let outcome =
        |window| match parse_in(window, &scan, &Progress::none()).map_err(|problem| problem.locate(&mut &bytes[..])) {
            Ok(content) => {
                let (valid, size) = match &content {
                    Content::RangeImage(image) => (image.validate(), image.len()),
                    Content::Mesh(mesh) => (mesh.validate(), mesh.positions.len() + mesh.triangles.len()),
                    Content::Points(cloud) => (Ok(()), cloud.positions.len()),
                };
                assert!(valid.is_ok(), "{valid:?}");
                assert!(size <= bytes.len(), "{size} entries from {} bytes", bytes.len());
                format!("{content:?}")
            }
            Err(problem) => {
                assert!(!problem.at.is_empty() && !problem.text.is_empty(), "{problem:?}");
                problem.to_string()
            }
        };
    let whole = outcome(Window::new(bytes, bytes.len() as u64));
    assert_eq!(whole, outcome(Window::tiny(bytes, bytes.len() as u64)));
    let mut file = std::io::Cursor::new(bytes);
    let previewed = preview::points(&mut file, bytes.len() as u64, &scan.path, 50);
    assert!(previewed.is_ok() || !whole.contains("RangeImage"), "a file can be read but not previewed: {previewed:?}");
}

#[cfg(test)]
mod tests;
