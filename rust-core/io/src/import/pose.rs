//! Poses as matrices: of any file that holds one, and in a file of its own beside a scan.
//!
//! `.xf`, `.tf` and `.pose.txt` hold the 16 numbers of the matrix that places the scan, row by row. A matrix whose last
//! column, not row, is 0 0 0 1 is one written column by column. Both fit a matrix without translation: the order is then the one
//! that its format asks for.

use std::ffi::OsStr;
use std::io::Read;
use std::path::{Path, PathBuf};

use glam::{DAffine3, DMat3, DVec3};

use super::file;
use super::scan::FileScan;
use base::error::{Error, Result};

/// Longest file of a pose.
const LONGEST: u64 = 1 << 14;

/// Rounding by single precision of a last row of 0 0 0 1 that was multiplied.
const ROUNDED: f64 = 1e-6;

/// Places a scan if there is a file of its pose beside it. A note that says so.
pub(super) fn beside(scan: &mut FileScan) -> Result<Option<String>> {
    let Some(path) = candidates(&scan.path).into_iter().find(|path| file::is_file(path)) else { return Ok(None) };
    let (file, length) = file::open(&path)?;
    if length > LONGEST {
        return Err(Error::format(&path, "whole file", format!("{length} bytes are more than a pose, a 4 x 4 matrix")));
    }
    let mut bytes = Vec::new();
    file.take(length).read_to_end(&mut bytes).map_err(|e| Error::io(&path, e))?;
    scan.world_from_sensor = parse(&bytes).map_err(|problem| Error::format(&path, "whole file", problem))?;
    Ok(Some(format!("{}: placed by {}", file::name(&scan.path), file::name(&path))))
}

/// The files that could hold the pose of a scan.
fn candidates(path: &Path) -> Vec<PathBuf> {
    let Some(stem) = path.file_stem() else { return Vec::new() };
    // Names need not be UTF-8.
    let named = |stem: &OsStr, ending: &str| {
        let mut name = stem.to_owned();
        name.push(ending);
        path.with_file_name(name)
    };
    // The frames of 7-Scenes: frame-000000.depth.png, frame-000000.pose.txt.
    let is_depth = Path::new(stem).extension().is_some_and(|ending| ending == "depth");
    let bare = if is_depth { Path::new(stem).file_stem().unwrap_or(stem) } else { stem };
    vec![named(stem, ".xf"), named(bare, ".xf"), named(bare, ".tf"), named(bare, ".pose.txt")]
}

/// The pose that a text of 16 numbers holds.
pub(super) fn parse(bytes: &[u8]) -> Result<DAffine3, String> {
    let text = std::str::from_utf8(bytes).map_err(|_| "this is not text (UTF-8)".to_owned())?;
    let mut rows = [0.0; 16];
    let mut words = text.split_ascii_whitespace();
    for (i, value) in rows.iter_mut().enumerate() {
        let word = words.next().ok_or_else(|| format!("a pose must be a 4 x 4 matrix, found {i} numbers"))?;
        let shown: String = word.chars().take(40).collect();
        *value = word.parse().map_err(|_| format!("expected number {} of 16, found `{shown}`", i + 1))?;
    }
    if words.next().is_some() {
        return Err("a pose must be a 4 x 4 matrix, found more than 16 numbers".to_owned());
    }
    from_rows(&rows)
}

/// The rigid transform nearest to a 4 x 4 matrix, given row by row or, where only that fits, column by column.
pub(super) fn from_rows(rows: &[f64; 16]) -> Result<DAffine3, String> {
    rigid(affine(rows, Order::Rows)?)
}

/// The order of a matrix's numbers in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    /// Points are columns: the translation is the last number of each of the first three lines.
    Rows,
    /// Points are rows: the translation is the last line.
    Columns,
}

/// The affine transform of a 4 x 4 matrix, given in the order that is expected or, where only that fits, in the other.
pub(super) fn affine(numbers: &[f64; 16], expected: Order) -> Result<DAffine3, String> {
    if let Some(bad) = numbers.iter().find(|x| !x.is_finite()) {
        return Err(format!("{bad} is not a finite number"));
    }
    let zero = |x: f64| x.abs() <= ROUNDED;
    let fits = |order: Order| match order {
        Order::Rows => (0..3).all(|i| zero(numbers[12 + i])),
        Order::Columns => (0..3).all(|i| zero(numbers[4 * i + 3])),
    };
    let other = if expected == Order::Rows { Order::Columns } else { Order::Rows };
    let order = [expected, other].into_iter().find(|&order| fits(order)).filter(|_| zero(numbers[15] - 1.0));
    let Some(order) = order else {
        return Err("the last row of the matrix, or its last column, must be 0 0 0 1".to_owned());
    };
    let at = |row: usize, col: usize| match order {
        Order::Rows => numbers[4 * row + col],
        Order::Columns => numbers[4 * col + row],
    };
    let axis = |col| DVec3::new(at(0, col), at(1, col), at(2, col));
    Ok(DAffine3 { matrix3: DMat3::from_cols(axis(0), axis(1), axis(2)), translation: axis(3) })
}

/// The rigid transform nearest to a matrix.
pub(super) fn rigid(transform: DAffine3) -> Result<DAffine3, String> {
    image::rigid::nearest(transform).map_err(|why| format!("the matrix is not a rigid transform: {why}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    #[test]
    fn rows_columns_and_few_digits() {
        let text = "0 -1 0 5\n1 0 0 6\n0 0 1 7\n0 0 0 1\n";
        let pose = parse(text.as_bytes()).unwrap();
        assert_eq!(pose.transform_point3(DVec3::X), DVec3::new(5.0, 7.0, 7.0));
        assert_eq!(parse(b"0 1 0 0  -1 0 0 0  0 0 1 0  5 6 7 1").unwrap(), pose);
        let turn = DMat3::from_quat(DQuat::from_euler(glam::EulerRot::XYZ, 0.3, -1.2, 2.0));
        let printed = turn.transpose().to_cols_array().map(|x| (x * 1e4).round() / 1e4);
        let m = printed;
        let rows = [m[0], m[1], m[2], 1e6, m[3], m[4], m[5], 2e6, m[6], m[7], m[8], 3e6, 0.0, 0.0, 0.0, 1.0];
        let near = from_rows(&rows).unwrap();
        let rest = near.matrix3.transpose() * near.matrix3 - DMat3::IDENTITY;
        assert!(rest.to_cols_array().iter().all(|x| x.abs() < 1e-15), "{rest}");
        assert!((near.matrix3 - turn).to_cols_array().iter().all(|x| x.abs() < 1e-4));
        assert_eq!(near.translation, DVec3::new(1e6, 2e6, 3e6));
    }

    #[test]
    fn what_is_no_pose() {
        for (text, problem) in [
            ("1 0 0", "found 3 numbers"),
            ("1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 1", "more than 16"),
            ("1 0 0 0 0 x 0 0 0 0 1 0 0 0 0 1", "expected number 6 of 16, found `x`"),
            ("2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1", "lengths 2.0000, 2.0000, 2.0000"),
            ("1 0 0 0 0 1 0 0 0 0 -1 0 0 0 0 1", "mirrors"),
            ("1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 nan", "not a finite number"),
            ("1 0 0 1 0 1 0 0 0 0 1 0 1 0 0 1", "the last row of the matrix, or its last column, must be"),
        ] {
            let error = parse(text.as_bytes()).unwrap_err();
            assert!(error.contains(problem), "{error}");
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn names_need_not_be_utf_8() {
        use std::os::unix::ffi::OsStrExt;
        let named = |bytes: &[u8]| PathBuf::from(OsStr::from_bytes(bytes));
        let expected: [&[u8]; 4] = [b"a/\xff.b.xf", b"a/\xff.b.xf", b"a/\xff.b.tf", b"a/\xff.b.pose.txt"];
        assert_eq!(candidates(&named(b"a/\xff.b.ply")), expected.map(named));
        let expected: [&[u8]; 4] = [b"\xff.depth.xf", b"\xff.xf", b"\xff.tf", b"\xff.pose.txt"];
        assert_eq!(candidates(&named(b"\xff.depth.png")), expected.map(named));
    }

    #[test]
    fn a_pose_beside_its_scan() {
        let folder = tempfile::tempdir().unwrap();
        let scan = folder.path().join("frame-1.depth.png");
        let point = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
            end_header\n0 0 0\n";
        std::fs::write(&scan, point).unwrap();
        std::fs::write(folder.path().join("frame-1.pose.txt"), "1 0 0 1 0 1 0 2 0 0 1 3 0 0 0 1").unwrap();
        let set = crate::import::open(&scan).unwrap();
        assert_eq!(set.scans[0].world_from_sensor.translation, DVec3::new(1.0, 2.0, 3.0));
        assert_eq!(set.notes, ["frame-1.depth.png: placed by frame-1.pose.txt"]);
        std::fs::write(folder.path().join("frame-1.depth.xf"), "1 0").unwrap();
        let error = crate::import::open(&scan).unwrap_err().to_string();
        assert!(
            error.ends_with("frame-1.depth.xf: whole file: a pose must be a 4 x 4 matrix, found 2 numbers"),
            "{error}"
        );
    }
}
