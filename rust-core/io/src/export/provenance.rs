//! Provenance: what a result says of where it is from.

use std::sync::Arc;

use serde_json::{Map, Value};

use base::error::{Error, Result};
use mesh::Crs;

/// Namespace of what our E57 files have beside what the standard knows.
pub const E57_NAMESPACE: &str = "https://github.com/surfrecon/surfrecon/e57";

/// Deepest nesting: glTF has three levels around it, and readers of JSON end at 128.
const DEEPEST: usize = 100;

/// Letters of a line of a PLY file's header: some readers have room for 1024.
const LINE: usize = 900;

/// Most bytes that it takes in a file: it is looked for within twice as many.
pub const LONGEST: usize = 1 << 22;
/// Beginning of the coordinate reference system's object in comments, and its name beside that of provenance.
pub(crate) const CRS_COMMENT: &str = "crs ";
pub(crate) const CRS_EXTRA: &str = "surfrecon_crs";

/// All that makes a result again, as a JSON object: program, version, command, parameters, hashes of what was read.
///
/// PLY files have it as comments: `comment surfrecon` and an object of one key, of lists and objects one of their entries. If it is too
/// long for a line, it goes on in lines that begin `comment surfrecon +`. So has OBJ, in lines that begin `# surfrecon`. glTF has it in
/// `asset.extras.surfrecon`, E57 as the text `provenance` of the root, in a namespace of its own ([`E57_NAMESPACE`]), which readers that
/// don't know it pass over. Other formats have no place for it. Whatever its keys are, it is read back as it was given. Numbers are doubles
/// or whole numbers of 64 bits.
///
/// PLY, OBJ and glTF also say the coordinate reference system: an object of its `text` and, if that is so, the `unit` `degree`, in a
/// comment `surfrecon crs` and in `asset.extras.surfrecon_crs`. E57 has a place of its own for it, `coordinateMetadata`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Provenance(Arc<Map<String, Value>>);

impl Provenance {
    /// Takes an object in JSON.
    ///
    /// # Errors
    /// [`Error::Input`] for anything else, and for what is nested more than 100 times.
    pub fn from_json(text: &str) -> Result<Self> {
        let object = serde_json::from_str(text).map_err(|e| Error::input(format!("provenance must be JSON: {e}")))?;
        match object {
            object @ Value::Object(_) if depth(&object) > DEEPEST => {
                Err(Error::input(format!("provenance is nested more than {DEEPEST} times")))
            }
            Value::Object(object) => Ok(Provenance(Arc::new(object))),
            other => Err(Error::input(format!("provenance must be a JSON object, got {other}"))),
        }
    }

    /// The object as text.
    pub fn to_json(&self) -> String {
        Value::Object(Map::clone(&self.0)).to_string()
    }

    /// Lines for the header of a text, each after the mark of a comment there.
    fn comments(&self, comment: &str) -> String {
        let mut lines = String::new();
        let mut put = |object: Map<String, Value>| put_comment(&mut lines, comment, "", &Value::Object(object));
        let of = |key: &String, value: Value| Map::from_iter([(key.clone(), value)]);
        if self.0.is_empty() {
            put(Map::new());
        }
        for (key, value) in self.0.iter() {
            match value {
                Value::Array(entries) if !entries.is_empty() => {
                    entries.iter().for_each(|entry| put(of(key, Value::Array(vec![entry.clone()]))));
                }
                Value::Object(entries) if !entries.is_empty() => {
                    entries.iter().for_each(|(name, entry)| put(of(key, Value::Object(of(name, entry.clone())))));
                }
                other => put(of(key, other.clone())),
            }
        }
        lines
    }

    /// The element of E57, whose text may not end where it does not.
    ///
    /// # Errors
    /// [`Error::Input`] if it is longer than [`LONGEST`].
    pub(super) fn e57_element(&self) -> Result<String> {
        let text = ascii(&Value::Object(Map::clone(&self.0))).replace('>', "\\u003e");
        let text = format!("<surfrecon:provenance type=\"String\"><![CDATA[{text}]]></surfrecon:provenance>\n");
        short_enough(text)
    }
}

/// Comments that say what a file is made from and which system its coordinates are in, each after the mark of a comment there.
///
/// # Errors
/// [`Error::Input`] for provenance that takes more than [`LONGEST`].
pub(super) fn comments(comment: &str, provenance: Option<&Provenance>, crs: Option<&Crs>) -> Result<String> {
    let mut lines = short_enough(provenance.map_or_else(String::new, |provenance| provenance.comments(comment)))?;
    if let Some(crs) = crs {
        put_comment(&mut lines, comment, CRS_COMMENT, &object_of(crs));
    }
    Ok(lines)
}

/// The same as a member of glTF's `asset`, with the comma before it. Nothing for nothing.
///
/// # Errors
/// As [`comments`].
pub(super) fn extras(provenance: Option<&Provenance>, crs: Option<&Crs>) -> Result<String> {
    let mut members = Vec::new();
    if let Some(provenance) = provenance {
        members.push(format!("\"surfrecon\":{}", short_enough(ascii(&Value::Object(Map::clone(&provenance.0))))?));
    }
    members.extend(crs.map(|crs| format!("\"{CRS_EXTRA}\":{}", ascii(&object_of(crs)))));
    Ok(if members.is_empty() { String::new() } else { format!(",\"extras\":{{{}}}", members.join(",")) })
}

fn object_of(crs: &Crs) -> Value {
    let unit = crs.is_in_degrees().then(|| ("unit".to_owned(), "degree".into()));
    Value::Object([("text".to_owned(), crs.text().into())].into_iter().chain(unit).collect())
}

/// One value as a comment, of as many lines as it needs.
fn put_comment(lines: &mut String, comment: &str, mark: &str, value: &Value) {
    let text = ascii(value);
    let (mut rest, mut mark) = (text.as_str(), mark);
    while !rest.is_empty() {
        let (part, after) = rest.split_at(rest.len().min(LINE));
        *lines += &format!("{comment} surfrecon {mark}{part}\n");
        (rest, mark) = (after, "+ ");
    }
}

/// A longer one would not be found when the file is read.
fn short_enough(said: String) -> Result<String> {
    if said.len() <= LONGEST {
        return Ok(said);
    }
    let problem = format!("provenance would take {} bytes of the file, more than {LONGEST}", said.len());
    Err(Error::input(format!("{problem}: leave something of it out, or keep it in a file of its own")))
}

impl From<Map<String, Value>> for Provenance {
    fn from(object: Map<String, Value>) -> Self {
        Provenance(Arc::new(object))
    }
}

fn depth(value: &Value) -> usize {
    match value {
        Value::Array(entries) => 1 + entries.iter().map(depth).max().unwrap_or(0),
        Value::Object(entries) => 1 + entries.values().map(depth).max().unwrap_or(0),
        _ => 0,
    }
}

/// JSON without letters that a header has no place for.
fn ascii(value: &Value) -> String {
    let mut text = String::new();
    for letter in value.to_string().chars() {
        if letter.is_ascii() && !letter.is_control() {
            text.push(letter);
        } else {
            letter.encode_utf16(&mut [0; 2]).iter().for_each(|unit| text += &format!("\\u{unit:04x}"));
        }
    }
    text
}

#[cfg(test)]
mod tests;
