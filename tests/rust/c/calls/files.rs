//! Files read and written, with their options, and the log.

use super::*;

#[test]
pub(super) fn formats_are_those_of_the_core() {
    let api = api();
    let known = surfrecon::import::formats();
    let mut count = 0;
    // SAFETY: as the header wants it; the texts are static.
    unsafe {
        api.ok((api.srf_format_count)(&mut count));
        assert_eq!(count, known.len());
        for (index, format) in known.iter().enumerate() {
            let (mut name, mut endings, mut is_side_file) = (std::ptr::null(), std::ptr::null(), 7);
            api.ok((api.srf_format)(index, &mut name, &mut endings, &mut is_side_file));
            let text = |text| CStr::from_ptr(text).to_str().unwrap();
            let expected = (format.name, format.extensions.join(" "), u32::from(format.is_side_file()));
            assert_eq!((text(name), text(endings).to_owned(), is_side_file), expected);
        }
        let (mut name, null) = (std::ptr::null(), std::ptr::null_mut());
        api.ok((api.srf_format)(0, &mut name, null, std::ptr::null_mut()));
        api.refused((api.srf_format)(count, &mut name, null, std::ptr::null_mut()), PARAMETER, "the number of formats");
    }
}

#[test]
pub(super) fn files_go_out_and_come_back() {
    let api = api();
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| CString::new(folder.path().join(name).to_str().unwrap()).unwrap();
    let mesh = octahedron();
    let (ply, glb) = (path("mesh.ply"), path("mesh.glb"));
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        let none = std::ptr::null();
        api.ok((api.srf_mesh_write_ply)(mesh, ply.as_ptr(), 2, none));
        api.ok((api.srf_mesh_write_glb)(mesh, glb.as_ptr(), std::ptr::null(), 0.001, 1, none));
        assert!(std::fs::metadata(folder.path().join("mesh.glb")).unwrap().len() > 100);
        let paths = [ply.as_ptr()];
        let mut scans = Handle::NULL;
        api.ok((api.srf_scans_open)(paths.as_ptr(), 1, std::ptr::null(), std::ptr::null(), &mut scans));
        let (mut count, mut notes) = (0, 9);
        api.ok((api.srf_scans_count)(scans, &mut count, &mut notes));
        assert_eq!(count, 1);
        let (mut name, mut pose) = (std::ptr::null(), [0.0; 16]);
        api.ok((api.srf_scans_describe)(scans, 0, &mut name, &mut pose));
        assert_eq!((text(name).as_str(), pose[5]), ("mesh", 1.0));
        let (mut content, mut image, mut read, mut cloud) = (0, Handle::NULL, Handle::NULL, Handle::NULL);
        api.ok((api.srf_scans_read)(scans, 0, std::ptr::null(), &mut content, &mut image, &mut read, &mut cloud));
        assert_eq!((content, image, cloud), (2, Handle::NULL, Handle::NULL));
        assert!(bytes(read) == bytes(mesh));
        let merger = merger_of(mesh);
        api.ok((api.srf_merger_add_scans)(merger, scans));
        let seen = scan(mesh);
        api.ok((api.srf_merger_add_image)(merger, seen));
        assert!(merged(merger, &params(0.1)).len() > 1000);
        api.refused((api.srf_scans_note)(scans, notes, &mut name), PARAMETER, "index must be <");
        for end in [(api.srf_mesh_free)(read), (api.srf_scans_free)(scans), (api.srf_merger_free)(merger)] {
            api.ok(end);
        }
        api.ok((api.srf_image_free)(seen));
        let missing = path("missing.ply");
        api.refused(
            (api.srf_scans_open)([missing.as_ptr()].as_ptr(), 1, std::ptr::null(), std::ptr::null(), &mut scans),
            IO,
            "missing.ply",
        );
        api.refused(
            (api.srf_scans_open)([std::ptr::null()].as_ptr(), 1, std::ptr::null(), std::ptr::null(), &mut scans),
            NULL,
            "paths[0] must not be NULL",
        );
        let nowhere = path("no folder/mesh.ply");
        api.refused((api.srf_mesh_write_ply)(mesh, nowhere.as_ptr(), 1, none), IO, "there is no folder");
        api.refused((api.srf_mesh_write_ply)(mesh, c"".as_ptr(), 1, none), INPUT, "path must not be empty");
        api.ok((api.srf_mesh_free)(mesh));
    }
}

/// Opens one file and reads its only scan: what it holds, and its handle.
fn opened(path: &std::path::Path, options: *const ReadOptions) -> (u32, Handle) {
    let api = api();
    let path = CString::new(path.to_str().unwrap()).unwrap();
    let (mut scans, mut content) = (Handle::NULL, 0);
    let mut handles = [Handle::NULL; 3];
    // SAFETY: as the header wants it.
    unsafe {
        api.ok((api.srf_scans_open)([path.as_ptr()].as_ptr(), 1, options, std::ptr::null(), &mut scans));
        let [image, mesh, cloud] = &mut handles;
        api.ok((api.srf_scans_read)(scans, 0, std::ptr::null(), &mut content, image, mesh, cloud));
        api.ok((api.srf_scans_free)(scans));
    }
    (content, *handles.iter().find(|handle| **handle != Handle::NULL).unwrap())
}

#[test]
pub(super) fn options_say_what_files_do_not() {
    let api = api();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.pgm");
    std::fs::write(&path, "P2 3 2 65535\n1000 2000 3000\n0 500 7\n").unwrap();
    let mut options = ReadOptions::ZERO;
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        api.ok((api.srf_read_options_init_sized)(&mut options, size_of_val(&options)));
        let samples = |options: &ReadOptions| {
            let (content, image) = opened(&path, options);
            assert_eq!(content, 1);
            let (mut view, mut projection) = (Array::EMPTY, Projection { kind: 0, ..DEPTH });
            api.ok((api.srf_image_samples)(image, &mut view));
            api.ok((api.srf_image_camera)(image, &mut projection, std::ptr::null_mut()));
            let values: Vec<f64> = view.bytes().chunks(8).map(|b| f64::from_ne_bytes(b.try_into().unwrap())).collect();
            api.ok((api.srf_image_free)(image));
            (values, projection)
        };
        let (values, projection) = samples(&options);
        assert_eq!((values, projection.kind), (vec![1000.0, 2000.0, 3000.0, 0.0, 500.0, 7.0], 1));
        options.set_f64(6, 0.5);
        options.set_f64(7, 10.0);
        options.set_f64(8, 30.0);
        options.set_f64(9, 3000.0);
        let (values, projection) = samples(&options);
        assert!(values[2].is_nan() && values[0] == 510.0 && values[5] == 13.5, "{values:?}");
        assert_eq!(projection.numbers, [0.0, 30.0, 30.0, -30.0]);

        api.ok((api.srf_read_options_init_sized)(&mut options, size_of_val(&options)));
        (0..4).zip([60.0, 61.0, 1.0, 0.5]).for_each(|(i, number)| options.set_f64(i, number));
        (options.numbers[4], options.numbers[5]) = (3, 2);
        let (values, projection) = samples(&options);
        assert_eq!((projection.kind, projection.numbers), (2, [60.0, 61.0, 1.0, 0.5]));
        assert!(values[0] == 1.0 && values[3].is_nan(), "{values:?}");
        options.numbers[10] = 2;
        assert_eq!(samples(&options).1.kind, 3, "distances along the rays");

        let text = CString::new(path.to_str().unwrap()).unwrap();
        let mut scans = Handle::NULL;
        let mut open = |options: &ReadOptions| {
            (api.srf_scans_open)([text.as_ptr()].as_ptr(), 1, options, std::ptr::null(), &mut scans)
        };
        let wrong = |change: &dyn Fn(&mut ReadOptions)| {
            let mut options = options;
            change(&mut options);
            options
        };
        let no_camera = |o: &mut ReadOptions| (0..4).for_each(|i| o.set_f64(i, 0.0));
        api.refused(open(&wrong(&no_camera)), PARAMETER, "camera_size goes with intrinsics");
        let text = "pixels must be one of 1 (auto), 2 (number), 3 (terrain_rgb), 4 (terrarium), got 9";
        api.refused(open(&wrong(&|o| o.numbers[11] = 9)), PARAMETER, text);
        api.refused(open(&wrong(&|o| o.numbers[10] = 0)), PARAMETER, "depth must be one of 1 (planar), 2 (ray), got 0");
        api.refused(open(&wrong(&|o| o.numbers[13] = 2)), PARAMETER, "allow_outside must be 0 or 1, got 2");
        api.refused(open(&wrong(&|o| o.set_f64(6, 0.0))), PARAMETER, "scale must be a finite number > 0, got 0");
        api.refused(open(&wrong(&|o| o.set_f64(0, 0.0))), INPUT, "focal");
        assert_eq!(scans, Handle::NULL);
    }
}

#[test]
pub(super) fn everything_is_written_and_comes_back() {
    let api = api();
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let c = |name: &str| CString::new(path(name).to_str().unwrap()).unwrap();
    let mesh = octahedron();
    let (image, mut cloud) = (scan(mesh), Handle::NULL);
    let defaults = std::ptr::null();
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        let none = std::ptr::null();
        let mut options = WriteOptions::ZERO;
        api.ok((api.srf_write_options_init_sized)(&mut options, size_of_val(&options)));
        for ending in ["ply", "glb", "obj", "stl", "3mf"] {
            api.ok((api.srf_mesh_write)(mesh, c(&format!("any.{ending}")).as_ptr(), &options, none));
            let (content, read) = opened(&path(&format!("any.{ending}")), defaults);
            assert_eq!(content, 2, "{ending}");
            api.ok((api.srf_mesh_free)(read));
        }
        for name in ["never.ply", "never.glb", "never.OBJ", "no folder/never.stl"] {
            api.ok((api.srf_check_mesh_file)(c(name).as_ptr(), std::ptr::null()));
            assert!(!folder.path().join(name).exists());
        }
        let answer = (api.srf_check_mesh_file)(c("any.las").as_ptr(), std::ptr::null());
        api.refused(answer, INPUT, "any.las: the name must end in .ply, .glb, .stl, .3mf or .obj");
        let answer = (api.srf_mesh_write)(mesh, c("any.las").as_ptr(), std::ptr::null(), none);
        api.refused(answer, INPUT, "the name must end in .ply, .glb, .stl, .3mf or .obj");
        options.numbers[1] = 3;
        let answer = (api.srf_mesh_write)(mesh, c("any.glb").as_ptr(), &options, none);
        api.refused(answer, PARAMETER, "up must be one of 1 (y), 2 (z), got 3");
        api.ok((api.srf_mesh_write_obj)(mesh, c("mesh.obj").as_ptr(), none));
        api.ok((api.srf_mesh_write_stl)(mesh, c("mesh.stl").as_ptr(), none));
        for name in ["mesh.obj", "mesh.stl"] {
            let (content, read) = opened(&path(name), defaults);
            // STL has no indices: the vertices come back in another order.
            let same = name == "mesh.stl" && bytes(read).len() == bytes(mesh).len() || bytes(read) == bytes(mesh);
            assert!(content == 2 && same, "{name}");
            api.ok((api.srf_mesh_free)(read));
        }
        let levels = [mesh, mesh];
        api.ok((api.srf_meshes_write_glb_levels)(levels.as_ptr(), 2, c("lod.glb").as_ptr(), none.cast(), 1.0, 0, none));
        let (content, read) = opened(&path("lod.glb"), defaults);
        assert!(content == 2 && bytes(read) == bytes(mesh), "the finest");
        api.ok((api.srf_mesh_free)(read));
        let nothing =
            (api.srf_meshes_write_glb_levels)(levels.as_ptr(), 0, c("n.glb").as_ptr(), none.cast(), 1.0, 0, none);
        api.refused(nothing, PARAMETER, "count is 0");
        api.ok((api.srf_image_to_cloud)(image, std::ptr::null(), &mut cloud));
        api.ok((api.srf_cloud_write_ply)(cloud, c("cloud.ply").as_ptr(), 2, none));
        let (content, read) = opened(&path("cloud.ply"), defaults);
        let positions = |cloud: Handle| {
            let mut view = Array::EMPTY;
            let unwanted = std::ptr::null_mut;
            api.ok((api.srf_cloud_arrays)(cloud, &mut view, unwanted(), unwanted(), unwanted()));
            view.bytes()
        };
        assert!(content == 3 && positions(read) == positions(cloud) && !positions(read).is_empty());
        api.ok((api.srf_cloud_free)(read));

        let images = [image];
        let mut valid = 0;
        api.ok((api.srf_image_size)(image, std::ptr::null_mut(), std::ptr::null_mut(), &mut valid));
        api.ok((api.srf_images_write_ptx)(images.as_ptr(), 1, c("scan.ptx").as_ptr(), none));
        api.ok((api.srf_images_write_e57)(images.as_ptr(), 1, c("scan.e57").as_ptr(), none));
        let refused = (api.srf_images_write_conf)(images.as_ptr(), 1, c("scans.ply").as_ptr(), 1, none);
        api.refused(refused, INPUT, "the name must end in .conf");
        let refused = (api.srf_images_write_conf)(images.as_ptr(), 1, c("scans.conf").as_ptr(), 1, none);
        api.refused(refused, INPUT, "a name of its own that can be a file's");
        for name in ["scan.ptx", "scan.e57"] {
            let (content, read) = opened(&path(name), defaults);
            let mut there = 0;
            api.ok((api.srf_image_size)(read, std::ptr::null_mut(), std::ptr::null_mut(), &mut there));
            assert_eq!((content, there), (1, valid), "{name}");
            // It has the file's name now.
            let named = [read];
            api.ok((api.srf_images_write_conf)(named.as_ptr(), 1, c("scans.conf").as_ptr(), 3, none));
            let (content, again) = opened(&path("scans.conf"), defaults);
            api.ok((api.srf_image_size)(again, std::ptr::null_mut(), std::ptr::null_mut(), &mut there));
            assert_eq!((content, there), (1, valid), "{name}");
            api.ok((api.srf_image_free)(again));
            api.ok((api.srf_image_free)(read));
        }
        let kinds = [image, mesh];
        let answer = (api.srf_images_write_ptx)(kinds.as_ptr(), 2, c("no.ptx").as_ptr(), none);
        api.refused(answer, HANDLE, "images[1] must be a srf_image, got a srf_mesh");
        api.refused((api.srf_images_write_e57)(kinds.as_ptr(), 0, c("no.e57").as_ptr(), none), PARAMETER, "count is 0");
        let answer = (api.srf_images_write_conf)(images.as_ptr(), 1, c("no.conf").as_ptr(), 7, none);
        api.refused(answer, PARAMETER, "encoding must be a value of srf_encoding, 1 to 3, got 7");
        assert!(!path("no.ptx").exists());
        api.ok((api.srf_cloud_free)(cloud));
        api.ok((api.srf_image_free)(image));
        api.ok((api.srf_mesh_free)(mesh));
    }
}

#[test]
pub(super) fn writing_reports_and_can_be_cancelled() {
    let api = api();
    let folder = tempfile::tempdir().unwrap();
    let path = CString::new(folder.path().join("mesh.obj").to_str().unwrap()).unwrap();
    let positions: Vec<[f64; 3]> = (0..3_000_000).map(|i| [f64::from(i) / 7.0, 1.0 / 3.0, 0.1]).collect();
    let mut mesh = Handle::NULL;
    let mut asked = 0_u32;
    let watch = Watch { report: Some(cancel), user: (&raw mut asked).cast(), cancel: Handle::NULL };
    // SAFETY: as the header wants it.
    unsafe {
        let none: [[u32; 3]; 1] = [[0, 1, 2]];
        api.ok((api.srf_mesh_create)(&Array::of(&positions, F64, 3), &Array::of(&none, U32, 3), &mut mesh));
        api.refused((api.srf_mesh_write_obj)(mesh, path.as_ptr(), &watch), CANCELLED, "cancelled");
        assert_eq!((asked, std::fs::read_dir(folder.path()).unwrap().count()), (1, 0));
        api.ok((api.srf_mesh_write_obj)(mesh, path.as_ptr(), std::ptr::null()));
        let (mut scans, mut content) = (Handle::NULL, 0);
        let mut read = [Handle::NULL; 3];
        api.ok((api.srf_scans_open)([path.as_ptr()].as_ptr(), 1, std::ptr::null(), std::ptr::null(), &mut scans));
        let [a, b, c] = &mut read;
        let answer = (api.srf_scans_read)(scans, 0, &watch, &mut content, a, b, c);
        api.refused(answer, CANCELLED, "cancelled");
        assert_eq!((asked, content, read), (2, 0, [Handle::NULL; 3]));
        api.ok((api.srf_scans_free)(scans));
        api.ok((api.srf_mesh_free)(mesh));
    }
}

unsafe extern "C" fn count_messages(level: i32, said: *const c_char, user: *mut c_void) {
    assert!(level == 1 || level == 2);
    // SAFETY: the list handed in.
    unsafe { (*user.cast::<std::sync::Mutex<Vec<String>>>()).lock().unwrap().push(text(said)) };
}

#[test]
pub(super) fn the_log_hears_of_gaps() {
    let api = api();
    let said = Box::leak(Box::new(std::sync::Mutex::new(Vec::<String>::new())));
    let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0_f64]];
    let mut mesh = Handle::NULL;
    // SAFETY: as the header wants it.
    unsafe {
        api.ok((api.srf_set_log)(Some(count_messages), (said as *mut std::sync::Mutex<Vec<String>>).cast()));
        let triangle = Array::of(&[[0_u32, 1, 2]], U32, 3);
        api.ok((api.srf_mesh_create)(&Array::of(&positions, F64, 3), &triangle, &mut mesh));
        let merger = merger_of(mesh);
        merged(merger, &params(0.03));
        api.ok((api.srf_set_log)(None, std::ptr::null_mut()));
        assert!(said.get_mut().unwrap().iter().any(|text| text.contains("1 open boundary loop:")), "{said:?}");
        api.ok((api.srf_merger_free)(merger));
        api.ok((api.srf_mesh_free)(mesh));
    }
}
