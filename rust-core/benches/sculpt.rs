//! Sculpting of rough hills of 512^2 pixels on one core: the digging alone, with removals, with the search. As a height map and as a point
//! grid, made ready, and measured.

#![allow(missing_docs)]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use surfrecon::range_image::{Projection, Samples, Viewing};
use surfrecon::sculpt::{SculptParams, Sculptor, Tolerance, certify};
use surfrecon::{Progress, RangeImage};

const SIDE: usize = 512;

/// Hills with a ripple, between 0 and about 1.
fn hills() -> RangeImage {
    let value = |i: usize| {
        let (y, x) = ((i / SIDE) as f64 / SIDE as f64, (i % SIDE) as f64 / SIDE as f64);
        let large = (9.0 * x + 3.0 * y).sin() * (7.0 * y).cos();
        0.5 + 0.3 * large + 0.05 * (61.0 * x * y).sin() + 0.003 * (311.0 * x + 173.0 * y).sin()
    };
    let step = 1.0 / SIDE as f64;
    let projection = Projection::Orthographic { first: [0.0; 2], step: [step, -step] };
    RangeImage::from_values(SIDE, SIDE, (0..SIDE * SIDE).map(value).collect(), projection).expect("an image")
}

fn as_point_grid(image: &RangeImage) -> RangeImage {
    let points = match image.samples() {
        Samples::Points(points) => points.clone(),
        Samples::Values(_) => (0..image.len()).map(|i| image.point_in_sensor(i).as_vec3().to_array()).collect(),
    };
    let viewing = Viewing::Parallel(-glam::DVec3::Z);
    RangeImage::from_points(image.rows(), image.cols(), points, viewing).expect("an image")
}

fn params(effort: u32) -> SculptParams {
    let mut params = SculptParams { effort, threads: 1, ..SculptParams::default() };
    params.triangulation.edge_limit = Some(10.0);
    params
}

fn sculpting(c: &mut Criterion) {
    let map = hills();
    let grid = as_point_grid(&map);
    let mut group = c.benchmark_group("sculpt_512_one_core");
    group.sample_size(10);
    group.throughput(Throughput::Elements(map.len() as u64));
    for (name, image) in [("height_map", &map), ("point_grid", &grid)] {
        let ready = |effort| Sculptor::new(image, &params(effort)).expect("a sculptor");
        group.bench_function(BenchmarkId::new("ready", name), |b| b.iter(|| ready(1)));
        for (stage, effort) in [("dig", 0), ("remove", 1), ("search", 2)] {
            let sculptor = ready(effort);
            for share in [0.0028, 0.000_41] {
                let id = BenchmarkId::new(stage, format!("{name}_{share}"));
                let refine = || sculptor.refine(Tolerance::OfDepthExtent(share), &Progress::none()).expect("a mesh");
                group.bench_function(id, |b| b.iter(refine));
            }
        }
        let mesh = ready(1).refine(Tolerance::OfDepthExtent(0.000_41), &Progress::none()).expect("a mesh").mesh;
        let measure = || certify(image, &mesh, &Progress::none()).expect("a certificate");
        group.bench_function(BenchmarkId::new("certify", name), |b| b.iter(measure));
    }
    group.finish();
}

criterion_group!(benches, sculpting);
criterion_main!(benches);
