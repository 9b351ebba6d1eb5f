//! Extent of content: its amount, where it lies, and its places in single precision.

use super::*;

/// Corners, or the status.
fn bounds(call: impl FnOnce(*mut f64, *mut f64) -> i32) -> Result<[[f64; 3]; 2], i32> {
    let [mut min, mut max] = [[9.0; 3]; 2];
    match call(min.as_mut_ptr(), max.as_mut_ptr()) {
        OK => Ok([min, max]),
        status => {
            assert_eq!([min, max], [[9.0; 3]; 2], "written in spite of the error");
            Err(status)
        }
    }
}

#[test]
pub(super) fn what_there_is_is_counted_and_has_bounds() {
    let api = api();
    let mesh = octahedron();
    let image = scan(mesh);
    let none: *const Watch = std::ptr::null();
    let pose: [f64; 16] = [0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 10.0, 20.0, 30.0, 1.0];
    let points = [[0.0, 0.0, 0.0], [1.0, 2.0, 3.0], [f64::NAN, 50.0, 0.0]];
    let (mut cloud, mut empty, mut nothing, mut seen) = (Handle::NULL, Handle::NULL, Handle::NULL, Handle::NULL);
    // SAFETY: as the header wants it.
    unsafe {
        let (mut vertices, mut triangles, mut count) = (9, 9, 9);
        api.ok((api.srf_mesh_size)(mesh, &mut vertices, &mut triangles));
        api.ok((api.srf_mesh_size)(mesh, std::ptr::null_mut(), std::ptr::null_mut()));
        let array = Array::of(&points, F64, 3);
        api.ok((api.srf_cloud_create)(&array, none.cast(), none.cast(), none.cast(), &pose, &mut cloud));
        api.ok((api.srf_cloud_size)(cloud, &mut count));
        assert_eq!((vertices, triangles, count), (6, 8, 3));
        let of_mesh = bounds(|min, max| (api.srf_mesh_bounds)(mesh, none, min, max));
        assert_eq!(of_mesh, Ok([[-1.0, -1.0, 3.0], [1.0, 1.0, 5.0]]));
        // A quarter of a turn, then moved.
        let of_cloud = bounds(|min, max| (api.srf_cloud_bounds)(cloud, none, min, max));
        assert_eq!(of_cloud, Ok([[8.0, 20.0, 30.0], [10.0, 21.0, 33.0]]));
        api.ok((api.srf_image_set_pose)(image, &pose));
        let [min, max] = bounds(|min, max| (api.srf_image_bounds)(image, none, min, max)).unwrap();
        assert!(min[0] > 9.0 && max[0] < 11.0 && (33.0..33.1).contains(&min[2]) && max[2] < 34.1, "{min:?} {max:?}");

        let array = Array { count: 0, ..array };
        api.ok((api.srf_mesh_create)(&array, none.cast(), &mut empty));
        let refused = |status: Result<[[f64; 3]; 2], i32>, expected: i32, part: &str| {
            api.refused(status.unwrap_err(), expected, part);
        };
        refused(bounds(|min, max| (api.srf_mesh_bounds)(empty, none, min, max)), INPUT, "no vertex");
        let lost = Array { data: points[2].as_ptr().cast(), count: 1, ..Array::of(&points, F64, 3) };
        api.ok((api.srf_cloud_create)(&lost, none.cast(), none.cast(), none.cast(), none.cast(), &mut nothing));
        refused(bounds(|min, max| (api.srf_cloud_bounds)(nothing, none, min, max)), INPUT, "no point whose");
        let unseen = Array::of(&[f64::NAN; 4], F64, 1);
        api.ok((api.srf_image_create)(2, 2, &DEPTH, &unseen, none.cast(), none.cast(), &mut seen));
        refused(bounds(|min, max| (api.srf_image_bounds)(seen, none, min, max)), INPUT, "no valid pixel");
        let mut asked = 0_u32;
        let watch = Watch { report: Some(cancel), user: (&raw mut asked).cast(), cancel: Handle::NULL };
        refused(bounds(|min, max| (api.srf_mesh_bounds)(mesh, &watch, min, max)), CANCELLED, "cancelled");
        refused(bounds(|min, max| (api.srf_cloud_bounds)(cloud, &watch, min, max)), CANCELLED, "cancelled");
        refused(bounds(|min, max| (api.srf_image_bounds)(image, &watch, min, max)), CANCELLED, "cancelled");
        for end in [(api.srf_mesh_free)(mesh), (api.srf_mesh_free)(empty), (api.srf_image_free)(image)] {
            api.ok(end);
        }
        for end in [(api.srf_cloud_free)(cloud), (api.srf_cloud_free)(nothing), (api.srf_image_free)(seen)] {
            api.ok(end);
        }
    }
}

#[test]
pub(super) fn far_positions_keep_their_digits_in_single_precision() {
    let api = api();
    let points = [[4e6 + 0.001, 5e6, -7.0], [4e6, 5e6 - 0.25, 1e300], [0.5, 0.25, 0.125]];
    let (mut mesh, mut cloud, none) = (Handle::NULL, Handle::NULL, std::ptr::null::<Watch>());
    let origin = [4e6, 5e6, 0.0];
    let mut out = [9.0_f32; 6];
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        let array = Array { count: 1, ..Array::of(&points, F64, 3) };
        let last = Array { data: points[2].as_ptr().cast(), ..array };
        api.ok((api.srf_mesh_create)(&array, none.cast(), &mut mesh));
        let whole = Array::of(&points, F64, 3);
        api.ok((api.srf_cloud_create)(&whole, none.cast(), none.cast(), none.cast(), none.cast(), &mut cloud));
        api.ok((api.srf_mesh_positions_f32)(mesh, origin.as_ptr(), out.as_mut_ptr(), 3, none.cast()));
        let expected = (4e6 + 0.001 - 4e6) as f32;
        assert_eq!(out, [expected, 0.0, -7.0, 9.0, 9.0, 9.0]);
        assert!((out[0] - 0.001).abs() < 1e-6);
        api.ok((api.srf_mesh_positions_f32)(mesh, std::ptr::null(), out.as_mut_ptr(), 6, none.cast()));
        assert_eq!(out[..3], [4e6, 5e6, -7.0]);
        let status = (api.srf_mesh_positions_f32)(mesh, std::ptr::null(), out.as_mut_ptr(), 2, none.cast());
        api.refused(status, PARAMETER, "capacity must be >= 3, got 2 (in floats)");
        let nan = [0.0, f64::NAN, 0.0];
        let status = (api.srf_mesh_positions_f32)(mesh, nan.as_ptr(), out.as_mut_ptr(), 3, none.cast());
        api.refused(status, PARAMETER, "origin must be finite");
        let status = (api.srf_mesh_positions_f32)(mesh, std::ptr::null(), std::ptr::null_mut(), 3, none.cast());
        api.refused(status, NULL, "out_positions must not be NULL");
        let mut room = [9.0_f32; 9];
        let status = (api.srf_cloud_positions_f32)(cloud, std::ptr::null(), room.as_mut_ptr(), 9, none.cast());
        api.refused(status, INPUT, "point 1 is farther from origin than single precision can hold");
        assert_eq!(room, [9.0; 9], "written in spite of the error");
        let mut asked = 0_u32;
        let watch = Watch { report: Some(cancel), user: (&raw mut asked).cast(), cancel: Handle::NULL };
        let status = (api.srf_cloud_positions_f32)(cloud, std::ptr::null(), room.as_mut_ptr(), 9, &watch);
        api.refused(status, CANCELLED, "cancelled");
        let status = (api.srf_mesh_positions_f32)(mesh, std::ptr::null(), out.as_mut_ptr(), 3, &watch);
        api.refused(status, CANCELLED, "cancelled");
        api.ok((api.srf_cloud_free)(cloud));
        api.ok((api.srf_mesh_free)(mesh));
        api.ok((api.srf_mesh_create)(&last, none.cast(), &mut mesh));
        api.ok((api.srf_mesh_positions_f32)(mesh, std::ptr::null(), out.as_mut_ptr(), 3, none.cast()));
        assert_eq!(out[..3], [0.5, 0.25, 0.125]);
        api.ok((api.srf_mesh_free)(mesh));
    }
}
