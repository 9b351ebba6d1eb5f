//! Contexts, each with threads, a limit on memory and a log of its own.

use std::sync::Mutex;

use super::*;

fn context() -> Handle {
    let mut context = Handle::NULL;
    // SAFETY: as the header wants it.
    api().ok(unsafe { (api().srf_context_create)(&mut context) });
    context
}

/// Has this thread use a context. Returns what it used before.
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
        api.ok((api.srf_context_set_memory_limit)(a, u64::MAX));
        assert_eq!((threads(a), limit(a), threads(b), limit(b)), (3, u64::MAX, 0, 0));
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
        // A context that was used and is freed is still told, and refused.
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

/// Theorem: what is taken under a context is on its account until it is given back, in whatever was made under another one, and by
/// whomever.
#[test]
pub(super) fn what_was_taken_is_given_back_where_it_was_taken() {
    let api = api();
    let (a, b) = (context(), context());
    use_context(a);
    let (mut folder, mut path) = (Handle::NULL, std::ptr::null());
    let (status, mesh) = large(3);
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        api.ok(status);
        api.ok((api.srf_folder_create)(std::ptr::null(), &mut folder));
        api.ok((api.srf_folder_path)(folder, c"m.ply".as_ptr(), &mut path));
        let of_a = held(a);
        let marks = vec![1.0_f32; 125_000];
        for round in 0..4 {
            use_context(b);
            api.ok((api.srf_mesh_write_ply)(mesh, path, 1, std::ptr::null()));
            api.ok((api.srf_mesh_set_attribute)(mesh, 1, c"mark".as_ptr(), &Array::of(&marks, F32, 1)));
            // The text of an error is no part of what calls hold.
            for _ in 0..1000 {
                api.refused((api.srf_context_set_threads)(b, 1025), PARAMETER, "threads must be");
            }
            let filled = held(b);
            assert!((2_000_000..4_000_000).contains(&filled), "{filled}");
            use_context(if round % 2 == 0 { Handle::NULL } else { a });
            api.ok((api.srf_folder_remove)(folder, c"m.ply".as_ptr(), std::ptr::null_mut()));
            api.ok((api.srf_mesh_set_attribute)(mesh, 1, c"mark".as_ptr(), std::ptr::null()));
            assert!(held(b) < 5000 && held(a).abs_diff(of_a) < 5000, "{} and {} of {of_a}", held(b), held(a));
        }
        use_context(Handle::NULL);
        api.ok((api.srf_mesh_free)(mesh));
        api.ok((api.srf_folder_free)(folder));
        assert!(held(a) < 5000, "{}", held(a));
        for end in [(api.srf_context_free)(a), (api.srf_context_free)(b)] {
            api.ok(end);
        }
    }
}

/// Theorem: no array of 24 MB passes a limit of 5 MB, whatever calls begin and end meanwhile.
#[test]
pub(super) fn no_call_passes_the_limit_as_others_end() {
    let api = api();
    let context = context();
    // SAFETY: as the header wants it.
    api.ok(unsafe { (api.srf_context_set_memory_limit)(context, 5_000_000) });
    let end = std::time::Instant::now() + std::time::Duration::from_millis(700);
    std::thread::scope(|scope| {
        for _ in 0..3 {
            scope.spawn(|| {
                use_context(context);
                while std::time::Instant::now() < end {
                    held(context);
                }
            });
        }
        for _ in 0..2 {
            scope.spawn(|| {
                use_context(context);
                while std::time::Instant::now() < end {
                    assert_eq!(large(24), (OUT_OF_MEMORY, Handle::NULL));
                }
            });
        }
    });
    // SAFETY: as the header wants it.
    api.ok(unsafe { (api.srf_context_free)(context) });
}

/// Theorem: a function that uses another context and puts back the former one is under that of its call again. It is so on whatever thread
/// of the library it is called, and whether that one was freed meanwhile or not.
#[test]
pub(super) fn a_function_of_a_call_puts_its_context_back() {
    struct Made {
        of_call: Handle,
        other: Handle,
        formers: Mutex<Vec<Handle>>,
        meshes: Mutex<Vec<Handle>>,
    }
    unsafe extern "C" fn make(user: *mut c_void, out: *mut Handle) -> i32 {
        // SAFETY: what was handed in.
        let made = unsafe { &*user.cast::<Made>() };
        let former = use_context(made.other);
        {
            let mut formers = made.formers.lock().unwrap();
            if formers.len() == 4 {
                // SAFETY: as the header wants it.
                api().ok(unsafe { (api().srf_context_free)(made.of_call) });
            }
            formers.push(former);
        }
        assert_eq!(use_context(former), made.other);
        let (status, mesh) = large(2);
        made.meshes.lock().unwrap().push(mesh);
        let plane = Projection { kind: 1, reserved: 0, numbers: [0.0, 0.0, 0.1, -0.1] };
        let (samples, null) = ([0.0_f64; 16], std::ptr::null());
        // SAFETY: as the header wants it.
        unsafe {
            api().ok(status);
            (api().srf_image_create)(4, 4, &plane, &Array::of(&samples, F64, 1), null, std::ptr::null(), out)
        }
    }
    let api = api();
    for threads in [1, 2] {
        let (of_call, other) = (context(), context());
        let made = Made { of_call, other, formers: Mutex::default(), meshes: Mutex::default() };
        let source = ImageSource { make: Some(make), user: std::ptr::from_ref(&made).cast_mut().cast() };
        let (mut merger, mut surface) = (Handle::NULL, Handle::NULL);
        // SAFETY: as the header wants it.
        unsafe {
            api.ok((api.srf_context_set_threads)(of_call, threads));
            use_context(of_call);
            api.ok((api.srf_merger_create)(&mut merger));
            for name in [c"a", c"b", c"c", c"d"] {
                api.ok((api.srf_merger_add_source)(merger, &source, std::ptr::null(), name.as_ptr()));
            }
            let status =
                (api.srf_merger_run)(merger, &params(0.1), std::ptr::null(), &mut surface, std::ptr::null_mut());
            api.ok(status);
            assert_eq!(use_context(Handle::NULL), of_call);
            let formers = made.formers.lock().unwrap();
            assert!(formers.len() > 5 && formers.iter().all(|former| *former == of_call), "{formers:?}");
            assert!(held(other) < 10_000, "{}", held(other));
            for mesh in made.meshes.lock().unwrap().drain(..) {
                api.ok((api.srf_mesh_free)(mesh));
            }
            for end in [(api.srf_mesh_free)(surface), (api.srf_merger_free)(merger), (api.srf_context_free)(other)] {
                api.ok(end);
            }
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
        // A call in here is under no context, its caller still is under that one.
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
        // This thread still uses the one that is freed: its log is told nothing more.
        api.ok((api.srf_context_free)(b));
        merged(merger, &params(0.03));
        assert_eq!(told(), []);
        assert_eq!(use_context(Handle::NULL), b);
        api.ok((api.srf_context_free)(a));
        api.ok((api.srf_merger_free)(merger));
        api.ok((api.srf_mesh_free)(mesh));
    }
}
