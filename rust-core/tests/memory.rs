//! Work that does not fit is refused before it begins, and what fits is not: the peaks are counted by an allocator of its
//! own, in one test, so that nothing else allocates meanwhile.
#![allow(unsafe_code, clippy::unwrap_used, clippy::print_stdout)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use glam::{DAffine3, DMat3, DVec3};
use surfrecon::close::print::{PrintParams, check_print};
use surfrecon::cluster::ClusterParams;
use surfrecon::frame::Camera;
use surfrecon::geom::bvh::Bvh;
use surfrecon::geom::delaunay3::Delaunay3;
use surfrecon::photo::{Photo, PhotoInMemory, Pixels};
use surfrecon::printing::{PrepareParams, prepare_print};
use surfrecon::quads::QuadParams;
use surfrecon::range_image::Projection;
use surfrecon::reconstruct::ReconstructParams;
use surfrecon::scan::shapes::Shape;
use surfrecon::sculpt::{SculptParams, Tolerance};
use surfrecon::texture::TextureParams;
use surfrecon::triangulate::TriangulateParams;
use surfrecon::unwrap::{UnwrapParams, unwrap};
use surfrecon::{
    Error, PointCloud, Progress, RangeImage, Result, cluster, memory, quads, reconstruct, sculpt, texture,
};

struct Counting;

static NOW: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call is handed on to the system's allocator unchanged; only numbers are kept beside it.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        PEAK.fetch_max(NOW.fetch_add(layout.size(), Relaxed) + layout.size(), Relaxed);
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Relaxed);
        // SAFETY: the caller keeps the contract of `dealloc`, and `alloc` got the pointer from the system.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn image(side: usize) -> RangeImage {
    let values = (0..side * side).map(|k| {
        let (y, x) = ((k / side) as f64, (k % side) as f64);
        3.0 * (0.05 * x).sin() * (0.04 * y).cos() + 0.01 * (k.wrapping_mul(2_654_435_761) % 1000) as f64
    });
    let projection = Projection::Orthographic { first: [0.0; 2], step: [1.0; 2] };
    RangeImage::from_values(side, side, values.collect(), projection).unwrap()
}

/// Photos of so many rows and columns of a sphere of radius 10, from all sides.
fn photos_of(pixels: usize, count: usize) -> Vec<PhotoInMemory> {
    let camera = Camera::sized([1.2 * pixels as f64; 2], [pixels as f64 / 2.0; 2], [pixels; 2]);
    let of = |i: usize| {
        let turn = DMat3::from_rotation_y(std::f64::consts::TAU * i as f64 / count as f64);
        let grey = |k: usize| [(60 + (k * 7 + i) % 90) as u8; 3];
        PhotoInMemory {
            name: format!("photo {i:02}"),
            camera,
            world_from_camera: DAffine3 { matrix3: turn, translation: turn * DVec3::new(0.0, 0.0, -30.0) },
            pixels: Pixels { size: [pixels; 2], colours: (0..pixels * pixels).map(grey).collect() },
            depths: None,
        }
    };
    (0..count).map(of).collect()
}

/// Theorem: with half of what the work took at its peak allowed it is refused before it takes a tenth of that. With three times the peak it
/// is done.
fn foreseen(name: &str, work: impl Fn() -> Result<()>) {
    let measured = || {
        let before = NOW.load(Relaxed);
        PEAK.store(before, Relaxed);
        let outcome = work();
        (PEAK.load(Relaxed) - before, outcome)
    };
    memory::set_limit(None);
    measured().1.unwrap();
    let (peak, outcome) = measured();
    outcome.unwrap();
    println!("{name}: {:.1} MB", peak as f64 / 1e6);
    memory::set_limit(Some(3 * peak as u64));
    work().unwrap_or_else(|error| panic!("{name}: {peak} bytes at the peak; {error}"));
    memory::set_limit(Some(peak as u64 / 2));
    let (taken, outcome) = measured();
    match outcome {
        Err(Error::OutOfMemory(text)) => assert!(text.contains(" allowed"), "{text}"),
        other => panic!("{name}: {peak} bytes at the peak were not foreseen: {other:?}"),
    }
    assert!(taken < peak / 10, "{name}: {taken} of {peak} bytes taken before it was refused");
    memory::set_limit(None);
}

#[test]
fn work_that_does_not_fit_is_refused() {
    let progress = Progress::none();
    let small = image(300);
    foreseen("triangulate", || {
        surfrecon::triangulate::triangulate(&small, &TriangulateParams::default(), &progress).map(drop)
    });
    let tolerance = Tolerance::Absolute(0.5);
    foreseen("sculpt", || sculpt::run(&small, &SculptParams { tolerance, ..Default::default() }, &progress).map(drop));
    foreseen("sculpt finely", || {
        let params = SculptParams { tolerance: Tolerance::Absolute(0.0), ..Default::default() };
        sculpt::run(&small, &params, &progress).map(drop)
    });
    foreseen("quads", || quads::run(&small, &QuadParams::default(), &progress).map(drop));

    let sphere = Shape::Sphere { radius: 1.0 }.mesh(36);
    foreseen("Bvh", || Bvh::build(&sphere.positions, &sphere.triangles, 0).map(drop));
    foreseen("cluster", || cluster::run(&sphere, &ClusterParams::default(), &progress).map(drop));
    let light = Shape::Sphere { radius: 10.0 }.mesh(12);
    let small_tile = UnwrapParams { size: 256, ..UnwrapParams::default() };
    foreseen("unwrap", || unwrap(&light, &small_tile, &progress).map(drop));
    let large_tile = UnwrapParams { size: 8192, ..UnwrapParams::default() };
    foreseen("unwrap in a large tile", || unwrap(&light, &large_tile, &progress).map(drop));
    let flat = unwrap(&light, &small_tile, &progress).unwrap().mesh;
    for (name, size, photos) in [("texture", 512, photos_of(80, 2)), ("texture of many photos", 64, photos_of(700, 12))]
    {
        let params = TextureParams { size, ..TextureParams::default() };
        let photos: Vec<&dyn Photo> = photos.iter().map(|photo| photo as &dyn Photo).collect();
        foreseen(name, || texture::run(&flat, &light, &photos, &params, &progress).map(drop));
    }
    foreseen("check print", || check_print(&sphere, &PrintParams::default(), &progress).map(drop));
    let print = PrepareParams { flat_base: true, ..PrepareParams::default() };
    foreseen("prepare print", || prepare_print(&sphere, &print, &progress).map(drop));
    let walls = PrepareParams { min_wall: Some(0.01), ..print };
    foreseen("thicken", || prepare_print(&sphere, &walls, &progress).map(drop));
    let hollow = PrepareParams { hollow: Some(0.05), ..PrepareParams::default() };
    foreseen("hollow", || prepare_print(&sphere, &hollow, &progress).map(drop));
    let points = sphere.positions.clone();
    foreseen("Delaunay", || Delaunay3::new(&points, 0, &progress).map(drop));
    let cloud = PointCloud { positions: points.clone(), ..Default::default() };
    foreseen("reconstruct", || reconstruct::run(&cloud, &ReconstructParams::default(), &progress).map(drop));
}
