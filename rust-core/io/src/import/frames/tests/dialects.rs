//! Differences between recordings of the same layout: names, endings, order, cameras of other forms, files that systems leave there. Each
//! reads as the one that the layout's own twin is.

use std::path::Path;

use super::twin::{FRAMES, Files, Twin};
use super::writers;
use crate::import::{Content, ReadOptions, open_with};
use base::progress::Progress;
use image::frame::Camera;
use image::range_image::RangeImage;

const KINECT: Camera = Camera { focal: [525.0, 525.0], centre: [319.5, 239.5], size: Some([640, 480]) };

fn read_with(path: &Path, options: &ReadOptions) -> Vec<RangeImage> {
    let set = open_with(&[path], options, &Progress::none()).unwrap_or_else(|error| panic!("{error}"));
    let read = |scan: &crate::import::FileScan| match scan.read().unwrap_or_else(|error| panic!("{error}")) {
        Content::RangeImage(mut image) => {
            image.name.clear();
            image
        }
        _ => panic!("a range image"),
    };
    set.scans.iter().map(read).collect()
}

fn read(files: &Files) -> Vec<RangeImage> {
    let (_keep, path) = files.folder();
    read_with(&path, &ReadOptions::default())
}

fn assert_same(found: &[RangeImage], expected: &[RangeImage], about: &str) {
    assert_eq!(found.len(), expected.len(), "{about}");
    for (k, (found, expected)) in found.iter().zip(expected).enumerate() {
        assert!(format!("{found:?}") == format!("{expected:?}"), "{about}: frame {k}");
    }
}

/// Theorem: the layout's twin, changed like this, reads as before.
fn same_after(about: &str, files: Files, change: impl FnOnce(&mut Files)) {
    let expected = read(&files);
    assert!(expected.len() >= FRAMES && expected.iter().any(|image| image.colour.is_some()), "{about}");
    let mut changed = files;
    change(&mut changed);
    assert_same(&read(&changed), &expected, about);
}

fn rename(files: &mut Files, name: impl Fn(&str) -> String) {
    files.0.iter_mut().for_each(|file| file.0 = name(&file.0));
}

fn edit(files: &mut Files, name: &str, change: impl FnOnce(String) -> String) {
    files.change(name, |bytes| *bytes = change(String::from_utf8(std::mem::take(bytes)).unwrap()).into_bytes());
}

/// The number of a frame of Redwood's by its image's name: `depth/8-000000000000.png` is the first.
fn redwood_number(name: &str) -> Option<usize> {
    let image = name.strip_prefix("depth/").or_else(|| name.strip_prefix("rgb/"))?;
    Some(image.split_once('-')?.0.parse::<usize>().ok()? - 8)
}

#[test]
fn colours_belong_to_the_depths_of_their_names() {
    let twin = Twin::kinect(KINECT);
    let renamed = |about: &str, depth: fn(usize) -> String, colour: fn(usize) -> String| {
        same_after(about, writers::redwood(&twin), |files| {
            rename(files, |name| match redwood_number(name) {
                Some(k) if name.starts_with("depth/") => format!("depth/{}.png", depth(k)),
                Some(k) => format!("rgb/{}.jpg", colour(k)),
                None => name.to_owned(),
            });
        });
    };
    renamed("words before the number", |k| format!("frame-{k:06}"), |k| format!("frame-{k:06}"));
    renamed("kinds behind it", |k| format!("frame-{k:06}.depth"), |k| format!("frame-{k:06}.color"));
    renamed("kinds before it", |k| format!("d{k}"), |k| format!("c{k}"));
    renamed("dates", |k| format!("2024-05-06-{k:02}"), |k| format!("2024-05-06-{k:02}"));
    renamed("as many, from 0 and from 1", |k| format!("{k}"), |k| format!("{}", k + 1));
    // One colour is missing: the others stay with their own.
    let mut fewer = writers::redwood(&twin);
    let expected = read(&fewer);
    fewer.0.retain(|(name, _)| !(name.starts_with("rgb/") && redwood_number(name) == Some(2)));
    for (k, (found, expected)) in read(&fewer).iter().zip(&expected).enumerate() {
        assert!(if k == 2 { found.colour.is_none() } else { found.colour == expected.colour }, "{k}");
    }
}

#[test]
fn files_of_the_system_are_none_of_the_recording() {
    let left = |folders: &[&str], files: &mut Files| {
        for folder in folders {
            for name in [".DS_Store", "._0.png", "Thumbs.db", "desktop.ini"] {
                files.put(format!("{folder}{name}"), "x");
            }
        }
    };
    same_after("Redwood", writers::redwood(&Twin::kinect(KINECT)), |files| {
        left(&["", "depth/", "rgb/"], files);
        files.put("depth/more/readme.txt", "x");
    });
    same_after("7-Scenes", writers::seven_scenes(&Twin::kinect(KINECT)), |files| {
        left(&[""], files);
        files.put("._frame-000000.pose.txt", "x");
    });
    same_after("Polycam", writers::polycam(&Twin::phone(), true), |files| {
        left(&["keyframes/depth/", "keyframes/corrected_cameras/", "keyframes/corrected_images/"], files);
    });
    same_after("Polycam without corrected ones", writers::polycam(&Twin::phone(), false), |files| {
        left(&["keyframes/corrected_cameras/", "keyframes/corrected_images/"], files);
    });
}

#[test]
fn endings_may_be_in_capitals_and_missing() {
    let capitals = |name: &str| {
        name.replace(".jpg", ".JPG").replace(".color.png", ".color.PNG").replace(".depth.png", ".depth.PNG")
    };
    let phone = Twin::phone();
    same_after("Polycam", writers::polycam(&phone, true), |files| rename(files, capitals));
    same_after("3D Scanner App", writers::scanner_app(&phone), |files| rename(files, capitals));
    same_after("3D Scanner App, jpeg", writers::scanner_app(&phone), |files| {
        rename(files, |name| name.replace(".jpg", ".jpeg"));
    });
    same_after("7-Scenes", writers::seven_scenes(&Twin::kinect(KINECT)), |files| rename(files, capitals));
    same_after("nerfstudio", writers::nerfstudio(&phone), |files| {
        edit(files, "transforms.json", |json| json.replace(".jpg\", \"depth_file_path", "\", \"depth_file_path"));
    });
}

#[test]
fn lists_in_any_order_and_with_blank_lines() {
    same_after("a log from its end", writers::redwood(&Twin::kinect(KINECT)), |files| {
        edit(files, "trajectory.log", |log| {
            let lines: Vec<&str> = log.lines().collect();
            lines.chunks(5).rev().flatten().map(|line| format!("{line}\n")).collect()
        });
    });
    same_after("COLMAP with blank lines", writers::colmap(&Twin::phone(), false), |files| {
        edit(files, "dense/sparse/images.txt", |text| {
            let mut spaced = "\n# a list\n\n".to_owned();
            let lines: Vec<&str> = text.lines().filter(|line| !line.starts_with('#')).collect();
            lines.chunks(2).for_each(|two| spaced += &format!("{}\n{}\n\n", two[0], two.get(1).unwrap_or(&"")));
            spaced
        });
    });
    same_after("photos that go on behind their end", writers::scanner_app(&Twin::phone()), |files| {
        files.0.iter_mut().filter(|file| file.0.ends_with(".jpg")).for_each(|file| file.1.extend([7; 300]));
    });
}

/// Theorem: a camera that says no size is that of the depth images, and scaled for those of colour.
#[test]
fn cameras_without_a_size_are_those_of_depth() {
    let twin = Twin::phone();
    let expected = read(&writers::polycam(&twin, true));
    let (_keep, path) = writers::polycam(&twin, true).folder();
    let camera = Camera::new(twin.camera.focal, twin.camera.centre);
    let found = read_with(&path, &ReadOptions { camera: Some(camera), ..ReadOptions::default() });
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(&expected) {
        let (found_colours, colours) = (found.colour.as_ref().unwrap(), expected.colour.as_ref().unwrap());
        for i in (0..found.len()).filter(|&i| found.is_valid(i)) {
            assert!((found.point_in_sensor(i) - expected.point_in_sensor(i)).length() < 1e-6);
            let off = [0, 1, 2].map(|c| found_colours[i][c].abs_diff(colours[i][c]));
            assert!(off.iter().all(|&off| off < 3), "{off:?}");
        }
    }
    // In the form of ScanNet's text, and beside that of the colours.
    let kinect = Twin::kinect(KINECT);
    same_after("two cameras", writers::redwood(&kinect), |files| {
        files.0.retain(|(name, _)| !name.starts_with("camera_"));
        let [fx, fy] = kinect.camera.focal;
        let [cx, cy] = kinect.camera.centre;
        files.put("depth_intrinsics.txt", format!("{fx} 0 {cx} 0\n0 {fy} {cy} 0\n0 0 1 0\n0 0 0 1\n"));
        files.put("color_intrinsics.txt", "90 0 3 0\n0 90 3 0\n0 0 1 0\n0 0 0 1\n");
    });
}

#[test]
fn a_camera_that_can_not_be_read_is_not_guessed() {
    let mut files = writers::seven_scenes(&Twin::kinect(KINECT));
    files.put("camera.json", r#"{"f": 60}"#);
    let (_keep, path) = files.folder();
    let error = open_with(&[&path], &ReadOptions::default(), &Progress::none()).unwrap_err().to_string();
    assert!(error.contains("camera.json: whole file: no intrinsics found"), "{error}");
}

/// Theorem: floats are metres, whatever whole numbers of that layout are.
#[test]
fn depths_in_floats_are_metres() {
    let twin = Twin::kinect(KINECT);
    let mut files = writers::redwood(&twin).without("depth/");
    for (name, bytes) in writers::record3d_exr(&twin).0 {
        if let Some(name) = name.strip_prefix("EXR_RGBD/depth/") {
            files.put(format!("depth/{name}"), bytes);
        }
    }
    for (found, truth) in read(&files).iter().zip(&twin.depths) {
        assert!(found.valid_count() > 500);
        for i in (0..found.len()).filter(|&i| found.is_valid(i)) {
            assert!((found.range(i) - truth.range(i)).abs() < 1e-6);
        }
    }
}
