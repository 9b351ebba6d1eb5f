//! Buffers that lie elsewhere than in a binary glTF: in the text, or in files beside it.

use std::path::Path;

use crate::import::scan::FileScan;
use crate::import::{conf, file};
use base::error::{Error, Result};

/// The bytes that a URI names.
pub(super) fn outside(uri: &str, scan: &FileScan) -> Result<Vec<u8>> {
    let shown: String = uri.chars().take(60).collect();
    let fail = |problem: &str| Err(Error::format(&scan.path, format!("buffer {shown}"), problem));
    if let Some(data) = uri.strip_prefix("data:") {
        let Some((_, text)) = data.split_once(";base64,") else { return fail("only base64 is known") };
        return match base64(text.as_bytes()) {
            Some(bytes) => Ok(bytes),
            None => fail("this is not base64"),
        };
    }
    let folder = scan.path.parent().unwrap_or(Path::new(""));
    let name = unescaped(uri);
    let path = match conf::named(folder, &name, &scan.options) {
        Ok(path) => path,
        Err(problem) => return fail(&problem),
    };
    if !file::is_file(&path) {
        return fail("there is no such file: buffers must be in the file itself or in files beside it");
    }
    file::read_bytes(&path)
}

/// A URI's name with its %XX.
fn unescaped(uri: &str) -> String {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&first, after)) = rest.split_first() {
        let hex = after.get(..2).and_then(|h| u8::from_str_radix(std::str::from_utf8(h).ok()?, 16).ok());
        match (first, hex) {
            (b'%', Some(byte)) => {
                bytes.push(byte);
                rest = &after[2..];
            }
            _ => {
                bytes.push(first);
                rest = after;
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

fn base64(text: &[u8]) -> Option<Vec<u8>> {
    let text = text.strip_suffix(b"==").or_else(|| text.strip_suffix(b"=")).unwrap_or(text);
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3 + 3);
    for quad in text.chunks(4) {
        let mut bits = 0_u32;
        for &c in quad {
            let digit = match c {
                b'A'..=b'Z' => c - b'A',
                b'a'..=b'z' => c - b'a' + 26,
                b'0'..=b'9' => c - b'0' + 52,
                b'+' | b'-' => 62,
                b'/' | b'_' => 63,
                _ => return None,
            };
            bits = (bits << 6) | u32::from(digit);
        }
        let whole = (bits << (6 * (4 - quad.len()))).to_be_bytes();
        bytes.extend(&whole[1..quad.len().max(1)]);
    }
    Some(bytes)
}
