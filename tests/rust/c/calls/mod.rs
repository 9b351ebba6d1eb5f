//! Every function: once right, once with zeros, with handles that never were, were freed or are of another kind, with wrong
//! enums, after a cancel, and from eight threads at once.

mod aligning;
mod bounds;
mod cancelling;
mod contexts;
mod crs;
mod files;
mod folders;
mod frames;
pub mod kit;
mod merging;
mod objects;
mod operations;
mod refusals;
pub mod right;
mod rightly;
mod select;
mod threads;
mod vertices;

use std::ffi::{CStr, CString, c_char, c_void};

use crate::library::*;

const OK: i32 = 0;
const PARAMETER: i32 = 1;
const INPUT: i32 = 2;
const FORMAT: i32 = 3;
const IO: i32 = 4;
const OUT_OF_MEMORY: i32 = 5;
const CANCELLED: i32 = 6;
const NULL: i32 = 7;
const HANDLE: i32 = 9;
const STRUCT_SIZE: i32 = 10;

const DEPTH: Projection = Projection { kind: 2, reserved: 0, numbers: [60.0, 60.0, 31.5, 31.5] };

/// An octahedron around (0, 0, 4), subdivided by nothing: eight triangles.
fn octahedron() -> Handle {
    let api = api();
    let positions: [[f64; 3]; 6] =
        [[1.0, 0.0, 4.0], [-1.0, 0.0, 4.0], [0.0, 1.0, 4.0], [0.0, -1.0, 4.0], [0.0, 0.0, 5.0], [0.0, 0.0, 3.0]];
    let triangles: [[u32; 3]; 8] =
        [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    let mut mesh = Handle::NULL;
    let (p, t) = (Array::of(&positions, F64, 3), Array::of(&triangles, U32, 3));
    // SAFETY: as the header wants it.
    api.ok(unsafe { (api.srf_mesh_create)(&p, &t, &mut mesh) });
    mesh
}

fn scan(mesh: Handle) -> Handle {
    let api = api();
    let mut image = Handle::NULL;
    // SAFETY: as the header wants it.
    let status = unsafe {
        (api.srf_scan_mesh)(mesh, 64, 64, &DEPTH, std::ptr::null(), std::ptr::null(), std::ptr::null(), &mut image)
    };
    api.ok(status);
    image
}

fn merger_of(mesh: Handle) -> Handle {
    let api = api();
    let mut merger = Handle::NULL;
    // SAFETY: as the header wants it.
    unsafe {
        api.ok((api.srf_merger_create)(&mut merger));
        api.ok((api.srf_merger_add_mesh)(merger, mesh, std::ptr::null(), c"octahedron".as_ptr()));
    }
    merger
}

fn params(voxel: f64) -> MergeParams {
    let mut params = MergeParams::ZERO;
    // SAFETY: as the header wants it.
    api().ok(unsafe { (api().srf_merge_params_init_sized)(&mut params, size_of_val(&params)) });
    params.set_f64(0, voxel);
    params
}

/// Bytes of positions and triangles.
fn bytes(mesh: Handle) -> Vec<u8> {
    let api = api();
    let (mut positions, mut triangles) = (Array::EMPTY, Array::EMPTY);
    // SAFETY: as the header wants it.
    unsafe {
        api.ok((api.srf_mesh_positions)(mesh, &mut positions));
        api.ok((api.srf_mesh_triangles)(mesh, &mut triangles));
    }
    assert_eq!((positions.kind, positions.components, triangles.kind, triangles.components), (F64, 3, U32, 3));
    [positions.bytes(), triangles.bytes()].concat()
}

fn merged(merger: Handle, params: &MergeParams) -> Vec<u8> {
    let api = api();
    let mut mesh = Handle::NULL;
    // SAFETY: as the header wants it.
    unsafe {
        api.ok((api.srf_merger_run)(merger, params, std::ptr::null(), &mut mesh, std::ptr::null_mut()));
        let bytes = bytes(mesh);
        api.ok((api.srf_mesh_free)(mesh));
        bytes
    }
}

unsafe extern "C" fn cancel(stage: *const c_char, fraction: f64, message: *const c_char, user: *mut c_void) -> i32 {
    assert!(!text(stage).is_empty() && text(message).contains('%') && (0.0..=1.0).contains(&fraction));
    // SAFETY: the counter handed in.
    unsafe { *user.cast::<u32>() += 1 };
    1
}
