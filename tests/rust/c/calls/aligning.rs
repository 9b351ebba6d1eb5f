//! Scans without poses, beside the core's own result.

use super::*;

/// An aligner of the views of the statue, whose first stays, and its folder.
fn aligner_of_views() -> (tempfile::TempDir, Handle) {
    let api = api();
    let folder = tempfile::tempdir().unwrap();
    let list = CString::new(crate::views::without_poses(folder.path()).to_str().unwrap()).unwrap();
    let (mut scans, mut aligner, null) = (Handle::NULL, Handle::NULL, std::ptr::null());
    // SAFETY: as the header wants it.
    unsafe {
        api.ok((api.srf_scans_open)(&list.as_ptr(), 1, null, std::ptr::null(), &mut scans));
        api.ok((api.srf_aligner_create)(&mut aligner));
        api.ok((api.srf_aligner_add_scans)(aligner, scans));
        api.ok((api.srf_scans_free)(scans));
        api.ok((api.srf_aligner_fix)(aligner, 0));
    }
    (folder, aligner)
}

/// Figures, lines, and each scan of an alignment.
fn told(alignment: Handle) -> (AlignReport, Vec<String>, Vec<AlignedScan>) {
    let api = api();
    let mut report = AlignReport::ZERO;
    // SAFETY: as the header wants it.
    unsafe {
        api.ok((api.srf_align_report_init_sized)(&mut report, size_of_val(&report)));
        api.ok((api.srf_alignment_report)(alignment, &mut report));
        let line = |index| {
            let mut line = std::ptr::null();
            api.ok((api.srf_alignment_line)(alignment, index, &mut line));
            text(line)
        };
        let scan = |index| {
            let mut scan = AlignedScan::ZERO;
            api.ok((api.srf_aligned_scan_init_sized)(&mut scan, size_of_val(&scan)));
            api.ok((api.srf_alignment_scan)(alignment, index, &mut scan));
            scan
        };
        let [scans, messages] =
            [align_report::SCANS_COUNT, align_report::MESSAGES_COUNT].map(|place| report.numbers[place] as usize);
        (report, (0..1 + scans + messages).map(line).collect(), (0..scans).map(scan).collect())
    }
}

/// Whether a struct has these ways to move: their number in one place, and from another on each.
fn ways(numbers: &[u64], count: usize, first: usize, expected: &[surfrecon::align::Freedom]) -> bool {
    let mut all = [0; 42];
    for (way, freedom) in all.chunks_mut(7).zip(expected) {
        way[0] = freedom.turns.into();
        for axis in 0..3 {
            (way[1 + axis], way[4 + axis]) = (freedom.direction[axis].to_bits(), freedom.point[axis].to_bits());
        }
    }
    numbers[count] == expected.len() as u64 && numbers[first..first + 42] == all
}

/// A pose as the header has it.
fn columns(pose: glam::DAffine3) -> [f64; 16] {
    glam::DMat4::from(pose).to_cols_array()
}

#[test]
fn scans_are_aligned_as_by_the_core() {
    use surfrecon::align::{self, AlignParams, Constraints, PairState, ScanSource};
    let api = api();
    let (folder, aligner) = aligner_of_views();
    let expected = {
        let set = surfrecon::import::open(&folder.path().join("views.conf")).unwrap();
        let sources: Vec<_> = set.scans.iter().map(|scan| scan as &dyn ScanSource).collect();
        let constraints = Constraints { fixed: vec![0], ..Constraints::default() };
        align::run(&sources, &AlignParams::default(), &constraints, &surfrecon::Progress::none()).unwrap()
    };
    let (mut alignment, null) = (Handle::NULL, std::ptr::null());
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        api.ok((api.srf_aligner_run)(aligner, null, std::ptr::null(), &mut alignment));
        api.ok((api.srf_aligner_free)(aligner));
        let (report, lines, scans) = told(alignment);
        assert_eq!(lines, expected.report.lines());
        let counts = [align_report::SCANS_COUNT, align_report::PLACED, align_report::GROUPS_COUNT];
        assert_eq!(counts.map(|place| report.numbers[place]), [4, 4, 1], "all four in one group: {lines:?}");
        assert_eq!(report.f64(align_report::RESIDUAL), expected.report.residual.unwrap());
        for ((scan, found), view) in scans.iter().zip(&expected.report.scans).zip(crate::views::views()) {
            let pose = found.world_from_scan.unwrap().to_cols_array_2d();
            for (column, numbers) in pose.iter().enumerate() {
                let got: Vec<f64> =
                    (0..3).map(|row| scan.f64(aligned_scan::WORLD_FROM_SCAN + 4 * column + row)).collect();
                assert_eq!(got, numbers);
            }
            let whole = [aligned_scan::STATE, aligned_scan::GROUP].map(|place| scan.numbers[place]);
            assert_eq!(whole, [1 + found.state as u64, 0]);
            let places = [aligned_scan::COVARIANCE + 1, aligned_scan::MISFIT, aligned_scan::SPACING];
            assert_eq!(places.map(|place| scan.f64(place)), [found.covariance[0][1], found.misfit, found.spacing]);
            let (count, first) = (aligned_scan::FREEDOMS_COUNT, aligned_scan::FREEDOMS);
            assert!(found.misfit > 0.0 && ways(&scan.numbers, count, first, &found.freedoms));
            let first = crate::views::views()[0].world_from_sensor;
            let off = found.world_from_scan.unwrap().inverse() * first.inverse() * view.world_from_sensor;
            assert!(off.translation.length() < found.spacing, "{} is {off} off", found.name);
        }
        let mut pair = AlignedPair::ZERO;
        api.ok((api.srf_aligned_pair_init_sized)(&mut pair, size_of_val(&pair)));
        api.ok((api.srf_alignment_pair)(alignment, 0, &mut pair));
        let first = &expected.report.pairs[0];
        assert_eq!((first.state, pair.numbers[aligned_pair::STATE]), (PairState::Fits, 2));
        assert_eq!(pair.numbers[aligned_pair::SCANS..aligned_pair::SCANS + 2], [0, 1]);
        assert_eq!(pair.f64(aligned_pair::RESIDUAL), first.residual);
        assert!(ways(&pair.numbers, aligned_pair::FREEDOMS_COUNT, aligned_pair::FREEDOMS, &first.freedoms));
        let mut found = 7;
        let (point, angles) = (std::ptr::null_mut(), std::ptr::null_mut());
        api.ok((api.srf_alignment_turntable)(alignment, &mut found, point, point, angles));
        assert_eq!((found, &expected.report.turntable), (0, &None));
        let mut reason = std::ptr::null();
        api.ok((api.srf_alignment_reason)(alignment, 3, &mut reason));
        assert_eq!(text(reason), "");
        let answer = (api.srf_alignment_scan)(
            alignment,
            4,
            &mut AlignedScan { size: size_of::<AlignedScan>() as u32, ..AlignedScan::ZERO },
        );
        api.refused(answer, PARAMETER, "index must be < 4, got 4");
        api.refused((api.srf_alignment_reason)(alignment, 9, &mut reason), PARAMETER, "index must be < 4, got 9");
        api.refused((api.srf_alignment_message)(alignment, 7, &mut reason), PARAMETER, "got 7");
        api.refused((api.srf_aligner_free)(alignment), HANDLE, "aligner must be a srf_aligner, got a srf_alignment");
        api.ok((api.srf_alignment_free)(alignment));
    }
}

#[test]
pub(super) fn what_is_not_placed_has_a_reason_and_a_cancelled_alignment_leaves_nothing() {
    let api = api();
    let mesh = octahedron();
    let image = scan(mesh);
    let (mut aligner, mut alignment, mut reason) = (Handle::NULL, Handle::NULL, std::ptr::null());
    let mut asked = 0_u32;
    let watch = Watch { report: Some(cancel), user: (&raw mut asked).cast(), cancel: Handle::NULL };
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        api.ok((api.srf_aligner_create)(&mut aligner));
        let null = std::ptr::null();
        api.ok((api.srf_aligner_add_image)(aligner, image));
        let answer = (api.srf_aligner_run)(aligner, null, std::ptr::null(), &mut alignment);
        api.refused(answer, INPUT, "aligning takes at least two scans, got 1");
        api.ok((api.srf_aligner_add_image)(aligner, image));
        api.ok((api.srf_aligner_reject)(aligner, 0, 1));
        api.refused((api.srf_aligner_run)(aligner, null, &watch, &mut alignment), CANCELLED, "cancelled");
        assert!(asked >= 1 && alignment == Handle::NULL);
        api.ok((api.srf_aligner_run)(aligner, null, std::ptr::null(), &mut alignment));
        let (report, lines, scans) = told(alignment);
        let place =
            scans.iter().position(|scan| scan.numbers[aligned_scan::STATE] == 1).expect("one that is not placed");
        let figures = (report.numbers[align_report::PLACED], report.f64(align_report::RESIDUAL));
        assert_eq!(figures, (0, -1.0), "{lines:?}");
        let group_and_pose = aligned_scan::GROUP..aligned_scan::WORLD_FROM_SCAN + 16;
        assert_eq!(scans[place].numbers[group_and_pose], [&[u64::MAX][..], &[0; 16]].concat(), "no group and no pose");
        api.ok((api.srf_alignment_reason)(alignment, place, &mut reason));
        let messages = report.numbers[align_report::MESSAGES_COUNT];
        assert!(!text(reason).is_empty() && lines[1 + messages as usize + place].ends_with(&text(reason)), "{lines:?}");
        api.ok((api.srf_alignment_message)(alignment, messages as usize - 1, &mut reason));
        assert!(text(reason).contains("hold the same samples"), "{lines:?}");
        for end in [(api.srf_alignment_free)(alignment), (api.srf_aligner_free)(aligner)] {
            api.ok(end);
        }
        api.ok((api.srf_image_free)(image));
        api.ok((api.srf_mesh_free)(mesh));
    }
}

#[test]
fn a_turntable_is_found_as_by_the_core_and_told_as_to_it() {
    use surfrecon::align::{AlignParams as Params, Axis, Constraints, Prepared, ScanSource, Turntable};
    let api = api();
    let (folder, aligner) = aligner_of_views();
    let none = surfrecon::Progress::none();
    let set = surfrecon::import::open(&folder.path().join("views.conf")).unwrap();
    let sources: Vec<_> = set.scans.iter().map(|scan| scan as &dyn ScanSource).collect();
    let prepared = Prepared::read(&sources, 0, &none).unwrap();
    let run = |params: &AlignParams| {
        let (mut alignment, mut found, mut angles) = (Handle::NULL, 0, Array::EMPTY);
        let (mut point, mut direction) = ([0.0; 3], [0.0; 3]);
        // SAFETY: as the header wants it.
        unsafe {
            api.ok((api.srf_aligner_run)(aligner, params, std::ptr::null(), &mut alignment));
            let axis = (point.as_mut_ptr(), direction.as_mut_ptr());
            api.ok((api.srf_alignment_turntable)(alignment, &mut found, axis.0, axis.1, &mut angles));
            let scans = told(alignment).2;
            assert_eq!((found, angles.kind, angles.components, angles.count), (1, F64, 1, 4));
            let turned = angles.bytes();
            api.ok((api.srf_alignment_free)(alignment));
            (point, direction, turned, scans)
        }
    };
    let same = |params: &AlignParams, expected: &Params, constraints: &Constraints| {
        let (point, direction, angles, scans) = run(params);
        let found = prepared.align(expected, constraints, &none).unwrap();
        let table = found.report.turntable.expect("a turntable");
        assert_eq!((point, direction), (table.axis.point.to_array(), table.axis.direction.to_array()));
        let turned: Vec<u8> = table.angles.iter().flat_map(|a| a.unwrap_or(f64::NAN).to_ne_bytes()).collect();
        assert!(angles == turned, "{:?}", table.angles);
        for (scan, pose) in scans.iter().zip(&found.world_from_scan) {
            let pose = pose.map_or([0.0; 16], columns);
            let place = aligned_scan::WORLD_FROM_SCAN;
            assert_eq!(scan.numbers[place..place + 16], pose.map(f64::to_bits));
        }
        (table.axis, table.angles)
    };
    let mut params = AlignParams::ZERO;
    // SAFETY: as the header wants it.
    unsafe {
        api.ok((api.srf_align_params_init_sized)(&mut params, size_of_val(&params)));
        params.numbers[2] = 2;
        let fixed = Constraints { fixed: vec![0], ..Constraints::default() };
        let turned = Params { turntable: Turntable::Turned, ..Params::default() };
        let (axis, angles) = same(&params, &turned, &fixed);
        assert!(angles.iter().all(Option::is_some), "{angles:?}");
        // Its state says that there was one.
        params.numbers[2] = 1;
        let turns: Vec<f64> = angles.into_iter().flatten().collect();
        let (point, direction) = (axis.point.to_array(), (2.0 * axis.direction).to_array());
        let of = (point.as_ptr(), direction.as_ptr());
        api.ok((api.srf_aligner_turn)(aligner, of.0, of.1, turns.as_ptr(), 4));
        let known = Axis { direction: 2.0 * axis.direction, ..axis };
        let given = Constraints { axis: Some(known), angles: turns.clone(), ..fixed.clone() };
        same(&params, &Params::default(), &given);
        let null = std::ptr::null();
        api.ok((api.srf_aligner_turn)(aligner, null, null, turns.as_ptr(), 4));
        same(&params, &Params::default(), &Constraints { axis: None, ..given });
        // Nothing is known any more.
        api.ok((api.srf_aligner_turn)(aligner, null, null, null, 0));
        let (mut alignment, mut found, out) = (Handle::NULL, 7, std::ptr::null_mut());
        api.ok((api.srf_aligner_run)(aligner, &params, std::ptr::null(), &mut alignment));
        api.ok((api.srf_alignment_turntable)(alignment, &mut found, out, out, std::ptr::null_mut()));
        assert_eq!(found, 0);
        api.ok((api.srf_alignment_free)(alignment));
        api.ok((api.srf_aligner_free)(aligner));
    }
}

#[test]
fn one_scan_is_drawn_to_others_as_by_the_core_and_files_are_read_once() {
    use glam::{DAffine3, DVec3};
    use surfrecon::align::{AlignParams as Params, PairState, Prepared, ScanSource};
    let api = api();
    let (folder, aligner) = aligner_of_views();
    let none = surfrecon::Progress::none();
    let set = surfrecon::import::open(&folder.path().join("views.conf")).unwrap();
    let sources: Vec<_> = set.scans.iter().map(|scan| scan as &dyn ScanSource).collect();
    let prepared = Prepared::read(&sources, 0, &none).unwrap();
    let views = crate::views::views();
    let mut poses: Vec<Option<DAffine3>> = views.iter().map(|view| Some(view.world_from_sensor)).collect();
    poses[3] = None;
    let off = DAffine3::from_axis_angle(DVec3::Y, 0.03) * DAffine3::from_translation(DVec3::new(0.01, -0.02, 0.02));
    poses[2] = poses[2].map(|pose| off * pose);
    let given: Vec<[f64; 16]> = poses.iter().map(|pose| pose.map_or([0.0; 16], columns)).collect();
    let (mut params, mut snap, mut touches) = (AlignParams::ZERO, Snap::ZERO, [9_u8; 4]);
    let mut asked = 0_u32;
    let watch = Watch { report: Some(cancel), user: (&raw mut asked).cast(), cancel: Handle::NULL };
    const POSE: usize = snap_report::WORLD_FROM_SCAN;
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        api.ok((api.srf_align_params_init_sized)(&mut params, size_of_val(&params)));
        api.ok((api.srf_snap_report_init_sized)(&mut snap, size_of_val(&snap)));
        let mut draw = |poses: &[[f64; 16]], params: *const AlignParams, watch: *const Watch| {
            let (poses, count) = if poses.is_empty() { (std::ptr::null(), 0) } else { (poses.as_ptr(), poses.len()) };
            let room = touches.as_mut_ptr();
            let status = (api.srf_aligner_snap)(aligner, 2, poses, count, params, watch, &mut snap, room);
            (status, snap, touches)
        };
        api.refused(draw(&given, std::ptr::null(), &watch).0, CANCELLED, "cancelled");
        assert!(asked >= 1);
        let (status, first, touched) = draw(&given, std::ptr::null(), std::ptr::null());
        api.ok(status);
        folder.close().unwrap();
        for threads in [1, 2] {
            params.second = threads;
            let (status, again, _) = draw(&given, &params, std::ptr::null());
            api.ok(status);
            assert_eq!(again, first, "{threads} threads");
        }
        let expected = prepared.snap(2, &poses, &Params::default(), &none).unwrap();
        assert_eq!((expected.state, first.numbers[snap_report::STATE]), (PairState::Fits, 2));
        let back = expected.world_from_scan.inverse() * views[2].world_from_sensor;
        let before = poses[2].unwrap().inverse() * views[2].world_from_sensor;
        assert!(5.0 * back.translation.length() < before.translation.length(), "{before} {back}");
        assert_eq!(first.numbers[POSE..POSE + 16], columns(expected.world_from_scan).map(f64::to_bits));
        assert!(ways(&first.numbers, snap_report::FREEDOMS_COUNT, snap_report::FREEDOMS, &expected.freedoms));
        let surfrecon::align::Snap { overlap, residual, balance, seen_through, moved, .. } = &expected;
        let figures: [f64; 5] = std::array::from_fn(|i| first.f64(snap_report::OVERLAP + i));
        assert_eq!(figures, [*overlap, *residual, *balance, *seen_through, *moved]);
        assert!(*moved > 0.01);

        // Told by the core alike of scans where they were added, which is on each other.
        let (status, there, _) = draw(&[], std::ptr::null(), std::ptr::null());
        api.ok(status);
        let identity = vec![Some(DAffine3::IDENTITY); 4];
        let alike = prepared.snap(2, &identity, &Params::default(), &none).unwrap();
        assert_eq!(there.numbers[POSE..POSE + 16], columns(alike.world_from_scan).map(f64::to_bits));
        assert_eq!(
            (there.numbers[snap_report::STATE], there.f64(snap_report::MOVED)),
            (1 + alike.state as u64, alike.moved)
        );
        assert!(draw(&given, std::ptr::null(), std::ptr::null()).1 == first, "depends on the snap before");
        assert_eq!(first.numbers[snap_report::TOUCHES_COUNT] as usize, expected.touches.len());
        assert_eq!(touched, std::array::from_fn(|scan| u8::from(expected.touches.contains(&scan))));

        let pixels = views[2].rows() * views[2].cols();
        let mut points: Vec<[f64; 3]> = (0..pixels).map(|pixel| views[2].point_in_sensor(pixel).to_array()).collect();
        points.push([f64::INFINITY, 0.0, 0.0]);
        let expected: Vec<DVec3> = points.iter().copied().map(DVec3::from).collect();
        let expected = prepared.misfit(2, &poses, &expected, &none).unwrap();
        let (mut distances, array) = (vec![9.0; points.len()], Array::of(&points, F64, 3));
        let (of, out) = (given.as_ptr(), distances.as_mut_ptr());
        asked = 0;
        let answer = (api.srf_aligner_misfit)(aligner, 2, of, 4, &array, &watch, out);
        api.refused(answer, CANCELLED, "cancelled");
        assert!(asked >= 1 && distances.iter().all(|distance| *distance == 9.0), "written in spite of the error");
        api.ok((api.srf_aligner_misfit)(aligner, 2, of, 4, &array, std::ptr::null(), out));
        let bits = |all: &[f64]| all.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert!(bits(&distances) == bits(&expected));
        let known = distances.iter().filter(|distance| !distance.is_nan()).count();
        assert!(known > 1000 && known < distances.len() && distances.last().unwrap().is_nan(), "{known}");
        let nothing = Array { count: 0, data: std::ptr::null(), ..array };
        let (out, watch) = (std::ptr::null_mut(), std::ptr::null());
        api.ok((api.srf_aligner_misfit)(aligner, 2, of, 4, &nothing, watch, out));

        // Samples that were read go as soon as scans are added, and the files are gone.
        let mesh = octahedron();
        let mut count = 0;
        api.ok((api.srf_aligner_add_mesh)(aligner, mesh, std::ptr::null(), c"one more".as_ptr()));
        api.ok((api.srf_aligner_count)(aligner, &mut count));
        assert_eq!(count, 5);
        let (status, ..) = draw(&[], std::ptr::null(), std::ptr::null());
        api.refused(status, IO, "view");
        api.ok((api.srf_mesh_free)(mesh));
        api.ok((api.srf_aligner_free)(aligner));
    }
}
