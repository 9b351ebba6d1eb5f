//! 3MF, the 3D Manufacturing Format (core specification 1.3): all triangles that the file builds as one mesh in metres, with colours.
//!
//! The archive names the part that is its model. Each item of the build places an object, an object is a mesh or puts others together, and
//! objects may lie in other parts of the archive (the production extension). A build without items means all objects that no other object
//! contains. Colours come from groups of colours and from base materials. A vertex takes its colour from the first triangle that names it.
//! Textures, other properties, thumbnails and slicers' settings are passed over.
//!
//! Cost: the unpacked part in memory, and the result.
//!
//! | file | what |
//! |---|---|
//! | `model` | one part: its unit, objects and build |
//! | `placing` | objects placed by the build as one mesh |

mod model;
mod placing;

use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use quick_xml::Reader;
use quick_xml::events::Event;

use super::archive::{self, Archive};
use super::file;
use super::options::ReadOptions;
use super::scan::{Content, FileScan};
use super::set::ScanSet;
use base::error::{Error, Result};
use base::progress::Progress;

/// The list of a package's parts that others refer to.
const RELATIONS: &str = "_rels/.rels";
/// The end of the type that the model has in that list.
const MODEL: &str = "/3dmodel";
/// Starts of the names of members that come first in packages.
const FIRST: [&[u8]; 5] = [b"[Content_Types].xml", b"_rels/", b"3D/", b"Metadata/", b"docProps/"];

/// Whether a file that starts like this is one: a zip archive whose first member is a part of a package.
pub(super) fn sniff(start: &[u8]) -> bool {
    archive::sniff(start) && start.get(30..).is_some_and(|name| FIRST.iter().any(|first| name.starts_with(first)))
}

/// Opens a file without looking into it.
pub(super) fn open(path: &Path, options: &Arc<ReadOptions>) -> Result<ScanSet> {
    file::single(path, options)
}

/// Reads the mesh.
pub(super) fn read(scan: &FileScan, progress: &Progress<'_>) -> Result<Content> {
    let archive = Archive::open(&scan.path, progress)?;
    let root = root(&archive, scan, progress)?;
    placing::placed(&archive, &root, scan, progress).map(Content::Mesh)
}

/// About `count` vertices, spread over it.
pub(super) fn preview(scan: &FileScan, count: usize) -> Result<Vec<DVec3>> {
    let Content::Mesh(mesh) = read(scan, &Progress::none())? else { return Ok(Vec::new()) };
    let step = (mesh.positions.len() / count.max(1)).max(1);
    Ok(mesh.positions.into_iter().step_by(step).collect())
}

/// The name of the part that is the model.
fn root(archive: &Archive, scan: &FileScan, progress: &Progress<'_>) -> Result<String> {
    let missing = |what: &str| {
        let hidden = archive.hidden().map_or_else(String::new, |hidden| format!(". {hidden}"));
        Err(Error::format(
            &scan.path,
            "list of files",
            format!("{what}: it is no 3MF file. Export the model again{hidden}"),
        ))
    };
    if archive.length(RELATIONS).is_none() {
        return missing("there is no _rels/.rels");
    }
    let bytes = archive.read(RELATIONS, scan.options.max_decoded_bytes(), progress)?;
    let part = Part { scan, name: RELATIONS, text: text(&bytes, scan, RELATIONS)? };
    let mut reader = Reader::from_str(part.text);
    loop {
        match reader.read_event().map_err(|e| part.fail(&reader, e.to_string()))? {
            Event::Start(tag) | Event::Empty(tag) if tag.local_name().into_inner() == "Relationship" => {
                let of = |name| part.attribute(&reader, &tag, name);
                if of("Type")?.is_some_and(|kind| kind.ends_with(MODEL))
                    && let Some(target) = of("Target")?
                {
                    return Ok(target.trim_start_matches('/').to_owned());
                }
            }
            Event::Eof => return missing("_rels/.rels names no 3D model"),
            _ => {}
        }
    }
}

/// The text of a part.
fn text<'a>(bytes: &'a [u8], scan: &FileScan, name: &str) -> Result<&'a str> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    std::str::from_utf8(bytes).map_err(|e| {
        let at = format!("{name}, byte {}", e.valid_up_to());
        Error::format(&scan.path, at, "it is not UTF-8, as XML of 3MF must be")
    })
}

/// A part of the package, while it is read.
#[derive(Clone, Copy)]
struct Part<'a> {
    scan: &'a FileScan,
    name: &'a str,
    text: &'a str,
}

impl Part<'_> {
    /// An error where the reader is.
    fn fail(&self, reader: &Reader<&[u8]>, problem: impl Into<String>) -> Error {
        let before = usize::try_from(reader.buffer_position()).unwrap_or(usize::MAX).min(self.text.len());
        let line = 1 + self.text.as_bytes()[..before].iter().filter(|&&byte| byte == b'\n').count();
        Error::format(&self.scan.path, format!("{}, line {line}", self.name), problem)
    }

    /// An attribute of a tag by its local name, unescaped.
    fn attribute(
        &self,
        reader: &Reader<&[u8]>,
        tag: &quick_xml::events::BytesStart<'_>,
        name: &str,
    ) -> Result<Option<String>> {
        for attribute in tag.attributes().with_checks(false) {
            let attribute = attribute.map_err(|e| self.fail(reader, e.to_string()))?;
            if attribute.key.local_name().into_inner() == name {
                let value = attribute.normalized_value(quick_xml::XmlVersion::Implicit1_0);
                return value.map(|value| Some(value.into_owned())).map_err(|e| self.fail(reader, e.to_string()));
            }
        }
        Ok(None)
    }
}

#[cfg(test)]
mod tests;
