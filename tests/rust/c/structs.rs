//! Structs that start with their size: of this header, of older and of newer ones, and none at all; their defaults are those
//! of the core's table.

use surfrecon::params::{self, Default};

use crate::library::*;

/// Calls the triangulation of a small image with `params` at `pointer`.
fn triangulate(pointer: *const TriangulateParams) -> i32 {
    let api = api();
    let plane = Projection { kind: 1, reserved: 0, numbers: [0.0, 0.0, 1.0, -1.0] };
    let values = [0.0_f64; 16];
    let (mut image, mut mesh) = (Handle::NULL, Handle::NULL);
    // SAFETY: as the header wants it; the params are what is tested.
    unsafe {
        let null = std::ptr::null();
        let samples = Array::of(&values, F64, 1);
        api.ok((api.srf_image_create)(4, 4, &plane, &samples, null, std::ptr::null(), &mut image));
        let status = (api.srf_image_triangulate)(image, pointer, std::ptr::null(), &mut mesh);
        assert_eq!(status == 0, mesh != Handle::NULL);
        let message = api.message();
        api.ok((api.srf_mesh_free)(mesh));
        api.ok((api.srf_image_free)(image));
        assert_eq!(message, api.message());
        status
    }
}

fn defaults() -> TriangulateParams {
    let mut params = TriangulateParams::ZERO;
    // SAFETY: as the header wants it.
    api().ok(unsafe { (api().srf_triangulate_params_init_sized)(&mut params, size_of_val(&params)) });
    params
}

#[test]
fn older_structs_take_defaults_for_what_they_lack() {
    let mut params = defaults();
    assert_eq!(triangulate(&params), 0);
    // As if the last field did not exist yet: rubbish there is not looked at.
    params.set_f64(1, f64::NAN);
    api().refused(triangulate(&params), 1, "grazing_limit");
    params.size = 16;
    assert_eq!(triangulate(&params), 0);
    params.set_f64(0, f64::NAN);
    params.size = 8;
    assert_eq!(triangulate(&params), 0);
}

#[test]
fn newer_structs_are_fine_as_long_as_what_is_new_is_zero() {
    #[repr(C)]
    struct Newer {
        known: TriangulateParams,
        new: [u64; 2],
    }
    let mut newer = Newer { known: defaults(), new: [0; 2] };
    newer.known.size = size_of::<Newer>() as u32;
    assert_eq!(triangulate((&raw const newer).cast()), 0);
    newer.new[1] = 1 << 40;
    api().refused(triangulate((&raw const newer).cast()), 10, "use a newer library");
}

#[test]
fn sizes_that_can_not_be_are_refused() {
    for size in [0, 4, 7, 12, 20, 1 << 20, u32::MAX] {
        let mut params = defaults();
        params.size = size;
        api().refused(triangulate(&params), 10, "_init function first");
    }
}

#[test]
fn an_older_report_is_written_as_far_as_it_goes() {
    let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0_f64]];
    let mut mesh = Handle::NULL;
    let mut report = MeshReport { size: 24, second: 9, numbers: [9; 17] };
    // SAFETY: as the header wants it.
    unsafe {
        let triangles = Array::of(&[[0_u32, 1, 2]], U32, 3);
        api().ok((api().srf_mesh_create)(&Array::of(&positions, F64, 3), &triangles, &mut mesh));
        api().ok((api().srf_mesh_check)(mesh, 0, std::ptr::null(), &mut report));
        api().ok((api().srf_mesh_free)(mesh));
    }
    assert_eq!((report.size, report.second, &report.numbers[..3]), (24, 1, &[1, 3, 9][..]));
}

/// The default of a parameter as C has it.
fn default(operation: &str, name: &str) -> f64 {
    match params::find(operation, name).unwrap_or_else(|| panic!("{operation} {name}")).default {
        Default::Value(value) => value,
        Default::FromData(_) => -1.0,
    }
}

#[test]
fn defaults_are_those_of_the_table() {
    let api = api();
    let (mut merge, mut scan, mut sculpt) = (MergeParams::ZERO, ScanParams::ZERO, SculptParams::ZERO);
    let (mut open, mut reconstruct, mut quads) = (ReadOptions::ZERO, ReconstructParams::ZERO, QuadParams::ZERO);
    let mut cluster = ClusterParams::ZERO;
    // SAFETY: as the header wants it.
    unsafe {
        api.ok((api.srf_cluster_params_init_sized)(&mut cluster, size_of_val(&cluster)));
        api.ok((api.srf_merge_params_init_sized)(&mut merge, size_of_val(&merge)));
        api.ok((api.srf_scan_params_init_sized)(&mut scan, size_of_val(&scan)));
        api.ok((api.srf_sculpt_params_init_sized)(&mut sculpt, size_of_val(&sculpt)));
        api.ok((api.srf_read_options_init_sized)(&mut open, size_of_val(&open)));
        api.ok((api.srf_reconstruct_params_init_sized)(&mut reconstruct, size_of_val(&reconstruct)));
        api.ok((api.srf_quad_params_init_sized)(&mut quads, size_of_val(&quads)));
    }
    assert_eq!(open.size as usize, size_of::<ReadOptions>());
    assert_eq!(reconstruct.size as usize, size_of::<ReconstructParams>());
    assert_eq!(quads.size as usize, size_of::<QuadParams>());
    let triangulate = defaults();
    let sizes = [merge.size, scan.size, sculpt.size, triangulate.size].map(|size| size as usize);
    let expected =
        [size_of::<MergeParams>(), size_of::<ScanParams>(), size_of::<SculptParams>(), size_of::<TriangulateParams>()];
    assert_eq!(sizes, expected);
    let mut named = 0;
    let mut same = |operation: &str, fields: &[&str], given: &dyn Fn(usize) -> f64| {
        for (i, name) in fields.iter().enumerate() {
            assert_eq!(given(i), default(operation, name), "{operation} {name}");
            named += 1;
        }
    };
    same("triangulate", &["edge_limit", "grazing_limit"], &|i| triangulate.f64(i));
    same("merge", &["voxel", "merge_distance", "max_hole_length", "min_component_share"], &|i| merge.f64(i));
    same("merge", &["threads"], &|_| f64::from(merge.second));
    let noise =
        ["noise", "noise_grazing", "quantum", "dropout", "dropout_grazing", "max_range", "pose_shift", "pose_turn"];
    same("scan", &noise, &|i| scan.f64(i));
    same("scan", &["seed"], &|_| scan.numbers[8] as f64);
    same("scan", &["threads"], &|_| f64::from(scan.second));
    same("open", &["scale"], &|_| open.f64(7));
    same("open", &["step"], &|_| open.f64(9));
    same("open", &["max_decoded_gib"], &|_| open.f64(11));
    same("sculpt", &["tolerance", "relative_tolerance"], &|i| sculpt.f64(i));
    same("sculpt", &["effort"], &|_| sculpt.numbers[2] as f64);
    same("sculpt", &["interpolate"], &|_| sculpt.numbers[5] as f64);
    same("sculpt", &["min_angle"], &|_| sculpt.f64(6));
    same("sculpt", &["simplify_borders"], &|_| sculpt.numbers[7] as f64);
    same("sculpt", &["threads"], &|_| f64::from(sculpt.second));
    same("reconstruct", &["factor"], &|_| reconstruct.f64(0));
    same("reconstruct", &["threads"], &|_| f64::from(reconstruct.second));
    // Tiles are counted: 0 stands for a number measured from the image.
    same("quads", &["tiles_down", "tiles_across"], &|i| quads.numbers[i] as f64 - 1.0);
    same("quads", &["rows", "columns"], &|i| quads.numbers[2 + i] as f64);
    same("quads", &["max_error", "rms_error"], &|i| quads.f64(4 + i));
    same("quads", &["gap_passes", "gap_neighbours"], &|i| quads.numbers[6 + i] as f64);
    same("quads", &["curvature_unit"], &|_| quads.f64(8));
    same("quads", &["curvature_limit"], &|_| quads.numbers[9] as f64);
    same("quads", &["exponent", "floor", "smoothing", "background_curvature", "coverage"], &|i| quads.f64(10 + i));
    same("quads", &["threads"], &|_| f64::from(quads.second));
    same("cluster", &["max_error", "adaptivity"], &|i| cluster.f64(2 + i));
    same("cluster", &["iterations", "relaxation", "seed", "fitting"], &|i| cluster.numbers[4 + i] as f64);
    same("cluster", &["threads"], &|_| f64::from(cluster.second));
    assert_eq!((cluster.size as usize, cluster.numbers[..2].to_vec()), (size_of::<ClusterParams>(), vec![0, 0]));
    assert_eq!([merge.f64(4), merge.f64(5)], [triangulate.f64(0), triangulate.f64(1)]);
    assert_eq!([sculpt.f64(3), sculpt.f64(4)], [triangulate.f64(0), triangulate.f64(1)]);
    let known = ["triangulate", "merge", "sculpt", "quads", "reconstruct", "cluster", "scan", "open"];
    // Counts that the data give are 0 in C.
    let others = ["backfaces", "vertices", "patches"];
    let there = params::table().filter(|p| known.contains(&p.operation) && !others.contains(&p.name)).count();
    assert_eq!(named, there, "a parameter of the table is missing here");
}
