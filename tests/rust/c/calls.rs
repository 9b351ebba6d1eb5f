//! Every function: once right, once with zeros, with handles that never were, were freed or are of another kind, with wrong
//! enums, after a cancel, and from eight threads at once.

use std::ffi::{CStr, CString, c_char, c_void};

use crate::library::*;

const OK: i32 = 0;
const PARAMETER: i32 = 1;
const INPUT: i32 = 2;
const IO: i32 = 4;
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
    api().ok(unsafe { (api().srf_merge_params_init)(&mut params) });
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

#[test]
fn zeros_are_refused_with_a_text_wherever_they_can_do_harm() {
    // Freeing NULL does nothing, nobody is told and one thread a core works: all allowed.
    let allowed = |name: &str| {
        name.ends_with("_free") || name == "srf_set_threads" || name == "srf_set_memory_limit" || name == "srf_set_log"
    };
    for (name, status) in api().call_with_zeros() {
        if allowed(name) {
            assert_eq!(status, OK, "{name}");
        } else {
            assert!(status == NULL, "{name}: {status}");
        }
    }
    assert!(!api().message().is_empty());
}

#[test]
fn handles_that_never_were_are_refused() {
    let all = api().call_with_junk();
    assert!(all.len() > 35, "{}", all.len());
    for (name, status) in all {
        // Some arguments are looked at before the handle; none of them is one either.
        assert!([HANDLE, NULL, STRUCT_SIZE].contains(&status), "{name}: {status}");
    }
}

#[test]
fn handles_of_another_kind_and_freed_ones_are_refused() {
    let api = api();
    let mesh = octahedron();
    let image = scan(mesh);
    let mut view = Array::EMPTY;
    // SAFETY: a wrong handle is allowed to be handed in.
    unsafe {
        api.refused((api.srf_mesh_positions)(image, &mut view), HANDLE, "mesh must be a srf_mesh, got a srf_image");
        api.refused((api.srf_image_samples)(mesh, &mut view), HANDLE, "image must be a srf_image, got a srf_mesh");
        api.refused((api.srf_mesh_free)(image), HANDLE, "srf_mesh");
        api.ok((api.srf_image_free)(image));
        api.refused((api.srf_image_free)(image), HANDLE, "freed");
        api.refused((api.srf_image_samples)(image, &mut view), HANDLE, "freed");
        assert!(view.data.is_null(), "written in spite of the error");
        api.ok((api.srf_mesh_free)(mesh));
    }
}

#[test]
fn a_mesh_and_its_attributes() {
    let api = api();
    let mesh = octahedron();
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        let floats: [f64; 6] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0];
        let confidence = Array::of(&floats, F64, 1);
        api.ok((api.srf_mesh_set_attribute)(mesh, 1, c"confidence".as_ptr(), &confidence));
        let flags: [u8; 8] = [0, 1, 0, 1, 0, 1, 0, 2];
        api.ok((api.srf_mesh_set_attribute)(mesh, 2, c"hole_fill".as_ptr(), &Array::of(&flags, U8, 1)));
        let mut count = 0;
        api.ok((api.srf_mesh_attribute_count)(mesh, 1, &mut count));
        assert_eq!(count, 1);
        let mut name = std::ptr::null();
        api.ok((api.srf_mesh_attribute_name)(mesh, 2, 0, &mut name));
        assert_eq!(text(name), "hole_fill");
        let mut view = Array::EMPTY;
        api.ok((api.srf_mesh_attribute)(mesh, 1, c"confidence".as_ptr(), &mut view));
        assert_eq!((view.kind, view.components, view.count, view.stride), (F32, 1, 6, 4));
        assert_eq!(view.bytes(), floats.map(|x| (x as f32).to_ne_bytes()).concat());
        api.ok((api.srf_mesh_attribute)(mesh, 2, c"hole_fill".as_ptr(), &mut view));
        assert_eq!(view.bytes(), [0, 1, 0, 1, 0, 1, 0, 1]);

        let missing = (api.srf_mesh_attribute)(mesh, 1, c"colour".as_ptr(), &mut view);
        api.refused(missing, INPUT, "no attribute colour there; it has confidence");
        api.refused((api.srf_mesh_attribute_name)(mesh, 1, 7, &mut name), PARAMETER, "index must be < 1, got 7");
        let wrong = (api.srf_mesh_attribute_count)(mesh, 3, &mut count);
        api.refused(wrong, PARAMETER, "SRF_VERTICES (1) or SRF_TRIANGLES (2), got 3");
        let short = (api.srf_mesh_set_attribute)(mesh, 2, c"x".as_ptr(), &confidence);
        api.refused(short, INPUT, "6 entries for 8 elements");
        api.ok((api.srf_mesh_set_attribute)(mesh, 1, c"confidence".as_ptr(), std::ptr::null()));
        api.ok((api.srf_mesh_attribute_count)(mesh, 1, &mut count));
        assert_eq!(count, 0);

        let mut report = MeshReport::ZERO;
        api.ok((api.srf_mesh_report_init)(&mut report));
        api.ok((api.srf_mesh_check)(mesh, 1, &mut report));
        assert_eq!((report.second, report.numbers[0], report.numbers[1], report.numbers[16]), (1, 8, 6, 0));
        api.refused((api.srf_mesh_check)(mesh, 2, &mut report), PARAMETER, "welded must be 0 or 1, got 2");
        api.ok((api.srf_mesh_free)(mesh));
    }
}

#[test]
fn arrays_that_lie_are_refused() {
    let api = api();
    let positions: [[f32; 3]; 3] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let good = Array::of(&positions, F32, 3);
    let mut mesh = Handle::NULL;
    let mut create = |p: Array, t: &[[i32; 3]]| {
        let t = Array::of(t, I32, 3);
        // SAFETY: wrong in the ways that are checked.
        unsafe { (api.srf_mesh_create)(&p, &t, &mut mesh) }
    };
    api.refused(create(Array { kind: 42, ..good }, &[]), INPUT, "type must be a value of srf_type, 1 to 5, got 42");
    api.refused(create(Array { components: 2, ..good }, &[]), INPUT, "components must be 3, got 2");
    api.refused(create(Array { stride: 11, ..good }, &[]), INPUT, "a stride of 11 bytes is less than the 12 bytes");
    api.refused(create(Array { count: usize::MAX, ..good }, &[]), INPUT, "more than there can be");
    api.refused(create(Array { data: std::ptr::null(), ..good }, &[]), NULL, "positions.data must not be NULL");
    api.refused(create(good, &[[0, 1, 3]]), INPUT, "triangle 0 names vertex 3");
    api.refused(create(good, &[[0, 1, -1]]), INPUT, "triangle 0 names vertex");
    let bad: [[f32; 3]; 1] = [[0.0, f32::NAN, 0.0]];
    api.refused(create(Array::of(&bad, F32, 3), &[]), INPUT, "vertex 0 has a coordinate that is not finite");
    assert_eq!(mesh, Handle::NULL, "written in spite of the errors");
}

#[test]
fn strides_and_unaligned_data_are_fine() {
    let api = api();
    // One byte of something else before each point.
    let mut packed = vec![7_u8];
    for point in [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]] {
        packed.extend(point.map(f64::to_ne_bytes).concat());
        packed.push(7);
    }
    let positions = Array { data: packed[1..].as_ptr().cast(), count: 3, stride: 25, kind: F64, components: 3 };
    let mut mesh = Handle::NULL;
    // SAFETY: as the header wants it.
    unsafe {
        api.ok((api.srf_mesh_create)(&positions, &Array::of(&[[0_u32, 1, 2]], U32, 3), &mut mesh));
        let expected = [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0_f64]].concat();
        assert_eq!(bytes(mesh)[..72], expected.iter().flat_map(|x| x.to_ne_bytes()).collect::<Vec<_>>());
        api.ok((api.srf_mesh_free)(mesh));
    }
}

#[test]
fn an_image_and_its_cloud() {
    let api = api();
    let mesh = octahedron();
    let image = scan(mesh);
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        let (mut rows, mut cols, mut valid) = (0, 0, 0);
        api.ok((api.srf_image_size)(image, &mut rows, &mut cols, &mut valid));
        assert!((rows, cols) == (64, 64) && valid > 200, "{valid}");
        let (mut projection, mut pose) = (DEPTH, [0.0; 16]);
        projection.kind = 0;
        api.ok((api.srf_image_camera)(image, &mut projection, &mut pose));
        assert_eq!((projection, pose[0], pose[15]), (DEPTH, 1.0, 1.0));
        let mut samples = Array::EMPTY;
        api.ok((api.srf_image_samples)(image, &mut samples));
        assert_eq!((samples.kind, samples.count), (F64, 4096));
        let mut points = vec![0.0; 3 * 4096];
        api.ok((api.srf_image_world_points)(image, points.as_mut_ptr(), points.len()));
        assert_eq!(points.iter().filter(|x| !x.is_nan()).count(), 3 * valid);
        let short = (api.srf_image_world_points)(image, points.as_mut_ptr(), 5);
        api.refused(short, PARAMETER, "capacity must be >= 12288, got 5 (in doubles)");
        let (mut origin, mut direction) = ([9.0; 3], [9.0; 3]);
        api.ok((api.srf_image_ray)(image, 10, 20, origin.as_mut_ptr(), direction.as_mut_ptr()));
        assert!(origin == [0.0; 3] && direction[2] > 0.5);
        let outside = (api.srf_image_ray)(image, 64, 0, origin.as_mut_ptr(), direction.as_mut_ptr());
        api.refused(outside, PARAMETER, "row must be < 64 and col < 64, got (64, 0)");

        let moved = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 5.0, 6.0, 7.0, 1.0];
        api.ok((api.srf_image_set_pose)(image, &moved));
        api.ok((api.srf_image_camera)(image, std::ptr::null_mut(), &mut pose));
        assert_eq!(pose, moved);
        let mut name = std::ptr::null();
        api.ok((api.srf_image_set_name)(image, c"left".as_ptr()));
        api.ok((api.srf_image_name)(image, &mut name));
        assert_eq!(CStr::from_ptr(name), c"left");
        api.refused((api.srf_image_set_name)(image, c"\xff".as_ptr()), INPUT, "UTF-8");
        api.ok((api.srf_image_set_name)(image, std::ptr::null()));
        api.ok((api.srf_image_name)(image, &mut name));
        assert_eq!(CStr::from_ptr(name), c"");
        let mut rows_first = moved;
        rows_first.swap(3, 12);
        api.refused((api.srf_image_set_pose)(image, &rows_first), INPUT, "the last row must be 0 0 0 1");
        let mut mirror = moved;
        mirror[0] = -mirror[0];
        api.refused((api.srf_image_set_pose)(image, &mirror), INPUT, "world_from_sensor must be rigid");

        let colours = vec![[9_u8; 4]; 4096];
        let confidences = vec![-1.0_f32; 4096];
        let (c, bad) = (Array::of(&colours, U8, 4), Array::of(&confidences, F32, 1));
        let null = std::ptr::null();
        api.ok((api.srf_image_set_attributes)(image, &c, null, null));
        api.refused((api.srf_image_set_attributes)(image, null, null, &bad), INPUT, "the confidence is -1");
        let mut view = Array::EMPTY;
        let unwanted = std::ptr::null_mut;
        api.ok((api.srf_image_attributes)(image, &mut view, unwanted(), unwanted()));
        assert_eq!(view.count, 4096, "lost by a call that failed");

        let mut surface = Handle::NULL;
        api.ok((api.srf_image_triangulate)(image, null.cast(), &mut surface));
        api.ok((api.srf_mesh_attribute)(surface, 1, c"range_row".as_ptr(), &mut view));
        assert!(view.count > 200 && view.kind == I32);
        let mut cloud = Handle::NULL;
        api.ok((api.srf_image_to_cloud)(image, &mut cloud));
        let (mut normals, mut positions) = (Array::EMPTY, Array::EMPTY);
        api.ok((api.srf_cloud_arrays)(cloud, &mut positions, &mut normals, unwanted(), unwanted()));
        assert_eq!((positions.count, normals.count), (valid, valid));
        api.ok((api.srf_cloud_pose)(cloud, &mut pose));
        assert_eq!(pose, moved);
        for end in [(api.srf_mesh_free)(surface), (api.srf_cloud_free)(cloud), (api.srf_image_free)(image)] {
            api.ok(end);
        }
        api.ok((api.srf_mesh_free)(mesh));
    }
}

#[test]
fn a_cloud_from_arrays() {
    let api = api();
    let positions = [[1e7, 2.0, 3.0], [1e7, 2.5, 3.0_f64]];
    let normals = [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0_f32]];
    let intensities = [0.25, 0.75_f64];
    let mut cloud = Handle::NULL;
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        let (p, n, i) = (Array::of(&positions, F64, 3), Array::of(&normals, F32, 3), Array::of(&intensities, F64, 1));
        let none = std::ptr::null();
        api.ok((api.srf_cloud_create)(&p, &n, none, &i, none.cast(), &mut cloud));
        let mut views = [Array::EMPTY; 4];
        let [a, b, c, d] = &mut views;
        api.ok((api.srf_cloud_arrays)(cloud, a, b, c, d));
        assert_eq!(views[0].bytes(), positions.concat().iter().flat_map(|x| x.to_ne_bytes()).collect::<Vec<_>>());
        assert_eq!(views.map(|view| view.count), [2, 2, 0, 2]);
        api.ok((api.srf_cloud_free)(cloud));
        let one = Array { count: 1, ..n };
        let answer = (api.srf_cloud_create)(&p, &one, none, none, none.cast(), &mut cloud);
        api.refused(answer, INPUT, "normals has 1 entries for 2 points");
    }
}

#[test]
fn images_from_arrays() {
    let api = api();
    let values: Vec<f32> = (0..12).map(|i| if i == 5 { f32::NAN } else { i as f32 }).collect();
    let plane = Projection { kind: 1, reserved: 0, numbers: [0.0, 0.0, 1.0, -1.0] };
    let mut image = Handle::NULL;
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        let samples = Array::of(&values, F32, 1);
        let null = std::ptr::null();
        api.ok((api.srf_image_create)(3, 4, &plane, &samples, null, c"height map".as_ptr(), &mut image));
        let mut name = std::ptr::null();
        api.ok((api.srf_image_name)(image, &mut name));
        assert_eq!(text(name), "height map");
        let mut valid = 0;
        api.ok((api.srf_image_size)(image, std::ptr::null_mut(), std::ptr::null_mut(), &mut valid));
        assert_eq!(valid, 11);
        api.ok((api.srf_image_free)(image));
        let mut create = |projection: Projection, rows, samples: Array, pose: *const [f64; 16]| {
            (api.srf_image_create)(rows, 4, &projection, &samples, pose, std::ptr::null(), &mut image)
        };
        api.refused(create(Projection { kind: 99, ..plane }, 3, samples, null.cast()), PARAMETER, "1 to 6, got 99");
        api.refused(create(plane, 4, samples, null.cast()), INPUT, "4 x 4 pixels need 4 x 4 values, got 12");
        let still = Projection { numbers: [0.0; 4], ..plane };
        api.refused(create(still, 3, samples, null.cast()), INPUT, "step from pixel to pixel");
        let nowhere = [f64::NAN; 16];
        api.refused(create(plane, 3, samples, &nowhere), INPUT, "world_from_sensor has a number that is not finite");
        let grid = Projection { kind: 6, ..plane };
        api.refused(create(grid, 3, samples, null.cast()), INPUT, "components must be 3, got 1");
        let bad = c"\xff";
        let answer = (api.srf_image_create)(3, 4, &plane, &samples, null.cast(), bad.as_ptr(), &mut image);
        api.refused(answer, INPUT, "name is not UTF-8");
    }
}

#[test]
fn an_image_is_sculpted_to_one_tolerance_after_the_other() {
    let api = api();
    let values: Vec<f64> =
        (0..4096).map(|i| (f64::from(i % 64) * 0.1).sin() * (f64::from(i / 64) * 0.07).cos()).collect();
    let plane = Projection { kind: 1, reserved: 0, numbers: [0.0, 0.0, 0.1, -0.1] };
    let (mut image, mut sculptor, mut certificate) = (Handle::NULL, Handle::NULL, Certificate::ZERO);
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        let null = std::ptr::null();
        let samples = Array::of(&values, F64, 1);
        api.ok((api.srf_image_create)(64, 64, &plane, &samples, null, std::ptr::null(), &mut image));
        api.ok((api.srf_sculptor_create)(image, std::ptr::null(), &mut sculptor));
        api.ok((api.srf_image_free)(image));
        api.ok((api.srf_certificate_init)(&mut certificate));
        let mut sculpt = |tolerance: f64| {
            let mut mesh = Handle::NULL;
            let progress = std::ptr::null();
            api.ok((api.srf_sculptor_refine)(sculptor, tolerance, progress, &mut mesh, &mut certificate));
            let bytes = bytes(mesh);
            api.ok((api.srf_mesh_free)(mesh));
            assert!(
                certificate.f64(2) <= certificate.f64(0) + 1e-12 && certificate.numbers[7] == 4096,
                "{certificate:?}"
            );
            (bytes, certificate.numbers[10])
        };
        let (fine, coarse, again) = (sculpt(0.001), sculpt(0.05), sculpt(0.001));
        assert!(fine == again && coarse.1 * 4 < fine.1, "{} {}", coarse.1, fine.1);
        let (exact, by_default) = (sculpt(0.0).1, sculpt(-1.0).1);
        assert!(exact <= 2 * 63 * 63 && by_default < exact, "{exact} {by_default}");
        let mut mesh = Handle::NULL;
        let answer = (api.srf_sculptor_refine)(sculptor, -0.5, std::ptr::null(), &mut mesh, &mut certificate);
        api.refused(answer, PARAMETER, "tolerance must be a finite number >= 0, got -0.5");
        api.ok((api.srf_sculptor_at_most)(sculptor, 300, std::ptr::null(), &mut mesh, &mut certificate));
        assert!((200..=300).contains(&certificate.numbers[10]), "{certificate:?}");
        api.ok((api.srf_mesh_free)(mesh));
        let answer = (api.srf_sculptor_at_most)(sculptor, 1, std::ptr::null(), &mut mesh, &mut certificate);
        api.refused(answer, INPUT, "at most 1 triangles are asked for");
        api.ok((api.srf_sculptor_free)(sculptor));
    }
}

#[test]
fn a_surface_through_scattered_points() {
    let api = api();
    let golden = std::f64::consts::PI * (5.0_f64.sqrt() - 1.0);
    let mut points: Vec<[f64; 3]> = (0..400)
        .map(|i| {
            let z = 1.0 - (2.0 * f64::from(i) + 1.0) / 400.0;
            let (ring, angle) = ((1.0 - z * z).sqrt(), golden * f64::from(i));
            [ring * angle.cos(), ring * angle.sin(), z]
        })
        .collect();
    points.extend([points[7], [0.0, 0.0, 3.0], [f64::NAN, 0.0, 0.0]]);
    let (mut cloud, mut reconstructor, mut mesh) = (Handle::NULL, Handle::NULL, Handle::NULL);
    let (mut params, mut report) = (ReconstructParams::ZERO, ReconstructReport::ZERO);
    let mut dropped = vec![9_u8; points.len()];
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        let null = std::ptr::null();
        let (positions, none) = (Array::of(&points, F64, 3), std::ptr::null());
        api.ok((api.srf_cloud_create)(&positions, none, none, none, null, &mut cloud));
        let two = Array::of(&points[..2], F64, 3);
        let answer = (api.srf_reconstructor_create)(cloud, &two, &mut reconstructor);
        api.refused(answer, INPUT, "2 sensor origins for 403 points");
        api.ok((api.srf_reconstructor_create)(cloud, none, &mut reconstructor));
        api.ok((api.srf_cloud_free)(cloud));
        api.ok((api.srf_reconstruct_params_init)(&mut params));
        api.ok((api.srf_reconstruct_report_init)(&mut report));
        let mut surface = |params: &ReconstructParams| {
            let (watch, dropped) = (std::ptr::null(), dropped.as_mut_ptr());
            api.ok((api.srf_reconstructor_surface)(reconstructor, params, watch, &mut mesh, &mut report, dropped));
            let bytes = bytes(mesh);
            api.ok((api.srf_mesh_free)(mesh));
            bytes
        };
        let first = surface(&params);
        params.set_f64(0, 2.0);
        params.numbers[2] = 2;
        surface(&params);
        params.set_f64(0, 1.0);
        params.numbers[2] = 1;
        assert!(surface(&params) == first, "depends on the surface before");
        // Closed; 403 points, 400 of them used, one no number, one a copy, one outside.
        assert_eq!((report.second, &report.numbers[..6]), (1, &[403, 400, 1, 1, 0, 1][..]), "{report:?}");
        assert!(
            dropped[..400].iter().all(|&reason| reason == 0) && dropped[400..] == [2, 4, 1],
            "{:?}",
            &dropped[400..]
        );
        params.numbers[3] = 7;
        let (watch, out) = (std::ptr::null(), std::ptr::null_mut());
        let answer =
            (api.srf_reconstructor_surface)(reconstructor, &params, watch, &mut mesh, std::ptr::null_mut(), out);
        api.refused(answer, PARAMETER, "closure must be SRF_CLOSED_OR_OPEN (1), SRF_CLOSED (2) or SRF_OPEN (3), got 7");
        params.numbers[3] = 1;
        params.set_f64(0, 0.5);
        let answer =
            (api.srf_reconstructor_surface)(reconstructor, &params, watch, &mut mesh, std::ptr::null_mut(), out);
        api.refused(answer, PARAMETER, "factor must be >= 1 and <= 2, got 0.5");
        api.ok((api.srf_reconstructor_free)(reconstructor));
    }
}

#[test]
fn an_image_becomes_a_quad_grid_and_a_surface() {
    let api = api();
    let values: Vec<f64> = (0..4096)
        .map(|i| if i < 8 { f64::NAN } else { (f64::from(i % 64) * 0.1).sin() * (f64::from(i / 64) * 0.2).cos() })
        .collect();
    let plane = Projection { kind: 1, reserved: 0, numbers: [0.0, 0.0, 0.1, -0.1] };
    let (mut image, mut quads, mut spline, mut mesh) = (Handle::NULL, Handle::NULL, Handle::NULL, Handle::NULL);
    let (mut params, mut report) = (QuadParams::ZERO, QuadReport::ZERO);
    let (mut rows, mut cols) = (0, 0);
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        let null = std::ptr::null();
        let none = std::ptr::null_mut;
        let samples = Array::of(&values, F64, 1);
        api.ok((api.srf_image_create)(64, 64, &plane, &samples, null, std::ptr::null(), &mut image));
        api.ok((api.srf_quad_params_init)(&mut params));
        api.ok((api.srf_quad_report_init)(&mut report));
        for (number, value, part) in [
            (2, 1, "rows must be >= 2"),
            (9, 256, "curvature_limit must be >= 1 and <= 255, got 256"),
            (0, u64::MAX, "tiles_down must be"),
            (13, 300.0_f64.to_bits(), "background_curvature must be >= 0 and <= 255, got 300"),
            (12, f64::NAN.to_bits(), "smoothing must be"),
        ] {
            let mut wrong = params;
            wrong.numbers[number] = value;
            let answer = (api.srf_quads_create)(image, &wrong, std::ptr::null(), &mut quads, none());
            api.refused(answer, PARAMETER, part);
        }
        params.set_f64(4, 0.1);
        params.set_f64(5, 0.1);
        let answer = (api.srf_quads_create)(image, &params, std::ptr::null(), &mut quads, none());
        api.refused(answer, INPUT, "not both");
        params.set_f64(4, -1.0);
        params.set_f64(5, -1.0);

        api.ok((api.srf_quads_create)(image, &params, std::ptr::null(), &mut quads, &mut report));
        let (mut positions, mut pixels, mut background) = (Array::EMPTY, Array::EMPTY, Array::EMPTY);
        let (out, more) = (&mut positions, (&mut pixels, &mut background));
        api.ok((api.srf_quads_grid)(quads, &mut rows, &mut cols, out, more.0, more.1));
        assert_eq!((rows, cols, positions.count, pixels.count, background.count), (9, 9, 81, 81, 81));
        assert_eq!([positions.components, pixels.components, background.components], [3, 2, 1]);
        assert_eq!(whole_numbers(&pixels.bytes())[160..], [63, 63]);
        assert_eq!((report.numbers[0], report.numbers[1], report.numbers[9]), (1, 1, 4088));
        assert!(report.f64(3) > 0.0 && report.f64(3) < report.f64(4), "{report:?}");

        let (mut vertices, mut uvs, mut corners, mut errors) = (Array::EMPTY, Array::EMPTY, Array::EMPTY, Array::EMPTY);
        api.ok((api.srf_quads_faces)(quads, &mut vertices, &mut uvs, &mut corners, &mut errors));
        assert_eq!((corners.count as u64, corners.components, uvs.components), (report.numbers[13], 4, 2));
        assert_eq!((vertices.count, errors.count), (uvs.count, corners.count));
        api.ok((api.srf_quads_triangles)(quads, &mut mesh));
        let mut triangles = Array::EMPTY;
        api.ok((api.srf_mesh_triangles)(mesh, &mut triangles));
        assert_eq!(triangles.count, 2 * corners.count);
        let highest = *whole_numbers(&corners.bytes()).iter().max().unwrap();
        assert_eq!(highest as usize + 1, vertices.count);
        api.ok((api.srf_mesh_free)(mesh));

        let (mut max, mut rms, mut point) = (0.0, 0.0, [0.0; 3]);
        let answer = (api.srf_spline_create)(quads, 5, 0, 0, &mut spline, std::ptr::null_mut(), std::ptr::null_mut());
        api.refused(answer, INPUT, "the order of a spline must be 2, 3 or 4, got 5");
        let answer = (api.srf_spline_create)(quads, 4, 3, 0, &mut spline, std::ptr::null_mut(), std::ptr::null_mut());
        api.refused(answer, INPUT, "3 rows of control points: order 4 over 9 rows of vertices needs 4 to 9");
        api.ok((api.srf_spline_create)(quads, 4, 0, 6, &mut spline, &mut max, &mut rms));
        assert!(0.0 < rms && rms <= max && max < 0.5, "{rms} {max}");
        let mut control = Array::EMPTY;
        api.ok((api.srf_spline_control)(spline, &mut rows, &mut cols, &mut control));
        assert_eq!((rows, cols, control.count), (9, 6, 54));
        api.ok((api.srf_spline_point)(spline, 2.0, -1.0, point.as_mut_ptr()));
        // Least squares across: the corner is met nearly.
        assert!((point[0] - 6.3).abs() < 0.1 && point[1].abs() < 1e-9, "{point:?}");
        api.refused((api.srf_spline_point)(spline, f64::NAN, 0.0, point.as_mut_ptr()), PARAMETER, "must be numbers");
        api.ok((api.srf_spline_sample)(spline, 20, 30, &mut mesh));
        api.ok((api.srf_mesh_triangles)(mesh, &mut triangles));
        assert_eq!(triangles.count, 2 * 19 * 29);
        api.ok((api.srf_mesh_free)(mesh));
        api.refused((api.srf_spline_sample)(spline, 1, 30, &mut mesh), INPUT, "2 x 2");
        api.refused((api.srf_spline_sample)(spline, 1 << 40, 1 << 40, &mut mesh), INPUT, "2 x 2");
        for handle in [image, quads, spline] {
            let free = [api.srf_image_free, api.srf_quads_free, api.srf_spline_free];
            assert_eq!(free.iter().filter(|free| free(handle) == 0).count(), 1);
        }
    }
}

fn whole_numbers(bytes: &[u8]) -> Vec<u32> {
    bytes.chunks_exact(4).map(|b| u32::from_ne_bytes(b.try_into().unwrap())).collect()
}

#[test]
fn a_mesh_is_clustered_and_so_is_a_chain() {
    let api = api();
    let (side, at) = (40_u32, |r: u32, c: u32| r * 40 + c);
    let positions: Vec<[f64; 3]> =
        (0..side * side).map(|i| [f64::from(i % side), f64::from(i / side), (f64::from(i) * 0.003).sin()]).collect();
    let cells = (0..side - 1).flat_map(|r| (0..side - 1).map(move |c| (r, c)));
    let triangles: Vec<[u32; 3]> = cells
        .flat_map(|(r, c)| [[at(r, c), at(r, c + 1), at(r + 1, c)], [at(r, c + 1), at(r + 1, c + 1), at(r + 1, c)]])
        .collect();
    let mut sheet = Handle::NULL;
    let (mut params, mut report) = (ClusterParams::ZERO, ClusterReport::ZERO);
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        api.ok((api.srf_mesh_create)(&Array::of(&positions, F64, 3), &Array::of(&triangles, U32, 3), &mut sheet));
        api.ok((api.srf_cluster_params_init)(&mut params));
        api.ok((api.srf_cluster_report_init)(&mut report));
        params.numbers[0] = 100;
        let cluster = |params: &ClusterParams, report: &mut ClusterReport| {
            let mut mesh = Handle::NULL;
            api.ok((api.srf_mesh_cluster)(sheet, params, std::ptr::null(), &mut mesh, report));
            let found = bytes(mesh);
            api.ok((api.srf_mesh_free)(mesh));
            found
        };
        let found = cluster(&params, &mut report);
        assert_eq!((report.numbers[1], report.second, report.f64(7)), (100, 0, -1.0), "{report:?}");
        assert!(report.f64(5) > report.f64(4) && report.f64(6) > 0.5, "{report:?}");
        params.second = 1;
        assert!(cluster(&params, &mut report) == found, "another number of threads");

        let (wanted, mut chain) = ([30_u64, 100], [Handle::NULL; 2]);
        api.ok((api.srf_mesh_cluster_levels)(
            sheet,
            wanted.as_ptr(),
            2,
            std::ptr::null(),
            std::ptr::null(),
            chain.as_mut_ptr(),
        ));
        assert!(bytes(chain[0]).len() < bytes(chain[1]).len());
        chain.iter().for_each(|&mesh| api.ok((api.srf_mesh_free)(mesh)));

        let mut mesh = Handle::NULL;
        let mut refused = |change: &dyn Fn(&mut ClusterParams), status: i32, text: &str| {
            let mut wrong = params;
            change(&mut wrong);
            let none = std::ptr::null_mut();
            api.refused((api.srf_mesh_cluster)(sheet, &wrong, std::ptr::null(), &mut mesh, none), status, text);
            assert!(mesh == Handle::NULL);
        };
        refused(&|p| p.numbers[1] = 7, INPUT, "one of vertices, patches and max_error");
        refused(
            &|p| p.numbers[0] = 1 << 40,
            PARAMETER,
            "vertices must be >= 1 and <= 4000000000, got 1.099511627776e12",
        );
        refused(&|p| p.numbers[4] = 1 << 40, PARAMETER, "iterations must be");
        refused(&|p| p.numbers[3] = f64::NAN.to_bits(), PARAMETER, "adaptivity must be");
        refused(&|p| (p.numbers[0], p.numbers[2]) = (0, 0), PARAMETER, "max_error must be a finite number > 0, got 0");
        // The vertices alone: a surface goes through all of them.
        let (mut cloud, none) = (Handle::NULL, std::ptr::null());
        let points = Array::of(&positions, F64, 3);
        api.ok((api.srf_cloud_create)(&points, none, none, none, std::ptr::null(), &mut cloud));
        api.ok((api.srf_cloud_cluster)(cloud, &params, std::ptr::null(), &mut mesh, &mut report));
        assert_eq!((report.numbers[1], report.numbers[8]), (100, 0), "{report:?}");
        api.ok((api.srf_mesh_free)(mesh));
        let (out, watch) = (chain.as_mut_ptr(), std::ptr::null());
        api.ok((api.srf_cloud_cluster_levels)(cloud, wanted.as_ptr(), 2, std::ptr::null(), watch, out));
        assert!(bytes(chain[0]).len() < bytes(chain[1]).len());
        chain.iter().for_each(|&mesh| api.ok((api.srf_mesh_free)(mesh)));
        api.ok((api.srf_cloud_free)(cloud));
        let few = Array::of(&positions[..3], F64, 3);
        api.ok((api.srf_cloud_create)(&few, none, none, none, std::ptr::null(), &mut cloud));
        let answer =
            (api.srf_cloud_cluster)(cloud, std::ptr::null(), std::ptr::null(), &mut mesh, std::ptr::null_mut());
        api.refused(answer, INPUT, "at least 4 different points");
        api.ok((api.srf_cloud_free)(cloud));
        api.ok((api.srf_mesh_free)(sheet));
    }
}

#[test]
fn a_merge_is_that_of_the_core_for_any_number_of_threads() {
    use glam::{DAffine3, DVec3};
    let mesh = octahedron();
    let merger = merger_of(mesh);
    let mut params = params(0.07);
    let expected = {
        let mut view = Array::EMPTY;
        // SAFETY: as the header wants it.
        api().ok(unsafe { (api().srf_mesh_positions)(mesh, &mut view) });
        let numbers: Vec<f64> = view.bytes().chunks(8).map(|b| f64::from_ne_bytes(b.try_into().unwrap())).collect();
        let positions = numbers.chunks(3).map(DVec3::from_slice).collect();
        let triangles = vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
        let mesh = surfrecon::TriMesh::new(positions, triangles);
        let name = "octahedron".to_owned();
        let placed = surfrecon::merge::PlacedMesh { name, mesh: &mesh, world_from_mesh: DAffine3::IDENTITY };
        let params = surfrecon::merge::MergeParams { voxel: Some(0.07), ..Default::default() };
        let merged = surfrecon::merge::run(&[&placed], &params, &surfrecon::Progress::none()).unwrap().mesh;
        let positions = merged.positions.iter().flat_map(|p| p.to_array()).flat_map(f64::to_ne_bytes);
        let triangles = merged.triangles.iter().flatten().flat_map(|v| v.to_ne_bytes());
        positions.chain(triangles).collect::<Vec<u8>>()
    };
    assert!(expected.len() > 1000);
    for threads in [1, 2, 8] {
        params.second = threads;
        assert!(merged(merger, &params) == expected, "{threads} threads");
    }
    // SAFETY: as the header wants it.
    unsafe {
        api().ok((api().srf_mesh_free)(mesh));
        assert!(merged(merger, &params) == expected, "the merge keeps what was added");
        api().ok((api().srf_merger_free)(merger));
    }
}

unsafe extern "C" fn cancel(stage: *const c_char, fraction: f64, message: *const c_char, user: *mut c_void) -> i32 {
    assert!(!text(stage).is_empty() && text(message).contains('%') && (0.0..=1.0).contains(&fraction));
    // SAFETY: the counter handed in.
    unsafe { *user.cast::<u32>() += 1 };
    1
}

#[test]
fn cancelling_leaves_nothing_and_the_next_call_is_fine() {
    let api = api();
    let mesh = octahedron();
    let merger = merger_of(mesh);
    let mut asked = 0_u32;
    let watch = Watch { report: Some(cancel), user: (&raw mut asked).cast() };
    let (mut surface, mut report) = (Handle::NULL, MergeReport::ZERO);
    // SAFETY: as the header wants it.
    unsafe {
        api.ok((api.srf_merge_report_init)(&mut report));
        let before = report;
        let long = params(0.001);
        api.refused((api.srf_merger_run)(merger, &long, &watch, &mut surface, &mut report), CANCELLED, "cancelled");
        assert!(asked >= 1 && surface == Handle::NULL && report == before);
        api.ok((api.srf_merger_run)(merger, &params(0.1), std::ptr::null(), &mut surface, &mut report));
        assert_eq!((report.size as usize, report.second), (size_of::<MergeReport>(), 1));
        assert_eq!(report.f64(1), 0.1);
        let points = [[0.0, 0.0, 4.0_f64], [3.0, 0.0, 4.0]];
        let (mut off, mut figures) = ([0.0; 2], Distances::ZERO);
        api.ok((api.srf_distances_init)(&mut figures));
        let points = Array::of(&points, F64, 3);
        let none = std::ptr::null();
        api.ok((api.srf_mesh_distances)(surface, &points, 1, 0, none, off.as_mut_ptr(), &mut figures));
        assert!(off[0] < -0.5 && (off[1] - 2.0).abs() < 0.05 && figures.numbers[0] == 2, "{off:?}");
        let measure = api.srf_mesh_surface_distance;
        let (mut reached, mut bound, null) = (0.0, 0.0, std::ptr::null_mut());
        api.ok(measure(surface, mesh, 0, 0, none, null, &mut figures, &mut reached, &mut bound));
        let largest = f64::from_bits(figures.numbers[4]);
        assert!(largest > 0.0 && largest <= reached && reached <= bound, "{largest} {reached} {bound}");
        assert!(bound <= 1.02 * reached + 1e-4, "{reached} {bound}");
        let answer = measure(surface, mesh, 7, 0, none, null, &mut figures, &mut reached, &mut bound);
        api.refused(answer, PARAMETER, "is_signed must be 0 or 1, got 7");
        let answer = (api.srf_mesh_distances)(surface, &points, 2, 0, none, off.as_mut_ptr(), &mut figures);
        api.refused(answer, PARAMETER, "is_signed must be 0 or 1, got 2");
        for end in [(api.srf_mesh_free)(surface), (api.srf_merger_free)(merger), (api.srf_mesh_free)(mesh)] {
            api.ok(end);
        }
    }
}

#[test]
fn parameters_out_of_range_say_value_range_and_unit() {
    let api = api();
    let mesh = octahedron();
    let merger = merger_of(mesh);
    let mut surface = Handle::NULL;
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        let mut run =
            |p: &MergeParams| (api.srf_merger_run)(merger, p, std::ptr::null(), &mut surface, std::ptr::null_mut());
        api.refused(
            run(&params(-2.0)),
            PARAMETER,
            "voxel must be a finite number > 0, got -2 (in the unit of the scans)",
        );
        let mut many = params(0.1);
        many.second = 5000;
        api.refused(run(&many), PARAMETER, "threads must be >= 0 and <= 1024, got 5000");
        api.refused((api.srf_set_threads)(2000), PARAMETER, "threads must be >= 0 and <= 1024, got 2000");
        let mut scan = ScanParams::ZERO;
        api.ok((api.srf_scan_params_init)(&mut scan));
        scan.set_f64(0, -1.0);
        let null = std::ptr::null;
        let mut image = Handle::NULL;
        let answer = (api.srf_scan_mesh)(mesh, 8, 8, &DEPTH, null(), &scan, null().cast(), &mut image);
        api.refused(answer, PARAMETER, "noise must be a finite number >= 0, got -1");
        api.refused((api.srf_mesh_write_ply)(mesh, c"x.ply".as_ptr(), 9, null().cast()), PARAMETER, "1 to 3, got 9");
        let glb = (api.srf_mesh_write_glb)(mesh, c"x.glb".as_ptr(), null().cast(), 1.0, 5, null().cast());
        api.refused(glb, PARAMETER, "z_up must be 0 or 1, got 5");
        api.ok((api.srf_merger_free)(merger));
        api.ok((api.srf_mesh_free)(mesh));
    }
}

#[test]
fn the_limit_on_memory_is_kept_until_it_is_lifted() {
    let api = api();
    // SAFETY: numbers only.
    unsafe {
        // Too much to stand in the way of the tests beside this one.
        api.ok((api.srf_set_memory_limit)(1 << 50));
        assert_eq!((api.srf_memory_limit)(), 1 << 50);
        api.ok((api.srf_set_memory_limit)(0));
        assert_eq!((api.srf_memory_limit)(), 0);
    }
}

#[test]
fn files_go_out_and_come_back() {
    let api = api();
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| CString::new(folder.path().join(name).to_str().unwrap()).unwrap();
    let mesh = octahedron();
    let (ply, glb) = (path("mesh.ply"), path("mesh.glb"));
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        let none = std::ptr::null();
        api.ok((api.srf_mesh_write_ply)(mesh, ply.as_ptr(), 2, none));
        api.ok((api.srf_mesh_write_glb)(mesh, glb.as_ptr(), std::ptr::null(), 0.001, 1, none));
        assert!(std::fs::metadata(folder.path().join("mesh.glb")).unwrap().len() > 100);
        let paths = [ply.as_ptr()];
        let mut scans = Handle::NULL;
        api.ok((api.srf_scans_open)(paths.as_ptr(), 1, &mut scans));
        let (mut count, mut notes) = (0, 9);
        api.ok((api.srf_scans_count)(scans, &mut count, &mut notes));
        assert_eq!(count, 1);
        let (mut name, mut pose) = (std::ptr::null(), [0.0; 16]);
        api.ok((api.srf_scans_describe)(scans, 0, &mut name, &mut pose));
        assert_eq!((text(name).as_str(), pose[5]), ("mesh", 1.0));
        let (mut content, mut image, mut read, mut cloud) = (0, Handle::NULL, Handle::NULL, Handle::NULL);
        api.ok((api.srf_scans_read)(scans, 0, &mut content, &mut image, &mut read, &mut cloud));
        assert_eq!((content, image, cloud), (2, Handle::NULL, Handle::NULL));
        assert!(bytes(read) == bytes(mesh));
        let merger = merger_of(mesh);
        api.ok((api.srf_merger_add_scans)(merger, scans));
        let seen = scan(mesh);
        api.ok((api.srf_merger_add_image)(merger, seen));
        assert!(merged(merger, &params(0.1)).len() > 1000);
        api.refused((api.srf_scans_note)(scans, notes, &mut name), PARAMETER, "index must be <");
        for end in [(api.srf_mesh_free)(read), (api.srf_scans_free)(scans), (api.srf_merger_free)(merger)] {
            api.ok(end);
        }
        api.ok((api.srf_image_free)(seen));
        let missing = path("missing.ply");
        api.refused((api.srf_scans_open)([missing.as_ptr()].as_ptr(), 1, &mut scans), IO, "missing.ply");
        api.refused(
            (api.srf_scans_open)([std::ptr::null()].as_ptr(), 1, &mut scans),
            NULL,
            "paths[0] must not be NULL",
        );
        let nowhere = path("no folder/mesh.ply");
        api.refused((api.srf_mesh_write_ply)(mesh, nowhere.as_ptr(), 1, none), INPUT, "there is no folder");
        api.refused((api.srf_mesh_write_ply)(mesh, c"".as_ptr(), 1, none), INPUT, "path must not be empty");
        api.ok((api.srf_mesh_free)(mesh));
    }
}

/// Opens one file and reads its only scan: what it holds, and its handle.
fn opened(path: &std::path::Path, options: *const ReadOptions) -> (u32, Handle) {
    let api = api();
    let path = CString::new(path.to_str().unwrap()).unwrap();
    let (mut scans, mut content) = (Handle::NULL, 0);
    let mut handles = [Handle::NULL; 3];
    // SAFETY: as the header wants it.
    unsafe {
        api.ok((api.srf_scans_open_with)([path.as_ptr()].as_ptr(), 1, options, &mut scans));
        let [image, mesh, cloud] = &mut handles;
        api.ok((api.srf_scans_read)(scans, 0, &mut content, image, mesh, cloud));
        api.ok((api.srf_scans_free)(scans));
    }
    (content, *handles.iter().find(|handle| **handle != Handle::NULL).unwrap())
}

#[test]
fn options_say_what_files_do_not() {
    let api = api();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.pgm");
    std::fs::write(&path, "P2 3 2 65535\n1000 2000 65535\n0 500 7\n").unwrap();
    let mut options = ReadOptions::ZERO;
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        api.ok((api.srf_read_options_init)(&mut options));
        let samples = |options: &ReadOptions| {
            let (content, image) = opened(&path, options);
            assert_eq!(content, 1);
            let (mut view, mut projection) = (Array::EMPTY, Projection { kind: 0, ..DEPTH });
            api.ok((api.srf_image_samples)(image, &mut view));
            api.ok((api.srf_image_camera)(image, &mut projection, std::ptr::null_mut()));
            let values: Vec<f64> = view.bytes().chunks(8).map(|b| f64::from_ne_bytes(b.try_into().unwrap())).collect();
            api.ok((api.srf_image_free)(image));
            (values, projection)
        };
        let (values, projection) = samples(&options);
        assert_eq!((values, projection.kind), (vec![1000.0, 2000.0, 65535.0, 0.0, 500.0, 7.0], 1));
        options.set_f64(7, 0.5);
        options.set_f64(8, 10.0);
        options.set_f64(9, 30.0);
        options.set_f64(10, 65535.0);
        let (values, projection) = samples(&options);
        assert!(values[2].is_nan() && values[0] == 510.0 && values[5] == 13.5, "{values:?}");
        assert_eq!(projection.numbers, [0.0, 30.0, 30.0, -30.0]);

        api.ok((api.srf_read_options_init)(&mut options));
        options.numbers[0] = 2;
        (1..5).zip([60.0, 61.0, 1.0, 0.5]).for_each(|(i, number)| options.set_f64(i, number));
        (options.numbers[5], options.numbers[6]) = (3, 2);
        let (values, projection) = samples(&options);
        assert_eq!((projection.kind, projection.numbers), (2, [60.0, 61.0, 1.0, 0.5]));
        assert!(values[0] == 1.0 && values[3].is_nan(), "{values:?}");

        let text = CString::new(path.to_str().unwrap()).unwrap();
        let mut scans = Handle::NULL;
        let mut open =
            |options: &ReadOptions| (api.srf_scans_open_with)([text.as_ptr()].as_ptr(), 1, options, &mut scans);
        let wrong = |change: &dyn Fn(&mut ReadOptions)| {
            let mut options = options;
            change(&mut options);
            options
        };
        api.refused(open(&wrong(&|o| o.numbers[0] = 1)), PARAMETER, "camera must be 0, SRF_PINHOLE_DEPTH (2)");
        api.refused(open(&wrong(&|o| o.numbers[0] = 0)), PARAMETER, "intrinsics or camera_size are given");
        api.refused(open(&wrong(&|o| o.numbers[0] |= 9 << 32)), PARAMETER, "pixels must be a value of srf_pixels");
        api.refused(open(&wrong(&|o| o.second = 2)), PARAMETER, "allow_outside must be 0 or 1, got 2");
        api.refused(open(&wrong(&|o| o.set_f64(7, 0.0))), PARAMETER, "scale must be a finite number > 0, got 0");
        api.refused(open(&wrong(&|o| o.set_f64(1, 0.0))), INPUT, "focal");
        assert_eq!(scans, Handle::NULL);
    }
}

#[test]
fn everything_is_written_and_comes_back() {
    let api = api();
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let c = |name: &str| CString::new(path(name).to_str().unwrap()).unwrap();
    let mesh = octahedron();
    let (image, mut cloud) = (scan(mesh), Handle::NULL);
    let defaults = std::ptr::null();
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        let none = std::ptr::null();
        api.ok((api.srf_mesh_write_obj)(mesh, c("mesh.obj").as_ptr(), none));
        api.ok((api.srf_mesh_write_stl)(mesh, c("mesh.stl").as_ptr(), none));
        for name in ["mesh.obj", "mesh.stl"] {
            let (content, read) = opened(&path(name), defaults);
            // STL has no indices: the vertices come back in another order.
            let same = name == "mesh.stl" && bytes(read).len() == bytes(mesh).len() || bytes(read) == bytes(mesh);
            assert!(content == 2 && same, "{name}");
            api.ok((api.srf_mesh_free)(read));
        }
        let levels = [mesh, mesh];
        api.ok((api.srf_meshes_write_glb_levels)(levels.as_ptr(), 2, c("lod.glb").as_ptr(), none.cast(), 1.0, 0, none));
        let (content, read) = opened(&path("lod.glb"), defaults);
        assert!(content == 2 && bytes(read) == bytes(mesh), "the finest");
        api.ok((api.srf_mesh_free)(read));
        let nothing =
            (api.srf_meshes_write_glb_levels)(levels.as_ptr(), 0, c("n.glb").as_ptr(), none.cast(), 1.0, 0, none);
        api.refused(nothing, INPUT, "count is 0");
        api.ok((api.srf_image_to_cloud)(image, &mut cloud));
        api.ok((api.srf_cloud_write_ply)(cloud, c("cloud.ply").as_ptr(), 2, none));
        let (content, read) = opened(&path("cloud.ply"), defaults);
        let positions = |cloud: Handle| {
            let mut view = Array::EMPTY;
            let unwanted = std::ptr::null_mut;
            api.ok((api.srf_cloud_arrays)(cloud, &mut view, unwanted(), unwanted(), unwanted()));
            view.bytes()
        };
        assert!(content == 3 && positions(read) == positions(cloud) && !positions(read).is_empty());
        api.ok((api.srf_cloud_free)(read));

        let images = [image];
        let mut valid = 0;
        api.ok((api.srf_image_size)(image, std::ptr::null_mut(), std::ptr::null_mut(), &mut valid));
        api.ok((api.srf_images_write_ptx)(images.as_ptr(), 1, c("scan.ptx").as_ptr(), none));
        api.ok((api.srf_images_write_e57)(images.as_ptr(), 1, c("scan.e57").as_ptr(), none));
        let refused = (api.srf_images_write_conf)(images.as_ptr(), 1, c("scans.conf").as_ptr(), 1, none);
        api.refused(refused, INPUT, "a name of its own that can be a file's");
        for name in ["scan.ptx", "scan.e57"] {
            let (content, read) = opened(&path(name), defaults);
            let mut there = 0;
            api.ok((api.srf_image_size)(read, std::ptr::null_mut(), std::ptr::null_mut(), &mut there));
            assert_eq!((content, there), (1, valid), "{name}");
            // It has the file's name now.
            let named = [read];
            api.ok((api.srf_images_write_conf)(named.as_ptr(), 1, c("scans.conf").as_ptr(), 3, none));
            let (content, again) = opened(&path("scans.conf"), defaults);
            api.ok((api.srf_image_size)(again, std::ptr::null_mut(), std::ptr::null_mut(), &mut there));
            assert_eq!((content, there), (1, valid), "{name}");
            api.ok((api.srf_image_free)(again));
            api.ok((api.srf_image_free)(read));
        }
        let kinds = [image, mesh];
        let answer = (api.srf_images_write_ptx)(kinds.as_ptr(), 2, c("no.ptx").as_ptr(), none);
        api.refused(answer, HANDLE, "images[1] must be a srf_image, got a srf_mesh");
        api.refused((api.srf_images_write_e57)(kinds.as_ptr(), 0, c("no.e57").as_ptr(), none), INPUT, "count is 0");
        let answer = (api.srf_images_write_conf)(images.as_ptr(), 1, c("no.conf").as_ptr(), 7, none);
        api.refused(answer, PARAMETER, "encoding must be a value of srf_encoding, 1 to 3, got 7");
        assert!(!path("no.ptx").exists());
        api.ok((api.srf_cloud_free)(cloud));
        api.ok((api.srf_image_free)(image));
        api.ok((api.srf_mesh_free)(mesh));
    }
}

#[test]
fn writing_reports_and_can_be_cancelled() {
    let api = api();
    let folder = tempfile::tempdir().unwrap();
    let path = CString::new(folder.path().join("mesh.obj").to_str().unwrap()).unwrap();
    let positions: Vec<[f64; 3]> = (0..3_000_000).map(|i| [f64::from(i) / 7.0, 1.0 / 3.0, 0.1]).collect();
    let mut mesh = Handle::NULL;
    let mut asked = 0_u32;
    let watch = Watch { report: Some(cancel), user: (&raw mut asked).cast() };
    // SAFETY: as the header wants it.
    unsafe {
        let none: [[u32; 3]; 1] = [[0, 1, 2]];
        api.ok((api.srf_mesh_create)(&Array::of(&positions, F64, 3), &Array::of(&none, U32, 3), &mut mesh));
        api.refused((api.srf_mesh_write_obj)(mesh, path.as_ptr(), &watch), CANCELLED, "cancelled");
        assert_eq!((asked, std::fs::read_dir(folder.path()).unwrap().count()), (1, 0));
        api.ok((api.srf_mesh_write_obj)(mesh, path.as_ptr(), std::ptr::null()));
        let (mut scans, mut content) = (Handle::NULL, 0);
        let mut read = [Handle::NULL; 3];
        api.ok((api.srf_scans_open)([path.as_ptr()].as_ptr(), 1, &mut scans));
        let [a, b, c] = &mut read;
        let answer = (api.srf_scans_read_with)(scans, 0, &watch, &mut content, a, b, c);
        api.refused(answer, CANCELLED, "cancelled");
        assert_eq!((asked, content, read), (2, 0, [Handle::NULL; 3]));
        api.ok((api.srf_scans_free)(scans));
        api.ok((api.srf_mesh_free)(mesh));
    }
}

unsafe extern "C" fn count_messages(level: i32, said: *const c_char, user: *mut c_void) {
    assert!(level == 1 || level == 2);
    // SAFETY: the list handed in.
    unsafe { (*user.cast::<std::sync::Mutex<Vec<String>>>()).lock().unwrap().push(text(said)) };
}

#[test]
fn the_log_hears_of_gaps() {
    let api = api();
    let said = Box::leak(Box::new(std::sync::Mutex::new(Vec::<String>::new())));
    let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0_f64]];
    let mut mesh = Handle::NULL;
    // SAFETY: as the header wants it.
    unsafe {
        api.ok((api.srf_set_log)(Some(count_messages), (said as *mut std::sync::Mutex<Vec<String>>).cast()));
        let triangle = Array::of(&[[0_u32, 1, 2]], U32, 3);
        api.ok((api.srf_mesh_create)(&Array::of(&positions, F64, 3), &triangle, &mut mesh));
        let merger = merger_of(mesh);
        merged(merger, &params(0.03));
        api.ok((api.srf_set_log)(None, std::ptr::null_mut()));
        assert!(said.get_mut().unwrap().iter().any(|text| text.contains("open boundary loops")), "{said:?}");
        api.ok((api.srf_merger_free)(merger));
        api.ok((api.srf_mesh_free)(mesh));
    }
}

#[test]
fn every_call_from_eight_threads_at_once() {
    let all: [fn(); 17] = [
        zeros_are_refused_with_a_text_wherever_they_can_do_harm,
        handles_that_never_were_are_refused,
        handles_of_another_kind_and_freed_ones_are_refused,
        a_mesh_and_its_attributes,
        arrays_that_lie_are_refused,
        strides_and_unaligned_data_are_fine,
        an_image_and_its_cloud,
        a_cloud_from_arrays,
        images_from_arrays,
        an_image_is_sculpted_to_one_tolerance_after_the_other,
        a_surface_through_scattered_points,
        an_image_becomes_a_quad_grid_and_a_surface,
        a_mesh_is_clustered_and_so_is_a_chain,
        cancelling_leaves_nothing_and_the_next_call_is_fine,
        files_go_out_and_come_back,
        options_say_what_files_do_not,
        everything_is_written_and_comes_back,
    ];
    std::thread::scope(|scope| {
        for first in 0..8 {
            scope.spawn(move || (0..all.len()).for_each(|i| all[(first + i) % all.len()]()));
        }
    });
}

#[test]
fn eight_threads_at_once_get_the_same() {
    let shared = octahedron();
    let results: Vec<Vec<u8>> = std::thread::scope(|scope| {
        let work = || {
            (0..5)
                .map(|_| {
                    let own = octahedron();
                    let image = scan(shared);
                    let merger = merger_of(own);
                    // SAFETY: as the header wants it.
                    unsafe {
                        api().ok((api().srf_merger_add_image)(merger, image));
                        api().ok((api().srf_mesh_free)(own));
                        api().ok((api().srf_image_free)(image));
                        let bytes = merged(merger, &params(0.05));
                        api().ok((api().srf_merger_free)(merger));
                        bytes
                    }
                })
                .next_back()
                .unwrap()
        };
        let threads: Vec<_> = (0..8).map(|_| scope.spawn(work)).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    assert!(results.iter().all(|bytes| *bytes == results[0]));
    // SAFETY: as the header wants it.
    api().ok(unsafe { (api().srf_mesh_free)(shared) });
}
