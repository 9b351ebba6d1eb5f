//! The scan that a pose of a list is of, as a comment before the pose. Tools of TUM's pass over comments.
//!
//! ```text
//! # scan "0004" of "depth/0004.png"
//! 4 tx ty tz qx qy qz qw
//! ```
//!
//! Both are strings of JSON, so that any name fits into a line.

use std::borrow::Cow;

use rustc_hash::{FxHashMap, FxHashSet};

/// First word of the comment.
const WORD: &str = "scan";
/// Words between the name and the file.
const OF: &str = " of ";
/// Marks that editors and people put around a text.
const QUOTES: [char; 10] =
    ['"', '\'', '`', '\u{b4}', '\u{2018}', '\u{2019}', '\u{201c}', '\u{201d}', '\u{201e}', '\u{ab}'];

/// The scan that a pose is of.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct ListedScan {
    /// Its name among the scans of its file.
    pub(crate) name: String,
    /// Its file, relative to the folder of the list or absolute. Empty if there is none.
    pub(crate) file: String,
}

/// A comment in a list of poses.
#[derive(Debug, PartialEq)]
pub(super) enum Comment {
    /// Names a scan.
    Scan(ListedScan),
    /// Begins as one that names a scan, but does not go on so. Without quotes it may be about something else.
    Damaged {
        is_quoted: bool,
    },
    Other,
}

impl ListedScan {
    /// The comment that names it.
    pub(crate) fn comment(&self) -> String {
        let quoted = |text: &str| serde_json::Value::from(text).to_string();
        let of = if self.file.is_empty() { String::new() } else { format!("{OF}{}", quoted(&self.file)) };
        format!("# {WORD} {}{of}", quoted(&self.name))
    }

    /// Reads a line that begins with `#`.
    pub(super) fn of_comment(line: &[u8]) -> Comment {
        let line = String::from_utf8_lossy(line);
        let text = line.trim_start_matches('#').trim_start();
        let Some((_, rest)) = text.split_at_checked(WORD.len()).filter(|(word, _)| word.eq_ignore_ascii_case(WORD))
        else {
            return Comment::Other;
        };
        let is_quoted = rest.trim_start().starts_with(QUOTES);
        if !is_quoted && !rest.starts_with([' ', '\t']) {
            return Comment::Other;
        }
        Self::of_strings(rest).map_or(Comment::Damaged { is_quoted }, Comment::Scan)
    }

    fn of_strings(rest: &str) -> Option<ListedScan> {
        let mut strings = serde_json::Deserializer::from_str(rest).into_iter::<String>();
        let name = strings.next()?.ok()?;
        let rest = rest[strings.byte_offset()..].trim_end();
        let file = if rest.is_empty() { String::new() } else { serde_json::from_str(rest.strip_prefix(OF)?).ok()? };
        Some(ListedScan { name, file })
    }

    /// Its file, the same however its path is written.
    pub(crate) fn plain_file(&self) -> Cow<'_, str> {
        let is_plain = |part: &str| !matches!(part, "" | "." | "..");
        let parts = || self.file.split('/');
        if parts().skip(usize::from(self.file.starts_with('/'))).all(is_plain) {
            return Cow::Borrowed(&self.file);
        }
        let mut plain: Vec<&str> = Vec::new();
        for (place, part) in parts().enumerate() {
            match part {
                "" if place > 0 => {}
                "." => {}
                ".." if plain.last().is_some_and(|last| is_plain(last)) => {
                    plain.pop();
                }
                other => plain.push(other),
            }
        }
        Cow::Owned(plain.join("/"))
    }

    /// The first of them that has the same scan as one before. One without a file is the same as any other of its name.
    pub(crate) fn twice<'s>(scans: impl Iterator<Item = &'s ListedScan> + Clone) -> Option<usize> {
        let mut files: FxHashMap<&str, FxHashSet<Cow<'_, str>>> = FxHashMap::default();
        for (place, scan) in scans.enumerate() {
            let known = files.entry(&scan.name).or_default();
            let file = scan.plain_file();
            if known.contains("") || (file.is_empty() && !known.is_empty()) || !known.insert(file) {
                return Some(place);
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_comment_says_what_was_written() {
        for (name, file) in [("0004", "depth/0004.png"), ("a \"b\"\n of \"c\"", "ä/\\ of .png"), ("x", ""), ("", "y")]
        {
            let scan = ListedScan { name: name.to_owned(), file: file.to_owned() };
            let comment = scan.comment();
            assert!(!comment.contains('\n'), "{comment}");
            let by_hand = comment.replacen("# scan ", "#Scan", 1);
            assert_eq!(ListedScan::of_comment(by_hand.as_bytes()), Comment::Scan(scan.clone()));
            assert_eq!(ListedScan::of_comment(comment.as_bytes()), Comment::Scan(scan));
        }
        for other in ["# timestamp tx", "#", "# scans \"a\"", "# scanner", "# scän", "# \"a\""] {
            assert_eq!(ListedScan::of_comment(other.as_bytes()), Comment::Other, "{other}");
        }
        let quoted = [
            "# scan \"a\" b",
            "# scan \"a\" of",
            "# scan \"a\" of b",
            "# scan 'a'",
            "# scan “a”",
            "#scan„a“",
            "# scan \"a",
        ];
        for damaged in quoted {
            assert_eq!(ListedScan::of_comment(damaged.as_bytes()), Comment::Damaged { is_quoted: true }, "{damaged}");
        }
        assert_eq!(ListedScan::of_comment(b"# scan 4"), Comment::Damaged { is_quoted: false });
    }

    #[test]
    fn a_scan_is_listed_once_however_its_file_is_written() {
        let scan = |name: &str, file: &str| ListedScan { name: name.to_owned(), file: file.to_owned() };
        for (one, other) in
            [("A/f", "./A/f"), ("A/f", "A//f"), ("A/f", "A/x/../f"), ("A/f", ""), ("", "A/f"), ("/f", "//./f")]
        {
            let scans = [scan("x", "B/f"), scan("y", one), scan("y", other)];
            assert_eq!(ListedScan::twice(scans.iter()), Some(2), "{one} {other}");
        }
        for (one, other) in [("A/f", "B/f"), ("A/f", "../A/f"), ("A/f", "/A/f"), ("../f", "../../f")] {
            assert_eq!(ListedScan::twice([scan("y", one), scan("y", other)].iter()), None, "{one} {other}");
        }
        assert_eq!(ListedScan::twice([scan("x", "f"), scan("y", "f"), scan("z", "")].iter()), None);
    }
}
