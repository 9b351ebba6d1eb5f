//! Cancelling calls from other threads.

use std::time::{Duration, Instant};

use super::*;

fn cancel_handle() -> Handle {
    let mut cancel = Handle::NULL;
    // SAFETY: as the header wants it.
    api().ok(unsafe { (api().srf_cancel_create)(&mut cancel) });
    cancel
}

fn with(cancel: Handle) -> Watch {
    Watch { report: None, user: std::ptr::null_mut(), cancel }
}

fn is_set(cancel: Handle) -> u32 {
    let mut is_set = 9;
    // SAFETY: as the header wants it.
    api().ok(unsafe { (api().srf_cancel_is_set)(cancel, &mut is_set) });
    is_set
}

#[test]
pub(super) fn a_call_is_cancelled_by_another_thread_and_not_by_what_was_reset() {
    let api = api();
    let mesh = octahedron();
    let merger = merger_of(mesh);
    let (cancel, mut surface) = (cancel_handle(), Handle::NULL);
    // SAFETY: as the header wants it.
    unsafe {
        let watch = with(cancel);
        let none = std::ptr::null_mut();
        let waited = std::thread::scope(|scope| {
            let other = scope.spawn(move || {
                std::thread::sleep(Duration::from_millis(200));
                api.ok((api.srf_cancel_set)(cancel));
                Instant::now()
            });
            let long = params(0.0015);
            api.refused((api.srf_merger_run)(merger, &long, &watch, &mut surface, none), CANCELLED, "cancelled");
            other.join().unwrap().elapsed()
        });
        // A tenth of a second on a machine that does nothing else, where the whole takes many times that.
        assert!(waited < Duration::from_secs(10), "{waited:?}");
        assert_eq!((is_set(cancel), surface), (1, Handle::NULL));
        // Also work that is over before anybody is asked.
        let (mut report, null) = (CheckReport::ZERO, std::ptr::null());
        api.ok((api.srf_check_report_init_sized)(&mut report, size_of_val(&report)));
        let before = report;
        api.refused((api.srf_mesh_check)(mesh, 0, &watch, &mut report), CANCELLED, "cancelled");
        assert_eq!(report, before, "written in spite of the error");
        api.ok((api.srf_cancel_reset)(cancel));
        assert_eq!(is_set(cancel), 0);
        api.ok((api.srf_mesh_check)(mesh, 0, &watch, &mut report));
        api.ok((api.srf_mesh_check)(mesh, 0, null, &mut report));
        for end in [(api.srf_merger_free)(merger), (api.srf_mesh_free)(mesh), (api.srf_cancel_free)(cancel)] {
            api.ok(end);
        }
    }
}

#[test]
pub(super) fn one_that_was_freed_cancels_nothing_and_no_other() {
    let api = api();
    let mesh = octahedron();
    let all: Vec<Handle> = (0..200).map(|_| cancel_handle()).collect();
    let mut report = CheckReport::ZERO;
    // SAFETY: as the header wants it; a handle that was freed is allowed to be handed in.
    unsafe {
        api.ok((api.srf_check_report_init_sized)(&mut report, size_of_val(&report)));
        for cancel in all.iter().step_by(2) {
            api.ok((api.srf_cancel_free)(*cancel));
        }
        // Their places are others' now.
        let new: Vec<Handle> = (0..100).map(|_| cancel_handle()).collect();
        for cancel in all.iter().step_by(2) {
            assert_eq!((api.srf_cancel_set)(*cancel), HANDLE);
            api.refused((api.srf_cancel_reset)(*cancel), HANDLE, "cancel is not a handle");
            let status = (api.srf_mesh_check)(mesh, 0, &with(*cancel), &mut report);
            api.refused(status, HANDLE, "progress.cancel is not a handle of this library, or one that was freed");
        }
        assert!(all.iter().skip(1).step_by(2).chain(&new).all(|cancel| is_set(*cancel) == 0));
        api.ok((api.srf_cancel_set)(new[0]));
        assert!(new[1..].iter().all(|cancel| is_set(*cancel) == 0) && is_set(new[0]) == 1);
        let status = (api.srf_mesh_check)(mesh, 0, &with(mesh), &mut report);
        api.refused(status, HANDLE, "progress.cancel must be a srf_cancel, got a srf_mesh");
        assert_eq!((api.srf_cancel_set)(mesh), HANDLE);
        for cancel in all.into_iter().skip(1).step_by(2).chain(new) {
            api.ok((api.srf_cancel_free)(cancel));
        }
        api.ok((api.srf_mesh_free)(mesh));
    }
}

#[test]
fn one_may_be_freed_by_the_call_that_has_it() {
    unsafe extern "C" fn frees(_: *const c_char, _: f64, _: *const c_char, user: *mut c_void) -> i32 {
        // SAFETY: the handle handed in, and a call that is refused from the second time on.
        let (first, set) = unsafe {
            let cancel = *user.cast::<Handle>();
            ((api().srf_cancel_free)(cancel), (api().srf_cancel_set)(cancel))
        };
        assert!([OK, HANDLE].contains(&first) && set == HANDLE, "{first} {set}");
        0
    }
    let api = api();
    let mesh = octahedron();
    let mut cancel = cancel_handle();
    let watch = Watch { report: Some(frees), user: (&raw mut cancel).cast(), cancel };
    let merger = merger_of(mesh);
    let mut surface = Handle::NULL;
    // SAFETY: as the header wants it.
    unsafe {
        api.ok((api.srf_merger_run)(merger, &params(0.05), &watch, &mut surface, std::ptr::null_mut()));
        api.refused((api.srf_cancel_free)(cancel), HANDLE, "freed");
        for end in [(api.srf_merger_free)(merger), (api.srf_mesh_free)(mesh), (api.srf_mesh_free)(surface)] {
            api.ok(end);
        }
    }
}
