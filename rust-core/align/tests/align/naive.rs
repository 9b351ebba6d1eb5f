//! A naive twin: every pose of a grid is tried, nothing of the library's search, features, or sight is used.

use base::progress::Progress;
use glam::{DAffine3, DQuat, DVec3, EulerRot};
use image::RangeImage;
use image::source::ScanSource as _;
use surfrecon_align::Constraints;

use crate::scans::{PIXELS, aligned, look, statue, without_poses};

/// Turns by so many degrees, shifts by so much of the object.
const TURN: f64 = 20.0;
const SHIFT: f64 = 0.12;
/// The height that the sensors of [`look`] see, as the tangent of half of it.
const HALF: f64 = 0.2;

struct Scan {
    points: Vec<DVec3>,
    normals: Vec<DVec3>,
    middle: DVec3,
    /// By pixel. Infinite where nothing came back.
    depths: Vec<f64>,
}

impl Scan {
    fn new(image: &RangeImage) -> Self {
        let points = image.oriented_points(&Progress::none()).unwrap();
        let normals: Vec<DVec3> = points.areas.iter().map(|area| area.normalize()).collect();
        let middle = points.positions.iter().sum::<DVec3>() / points.positions.len() as f64;
        let mut scan = Scan { points: points.positions, normals, middle, depths: vec![f64::INFINITY; PIXELS * PIXELS] };
        for k in 0..scan.points.len() {
            let pixel = Scan::pixel(scan.points[k]).unwrap();
            scan.depths[pixel] = scan.points[k].z;
        }
        scan
    }

    fn pixel(at: DVec3) -> Option<usize> {
        let place = |x: f64| (PIXELS as f64 / 2.0 * (1.0 + x / at.z / HALF)).floor();
        let (col, row) = (place(at.x), place(at.y));
        let is_in = |x: f64| (0.0..PIXELS as f64).contains(&x);
        (at.z > 0.0 && is_in(col) && is_in(row)).then(|| row as usize * PIXELS + col as usize)
    }

    /// Evidence for a point of another scan here, and against it.
    fn says(&self, at: DVec3, normal: DVec3, off: f64) -> f64 {
        let Some(pixel) = Scan::pixel(at) else { return 0.0 };
        let depth = self.depths[pixel];
        if !depth.is_finite() {
            return 0.0;
        }
        let slant = normal.dot(at.normalize()).abs();
        if (depth - at.z).abs() * slant < off {
            let facing = normal.dot(at.normalize()) < 0.0;
            return if facing { 1.0 } else { -1.0 };
        }
        if slant > 0.3 && depth > at.z + off / slant { -2.0 } else { 0.0 }
    }
}

fn score(scans: &[Scan; 2], a_from_b: &DAffine3, step: usize, off: f64) -> f64 {
    let b_from_a = a_from_b.inverse();
    let side = |mine: &Scan, other: &Scan, motion: &DAffine3| -> f64 {
        let says = |k: usize| {
            other.says(motion.transform_point3(mine.points[k]), motion.transform_vector3(mine.normals[k]), off)
        };
        (0..mine.points.len()).step_by(step).map(says).sum::<f64>() * step as f64
    };
    side(&scans[1], &scans[0], a_from_b) + side(&scans[0], &scans[1], &b_from_a)
}

/// The best pose of the grid, made better by steps that halve.
fn best(scans: &[Scan; 2], size: f64) -> DAffine3 {
    let turns = (360.0 / TURN) as i32;
    let shifts = (0.4 / SHIFT).round() as i32;
    let mut found: Vec<(f64, DAffine3)> = Vec::new();
    for (x, y, z) in (0..turns).flat_map(|x| (0..=turns / 2).flat_map(move |y| (0..turns).map(move |z| (x, y, z)))) {
        let angle = |k: i32| (f64::from(k) * TURN).to_radians();
        let turn = DQuat::from_euler(EulerRot::ZYZ, angle(x), angle(y), angle(z));
        for shift in 0..(2 * shifts + 1).pow(2) {
            let by = |k: i32| f64::from(k - shifts) * SHIFT * size;
            let across = DVec3::new(by(shift % (2 * shifts + 1)), by(shift / (2 * shifts + 1)), 0.0);
            for along in [-0.15, 0.0, 0.15] {
                let to = scans[0].middle + across + DVec3::Z * along * size;
                let motion = DAffine3::from_translation(to)
                    * DAffine3::from_quat(turn)
                    * DAffine3::from_translation(-scans[1].middle);
                found.push((score(scans, &motion, 97, 0.04 * size), motion));
            }
        }
    }
    found.sort_by(|x, y| y.0.total_cmp(&x.0));
    found.truncate(60);
    let refined = found.into_iter().map(|(_, start)| climbed(scans, start, size));
    refined.max_by(|x, y| x.0.total_cmp(&y.0)).unwrap().1
}

/// Steps along and about the axes as long as they make it better.
fn climbed(scans: &[Scan; 2], start: DAffine3, size: f64) -> (f64, DAffine3) {
    let mut motion = start;
    let mut last = 0.0;
    for level in 0..6 {
        let by = 0.06 * 0.5_f64.powi(level);
        let off = (0.6 * by * size).max(0.006 * size);
        let step = [41, 23, 11][level.min(2) as usize];
        last = score(scans, &motion, step, off);
        for _ in 0..12 {
            let middle = motion.transform_point3(scans[1].middle);
            let moves = [DVec3::X, DVec3::Y, DVec3::Z].into_iter().flat_map(|axis| [axis, -axis]).flat_map(|axis| {
                let turn = DAffine3::from_axis_angle(axis, 2.0 * by);
                let about = DAffine3::from_translation(middle) * turn * DAffine3::from_translation(-middle);
                [about, DAffine3::from_translation(by * size * axis)]
            });
            let tried = moves.map(|step_by| step_by * motion).map(|moved| (score(scans, &moved, step, off), moved));
            let (value, moved) = tried.max_by(|x, y| x.0.total_cmp(&y.0)).unwrap();
            if value <= last {
                break;
            }
            (last, motion) = (value, moved);
        }
    }
    (last, motion)
}

#[test]
fn a_search_over_a_grid_of_poses_finds_the_same() {
    let mut compared = 0;
    for (from, to) in [
        (DVec3::new(1.0, 0.1, 0.4), DVec3::new(0.7, 0.7, 0.3)),
        (DVec3::new(-1.0, 0.4, 0.2), DVec3::new(-0.6, -0.5, 0.6)),
    ] {
        let images = [look(statue(), from, 0.4, 0.0), look(statue(), to, 1.3, 0.0)];
        let alignment = aligned(&without_poses(&images), &Constraints::default());
        let [Some(a), Some(b)] = alignment.world_from_scan[..] else { continue };
        let found = a.inverse() * b;
        let scans = [Scan::new(&images[0]), Scan::new(&images[1])];
        let naive = best(&scans, 1.0);
        let off = |p: &DVec3| found.transform_point3(*p).distance(naive.transform_point3(*p));
        let worst = scans[1].points.iter().map(off).fold(0.0, f64::max);
        assert!(worst < 0.12, "{worst}");
        let [ours, theirs] = [found, naive].map(|motion| score(&scans, &motion, 1, 0.006));
        assert!(ours > 0.97 * theirs, "{ours} {theirs}");
        compared += 1;
    }
    assert!(compared > 0, "nothing was placed");
}
