//! Reading and writing scans. With SURFRECON_DATA the ten Stanford bunny scans as they are. Always a scan of the same size made here, in
//! each encoding.

#![allow(missing_docs, clippy::print_stdout, clippy::unwrap_used)]

use std::path::{Path, PathBuf};

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use surfrecon::export::{PlyEncoding, write_ply, write_range_grid_ply};
use surfrecon::import::{self, Content, FileScan};
use surfrecon::range_image::Viewing;
use surfrecon::{Progress, RangeImage, TriMesh};

fn size(path: &Path) -> u64 {
    std::fs::metadata(path).unwrap().len()
}

fn read(scan: &FileScan) -> usize {
    match scan.read().unwrap() {
        Content::RangeImage(image) => image.len(),
        Content::Mesh(mesh) => mesh.triangles.len(),
        Content::Points(points) => points.positions.len(),
    }
}

/// 512 x 400 pixels, a fifth of them valid, as in a bunny scan.
fn range_image() -> RangeImage {
    let points = (0..400 * 512).map(|i| {
        let (x, y) = ((i % 512) as f32 / 512.0 - 0.5, (i / 512) as f32 / 400.0 - 0.5);
        let height = 0.0625 - x * x - y * y;
        if height > 0.0 { [x * 0.256, y * 0.2 + 0.1, height.sqrt() * 0.2] } else { [f32::NAN; 3] }
    });
    RangeImage::from_points(400, 512, points.collect(), Viewing::ALONG_MINUS_Z).unwrap()
}

/// A closed band of half a million vertices and a million triangles.
fn mesh() -> TriMesh {
    let (around, along) = (1000_u32, 500_u32);
    let positions = (0..=along).flat_map(|j| {
        (0..around).map(move |i| {
            let angle = f64::from(i) / f64::from(around) * std::f64::consts::TAU;
            DVec3::new(angle.cos(), angle.sin(), f64::from(j) * 0.01)
        })
    });
    let triangles = (0..along).flat_map(|j| {
        (0..around).flat_map(move |i| {
            let (a, b) = (j * around + i, j * around + (i + 1) % around);
            [[a, b, b + around], [a, b + around, a + around]]
        })
    });
    TriMesh::new(positions.collect(), triangles.collect())
}

fn reading(c: &mut Criterion) {
    let mut group = c.benchmark_group("read");
    if let Some(data) = std::env::var_os("SURFRECON_DATA").map(PathBuf::from) {
        let conf = data.join("stanford_bunny/bun.conf");
        group.bench_function("open bun.conf", |b| b.iter(|| import::open(&conf).unwrap().scans.len()));
        let scans = import::open(&conf).unwrap().scans;
        group.throughput(Throughput::Bytes(scans.iter().map(|scan| size(&scan.path)).sum()));
        group.bench_function("ten bunny scans, text", |b| b.iter(|| scans.iter().map(read).sum::<usize>()));
        let zipper = FileScan::new(&data.join("stanford_bunny/bun_zipper.ply"));
        group.throughput(Throughput::Bytes(size(&zipper.path)));
        group.bench_function("bun_zipper, text mesh", |b| b.iter(|| read(&zipper)));
    } else {
        println!("SKIPPED: SURFRECON_DATA is not set");
    }
    let folder = tempfile::tempdir().unwrap();
    let encodings = [
        ("little", PlyEncoding::BinaryLittleEndian),
        ("big", PlyEncoding::BinaryBigEndian),
        ("text", PlyEncoding::Ascii),
    ];
    for (name, encoding) in encodings {
        let path = folder.path().join(format!("grid_{name}.ply"));
        write_range_grid_ply(&path, &range_image(), encoding, &Progress::none()).unwrap();
        group.throughput(Throughput::Bytes(size(&path)));
        let scan = FileScan::new(&path);
        group.bench_function(format!("range grid, {name}"), |b| b.iter(|| read(&scan)));
        let path = folder.path().join(format!("mesh_{name}.ply"));
        write_ply(&path, &mesh(), encoding, &Progress::none()).unwrap();
        group.throughput(Throughput::Bytes(size(&path)));
        let scan = FileScan::new(&path);
        group.bench_function(format!("million triangles, {name}"), |b| b.iter(|| read(&scan)));
    }
}

fn writing(c: &mut Criterion) {
    let mut group = c.benchmark_group("write");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.ply");
    let mesh = mesh();
    let pool = surfrecon::threads::pool(0).unwrap();
    for (name, encoding) in [("little", PlyEncoding::BinaryLittleEndian), ("text", PlyEncoding::Ascii)] {
        write_ply(&path, &mesh, encoding, &Progress::none()).unwrap();
        group.throughput(Throughput::Bytes(size(&path)));
        group.bench_function(format!("million triangles, {name}"), |b| {
            b.iter(|| write_ply(&path, &mesh, encoding, &Progress::none()).unwrap());
        });
        group.bench_function(format!("million triangles, {name}, in a pool"), |b| {
            b.iter(|| pool.install(|| write_ply(&path, &mesh, encoding, &Progress::none())).unwrap());
        });
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20).measurement_time(std::time::Duration::from_secs(2));
    targets = reading, writing
}
criterion_main!(benches);
