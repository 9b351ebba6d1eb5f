//! The real samples of SURFRECON_DATA: frames lie on each other as closely as was measured when they were taken there.

use std::path::PathBuf;

use crate::import::overlap::Overlap;
use crate::import::{Content, PhotoOptions, ReadOptions, ScanSet, open, open_with};
use base::progress::Progress;
use glam::DVec3;
use image::frame::Camera;

fn data(name: &str) -> Option<PathBuf> {
    let path = std::env::var_os("SURFRECON_DATA").map(|data| PathBuf::from(data).join(name));
    let found = path.filter(|path| path.exists());
    if found.is_none() {
        println!("SKIPPED: SURFRECON_DATA has no {name}");
    }
    found
}

/// Median distance from the points of frames to the nearest of the others. Reads all of them.
fn apart(set: &ScanSet, frames: &[usize]) -> f64 {
    set.notes.iter().for_each(|note| println!("{note}"));
    let points: Vec<Vec<DVec3>> = frames
        .iter()
        .map(|&k| {
            let Content::RangeImage(image) = set.scans[k].read().unwrap() else { panic!("a range image") };
            if let Some(colour) = &image.colour {
                let seen = (0..image.len()).filter(|&i| image.is_valid(i) && colour[i][3] == 255).count();
                assert!(seen * 10 > image.valid_count() * 9, "{}: {seen} of {} seen", image.name, image.valid_count());
            }
            (0..image.len()).filter(|&i| image.is_valid(i)).map(|i| image.point_in_sensor(i)).collect()
        })
        .collect();
    Overlap::of(points).median(&|k| set.scans[frames[k]].world_from_sensor)
}

#[test]
fn scanner_app_chair() {
    let Some(path) = data("frames/scannerapp_chair/chair_scan") else { return };
    let set = open(&path).unwrap();
    assert_eq!(set.scans.len(), 24);
    assert!(set.notes[0].contains("24 frames of 3D Scanner App, 4 with colour"), "{:?}", set.notes);
    let apart = apart(&set, &[0, 5, 10, 15]);
    assert!(apart < 0.012, "{apart}");
}

#[test]
fn record3d_door() {
    let Some(path) = data("frames/record3d_exr") else { return };
    let set = open(&path).unwrap();
    assert_eq!(set.scans.len(), 11);
    let apart = apart(&set, &[0, 3, 6, 10]);
    assert!(apart < 0.008, "{apart}");
}

#[test]
fn tum_desk() {
    let Some(path) = data("frames/tum_fr1_desk") else { return };
    let set = open(&path).unwrap();
    assert_eq!(set.scans.len(), 9);
    let apart = apart(&set, &[0, 4, 8]);
    assert!(apart < 0.012, "{apart}");
}

#[test]
fn slambook_room() {
    let Some(path) = data("frames/slambook/ch12/dense_RGBD/data") else { return };
    let camera = Camera::sized([481.2, -480.0], [319.5, 239.5], [640, 480]);
    let options = ReadOptions { camera: Some(camera), scale: Some(1.0 / 5000.0), ..ReadOptions::default() };
    let set = open_with(&[&path], &options, &Progress::none()).unwrap();
    assert_eq!(set.scans.len(), 5);
    let right = apart(&set, &[0, 1, 2, 3, 4]);
    let upside_down = ReadOptions { camera: Some(Camera { focal: [481.2, 480.0], ..camera }), ..options };
    let wrong = apart(&open_with(&[&path], &upside_down, &Progress::none()).unwrap(), &[0, 1, 2, 3, 4]);
    assert!(right < 0.03 && wrong > 2.0 * right, "{right}, with fy > 0 {wrong}");
}

#[test]
fn seven_scenes_with_its_colours() {
    let (Some(depths), Some(colours)) = (data("rgbd_7scenes"), data("frames/7scenes_color")) else { return };
    let folder = tempfile::tempdir().unwrap();
    for from in [depths, colours] {
        for entry in std::fs::read_dir(from).unwrap() {
            let path = entry.unwrap().path();
            std::fs::copy(&path, folder.path().join(path.file_name().unwrap())).unwrap();
        }
    }
    let set = open(folder.path()).unwrap();
    assert_eq!(set.scans.len(), 50);
    let apart = apart(&set, &[0, 10, 20, 30]);
    assert!(apart < 0.02, "{apart}");
}

#[test]
fn open3d() {
    let Some(path) = data("rgbd_open3d") else { return };
    let set = open(&path).unwrap();
    assert_eq!(set.scans.len(), 5);
    let apart = apart(&set, &[0, 1, 2, 3, 4]);
    assert!(apart < 0.01, "{apart}");
}

#[test]
fn realsense() {
    let Some(path) = data("frames/realsense_planes/data") else { return };
    let set = open(&path).unwrap();
    assert_eq!(set.scans.len(), 5);
    assert!(set.notes.iter().any(|note| note.contains("the frames have no poses")), "{:?}", set.notes);
    set.scans.iter().for_each(|scan| drop(scan.read().unwrap_or_else(|error| panic!("{error}"))));
}

#[test]
fn colmap_tiny() {
    let Some(path) = data("frames/colmap_dense_tiny/dense") else { return };
    let set = open(&path).unwrap();
    assert_eq!(set.scans.len(), 15);
    set.scans.iter().for_each(|scan| drop(scan.read().unwrap_or_else(|error| panic!("{error}"))));
}

#[test]
fn what_samples_lack_is_said() {
    let cases = [
        ("frames/colmap_depthmap_plant/dense", "depth maps without the model have no poses"),
        ("frames/stray_csv", "there are no depth images"),
    ];
    for (name, part) in cases {
        let Some(path) = data(name) else { continue };
        let error = open(&path).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
}

/// The photos are at their full size, and beside each lie the depths of its frame.
#[test]
fn photos_of_the_chair() {
    use image::photo::Photo as _;
    let Some(path) = data("frames/scannerapp_chair_full") else { return };
    let (scans, none) = (open(&path).unwrap(), Progress::none());
    let found = crate::import::photos(&path, &PhotoOptions::default(), &ReadOptions::default(), &none).unwrap();
    assert_eq!(found.photos.len(), 21, "{:?}", found.notes);
    for photo in &found.photos {
        let frame = photo.name().strip_suffix(".jpg").unwrap();
        let scan = scans.scans.iter().find(|scan| scan.name == frame).unwrap();
        assert_eq!(photo.world_from_camera(), scan.world_from_sensor);
        assert_eq!(photo.camera().size, Some([1920, 1440]));
    }
    let [pixels, last] = [0, 20].map(|i| found.photos[i].pixels().unwrap());
    assert!(pixels.colours.len() == 1920 * 1440 && pixels.colours != last.colours);
    let depths = found.photos[0].depths().unwrap().unwrap();
    let measured = depths.values.iter().filter(|depth| **depth > 0.0).count();
    assert!(depths.size == [256, 192] && measured * 2 > depths.values.len(), "{measured}");
}
