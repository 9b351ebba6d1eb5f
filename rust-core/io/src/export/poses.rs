//! Lists that place files: VRIP's `.conf`, MeshLab's projects and alignments, TUM's trajectories.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use glam::{DAffine3, DMat4, DQuat};

use super::atomic::stage;
use super::conf::{PlacedFile, check_placed, check_pose, write_conf};
use crate::import::listed_scan::ListedScan;
use crate::import::numbering::number_in;
use base::error::{Error, Result, known_as};
use base::progress::Progress;

/// Writes the poses of files, by the ending of the name: `.conf`, `.mlp` or `.aln`. [`write_trajectory`] writes `.tum`.
///
/// # Errors
/// Another ending. A name that the format can't hold. A pose that isn't rigid. [`Error::Io`]. No file is left then.
pub fn write_poses(path: &Path, placed: &[PlacedFile]) -> Result<()> {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    let text = match ending.as_deref() {
        Some("conf") => return write_conf(path, placed),
        Some("mlp") => project,
        Some("aln") => alignment,
        _ => {
            let endings = ".conf (VRIP), .mlp or .aln (MeshLab) or .tum (TUM)";
            return Err(Error::input(format!("{}: the name of a list of poses must end in {endings}", known_as(path))));
        }
    };
    placed.iter().try_for_each(check_placed)?;
    let text = text(placed);
    stage(path, &Progress::none(), |file| file.write_all(text.as_bytes()).map_err(|e| Error::io(path, e)))?.keep()
}

/// A scan and its place, for [`write_trajectory`].
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedScan {
    /// Its name among the scans of its file.
    pub name: String,
    /// Its file, relative to the folder of the list or absolute. Empty if there is none.
    pub file: String,
    /// Its number among all that were aligned, counted from 0.
    pub number: usize,
    /// Places the scan in the world. A rotation and a translation.
    pub world_from_scan: DAffine3,
}

impl PlacedScan {
    fn listed(&self) -> ListedScan {
        ListedScan { name: self.name.clone(), file: self.file.clone() }
    }
}

/// Writes the poses of scans as TUM's trajectory. A comment before each pose says which scan it is of, so that the list opens with the
/// scans in any order. Times are the numbers in the names, where each scan has one of its own, else the numbers of the scans.
///
/// # Errors
/// Two scans of one name and file. A pose that isn't rigid. [`Error::Io`]. No file is left then.
pub fn write_trajectory(path: &Path, placed: &[PlacedScan]) -> Result<()> {
    let listed: Vec<ListedScan> = placed.iter().map(PlacedScan::listed).collect();
    if let Some(place) = ListedScan::twice(listed.iter()) {
        return Err(Error::input(format!(
            "{:?} is the name of two scans, which a list of poses must tell apart. Give each a name of its own, or \
                open their files together.",
            listed[place].name
        )));
    }
    for scan in placed {
        check_pose(&scan.name, &scan.world_from_scan)?;
    }
    let text = trajectory(placed);
    stage(path, &Progress::none(), |file| file.write_all(text.as_bytes()).map_err(|e| Error::io(path, e)))?.keep()
}

/// Rows of a pose, a line each.
fn rows(pose: &DAffine3) -> String {
    let rows = DMat4::from(*pose).transpose().to_cols_array_2d();
    rows.iter().fold(String::new(), |mut text, [x, y, z, w]| {
        // Nothing can fail: it is written to memory.
        let _ = writeln!(text, "{x} {y} {z} {w}");
        text
    })
}

fn project(placed: &[PlacedFile]) -> String {
    let mut text = "<!DOCTYPE MeshLabDocument>\n<MeshLabProject>\n <MeshGroup>\n".to_owned();
    for PlacedFile { file, world_from_file } in placed {
        let name = escaped(file);
        let label = name.rsplit('/').next().unwrap_or(&name);
        let _ = write!(
            text,
            "  <MLMesh label=\"{label}\" filename=\"{name}\">\n   <MLMatrix44>\n{}</MLMatrix44>\n  </MLMesh>\n",
            rows(world_from_file)
        );
    }
    text + " </MeshGroup>\n</MeshLabProject>\n"
}

fn escaped(name: &str) -> String {
    name.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

fn alignment(placed: &[PlacedFile]) -> String {
    let mut text = format!("{}\n", placed.len());
    for PlacedFile { file, world_from_file } in placed {
        let _ = write!(text, "{file}\n#\n{}", rows(world_from_file));
    }
    text + "0\n"
}

fn trajectory(placed: &[PlacedScan]) -> String {
    let mut text = "# timestamp tx ty tz qx qy qz qw\n".to_owned();
    for (time, scan) in timed(placed) {
        let (t, q) = (scan.world_from_scan.translation, DQuat::from_mat3(&scan.world_from_scan.matrix3).normalize());
        let _ = writeln!(text, "{}", scan.listed().comment());
        let _ = writeln!(text, "{time} {} {} {} {} {} {} {}", t.x, t.y, t.z, q.x, q.y, q.z, q.w);
    }
    text
}

/// The scans in the order of their times, as these are written.
fn timed(placed: &[PlacedScan]) -> Vec<(String, &PlacedScan)> {
    let numbers: Option<Vec<_>> = placed.iter().map(|scan| Some((number_in(&scan.name)?, scan))).collect();
    if let Some(mut numbers) = numbers {
        numbers.sort_by(|a, b| a.0.value.total_cmp(&b.0.value));
        if numbers.windows(2).all(|two| two[0].0.value < two[1].0.value) {
            return numbers.into_iter().map(|(number, scan)| (number.text.to_owned(), scan)).collect();
        }
    }
    placed.iter().map(|scan| (scan.number.to_string(), scan)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import;
    use glam::DVec3;

    #[test]
    fn what_is_written_opens_with_the_same_poses() {
        let folder = tempfile::tempdir().unwrap();
        let names = ["a.ply", "b & c.ply"];
        let poses = [
            DAffine3::from_rotation_translation(
                DQuat::from_axis_angle(DVec3::ONE.normalize(), 1.2),
                DVec3::new(0.1, -2.0, 1e4),
            ),
            DAffine3::from_rotation_translation(DQuat::from_rotation_z(3.0), DVec3::ZERO),
        ];
        for name in names {
            let text = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n";
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        let placed: Vec<PlacedFile> = names
            .iter()
            .zip(poses)
            .map(|(name, world_from_file)| PlacedFile { file: (*name).to_owned(), world_from_file })
            .collect();
        for list in ["set.mlp", "set.aln"] {
            let path = folder.path().join(list);
            write_poses(&path, &placed).unwrap();
            let set = import::open(&path).unwrap();
            assert_eq!(set.scans.len(), 2, "{list}");
            for (scan, pose) in set.scans.iter().zip(poses) {
                assert!(scan.world_from_sensor.abs_diff_eq(pose, 1e-12), "{list}: {:?}", scan.world_from_sensor);
            }
        }
        let refused = write_poses(&folder.path().join("set.txt"), &placed).unwrap_err().to_string();
        assert!(refused.contains(".conf") && !folder.path().join("set.txt").exists(), "{refused}");
        let scaled = PlacedFile { file: "a.ply".to_owned(), world_from_file: DAffine3::from_scale(DVec3::splat(2.0)) };
        assert!(write_poses(&folder.path().join("scaled.aln"), &[scaled]).is_err());
        assert!(!folder.path().join("scaled.aln").exists());
    }

    fn scan(name: &str, file: &str, number: usize) -> PlacedScan {
        let world_from_scan = DAffine3::from_translation(DVec3::splat(number as f64));
        PlacedScan { name: name.to_owned(), file: file.to_owned(), number, world_from_scan }
    }

    fn times(placed: &[PlacedScan]) -> Vec<String> {
        let text = trajectory(placed);
        let lines = text.lines().filter(|line| !line.starts_with('#'));
        lines.map(|line| line.split(' ').next().unwrap().to_owned()).collect()
    }

    /// Theorem: times are numbers of names in their order, digit by digit, if each scan has its own. Else each is the scan's number.
    #[test]
    fn times_are_the_numbers_of_the_scans() {
        let file = |name: &str, number| scan(name, "", number);
        assert_eq!(
            times(&[file("1305031453.404816", 0), file("1305031453.374112", 1)]),
            ["1305031453.374112", "1305031453.404816"]
        );
        assert_eq!(times(&[file("frame_0004", 0), file("frame_0002", 1)]), ["0002", "0004"]);
        // Of five that were aligned two have no pose.
        assert_eq!(times(&[file("hall", 1), file("stairs", 2), file("roof", 4)]), ["1", "2", "4"]);
        assert_eq!(times(&[file("000", 0), file("0000", 1), file("0005", 3)]), ["0", "1", "3"]);
    }

    #[test]
    fn scans_that_no_list_tells_apart_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.tum");
        let refused = write_trajectory(&path, &[scan("a", "b.ply", 0), scan("a", "b.ply", 1)]).unwrap_err().to_string();
        assert!(refused.contains("\"a\" is the name of two scans") && !path.exists(), "{refused}");
        let refused = write_trajectory(&path, &[scan("a", "", 0), scan("a", "b.ply", 1)]).unwrap_err().to_string();
        assert!(refused.contains("\"a\" is the name of two scans") && !path.exists(), "{refused}");
        let mut scaled = scan("a", "", 0);
        scaled.world_from_scan = DAffine3::from_scale(DVec3::splat(2.0));
        assert!(write_trajectory(&path, &[scaled]).is_err() && !path.exists());
        write_trajectory(&path, &[scan("a", "b.ply", 0), scan("a", "c.ply", 1)]).unwrap();
        assert!(path.exists());
    }
}
