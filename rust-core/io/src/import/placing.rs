//! The pose of each scan: by the scans that the list names, else by the times in their names, else in their order.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::DAffine3;
use rustc_hash::FxHashMap;

use super::file;
use super::listed_scan::ListedScan;
use super::numbering::number_in;
use super::scan::FileScan;
use super::trajectory::{APART, Trajectory};
use base::error::{Error, Result, known_as};
use base::log::{self, Level};

impl Trajectory {
    /// Places scans. Notes that say how. Scans without a pose are passed over.
    ///
    /// # Errors
    /// Two scans that take one pose, or a scan of which the list does not tell which pose is its own. No scan that has a pose. As many poses
    /// as scans are needed where neither names nor times tell which belong together.
    pub(super) fn place(&self, scans: &mut Vec<FileScan>, path: &Path) -> Result<Vec<String>> {
        if let Some(listed) = self.scans() {
            return self.by_names(listed, scans, path);
        }
        let numbers = scans.iter().map(|scan| number_in(scan.own_name()).filter(|number| number.is_all));
        let taken: Option<Vec<f64>> = numbers.map(|number| Some(number?.value)).collect();
        match taken.filter(|_| self.times().is_some()) {
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
                    self.times().map_or(0.0, |times| times[pose])
                )));
            }
        }
        if scan_of.is_empty() {
            return Err(fail(format!("a pose must lie within {APART} s of {}, but none does", scans[0].name)));
        }
        let pose_of = scan_of.into_iter().map(|(pose, scan)| (scan, self.poses()[pose])).collect();
        let [placed, lost] = keep(scans, &pose_of);
        let said = format!("{}: placed {} by the times in their names", file::name(path), many(placed, "scan"));
        Ok(match lost {
            0 => said,
            1 => format!("{said}, and 1 of {} has no pose within {APART} s and is passed over", placed + lost),
            _ => format!("{said}, and {lost} of {} have no pose within {APART} s and are passed over", placed + lost),
        })
    }

    fn in_order(&self, scans: &mut [FileScan], path: &Path) -> Result<String> {
        let (poses, count) = (self.poses().len(), scans.len());
        if count != poses {
            let [poses, count] = [many(poses, "pose"), many(count, "scan")];
            let problem = format!(
                "{poses} for {count}, whose names are not times: open as many scans as there are poses, in order"
            );
            return Err(Error::format(path, "whole file", problem));
        }
        for (scan, pose) in scans.iter_mut().zip(self.poses()) {
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
                pose_of.insert(*scan, self.poses()[*pose]);
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
                    pose_of.insert(scan, self.poses()[pose]);
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
        let said = format!("{}: placed {} by name", file::name(path), many(placed, "scan"));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::text::Lines;
    use crate::import::trajectory::parse;

    const LOG: &str = "0 0 1\n1 0 0 1\n0 1 0 2\n0 0 1 3\n0 0 0 1\n1 1 2\n0 -1 0 0\n1 0 0 0\n0 0 1 0\n0 0 0 1\n";
    const TUM: &str = "# t\n10.00 1 2 3 0 0 0 1\r\n10.05 1 1 1 0 0 1 0\n";

    /// Theorem: scans whose names are times take the poses of these. Others take them in their order, all or none.
    #[test]
    fn times_or_the_order_decide() {
        let [log, tum] =
            [LOG, TUM].map(|text| parse(Lines::new(text.as_bytes(), text.len() as u64, Path::new("t"))).unwrap());
        let scan = |name: &str| FileScan { name: name.to_owned(), ..FileScan::new(Path::new("x")) };
        let twice = tum.place(&mut vec![scan("10.049"), scan("10.011"), scan("10.04")], Path::new("t")).unwrap_err();
        assert!(twice.to_string().contains("10.049 and 10.04 both take the pose of time 10.05"), "{twice}");
        let mut scans = vec![scan("10.049"), scan("10.011")];
        assert!(tum.place(&mut scans, Path::new("t")).unwrap()[0].contains("placed 2 scans by the times"));
        let are_second =
            |scans: &[FileScan]| scans.iter().map(|s| s.world_from_sensor == tum.poses()[1]).collect::<Vec<_>>();
        assert_eq!(are_second(&scans), [true, false]);
        scans.insert(1, scan("12"));
        let note = tum.place(&mut scans, Path::new("t")).unwrap().remove(0);
        assert!(note.ends_with(
            "placed 2 scans by the times in their names, and 1 of 3 has no pose within 0.02 s and is passed over"
        ));
        assert_eq!(are_second(&scans), [true, false]);
        let refused = tum.place(&mut vec![scan("12")], Path::new("t")).unwrap_err().to_string();
        assert!(refused.contains("within 0.02 s of 12"), "{refused}");
        let mut named = vec![scan("a"), scan("b")];
        log.place(&mut named, Path::new("t")).unwrap();
        assert_eq!(named[1].world_from_sensor, log.poses()[1]);
        named.pop();
        assert!(log.place(&mut named, Path::new("t")).unwrap_err().to_string().contains("2 poses for 1 scan"));
    }
}
