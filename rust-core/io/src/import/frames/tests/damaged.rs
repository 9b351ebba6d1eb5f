//! Faults of recordings: named with the remedy, never more than refused.

use std::io::Write;
use std::path::Path;

use super::twin::{FRAMES, Files, Twin, grey16};
use super::writers;
use crate::import::{Content, ReadOptions, open, open_with};
use base::error::{Error, Result};
use base::progress::Progress;
use image::range_image::RangeImage;

fn phone() -> Twin {
    Twin::phone()
}

fn read(path: &Path, k: usize) -> Result<RangeImage> {
    match open(path)?.scans[k].read()? {
        Content::RangeImage(image) => Ok(image),
        _ => panic!("a range image"),
    }
}

fn refused(files: &Files, part: &str) {
    let (_keep, path) = files.folder();
    let error = open(&path).and_then(|set| set.scans.iter().try_for_each(|scan| scan.read().map(drop))).unwrap_err();
    let error = error.to_string();
    assert!(error.contains(part) && error.starts_with(&*path.to_string_lossy()), "{error}");
}

#[test]
fn what_is_missing_is_named_with_the_remedy() {
    let twin = phone();
    refused(&writers::polycam(&twin, true).without("depth/"), "exported as raw data with developer mode on");
    refused(&writers::stray(&twin).without("depth/"), "Scan with a device that has LiDAR");
    refused(&writers::colmap(&twin, true).without("images.bin"), "depth maps without the model have no poses");
    refused(&writers::redwood(&twin).without("camera_"), "does not say its camera. Give it as camera =");
    let mut none = writers::scanner_app(&twin);
    (0..FRAMES).for_each(|k| none.change(&format!("frame_{k:05}.json"), |json| *json = b"{}".to_vec()));
    refused(&none, "needs a frame that has both depth and pose: 6 of 6 frames have no pose and are passed over");
    let mut colours = writers::nerfstudio(&twin);
    colours.change("transforms.json", |json| {
        *json = String::from_utf8_lossy(json).replace("depth_file_path", "other").into_bytes();
    });
    refused(&colours, "Colour images alone give no surface");
    let mut poses = writers::record3d(&twin);
    poses.change("metadata", |json| *json = String::from_utf8_lossy(json).replace("poses", "other").into_bytes());
    refused(&poses, "there are no poses: only recordings with the LiDAR have them");
    for (mut files, list, problem) in [
        (writers::redwood(&twin), "trajectory.log", "the list has no pose: fill it, or take it out of the folder"),
        (writers::tum(&twin), "groundtruth.txt", "there is no pose"),
        (writers::tum(&twin), "depth.txt", "the list names no image: fill it"),
    ] {
        files.change(list, |text| *text = b"# nothing\n".to_vec());
        refused(&files, problem);
    }
    for (mut files, list, line, problem) in [
        (
            writers::redwood(&twin),
            "trajectory.log",
            "0 0 1\n2 0 0 0\n0 2 0 0\n0 0 2 0\n0 0 0 1\n",
            "Then the frames open without poses.",
        ),
        (
            writers::tum(&twin),
            "groundtruth.txt",
            "1 0 0 0 0 0 0 9\n",
            "must have unit length. Mend it, or take the poses out",
        ),
        (
            writers::seven_scenes(&twin),
            "frame-000002.pose.txt",
            "1 0 0 0 1",
            "a pose must be a 4 x 4 matrix. Mend it, or take the poses out",
        ),
    ] {
        files.change(list, |text| *text = line.as_bytes().to_vec());
        refused(&files, problem);
    }
    let (_keep, path) = writers::redwood(&twin).without("camera_").folder();
    let camera = image::frame::Camera::new([525.0, 525.0], [319.5, 239.5]);
    let options = ReadOptions { camera: Some(camera), ..ReadOptions::default() };
    assert_eq!(open_with(&[&path], &options, &Progress::none()).unwrap().scans.len(), FRAMES);
}

/// Theorem: a pose with numbers that are none, as Python writes them into JSON, is that of a frame whose track was lost.
#[test]
fn poses_of_no_numbers_are_lost_ones() {
    let lost = |mut files: Files, name: &str, key: &str| {
        files.change(name, |json| {
            let text = String::from_utf8_lossy(json).into_owned();
            let at = text.find(key).unwrap() + key.len();
            let at = at + text[at..].find(|c: char| c.is_ascii_digit()).unwrap();
            let end = at + text[at..].find([',', ']']).unwrap();
            *json = format!("{}NaN{}", &text[..at], &text[end..]).into_bytes();
        });
        let (_keep, path) = files.folder();
        let set = open(&path).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(set.scans.len(), FRAMES - 1);
        assert!(
            set.notes.iter().any(|note| note.contains("1 of ") && note.ends_with("have no pose and are passed over")),
            "{:?}",
            set.notes
        );
    };
    lost(writers::nerfstudio(&phone()), "transforms.json", "\"transform_matrix\"");
    let mut files = writers::nerfstudio(&phone());
    files.change("transforms.json", |json| {
        *json = [b"{\"a\": \"NaN \\\" NaN\", \"b\": NaN, ".to_vec(), b"]".to_vec()].concat()
    });
    refused(&files, "this is not JSON");
}

#[test]
fn what_can_not_be_done_is_refused_by_name() {
    let twin = phone();
    let lens = |from: &str, to: &str| {
        let mut files = writers::nerfstudio(&twin);
        files.change("transforms.json", |json| *json = String::from_utf8_lossy(json).replace(from, to).into_bytes());
        files
    };
    refused(&lens("\"k1\": 0.0", "\"k1\": 0.03"), "the lens distorts (k1 = 0.03), which is not undone");
    refused(&lens("OPENCV", "OPENCV_FISHEYE"), "the camera model OPENCV_FISHEYE is no pinhole camera");
    refused(&lens("depths/f1.png", "../f1.png"), "../f1.png leads out of the folder");
    refused(&lens("\"k1\": 0.0", "\"k1\": \"0.03\""), "frame 0: `k1` must be a number, not \"0.03\"");
    refused(&lens("\"cx\": ", "\"cx\": [], \"_\": "), "`cx` must be a number, not []");
    refused(&lens("\"depths/f1.png\"", "1"), "frame 1: `depth_file_path` must be text, not 1");
    for (unit, said) in [("0", "multiplied by 0, which must be > 0"), ("\"1\"", "must be a number, not \"1\"")] {
        let file = lens("0.00025", unit);
        refused(&file, said);
    }
    let mut model = writers::colmap(&twin, false);
    model.change("dense/sparse/cameras.txt", |text| {
        *text = String::from_utf8_lossy(text).replace("PINHOLE", "OPENCV").into_bytes();
    });
    refused(&model, "is no pinhole camera: undistort the images first (image_undistorter)");
    let mut turned = writers::scanner_app(&twin);
    turned.change("depth_00003.png", |bytes| *bytes = grey16([48, 64], &[1000; 48 * 64]));
    let (_keep, path) = turned.folder();
    let notes = open(&path).unwrap().notes.concat();
    let said = "frames are skipped: depth_00003.png does not fit (an image of 48 x 64 pixels must have the shape of its camera's";
    assert!(notes.contains(said), "{notes}");
}

/// Theorem: of cameras without a size most images say it. The others are skipped by name, the first as any other.
#[test]
fn a_first_image_of_another_size_is_skipped() {
    let camera = image::frame::Camera::sized([525.0; 2], [319.5, 239.5], [640, 480]);
    let mut files = writers::redwood(&Twin::kinect(camera));
    files.change("camera_primesense.json", |json| {
        *json = br#"{"intrinsic_matrix": [52.5, 0, 0, 0, 52.5, 0, 31.5, 23.5, 1]}"#.to_vec();
    });
    let (_keep, path) = files.folder();
    let count = open(&path).unwrap().scans.len();
    let first = "depth/8-000000000000.png";
    files.change(first, |bytes| *bytes = grey16([48, 64], &[1000; 48 * 64]));
    let (_keep, path) = files.folder();
    let set = open(&path).unwrap();
    let said = format!("1 of {count} frames are skipped: {} does not fit", &first[6..]);
    assert!(set.scans.len() == count - 1 && set.notes.concat().contains(&said), "{:?}", set.notes);
}

/// Frames whose pose was lost are passed over and counted.
#[test]
fn poses_of_zeros_are_none() {
    let mut files = writers::nerfstudio(&phone());
    files.change("transforms.json", |json| {
        let mut file: serde_json::Value = serde_json::from_slice(json).unwrap();
        file["frames"][2]["transform_matrix"] =
            serde_json::json!([[0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 1]]);
        *json = file.to_string().into_bytes();
    });
    let (_keep, path) = files.folder();
    let set = open(&path).unwrap();
    assert_eq!(set.scans.len(), FRAMES - 1);
    let said = format!("1 of {} frames have no pose and are passed over", FRAMES + 1);
    assert!(set.notes.iter().any(|note| note.contains(&said)), "{:?}", set.notes);
}

#[test]
fn archives_whose_files_are_hidden_say_so() {
    let refused = |bytes: &[u8], part: &str| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("recording.zip");
        std::fs::write(&path, bytes).unwrap();
        let error = open(&path).unwrap_err().to_string();
        assert!(error.contains("no recording that is known") && error.contains(part), "{error}");
    };
    let inside = writers::record3d(&phone()).archive();
    let mut outer = Files::default();
    outer.put("My scan/scan.r3d", inside.clone());
    refused(&outer.archive(), "it holds another archive, My scan/scan.r3d: unpack it first");
    // The first bit of the flags, of each file's own header and of its line in the list.
    let mut encrypted = inside;
    for (start, flags) in [(b"PK\x03\x04", 6), (b"PK\x01\x02", 8)] {
        for at in 0..encrypted.len() - 8 {
            if encrypted[at..].starts_with(start) {
                encrypted[at + flags] |= 1;
            }
        }
    }
    refused(&encrypted, "of its files are encrypted: unpack it with its password first");
}

/// Theorem: the caller's word on what depths measure counts.
#[test]
fn depths_along_rays_are_read_as_such() {
    let (_keep, path) =
        writers::redwood(&Twin::kinect(image::frame::Camera::sized([525.0; 2], [319.5, 239.5], [640, 480]))).folder();
    let along = ReadOptions { depth: image::range_image::DepthKind::Ray, ..ReadOptions::default() };
    let read = |options: &ReadOptions| {
        let set = open_with(&[&path], options, &Progress::none()).unwrap();
        match set.scans[0].read().unwrap() {
            Content::RangeImage(image) => image,
            _ => panic!("a range image"),
        }
    };
    let (planar, ray) = (read(&ReadOptions::default()), read(&along));
    let valid = (0..planar.len()).find(|&i| planar.is_valid(i)).unwrap();
    let (z, along) = (planar.point_in_sensor(valid).z, ray.point_in_sensor(valid).length());
    assert!((z - along).abs() < 1e-9 && planar.point_in_sensor(valid).length() > z + 1e-3);
}

/// Theorem: a frame whose depth is cut off is skipped with its name said. So is one whose confidence is cut off, of those looked at when
/// the recording is opened. A frame with other images cut off is refused with their name. The others still read.
#[test]
fn damaged_images_are_named() {
    let twin = phone();
    for name in ["depth_00003.png", "conf_00003.png", "frame_00003.jpg"] {
        for tenths in [0, 1, 5, 9] {
            let mut files = writers::scanner_app(&twin);
            files.change(name, |bytes| bytes.truncate(bytes.len() * tenths / 10));
            let (_keep, path) = files.folder();
            let set = open(&path).unwrap();
            if name.ends_with(".png") {
                assert_eq!(set.scans.len(), FRAMES - 1);
                let skipped = format!("1 of 6 frames are skipped: {name} is damaged (");
                let said = set.notes.iter().any(|note| note.contains(&skipped));
                assert!(said && set.scans.iter().all(|scan| scan.read().is_ok()), "{:?}", set.notes);
                continue;
            }
            let error = set.scans[3].read().map(drop).unwrap_err().to_string();
            assert!(error.contains(name), "{tenths} tenths of {name}: {error}");
            assert!(set.scans[0].read().is_ok());
        }
    }
    let mut files = writers::colmap(&twin, true);
    let map = "dense/stereo/depth_maps/f1.jpg.geometric.bin";
    files.change(map, |bytes| bytes.truncate(500));
    let skipped = |files: &Files, why: &str| {
        let (_keep, path) = files.folder();
        let notes = open(&path).unwrap().notes;
        assert!(notes.iter().any(|note| note.contains("1 of 6 frames are skipped") && note.contains(why)), "{notes:?}");
    };
    skipped(&files, "of the 12288 bytes of its pixels: it is damaged or cut off");
    files.change(map, |bytes| *bytes = b"9999999&9999999&1&".to_vec());
    skipped(&files, "are none, or more than max_decoded_gib allows");
}

/// Theorem: a photo that lacks its last bytes is refused, also where a smaller image with an end of its own lies in its header.
#[test]
fn photos_without_their_end_are_refused() {
    let small: Vec<u8> = [&[0xFF, 0xE1, 0, 10][..], &[0xFF, 0xD8, 0xFF, 0xDA, 0, 0, 0xFF, 0xD9]].concat();
    for cut in [1, 2, 3, 20] {
        let mut files = writers::scanner_app(&phone());
        files.change("frame_00003.jpg", |bytes| {
            bytes.splice(2..2, small.iter().copied());
            bytes.truncate(bytes.len() - cut);
        });
        let (_keep, path) = files.folder();
        let error = open(&path).unwrap().scans[3].read().map(drop).unwrap_err().to_string();
        assert!(error.contains("frame_00003.jpg: while decoding: "), "{cut}: {error}");
    }
    let mut whole = writers::scanner_app(&phone());
    whole.change("frame_00003.jpg", |bytes| drop(bytes.splice(2..2, small.iter().copied())));
    let (_keep, path) = whole.folder();
    assert!(read(&path, 3).unwrap().colour.is_some());
}

#[test]
fn numbers_that_are_no_depths() {
    let twin = phone();
    let size = [64, 48];
    let mut files = writers::scanner_app(&twin);
    let mut depths = vec![1000_u16; 64 * 48];
    (depths[100], depths[101], depths[102], depths[103]) = (0, 65535, 4999, 5001);
    files.change("depth_00003.png", |bytes| *bytes = grey16(size, &depths));
    let (_keep, path) = files.folder();
    let image = read(&path, 3).unwrap();
    assert_eq!([100, 101, 102, 103, 104].map(|i| image.is_valid(i)), [false, false, true, false, true]);
    let mut files = writers::colmap(&twin, true);
    let mut floats = vec![1.5_f32; 64 * 48];
    (floats[10], floats[11], floats[12], floats[13]) = (f32::NAN, -2.0, 1e38, f32::INFINITY);
    let map = [b"64&48&1&".to_vec(), floats.iter().flat_map(|x| x.to_le_bytes()).collect()].concat();
    files.change("dense/stereo/depth_maps/f1.jpg.geometric.bin", |bytes| *bytes = map);
    let (_keep, path) = files.folder();
    let image = read(&path, 1).unwrap();
    assert_eq!([10, 11, 12, 13, 14].map(|i| image.is_valid(i)), [false, false, false, false, true]);
}

/// An archive of which a member is made by `add`.
fn archive(files: &Files, add: impl FnOnce(&mut zip::ZipWriter<std::io::Cursor<Vec<u8>>>)) -> Vec<u8> {
    let bytes = std::io::Cursor::new(files.archive());
    let mut zip = zip::ZipWriter::new_append(bytes).unwrap();
    add(&mut zip);
    zip.finish().unwrap().into_inner()
}

fn opened(folder: &Path, archive: &[u8]) -> Result<crate::import::ScanSet> {
    let path = folder.join("recording.r3d");
    std::fs::write(&path, archive).unwrap();
    open(&path)
}

/// Theorem: links and names that lead out of an archive are no files of it, and nothing is written to the disk.
#[test]
fn archives_lead_nowhere() {
    let folder = tempfile::tempdir().unwrap();
    let files = writers::record3d(&phone());
    let options = zip::write::SimpleFileOptions::default;
    let outside = archive(&files, |zip| {
        for name in ["../outside", "/etc/outside", "rgbd/../../outside"] {
            zip.start_file(name, options()).unwrap();
            zip.write_all(b"x").unwrap();
        }
    });
    assert_eq!(opened(folder.path(), &outside).unwrap().scans.len(), FRAMES);
    let names: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(names, ["recording.r3d"]);
    // A colour image that is a link is not there.
    let linked = archive(&writers::record3d(&phone()).without("rgbd/4.jpg"), |zip| {
        zip.add_symlink("rgbd/4.jpg", "/etc/passwd", options()).unwrap();
    });
    let set = opened(folder.path(), &linked).unwrap();
    assert!(set.notes[0].ends_with("6 frames of Record3D, 5 with colour"), "{:?}", set.notes);
}

/// Theorem: what would unpack to more than is allowed or than it can is refused before or while it is unpacked.
#[test]
fn bombs_do_not_unpack() {
    let folder = tempfile::tempdir().unwrap();
    let options = zip::write::SimpleFileOptions::default;
    let bomb = archive(&writers::record3d(&phone()).without("metadata"), |zip| {
        zip.start_file("metadata", options()).unwrap();
        zip.write_all(&vec![b' '; 130 << 20]).unwrap();
    });
    let error = opened(folder.path(), &bomb).unwrap_err().to_string();
    let place = format!("recording.r3d{}metadata: whole file", std::path::MAIN_SEPARATOR);
    assert!(error.contains(&place) && error.contains("are said to unpack to"), "{error}");
    // A depth that unpacks to more than its pixels.
    let mut files = writers::record3d(&phone());
    let mut packed = Vec::new();
    lzfse_rust::encode_bytes(&vec![7; 64 << 20], &mut packed).unwrap();
    files.change("rgbd/2.depth", |bytes| *bytes = packed);
    let notes = opened(folder.path(), &files.archive()).unwrap().notes;
    let said = "2.depth is damaged (it holds more than the 12288 bytes of its pixels)";
    assert!(notes.iter().any(|note| note.contains(said)), "{notes:?}");
    // Sizes that lie.
    let whole = writers::record3d(&phone()).archive();
    for at in (0..whole.len()).step_by(whole.len() / 300) {
        for value in [0, 0xFF, whole[at] ^ 1] {
            let mut damaged = whole.clone();
            damaged[at] = value;
            let outcome = opened(folder.path(), &damaged);
            let outcome = outcome.and_then(|set| set.scans.iter().try_for_each(|scan| scan.read().map(drop)));
            if let Err(error) = outcome {
                assert!(error.to_string().contains("recording.r3d"), "{error}");
            }
        }
    }
}

/// Theorem: cancelling stops opening and unpacking, whenever it is asked for.
#[test]
fn cancelling_stops_unpacking() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("recording.r3d");
    std::fs::write(&path, writers::record3d(&phone()).archive()).unwrap();
    let mut checks = 0;
    while let Err(error) = open_with(&[&path], &ReadOptions::default(), &Progress::cancel_after(checks)) {
        assert!(matches!(error, Error::Cancelled), "after {checks}: {error}");
        checks += 1;
    }
    assert!(checks > 20, "{checks}");
    let set = open(&path).unwrap();
    for checks in 0..3 {
        assert!(matches!(set.scans[1].read_with(&Progress::cancel_after(checks)), Err(Error::Cancelled)));
    }
}

/// Theorem: a `.sens` file cut off anywhere is refused by name, and changed anywhere is read or refused.
#[test]
fn damaged_sens_files() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.sens");
    let whole = writers::sens(&phone(), true);
    for kept in (16..whole.len()).step_by(whole.len() / 150) {
        std::fs::write(&path, &whole[..kept]).unwrap();
        let error = open(&path).unwrap_err().to_string();
        assert!(error.contains("scene.sens: byte "), "{kept}: {error}");
    }
    let mut damaged = whole.clone();
    let end = damaged.len();
    damaged[end - 40..].fill(0);
    std::fs::write(&path, &damaged).unwrap();
    let set = open(&path).unwrap();
    assert_eq!(set.scans.len(), FRAMES - 1);
    assert!(set.notes.iter().any(|note| note.contains("frame 000006 is damaged")), "{:?}", set.notes);
    for at in (0..1200).step_by(7) {
        let mut damaged = whole.clone();
        damaged[at] ^= 0x41;
        std::fs::write(&path, &damaged).unwrap();
        let outcome = open(&path).and_then(|set| set.scans.iter().try_for_each(|scan| scan.read().map(drop)));
        if let Err(error) = outcome {
            assert!(error.to_string().contains("scene.sens"), "{at}: {error}");
        }
    }
}

/// Theorem: the images of a frame survive any damage: any prefix, any byte changed.
#[test]
fn damaged_bytes_are_read_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let twin = phone();
    let record3d = writers::record3d(&twin);
    let (_, metadata) = &record3d.0[0];
    let (_, depth) = &record3d.0[1];
    let nerfstudio = writers::nerfstudio(&twin);
    let (_, transforms) = nerfstudio.0.last().unwrap();
    for whole in [&twin.jpeg(0), &twin.png(1), depth, metadata, transforms] {
        for kept in (0..whole.len()).step_by(1 + whole.len() / 40) {
            crate::import::frames::examine(&whole[..kept], folder.path());
        }
        for at in (0..whole.len()).step_by(1 + whole.len() / 60) {
            let mut damaged = whole.clone();
            damaged[at] ^= 0x55;
            crate::import::frames::examine(&damaged, folder.path());
        }
    }
}

/// Theorem: a hundred thousand files in the folder are no burden, and names that are not UTF-8 are none of the
/// layout's.
#[test]
fn folders_of_many_and_odd_files() {
    let twin = phone();
    let (_keep, path) = writers::scanner_app(&twin).folder();
    // Wine looks through the whole folder for each name that is new in it.
    for k in 0..if cfg!(windows) { 2_000 } else { 100_000 } {
        std::fs::File::create(path.join(format!("photo_{k:06}.heic"))).unwrap();
    }
    #[cfg(unix)]
    {
        use std::os::unix::ffi::OsStrExt;
        for name in [&b"depth_\xff.png"[..], b"frame_\xfe.json"] {
            std::fs::write(path.join(std::ffi::OsStr::from_bytes(name)), b"x").unwrap();
        }
        let odd = path.with_file_name(std::ffi::OsStr::from_bytes(b"odd\xff"));
        std::fs::rename(&path, &odd).unwrap();
        std::fs::rename(&odd, &path).unwrap();
        std::os::unix::fs::symlink(&path, &odd).unwrap();
        assert!(open(&odd).unwrap().scans[2].read().is_ok());
    }
    let begun = std::time::Instant::now();
    let set = open(&path).unwrap();
    assert_eq!(set.scans.len(), FRAMES);
    assert!(begun.elapsed().as_secs() < 20, "{:?}", begun.elapsed());
    assert!(matches!(open_with(&[&path], &ReadOptions::default(), &Progress::cancel_after(10)), Err(Error::Cancelled)));
}
