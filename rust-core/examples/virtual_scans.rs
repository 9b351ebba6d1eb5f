//! Makes the demo's data: scans a sculpture virtually and writes what a scanner would deliver, next to the truth.
//!
//! In the folder afterwards: `scan_00.ply` and so on (Stanford range grids), `scans.conf` (their poses as a registration
//! would report them, slightly wrong), `true_poses.conf`, and `truth.ply`, the sculpture itself. Lengths are millimetres.

#![allow(clippy::print_stdout, clippy::print_stderr)]

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use surfrecon::export::{PlacedFile, PlyEncoding, range_grid_frame, write_conf, write_ply, write_range_grid_ply};
use surfrecon::geom::bvh::Bvh;
use surfrecon::mesh::measure::bounds;
use surfrecon::scan::{ScanParams, TurntableViews, scan, sculpture, turntable};
use surfrecon::{Error, Progress, Result};

/// Scans a sculpture with a virtual scanner.
#[derive(Parser)]
struct Args {
    /// Folder for the files. Made if it is missing.
    folder: PathBuf,
    /// Number of scans: two thirds in a ring, the others from above, one in twelve from below.
    #[arg(long, default_value_t = 12)]
    scans: usize,
    /// Pixels across the sculpture's diagonal of 310 mm.
    #[arg(long, default_value_t = 520)]
    pixels: usize,
    /// Standard deviation of the noise along the rays, mm.
    #[arg(long, default_value_t = 0.08)]
    noise: f64,
    /// Step of the scanner's values, mm.
    #[arg(long, default_value_t = 0.01)]
    quantum: f64,
    /// Share of pixels that give no value.
    #[arg(long, default_value_t = 0.002)]
    dropout: f64,
    /// Standard deviation of the error of the reported positions along each axis, mm.
    #[arg(long, default_value_t = 0.08)]
    pose_shift: f64,
    /// Standard deviation of the error of the reported orientations, degrees.
    #[arg(long, default_value_t = 0.03)]
    pose_turn: f64,
    /// Number that all randomness follows from.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Detail of the sculpture: edge of its lattice, mm.
    #[arg(long, default_value_t = sculpture::CELL)]
    cell: f64,
    /// Text instead of binary files.
    #[arg(long)]
    ascii: bool,
    /// Threads, 0 for one per core.
    #[arg(long, default_value_t = 0)]
    threads: usize,
}

fn main() -> ExitCode {
    match run(&Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn run(args: &Args) -> Result<()> {
    std::fs::create_dir_all(&args.folder).map_err(|e| Error::io(&args.folder, e))?;
    let encoding = if args.ascii { PlyEncoding::Ascii } else { PlyEncoding::BinaryLittleEndian };
    let quiet = Progress::none();

    let start = Instant::now();
    let truth = sculpture::sculpture(args.cell, args.threads, &Progress::none())?;
    let bvh = Bvh::build(&truth.positions, &truth.triangles, args.threads)?;
    write_ply(&args.folder.join("truth.ply"), &truth, encoding, &quiet)?;
    println!("truth: {} triangles, {:.2} s", truth.triangles.len(), start.elapsed().as_secs_f64());

    let (above, below) = (args.scans / 4, args.scans / 12);
    let table = TurntableViews {
        around: args.scans - above - below,
        above,
        below,
        pixels: args.pixels,
        ..TurntableViews::default()
    };
    let extent = bounds(&truth.positions).expect("the sculpture is not empty");
    let (mut reported, mut true_poses) = (Vec::new(), Vec::new());
    for (k, camera) in turntable(extent, &table, &Progress::none())?.iter().enumerate() {
        let start = Instant::now();
        let params = ScanParams {
            noise: args.noise,
            noise_grazing: 0.5,
            quantum: args.quantum,
            dropout: args.dropout,
            dropout_grazing: 0.8,
            pose_shift: args.pose_shift,
            pose_turn: args.pose_turn.to_radians(),
            // A run of seeds a scan each; neighbouring seeds are independent.
            seed: args.seed.wrapping_mul(1000).wrapping_add(k as u64),
            threads: args.threads,
            ..ScanParams::default()
        };
        let mut image = scan(&truth, &bvh, camera, &params, &quiet)?;
        let seconds = start.elapsed().as_secs_f64();
        let file = format!("scan_{k:02}.ply");
        image.name.clone_from(&file);
        write_range_grid_ply(&args.folder.join(&file), &image, encoding, &quiet)?;
        let grid = range_grid_frame(&image)?;
        println!(
            "{file}: {} of {} pixels, {:.1} M rays/s",
            image.valid_count(),
            image.len(),
            image.len() as f64 / seconds / 1e6
        );
        reported.push(PlacedFile { file: file.clone(), world_from_file: image.world_from_sensor * grid });
        true_poses.push(PlacedFile { file, world_from_file: camera.world_from_sensor * grid });
    }
    write_conf(&args.folder.join("scans.conf"), &reported)?;
    write_conf(&args.folder.join("true_poses.conf"), &true_poses)
}
