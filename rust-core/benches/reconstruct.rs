//! The stages of a reconstruction from scattered points on one core, the whole of it on all, and again with another factor.

#![allow(missing_docs)]

use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use surfrecon::reconstruct::{self, ReconstructParams, Reconstructor};
use surfrecon::{PointCloud, Progress};

/// Points of a ring of bumps, all of them on two spirals around its tube.
fn cloud(count: usize) -> PointCloud {
    let positions = (0..count).map(|i| {
        let around = i as f64 / count as f64 * std::f64::consts::TAU;
        let along = around * (count as f64).sqrt() * 1.3 + (i % 2) as f64 * 2.0;
        let tube = 0.4 * (1.0 + 0.1 * (7.0 * around).sin() * (3.0 * along).cos());
        let ring = 1.0 + tube * along.cos();
        DVec3::new(ring * around.cos(), ring * around.sin(), tube * along.sin())
    });
    PointCloud { positions: positions.collect(), ..PointCloud::default() }
}

fn stages(c: &mut Criterion) {
    let cloud = cloud(100_000);
    let params = |threads| ReconstructParams { threads, ..ReconstructParams::default() };
    let run = |threads| reconstruct::run(&cloud, &params(threads), &Progress::none()).expect("a surface");
    let mut group = c.benchmark_group("scattered_one_core");
    group.sample_size(10);
    group.throughput(Throughput::Elements(cloud.positions.len() as u64));
    for (stage, _) in run(1).report.seconds {
        group.bench_function(stage, |b| {
            b.iter_custom(|rounds| {
                let seconds = |_| {
                    let report = run(1).report;
                    report.seconds.iter().filter(|(name, _)| *name == stage).map(|(_, s)| *s).sum::<f64>()
                };
                Duration::from_secs_f64((0..rounds).map(seconds).sum())
            });
        });
    }
    group.bench_function("whole", |b| b.iter(|| run(1)));
    group.bench_function("whole_on_all_cores", |b| b.iter(|| run(0)));
    let mut kept = Reconstructor::new(&cloud).expect("a cloud");
    kept.surface(&params(1), &Progress::none()).expect("a surface");
    let other = ReconstructParams { factor: 1.5, ..params(1) };
    group.bench_function("another_factor", |b| b.iter(|| kept.surface(&other, &Progress::none())));
    group.finish();
}

criterion_group!(benches, stages);
criterion_main!(benches);
