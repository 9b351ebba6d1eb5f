//! 3MF, the 3D Manufacturing Format (core specification 1.3): all triangles that the file builds as one mesh in metres, with colours.
//!
//! The archive names the part that is its model. Each item of the build places an object, an object is a mesh or puts others together, and
//! objects may lie in other parts of the archive (the production extension). A build without items means all objects that no other object
//! contains. Colours come from groups of colours and from base materials. A vertex takes its colour from the first triangle that names it.
//! Textures, other properties, thumbnails and slicers' settings are passed over.
//!
//! Cost: the objects and the result in memory. Text is not kept.
//!
//! | file | what |
//! |---|---|
//! | `part` | the XML of a part, tag by tag |
//! | `model` | one part: its unit, objects and build |
//! | `placing` | objects placed by the build as one mesh |

mod model;
mod part;
mod placing;

use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use quick_xml::events::Event;

use super::archive::{self, Archive};
use super::file;
use super::options::ReadOptions;
use super::scan::{Content, FileScan};
use super::set::ScanSet;
use base::error::{Error, Result};
use base::progress::Progress;
use part::Part;

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
    let most = scan.options.max_decoded_bytes();
    let root = archive.unpack(RELATIONS, most, progress, |from| model_of(&mut Part::new(scan, RELATIONS, from)))?;
    root.map_or_else(|| missing("_rels/.rels names no 3D model"), Ok)
}

/// The name of the model in the list of relations.
fn model_of(part: &mut Part<'_>) -> Result<Option<String>> {
    let mut buffer = Vec::new();
    loop {
        match part.next(&mut buffer)? {
            Event::Start(tag) | Event::Empty(tag) if tag.local_name().into_inner() == "Relationship" => {
                if part.attribute(&tag, "Type")?.is_some_and(|kind| kind.ends_with(MODEL))
                    && let Some(target) = part.attribute(&tag, "Target")?
                {
                    return Ok(Some(target.trim_start_matches('/').to_owned()));
                }
            }
            Event::Eof => return Ok(None),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests;
