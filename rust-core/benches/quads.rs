//! Quad grids on one core: the paper's image sizes, a large height map, a camera's image, a point grid. Also a size chosen for an error,
//! and the mesh and the B-spline surface of a grid.

#![allow(missing_docs)]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use surfrecon::quads::{QuadParams, SplineParams, Target, run};
use surfrecon::range_image::{DepthKind, Projection, Viewing};
use surfrecon::{Progress, RangeImage};

/// Waves with a step and a hole, between about 1 and 3.
fn image(rows: usize, cols: usize, projection: Projection) -> RangeImage {
    let value = |i: usize| {
        let (y, x) = ((i / cols) as f64 / rows as f64, (i % cols) as f64 / cols as f64);
        if (x - 0.3).powi(2) + (y - 0.6).powi(2) < 0.01 {
            return f64::NAN;
        }
        let step = if x + 0.3 * y > 0.8 { 0.4 } else { 0.0 };
        2.0 + 0.5 * (9.0 * x).sin() * (7.0 * y).cos() + 0.15 * (60.0 * x * y).sin() + step
    };
    RangeImage::from_values(rows, cols, (0..rows * cols).map(value).collect(), projection).expect("an image")
}

fn height_map(rows: usize, cols: usize) -> RangeImage {
    image(rows, cols, Projection::Orthographic { first: [0.0; 2], step: [0.01, -0.01] })
}

fn point_grid(rows: usize, cols: usize) -> RangeImage {
    let map = height_map(rows, cols);
    let points = (0..map.len()).map(|i| map.point_in_sensor(i).as_vec3().to_array()).collect();
    RangeImage::from_points(rows, cols, points, Viewing::Parallel(-glam::DVec3::Z)).expect("an image")
}

fn tiled(tiles: [usize; 2], vertices: usize) -> QuadParams {
    QuadParams {
        tiles_down: Some(tiles[0]),
        tiles_across: Some(tiles[1]),
        rows: vertices,
        columns: vertices,
        ..one_core()
    }
}

fn one_core() -> QuadParams {
    QuadParams { threads: 1, ..QuadParams::default() }
}

fn gridding(c: &mut Criterion) {
    let pinhole = Projection::Pinhole { focal: [500.0; 2], centre: [320.0, 240.0], depth: DepthKind::Planar };
    let mut group = c.benchmark_group("quads_one_core");
    group.sample_size(10);
    for (name, image, params) in [
        ("154x183_to_31x31", height_map(154, 183), tiled([5, 5], 7)),
        ("399x263_to_55x37", height_map(399, 263), tiled([6, 4], 10)),
        ("height_map_4096", height_map(4096, 4096), one_core()),
        ("pinhole_480x640", image(480, 640, pinhole), one_core()),
        ("point_grid_480x640", point_grid(480, 640), one_core()),
        ("rms_error_480x640", height_map(480, 640), QuadParams { target: Target::Rms(0.01), ..one_core() }),
    ] {
        group.throughput(Throughput::Elements(image.len() as u64));
        let make = || run(&image, &params, &Progress::none()).expect("a grid");
        group.bench_function(BenchmarkId::new("run", name), |b| b.iter(make));
    }
    let grid = run(&height_map(4096, 4096), &one_core(), &Progress::none()).expect("a grid");
    group.throughput(Throughput::Elements(grid.positions.len() as u64));
    group.bench_function("mesh_513", |b| b.iter(|| grid.mesh()));
    group.bench_function("triangles_513", |b| b.iter(|| grid.triangles()));
    for controls in [None, Some(128)] {
        let params = SplineParams { order: 4, rows: controls, columns: controls };
        let name = if controls.is_none() { "through" } else { "near" };
        group.bench_function(BenchmarkId::new("spline_513", name), |b| {
            b.iter(|| grid.spline(&params, &Progress::none()).expect("a surface"))
        });
    }
    group.finish();
}

criterion_group!(benches, gridding);
criterion_main!(benches);
