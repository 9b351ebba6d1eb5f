//! Merges registered range scans from files into one surface.
//!
//! ```sh
//! cargo run --release --example merge_scans -- bunny/bun.conf bunny.ply --voxel 0.0005
//! ```

#![allow(clippy::print_stdout, clippy::print_stderr)]

use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use surfrecon::merge::{self, MergeParams, MergeReport, ScanSource};
use surfrecon::{Error, Progress, Result, export, import};

/// Merges registered range scans into one surface. Lengths are in the unit of the scans.
#[derive(Parser)]
struct Arguments {
    /// A Stanford `.conf` that places scans, or a single scan.
    scans: PathBuf,
    /// The PLY file to write.
    out: PathBuf,
    /// Size of a cell of the grid. Measured from the scans when not given.
    #[arg(long)]
    voxel: Option<f64>,
    /// Surfaces closer than this become one. Measured from the scans when not given.
    #[arg(long)]
    merge_distance: Option<f64>,
    /// Longest boundary of a hole that is closed. 0 leaves all open.
    #[arg(long)]
    max_hole_length: Option<f64>,
    /// Connected parts with a smaller share of the triangles are dropped.
    #[arg(long)]
    min_component_share: Option<f64>,
    /// Worker threads, 0 for one per core.
    #[arg(long, default_value_t = 0)]
    threads: usize,
    /// Also writes the figures of the run to this JSON file.
    #[arg(long)]
    report: Option<PathBuf>,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<()> {
    let set = import::open(&arguments.scans)?;
    for note in &set.notes {
        println!("{note}");
    }
    let sources: Vec<&dyn ScanSource> = set.scans.iter().map(|scan| scan as &dyn ScanSource).collect();
    let defaults = MergeParams::default();
    let params = MergeParams {
        voxel: arguments.voxel,
        merge_distance: arguments.merge_distance,
        max_hole_length: arguments.max_hole_length,
        min_component_share: arguments.min_component_share.unwrap_or(defaults.min_component_share),
        threads: arguments.threads,
        ..defaults
    };
    let merged = merge::merge(&sources, &params, merge::Run::default(), &progress())?;
    export::write_ply(&arguments.out, &merged.mesh, export::PlyEncoding::default(), &Progress::none())?;
    let (triangles, vertices) = (merged.mesh.triangles.len(), merged.mesh.positions.len());
    println!("{}: {triangles} triangles, {vertices} vertices", arguments.out.display());
    if let Some(path) = &arguments.report {
        std::fs::write(path, json(&merged.report)).map_err(|error| Error::io(path, error))?;
    }
    Ok(())
}

/// A line that follows the stages, where somebody watches.
fn progress() -> Progress<'static> {
    if !std::io::stderr().is_terminal() {
        return Progress::none();
    }
    Progress::new(|tick| {
        eprint!("\r\x1b[K{:3.0} % {}", tick.fraction * 100.0, tick.stage);
        if tick.fraction >= 1.0 {
            eprintln!();
        }
        ControlFlow::Continue(())
    })
}

fn json(report: &MergeReport) -> String {
    let residual = report.overlap_residual.map_or("null".to_owned(), |r| r.to_string());
    let seconds: Vec<String> = report.seconds.iter().map(|(stage, s)| format!("\"{stage}\": {s}")).collect();
    format!(
        "{{\"scans\": {}, \"input_triangles\": {}, \"voxel\": {}, \"merge_distance\": {}, \"max_hole_length\": {}, \
         \"overlap_residual\": {residual}, \"noise\": {}, \"grid\": {:?}, \"intersections\": {}, \"fused_intersections\": {}, \
         \"artificial_intersections\": {}, \"faces\": {:?}, \"holes\": {:?}, \"dropped_components\": {:?}, \
         \"working_bytes\": {}, \"seconds\": {{{}}}}}\n",
        report.scans,
        report.input_triangles,
        report.voxel,
        report.merge_distance,
        report.max_hole_length,
        report.noise,
        report.grid,
        report.intersections,
        report.fused_intersections,
        report.artificial_intersections,
        report.faces,
        report.holes,
        report.dropped_components,
        report.working_bytes,
        seconds.join(", ")
    )
}
