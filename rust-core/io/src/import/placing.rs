//! The pose of each scan: by the scans that the list names, else by the numbers in their names, else in their order.

use std::path::Path;

use glam::DAffine3;
use rustc_hash::FxHashMap;

use super::file;
use super::numbering::{Key, keys_of, order_of};
use super::placing_by_name::{by_names, keep};
use super::placing_by_numbers::{Places, Placing, counts_on};
use super::scan::FileScan;
use super::trajectory::{APART, Trajectory};
use base::error::{Error, Result, counted};

impl Trajectory {
    /// Places scans. Notes that say how. Scans without a pose are passed over.
    ///
    /// # Errors
    /// Two scans that take one pose, or a scan of which the list does not tell which pose is its own. No scan that has a pose. As many poses
    /// as scans are needed where neither names nor times tell which belong together.
    pub(super) fn place(&self, scans: &mut Vec<FileScan>, path: &Path) -> Result<Vec<String>> {
        if let Some(listed) = self.scans() {
            return by_names(self.poses(), listed, scans, path);
        }
        let fail = |problem: String| Error::format(path, "whole file", problem);
        let names: Vec<String> = scans.iter().map(|scan| scan.own_name().to_owned()).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let keys = match keys_of(&names) {
            // Parts of a file have an order, and one has no other.
            Err(_) if are_parts(scans) || (scans.len() == 1 && self.tells_order_alone()) => Vec::new(),
            keys => keys.map_err(fail)?,
        };
        let note = match self.placing(&keys, &names).map_err(fail)? {
            Placing::Times(places) => self.placed(&places, true, scans, path),
            Placing::Numbers(places) => self.placed(&places, false, scans, path),
            Placing::Order => self.in_order(&keys, &names, scans, path).map_err(fail)?,
        };
        Ok(vec![note])
    }

    fn tells_order_alone(&self) -> bool {
        self.times().is_none() && self.numbers().iter().all(|column| counts_on(column))
    }

    /// Gives scans their poses. Those without one are passed over, and the note says so.
    fn placed(&self, places: &Places, by_times: bool, scans: &mut Vec<FileScan>, path: &Path) -> String {
        let pose = |(image, place): (usize, &Option<usize>)| Some((image, self.poses()[(*place)?]));
        let pose_of: FxHashMap<usize, DAffine3> = places.iter().enumerate().filter_map(pose).collect();
        let [placed, lost] = keep(scans, &pose_of);
        let (list, count) = (file::name(path), counted(placed as u64, "scan", "scans"));
        let said = if by_times {
            format!("{list}: placed {count} by the times in their names")
        } else {
            format!("{list}: placed {count} by the numbers in their names")
        };
        match (lost, by_times) {
            (0, _) => said,
            (1, true) => {
                format!("{said}, and 1 of {} has no pose of its own within {APART} s and is passed over", placed + lost)
            }
            (_, true) => {
                let of = placed + lost;
                format!("{said}, and {lost} of {of} have no pose of their own within {APART} s and are passed over")
            }
            (1, _) => format!("{said}, and 1 of {} has no pose and is passed over", placed + lost),
            _ => format!("{said}, and {lost} of {} have no pose and are passed over", placed + lost),
        }
    }

    fn in_order(&self, keys: &[Key], names: &[&str], scans: &mut [FileScan], path: &Path) -> Result<String, String> {
        let (poses, count) = (self.poses().len(), scans.len());
        if count != poses {
            let [poses, count] = [counted(poses as u64, "pose", "poses"), counted(count as u64, "scan", "scans")];
            return Err(format!(
                "{poses} for {count}, whose names have no times of the list: open as many scans as there are poses, in order"
            ));
        }
        for (scan, pose) in order_of(keys, names)?.into_iter().zip(self.poses()) {
            scans[scan].world_from_sensor = *pose;
        }
        let (list, count) = (file::name(path), counted(count as u64, "scan", "scans"));
        Ok(if !keys.is_empty() && poses > 1 {
            format!("{list}: placed {count} in the order of the numbers in their names")
        } else {
            format!("{list}: placed {count} in their order")
        })
    }
}

/// Whether scans are the parts of one file.
fn are_parts(scans: &[FileScan]) -> bool {
    let [first, _, ..] = scans else { return false };
    let are_parted = || scans.windows(2).all(|two| two[0].part < two[1].part);
    scans.iter().all(|scan| scan.path == first.path && !scan.is_frame()) && are_parted()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::text::Lines;
    use crate::import::trajectory::parse;

    const LOG: &str = "0 0 1\n1 0 0 1\n0 1 0 2\n0 0 1 3\n0 0 0 1\n1 1 2\n0 -1 0 0\n1 0 0 0\n0 0 1 0\n0 0 0 1\n";
    const TUM: &str = "# t\n10.00 1 2 3 0 0 0 1\r\n10.05 1 1 1 0 0 1 0\n";

    /// Theorem: scans whose names have times take the poses of these. Others take them in their order, all or none.
    #[test]
    fn times_or_the_order_decide() {
        let [log, tum] =
            [LOG, TUM].map(|text| parse(Lines::new(text.as_bytes(), text.len() as u64, Path::new("t"))).unwrap());
        let scan = |name: &str| FileScan { name: name.to_owned(), ..FileScan::new(Path::new("x")) };
        let twice = tum.place(&mut vec![scan("10.04"), scan("10.011"), scan("10.040")], Path::new("t")).unwrap_err();
        assert!(twice.to_string().contains("10.04 and 10.040 have the same number in their names"), "{twice}");
        let mut rivals = vec![scan("10.04"), scan("10.011"), scan("depth_10.049")];
        let note = tum.place(&mut rivals, Path::new("t")).unwrap().remove(0);
        assert!(note.ends_with("1 of 3 has no pose of its own within 0.02 s and is passed over"), "{note}");
        assert_eq!(rivals.iter().map(|scan| scan.name.as_str()).collect::<Vec<_>>(), ["10.011", "depth_10.049"]);
        let mut scans = vec![scan("10.049"), scan("10.011")];
        assert!(tum.place(&mut scans, Path::new("t")).unwrap()[0].contains("placed 2 scans by the times"));
        let are_second =
            |scans: &[FileScan]| scans.iter().map(|s| s.world_from_sensor == tum.poses()[1]).collect::<Vec<_>>();
        assert_eq!(are_second(&scans), [true, false]);
        scans.insert(1, scan("12"));
        let note = tum.place(&mut scans, Path::new("t")).unwrap().remove(0);
        assert!(note.ends_with(
            "placed 2 scans by the times in their names, and 1 of 3 has no pose of its own within 0.02 s and is passed over"
        ));
        assert_eq!(are_second(&scans), [true, false]);
        let refused = tum.place(&mut vec![scan("12.5")], Path::new("t")).unwrap_err().to_string();
        assert!(refused.contains("within 0.02 s of 12.5"), "{refused}");
        let mut named = vec![scan("a"), scan("b")];
        log.place(&mut named, Path::new("t")).unwrap();
        assert_eq!(named[1].world_from_sensor, log.poses()[1]);
        named.pop();
        assert!(log.place(&mut named, Path::new("t")).unwrap_err().to_string().contains("2 poses for 1 scan"));
    }

    /// The scans that have a pose, each with the x of it, and the note. Or the problem.
    fn placed(list: &str, names: &[&str]) -> std::result::Result<(Vec<(String, f64)>, String), String> {
        let list = parse(Lines::new(list.as_bytes(), list.len() as u64, Path::new("t"))).unwrap();
        let mut scans: Vec<FileScan> =
            names.iter().map(|name| FileScan { name: (*name).to_owned(), ..FileScan::new(Path::new("x")) }).collect();
        let notes = list.place(&mut scans, Path::new("t")).map_err(|error| error.to_string())?;
        let places = scans.into_iter().map(|scan| (scan.name, scan.world_from_sensor.translation.x)).collect();
        Ok((places, notes.concat()))
    }

    /// A list whose times are these, and whose places count from 0.
    fn timed(times: &[&str]) -> String {
        times.iter().enumerate().map(|(k, time)| format!("{time} {k} 0 0 0 0 0 1\n")).collect()
    }

    /// Theorem: times that names have as numbers place them, however many these are. The order of the files says nothing then.
    #[test]
    fn numbers_in_names_decide() {
        let own = |pairs: &[(&str, f64)]| -> Vec<(String, f64)> {
            pairs.iter().map(|(name, x)| ((*name).to_owned(), *x)).collect()
        };
        let (places, note) = placed(&timed(&["1", "2", "3", "10"]), &["view1", "view10", "view2", "view3"]).unwrap();
        assert_eq!(places, own(&[("view1", 0.0), ("view10", 3.0), ("view2", 1.0), ("view3", 2.0)]));
        assert!(note.ends_with("placed 4 scans by the numbers in their names"), "{note}");
        // As many poses as scans, but one of either is another's. A scan without a number has none.
        let (places, note) =
            placed(&timed(&["0000", "0002", "0003", "0005"]), &["f_0", "f_1", "f_2", "f_3", "mask"]).unwrap();
        assert_eq!(places, own(&[("f_0", 0.0), ("f_2", 1.0), ("f_3", 2.0)]));
        assert!(note.ends_with("2 of 5 have no pose and are passed over"), "{note}");
        let (places, _) = placed(&timed(&["10.0", "10.5"]), &["depth_10.502", "extra", "depth_10.499"])
            .unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(places.len(), 1);
    }

    /// Theorem: scans that order alone places are as many as the poses, are ordered as their numbers, and contradict no time.
    #[test]
    fn order_decides_where_nothing_else_does() {
        let kitti: String = (0..3).map(|k| format!("1 0 0 {k} 0 1 0 0 0 0 1 0\n")).collect();
        let seconds = timed(&["0.0", "0.5", "1.0"]);
        for list in [&kitti, &seconds] {
            let (places, note) = placed(list, &["view1", "view10", "view2"]).unwrap();
            assert_eq!(places.iter().map(|(_, x)| *x).collect::<Vec<_>>(), [0.0, 2.0, 1.0]);
            assert!(note.ends_with("placed 3 scans in the order of the numbers in their names"), "{note}");
            let (places, note) = placed(list, &["c", "a", "b"]).unwrap();
            assert_eq!(places.iter().map(|(_, x)| *x).collect::<Vec<_>>(), [0.0, 1.0, 2.0]);
            assert!(note.ends_with("placed 3 scans in their order"), "{note}");
            // Frame 1 is not at 1 s.
            let refused = placed(list, &["0", "1"]).unwrap_err();
            assert!(refused.contains("3 poses for 2 scans, whose names have no times of the list"), "{refused}");
        }
        let refused = placed(&timed(&["0", "1", "2"]), &["view1", "view2", "view3"]).unwrap_err();
        assert!(
            refused.contains("its times are 0 to 2, but the numbers in the names of the scans are 1 to 3"),
            "{refused}"
        );
        let refused = placed(&timed(&["0", "1", "2"]), &["A_1", "B_1"]).unwrap_err();
        assert!(refused.contains("A_1 and B_1 have the same number in their names"), "{refused}");
    }

    /// A log whose headers are `k k k+1`, and whose places count from 0.
    fn logged(numbers: &[i32]) -> String {
        let block = |(x, k): (usize, &i32)| format!("{k} {k} {}\n1 0 0 {x}\n0 1 0 0\n0 0 1 0\n0 0 0 1\n", k + 1);
        numbers.iter().enumerate().map(block).collect()
    }

    fn kitti(count: usize) -> String {
        (0..count).map(|k| format!("1 0 0 {k} 0 1 0 0 0 0 1 0\n")).collect()
    }

    /// Lines of RTAB-Map's with these numbers.
    fn mapped(ids: &[i32]) -> String {
        let line = |(x, id): (usize, &i32)| format!("{x}.5 {x} 0 0 0 0 0 1 {id}\n");
        "#timestamp x y z qx qy qz qw id\n".to_owned() + &ids.iter().enumerate().map(line).collect::<String>()
    }

    /// Theorem: in whatever order files come, a scan takes the pose of the number by which its name differs from the others.
    #[test]
    fn the_number_that_differs_decides() {
        let letters = ["0", "1", "10", "11", "2", "3", "4", "5", "6", "7", "8", "9"];
        let stamps: Vec<String> = (0..12).map(|k| format!("{:06}-{:012}", k + 1, k * 33369)).collect();
        let seconds: Vec<String> = (0..12).map(|k| format!("0.{k:02}")).collect();
        let wholes: Vec<String> = (0..12).map(|k| k.to_string()).collect();
        let times = |texts: &[String]| timed(&texts.iter().map(String::as_str).collect::<Vec<_>>());
        let log = logged(&(0..12).collect::<Vec<_>>());
        for list in [kitti(12), times(&seconds), times(&wholes), log.clone(), mapped(&(0..12).collect::<Vec<_>>())] {
            for [before, behind] in [["", "_640x480"], ["frame", "_v2"], ["cam1_", ""], ["f_", " (2)"], ["view (", ")"]]
            {
                let names: Vec<String> = letters.iter().map(|k| format!("{before}{k}{behind}")).collect();
                let names: Vec<&str> = names.iter().map(String::as_str).collect();
                let (places, note) = placed(&list, &names).unwrap_or_else(|refused| panic!("{names:?}: {refused}"));
                for ((name, x), k) in places.iter().zip(letters) {
                    assert_eq!(x.to_string(), k, "{name}: {note}");
                }
            }
        }
        for list in [kitti(12), log, times(&seconds)] {
            let mut names: Vec<&str> = stamps.iter().map(String::as_str).collect();
            names.reverse();
            let (places, _) = placed(&list, &names).unwrap();
            assert_eq!(
                places.iter().map(|(_, x)| *x).collect::<Vec<_>>(),
                (0..12).rev().map(f64::from).collect::<Vec<_>>()
            );
        }
    }

    /// Theorem: a scan whose place is in doubt is refused by name, whatever list it is.
    #[test]
    fn doubt_is_refused() {
        let frames: Vec<String> = (0..11).map(|k| format!("frame{k}")).chain(["mean".to_owned()]).collect();
        let frames: Vec<&str> = frames.iter().map(String::as_str).collect();
        let f: Vec<String> = (0..6).map(|k| format!("f_{k}")).collect();
        let f: Vec<&str> = f.iter().map(String::as_str).collect();
        let numbered = |numbers: &[i32]| numbers.iter().map(|k| format!("{k:06}")).collect::<Vec<_>>();
        let (gaps, maps) = (numbered(&[0, 1, 2, 4, 5]), numbered(&[1, 5, 6, 9]));
        let gaps: Vec<&str> = gaps.iter().map(String::as_str).collect();
        let maps: Vec<&str> = maps.iter().map(String::as_str).collect();
        for (list, names, problem) in [
            (kitti(12), &frames[..], "mean has no number in its name"),
            (kitti(4), &["f_0", "f_1", "f_1 (2)", "f_3"][..], "f_1 and f_1 (2) have the same number"),
            (timed(&["0", "1", "2", "3"]), &["f_0", "f_1", "f_1 (2)", "f_3"], "f_1 and f_1 (2) have the same number"),
            (kitti(2), &["mean", "mean (2)"], "mean has no number in its name"),
            (timed(&["0", "0.5", "1", "2", "3", "4"]), &f, "5 of 6 numbers in the names of the scans are times"),
            (timed(&["3", "5", "9"]), &f[..3], "Only 0 of them fit"),
            (logged(&[0, 1, 2, 3, 5]), &gaps, "the first and the third number before each matrix"),
            (logged(&[0, 2, 3, 5]), &f[..4], "the first and the third number before each matrix"),
            (
                mapped(&[0, 1, 2]),
                &f[1..4],
                "its numbers are 0 to 2, but the numbers in the names of the scans are 1 to 3",
            ),
            (
                timed(&["0", "1", "2", "3", "4", "5", "7"]),
                &["frame3_v2"],
                "which of the 2 numbers in the name frame3_v2",
            ),
            (timed(&["1", "2", "4", "7"]), &["f1_e4", "f2_e7"], "the numbers in the name say different ones"),
            (kitti(2), &["f1_e4", "f2_e3"], "give two orders"),
        ] {
            let refused = placed(&list, names).unwrap_err();
            assert!(refused.contains(problem), "{names:?}: {refused}");
        }
        // The other scans have their own.
        let (places, note) = placed(&mapped(&[1, 5, 8, 9]), &maps).unwrap();
        assert_eq!(places, [("000001", 0.0), ("000005", 1.0), ("000009", 3.0)].map(|(name, x)| (name.to_owned(), x)));
        assert!(
            note.ends_with("placed 3 scans by the numbers in their names, and 1 of 4 has no pose and is passed over")
        );
        let (places, _) = placed(&logged(&[0, 1, 2, 4, 5]), &gaps).unwrap();
        assert_eq!(places.len(), 5);
        let (places, _) =
            placed(&timed(&["0", "1", "2", "3", "4", "5", "6", "7", "8", "9", "10", "11"]), &frames).unwrap();
        assert_eq!(places.len(), 11);
        assert_eq!(placed(&kitti(1), &["frame3_v2"]).unwrap().0.len(), 1);
    }
}
