//! Provenance in files of our own, as [`crate::export::Provenance`] writes it.

use std::path::Path;

use ::e57::E57Reader;
use roxmltree::Document;
use serde_json::{Map, Value};

use super::super::file::watched;
use super::super::geo_keys::NamedCrs;
use super::super::{e57, file, ply};
use crate::export::{CRS_COMMENT, CRS_EXTRA, E57_NAMESPACE, LONGEST};
use base::error::Result;
use mesh::Crs;

/// Bytes of a file in which it is looked for, one after the other: the last has room for the longest there can be, and for all that a
/// header has besides.
const WITHIN: [usize; 3] = [1 << 12, 1 << 16, 2 * LONGEST];
/// Beginning of each line in PLY, and in OBJ. Each ends where the next line does not begin so.
const IN_PLY: &str = "comment surfrecon ";
const IN_OBJ: &str = "# surfrecon ";
/// Beginning of a binary glTF of ours behind its header, and of a text.
const IN_GLTF: &[u8] = b"{\"asset\":";

/// All that a file says of itself.
#[derive(Default)]
pub(super) struct Said {
    /// The program and parameters that made it.
    pub(super) provenance: Option<Map<String, Value>>,
    /// The object of its system, of formats that have no other place for it.
    crs: Option<Value>,
}

impl Said {
    /// The system that it names.
    pub(super) fn crs(&self) -> NamedCrs {
        let Some(text) = self.crs.as_ref().and_then(|crs| crs.get("text")?.as_str()) else { return Ok(None) };
        let crs = understood(text)?;
        let in_degrees = self.crs.as_ref().is_some_and(|crs| crs.get("unit").is_some_and(|unit| unit == "degree"));
        Ok(Some(if in_degrees { crs.with_degrees(true) } else { crs }))
    }
}

/// A system by a text that a file has in its place.
pub(super) fn understood(text: &str) -> Result<Crs, String> {
    Crs::new(text).map_err(|error| error.to_string())
}

/// The words of a file, which starts with these bytes.
pub(super) fn of_file(path: &Path, start: &[u8]) -> Result<Said> {
    if ply::sniff(start) {
        return lines(path, IN_PLY, |line| line == "end_header");
    }
    if start.starts_with(IN_OBJ.as_bytes()) {
        return lines(path, IN_OBJ, |line| !line.starts_with('#'));
    }
    if e57::sniff(start) {
        return in_e57(path);
    }
    let at = if start.starts_with(b"glTF") { 20 } else { 0 };
    let is_gltf = start.get(at..).is_some_and(|json| json.starts_with(IN_GLTF));
    if is_gltf { in_gltf(path, at + IN_GLTF.len()) } else { Ok(Said::default()) }
}

/// The words of lines which begin so, until a line is the last one.
fn lines(path: &Path, mark: &str, is_last: impl Fn(&str) -> bool) -> Result<Said> {
    for within in WITHIN {
        let (start, length) = file::read_start(path, within)?;
        let whole = start.len() as u64 == length;
        let (mut texts, mut ended) = (Vec::<String>::new(), whole);
        let is_end = |byte: &u8| [b'\n', b'\r'].contains(byte);
        for line in start.split_inclusive(is_end).filter(|line| whole || line.last().is_some_and(is_end)) {
            let line = String::from_utf8_lossy(line);
            let line = line.trim_end_matches(['\n', '\r']);
            // Between the two ends that a line of Windows has.
            if line.is_empty() {
                continue;
            }
            if is_last(line) {
                ended = true;
                break;
            }
            let Some(text) = line.strip_prefix(mark) else { continue };
            match (text.strip_prefix("+ "), texts.last_mut()) {
                (Some(more), Some(last)) => last.push_str(more),
                _ => texts.push(text.to_owned()),
            }
        }
        if ended {
            let (crs, rest): (Vec<_>, Vec<_>) = texts.iter().partition(|text| text.starts_with(CRS_COMMENT));
            let crs = crs.last().and_then(|text| serde_json::from_str(&text[CRS_COMMENT.len()..]).ok());
            return Ok(Said { provenance: joined(&rest), crs });
        }
    }
    Ok(Said::default())
}

/// The object whose entries lines have one by one.
fn joined(lines: &[&String]) -> Option<Map<String, Value>> {
    let mut whole = None;
    for line in lines {
        // Text that others have put there, or a line that was cut.
        let Ok(Value::Object(object)) = serde_json::from_str(line) else { continue };
        let whole = whole.get_or_insert_with(Map::new);
        for (key, value) in object {
            match (whole.get_mut(&key), value) {
                (Some(Value::Array(all)), Value::Array(more)) => all.extend(more),
                (Some(Value::Object(all)), Value::Object(more)) => all.extend(more),
                (_, value) => drop(whole.insert(key, value)),
            }
        }
    }
    whole
}

/// The content of glTF's `asset.extras`. `asset` is the first of all.
fn in_gltf(path: &Path, at: usize) -> Result<Said> {
    for within in WITHIN {
        let (start, length) = file::read_start(path, within)?;
        let json = start.get(at..).unwrap_or_default();
        match serde_json::Deserializer::from_slice(json).into_iter::<Value>().next() {
            Some(Ok(asset)) => {
                let of = |name| asset.get("extras").and_then(|extras| extras.get(name)).cloned();
                let provenance = of("surfrecon").and_then(|said| Some(said.as_object()?.clone()));
                return Ok(Said { provenance, crs: of(CRS_EXTRA) });
            }
            Some(Err(error)) if error.is_eof() && (start.len() as u64) < length => {}
            _ => break,
        }
    }
    Ok(Said::default())
}

fn in_e57(path: &Path) -> Result<Said> {
    watched(&mut file::open(path)?.0, path, |input| {
        let Ok(reader) = E57Reader::new(input) else { return Ok(Said::default()) };
        let Ok(document) = Document::parse(reader.xml()) else { return Ok(Said::default()) };
        let mut nodes = document.root_element().children();
        let node = nodes.find(|node| node.has_tag_name((E57_NAMESPACE, "provenance")));
        let text: String = node.iter().flat_map(|node| node.children()).filter_map(|child| child.text()).collect();
        let provenance = serde_json::from_str::<Value>(&text).ok().and_then(|said| said.as_object().cloned());
        Ok(Said { provenance, crs: None })
    })
}
