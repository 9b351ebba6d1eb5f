//! The pose of each scan: by the scans that the list names, else by the times in their names, else in their order.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::DAffine3;
use rustc_hash::FxHashMap;

use super::super::file;
use super::super::numbering::number_in;
use super::super::scan::FileScan;
use super::listed::ListedScan;
use super::{APART, Trajectory};
use base::error::{Error, Result, known_as};
use base::log::{self, Level};

impl Trajectory {
    /// Places scans. Notes that say how. Scans without a pose are passed over.
    ///
    /// # Errors
    /// Two scans that take one pose, or a scan of which the list does not tell which pose is its own. No scan that has a pose. As many poses
    /// as scans are needed where neither names nor times tell which belong together.
    pub(in super::super) fn place(&self, scans: &mut Vec<FileScan>, path: &Path) -> Result<Vec<String>> {
        if let Some(listed) = &self.scans {
            return self.by_names(listed, scans, path);
        }
        let numbers = scans.iter().map(|scan| number_in(scan.own_name()).filter(|number| number.is_all));
        let taken: Option<Vec<f64>> = numbers.map(|number| Some(number?.value)).collect();
        match taken.filter(|_| self.times.is_some()) {
            Some(taken) => self.by_times(&taken, scans, path).map(|note| vec![note]),
            None => self.in_order(scans, path).map(|note| vec![note]),
        }
    }

    fn by_times(&self, taken: &[f64], scans: &mut Vec<FileScan>, path: &Path) -> Result<String> {
        let fail = |problem: String| Error::format(path, "whole file", problem);
        let mut scan_of: FxHashMap<usize, usize> = FxHashMap::default();
        for (scan, time) in taken.iter().enumerate() {
            let Some(pose) = self.nearest(*time, APART) else { continue };
            if let Some(other) = scan_of.insert(pose, scan) {
                return Err(fail(format!(
                    "{} and {} both take the pose of time {}. Open the scans that the list is of, or align them and write \
                        the list anew, which then names them.",
                    scans[other].name,
                    scans[scan].name,
                    self.times.as_ref().map_or(0.0, |times| times[pose])
                )));
            }
        }
        if scan_of.is_empty() {
            return Err(fail(format!("a pose must lie within {APART} s of {}, but none does", scans[0].name)));
        }
        let pose_of = scan_of.into_iter().map(|(pose, scan)| (scan, self.poses[pose])).collect();
        let [placed, lost] = keep(scans, &pose_of);
        let said = format!("{}: placed {} by the times in their names", file::name(path), many(placed, "scan"));
        Ok(match lost {
            0 => said,
            1 => format!("{said}, and 1 of {} has no pose within {APART} s and is passed over", placed + lost),
            _ => format!("{said}, and {lost} of {} have no pose within {APART} s and are passed over", placed + lost),
        })
    }

    fn in_order(&self, scans: &mut [FileScan], path: &Path) -> Result<String> {
        let (poses, count) = (self.poses.len(), scans.len());
        if count != poses {
            let [poses, count] = [many(poses, "pose"), many(count, "scan")];
            let problem = format!(
                "{poses} for {count}, whose names are not times: open as many scans as there are poses, in order"
            );
            return Err(Error::format(path, "whole file", problem));
        }
        for (scan, pose) in scans.iter_mut().zip(&self.poses) {
            scan.world_from_sensor = *pose;
        }
        Ok(format!("{}: placed {} in their order", file::name(path), many(count, "scan")))
    }

    /// A name that one scan and one pose have brings them together. Of several the files decide.
    fn by_names(&self, listed: &[ListedScan], scans: &mut Vec<FileScan>, path: &Path) -> Result<Vec<String>> {
        let fail = |problem: String| Error::format(path, "whole file", problem);
        let mut groups: BTreeMap<&str, [Vec<usize>; 2]> = BTreeMap::new();
        for (pose, scan) in listed.iter().enumerate() {
            groups.entry(&scan.name).or_default()[0].push(pose);
        }
        for (number, scan) in scans.iter().enumerate() {
            if let Some(group) = groups.get_mut(scan.own_name()) {
                group[1].push(number);
            }
        }
        let mut pose_of: FxHashMap<usize, DAffine3> = FxHashMap::default();
        let mut elsewhere: Option<(String, String)> = None;
        for (name, [poses, named]) in &groups {
            // Canonical paths cost: they are asked for where names are not enough, and once to compare the sets.
            if let ([pose], [scan]) = (poses.as_slice(), named.as_slice()) {
                pose_of.insert(*scan, self.poses[*pose]);
                let named = file_of(path, &listed[*pose]);
                if !listed[*pose].file.is_empty() && named.exists() && !is_same(&named, &scans[*scan].path) {
                    elsewhere.get_or_insert_with(|| {
                        (known_as(&named).to_string(), known_as(&scans[*scan].path).to_string())
                    });
                }
                continue;
            }
            let mut found = 0;
            for &pose in poses {
                let mut own = named.iter().filter(|&&scan| is_same(&file_of(path, &listed[pose]), &scans[scan].path));
                if let Some(&scan) = own.next().filter(|_| own.next().is_none() && !listed[pose].file.is_empty()) {
                    pose_of.insert(scan, self.poses[pose]);
                    found += 1;
                }
            }
            if found == 0 && !named.is_empty() {
                return Err(fail(format!(
                    "{:?} is the name of {} and of {}, and no file tells which belong together. Open the files that \
                        the list names, such as {}.",
                    name,
                    many(poses.len(), "pose"),
                    many(named.len(), "scan"),
                    listed[poses[0]].comment().trim_start_matches("# ")
                )));
            }
        }
        if pose_of.is_empty() {
            return Err(fail(format!(
                "no scan that is opened has a pose here: the list is of {}, but {} is opened",
                listed[0].comment().trim_start_matches("# "),
                scans[0].name
            )));
        }
        let all = scans.len();
        let [placed, lost] = keep(scans, &pose_of);
        let said = format!("{}: placed {} by their names", file::name(path), many(placed, "scan"));
        let mut notes = vec![match lost {
            0 => said,
            1 => format!("{said}, and 1 of {all} has no pose and is passed over"),
            _ => format!("{said}, and {lost} of {all} have no pose and are passed over"),
        }];
        if let Some((listed, opened)) = elsewhere {
            let told = format!(
                "{}: the list is of {listed}, and the scans of the same names are of {opened}: check that these are the same",
                file::name(path)
            );
            log::tell(Level::Warning, &told);
            notes.push(told);
        }
        Ok(notes)
    }
}

/// Leaves the scans that have a pose, with it. How many these are, and how many have none.
fn keep(scans: &mut Vec<FileScan>, pose_of: &FxHashMap<usize, DAffine3>) -> [usize; 2] {
    let (all, mut number) = (scans.len(), 0);
    scans.retain_mut(|scan| {
        let pose = pose_of.get(&number);
        number += 1;
        scan.world_from_sensor = pose.copied().unwrap_or_default();
        pose.is_some()
    });
    [scans.len(), all - scans.len()]
}

/// The file that a line names: within the list's folder, or absolute.
fn file_of(list: &Path, listed: &ListedScan) -> PathBuf {
    list.parent().unwrap_or(Path::new("")).join(&listed.file)
}

fn is_same(one: &Path, other: &Path) -> bool {
    let whole = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_owned());
    one == other || whole(one) == whole(other)
}

/// A count of things with their noun.
fn many(count: usize, noun: &str) -> String {
    if count == 1 { format!("1 {noun}") } else { format!("{count} {noun}s") }
}
