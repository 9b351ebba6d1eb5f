//! glTF 2.0, binary and text: the triangles of all meshes of the scene as one mesh, placed by their nodes, with the colours of their
//! vertices, and their texture coordinates if all have some. A scene of points without triangles is a point cloud. If the scene names no
//! node, all are placed. Buffers lie in the file, in the text (base64) or in the file's folder. A name that leads out of it is refused
//! unless the options allow it. Triangle strips and fans are triangles. Lines, and points beside triangles, are passed over.
//!
//! The `gltf` crate knows the schema. Three things are ours. Chunks, as its reader of them panics on short lengths. Nodes' transforms,
//! which it rounds to 32 bits where surveyed coordinates have more digits. Elements, whose bounds it trusts.
//!
//! Cost: the file and its buffers in memory, and the result.
//!
//! | file | what |
//! |---|---|
//! | `container` | chunks and versions |
//! | `uri` | buffers that lie elsewhere |
//! | `elements` | numbers in buffers |
//! | `scene` | nodes and their meshes |

mod container;
mod elements;
mod scene;
mod uri;

use std::borrow::Cow;
use std::io::Read;

use gltf::json::{Root, deserialize};

use super::file::{Input, reserve, too_deep};
use super::scan::{Content, FileScan};
use base::error::{Error, Result, known_as};
use base::progress::Progress;

/// Whether a file that starts like this is one.
pub(super) fn sniff(start: &[u8]) -> bool {
    if start.starts_with(b"glTF") {
        return true;
    }
    let text = String::from_utf8_lossy(start);
    let has = |key: &str| text.contains(&format!("\"{key}\""));
    text.trim_start().starts_with('{') && (has("asset") || has("accessors") || has("bufferViews"))
}

pub(super) fn parse(input: &mut dyn Input, length: u64, scan: &FileScan, progress: &Progress<'_>) -> Result<Content> {
    let size = usize::try_from(length)
        .map_err(|_| Error::OutOfMemory(format!("{}: reading it takes {length} bytes", known_as(&scan.path))))?;
    let mut bytes = reserve(size, &scan.path)?;
    input.take(length).read_to_end(&mut bytes).map_err(|e| Error::io(&scan.path, e))?;
    let (json, mut blob) = container::chunks(&bytes, scan)?;
    let not_gltf = |error: serde_json::Error| {
        let problem = || format!("this is neither glTF's JSON nor a binary glTF: {error}");
        too_deep(&scan.path, &error).unwrap_or_else(|| Error::format(&scan.path, "start of file", problem()))
    };
    let mut members: container::Members = serde_json::from_slice(json).map_err(not_gltf)?;
    container::check_version(&members, scan)?;
    let root: Root = match container::named_nodes(&mut members).map_err(not_gltf)? {
        Some(json) => deserialize::from_slice(json.as_bytes()),
        None => deserialize::from_slice(json),
    }
    .map_err(not_gltf)?;
    let transforms = scene::transforms(&members).map_err(not_gltf)?;
    let fail = |at: String, problem: String| Err(Error::format(&scan.path, at, problem));
    if let Some(name) = root.extensions_required.first() {
        return fail("extensionsRequired".to_owned(), format!("it needs {name}, which is not read"));
    }
    let mut buffers = Vec::new();
    for (index, buffer) in root.buffers.iter().enumerate() {
        let data = match &buffer.uri {
            Some(uri) => Cow::Owned(uri::outside(uri, scan)?),
            None => Cow::Borrowed(std::mem::take(&mut blob)),
        };
        let wanted = buffer.byte_length.0;
        if (data.len() as u64) < wanted {
            return fail(format!("buffer {index}"), format!("it has only {} bytes of {wanted}", data.len()));
        }
        buffers.push(data);
    }
    let accessors = elements::Accessors { scan, root: &root, buffers };
    scene::Reader::new(accessors, transforms, progress)?.placed()
}

#[cfg(test)]
mod tests;
