//! Cost of calling through the C library beyond calling the core, and of its files in memory beside those on a disk: the same work both
//! ways in turn, seconds as JSON lines. Usage: capi_overhead LIBRARY REPEATS
#![allow(unsafe_code, clippy::print_stdout, clippy::unwrap_used)]

use std::ffi::{CString, c_char, c_void};
use std::time::Instant;

use glam::{DAffine3, DVec3};
use libloading::Library;
use surfrecon::Progress;
use surfrecon::merge::{self, MergeParams, PlacedMesh};
use surfrecon::mesh::TriMesh;
use surfrecon::mesh::measure::{Side, deviation};
use surfrecon::scan::shapes::Shape;

type Handle = *mut c_void;

#[repr(C)]
struct Array {
    data: *const c_void,
    count: usize,
    stride: usize,
    kind: u32,
    components: u32,
}

fn points(values: &[[f64; 3]]) -> Array {
    Array { data: values.as_ptr().cast(), count: values.len(), stride: 0, kind: 2, components: 3 }
}

fn triangles(values: &[[u32; 3]]) -> Array {
    Array { data: values.as_ptr().cast(), count: values.len(), stride: 0, kind: 4, components: 3 }
}

type Create = unsafe extern "C" fn(*const Array, *const Array, *mut Handle) -> i32;
type Free = unsafe extern "C" fn(Handle) -> i32;
type Distances = unsafe extern "C" fn(Handle, *const Array, u32, u32, *const c_void, *mut f64, *mut c_void) -> i32;
type Make = unsafe extern "C" fn(*mut Handle) -> i32;
type AddMesh = unsafe extern "C" fn(Handle, Handle, *const c_void, *const i8) -> i32;
type Run = unsafe extern "C" fn(Handle, *const [u64; 7], *const c_void, *mut Handle, *mut c_void) -> i32;
type Init = unsafe extern "C" fn(*mut [u64; 7], usize) -> i32;
type View = unsafe extern "C" fn(Handle, *mut Array) -> i32;

/// Medians of the seconds of calling the core and calling the C library.
fn compare(case: &str, repeats: usize, core: impl FnMut(), c: impl FnMut()) {
    compare_as(["core_s", "c_s"], case, repeats, core, c);
}

/// Medians of the seconds of both ways, which take turns.
fn compare_as(names: [&str; 2], case: &str, repeats: usize, mut first: impl FnMut(), mut second: impl FnMut()) {
    let mut seconds = [vec![], vec![]];
    // The first turn warms caches, page tables and thread pools, and does not count.
    for turn in 0..=repeats {
        for (way, work) in [&mut first as &mut dyn FnMut(), &mut second].into_iter().enumerate() {
            let started = Instant::now();
            work();
            if turn > 0 {
                seconds[way].push(started.elapsed().as_secs_f64());
            }
        }
    }
    let [first, second] = seconds.map(|mut all| {
        all.sort_by(f64::total_cmp);
        all[all.len() / 2]
    });
    println!("{{\"case\": \"{case}\", \"{}\": {first}, \"{}\": {second}}}", names[0], names[1]);
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let repeats: usize = arguments[2].parse().unwrap();
    // SAFETY: our own library, which runs no code when loaded; the types are those the header declares.
    let library = unsafe { Library::new(&arguments[1]) }.unwrap();
    macro_rules! function {
        ($name:literal, $t:ty) => {
            // SAFETY: as above.
            *unsafe { library.get::<$t>($name) }.unwrap()
        };
    }
    let create = function!(b"srf_mesh_create", Create);
    let free = function!(b"srf_mesh_free", Free);
    let distances = function!(b"srf_mesh_distances", Distances);
    let positions_of = function!(b"srf_mesh_positions", View);
    let create_merger = function!(b"srf_merger_create", Make);
    let add_mesh = function!(b"srf_merger_add_mesh", AddMesh);
    let init = function!(b"srf_merge_params_init_sized", Init);

    let mesh = Shape::Torus { major: 1.0, minor: 0.4 }.mesh(60);
    let corners: Vec<[f64; 3]> = mesh.positions.iter().map(|p| p.to_array()).collect();
    let mut handle: Handle = std::ptr::null_mut();
    // SAFETY: arrays as the header wants them.
    assert_eq!(unsafe { create(&points(&corners), &triangles(&mesh.triangles), &mut handle) }, 0);

    // A million points near the surface, the same every time.
    let million: Vec<[f64; 3]> = (0..1_000_000_u32)
        .map(|i| {
            let (u, v) = (f64::from(i) * 0.618_033_988_75, f64::from(i) * 0.414_213_562_37);
            let r = 1.0 + 0.41 * v.cos();
            [r * u.cos(), r * u.sin(), 0.41 * v.sin()]
        })
        .collect();
    let as_vectors: &[DVec3] = bytemuck::cast_slice(&million);
    compare(
        "distances of a million points",
        repeats,
        || {
            let found = deviation(as_vectors, &mesh, Side::Ignored, 1, &Progress::none()).unwrap();
            assert_eq!(found.distances.len(), 1_000_000);
        },
        || {
            let mut found = vec![0.0; 1_000_000];
            let null = std::ptr::null();
            // SAFETY: arrays as the header wants them.
            let status =
                unsafe { distances(handle, &points(&million), 0, 1, null, found.as_mut_ptr(), std::ptr::null_mut()) };
            assert_eq!(status, 0);
        },
    );

    let voxel = 0.01;
    let placed = PlacedMesh { name: "torus".to_owned(), mesh: &mesh, world_from_mesh: DAffine3::IDENTITY };
    let merger = {
        let mut merger: Handle = std::ptr::null_mut();
        // SAFETY: handles of the library.
        unsafe {
            assert_eq!(create_merger(&mut merger), 0);
            assert_eq!(add_mesh(merger, handle, std::ptr::null(), c"torus".as_ptr().cast()), 0);
        }
        merger
    };
    let run = function!(b"srf_merger_run", Run);
    let mut params = [0_u64; 7];
    // SAFETY: room for the struct of the header, whose size is checked below.
    assert_eq!(unsafe { init(&mut params, size_of_val(&params)) }, 0);
    assert_eq!((params[0] as u32) as usize, size_of_val(&params), "struct_size");
    params[0] |= 1 << 32;
    params[1] = f64::to_bits(voxel);
    compare(
        "a merge",
        repeats,
        || {
            let params = MergeParams { voxel: Some(voxel), threads: 1, ..MergeParams::default() };
            let merged = merge::merge(&[&placed], &params, merge::Run::default(), &Progress::none()).unwrap();
            assert!(merged.mesh.triangles.len() > 10_000);
        },
        || {
            let mut merged: Handle = std::ptr::null_mut();
            // SAFETY: handles of the library, a struct it initialized.
            unsafe {
                assert_eq!(run(merger, &params, std::ptr::null(), &mut merged, std::ptr::null_mut()), 0);
                assert_eq!(free(merged), 0);
            }
        },
    );

    let sum = |values: &[f64]| values.iter().sum::<f64>();
    let expected = sum(bytemuck::cast_slice(&corners));
    compare(
        "a thousand views of a mesh, read",
        repeats,
        || {
            for _ in 0..1000 {
                assert_eq!(sum(bytemuck::cast_slice(std::hint::black_box(&corners))), expected);
            }
        },
        || {
            for _ in 0..1000 {
                let mut view = Array { data: std::ptr::null(), count: 0, stride: 0, kind: 0, components: 0 };
                // SAFETY: room for the view, which has three doubles an element without gaps.
                let values = unsafe {
                    assert_eq!(positions_of(handle, &mut view), 0);
                    std::slice::from_raw_parts(view.data.cast::<f64>(), 3 * view.count)
                };
                assert_eq!(sum(values), expected);
            }
        },
    );

    let copy: &TriMesh = &mesh;
    let large: Vec<[f64; 3]> = million.clone();
    compare(
        "a million points into a mesh",
        repeats,
        || {
            let made = TriMesh::new(bytemuck::cast_slice::<_, DVec3>(&large).to_vec(), Vec::new());
            made.validate().unwrap();
            assert!(made.positions.len() > copy.positions.len());
        },
        || {
            let mut made: Handle = std::ptr::null_mut();
            // SAFETY: arrays as the header wants them.
            unsafe {
                assert_eq!(create(&points(&large), std::ptr::null(), &mut made), 0);
                assert_eq!(free(made), 0);
            }
        },
    );

    files(&library, repeats);
}

type Text = *const c_char;
type CreateFolder = unsafe extern "C" fn(*const c_void, *mut Handle) -> i32;
type PathIn = unsafe extern "C" fn(Handle, Text, *mut Text) -> i32;
type Put = unsafe extern "C" fn(Handle, Text, *const c_void, usize) -> i32;
type BytesOf = unsafe extern "C" fn(Handle, Text, *mut *const c_void, *mut usize) -> i32;
type Write = unsafe extern "C" fn(Handle, Text, *const c_void, *const c_void) -> i32;
type Open = unsafe extern "C" fn(*const Text, usize, *const c_void, *const c_void, *mut Handle) -> i32;
type Read = unsafe extern "C" fn(Handle, usize, *const c_void, *mut u32, *mut Handle, *mut Handle, *mut Handle) -> i32;

#[repr(C)]
struct FileSource {
    length: u64,
    read: unsafe extern "C" fn(*mut c_void, u64, *mut c_void, usize, *mut usize) -> i32,
    release: Option<unsafe extern "C" fn(*mut c_void)>,
    user: *mut c_void,
}

#[repr(C)]
struct FileSink {
    write: unsafe extern "C" fn(*mut c_void, Text, *const c_void, usize) -> i32,
    release: Option<unsafe extern "C" fn(*mut c_void)>,
    user: *mut c_void,
}

/// Reads what lies in a buffer.
unsafe extern "C" fn read_buffer(user: *mut c_void, at: u64, to: *mut c_void, count: usize, out: *mut usize) -> i32 {
    // SAFETY: the buffer handed in, and room for as many bytes.
    unsafe {
        let from = &(&*user.cast::<Vec<u8>>())[at as usize..];
        let some = count.min(from.len());
        to.cast::<u8>().copy_from_nonoverlapping(from.as_ptr(), some);
        *out = some;
    }
    0
}

/// Appends to a buffer.
unsafe extern "C" fn write_buffer(user: *mut c_void, _: Text, bytes: *const c_void, count: usize) -> i32 {
    if !bytes.is_null() {
        // SAFETY: the buffer handed in, and as many bytes.
        unsafe { (*user.cast::<Vec<u8>>()).extend_from_slice(std::slice::from_raw_parts(bytes.cast(), count)) };
    }
    0
}

/// Writing and reading a mesh of a million triangles. One way is a file on a disk, which the system holds in its cache. The other is
/// memory: once by functions of the program's, and once, of bytes that it has or wants, through a file or through a folder that keeps a
/// copy of them.
fn files(library: &Library, repeats: usize) {
    macro_rules! function {
        ($name:literal, $t:ty) => {
            // SAFETY: the types are those the header declares.
            *unsafe { library.get::<$t>($name) }.unwrap()
        };
    }
    let create = function!(b"srf_mesh_create", Create);
    let (free, free_scans) = (function!(b"srf_mesh_free", Free), function!(b"srf_scans_free", Free));
    let (create_folder, path_in) =
        (function!(b"srf_folder_create", CreateFolder), function!(b"srf_folder_path", PathIn));
    let put_source = function!(b"srf_folder_put_source", unsafe extern "C" fn(Handle, Text, *const FileSource) -> i32);
    let (put, bytes_of) = (function!(b"srf_folder_put", Put), function!(b"srf_folder_bytes", BytesOf));
    let (write, open, read) =
        (function!(b"srf_mesh_write", Write), function!(b"srf_scans_open", Open), function!(b"srf_scans_read", Read));
    let null = std::ptr::null();

    let mesh = Shape::Torus { major: 1.0, minor: 0.4 }.mesh(500);
    let corners: Vec<[f64; 3]> = mesh.positions.iter().map(|p| p.to_array()).collect();
    let (mut handle, mut folder): (Handle, Handle) = (std::ptr::null_mut(), std::ptr::null_mut());
    // SAFETY: arrays as the header wants them.
    unsafe {
        assert_eq!(create(&points(&corners), &triangles(&mesh.triangles), &mut handle), 0);
        assert_eq!(create_folder(null, &mut folder), 0);
    }
    let disk = tempfile::tempdir().unwrap();
    // SAFETY: handles of the library, texts that end with a zero.
    let write_to = |path: Text| assert_eq!(unsafe { write(handle, path, null, null) }, 0);
    let read_from = |path: Text| {
        let (mut scans, mut content) = (std::ptr::null_mut(), 0);
        let (mut image, mut mesh, mut cloud) = (std::ptr::null_mut(), std::ptr::null_mut(), std::ptr::null_mut());
        // SAFETY: as above.
        unsafe {
            assert_eq!(open([path].as_ptr(), 1, null, null, &mut scans), 0);
            assert_eq!(read(scans, 0, null, &mut content, &mut image, &mut mesh, &mut cloud), 0);
            assert_eq!((free(mesh), free_scans(scans)), (0, 0));
        }
    };
    let held = |name: Text| {
        let (mut bytes, mut count) = (null, 0);
        // SAFETY: as above; the bytes stay until they are asked for again.
        unsafe {
            assert_eq!(bytes_of(folder, name, &mut bytes, &mut count), 0);
            std::slice::from_raw_parts(bytes.cast::<u8>(), count).to_vec()
        }
    };
    let names = ["file_s", "memory_s"];
    for name in ["mesh.ply", "mesh.glb", "mesh.stl", "mesh.obj"] {
        let on_disk = CString::new(disk.path().join(name).to_str().unwrap()).unwrap();
        let in_memory = CString::new(name).unwrap();
        let mut path = std::ptr::null();
        // SAFETY: as above.
        assert_eq!(unsafe { path_in(folder, in_memory.as_ptr(), &mut path) }, 0);
        compare_as(
            names,
            &format!("a mesh to bytes of a {name}"),
            repeats,
            || {
                write_to(on_disk.as_ptr());
                std::hint::black_box(std::fs::read(disk.path().join(name)).unwrap());
            },
            || {
                write_to(path);
                std::hint::black_box(held(in_memory.as_ptr()));
            },
        );
        let mut buffer = held(in_memory.as_ptr());
        let user: *mut c_void = (&raw mut buffer).cast();
        let (mut sink, mut written_to) = (std::ptr::null_mut(), std::ptr::null());
        let takes = FileSink { write: write_buffer, release: None, user };
        // SAFETY: as above; the buffer outlives the folder.
        unsafe {
            assert_eq!(create_folder((&raw const takes).cast(), &mut sink), 0);
            assert_eq!(path_in(sink, in_memory.as_ptr(), &mut written_to), 0);
        }
        compare_as(
            names,
            &format!("write {name} to a function"),
            repeats,
            || write_to(on_disk.as_ptr()),
            || {
                // SAFETY: nobody is writing.
                unsafe { (*user.cast::<Vec<u8>>()).clear() };
                write_to(written_to);
            },
        );
        let bytes = held(in_memory.as_ptr());
        assert_eq!(buffer, bytes);
        assert_eq!(bytes, std::fs::read(disk.path().join(name)).unwrap());
        compare_as(
            names,
            &format!("bytes of a {name} to a mesh"),
            repeats,
            || {
                std::fs::write(disk.path().join(name), &bytes).unwrap();
                read_from(on_disk.as_ptr());
            },
            || {
                // SAFETY: as above.
                assert_eq!(unsafe { put(folder, in_memory.as_ptr(), bytes.as_ptr().cast(), bytes.len()) }, 0);
                read_from(path);
            },
        );
        let source = FileSource { length: buffer.len() as u64, read: read_buffer, release: None, user };
        // SAFETY: as above; the buffer outlives what is read of it.
        assert_eq!(unsafe { put_source(folder, in_memory.as_ptr(), &source) }, 0);
        compare_as(
            names,
            &format!("read {name} by a function"),
            repeats,
            || read_from(on_disk.as_ptr()),
            || read_from(path),
        );
        // SAFETY: as above: nothing reads the buffer any more.
        assert_eq!(unsafe { put(folder, in_memory.as_ptr(), null, 0) }, 0);
    }
}
