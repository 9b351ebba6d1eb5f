//! Contexts, each with threads, a limit on memory and a log of its own.

use std::sync::Mutex;

use super::*;

fn context() -> Handle {
    let mut context = Handle::NULL;
    // SAFETY: as the header wants it.
    api().ok(unsafe { (api().srf_context_create)(&mut context) });
    context
}

/// What this thread used before.
fn use_context(context: Handle) -> Handle {
    let mut former = Handle(std::ptr::without_provenance_mut(1));
    // SAFETY: as the header wants it.
    api().ok(unsafe { (api().srf_context_use)(context, &mut former) });
    former
}

fn held(context: Handle) -> u64 {
    let mut held = 0;
    // SAFETY: as the header wants it.
    api().ok(unsafe { (api().srf_context_memory)(context, std::ptr::null_mut(), &mut held) });
    held
}

/// A mesh of so many megabytes.
fn large(megabytes: usize) -> (i32, Handle) {
    let positions = vec![[0.5_f32; 3]; megabytes * 1_000_000 / 24];
    let mut mesh = Handle::NULL;
    // SAFETY: as the header wants it.
    let status = unsafe { (api().srf_mesh_create)(&Array::of(&positions, F32, 3), std::ptr::null(), &mut mesh) };
    (status, mesh)
}

#[test]
pub(super) fn a_context_has_settings_of_its_own() {
    let api = api();
    let (a, b) = (context(), context());
    let threads = |context| {
        let mut threads = 9;
        // SAFETY: as the header wants it.
        api.ok(unsafe { (api.srf_context_threads)(context, &mut threads) });
        threads
    };
    let limit = |context| {
        let mut limit = 9;
        // SAFETY: as the header wants it.
        api.ok(unsafe { (api.srf_context_memory)(context, &mut limit, std::ptr::null_mut()) });
        limit
    };
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        assert_eq!((threads(a), limit(a)), (0, 0));
        api.ok((api.srf_context_set_threads)(a, 3));
        api.ok((api.srf_context_set_memory_limit)(a, u64::MAX - 1));
        assert_eq!((threads(a), limit(a), threads(b), limit(b)), (3, u64::MAX - 1, 0, 0));
        api.refused((api.srf_context_set_threads)(a, 1025), PARAMETER, "threads must be >= 0 and <= 1024, got 1025");
        assert_eq!(threads(a), 3);
        assert_eq!(use_context(a), Handle::NULL);
        assert_eq!(use_context(b), a);
        let mesh = octahedron();
        let mut former = Handle::NULL;
        api.refused((api.srf_context_use)(mesh, &mut former), HANDLE, "context must be a srf_context, got a srf_mesh");
        assert_eq!((former, use_context(b)), (Handle::NULL, b));
        api.ok((api.srf_context_free)(a));
        api.refused((api.srf_context_use)(a, &mut former), HANDLE, "freed");
        // What was used and is freed is still told, and refused.
        api.ok((api.srf_context_free)(b));
        assert_eq!(use_context(Handle::NULL), b);
        api.refused((api.srf_context_use)(b, std::ptr::null_mut()), HANDLE, "freed");
        assert_eq!(use_context(Handle::NULL), Handle::NULL);
        api.ok((api.srf_mesh_free)(mesh));
    }
}

#[test]
#[ignore = "others would find none left: `each_status_that_is_listed_is_provoked` runs it in a process of its own"]
fn there_are_only_so_many() {
    let api = api();
    let mut all = Vec::new();
    let status = loop {
        let mut context = Handle::NULL;
        // SAFETY: as the header wants it.
        match unsafe { (api.srf_context_create)(&mut context) } {
            OK => all.push(context),
            status => break status,
        }
    };
    api.refused(status, OUT_OF_MEMORY, "there are 1023 contexts already");
    assert_eq!(all.len(), 1023);
    // SAFETY: as the header wants it.
    all.into_iter().for_each(|context| api.ok(unsafe { (api.srf_context_free)(context) }));
}

#[test]
#[ignore = "it must come first: `each_status_that_is_listed_is_provoked` runs it in a process of its own"]
fn memory_comes_from_the_callers_functions() {
    use std::alloc::{Layout, alloc, dealloc};
    use std::sync::atomic::{AtomicUsize, Ordering};
    static BLOCKS: AtomicUsize = AtomicUsize::new(0);
    unsafe extern "C" fn allocate(_: *mut c_void, size: usize, alignment: usize) -> *mut c_void {
        BLOCKS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the library asks for at least a byte.
        unsafe { alloc(Layout::from_size_align(size, alignment).unwrap()).cast() }
    }
    unsafe extern "C" fn deallocate(_: *mut c_void, block: *mut c_void, size: usize, alignment: usize) {
        // SAFETY: as it was asked for.
        unsafe { dealloc(block.cast(), Layout::from_size_align(size, alignment).unwrap()) }
    }
    let functions = [allocate as *const () as usize, 0, deallocate as *const () as usize, 0];
    // SAFETY: as the header wants it.
    unsafe {
        api().ok((api().srf_set_allocator)(&functions));
        api().ok((api().srf_mesh_free)(octahedron()));
    }
    assert!(BLOCKS.load(Ordering::Relaxed) > 3);
}

#[test]
pub(super) fn a_limit_concerns_the_calls_of_its_context_alone() {
    let api = api();
    let (narrow, wide) = (context(), context());
    // SAFETY: as the header wants it.
    unsafe {
        api.ok((api.srf_context_set_memory_limit)(narrow, 8_000_000));
        use_context(narrow);
        let (status, mesh) = large(20);
        api.refused(status, OUT_OF_MEMORY, "not enough memory");
        assert_eq!(mesh, Handle::NULL);
        let (status, small) = large(4);
        api.ok(status);
        assert_eq!(use_context(wide), narrow);
        let (status, mesh) = large(20);
        api.ok(status);
        assert!((4_000_000..5_000_000).contains(&held(narrow)), "{}", held(narrow));
        assert!((20_000_000..21_000_000).contains(&held(wide)), "{}", held(wide));
        // Given back on the accounts of those who took it, whoever frees it.
        api.ok((api.srf_mesh_free)(small));
        use_context(Handle::NULL);
        std::thread::spawn(move || api.ok((api.srf_mesh_free)(mesh))).join().unwrap();
        assert!(held(narrow) < 100_000 && held(wide) < 100_000, "{} {}", held(narrow), held(wide));
        for end in [(api.srf_context_free)(narrow), (api.srf_context_free)(wide)] {
            api.ok(end);
        }
    }
}

#[test]
pub(super) fn what_a_merge_keeps_is_on_the_account_of_its_last_run() {
    let api = api();
    let (a, b) = (context(), context());
    let mesh = octahedron();
    let merger = merger_of(mesh);
    let mut renewed = [[0, 0]; 3];
    // SAFETY: as the header wants it.
    unsafe {
        api.ok((api.srf_merger_keep)(merger, 1));
        let mut run = |k: usize, context| {
            use_context(context);
            let found = merged(merger, &params(0.02));
            let [some, all] = &mut renewed[k];
            api.ok((api.srf_merger_renewed)(merger, some, all));
            (found, held(a), held(b))
        };
        let (first, kept, none) = run(0, a);
        assert!(kept > 1_000_000 && none == 0, "{kept} {none}");
        let (second, left, its) = run(1, b);
        assert!(second == first && left < kept / 4 && its > kept / 2, "{left} {its} of {kept}");
        assert!(run(2, b).0 == first);
        let all = renewed[0][1];
        assert_eq!(renewed, [[all, all], [all, all], [0, all]]);
        use_context(a);
        api.ok((api.srf_merger_free)(merger));
        use_context(Handle::NULL);
        assert!(held(a) < kept / 4 && held(b) < kept / 4, "{} {} of {kept}", held(a), held(b));
        for end in [(api.srf_mesh_free)(mesh), (api.srf_context_free)(a), (api.srf_context_free)(b)] {
            api.ok(end);
        }
    }
}

#[test]
pub(super) fn a_context_is_freed_while_a_call_is_under_it() {
    struct Both {
        context: Handle,
        calls: u32,
    }
    unsafe extern "C" fn frees(_: *const c_char, _: f64, _: *const c_char, user: *mut c_void) -> i32 {
        // SAFETY: what was handed in.
        let both = unsafe { &mut *user.cast::<Both>() };
        both.calls += 1;
        if both.calls == 1 {
            // SAFETY: as the header wants it.
            api().ok(unsafe { (api().srf_context_free)(both.context) });
            assert_eq!(use_context(Handle::NULL), both.context);
        }
        // What is called in here is under no context, what called it still is under that one.
        let mesh = octahedron();
        // SAFETY: as the header wants it.
        api().ok(unsafe { (api().srf_mesh_free)(mesh) });
        0
    }
    let api = api();
    let mesh = octahedron();
    let merger = merger_of(mesh);
    let expected = merged(merger, &params(0.02));
    for _ in 0..5 {
        let mut both = Both { context: context(), calls: 0 };
        let watch = Watch { report: Some(frees), user: (&raw mut both).cast(), cancel: Handle::NULL };
        let mut surface = Handle::NULL;
        // SAFETY: as the header wants it.
        unsafe {
            api.ok((api.srf_context_set_threads)(both.context, 3));
            use_context(both.context);
            api.ok((api.srf_merger_run)(merger, &params(0.02), &watch, &mut surface, std::ptr::null_mut()));
            assert_eq!(bytes(surface), expected);
            api.ok((api.srf_mesh_free)(surface));
        }
        assert!(both.calls > 0);
    }
    // SAFETY: as the header wants it.
    unsafe {
        api.ok((api.srf_merger_free)(merger));
        api.ok((api.srf_mesh_free)(mesh));
    }
}

#[test]
fn each_context_has_its_log() {
    static TOLD: Mutex<Vec<(usize, String)>> = Mutex::new(Vec::new());
    unsafe extern "C" fn log(_: i32, said: *const c_char, user: *mut c_void) {
        TOLD.lock().unwrap().push((user.addr(), text(said)));
    }
    let api = api();
    let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0_f64]];
    let mut mesh = Handle::NULL;
    let triangle = Array::of(&[[0_u32, 1, 2]], U32, 3);
    // SAFETY: as the header wants it.
    api.ok(unsafe { (api.srf_mesh_create)(&Array::of(&positions, F64, 3), &triangle, &mut mesh) });
    let merger = merger_of(mesh);
    let told = || std::mem::take(&mut *TOLD.lock().unwrap());
    let (a, b) = (context(), context());
    // SAFETY: as the header wants it.
    unsafe {
        for (context, number) in [(a, 1), (b, 2)] {
            api.ok((api.srf_context_set_log)(context, Some(log), std::ptr::without_provenance_mut(number)));
        }
        for (context, number) in [(a, 1), (b, 2)] {
            use_context(context);
            merged(merger, &params(0.03));
            let told = told();
            assert!(!told.is_empty() && told.iter().all(|(of, said)| *of == number && !said.is_empty()), "{told:?}");
        }
        use_context(Handle::NULL);
        for end in [(api.srf_context_free)(a), (api.srf_context_free)(b)] {
            api.ok(end);
        }
        api.ok((api.srf_merger_free)(merger));
        api.ok((api.srf_mesh_free)(mesh));
    }
}
