//! Adaptive quad grids: one range image -> a regular grid of quads that is dense where the surface bends. \[GSB97\]
//!
//! | stage | file | in -> out |
//! |---|---|---|
//! | 1 | `gaps` | image -> image without single invalid pixels |
//! | 2 | `density` | ranges -> 8-bit curvature -> how much each pixel attracts vertices |
//! | 3 | `tiles` | image -> tiles that share a line of pixels |
//! | 4 | `curves` | density -> vertical curves |
//! | 5 | `rows` | density along curves -> vertices |
//! | 6 | `stitch`, `snap` | vertices -> one grid of pixels without folds, drawn onto the surface's border |
//! | 7 | `measure`, `quad_distance` | grid and image -> errors, and the better diagonal of each quad |
//! | 8 | `place`, `grid` | grid -> quads and triangles in space |
//! | 9 | `spline` | grid -> B-spline surface |
//!
//! `choose` runs stages 4 to 7 again and again where an error is asked for.
//!
//! Differences from the paper: (1) curvature is measured in a share of the depth extent, so the user's unit does not matter. (2) The
//! density is a power of the curvature, not its logarithm, with a floor spread evenly. The paper's log x gives curvatures 0 and 1 no
//! density at all. Of 96 real scans it met a good part no better than a uniform grid does. `exponent = 0` is log(1 + x). (3) The density is
//! averaged over a few quads, so lines run smoothly. `smoothing = 0` is the paper's. (4) No vertex is repeated and no quad folds over. (5)
//! Invalid pixels are masked: they attract nothing (unless given a curvature), vertices beside the surface move onto it, and quads on the
//! background are left out. (6) If the uniform grid of the same size lies nearer to the image, gentler densities and one without smoothing
//! are tried, and at last the uniform grid is the answer.

mod operation;
mod params;

// 1. single-pixel gaps
mod gaps;

// 2. curvature and density
mod density;

// 3. tiles
mod tiles;

// 4. vertical curves
mod curves;

// 5. rows
mod rows;

// 6. one grid
mod snap;
mod stitch;

// 7. errors
mod measure;
mod quad_distance;

// 8. the result
mod grid;
mod place;

// 9. a surface through the grid
mod spline;

// Rows and columns for an error
mod choose;

pub use grid::QuadGrid;
pub use operation::OPERATION;
pub use params::{QuadParams, SCHEMA, Target};
pub use spline::{Fit, OPERATION as SPLINE_OPERATION, SCHEMA as SPLINE_SCHEMA, Spline, SplineParams};

use std::borrow::Cow;

use rayon::prelude::*;

use base::error::{Error, Result, Shown};
use base::magnitude::LARGEST;
use base::memory;
use base::progress::{Progress, Seconds};
use image::range_image::{RangeImage, Samples};
use measure::{Judge, Measured};
use mesh::dump::{self, Stage};
use mesh::{Attribute, Crs};
use place::Vertices;
use stitch::Net;
use tiles::Layout;

/// At the peak. Measured.
const BYTES_A_PIXEL: f64 = 3.0;
/// Of the grid with the uniform one that it is compared with.
const BYTES_A_VERTEX: f64 = 175.0;

base::report! {
    /// The figures of a quad grid. Errors are distances along the samples' rays to the planes of the triangles of the pixels' quads, over
    /// all valid pixels of the image but those missed, with each quad cut along its better diagonal. On the background the grid continues
    /// the surface.
    #[derive(Default)]
    pub struct QuadReport {
        /// Tiles from top to bottom and from left to right.
        tiles: [usize; 2] = count("Tiles").parts(&[
            ("tiles_down", "Tiles from top to bottom."),
            ("tiles_across", "Tiles from left to right."),
        ]),
        /// Difference between the farthest and the nearest range of the valid pixels.
        depth_extent: f64 = length("Depth extent"),
        /// Mean error as a share of the depth extent, the paper's relative error. 0 where all ranges are equal.
        relative_error: f64 = ratio("Relative error"),
        /// Relative error of the uniform grid of the same size.
        uniform_relative_error: f64 = ratio("Of the uniform grid"),
        /// Root of the mean square error.
        rms_error: f64 = length("RMS error"),
        /// Root of the mean square error of the uniform grid.
        uniform_rms_error: f64 = length("RMS error of the uniform grid"),
        /// Largest error.
        max_error: f64 = length("Largest error"),
        /// Largest error of the uniform grid.
        uniform_max_error: f64 = length("Largest error of the uniform grid"),
        /// Whether the result is the uniform grid, as the adaptive one lay no nearer. Vertices snapped to the border moved all the same.
        is_uniform: bool = flag("Uniform"),
        /// Valid pixels of the image.
        valid_pixels: usize = count("Valid pixels"),
        /// Valid pixels whose rays do not meet the planes of their quad in front of the sensor. They have no error.
        missed_pixels: usize = count("Missed pixels"),
        /// Missed pixels of the uniform grid.
        uniform_missed_pixels: usize = count("Missed by the uniform grid"),
        /// Invalid pixels that were filled.
        gaps_filled: usize = count("Gaps filled"),
        /// Vertices that were moved so that no quad folds over.
        unfolded: usize = count("Vertices unfolded"),
        /// Vertices that were moved from the background onto the border of the surface.
        snapped: usize = count("Vertices snapped"),
        /// Quads of the mesh: those that are not on the background.
        quads: usize = count("Quads"),
        /// Wall-clock seconds by the name of the stage.
        seconds: Seconds = stages(),
    }
}

/// Images of fewer pixels, about a millisecond of work, are left to one thread.
const PIXELS_FOR_THREADS: usize = 1 << 15;

base::stages! {
    /// Stages with their shares of the time.
    PLAN:
    FILLING = "filling gaps", 0.15;
    CURVATURE = "curvature", 0.15;
    SAMPLING = "sampling", 0.3;
    MEASURING = "measuring the error", 0.4;
}

/// A grid with its figures, not yet in its final form.
struct Candidate {
    layout: Layout,
    net: Net,
    vertices: Vertices,
    measured: Measured,
    uniform: Measured,
    is_uniform: bool,
    unfolded: usize,
    snapped: usize,
}

/// Data that all candidates share.
struct Source<'a> {
    image: &'a RangeImage,
    filled: &'a RangeImage,
    params: &'a QuadParams,
    density: Vec<u8>,
    extent: f64,
    /// Error of a pixel that a grid does not meet, when grids are compared: the depth extent or, if all samples are equally far, their
    /// distance.
    missed: f64,
    judge: Judge,
}

/// Makes a quad grid of an image.
///
/// # Guarantees
/// * The grid is regular: every vertex has its own pixel, and seen on the pixels no quad folds over. See [`QuadGrid`]. Without a target it
///   has `(rows - 1) * tiles_down + 1` rows and `(columns - 1) * tiles_across + 1` columns.
/// * Its mean error (with a target, the error that the target names) is at most that of the uniform grid of the same size, if
///   a pixel that is missed counts as far off as the depth extent.
/// * With a target, that error is at most the one asked for, as measured. Up to one vertex per pixel may be needed. Only pixels that are
///   missed even then have none.
/// * The same image gives the same grid for any number of threads, and in any unit that is a power of two times another.
///
/// # Cost
/// O(pixels). 2 bytes per pixel beside the image, 12 more with many columns, and a copy of the image if it has gaps to fill. With a target
/// about 10 times the time.
///
/// # Errors
/// Parameters out of range. Fewer pixels than vertices along a side, fewer than 2 x 2 pixels, none valid, attributes of the wrong length, a
/// world in degrees. [`Error::Cancelled`].
///
/// Source: \[GSB97\], with the differences listed at the module.
pub fn run(image: &RangeImage, params: &QuadParams, progress: &Progress<'_>) -> Result<QuadGrid> {
    params.validate()?;
    image.validate()?;
    Crs::lengths(image.crs.as_ref())?;
    let size = [image.rows(), image.cols()];
    if size[0] < 2 || size[1] < 2 {
        return Err(Error::input(format!(
            "a quad grid needs at least 2 x 2 pixels, the image has {} x {}",
            size[0], size[1]
        )));
    }
    if size[0].max(size[1]) > 1 << 26 {
        return Err(Error::input(format!("{} x {} pixels: a side may have at most {}", size[0], size[1], 1 << 26)));
    }
    let pixels = BYTES_A_PIXEL * image.len() as f64;
    memory::expect(pixels, || format!("a grid over {} pixels", image.len()), "use fewer")?;
    progress.plan(PLAN);
    // Waking threads would take longer than they save.
    let threads = if image.len() < PIXELS_FOR_THREADS { 1 } else { params.threads };
    let pool = base::threads::pool(threads)?;
    progress.run(&pool, || stages(image, params, progress))
}

fn stages(image: &RangeImage, params: &QuadParams, progress: &Progress<'_>) -> Result<QuadGrid> {
    progress.stage(FILLING, 1);
    let (filled, gaps_filled) = gaps::fill(image, params.gap_passes, params.gap_neighbours, progress)?;
    let ranges = ranges(&filled);
    let extent = depth_extent(image, &ranges)?;
    progress.lap("filling gaps");

    progress.stage(CURVATURE, image.len() as u64);
    let density = density::image(&ranges, image.cols(), extent, params, progress)?;
    drop(ranges);
    progress.lap("curvature");

    let judge = match params.target {
        Target::AsGiven => Judge::Mean,
        Target::Rms(_) => Judge::Rms,
        Target::Max(_) => Judge::Max,
    };
    let first_range = || (0..image.len()).find_map(|i| image.is_valid(i).then(|| image.range(i).abs()));
    let missed = if extent > 0.0 { extent } else { first_range().unwrap_or(0.0) };
    let source = Source { image, filled: &filled, params, density, extent, missed, judge };
    progress.stage(SAMPLING, 1);
    let mut chosen = match params.target {
        Target::AsGiven => source.candidate(source.layout([params.rows, params.columns])?, progress)?,
        Target::Rms(error) | Target::Max(error) => choose::smallest(&source, error, progress)?,
    };
    progress.lap("measuring the error");
    source.finish(&mut chosen, gaps_filled, progress)
}

impl Source<'_> {
    /// The error that a grid is chosen by.
    fn judged(&self, measured: &Measured) -> f64 {
        measured.judged(self.judge, self.missed)
    }

    /// Tiles as given or by default, with so many vertices along their sides.
    fn layout(&self, vertices: [usize; 2]) -> Result<Layout> {
        let size = [self.image.rows(), self.image.cols()];
        let tiles = |given: Option<usize>, pixels: usize| given.unwrap_or((pixels / PIXELS_A_TILE).max(1));
        let tiles = [tiles(self.params.tiles_down, size[0]), tiles(self.params.tiles_across, size[1])];
        Layout::new(size, tiles, vertices)
    }

    /// Stages 4 to 7: the adaptive grid of a layout, or the uniform one if that lies nearer.
    fn candidate(&self, layout: Layout, progress: &Progress<'_>) -> Result<Candidate> {
        let size = [self.image.rows(), self.image.cols()];
        let vertices = layout.rows() as f64 * layout.cols() as f64;
        let grid = || format!("a grid of {} x {} vertices", layout.rows(), layout.cols());
        memory::expect(BYTES_A_VERTEX * vertices, grid, "ask for fewer")?;
        let uniform_net = Net::uniform(layout.rows(), layout.cols(), size);
        let uniform_vertices = place::place(self.filled, &uniform_net, progress)?;
        let mut best: Option<Measured> = None;
        for (floor, smoothing) in TRIES {
            let (floor, smoothing) = (self.params.floor * floor, self.params.smoothing * smoothing);
            let (net, unfolded, snapped) = self.adaptive(&layout, floor, smoothing, progress)?;
            let vertices = place::place(self.filled, &net, progress)?;
            dump(&net, &vertices)?;
            progress.lap("sampling");
            progress.stage(MEASURING, layout.rows() as u64);
            let (measured, uniform) = match best.take() {
                None => {
                    let grids = [(&net, &vertices), (&uniform_net, &uniform_vertices)];
                    measure::measure(self.image, self.missed, grids, self.judge, progress)?.into()
                }
                Some(uniform) => {
                    let [measured] =
                        measure::measure(self.image, self.missed, [(&net, &vertices)], self.judge, progress)?;
                    (measured, uniform)
                }
            };
            if self.judged(&measured) < self.judged(&uniform) {
                return Ok(Candidate {
                    layout,
                    net,
                    vertices,
                    measured,
                    uniform,
                    is_uniform: false,
                    unfolded,
                    snapped,
                });
            }
            best = Some(uniform);
        }
        let uniform = best.expect("at least one density was tried");
        // The mask is followed also by the uniform grid, if that does no harm.
        let mut net = uniform_net.clone();
        let snapped = snap::snap(self.filled, &mut net, progress)?;
        if snapped > 0 {
            let vertices = place::place(self.filled, &net, progress)?;
            let [measured] = measure::measure(self.image, self.missed, [(&net, &vertices)], self.judge, progress)?;
            if self.judged(&measured) <= self.judged(&uniform) {
                return Ok(Candidate {
                    layout,
                    net,
                    vertices,
                    measured,
                    uniform,
                    is_uniform: true,
                    unfolded: 0,
                    snapped,
                });
            }
        }
        let (net, vertices, measured) = (uniform_net, uniform_vertices, uniform.clone());
        Ok(Candidate { layout, net, vertices, measured, uniform, is_uniform: true, unfolded: 0, snapped: 0 })
    }

    /// Stages 4 to 6 with a floor and a smoothing of the density: the grid, and how many vertices were moved so that it does not fold, and
    /// onto the surface.
    fn adaptive(
        &self,
        layout: &Layout,
        floor: f64,
        smoothing: f64,
        progress: &Progress<'_>,
    ) -> Result<(Net, usize, usize)> {
        let size = [self.image.rows(), self.image.cols()];
        let window = smoothing * (size[0] - 1) as f64 / (layout.rows() - 1) as f64;
        let curves = curves::sample(&self.density, size[1], layout, window as usize, floor, progress)?;
        let placed = rows::sample(&self.density, size[1], layout, &curves, smoothing > 0.0, floor, progress)?;
        let (mut net, unfolded) = stitch::stitch(&placed, layout, size, progress)?;
        let snapped = snap::snap(self.filled, &mut net, progress)?;
        Ok((net, unfolded, snapped))
    }

    /// Stage 8.
    fn finish(&self, chosen: &mut Candidate, gaps_filled: usize, progress: &Progress<'_>) -> Result<QuadGrid> {
        let Candidate { layout, net, vertices, measured, uniform, is_uniform, unfolded, snapped } = chosen;
        let coverage = self.params.coverage;
        let is_kept = |q: usize| {
            let quad = &measured.quads[q];
            let corners = net.corners(q / (net.cols - 1), q % (net.cols - 1));
            let on_surface = corners.iter().all(|&v| !vertices.background[v]);
            coverage == 0.0 || (on_surface && f64::from(quad.valid) >= coverage * f64::from(quad.pixels))
        };
        let mut kept = Vec::with_capacity(measured.quads.len());
        for range in progress.ranges(measured.quads.len()) {
            kept.extend(range?.map(is_kept));
        }
        if !kept.contains(&true) {
            return Err(Error::input(format!(
                "{}: none of the {} x {} quads is covered by valid pixels to {}, but a mesh has at least one quad. Lower \
                 coverage (0 keeps every quad), or ask for more rows and columns, so that quads are smaller.",
                self.image.called(),
                net.rows - 1,
                net.cols - 1,
                Shown(coverage)
            )));
        }
        let share = |m: &Measured| if self.extent > 0.0 { m.error(Judge::Mean) / self.extent } else { 0.0 };
        let pixel: Vec<usize> = net.sites.iter().map(|s| s[0] as usize * self.image.cols() + s[1] as usize).collect();
        let mut report = QuadReport {
            tiles: [layout.row_lines.len() - 1, layout.col_lines.len() - 1],
            depth_extent: self.extent,
            relative_error: share(measured),
            uniform_relative_error: share(uniform),
            rms_error: measured.error(Judge::Rms),
            uniform_rms_error: uniform.error(Judge::Rms),
            max_error: measured.error(Judge::Max),
            uniform_max_error: uniform.error(Judge::Max),
            is_uniform: *is_uniform,
            valid_pixels: measured.valid,
            missed_pixels: measured.total.missed,
            uniform_missed_pixels: uniform.total.missed,
            gaps_filled,
            unfolded: *unfolded,
            snapped: *snapped,
            quads: kept.iter().filter(|k| **k).count(),
            seconds: Vec::new(),
        };
        progress.check()?;
        let mirrored = grid::is_mirrored(self.filled, [net.rows, net.cols], &vertices.points);
        let attributes = attributes(self.image, &pixel);
        progress.check()?;
        progress.lap("finishing");
        report.seconds = progress.seconds();
        Ok(QuadGrid {
            rows: net.rows,
            cols: net.cols,
            pixels: std::mem::take(&mut net.sites),
            positions: std::mem::take(&mut vertices.points),
            background: std::mem::take(&mut vertices.background),
            odd_diagonals: measured.quads.iter().map(|q| q.odd).collect(),
            quad_errors: measured.quads.iter().map(|q| q.max).collect(),
            kept,
            mirrored,
            image_size: [self.image.rows(), self.image.cols()],
            attributes,
            crs: self.image.crs_of_frame(),
            report,
        })
    }
}

/// Leaves a grid that is tried to look at: vertices in the background are 1.
fn dump(net: &Net, vertices: &Vertices) -> Result<()> {
    dump::stage("quads-1-grid", || {
        let corners = |row: usize, col: usize| net.corners(row, col).map(|v| v as u32);
        let quads = (0..net.rows - 1).flat_map(|row| (0..net.cols - 1).map(move |col| corners(row, col)));
        Stage {
            positions: vertices.points.clone(),
            values: vertices.background.iter().map(|&is_background| i32::from(is_background)).collect(),
            triangles: quads.flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        }
    })
}

/// Floors and smoothings that are tried one after the other, as multiples of those given, until the grid lies nearer than the
/// uniform one. The last follows every pixel by itself: what serves where a quad is hardly larger than a pixel.
const TRIES: [(f64, f64); 4] = [(1.0, 1.0), (4.0, 1.0), (16.0, 1.0), (0.1, 0.0)];

/// By default a tile is as many pixels wide and high.
const PIXELS_A_TILE: usize = 64;

/// The ranges of an image, computed only where they aren't stored.
fn ranges(image: &RangeImage) -> Cow<'_, [f64]> {
    match image.samples() {
        Samples::Values(values) => Cow::Borrowed(values),
        Samples::Points(_) => Cow::Owned((0..image.len()).into_par_iter().map(|i| image.range(i)).collect()),
    }
}

/// Difference between the farthest and the nearest valid range.
fn depth_extent(image: &RangeImage, ranges: &[f64]) -> Result<f64> {
    let limits = ranges
        .par_chunks(1 << 16)
        .map(|ranges| {
            let mut lanes = ([f64::INFINITY; 8], [f64::NEG_INFINITY; 8]);
            for chunk in ranges.chunks(8) {
                for (l, &z) in chunk.iter().enumerate() {
                    lanes.0[l] = if z < lanes.0[l] { z } else { lanes.0[l] };
                    lanes.1[l] = if z > lanes.1[l] { z } else { lanes.1[l] };
                }
            }
            (lanes.0.into_iter().fold(f64::INFINITY, f64::min), lanes.1.into_iter().fold(f64::NEG_INFINITY, f64::max))
        })
        .reduce(|| (f64::INFINITY, f64::NEG_INFINITY), |a, b| (a.0.min(b.0), a.1.max(b.1)));
    let name = image.called();
    if limits.0 > limits.1 {
        return Err(Error::input(format!("{name}: no pixel is valid, but a grid needs some")));
    }
    let extent = limits.1 - limits.0;
    // Errors are squared.
    if limits.0.abs().max(limits.1.abs()) > LARGEST * LARGEST {
        return Err(Error::input(format!(
            "{name}: ranges from {:e} to {:e} are farther than can be computed with: use a larger unit",
            limits.0, limits.1
        )));
    }
    Ok(extent)
}

fn attributes(image: &RangeImage, pixels: &[usize]) -> Vec<Attribute> {
    let floats = |name: &str, data: &Option<Vec<f32>>| {
        data.as_ref().map(|data| Attribute::f32(name, pixels.iter().map(|&p| data[p]).collect()))
    };
    let colour = image.colour.as_ref().map(|c| Attribute::colour("colour", pixels.iter().map(|&p| c[p]).collect()));
    [colour, floats("intensity", &image.intensity), floats("confidence", &image.confidence)]
        .into_iter()
        .flatten()
        .collect()
}

#[cfg(test)]
mod tests;
