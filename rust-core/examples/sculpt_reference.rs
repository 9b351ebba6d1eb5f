//! Sculpts a grid of heights as the paper does: a peer in `make bench ONLY=sculpt`.

#![allow(clippy::print_stdout)]

use bytemuck::{cast_slice, pod_collect_to_vec};
use clap::Parser;
use surfrecon::progress::Progress;
use surfrecon::range_image::{Projection, RangeImage};
use surfrecon::sculpt::{SculptParams, Tolerance, reference};

#[derive(Parser)]
struct Options {
    /// Heights row by row, NaN where there is none, as doubles, least byte first.
    heights: std::path::PathBuf,
    /// Pixels in a row.
    cols: usize,
    /// Largest distance between a sample and the mesh, in the unit of the heights.
    tolerance: f64,
    /// Receives the mesh: three positions as doubles per triangle.
    out: std::path::PathBuf,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let options = Options::parse();
    let heights: Vec<f64> = pod_collect_to_vec(&std::fs::read(&options.heights)?);
    let rows = heights.len().checked_div(options.cols).unwrap_or(0);
    let projection = Projection::Orthographic { first: [0.0; 2], step: [1.0; 2] };
    let image = RangeImage::from_values(rows, options.cols, heights, projection)?;
    let mut params = SculptParams { tolerance: Tolerance::Absolute(options.tolerance), ..SculptParams::default() };
    // Every jump is bridged, as in the paper.
    params.triangulation.edge_limit = Some(1e9);
    let start = std::time::Instant::now();
    let result = reference::run(&image, &params, &Progress::none())?;
    let wall = start.elapsed().as_secs_f64();
    let corners: Vec<[f64; 3]> =
        (0..result.mesh.triangles.len()).flat_map(|t| result.mesh.corners(t).map(|p| p.to_array())).collect();
    std::fs::write(&options.out, cast_slice::<[f64; 3], u8>(&corners))?;
    println!("{{\"wall_s\": {wall}}}");
    Ok(())
}
