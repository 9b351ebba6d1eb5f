//! Some points of a file without reading all of it: a few chunks spread over the vertices.
//!
//! In text nothing tells where the vertices end but counting all lines. Here their extent is estimated from the length of the first lines.
//! Lines that don't look like a vertex are left out, among them every line of whole numbers only, which may be a face. The cost does not
//! grow with the file. If that gives too little, the whole file is read.

use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use glam::DVec3;

use super::binary::Binary;
use super::body::vertex_row;
use super::columns::{EMPTY_ROW, POSITION, Plan};
use super::elements::{elements, vertex_plan};
use super::header::{Element, Encoding, Header, Kind, header_in, read_header};
use super::problem::Parsed;
use super::source::{Ascii, Source};
use crate::import::window::Window;
use base::error::{Error, Result};

/// Bytes read at a time.
const CHUNK: u64 = 1 << 11;

/// Points taken from one chunk, unless there are fewer chunks than that needs.
const PER_CHUNK: usize = 24;

/// About `count` points of a file of `length` bytes. `path` is for messages.
pub(super) fn points<F: Read + Seek>(file: &mut F, length: u64, path: &Path, count: usize) -> Result<Vec<DVec3>> {
    let header = read_header(file, length, path)?;
    let (element, plan) = vertex_plan(&header).map_err(|problem| problem.into_error(path))?;
    let count = usize::try_from(element.count).map_or(count, |all| count.min(all));
    if count == 0 {
        return Ok(Vec::new());
    }
    let mut sampler = Sampler { file, length, path, header: &header, element, plan: &plan };
    let sampled = match header.encoding {
        Encoding::Ascii => sampler.sample_text(count)?,
        Encoding::LittleEndian => sampler.sample_binary::<false>(count)?,
        Encoding::BigEndian => sampler.sample_binary::<true>(count)?,
    };
    match sampled {
        Some(points) if points.len() >= (count / 2).max(1) => Ok(points),
        _ => sampler.sample_whole(count),
    }
}

/// A file whose vertices are sampled.
struct Sampler<'a, F> {
    file: &'a mut F,
    length: u64,
    path: &'a Path,
    header: &'a Header,
    element: &'a Element,
    plan: &'a Plan,
}

impl<F: Read + Seek> Sampler<'_, F> {
    /// A window on `length` bytes from `at`, or fewer if the file ends.
    fn window(&mut self, at: u64, length: u64) -> Result<Window<'_>> {
        self.file.seek(SeekFrom::Start(at)).map_err(|e| Error::io(self.path, e))?;
        let mut window = Window::new(&mut self.file, length);
        window.failure().map_or(Ok(window), |error| Err(Error::io(self.path, error)))
    }

    fn sample_text(&mut self, count: usize) -> Result<Option<Vec<DVec3>>> {
        let (element, plan) = (self.element, self.plan);
        let first = self.header.elements.iter().find(|e| e.count > 0);
        if !is_plain(element) || first.is_none_or(|first| first.name != element.name) {
            return Ok(None);
        }
        let start = self.header.body as u64;
        let length = self.length.max(start);
        // Lines may grow or shrink along the file: each look farther in mends the guess of where it ends.
        let (mut bytes, mut seen, mut end) = (0, 0, start);
        for quarter in 0..4 {
            let at = start + (end - start) / 4 * quarter;
            let mut window = self.window(at, CHUNK)?;
            for line in lines(window.rest(), at == start).into_iter().step_by(4) {
                if vertex_of_line(&mut window, line, element, plan).is_some() {
                    bytes += line.1 + 1 - line.0;
                    seen += 1;
                }
            }
            if seen == 0 {
                return Ok(None);
            }
            let extent = bytes as f64 / f64::from(seen) * element.count as f64;
            end = start.saturating_add(extent as u64).min(length);
        }
        let chunks = (count.div_ceil(PER_CHUNK) as u64).clamp(1, (end - start).div_ceil(CHUNK).max(1));
        let per_chunk = count.div_ceil(chunks as usize);
        let mut points = Vec::new();
        for c in 0..chunks {
            let at = start + spread((end - start).saturating_sub(CHUNK), c, chunks);
            let mut window = self.window(at, CHUNK)?;
            let lines = lines(window.rest(), c == 0);
            points.extend(
                strided(lines.len(), per_chunk).filter_map(|i| vertex_of_line(&mut window, lines[i], element, plan)),
            );
        }
        Ok(Some(points))
    }

    fn sample_binary<const BIG: bool>(&mut self, count: usize) -> Result<Option<Vec<DVec3>>> {
        let (element, plan) = (self.element, self.plan);
        let encoding = self.header.encoding;
        let mut start = self.header.body as u64;
        for before in self.header.elements.iter().take_while(|e| e.name != element.name) {
            let size = before.count.checked_mul(before.smallest_size(encoding));
            match size.and_then(|size| size.checked_add(start)) {
                Some(end) if before.count == 0 || is_plain(before) => start = end,
                _ => return Ok(None),
            }
        }
        let stride = element.smallest_size(encoding);
        if !is_plain(element) || self.length.saturating_sub(start) / stride < element.count {
            return Ok(None);
        }
        let chunks = count.div_ceil(PER_CHUNK) as u64;
        // At least one entry a chunk, and no overlap.
        let per_chunk = (CHUNK / stride).max(1).min(element.count.div_ceil(chunks));
        let mut points = Vec::new();
        for c in 0..chunks {
            let first = spread(element.count - per_chunk, c, chunks);
            let mut window = self.window(start + first * stride, per_chunk * stride)?;
            for i in strided(per_chunk as usize, count.div_ceil(chunks as usize)) {
                window.at = i * stride as usize;
                points.extend(vertex(&mut Binary::<BIG> { window: &mut window }, element, plan));
            }
        }
        Ok(Some(points))
    }

    /// Reads everything and takes some of it.
    fn sample_whole(&mut self, count: usize) -> Result<Vec<DVec3>> {
        let path = self.path;
        let mut window = self.window(0, self.length)?;
        let all = positions(&mut window);
        if let Some(error) = window.failure() {
            return Err(Error::io(path, error));
        }
        drop(window);
        let all = match all {
            Ok(all) => all,
            Err(problem) => {
                self.file.rewind().map_err(|e| Error::io(path, e))?;
                return Err(problem.locate(&mut self.file).into_error(path));
            }
        };
        let finite: Vec<DVec3> = all.into_iter().filter(|p| p.is_finite()).collect();
        Ok(strided(finite.len(), count).map(|i| finite[i]).collect())
    }
}

/// Whether every entry of an element has the same number of values.
fn is_plain(element: &Element) -> bool {
    element.properties.iter().all(|p| matches!(p.kind, Kind::Scalar(_)))
}

/// The `i`-th of `count` places spread over 0 to `last`.
fn spread(last: u64, i: u64, count: u64) -> u64 {
    (u128::from(last) * u128::from(i) / u128::from((count - 1).max(1))) as u64
}

/// Starts and ends of the whole lines of a chunk. Its first bytes are one's start only if `from_start`.
fn lines(chunk: &[u8], from_start: bool) -> Vec<(usize, usize)> {
    let mut ends = memchr::memchr2_iter(b'\n', b'\r', chunk);
    let mut start = if from_start { Some(0) } else { ends.next().map(|end| end + 1) };
    let mut lines = Vec::new();
    for end in ends {
        if let Some(start) = start.filter(|start| *start < end) {
            lines.push((start, end));
        }
        start = Some(end + 1);
    }
    lines
}

/// At most `wanted` of `count` places, evenly.
fn strided(count: usize, wanted: usize) -> impl Iterator<Item = usize> {
    let taken = wanted.min(count);
    (0..taken).map(move |i| i * count / taken)
}

fn vertex_of_line(
    window: &mut Window<'_>,
    (start, end): (usize, usize),
    element: &Element,
    plan: &Plan,
) -> Option<DVec3> {
    let whole_number = |b: &u8| b.is_ascii_digit() || matches!(b, b'-' | b'+' | b' ' | b'\t');
    if window.padded()[start..end].iter().all(whole_number) {
        return None;
    }
    window.at = start;
    vertex(&mut Ascii { window: &mut *window }, element, plan).filter(|_| window.at == end)
}

fn vertex<S: Source>(source: &mut S, element: &Element, plan: &Plan) -> Option<DVec3> {
    let mut row = EMPTY_ROW;
    vertex_row(source, element, plan, &mut row).ok()?;
    let point = DVec3::new(row[POSITION], row[POSITION + 1], row[POSITION + 2]);
    point.is_finite().then_some(point)
}

/// The positions of all vertices of a file.
fn positions(window: &mut Window<'_>) -> Parsed<Vec<DVec3>> {
    let header = header_in(window)?;
    let (element, plan) = vertex_plan(&header)?;
    let cols = header.grid_cols.unwrap_or(1).max(1);
    let parts = match header.encoding {
        Encoding::Ascii => elements(&mut Ascii { window }, &header, element, &plan, cols)?,
        Encoding::LittleEndian => elements(&mut Binary::<false> { window }, &header, element, &plan, cols)?,
        Encoding::BigEndian => elements(&mut Binary::<true> { window }, &header, element, &plan, cols)?,
    };
    Ok(parts.vertices.positions)
}
