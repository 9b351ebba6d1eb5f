//! Some points of a file without reading all of it: a few chunks spread over the vertices.
//!
//! In text nothing tells where the vertices end but counting all lines. Here their extent is estimated from the length
//! of the first lines; what doesn't look like a vertex is left out, among it every line of whole numbers only, which
//! may be a face. The cost does not grow with the file. Where that gives too little, the whole file is read.

use std::fs::File;

use glam::DVec3;

use super::body::vertex_row;
use super::columns::{EMPTY_ROW, POSITION, Plan};
use super::fault::Parsed;
use super::header::{Element, Encoding, Header, Kind};
use super::source::{Ascii, Binary, Source};
use super::{elements, header_in, located, read_header, vertex_plan};
use crate::error::{Error, Result};
use crate::import::window::Window;
use crate::import::{Scan, file};

/// Bytes read at a time.
const CHUNK: usize = 1 << 11;

/// Points taken from one chunk, unless there are fewer chunks than that needs.
const PER_CHUNK: usize = 24;

pub(super) fn points(scan: &Scan, count: usize) -> Result<Vec<DVec3>> {
    let path = &scan.path;
    let header = read_header(path)?;
    let (element, plan) = vertex_plan(&header).map_err(|problem| problem.into_error(path))?;
    if count == 0 || element.count == 0 {
        return Ok(Vec::new());
    }
    let sampled = match header.encoding {
        Encoding::Ascii => from_text(scan, &header, element, &plan, count)?,
        Encoding::LittleEndian => from_binary::<false>(scan, &header, element, &plan, count)?,
        Encoding::BigEndian => from_binary::<true>(scan, &header, element, &plan, count)?,
    };
    let enough = (count as u64).min(element.count) / 2;
    match sampled {
        Some(points) if points.len() as u64 >= enough.max(1) => Ok(points),
        _ => whole(scan, count),
    }
}

/// Whether every entry of an element has the same number of values.
fn is_plain(element: &Element) -> bool {
    element.properties.iter().all(|p| matches!(p.kind, Kind::Scalar(_)))
}

fn from_text(scan: &Scan, header: &Header, element: &Element, plan: &Plan, count: usize) -> Result<Option<Vec<DVec3>>> {
    let first = header.elements.iter().find(|e| e.count > 0);
    if !is_plain(element) || first.is_none_or(|first| first.name != element.name) {
        return Ok(None);
    }
    let (mut file, length) = file::open(&scan.path)?;
    let start = header.body as u64;
    // Lines may grow or shrink along the file: each look farther in mends the guess of where it ends.
    let (mut bytes, mut seen, mut end) = (0, 0, start);
    for quarter in 0..4 {
        let at = start + (end - start) * quarter / 4;
        let mut window = file::window_at(&mut file, &scan.path, at, CHUNK as u64)?;
        let lines = lines(window.rest(), at == start);
        for line in lines.into_iter().step_by(4).filter(|l| vertex_of_line(&mut window, *l, element, plan).is_some()) {
            bytes += line.1 + 1 - line.0;
            seen += 1;
        }
        if seen == 0 {
            return Ok(None);
        }
        end = ((start as f64 + bytes as f64 / f64::from(seen) * element.count as f64) as u64).min(length).max(start);
    }
    let chunks = count.div_ceil(PER_CHUNK).clamp(1, (end - start).div_ceil(CHUNK as u64).max(1) as usize);
    let per_chunk = count.div_ceil(chunks);
    let mut points = Vec::with_capacity(chunks * per_chunk);
    for c in 0..chunks as u64 {
        let at = start + (end - start).saturating_sub(CHUNK as u64) * c / (chunks as u64 - 1).max(1);
        let mut window = file::window_at(&mut file, &scan.path, at, CHUNK as u64)?;
        let lines = lines(window.rest(), c == 0);
        for i in strided(lines.len(), per_chunk) {
            points.extend(vertex_of_line(&mut window, lines[i], element, plan));
        }
    }
    Ok(Some(points))
}

/// Starts and ends of the whole lines of a chunk; its first bytes are one's start only if `from_start`.
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

fn from_binary<const BIG: bool>(
    scan: &Scan,
    header: &Header,
    element: &Element,
    plan: &Plan,
    count: usize,
) -> Result<Option<Vec<DVec3>>> {
    let mut start = header.body as u64;
    for before in header.elements.iter().take_while(|e| e.name != element.name) {
        let Some(end) =
            before.count.checked_mul(before.smallest_size(header.encoding)).and_then(|n| n.checked_add(start))
        else {
            return Ok(None);
        };
        if before.count > 0 && !is_plain(before) {
            return Ok(None);
        }
        start = end;
    }
    let stride = element.smallest_size(header.encoding);
    let (mut file, length): (File, u64) = file::open(&scan.path)?;
    if !is_plain(element) || length.saturating_sub(start) / stride < element.count {
        return Ok(None);
    }
    let chunks = count.div_ceil(PER_CHUNK) as u64;
    // At least one entry a chunk, and no overlap.
    let per_chunk = (CHUNK as u64 / stride).max(1).min(element.count.div_ceil(chunks));
    let mut points = Vec::with_capacity(count);
    for c in 0..chunks {
        let first = (u128::from(element.count - per_chunk) * u128::from(c) / u128::from((chunks - 1).max(1))) as u64;
        let mut window = file::window_at(&mut file, &scan.path, start + first * stride, per_chunk * stride)?;
        for i in strided(per_chunk as usize, count.div_ceil(chunks as usize)) {
            window.at = i * stride as usize;
            points.extend(vertex(&mut Binary::<BIG> { window: &mut window }, element, plan));
        }
    }
    Ok(Some(points))
}

/// Reads everything and takes some of it.
fn whole(scan: &Scan, count: usize) -> Result<Vec<DVec3>> {
    let path = &scan.path;
    let (mut file, length) = file::open(path)?;
    let mut window = Window::new(&mut file, length);
    let all = positions(&mut window).map_err(|problem| located(problem, path))?;
    if let Some(error) = window.failure() {
        return Err(Error::io(path, error));
    }
    let finite: Vec<DVec3> = all.into_iter().filter(|p| p.is_finite()).collect();
    Ok(strided(finite.len(), count).map(|i| finite[i]).collect())
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
