//! Tetrahedralizes points from a file of little-endian doubles: the program that `make bench ONLY=delaunay` measures.

#![allow(clippy::print_stdout)]

use bytemuck::pod_collect_to_vec;
use clap::Parser;
use surfrecon::geom::delaunay3::Delaunay3;
use surfrecon::progress::Progress;

#[derive(Parser)]
struct Options {
    /// x, y, z of each point, as doubles, least byte first.
    points: std::path::PathBuf,
    /// Worker threads, 0 for one per core.
    #[arg(long, default_value_t = 1)]
    threads: usize,
    /// Check the result afterwards.
    #[arg(long)]
    check: bool,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let options = Options::parse();
    let mut points: Vec<glam::DVec3> = pod_collect_to_vec(&std::fs::read(&options.points)?);
    let delaunay = Delaunay3::in_place(&mut points, options.threads, &Progress::none())?;
    if options.check {
        delaunay.check(&points)?;
    }
    println!("{{\"tets\": {}}}", delaunay.finite_count());
    Ok(())
}
