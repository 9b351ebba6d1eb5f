//! Faults that a recording of any layout withstands: images that are missing, cut off or of another size, archives of many and odd files,
//! disks that fail.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use super::twin::{FRAMES, Files, Twin, grey16};
use super::writers;
use crate::import::{Content, FileScan, PhotoOptions, ReadOptions, faults_tests, open, photos};
use base::context::{Context, choose};
use base::error::Result;
use base::log::Log;
use base::progress::Progress;
use image::frame::Camera;
use image::photo::Photo as _;
use image::range_image::RangeImage;
use image::source::ScanSource as _;

/// A twin of each layout that is a folder, with its name.
fn layouts() -> Vec<(&'static str, Files)> {
    let phone = Twin::phone();
    let kinect = |focal: [f64; 2], centre: [f64; 2]| Twin::kinect(Camera::sized(focal, centre, [640, 480]));
    let usual = kinect([525.0, 525.0], [319.5, 239.5]);
    vec![
        ("7-Scenes", writers::seven_scenes(&kinect([585.0, 585.0], [320.0, 240.0]))),
        ("TUM", writers::tum(&usual)),
        ("Redwood", writers::redwood(&usual)),
        ("ICL-NUIM", writers::icl_in_form_of_tum(&kinect([481.2, -480.0], [319.5, 239.5]))),
        ("nerfstudio", writers::nerfstudio(&phone)),
        ("Polycam", writers::polycam(&phone, true)),
        ("Record3D", writers::record3d(&phone)),
        ("Record3D's EXR", writers::record3d_exr(&phone)),
        ("3D Scanner App", writers::scanner_app(&phone)),
        ("Stray Scanner", writers::stray(&phone)),
        ("COLMAP", writers::colmap(&phone, true)),
    ]
}

/// Whether a file is an image of a frame, not a list.
fn is_image(name: &str) -> bool {
    [".png", ".jpg", ".depth", ".conf", ".exr", "geometric.bin"].iter().any(|ending| name.ends_with(ending))
}

/// The photos of a recording with one damaged file are those of the others, with all their depths but one.
fn photos_withstand(path: &Path, layout: &str, file: &str, about: &str) {
    let set = photos(path, &PhotoOptions::default(), &ReadOptions::default(), &Progress::none());
    let set = match set {
        Err(error) => {
            assert!(layout == "Stray Scanner" && error.to_string().contains("no photo"), "{about}: {error}");
            return;
        }
        Ok(set) => set,
    };
    // 3D Scanner App's twin has two photos alone.
    let count = if layout == "3D Scanner App" { 2 } else { FRAMES };
    let whole = set.photos.iter().filter(|photo| match photo.pixels() {
        Ok(_) => true,
        Err(error) => {
            assert!(error.to_string().contains(file), "{about}: {error}");
            false
        }
    });
    let with_depths = whole.filter(|photo| photo.depths().unwrap().is_some()).count();
    assert!(with_depths + 1 >= count, "{about}: {with_depths}");
    let kept = set.photos.len();
    assert!(kept + 1 >= count, "{about}: {kept} photos, {:?}", set.notes);
}

/// Theorem: of any layout, any image may be missing, empty or cut off: the recording opens, the frame is passed over or its error names the
/// file, and the others read as before.
#[test]
fn any_image_may_be_missing_or_cut_off() {
    for (layout, files) in layouts() {
        let (_keep, path) = files.folder();
        let whole: Vec<String> = open(&path)
            .and_then(|set| set.scans.iter().map(|scan| Ok(format!("{}{:?}", scan.name, scan.read()?))).collect())
            .unwrap_or_else(|error| panic!("{layout}: {error}"));
        let images: Vec<&(String, Vec<u8>)> = files.0.iter().filter(|(name, _)| is_image(name)).collect();
        assert!(images.len() >= FRAMES, "{layout}");
        for (name, bytes) in images.iter().step_by(1 + images.len() / 7) {
            let file = name.rsplit('/').next().unwrap();
            for tenths in [None, Some(0), Some(5), Some(9)] {
                match tenths {
                    None => std::fs::remove_file(path.join(name)).unwrap(),
                    Some(tenths) => std::fs::write(path.join(name), &bytes[..bytes.len() * tenths / 10]).unwrap(),
                }
                let about = format!("{layout}, {name}, {tenths:?} tenths");
                let named = |error: base::error::Error| {
                    let error = error.to_string();
                    assert!(error.contains(file), "{about}: {error}");
                };
                match open(&path) {
                    // Whose number is no other's only if images before and after it are there.
                    Err(error) if layout == "Redwood" && (file.starts_with("8-") || file.starts_with("13-")) => {
                        assert!(
                            tenths.is_none() && error.to_string().contains("do not number them"),
                            "{about}: {error}"
                        );
                    }
                    Err(error) => panic!("{about}: {error}"),
                    Ok(set) => {
                        photos_withstand(&path, layout, file, &about);
                        let mut same = 0;
                        for scan in &set.scans {
                            match scan.read() {
                                Ok(content) => {
                                    same += usize::from(whole.contains(&format!("{}{content:?}", scan.name)))
                                }
                                Err(error) => named(error),
                            }
                        }
                        assert!(same + 1 >= whole.len(), "{about}: {same} of {} as before", whole.len());
                    }
                }
            }
            std::fs::write(path.join(name), bytes).unwrap();
        }
    }
}

/// Theorem: what takes many frames goes on where images are damaged within: without the colours, or without the frame, and the log is
/// told once. Who reads that frame alone has an error.
#[test]
fn damage_within_is_left_out_of_many() {
    for (name, samples, said) in [
        ("depth_00003.png", false, "frame_00003 is skipped: "),
        ("conf_00003.png", false, "frame_00003 is skipped: "),
        ("frame_00003.jpg", true, "frame_00003 is read without colours: "),
    ] {
        let (_keep, path) = writers::scanner_app(&Twin::phone()).folder();
        let set = open(&path).unwrap();
        assert_eq!(set.scans.len(), FRAMES);
        let image = |scan: &FileScan| -> Result<(usize, bool)> {
            let image = scan.image(&Progress::none())?.unwrap();
            Ok((image.valid_count(), image.colour.is_some()))
        };
        let whole: Vec<(usize, bool)> = set.scans.iter().map(|scan| image(scan).unwrap()).collect();
        assert!(whole[3].0 > 0 && whole[3].1);
        // Of so few frames opening decodes all, and finds damage that is there by then.
        let bytes = std::fs::read(path.join(name)).unwrap();
        std::fs::write(path.join(name), &bytes[..bytes.len() / 2]).unwrap();
        assert!(set.scans[3].read().map(drop).unwrap_err().to_string().contains(name), "{name}");
        let heard = Arc::new(Mutex::new(Vec::new()));
        let listener = heard.clone();
        let context = Context::new().unwrap();
        context.set_log(Log::To(Arc::new(move |_, text: &str| listener.lock().unwrap().push(text.to_owned()))));
        choose(Some(context));
        let found = base::memory::guarded(|| -> Result<Vec<(usize, bool)>> {
            set.scans.iter().try_for_each(|scan| image(scan).map(drop))?;
            set.scans.iter().map(image).collect()
        });
        choose(None);
        let mut expected = whole.clone();
        expected[3] = (if samples { whole[3].0 } else { 0 }, false);
        assert_eq!(found.unwrap(), expected, "{name}");
        let heard = heard.lock().unwrap();
        assert!(heard.len() == 1 && heard[0].starts_with(said) && heard[0].contains(name), "{heard:?}");
        let damages: Vec<String> = set.scans.iter().filter_map(|scan| scan.damage()).collect();
        assert!(damages.len() == 1 && heard[0] == format!("frame_00003 {}", damages[0]), "{damages:?}");
    }
}

/// Theorem: frames of one recording may have images of different sizes: each sees what its camera saw, scaled.
#[test]
fn sizes_that_differ_are_read_by_the_same_camera() {
    let twin = Twin::phone();
    let mut files = writers::scanner_app(&twin);
    // Every second row and column, whose middle lies where the larger pixel's does but for half of a pixel of the larger.
    let truth = &twin.depths[3];
    let half: Vec<u16> = (0..24 * 32).map(|i| twin.whole(3, 1000.0)[i / 32 * 2 * 64 + i % 32 * 2]).collect();
    files.change("depth_00003.png", |bytes| *bytes = grey16([32, 24], &half));
    let (_keep, path) = files.folder();
    let set = open(&path).unwrap();
    let Content::RangeImage(small) = set.scans[3].read().unwrap() else { panic!("a range image") };
    let Content::RangeImage(large) = set.scans[0].read().unwrap() else { panic!("a range image") };
    assert_eq!(([small.rows(), small.cols()], [large.rows(), large.cols()]), ([24, 32], [48, 64]));
    assert!(small.valid_count() > 200 && small.colour.is_some());
    for i in (0..small.len()).filter(|&i| small.is_valid(i)) {
        let at = |image: &RangeImage, i: usize| {
            let point = image.point_in_sensor(i);
            [point.x / point.z, point.y / point.z, point.z]
        };
        let (found, near) = (at(&small, i), at(truth, i / 32 * 2 * 64 + i % 32 * 2));
        // Half a pixel of the larger image.
        let apart = [0, 1].map(|axis| (found[axis] - near[axis]) * twin.camera.focal[axis]);
        assert!(apart.iter().all(|apart| (apart - 0.5).abs() < 1e-6), "{apart:?}");
        assert!((found[2] - near[2]).abs() < 0.00051);
    }
}

/// Theorem: names in an archive that are not UTF-8 are none of the layout's, and a hundred thousand files are no burden.
#[test]
fn archives_of_many_and_odd_files() {
    let bytes = std::io::Cursor::new(writers::record3d(&Twin::phone()).archive());
    let mut zip = zip::ZipWriter::new_append(bytes).unwrap();
    let stored = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    for k in 0..100_000 {
        zip.start_file(format!("photos/{k:06}.heic"), stored).unwrap();
    }
    zip.start_file("rgbd/@@.depth", stored).unwrap();
    zip.write_all(b"x").unwrap();
    let mut bytes = zip.finish().unwrap().into_inner();
    let (odd, mut replaced) = (*b"rgbd/\xff\xfe.depth", 0);
    for at in 0..bytes.len() - odd.len() {
        if bytes[at..].starts_with(b"rgbd/@@.depth") {
            bytes[at..at + odd.len()].copy_from_slice(&odd);
            replaced += 1;
        }
    }
    assert_eq!(replaced, 2);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("recording.r3d");
    std::fs::write(&path, bytes).unwrap();
    let begun = std::time::Instant::now();
    let set = open(&path).unwrap();
    assert_eq!(set.scans.len(), FRAMES, "{:?}", set.notes);
    assert!(set.scans[5].read().is_ok());
    assert!(begun.elapsed().as_secs() < 20, "{:?}", begun.elapsed());
}

/// Theorem: as of files, any read of a recording in a folder may fail: of its lists, and of each kind of image.
#[test]
fn any_read_of_a_folder_may_fail() {
    let folder = tempfile::tempdir().unwrap();
    // Of one frame, since each of hundreds of reads takes reading all.
    let others: Vec<String> =
        (1..FRAMES).flat_map(|k| [format!("{k:05}."), format!("f{k}.jpg"), format!("{}.", 1305031453 + k)]).collect();
    let is_of_others = |name: &str| others.iter().any(|other| name.contains(other));
    let sets: Vec<Vec<PathBuf>> = layouts()
        .into_iter()
        .filter(|(layout, _)| ["TUM", "3D Scanner App", "COLMAP"].contains(layout))
        .map(|(layout, files)| {
            let path = folder.path().join(layout);
            Files(files.0.into_iter().filter(|(name, _)| !is_of_others(name)).collect()).write(&path);
            vec![path]
        })
        .collect();
    faults_tests::check(folder.path(), sets);
}
