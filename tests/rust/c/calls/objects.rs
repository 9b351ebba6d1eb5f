//! Meshes, clouds and images, from arrays and back.

use super::*;

#[test]
pub(super) fn a_mesh_and_its_attributes() {
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
        api.refused(missing, INPUT, "no attribute colour there: there are confidence");
        let misspelt = (api.srf_mesh_attribute)(mesh, 1, c"confidance".as_ptr(), &mut view);
        api.refused(misspelt, INPUT, "there are confidence. Did you mean \"confidence\"?");
        api.refused((api.srf_mesh_attribute_name)(mesh, 1, 7, &mut name), PARAMETER, "index must be < 1, got 7");
        let wrong = (api.srf_mesh_attribute_count)(mesh, 3, &mut count);
        api.refused(wrong, PARAMETER, "SRF_DOMAIN_VERTICES (1) or SRF_DOMAIN_TRIANGLES (2), got 3");
        let short = (api.srf_mesh_set_attribute)(mesh, 2, c"x".as_ptr(), &confidence);
        api.refused(short, INPUT, "6 entries for 8 elements");
        api.ok((api.srf_mesh_set_attribute)(mesh, 1, c"confidence".as_ptr(), std::ptr::null()));
        api.ok((api.srf_mesh_attribute_count)(mesh, 1, &mut count));
        assert_eq!(count, 0);

        let mut report = CheckReport::ZERO;
        api.ok((api.srf_check_report_init_sized)(&mut report, size_of_val(&report)));
        api.ok((api.srf_mesh_check)(mesh, 1, std::ptr::null(), &mut report));
        use check_report::{GENUS, IS_MANIFOLD, TRIANGLES, VERTICES};
        assert_eq!([IS_MANIFOLD, TRIANGLES, VERTICES, GENUS].map(|place| report.numbers[place]), [1, 8, 6, 0]);
        api.refused(
            (api.srf_mesh_check)(mesh, 2, std::ptr::null(), &mut report),
            PARAMETER,
            "welded must be 0 or 1, got 2",
        );
        api.ok((api.srf_mesh_free)(mesh));
    }
}

#[test]
pub(super) fn strides_and_unaligned_data_are_fine() {
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
pub(super) fn an_image_and_its_cloud() {
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
        api.ok((api.srf_image_world_points)(image, points.as_mut_ptr(), points.len(), std::ptr::null()));
        assert_eq!(points.iter().filter(|x| !x.is_nan()).count(), 3 * valid);
        let short = (api.srf_image_world_points)(image, points.as_mut_ptr(), 5, std::ptr::null());
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
        let mut rounded = moved;
        (rounded[0], rounded[1], rounded[4], rounded[5]) = (0.8001, 0.6, -0.6, 0.7999);
        api.ok((api.srf_image_set_pose)(image, &rounded));
        api.ok((api.srf_image_camera)(image, std::ptr::null_mut(), &mut pose));
        assert!(
            (pose[0].hypot(pose[1]) - 1.0).abs() < 1e-15 && (pose[0] - 0.8).abs() < 2e-4 && pose[12..] == moved[12..]
        );
        api.ok((api.srf_image_set_pose)(image, &moved));

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
        api.ok((api.srf_image_triangulate)(image, null.cast(), null.cast(), &mut surface));
        api.ok((api.srf_mesh_attribute)(surface, 1, c"range_row".as_ptr(), &mut view));
        assert!(view.count > 200 && view.kind == I32);
        let mut cloud = Handle::NULL;
        api.ok((api.srf_image_to_cloud)(image, std::ptr::null(), &mut cloud));
        let (mut normals, mut positions) = (Array::EMPTY, Array::EMPTY);
        api.ok((api.srf_cloud_arrays)(cloud, &mut positions, &mut normals, unwanted(), unwanted()));
        assert_eq!((positions.count, normals.count), (valid, valid));
        api.ok((api.srf_cloud_pose)(cloud, &mut pose));
        assert_eq!(pose, moved);
        let (mut own, mut placed) = ([9.0; 3], [9.0; 3]);
        api.ok((api.srf_cloud_sensor)(cloud, own.as_mut_ptr()));
        api.ok((api.srf_image_sensor)(image, placed.as_mut_ptr()));
        assert_eq!((own, &placed[..]), ([0.0; 3], &moved[12..15]), "rays start in the origin");
        for end in [(api.srf_mesh_free)(surface), (api.srf_cloud_free)(cloud), (api.srf_image_free)(image)] {
            api.ok(end);
        }
        api.ok((api.srf_mesh_free)(mesh));
    }
}

#[test]
pub(super) fn a_cloud_from_arrays() {
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
        // Finite as they are given, but not in single precision.
        let long = [[0.0, 0.0, 1.0], [0.0, -1e200, 0.0]];
        let answer = (api.srf_cloud_create)(&p, &Array::of(&long, F64, 3), none, none, none.cast(), &mut cloud);
        api.refused(answer, INPUT, "normals: -1e200 is more than single precision can hold");
        let bright = [1.0, 1e200];
        let answer = (api.srf_cloud_create)(&p, none, none, &Array::of(&bright, F64, 1), none.cast(), &mut cloud);
        api.refused(answer, INPUT, "intensities: 1e200 is more than single precision can hold");
    }
}

#[test]
pub(super) fn images_from_arrays() {
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
        api.refused(create(still, 3, samples, null.cast()), PARAMETER, "step from column to column");
        let nowhere = [f64::NAN; 16];
        api.refused(create(plane, 3, samples, &nowhere), INPUT, "world_from_sensor must have finite numbers");
        let grid = Projection { kind: 6, ..plane };
        api.refused(create(grid, 3, samples, null.cast()), PARAMETER, "components must be 3, got 1");
        let bad = c"\xff";
        let answer = (api.srf_image_create)(3, 4, &plane, &samples, null.cast(), bad.as_ptr(), &mut image);
        api.refused(answer, INPUT, "name is not UTF-8");
    }
}

#[test]
fn projections_are_made_by_what_their_numbers_mean() {
    let api = api();
    let mut made = Projection { kind: 0, reserved: 7, numbers: [9.0; 4] };
    let is = |made: &Projection, kind: u32, numbers: [f64; 4]| {
        assert_eq!(*made, Projection { kind, reserved: 0, numbers });
    };
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        api.ok((api.srf_projection_orthographic)(1.0, 2.0, 0.5, -0.5, &mut made));
        is(&made, 1, [1.0, 2.0, 0.5, -0.5]);
        for along_ray in [0, 1] {
            api.ok((api.srf_projection_pinhole)(500.0, 501.0, 320.0, 240.0, along_ray, &mut made));
            is(&made, 2 + along_ray, [500.0, 501.0, 320.0, 240.0]);
        }
        api.ok((api.srf_projection_spherical)(0.1, 0.2, 0.3, -0.4, &mut made));
        is(&made, 4, [0.1, 0.2, 0.3, -0.4]);
        api.ok((api.srf_projection_grid_parallel)([0.0, 0.0, -2.0].as_ptr(), &mut made));
        is(&made, 5, [0.0, 0.0, -2.0, 0.0]);
        api.ok((api.srf_projection_grid_from)([1.0, 2.0, 3.0].as_ptr(), &mut made));
        is(&made, 6, [1.0, 2.0, 3.0, 0.0]);
        let untouched = made;
        let answer = (api.srf_projection_pinhole)(0.0, 1.0, 0.0, 0.0, 0, &mut made);
        api.refused(answer, PARAMETER, "focal length fx");
        let answer = (api.srf_projection_pinhole)(1.0, 1.0, 0.0, 0.0, 2, &mut made);
        api.refused(answer, PARAMETER, "along_ray must be 0 or 1, got 2");
        let answer = (api.srf_projection_spherical)(f64::NAN, 0.0, 1.0, 1.0, &mut made);
        api.refused(answer, PARAMETER, "first pixel");
        api.refused((api.srf_projection_grid_parallel)([0.0; 3].as_ptr(), &mut made), PARAMETER, "viewing direction");
        api.refused((api.srf_projection_grid_from)(std::ptr::null(), &mut made), NULL, "origin must not be NULL");
        assert_eq!(made, untouched);
    }
}
