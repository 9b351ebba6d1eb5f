//! Arguments that every function refuses: zeros, handles that never were, were freed or are of another kind, arrays that lie.

use super::*;

#[test]
pub(super) fn zeros_are_refused_with_a_text_wherever_they_can_do_harm() {
    // Freeing NULL does nothing, no context is used, nobody is told and one thread a core works: all allowed.
    let allowed = |name: &str| {
        let settings = ["srf_set_threads", "srf_set_memory_limit", "srf_set_log", "srf_context_use"];
        name.ends_with("_free") || settings.contains(&name)
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
pub(super) fn handles_that_never_were_are_refused() {
    let all = api().call_with_junk();
    assert!(all.len() > 35, "{}", all.len());
    for (name, status) in all {
        // Some arguments are looked at before the handle; none of them is one either.
        assert!([HANDLE, NULL, STRUCT_SIZE].contains(&status), "{name}: {status}");
    }
}

#[test]
pub(super) fn handles_of_another_kind_and_freed_ones_are_refused() {
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
pub(super) fn arrays_that_lie_are_refused() {
    let api = api();
    let positions: [[f32; 3]; 3] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let good = Array::of(&positions, F32, 3);
    let mut mesh = Handle::NULL;
    let mut create = |p: Array, t: &[[i32; 3]]| {
        let t = Array::of(t, I32, 3);
        // SAFETY: wrong in the ways that are checked.
        unsafe { (api.srf_mesh_create)(&p, &t, &mut mesh) }
    };
    api.refused(create(Array { kind: 42, ..good }, &[]), PARAMETER, "type must be a value of srf_type, 1 to 6, got 42");
    api.refused(create(Array { components: 2, ..good }, &[]), PARAMETER, "components must be 3, got 2");
    api.refused(
        create(Array { stride: 11, ..good }, &[]),
        PARAMETER,
        "a stride must be 0 or at least the 12 bytes of an element, got 11",
    );
    api.refused(create(Array { count: usize::MAX, ..good }, &[]), PARAMETER, "more than there can be");
    api.refused(create(Array { data: std::ptr::null(), ..good }, &[]), NULL, "positions.data must not be NULL");
    api.refused(create(good, &[[0, 1, 3]]), INPUT, "triangle 0 names vertex 3");
    api.refused(create(good, &[[0, 1, -1]]), INPUT, "triangle 0 names vertex");
    let bad: [[f32; 3]; 1] = [[0.0, f32::NAN, 0.0]];
    api.refused(create(Array::of(&bad, F32, 3), &[]), INPUT, "vertex 0 has a coordinate that is not finite");
    assert_eq!(mesh, Handle::NULL, "written in spite of the errors");
}

#[test]
pub(super) fn parameters_out_of_range_say_value_range_and_unit() {
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
        api.ok((api.srf_scan_params_init_sized)(&mut scan, size_of_val(&scan)));
        scan.set_f64(0, -1.0);
        let null = std::ptr::null;
        let mut image = Handle::NULL;
        let answer = (api.srf_scan_mesh)(mesh, 8, 8, &DEPTH, null(), &scan, null().cast(), &mut image);
        api.refused(answer, PARAMETER, "noise must be a finite number >= 0, got -1");
        api.refused((api.srf_mesh_write_ply)(mesh, c"x.ply".as_ptr(), 9, null().cast()), PARAMETER, "1 to 3, got 9");
        let glb = (api.srf_mesh_write_glb)(mesh, c"x.glb".as_ptr(), null().cast(), 1.0, 5, null().cast());
        api.refused(glb, PARAMETER, "z_up must be 0 or 1, got 5");
        for metres in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let glb = (api.srf_mesh_write_glb)(mesh, c"x.glb".as_ptr(), null().cast(), metres, 0, null().cast());
            api.refused(glb, PARAMETER, "metres_per_unit must be a finite number > 0");
            let size = (api.srf_true_size)([0.0; 3].as_ptr(), [1.0; 3].as_ptr(), metres, &mut [0.0; 16]);
            api.refused(size, PARAMETER, "distance must be a finite number > 0");
            let mut camera = GridCamera::ZERO;
            api.ok((api.srf_grid_camera_init_sized)(&mut camera, size_of_val(&camera)));
            let status = (api.srf_grid_camera_scale)(&mut camera, metres);
            assert_eq!(status, PARAMETER, "{}", api.message());
            let seen = Projection { numbers: [metres.max(0.0), 60.0, 31.5, 31.5], ..DEPTH };
            let samples = Array::of(&[1.0_f64], F64, 1);
            let made = (api.srf_image_create)(1, 1, &seen, &samples, null().cast(), null().cast(), &mut image);
            assert_eq!(made, PARAMETER, "{}", api.message());
        }
        let levels = (api.srf_meshes_write_glb_levels)(
            null().cast(),
            0,
            c"x.glb".as_ptr(),
            null().cast(),
            1.0,
            0,
            null().cast(),
        );
        api.refused(levels, PARAMETER, "count is 0");
        api.ok((api.srf_merger_free)(merger));
        api.ok((api.srf_mesh_free)(mesh));
    }
}

#[test]
pub(super) fn what_is_said_of_scans_that_are_not_there_is_refused() {
    let api = api();
    let mesh = octahedron();
    let (mut aligner, mut pick) = (Handle::NULL, Pick::ZERO);
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        api.ok((api.srf_aligner_create)(&mut aligner));
        for name in [c"a", c"b"] {
            api.ok((api.srf_aligner_add_mesh)(aligner, mesh, std::ptr::null(), name.as_ptr()));
        }
        api.refused((api.srf_aligner_fix)(aligner, 2), PARAMETER, "scan must be < 2, the number of scans added, got 2");
        api.refused((api.srf_aligner_trust)(aligner, 0, 7), PARAMETER, "b must be < 2");
        api.refused((api.srf_aligner_reject)(aligner, 1, 1), PARAMETER, "a and b must be two scans, got 1 twice");
        api.refused((api.srf_aligner_pick)(aligner, &pick), STRUCT_SIZE, "_init function first");
        api.ok((api.srf_pick_init_sized)(&mut pick, size_of_val(&pick)));
        api.refused((api.srf_aligner_pick)(aligner, &pick), PARAMETER, "must be two scans, got 0 twice");
        pick.numbers[0] = 5 << 32;
        api.refused((api.srf_aligner_pick)(aligner, &pick), PARAMETER, "pick.scans[1] must be < 2");
        pick.numbers[0] = 1 << 32;
        api.ok((api.srf_aligner_pick)(aligner, &pick));
        let wrong = |index: usize, number: f64, has_normals: u32, part: &str| {
            let mut wrong = Pick { second: has_normals, ..pick };
            wrong.set_f64(index, number);
            api.refused((api.srf_aligner_pick)(aligner, &wrong), PARAMETER, part);
        };
        wrong(3, f64::NAN, 0, "pick.points must have finite numbers");
        wrong(13, 0.0, 0, "pick.weight must be a finite number > 0, got 0");
        wrong(13, 1.0, 1, "pick.normals must be finite and not 0");
        wrong(13, 1.0, 2, "pick.has_normals must be 0 or 1, got 2");
        let (point, direction, angles) = ([0.0_f64; 3], [0.0, 0.0, 2.0_f64], [0.0, f64::INFINITY, 2.0]);
        let (at, along, none) = (point.as_ptr(), direction.as_ptr(), std::ptr::null());
        let turn = |point, direction, angles, count, status, part: &str| {
            api.refused((api.srf_aligner_turn)(aligner, point, direction, angles, count), status, part);
        };
        turn(at, none, none, 0, NULL, "direction must not be NULL");
        turn(none, along, none, 0, NULL, "point must not be NULL");
        turn(at, at, none, 0, INPUT, "a direction that is not 0");
        turn(angles.as_ptr(), along, none, 0, INPUT, "must have finite numbers");
        turn(at, along, none, 2, NULL, "angles must not be NULL");
        turn(none, none, angles.as_ptr(), 3, INPUT, "3 angles of the turntable are given for 2 scans: give one a scan");
        turn(none, none, angles.as_ptr(), 2, INPUT, "angle of scan 1 must be a number of radians");
        turn(none, none, angles.as_ptr(), usize::MAX, PARAMETER, "more than there can be");
        let mut params = AlignParams::ZERO;
        api.ok((api.srf_align_params_init_sized)(&mut params, size_of_val(&params)));
        params.numbers[0] = 5;
        let mut alignment = Handle::NULL;
        let answer = (api.srf_aligner_run)(aligner, &params, std::ptr::null(), &mut alignment);
        api.refused(answer, PARAMETER, "start must be one of 1 (auto), 2 (unknown), 3 (rough), 4 (sequence), got 5");
        api.ok((api.srf_aligner_trust)(aligner, 0, 1));
        api.ok((api.srf_aligner_reject)(aligner, 1, 0));
        let answer = (api.srf_aligner_run)(aligner, std::ptr::null(), std::ptr::null(), &mut alignment);
        api.refused(answer, INPUT, "both trusted and rejected");
        let scaled = std::array::from_fn(|i| {
            if i == 15 {
                1.0
            } else if i % 5 == 0 {
                2.0
            } else {
                0.0
            }
        });
        let mut other = Handle::NULL;
        api.ok((api.srf_aligner_create)(&mut other));
        for pose in [std::ptr::null(), &raw const scaled] {
            api.ok((api.srf_aligner_add_mesh)(other, mesh, pose, c"twice".as_ptr()));
        }
        let answer = (api.srf_aligner_run)(other, std::ptr::null(), std::ptr::null(), &mut alignment);
        api.refused(answer, INPUT, "\"twice\" is scaled, sheared or mirrored");
        // Angles that were one per scan, and a scan more.
        api.ok((api.srf_aligner_turn)(other, none, none, point.as_ptr(), 2));
        api.ok((api.srf_aligner_add_mesh)(other, mesh, std::ptr::null(), c"c".as_ptr()));
        let answer = (api.srf_aligner_run)(other, std::ptr::null(), std::ptr::null(), &mut alignment);
        api.refused(answer, INPUT, "2 angles of the turntable are given for 3 scans");
        assert!(alignment == Handle::NULL, "written in spite of the error");
        for end in [(api.srf_aligner_free)(aligner), (api.srf_aligner_free)(other), (api.srf_mesh_free)(mesh)] {
            api.ok(end);
        }
    }
}

#[test]
pub(super) fn poses_to_draw_a_scan_from_are_refused_where_they_can_not_be() {
    let api = api();
    let mesh = octahedron();
    let (mut aligner, mut snap, null) = (Handle::NULL, Snap::ZERO, std::ptr::null());
    let placed: [f64; 16] = std::array::from_fn(|i| if i % 5 == 0 { 1.0 } else { 0.0 });
    let with = |index: usize, number: f64| {
        let mut pose = placed;
        pose[index] = number;
        pose
    };
    let mut distances = [9.0];
    let points = [[0.0, 0.0, 3.0_f64]];
    let points = Array::of(&points, F64, 3);
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        api.ok((api.srf_aligner_create)(&mut aligner));
        api.ok((api.srf_aligner_add_mesh)(aligner, mesh, std::ptr::null(), c"a".as_ptr()));
        let draw = |scan: usize, poses: &[[f64; 16]], params: *const AlignParams, snap: &mut Snap| {
            let (poses, count) = if poses.is_empty() { (std::ptr::null(), 0) } else { (poses.as_ptr(), poses.len()) };
            (api.srf_aligner_snap)(aligner, scan, poses, count, params, std::ptr::null(), snap, std::ptr::null_mut())
        };
        api.refused(draw(0, &[], null, &mut snap), STRUCT_SIZE, "out_snap.struct_size is 0");
        api.ok((api.srf_snap_report_init_sized)(&mut snap, size_of_val(&snap)));
        let before = snap;
        api.refused(draw(0, &[], null, &mut snap), INPUT, "aligning takes at least two scans, got 1");
        api.ok((api.srf_aligner_add_mesh)(aligner, mesh, std::ptr::null(), c"b".as_ptr()));
        api.refused(draw(2, &[], null, &mut snap), PARAMETER, "scan must be < 2, the number of scans added, got 2");
        let mut params = AlignParams::ZERO;
        api.ok((api.srf_align_params_init_sized)(&mut params, size_of_val(&params)));
        params.set_f64(1, -2.0);
        api.refused(draw(0, &[], &params, &mut snap), PARAMETER, "reach must be a finite number > 0, got -2");
        let mut refused = |poses: &[[f64; 16]], part: &str| {
            api.refused(draw(0, poses, null, &mut snap), INPUT, part);
            assert!(snap == before, "written in spite of the error");
            let out = distances.as_mut_ptr();
            let (of, count) = (poses.as_ptr(), poses.len());
            let part = part.replace("scan 0 is to be drawn to the others, but has no pose", "scan 0 has no pose");
            let answer = (api.srf_aligner_misfit)(aligner, 0, of, count, &points, std::ptr::null(), out);
            api.refused(answer, INPUT, &part);
            assert_eq!(distances, [9.0], "written in spite of the error");
        };
        refused(
            &[placed],
            "world_from_scan: 1 pose is given for 2 scans: give as many as there are scans, all 0 at a scan that is left out",
        );
        refused(&[placed, with(7, 1.0)], "world_from_scan[1]: the last row must be 0 0 0 1, got 0 1 0 1");
        refused(&[with(12, f64::NAN), placed], "world_from_scan[0] must have finite numbers");
        refused(&[placed, with(0, 2.0)], "world_from_scan[1] must be rigid");
        refused(&[[0.0; 16], placed], "scan 0 is to be drawn to the others, but has no pose");
        let out = distances.as_mut_ptr();
        let misfit = |scan, poses, count, points: *const Array, out| {
            (api.srf_aligner_misfit)(aligner, scan, poses, count, points, std::ptr::null(), out)
        };
        let none = std::ptr::null();
        api.refused(misfit(0, none, 2, &points, out), NULL, "world_from_scan must not be NULL");
        api.refused(misfit(5, none, 0, &points, out), PARAMETER, "scan must be < 2");
        api.refused(misfit(0, none, 0, none.cast(), out), NULL, "points must not be NULL");
        api.refused(misfit(0, none, 0, &points, std::ptr::null_mut()), NULL, "out_distances must not be NULL");
        let whole = Array { kind: I32, ..points };
        api.refused(
            misfit(0, none, 0, &whole, out),
            PARAMETER,
            "points: type must be SRF_TYPE_F64 or SRF_TYPE_F32, got SRF_TYPE_I32",
        );
        for end in [(api.srf_aligner_free)(aligner), (api.srf_mesh_free)(mesh)] {
            api.ok(end);
        }
    }
}

#[test]
pub(super) fn the_limit_on_memory_is_kept_until_it_is_lifted() {
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
