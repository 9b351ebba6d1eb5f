//! Stage 8: the result of the chosen grid.

use super::candidate::{Candidate, Source};
use super::grid::{self, QuadGrid};
use super::measure::{Judge, Measured};
use super::report::QuadReport;
use base::error::{Error, Result, Shown};
use base::progress::Progress;
use image::range_image::RangeImage;
use mesh::Attribute;

impl Source<'_> {
    /// The chosen grid as it is handed over.
    ///
    /// # Errors
    /// No quad is covered as asked for. Cancelled.
    pub fn finish(&self, chosen: &mut Candidate, gaps_filled: usize, progress: &Progress<'_>) -> Result<QuadGrid> {
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
