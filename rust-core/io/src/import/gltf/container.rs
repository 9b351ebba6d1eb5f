//! A glTF file's chunks, and which version it is of.

use std::collections::BTreeMap;

use serde_json::Value;
use serde_json::value::RawValue;

use crate::import::scan::FileScan;
use base::error::{Error, Result};

/// The JSON of a file and the buffer in it.
pub(super) fn chunks<'a>(bytes: &'a [u8], scan: &FileScan) -> Result<(&'a [u8], &'a [u8])> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes, &[]));
    }
    let fail = |at: usize, problem: &str| Err(Error::format(&scan.path, format!("byte {at}"), problem));
    let word = |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    match word(4) {
        Some(2) => {}
        Some(version) => return Err(other_version(&format!("{version}.0"), scan)),
        None => return fail(4, "the file ends"),
    }
    let (mut json, mut blob, mut at) = (None, &[][..], 12);
    while let (Some(length), Some(kind)) = (word(at), word(at + 4)) {
        let Some(chunk) = bytes.get(at + 8..).and_then(|rest| rest.get(..length as usize)) else {
            return fail(at, &format!("a chunk of {length} bytes goes beyond the end of the file"));
        };
        match &kind.to_le_bytes() {
            b"JSON" if json.is_none() => json = Some(chunk),
            b"BIN\0" if blob.is_empty() => blob = chunk,
            _ => {}
        }
        at += 8 + length as usize;
    }
    match json {
        Some(json) => Ok((json, blob)),
        None => fail(at, "there is no JSON chunk"),
    }
}

/// The members of the document, each as text.
pub(super) type Members = BTreeMap<String, Box<RawValue>>;

/// The document anew where a scene says nothing of nodes, which it may, but the crate needs.
pub(super) fn named_nodes(members: &mut Members) -> serde_json::Result<Option<String>> {
    let Some(scenes) = members.get("scenes") else { return Ok(None) };
    let mut scenes: Value = serde_json::from_str(scenes.get())?;
    let objects = scenes.as_array_mut().into_iter().flatten().filter_map(Value::as_object_mut);
    let mut without: Vec<_> = objects.filter(|scene| !scene.contains_key("nodes")).collect();
    if without.is_empty() {
        return Ok(None);
    }
    without.iter_mut().for_each(|scene| drop(scene.insert("nodes".to_owned(), Value::Array(Vec::new()))));
    members.insert("scenes".to_owned(), serde_json::value::to_raw_value(&scenes)?);
    serde_json::to_string(members).map(Some)
}

/// Refuses versions that are not read. What says none and has names instead of numbers is older than those that say it.
pub(super) fn check_version(members: &Members, scan: &FileScan) -> Result<()> {
    let asset = members.get("asset").and_then(|asset| serde_json::from_str::<Value>(asset.get()).ok());
    let version = asset.as_ref().and_then(|asset| asset.get("version")?.as_str());
    let major = version.and_then(|version| version.split('.').next()?.parse::<u32>().ok());
    let has_names = |key: &str| members.get(key).is_some_and(|value| value.get().starts_with('{'));
    match (version, major) {
        (Some(version), Some(major)) if major != 2 => Err(other_version(version, scan)),
        (None, _) if has_names("accessors") || has_names("meshes") => Err(other_version("1.0 or older", scan)),
        _ => Ok(()),
    }
}

fn other_version(version: &str, scan: &FileScan) -> Error {
    let problem = format!("this is glTF {version}, but glTF 2.0 is read: write it anew as glTF 2.0");
    Error::format(&scan.path, "asset", problem)
}
