//! Clustering of a torus of 131,072 triangles on one core: k-means with disks and fans alone, with the relaxation, at several
//! resolutions, as a chain, and within a largest error.

#![allow(missing_docs)]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use surfrecon::cluster::{ClusterParams, Resolution, levels, run};
use surfrecon::scan::shapes::Shape;
use surfrecon::{Progress, TriMesh};

fn torus() -> TriMesh {
    Shape::Torus { major: 2.0, minor: 0.7 }.mesh(64)
}

fn params(resolution: Resolution) -> ClusterParams {
    ClusterParams { resolution, threads: 1, ..ClusterParams::default() }
}

fn clustering(c: &mut Criterion) {
    let mesh = torus();
    let mut group = c.benchmark_group("cluster_one_core");
    group.sample_size(10);
    group.throughput(Throughput::Elements(mesh.triangles.len() as u64));
    let time = |params: &ClusterParams| run(&mesh, params, &Progress::none()).expect("a mesh");
    for patches in [100, 1000, 5000] {
        let relaxed = params(Resolution::Patches(patches));
        let even = ClusterParams { adaptivity: 0.0, ..relaxed };
        let fans = ClusterParams { relaxation: 0, ..even };
        for (name, params) in [("fans", &fans), ("even", &even), ("adaptive", &relaxed)] {
            group.bench_function(BenchmarkId::new(name, patches), |b| b.iter(|| time(params)));
        }
    }
    group.bench_function("vertices", |b| b.iter(|| time(&params(Resolution::Vertices(3000)))));
    group.bench_function("max_error", |b| b.iter(|| time(&params(Resolution::MaxError(0.01)))));
    let chain = [12_800, 3_200, 800, 200].map(Resolution::Vertices);
    group.bench_function("chain", |b| {
        b.iter(|| levels(&mesh, &chain, &params(Resolution::Tenth), &Progress::none()).expect("levels"));
    });
    group.finish();
}

criterion_group!(benches, clustering);
criterion_main!(benches);
