//! Every operation, beside the core's own result where that is quick.

use super::*;

#[test]
pub(super) fn an_image_is_sculpted_to_one_tolerance_after_the_other() {
    use sculpt_report::*;
    let api = api();
    let values: Vec<f64> =
        (0..4096).map(|i| (f64::from(i % 64) * 0.1).sin() * (f64::from(i / 64) * 0.07).cos()).collect();
    let plane = Projection { kind: 1, reserved: 0, numbers: [0.0, 0.0, 0.1, -0.1] };
    let (mut image, mut sculptor, mut certificate) = (Handle::NULL, Handle::NULL, SculptReport::ZERO);
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        let null = std::ptr::null();
        let samples = Array::of(&values, F64, 1);
        api.ok((api.srf_image_create)(64, 64, &plane, &samples, null, std::ptr::null(), &mut image));
        api.ok((api.srf_sculptor_create)(image, std::ptr::null(), std::ptr::null(), &mut sculptor));
        api.ok((api.srf_image_free)(image));
        api.ok((api.srf_sculpt_report_init_sized)(&mut certificate, size_of_val(&certificate)));
        let mut sculpt = |tolerance: f64| {
            let mut mesh = Handle::NULL;
            let progress = std::ptr::null();
            api.ok((api.srf_sculptor_refine)(sculptor, tolerance, progress, &mut mesh, &mut certificate));
            let bytes = bytes(mesh);
            api.ok((api.srf_mesh_free)(mesh));
            assert!(
                certificate.f64(MAX_ERROR) <= certificate.f64(TOLERANCE) + 1e-12
                    && certificate.numbers[COVERED_PIXELS] == 4096,
                "{certificate:?}"
            );
            (bytes, certificate.numbers[TRIANGLES])
        };
        let (fine, coarse, again) = (sculpt(0.001), sculpt(0.05), sculpt(0.001));
        assert!(fine == again && coarse.1 * 4 < fine.1, "{} {}", coarse.1, fine.1);
        let projection = surfrecon::range_image::Projection::Orthographic { first: [0.0; 2], step: [0.1, -0.1] };
        let core = surfrecon::RangeImage::from_values(64, 64, values.clone(), projection).unwrap();
        let none = surfrecon::Progress::none();
        let core = surfrecon::sculpt::Sculptor::prepare(&core, &Default::default(), &none).unwrap();
        let core = core.refine(surfrecon::sculpt::Tolerance::Absolute(0.05), &none).unwrap().certificate;
        sculpt(0.05);
        assert_eq!(
            [MAX_ERROR, MAX_ERROR_SINGLE].map(|place| certificate.f64(place)),
            [core.max_error, core.max_error_single]
        );
        let mut sculpt = |tolerance: f64| {
            let mut mesh = Handle::NULL;
            api.ok((api.srf_sculptor_refine)(sculptor, tolerance, std::ptr::null(), &mut mesh, &mut certificate));
            api.ok((api.srf_mesh_free)(mesh));
            certificate.numbers[TRIANGLES]
        };
        let (exact, by_default) = (sculpt(0.0), sculpt(-1.0));
        assert!(exact <= 2 * 63 * 63 && by_default < exact, "{exact} {by_default}");
        let mut mesh = Handle::NULL;
        let answer = (api.srf_sculptor_refine)(sculptor, -0.5, std::ptr::null(), &mut mesh, &mut certificate);
        api.refused(answer, PARAMETER, "tolerance must be a finite number >= 0, got -0.5");
        api.ok((api.srf_sculptor_at_most)(sculptor, 300, std::ptr::null(), &mut mesh, &mut certificate));
        assert!((200..=300).contains(&certificate.numbers[TRIANGLES]), "{certificate:?}");
        api.ok((api.srf_mesh_free)(mesh));
        let answer = (api.srf_sculptor_at_most)(sculptor, 1, std::ptr::null(), &mut mesh, &mut certificate);
        api.refused(answer, INPUT, "at most 1 triangles are asked for");
        api.ok((api.srf_sculptor_free)(sculptor));
    }
}

#[test]
pub(super) fn a_surface_through_scattered_points() {
    use reconstruct_report::*;
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
        let counts = [CLOSED, POINTS, USED, NOT_FINITE, DUPLICATES, INSIDE, OUTSIDE].map(|place| report.numbers[place]);
        assert_eq!(counts, [1, 403, 400, 1, 1, 0, 1], "{report:?}");
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
    use quads_report::*;
    let api = api();
    let values: Vec<f64> = (0..4096)
        .map(|i| if i < 8 { f64::NAN } else { (f64::from(i % 64) * 0.1).sin() * (f64::from(i / 64) * 0.2).cos() })
        .collect();
    let plane = Projection { kind: 1, reserved: 0, numbers: [0.0, 0.0, 0.1, -0.1] };
    let (mut image, mut quads, mut spline, mut mesh) = (Handle::NULL, Handle::NULL, Handle::NULL, Handle::NULL);
    let (mut params, mut report) = (QuadsParams::ZERO, QuadReport::ZERO);
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
        assert_eq!([TILES_DOWN, TILES_ACROSS, VALID_PIXELS].map(|place| report.numbers[place]), [1, 1, 4088]);
        let [error, uniform] = [RELATIVE_ERROR, UNIFORM_RELATIVE_ERROR].map(|place| report.f64(place));
        assert!(error > 0.0 && error < uniform, "{report:?}");

        let (mut vertices, mut uvs, mut corners, mut errors) = (Array::EMPTY, Array::EMPTY, Array::EMPTY, Array::EMPTY);
        api.ok((api.srf_quads_faces)(quads, &mut vertices, &mut uvs, &mut corners, &mut errors));
        assert_eq!((corners.count as u64, corners.components, uvs.components), (report.numbers[QUADS], 4, 2));
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

/// The core's own mesh of the same vertices and triangles.
fn of_core(mesh: Handle) -> surfrecon::TriMesh {
    let (mut positions, mut triangles) = (Array::EMPTY, Array::EMPTY);
    // SAFETY: as the header wants it.
    unsafe {
        api().ok((api().srf_mesh_positions)(mesh, &mut positions));
        api().ok((api().srf_mesh_triangles)(mesh, &mut triangles));
    }
    let numbers: Vec<f64> = positions.bytes().chunks(8).map(|b| f64::from_ne_bytes(b.try_into().unwrap())).collect();
    let corners = whole_numbers(&triangles.bytes()).as_chunks::<3>().0.to_vec();
    surfrecon::TriMesh::new(numbers.chunks(3).map(glam::DVec3::from_slice).collect(), corners)
}

#[test]
pub(super) fn a_mesh_is_clustered_and_so_is_a_chain() {
    use cluster_report::*;
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
        assert_eq!((report.numbers[VERTICES], report.numbers[KEPT_INPUT]), (100, 0), "{report:?}");
        assert!(report.f64(MAX_ERROR) > report.f64(RMS_ERROR) && report.f64(RMS_ERROR) > 0.0, "{report:?}");
        let [before, after] = [BEFORE_MEAN_SMALLEST_ANGLE, AFTER_MEAN_SMALLEST_ANGLE].map(|place| report.f64(place));
        assert!(after > before && report.f64(AFTER_SMALLEST_ANGLE) > 0.5, "{report:?}");
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
        refused(&|p| p.numbers[1] = 7, INPUT, "one of vertices, patches, max_error and triangles");
        refused(&|p| p.numbers[0] = 1 << 40, PARAMETER, "vertices must be >= 1 and <= 4000000000, got 1099511627776");
        refused(&|p| p.numbers[4] = 1 << 40, PARAMETER, "iterations must be");
        refused(&|p| p.numbers[3] = f64::NAN.to_bits(), PARAMETER, "adaptivity must be");
        refused(&|p| (p.numbers[0], p.numbers[2]) = (0, 0), PARAMETER, "max_error must be a finite number > 0, got 0");
        // The vertices alone: a surface goes through all of them.
        let (mut cloud, none) = (Handle::NULL, std::ptr::null());
        let points = Array::of(&positions, F64, 3);
        api.ok((api.srf_cloud_create)(&points, none, none, none, std::ptr::null(), &mut cloud));
        api.ok((api.srf_cloud_cluster)(cloud, &params, std::ptr::null(), &mut mesh, &mut report));
        assert_eq!((report.numbers[VERTICES], report.numbers[OFF_SURFACE]), (100, 0), "{report:?}");
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
pub(super) fn a_mesh_gets_the_texture_coordinates_of_the_core() {
    use unwrap_report::*;
    let api = api();
    let mesh = octahedron();
    let (mut params, mut report, mut unwrapped) = (UnwrapParams::ZERO, UnwrapReport::ZERO, Handle::NULL);
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        api.ok((api.srf_unwrap_params_init_sized)(&mut params, size_of_val(&params)));
        api.ok((api.srf_unwrap_report_init_sized)(&mut report, size_of_val(&report)));
        (params.numbers[0], params.numbers[2], params.numbers[3]) = (2, 256, 2);
        let mut refused = |change: &dyn Fn(&mut UnwrapParams), status: i32, text: &str| {
            let mut wrong = params;
            change(&mut wrong);
            let none = std::ptr::null_mut();
            api.refused((api.srf_mesh_unwrap)(mesh, &wrong, std::ptr::null(), &mut unwrapped, none), status, text);
            assert!(unwrapped == Handle::NULL);
        };
        refused(&|p| p.numbers[0] = 101, PARAMETER, "tiles must be >= 1 and <= 100, got 101");
        refused(
            &|p| (p.numbers[0], p.numbers[1]) = (0, f64::NAN.to_bits()),
            PARAMETER,
            "texels_per_unit must be a finite number > 0, got NaN",
        );
        refused(&|p| p.numbers[2] = 8, PARAMETER, "size must be >= 16 and <= 16384, got 8");
        refused(&|p| p.set_f64(4, 2.0), PARAMETER, "cone must be");
        refused(&|p| p.numbers[3] = 300, PARAMETER, "padding must be");
        refused(&|p| p.set_f64(1, 3.0), INPUT, "tiles or texels_per_unit, not both");
        refused(&|p| p.numbers[3] = 64, INPUT, "use less padding or larger tiles");

        api.ok((api.srf_mesh_unwrap)(mesh, &params, std::ptr::null(), &mut unwrapped, &mut report));
        let asked = surfrecon::unwrap::UnwrapParams {
            extent: surfrecon::unwrap::ChartScale::Tiles(2),
            size: 256,
            padding: 2,
            ..Default::default()
        };
        let core = surfrecon::unwrap::unwrap(&of_core(mesh), &asked, &surfrecon::Progress::none()).unwrap();
        let attribute = |domain: u32, name: &CStr| {
            let mut view = Array::EMPTY;
            api.ok((api.srf_mesh_attribute)(unwrapped, domain, name.as_ptr(), &mut view));
            whole_numbers(&view.bytes())
        };
        let along = |axis: usize| core.uv.iter().map(|at| (at[axis] as f32).to_bits()).collect::<Vec<u32>>();
        assert_eq!([attribute(1, c"s"), attribute(1, c"t")], [along(0), along(1)]);
        assert_eq!(attribute(1, c"source_vertex"), core.source);
        assert_eq!(attribute(2, c"chart"), core.chart.iter().map(|&chart| chart as u32).collect::<Vec<u32>>());
        assert_eq!(
            [CHARTS, TILES].map(|place| report.numbers[place]),
            [core.report.charts, core.report.tiles].map(|n| n as u64)
        );
        assert_eq!([USED, STRETCH].map(|place| report.f64(place)), [core.report.used, core.report.stretch]);
        api.ok((api.srf_mesh_free)(unwrapped));
        api.ok((api.srf_mesh_free)(mesh));
    }
}

/// Photos of what lies around (0, 0, 4), of 40 x 30 pixels, from both sides. The second has depths.
fn photos() -> [surfrecon::photo::PhotoInMemory; 2] {
    use glam::{DAffine3, DMat3, DVec3};
    use surfrecon::photo::{Depths, PhotoInMemory, Pixels};
    let size = [40, 30];
    let camera = surfrecon::frame::Camera::sized([50.0, 50.0], [19.5, 14.5], size);
    let photo = |name: &str, world_from_camera, depths| PhotoInMemory {
        name: name.to_owned(),
        camera,
        world_from_camera,
        pixels: Pixels { size, colours: (0..1200).map(|i| [60 + (i % 90) as u8, 80, 200 - (i / 12) as u8]).collect() },
        depths,
    };
    let behind = DAffine3 {
        matrix3: DMat3::from_cols(DVec3::NEG_X, DVec3::Y, DVec3::NEG_Z),
        translation: DVec3::new(0.0, 0.0, 9.0),
    };
    let depths = Depths { size: [4, 3], values: vec![5.0; 12] };
    [photo("front", DAffine3::IDENTITY, None), photo("behind", behind, Some(depths))]
}

/// The photo behind a handle of the library.
fn handed_over(photo: &surfrecon::photo::PhotoInMemory) -> Handle {
    let api = api();
    let [a, b, c, d, e, f, g, h, i, x, y, z] = photo.world_from_camera.to_cols_array();
    let pose = [a, b, c, 0.0, d, e, f, 0.0, g, h, i, 0.0, x, y, z, 1.0];
    let camera = Projection { kind: 2, reserved: 0, numbers: [50.0, 50.0, 19.5, 14.5] };
    let pixels = Array::of(&photo.pixels.colours, U8, 3);
    let name = CString::new(photo.name.as_str()).unwrap();
    let depths = photo.depths.as_ref().map(|depths| Array::of(&depths.values, F32, 1));
    let [cols, rows] = photo.depths.as_ref().map_or([0; 2], |depths| depths.size);
    let depths = depths.as_ref().map_or(std::ptr::null(), std::ptr::from_ref);
    let mut made = Handle::NULL;
    let mut create = |of: usize, camera: &Projection| {
        // SAFETY: as the header wants it, or wrong in the ways it names.
        unsafe {
            let (pixels, name) = (&raw const pixels, name.as_ptr());
            (api.srf_photo_create)(of, 40, camera, pixels, &pose, name, rows, cols, depths, &mut made)
        }
    };
    api.refused(create(29, &camera), INPUT, "pixels: an image of 40 x 29 pixels has not 1200 elements");
    api.refused(create(30, &Projection { kind: 3, ..camera }), PARAMETER, "fill it by srf_projection_pinhole()");
    let mirrored = Projection { numbers: [-50.0, 50.0, 19.5, 14.5], ..camera };
    api.refused(create(30, &mirrored), INPUT, "the camera's focal length fx must be above 0, got -50");
    api.ok(create(30, &camera));
    made
}

/// Looks at all images of a tile, at the cameras and at the figures of the photos.
fn same_images(textures: Handle, core: &surfrecon::texture::Textured) {
    let api = api();
    let tile = &core.images.tiles[0];
    let bytes = |map: u32| {
        let mut view = Array::EMPTY;
        // SAFETY: as the header wants it.
        api.ok(unsafe { (api.srf_textures_image)(textures, 0, map, &mut view) });
        view.bytes()
    };
    let heights: Vec<u8> = tile.height.iter().flatten().flat_map(|height| height.to_ne_bytes()).collect();
    assert!(bytes(1) == tile.colour.as_flattened() && bytes(2) == *tile.mask.as_ref().unwrap() && bytes(4) == heights);
    assert!(bytes(3) == tile.normal.as_ref().unwrap().as_flattened() && bytes(5).is_empty());
    for (index, (photo, pose)) in core.report.photos.iter().zip(&core.world_from_camera).enumerate() {
        let (mut figures, mut found, mut reason) = (TexturedPhoto::ZERO, [0.0; 16], std::ptr::null());
        // SAFETY: as the header wants it.
        let reason = unsafe {
            api.ok((api.srf_textured_photo_init_sized)(&mut figures, size_of_val(&figures)));
            api.ok((api.srf_textures_photo)(textures, index, &mut figures));
            api.ok((api.srf_textures_pose)(textures, index, &mut found));
            api.ok((api.srf_textures_reason)(textures, index, &mut reason));
            CStr::from_ptr(reason)
        };
        assert_eq!(figures.numbers[textured_photo::TEXELS], photo.texels);
        assert_eq!(figures.f64(textured_photo::MOVED), photo.moved);
        assert_eq!(found[12..15], pose.translation.to_array());
        assert_eq!(reason.to_str().unwrap(), photo.reason);
    }
}

#[test]
pub(super) fn a_mesh_gets_the_images_of_the_core() {
    use surfrecon::photo::Photo;
    use texture_report::*;
    let api = api();
    let (mesh, taken) = (octahedron(), photos());
    let handles = taken.each_ref().map(handed_over);
    let (mut flat, mut textures) = (Handle::NULL, Handle::NULL);
    let (mut params, mut report) = (TextureParams::ZERO, TextureReport::ZERO);
    let (null, none) = (std::ptr::null(), std::ptr::null_mut());
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        api.ok((api.srf_mesh_unwrap)(mesh, std::ptr::null(), null, &mut flat, none));
        api.ok((api.srf_texture_params_init_sized)(&mut params, size_of_val(&params)));
        api.ok((api.srf_texture_report_init_sized)(&mut report, size_of_val(&report)));
        (params.numbers[0], params.numbers[4], params.numbers[5]) = (64, 1, 1);
        let none = std::ptr::null_mut();
        let mut refused = |of: Handle, photos: &[Handle], size: u64, status: i32, text: &str| {
            let (mut wrong, list) = (params, photos.as_ptr());
            wrong.numbers[0] = size;
            let made = &mut textures;
            let call = (api.srf_mesh_texture)(of, mesh, list, photos.len(), &wrong, null, made, none);
            api.refused(call, status, text);
            assert!(textures == Handle::NULL);
        };
        refused(
            mesh,
            &handles,
            64,
            INPUT,
            "the mesh has no texture coordinates, but texturing needs some: unwrap it first",
        );
        refused(flat, &[], 64, INPUT, "there are neither photos nor colours");
        refused(flat, &[handles[0], handles[0]], 64, INPUT, "two photos are called front: names must differ");
        refused(flat, &[handles[0], mesh], 64, HANDLE, "photos[1] must be a srf_photo, got a srf_mesh");
        refused(flat, &handles, 8, PARAMETER, "size must be >= 16 and <= 16384, got 8");

        let made = &mut textures;
        api.ok((api.srf_mesh_texture)(flat, mesh, handles.as_ptr(), 2, &params, null, made, &mut report));
        let asked =
            surfrecon::texture::TextureParams { size: 64, normal_map: true, height_map: true, ..Default::default() };
        let progress = surfrecon::Progress::none();
        let core_mesh = of_core(mesh);
        let unwrapped = surfrecon::unwrap::unwrap(&core_mesh, &Default::default(), &progress).unwrap().mesh;
        let photos = taken.each_ref().map(|photo| photo as &dyn Photo);
        let core = surfrecon::texture::run(&unwrapped, &core_mesh, &photos, &asked, &progress).unwrap();
        same_images(textures, &core);
        let numbers = [TILES, TEXELS, SEEN, PHOTOS_COUNT].map(|place| report.numbers[place]);
        assert_eq!(numbers, [1, core.report.texels, core.report.seen, 2]);
        assert!(core.report.seen > 100);
        assert_eq!([LOWEST, HIGHEST].map(|place| report.f64(place)), core.report.heights.unwrap());
        let (mut size, mut tiles, mut view) = (0, 0, Array::EMPTY);
        api.ok((api.srf_textures_size)(textures, &mut size, &mut tiles));
        assert_eq!([size, tiles], [64, 1]);
        let call = (api.srf_textures_image)(textures, 1, 1, &mut view);
        api.refused(call, PARAMETER, "tile must be < 1, the number of tiles, got 1");
        let call = (api.srf_textures_image)(textures, 0, 6, &mut view);
        api.refused(call, PARAMETER, "map must be a value of srf_texture_map, 1 to 5, got 6");
        for end in [(api.srf_textures_free)(textures), (api.srf_mesh_free)(flat), (api.srf_mesh_free)(mesh)] {
            api.ok(end);
        }
        handles.into_iter().for_each(|photo| api.ok((api.srf_photo_free)(photo)));
    }
}

#[test]
pub(super) fn a_merge_is_that_of_the_core_for_any_number_of_threads() {
    use glam::DAffine3;
    let mesh = octahedron();
    let merger = merger_of(mesh);
    let mut params = params(0.07);
    let expected = {
        let mesh = of_core(mesh);
        let name = "octahedron".to_owned();
        let placed = surfrecon::merge::PlacedMesh { name, mesh: &mesh, world_from_mesh: DAffine3::IDENTITY };
        let params = surfrecon::merge::MergeParams { voxel: Some(0.07), ..Default::default() };
        let merged = surfrecon::merge::merge(
            &[&placed],
            &params,
            surfrecon::merge::Run::default(),
            &surfrecon::Progress::none(),
        )
        .unwrap()
        .mesh;
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
