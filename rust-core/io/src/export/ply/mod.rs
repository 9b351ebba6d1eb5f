//! PLY files: meshes and points with all their attributes, range grids in the layout of the Stanford archive.
//!
//! Cost: memory for one chunk per thread beyond what is written. The time is that of the disk for binary files. Within one of our thread
//! pools chunks are encoded in parallel. The bytes do not depend on the number of threads. `progress` counts elements, about every quarter
//! megabyte.

mod columns;
mod layout;
mod options;
mod parts;
mod pieces;
mod rows;

use std::io::Write;
use std::path::Path;

use glam::{DAffine3, DMat3, DQuat, DVec3};

use self::columns::{attributes, channels, element, faces, floats, header, positions};
use self::rows::{Column, Data, Element, NO_VERTEX};
use super::atomic::{Staged, stage};
use base::error::{Error, Result};
use base::memory;
use base::progress::Progress;
use image::range_image::{Projection, RangeImage, Samples, Viewing};
use mesh::point_cloud::PointCloud;
use mesh::sink::MeshSink;
use mesh::{Crs, QuadMesh, TriMesh};

pub use self::options::{PlyEncoding, PlyOptions, PositionType};
pub use self::parts::part_path;
pub use self::pieces::write_ply_in_pieces;

/// Writes a mesh with all its attributes: `colour` as red, green, blue and alpha (uchar), floats as float, integers as
/// int, flags as uchar. In parts as [`write_ply_in_pieces`] makes them.
///
/// # Errors
/// The mesh isn't valid ([`TriMesh::validate`]), parts that are to be text, a coordinate doesn't fit the precision, an attribute has a name
/// that the format can't hold or that is taken. [`Error::Io`]. [`Error::Cancelled`]. Then no file is left, and one that was there is
/// untouched.
pub fn write_ply(path: &Path, mesh: &TriMesh, options: impl Into<PlyOptions>, progress: &Progress<'_>) -> Result<()> {
    let options = options.into();
    mesh.validate()?;
    let mut vertices = element("vertex", mesh.positions.len());
    let breaks_bound = mesh.rounding_room.is_some_and(|room| mesh.single_rounding() > room);
    let kind = match options.positions {
        PositionType::Auto if breaks_bound => PositionType::Double,
        kind => kind,
    };
    if options.part_triangles > 0 {
        let options = PlyOptions { positions: kind, ..options };
        begin(progress, mesh.positions.len() + mesh.triangles.len());
        let hand_over = |sink: &mut dyn MeshSink| mesh.hand_over(sink, progress);
        return progress.watch(|| write_ply_in_pieces(path, options, hand_over, progress));
    }
    vertices.columns.push(positions(&mesh.positions, kind)?);
    attributes(&mut vertices, &mesh.vertex_attributes)?;
    let mut faces = faces(&mesh.triangles, mesh.triangles.len());
    attributes(&mut faces, &mesh.face_attributes)?;
    begin(progress, mesh.positions.len() + mesh.triangles.len());
    write(path, "", &[vertices, faces], &options, mesh.crs.as_ref(), progress)?.keep()
}

/// Writes a mesh of quads with all its attributes as [`write_ply`] does, texture coordinates as the properties s and t.
///
/// # Errors
/// A coordinate that isn't finite, an index out of range, an attribute of the wrong length. Else as [`write_ply`].
pub fn write_quads_ply(
    path: &Path,
    mesh: &QuadMesh,
    options: impl Into<PlyOptions>,
    progress: &Progress<'_>,
) -> Result<()> {
    let options = options.into();
    mesh.validate()?;
    let mut vertices = element("vertex", mesh.positions.len());
    vertices.columns.push(positions(&mesh.positions, options.positions)?);
    if !mesh.uvs.is_empty() {
        vertices.columns.push(Column { declaration: floats(&["s", "t"]), data: Data::Pairs(&mesh.uvs) });
    }
    attributes(&mut vertices, &mesh.vertex_attributes)?;
    let mut faces = element("face", mesh.quads.len());
    faces.columns.push(Column {
        declaration: "property list uchar int vertex_indices\n".to_owned(),
        data: Data::Quad(&mesh.quads),
    });
    attributes(&mut faces, &mesh.face_attributes)?;
    begin(progress, mesh.positions.len() + mesh.quads.len());
    write(path, "", &[vertices, faces], &options, mesh.crs.as_ref(), progress)?.keep()
}

/// Writes points with their normals, colours and intensities. The pose is not written: place them first, or write a `.conf`. Nor is
/// the coordinate reference system of points with a pose, which is that of the world.
///
/// # Errors
/// An attribute of another length than the points, a coordinate that isn't finite or doesn't fit the precision. [`Error::Io`].
/// [`Error::Cancelled`]. Then no file is left, and one that was there is untouched.
pub fn write_points_ply(
    path: &Path,
    cloud: &PointCloud,
    options: impl Into<PlyOptions>,
    progress: &Progress<'_>,
) -> Result<()> {
    let options = options.into();
    let count = cloud.positions.len();
    if let Some(i) = cloud.positions.iter().position(|p| !p.is_finite()) {
        return Err(Error::input(format!("point {i} has a coordinate that is not finite: {}", cloud.positions[i])));
    }
    let lengths = [
        ("normals", cloud.normals.as_ref().map(Vec::len)),
        ("colours", cloud.colour.as_ref().map(Vec::len)),
        ("intensities", cloud.intensity.as_ref().map(Vec::len)),
    ];
    if let Some((what, Some(length))) = lengths.iter().find(|(_, length)| length.is_some_and(|n| n != count)) {
        return Err(Error::input(format!("{count} points need {count} {what}, got {length}")));
    }
    let mut vertices = element("vertex", count);
    vertices.columns.push(positions(&cloud.positions, options.positions)?);
    if let Some(normals) = &cloud.normals {
        vertices.columns.push(Column { declaration: floats(&["nx", "ny", "nz"]), data: Data::Floats(normals) });
    }
    if let Some(colour) = &cloud.colour {
        vertices.columns.push(Column { declaration: channels(""), data: Data::Colour(colour) });
    }
    if let Some(intensity) = &cloud.intensity {
        vertices.columns.push(Column { declaration: floats(&["intensity"]), data: Data::F32(intensity) });
    }
    begin(progress, count);
    write(path, "", &[vertices], &options, cloud.crs_of_frame().as_ref(), progress)?.keep()
}

/// Writes a range image as a range grid in the layout of the Stanford archive: the points of the valid pixels in the order of the pixels,
/// then a cell per pixel, row by row, that names its point or none. Colour, intensity and confidence become properties of the points.
///
/// Readers take such a grid to be seen along -z. The points are written in the frame of [`range_grid_frame`], where that is so. Place the
/// file with `image.world_from_sensor * range_grid_frame(image)?`. Coordinates are single precision, and in no coordinate reference system.
///
/// # Errors
/// As [`range_grid_frame`]. An attribute of the wrong length. A coordinate beyond single precision. [`Error::Io`]. [`Error::Cancelled`].
/// Then no file is left, and one that was there is untouched.
pub fn write_range_grid_ply(
    path: &Path,
    image: &RangeImage,
    options: impl Into<PlyOptions>,
    progress: &Progress<'_>,
) -> Result<()> {
    begin(progress, elements_of(image));
    stage_grid(path, image, &options.into(), progress)?.keep()
}

/// Numbers of pixels and points.
const BYTES_A_SAMPLE: f64 = 21.0;

/// Number of things that [`stage_grid`] counts: points and cells.
pub(super) fn elements_of(image: &RangeImage) -> usize {
    image.valid_count() + image.len()
}

/// Writes a range grid, but for its name, as part of a call whose progress has begun.
pub(super) fn stage_grid(
    path: &Path,
    image: &RangeImage,
    options: &PlyOptions,
    progress: &Progress<'_>,
) -> Result<Staged> {
    image.validate()?;
    let picked = [image.colour.is_some(), image.intensity.is_some(), image.confidence.is_some()];
    let each = BYTES_A_SAMPLE + 4.0 * picked.into_iter().filter(|is| *is).count() as f64;
    memory::expect_each(image.valid_count(), each, 4.0 * image.len() as f64, "writing", "valid pixels")?;
    let mut valid = Vec::with_capacity(image.valid_count());
    valid.extend((0..image.len()).filter(|&i| image.is_valid(i)));
    let grid_from_sensor = range_grid_frame(image)?.inverse();
    let points: Vec<[f32; 3]> = match image.samples() {
        Samples::Points(points) if grid_from_sensor == DAffine3::IDENTITY => valid.iter().map(|&i| points[i]).collect(),
        _ => {
            let place = |i| grid_from_sensor.transform_point3(image.point_in_sensor(i)).as_vec3().to_array();
            valid.iter().map(|&i| place(i)).collect()
        }
    };
    if let Some(i) = points.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
        let (row, col) = (valid[i] / image.cols(), valid[i] % image.cols());
        return Err(Error::input(format!("{}: pixel ({row}, {col}): {TOO_LARGE}", image.called())));
    }
    let mut cells = vec![NO_VERTEX; image.len()];
    for (vertex, &pixel) in valid.iter().enumerate() {
        cells[pixel] = vertex as u32;
    }
    let colour = image.colour.as_ref().map(|all| pick(all, &valid));
    let intensity = image.intensity.as_ref().map(|all| pick(all, &valid));
    let confidence = image.confidence.as_ref().map(|all| pick(all, &valid));

    let mut vertices = Element { blank_at_end: true, ..element("vertex", points.len()) };
    vertices.columns.push(Column { declaration: floats(&["x", "y", "z"]), data: Data::Floats(&points) });
    if let Some(colour) = &colour {
        vertices.columns.push(Column { declaration: channels(""), data: Data::Colour(colour) });
    }
    for (name, values) in [("intensity", &intensity), ("confidence", &confidence)] {
        if let Some(values) = values {
            vertices.columns.push(Column { declaration: floats(&[name]), data: Data::F32(values) });
        }
    }
    let mut grid = Element { blank_at_end: true, ..element("range_grid", cells.len()) };
    grid.columns
        .push(Column { declaration: "property list uchar int vertex_indices\n".to_owned(), data: Data::Cell(&cells) });
    let size = format!("obj_info is_mesh 0\nobj_info num_cols {}\nobj_info num_rows {}\n", image.cols(), image.rows());
    write(path, &size, &[vertices, grid], options, None, progress)
}

/// The frame a range grid is written in, as `sensor_from_grid`: the sensor's own, turned so that it looks along -z. For parallel rays along
/// -z this is the identity. For a pinhole half a turn about x. For rays from a point the turn that brings the mean direction to -z.
///
/// # Errors
/// [`Error::Input`] if the rays have no mean direction, as in a full panorama: a range grid can't hold it.
pub fn range_grid_frame(image: &RangeImage) -> Result<DAffine3> {
    let direction = match image.projection() {
        Projection::Orthographic { .. } => DVec3::NEG_Z,
        // Exactly half a turn: no coordinate changes but in sign.
        Projection::Pinhole { .. } => {
            return Ok(DAffine3::from_mat3(DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0))));
        }
        Projection::PointGrid(Viewing::Parallel(direction)) => direction.normalize_or_zero(),
        projection @ (Projection::Spherical { .. } | Projection::PointGrid(Viewing::From(_))) => {
            let valid = (0..image.len()).filter(|&i| image.is_valid(i));
            let (sum, count) = valid.fold((DVec3::ZERO, 0_usize), |(sum, count), i| {
                (sum + projection.view_direction(image.point_in_sensor(i)), count + 1)
            });
            // Rays more than a quarter turn apart would face backwards: half of the sphere has a mean of length 1/2.
            if count > 0 && sum.length() < 0.5 * count as f64 {
                let problem = "its rays go round more than half a sphere, which a range grid can't hold: write points";
                return Err(Error::input(format!("{}: {problem}", image.called())));
            }
            sum.normalize_or(DVec3::NEG_Z)
        }
    };
    if direction == DVec3::NEG_Z {
        return Ok(DAffine3::IDENTITY);
    }
    Ok(DAffine3::from_quat(DQuat::from_rotation_arc(DVec3::NEG_Z, direction)))
}

const TOO_LARGE: &str = "a coordinate is too large for single precision: move the scan closer to the origin";

fn pick<T: Copy>(all: &[T], places: &[usize]) -> Vec<T> {
    places.iter().map(|&i| all[i]).collect()
}

pub(super) fn begin(progress: &Progress<'_>, elements: usize) {
    progress.plan(&[("writing", 1.0)]);
    progress.stage(0, elements as u64);
}

fn write(
    path: &Path,
    info: &str,
    elements: &[Element<'_>],
    options: &PlyOptions,
    crs: Option<&Crs>,
    progress: &Progress<'_>,
) -> Result<Staged> {
    let header = header(info, elements, options, crs)?;
    stage(path, progress, |file| {
        file.write_all(header.as_bytes()).map_err(|e| Error::io(path, e))?;
        for element in elements {
            element.write(file, path, options.encoding, progress)?;
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests;
