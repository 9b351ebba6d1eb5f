//! Stages 4 to 7: the grid of one layout.

use super::measure::{self, Judge, Measured};
use super::params::QuadParams;
use super::place::{self, Vertices};
use super::stages::MEASURING;
use super::stitch::{self, Net};
use super::tiles::Layout;
use super::{curves, rows, snap};
use base::error::Result;
use base::memory;
use base::progress::Progress;
use image::range_image::RangeImage;
use mesh::dump::{self, Stage};

/// Of the grid with the uniform one that it is compared with.
const BYTES_A_VERTEX: f64 = 175.0;

/// By default a tile is as many pixels wide and high.
const PIXELS_A_TILE: usize = 64;

/// Floors and smoothings that are tried one after the other, as multiples of those given, until the grid lies nearer than the
/// uniform one. The last follows every pixel by itself: what serves where a quad is hardly larger than a pixel.
const TRIES: [(f64, f64); 4] = [(1.0, 1.0), (4.0, 1.0), (16.0, 1.0), (0.1, 0.0)];

/// A grid with its figures, not yet in its final form.
pub struct Candidate {
    pub layout: Layout,
    pub net: Net,
    pub vertices: Vertices,
    pub measured: Measured,
    pub uniform: Measured,
    pub is_uniform: bool,
    pub unfolded: usize,
    pub snapped: usize,
}

/// Data that all candidates share.
pub struct Source<'a> {
    pub image: &'a RangeImage,
    pub filled: &'a RangeImage,
    pub params: &'a QuadParams,
    pub density: Vec<u8>,
    pub extent: f64,
    /// Error of a pixel that a grid does not meet, when grids are compared: the depth extent or, if all samples are equally far, their
    /// distance.
    pub missed: f64,
    pub judge: Judge,
}

impl Source<'_> {
    /// The error that a grid is chosen by.
    pub fn judged(&self, measured: &Measured) -> f64 {
        measured.judged(self.judge, self.missed)
    }

    /// Tiles as given or by default, with so many vertices along their sides.
    pub fn layout(&self, vertices: [usize; 2]) -> Result<Layout> {
        let size = [self.image.rows(), self.image.cols()];
        let tiles = |given: Option<usize>, pixels: usize| given.unwrap_or((pixels / PIXELS_A_TILE).max(1));
        let tiles = [tiles(self.params.tiles_down, size[0]), tiles(self.params.tiles_across, size[1])];
        Layout::new(size, tiles, vertices)
    }

    /// Stages 4 to 7: the adaptive grid of a layout, or the uniform one if that lies nearer.
    pub fn candidate(&self, layout: Layout, progress: &Progress<'_>) -> Result<Candidate> {
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
