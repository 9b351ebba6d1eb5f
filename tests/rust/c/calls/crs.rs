//! Coordinate reference systems from files through results to files, and what files say of where they are from.

use super::*;

type Ask<'a> = &'a dyn Fn(*mut c_char, usize, *mut usize) -> i32;

/// A text that is asked for its length first.
fn told(ask: Ask<'_>) -> String {
    let api = api();
    let mut length = usize::MAX;
    api.ok(ask(std::ptr::null_mut(), 0, &mut length));
    let mut room = vec![b'x'; length + 2];
    api.ok(ask(room.as_mut_ptr().cast(), length + 1, &mut length));
    assert_eq!((room.pop(), room.pop()), (Some(b'x'), Some(0)));
    if length > 0 {
        api.refused(ask(room.as_mut_ptr().cast(), length, &mut length), PARAMETER, "capacity must be at least");
    }
    String::from_utf8(room).unwrap()
}

#[test]
pub(super) fn systems_go_from_files_through_results_to_files() {
    let api = api();
    let folder = tempfile::tempdir().unwrap();
    let c = |name: &str| CString::new(folder.path().join(name).to_str().unwrap()).unwrap();
    let mesh = octahedron();
    let (none, null) = (std::ptr::null(), std::ptr::null_mut());
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        let of_mesh = |mesh: Handle| told(&|text, room, length| (api.srf_mesh_crs)(mesh, text, room, length));
        let of_scans =
            |scans: Handle, at| told(&|text, room, length| (api.srf_scans_crs)(scans, at, text, room, length));
        let said =
            |path: &CStr| told(&|text, room, length| (api.srf_file_provenance)(path.as_ptr(), text, room, length));
        assert_eq!(of_mesh(mesh), "");
        api.refused((api.srf_mesh_set_crs)(mesh, c"\x01".as_ptr()), INPUT, "not the text of a coordinate reference");
        api.refused((api.srf_mesh_crs)(mesh, null, 0, std::ptr::null_mut()), NULL, "out_length");
        api.ok((api.srf_mesh_set_crs)(mesh, c"EPSG:25832".as_ptr()));
        assert_eq!(of_mesh(mesh), "EPSG:25832");
        let made = c"{\"by\":\"a test\",\"of\":[1,2]}";
        for name in ["a.ply", "a.obj", "a.glb"] {
            let path = c(name);
            api.ok((api.srf_mesh_write_from)(mesh, path.as_ptr(), std::ptr::null(), made.as_ptr(), none));
            assert_eq!(said(&path), made.to_str().unwrap(), "{name}");
        }
        let refused = (api.srf_mesh_write_from)(mesh, c("b.ply").as_ptr(), std::ptr::null(), c"[]".as_ptr(), none);
        api.refused(refused, INPUT, "provenance must be a JSON object");
        api.ok((api.srf_mesh_write)(mesh, c("c.ply").as_ptr(), std::ptr::null(), none));
        assert_eq!(said(&c("c.ply")), "");
        api.ok((api.srf_mesh_set_crs)(mesh, c"EPSG:25833".as_ptr()));
        api.ok((api.srf_mesh_write)(mesh, c("other.ply").as_ptr(), std::ptr::null(), none));
        // Of a set, of a result, and of two that disagree.
        let paths = [c("a.ply"), c("other.ply")];
        let paths = paths.each_ref().map(|path| path.as_ptr());
        let mut scans = Handle::NULL;
        api.ok((api.srf_scans_open)(paths.as_ptr(), 2, std::ptr::null(), none, &mut scans));
        assert_eq!((of_scans(scans, 0).as_str(), of_scans(scans, 1).as_str()), ("EPSG:25832", "EPSG:25833"));
        let mut length = 0;
        let all = (api.srf_scans_crs)(scans, usize::MAX, null, 0, &mut length);
        api.refused(all, INPUT, "a is in EPSG:25832, other in EPSG:25833: transform one of them first");
        api.refused((api.srf_scans_crs)(scans, 2, null, 0, &mut length), PARAMETER, "index must be < 2");
        let mut merger = Handle::NULL;
        api.ok((api.srf_merger_create)(&mut merger));
        api.ok((api.srf_merger_add_scans)(merger, scans));
        let mut merged = Handle::NULL;
        let refused = (api.srf_merger_run)(merger, &params(0.1), none, &mut merged, std::ptr::null_mut());
        api.refused(refused, INPUT, "transform one of them first");
        api.ok((api.srf_merger_free)(merger));
        api.ok((api.srf_scans_set_crs)(scans, 1, c"EPSG:25832".as_ptr()));
        assert_eq!(of_scans(scans, usize::MAX), "EPSG:25832");
        api.ok((api.srf_merger_create)(&mut merger));
        api.ok((api.srf_merger_add_scans)(merger, scans));
        api.ok((api.srf_merger_run)(merger, &params(0.1), none, &mut merged, std::ptr::null_mut()));
        assert_eq!(of_mesh(merged), "EPSG:25832");
        api.ok((api.srf_scans_set_crs)(scans, usize::MAX, std::ptr::null()));
        assert_eq!(of_scans(scans, usize::MAX), "");
        // Scaled it is in none.
        let twice = [2.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        api.ok((api.srf_mesh_transform)(merged, &twice));
        assert_eq!(of_mesh(merged), "");

        let image = scan(mesh);
        let of_image = told(&|text, room, length| (api.srf_image_crs)(image, text, room, length));
        assert_eq!(of_image, "");
        api.ok((api.srf_image_set_crs)(image, c"EPSG:25832".as_ptr()));
        let images = [image];
        let path = c("a.e57");
        api.ok((api.srf_images_write_e57_from)(images.as_ptr(), 1, path.as_ptr(), made.as_ptr(), none));
        assert_eq!(said(&path), made.to_str().unwrap());
        let mut again = Handle::NULL;
        api.ok((api.srf_scans_open)([path.as_ptr()].as_ptr(), 1, std::ptr::null(), none, &mut again));
        assert_eq!(of_scans(again, 0), "EPSG:25832");
        let mut cloud = Handle::NULL;
        api.ok((api.srf_image_to_cloud)(image, none, &mut cloud));
        let of_cloud = || told(&|text, room, length| (api.srf_cloud_crs)(cloud, text, room, length));
        assert_eq!(of_cloud(), "EPSG:25832");
        api.ok((api.srf_cloud_set_crs)(cloud, std::ptr::null()));
        assert_eq!(of_cloud(), "");
        for end in [(api.srf_scans_free)(scans), (api.srf_scans_free)(again), (api.srf_cloud_free)(cloud)] {
            api.ok(end);
        }
        for end in [(api.srf_image_free)(image), (api.srf_mesh_free)(mesh), (api.srf_mesh_free)(merged)] {
            api.ok(end);
        }
        api.ok((api.srf_merger_free)(merger));
    }
}
