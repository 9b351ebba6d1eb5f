//! An allocation that fails ends a call with an error, and neither the program nor anything else. Each operation, reader and writer is run
//! again and again, and each time one allocation more is granted. In one test, so that nothing else allocates.
#![allow(unsafe_code, clippy::unwrap_used, clippy::print_stdout)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed};

use glam::{DAffine3, DVec3};
use surfrecon::cluster::{ClusterParams, Resolution};
use surfrecon::export::{self, GlbNode, GlbOptions};
use surfrecon::geom::bvh::Bvh;
use surfrecon::geom::delaunay3::Delaunay3;
use surfrecon::merge::{MergeParams, ScanSource};
use surfrecon::mesh::measure::Side;
use surfrecon::quads::{QuadParams, SplineParams};
use surfrecon::range_image::Projection;
use surfrecon::reconstruct::ReconstructParams;
use surfrecon::scan::shapes::Shape;
use surfrecon::scan::{ScanParams, TurntableViews, VirtualCamera};
use surfrecon::sculpt::{SculptParams, Sculptor, Tolerance};
use surfrecon::triangulate::TriangulateParams;
use surfrecon::{
    Error, IntoFile, PointCloud, Progress, RangeImage, Result, cluster, import, memory, merge, merge_to_file, mesh,
    quads, reconstruct, scan, sculpt,
};
use surfrecon_allocator::Account;

/// Allocations up to this many bytes, with what the account puts before them, are granted: where the system refuses them they come from its
/// reserve.
const SMALL: usize = 4096 + 128;

/// Counts the larger allocations and refuses some.
struct Faulty;

static COUNT: AtomicUsize = AtomicUsize::new(0);
/// The first that is refused ...
static REFUSED: AtomicUsize = AtomicUsize::new(usize::MAX);
/// ... and whether all from then on are, small ones too.
static ALL: AtomicBool = AtomicBool::new(false);

fn granted(bytes: usize) -> bool {
    if bytes <= SMALL {
        return !(ALL.load(Relaxed) && COUNT.load(Relaxed) > REFUSED.load(Relaxed));
    }
    let (count, refused) = (COUNT.fetch_add(1, Relaxed), REFUSED.load(Relaxed));
    count < refused || count > refused && !ALL.load(Relaxed)
}

// SAFETY: what is granted is handed on to the system's allocator unchanged; null is an answer that the contract allows.
unsafe impl GlobalAlloc for Faulty {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the contract of `alloc`.
        if granted(layout.size()) { unsafe { System.alloc(layout) } } else { std::ptr::null_mut() }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps the contract of `dealloc`, and `alloc` got the pointer from the system.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, bytes: usize) -> *mut u8 {
        // SAFETY: the caller keeps the contract of `realloc`, and `alloc` got the pointer from the system.
        if granted(bytes) { unsafe { System.realloc(pointer, layout, bytes) } } else { std::ptr::null_mut() }
    }
}

#[global_allocator]
static ALLOCATOR: Account<Faulty> = Account(Faulty);

/// Ends the refusals, also when a panic goes by.
struct Grant;

impl Drop for Grant {
    fn drop(&mut self) {
        REFUSED.store(usize::MAX, Relaxed);
    }
}

/// Runs `work` with its `k`-th large allocation refused, and all later ones with `all`. Returns whether one was.
fn starved<R>(k: usize, all: bool, work: impl FnOnce() -> Result<R>) -> (bool, Result<R>) {
    ALL.store(all, Relaxed);
    COUNT.store(0, Relaxed);
    REFUSED.store(k, Relaxed);
    let grant = Grant;
    let outcome = memory::guarded(work);
    drop(grant);
    (COUNT.load(Relaxed) > k, outcome)
}

/// Theorem: whichever allocation fails, the call answers that memory is short, nothing is held afterwards, no file is left,
/// and the next call answers as ever.
fn survives<R: PartialEq>(name: &str, folder: &Path, work: impl Fn() -> Result<R>) {
    survives_by(name, folder, false, work);
}

/// [`survives`] of work that may do without an allocation that threads fail at, and is done anew by one thread.
fn survives_by<R: PartialEq>(name: &str, folder: &Path, has_another_way: bool, work: impl Fn() -> Result<R>) {
    let expected = memory::guarded(&work).unwrap_or_else(|error| panic!("{name}: {error}"));
    let files = || {
        let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|file| file.unwrap().file_name()).collect();
        files.sort();
        files
    };
    let present = files();
    let held = memory::held();
    let mut tried = 0;
    for all in [false, true] {
        let mut k = 0;
        loop {
            let (refused, outcome) = starved(k, all, &work);
            tried += 1;
            match outcome {
                Err(Error::OutOfMemory(_)) => assert!(refused, "{name}: refused without need"),
                Err(error) => panic!("{name}, allocation {k}: {error}"),
                Ok(result) => {
                    assert!(!refused || has_another_way && !all, "{name}: done without allocation {k}");
                    assert!(result == expected, "{name}: another result");
                    if !refused {
                        break;
                    }
                }
            }
            assert_eq!(files(), present, "{name}, allocation {k}");
            // Every one of the first, then every tenth part more.
            k += 1 + k / 10;
        }
    }
    let more = memory::held().saturating_sub(held);
    assert!(more < 16 * SMALL, "{name}: {more} bytes are held");
    assert!(memory::guarded(&work).unwrap() == expected, "{name}: another result afterwards");
    println!("{name}: {tried} times");
}

fn image(side: usize) -> RangeImage {
    let values = (0..side * side).map(|k| {
        let (y, x) = ((k / side) as f64, (k % side) as f64);
        3.0 * (0.05 * x).sin() * (0.04 * y).cos() + 0.01 * (k.wrapping_mul(2_654_435_761) % 1000) as f64
    });
    let projection = Projection::Orthographic { first: [0.0; 2], step: [1.0; 2] };
    let mut image = RangeImage::from_values(side, side, values.collect(), projection).unwrap();
    image.name = "image".to_owned();
    image
}

mod thorough {
    use super::*;

    #[test]
    fn refused_allocations_are_errors() {
        assert!(
            surfrecon_allocator::unwinds(),
            "built without RUSTC_BOOTSTRAP=surfrecon_allocator: see .cargo/config.toml"
        );
        let folder = tempfile::tempdir().unwrap();
        // A thread that begins allocates.
        for threads in [1, 2] {
            operations(folder.path(), threads);
        }
        writers(folder.path());
        let written = tempfile::tempdir().unwrap();
        readers(folder.path(), &seeds(written.path()));
    }
}

fn operations(folder: &Path, threads: usize) {
    let progress = Progress::none();
    let small = image(60);
    let triangulation = TriangulateParams::default();
    survives("triangulate", folder, || {
        Ok(surfrecon::triangulate::triangulate(&small, &triangulation, &progress)?.triangles)
    });
    let sculpting = |tolerance, interpolate| SculptParams {
        tolerance: Tolerance::Absolute(tolerance),
        interpolate,
        threads,
        ..Default::default()
    };
    for (tolerance, interpolate) in [(0.5, true), (0.0, true), (0.5, false)] {
        survives("sculpt", folder, || Ok(sculpt::run(&small, &sculpting(tolerance, interpolate), &progress)?.mesh));
    }
    let sculptor = Sculptor::prepare(&small, &sculpting(0.5, true), &progress).unwrap();
    survives("Sculptor::refine", folder, || Ok(sculptor.refine(Tolerance::Absolute(0.3), &progress)?.mesh));
    survives("Sculptor::at_most", folder, || Ok(sculptor.at_most(500, &progress)?.mesh));
    let quads = QuadParams { threads, ..Default::default() };
    let large = image(300);
    survives("quads", folder, || Ok(quads::run(&large, &quads, &progress)?.positions));
    let grid = quads::run(&large, &quads, &progress).unwrap();
    survives("spline", folder, || {
        Ok(grid.spline(&SplineParams::default(), &progress)?.spline.sample(50, 50, false)?.positions)
    });

    let sphere = Shape::Sphere { radius: 1.0 }.mesh(12);
    let torus = Shape::Torus { major: 0.8, minor: 0.3 }.mesh(12);
    survives("Bvh", folder, || Bvh::build(&sphere.positions, &sphere.triangles, threads).map(|bvh| bvh.len()));
    for resolution in [Resolution::Patches(60), Resolution::MaxError(0.02)] {
        let params = ClusterParams { resolution, threads, ..Default::default() };
        survives("cluster", folder, || Ok(cluster::run(&sphere, &params, &progress)?.mesh));
    }
    let cloud = PointCloud { positions: sphere.positions.clone(), ..Default::default() };
    survives("Delaunay", folder, || Ok(Delaunay3::new(&cloud.positions, threads, &progress)?.finite_count()));
    let reconstruct = ReconstructParams { threads, ..Default::default() };
    survives("reconstruct", folder, || Ok(reconstruct::run(&cloud, &reconstruct, &progress)?.mesh));
    let clustering = ClusterParams { resolution: Resolution::Patches(60), threads, ..Default::default() };
    survives("cluster points", folder, || Ok(cluster::run_points(&cloud, &clustering, &progress)?.mesh));

    survives("certify", folder, || {
        mesh::certify::certify(&sphere, &torus, Side::Ignored, threads, &progress).map(|found| found.bound)
    });
    survives("check", folder, || mesh::check::try_check(&sphere, &progress));
    survives("sculpture", folder, || scan::sculpture::sculpture(20.0, threads, &progress));
    let bvh = Bvh::build(&sphere.positions, &sphere.triangles, threads).unwrap();
    let bounds = mesh::measure::bounds(&sphere.positions).unwrap();
    let table = TurntableViews { pixels: 60, ..Default::default() };
    let cameras = scan::turntable(bounds, &table, &Progress::none()).unwrap();
    let params = ScanParams { threads, ..Default::default() };
    let scan = |camera: &VirtualCamera| scan::scan(&sphere, &bvh, camera, &params, &progress);
    survives("virtual scan", folder, || Ok(scan(&cameras[0])?.valid_count()));
    let scans: Vec<RangeImage> = cameras.iter().take(4).map(|camera| scan(camera).unwrap()).collect();
    let sources: Vec<&dyn ScanSource> = scans.iter().map(|scan| scan as &dyn ScanSource).collect();
    let merging = MergeParams { voxel: Some(0.1), threads, ..Default::default() };
    let are_several = threads > 1;
    survives_by("merge", folder, are_several, || {
        Ok(merge::merge(&sources, &merging, merge::Run::default(), &progress)?.mesh)
    });
    let in_files = || {
        let run = merge::Run { store: merge::Store::Files { workspace: None }, ..merge::Run::default() };
        Ok(merge::merge(&sources, &merging, run, &progress)?.mesh)
    };
    survives_by("merge in files", folder, are_several, in_files);
    let path = folder.join("merged.ply");
    survives("merge to file", folder, || {
        merge_to_file(&sources, &path, &merging, &IntoFile::default(), &progress)?;
        let bytes = std::fs::read(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        Ok(bytes)
    });
}

type Write<'a> = Box<dyn Fn() -> Result<()> + 'a>;

fn writers(folder: &Path) {
    let progress = Progress::none();
    let sphere = Shape::Sphere { radius: 1.0 }.mesh(12);
    let bvh = Bvh::build(&sphere.positions, &sphere.triangles, 1).unwrap();
    let camera = VirtualCamera::pinhole(60, 60, 0.8, DVec3::new(0.0, -4.0, 0.0), DVec3::ZERO, DVec3::Z).unwrap();
    let mut seen = scan::scan(&sphere, &bvh, &camera, &ScanParams::default(), &progress).unwrap();
    seen.name = "seen".to_owned();
    let path = folder.join("written");
    let node =
        GlbNode { name: "sphere", mesh: &sphere, world_from_mesh: DAffine3::IDENTITY, coarser: &[], images: None };
    let cloud = PointCloud { positions: sphere.positions.clone(), ..Default::default() };
    let written: [(&str, Write<'_>); 9] = [
        ("write_ply", Box::new(|| export::write_ply(&path, &sphere, export::PlyOptions::default(), &progress))),
        (
            "write_points_ply",
            Box::new(|| export::write_points_ply(&path, &cloud, export::PlyOptions::default(), &progress)),
        ),
        ("write_obj", Box::new(|| export::write_obj(&path, &sphere, None, &progress))),
        ("write_stl", Box::new(|| export::write_stl(&path, &sphere, 1.0, &progress))),
        ("write_3mf", Box::new(|| export::write_3mf(&path, "sphere", &sphere, &GlbOptions::default(), &progress))),
        ("write_glb", Box::new(|| export::write_glb(&path, &[node], &GlbOptions::default(), &progress))),
        ("write_e57", Box::new(|| export::write_e57(&path, &[&seen], None, &progress))),
        ("write_ptx", Box::new(|| export::write_ptx(&path, &[&seen], &progress))),
        (
            "write_range_grid_ply",
            Box::new(|| export::write_range_grid_ply(&path, &seen, export::PlyOptions::default(), &progress)),
        ),
    ];
    for (name, write) in &written {
        survives(name, folder, || {
            write()?;
            let bytes = std::fs::metadata(&path).unwrap().len();
            std::fs::remove_file(&path).unwrap();
            Ok(bytes)
        });
    }
}

fn entries(content: &import::Content) -> usize {
    match content {
        import::Content::RangeImage(image) => image.valid_count(),
        import::Content::Mesh(mesh) => mesh.positions.len(),
        import::Content::Points(cloud) => cloud.positions.len(),
    }
}

/// Files of every format: small ones, and larger ones that are written here.
fn seeds(written: &Path) -> Vec<PathBuf> {
    let progress = Progress::none();
    let (sphere, grid) = (Shape::Sphere { radius: 1.0 }.mesh(12), image(60));
    for encoding in [export::PlyEncoding::Ascii, export::PlyEncoding::BinaryLittleEndian] {
        export::write_ply(&written.join(format!("{encoding:?}.ply")), &sphere, encoding, &progress).unwrap();
        export::write_range_grid_ply(&written.join(format!("{encoding:?}_grid.ply")), &grid, encoding, &progress)
            .unwrap();
    }
    export::write_obj(&written.join("large.obj"), &sphere, None, &progress).unwrap();
    export::write_stl(&written.join("large.stl"), &sphere, 1.0, &progress).unwrap();
    export::write_3mf(&written.join("large.3mf"), "sphere", &sphere, &GlbOptions::default(), &progress).unwrap();
    let node =
        GlbNode { name: "sphere", mesh: &sphere, world_from_mesh: DAffine3::IDENTITY, coarser: &[], images: None };
    export::write_glb(&written.join("large.glb"), &[node], &GlbOptions::default(), &progress).unwrap();
    let kinds = ["import_ply", "import_points", "import_scan"];
    let kinds = kinds.map(|kind| Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds").join(kind));
    let folders = kinds.iter().map(PathBuf::as_path).chain([written]);
    let mut files: Vec<_> =
        folders.flat_map(|folder| std::fs::read_dir(folder).unwrap().map(|file| file.unwrap().path())).collect();
    files.sort();
    files
}

fn readers(folder: &Path, files: &[PathBuf]) {
    let mut read_well = 0;
    for path in files {
        let read = || {
            let set = import::open(path)?;
            set.scans.iter().map(|scan| scan.read().map(|content| entries(&content))).collect::<Result<Vec<_>>>()
        };
        // Seeds that stand for an error have been read elsewhere.
        if memory::guarded(read).is_ok() {
            survives(&path.file_name().unwrap().to_string_lossy(), folder, read);
            read_well += 1;
        }
    }
    assert!(read_well > 40, "{read_well} files");
}
