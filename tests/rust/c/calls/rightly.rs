//! Every function: once with right arguments, and once with each fault that they can have.

use super::kit::{FAULTS, Fault, Kit};
use super::*;

/// Functions that concern all other tests as well, which call them.
const OF_THE_PROCESS: [&str; 2] = ["srf_set_memory_limit", "srf_set_log"];

/// Calls a function. Nothing where it returns no status, or has no argument with the fault.
fn called(name: &'static str, kit: &Kit) -> Option<i32> {
    kit.begin(name);
    let status = api().call_rightly(name, kit);
    // SAFETY: as the header wants it.
    api().ok(unsafe { (api().srf_context_use)(Handle::NULL, std::ptr::null_mut()) });
    status
}

#[test]
fn every_function_with_right_arguments() {
    let mut watched = 0;
    for name in NAMES.iter().filter(|name| !OF_THE_PROCESS.contains(name)) {
        // By now the library holds memory.
        let expected = match *name {
            "srf_set_allocator" => INPUT,
            _ => OK,
        };
        let kit = Kit::new(Fault::None);
        if let Some(status) = called(name, &kit) {
            assert_eq!(status, expected, "{name}: {}", api().message());
        }
        if let Some(told) = kit.told() {
            assert_eq!(told, 1.0, "{name}: what its progress was told last");
            watched += 1;
        }
    }
    assert!(watched > 30, "{watched} functions have a progress");
}

#[test]
fn every_function_with_each_fault() {
    with_faults(&FAULTS);
}

/// The work that each of eight threads does at once, see `threads`.
pub(super) fn every_function_with_wrong_handles_and_sizes() {
    with_faults(&[Fault::Handle, Fault::Size, Fault::Older, Fault::Newer]);
}

fn with_faults(faults: &[Fault]) {
    let mut wrong = Vec::new();
    for &fault in faults {
        let expected: &[i32] = match fault {
            Fault::Handle => &[HANDLE],
            Fault::Cancelled => &[CANCELLED],
            Fault::Size => &[STRUCT_SIZE],
            Fault::Older | Fault::Newer | Fault::None => &[OK],
            Fault::Type => &[PARAMETER],
            // Some may not be given together.
            Fault::Parameters => &[PARAMETER, INPUT],
            Fault::Values => &[INPUT, PARAMETER, OK],
            Fault::Number => &[PARAMETER, INPUT, OUT_OF_MEMORY],
            Fault::Text => &[INPUT],
            Fault::Path => &[IO],
            Fault::Gone => &[IO, OK],
            Fault::Damaged => &[FORMAT, OK],
            Fault::Memory => &[OUT_OF_MEMORY, OK],
            Fault::Senseless => &[INPUT, PARAMETER, OK],
        };
        // The arguments of these calls stay what they were.
        let may_share = ![Fault::None, Fault::Gone, Fault::Damaged, Fault::Memory, Fault::Senseless].contains(&fault);
        let shared = Kit::new(fault);
        for name in NAMES.iter().filter(|name| !OF_THE_PROCESS.contains(name) && **name != "srf_set_allocator") {
            // The others have nothing to do with files of scans.
            let may_read = ["scans", "align", "merger", "plane", "close"].iter().any(|part| name.contains(part));
            if !may_read && [Fault::Gone, Fault::Damaged].contains(&fault) {
                continue;
            }
            // The arguments of others can't be made of senseless ones.
            let may_be_given =
                ["image", "mesh", "cloud", "region_below", "ground", "sculptor_create", "grid_camera_scale"];
            if fault == Fault::Senseless
                && (!may_be_given.iter().any(|part| name.contains(part))
                    || name.contains("add_")
                    || name.contains("meshes"))
            {
                continue;
            }
            let own = Kit::new(fault);
            if let Some(status) = called(name, if may_share { &shared } else { &own })
                && !expected.contains(&status)
            {
                wrong.push(format!("{fault:?}: {name} returned {status}: {}", api().message()));
            }
        }
    }
    assert!(wrong.is_empty(), "{} of them:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn what_only_certain_data_lead_to() {
    let api = api();
    let kit = Kit::new(Fault::None);
    let (none, room) = (std::ptr::null::<Watch>(), std::ptr::null_mut());
    let (mut params, mut made, mut few, mut reconstructor) =
        (ClusterParams::ZERO, Handle::NULL, Handle::NULL, Handle::NULL);
    let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0_f64]];
    // SAFETY: as the header wants it.
    unsafe {
        api.ok((api.srf_cluster_params_init_sized)(&mut params, size_of_val(&params)));
        params.second = 5000;
        let status = (api.srf_cloud_cluster)(kit.handle("cloud"), &params, none, &mut made, room);
        api.refused(status, PARAMETER, "threads must be");
        let points = Array::of(&points, F64, 3);
        api.ok((api.srf_cloud_create)(&points, none.cast(), none.cast(), none.cast(), none.cast(), &mut few));
        let params = std::ptr::null();
        api.ok((api.srf_reconstructor_create)(few, std::ptr::null(), &mut reconstructor));
        let status = (api.srf_reconstructor_surface)(
            reconstructor,
            params,
            none,
            &mut made,
            std::ptr::null_mut(),
            std::ptr::null_mut(),
        );
        api.refused(status, INPUT, "points");
        // More rows than any image has that can be sculpted, and no pixel in them.
        let (mut tall, none) = (Handle::NULL, std::ptr::null());
        let empty = Array { count: 0, ..Array::of(&[0.0_f64], F64, 1) };
        api.ok((api.srf_image_create)(1 << 33, 0, &DEPTH, &empty, std::ptr::null(), none, &mut tall));
        let status = (api.srf_sculptor_create)(tall, std::ptr::null(), std::ptr::null(), &mut made);
        api.refused(status, INPUT, "at most 2^32 - 2 rows");
        api.ok((api.srf_image_free)(tall));
        assert_eq!(made, Handle::NULL);
        api.ok((api.srf_reconstructor_free)(reconstructor));
        api.ok((api.srf_cloud_free)(few));
    }
}
