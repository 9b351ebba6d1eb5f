//! Range images as hosts keep them: a mesh of one vertex per valid pixel, each with its row and column. The user moves, turns, scales and
//! mirrors it, deletes vertices of it, edits them one by one, and stores it in single precision. To it, and back.
//!
//! | file | what |
//! |---|---|
//! | `camera` | the camera that a host keeps besides: how pixels see, and where some of the vertices were |
//! | `motion` | how the vertices were moved since |
//! | `placed` | vertices whose motion is known -> samples, projection and pose |

mod camera;
mod motion;
mod placed;

pub use camera::{Anchor, GridCamera, MOST_ANCHORS};

use glam::{DAffine3, DVec3};

use base::error::{Error, Result};
use base::magnitude;
use base::memory;
use base::progress::Progress;
use mesh::TriMesh;

use crate::range_image::RangeImage;
use crate::range_image::samples::SampleGrid;
use crate::triangulate::{self, TriangulateParams};

/// At the peak, without and with faces. Measured.
const BYTES_A_VERTEX: f64 = 56.0;
const BYTES_WITH_FACES: f64 = 88.0;

/// Of an image of points with all attributes, and of what tells its pixels' vertices.
const BYTES_A_PIXEL: f64 = 28.0;

/// Grids of up to so many pixels are made for any number of vertices, as far as memory goes: users delete most of a scan.
const MOST_FOR_FEW: usize = 1 << 28;
/// Of larger ones so many pixels for each vertex: a number gone wrong asks for more.
const PIXELS_A_VERTEX: usize = 256;

const NO_VERTEX: u32 = u32::MAX;

/// The vertices of a range image in a host, one entry each.
#[derive(Clone, Copy, Debug, Default)]
pub struct Vertices<'a> {
    /// The pixels' rows.
    pub row: &'a [i32],
    /// The pixels' columns.
    pub col: &'a [i32],
    /// Coordinates in the host's frame.
    pub positions: &'a [DVec3],
    /// Colours, sRGB with straight alpha.
    pub colour: Option<&'a [[u8; 4]]>,
    /// Strength of the returned signal, in the sensor's own unit.
    pub intensity: Option<&'a [f32]>,
    /// Confidence of each sample, >= 0: how far it can be trusted.
    pub confidence: Option<&'a [f32]>,
}

/// The valid pixels of an image as vertices, row by row, in the sensor's frame, with the vertex attributes `range_row` and
/// `range_col` and, where the image has them, `colour`, `intensity` and `confidence`.
///
/// With `faces` also the triangles of [`triangulate::triangulate`] with its defaults, over the same vertices: those of
/// isolated pixels have none.
///
/// Cost: O(pixels), one thread. 56 bytes per valid pixel, with faces 88.
///
/// # Errors
/// Attributes of the wrong length, more than 2^31 rows or columns, a coordinate larger than [`magnitude::LARGEST`]. [`Error::OutOfMemory`].
/// [`Error::Cancelled`].
pub fn to_mesh(image: &RangeImage, faces: bool, progress: &Progress<'_>) -> Result<TriMesh> {
    progress.watch(|| {
        fits_attributes(image.rows(), image.cols())?;
        image.validate()?;
        let each = if faces { BYTES_WITH_FACES } else { BYTES_A_VERTEX };
        memory::foresee(image.valid_count(), each, "the vertices of", "valid pixels")?;
        let (SampleGrid { positions, pixels, .. }, triangles) = if faces {
            triangulate::over_samples(image, &TriangulateParams::default(), progress)?
        } else {
            (SampleGrid::new(image, progress)?, Vec::new())
        };
        magnitude::points("sample", &positions)?;
        let mut mesh = TriMesh::new(positions, triangles);
        mesh.vertex_attributes = image.attributes_of(&pixels, progress)?;
        mesh.crs = image.crs_of_frame();
        Ok(mesh)
    })
}

fn fits_attributes(rows: usize, cols: usize) -> Result<()> {
    if i32::try_from(rows.max(cols)).is_ok() {
        return Ok(());
    }
    Err(Error::input(format!("{rows} x {cols} pixels: a mesh's rows and columns may be at most {}", i32::MAX)))
}

/// The range image that a host's vertices are, however the user moved them. `world_from_host` places the host's frame in the world and may
/// be any affine transform that doesn't flatten. Pixels without a vertex are invalid.
///
/// Vertices may be moved, turned, scaled and mirrored all alike, by themselves or by `world_from_host`, within single precision. If each
/// then lies on its pixel's ray, the projection stays of its kind: its parameters are scaled and mirrored and the pose is rigid. If they
/// were stretched or sheared, or some edited one by one, it becomes a grid of points in single precision, seen from where it was. In either
/// case each sample lies in the world where its vertex does, to single precision. If so few anchors are left, or all in one line, that they
/// fix no turn, they must lie where they were or where `world_from_host` takes them. If none is left the vertices are taken to lie where
/// they were, which rays must confirm if the projection has any. Of anchors in one plane a mirror across it can't be told from a turn. If
/// vertices lie on its rays, that tells. Else it is taken for the turn.
///
/// Cost: O(pixels), one thread. 28 bytes per pixel at most.
///
/// # Errors
/// [`Error::Input`]: arrays of different lengths, a pixel outside of the grid or there twice, positions that are not finite, vertices that
/// are flattened, moved ones of which too few anchors are left, a confidence below 0, a grid far too large for its vertices.
/// [`Error::OutOfMemory`]. [`Error::Cancelled`].
///
/// Sources: the motion in closed form: \[Horn87\].
pub fn from_vertices(
    camera: &GridCamera,
    vertices: &Vertices<'_>,
    world_from_host: DAffine3,
    progress: &Progress<'_>,
) -> Result<RangeImage> {
    progress.watch(|| {
        camera.validate()?;
        check(camera, vertices)?;
        for column in [world_from_host.x_axis, world_from_host.y_axis, world_from_host.z_axis, world_from_host.w_axis] {
            magnitude::place("each column of world_from_host", column)?;
        }
        are_places(vertices.positions, progress)?;
        let (pixels, vertex_of) = grid(camera, vertices, progress)?;
        let pairs: Vec<[DVec3; 2]> = camera
            .anchors
            .iter()
            .map(|anchor| (anchor, vertex_of[anchor.row * camera.cols + anchor.col]))
            .filter(|(_, vertex)| *vertex != NO_VERTEX)
            .map(|(anchor, vertex)| [anchor.point, vertices.positions[vertex as usize]])
            .collect();
        drop(vertex_of);
        let placing = placed::Placing {
            rows: camera.rows,
            cols: camera.cols,
            projection: &camera.projection,
            pixels: &pixels,
            positions: vertices.positions,
            motion: motion::recognized(&pairs, &world_from_host)?,
            world_from_host,
            is_blind: pairs.is_empty() && !camera.anchors.is_empty() && !pixels.is_empty(),
        };
        let mut image = placing.image(progress)?;
        image.colour = spread(&image, vertices.colour, &pixels, progress)?;
        image.intensity = spread(&image, vertices.intensity, &pixels, progress)?;
        image.confidence = spread(&image, vertices.confidence, &pixels, progress)?;
        image.validate()?;
        Ok(image)
    })
}

/// Checks that there are as many entries as vertices, for those who look before they read: each list by what it holds.
///
/// # Errors
/// [`Error::Input`] naming the first that is longer or shorter.
pub fn of_one_length(vertices: usize, lists: &[(&str, usize)]) -> Result<()> {
    match lists.iter().find(|(_, length)| *length != vertices) {
        Some((what, length)) => Err(Error::input(format!("{vertices} vertices need {vertices} {what}, got {length}"))),
        None => Ok(()),
    }
}

/// Checks lengths, and the size of the grid.
fn check(camera: &GridCamera, vertices: &Vertices<'_>) -> Result<()> {
    let count = vertices.positions.len();
    let lengths = [
        ("rows", Some(vertices.row.len())),
        ("columns", Some(vertices.col.len())),
        ("colours", vertices.colour.map(<[_]>::len)),
        ("intensities", vertices.intensity.map(<[_]>::len)),
        ("confidences", vertices.confidence.map(<[_]>::len)),
    ];
    for (what, length) in lengths {
        of_one_length(count, &[(what, length.unwrap_or(count))])?;
    }
    let most = MOST_FOR_FEW.max(PIXELS_A_VERTEX.saturating_mul(count)).min(NO_VERTEX as usize - 1);
    match camera.rows.checked_mul(camera.cols) {
        Some(pixels) if pixels <= most => memory::foresee(pixels, BYTES_A_PIXEL, "a range image of", "pixels"),
        _ => Err(Error::input(format!(
            "the grid has {} x {} pixels, but {count} vertices: at most {most} pixels are made of so many",
            camera.rows, camera.cols
        ))),
    }
}

fn are_places(positions: &[DVec3], progress: &Progress<'_>) -> Result<()> {
    for range in progress.ranges(positions.len()) {
        for i in range? {
            magnitude::place("the vertex's place", positions[i])
                .map_err(|error| Error::input(format!("vertex {i}: {error}")))?;
        }
    }
    Ok(())
}

/// The pixel of each vertex, and the vertex of each pixel.
fn grid(camera: &GridCamera, vertices: &Vertices<'_>, progress: &Progress<'_>) -> Result<(Vec<u32>, Vec<u32>)> {
    let mut pixels = Vec::with_capacity(vertices.row.len());
    let mut vertex_of = vec![NO_VERTEX; camera.rows * camera.cols];
    for range in progress.ranges(vertices.row.len()) {
        for i in range? {
            let (row, col) = (vertices.row[i], vertices.col[i]);
            let inside = |place: i32, count: usize| usize::try_from(place).ok().filter(|&place| place < count);
            let (Some(row), Some(col)) = (inside(row, camera.rows), inside(col, camera.cols)) else {
                return Err(Error::input(format!(
                    "vertex {i} is pixel ({row}, {col}), but the grid has {} x {} pixels",
                    camera.rows, camera.cols
                )));
            };
            let pixel = row * camera.cols + col;
            if vertex_of[pixel] != NO_VERTEX {
                return Err(Error::input(format!(
                    "vertices {} and {i} are both pixel ({row}, {col}): the mesh was refined or joined with another \
                        and is no range image any more. Take it as it was before, or import it again.",
                    vertex_of[pixel]
                )));
            }
            vertex_of[pixel] = i as u32;
            pixels.push(pixel as u32);
        }
    }
    Ok((pixels, vertex_of))
}

/// An attribute of vertices as one of pixels.
fn spread<T: Copy + Default>(
    image: &RangeImage,
    entries: Option<&[T]>,
    pixels: &[u32],
    progress: &Progress<'_>,
) -> Result<Option<Vec<T>>> {
    let Some(entries) = entries else { return Ok(None) };
    let mut spread = vec![T::default(); image.len()];
    for range in progress.ranges(pixels.len()) {
        range?.for_each(|i| spread[pixels[i] as usize] = entries[i]);
    }
    Ok(Some(spread))
}

#[cfg(test)]
mod tests;
