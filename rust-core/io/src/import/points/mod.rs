//! Scattered points in text: XYZ, PTS, ASC and whatever else holds one point a line.
//!
//! | file | what |
//! |---|---|
//! | `columns` | meanings of the numbers of a line |
//! | `lines` | lines of a file, with their numbers, in bounded memory |
//! | `problem` | faults, with their lines |
//!
//! Numbers are separated by blanks, tabs, commas or semicolons. Between semicolons, or where blanks separate and each comma stands between
//! digits, a comma is the decimal point. If commas seem to be both, the file is refused. Lines starting with `#`, `//`, `%` or `!` are
//! comments. A line that names the columns, in a comment or not, is obeyed. A line with one whole number announces how many points follow
//! at least, as in PTS. Without names the columns are told by their count and, where that leaves a choice, by the values of the first
//! lines. The notes say what was understood.
//!
//! Points with a coordinate that isn't finite are left out. A line with another count of numbers than the first, or with
//! anything that isn't a number, is an error with its number. Cost: one pass, memory for the result and a line.

mod columns;
mod lines;
mod problem;

use std::io::{BufReader, Read};
use std::path::Path;
use std::sync::Arc;

use glam::DVec3;

use self::columns::{Columns, MOST};
use self::lines::{Line, Lines};
use self::problem::{Kind, Problem, shorten};
use super::file;
use super::options::ReadOptions;
use super::scan::{Content, FileScan};
use super::set::ScanSet;
use super::text::whole_lines;
use base::error::{Error, Result, known_as};
use base::memory;
use base::progress::Progress;
use mesh::point_cloud::PointCloud;

/// Data lines looked at to tell the columns.
const LOOKED_AT: usize = 200;

/// Bytes of a file that are enough for those.
const HEAD: usize = 1 << 16;

/// Whether a file that starts like this holds points in text.
pub(super) fn sniff(start: &[u8]) -> bool {
    // The last line may be cut.
    let whole = whole_lines(start);
    if whole.contains(&0) {
        return false;
    }
    let mut lines = Lines::new(whole);
    let (mut announced, mut count, mut seen) = (false, None, 0);
    loop {
        let line = match lines.next() {
            Err(_) => return false,
            Ok(None) => return seen > 0,
            Ok(Some((_, line))) => line,
        };
        match line {
            Line::Names(names) if seen == 0 && Columns::named(&names).is_some() => {}
            Line::Names(_) | Line::Strange { .. } => return false,
            Line::Comment(_) => {}
            Line::Numbers(numbers) => {
                if numbers.len() == 1 && !announced && seen == 0 {
                    announced = true;
                } else if announced && seen > 0 && is_count(numbers) {
                    // The next scan of a PTS.
                } else if numbers.len() < 3 || *count.get_or_insert(numbers.len()) != numbers.len() {
                    return false;
                } else {
                    seen += 1;
                }
            }
        }
    }
}

/// Opens a file as one scan. Reads its first lines only.
pub(super) fn open(path: &Path, options: &Arc<ReadOptions>) -> Result<ScanSet> {
    let (head, _) = file::read_start(path, HEAD)?;
    let columns = layout(if head.len() < HEAD { &head } else { whole_lines(&head) })
        .map_err(|problem| problem.into_error(path))?;
    let notes = columns.iter().flat_map(|c| &c.notes).map(|note| format!("{}: {note}", file::name(path))).collect();
    Ok(ScanSet { scans: vec![FileScan::with(path, options)], notes })
}

/// Reads a scan. Of the length of the file, which the points take while their arrays grow. Measured.
const SHARE_OF_TEXT: f64 = 1.3;

pub(super) fn read(scan: &FileScan, progress: &Progress<'_>) -> Result<Content> {
    let (file, length) = file::counted(&scan.path, progress)?;
    let what = || format!("reading {}", known_as(&scan.path));
    memory::expect(SHARE_OF_TEXT * length as f64, what, "use fewer points, or raise the limit")?;
    let mut cloud = parse(file, length).map_err(|problem| problem.into_error(&scan.path))?;
    cloud.world_from_cloud = scan.world_from_sensor;
    Ok(Content::Points(cloud))
}

/// About `count` points of a scan, in its own frame, from a few places of the file.
pub(super) fn preview(scan: &FileScan, count: usize) -> Result<Vec<DVec3>> {
    use std::io::{Seek, SeekFrom};
    const CHUNK: u64 = 1 << 12;
    let (mut file, length) = file::open(&scan.path)?;
    let chunks = count.div_ceil(24).max(1) as u64;
    if length < 2 * CHUNK * chunks {
        let Content::Points(cloud) = read(scan, &Progress::none())? else { return Ok(Vec::new()) };
        let step = (cloud.positions.len() / count.max(1)).max(1);
        return Ok(cloud.positions.into_iter().step_by(step).take(count).collect());
    }
    let mut points = Vec::new();
    for chunk in 0..chunks {
        file.seek(SeekFrom::Start((length - CHUNK) / chunks * chunk)).map_err(|e| Error::io(&scan.path, e))?;
        let mut bytes = Vec::new();
        (&mut file).take(CHUNK).read_to_end(&mut bytes).map_err(|e| Error::io(&scan.path, e))?;
        // Only whole lines; at the start of the file the first is one.
        let first = if chunk == 0 { Some(0) } else { memchr::memchr2(b'\n', b'\r', &bytes).map(|at| at + 1) };
        let (Some(first), Some(end)) = (first, memchr::memrchr2(b'\n', b'\r', &bytes)) else { continue };
        let mut lines = Lines::new(&bytes[first.min(end)..end]);
        let mut here = Vec::new();
        while let Ok(Some((_, line))) = lines.next() {
            if let Line::Numbers(n) = line
                && let [x, y, z, ..] = *n
                && DVec3::new(x, y, z).is_finite()
            {
                here.push(DVec3::new(x, y, z));
            }
        }
        let step = here.len().div_ceil(24).max(1);
        points.extend(here.into_iter().step_by(step));
    }
    points.truncate(count);
    Ok(points)
}

/// The columns of a file that starts like this. `None` if it holds no point.
fn layout(head: &[u8]) -> Result<Option<Columns>, Problem> {
    let mut lines = Lines::new(head);
    let (mut names, mut announced): (Option<Vec<String>>, bool) = (None, false);
    let mut rows: Vec<[f64; MOST]> = Vec::new();
    let (mut width, mut first) = (0, 0);
    while rows.len() < LOOKED_AT {
        let Some((number, line)) = lines.next()? else { break };
        match line {
            Line::Comment(words) => {
                if rows.is_empty() && Columns::named(&words).is_some() {
                    names = Some(words);
                }
            }
            Line::Names(words) => {
                if Columns::named(&words).is_none() || !rows.is_empty() {
                    let found = words.join(" ");
                    return Err(Problem::text(number, format!("expected numbers, found `{}`", shorten(&found))));
                }
                names = Some(words);
            }
            Line::Strange { found } => {
                return Err(Problem::text(number, format!("expected a number, found `{found}`")));
            }
            Line::Numbers(numbers) if numbers.len() == 1 && rows.is_empty() => announced = true,
            Line::Numbers(numbers) if !rows.is_empty() && is_count(numbers) => {}
            Line::Numbers(numbers) => {
                if rows.is_empty() {
                    width = numbers.len();
                    first = number;
                    if width < 3 {
                        let problem = format!("a point needs three coordinates, this line has {width} numbers");
                        return Err(Problem::text(number, problem));
                    }
                }
                let mut row = [f64::NAN; MOST];
                for (to, from) in row.iter_mut().zip(numbers) {
                    *to = *from;
                }
                rows.push(row);
            }
        }
    }
    if rows.is_empty() {
        return Ok(None);
    }
    let mut columns = match names.and_then(|names| Columns::named(&names)) {
        Some(mut columns) if columns.width() == width => {
            columns.scale_colours(&rows);
            columns
        }
        // Names for half of the numbers.
        Some(columns) if 2 * columns.width() == width && lines.comma_separated => {
            return Err(Problem::text(first, lines::REMEDY));
        }
        _ => Columns::guessed(width, announced, &rows),
    };
    if lines.decimal_commas {
        columns.notes.push("commas within numbers are taken as decimal points".to_owned());
    }
    Ok(Some(columns))
}

/// Whether the numbers of a line are how many points follow.
fn is_count(numbers: &[f64]) -> bool {
    matches!(*numbers, [count] if count >= 0.0 && count.fract() == 0.0)
}

/// Reads all points of a file of `length` bytes.
fn parse(source: impl Read, length: u64) -> Result<PointCloud, Problem> {
    let mut reader = BufReader::with_capacity(HEAD, source);
    let mut head = Vec::new();
    (&mut reader).take(HEAD as u64).read_to_end(&mut head).map_err(|e| Problem { line: 1, kind: Kind::Io(e) })?;
    let is_all = (head.len() as u64) < length.min(HEAD as u64) || head.len() as u64 == length;
    let columns = layout(if is_all { &head } else { whole_lines(&head) })?;
    let mut lines = Lines::new(head.as_slice().chain(reader));
    let mut cloud = PointCloud::default();
    let Some(columns) = columns else {
        // Perhaps there are only long comments at the start; what follows must then be one as well.
        while let Some((number, line)) = lines.next()? {
            if !matches!(line, Line::Comment(_) | Line::Names(_)) {
                return Err(Problem::text(number, "no point in the first 64 KiB of the file"));
            }
        }
        return Err(Problem::text(1, "there is no point"));
    };
    // The line that announces points, how many, and how many of them are still to come.
    let mut announced: Option<(u64, f64, f64)> = None;
    let missing = |announced: Option<(u64, f64, f64)>| match announced {
        Some((line, count, left)) if left > 0.0 => {
            let problem = format!("{count} points are announced, but {} follow: the file was cut short", count - left);
            Err(Problem::text(line, problem))
        }
        _ => Ok(()),
    };
    let mut normals = columns.normal.map(|_| Vec::new());
    let mut colour = columns.colour.map(|_| Vec::new());
    let mut intensity = columns.intensity.map(|_| Vec::new());
    while let Some((number, line)) = lines.next()? {
        let numbers = match line {
            Line::Comment(_) => continue,
            Line::Names(_) if cloud.positions.is_empty() => continue,
            Line::Names(words) => {
                let found = shorten(&words.join(" "));
                return Err(Problem::text(number, format!("expected numbers, found `{found}`")));
            }
            Line::Strange { found } => {
                return Err(Problem::text(number, format!("expected a number, found `{found}`")));
            }
            Line::Numbers(numbers) => numbers,
        };
        if numbers.len() != columns.width() {
            // PTS files may hold several clouds, each after its count.
            if is_count(numbers) {
                missing(announced)?;
                announced = Some((number, numbers[0], numbers[0]));
                continue;
            }
            let (here, wanted) = (numbers.len(), columns.width());
            return Err(Problem::text(number, format!("{here} numbers, but the first point has {wanted}")));
        }
        if let Some((_, _, left)) = &mut announced {
            *left -= 1.0;
        }
        let [x, y, z] = columns.position.map(|c| numbers[c]);
        let position = DVec3::new(x, y, z);
        if !position.is_finite() {
            continue;
        }
        let count = cloud.positions.len();
        let memory = |_| Problem { line: number, kind: Kind::Memory(count) };
        if cloud.positions.len() == cloud.positions.capacity() {
            // Doubling, said aloud so that running out of memory is an error.
            let more = count.max(1024);
            cloud.positions.try_reserve(more).map_err(memory)?;
            normals.iter_mut().try_for_each(|list| list.try_reserve(more)).map_err(memory)?;
            colour.iter_mut().try_for_each(|list| list.try_reserve(more)).map_err(memory)?;
            intensity.iter_mut().try_for_each(|list| list.try_reserve(more)).map_err(memory)?;
        }
        cloud.positions.push(position);
        if let (Some(list), Some(at)) = (&mut normals, columns.normal) {
            let normal = DVec3::from(at.map(|c| numbers[c])).normalize_or_zero();
            list.push(normal.as_vec3().to_array());
        }
        if let (Some(list), Some(at)) = (&mut colour, columns.colour) {
            let [r, g, b] = at.map(|c| (numbers[c] * columns.colour_scale + 0.5).clamp(0.0, 255.0) as u8);
            list.push([r, g, b, 255]);
        }
        if let (Some(list), Some(at)) = (&mut intensity, columns.intensity) {
            list.push(numbers[at] as f32);
        }
    }
    missing(announced)?;
    cloud.normals = normals;
    cloud.colour = colour;
    cloud.intensity = intensity;
    Ok(cloud)
}

/// For tests and fuzzing: any bytes are read or refused with a line. Content that is read is valid and no larger than the file.
#[cfg(any(test, fuzzing))]
pub(super) fn examine(bytes: &[u8]) {
    match parse(bytes, bytes.len() as u64) {
        Ok(cloud) => {
            let count = cloud.positions.len();
            assert!(count <= bytes.len() && cloud.positions.iter().all(|p| p.is_finite()));
            assert!(cloud.normals.is_none_or(|list| list.len() == count));
            assert!(cloud.colour.is_none_or(|list| list.len() == count));
            assert!(cloud.intensity.is_none_or(|list| list.len() == count));
        }
        Err(problem) => assert!(problem.line > 0 || bytes.is_empty(), "{problem:?}"),
    }
}

#[cfg(test)]
mod tests;
