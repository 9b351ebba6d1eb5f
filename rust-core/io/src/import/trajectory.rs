//! Poses of a sequence of images, camera to world but for ARKitScenes'.
//!
//! ```text
//! Open3D          k k k+1
//!                 4 x 4 matrix
//! TUM             timestamp tx ty tz qx qy qz qw
//! RTAB-Map        timestamp tx ty tz qx qy qz qw id
//! Replica, KITTI  16 or 12 numbers of a matrix, row by row
//! many            tx ty tz qx qy qz qw
//! ScanNet         4 x 4 matrix, the only one of the file
//! ARKitScenes     timestamp rx ry rz tx ty tz: a rotation vector, world to camera; by the ending .traj
//! tables          timestamp,tx,ty,tz,qx,qy,qz,qw: TUM's, with commas
//! ```

use std::io::Read;
use std::path::Path;

use glam::{DAffine3, DMat3, DQuat, DVec3};
use rustc_hash::FxHashSet;

use super::listed_scan::{Comment, ListedScan};
use super::numbering::{TIMES_FROM, number_in};
use super::options::ReadOptions;
use super::options::{CameraAxes, PoseSense};
use super::text::{Lines, lines_of, whole_lines};
use super::{file, pose};
use base::error::{Error, Result};
use image::frame::TURNED;

/// Most seconds between an image and its pose.
pub(super) const APART: f64 = 0.02;

/// Bytes by which commas between numbers are known.
const LOOKED_AT: usize = 4096;

/// Bytes by which a text is told from points.
const LOOKED_AT_TO_TELL: usize = 1 << 20;

/// Largest difference from 1 of the length of a list's quaternion.
const UNIT_WITHIN: f64 = 0.01;

/// Most numbers of a line: those of a matrix.
const MOST: usize = 16;

/// The ending of ARKitScenes' lists, whose numbers could be anything.
pub(super) const AXIS_ANGLE: &str = "traj";

/// The ending of the lists that are written here. Others end in .txt.
const WRITTEN: &str = "tum";

/// Poses in the order of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Trajectory {
    poses: Vec<DAffine3>,
    /// Their times in seconds, where lines begin with them. Ascending.
    times: Option<Vec<f64>>,
    /// Numbers of the images, where lines end with them.
    ids: Vec<i64>,
    /// Numbers that the list gives its images, each of another one: its times if these are no clock's, its ids, or those in the headers
    /// of a log. These may be of two kinds.
    numbers: Vec<Vec<f64>>,
    /// Whether it is a log.
    is_log: bool,
    /// The scans that they are of, where comments say it. Each is another one.
    scans: Option<Vec<ListedScan>>,
    /// Whether the file has them world to camera. Here they are inverted.
    is_world_to_camera: bool,
}

/// Whether a file that starts like this is one.
pub(super) fn sniff(start: &[u8]) -> bool {
    let text = String::from_utf8_lossy(start);
    let mut lines = lines_of(&text).map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    let numbers = |line: Option<&str>| -> Vec<f64> {
        line.unwrap_or("").split_ascii_whitespace().map_while(|word| word.parse().ok()).collect()
    };
    if has_commas(whole_lines(start)) {
        return true;
    }
    let first = numbers(lines.next());
    if first.len() == 3 && first.iter().all(|x: &f64| x.fract() == 0.0) {
        let rows: Vec<Vec<f64>> = (0..4).map(|_| numbers(lines.next())).collect();
        return rows.iter().all(|row| row.len() == 4) && rows[3] == [0.0, 0.0, 0.0, 1.0];
    }
    match first.len() {
        // A unit quaternion at the end of eight numbers.
        8 => is_unit(&first[4..]),
        4 => {
            let rest: Vec<Vec<f64>> = lines.map(|line| numbers(Some(line))).collect();
            rest.len() == 3 && is_matrix(&[&first, &rest[0][..], &rest[1], &rest[2]].concat())
        }
        12 | 16 => is_matrix(&first),
        7 | 9 => are_quaternions(whole_lines(start)),
        _ => false,
    }
}

/// Whether all lines are TUM's eight numbers with a comma between each two.
fn has_commas(text: &[u8]) -> bool {
    let text = String::from_utf8_lossy(text);
    let mut lines = lines_of(&text).map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#')).peekable();
    let is_pose = |line: &str| {
        let row: Option<Vec<f64>> = line.split(',').map(|word| word.trim().parse().ok()).collect();
        row.is_some_and(|row| row.len() == 8 && is_unit(&row[4..]))
    };
    lines.peek().is_some() && lines.all(is_pose)
}

/// A text whose commas read as blanks. Comments keep theirs, which names of scans may have.
struct WithoutCommas<R> {
    text: R,
    in_comment: bool,
}

impl<R: Read> Read for WithoutCommas<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.text.read(buffer)?;
        for byte in &mut buffer[..count] {
            match *byte {
                b'#' => self.in_comment = true,
                b'\n' | b'\r' => self.in_comment = false,
                b',' if !self.in_comment => *byte = b' ',
                _ => {}
            }
        }
        Ok(count)
    }
}

/// Whether numbers are those of a rigid transform, row by row, with or without the last row.
fn is_matrix(numbers: &[f64]) -> bool {
    let rows = matrix(numbers);
    rows.is_some_and(|rows| rows[12..] == [0.0, 0.0, 0.0, 1.0] && pose::from_rows(&rows).is_ok())
}

/// The rows of a matrix of 12 or 16 numbers.
pub(super) fn matrix(numbers: &[f64]) -> Option<[f64; 16]> {
    let mut rows = [0.0; 16];
    rows[15] = 1.0;
    rows.get_mut(..numbers.len()).filter(|_| matches!(numbers.len(), 12 | 16))?.copy_from_slice(numbers);
    Some(rows)
}

fn is_unit(quaternion: &[f64]) -> bool {
    (quaternion.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-2
}

/// Whether all lines are `tx ty tz qx qy qz qw`, or RTAB-Map's with a time before and a number behind it. Points with normals have
/// as many numbers: of those some column of four is 0 throughout, and the last does not count up.
fn are_quaternions(text: &[u8]) -> bool {
    let text = String::from_utf8_lossy(text);
    let lines = lines_of(&text).map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    let rows: Option<Vec<Vec<f64>>> =
        lines.map(|line| line.split_ascii_whitespace().map(|word| word.parse().ok()).collect()).collect();
    let Some(rows) = rows.filter(|rows| !rows.is_empty()) else { return false };
    let (width, at) = (rows[0].len(), if rows[0].len() == 7 { 3 } else { 4 });
    if rows.iter().any(|row| row.len() != width || !is_unit(&row[at..at + 4])) {
        return false;
    }
    let is_zero = |column: usize| rows.iter().all(|row| row[column] == 0.0);
    if width == 7 {
        // Level robots turn about z alone.
        return !is_zero(6) && (!is_zero(3) || is_zero(4));
    }
    let ids: Vec<f64> = rows.iter().map(|row| row[8]).filter(|id| *id >= 0.0).collect();
    let count_up = ids.windows(2).all(|pair| pair[0] < pair[1]) && ids.iter().all(|id| id.fract() == 0.0);
    count_up && (ids.len() > 1 || text.contains("timestamp"))
}

/// Reads a file of poses.
pub(super) fn read(path: &Path) -> Result<Trajectory> {
    let (file, length) = file::open(path)?;
    if is_axis_angle(path) {
        return parse_axis_angle(Lines::new(file, length, path));
    }
    if has_commas(whole_lines(&file::read_start(path, LOOKED_AT)?.0)) {
        return parse(Lines::new(WithoutCommas { text: file, in_comment: false }, length, path));
    }
    parse(Lines::new(file, length, path))
}

/// Whether a file is a list of ARKitScenes', by its name.
pub(super) fn is_axis_angle(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case(AXIS_ANGLE))
}

/// Whether the name of a file says that it is a list of poses, whatever it holds.
pub(super) fn is_named_so(path: &Path) -> bool {
    is_axis_angle(path) || path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case(WRITTEN))
}

/// Whether most lines of a text have as many numbers as a pose. Points with normals may have seven or nine, too: such lines must be as many
/// as the images.
pub(super) fn is_like_one(path: &Path, images: usize) -> bool {
    let Ok((start, length)) = file::read_start(path, LOOKED_AT_TO_TELL) else { return false };
    let is_whole = start.len() as u64 == length;
    let text = String::from_utf8_lossy(if is_whole { &start } else { whole_lines(&start) });
    let lines = lines_of(&text).map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    let widths: Vec<usize> = lines
        .map(|line| {
            let words = line.split(|c: char| c.is_ascii_whitespace() || c == ',').filter(|word| !word.is_empty());
            words.map_while(|word| word.parse::<f64>().ok()).count()
        })
        .collect();
    let are_most = |width: usize| widths.iter().filter(|own| **own == width).count() * 2 > widths.len();
    [8, 12, MOST].into_iter().any(are_most) || (is_whole && widths.len() == images && (are_most(7) || are_most(9)))
}

/// Parses the lines of a file.
pub(super) fn parse(mut lines: Lines<'_>) -> Result<Trajectory> {
    let mut trajectory = Trajectory::default();
    let mut times: Vec<f64> = Vec::new();
    let mut headers: Vec<Header> = Vec::new();
    let mut known_ids: FxHashSet<i64> = FxHashSet::default();
    let mut widths = None;
    let mut named = Named::default();
    while lines.next_content()? {
        if lines.rest().starts_with(b"#") {
            named.comment(&lines)?;
            continue;
        }
        if lines.rest().contains(&b',') {
            return Err(lines.fail(
                "numbers of a list of poses are separated by blanks. Commas may stand between the eight of time, place \
                    and quaternion (x y z w, of unit length), in all lines of the list.",
            ));
        }
        let mut row = [0.0; MOST];
        let mut count = 0;
        while !lines.is_done() && count < MOST {
            row[count] = lines.f64("a number")?;
            count += 1;
        }
        if !lines.is_done() {
            count += 1;
        }
        let pose = match count {
            3 => {
                headers.push(Header { line: lines.number, numbers: [row[0], row[2]] });
                block(&mut lines, 0, [0.0; 4])?
            }
            4 if trajectory.poses.is_empty() => block(&mut lines, 1, [row[0], row[1], row[2], row[3]])?,
            7 => placed(&lines, &row[..3], &row[3..7])?,
            // A landmark.
            9 if row[8] < 0.0 => continue,
            8 | 9 => {
                let is_back = times.last().is_some_and(|last| *last > row[0]) && named.is_none();
                if !row[..8].iter().all(|x| x.is_finite()) || is_back {
                    return Err(lines.fail("expected finite numbers, times ascending"));
                }
                let pose = placed(&lines, &row[1..4], &row[4..8])?;
                let id = (count == 9).then_some(row[8] as i64);
                if named.is_none() && times.last() == Some(&row[0]) {
                    if trajectory.ids.last().copied() == id && trajectory.poses.last() == Some(&pose) {
                        continue;
                    }
                    return Err(lines.fail(format!("the time {} has two poses: take one of them out", row[0])));
                }
                if let Some(id) = id.filter(|id| !known_ids.insert(*id)) {
                    return Err(twice(&lines, lines.number, id as f64));
                }
                times.push(row[0]);
                trajectory.ids.extend(id);
                pose
            }
            _ => match matrix(&row[..count.min(MOST)]).filter(|_| count <= MOST) {
                Some(rows) => pose::from_rows(&rows).map_err(|problem| lines.fail(problem))?,
                None => {
                    let problem = "expected three whole numbers and a 4 x 4 matrix (Open3D), time, place and \
                        quaternion (TUM), or a matrix of 12 or 16 numbers";
                    return Err(lines.fail(problem));
                }
            },
        };
        trajectory.poses.push(pose);
        named.pose(&lines, trajectory.poses.len())?;
        if *widths.get_or_insert(count) != count {
            return Err(lines.fail("all poses must have a time or none, and all lines one form"));
        }
    }
    if trajectory.poses.is_empty() {
        return Err(lines.fail("there is no pose"));
    }
    trajectory.order_log(&headers, &lines)?;
    let scans = named.all(&lines, &times)?;
    // Scans are found by name: lists may have been put together.
    let mut order: Vec<usize> = (0..times.len()).collect();
    order.sort_by(|&a, &b| times[a].total_cmp(&times[b]));
    if !scans.is_empty() && !order.is_sorted() {
        trajectory.poses = order.iter().map(|&k| trajectory.poses[k]).collect();
        trajectory.ids = order.iter().filter_map(|&k| trajectory.ids.get(k).copied()).collect();
        trajectory.scans = Some(order.iter().map(|&k| scans[k].clone()).collect());
        times.sort_by(f64::total_cmp);
    } else {
        trajectory.scans = (!scans.is_empty() && headers.is_empty()).then_some(scans);
    }
    let are_numbers = times.iter().all(|time| time.fract() == 0.0 && *time < TIMES_FROM);
    if !trajectory.ids.is_empty() && trajectory.ids.len() == trajectory.poses.len() {
        trajectory.numbers = vec![trajectory.ids.iter().map(|id| *id as f64).collect()];
    } else if !times.is_empty() && are_numbers && trajectory.scans.is_none() {
        trajectory.numbers = vec![times.iter().map(|time| time + 0.0).collect()];
    }
    trajectory.times = (!times.is_empty()).then_some(times);
    Ok(trajectory)
}

/// The line before a matrix of a log.
struct Header {
    line: u64,
    /// Its first and its third number. Either may number the images, from 0 or from 1.
    numbers: [f64; 2],
}

impl Trajectory {
    /// Puts the poses of a log in the order of its numbers. Some logs have the same number for all.
    fn order_log(&mut self, headers: &[Header], lines: &Lines<'_>) -> Result<()> {
        let mut order: Vec<usize> = (0..headers.len()).collect();
        let mut again = None;
        for kind in [1, 0] {
            let number = |k: usize| headers[k].numbers[kind] + 0.0;
            order.sort_by(|&a, &b| number(a).total_cmp(&number(b)).then(a.cmp(&b)));
            let same = order.windows(2).filter(|two| number(two[0]) == number(two[1])).map(|two| two[1]).min();
            match same {
                None if headers.is_empty() => {}
                None => self.numbers.insert(0, (0..headers.len()).map(number).collect()),
                Some(_) if number(order[0]) == number(order[order.len() - 1]) => {}
                Some(second) => again = again.or(Some((second, number(second)))),
            }
        }
        self.is_log = !headers.is_empty();
        if self.numbers.is_empty() {
            return match again {
                Some((second, number)) => Err(twice(lines, headers[second].line, number)),
                None => Ok(()),
            };
        }
        let first = &self.numbers[0];
        order.sort_by(|&a, &b| first[a].total_cmp(&first[b]));
        self.poses = order.iter().map(|&k| self.poses[k]).collect();
        self.numbers = self.numbers.iter().map(|column| order.iter().map(|&k| column[k]).collect()).collect();
        let is_back = |two: &&[usize]| self.numbers.iter().any(|column| column[two[0]] >= column[two[1]]);
        let places: Vec<usize> = (0..order.len()).collect();
        if let Some(two) = places.windows(2).find(is_back) {
            let problem = "the first and the third number before the matrices number the poses in two orders: write one of \
                them in both places";
            return Err(lines.fail_at(headers[order[two[1]]].line, problem));
        }
        self.numbers.dedup();
        Ok(())
    }
}

#[cold]
fn twice(lines: &Lines<'_>, line: u64, number: f64) -> Error {
    lines.fail_at(line, format!("the number {number} has two poses: take one of them out"))
}

/// The scans that the comments of a list name, with the lines of their poses.
#[derive(Default)]
struct Named {
    scans: Vec<(u64, ListedScan)>,
    /// That of the next pose, with its own line.
    next: Option<(u64, ListedScan)>,
    /// The first comment that may be one and can't be read.
    unread: Option<u64>,
}

impl Named {
    fn is_none(&self) -> bool {
        self.scans.is_empty()
    }

    fn comment(&mut self, lines: &Lines<'_>) -> Result<()> {
        match ListedScan::of_comment(lines.rest()) {
            Comment::Scan(scan) => match self.next.replace((lines.number, scan)) {
                Some(before) => Err(without_pose(lines, &before)),
                None => Ok(()),
            },
            Comment::Damaged { is_quoted: true } => Err(damaged(lines, lines.number)),
            Comment::Damaged { is_quoted: false } => {
                self.unread.get_or_insert(lines.number);
                Ok(())
            }
            Comment::Other => Ok(()),
        }
    }

    /// Takes note of a pose, which is the last of so many.
    fn pose(&mut self, lines: &Lines<'_>, poses: usize) -> Result<()> {
        self.scans.extend(self.next.take().map(|(_, scan)| (lines.number, scan)));
        if self.is_none() || self.scans.len() == poses {
            return Ok(());
        }
        Err(lines.fail("the scan of this pose is missing: put a line # scan \"NAME\" before each pose, or before none"))
    }

    /// The scans, whose poses have these times.
    fn all(self, lines: &Lines<'_>, times: &[f64]) -> Result<Vec<ListedScan>> {
        if let Some(last) = &self.next {
            return Err(without_pose(lines, last));
        }
        if let Some(line) = self.unread.filter(|_| !self.scans.is_empty()) {
            return Err(damaged(lines, line));
        }
        if let Some(place) = ListedScan::twice(self.scans.iter().map(|(_, scan)| scan)) {
            let (line, scan) = &self.scans[place];
            return Err(lines.fail_at(*line, format!("{} has two poses: take one of them out", scan.comment())));
        }
        if let Some(place) = foreign(&self.scans, times) {
            let (line, scan) = &self.scans[place];
            return Err(lines.fail_at(
                *line,
                format!(
                    "the time {} is not the number in {:?}, the name of the scan before it: a line is missing between \
                        them. Put it back, or take out both.",
                    times[place], scan.name
                ),
            ));
        }
        Ok(self.scans.into_iter().map(|(_, scan)| scan).collect())
    }
}

/// The first pose whose time is not the number in the name of its scan, in a list of which the times are these numbers.
fn foreign(scans: &[(u64, ListedScan)], times: &[f64]) -> Option<usize> {
    let numbers: Vec<f64> = scans.iter().map(|(_, scan)| Some(number_in(&scan.name)?.value)).collect::<Option<_>>()?;
    let mut sorted = numbers.clone();
    sorted.sort_by(f64::total_cmp);
    let is_own = |place: &usize| times[*place] == numbers[*place];
    let places = || 0..times.len().min(numbers.len());
    // Else the times count the scans.
    let are_numbers =
        sorted.windows(2).all(|pair| pair[0] < pair[1]) && places().filter(is_own).count() * 2 >= scans.len();
    places().find(|place| are_numbers && !is_own(place))
}

#[cold]
fn without_pose(lines: &Lines<'_>, (line, scan): &(u64, ListedScan)) -> Error {
    lines.fail_at(*line, format!("there is no pose behind {}: put it back, or take this line out", scan.comment()))
}

#[cold]
fn damaged(lines: &Lines<'_>, line: u64) -> Error {
    lines.fail_at(line, "this comment must name a scan in straight quotes, as # scan \"NAME\" does")
}

/// Parses the lines of ARKitScenes'.
pub(super) fn parse_axis_angle(mut lines: Lines<'_>) -> Result<Trajectory> {
    let mut trajectory = Trajectory { is_world_to_camera: true, ..Trajectory::default() };
    let mut times: Vec<f64> = Vec::new();
    while lines.next_content()? {
        let mut row = [0.0; 7];
        for value in &mut row {
            *value = lines.f64("a number of `timestamp rx ry rz tx ty tz`")?;
        }
        if !lines.is_done() {
            return Err(lines.expected("the end of the line: it has seven numbers"));
        }
        if !row.iter().all(|x| x.is_finite()) || times.last().is_some_and(|last| *last > row[0]) {
            return Err(lines.fail("expected finite numbers, times ascending"));
        }
        times.push(row[0]);
        let [turn, place] = [DVec3::from_slice(&row[1..]), DVec3::from_slice(&row[4..])];
        let rotation = DQuat::from_scaled_axis(turn);
        trajectory.poses.push(DAffine3::from_rotation_translation(rotation, place).inverse());
    }
    if trajectory.poses.is_empty() {
        return Err(lines.fail("there is no pose"));
    }
    trajectory.times = Some(times);
    Ok(trajectory)
}

/// The pose of a place and a quaternion.
fn placed(lines: &Lines<'_>, place: &[f64], quaternion: &[f64]) -> Result<DAffine3> {
    let quaternion = DQuat::from_slice(quaternion);
    if !((quaternion.length() - 1.0).abs() < UNIT_WITHIN) {
        return Err(lines.fail("the quaternion (four numbers behind the place) must have unit length"));
    }
    let rotation = DMat3::from_quat(quaternion.normalize());
    Ok(DAffine3 { matrix3: rotation, translation: DVec3::from_slice(place) })
}

/// The pose of a matrix on four lines, of which `known` rows are read.
fn block(lines: &mut Lines<'_>, known: usize, first: [f64; 4]) -> Result<DAffine3> {
    let mut rows = [0.0; 16];
    rows[..4].copy_from_slice(&first);
    for row in rows.chunks_exact_mut(4).skip(known) {
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
        self.within(time, APART)
    }

    /// The pose nearest in time, within so many seconds.
    pub(super) fn within(&self, time: f64, apart: f64) -> Option<DAffine3> {
        self.nearest(time, apart).map(|k| self.poses[k])
    }

    /// The scans that the poses are of, where the list names them.
    pub(super) fn scans(&self) -> Option<&[ListedScan]> {
        self.scans.as_deref()
    }

    /// The times of the poses, where lines begin with them.
    pub(super) fn times(&self) -> Option<&[f64]> {
        self.times.as_deref()
    }

    /// Numbers that the list gives its images, each column in the order of the poses, ascending. Two columns may be meant.
    pub(super) fn numbers(&self) -> &[Vec<f64>] {
        &self.numbers
    }

    /// Whether it is a log, which numbers its poses in headers.
    pub(super) fn is_log(&self) -> bool {
        self.is_log
    }

    /// The place in the list of the pose nearest in time, within so many seconds.
    pub(super) fn nearest(&self, time: f64, apart: f64) -> Option<usize> {
        let times = self.times.as_ref()?;
        let after = times.partition_point(|t| *t < time);
        let near = [after.wrapping_sub(1), after].into_iter().filter(|&i| i < times.len());
        let nearest = near.min_by(|&a, &b| (times[a] - time).abs().total_cmp(&(times[b] - time).abs()))?;
        ((times[nearest] - time).abs() <= apart).then_some(nearest)
    }

    /// The pose of the image of that number.
    pub(super) fn of_id(&self, id: i64) -> Option<DAffine3> {
        self.ids.iter().position(|known| *known == id).map(|k| self.poses[k])
    }

    /// The first and the last time.
    pub(super) fn span(&self) -> Option<[f64; 2]> {
        let times = self.times.as_ref()?;
        Some([*times.first()?, *times.last()?])
    }

    /// Reads its poses in the sense and by the axes that the caller has named.
    pub(super) fn as_told(&mut self, options: &ReadOptions) {
        let is_other = match options.poses {
            PoseSense::Auto => false,
            sense => (sense == PoseSense::WorldToCamera) != self.is_world_to_camera,
        };
        for pose in &mut self.poses {
            if is_other {
                *pose = pose.inverse();
            }
            if options.axes == CameraAxes::YUp {
                *pose *= TURNED;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse_text(text: &str) -> Result<Trajectory> {
        parse(Lines::new(text.as_bytes(), text.len() as u64, Path::new("t")))
    }

    const LOG: &str = "0 0 1\n1 0 0 1\n0 1 0 2\n0 0 1 3\n0 0 0 1\n1 1 2\n0 -1 0 0\n1 0 0 0\n0 0 1 0\n0 0 0 1\n";
    const TUM: &str = "# t\n10.00 1 2 3 0 0 0 1\r\n10.05 1 1 1 0 0 1 0\n";

    #[test]
    fn both_forms() {
        assert!(sniff(LOG.as_bytes()) && sniff(TUM.as_bytes()));
        assert!(!sniff(b"1 2 3\n1 2 3\n") && !sniff(b"1 2 3 4 5 6 7 8\n") && !sniff(b"") && !sniff(b"ply"));
        let log = parse_text(LOG).unwrap();
        assert_eq!(log.poses[0].translation, DVec3::new(1.0, 2.0, 3.0));
        assert_eq!(log.poses[1].transform_point3(DVec3::X), DVec3::Y);
        let tum = parse_text(TUM).unwrap();
        assert_eq!(tum.poses[1].transform_point3(DVec3::X), DVec3::new(0.0, 1.0, 1.0));
    }

    /// Theorem: eight numbers with commas are a list of poses as they are with blanks. Other commas are refused, and say what is allowed.
    #[test]
    fn commas_between_the_numbers() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            path
        };
        let listed =
            "# scan \"a, b\" of \"a.ply\"\n10.00, 1,2,3, 0,0,0,1\r\n# scan \"c\" of \"c.ply\"\n10.05,1,1,1,0,0,1,0\n";
        let table = read(&file("a.csv", listed)).unwrap();
        assert!(sniff(listed.as_bytes()) && !sniff(b"10,1,2,3,0,0,0,1\n11,1,2,3,4,5,6,7\n"));
        assert_eq!(table.poses, parse_text(TUM).unwrap().poses);
        assert_eq!(table.scans.unwrap()[0].name, "a, b");
        for text in ["10,1,2,3,0,0,0\n", "10,1,2,3,0,0,0,1\n11,1,2,3,4,5,6,7\n", "1,5 1 2 3 0 0 0 1\n"] {
            let refused = read(&file("a.tum", text)).unwrap_err().to_string();
            assert!(
                refused.contains("line 1: numbers of a list of poses are separated by blanks. Commas may"),
                "{refused}"
            );
        }
    }

    /// Theorem: a list of poses in any form that recordings have is one, and points with as many numbers per line are none.
    #[test]
    fn lists_of_poses_are_told_from_points() {
        let turn = "0 -1 0 5 1 0 0 6 0 0 1 7";
        let lists = [
            format!("{turn}\n{turn}\n"),
            format!("{turn} 0 0 0 1\n"),
            "0 -1 0 5\n1 0 0 6\n0 0 1 7\n0 0 0 1\n".to_owned(),
            "5 6 7 0 0 0.7071068 0.7071068\n5 6 7 0 0 0.7071068 0.7071068\n".to_owned(),
            "#timestamp x y z qx qy qz qw id\n1.5 5 6 7 0 0 0.7071068 0.7071068 4\n2.5 0 0 0 0 0 0 1 -3\n".to_owned(),
        ];
        for list in &lists {
            assert!(sniff(list.as_bytes()), "{list}");
            let pose = parse_text(list).unwrap_or_else(|error| panic!("{list}: {error}")).poses[0];
            assert!(pose.transform_point3(DVec3::X).abs_diff_eq(DVec3::new(5.0, 7.0, 7.0), 1e-6), "{list}: {pose}");
        }
        assert_eq!(parse_text(&lists[4]).unwrap().of_id(4), Some(parse_text(&lists[4]).unwrap().poses[0]));
        for points in [
            "1 2 3 0 0 0.6 0.8\n1 2 4 0 0.6 0 0.8\n",
            "1 2 3 0.6 0 0.8 0\n1 2 3 0.6 0.8 0 0\n",
            "1 2 3 0 0 0 0.6 0.8 0\n4 5 6 0 0 0 0.8 0.6 0\n",
            "1 2 3 4\n1 0 0 0\n0 1 0 0\n0 0 0 1\n",
            "1 2 3 4 5 6 7 8 9 10 11 12\n",
        ] {
            assert!(!sniff(points.as_bytes()), "{points}");
        }
        // ARKitScenes' are recognized by their name alone.
        let lines = "7.25 0 0 -1.5707963267948966 -6 5 -7\n";
        let found = parse_axis_angle(Lines::new(lines.as_bytes(), lines.len() as u64, Path::new("a.traj"))).unwrap();
        let pose = found.at(7.25).unwrap();
        assert!(pose.transform_point3(DVec3::X).abs_diff_eq(DVec3::new(5.0, 7.0, 7.0), 1e-9), "{pose}");
        assert!(is_axis_angle(Path::new("a.TRAJ")) && !is_axis_angle(Path::new("traj")));
    }

    /// Theorem: the caller's word on sense and axes counts.
    #[test]
    fn poses_are_read_as_told() {
        let told = |poses, axes| {
            let mut list = parse_text(LOG).unwrap();
            list.as_told(&ReadOptions { poses, axes, ..ReadOptions::default() });
            list.poses[1]
        };
        let pose = parse_text(LOG).unwrap().poses[1];
        assert_eq!(told(PoseSense::Auto, CameraAxes::YDown), pose);
        assert_eq!(told(PoseSense::CameraToWorld, CameraAxes::Auto), pose);
        assert_eq!(told(PoseSense::WorldToCamera, CameraAxes::Auto), pose.inverse());
        assert_eq!(told(PoseSense::Auto, CameraAxes::YUp), pose * TURNED);
    }

    /// Theorem: lists that are put together are one, whatever their times. Comments of others are passed over.
    #[test]
    fn named_lists_need_no_order() {
        let text = "#scan \"a\"\n7 1 0 0 0 0 0 1\n# scan \"b\" of \"x/b\"\n# of a wall\n3 2 0 0 0 0 0 1\n# SCAN \"c\"\n3 3 0 0 0 0 0 1\n";
        let list = parse_text(text).unwrap();
        let names: Vec<&str> = list.scans().unwrap().iter().map(|scan| scan.name.as_str()).collect();
        assert_eq!(names, ["b", "c", "a"]);
        assert_eq!(list.times(), Some(&[3.0, 3.0, 7.0][..]));
        assert_eq!(list.poses.iter().map(|pose| pose.translation.x).collect::<Vec<_>>(), [2.0, 3.0, 1.0]);
        // Times that count the scans are not those in the names.
        let text = "# scan \"f5\" of \"A\"\n0 0 0 0 0 0 0 1\n# scan \"f5\" of \"B\"\n1 0 0 0 0 0 0 1\n# scan \"f2\" of \"B\"\n2 0 0 0 0 0 0 1\n";
        assert_eq!(parse_text(text).unwrap().scans().unwrap().len(), 3);
        assert!(parse_text("# scan 4\n1 0 0 0 0 0 0 1\n").unwrap().scans().is_none());
    }

    /// Theorem: a pose that is there twice, time and all, is one. In a log, a number that some poses share is wrong, one of all is none.
    #[test]
    fn poses_are_there_once() {
        let pose = "1 2 3 0 0 0 1\n";
        assert_eq!(parse_text(&format!("1 {pose}1 {pose}2 {pose}")).unwrap().times(), Some(&[1.0, 2.0][..]));
        assert!(parse_text(&format!("1 {}", pose.replace(" 1\n", " 1.009\n"))).is_ok());
        let log = |headers: &[&str]| {
            let block = |header: &&str| format!("{header}\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
            parse_text(&headers.iter().map(block).collect::<String>())
        };
        let refused = |headers: &[&str]| log(headers).unwrap_err().to_string();
        assert!(refused(&["0 0 1", "1 1 2", "1 1 2"]).contains("line 11: the number 2 has two poses"));
        assert!(refused(&["0 1 9", "0 2 9", "1 2 9"]).contains("line 6: the number 0 has two poses"));
        assert!(refused(&["0 0 2", "1 1 1"]).contains("line 6: the first and the third number"));
        assert!(log(&["0 0 1", "0 0 1"]).unwrap().numbers().is_empty());
        assert_eq!(log(&["0 0 1", "0 0 2"]).unwrap().numbers(), [[1.0, 2.0]]);
        assert_eq!(log(&["4 4 5", "2 2 3"]).unwrap().numbers(), [[2.0, 4.0], [3.0, 5.0]]);
    }

    #[test]
    fn what_is_wrong_has_a_line() {
        for (text, problem) in [
            ("", "line 1: there is no pose"),
            ("0 0 1\n1 0 0 0\n", "line 2: expected a row of a 4 x 4 matrix, but the file ends"),
            ("0 0 1\n1 0 0\n", "line 2: expected a number of a 4 x 4 matrix, but the line ends"),
            ("1 2\n", "line 1: expected three whole numbers"),
            ("1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17\n", "line 1: expected three whole numbers"),
            ("1 0 0 0 0 1 0 0 0 0 1 0\n0 0 0 0 0 0 1\n", "line 2: all poses must have a time or none"),
            ("1 2 3 4 5 6 7 8\n", "line 1: the quaternion"),
            ("1 x\n", "line 1: expected a number, found `x`"),
            ("# scan \"a\"\n1 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n", "line 3: the scan of this pose is missing"),
            ("1 0 0 0 0 0 0 1\n# scan \"a\"\n2 0 0 0 0 0 0 1\n", "line 3: the scan of this pose is missing"),
            ("# scan \"a\"\n1 0 0 0 0 0 0 1\n# scan \"a\"\n2 0 0 0 0 0 0 1\n", "# scan \"a\" has two poses"),
            (
                "# scan \"a\"\n1 0 0 0 0 0 0 1\n# scan \"a\" of \"x\"\n2 0 0 0 0 0 0 1\n",
                "line 4: # scan \"a\" of \"x\" has two",
            ),
            ("# scan \"f3\"\n# scan \"f4\"\n4 0 0 0 0 0 0 1\n", "line 1: there is no pose behind # scan \"f3\""),
            ("# scan \"f3\"\n3 0 0 0 0 0 0 1\n#scan \"f4\"\n", "line 3: there is no pose behind # scan \"f4\""),
            ("# scan 'a'\n1 0 0 0 0 0 0 1\n", "line 1: this comment must name a scan"),
            ("# scan \"a\"\n# scan b\n1 0 0 0 0 0 0 1\n", "line 2: this comment must name a scan"),
            (
                "# scan \"f2\"\n2 0 0 0 0 0 0 1\n# scan \"f3\"\n4 0 0 0 0 0 0 1\n# scan \"f5\"\n5 0 0 0 0 0 0 1\n",
                "line 4: the time 4 is not the number in \"f3\"",
            ),
            ("2 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n", "line 2: expected finite numbers, times ascending"),
            ("1 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n", "line 2: the time 1 has two poses"),
            ("0.5 0 0 0 0 0 0 1\n1.25 0 0 0 0 0 0 1\n1.250 1 0 0 0 0 0 1\n", "line 3: the time 1.25 has two poses"),
            ("1 0 0 0 0 0 0 1 7\n2 1 0 0 0 0 0 1 7\n", "line 2: the number 7 has two poses"),
            ("0 0 0 0 0 0 0 1.02\n", "line 1: the quaternion"),
            ("0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1 5\n", "line 5: expected the end of the line"),
        ] {
            let error = parse_text(text).unwrap_err().to_string();
            assert!(error.contains(problem), "{error}");
        }
    }
}
