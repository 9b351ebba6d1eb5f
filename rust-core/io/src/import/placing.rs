//! The pose of each scan: by the scans that the list names, else by the numbers in their names, else in their order.

use std::collections::BTreeMap;
use std::path::Path;

use glam::DAffine3;
use rustc_hash::FxHashMap;

use super::file;
use super::numbering::{Number, number_in};
use super::placing_by_name::by_names;
use super::scan::FileScan;
use super::trajectory::{APART, Trajectory};
use base::error::{Error, Result};

/// Whole numbers from here on are times, as seconds since 1970 are: no frame has such a number.
const TIMES_FROM: f64 = 1e8;

/// Meaning of the times of a list.
#[derive(Clone, Copy, PartialEq)]
enum Meaning {
    /// Times near those that names have.
    Times,
    /// The numbers that names have.
    Numbers,
    /// Neither.
    Others,
}

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
        let names: Vec<String> = scans.iter().map(|scan| scan.own_name().to_owned()).collect();
        let numbers: Vec<Option<Number<'_>>> = names.iter().map(|name| number_in(name)).collect();
        let note = match self.meaning(&numbers) {
            Meaning::Others => self.in_order(&numbers, scans, path),
            meaning => self.by_numbers(meaning, &numbers, scans, path),
        };
        note.map(|note| vec![note])
    }

    fn meaning(&self, numbers: &[Option<Number<'_>>]) -> Meaning {
        let Some(times) = self.times() else { return Meaning::Others };
        let is_time = |number: &Number<'_>| number.text.contains('.') || number.value >= TIMES_FROM;
        if numbers.iter().flatten().any(is_time) {
            return Meaning::Times;
        }
        let are_numbers =
            times.iter().all(|time| time.fract() == 0.0) && times.windows(2).all(|pair| pair[0] < pair[1]);
        let has = |number: &Number<'_>| self.nearest(number.value, 0.0).is_some();
        if are_numbers && numbers.iter().flatten().any(has) { Meaning::Numbers } else { Meaning::Others }
    }

    fn by_numbers(
        &self,
        meaning: Meaning,
        numbers: &[Option<Number<'_>>],
        scans: &mut Vec<FileScan>,
        path: &Path,
    ) -> Result<String> {
        let fail = |problem: String| Err(Error::format(path, "whole file", problem));
        let times = self.times().unwrap_or_default();
        let apart = if meaning == Meaning::Times { APART } else { 0.0 };
        // Distances and scans of each pose that these are nearest to.
        let mut near: BTreeMap<usize, Vec<(f64, usize)>> = BTreeMap::new();
        for (scan, number) in numbers.iter().enumerate() {
            let Some(value) = number.map(|number| number.value) else { continue };
            if let Some(pose) = self.nearest(value, apart) {
                near.entry(pose).or_default().push(((times[pose] - value).abs(), scan));
            }
        }
        let mut pose_of: FxHashMap<usize, DAffine3> = FxHashMap::default();
        for (pose, mut rivals) in near {
            rivals.sort_by(|a, b| a.0.total_cmp(&b.0));
            if let [first, second, ..] = rivals[..]
                && first.0 == second.0
            {
                return fail(format!(
                    "{} and {} both take the pose of time {}. Open the scans that the list is of, or align them and write \
                        the list anew, which then names them.",
                    scans[first.1].name, scans[second.1].name, times[pose]
                ));
            }
            pose_of.insert(rivals[0].1, self.poses()[pose]);
        }
        if pose_of.is_empty() {
            let shown = numbers.iter().flatten().next().map_or("", |number| number.text);
            return fail(format!("a pose must lie within {APART} s of {shown}, but none does"));
        }
        if meaning == Meaning::Numbers {
            self.refuse_doubt(numbers, pose_of.len(), path)?;
        }
        let [placed, lost] = keep(scans, &pose_of);
        let (list, count) = (file::name(path), many(placed, "scan"));
        let said = match meaning {
            Meaning::Times => format!("{list}: placed {count} by the times in their names"),
            _ => format!("{list}: placed {count} by the numbers in their names"),
        };
        Ok(match (lost, meaning) {
            (0, _) => said,
            (1, Meaning::Times) => {
                format!("{said}, and 1 of {} has no pose of its own within {APART} s and is passed over", placed + lost)
            }
            (_, Meaning::Times) => {
                let of = placed + lost;
                format!("{said}, and {lost} of {of} have no pose of their own within {APART} s and are passed over")
            }
            (1, _) => format!("{said}, and 1 of {} has no pose and is passed over", placed + lost),
            _ => format!("{said}, and {lost} of {} have no pose and are passed over", placed + lost),
        })
    }

    /// Refuses scans that some numbers and their order place differently, where either may be meant.
    fn refuse_doubt(&self, numbers: &[Option<Number<'_>>], fit: usize, path: &Path) -> Result<()> {
        let times = self.times().unwrap_or_default();
        let known: Vec<f64> = numbers.iter().flatten().map(|number| number.value).collect();
        let count_on = matches!(times, [first, .., last] if *first <= 1.0 && last - first == (times.len() - 1) as f64);
        let are_as_many = times.len() == numbers.len() || times.len() == known.len();
        if fit == known.len() || !are_as_many || !(count_on || fit * 2 < known.len()) {
            return Ok(());
        }
        let least = known.iter().copied().fold(f64::INFINITY, f64::min);
        let most = known.iter().copied().fold(0.0, f64::max);
        let problem = format!(
            "its times are {} to {}, but the numbers in the names of the scans are {least} to {most}. Only {fit} of them fit, so \
                that the order may be meant. Open the scans that fit alone, or number them as the list does.",
            times[0],
            times[times.len() - 1]
        );
        Err(Error::format(path, "whole file", problem))
    }

    fn in_order(&self, numbers: &[Option<Number<'_>>], scans: &mut [FileScan], path: &Path) -> Result<String> {
        let (poses, count) = (self.poses().len(), scans.len());
        if count != poses {
            let [poses, count] = [many(poses, "pose"), many(count, "scan")];
            let problem = format!(
                "{poses} for {count}, whose names have no times of the list: open as many scans as there are poses, in order"
            );
            return Err(Error::format(path, "whole file", problem));
        }
        let mut order: Vec<usize> = (0..count).collect();
        let value = |scan: usize| numbers[scan].map_or(f64::NAN, |number| number.value);
        order.sort_by(|&a, &b| value(a).total_cmp(&value(b)));
        let is_numbered = order.windows(2).all(|pair| value(pair[0]) < value(pair[1]));
        if !is_numbered {
            order.sort_unstable();
        }
        for (scan, pose) in order.into_iter().zip(self.poses()) {
            scans[scan].world_from_sensor = *pose;
        }
        let (list, count) = (file::name(path), many(count, "scan"));
        Ok(if is_numbered && poses > 1 {
            format!("{list}: placed {count} in the order of the numbers in their names")
        } else {
            format!("{list}: placed {count} in their order")
        })
    }
}

/// Leaves the scans that have a pose, with it. How many these are, and how many have none.
pub(super) fn keep(scans: &mut Vec<FileScan>, pose_of: &FxHashMap<usize, DAffine3>) -> [usize; 2] {
    let (all, mut number) = (scans.len(), 0);
    scans.retain_mut(|scan| {
        let pose = pose_of.get(&number);
        number += 1;
        scan.world_from_sensor = pose.copied().unwrap_or_default();
        pose.is_some()
    });
    [scans.len(), all - scans.len()]
}

/// A count of things with their noun.
pub(super) fn many(count: usize, noun: &str) -> String {
    if count == 1 { format!("1 {noun}") } else { format!("{count} {noun}s") }
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
        assert!(twice.to_string().contains("10.04 and 10.040 both take the pose of time 10.05"), "{twice}");
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
        assert!(refused.contains("A_1 and B_1 both take the pose of time 1"), "{refused}");
    }
}
