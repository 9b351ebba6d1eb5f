//! STL, binary and text: triangles without shared vertices. Corners at exactly the same place become one vertex, in the
//! order of their first appearance. The format has no unit. A binary file whose header says one, as `export` writes it, is read in metres.

use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use rustc_hash::FxHashMap;

use super::file::{self, Input};
use super::options::ReadOptions;
use super::scan::{Content, FileScan};
use super::set::ScanSet;
use super::text::Lines;
use super::window::Window;
use crate::unit;
use base::error::{Error, Result};
use base::memory;
use base::progress::Progress;
use mesh::TriMesh;

/// Bytes before the triangles of a binary file, and of each.
const HEADER: u64 = 84;
const TRIANGLE: u64 = 50;

/// Whether a file that starts like this is text. Binary files have no mark.
pub(super) fn sniff(start: &[u8]) -> bool {
    let Some(rest) = start.trim_ascii_start().strip_prefix(b"solid") else { return false };
    // Binary files may start with the word as well.
    rest.first().is_none_or(u8::is_ascii_whitespace) && rest.windows(5).any(|w| w == b"facet" || w == b"endso")
}

/// Whether a file that starts like this is exactly as long as the number of triangles in a binary file's header says.
pub(super) fn has_length_of_binary(start: &[u8], length: u64) -> bool {
    let Some(&[a, b, c, d]) = start.get(80..84) else { return false };
    let count = u64::from(u32::from_le_bytes([a, b, c, d]));
    count > 0 && HEADER + count * TRIANGLE == length
}

/// Opens a file. A note says if it is read in metres.
pub(super) fn open(path: &Path, options: &Arc<ReadOptions>) -> Result<ScanSet> {
    let (header, _) = file::read_start(path, unit::STL_TEXT)?;
    let note = |metres| format!("{}: its header says {}: it is read in metres", file::name(path), unit::words(metres));
    Ok(ScanSet { notes: unit::of_stl_header(&header).map(note).into_iter().collect(), ..file::single(path, options)? })
}

/// At the peak, where each vertex is in six triangles. Measured.
const BYTES_A_TRIANGLE: f64 = 82.0;
/// Bytes of a triangle in a text, about.
const TEXT: usize = 250;

/// The corners' places, each once.
#[derive(Default)]
struct Welder {
    vertices: FxHashMap<[u64; 3], u32>,
    mesh: TriMesh,
}

impl Welder {
    fn add(&mut self, corners: [DVec3; 3], path: &Path) -> Result<()> {
        let mut triangle = [0; 3];
        for (vertex, corner) in triangle.iter_mut().zip(corners) {
            // + 0: the two zeros are one place.
            let key = corner.to_array().map(|x| (x + 0.0).to_bits());
            let next = self.mesh.positions.len();
            *vertex = *self.vertices.entry(key).or_insert(next as u32);
            if *vertex as usize == next {
                if next >= u32::MAX as usize {
                    return Err(Error::format(path, "whole file", "more than 2^32 - 1 vertices"));
                }
                self.mesh.positions.push(corner + DVec3::ZERO);
            }
        }
        self.mesh.triangles.push(triangle);
        Ok(())
    }
}

pub(super) fn parse(input: &mut dyn Input, length: u64, scan: &FileScan, progress: &Progress<'_>) -> Result<Content> {
    let mut window = Window::new(input, length);
    let (binary, count, metres) = match window.ensure(HEADER as usize) {
        true => {
            let b = &window.rest()[80..84];
            let count = u64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
            let binary = HEADER + count * TRIANGLE == length || !sniff(window.rest());
            (binary, count, unit::of_stl_header(window.rest()).unwrap_or(1.0))
        }
        false => (false, 0, 1.0),
    };
    if let Some(error) = window.failure() {
        return Err(Error::io(&scan.path, error));
    }
    let mut welder = Welder::default();
    if binary {
        if HEADER + count * TRIANGLE > length {
            let problem = format!("{count} triangles of 50 bytes don't fit the {length} bytes of the file");
            return Err(Error::format(&scan.path, "header", problem));
        }
        window.at = HEADER as usize;
        memory::expect_each(count as usize, BYTES_A_TRIANGLE, 0.0, "reading", "triangles")?;
        for triangle in 0..count {
            if triangle % 4096 == 0 {
                progress.check()?;
            }
            let at = || format!("triangle {triangle} of {count}");
            if !window.ensure(TRIANGLE as usize) {
                let ends = Error::format(&scan.path, at(), "the file ends");
                return Err(window.failure().map_or(ends, |error| Error::io(&scan.path, error)));
            }
            let floats = window.rest()[12..48].as_chunks::<4>().0;
            let number = |i: usize| f64::from(f32::from_le_bytes(floats[i])) * metres;
            let corners = [0, 3, 6].map(|i| DVec3::new(number(i), number(i + 1), number(i + 2)));
            if !corners.iter().all(|corner| corner.is_finite()) {
                return Err(Error::format(&scan.path, at(), "a coordinate is not finite"));
            }
            welder.add(corners, &scan.path)?;
            window.at += TRIANGLE as usize;
        }
    } else {
        memory::expect_each(length as usize / TEXT, BYTES_A_TRIANGLE, 0.0, "reading", "triangles")?;
        text(Lines::over(window, &scan.path), &mut welder, scan)?;
    }
    Ok(Content::Mesh(welder.mesh))
}

fn text(mut lines: Lines<'_>, welder: &mut Welder, scan: &FileScan) -> Result<()> {
    let mut corners = [DVec3::ZERO; 3];
    // Corners of the facet so far; `None` outside of one.
    let mut count: Option<usize> = None;
    let mut solid = false;
    while lines.next_content()? {
        let word = lines.word().to_ascii_lowercase();
        match (word.as_slice(), count) {
            (b"solid", None) => solid = true,
            (b"facet", None) if solid => count = Some(0),
            (b"outer" | b"endloop", Some(_)) => {}
            (b"vertex", Some(known)) if known < 3 => {
                corners[known] = DVec3::new(lines.f64("x")?, lines.f64("y")?, lines.f64("z")?);
                if !corners[known].is_finite() {
                    return Err(lines.fail("a coordinate is not finite"));
                }
                count = Some(known + 1);
            }
            (b"endfacet", Some(3)) => {
                welder.add(corners, &scan.path)?;
                count = None;
            }
            (b"endsolid", None) if solid => solid = false,
            _ => {
                lines.rewind();
                return Err(
                    lines.expected("`facet`, `outer loop`, three times `vertex`, `endloop`, `endfacet` or `endsolid`")
                );
            }
        }
    }
    if solid || lines.number == 0 {
        return Err(lines.ends("`endsolid`"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::damage;
    use super::*;

    const TEXT: &str = "solid two\nfacet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n  vertex 1 1 0\n endloop\n\
        endfacet\nfacet normal 0 0 1\nouter loop\nvertex 0 -0 0\r\nvertex 1 1 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid two\n";

    fn binary() -> Vec<u8> {
        let mut bytes = b"solid but binary".to_vec();
        bytes.resize(80, 0);
        bytes.extend(2_u32.to_le_bytes());
        for corners in
            [[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0_f32], [-0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0]]
        {
            bytes.extend([0; 12]);
            corners.iter().for_each(|x| bytes.extend(x.to_le_bytes()));
            bytes.extend([0; 2]);
        }
        bytes
    }

    #[test]
    fn both_kinds_are_the_same_and_welded() {
        let scan = FileScan::new(Path::new("x.stl"));
        for bytes in [TEXT.as_bytes(), &binary()] {
            let Content::Mesh(mesh) = damage::read(parse, bytes, &scan).unwrap() else { panic!("no mesh") };
            assert_eq!((mesh.positions.len(), mesh.triangles.as_slice()), (4, &[[0, 1, 2], [0, 2, 3]][..]));
            damage::endure(parse, bytes, &scan);
        }
        assert!(sniff(TEXT.as_bytes()) && !sniff(&binary()) && !sniff(b"solidity\nfacet"));
        let mut many = binary();
        many[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
        let error = damage::read(parse, &many, &scan).unwrap_err().to_string();
        assert!(
            error.ends_with("header: 4294967295 triangles of 50 bytes don't fit the 184 bytes of the file"),
            "{error}"
        );
        let cut = TEXT.replace("endsolid two\n", "");
        let error = damage::read(parse, cut.as_bytes(), &scan).unwrap_err().to_string();
        assert!(error.contains("line 15: expected `endsolid`, but the file ends"), "{error}");
        let error =
            damage::read(parse, TEXT.replace("endloop", "vertex 1 2 3").as_bytes(), &scan).unwrap_err().to_string();
        assert!(error.contains("line 7: expected `facet`"), "{error}");
    }
}
