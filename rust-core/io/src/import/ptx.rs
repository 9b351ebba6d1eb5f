//! PTX, as Leica's programs write it: scans one after the other, each a grid of points seen from its scanner.
//!
//! ```text
//! columns                     then a line a point, column by column:
//! rows                        x y z
//! scanner's position          x y z intensity
//! three lines: its axes       x y z intensity red green blue
//! four lines: the pose, its
//! translation in the last row
//! ```
//!
//! Points are in the scanner's frame. 0 0 0 means that nothing came back. The rays start at the scanner's position, which is the frame's
//! origin unless the points were moved without their header. Pixel (row, column) is line `column * rows + row`. A pose that scales, shears
//! or mirrors is applied to the points instead.
//!
//! The matrix multiplies rows, so that its lines are the axes once more. Some programs write it the other way round. The place of the
//! translation tells. Without translation, the axes do.
//!
//! Cost: opening looks for line ends only. Reading a scan is one pass over it, memory for the result and a window.

use std::io::SeekFrom;
use std::path::Path;
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::file::{self, Input};
use super::grid::PointGrid;
use super::options::ReadOptions;
use super::pose::{self, Order};
use super::scan::{Content, FileScan};
use super::set::ScanSet;
use super::text::{Lines, lines_of};
use base::error::{Error, Result};
use base::progress::Progress;

/// Fewest bytes of a point: `0 0 0` and a line end.
const SHORTEST: u64 = 6;

/// Whether a file that starts like this is one: its first ten lines have the numbers of a header.
pub(super) fn sniff(start: &[u8]) -> bool {
    let text = String::from_utf8_lossy(start);
    let mut lines = lines_of(&text).skip_while(|line| line.trim().is_empty());
    [1, 1, 3, 3, 3, 3, 4, 4, 4, 4].iter().all(|&count| {
        let mut words = lines.next().unwrap_or("").split_ascii_whitespace();
        words.by_ref().take(count).filter(|word| word.parse::<f64>().is_ok()).count() == count && words.next().is_none()
    })
}

/// The beginning of a scan.
struct Header {
    cols: usize,
    rows: usize,
    /// Position of the scanner in the world.
    position: DVec3,
    pose: DAffine3,
    /// The transform that is applied to the points because it is no rigid one. The pose is none then.
    applied: Option<DAffine3>,
}

fn header(lines: &mut Lines<'_>) -> Result<Header> {
    let cols = lines.count("the number of columns")?;
    lines.expect_line("the number of rows")?;
    let rows = lines.count("the number of rows")?;
    let mut numbers = [0.0; 28];
    let mut rest = numbers.as_mut_slice();
    for (count, what) in [(3, "the scanner's position"), (3, "an axis"), (3, "an axis"), (3, "an axis")]
        .into_iter()
        .chain([(4, "a row of the pose"); 4])
    {
        lines.expect_line(what)?;
        let (line, after) = rest.split_at_mut(count);
        for number in line {
            *number = lines.f64(what)?;
        }
        rest = after;
    }
    let mut matrix = [0.0; 16];
    matrix.copy_from_slice(&numbers[12..]);
    let matrix = pose::affine(&matrix, order(&numbers[3..12], &matrix)).map_err(|problem| lines.fail(problem))?;
    let (pose, applied) = match pose::rigid(matrix) {
        Ok(pose) => (pose, None),
        Err(_) => (DAffine3::IDENTITY, Some(matrix)),
    };
    let position = DVec3::new(numbers[0], numbers[1], numbers[2]);
    if !position.is_finite() {
        return Err(lines.fail("the scanner's position is not finite"));
    }
    let (points, left) = (rows.checked_mul(cols), lines.left()?);
    // The last line needs no end.
    if points.is_none_or(|points| points == 0 || points > (left + 1) / SHORTEST) {
        return Err(lines.fail(format!("{cols} columns of {rows} rows don't fit the {left} bytes that follow")));
    }
    Ok(Header { cols: cols as usize, rows: rows as usize, position, pose, applied })
}

/// Largest difference of the axes of a header from those of its matrix, both printed with few digits.
const SAME_AXES: f64 = 1e-3;

/// The order of a matrix whose translation doesn't tell it: by rows only where the axes are its columns and not its lines.
fn order(axes: &[f64], matrix: &[f64; 16]) -> Order {
    let agree = |at: fn(usize, usize) -> usize| {
        (0..3).all(|axis| (0..3).all(|k| (axes[3 * axis + k] - matrix[at(axis, k)]).abs() <= SAME_AXES))
    };
    let (are_lines, are_columns) = (agree(|axis, k| 4 * axis + k), agree(|axis, k| 4 * k + axis));
    if are_columns && !are_lines { Order::Rows } else { Order::Columns }
}

/// Lists the scans.
pub(super) fn open(path: &Path, options: &Arc<ReadOptions>) -> Result<ScanSet> {
    let (file, length) = file::open(path)?;
    let mut lines = Lines::new(file, length, path);
    let mut scans: Vec<FileScan> = Vec::new();
    loop {
        let begin = lines.begin();
        if !lines.next_content()? {
            break;
        }
        let header = header(&mut lines)?;
        for point in 0..header.cols * header.rows {
            if !lines.next_line()? {
                return Err(ends(&lines, point, &header));
            }
        }
        let part = scans.len();
        scans.push(FileScan { part, begin, world_from_sensor: header.pose, ..FileScan::with(path, options) });
    }
    if scans.is_empty() {
        return Err(lines.fail("there is no scan"));
    }
    Ok(ScanSet { scans, notes: Vec::new() })
}

fn ends(lines: &Lines<'_>, point: usize, header: &Header) -> Error {
    lines.ends(&format!("point {point} of {} columns x {} rows", header.cols, header.rows))
}

/// Reads one scan.
pub(super) fn parse(input: &mut dyn Input, length: u64, scan: &FileScan, _: &Progress<'_>) -> Result<Content> {
    input.seek(SeekFrom::Start(scan.begin.byte)).map_err(|e| Error::io(&scan.path, e))?;
    let mut lines = Lines::new(input, length.saturating_sub(scan.begin.byte), &scan.path);
    lines.continue_from(scan.begin);
    if !lines.next_content()? {
        return Err(lines.ends("the number of columns"));
    }
    let header = header(&mut lines)?;
    if !lines.next_line()? {
        return Err(ends(&lines, 0, &header));
    }
    let mut numbers = 0;
    while lines.try_f64().is_some() {
        numbers += 1;
    }
    if !lines.is_done() || ![3, 4, 6, 7].contains(&numbers) {
        return Err(lines.expected("the end of a line of x y z [intensity] [red green blue]"));
    }
    lines.rewind();
    let (intensity, colour) = (numbers == 4 || numbers == 7, numbers >= 6);
    let (rows, cols) = (header.rows, header.cols);
    let mut grid = PointGrid::new(rows, cols, intensity, colour, &scan.path)?;
    for col in 0..cols {
        for row in 0..rows {
            if (row, col) != (0, 0) && !lines.next_line()? {
                return Err(ends(&lines, col * rows + row, &header));
            }
            let pixel = row * cols + col;
            let point = [lines.f64("x")?, lines.f64("y")?, lines.f64("z")?];
            match header.applied {
                Some(matrix) if point != [0.0; 3] => {
                    grid.set(pixel, matrix.transform_point3(DVec3::from_array(point)).to_array());
                }
                _ => grid.set(pixel, point),
            }
            if let Some(list) = &mut grid.intensity {
                list[pixel] = lines.f64("the intensity")? as f32;
            }
            if let Some(list) = &mut grid.colour {
                let [r, g, b] = [lines.f64("red")?, lines.f64("green")?, lines.f64("blue")?];
                // Out of range and NaN go to the nearest end.
                list[pixel] = [r as u8, g as u8, b as u8, 255];
            }
            if !lines.is_done() {
                return Err(lines.expected("the end of the line: each point of a scan has the same columns"));
            }
        }
    }
    let eye = header.pose.inverse().transform_point3(header.position);
    // The position is the pose's translation in other digits.
    let printed = 1e-6 * (1.0 + header.position.abs().max_element());
    let eye = if eye.abs().max_element() <= printed { DVec3::ZERO } else { eye };
    // The pose may have been changed since the file was opened: the header's is already in it.
    grid.into_content(eye, scan)
}

#[cfg(test)]
mod tests {
    use super::super::damage;
    use super::*;

    const POSE: &str = "5 6 7\n0 1 0\n-1 0 0\n0 0 1\n0 1 0 0\n-1 0 0 0\n0 0 1 0\n5 6 7 1\n";

    fn two_scans() -> String {
        format!(
            "2\n3\n{POSE}1 2 3 0.5 255 0 1\n0 0 0 0.5 0 0 0\n1 2 4 0.25 1 2 3\r\n-1.5 2e-1 3 1 300 -1 7\n\
             1 1 1 0 0 0 0\n1 1 2 0 0 0 0\n1\n2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n\
             4000000.25 5000000.5 1\n4000001.75 5000001 2\n\n"
        )
    }

    fn read(text: &str) -> Vec<image::RangeImage> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("two.ptx");
        std::fs::write(&path, text).unwrap();
        let set = crate::import::open(&path).unwrap();
        let content = set.scans.iter().map(|scan| match scan.read().unwrap() {
            Content::RangeImage(image) => image,
            other => panic!("{other:?}"),
        });
        content.collect()
    }

    #[test]
    fn columns_poses_and_no_returns() {
        let images = read(&two_scans());
        assert_eq!(images.iter().map(|i| i.name.as_str()).collect::<Vec<_>>(), ["two", "two (2)"]);
        let image = &images[0];
        assert_eq!((image.rows(), image.cols(), image.valid_count()), (3, 2, 5));
        // The second point of the first column came back from nowhere.
        assert!(!image.is_valid(2));
        assert_eq!(image.point_in_sensor(4), DVec3::new(1.0, 2.0, 4.0));
        assert!((image.point_in_sensor(1) - DVec3::new(-1.5, 0.2, 3.0)).length() < 1e-7);
        assert_eq!(image.point_in_world(4), DVec3::new(3.0, 7.0, 11.0));
        assert_eq!(image.colour.as_ref().unwrap()[1], [255, 0, 7, 255]);
        assert_eq!(image.intensity.as_ref().unwrap()[4], 0.25);
        assert_eq!(
            *image.projection(),
            image::range_image::Projection::PointGrid(image::range_image::Viewing::From(DVec3::ZERO))
        );
        let far = &images[1];
        assert_eq!((far.rows(), far.cols(), &far.colour, &far.intensity), (2, 1, &None, &None));
        assert_eq!(far.point_in_world(0), DVec3::new(4_000_000.25, 5_000_000.5, 1.0));
        assert_eq!(far.point_in_world(1), DVec3::new(4_000_001.75, 5_000_001.0, 2.0));
        // Seen from where the header says, in the shifted frame.
        let (eye, _) = far.ray_in_sensor(0);
        assert_eq!(far.world_from_sensor.transform_point3(eye), DVec3::ZERO);
    }

    #[test]
    fn a_pose_that_scales_is_applied() {
        let image = &read(&format!("1\n2\n{}1 2 3\n0 0 0\n", POSE.replace("0 0 1 0", "0 0 2 0")))[0];
        assert_eq!((image.valid_count(), image.point_in_world(0)), (1, DVec3::new(3.0, 7.0, 13.0)));
        assert_eq!(image.ray_in_sensor(0).0, DVec3::new(5.0, 6.0, 7.0));
    }

    #[test]
    fn what_is_wrong_has_its_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bad.ptx");
        let refused = |text: &str| {
            std::fs::write(&path, text).unwrap();
            let error = crate::import::open(&path).and_then(|set| set.scans[0].read()).unwrap_err().to_string();
            error.strip_prefix(&format!("{}: ", path.display())).unwrap().to_owned()
        };
        let case = |text: String, expected: &str| {
            let found = refused(&text);
            assert!(found.starts_with(expected), "found: {found}\nexpected: {expected}");
        };
        case(format!("1\n3\n{POSE}1 2 3\n1 2 3\n"), "line 10: 1 columns of 3 rows don't fit the 12 bytes");
        case(
            format!("1\n2\n{POSE}1 2 3 4 5 6 7\n"),
            "line 11: expected point 1 of 1 columns x 2 rows, but the file ends",
        );
        case(format!("99999999\n99999999\n{POSE}1 2 3\n"), "line 10: 99999999 columns of 99999999 rows don't fit");
        case(format!("18446744073709551615\n2\n{POSE}1 2 3\n"), "line 1: expected the number of columns");
        case(format!("0\n2\n{POSE}1 2 3\n"), "line 10: 0 columns");
        case(format!("1\n2\n{POSE}1 2 3 4\n1 2 3\n"), "line 12: expected the intensity, but the line ends");
        case(format!("1\n2\n{POSE}1 2 3\n1 2 3 4\n"), "line 12: expected the end of the line");
        case(format!("1\n1\n{POSE}1 2 x\n"), "line 11: expected the end of a line of x y z");
        case(
            format!("1\n1\n{}1 2 3\n", POSE.replace("0 0 1 0", "0 0 1 9")),
            "line 10: the last row of the matrix, or its last column,",
        );
        case("1\n1\n0 0 0\n1 0 0\n".to_owned(), "line 4: expected an axis, but the file ends");
    }

    #[test]
    fn endures_all_damage() {
        let scan = FileScan::new(Path::new("x.ptx"));
        damage::endure(parse, two_scans().as_bytes(), &scan);
        assert!(sniff(two_scans().as_bytes()) && !sniff(b"1\n2\n3 4 5\n") && !sniff(b"ply\n"));
    }
}
