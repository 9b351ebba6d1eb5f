//! E57 (ASTM E2807), through the crate `e57`: scans with row and column indices become range images seen from the origin of their frame,
//! others points. Poses, colours and intensities are kept. Coordinates marked invalid are no samples. Nor are those at exactly (0, 0, 0),
//! where no ray can have been: in grids, and where points are distances and angles. Scans without points, as writers leave them of images
//! without a valid pixel, are left out of a set, which says so.
//!
//! Cost: opening reads the XML part. Reading a scan is one pass over it, memory for the result and some packets. Without the bounds of the
//! indices the grid is the rows and columns that the points use, which takes one more pass.

use std::io::{Read, Seek};
use std::path::Path;
use std::sync::Arc;

use ::e57::{CartesianCoordinate, E57Reader, PointCloud as Stored, RecordDataType, RecordName};
use glam::{DAffine3, DQuat, DVec3};

use super::file::{self, Input, decoding_error, watched};
use super::grid::PointGrid;
use super::options::ReadOptions;
use super::scan::{Content, FileScan};
use super::set::ScanSet;
use base::error::{Error, Result, known_as};
use base::progress::Progress;
use mesh::point_cloud::PointCloud;

/// Fewest points that a grid holds of its pixels: one in so many.
const SPARSEST: u64 = 256;

/// The words for a scan of which nothing is left.
const EMPTY: &str = "has no valid points";
/// Longest name of a scan that is taken, in bytes: longer ones are no names.
const LONGEST_NAME: usize = 200;
/// Largest difference from 1 of the length of a pose's quaternion: writers round to few digits.
const UNIT_WITHIN: f64 = 0.02;
/// Bytes of a pixel of a grid of points: coordinates, intensity, colour.
const PIXEL: u64 = 20;

/// Whether a file that starts like this is one.
pub(super) fn sniff(start: &[u8]) -> bool {
    start.starts_with(b"ASTM-E57")
}

/// Lists the scans.
pub(super) fn open(path: &Path, options: &Arc<ReadOptions>) -> Result<ScanSet> {
    let (mut file, _) = file::open(path)?;
    let scan = FileScan::with(path, options);
    list(&mut file, &scan)
}

fn list(input: &mut dyn Input, scan: &FileScan) -> Result<ScanSet> {
    let stored = watched(input, &scan.path, |input| {
        Ok(E57Reader::new(input).map_err(|e| decoding_error(scan, &e))?.pointclouds())
    })?;
    if stored.is_empty() {
        return Err(Error::format(&scan.path, "whole file", "there is no scan"));
    }
    let (mut scans, mut notes) = (Vec::with_capacity(stored.len()), Vec::new());
    for (part, one) in stored.iter().enumerate() {
        let mut scan = FileScan { part, world_from_sensor: pose(one, &scan.path, part)?, ..scan.clone() };
        if let Some(name) =
            one.name.as_deref().map(str::trim).filter(|name| !name.is_empty() && name.len() < LONGEST_NAME)
        {
            scan.name = name.to_owned();
        }
        if one.records == 0 {
            notes.push(format!("{}: scan {part}, {}, {EMPTY}: it is left out", known_as(&scan.path), scan.name));
        } else {
            scans.push(scan);
        }
    }
    if scans.is_empty() {
        let problem = if stored.len() == 1 {
            format!("the scan {EMPTY}: export it again")
        } else {
            format!("none of {} scans has valid points: export them again", stored.len())
        };
        return Err(Error::format(&scan.path, "whole file", problem));
    }
    Ok(ScanSet { scans, notes })
}

fn pose(stored: &Stored, path: &Path, part: usize) -> Result<DAffine3> {
    let Some(transform) = &stored.transform else { return Ok(DAffine3::IDENTITY) };
    let (q, t) = (&transform.rotation, &transform.translation);
    let rotation = DQuat::from_xyzw(q.x, q.y, q.z, q.w);
    let translation = DVec3::new(t.x, t.y, t.z);
    let length = rotation.length();
    if !(translation.is_finite() && (length - 1.0).abs() < UNIT_WITHIN) {
        let problem = format!("the pose's quaternion has length {length}, or its translation is not finite");
        return Err(Error::format(path, format!("scan {part}"), problem));
    }
    Ok(DAffine3::from_rotation_translation(rotation.normalize(), translation))
}

/// Reads one scan.
pub(super) fn parse(input: &mut dyn Input, length: u64, scan: &FileScan, _: &Progress<'_>) -> Result<Content> {
    watched(input, &scan.path, |input| {
        let mut reader = E57Reader::new(input).map_err(|e| decoding_error(scan, &e))?;
        let at = format!("scan {}", scan.part);
        let fail = |problem: String| Err(Error::format(&scan.path, at.clone(), problem));
        let Some(stored) = reader.pointclouds().into_iter().nth(scan.part) else {
            return fail("there is no such scan".to_owned());
        };
        if stored.records == 0 {
            return fail(format!("the scan {EMPTY}: export it again"));
        }
        // At least a bit per point: files whose points take none are bombs.
        if stored.records > length.saturating_mul(8)
            || stored.records * size_of::<DVec3>() as u64 > scan.options.max_decoded_bytes()
        {
            return fail(format!("{} points don't fit a file of {length} bytes, or max_decoded_gib", stored.records));
        }
        let bounds = match index_bounds(&stored) {
            Some([Some(rows), Some(cols)]) => Some((rows, cols)),
            Some([rows, cols]) => {
                let used = used_indices(points(&mut reader, &stored, scan)?)?;
                used.map(|used| (rows.unwrap_or(used.0), cols.unwrap_or(used.1)))
            }
            None => None,
        };
        let size = bounds.map_or(Ok(None), |(rows, cols)| grid_size(rows, cols, &stored, scan))?;
        let points = points(&mut reader, &stored, scan)?;
        match size {
            Some(size) => grid(points, size, &stored, scan),
            None => cloud(points, &stored, scan),
        }
    })
}

/// The points of a scan as they are stored.
fn points<'a, T: Read + Seek>(
    reader: &'a mut E57Reader<T>,
    stored: &'a Stored,
    scan: &'a FileScan,
) -> Result<impl Iterator<Item = Result<::e57::Point>> + 'a> {
    let mut points = reader.pointcloud_simple(stored).map_err(|e| decoding_error(scan, &e))?;
    points.apply_pose(false);
    points.intensity_to_color(false);
    points.normalize_intensity(false);
    // A packet may hold no point of which all is there, as the first of fewer than eight whose rows are a bit each: the crate takes that
    // for an error of its own. It has read the packet then, so that this ends.
    let next = move || loop {
        match points.next() {
            Some(Err(::e57::Error::Internal { source: None, .. })) => {}
            next => return next,
        }
    };
    Ok(std::iter::from_fn(next).map(|point| point.map_err(|e| decoding_error(scan, &e))))
}

/// First and last.
type Range = (i64, i64);

/// Rows and columns as the scan's header gives them, of a scan whose points have some.
fn index_bounds(stored: &Stored) -> Option<[Option<Range>; 2]> {
    let is_integer = |name: RecordName| {
        let mut records = stored.prototype.iter().filter(|record| record.name == name);
        records.any(|record| matches!(record.data_type, RecordDataType::Integer { .. }))
    };
    if !(stored.has_row_column() && is_integer(RecordName::RowIndex) && is_integer(RecordName::ColumnIndex)) {
        return None;
    }
    let bounds = stored.index_bounds.as_ref();
    let rows = bounds.and_then(|b| Some((b.row_min?, b.row_max?)));
    let cols = bounds.and_then(|b| Some((b.column_min?, b.column_max?)));
    Some([rows, cols])
}

/// Rows and columns that points use. `None` without points.
fn used_indices(points: impl Iterator<Item = Result<::e57::Point>>) -> Result<Option<(Range, Range)>> {
    let with = |range: Option<Range>, at: i64| range.map_or((at, at), |(first, last)| (first.min(at), last.max(at)));
    let (mut rows, mut cols) = (None, None);
    for point in points {
        let point = point?;
        rows = Some(with(rows, point.row));
        cols = Some(with(cols, point.column));
    }
    Ok(rows.zip(cols))
}

/// First row and column and their numbers. `None` for what is no grid but a line.
fn grid_size(rows: Range, cols: Range, stored: &Stored, scan: &FileScan) -> Result<Option<[i64; 4]>> {
    let count = |(min, max): (i64, i64)| max.checked_sub(min)?.checked_add(1).filter(|count| *count > 0);
    let size = count(rows).zip(count(cols));
    let pixels = size.and_then(|(rows, cols)| (rows as u64).checked_mul(cols as u64));
    let most = stored.records.saturating_mul(SPARSEST) + 1;
    match (size, pixels) {
        (Some((1, _) | (_, 1)), _) => Ok(None),
        (Some((r, c)), Some(pixels)) if pixels <= most && pixels * PIXEL <= scan.options.max_decoded_bytes() => {
            Ok(Some([rows.0, cols.0, r, c]))
        }
        _ => Err(Error::format(
            &scan.path,
            format!("scan {}", scan.part),
            format!(
                "rows {} to {} and columns {} to {} are too many for {} points, or for max_decoded_gib",
                rows.0, rows.1, cols.0, cols.1, stored.records
            ),
        )),
    }
}

fn coordinates(point: &::e57::Point) -> Option<[f64; 3]> {
    match point.cartesian {
        CartesianCoordinate::Valid { x, y, z } => Some([x, y, z]),
        _ => None,
    }
}

fn rgba(point: &::e57::Point) -> [u8; 4] {
    // The crate normalizes to 0..1.
    let byte = |x: f32| (x * 255.0).round() as u8;
    point.color.as_ref().map_or([0; 4], |c| [byte(c.red), byte(c.green), byte(c.blue), 255])
}

fn grid(
    points: impl Iterator<Item = Result<::e57::Point>>,
    [first_row, first_col, rows, cols]: [i64; 4],
    stored: &Stored,
    scan: &FileScan,
) -> Result<Content> {
    let (rows, cols) = (rows as usize, cols as usize);
    let mut grid = PointGrid::new(rows, cols, stored.has_intensity(), stored.has_color(), &scan.path)?;
    for (index, point) in points.enumerate() {
        let point = point?;
        let place = |at: i64, first: i64, count: usize| {
            at.checked_sub(first).and_then(|at| usize::try_from(at).ok()).filter(|at| *at < count)
        };
        let (Some(row), Some(col)) = (place(point.row, first_row, rows), place(point.column, first_col, cols)) else {
            let problem = format!("row {} or column {} lies outside the scan's bounds", point.row, point.column);
            return Err(Error::format(&scan.path, format!("scan {}, point {index}", scan.part), problem));
        };
        let pixel = row * cols + col;
        if let Some(position) = coordinates(&point) {
            grid.set(pixel, position);
        }
        if let Some(list) = &mut grid.intensity {
            list[pixel] = point.intensity.unwrap_or(0.0);
        }
        if let Some(list) = &mut grid.colour {
            list[pixel] = rgba(&point);
        }
    }
    grid.into_content(DVec3::ZERO, scan)
}

fn cloud(points: impl Iterator<Item = Result<::e57::Point>>, stored: &Stored, scan: &FileScan) -> Result<Content> {
    let mut cloud = PointCloud {
        world_from_cloud: scan.world_from_sensor,
        intensity: stored.has_intensity().then(Vec::new),
        colour: stored.has_color().then(Vec::new),
        ..PointCloud::default()
    };
    let has_origin = stored.has_cartesian() && !stored.has_row_column();
    for point in points {
        let point = point?;
        let Some(position) = coordinates(&point).map(DVec3::from_array) else { continue };
        if !position.is_finite() || (position == DVec3::ZERO && !has_origin) {
            continue;
        }
        cloud.positions.push(position);
        if let Some(list) = &mut cloud.intensity {
            list.push(point.intensity.unwrap_or(0.0));
        }
        if let Some(list) = &mut cloud.colour {
            list.push(rgba(&point));
        }
    }
    Ok(Content::Points(cloud))
}

#[cfg(test)]
mod tests {
    use super::super::damage;
    use super::*;
    use ::e57::{E57Writer, Quaternion, Record, RecordValue, Transform, Translation};
    use image::range_image::{RangeImage, Viewing};

    /// A scan of 3 x 4 pixels with two missing, then a cloud of three points.
    fn file() -> Vec<u8> {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let mut writer = E57Writer::new(&mut bytes, "file").unwrap();
        let index = |name, max| Record { name, data_type: RecordDataType::Integer { min: 0, max } };
        let structured = vec![
            Record::CARTESIAN_X_F64,
            Record::CARTESIAN_Y_F64,
            Record::CARTESIAN_Z_F64,
            Record { name: RecordName::CartesianInvalidState, data_type: RecordDataType::Integer { min: 0, max: 2 } },
            Record::COLOR_RED_U8,
            Record::COLOR_GREEN_U8,
            Record::COLOR_BLUE_U8,
            index(RecordName::RowIndex, 2),
            index(RecordName::ColumnIndex, 3),
        ];
        let mut scan = writer.add_pointcloud("a", structured).unwrap();
        scan.set_name(Some("Hall".to_owned()));
        let half = std::f64::consts::FRAC_1_SQRT_2;
        scan.set_transform(Some(Transform {
            rotation: Quaternion { w: half, x: 0.0, y: 0.0, z: half },
            translation: Translation { x: 4e6, y: 0.0, z: 0.0 },
        }));
        for i in 0..11 {
            let (row, col) = (i / 4, i % 4);
            let state = if i == 5 { 2 } else { 0 };
            let mut values: Vec<RecordValue> = [col as f64 + 1.0, row as f64, 5.0].map(RecordValue::Double).to_vec();
            values.extend([state, 255, i, 0, row, col].map(RecordValue::Integer));
            scan.add_point(values).unwrap();
        }
        scan.finalize().unwrap();
        let plain =
            vec![Record::CARTESIAN_X_F32, Record::CARTESIAN_Y_F32, Record::CARTESIAN_Z_F32, Record::INTENSITY_U16];
        let mut cloud = writer.add_pointcloud("b", plain).unwrap();
        for i in 0..3_i16 {
            let mut values: Vec<RecordValue> = [i, 2 * i, 0].map(|x| RecordValue::Single(x.into())).to_vec();
            values.push(RecordValue::Integer((100 * i).into()));
            cloud.add_point(values).unwrap();
        }
        cloud.finalize().unwrap();
        writer.finalize().unwrap();
        drop(writer);
        bytes.into_inner()
    }

    #[test]
    fn grids_clouds_and_poses() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("two.e57");
        std::fs::write(&path, file()).unwrap();
        let set = crate::import::open(&path).unwrap();
        assert_eq!(set.scans.iter().map(|s| s.name.as_str()).collect::<Vec<_>>(), ["Hall", "two"]);
        let Content::RangeImage(image) = set.scans[0].read().unwrap() else { panic!("no grid") };
        assert_eq!((image.rows(), image.cols(), image.valid_count()), (3, 4, 10));
        assert!(!image.is_valid(5) && !image.is_valid(11));
        assert!((image.point_in_world(2) - DVec3::new(4e6, 3.0, 5.0)).length() < 1e-9);
        assert_eq!(image.colour.as_ref().unwrap()[7], [255, 7, 0, 255]);
        let Content::Points(cloud) = set.scans[1].read().unwrap() else { panic!("no cloud") };
        assert_eq!(cloud.positions, [DVec3::ZERO, DVec3::new(1.0, 2.0, 0.0), DVec3::new(2.0, 4.0, 0.0)]);
        assert_eq!(cloud.intensity.unwrap(), [0.0, 100.0, 200.0]);
    }

    #[test]
    fn scans_without_valid_points_spoil_no_others() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("set.e57");
        let image = |name: &str, value: f32| {
            let mut image = RangeImage::from_points(2, 3, vec![[value; 3]; 6], Viewing::From(DVec3::ZERO)).unwrap();
            image.name = name.to_owned();
            image
        };
        let images = [image("first", 1.0), image("none", f32::NAN), image("last", 2.0)];
        let write = |images: &[&RangeImage]| {
            crate::export::write_e57(&path, images, None, &Progress::none()).unwrap();
            crate::import::open(&path)
        };
        let set = write(&images.iter().collect::<Vec<_>>()).unwrap();
        assert_eq!(set.notes, [format!("{}: scan 1, none, has no valid points: it is left out", path.display())]);
        assert_eq!(
            set.scans.iter().map(|s| (s.name.as_str(), s.part)).collect::<Vec<_>>(),
            [("first", 0), ("last", 2)]
        );
        for scan in &set.scans {
            let Content::RangeImage(read) = scan.read().unwrap() else { panic!("no image") };
            let expected = &images[scan.part];
            assert_eq!((read.name.as_str(), read.valid_count()), (expected.name.as_str(), 6));
        }
        let error = write(&[&images[1]]).unwrap_err().to_string();
        assert!(error.ends_with("set.e57: whole file: the scan has no valid points: export it again"), "{error}");
        let error = FileScan::new(&path).read().unwrap_err().to_string();
        assert!(error.ends_with("set.e57: scan 0: the scan has no valid points: export it again"), "{error}");
        let error = write(&[&images[1], &images[1]]).unwrap_err().to_string();
        assert!(error.ends_with("none of 2 scans has valid points: export them again"), "{error}");
    }

    #[test]
    fn endures_all_damage() {
        for part in 0..2 {
            let scan = FileScan { part, ..FileScan::new(Path::new("x.e57")) };
            damage::endure(parse, &file(), &scan);
        }
        let scan = FileScan { part: 2, ..FileScan::new(Path::new("x.e57")) };
        let error = damage::read(parse, &file(), &scan).unwrap_err().to_string();
        assert_eq!(error, "x.e57: scan 2: there is no such scan");
    }
}
