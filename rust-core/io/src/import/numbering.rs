//! Numbers of frames, and times, in names. This one rule decides them for the order of a recording, and for lists of poses that are read and
//! written.

/// The number in a name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Number<'n> {
    /// It as the name has it.
    pub(crate) text: &'n str,
    pub(crate) value: f64,
    /// Whether the name has nothing else.
    pub(crate) is_all: bool,
}

/// The last number in a name, of a frame or a time in seconds.
pub(crate) fn number_in(name: &str) -> Option<Number<'_>> {
    let end = name.rfind(|c: char| c.is_ascii_digit())? + 1;
    let begin = name[..end].rfind(|c: char| !c.is_ascii_digit() && c != '.').map_or(0, |other| {
        // It may take several bytes.
        other + name[other..].chars().next().map_or(1, char::len_utf8)
    });
    let text = name[begin..end].trim_start_matches('.');
    Some(Number { text, value: text.parse().ok().filter(|value: &f64| value.is_finite())?, is_all: text == name })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_number_counts() {
        for (name, text, value, is_all) in [
            ("0004", "0004", 4.0, true),
            ("1305031453.404816", "1305031453.404816", 1_305_031_453.404_816, true),
            ("frame_0004", "0004", 4.0, false),
            ("frame-3.depth", "3", 3.0, false),
            ("Tür7", "7", 7.0, false),
            ("ü7", "7", 7.0, false),
            ("-5", "5", 5.0, false),
            ("depth..5", "5", 5.0, false),
        ] {
            assert_eq!(number_in(name), Some(Number { text, value, is_all }), "{name}");
        }
        let long = "9".repeat(400);
        for name in ["", "depth", "v1.2.3", "nan", "inf", &long] {
            assert_eq!(number_in(name), None, "{name}");
        }
    }
}
