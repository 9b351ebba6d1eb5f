//! The fault of a value, put into words with its element, its property and its line.

use super::fault::Fault;
use super::header::Element;
use super::number;
use super::problem::Problem;
use super::source::Source;

impl Fault {
    /// In words, at entry `index` of `element`, reading its property number `property`.
    #[cold]
    pub(super) fn at<S: Source>(
        self,
        element: &Element,
        index: u64,
        property: Option<usize>,
        source: &S,
    ) -> Box<Problem> {
        let entry = place(element, index);
        let entry = match property.and_then(|p| element.properties.get(p)) {
            Some(property) => format!("{entry}, property {}", property.name),
            None => entry,
        };
        let (byte, problem) = match self {
            Fault::End => return Problem::new(entry, "the file ends"),
            Fault::Range(value, scalar) => {
                let problem = format!("{value} is out of range (the type is {})", scalar.name());
                if S::TEXT { (source.window().at, problem) } else { return Problem::new(entry, problem) }
            }
            Fault::LineEnd(byte) => (byte, "the line ends too early: an element has one line".to_owned()),
            Fault::NoNumber(byte) => (byte, format!("expected a number, found `{}`", token(source, byte))),
            Fault::NoWhole(byte) => (byte, format!("expected a whole number, found `{}`", token(source, byte))),
            Fault::LineGoesOn(byte) => (
                byte,
                format!("expected the end of the line, found `{}`: an element has one line", token(source, byte)),
            ),
        };
        Problem::on_line_of(source.window().offset(byte), format!("{entry}: {problem}"))
    }
}

/// An entry of an element, as messages name it.
pub(super) fn place(element: &Element, index: u64) -> String {
    format!("{} {index} of {} (counted from 0)", element.name, element.count)
}

/// The text at a byte of the window, shortened.
fn token(source: &impl Source, at: usize) -> String {
    let text = source.window().padded();
    let end = number::token_end(text, at).min(source.window().end());
    let mut shown: String = String::from_utf8_lossy(&text[at..end.min(at + 160)]).chars().take(40).collect();
    if end - at > shown.len() {
        shown.push('…');
    }
    shown
}
