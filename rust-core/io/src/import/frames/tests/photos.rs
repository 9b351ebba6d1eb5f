//! Theorem: the photos of each layout's twin have the cameras, poses, pixels and depths that were recorded.

use std::path::Path;

use glam::{DAffine3, DVec2, DVec3};

use super::twin::{FRAMES, Files, Twin, jpeg};
use super::writers;
use crate::import::{PhotoOptions, PhotoSet, ReadOptions, open, photos};
use base::error::{Error, Result};
use base::progress::Progress;
use image::frame::Camera;
use image::photo::Photo as _;

fn photos_at(path: &Path, wanted: &PhotoOptions) -> Result<PhotoSet> {
    photos(path, wanted, &ReadOptions::default(), &Progress::none())
}

fn photos_of(files: &Files) -> PhotoSet {
    let (_keep, path) = files.folder();
    let set = photos_at(&path, &PhotoOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    // They outlive the files, but for pixels.
    PhotoSet { notes: set.notes.clone(), ..set }
}

/// Opens a recording in a folder, and looks at its photos while it is there.
fn with_photos(files: &Files, wanted: &PhotoOptions, look: impl Fn(&PhotoSet)) {
    let (_keep, path) = files.folder();
    look(&photos_at(&path, wanted).unwrap_or_else(|error| panic!("{error}")));
    let zipped = path.with_extension("zip");
    std::fs::write(&zipped, files.archive()).unwrap();
    look(&photos_at(&zipped, wanted).unwrap_or_else(|error| panic!("{error}")));
}

fn is_at(found: DAffine3, pose: DAffine3) -> bool {
    (found.inverse() * pose).abs_diff_eq(DAffine3::IDENTITY, 1e-5)
}

fn is_as(found: Camera, camera: Camera) -> bool {
    let close = |a: [f64; 2], b: [f64; 2]| DVec2::from(a).distance(DVec2::from(b)) < 1e-5;
    found.size == camera.size && close(found.focal, camera.focal) && close(found.centre, camera.centre)
}

/// Share of pixels that differ from what the twin saw by more than JPEG does.
fn wrong(found: &[[u8; 3]], truth: &[[u8; 3]]) -> f64 {
    assert_eq!(found.len(), truth.len());
    let apart = |(a, b): (&[u8; 3], &[u8; 3])| (0..3).map(|c| a[c].abs_diff(b[c])).max().unwrap();
    found.iter().zip(truth).filter(|pair| apart(*pair) > 12).count() as f64 / found.len() as f64
}

/// Checks a set of photos of the frames with these numbers.
fn check(set: &PhotoSet, twin: &Twin, frames: &[usize], has_depths: bool) {
    assert_eq!(set.photos.len(), frames.len(), "{:?}", set.notes);
    for (photo, &k) in set.photos.iter().zip(frames) {
        assert!(is_at(photo.world_from_camera(), twin.pose(k)), "{}", photo.name());
        assert!(is_as(photo.camera(), twin.photo), "{:?} for {:?}", photo.camera(), twin.photo);
        let pixels = photo.pixels().unwrap();
        assert_eq!(Some(pixels.size), twin.photo.size);
        let wrong = wrong(&pixels.colours, &twin.colours[k]);
        assert!(wrong < 0.03, "{}: {wrong}", photo.name());
        let depths = photo.depths().unwrap();
        assert_eq!(depths.is_some(), has_depths, "{}", photo.name());
        let Some(depths) = depths else { continue };
        assert_eq!(depths.size, twin.size());
        let (mut measured, truth) = (0, &twin.depths[k]);
        for (i, &depth) in depths.values.iter().enumerate().filter(|(_, depth)| **depth > 0.0) {
            assert!(truth.is_valid(i) && (f64::from(depth) - truth.point_in_sensor(i).z).abs() < 0.002, "{i}: {depth}");
            measured += 1;
        }
        assert!(measured * 10 > truth.valid_count() * 8, "{measured}");
    }
}

const ALL: [usize; FRAMES] = [0, 1, 2, 3, 4, 5];

#[test]
fn phones() {
    let (twin, wanted) = (Twin::phone(), PhotoOptions::default());
    for files in [writers::polycam(&twin, false), writers::record3d(&twin), writers::record3d_exr(&twin)] {
        with_photos(&files, &wanted, |set| check(set, &twin, &ALL, true));
    }
    // Of some frames alone.
    with_photos(&writers::scanner_app(&twin), &wanted, |set| {
        check(set, &twin, &[0, 3], true);
        assert!(set.notes[0].ends_with("2 photos of 3D Scanner App"), "{:?}", set.notes);
        assert_eq!(set.photos[1].name(), "frame_00003.jpg");
    });
}

#[test]
fn lists_with_depths() {
    let (twin, wanted) = (Twin::phone(), PhotoOptions::default());
    with_photos(&writers::nerfstudio(&twin), &wanted, |set| {
        check(set, &twin, &ALL, true);
        let note = set.notes.iter().find(|note| note.contains("left out")).unwrap();
        assert!(note.contains("1 photos are left out: images/none.jpg is not there"), "{note}");
    });
    for binary in [false, true] {
        with_photos(&writers::colmap(&twin, binary), &wanted, |set| check(set, &twin, &ALL, true));
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.sens");
    std::fs::write(&path, writers::sens(&twin, true)).unwrap();
    check(&photos_at(&path, &wanted).unwrap(), &twin, &ALL, true);
}

#[test]
fn data_sets() {
    let twin = Twin::kinect(Camera { focal: [525.0, 525.0], centre: [319.5, 239.5], size: Some([640, 480]) });
    with_photos(&writers::tum(&twin), &PhotoOptions::default(), |set| check(set, &twin, &ALL, true));
}

#[test]
fn photos_without_depths() {
    let (twin, wanted) = (Twin::phone(), PhotoOptions::default());
    let mut files = writers::nerfstudio(&twin).without("depths/");
    files.change("transforms.json", |text| {
        *text = String::from_utf8_lossy(text).replace("\"depth_file_path\"", "\"other\"").into_bytes();
    });
    let (_keep, path) = files.folder();
    assert!(open(&path).unwrap_err().to_string().contains("export it with depth"));
    with_photos(&files, &wanted, |set| check(set, &twin, &ALL, false));
    check(&photos_at(&path.join("transforms.json"), &wanted).unwrap(), &twin, &ALL, false);

    for binary in [false, true] {
        let mut files = writers::colmap(&twin, binary).without("stereo/");
        files.0.iter_mut().for_each(|(name, _)| {
            *name = name.trim_start_matches("dense/").replace("sparse/", "sparse/0/");
        });
        let (_keep, path) = files.folder();
        assert!(open(&path).is_err());
        with_photos(&files, &wanted, |set| check(set, &twin, &ALL, false));
    }
    // Sessions of phones without LiDAR.
    for corrected in [false, true] {
        let files = writers::polycam(&twin, corrected).without("/depth/").without("/confidence/");
        let (_keep, path) = files.folder();
        assert!(open(&path).is_err());
        with_photos(&files, &wanted, |set| {
            assert_eq!(set.photos.len(), FRAMES, "{:?}", set.notes);
            for (k, photo) in set.photos.iter().enumerate() {
                assert!(is_at(photo.world_from_camera(), twin.pose(k)), "{k}");
            }
        });
    }
    let files = writers::scanner_app(&twin).without("depth_00003");
    with_photos(&files, &wanted, |set| {
        assert_eq!(set.photos.len(), 2, "{:?}", set.notes);
        assert!(set.photos[1].depths().unwrap().is_none() && is_at(set.photos[1].world_from_camera(), twin.pose(3)));
    });
    // Depth images that are gone leave photos.
    let files = writers::colmap(&twin, true).without("f2.jpg.photometric.bin");
    with_photos(&files, &wanted, |set| assert_eq!(set.photos.len(), FRAMES));
}

/// An image as a lens with this distortion along the radius shows it.
fn seen_through(twin: &Twin, k: usize, k1: f64) -> Vec<[u8; 3]> {
    let ([cols, rows], focal) = (twin.photo.size.unwrap(), DVec2::from(twin.photo.focal));
    let centre = DVec2::from(twin.photo.centre);
    let pixel = |i: usize| {
        let at = (DVec2::new((i % cols) as f64, (i / cols) as f64) - centre) / focal;
        // Undone by steps: r = r' (1 + k1 r'^2).
        let ideal = (0..60).fold(at, |ideal, _| at / (1.0 + k1 * ideal.length_squared()));
        let [col, row] = (ideal * focal + centre).round().to_array();
        let inside = |x: f64, count: usize| x.clamp(0.0, (count - 1) as f64) as usize;
        twin.colours[k][inside(row, rows) * cols + inside(col, cols)]
    };
    (0..cols * rows).map(pixel).collect()
}

#[test]
fn lenses_that_distort_are_undone() {
    let (twin, k1) = (Twin::phone(), -0.1);
    let size = twin.photo.size.unwrap();
    let mut listed = writers::nerfstudio(&twin);
    listed.change("transforms.json", |text| {
        *text = String::from_utf8_lossy(text).replace("\"k1\": 0.0", &format!("\"k1\": {k1}")).into_bytes();
    });
    let mut model = writers::colmap(&twin, false);
    model.change("dense/sparse/cameras.txt", |text| {
        let line = String::from_utf8_lossy(text).replace("PINHOLE", "OPENCV");
        *text = format!("{} {k1} 0 0 0\n", line.trim_end()).into_bytes();
    });
    for k in 0..FRAMES {
        let image = jpeg(size, &seen_through(&twin, k, k1));
        listed.change(&format!("images/f{k}.jpg"), |bytes| *bytes = image.clone());
        model.change(&format!("dense/images/f{k}.jpg"), |bytes| *bytes = image);
    }
    for files in [listed, model] {
        let (_keep, path) = files.folder();
        assert!(open(&path).unwrap_err().to_string().contains("undistort the images first"));
        with_photos(&files, &PhotoOptions::default(), |set| {
            assert_eq!(set.photos.len(), FRAMES, "{:?}", set.notes);
            let camera = set.photos[0].camera();
            let [cols, rows] = camera.size.unwrap();
            assert!(cols <= size[0] && rows <= size[1] && cols * 10 > size[0] * 8, "{cols} x {rows}");
            let first = [0, 1].map(|axis| (twin.photo.centre[axis] - camera.centre[axis]).round() as usize);
            for (k, photo) in set.photos.iter().enumerate() {
                let whole = &twin.colours[k];
                let truth: Vec<[u8; 3]> =
                    (0..cols * rows).map(|i| whole[(i / cols + first[1]) * size[0] + i % cols + first[0]]).collect();
                let wrong = wrong(&photo.pixels().unwrap().colours, &truth);
                assert!(wrong < 0.06, "{k}: {wrong}");
                assert!(photo.depths().unwrap().is_none() && is_at(photo.world_from_camera(), twin.pose(k)));
            }
        });
    }
}

#[test]
fn the_black_rim_is_cut_off() {
    let twin = Twin::phone();
    with_photos(&writers::polycam(&twin, true), &PhotoOptions::default(), |set| {
        assert_eq!(set.photos.len(), FRAMES);
        let [cols, rows] = set.photos[0].camera().size.unwrap();
        // The rim is 10 pixels wide at the sides and 8 at the top. Compression smears it.
        assert!((256 - 40..256 - 19).contains(&cols) && (192 - 20..192 - 7).contains(&rows), "{cols} x {rows}");
        for photo in &set.photos {
            let pixels = photo.pixels().unwrap();
            assert_eq!(pixels.colours.len(), cols * rows);
            assert!(pixels.colours.iter().all(|pixel| pixel.iter().any(|&channel| channel > 20)));
            // The depths are those of the part.
            let depths = photo.depths().unwrap().unwrap();
            assert!(depths.size[0] < 64 && depths.size[0] > 50 && depths.values.iter().any(|depth| *depth > 0.0));
            // A ray through the middle of the pixels is where it was.
            let point = photo.camera().centre;
            assert!(point[0] < twin.photo.centre[0] - 9.0 && point[1] < twin.photo.centre[1] - 7.0, "{point:?}");
        }
    });
}

#[test]
fn some_of_many() {
    let twin = Twin::phone();
    let files = writers::nerfstudio(&twin);
    let names = |every, most| {
        let (_keep, path) = files.folder();
        let set = photos_at(&path, &PhotoOptions { every, most }).unwrap();
        set.photos.iter().map(|photo| photo.name().to_owned()).collect::<Vec<_>>().join(" ")
    };
    assert_eq!(names(2, 0), "images/f0.jpg images/f2.jpg images/f4.jpg");
    assert_eq!(names(1, 3), "images/f1.jpg images/f3.jpg images/f5.jpg");
    assert_eq!(names(1, 6).split(' ').count(), 6);
    assert_eq!(names(4, 1), "images/f4.jpg");
    let (_keep, path) = files.folder();
    let error = photos_at(&path, &PhotoOptions { every: 0, most: 0 }).unwrap_err().to_string();
    assert!(error.contains("every must be"), "{error}");
}

/// A JPEG file with the orientation of EXIF.
fn with_orientation(file: &[u8], number: u16, is_little: bool) -> Vec<u8> {
    let short = |x: u16| if is_little { x.to_le_bytes() } else { x.to_be_bytes() };
    let long = |x: u32| if is_little { x.to_le_bytes() } else { x.to_be_bytes() };
    let mark: &[u8] = if is_little { b"II" } else { b"MM" };
    let entry = [&short(0x0112)[..], &short(3), &long(1), &short(number), &[0; 2]].concat();
    let exif = [b"Exif\0\0", mark, &short(42), &long(8), &short(1), &entry, &long(0)].concat();
    [&file[..2], &[0xFF, 0xE1], &(exif.len() as u16 + 2).to_be_bytes(), &exif, &file[2..]].concat()
}

#[test]
fn photos_that_exif_turns_fit_their_cameras() {
    let twin = Twin::phone();
    let [cols, rows] = twin.photo.size.unwrap();
    let stored = |k: usize, number: u16| -> Vec<[u8; 3]> {
        let image = &twin.colours[k];
        // The stored image has as many columns as the shown one has rows.
        let at = |x: usize, y: usize| match number {
            5 => [y, x],
            6 => [cols - 1 - y, x],
            7 => [cols - 1 - y, rows - 1 - x],
            _ => [y, rows - 1 - x],
        };
        let places = (0..cols).flat_map(|y| (0..rows).map(move |x| at(x, y)));
        places.map(|[col, row]| image[row * cols + col]).collect()
    };
    let mut files = writers::nerfstudio(&twin);
    for (k, number) in [5, 6, 7, 8].into_iter().enumerate() {
        let image = with_orientation(&jpeg([rows, cols], &stored(k, number)), number, k % 2 == 0);
        files.change(&format!("images/f{k}.jpg"), |bytes| *bytes = image);
    }
    // One that fits as it is stored stays so, whatever EXIF says.
    files.change("images/f4.jpg", |bytes| *bytes = with_orientation(bytes, 3, true));
    with_photos(&files, &PhotoOptions::default(), |set| {
        assert_eq!(set.photos.len(), FRAMES, "{:?}", set.notes);
        for (k, photo) in set.photos.iter().enumerate() {
            let wrong = wrong(&photo.pixels().unwrap().colours, &twin.colours[k]);
            assert!(wrong < 0.03 && is_as(photo.camera(), twin.photo), "{k}: {wrong}");
        }
    });
}

#[test]
fn photos_that_do_not_fit_are_scaled_or_left_out_by_name() {
    let twin = Twin::phone();
    let mut files = writers::nerfstudio(&twin);
    let small: Vec<[u8; 3]> = (0..128 * 96).map(|i| twin.colours[0][(i / 128 * 2) * 256 + i % 128 * 2]).collect();
    files.change("images/f0.jpg", |bytes| *bytes = jpeg([128, 96], &small));
    files.change("images/f1.jpg", |bytes| *bytes = jpeg([100, 192], &twin.colours[1][..19_200]));
    files.change("images/f2.jpg", |bytes| *bytes = b"\0\0\0\x18ftypheic".to_vec());
    files.change("images/f3.jpg", |bytes| bytes.truncate(40));
    let files = files.without("f4.jpg");
    let (_keep, path) = files.folder();
    let set = photos_at(&path, &PhotoOptions::default()).unwrap();
    assert_eq!(set.photos.iter().map(|photo| photo.name()).collect::<Vec<_>>(), ["images/f0.jpg", "images/f5.jpg"]);
    assert!(is_as(set.photos[0].camera(), twin.photo.scaled_to([128, 96])));
    assert_eq!(set.photos[0].pixels().unwrap().size, [128, 96]);
    let note = |part: &str| assert!(set.notes.iter().any(|note| note.contains(part)), "{part}: {:?}", set.notes);
    note("1 photos have another size than their cameras say: the cameras are scaled to them");
    note("5 photos are left out: ");
    note("f1.jpg");
    note("one of them was turned or cropped");
    note("HEIC images and videos are not read: convert it to JPEG or PNG");
    // One that is changed later says so, and so does one that goes.
    std::fs::write(path.join("images/f5.jpg"), jpeg([128, 96], &small)).unwrap();
    let error = set.photos[1].pixels().unwrap_err().to_string();
    assert!(error.contains("f5.jpg") && error.contains("open the recording again"), "{error}");
    std::fs::remove_file(path.join("images/f5.jpg")).unwrap();
    let error = set.photos[1].pixels().unwrap_err();
    assert!(matches!(&error, Error::Io { .. }) && error.to_string().contains("f5.jpg"), "{error}");
}

#[test]
fn recordings_without_photos_say_why() {
    let twin = Twin::phone();
    let told = |files: &Files| {
        let (_keep, path) = files.folder();
        photos_at(&path, &PhotoOptions::default()).unwrap_err().to_string()
    };
    let error = told(&writers::stray(&twin));
    assert!(error.contains("no photo with a camera and a pose") && error.contains("rgb.mp4"), "{error}");
    let mut other = Files::default();
    other.put("a.txt", "1 2 3");
    assert!(told(&other).contains("this folder is no recording that is known"));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ply");
    std::fs::write(&path, "ply\n").unwrap();
    let error = photos_at(&path, &PhotoOptions::default()).unwrap_err().to_string();
    assert!(error.contains("give its folder, its archive"), "{error}");
    let fish = {
        let mut files = writers::colmap(&twin, false);
        files.change("dense/sparse/cameras.txt", |text| {
            let line = String::from_utf8_lossy(text).replace("PINHOLE", "OPENCV_FISHEYE");
            *text = format!("{} 0.1 0 0 0\n", line.trim_end()).into_bytes();
        });
        told(&files)
    };
    assert!(fish.contains("OPENCV_FISHEYE") && fish.contains("image_undistorter"), "{fish}");
    assert!(photos_of(&writers::scanner_app(&twin)).photos.len() == 2);
}

#[test]
fn poses_are_those_that_the_scans_have() {
    let twin = Twin::phone();
    // Cameras that look along z where the layout has them look along -z: the frames show it, and photos follow.
    let turned = |pose: DAffine3| pose * DAffine3::from_scale(DVec3::new(1.0, -1.0, -1.0));
    let mut files = writers::nerfstudio(&twin);
    files.change("transforms.json", |text| {
        let mut json: serde_json::Value = serde_json::from_slice(text).unwrap();
        for (k, frame) in json["frames"].as_array_mut().unwrap().iter_mut().enumerate().take(FRAMES) {
            let rows = glam::DMat4::from(turned(twin.pose_backward(k))).transpose().to_cols_array_2d();
            frame["transform_matrix"] = serde_json::json!(rows);
            // Half of the photos have no depths.
            if k % 2 == 1 {
                frame.as_object_mut().unwrap().remove("depth_file_path");
            }
        }
        *text = json.to_string().into_bytes();
    });
    let set = photos_of(&files);
    assert_eq!(set.photos.len(), FRAMES, "{:?}", set.notes);
    for photo in &set.photos {
        let k: usize = photo.name()[8..9].parse().unwrap();
        assert!(is_at(photo.world_from_camera(), twin.pose(k)), "{}: {:?}", photo.name(), set.notes);
    }
}

#[test]
fn it_can_be_cancelled() {
    let (_keep, path) = writers::nerfstudio(&Twin::phone()).folder();
    let (wanted, options) = (PhotoOptions::default(), ReadOptions::default());
    for checks in [0, 1, 5, 9] {
        let outcome = photos(&path, &wanted, &options, &Progress::cancel_after(checks));
        assert!(matches!(outcome, Err(Error::Cancelled)), "{checks}");
    }
}
