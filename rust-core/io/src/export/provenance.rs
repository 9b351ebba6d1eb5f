//! What a result says of where it is from.

use std::sync::Arc;

use serde_json::{Map, Value};

use base::error::{Error, Result};
use mesh::Crs;

/// Namespace of what our E57 files have beside what the standard knows.
pub const E57_NAMESPACE: &str = "https://github.com/surfrecon/surfrecon/e57";

/// Letters of a line of a PLY file's header: some readers have room for 1024.
const LINE: usize = 900;

/// What makes a result again, as a JSON object: program, version, command, parameters, hashes of what was read.
///
/// PLY files have it as comments: `comment surfrecon` and an object of one key, of lists and objects one of their entries; what is
/// too long for a line goes on in those that begin `comment surfrecon +`. So has OBJ, in lines that begin `# surfrecon`. glTF has it in
/// `asset.extras.surfrecon`, E57 as the text `provenance` of the root, in a namespace of its own ([`E57_NAMESPACE`]), which readers that
/// don't know it pass over. Other formats have no place for it.
///
/// In PLY, OBJ and glTF the object also has the coordinate reference system: its text as `crs`, and `crs_unit` if that is `degree`. E57 has
/// a place of its own for it, `coordinateMetadata`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Provenance(Arc<Map<String, Value>>);

impl Provenance {
    /// Takes an object in JSON.
    ///
    /// # Errors
    /// [`Error::Input`] for anything else.
    pub fn from_json(text: &str) -> Result<Self> {
        let object = serde_json::from_str(text).map_err(|e| Error::input(format!("provenance must be JSON: {e}")))?;
        match object {
            Value::Object(object) => Ok(Provenance(Arc::new(object))),
            other => Err(Error::input(format!("provenance must be a JSON object, got {other}"))),
        }
    }

    /// The object as text.
    pub fn to_json(&self) -> String {
        Value::Object(Map::clone(&self.0)).to_string()
    }

    /// What a file says: this, and the system of its coordinates.
    pub(super) fn with_crs(given: Option<&Provenance>, crs: Option<&Crs>) -> Option<Provenance> {
        let Some(crs) = crs else { return given.cloned() };
        let mut object = given.map_or_else(Map::new, |given| Map::clone(&given.0));
        object.insert("crs".to_owned(), crs.text().into());
        object.remove("crs_unit");
        if crs.is_in_degrees() {
            object.insert("crs_unit".to_owned(), "degree".into());
        }
        Some(Provenance(Arc::new(object)))
    }

    /// Lines for the header of a text, each after the mark of a comment there.
    pub(super) fn comments(&self, comment: &str) -> String {
        let mut lines = String::new();
        let mut put = |key: &str, value: Value| {
            let text = ascii(&Value::Object(Map::from_iter([(key.to_owned(), value)])));
            let (mut rest, mut mark) = (text.as_str(), "");
            while !rest.is_empty() {
                let (part, after) = rest.split_at(rest.len().min(LINE));
                lines += &format!("{comment} surfrecon {mark}{part}\n");
                (rest, mark) = (after, "+ ");
            }
        };
        for (key, value) in self.0.iter() {
            match value {
                Value::Array(entries) => entries.iter().for_each(|entry| put(key, Value::Array(vec![entry.clone()]))),
                Value::Object(entries) => entries
                    .iter()
                    .for_each(|(name, entry)| put(key, Value::Object(Map::from_iter([(name.clone(), entry.clone())])))),
                other => put(key, other.clone()),
            }
        }
        lines
    }

    /// The element of E57, whose text may not end where it does not.
    pub(super) fn e57_element(&self) -> String {
        let text = ascii(&Value::Object(Map::clone(&self.0))).replace('>', "\\u003e");
        format!("<surfrecon:provenance type=\"String\"><![CDATA[{text}]]></surfrecon:provenance>\n")
    }

    /// For `extras` of glTF.
    pub(super) fn extras(&self) -> String {
        format!("{{\"surfrecon\":{}}}", ascii(&Value::Object(Map::clone(&self.0))))
    }
}

impl From<Map<String, Value>> for Provenance {
    fn from(object: Map<String, Value>) -> Self {
        Provenance(Arc::new(object))
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
mod tests {
    use super::*;

    /// The object that comments say.
    fn said(comments: &str) -> Value {
        let mut lines: Vec<String> = Vec::new();
        for line in comments.lines() {
            assert!(line.is_ascii() && line.len() < 1000, "{line}");
            let line = line.strip_prefix("comment surfrecon ").unwrap();
            match line.strip_prefix("+ ") {
                Some(more) => *lines.last_mut().unwrap() += more,
                None => lines.push(line.to_owned()),
            }
        }
        let mut whole = Map::new();
        for line in lines {
            let Value::Object(object) = serde_json::from_str(&line).unwrap() else { panic!("{line}") };
            for (key, value) in object {
                match (whole.get_mut(&key), value) {
                    (Some(Value::Array(all)), Value::Array(more)) => all.extend(more),
                    (Some(Value::Object(all)), Value::Object(more)) => all.extend(more),
                    (None, value) => drop(whole.insert(key, value)),
                    (Some(all), more) => panic!("{all} and {more}"),
                }
            }
        }
        Value::Object(whole)
    }

    #[test]
    fn comments_and_extras_say_all_of_it() {
        let long = "\u{1f5ff}ä\\\"\n".repeat(1000);
        let text = serde_json::json!({
            "command": "merge",
            "parameters": {"voxel": 0.1, "levels": [1, 2, 3], "one": {"two": null}},
            "inputs": [{"name": "é.ply"}, {"name": long}, []],
        });
        let provenance = Provenance::from_json(&text.to_string()).unwrap();
        assert_eq!(said(&provenance.comments("comment")), text);
        let extras = provenance.extras();
        assert!(extras.is_ascii() && !extras.contains('\n'));
        assert_eq!(serde_json::from_str::<Value>(&extras).unwrap()["surfrecon"], text);
        assert_eq!(Provenance::from_json("{}").unwrap().comments("comment"), "");
    }

    #[test]
    fn what_is_no_object_is_refused() {
        for (text, problem) in
            [("[]", "must be a JSON object, got []"), ("{", "must be JSON: "), ("", "must be JSON: ")]
        {
            let error = Provenance::from_json(text).unwrap_err().to_string();
            assert!(error.contains(problem), "{error}");
        }
    }
}
