//! Right arguments of every type, by their names, with the fault that a kit has.

use std::any::type_name;

use super::kit::{Fault, Kit, SIDE};
use super::*;

/// Too many to pass any limit on memory.
const BYTES: usize = 8192;

/// An argument of a type.
pub trait Right {
    fn right(kit: &Kit, name: &str) -> Self;
}

unsafe extern "C" fn makes(user: *mut c_void, out: *mut Handle) -> i32 {
    let plane = Projection { kind: 1, reserved: 0, numbers: [0.0, 0.0, 0.1, -0.1] };
    let samples = [0.0_f64; 16];
    let null = std::ptr::null();
    assert!(user.is_null());
    // SAFETY: as the header wants it.
    unsafe { (api().srf_image_create)(4, 4, &plane, &Array::of(&samples, F64, 1), null, std::ptr::null(), out) }
}

unsafe extern "C" fn reads(_: *mut c_void, _: u64, _: *mut c_void, _: usize, count: *mut usize) -> i32 {
    // SAFETY: room for the number.
    unsafe { *count = 0 };
    0
}

unsafe extern "C" fn nothing() {}

impl Right for Handle {
    fn right(kit: &Kit, name: &str) -> Self {
        let right = kit.handle(name);
        if kit.is(Fault::Handle) { Handle(std::ptr::without_provenance_mut(0x1234)) } else { right }
    }
}

impl Right for LogFn {
    fn right(_: &Kit, _: &str) -> Self {
        None
    }
}

impl Right for f64 {
    fn right(kit: &Kit, name: &str) -> Self {
        if kit.is(Fault::Number) {
            return f64::NAN;
        }
        if name == "tolerance" { 0.1 } else { 0.5 }
    }
}

impl Right for usize {
    fn right(kit: &Kit, name: &str) -> Self {
        match name {
            "size" => return if kit.is(Fault::Size) { 7 } else { 8 },
            "rows" | "cols" | "depth_rows" | "depth_cols" if kit.is(Fault::Number) => return 1 << 31,
            "rows" | "cols" | "depth_rows" | "depth_cols" => return SIDE,
            "count" if kit.function() == "srf_folder_put" => return BYTES,
            "count" if ["srf_aligner_snap", "srf_aligner_misfit", "srf_aligner_turn"].contains(&kit.function()) => {
                return 0;
            }
            "count" if kit.function().ends_with("_levels") && !kit.function().contains("glb") => return 1,
            "count" => return if kit.is(Fault::Number) { 0 } else { 1 },
            "capacity" | "max_triangles" => return if kit.is(Fault::Number) { 0 } else { 1 << 15 },
            _ => {}
        }
        if kit.is(Fault::Number) { 1 << 40 } else { usize::from(name == "b") }
    }
}

macro_rules! whole {
    ($($t:ty),*) => {$(
        impl Right for $t {
            fn right(kit: &Kit, name: &str) -> Self {
                match name {
                    "status" | "bytes" if !kit.is(Fault::Number) => 0,
                    "threads" | "welded" | "is_signed" | "faces" | "z_up" if !kit.is(Fault::Number) => 0,
                    _ if kit.is(Fault::Number) => 60_000,
                    _ => 1,
                }
            }
        }
    )*};
}
whole!(i32, u32);

impl Right for u64 {
    fn right(_: &Kit, _: &str) -> Self {
        0
    }
}

impl<T: 'static> Right for *mut T {
    fn right(kit: &Kit, name: &str) -> Self {
        let is_sized = type_name::<T>().contains("Sized<");
        if is_sized && !kit.function().ends_with("_init_sized") {
            let place: *mut c_void =
                if name == "camera" { kit.camera().cast() } else { kit.keep(vec![0_u64; size_of::<T>() / 8]).cast() };
            let place = if name == "camera" {
                place
            } else {
                // SAFETY: a list that is kept.
                unsafe { (*place.cast::<Vec<u64>>()).as_mut_ptr().cast() }
            };
            return kit.sized(place, size_of::<T>()).cast();
        }
        let room = kit.keep(vec![0_u64; 1 << 16]);
        // SAFETY: it is kept.
        unsafe { (*room).as_mut_ptr().cast() }
    }
}

impl<T: 'static> Right for *const T {
    fn right(kit: &Kit, name: &str) -> Self {
        let kind = type_name::<T>();
        let last = kind.rsplit("::").next().unwrap_or(kind);
        let place: *const c_void = match (last, name) {
            (_, "progress") => {
                if kit.is(Fault::Handle) {
                    let cancel = Handle(std::ptr::without_provenance_mut(0x1234));
                    return kit.keep(Watch { report: None, user: std::ptr::null_mut(), cancel }).cast_const().cast();
                }
                if kit.is(Fault::None) {
                    return kit.watch().cast();
                }
                if !kit.is(Fault::Cancelled) {
                    return std::ptr::null();
                }
                let cancel = kit.handle("cancel");
                // SAFETY: as the header wants it.
                assert_eq!(unsafe { (api().srf_cancel_set)(cancel) }, 0);
                kit.keep(Watch { report: None, user: std::ptr::null_mut(), cancel }).cast()
            }
            ("Array", _) => kit.array(name).cast(),
            ("Projection", _) => {
                let kind = if kit.is(Fault::Number) { 99 } else { 2 };
                kit.keep(Projection { kind, reserved: 0, numbers: [20.0, 20.0, 12.0, 12.0] }).cast()
            }
            ("FileSink", _) => return std::ptr::null(),
            ("FileSource", _) => {
                kit.keep(FileSource { length: 0, read: Some(reads), release: None, user: std::ptr::null_mut() }).cast()
            }
            ("ImageSource", _) => kit.keep(ImageSource { make: Some(makes), user: std::ptr::null_mut() }).cast(),
            (_, "pose" | "poses" | "similarity") => {
                let number = if kit.is(Fault::Values) { f64::NAN } else { 0.0 };
                if number == 0.0 && name == "poses" {
                    return std::ptr::null();
                }
                let identity: [f64; 16] = std::array::from_fn(|i| if i % 5 == 0 { 1.0 } else { number });
                kit.keep(identity).cast()
            }
            (_, "plane") => {
                let plane = kit.plane();
                if kit.is(Fault::Senseless) {
                    // SAFETY: it is kept.
                    unsafe { (*plane).numbers.fill(0) };
                }
                kit.sized(plane.cast(), size_of::<Plane>())
            }
            (_, "camera") => kit.sized(kit.camera().cast(), size_of::<GridCamera>()),
            (_, "pick") => {
                let pick = kit.keep(Pick::ZERO);
                // SAFETY: as the header wants it.
                api().ok(unsafe { (api().srf_pick_init_sized)(pick, size_of::<Pick>()) });
                // SAFETY: it is kept.
                unsafe { (*pick).numbers[0] = if kit.is(Fault::Number) { 7 } else { 1 } << 32 };
                kit.sized(pick.cast(), size_of::<Pick>())
            }
            (_, "frame") => {
                let frame = kit.keep(Frame::ZERO);
                // SAFETY: as the header wants it.
                unsafe {
                    *frame = frames::form(SIDE, SIDE);
                    if kit.is(Fault::Parameters) {
                        (*frame).numbers.fill(f64::NAN.to_bits());
                    }
                }
                kit.sized(frame.cast(), size_of::<Frame>())
            }
            // Others take long.
            (_, "params") if kit.function() == "srf_mesh_texture" && kit.fault != Fault::Parameters => {
                kit.sized(kit.small_images().cast(), size_of::<TextureParams>())
            }
            (_, "params" | "options") => {
                if !kit.is(Fault::Parameters) && !kit.is(Fault::Size) {
                    return std::ptr::null();
                }
                let mut words = vec![u64::MAX; size_of::<T>() / 8];
                words[0] = if kit.fault == Fault::Size { 0 } else { u64::MAX << 32 | size_of::<T>() as u64 };
                let words = kit.keep(words);
                // SAFETY: it is kept.
                unsafe { (*words).as_ptr().cast() }
            }
            (_, "path") if kit.function() == "srf_file_provenance" => match () {
                () if kit.is(Fault::Text) => c"\xff".as_ptr().cast(),
                () if kit.is(Fault::Path) => kit.path("missing/out.ply").cast(),
                () => {
                    let path = kit.mesh_file("from.ply");
                    if kit.fault == Fault::Damaged {
                        kit.spoil("from.ply");
                    }
                    path.cast()
                }
            },
            (_, "path") => {
                let ending = [
                    ("conf", "conf"),
                    ("ptx", "ptx"),
                    ("e57", "e57"),
                    ("glb", "glb"),
                    ("stl", "stl"),
                    ("3mf", "3mf"),
                    ("obj", "obj"),
                ];
                let ending =
                    ending.iter().find(|(of, _)| kit.function().contains(of)).map_or("ply", |(_, ending)| ending);
                let folder = if kit.is(Fault::Path) { "missing/" } else { "" };
                match kit.is(Fault::Text) {
                    true => c"\xff".as_ptr().cast(),
                    false => kit.path(&format!("{folder}out.{ending}")).cast(),
                }
            }
            (_, "file") => match kit.is(Fault::Text) {
                true => c"\xff".as_ptr().cast(),
                false => kit.path("out.ply").cast(),
            },
            (_, "paths") => {
                let path = match () {
                    () if kit.is(Fault::Text) => c"\xff".as_ptr(),
                    () if kit.is(Fault::Path) => kit.path("missing/scan.ptx"),
                    () => kit.scan_file("open.ptx"),
                };
                if kit.fault == Fault::Damaged {
                    kit.spoil("open.ptx");
                }
                kit.keep([path]).cast()
            }
            (_, "name" | "text") => match kit.is(Fault::Text) {
                true => c"\xff".as_ptr().cast(),
                false => c"name".as_ptr().cast(),
            },
            (_, "workspace") => match kit.is(Fault::Text) {
                true => c"\xff".as_ptr().cast(),
                false => return std::ptr::null(),
            },
            (_, "provenance") => match () {
                () if kit.is(Fault::Text) => c"\xff".as_ptr().cast(),
                () if kit.is(Fault::Values) => c"[]".as_ptr().cast(),
                () => c"{}".as_ptr().cast(),
            },
            (_, "images" | "meshes" | "photos") => {
                let one = if kit.is(Fault::Handle) {
                    Handle(std::ptr::without_provenance_mut(0x1234))
                } else {
                    kit.handle(&name.replace("images", "image").replace("meshes", "mesh").replace("photos", "photo"))
                };
                kit.keep([one]).cast()
            }
            (_, "bytes") => kit.keep([7_u8; BYTES]).cast(),
            (_, "allocator") => kit.keep([nothing as *const () as usize, 0, nothing as *const () as usize, 0]).cast(),
            (_, "vertices") => kit.keep([if kit.is(Fault::Number) { 0_u64 } else { 40 }]).cast(),
            ("f64", "angles") if kit.function() == "srf_aligner_turn" => return std::ptr::null(),
            ("f64", _) => {
                let number = if kit.is(Fault::Values) { f64::NAN } else { 0.0 };
                let numbers = match name {
                    "points" => [number, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0],
                    "a" | "point" | "origin" => [number; 9],
                    _ => [number, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
                };
                kit.keep(numbers).cast()
            }
            other => panic!("{}: nothing is right for {other:?}", kit.function()),
        };
        place.cast()
    }
}
