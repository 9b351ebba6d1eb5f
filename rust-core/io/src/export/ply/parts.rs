//! A mesh in several files, none of which has more than some triangles: what is too large for whoever reads it.

use std::io::{BufWriter, Read as _, Seek as _, SeekFrom, Write as _};
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::layout::{Layout, Rows, cant_write};
use super::options::{PlyEncoding, PlyOptions};
use super::rows::CHUNK;
use crate::export::atomic::{Output, Staged, stage};
use base::error::{Error, Result};
use base::memory::expect;
use base::progress::Progress;
use mesh::sink::MeshOutline;

/// Bytes that a part takes for each of its triangles while it is made.
const BYTES_A_TRIANGLE: f64 = 12.0;

/// The name of one of `count` parts, counted from 1: the first has that of the whole, the third of twelve of `surface.ply` is
/// `surface-03-of-12.ply`.
pub fn part_path(path: &Path, number: u64, count: u64) -> PathBuf {
    if number == 1 {
        return path.to_owned();
    }
    let width = count.to_string().len();
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push(format!("-{number:0width$}-of-{count}"));
    if let Some(ending) = path.extension() {
        name.push(".");
        name.push(ending);
    }
    path.with_file_name(name)
}

impl PlyOptions {
    /// Whether a mesh of so many triangles goes into several files.
    pub(super) fn is_split(&self, triangles: u64) -> bool {
        self.part_triangles > 0 && triangles > self.part_triangles.into()
    }
}

/// A mesh that is written whole, and is to be split.
pub(super) struct Whole<'a, 'f> {
    pub file: &'a mut Output<'f>,
    pub path: &'a Path,
    pub options: &'a PlyOptions,
    pub outline: &'a MeshOutline,
    pub layout: &'a Layout,
}

impl Whole<'_, '_> {
    /// Writes its parts: runs of its triangles, each with the vertices that it names, all in the order of the whole. Rows are those
    /// of the whole but for the numbers of the vertices.
    pub fn split(&mut self, progress: &Progress<'_>) -> Result<Vec<Staged>> {
        let (triangles, most) = (self.layout.faces.count, u64::from(self.options.part_triangles));
        let count = triangles.div_ceil(most);
        (0..count)
            .map(|number| {
                let run = most * number..triangles.min(most * (number + 1));
                // Only so many files may be open at once.
                self.part(&part_path(self.path, number + 1, count), run, progress)?.closed()
            })
            .collect()
    }

    fn part(&mut self, path: &Path, triangles: Range<u64>, progress: &Progress<'_>) -> Result<Staged> {
        let count = triangles.end - triangles.start;
        let what = || format!("a part of {count} triangles");
        expect(BYTES_A_TRIANGLE * count as f64, what, "ask for smaller parts, or raise the limit")?;
        let encoding = self.options.encoding;
        let mut used = Vec::with_capacity(3 * count as usize);
        self.each_face(triangles.clone(), progress, |row| {
            used.extend((0..3).map(|corner| get(row, corner, encoding)));
            Ok(())
        })?;
        used.sort_unstable();
        used.dedup();
        let outline = MeshOutline { vertices: used.len() as u64, triangles: count, ..self.outline.clone() };
        let layout = Layout::of(&outline, self.options, self.layout.is_double)?;
        let failed = |error| cant_write(path, layout.faces.end(), error);
        stage(path, &Progress::none(), |out| {
            out.reserve(layout.faces.end()).map_err(failed)?;
            let mut out = BufWriter::with_capacity(CHUNK, out);
            out.write_all(layout.header.as_bytes()).map_err(failed)?;
            self.each_vertex(&used, progress, |row| out.write_all(row).map_err(failed))?;
            self.each_face(triangles, progress, |row| {
                for corner in 0..3 {
                    let vertex = get(row, corner, encoding);
                    put(row, corner, encoding, used.partition_point(|&used| used < vertex) as u32);
                }
                out.write_all(row).map_err(failed)
            })?;
            out.flush().map_err(failed)
        })
    }

    fn each_face(
        &mut self,
        triangles: Range<u64>,
        progress: &Progress<'_>,
        mut with: impl FnMut(&mut [u8]) -> Result<()>,
    ) -> Result<()> {
        let rows = self.layout.faces;
        let each = (CHUNK as u64 / rows.size).max(1);
        let mut bytes = Vec::new();
        let mut first = triangles.start;
        while first < triangles.end {
            progress.check()?;
            let end = triangles.end.min(first + each);
            self.read(rows, first..end, &mut bytes)?;
            bytes.chunks_exact_mut(rows.size as usize).try_for_each(&mut with)?;
            first = end;
        }
        Ok(())
    }

    /// The rows of vertices whose numbers rise.
    fn each_vertex(
        &mut self,
        numbers: &[u32],
        progress: &Progress<'_>,
        mut with: impl FnMut(&[u8]) -> Result<()>,
    ) -> Result<()> {
        let rows = self.layout.vertices;
        let (each, size) = ((CHUNK as u64 / rows.size).max(1), rows.size as usize);
        let (mut bytes, mut there) = (Vec::new(), 0..0);
        for &number in numbers {
            let number = u64::from(number);
            if !there.contains(&number) {
                progress.check()?;
                there = number..rows.count.min(number + each);
                self.read(rows, there.clone(), &mut bytes)?;
            }
            let begin = (number - there.start) as usize * size;
            with(&bytes[begin..begin + size])?;
        }
        Ok(())
    }

    fn read(&mut self, rows: Rows, which: Range<u64>, bytes: &mut Vec<u8>) -> Result<()> {
        bytes.resize(((which.end - which.start) * rows.size) as usize, 0);
        let failed = |error| Error::io(self.path, error);
        self.file.seek(SeekFrom::Start(rows.begin + rows.size * which.start)).map_err(failed)?;
        self.file.read_exact(bytes).map_err(failed)
    }
}

/// Place of the number of a corner in the row of a triangle: behind the number of corners, a byte.
fn place(corner: usize) -> Range<usize> {
    1 + 4 * corner..5 + 4 * corner
}

fn get(row: &[u8], corner: usize, encoding: PlyEncoding) -> u32 {
    let bytes = row[place(corner)].try_into().expect("four");
    if encoding == PlyEncoding::BinaryBigEndian { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) }
}

fn put(row: &mut [u8], corner: usize, encoding: PlyEncoding, vertex: u32) {
    let bytes = if encoding == PlyEncoding::BinaryBigEndian { vertex.to_be_bytes() } else { vertex.to_le_bytes() };
    row[place(corner)].copy_from_slice(&bytes);
}
