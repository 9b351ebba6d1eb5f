//! Every operation, beside the core's own result where that is quick.

use super::*;

#[test]
pub(super) fn an_image_is_sculpted_to_one_tolerance_after_the_other() {
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
        api.ok((api.srf_sculptor_create)(image, std::ptr::null(), std::ptr::null(), &mut sculptor));
        api.ok((api.srf_image_free)(image));
        api.ok((api.srf_certificate_init_sized)(&mut certificate, size_of_val(&certificate)));
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
pub(super) fn a_surface_through_scattered_points() {
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
        api.ok((api.srf_reconstruct_params_init_sized)(&mut params, size_of_val(&params)));
        api.ok((api.srf_reconstruct_report_init_sized)(&mut report, size_of_val(&report)));
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
        api.refused(answer, PARAMETER, "closure must be one of 1 (auto), 2 (closed), 3 (open), got 7");
        params.numbers[3] = 1;
        params.set_f64(0, 0.5);
        let answer =
            (api.srf_reconstructor_surface)(reconstructor, &params, watch, &mut mesh, std::ptr::null_mut(), out);
        api.refused(answer, PARAMETER, "factor must be >= 1 and <= 2, got 0.5");
        api.ok((api.srf_reconstructor_free)(reconstructor));
    }
}

#[test]
pub(super) fn an_image_becomes_a_quad_grid_and_a_surface() {
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
        api.ok((api.srf_quads_params_init_sized)(&mut params, size_of_val(&params)));
        api.ok((api.srf_quads_report_init_sized)(&mut report, size_of_val(&report)));
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
        let mut asked = SplineParams::ZERO;
        api.ok((api.srf_spline_params_init_sized)(&mut asked, size_of_val(&asked)));
        let none = std::ptr::null_mut;
        asked.numbers[0] = 5;
        let answer = (api.srf_spline_create)(quads, &asked, std::ptr::null(), &mut spline, none(), none());
        api.refused(answer, PARAMETER, "order must be >= 2 and <= 4, got 5");
        (asked.numbers[0], asked.numbers[1]) = (4, 3);
        let answer = (api.srf_spline_create)(quads, &asked, std::ptr::null(), &mut spline, none(), none());
        api.refused(answer, INPUT, "3 rows of control points: order 4 over 9 rows of vertices needs 4 to 9");
        (asked.numbers[1], asked.numbers[2]) = (0, 6);
        api.ok((api.srf_spline_create)(quads, &asked, std::ptr::null(), &mut spline, &mut max, &mut rms));
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
pub(super) fn a_mesh_is_clustered_and_so_is_a_chain() {
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
        api.ok((api.srf_cluster_params_init_sized)(&mut params, size_of_val(&params)));
        api.ok((api.srf_cluster_report_init_sized)(&mut report, size_of_val(&report)));
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
        // How fine levels are is not asked of the struct.
        let mut passed_over = params;
        (passed_over.numbers[0], passed_over.numbers[1]) = (7, 7);
        passed_over.set_f64(2, f64::NAN);
        let (watch, out) = (std::ptr::null(), chain.as_mut_ptr());
        api.ok((api.srf_mesh_cluster_levels)(sheet, wanted.as_ptr(), 2, &passed_over, watch, out));
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
        refused(&|p| p.numbers[0] = 1 << 40, PARAMETER, "vertices must be >= 1 and <= 4000000000, got 1099511627776");
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
        let few = Array::of(&positions[..2], F64, 3);
        api.ok((api.srf_cloud_create)(&few, none, none, none, std::ptr::null(), &mut cloud));
        let answer =
            (api.srf_cloud_cluster)(cloud, std::ptr::null(), std::ptr::null(), &mut mesh, std::ptr::null_mut());
        api.refused(answer, INPUT, "at least 3 different points");
        api.ok((api.srf_cloud_free)(cloud));
        api.ok((api.srf_mesh_free)(sheet));
    }
}

#[test]
pub(super) fn a_merge_is_that_of_the_core_for_any_number_of_threads() {
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
        let lines = (report.numbers[1] >> 32) as usize;
        (report, (0..lines).map(line).collect(), (0..report.second as usize).map(scan).collect())
    }
}

/// Whether a struct has these ways to move: their count in the upper half of one number, and from another on each.
fn ways(numbers: &[u64], count: usize, first: usize, expected: &[surfrecon::align::Freedom]) -> bool {
    let mut all = [0; 42];
    for (way, freedom) in all.chunks_mut(7).zip(expected) {
        way[0] = freedom.turns.into();
        for axis in 0..3 {
            (way[1 + axis], way[4 + axis]) = (freedom.direction[axis].to_bits(), freedom.point[axis].to_bits());
        }
    }
    numbers[count] >> 32 == expected.len() as u64 && numbers[first..first + 42] == all
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
        assert_eq!([report.second as u64, report.numbers[0]], [4, 4 | 1 << 32], "all four in one group: {lines:?}");
        assert_eq!(report.f64(4), expected.report.residual.unwrap());
        for ((scan, found), view) in scans.iter().zip(&expected.report.scans).zip(crate::views::views()) {
            let pose = found.world_from_scan.unwrap().to_cols_array_2d();
            for (column, numbers) in pose.iter().enumerate() {
                let got: Vec<f64> = (0..3).map(|row| scan.f64(1 + 4 * column + row)).collect();
                assert_eq!(got, numbers);
            }
            assert_eq!((scan.second as usize, scan.numbers[0]), (found.state as usize, 0));
            assert_eq!([scan.f64(18), scan.f64(101)], [found.covariance[0][1], found.misfit]);
            assert_eq!(scan.f64(102), found.spacing);
            assert!(found.misfit > 0.0 && ways(&scan.numbers, 0, 57, &found.free));
            let first = crate::views::views()[0].world_from_sensor;
            let off = found.world_from_scan.unwrap().inverse() * first.inverse() * view.world_from_sensor;
            assert!(off.translation.length() < found.spacing, "{} is {off} off", found.name);
        }
        let mut pair = AlignedPair::ZERO;
        api.ok((api.srf_aligned_pair_init_sized)(&mut pair, size_of_val(&pair)));
        api.ok((api.srf_alignment_pair)(alignment, 0, &mut pair));
        let first = &expected.report.pairs[0];
        assert_eq!((first.state, pair.second), (PairState::Fits, 1));
        assert_eq!((pair.numbers[0], pair.f64(46)), (1 << 32, first.residual));
        assert!(ways(&pair.numbers, 1, 2, &first.free));
        let mut found = 7;
        let (point, angles) = (std::ptr::null_mut(), std::ptr::null_mut());
        api.ok((api.srf_alignment_turntable)(alignment, &mut found, point, point, angles));
        assert_eq!((found, &expected.report.turntable), (0, &None));
        let mut reason = std::ptr::null();
        api.ok((api.srf_alignment_reason)(alignment, 3, &mut reason));
        assert_eq!(text(reason), "");
        let answer = (api.srf_alignment_scan)(alignment, 4, &mut AlignedScan { size: 832, ..AlignedScan::ZERO });
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
    let watch = Watch { report: Some(cancel), user: (&raw mut asked).cast() };
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
        let place = scans.iter().position(|scan| scan.second == 0).expect("one that is not placed");
        assert_eq!((report.numbers[0] & 0xffff_ffff, report.f64(4)), (0, -1.0), "{lines:?}");
        assert_eq!(scans[place].numbers[..17], [&[0xffff_ffff][..], &[0; 16]].concat(), "no group and no pose");
        api.ok((api.srf_alignment_reason)(alignment, place, &mut reason));
        assert!(!text(reason).is_empty() && lines[1 + place].ends_with(&text(reason)), "{lines:?}");
        let messages = report.numbers[1] & 0xffff_ffff;
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
            assert_eq!(scan.numbers[1..17], pose.map(f64::to_bits));
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
        // What is known of it says that there was one.
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
    let watch = Watch { report: Some(cancel), user: (&raw mut asked).cast() };
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        api.ok((api.srf_align_params_init_sized)(&mut params, size_of_val(&params)));
        api.ok((api.srf_snap_init_sized)(&mut snap, size_of_val(&snap)));
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
        assert_eq!((expected.state, first.second), (PairState::Fits, 1));
        let back = expected.world_from_scan.inverse() * views[2].world_from_sensor;
        let before = poses[2].unwrap().inverse() * views[2].world_from_sensor;
        assert!(5.0 * back.translation.length() < before.translation.length(), "{before} {back}");
        assert_eq!(first.numbers[1..17], columns(expected.world_from_scan).map(f64::to_bits));
        assert!(ways(&first.numbers, 0, 17, &expected.free));
        let surfrecon::align::Snap { overlap, residual, balance, seen_through, moved, .. } = &expected;
        let figures: [f64; 5] = std::array::from_fn(|i| first.f64(59 + i));
        assert_eq!(figures, [*overlap, *residual, *balance, *seen_through, *moved]);
        assert!(*moved > 0.01);

        // Where they were added, which is on each other: told of by the core alike.
        let (status, there, _) = draw(&[], std::ptr::null(), std::ptr::null());
        api.ok(status);
        let identity = vec![Some(DAffine3::IDENTITY); 4];
        let alike = prepared.snap(2, &identity, &Params::default(), &none).unwrap();
        assert_eq!(there.numbers[1..17], columns(alike.world_from_scan).map(f64::to_bits));
        assert_eq!((there.second as usize, there.f64(63)), (alike.state as usize, alike.moved));
        assert!(draw(&given, std::ptr::null(), std::ptr::null()).1 == first, "depends on the snap before");
        assert_eq!(first.numbers[0] as u32 as usize, expected.touches.len());
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

        // What was read goes as soon as scans are added, and the files are gone.
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
