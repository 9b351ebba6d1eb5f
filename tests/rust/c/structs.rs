//! Structs that start with their size: of this header, of older and of newer ones, and none at all. Their defaults are those of the core's
//! table.

use surfrecon::params::{self, ParamKind, Value};

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
    api().refused(triangulate((&raw const newer).cast()), 10, "Use a newer library.");
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
    let mut report = CheckReport { size: 24, second: 9, ..CheckReport::ZERO };
    report.numbers.fill(9);
    // SAFETY: as the header wants it.
    unsafe {
        let triangles = Array::of(&[[0_u32, 1, 2]], U32, 3);
        api().ok((api().srf_mesh_create)(&Array::of(&positions, F64, 3), &triangles, &mut mesh));
        api().ok((api().srf_mesh_check)(mesh, 0, std::ptr::null(), &mut report));
        api().ok((api().srf_mesh_free)(mesh));
    }
    assert_eq!((report.size, report.second, &report.numbers[..3]), (24, 0, &[1, 3, 9][..]));
}

/// Places of the fields of a struct, as a compiler of C found them: name, bytes, place.
fn layout(of: &str) -> Vec<(String, usize, usize)> {
    let listed = std::fs::read_to_string(root().join("c-api/abi/layouts.txt")).expect("the layouts");
    let field = |line: &str| {
        let (name, rest) = line.strip_prefix(of)?.strip_prefix('.')?.split_once(": ")?;
        let (bytes, place) = rest.split_once(" bytes at ")?;
        Some((name.to_owned(), bytes.parse().ok()?, place.parse().ok()?))
    };
    listed.lines().filter_map(field).collect()
}

/// Theorem: every parameter of the table is a field of its operation's struct, with the table's default, and each field that
/// is none is known.
#[test]
fn defaults_are_those_of_the_table() {
    let api = api();
    type Init = unsafe fn(*mut u64, usize) -> i32;
    macro_rules! init {
        ($function:ident) => {{
            // SAFETY: the memory has room for the size that is handed over.
            let init: Init = |bytes, size| unsafe { (crate::library::api().$function)(bytes.cast(), size) };
            init
        }};
    }
    let structs: &[(&str, &str, Init)] = &[
        ("open", "srf_read_options", init!(srf_read_options_init_sized)),
        ("write", "srf_write_options", init!(srf_write_options_init_sized)),
        ("triangulate", "srf_triangulate_params", init!(srf_triangulate_params_init_sized)),
        ("plane", "srf_plane_params", init!(srf_plane_params_init_sized)),
        ("align", "srf_align_params", init!(srf_align_params_init_sized)),
        ("merge", "srf_merge_params", init!(srf_merge_params_init_sized)),
        ("sculpt", "srf_sculpt_params", init!(srf_sculpt_params_init_sized)),
        ("quads", "srf_quads_params", init!(srf_quads_params_init_sized)),
        ("spline", "srf_spline_params", init!(srf_spline_params_init_sized)),
        ("reconstruct", "srf_reconstruct_params", init!(srf_reconstruct_params_init_sized)),
        ("cluster", "srf_cluster_params", init!(srf_cluster_params_init_sized)),
        ("close", "srf_close_params", init!(srf_close_params_init_sized)),
        ("check_print", "srf_check_print_params", init!(srf_check_print_params_init_sized)),
        ("prepare_print", "srf_prepare_print_params", init!(srf_prepare_print_params_init_sized)),
        ("unwrap", "srf_unwrap_params", init!(srf_unwrap_params_init_sized)),
        ("texture", "srf_texture_params", init!(srf_texture_params_init_sized)),
        ("scan", "srf_scan_params", init!(srf_scan_params_init_sized)),
    ];
    let operations: Vec<&str> = structs.iter().map(|(operation, ..)| *operation).collect();
    assert_eq!(operations, params::schemas().map(|schema| schema.operation).collect::<Vec<_>>());
    for (operation, of, init) in structs {
        let mut memory = [u64::MAX; 64];
        let fields = layout(of);
        let size = fields.iter().map(|(_, bytes, place)| bytes + place).max().expect("there are fields");
        // SAFETY: the memory is larger than any struct.
        api.ok(unsafe { init(memory.as_mut_ptr(), size) });
        assert!(memory[size / 8..].iter().all(|word| *word == u64::MAX), "{of} writes beyond its end");
        let rows = (params::schema(operation).expect("a schema").all)();
        let mut others = Vec::new();
        for (name, bytes, place) in &fields {
            let word = memory[place / 8];
            let number = if *bytes == 4 { (word >> (8 * (place % 8))) as u32 as f64 } else { f64::from_bits(word) };
            let Some(row) = rows.iter().find(|row| row.name == name) else {
                others.push(name.as_str());
                continue;
            };
            let expected = match (row.default_value(), row.choices()) {
                (Value::Absent, _) if row.any_number => f64::NAN,
                // No value of theirs is 0.
                (Value::Absent, _) if row.kind == ParamKind::Count && row.min >= 1.0 => 0.0,
                (Value::Absent, _) => -1.0,
                (Value::Number(number), _) => number,
                (Value::Flag(flag), _) => f64::from(u8::from(flag)),
                (Value::Choice(chosen), all) => {
                    all.iter().position(|choice| choice.name == chosen).expect("it is one") as f64 + 1.0
                }
            };
            let whole = matches!(row.kind, ParamKind::Flag | ParamKind::Choice(_))
                || row.kind == ParamKind::Count && expected >= 0.0;
            let got = if *bytes == 8 && whole { word as f64 } else { number };
            assert!(got == expected || got.is_nan() && expected.is_nan(), "{of}.{name} is {got}, not {expected}");
        }
        for row in rows {
            assert!(fields.iter().any(|(name, ..)| name == row.name), "{of} lacks {}", row.name);
        }
        let known = ["struct_size", "reserved", "intrinsics", "camera_size"];
        assert!(others.iter().all(|name| known.contains(name)), "{of} has {others:?}");
    }
}
