//! Theorem: the twins of further layouts read as what was recorded, and lists of poses are never points.

use super::data_sets::{self, Rtabmap};
use super::layouts::{Expected, PHONE, PLAIN, check, folder, note};
use super::twin::{FRAMES, Files, Twin};
use super::writers;
use crate::import::{ReadOptions, open};

#[test]
fn scannet_in_folders() {
    let twin = Twin::phone();
    folder(&data_sets::scannet(&twin), |set| {
        check(set, &twin, &PLAIN);
        assert_eq!(set.scans[1].name, "20");
        note(set, "6 frames of ScanNet, 6 with colour");
        note(set, "1 of 7 frames have no pose and are passed over");
    });
    // Intrinsics at the top, one for both images.
    let mut files = data_sets::scannet(&twin).without("intrinsic/");
    let [fx, fy] = twin.camera.focal;
    let [cx, cy] = twin.camera.centre;
    files.put("intrinsics_depth.txt", format!("{fx} 0 {cx}\n0 {fy} {cy}\n0 0 1\n"));
    folder(&files, |set| {
        check(set, &twin, &PLAIN);
    });
}

#[test]
fn replica() {
    let twin = Twin::phone();
    let files = data_sets::replica(&twin);
    let expected = Expected { depth: 0.000_09, ..PLAIN };
    folder(&files, |set| {
        check(set, &twin, &expected);
        note(set, "6 frames of Replica, 6 with colour");
    });
    // The camera beside the folder, as the data set has it.
    let (_keep, path) = files.folder();
    std::fs::rename(path.join("cam_params.json"), path.with_file_name("cam_params.json")).unwrap();
    check(&open(&path).unwrap(), &twin, &expected);
    // Frames that were taken out: the numbers of the others say which they are.
    std::fs::remove_file(path.join("results/depth000002.png")).unwrap();
    let set = open(&path).unwrap();
    assert_eq!(set.scans.len(), FRAMES - 1);
    assert!(set.scans[2].world_from_sensor.abs_diff_eq(twin.pose(3), 1e-5));
}

#[test]
fn arkit_scenes() {
    let twin = Twin::phone();
    let files = data_sets::arkit_scenes(&twin);
    let files_of_boxes = || {
        let mut inner = Files::default();
        data_sets::arkit_scenes(&twin)
            .0
            .into_iter()
            .for_each(|(name, bytes)| inner.put(format!("40753679_frames/{name}"), bytes));
        inner.put("40753679_3dod_annotation.json", "{}");
        inner
    };
    for files in [files, files_of_boxes()] {
        folder(&files, |set| {
            check(set, &twin, &PHONE);
            note(set, "6 frames of ARKitScenes, 6 with colour");
            note(set, "1 of 7 frames have no pose within 0.006 s");
            note(set, "poses read as y down, looking along z, world to camera");
        });
    }
}

#[test]
fn rtabmap() {
    let twin = Twin::phone();
    for form in [Rtabmap::Camera, Rtabmap::Robot, Rtabmap::Viewer] {
        folder(&data_sets::rtabmap(&twin, form), |set| {
            check(set, &twin, &PLAIN);
            note(set, "6 frames of RTAB-Map, 6 with colour");
        });
    }
    let (_keep, path) = data_sets::rtabmap(&twin, Rtabmap::Camera).without("_poses").folder();
    let error = open(&path).unwrap_err().to_string();
    assert!(error.contains("export it beside the images with rtabmap-export --poses_camera"), "{error}");
}

/// nerfstudio's list with other keys, as instant-ngp's, with depths as arrays, and with much before the first depth.
#[test]
fn lists_of_instant_ngp_and_arrays() {
    let twin = Twin::phone();
    let edited = |edit: &dyn Fn(String) -> String| {
        let mut files = writers::nerfstudio(&twin);
        files.change("transforms.json", |json| *json = edit(String::from_utf8(json.clone()).unwrap()).into_bytes());
        files
    };
    let expected = Expected { depth: 0.000_13, ..PLAIN };
    let ngp = edited(&|json| {
        json.replace("depth_file_path", "depth_path").replace("depth_unit_scale_factor", "integer_depth_scale")
    });
    folder(&ngp, |set| {
        check(set, &twin, &expected);
    });
    let mut arrays = edited(&|json| {
        (0..FRAMES).fold(json, |json, k| json.replace(&format!("depths/f{k}.png"), &format!("depths/f{k}.npy")))
    })
    .without("depths/");
    for k in 0..FRAMES {
        let values: Vec<f32> = twin.floats(k).iter().map(|depth| depth * 4000.0).collect();
        arrays.put(format!("depths/f{k}.npy"), data_sets::npy(twin.size(), &values));
    }
    folder(&arrays, |set| {
        check(set, &twin, &Expected { depth: 1e-6, ..PLAIN });
    });
    // Keys of a frame come in any order, and some are long.
    let long = format!("\"comment\": \"{}\", ", "x".repeat(9000));
    let late = edited(&|json| json.replace("{\"file_path\"", &format!("{{{long}\"file_path\"")));
    let (_keep, path) = late.folder();
    for path in [path.clone(), path.join("transforms.json")] {
        check(&open(&path).unwrap(), &twin, &expected);
    }
    std::fs::rename(path.join("transforms.json"), path.join("list.json")).unwrap();
    check(&open(&path.join("list.json")).unwrap(), &twin, &expected);
}

/// Theorem: a list of poses of any layout, opened by itself, is one.
#[test]
fn lists_of_poses_are_no_points() {
    let twin = Twin::phone();
    let lists = [
        (data_sets::replica(&twin), "traj.txt"),
        (data_sets::arkit_scenes(&twin), "lowres_wide.traj"),
        (data_sets::rtabmap(&twin, Rtabmap::Camera), "rtabmap_camera_poses.txt"),
        (data_sets::rtabmap(&twin, Rtabmap::Viewer), "camera_poses.txt"),
        (data_sets::scannet(&twin), "pose/0.txt"),
    ];
    for (files, list) in lists {
        let (_keep, path) = files.folder();
        let error = open(&path.join(list)).unwrap_err().to_string();
        assert!(error.contains("this describes scans, so open it together with them"), "{list}: {error}");
    }
}

/// Theorem: of a session that is corrected in part all frames come, in one frame of reference.
#[test]
fn polycam_corrected_in_part() {
    let twin = Twin::phone();
    let up = glam::DAffine3::from_translation(glam::DVec3::Y);
    let whole = writers::polycam(&twin, true);
    let names: Vec<String> =
        whole.0.iter().map(|(name, _)| name.clone()).filter(|name| name.contains("corrected_cameras/")).collect();
    let mut few = writers::polycam(&twin, true);
    few.0.retain(|(name, _)| !names[2..].contains(name));
    folder(&few, |set| {
        assert_eq!(set.scans.len(), FRAMES, "{:?}", set.notes);
        for (k, scan) in set.scans.iter().enumerate() {
            assert!(scan.world_from_sensor.abs_diff_eq(up * twin.pose(k), 1e-5), "{k}");
        }
        note(set, "The session has corrected ones for 2 of 6 frames alone, which are of another frame of reference.");
    });
}

/// Theorem: a frame whose depth image is gone, empty or cut off is skipped and said, wherever it is in the list.
#[test]
fn frames_without_their_depth_are_skipped() {
    let twin = Twin::phone();
    for k in [0, 2, FRAMES - 1] {
        for cut in [None, Some(0), Some(40), Some(300)] {
            let mut files = writers::nerfstudio(&twin);
            let name = format!("depths/f{k}.png");
            match cut {
                None => files = files.without(&name),
                Some(cut) => files.change(&name, |bytes| bytes.truncate(if cut == 0 { 0 } else { bytes.len() - cut })),
            }
            let (_keep, path) = files.folder();
            let set = open(&path).unwrap();
            assert_eq!(set.scans.len(), FRAMES - 1, "{name} {cut:?}");
            assert!(set.scans.iter().all(|scan| scan.read().is_ok() && scan.name != format!("f{k}")));
            let said = note(&set, "1 of 6 frames are skipped: ");
            assert!(
                said.contains(&format!("f{k}.png is ")) == cut.is_some() || said.contains("is not there"),
                "{said}"
            );
        }
    }
    // None is left.
    let mut all = writers::nerfstudio(&twin);
    (0..FRAMES).for_each(|k| all.change(&format!("depths/f{k}.png"), |bytes| bytes.truncate(30)));
    let (_keep, path) = all.folder();
    let error =
        crate::import::open_with(&[&path], &ReadOptions::default(), &base::progress::Progress::none()).unwrap_err();
    assert!(error.to_string().contains("6 of 6 frames are skipped: f0.png is damaged"), "{error}");
}
