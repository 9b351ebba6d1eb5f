//! The scan that a pose of a list is of, as a comment before the pose. Tools of TUM's pass over comments.
//!
//! ```text
//! # scan "0004" of "depth/0004.png"
//! 4 tx ty tz qx qy qz qw
//! ```
//!
//! Both are strings of JSON, so that any name fits into a line.

/// Beginning of the comment.
const MARK: &str = "# scan ";
/// Words between the name and the file.
const OF: &str = " of ";

/// The scan that a pose is of.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct ListedScan {
    /// Its name among the scans of its file.
    pub(crate) name: String,
    /// Its file, relative to the folder of the list or absolute. Empty if there is none.
    pub(crate) file: String,
}

impl ListedScan {
    /// The comment that names it.
    pub(crate) fn comment(&self) -> String {
        let quoted = |text: &str| serde_json::Value::from(text).to_string();
        let of = if self.file.is_empty() { String::new() } else { format!("{OF}{}", quoted(&self.file)) };
        format!("{MARK}{}{of}", quoted(&self.name))
    }

    /// The scan that a line names, if the line is such a comment.
    pub(super) fn of_comment(line: &[u8]) -> Option<ListedScan> {
        let rest = std::str::from_utf8(line).ok()?.strip_prefix(MARK)?;
        let mut strings = serde_json::Deserializer::from_str(rest).into_iter::<String>();
        let name = strings.next()?.ok()?;
        let rest = rest[strings.byte_offset()..].trim_end();
        let file = if rest.is_empty() { String::new() } else { serde_json::from_str(rest.strip_prefix(OF)?).ok()? };
        Some(ListedScan { name, file })
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
            assert_eq!(ListedScan::of_comment(comment.as_bytes()), Some(scan));
        }
        for other in
            ["# timestamp tx", "# scan 4", "# scan \"a\" b", "# scan \"a\" of", "# scan \"a\" of b", "1 2 3", "# \"a\""]
        {
            assert_eq!(ListedScan::of_comment(other.as_bytes()), None, "{other}");
        }
    }
}
