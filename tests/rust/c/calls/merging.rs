//! Merges whose scans change: counted, replaced, removed, and run again from what was kept.

use super::*;

/// A view of the octahedron from so far, moved.
fn view(mesh: Handle, by: f64, name: &CStr) -> Handle {
    let api = api();
    let image = scan(mesh);
    let pose = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, by, 0.0, 0.01 * by, 1.0];
    // SAFETY: as the header wants it.
    unsafe {
        api.ok((api.srf_image_set_pose)(image, &pose));
        api.ok((api.srf_image_set_name)(image, name.as_ptr()));
    }
    image
}

fn count(merger: Handle) -> usize {
    let mut scans = 9;
    // SAFETY: as the header wants it.
    api().ok(unsafe { (api().srf_merger_count)(merger, &mut scans) });
    scans
}

/// Bricks that the last run renewed, and all.
fn renewed(merger: Handle) -> (usize, usize) {
    let (mut renewed, mut all) = (9, 9);
    // SAFETY: as the header wants it.
    api().ok(unsafe { (api().srf_merger_renewed)(merger, &mut renewed, &mut all) });
    (renewed, all)
}

/// A merge of these images.
fn merger_of_images(images: &[Handle]) -> Handle {
    let api = api();
    let mut merger = Handle::NULL;
    // SAFETY: as the header wants it.
    unsafe {
        api.ok((api.srf_merger_create)(&mut merger));
        images.iter().for_each(|&image| api.ok((api.srf_merger_add_image)(merger, image)));
    }
    merger
}

/// The merge of these images that knows nothing.
fn fresh(images: &[Handle]) -> Vec<u8> {
    let merger = merger_of_images(images);
    let found = merged(merger, &params(0.02));
    // SAFETY: as the header wants it.
    api().ok(unsafe { (api().srf_merger_free)(merger) });
    found
}

/// Theorem: whatever was replaced, added and removed, a merge that keeps gives what one gives that knows nothing, and does less.
#[test]
pub(super) fn scans_are_replaced_and_removed_and_the_rest_is_kept() {
    let api = api();
    let mesh = octahedron();
    let mut images: Vec<Handle> =
        (0..6).map(|i| view(mesh, 1.7 * f64::from(i), &CString::new(format!("view {i}")).unwrap())).collect();
    let merger = merger_of_images(&images);
    let again = || merged(merger, &params(0.02));
    // SAFETY: as the header wants it.
    unsafe {
        assert_eq!((count(merger), renewed(merger)), (6, (0, 0)));
        api.ok((api.srf_merger_keep)(merger, 1));
        assert!(again() == fresh(&images));
        let (all, of) = renewed(merger);
        assert!(all == of && of > 50, "{all} of {of}");
        assert!(again() == fresh(&images));
        assert_eq!(renewed(merger), (0, of));

        let moved = view(mesh, 3.42, c"view 2");
        api.ok((api.srf_merger_replace_by_image)(merger, 2, moved));
        api.ok((api.srf_image_free)(std::mem::replace(&mut images[2], moved)));
        assert!(again() == fresh(&images));
        let (some, of) = renewed(merger);
        assert!(some > 0 && 2 * some < of, "{some} of {of}");

        api.ok((api.srf_merger_remove)(merger, 5));
        api.ok((api.srf_image_free)(images.remove(5)));
        assert_eq!(count(merger), 5);
        assert!(again() == fresh(&images));
        api.ok((api.srf_merger_keep)(merger, 0));
        assert_eq!(renewed(merger), (0, 0));
        assert!(again() == fresh(&images));

        // By what is no image.
        api.ok((api.srf_merger_keep)(merger, 1));
        api.ok((api.srf_merger_replace_by_mesh)(merger, 0, mesh, std::ptr::null(), c"view 0".as_ptr()));
        let other = merger_of_images(&images[1..]);
        api.ok((api.srf_merger_add_mesh)(other, mesh, std::ptr::null(), c"view 0".as_ptr()));
        assert!(again() == merged(other, &params(0.02)));
        for end in [(api.srf_merger_free)(merger), (api.srf_merger_free)(other), (api.srf_mesh_free)(mesh)] {
            api.ok(end);
        }
        images.iter().for_each(|&image| api.ok((api.srf_image_free)(image)));
    }
}

#[test]
pub(super) fn scans_that_are_not_there_are_not_replaced() {
    let api = api();
    let mesh = octahedron();
    let (merger, image) = (merger_of(mesh), view(mesh, 0.0, c"view"));
    let before = merged(merger, &params(0.1));
    let (here, none, name) = (std::ptr::null(), std::ptr::null(), c"a".as_ptr());
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        let text = "index must be < 1, the number of scans, got 1";
        api.refused((api.srf_merger_remove)(merger, 1), PARAMETER, text);
        api.refused((api.srf_merger_replace_by_image)(merger, 1, image), PARAMETER, text);
        api.refused((api.srf_merger_replace_by_mesh)(merger, 1, mesh, here, name), PARAMETER, text);
        api.refused((api.srf_merger_replace_by_image)(merger, 0, mesh), HANDLE, "image must be a srf_image");
        api.refused((api.srf_merger_replace_by_mesh)(merger, 0, mesh, &[f64::NAN; 16], name), INPUT, "world_from_mesh");
        api.refused((api.srf_merger_replace_by_source)(merger, 0, none, here, name), NULL, "source must not be NULL");
        api.refused((api.srf_merger_keep)(merger, 2), PARAMETER, "keep must be 0 or 1, got 2");
        api.refused((api.srf_merger_count)(merger, std::ptr::null_mut()), NULL, "out_scans must not be NULL");
        let folder = std::env::temp_dir().join(format!(
            "surfrecon-replaced-{}-{:?}",
            std::process::id(),
            std::thread::current().id()
        ));
        std::fs::create_dir_all(&folder).unwrap();
        let path = CString::new(folder.join("scan.ply").to_str().unwrap()).unwrap();
        api.ok((api.srf_mesh_write_ply)(mesh, path.as_ptr(), 1, std::ptr::null()));
        let mut set = Handle::NULL;
        api.ok((api.srf_scans_open)(&path.as_ptr(), 1, std::ptr::null(), std::ptr::null(), &mut set));
        let replace = api.srf_merger_replace_by_scan;
        api.refused(replace(merger, 0, set, 1), PARAMETER, "of_set must be < 1, the number of scans in the set, got 1");
        api.refused(replace(merger, 1, set, 0), PARAMETER, text);
        assert!(merged(merger, &params(0.1)) == before, "changed in spite of the errors");
        api.ok(replace(merger, 0, set, 0));
        assert!(merged(merger, &params(0.1)) == before, "the same mesh from a file");
        let add = api.srf_merger_add_scan;
        api.refused(add(merger, set, 1), PARAMETER, "of_set must be < 1, the number of scans in the set, got 1");
        api.refused(add(merger, mesh, 0), HANDLE, "scans must be a srf_scans");
        assert_eq!(count(merger), 1);
        api.ok(add(merger, set, 0));
        assert_eq!(count(merger), 2);
        api.ok((api.srf_merger_remove)(merger, 0));
        assert!(merged(merger, &params(0.1)) == before, "the same mesh, added by itself");
        std::fs::remove_dir_all(&folder).unwrap();
        for end in [(api.srf_scans_free)(set), (api.srf_image_free)(image), (api.srf_mesh_free)(mesh)] {
            api.ok(end);
        }
        api.ok((api.srf_merger_free)(merger));
    }
}

/// Theorem: whatever takes a scan out of a merge, what its file is behind is released where the library's functions may be called.
#[test]
fn scans_are_released_where_all_may_be_called() {
    struct Source {
        merger: Handle,
        counted: Option<usize>,
    }
    unsafe extern "C" fn none(_: *mut c_void, _: u64, _: *mut c_void, _: usize, _: *mut usize) -> i32 {
        IO
    }
    unsafe extern "C" fn release(user: *mut c_void) {
        // SAFETY: what was handed in.
        let source = unsafe { &mut *user.cast::<Source>() };
        let mut scans = 0;
        // SAFETY: as the header wants it.
        if unsafe { (api().srf_merger_count)(source.merger, &mut scans) } == OK {
            source.counted = Some(scans);
        }
    }
    let (done, end) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        let api = api();
        let mesh = octahedron();
        // SAFETY: as the header wants it.
        unsafe {
            let replacing: [&dyn Fn(Handle) -> (i32, Option<usize>); 4] = [
                &|merger| ((api.srf_merger_remove)(merger, 0), Some(0)),
                &|merger| {
                    let image = view(mesh, 0.0, c"view");
                    let status = (api.srf_merger_replace_by_image)(merger, 0, image);
                    api.ok((api.srf_image_free)(image));
                    (status, Some(1))
                },
                &|merger| {
                    let name = c"a".as_ptr();
                    ((api.srf_merger_replace_by_mesh)(merger, 0, mesh, std::ptr::null(), name), Some(1))
                },
                &|merger| ((api.srf_merger_free)(merger), None),
            ];
            for replace in replacing {
                let (mut merger, mut folder, mut path) = (Handle::NULL, Handle::NULL, std::ptr::null());
                api.ok((api.srf_merger_create)(&mut merger));
                let mut source = Source { merger, counted: None };
                let user = (&raw mut source).cast();
                api.ok((api.srf_folder_create)(std::ptr::null(), &mut folder));
                let bytes = b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
                api.ok((api.srf_folder_put)(folder, c"a.ply".as_ptr(), bytes.as_ptr().cast(), bytes.len()));
                api.ok((api.srf_folder_path)(folder, c"a.ply".as_ptr(), &mut path));
                let mut scans = Handle::NULL;
                api.ok((api.srf_scans_open)(&path, 1, std::ptr::null(), std::ptr::null(), &mut scans));
                // Beside the file that was opened: it goes with the folder, which the scans keep.
                let behind = FileSource { length: 3, read: Some(none), release: Some(release), user };
                api.ok((api.srf_folder_put_source)(folder, c"b".as_ptr(), &behind));
                api.ok((api.srf_merger_add_scans)(merger, scans));
                for end in [(api.srf_scans_free)(scans), (api.srf_folder_free)(folder)] {
                    api.ok(end);
                }
                let (status, expected) = replace(merger);
                api.ok(status);
                assert_eq!(source.counted, expected);
                if expected.is_some() {
                    api.ok((api.srf_merger_free)(merger));
                }
            }
            api.ok((api.srf_mesh_free)(mesh));
        }
        done.send(()).unwrap();
    });
    let outcome = end.recv_timeout(std::time::Duration::from_secs(60));
    assert!(outcome.is_ok(), "a scan's release waits for ever, or failed: {outcome:?}");
}

#[test]
fn what_a_run_renews_is_not_told_before_it_ends() {
    unsafe extern "C" fn asks(_: *const c_char, _: f64, _: *const c_char, user: *mut c_void) -> i32 {
        // SAFETY: what was handed in.
        let merger = unsafe { *user.cast::<Handle>() };
        let (renewed, all) = (std::ptr::null_mut(), std::ptr::null_mut());
        // SAFETY: as the header wants it.
        let answer = unsafe { (api().srf_merger_renewed)(merger, renewed, all) };
        api().refused(answer, INPUT, "merger is running");
        1
    }
    let api = api();
    let mesh = octahedron();
    let mut merger = merger_of(mesh);
    let watch = Watch { report: Some(asks), user: (&raw mut merger).cast(), cancel: Handle::NULL };
    let mut surface = Handle::NULL;
    // SAFETY: as the header wants it.
    unsafe {
        api.ok((api.srf_merger_keep)(merger, 1));
        let answer = (api.srf_merger_run)(merger, &params(0.02), &watch, &mut surface, std::ptr::null_mut());
        api.refused(answer, CANCELLED, "cancelled");
        for end in [(api.srf_merger_free)(merger), (api.srf_mesh_free)(mesh)] {
            api.ok(end);
        }
    }
}

/// Theorem: who runs a merge that keeps, on however many threads, while others replace its scans, gets what one of its states is.
#[test]
pub(super) fn runs_at_a_time_and_replacing_meanwhile_give_what_one_state_is() {
    let api = api();
    let mesh = octahedron();
    let images = [view(mesh, 0.0, c"a"), view(mesh, 0.7, c"b"), view(mesh, 0.75, c"b")];
    let expected = [[images[0], images[1]], [images[0], images[2]]].map(|images| fresh(&images));
    let merger = merger_of_images(&images[..2]);
    // SAFETY: as the header wants it.
    unsafe {
        api.ok((api.srf_merger_keep)(merger, 1));
        std::thread::scope(|scope| {
            for thread in 0..8 {
                let (images, expected) = (&images, &expected);
                scope.spawn(move || {
                    for round in 0..4 {
                        let image = images[1 + (thread + round) % 2];
                        api.ok((api.srf_merger_replace_by_image)(merger, 1, image));
                        assert!(expected.contains(&merged(merger, &params(0.02))));
                    }
                });
            }
        });
        for end in [(api.srf_merger_free)(merger), (api.srf_mesh_free)(mesh)] {
            api.ok(end);
        }
        images.iter().for_each(|&image| api.ok((api.srf_image_free)(image)));
    }
}

/// Theorem: a merge into a file makes the file that merging and writing make, and leaves nothing else.
#[test]
pub(super) fn more_scans_than_memory_holds_go_into_a_file() {
    let api = api();
    let mesh = octahedron();
    let merger = merger_of(mesh);
    let folder = std::env::temp_dir().join(format!(
        "surfrecon-into-file-{}-{:?}",
        std::process::id(),
        std::thread::current().id()
    ));
    let workspace = folder.join("workspace");
    std::fs::create_dir_all(&workspace).unwrap();
    let c = |path: &std::path::Path| CString::new(path.to_str().unwrap()).unwrap();
    let [at_once, in_pieces, glb] = ["at once.ply", "in pieces.ply", "surface.glb"].map(|name| c(&folder.join(name)));
    let (here, none, said) = (c(&workspace), std::ptr::null::<u8>(), c"{\"command\":\"merge\"}");
    let (mut surface, mut report, mut written) = (Handle::NULL, MergeReport::ZERO, MergeReport::ZERO);
    let files = |of: &std::path::Path| std::fs::read_dir(of).unwrap().count();
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        for report in [&mut report, &mut written] {
            api.ok((api.srf_merge_report_init_sized)(report, size_of::<MergeReport>()));
        }
        let params = params(0.02);
        api.ok((api.srf_merger_run)(merger, &params, none.cast(), &mut surface, &mut report));
        api.ok((api.srf_mesh_write_from)(surface, at_once.as_ptr(), none.cast(), said.as_ptr(), none.cast()));
        let write = |path: &CStr, memory: u64, workspace: &CStr, written: *mut MergeReport| {
            let (path, workspace, said) = (path.as_ptr(), workspace.as_ptr(), said.as_ptr());
            (api.srf_merger_write)(merger, path, &params, memory, workspace, none.cast(), said, none.cast(), written)
        };
        api.ok(write(&in_pieces, 0, &here, &mut written));
        let [one, other] = ["at once.ply", "in pieces.ply"].map(|name| std::fs::read(folder.join(name)).unwrap());
        assert!(one == other && one.len() > 1000 && files(&workspace) == 0 && files(&folder) == 3);
        // Scans, and faces of each kind.
        use merge_report::{FACES_DIRECT, FACES_FILLING, FACES_SETTLED, SCANS};
        for place in [SCANS, FACES_DIRECT, FACES_SETTLED, FACES_FILLING] {
            assert_eq!(written.numbers[place], report.numbers[place]);
        }
        let nothing = std::ptr::null_mut();
        api.refused(write(&glb, 0, &here, nothing), INPUT, "only .ply is written piece by piece");
        api.refused(write(&in_pieces, 0, &in_pieces, nothing), INPUT, "the workspace must be a folder that exists");
        api.refused(write(&in_pieces, 1000, &here, nothing), OUT_OF_MEMORY, "12 MB for each of");
        assert!(std::fs::read(folder.join("in pieces.ply")).unwrap() == one && files(&folder) == 3);
        for end in [(api.srf_merger_free)(merger), (api.srf_mesh_free)(mesh), (api.srf_mesh_free)(surface)] {
            api.ok(end);
        }
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

/// A merge in files, or where that is needed: the surface, whether files were needed, or what it was refused with.
fn in_files(
    merger: Handle,
    voxel: f64,
    only_if_needed: u32,
    memory: u64,
    workspace: *const c_char,
) -> Result<(Vec<u8>, bool), i32> {
    let (api, params) = (api(), params(voxel));
    let (mut surface, mut report) = (Handle::NULL, MergeReport::ZERO);
    let out: *mut MergeReport = &mut report;
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        api.ok((api.srf_merge_report_init_sized)(out, size_of::<MergeReport>()));
        let run = api.srf_merger_run_in_files;
        let status = run(merger, &params, only_if_needed, memory, workspace, std::ptr::null(), &mut surface, out);
        if status != 0 {
            assert!(surface == Handle::NULL);
            return Err(status);
        }
        let found = bytes(surface);
        api.ok((api.srf_mesh_free)(surface));
        Ok((found, report.numbers[merge_report::IN_FILES] == 1))
    }
}

/// Theorem: a merge in files makes the surface of one in memory, and its report says so. Work that is done only where it is needed is not
/// done else, and kept findings serve it.
#[test]
pub(super) fn more_scans_than_memory_holds_are_merged_in_files() {
    let api = api();
    let mesh = octahedron();
    let images = [view(mesh, 0.0, c"a"), view(mesh, 0.7, c"b")];
    let merger = merger_of_images(&images);
    let folder = std::env::temp_dir().join(format!(
        "surfrecon-in-files-{}-{:?}",
        std::process::id(),
        std::thread::current().id()
    ));
    std::fs::create_dir_all(&folder).unwrap();
    let [here, nowhere] =
        [folder.clone(), folder.join("none")].map(|path| CString::new(path.to_str().unwrap()).unwrap());
    let expected = merged(merger, &params(0.02));
    for workspace in [here.as_ptr(), std::ptr::null()] {
        assert!(in_files(merger, 0.02, 0, 0, workspace) == Ok((expected.clone(), true)));
    }
    // SAFETY: as the header wants it.
    unsafe { api.ok((api.srf_merger_keep)(merger, 1)) };
    for _ in 0..2 {
        assert!(in_files(merger, 0.02, 1, 0, here.as_ptr()) == Ok((expected.clone(), false)));
    }
    assert!(renewed(merger).0 == 0 && renewed(merger).1 > 10);
    assert_eq!(in_files(merger, 0.02, 0, 1000, here.as_ptr()), Err(OUT_OF_MEMORY));
    assert_eq!(in_files(merger, 1e-7, 1, 0, here.as_ptr()), Err(OUT_OF_MEMORY));
    // A merge that did not fit is not kept.
    assert_eq!(renewed(merger), (0, 0));
    assert_eq!(in_files(merger, 0.02, 0, 0, nowhere.as_ptr()), Err(INPUT));
    assert_eq!(in_files(merger, 0.02, 2, 0, here.as_ptr()), Err(PARAMETER));
    assert!(std::fs::read_dir(&folder).unwrap().next().is_none());
    std::fs::remove_dir_all(&folder).unwrap();
    // SAFETY: as the header wants it.
    unsafe {
        for end in [(api.srf_merger_free)(merger), (api.srf_mesh_free)(mesh)] {
            api.ok(end);
        }
        images.iter().for_each(|&image| api.ok((api.srf_image_free)(image)));
    }
}

/// Theorem: scans of a set that are placed one by one, while others of it are in a merge already, merge from their files as images at those
/// poses do. Texts of the set stay.
#[test]
fn scans_are_placed_without_being_read() {
    let api = api();
    let folder = tempfile::tempdir().unwrap();
    let list = CString::new(folder.path().join("all.conf").to_str().unwrap()).unwrap();
    let mesh = octahedron();
    let images = [scan(mesh), scan(mesh)];
    let moved = |by: f64| {
        let mut pose: [f64; 16] = std::array::from_fn(|i| if i % 5 == 0 { 1.0 } else { 0.0 });
        pose[12] = by;
        pose
    };
    let none = std::ptr::null();
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        for (image, name) in images.iter().zip([c"a", c"b"]) {
            api.ok((api.srf_image_set_name)(*image, name.as_ptr()));
        }
        api.ok((api.srf_images_write_conf)(images.as_ptr(), 2, list.as_ptr(), 1, none));
        let (mut scans, mut merger) = (Handle::NULL, Handle::NULL);
        api.ok((api.srf_scans_open)([list.as_ptr()].as_ptr(), 1, std::ptr::null(), none, &mut scans));
        api.ok((api.srf_merger_create)(&mut merger));
        let (mut name, mut pose) = (std::ptr::null(), [0.0; 16]);
        api.ok((api.srf_scans_describe)(scans, 0, &mut name, &mut pose));
        let mut read = Vec::new();
        for index in 0..2 {
            let by = 0.1 * index as f64;
            api.ok((api.srf_scans_set_pose)(scans, index, &moved(by)));
            api.ok((api.srf_merger_add_scan)(merger, scans, index));
            let (mut content, [mut image, mut other, mut cloud]) = (0, [Handle::NULL; 3]);
            api.ok((api.srf_scans_read)(scans, index, none, &mut content, &mut image, &mut other, &mut cloud));
            api.ok((api.srf_image_camera)(image, std::ptr::null_mut(), &mut pose));
            assert_eq!(pose, moved(by));
            read.push(image);
        }
        api.ok((api.srf_scans_describe)(scans, 1, std::ptr::null_mut(), &mut pose));
        assert_eq!(pose, moved(0.1));
        // A scan in a merge stays as it was added.
        api.ok((api.srf_scans_set_pose)(scans, 0, std::ptr::null()));
        api.ok((api.srf_scans_set_pose)(scans, 1, &moved(7.0)));
        assert_eq!(text(name), "a");
        assert_eq!(merged(merger, &params(0.05)), {
            let merger = merger_of_images(&read);
            let found = merged(merger, &params(0.05));
            api.ok((api.srf_merger_free)(merger));
            found
        });
        let mut skewed = moved(0.0);
        skewed[0] = 2.0;
        api.refused((api.srf_scans_set_pose)(scans, 0, &skewed), INPUT, "world_from_sensor must be rigid");
        api.refused((api.srf_scans_set_pose)(scans, 2, &moved(0.0)), PARAMETER, "index must be < 2, got 2");
        for end in [(api.srf_merger_free)(merger), (api.srf_scans_free)(scans), (api.srf_mesh_free)(mesh)] {
            api.ok(end);
        }
        images.iter().chain(&read).for_each(|&image| api.ok((api.srf_image_free)(image)));
    }
}
