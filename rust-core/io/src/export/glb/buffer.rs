//! The buffer of a binary glTF file, as its JSON describes it.

use std::fmt::Write as _;

/// Bytes that all offsets are multiples of.
const WORD: usize = 4;

/// A number of single precision.
pub const FLOAT: u32 = 5126;
pub const UNSIGNED_INT: u32 = 5125;
pub const UNSIGNED_SHORT: u32 = 5123;
pub const UNSIGNED_BYTE: u32 = 5121;

/// The parts of the buffer that have been given away.
#[derive(Default)]
pub struct Buffer {
    pub views: Vec<String>,
    pub accessors: Vec<String>,
    pub length: u64,
}

impl Buffer {
    /// Takes room for `count` elements and returns the accessor's index. Elements fill whole words, so all stays aligned.
    pub fn take(&mut self, count: usize, component: u32, kind: &str, bytes: u64, target: u32, more: &str) -> usize {
        let (view, size) = (self.views.len(), count as u64 * bytes);
        let offset = self.length;
        self.views.push(format!("{{\"buffer\":0,\"byteOffset\":{offset},\"byteLength\":{size},\"target\":{target}}}"));
        self.accessors.push(format!(
            "{{\"bufferView\":{view},\"componentType\":{component},\"count\":{count},\"type\":\"{kind}\"{more}}}"
        ));
        self.length += size;
        view
    }

    /// Takes room for a file and returns its view.
    pub fn file(&mut self, bytes: usize) -> usize {
        let (view, offset) = (self.views.len(), self.length);
        self.views.push(format!("{{\"buffer\":0,\"byteOffset\":{offset},\"byteLength\":{bytes}}}"));
        self.length += bytes.next_multiple_of(WORD) as u64;
        view
    }
}

/// Fills the last word of some bytes.
pub fn pad(mut bytes: Vec<u8>, with: u8) -> Vec<u8> {
    bytes.resize(bytes.len().next_multiple_of(WORD), with);
    bytes
}

/// A JSON string.
pub fn quoted(text: &str) -> String {
    let mut out = String::from('"');
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            c if c < ' ' => {
                let _ = write!(out, "\\u{:04x}", c as u32);
            }
            c => out.push(c),
        }
    }
    out.push('"');
    out
}
