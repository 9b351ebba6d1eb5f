//! Times the checks for printing of shapes that are hard for the balls of walls: round ones, smooth and noisy.
//!
//! ```sh
//! cargo run --release -p surfrecon-close --example print_figures -- 200000         # about so many faces each
//! cargo run --release -p surfrecon-close --example print_figures -- 200000 ball    # of one shape
//! cargo run --release -p surfrecon-close --example print_figures -- 20000 ball 9   # with walls of any thickness measured
//! ```
//!
//! Prints the seconds of the stage of walls, of all threads, and the thinnest wall, at most the thickness up to which walls are measured.

#![allow(clippy::print_stdout)]

use glam::DVec3;

use base::error::Result;
use base::progress::Progress;
use mesh::TriMesh;
use mesh::shapes::Shape;
use surfrecon_close::print::{PrintParams, check_print};

/// The finest mesh of a shape that has at most so many faces.
fn made(shape: &Shape, faces: usize) -> TriMesh {
    let mut detail = 1;
    while shape.mesh(detail + 1).triangles.len() <= faces {
        detail += 1 + detail / 20;
    }
    shape.mesh(detail)
}

/// Moves each vertex by up to `most` along each axis, by a fixed rule.
fn noisy(mut mesh: TriMesh, most: f64) -> TriMesh {
    let mut state = 1_u64;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    mesh.positions.iter_mut().for_each(|p| *p += most * DVec3::new(next(), next(), next()));
    mesh
}

fn main() -> Result<()> {
    let faces = std::env::args().nth(1).and_then(|count| count.parse().ok()).unwrap_or(200_000);
    let ball = made(&Shape::Sphere { radius: 1.0 }, faces);
    let mut shapes = vec![
        ("box".to_owned(), made(&Shape::Cuboid { half: DVec3::new(1.0, 2.0, 0.5) }, faces)),
        ("ring".to_owned(), made(&Shape::Torus { major: 1.0, minor: 0.3 }, faces)),
        ("cylinder".to_owned(), made(&Shape::Cylinder { radius: 1.0, half_height: 1.0 }, faces)),
        ("ball".to_owned(), ball.clone()),
    ];
    for noise in [1e-5, 1e-4, 1e-3] {
        shapes.push((format!("ball, noise {noise:e}"), noisy(ball.clone(), noise)));
    }
    let mut bumpy = ball;
    let bumps = |p: DVec3| 0.1 * (7.0 * p.x).sin() * (6.0 * p.y).sin() * (5.0 * p.z).cos();
    bumpy.positions.iter_mut().for_each(|p| *p *= 1.0 + bumps(*p));
    shapes.push(("bumpy ball".to_owned(), bumpy));
    println!("{:20} {:>8} {:>10} {:>10}", "shape", "faces", "walls, s", "thinnest");
    let only = std::env::args().nth(2);
    let max_wall = std::env::args().nth(3).and_then(|limit| limit.parse().ok());
    let params = PrintParams { max_wall, ..PrintParams::default() };
    for (name, mesh) in shapes.into_iter().filter(|(name, _)| only.as_ref().is_none_or(|only| only == name)) {
        let report = check_print(&mesh, &params, &Progress::none())?.report;
        let walls =
            report.seconds.iter().find(|(stage, _)| *stage == "measuring walls").map_or(0.0, |(_, seconds)| *seconds);
        println!(
            "{name:20} {:8} {walls:10.2} {:10.4}",
            mesh.triangles.len(),
            report.thinnest_wall.unwrap_or(report.wall_limit)
        );
    }
    Ok(())
}
