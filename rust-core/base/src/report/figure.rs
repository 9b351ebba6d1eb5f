//! The rows of a report, one a figure, and the words that it is declared with.

use crate::params::Choice;

/// All that is declared of one report.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReportSchema {
    /// Name of its type in every language that has types.
    pub name: &'static str,
    /// The subject of its figures.
    pub text: &'static str,
    /// The rows, in the order in which people read them.
    pub figures: &'static [Figure],
}

/// The sort of value that a figure is. Hosts show it by this, with its unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FigureKind {
    /// Yes or no.
    Flag,
    /// A whole number, at least 0.
    Count,
    /// A whole number of any sign.
    Integer,
    /// A number of bytes.
    Bytes,
    /// A length in the unit of the scans.
    Length,
    /// An angle in radians.
    Angle,
    /// A share of a whole, 0 to 1.
    Ratio,
    /// Any other number.
    Number,
    /// Three numbers along x, y and z: a point, a direction or a shift, in the unit of the scans.
    Vector,
    /// Places a frame in another.
    Pose,
    /// A square matrix of so many rows.
    Matrix(usize),
    /// One of these, by its name.
    Choice(&'static [Choice]),
    /// Words that the data gave, such as the name of a scan.
    Text,
    /// A kind, by its name, and a sentence that says what was found and what to do.
    Warning(&'static [Choice]),
    /// The name of a stage and its wall-clock seconds.
    Stage,
    /// A report of its own.
    Nested(&'static ReportSchema),
}

/// How many values a figure has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FigureShape {
    /// One.
    One,
    /// One, or none where it does not apply.
    Optional,
    /// So many, always.
    Array(usize),
    /// So many, or none where they do not apply.
    OptionalArray(usize),
    /// Any number of values, or of arrays where the size of these is not 0.
    List(usize),
    /// Any number of values, at most so many.
    UpTo(usize),
    /// Any number of values, of which some may not apply.
    ListOfOptional,
    /// Any number of lists.
    Lists,
}

/// One figure of a report, as its row declares it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figure {
    /// Its name in every language.
    pub name: &'static str,
    /// Its name for people.
    pub label: &'static str,
    /// The sort of its values.
    pub kind: FigureKind,
    /// How many they are.
    pub shape: FigureShape,
    /// Names and texts of the values of an array, for languages that give each a name of its own. Empty: these have an array.
    pub parts: &'static [(&'static str, &'static str)],
    /// Name of the type of its choices in languages that have such types, in small letters. Empty: that of the figure.
    pub choices_name: &'static str,
    /// Whether C's struct says how many values a list has. Functions give each.
    pub is_counted: bool,
    /// The text for people in every language.
    pub text: &'static str,
    /// The version it came with.
    pub since: &'static str,
}

impl Figure {
    /// None where it does not apply.
    pub const fn optional(mut self) -> Self {
        self.shape = FigureShape::Optional;
        self
    }

    /// So many values, always.
    pub const fn array(mut self, size: usize) -> Self {
        self.shape = FigureShape::Array(size);
        self
    }

    /// An array whose values have names of their own in languages that have no tuples, each with its text.
    pub const fn parts(mut self, parts: &'static [(&'static str, &'static str)]) -> Self {
        self.shape = match self.shape {
            FigureShape::Optional => FigureShape::OptionalArray(parts.len()),
            _ => FigureShape::Array(parts.len()),
        };
        self.parts = parts;
        self
    }

    /// Any number of values.
    pub const fn list(mut self) -> Self {
        self.shape = FigureShape::List(0);
        self
    }

    /// Any number of arrays of that size.
    pub const fn list_of(mut self, size: usize) -> Self {
        self.shape = FigureShape::List(size);
        self
    }

    /// Any number of values, at most so many, so that C's structs hold them.
    pub const fn up_to(mut self, most: usize) -> Self {
        self.shape = FigureShape::UpTo(most);
        self
    }

    /// Any number of values, of which some may not apply.
    pub const fn list_of_optional(mut self) -> Self {
        self.shape = FigureShape::ListOfOptional;
        self
    }

    /// Any number of lists.
    pub const fn lists(mut self) -> Self {
        self.shape = FigureShape::Lists;
        self
    }

    /// A list whose length C's struct says, since functions give each value.
    pub const fn counted(mut self) -> Self {
        self.is_counted = true;
        self
    }

    /// The name of the type of its choices, which other figures may have as well.
    pub const fn choices_named(mut self, name: &'static str) -> Self {
        self.choices_name = name;
        self
    }

    /// The version it came with, if not the first. Structs of C have their fields in the order of versions.
    pub const fn since(mut self, version: &'static str) -> Self {
        self.since = version;
        self
    }

    /// The row as [`report!`](crate::report!) completes it. `text` comes from a comment, with the space after its slashes.
    pub const fn of(mut self, name: &'static str, text: &'static str) -> Self {
        self.name = name;
        self.text = text.trim_ascii();
        self
    }

    /// The choices that it may be one of. Empty for all other kinds.
    pub const fn choices(&self) -> &'static [Choice] {
        match self.kind {
            FigureKind::Choice(choices) | FigureKind::Warning(choices) => choices,
            _ => &[],
        }
    }

    /// Whether its value is a fixed number of numbers, as C's structs hold them.
    pub const fn is_fixed(&self) -> bool {
        !matches!(self.shape, FigureShape::List(_) | FigureShape::ListOfOptional | FigureShape::Lists)
            && !matches!(self.kind, FigureKind::Text | FigureKind::Warning(_) | FigureKind::Stage)
    }

    /// Whether it may be absent.
    pub const fn is_optional(&self) -> bool {
        matches!(self.shape, FigureShape::Optional | FigureShape::OptionalArray(_))
    }

    /// Name of the type of its choices, in small letters.
    pub const fn type_of_choices(&self) -> &'static str {
        if self.choices_name.is_empty() { self.name } else { self.choices_name }
    }
}
