//! The header of a PLY file: encoding, elements and their properties.
//!
//! Files in the wild break lines with LF, CR LF or CR, and carry stray lines. A line of an unknown kind is kept as a note. It can't do
//! silent harm. In text, rows that don't fit the properties are refused. In binary, bodies whose length doesn't fit the counts are refused.

use std::io::Read;
use std::path::Path;

use super::problem::{Parsed, Problem};
use crate::import::window::Window;
use base::error::Result;

/// Encoding of the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// Type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ScalarType {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl ScalarType {
    fn from_name(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => ScalarType::I8,
            "uchar" | "uint8" => ScalarType::U8,
            "short" | "int16" => ScalarType::I16,
            "ushort" | "uint16" => ScalarType::U16,
            "int" | "int32" => ScalarType::I32,
            "uint" | "uint32" => ScalarType::U32,
            "float" | "float32" => ScalarType::F32,
            "double" | "float64" => ScalarType::F64,
            _ => return None,
        })
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            ScalarType::I8 => "char",
            ScalarType::U8 => "uchar",
            ScalarType::I16 => "short",
            ScalarType::U16 => "ushort",
            ScalarType::I32 => "int",
            ScalarType::U32 => "uint",
            ScalarType::F32 => "float",
            ScalarType::F64 => "double",
        }
    }

    /// Bytes in a binary file.
    pub(super) fn size(self) -> usize {
        match self {
            ScalarType::I8 | ScalarType::U8 => 1,
            ScalarType::I16 | ScalarType::U16 => 2,
            ScalarType::I32 | ScalarType::U32 | ScalarType::F32 => 4,
            ScalarType::F64 => 8,
        }
    }

    /// Smallest and largest value of a whole-number type.
    pub(super) fn whole_range(self) -> Option<(i64, i64)> {
        match self {
            ScalarType::I8 => Some((i8::MIN.into(), i8::MAX.into())),
            ScalarType::U8 => Some((0, u8::MAX.into())),
            ScalarType::I16 => Some((i16::MIN.into(), i16::MAX.into())),
            ScalarType::U16 => Some((0, u16::MAX.into())),
            ScalarType::I32 => Some((i32::MIN.into(), i32::MAX.into())),
            ScalarType::U32 => Some((0, u32::MAX.into())),
            ScalarType::F32 | ScalarType::F64 => None,
        }
    }
}

/// One number, or a list of them with its length before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Scalar(ScalarType),
    List { length: ScalarType, item: ScalarType },
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Property {
    pub(super) name: String,
    pub(super) kind: Kind,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Element {
    pub(super) name: String,
    /// As claimed. Nothing is allocated for it before the file's size has been compared.
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
}

impl Element {
    /// Fewest bytes one of these can take.
    pub(super) fn smallest_size(&self, encoding: Encoding) -> u64 {
        let size = |kind: Kind| match (encoding, kind) {
            // A digit and a separator each; an empty list is its length alone.
            (Encoding::Ascii, _) => 2,
            (_, Kind::Scalar(scalar)) => scalar.size(),
            (_, Kind::List { length, .. }) => length.size(),
        };
        self.properties.iter().map(|p| size(p.kind) as u64).sum()
    }
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    /// `obj_info num_cols` and `num_rows`.
    pub(super) grid_cols: Option<u64>,
    pub(super) grid_rows: Option<u64>,
    /// The start of the body.
    pub(super) body: usize,
    /// Oddities a person should know about.
    pub(super) notes: Vec<String>,
}

/// Whether a file that starts with these bytes is a PLY file.
pub(super) fn sniff(start: &[u8]) -> bool {
    start.starts_with(b"ply") && start.get(3).is_none_or(|&b| b <= b' ')
}

impl Header {
    pub(super) fn element(&self, name: &str) -> Option<&Element> {
        self.elements.iter().find(|e| e.name == name)
    }

    /// Parses the header at the start of `bytes`. `None` if `end_header` doesn't come within them.
    pub(super) fn parse(bytes: &[u8]) -> Parsed<Option<Header>> {
        if !sniff(bytes) {
            return Err(Problem::new("start of file", "a PLY file must start with a line `ply`"));
        }
        let mut encoding = None;
        let mut header = Header {
            encoding: Encoding::Ascii,
            elements: Vec::new(),
            grid_cols: None,
            grid_rows: None,
            body: 0,
            notes: Vec::new(),
        };
        let mut lines = Lines::new(bytes);
        while let Some((number, line)) = lines.next() {
            let at = || format!("line {number}");
            let text = String::from_utf8_lossy(line);
            let mut words = text.split_ascii_whitespace();
            let keyword = words.next().unwrap_or("");
            match keyword {
                "ply" if number == 1 => {}
                "format" if encoding.is_none() => encoding = Some(format(words.next(), words.next(), &at)?),
                "comment" | "" => {}
                "obj_info" => {
                    let slot = match words.next() {
                        Some("num_cols") => &mut header.grid_cols,
                        Some("num_rows") => &mut header.grid_rows,
                        _ => continue,
                    };
                    *slot = Some(count(words.next(), &at, "obj_info")?);
                }
                "element" => {
                    let Some(name) = words.next() else {
                        return Err(Problem::new(at(), "the element must have a name"));
                    };
                    if header.elements.len() == 1000 {
                        return Err(Problem::new(at(), "the file has more than 1000 kinds of elements"));
                    }
                    if header.element(name).is_some() {
                        return Err(Problem::new(at(), format!("element `{name}` is declared twice")));
                    }
                    let count = count(words.next(), &at, name)?;
                    header.elements.push(Element { name: name.to_owned(), count, properties: Vec::new() });
                }
                "property" => {
                    let Some(element) = header.elements.last_mut() else {
                        return Err(Problem::new(at(), "a property must follow an element"));
                    };
                    element.properties.push(property(&mut words, &at)?);
                }
                "end_header" => {
                    header.encoding =
                        encoding.ok_or_else(|| Problem::new(at(), "the header must have a `format` line"))?;
                    header.body = lines.at;
                    header.check()?;
                    return Ok(Some(header));
                }
                _ if header.notes.len() < 8 => {
                    let shown: String = text.trim().chars().take(40).collect();
                    header.notes.push(format!("header line {number}, `{shown}`, is of no known kind and was skipped"));
                }
                _ => {}
            }
        }
        Ok(None)
    }

    fn check(&self) -> Parsed<()> {
        for element in &self.elements {
            if element.properties.is_empty() && element.count > 0 {
                let problem =
                    format!("element `{}` claims {} entries, but has no properties", element.name, element.count);
                return Err(Problem::new("header", problem));
            }
        }
        Ok(())
    }
}

fn format(name: Option<&str>, version: Option<&str>, at: &dyn Fn() -> String) -> Parsed<Encoding> {
    let encoding = match name {
        Some("ascii") => Encoding::Ascii,
        Some("binary_little_endian") => Encoding::LittleEndian,
        Some("binary_big_endian") => Encoding::BigEndian,
        other => {
            let other = other.unwrap_or("");
            return Err(Problem::new(
                at(),
                format!("unknown format `{other}`: there are ascii, binary_little_endian and binary_big_endian"),
            ));
        }
    };
    match version {
        Some("1.0") => Ok(encoding),
        other => Err(Problem::new(at(), format!("unknown version `{}`: there is only 1.0", other.unwrap_or("")))),
    }
}

fn count(word: Option<&str>, at: &dyn Fn() -> String, what: &str) -> Parsed<u64> {
    let word = word.unwrap_or("");
    word.parse().map_err(|_| Problem::new(at(), format!("{what}: `{word}` is not a count (a whole number >= 0)")))
}

fn property<'a>(words: &mut impl Iterator<Item = &'a str>, at: &dyn Fn() -> String) -> Parsed<Property> {
    let scalar = |word: Option<&str>| {
        let word = word.unwrap_or("");
        ScalarType::from_name(word).ok_or_else(|| {
            let known = "char, uchar, short, ushort, int, uint, float, double, int8 to float64";
            Problem::new(at(), format!("unknown type `{word}`: there are {known}"))
        })
    };
    let kind = match words.next() {
        Some("list") => {
            let length = scalar(words.next())?;
            if length.whole_range().is_none() {
                let problem = format!("the length of a list can't be a `{}`", length.name());
                return Err(Problem::new(at(), problem));
            }
            Kind::List { length, item: scalar(words.next())? }
        }
        word => Kind::Scalar(scalar(word)?),
    };
    match words.next() {
        Some(name) => Ok(Property { name: name.to_owned(), kind }),
        None => Err(Problem::new(at(), "the property must have a name")),
    }
}

/// Lines of the header. How the first line ends tells how the others do: a binary body may start with a byte that looks
/// like half a line end.
struct Lines<'a> {
    bytes: &'a [u8],
    at: usize,
    number: usize,
    end: u8,
}

impl<'a> Lines<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        let first = bytes.iter().position(|&b| b == b'\n' || b == b'\r');
        let cr_only = first.is_some_and(|i| bytes[i] == b'\r' && bytes.get(i + 1) != Some(&b'\n'));
        Lines { bytes, at: 0, number: 0, end: if cr_only { b'\r' } else { b'\n' } }
    }

    /// The next whole line with its number, without its line end.
    fn next(&mut self) -> Option<(usize, &'a [u8])> {
        let rest = &self.bytes[self.at..];
        let length = memchr::memchr(self.end, rest)?;
        self.at += length + 1;
        self.number += 1;
        Some((self.number, &rest[..length]))
    }
}

/// Reads little more of the file than its header.
pub(super) fn read_header(file: &mut dyn Read, length: u64, path: &Path) -> Result<Header> {
    header_in(&mut Window::small(file, length)).map_err(|problem| problem.into_error(path))
}

/// The header at the start of a window, which afterwards stands at the body.
pub(super) fn header_in(window: &mut Window<'_>) -> Parsed<Header> {
    loop {
        match Header::parse(window.rest()) {
            Ok(Some(header)) => {
                window.at = header.body;
                return Ok(header);
            }
            Ok(None) => {}
            // Bytes that looked like a file of something else may be the little that could be read.
            Err(problem) => return Err(window.failure().map_or(problem, Problem::io)),
        }
        if !window.grow() {
            return Err(match window.failure() {
                Some(error) => Problem::io(error),
                None => Problem::new("header", "the file ends before `end_header`"),
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STANFORD: &str = "ply\nformat ascii 1.0\nobj_info is_mesh 0\nobj_info num_cols 512\nobj_info num_rows 400\n\
        element vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement range_grid 204800\n\
        property list uchar int vertex_indices\nend_header\n0 0 0\n";

    fn parse(text: &str) -> Header {
        Header::parse(text.as_bytes()).unwrap().unwrap()
    }

    fn refused(text: &str) -> String {
        Header::parse(text.as_bytes()).unwrap_err().to_string()
    }

    #[test]
    fn a_stanford_header() {
        let header = parse(STANFORD);
        assert_eq!((header.grid_cols, header.grid_rows), (Some(512), Some(400)));
        assert_eq!(&STANFORD[header.body..], "0 0 0\n");
        assert_eq!(header.elements.len(), 2);
        assert_eq!(header.elements[0].properties[2].name, "z");
        let list = header.elements[1].properties[0].kind;
        assert_eq!(list, Kind::List { length: ScalarType::U8, item: ScalarType::I32 });
        assert!(header.notes.is_empty());
    }

    #[test]
    fn every_line_end_gives_the_same_header() {
        let lf = parse(STANFORD);
        for end in ["\r\n", "\r"] {
            let text = STANFORD.replace('\n', end);
            let other = parse(&text);
            assert_eq!(&text[other.body..], format!("0 0 0{end}"));
            assert_eq!(Header { body: lf.body, ..other }, lf);
        }
        // The body of a binary file may start with 10.
        let text = "ply\rformat binary_little_endian 1.0\relement vertex 0\rend_header\r\n";
        assert_eq!(parse(text).body, text.len() - 1);
    }

    #[test]
    fn stray_lines_are_noted() {
        let header = parse(&STANFORD.replace("end_header", "bye\nend_header"));
        assert_eq!(header.notes, ["header line 12, `bye`, is of no known kind and was skipped"]);
    }

    #[test]
    fn all_type_names() {
        for name in ["char", "int8", "uchar", "uint8", "short", "int16", "ushort", "uint16"] {
            assert!(ScalarType::from_name(name).unwrap().size() <= 2);
        }
        for name in ["int", "int32", "uint", "uint32", "float", "float32", "double", "float64"] {
            assert!(ScalarType::from_name(name).unwrap().size() >= 4);
        }
    }

    #[test]
    fn what_is_wrong_is_named_with_its_line() {
        assert_eq!(refused("plyx\n"), "start of file: a PLY file must start with a line `ply`");
        let line = |text: &str| refused(&format!("ply\nformat ascii 1.0\n{text}\nend_header\n"));
        assert!(line("element vertex -3").starts_with("line 3: vertex: `-3` is not a count"));
        assert!(line("element vertex 99999999999999999999999").contains("is not a count"));
        assert!(line("element vertex").contains("`` is not a count"));
        assert!(line("element").contains("must have a name"));
        assert!(line("property float x").contains("must follow an element"));
        assert!(line("element v 1\nproperty half x").starts_with("line 4: unknown type `half`"));
        assert!(line("element v 1\nproperty float").contains("must have a name"));
        assert!(line("element v 1\nproperty list float int i").contains("can't be a `float`"));
        assert!(line("element v 1\nelement v 1").contains("twice"));
        assert!(line("element v 1").contains("has no properties"));
        assert!(line("obj_info num_cols many").contains("`many`"));
        assert!(refused("ply\nend_header\n").contains("must have a `format`"));
        assert!(refused("ply\nformat binary 1.0\n").contains("unknown format `binary`"));
        assert!(refused("ply\nformat ascii 2.0\n").contains("unknown version `2.0`"));
        assert_eq!(Header::parse(b"ply\nformat ascii 1.0\n").unwrap(), None);
    }
}
