//! Selections, the dominant plane, true size and ground.

use super::*;

/// A box along the axes as the pose that makes it of the cube from -1 to 1.
fn cuboid(centre: [f64; 3], half: [f64; 3]) -> [f64; 16] {
    let [x, y, z] = half;
    let [a, b, c] = centre;
    [x, 0.0, 0.0, 0.0, 0.0, y, 0.0, 0.0, 0.0, 0.0, z, 0.0, a, b, c, 1.0]
}

fn level() -> Plane {
    let mut plane = Plane::ZERO;
    // SAFETY: as the header wants it.
    api().ok(unsafe { (api().srf_plane_init_sized)(&mut plane, size_of_val(&plane)) });
    plane
}

fn valid(image: Handle) -> usize {
    let (mut rows, mut cols, mut valid) = (0, 0, 0);
    // SAFETY: as the header wants it.
    api().ok(unsafe { (api().srf_image_size)(image, &mut rows, &mut cols, &mut valid) });
    valid
}

#[test]
pub(super) fn regions_part_images_meshes_clouds_and_scans_of_files() {
    let api = api();
    let mesh = octahedron();
    let folder = tempfile::tempdir().unwrap();
    let path = CString::new(folder.path().join("mesh.ply").to_str().unwrap()).unwrap();
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        let (none, null) = (std::ptr::null(), std::ptr::null());
        let mut region = Handle::NULL;
        let (kept, rest) = (scan(mesh), scan(mesh));
        let all = valid(kept);
        api.ok((api.srf_region_box)(&cuboid([1.0, 0.0, 4.0], [1.0, 9.0, 9.0]), &mut region));
        let (mut gone, mut also) = (0, 0);
        api.ok((api.srf_image_select)(kept, region, 1, none, &mut gone));
        api.ok((api.srf_image_select)(rest, region, 0, none, &mut also));
        assert!(gone + also == all && valid(kept) == also && valid(rest) == gone && gone > 0 && also > 0);
        api.refused((api.srf_image_select)(rest, region, 2, none, &mut also), PARAMETER, "keep must be 0 or 1, got 2");
        api.ok((api.srf_mesh_write_ply)(mesh, path.as_ptr(), 1, none));
        let mut scans = Handle::NULL;
        api.ok((api.srf_scans_open)([path.as_ptr()].as_ptr(), 1, std::ptr::null(), none, &mut scans));
        api.ok((api.srf_scans_select)(scans, usize::MAX, region, 1));
        api.refused((api.srf_scans_select)(scans, 1, region, 1), PARAMETER, "index must be < 1, got 1");
        // Five of the six corners, with the four faces between these.
        api.ok((api.srf_mesh_select)(mesh, null, region, 1, none, &mut gone));
        assert_eq!(gone, 1);
        let (mut content, mut image, mut read, mut cloud) = (0, Handle::NULL, Handle::NULL, Handle::NULL);
        api.ok((api.srf_scans_read)(scans, 0, none, &mut content, &mut image, &mut read, &mut cloud));
        assert!(bytes(read) == bytes(mesh) && bytes(mesh).len() == 5 * 24 + 4 * 12);
        api.ok((api.srf_region_free)(region));
        let points = [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 2.0_f64]];
        api.ok((api.srf_cloud_create)(
            &Array::of(&points, F64, 3),
            null.cast(),
            null.cast(),
            null.cast(),
            null,
            &mut cloud,
        ));
        let plane = Plane {
            numbers: {
                let mut n = level().numbers;
                n[6] = 1.0_f64.to_bits();
                n
            },
            ..level()
        };
        api.ok((api.srf_region_below)(&plane, &mut region));
        api.ok((api.srf_cloud_select)(cloud, region, 0, none, &mut gone));
        assert_eq!(gone, 2);
        api.ok((api.srf_region_free)(region));
        let marks = [0_u8, 3, 0, 0, 1];
        api.ok((api.srf_region_mask)(&Array::of(&marks, U8, 1), 0, 0, &mut region));
        api.ok((api.srf_mesh_select)(mesh, null, region, 0, none, std::ptr::null_mut()));
        assert_eq!(bytes(mesh).len() / 24, 3);
        let answer = (api.srf_mesh_select)(mesh, null, region, 0, none, std::ptr::null_mut());
        api.refused(answer, INPUT, "the mask has 5 marks for 3 vertices");
        api.refused((api.srf_image_select)(kept, region, 1, none, &mut gone), INPUT, "the mask has 5 x 1 pixels");
        let answer = (api.srf_region_mask)(&Array::of(&marks, U8, 1), 2, 3, &mut region);
        api.refused(answer, INPUT, "2 x 3 pixels");
        let answer = (api.srf_region_box)(&cuboid([0.0; 3], [1.0, 0.0, 1.0]), &mut region);
        api.refused(answer, INPUT, "the box is flat");
        let mut watched = 0_u32;
        let watch = Watch { report: Some(cancel), user: (&raw mut watched).cast(), cancel: Handle::NULL };
        let answer = (api.srf_image_select)(kept, region, 1, &watch, &mut gone);
        assert!(answer == CANCELLED || answer == INPUT, "{answer}");
        for end in [(api.srf_region_free)(region), (api.srf_scans_free)(scans), (api.srf_cloud_free)(cloud)] {
            api.ok(end);
        }
        for handle in [kept, rest] {
            api.ok((api.srf_image_free)(handle));
        }
        for handle in [mesh, read] {
            api.ok((api.srf_mesh_free)(handle));
        }
    }
}

#[test]
pub(super) fn a_plane_is_found_and_becomes_the_ground_in_true_size() {
    let api = api();
    // A square 3 below the origin, and a few points above it.
    let mut points: Vec<[f64; 3]> =
        (0..900).map(|i| [-3.0, f64::from(i % 30) / 10.0, f64::from(i / 30) / 10.0]).collect();
    points.extend((0..100).map(|i| [-2.0 + f64::from(i % 10) / 10.0, 1.0 + f64::from(i / 10) / 20.0, 1.0]));
    // SAFETY: as the header wants it, or wrong in the ways it names.
    unsafe {
        let (none, null) = (std::ptr::null(), std::ptr::null());
        let (mut cloud, mut aligner) = (Handle::NULL, Handle::NULL);
        api.ok((api.srf_cloud_create)(&Array::of(&points, F64, 3), null, null, null, null.cast(), &mut cloud));
        api.ok((api.srf_aligner_create)(&mut aligner));
        let mut plane = level();
        let answer = (api.srf_dominant_plane)(aligner, std::ptr::null(), none, &mut plane);
        api.refused(answer, INPUT, "at least three samples, but the scans have 0");
        api.ok((api.srf_aligner_add_cloud)(aligner, cloud, c"points".as_ptr()));
        api.ok((api.srf_dominant_plane)(aligner, std::ptr::null(), none, &mut plane));
        let numbers: Vec<f64> = (0..9).map(|k| plane.f64(k)).collect();
        assert!(plane.second == 1 && (numbers[3] - 1.0).abs() < 1e-9 && (numbers[0] + 3.0).abs() < 1e-9, "{numbers:?}");
        assert!((numbers[7] - 0.9).abs() < 0.01 && numbers[8] < 1e-9 && numbers[6] > 0.0, "{numbers:?}");
        let mut params = PlaneParams::ZERO;
        api.ok((api.srf_plane_params_init_sized)(&mut params, size_of_val(&params)));
        params.set_f64(1, 0.95);
        let answer = (api.srf_dominant_plane)(aligner, &params, none, &mut plane);
        api.refused(answer, INPUT, "no plane stands out");
        let (mut size, mut ground) = ([0.0; 16], [0.0; 16]);
        api.ok((api.srf_true_size)([0.0; 3].as_ptr(), [0.0, 0.0, 2.0].as_ptr(), 5.0, &mut size));
        assert_eq!((size[0], size[5], size[12]), (2.5, 2.5, 0.0));
        api.ok((api.srf_ground)(&plane, std::ptr::null(), &mut ground));
        api.ok((api.srf_cloud_transform)(cloud, &ground));
        api.ok((api.srf_cloud_transform)(cloud, &size));
        let (mut at, mut pose) = (Array::EMPTY, [0.0; 16]);
        let unwanted = std::ptr::null_mut();
        api.ok((api.srf_cloud_arrays)(cloud, &mut at, unwanted, unwanted, unwanted));
        api.ok((api.srf_cloud_pose)(cloud, &mut pose));
        let places: Vec<f64> = at.bytes().chunks_exact(8).map(|x| f64::from_ne_bytes(x.try_into().unwrap())).collect();
        for (place, was) in places.chunks_exact(3).zip(&points) {
            let height = pose[2] * place[0] + pose[6] * place[1] + pose[10] * place[2] + pose[14];
            assert!((height - 2.5 * (was[0] + 3.0)).abs() < 1e-9, "{height} of {was:?}");
        }
        let picked = [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]].concat();
        api.ok((api.srf_plane_through)(picked.as_ptr(), [0.0; 3].as_ptr(), &mut plane));
        assert_eq!((plane.second, plane.f64(5)), (0, -1.0));
        let answer = (api.srf_plane_through)([1.0; 9].as_ptr(), std::ptr::null(), &mut plane);
        api.refused(answer, INPUT, "lie on one line");
        api.refused((api.srf_true_size)([0.0; 3].as_ptr(), [0.0; 3].as_ptr(), 5.0, &mut size), INPUT, "lie apart");
        let squeezed = cuboid([0.0; 3], [1.0, 2.0, 1.0]);
        api.refused((api.srf_cloud_transform)(cloud, &squeezed), INPUT, "scale all directions alike");
        let mesh = octahedron();
        let before = bytes(mesh);
        let image = scan(mesh);
        api.ok((api.srf_image_transform)(image, &size));
        api.ok((api.srf_mesh_transform)(mesh, &size));
        assert!(bytes(mesh) != before);
        for end in [(api.srf_mesh_free)(mesh), (api.srf_image_free)(image), (api.srf_cloud_free)(cloud)] {
            api.ok(end);
        }
        api.ok((api.srf_aligner_free)(aligner));
    }
}
