//! Figures of unwrapping OBJ files: charts, share used, stretch, seconds of CPU time on one thread.
//!
//! `cargo run --release -p surfrecon-unwrap --example unwrap_figures -- [SIZE PADDING] mesh.obj ...`

use std::time::Instant;

use glam::DVec3;

use base::{Error, Progress, Result};
use mesh::TriMesh;
use unwrap::{UnwrapParams, check};

use surfrecon_unwrap as unwrap;

#[allow(clippy::print_stdout)]
fn main() -> Result<()> {
    let mut params = UnwrapParams { threads: 1, ..UnwrapParams::default() };
    let mut numbers = 0;
    println!(
        "mesh, triangles, charts before, charts, tiles, used, texels per unit, stretch, stretch p95, vertices for one, collapsed, moved, flips, overlaps, s"
    );
    for argument in std::env::args().skip(1) {
        if let Ok(number) = argument.parse() {
            *if numbers == 0 { &mut params.size } else { &mut params.padding } = number;
            numbers += 1;
            continue;
        }
        let mesh = read(&argument)?;
        let start = Instant::now();
        let done = unwrap::unwrap(&mesh, &params, &Progress::none())?;
        let seconds = start.elapsed().as_secs_f64();
        let found = check::check(&done.uv, &done.mesh.triangles, &Progress::none())?;
        let of = &done.report;
        println!(
            "{argument}, {}, {}, {}, {}, {:.3}, {:.2}, {:.3}, {:.3}, {:.2}, {}, {}, {}, {}, {seconds:.2} {:.2?}",
            mesh.triangles.len(),
            of.charts_before,
            of.charts,
            of.tiles,
            of.used,
            of.texels_per_unit,
            of.stretch,
            of.stretch_p95,
            done.mesh.positions.len() as f64 / mesh.positions.len() as f64,
            of.collapsed,
            of.moved,
            found.flipped.len(),
            found.overlapping.len(),
            of.seconds
        );
    }
    Ok(())
}

/// Vertices and triangles of an OBJ file. Larger faces as fans.
fn read(path: &str) -> Result<TriMesh> {
    let text = std::fs::read_to_string(path).map_err(|error| Error::io(path.as_ref(), error))?;
    let mut mesh = TriMesh::default();
    for line in text.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let mut number = || words.next().and_then(|word| word.parse().ok()).unwrap_or(f64::NAN);
                mesh.positions.push(DVec3::new(number(), number(), number()));
            }
            Some("f") => {
                let index =
                    |word: &str| word.split('/').next().and_then(|first| first.parse::<u32>().ok()).unwrap_or(0);
                let corners: Vec<u32> = words.map(|word| index(word).wrapping_sub(1)).collect();
                mesh.triangles.extend(corners.windows(2).skip(1).map(|pair| [corners[0], pair[0], pair[1]]));
            }
            _ => {}
        }
    }
    Ok(mesh)
}
