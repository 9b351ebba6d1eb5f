//! The stages of a merge on one core and the whole of it on all, on virtual scans held in memory.

#![allow(missing_docs)]

use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use surfrecon::geom::bvh::Bvh;
use surfrecon::merge::{self, MergeParams, Merged, ScanSource};
use surfrecon::mesh::measure::bounds;
use surfrecon::scan::shapes::Shape;
use surfrecon::scan::{ScanParams, TurntableViews, scan, turntable};
use surfrecon::{Progress, RangeImage};

/// Noisy, slightly misplaced scans of a ring of bumps about 2.8 wide.
fn scans() -> Vec<RangeImage> {
    let mut mesh = Shape::Torus { major: 1.0, minor: 0.4 }.mesh(79);
    for p in &mut mesh.positions {
        *p *= 1.0 + 0.03 * (11.0 * p.x).sin() * (13.0 * p.y).sin() * (17.0 * p.z).cos();
    }
    let bvh = Bvh::build(&mesh.positions, &mesh.triangles, 0).expect("a tree");
    let extent = bounds(&mesh.positions).expect("a mesh");
    let table = TurntableViews { around: 8, pixels: 400, ..TurntableViews::default() };
    let cameras = turntable(extent, &table, &Progress::none()).expect("cameras");
    let look = |(i, camera)| {
        let params = ScanParams { noise: 0.001, pose_shift: 0.001, seed: i as u64, ..ScanParams::default() };
        let mut image = scan(&mesh, &bvh, camera, &params, &Progress::none()).expect("a scan");
        image.name = format!("scan{i:02}");
        image
    };
    cameras.iter().enumerate().map(look).collect()
}

fn merged(scans: &[RangeImage], threads: usize) -> Merged {
    let sources: Vec<&dyn ScanSource> = scans.iter().map(|scan| scan as &dyn ScanSource).collect();
    let params = MergeParams { voxel: Some(0.01), threads, ..MergeParams::default() };
    merge::merge(&sources, &params, merge::Run::default(), &Progress::none()).expect("a surface")
}

fn stages(c: &mut Criterion) {
    let scans = scans();
    let first = merged(&scans, 1).report;
    let mut group = c.benchmark_group("merge_one_core");
    group.sample_size(10);
    group.throughput(Throughput::Elements(first.intersections));
    for (stage, _) in first.seconds {
        group.bench_function(stage, |b| {
            b.iter_custom(|rounds| {
                let seconds = |report: merge::MergeReport| {
                    report.seconds.iter().filter(|(name, _)| *name == stage).map(|(_, s)| *s).sum::<f64>()
                };
                Duration::from_secs_f64((0..rounds).map(|_| seconds(merged(&scans, 1).report)).sum())
            });
        });
    }
    group.bench_function("whole", |b| b.iter(|| merged(&scans, 1)));
    group.bench_function("whole_on_all_cores", |b| b.iter(|| merged(&scans, 0)));
    group.finish();
}

criterion_group!(benches, stages);
criterion_main!(benches);
