//! Theorem: each layout's twin reads as what was recorded: depths, poses, colours, what is left out.

use std::path::Path;

use glam::{DAffine3, DVec3};

use super::twin::{FRAMES, Files, Twin, colour};
use super::writers;
use crate::import::{Content, ScanSet, open, open_many};
use base::progress::Progress;
use image::frame::{Camera, LeftOutReport};
use image::range_image::RangeImage;
use image::source::ScanSource as _;

/// The content that a recording must read as.
pub(super) struct Expected {
    /// Largest error of a depth, in metres.
    pub(super) depth: f64,
    /// Most that a colour's channel may be off, for nearly all samples.
    pub(super) colour: u8,
    /// Tells which frames have colour.
    pub(super) coloured: fn(usize) -> bool,
    /// Whether the columns of low confidence are left out.
    pub(super) low_confidence: bool,
}

pub(super) const PLAIN: Expected = Expected { depth: 0.00051, colour: 14, coloured: |_| true, low_confidence: false };
pub(super) const PHONE: Expected = Expected { low_confidence: true, ..PLAIN };

pub(super) fn note<'a>(set: &'a ScanSet, part: &str) -> &'a str {
    set.notes.iter().find(|note| note.contains(part)).unwrap_or_else(|| panic!("no `{part}` in {:?}", set.notes))
}

/// Checks what a recording opened as.
pub(super) fn check(set: &ScanSet, twin: &Twin, expected: &Expected) -> Vec<LeftOutReport> {
    assert_eq!(set.scans.len(), FRAMES, "{:?}", set.notes);
    let mut all = Vec::new();
    for (k, scan) in set.scans.iter().enumerate() {
        let off = |a: DAffine3, b: DAffine3| (a.inverse() * b).abs_diff_eq(DAffine3::IDENTITY, 1e-5);
        assert!(off(scan.world_from_sensor, twin.pose(k)), "{k}: {} for {}", scan.world_from_sensor, twin.pose(k));
        let frame = scan.frame(&Progress::none()).unwrap().unwrap();
        assert_eq!(frame.colour.is_some(), (expected.coloured)(k), "{k}");
        assert_eq!(frame.confidence.is_some(), expected.low_confidence);
        let (image, left_out) = frame.into_range_image(&Progress::none()).unwrap();
        let Content::RangeImage(read) = scan.read().unwrap() else { panic!("a range image") };
        assert!(format!("{read:?}") == format!("{image:?}") && read.name == scan.name);
        assert_eq!(image.world_from_sensor, scan.world_from_sensor);
        depths(&image, &twin.depths[k], expected, left_out.black_rim > 0);
        if (expected.coloured)(k) {
            colours(&image, expected.colour);
        }
        assert!(scan.preview_points(100).unwrap().len() >= 100);
        all.push(left_out);
    }
    all
}

fn depths(image: &RangeImage, truth: &RangeImage, expected: &Expected, has_rim: bool) {
    assert_eq!((image.rows(), image.cols()), (truth.rows(), truth.cols()));
    for i in 0..truth.len() {
        let is_low = expected.low_confidence && writers::LOW.contains(&(i % truth.cols()));
        let is_there = truth.is_valid(i) && !is_low;
        assert!(has_rim && !image.is_valid(i) || image.is_valid(i) == is_there, "pixel {i}");
        if image.is_valid(i) {
            let (found, true_point) = (image.point_in_sensor(i), truth.point_in_sensor(i));
            let off = found.distance(true_point);
            assert!(off <= expected.depth * 2.0, "pixel {i}: {off}");
        }
    }
}

/// Colours are those of the places. At edges and where blocks of the JPEG have one colour they may be off.
fn colours(image: &RangeImage, most: u8) {
    let found = image.colour.as_ref().unwrap();
    let (mut wrong, mut count) = (0, 0);
    for i in (0..image.len()).filter(|&i| image.is_valid(i)) {
        let truth = colour(image.point_in_world(i));
        let off = (0..3).map(|c| found[i][c].abs_diff(truth[c])).max().unwrap();
        wrong += usize::from(off > most || found[i][3] != 255);
        count += 1;
    }
    assert!(wrong * 100 <= count * 12, "{wrong} of {count} colours are wrong");
}

pub(super) fn folder(files: &Files, check: impl Fn(&ScanSet)) {
    let (_keep, path) = files.folder();
    check(&open(&path).unwrap_or_else(|error| panic!("{error}")));
    // Zipped, the same layout reads the same.
    let zipped = path.with_extension("zip");
    std::fs::write(&zipped, files.archive()).unwrap();
    check(&open(&zipped).unwrap_or_else(|error| panic!("{error}")));
}

const KINECT: Camera = Camera { focal: [525.0, 525.0], centre: [319.5, 239.5], size: Some([640, 480]) };

/// Up is up whatever the poses are used for. A Kinect's recording does not say it.
#[test]
fn phones_know_what_is_up() {
    let twin = Twin::phone();
    for files in [
        writers::polycam(&twin, true),
        writers::record3d_exr(&twin),
        writers::scanner_app(&twin),
        writers::stray(&twin),
    ] {
        folder(&files, |set| {
            for (k, scan) in set.scans.iter().enumerate() {
                let up = twin.pose(k).inverse().transform_vector3(DVec3::Y);
                assert!(scan.up().is_some_and(|found| found.distance(up) < 1e-5), "{k}: {:?} for {up}", scan.up());
            }
        });
    }
    let twin = Twin::kinect(KINECT);
    folder(&writers::seven_scenes(&twin), |set| assert!(set.scans.iter().all(|scan| scan.up().is_none())));
}

#[test]
fn seven_scenes() {
    let camera = Camera { focal: [585.0, 585.0], centre: [320.0, 240.0], size: Some([640, 480]) };
    let twin = Twin::kinect(camera);
    folder(&writers::seven_scenes(&twin), |set| {
        check(set, &twin, &PLAIN);
        assert_eq!(set.scans[1].name, "frame-000001");
        note(set, "6 frames of 7-Scenes, 6 with colour");
        note(set, "poses read as y down, looking along z, camera to world (overlapping frames lie");
    });
}

#[test]
fn tum() {
    let twin = Twin::kinect(KINECT);
    folder(&writers::tum(&twin), |set| {
        check(set, &twin, &Expected { depth: 0.000_11, ..PLAIN });
        assert_eq!(set.scans[0].name, "1305031453.000000");
    });
    // Without a camera of its own the folder's name says which Kinect it was.
    let files = writers::tum(&twin).without("camera.json");
    let (_keep, path) = files.folder();
    let error = open(&path).unwrap_err().to_string();
    assert!(error.contains("does not say its camera. Give it as camera = (fx, fy, cx, cy)"), "{error}");
    let named = path.with_file_name("rgbd_dataset_freiburg2_desk");
    std::fs::rename(&path, &named).unwrap();
    let set = open(&named).unwrap();
    assert_eq!(set.scans.len(), FRAMES);
    note(
        &set,
        "no file says the camera: taken for the data set's by `freiburg2` in the folder's name, (520.9, 521, 325.1, 249.7)",
    );
}

#[test]
fn redwood() {
    let twin = Twin::kinect(KINECT);
    folder(&writers::redwood(&twin), |set| {
        check(set, &twin, &Expected { colour: 120, ..PLAIN });
        assert_eq!(set.scans[2].name, "10-000000066000");
    });
}

/// A list that is opened with a recording places its frames: then they have poses.
#[test]
fn a_recording_with_its_list_of_poses_has_poses() {
    let twin = Twin::kinect(KINECT);
    let mut files = writers::tum(&twin).without("groundtruth.txt");
    let line = |k: usize| format!("{:.6} 0 0 {k} 0 0 0 1\n", 1_305_031_453.0 + k as f64);
    files.put("list.tum", (0..FRAMES).map(line).collect::<String>());
    let (_keep, path) = files.folder();
    let set = open_many(&[&path, &path.join("list.tum")]).unwrap();
    assert_eq!(set.scans.len(), FRAMES);
    assert_eq!(set.scans[2].world_from_sensor.translation.z, 2.0);
    assert!(!set.notes.iter().any(|note| note.contains("no poses")), "{:?}", set.notes);
}

/// Kinects' and RealSenses' folders without poses are recordings to align: with times, scale and colours.
#[test]
fn recordings_without_poses() {
    let kinect = Twin::kinect(KINECT);
    // The camera of 7-Scenes, which no file of it says.
    let seven = Twin::kinect(Camera { focal: [585.0, 585.0], centre: [320.0, 240.0], size: Some([640, 480]) });
    let list = "no list of poses lies beside the images (trajectory.log, pose.txt";
    let cases = [
        (&seven, writers::seven_scenes(&seven).without(".pose.txt"), "there are no files .pose.txt", 0.000_51),
        (&kinect, writers::tum(&kinect).without("groundtruth.txt"), "groundtruth.txt is missing", 0.000_11),
        (&kinect, writers::redwood(&kinect).without(".log"), list, 0.000_51),
    ];
    for (twin, files, why, depth) in cases {
        folder(&files, |set| {
            assert_eq!(set.scans.len(), FRAMES);
            assert!(
                note(set, "the frames have no poses: align them before they are merged").contains(why),
                "{:?}",
                set.notes
            );
            assert!(!set.notes.iter().any(|note| note.contains("poses read as")), "{:?}", set.notes);
            for (k, scan) in set.scans.iter().enumerate() {
                assert_eq!(scan.world_from_sensor, DAffine3::IDENTITY);
                assert!(scan.moment().is_some_and(|moment| moment.at == k as f64));
                let (image, _) =
                    scan.frame(&Progress::none()).unwrap().unwrap().into_range_image(&Progress::none()).unwrap();
                depths(&image, &twin.depths[k], &Expected { depth, ..PLAIN }, false);
                assert!(image.colour.is_some());
            }
        });
    }
}

#[test]
fn icl_nuim() {
    let camera = Camera { focal: [481.2, -480.0], centre: [319.5, 239.5], size: Some([640, 480]) };
    let twin = Twin::kinect(camera);
    folder(&writers::icl_in_form_of_tum(&twin), |set| {
        check(set, &twin, &Expected { depth: 0.000_11, ..PLAIN });
        note(set, "1 of 7 frames have no pose and are passed over");
    });
    // At the size of the data set: the text says none.
    let twin = Twin::new(camera, [640, 480]);
    let (_keep, path) = writers::icl_rendered(&twin).folder();
    check(&open(&path).unwrap(), &twin, &Expected { depth: 1e-5, ..PLAIN });
}

#[test]
fn nerfstudio() {
    let twin = Twin::phone();
    let files = writers::nerfstudio(&twin);
    folder(&files, |set| {
        check(set, &twin, &Expected { depth: 0.000_13, ..PLAIN });
        note(set, "1 of 7 frames have no depth and are passed over");
    });
    let (_keep, path) = files.folder();
    check(&open(&path.join("transforms.json")).unwrap(), &twin, &Expected { depth: 0.000_13, ..PLAIN });
}

#[test]
fn polycam() {
    let twin = Twin::phone();
    folder(&writers::polycam(&twin, true), |set| {
        let left_out = check(set, &twin, &PHONE);
        assert!(left_out.iter().all(|out| out.low_confidence > 0));
        assert!(left_out.iter().any(|out| out.black_rim > 0), "{left_out:?}");
        note(set, "of 6 frames looked at: left out");
    });
    let corrected = writers::polycam(&twin, true).without("keyframes/images/").without("keyframes/cameras/");
    folder(&corrected, |set| {
        check(set, &twin, &PHONE);
    });
    folder(&writers::polycam(&twin, false), |set| {
        check(set, &twin, &PHONE);
        note(set, "the session has no corrected ones");
    });
}

#[test]
fn record3d() {
    let twin = Twin::phone();
    let files = writers::record3d(&twin);
    folder(&files, |set| {
        check(set, &twin, &Expected { depth: 1e-6, ..PHONE });
    });
    let (_keep, path) = files.folder();
    let archive = path.with_extension("r3d");
    std::fs::write(&archive, files.archive()).unwrap();
    check(&open(&archive).unwrap(), &twin, &Expected { depth: 1e-6, ..PHONE });
    folder(&writers::record3d_exr(&twin), |set| {
        check(set, &twin, &Expected { depth: 1e-6, ..PLAIN });
    });
}

#[test]
fn a_file_tells_which_recording_it_is_of() {
    let files = writers::polycam(&Twin::phone(), true);
    let (_keep, path) = files.folder();
    let of = |file: &str| crate::import::recording_of(&path.join(file), &Progress::none()).unwrap();
    for file in ["keyframes/depth/1.png", "keyframes/images/x.jpg", "mesh_info.json"] {
        assert_eq!(of(file).as_ref(), Some(&path), "{file}");
    }
    // Neither from farther off nor beside it.
    assert_eq!(of("keyframes/a/b/c/d.png"), None);
    let alone = path.with_file_name("alone.png");
    std::fs::write(&alone, "").unwrap();
    std::fs::write(path.with_file_name("another.png"), "").unwrap();
    assert_eq!(crate::import::recording_of(&alone, &Progress::none()).unwrap(), None);
    assert!(crate::import::recording_of(&path.join("x.png"), &Progress::cancel_after(0)).is_err());
}

#[test]
fn scanner_app() {
    let twin = Twin::phone();
    folder(&writers::scanner_app(&twin), |set| {
        check(set, &twin, &Expected { coloured: |k| k % 3 == 0, ..PHONE });
        note(set, "6 frames of 3D Scanner App, 2 with colour");
    });
}

#[test]
fn stray() {
    let twin = Twin::phone();
    folder(&writers::stray(&twin), |set| {
        check(set, &twin, &Expected { coloured: |_| false, ..PHONE });
        note(set, "colours are in a video, rgb.mp4, which is not read");
    });
}

#[test]
fn colmap() {
    let twin = Twin::phone();
    for binary in [false, true] {
        folder(&writers::colmap(&twin, binary), |set| {
            check(set, &twin, &Expected { depth: 1e-6, ..PLAIN });
        });
    }
}

#[test]
fn sens() {
    let twin = Twin::phone();
    let folder = tempfile::tempdir().unwrap();
    for packed in [false, true] {
        let path = folder.path().join("scene.sens");
        std::fs::write(&path, writers::sens(&twin, packed)).unwrap();
        let set = open(&path).unwrap();
        check(&set, &twin, &PLAIN);
        note(&set, "1 of 7 frames have no pose and are passed over");
    }
}

/// Theorem: a recording whose poses have other axes or another sense than its layout is told from a right one, and read
/// as it was meant.
#[test]
fn other_conventions_are_found() {
    let twin = Twin::phone();
    let opened = |wrong: &dyn Fn(DAffine3) -> DAffine3| {
        let mut other = Twin::phone();
        for depth in &mut other.depths {
            depth.world_from_sensor = wrong(depth.world_from_sensor);
        }
        let (keep, path) = writers::nerfstudio(&other).folder();
        let set = open(&path).unwrap();
        let convention = note(&set, "poses read as").to_owned();
        (set, convention, keep)
    };
    let turned = DAffine3::from_scale(DVec3::new(1.0, -1.0, -1.0));
    let right = opened(&|pose| pose);
    assert!(right.1.contains("y up, looking along -z, camera to world (overlapping frames lie"), "{}", right.1);
    // Written with the axes of OpenCV, where nerfstudio's are OpenGL's.
    let axes = opened(&|pose| pose * turned);
    assert!(axes.1.contains("y down, looking along z, camera to world, not as nerfstudio usually"), "{}", axes.1);
    check(&axes.0, &twin, &Expected { depth: 0.000_13, ..PLAIN });
    // World to camera.
    let sense = opened(&|pose| (pose * turned).inverse() * turned);
    assert!(sense.1.contains("y up, looking along -z, world to camera, not as nerfstudio"), "{}", sense.1);
    check(&sense.0, &twin, &Expected { depth: 0.000_13, ..PLAIN });
}

/// Theorem: a recording inside of the only folder, of a folder or of an archive, is found there, also where somebody describes it.
#[test]
fn recordings_in_a_folder_of_their_own() {
    let twin = Twin::phone();
    let mut files = Files::default();
    writers::scanner_app(&twin).0.into_iter().for_each(|(name, content)| files.put(format!("my scan/{name}"), content));
    files.put("__MACOSX/._my scan", "x");
    files.put("README.md", "what it is of");
    folder(&files, |set| {
        check(set, &twin, &Expected { coloured: |k| k % 3 == 0, ..PHONE });
        assert!(set.scans[0].path.ends_with("my scan/depth_00000.png"), "{:?}", set.scans[0].path);
    });
}

/// Theorem: what is read does not depend on where the folder is named from, nor on a slash behind it.
#[test]
fn names_are_those_of_the_frames() {
    let twin = Twin::phone();
    let (_keep, path) = writers::scanner_app(&twin).folder();
    let again = Path::new(&format!("{}/", path.display())).to_owned();
    let names = |path: &Path| -> Vec<String> { open(path).unwrap().scans.into_iter().map(|s| s.name).collect() };
    assert_eq!(names(&path), names(&again));
    assert_eq!(names(&path)[5], "frame_00005");
}
