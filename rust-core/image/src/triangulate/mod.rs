//! Step-discontinuity triangulation of the pixel grid.
//!
//! 1. collect the valid pixels with their neighbours (`range_image::samples`)
//! 2. median spacing, and from it the longest edge (`range_image::spacing`)
//! 3. up to two triangles a cell of 2 x 2 pixels (`cells`)
//! 4. confidence: cosine to the ray, ramped to zero at jumps and borders (`range_image::confidence`)
//! 5. drop the pixels without a triangle

// 3. which triangles a cell gets, and their orientation
mod cells;

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;

use crate::range_image::samples::SampleGrid;
use crate::range_image::spacing::{EdgeLimit, Spacing};
use crate::range_image::{RangeImage, confidence, repeats};
use base::error::{Error, Result, Shown};
use base::magnitude;
use base::memory;
use base::operation::{DataKind, Operation};
use base::params::{angle, length};
use base::progress::Progress;
use mesh::{Attribute, TriMesh};

/// At the peak. Measured.
const BYTES_A_SAMPLE: f64 = 82.0;

/// The declaration of the operation.
pub const OPERATION: Operation = Operation {
    name: "triangulate",
    text: "Makes triangles of a range image, without those across jumps.",
    since: "0.1",
    takes: &[DataKind::Image],
    gives: &[DataKind::Mesh],
    params: Some(SCHEMA),
    report: &[],
    command: None,
    blender: None,
    meshlab: None,
};

base::params! {
    /// How range images become surfaces: limits of the step-discontinuity triangulation.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct TriangulateParams of "triangulate" {
        /// Longest edge between neighbouring samples. Larger values bridge jumps, smaller ones open holes.
        edge_limit: Option<f64> = length("Edge limit")
            .from_data("3.4 times the median distance of neighbouring samples of each scan, in rows and columns apart where pixels are not square").above(0.0),
        /// Largest angle between a triangle's normal and the direction to the sensor. Smaller values drop surfaces seen at a grazing angle.
        grazing_limit: f64 = angle("Grazing limit").default(FRAC_PI_2).above(0.0).at_most(FRAC_PI_2),
    }
}

/// The triangulated surface of a range image, in the sensor's frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RangeSurface {
    /// Points of the vertices: the valid pixels that have a triangle.
    pub positions: Vec<DVec3>,
    /// Index of each vertex's pixel.
    pub pixels: Vec<u32>,
    /// Trust in each vertex, >= 0, ramped to zero at jumps and borders.
    pub confidence: Vec<f32>,
    /// Three vertices per triangle, counter-clockwise seen from the sensor.
    pub triangles: Vec<[u32; 3]>,
    /// Median distance of neighbouring samples. The larger one of rows and columns if pixels are not square.
    pub spacing: f64,
    /// Valid pixels without a triangle.
    pub isolated_pixels: usize,
}

impl RangeSurface {
    /// The surface as a mesh, with the vertex attributes `range_row` and `range_col`, the `colour` and `intensity` that the
    /// image it was made of has, and `confidence`.
    ///
    /// # Errors
    /// [`base::error::Error::Cancelled`].
    pub fn into_mesh(self, image: &RangeImage, progress: &Progress<'_>) -> Result<TriMesh> {
        progress.watch(|| {
            let mut attributes = image.attributes_of(&self.pixels, progress)?;
            attributes.retain(|attribute| attribute.name != "confidence");
            attributes.push(Attribute::f32("confidence", self.confidence));
            let mut mesh = TriMesh::new(self.positions, self.triangles);
            mesh.vertex_attributes = attributes;
            mesh.crs = image.crs_of_frame();
            Ok(mesh)
        })
    }
}

/// Triangulates the pixel grid, leaving out jumps.
///
/// Each cell of 2 x 2 pixels is split by its shorter diagonal in space. A cell with one invalid corner gives one triangle. A triangle is
/// left out if one of its edges is longer than the limit, or if it is seen at a grazing angle above the limit. It is also left out if it is
/// seen from behind or edge-on. Neighbouring pixels of a point grid may lie in another order than the grid's (a fold), and then one hides
/// behind the other. The default edge limit is 3.4 times the median distance of neighbours. If rays fan out from a point (pinhole,
/// spherical, point grids seen from a point) it is 3.4 times the median of distance by range, times the range of the edge's nearer end,
/// since sampling thins out with range. If pixels are not square (one side, across the rays, is longer than the other by
/// [`SQUARE`](crate::range_image::pitch::SQUARE) or more), rows and columns have a median each. Edges along the longer side and diagonals
/// are compared with its own, edges along the other one with the geometric mean of both. If values are multiples of a step that is longer
/// than the spacing, rounding alone moves neighbours a step apart. Edges may then be longer by one and a half steps.
///
/// Guarantees: Triangles turn counter-clockwise seen from the sensor. There is no zero-area triangle. Every vertex has a triangle. Vertices
/// are in pixel order. Without own confidences a vertex's confidence is the cosine between its normal and its ray, with them it is the
/// given one. It is multiplied by a ramp that is 0 at vertices not surrounded by eight triangles and reaches 1 after
/// [`confidence::RAMP_PIXELS`] pixels.
///
/// Cost: O(pixels), one thread. About 120 bytes per valid pixel.
///
/// # Errors
/// An image that gives no triangle. Parameters out of range, attributes of the wrong length, more than 2^32 - 2 pixels, or a coordinate
/// larger than [`magnitude::LARGEST`]. [`base::Error::OutOfMemory`]. [`base::Error::Cancelled`].
///
/// Sources: contract of section 0. The ramp: \[CL96\].
pub fn triangulate(image: &RangeImage, params: &TriangulateParams, progress: &Progress<'_>) -> Result<RangeSurface> {
    let surface = progress.watch(|| triangulate_samples(image, samples(image, params, progress)?, params, progress))?;
    if surface.triangles.is_empty() { Err(no_triangle(image, params)) } else { Ok(surface) }
}

/// Says that an image gives no triangle, and what may help.
pub fn no_triangle(image: &RangeImage, params: &TriangulateParams) -> Error {
    let valid = image.valid_count();
    let remedy = match params.edge_limit {
        _ if valid < 3 => "Check how the image was made: pixels of value NaN are not measured.".to_owned(),
        Some(limit) => format!("Raise edge_limit, which is {}, or leave it out to have it measured.", Shown(limit)),
        None if params.grazing_limit < FRAC_PI_2 => {
            format!("Raise grazing_limit, which is {} degrees.", Shown(params.grazing_limit.to_degrees()))
        }
        None => {
            "Check that neighbouring pixels hold neighbouring points, seen from where the image was taken.".to_owned()
        }
    };
    Error::input(format!(
        "{}: no triangle comes of its {} x {} pixels, of which {valid} are valid. A triangle needs three \
            neighbouring pixels that no jump separates. {remedy}",
        image.called(),
        image.rows(),
        image.cols()
    ))
}

/// [`triangulate`] with the samples of the image moved along their rays. The surface may be empty.
///
/// # Errors
/// As [`triangulate`].
pub(crate) fn triangulate_samples(
    image: &RangeImage,
    grid: SampleGrid,
    params: &TriangulateParams,
    progress: &Progress<'_>,
) -> Result<RangeSurface> {
    progress.watch(|| {
        let (cells, spacing) = cells_of(image, &grid, params, progress)?;
        magnitude::points("sample", &grid.positions)?;
        let spacing = match spacing {
            Some(spacing) => spacing,
            None => Spacing::of(image, &grid, progress)?,
        }
        .larger();
        let mut weights = confidence::ramp(&grid, |k| cells.is_interior(k), progress)?;
        confidence::weigh(image, &grid, &mut weights, progress)?;
        keep_used(grid, cells, weights, spacing, progress)
    })
}

/// The triangles of [`triangulate`] over all valid pixels, also those that have none.
///
/// # Errors
/// As [`triangulate`].
pub(crate) fn over_samples(
    image: &RangeImage,
    params: &TriangulateParams,
    progress: &Progress<'_>,
) -> Result<(SampleGrid, Vec<[u32; 3]>)> {
    let grid = samples(image, params, progress)?;
    let (cells, _) = cells_of(image, &grid, params, progress)?;
    Ok((grid, cells.triangles))
}

/// The triangles of [`triangulate`] over pixel indices, without what else it finds. Also the valid pixels, rising.
///
/// # Errors
/// As [`triangulate`]. [`base::Error::Cancelled`].
#[doc(hidden)]
pub fn triangles_over_pixels(
    image: &RangeImage,
    params: &TriangulateParams,
    progress: &Progress<'_>,
) -> Result<(Vec<[u32; 3]>, Vec<u32>)> {
    let (SampleGrid { positions, pixels, .. }, mut triangles) = over_samples(image, params, progress)?;
    if triangles.is_empty() {
        // Lengths of edges may be too large to be compared.
        magnitude::points("sample", &positions)?;
    }
    for triangle in &mut triangles {
        *triangle = triangle.map(|k| pixels[k as usize]);
    }
    Ok((triangles, pixels))
}

/// The samples of an image that can be triangulated.
///
/// # Errors
/// As [`triangulate`].
pub(crate) fn samples(image: &RangeImage, params: &TriangulateParams, progress: &Progress<'_>) -> Result<SampleGrid> {
    expect(image, params)?;
    SampleGrid::new(image, progress)
}

/// Checks image and parameters, and whether there is memory for them.
///
/// # Errors
/// As [`triangulate`].
pub(crate) fn expect(image: &RangeImage, params: &TriangulateParams) -> Result<()> {
    params.validate()?;
    image.validate()?;
    let columns = size_of::<u32>() as f64 * image.cols() as f64;
    memory::expect_each(image.valid_count(), BYTES_A_SAMPLE, columns, "triangulating", "valid pixels")
}

/// The triangles of samples and, where the edge limit comes from it, their median spacing.
fn cells_of(
    image: &RangeImage,
    grid: &SampleGrid,
    params: &TriangulateParams,
    progress: &Progress<'_>,
) -> Result<(cells::Cells, Option<Spacing>)> {
    let (limit, spacing) = match params.edge_limit {
        Some(length) => (EdgeLimit::length(length), None),
        None => {
            let spacing = Spacing::of(image, grid, progress)?;
            // If pixels are repeated, most neighbours are equal, and those that are not lie a whole block apart.
            let limit = match repeats::undone(image) {
                Some(own_size) => {
                    let grid = SampleGrid::new(&own_size, progress)?;
                    let spacing = Spacing::of(&own_size, &grid, progress)?;
                    EdgeLimit::from_data(&own_size, &grid, spacing, progress)?
                }
                None => EdgeLimit::from_data(image, grid, spacing, progress)?,
            };
            (limit, Some(spacing))
        }
    };
    let cells = cells::triangulate(image.projection(), grid, &limit, params.grazing_limit, progress)?;
    Ok((cells, spacing))
}

/// The surface without the samples that have no triangle.
fn keep_used(
    grid: SampleGrid,
    cells: cells::Cells,
    weights: Vec<f32>,
    spacing: f64,
    progress: &Progress<'_>,
) -> Result<RangeSurface> {
    let samples = grid.len();
    let SampleGrid { mut positions, mut pixels, up: mut new_index, .. } = grid;
    let (mut triangles, mut confidence) = (cells.triangles, weights);
    let mut used = 0;
    for block in progress.ranges(samples) {
        for k in block? {
            if cells.surroundings[k].is_used() {
                new_index[k] = used as u32;
                (positions[used], pixels[used], confidence[used]) = (positions[k], pixels[k], confidence[k]);
                used += 1;
            }
        }
    }
    if used < samples {
        positions.truncate(used);
        pixels.truncate(used);
        confidence.truncate(used);
        for triangle in &mut triangles {
            *triangle = triangle.map(|k| new_index[k as usize]);
        }
    }
    Ok(RangeSurface { positions, pixels, confidence, triangles, spacing, isolated_pixels: samples - used })
}

#[cfg(test)]
mod tests;
