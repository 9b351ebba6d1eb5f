//! Rays a second on one core: coherent camera rays against meshes of 100,000 and 1,600,000 triangles, and the rest of the
//! scanner's and the measure's work.

#![allow(missing_docs)]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use surfrecon::geom::bvh::{Bvh, Ray};
use surfrecon::mesh::TriMesh;
use surfrecon::mesh::measure::{Side, bounds, deviation};
use surfrecon::scan::shapes::Shape;
use surfrecon::scan::{ScanParams, TurntableViews, VirtualCamera, scan, turntable};
use surfrecon::{Progress, RangeImage};

/// A ring of bumps: curved, concave and self-occluding.
fn bumpy(detail: usize) -> TriMesh {
    let mut mesh = Shape::Torus { major: 1.0, minor: 0.4 }.mesh(detail);
    for p in &mut mesh.positions {
        *p *= 1.0 + 0.03 * (11.0 * p.x).sin() * (13.0 * p.y).sin() * (17.0 * p.z).cos();
    }
    mesh
}

fn cameras(mesh: &TriMesh, pixels: usize) -> Vec<(&'static str, VirtualCamera)> {
    let extent = bounds(&mesh.positions).expect("a mesh");
    let view = |height_angle| {
        let table = TurntableViews { around: 0, above: 1, below: 0, pixels, height_angle, ..TurntableViews::default() };
        turntable(extent, &table, &Progress::none()).expect("a camera")[0]
    };
    let inside = VirtualCamera::spherical(pixels / 2, pixels, -1.2, 1.2, DVec3::X, DVec3::Z).expect("a usable camera");
    vec![("orthographic", view(None)), ("pinhole", view(Some(0.7))), ("spherical_inside", inside)]
}

fn shoot(mesh: &TriMesh, bvh: &Bvh<'_>, camera: &VirtualCamera) -> RangeImage {
    let params = ScanParams { threads: 1, backfaces: true, ..ScanParams::default() };
    scan(mesh, bvh, camera, &params, &Progress::none()).expect("a scan")
}

fn rays(c: &mut Criterion) {
    for (name, detail) in [("100k", 79), ("1600k", 316)] {
        let mesh = bumpy(detail);
        let bvh = Bvh::build(&mesh.positions, &mesh.triangles, 0).expect("a tree");
        let mut group = c.benchmark_group(format!("scan_{name}_triangles_one_core"));
        group.sample_size(10);
        for (kind, camera) in cameras(&mesh, 1024) {
            group.throughput(Throughput::Elements((camera.rows * camera.cols) as u64));
            group.bench_function(BenchmarkId::from_parameter(kind), |b| b.iter(|| shoot(&mesh, &bvh, &camera)));
        }
        let camera = cameras(&mesh, 256)[1].1;
        group.throughput(Throughput::Elements((camera.rows * camera.cols) as u64));
        group.bench_function("pinhole_256", |b| b.iter(|| shoot(&mesh, &bvh, &camera)));
        // One ray after the other, as algorithms that can't gather rays do.
        let rays: Vec<Ray> = (0..camera.rows * camera.cols)
            .map(|i| {
                let (origin, direction) = camera.projection.ray(i / camera.cols, i % camera.cols, DVec3::ZERO);
                let pose = camera.world_from_sensor;
                Ray { origin: pose.transform_point3(origin), direction: pose.matrix3 * direction }
            })
            .collect();
        group.bench_function("single_rays", |b| {
            b.iter(|| rays.iter().filter(|r| bvh.first_hit(r, 0.0, f64::INFINITY).is_some()).count());
        });
        group.finish();
    }
}

fn build_and_measure(c: &mut Criterion) {
    let mesh = bumpy(79);
    let triangles = mesh.triangles.len() as u64;
    let mut group = c.benchmark_group("one_core");
    group.sample_size(10);
    group.throughput(Throughput::Elements(triangles));
    group.bench_function("build_100k", |b| b.iter(|| Bvh::build(&mesh.positions, &mesh.triangles, 1).expect("a tree")));
    let points: Vec<DVec3> = bumpy(100).positions.iter().map(|&p| p * 1.001).collect();
    group.throughput(Throughput::Elements(points.len() as u64));
    group.bench_function("deviation_near_points", |b| {
        b.iter(|| deviation(&points, &mesh, Side::Ignored, 1, &Progress::none()).expect("distances"));
    });
    group.finish();
}

criterion_group!(benches, rays, build_and_measure);
criterion_main!(benches);
