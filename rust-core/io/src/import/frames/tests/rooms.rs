//! Recordings of a room: a full turn, whose frames nearly all see another part of it, and a hand that moves now faster, now slower.

use std::fmt::Write as _;

use glam::{DAffine3, DMat3, DQuat, DVec3};

use super::layouts::note;
use super::twin::{Files, grey16, rows};
use crate::import::{CameraAxes, PoseSense, ReadOptions, ScanSet, open, open_with};
use base::progress::Progress;

const SIZE: [usize; 2] = [64, 48];
const FOCAL: f64 = 53.0;
const LOW: DVec3 = DVec3::new(-2.0, -1.5, 0.0);
const HIGH: DVec3 = DVec3::new(2.0, 1.5, 2.5);

fn camera() -> String {
    format!(r#"{{"width": 64, "height": 48, "fx": {FOCAL}, "fy": {FOCAL}, "cx": 31.5, "cy": 23.5}}"#)
}

/// A camera that looks at a place.
fn looking(eye: DVec3, at: DVec3) -> DAffine3 {
    let z = (at - eye).normalize();
    let x = z.cross(DVec3::Z).normalize();
    DAffine3 { matrix3: DMat3::from_cols(x, z.cross(x), z), translation: eye }
}

/// Depths of the walls in units of `per_metre`.
fn depths(pose: DAffine3, per_metre: f64) -> Vec<u8> {
    let depth = |i: usize| {
        let through = DVec3::new(((i % 64) as f64 - 31.5) / FOCAL, ((i / 64) as f64 - 23.5) / FOCAL, 1.0);
        let (ray, eye) = (pose.transform_vector3(through), pose.translation);
        let wall = |axis: usize| ((if ray[axis] > 0.0 { HIGH } else { LOW })[axis] - eye[axis]) / ray[axis];
        ((0..3).map(wall).fold(f64::INFINITY, f64::min) * per_metre).round() as u16
    };
    grey16(SIZE, &(0..64 * 48).map(depth).collect::<Vec<_>>())
}

/// A recording in Open3D's form, of poses as they are written and images of depth.
fn open3d(frames: impl IntoIterator<Item = (DAffine3, Vec<u8>)>) -> Files {
    let (mut files, mut log) = (Files::default(), String::new());
    for (k, (written, depth)) in frames.into_iter().enumerate() {
        files.put(format!("depth/{k:06}.png"), depth);
        let matrix = rows(written, " ");
        let words: Vec<&str> = matrix.split(' ').collect();
        writeln!(log, "{k} {k} {}", k + 1).unwrap();
        words.chunks(4).for_each(|row| writeln!(log, "{}", row.join(" ")).unwrap());
    }
    files.put("trajectory.log", log);
    files.put("camera_intrinsic.json", camera());
    files
}

/// A full turn, poses as `written` makes them.
fn turn(frames: usize, written: &dyn Fn(DAffine3) -> DAffine3) -> (Files, Vec<DAffine3>) {
    let pose = |k: usize| {
        let s = std::f64::consts::TAU * k as f64 / frames as f64;
        let eye = DVec3::new(1.1 * s.cos(), 0.8 * s.sin(), 1.3);
        looking(eye, DVec3::new(1.6 * (s + 2.4).cos(), 1.2 * (s + 2.4).sin(), 0.6))
    };
    let poses: Vec<DAffine3> = (0..frames).map(pose).collect();
    (open3d(poses.iter().map(|&pose| (written(pose), depths(pose, 1000.0)))), poses)
}

fn assert_placed(set: &ScanSet, poses: &[DAffine3]) {
    assert_eq!(set.scans.len(), poses.len());
    for (k, (scan, pose)) in set.scans.iter().zip(poses).enumerate() {
        assert!(scan.world_from_sensor.abs_diff_eq(*pose, 1e-5), "{k}: {:?}", set.notes);
    }
}

/// Theorem: however many frames a full turn has, its sense and axes are found.
#[test]
fn conventions_are_found_on_a_full_turn() {
    let turned = DAffine3::from_scale(DVec3::new(1.0, -1.0, -1.0));
    for frames in [20, 60, 150] {
        let ways: [(&str, &dyn Fn(DAffine3) -> DAffine3); 3] = [
            ("y down, looking along z, camera to world (", &|pose| pose),
            ("y down, looking along z, world to camera, not as Open3D", &|pose| pose.inverse()),
            ("y up, looking along -z, camera to world, not as Open3D", &|pose| pose * turned),
        ];
        for (said, written) in ways {
            let (files, poses) = turn(frames, written);
            let (_keep, path) = files.folder();
            let set = open(&path).unwrap();
            note(&set, &format!("poses read as {said}"));
            assert_placed(&set, &poses);
        }
    }
}

/// Theorem: the caller's word on sense and axes counts, and what nothing shows is said.
#[test]
fn poses_are_read_as_the_caller_says() {
    let (files, poses) = turn(20, &|pose| pose.inverse());
    let (_keep, path) = files.folder();
    let opened = |poses, axes| {
        open_with(&[&path], &ReadOptions { poses, axes, ..ReadOptions::default() }, &Progress::none()).unwrap()
    };
    assert_placed(&opened(PoseSense::WorldToCamera, CameraAxes::YDown), &poses);
    assert_placed(&opened(PoseSense::WorldToCamera, CameraAxes::Auto), &poses);
    let wrong = opened(PoseSense::CameraToWorld, CameraAxes::YDown);
    note(&wrong, "poses read as y down, looking along z, camera to world, as was asked for");
    let inverses: Vec<DAffine3> = poses.iter().map(DAffine3::inverse).collect();
    assert_placed(&wrong, &inverses);
    // One wall, seen straight on by cameras that roll: no reading is better than another.
    let rolled = (0..6).map(|k| (DAffine3::from_rotation_z(0.2 * f64::from(k)), grey16(SIZE, &[1500; 64 * 48])));
    let files = open3d(rolled);
    let (_keep, path) = files.folder();
    let set = open(&path).unwrap();
    assert!(set.notes[1].contains("the meaning of the poses is not decided"), "{:?}", set.notes);
}

/// An image of depth as a function of column and row has it, in metres.
fn image(depth: impl Fn(f64, f64) -> f64) -> Vec<u8> {
    let at = |i: usize| (1000.0 * depth((i % 64) as f64, (i / 64) as f64)).round() as u16;
    grey16(SIZE, &(0..64 * 48).map(at).collect::<Vec<_>>())
}

/// Theorem: frames that meet nowhere, each before a wall of its own, are not brought together by another reading.
#[test]
fn frames_that_meet_nowhere_decide_nothing() {
    for (frames, bumps) in [(3, 0.1), (8, 0.05), (12, 0.1), (12, 0.4), (24, 0.1)] {
        let pose = |k: usize| {
            let out = DVec3::X.rotate_z(std::f64::consts::TAU * k as f64 / frames as f64);
            looking(5.5 * out + 1.5 * DVec3::Z, 9.0 * out + 1.5 * DVec3::Z)
        };
        let poses: Vec<DAffine3> = (0..frames).map(pose).collect();
        let wall = |k: usize| image(|x, y| 1.5 + bumps * (x / 4.0 + k as f64).sin() * (y / 5.0 + 2.0 * k as f64).cos());
        let (_keep, path) = open3d((0..frames).map(|k| (poses[k], wall(k)))).folder();
        let set = open(&path).unwrap();
        note(&set, "the meaning of the poses is not decided");
        assert_placed(&set, &poses);
    }
}

/// Theorem: a wrong scale of the depths is not explained by another reading of the poses.
#[test]
fn a_wrong_scale_decides_nothing() {
    let (_, poses) = turn(20, &|pose| pose);
    let (_keep, path) = open3d(poses.iter().map(|&pose| (pose, depths(pose, 100.0)))).folder();
    let set = open(&path).unwrap();
    note(&set, "Look also at the camera and at the scale of the depths");
    assert_placed(&set, &poses);
}

/// Theorem: the sense is found of a camera that moves and never turns.
#[test]
fn a_slider_shows_the_sense() {
    // A curtain with folds, and rods across it.
    let curtain = |from: f64| {
        image(move |x, y| {
            let (u, v) = ((x - 31.5) / FOCAL, (y - 23.5) / FOCAL);
            let fold = |z: f64| 3.0 + 0.25 * (2.0 * (from + u * z)).sin() + 0.2 * (3.0 * v * z).cos();
            (0..60).fold(3.0, |z, _| fold(z))
        })
    };
    let poses: Vec<DAffine3> = (0..8).map(|k| DAffine3::from_translation(0.3 * f64::from(k) * DVec3::X)).collect();
    let seen: Vec<Vec<u8>> = poses.iter().map(|pose| curtain(pose.translation.x)).collect();
    for is_inverse in [false, true] {
        let written = poses.iter().map(|pose| if is_inverse { pose.inverse() } else { *pose });
        let (_keep, path) = open3d(written.zip(seen.iter().cloned())).folder();
        let set = open(&path).unwrap();
        note(
            &set,
            if is_inverse { "world to camera, not as Open3D" } else { "poses read as y down, looking along z, camera" },
        );
        assert_placed(&set, &poses);
    }
}

/// A hand-held recording in TUM's form, whose poses have a clock that is ahead by so many seconds, and are written as `written` makes
/// them.
fn by_hand(ahead: f64, written: &dyn Fn(DAffine3) -> DAffine3) -> (Files, Vec<DAffine3>) {
    let pose = |time: f64| {
        let eye = DVec3::new(0.7 * (1.3 * time).sin(), 0.5 * (0.9 * time + 1.0).sin(), 1.3 + 0.2 * (2.1 * time).sin());
        let base = looking(eye, DVec3::new(1.9, 0.3 + 0.8 * (1.1 * time).sin(), 0.8 + 0.4 * (1.7 * time).sin()));
        base * DAffine3::from_quat(DQuat::from_rotation_z(0.2 * (1.9 * time).sin()))
    };
    let (mut files, mut list, mut poses, mut truth) = (Files::default(), String::new(), String::new(), Vec::new());
    for k in 0..40 {
        let time = 2.0 + 0.15 * f64::from(k);
        writeln!(list, "{time:.4} depth/{time:.4}.png").unwrap();
        files.put(format!("depth/{time:.4}.png"), depths(pose(time), 5000.0));
        truth.push(pose(time));
    }
    for k in 0..1200 {
        let time = -1.0 + 0.01 * f64::from(k);
        let pose = written(pose(time));
        let [x, y, z, w] = DQuat::from_mat3(&pose.matrix3).to_array();
        let t = pose.translation;
        writeln!(poses, "{:.4} {} {} {} {x} {y} {z} {w}", time + ahead, t.x, t.y, t.z).unwrap();
    }
    files.put("depth.txt", list);
    files.put("groundtruth.txt", poses);
    files.put("camera.json", camera());
    (files, truth)
}

/// Theorem: the difference between the clocks of images and poses is found. If they agree nothing is moved.
#[test]
fn clocks_that_differ_are_brought_together() {
    for (ahead, said) in [(0.6, Some("0.600 s later")), (-0.45, Some("0.450 s earlier")), (0.0, None)] {
        // The poses may mean either, as nobody has said.
        let ways: [&dyn Fn(DAffine3) -> DAffine3; 2] = [&|pose| pose, &|pose| pose.inverse()];
        for written in ways {
            let (files, truth) = by_hand(ahead, written);
            let (_keep, path) = files.folder();
            let set = open(&path).unwrap();
            match said {
                Some(said) => drop(note(&set, said)),
                None => assert!(!set.notes.iter().any(|note| note.contains("clock")), "{:?}", set.notes),
            }
            assert_placed(&set, &truth);
        }
    }
    // Further off than is looked for: no shift is made up.
    let (_keep, path) = by_hand(3.7, &|pose| pose).0.folder();
    note(&open(&path).unwrap(), "no shift of time within 3 s brings them together");
    // So far off that no image has a pose.
    let (_keep, path) = by_hand(1000.0, &|pose| pose).0.folder();
    let error = open(&path).unwrap_err().to_string();
    assert!(error.contains("depth.txt lists times from 2.000 to 7.850 s, groundtruth.txt from 999.000"), "{error}");
}
