//! Merges whose tasks are done by several, in any order, at once, and again where they were stopped.
#![allow(clippy::unwrap_used)]

use std::path::Path;
use std::sync::Arc;

use surfrecon::close::{Openings, UpAxis};
use surfrecon::export::WriteOptions;
use surfrecon::geom::bvh::Bvh;
use surfrecon::merge::out_of_core::{LEAST, Stage};
use surfrecon::merge::{MergeParams, ScanSource};
use surfrecon::mesh::shapes::Shape;
use surfrecon::scan::{ScanParams, TurntableViews, bounds, scan, turntable};
use surfrecon::{
    Error, IntoFile, Progress, RangeImage, TaskFolder, end_merge_tasks, merge_task, merge_tasks_to_file, merge_to_file,
};

fn scans() -> Vec<RangeImage> {
    let shape = Shape::Torus { major: 1.0, minor: 0.3 }.mesh(40);
    let tree = Bvh::build(&shape.positions, &shape.triangles, 0).unwrap();
    let table = TurntableViews { around: 5, above: 1, below: 1, pixels: 80, ..TurntableViews::default() };
    let noisy = ScanParams { noise: 0.002, ..ScanParams::default() };
    let cameras = turntable(bounds(&shape.positions).unwrap(), &table, &Progress::none()).unwrap();
    let mut scans: Vec<RangeImage> =
        cameras.iter().map(|camera| scan(&shape, &tree, camera, &noisy, &Progress::none()).unwrap()).collect();
    for (k, scan) in scans.iter_mut().enumerate() {
        let grey = 80 + 10 * k as u8;
        scan.colour = Some(vec![[grey, 128, 200, 255]; scan.rows() * scan.cols()]);
    }
    scans
}

const PARAMS: MergeParams = MergeParams {
    voxel: Some(0.015),
    merge_distance: None,
    max_hole_length: None,
    min_component_share: 0.0,
    match_exposure: true,
    close: Openings::Holes,
    flat_base: false,
    base_up: UpAxis::Z,
    triangulation: surfrecon::triangulate::TriangulateParams {
        edge_limit: None,
        grazing_limit: std::f64::consts::FRAC_PI_2,
    },
    threads: 1,
};

struct Job<'a> {
    sources: Vec<&'a dyn ScanSource>,
    folder: Arc<tempfile::TempDir>,
    tasks: u32,
    keep: bool,
}

impl<'a> Job<'a> {
    fn new(scans: &'a [RangeImage], tasks: u32) -> Self {
        let sources = scans.iter().map(|scan| scan as &dyn ScanSource).collect();
        Job { sources, folder: Arc::new(tempfile::tempdir().unwrap()), tasks, keep: false }
    }

    fn folder(&self) -> TaskFolder<'_> {
        TaskFolder {
            folder: self.folder.path(),
            max_memory: Some(LEAST),
            tasks: self.tasks,
            keep: self.keep,
            has_a_part: false,
        }
    }

    fn task(&self, stage: Stage, number: u32, progress: &Progress<'_>) -> surfrecon::Result<()> {
        merge_task(&self.sources, &PARAMS, self.folder(), (stage, number), progress)
    }

    fn surface(&self) -> Vec<u8> {
        let file = tempfile::tempdir().unwrap().keep().join("surface.ply");
        let write = WriteOptions::default();
        merge_tasks_to_file(&self.sources, &file, &PARAMS, self.folder(), &write, &Progress::none()).unwrap();
        taken(&file)
    }
}

fn taken(file: &Path) -> Vec<u8> {
    let bytes = std::fs::read(file).unwrap();
    std::fs::remove_dir_all(file.parent().unwrap()).unwrap();
    bytes
}

fn by_one(scans: &[RangeImage]) -> Vec<u8> {
    let file = tempfile::tempdir().unwrap().keep().join("surface.ply");
    let sources: Vec<&dyn ScanSource> = scans.iter().map(|scan| scan as &dyn ScanSource).collect();
    let into = IntoFile { max_memory: Some(LEAST), ..IntoFile::default() };
    merge_to_file(&sources, &file, &PARAMS, &into, &Progress::none()).unwrap();
    taken(&file)
}

#[test]
fn tasks_in_any_order_at_once_and_twice_make_the_same_file() {
    let scans = scans();
    let expected = by_one(&scans);
    for tasks in [1, 3, 20] {
        let job = Job::new(&scans, tasks);
        for (k, &stage) in Stage::ALL.iter().enumerate() {
            let count = stage.tasks(tasks);
            // From somewhere in the middle, in steps that meet all.
            let order = (0..count).map(|i| (i * if tasks == 20 { 7 } else { 1 } + k as u32) % count);
            for number in order {
                std::thread::scope(|scope| {
                    for _ in 0..2 {
                        scope.spawn(|| job.task(stage, number, &Progress::none()).unwrap());
                    }
                });
            }
        }
        // Also long after what they need is gone.
        job.task(Stage::Collect, 0, &Progress::none()).unwrap();
        job.task(Stage::Label, tasks - 1, &Progress::none()).unwrap();
        assert!(job.surface() == expected, "{tasks} tasks");
    }
}

/// Theorem: in a folder that is kept merges of more, fewer and other scans make what they make anew.
#[test]
fn scans_come_and_go_in_a_folder_that_is_kept() {
    let scans = scans();
    let mut moved = scans.clone();
    moved[1].world_from_sensor.translation.y += 0.001;
    let folder = Arc::new(tempfile::tempdir().unwrap());
    for scans in [&scans[..], &scans[1..], &moved, &scans] {
        let job = Job { keep: true, folder: folder.clone(), ..Job::new(scans, 3) };
        for &stage in Stage::ALL {
            (0..stage.tasks(3)).for_each(|number| job.task(stage, number, &Progress::none()).unwrap());
        }
        // As often as it is wanted, until it is said that it is there.
        let expected = by_one(scans);
        assert!(job.surface() == expected && job.surface() == expected);
        let left = || folder.path().read_dir().unwrap().map(|file| file.unwrap().file_name().into_string().unwrap());
        assert!(left().any(|name| name.starts_with("done-")));
        end_merge_tasks(&job.sources, &PARAMS, job.folder(), &Progress::none()).unwrap();
        assert!(!left().any(|name| name.starts_with("done-")) && left().any(|name| name.starts_with("segment-")));
    }
}

/// Theorem: merges of other scans in one folder that is kept do not mix: the one that was planned last goes on.
#[test]
fn a_folder_that_is_kept_has_one_merge_at_a_time() {
    let scans = scans();
    let first = Job { keep: true, ..Job::new(&scans, 2) };
    let second = Job { keep: true, folder: first.folder.clone(), ..Job::new(&scans[1..], 2) };
    let none = Progress::none();
    first.task(Stage::Plan, 0, &none).unwrap();
    first.task(Stage::Collect, 0, &none).unwrap();
    second.task(Stage::Plan, 0, &none).unwrap();
    let text = first.task(Stage::Collect, 1, &none).unwrap_err().to_string();
    assert!(text.ends_with("a merge of other scans is at work here: plan this one anew after it"), "{text}");
    for &stage in Stage::ALL {
        (0..stage.tasks(2)).for_each(|number| second.task(stage, number, &none).unwrap());
    }
    assert!(second.surface() == by_one(&scans[1..]));
}

#[test]
fn a_task_that_was_stopped_is_done_again() {
    let scans = scans();
    let expected = by_one(&scans);
    let job = Job::new(&scans, 2);
    for &stage in Stage::ALL {
        for number in 0..stage.tasks(2) {
            let (mut checks, mut stops) = (1, 0);
            while let Err(error) = job.task(stage, number, &Progress::cancel_after(checks)) {
                assert!(matches!(error, Error::Cancelled), "{stage:?}: {error}");
                // A file that a process leaves which is killed while it writes.
                std::fs::write(job.folder.path().join(format!("unfinished-{stops}")), b"half").unwrap();
                (checks, stops) = (3 * checks / 2 + 1, stops + 1);
            }
            assert!(stops > 0, "{stage:?}");
        }
    }
    assert!(job.surface() == expected);
}

#[test]
fn what_is_not_done_yet_is_named() {
    let scans = scans();
    let job = Job::new(&scans, 3);
    let said = |stage, number| job.task(stage, number, &Progress::none()).unwrap_err().to_string();
    assert!(said(Stage::Collect, 0).contains("plan 0 of 1 tasks is not done: do it first"));
    assert_eq!(said(Stage::Collect, 3), "there is no task 3 of collect, which has only 3");
    job.task(Stage::Plan, 0, &Progress::none()).unwrap();
    for number in [0, 2] {
        job.task(Stage::Collect, number, &Progress::none()).unwrap();
    }
    assert!(said(Stage::Overlap, 0).contains("collect 1 of 3 tasks is not done: do it first"));
    assert!(said(Stage::Build, 0).contains("label 0 of 3 tasks is not done: do it first"));
    let nowhere = job.folder.path().join("nowhere");
    let folder = TaskFolder { folder: &nowhere, ..job.folder() };
    let refused = merge_task(&job.sources, &PARAMS, folder, (Stage::Plan, 0), &Progress::none()).unwrap_err();
    assert!(refused.to_string().ends_with("nowhere: tasks need a folder that exists"), "{refused}");
    // Scans of another number.
    let refused = merge_task(&job.sources[1..], &PARAMS, job.folder(), (Stage::Collect, 1), &Progress::none());
    assert!(refused.unwrap_err().to_string().ends_with("was planned for 7 scans, not for 6: plan it anew"));
}

#[test]
fn what_is_cut_off_or_flipped_is_told() {
    let scans = scans();
    for (stage, kind) in [
        (Stage::Overlap, "segment-"),
        (Stage::Fuse, "segment-"),
        (Stage::Fuse, "done-collect-"),
        (Stage::Look, "block-"),
        (Stage::Drop, "votes-"),
        (Stage::Label, "block-"),
        (Stage::Build, "labels-"),
    ] {
        for cut in [false, true] {
            let job = Job::new(&scans, 1);
            let before = Stage::ALL.iter().take_while(|&&before| before != stage);
            before.for_each(|&before| job.task(before, 0, &Progress::none()).unwrap());
            let mut damaged = 0;
            for file in job.folder.path().read_dir().unwrap().map(|file| file.unwrap().path()) {
                let name = file.file_name().unwrap().to_str().unwrap().to_owned();
                if name.starts_with(kind) {
                    let mut bytes = std::fs::read(&file).unwrap();
                    if cut {
                        bytes.truncate(bytes.len() / 2);
                    } else {
                        bytes.iter_mut().for_each(|byte| *byte ^= 4);
                    }
                    std::fs::write(&file, bytes).unwrap();
                    damaged += 1;
                }
            }
            assert!(damaged > 0, "{kind}");
            let told = job.task(stage, 0, &Progress::none()).unwrap_err().to_string();
            assert!(told.contains(kind) && told.contains("is damaged"), "{told}");
        }
    }
}
