//! Poses of a sequence of images: Open3D's log and TUM's list, both camera to world.
//!
//! ```text
//! Open3D   k k k+1            TUM   # timestamp tx ty tz qx qy qz qw
//!          4 x 4 matrix             1305031102.1758 1.3405 0.6266 1.6575 0.6574 0.6126 -0.2949 -0.3248
//! ```

use std::path::Path;

use glam::{DAffine3, DMat3, DQuat, DVec3};

use super::text::{Lines, lines_of};
use super::{Scan, file, pose};
use base::error::{Error, Result};

/// Most seconds between an image and its pose.
pub(super) const APART: f64 = 0.02;

/// Poses in the order of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Trajectory {
    poses: Vec<DAffine3>,
    /// Their times in seconds, for TUM's lists; ascending.
    times: Option<Vec<f64>>,
}

/// Whether a file that starts like this is one.
pub(super) fn sniff(start: &[u8]) -> bool {
    let text = String::from_utf8_lossy(start);
    let mut lines = lines_of(&text).map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    let numbers = |line: Option<&str>| -> Vec<f64> {
        line.unwrap_or("").split_ascii_whitespace().map_while(|word| word.parse().ok()).collect()
    };
    let first = numbers(lines.next());
    if first.len() == 3 && first.iter().all(|x: &f64| x.fract() == 0.0) {
        let rows: Vec<Vec<f64>> = (0..4).map(|_| numbers(lines.next())).collect();
        return rows.iter().all(|row| row.len() == 4) && rows[3] == [0.0, 0.0, 0.0, 1.0];
    }
    // A unit quaternion at the end of eight numbers.
    first.len() == 8 && (first[4..].iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-2
}

/// Reads a file of poses.
pub(super) fn read(path: &Path) -> Result<Trajectory> {
    let (file, length) = file::open(path)?;
    parse(Lines::new(file, length, path))
}

/// Parses the lines of a file.
pub(super) fn parse(mut lines: Lines<'_>) -> Result<Trajectory> {
    let mut trajectory = Trajectory::default();
    let mut times: Vec<f64> = Vec::new();
    let mut numbers: Vec<f64> = Vec::new();
    while lines.next_content()? {
        if lines.rest().starts_with(b"#") {
            continue;
        }
        let mut row = [0.0; 8];
        let mut count = 0;
        while !lines.is_done() && count < 8 {
            row[count] = lines.f64("a number")?;
            count += 1;
        }
        if count == 3 {
            numbers.push(row[0]);
            trajectory.poses.push(matrix(&mut lines)?);
        } else if count == 8 && lines.is_done() {
            if !row.iter().all(|x| x.is_finite()) || times.last().is_some_and(|last| *last > row[0]) {
                return Err(lines.fail("expected finite numbers, times ascending"));
            }
            let quaternion = DQuat::from_xyzw(row[4], row[5], row[6], row[7]);
            if !((quaternion.length_squared() - 1.0).abs() < 0.02) {
                return Err(lines.fail("the quaternion (the last four numbers) does not have unit length"));
            }
            let rotation = DMat3::from_quat(quaternion.normalize());
            let translation = DVec3::new(row[1], row[2], row[3]);
            trajectory.poses.push(DAffine3 { matrix3: rotation, translation });
            times.push(row[0]);
        } else {
            let problem = "expected three whole numbers and a 4 x 4 matrix (Open3D) or eight numbers (TUM)";
            return Err(lines.fail(problem));
        }
        if !times.is_empty() && times.len() != trajectory.poses.len() {
            return Err(lines.fail("poses with and without a time are mixed"));
        }
    }
    if trajectory.poses.is_empty() {
        return Err(lines.fail("there is no pose"));
    }
    // A log numbers its images, in any order; some write the same number for all.
    let mut order: Vec<usize> = (0..numbers.len()).collect();
    order.sort_by(|&a, &b| numbers[a].total_cmp(&numbers[b]));
    if order.windows(2).all(|pair| numbers[pair[0]] < numbers[pair[1]]) && !order.is_empty() {
        trajectory.poses = order.into_iter().map(|k| trajectory.poses[k]).collect();
    }
    trajectory.times = (!times.is_empty()).then_some(times);
    Ok(trajectory)
}

fn matrix(lines: &mut Lines<'_>) -> Result<DAffine3> {
    let mut rows = [0.0; 16];
    for row in rows.chunks_exact_mut(4) {
        lines.expect_line("a row of a 4 x 4 matrix")?;
        for value in row {
            *value = lines.f64("a number of a 4 x 4 matrix")?;
        }
        if !lines.is_done() {
            return Err(lines.expected("the end of the line: a row has four numbers"));
        }
    }
    pose::from_rows(&rows).map_err(|problem| lines.fail(problem))
}

impl Trajectory {
    /// The poses in their order.
    pub(super) fn poses(&self) -> &[DAffine3] {
        &self.poses
    }

    /// The pose nearest in time, within [`APART`].
    pub(super) fn at(&self, time: f64) -> Option<DAffine3> {
        let times = self.times.as_ref()?;
        let after = times.partition_point(|t| *t < time);
        let near = [after.wrapping_sub(1), after].into_iter().filter(|&i| i < times.len());
        let nearest = near.min_by(|&a, &b| (times[a] - time).abs().total_cmp(&(times[b] - time).abs()))?;
        ((times[nearest] - time).abs() <= APART).then(|| self.poses[nearest])
    }

    /// Places scans, by the times in their names or in their order; a note that says so.
    pub(super) fn place(&self, scans: &mut [Scan], path: &Path) -> Result<Option<String>> {
        let (name, count) = (file::name(path), self.poses.len());
        if self.times.is_some()
            && let Some(taken) = scans.iter().map(|scan| scan.name.parse::<f64>().ok()).collect::<Option<Vec<f64>>>()
        {
            for (scan, time) in scans.iter_mut().zip(taken) {
                scan.world_from_sensor = self.at(time).ok_or_else(|| {
                    let problem = format!("no pose lies within {APART} s of {}", scan.name);
                    Error::format(path, "whole file", problem)
                })?;
            }
            return Ok(Some(format!("{name}: placed {} scans by the times in their names", scans.len())));
        }
        if scans.len() != count {
            let problem = format!(
                "{count} poses for {} scans, whose names are not times: open as many scans as there are poses, in order",
                scans.len()
            );
            return Err(Error::format(path, "whole file", problem));
        }
        for (scan, pose) in scans.iter_mut().zip(&self.poses) {
            scan.world_from_sensor = *pose;
        }
        Ok(Some(format!("{name}: placed {count} scans in their order")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Trajectory> {
        parse(Lines::new(text.as_bytes(), text.len() as u64, Path::new("t")))
    }

    const LOG: &str = "0 0 1\n1 0 0 1\n0 1 0 2\n0 0 1 3\n0 0 0 1\n1 1 2\n0 -1 0 0\n1 0 0 0\n0 0 1 0\n0 0 0 1\n";
    const TUM: &str = "# t\n10.00 1 2 3 0 0 0 1\r\n10.05 1 1 1 0 0 1 0\n";

    #[test]
    fn both_forms() {
        assert!(sniff(LOG.as_bytes()) && sniff(TUM.as_bytes()));
        assert!(!sniff(b"1 2 3\n1 2 3\n") && !sniff(b"1 2 3 4 5 6 7 8\n") && !sniff(b"") && !sniff(b"ply"));
        let log = read(LOG).unwrap();
        assert_eq!(log.poses[0].translation, DVec3::new(1.0, 2.0, 3.0));
        assert_eq!(log.poses[1].transform_point3(DVec3::X), DVec3::Y);
        let tum = read(TUM).unwrap();
        assert_eq!(tum.poses[1].transform_point3(DVec3::X), DVec3::new(0.0, 1.0, 1.0));
        let scan = |name: &str| Scan { name: name.to_owned(), ..Scan::new(Path::new("x")) };
        let mut scans = [scan("10.049"), scan("10.011"), scan("10.04")];
        assert!(tum.place(&mut scans, Path::new("t")).unwrap().unwrap().contains("placed 3 scans by the times"));
        assert_eq!(scans.each_ref().map(|s| s.world_from_sensor == tum.poses[1]), [true, false, true]);
        assert!(tum.place(&mut [scan("12")], Path::new("t")).unwrap_err().to_string().contains("within 0.02 s of 12"));
        let mut named = [scan("a"), scan("b")];
        log.place(&mut named, Path::new("t")).unwrap();
        assert_eq!(named[1].world_from_sensor, log.poses[1]);
        assert!(log.place(&mut named[..1], Path::new("t")).unwrap_err().to_string().contains("2 poses for 1 scans"));
    }

    #[test]
    fn what_is_wrong_has_a_line() {
        for (text, problem) in [
            ("", "line 1: there is no pose"),
            ("0 0 1\n1 0 0 0\n", "line 2: the file ends; expected a row"),
            ("0 0 1\n1 0 0\n", "line 2: the line ends; expected a number of a 4 x 4 matrix"),
            ("1 2\n", "line 1: expected three whole numbers"),
            ("1 2 3 4 5 6 7 8\n", "line 1: the quaternion"),
            ("1 x\n", "line 1: expected a number, found `x`"),
            ("2 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n", "line 2: expected finite numbers, times ascending"),
            ("0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1 5\n", "line 5: expected the end of the line"),
        ] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains(problem), "{error}");
        }
    }
}
