//! The coordinate reference system of surveys: named as files name it, kept from file to result, never transformed.

use std::fmt;
use std::sync::Arc;

use base::error::{Error, Result};

/// Longest text of a system, in bytes: what a record of LAS holds.
pub const LONGEST: usize = 1 << 16;

/// Letters of a system's name that messages show.
const SHOWN: usize = 80;
/// The remedy for a text that can't be taken.
const REMEDY: &str = "give well-known text, or a code as EPSG:25832";

/// Words that begin a system in well-known text, of whichever version.
const KEYWORDS: [&str; 26] = [
    "PROJCS",
    "PROJCRS",
    "PROJECTEDCRS",
    "GEOGCS",
    "GEOGCRS",
    "GEOGRAPHICCRS",
    "GEOCCS",
    "GEODCRS",
    "GEODETICCRS",
    "COMPD_CS",
    "COMPOUNDCRS",
    "VERT_CS",
    "VERTCRS",
    "VERTICALCRS",
    "LOCAL_CS",
    "ENGCRS",
    "ENGINEERINGCRS",
    "BOUNDCRS",
    "DERIVEDPROJCRS",
    "FITTED_CS",
    "COORDINATEMETADATA",
    "PARAMETRICCRS",
    "PARAMETRICDATUM",
    "TIMECRS",
    "IMAGECRS",
    "VERTCS",
];
/// Of these, those whose first two coordinates are lengths.
const PLANE: [&str; 8] =
    ["PROJCS", "PROJCRS", "PROJECTEDCRS", "DERIVEDPROJCRS", "GEOCCS", "LOCAL_CS", "ENGCRS", "ENGINEERINGCRS"];
/// And those whose first two are angles, unless they say that they are Cartesian.
const ANGLES: [&str; 5] = ["GEOGCS", "GEOGCRS", "GEOGRAPHICCRS", "GEODCRS", "GEODETICCRS"];

/// A coordinate reference system, as a file or a user names it: well-known text (WKT 1 or 2), a code as `EPSG:25832`, or
/// `EPSG:25832+7837` with the one of the heights. Nothing is looked up and nothing transformed: the text goes along with coordinates.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Crs {
    text: Arc<str>,
    degrees: bool,
}

impl Crs {
    /// A system by its text, whose lines become one.
    ///
    /// # Errors
    /// [`Error::Input`] for a text that is empty, longer than [`LONGEST`] or has control characters. Also for well-known text whose
    /// brackets or quotes are not closed, and for an authority without a code.
    pub fn new(text: &str) -> Result<Self> {
        let text = in_one_line(text.trim_end_matches('\0'));
        let fault = if text.is_empty() {
            "it is empty".to_owned()
        } else if text.len() > LONGEST {
            format!("it has {} bytes, more than {LONGEST}", text.len())
        } else if text.contains("]]>") || text.chars().any(|letter| letter.is_control() || letter == '\u{fffd}') {
            "it has characters that are none of text".to_owned()
        } else if keyword(&text).is_some() && !is_closed(&text) {
            "its brackets or quotes are not closed".to_owned()
        } else if text.ends_with(':') {
            format!("{} has no code", shown(&text))
        } else {
            let degrees = is_in_degrees(&text);
            return Ok(Crs { text: text.into(), degrees });
        };
        Err(Error::input(format!("not the text of a coordinate reference system: {fault}: {REMEDY}")))
    }

    /// A system as somebody names it who can choose: by what others can look up. Files also have names of grids that nothing else knows,
    /// which [`Crs::new`] takes.
    ///
    /// # Errors
    /// As [`Crs::new`]. [`Error::Input`] for a text that is no well-known text, no code, URN or address of one, no text of PROJ nor its
    /// JSON.
    pub fn told(text: &str) -> Result<Self> {
        let crs = Crs::new(text)?;
        let is_of_proj = crs.text.starts_with('{') || crs.text.starts_with('+') && crs.text.contains('=');
        let is_address = crs.text.starts_with("http://") || crs.text.starts_with("https://");
        if keyword(&crs.text).is_some() || is_of_proj || is_address || is_code(&crs.text) {
            return Ok(crs);
        }
        let name = shown(&crs.text);
        Err(Error::input(format!("\"{name}\" names no coordinate reference system: {REMEDY}")))
    }

    /// Whether its first two coordinates are degrees of longitude and latitude: well-known text says so itself, a code does not.
    #[must_use]
    pub fn with_degrees(mut self, degrees: bool) -> Self {
        self.degrees = degrees;
        self
    }

    /// The text in one line.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Whether its first two coordinates are known to be angles, which nothing can be measured in.
    pub fn is_in_degrees(&self) -> bool {
        self.degrees
    }

    /// The code of the whole system, as in `EPSG:25832`, where its text has one.
    pub fn code(&self) -> Option<String> {
        if keyword(&self.text).is_none() {
            return self.text.contains(':').then(|| self.text.to_ascii_uppercase());
        }
        root_code(&self.text)
    }

    /// Whether both name the same system: by the same text, or by codes.
    pub fn is_same(&self, other: &Crs) -> bool {
        self.text == other.text || self.code().is_some_and(|code| other.code() == Some(code))
    }

    /// Refuses degrees where lengths are needed.
    ///
    /// # Errors
    /// [`Error::Input`].
    pub fn lengths(crs: Option<&Crs>) -> Result<()> {
        match crs.filter(|crs| crs.degrees) {
            None => Ok(()),
            Some(crs) => Err(Error::input(format!(
                "its coordinates are degrees ({crs}), in which nothing can be measured: project them first, as to UTM"
            ))),
        }
    }

    /// The system of things that lie in one world and are measured there: what all that name one agree on.
    ///
    /// # Errors
    /// [`Error::Input`] if two disagree, or one is in degrees. It names them.
    pub fn common<'a>(named: impl IntoIterator<Item = (&'a str, Option<Crs>)>) -> Result<Option<Crs>> {
        let mut degrees = None;
        let named = named.into_iter().inspect(|(name, crs)| {
            if let Err(error) = Crs::lengths(crs.as_ref()) {
                degrees.get_or_insert_with(|| Error::input(format!("{name}: {error}")));
            }
        });
        let agreed = Crs::agreed(named);
        degrees.map_or(agreed, Err)
    }

    /// The system that all that name one agree on, be it in degrees.
    ///
    /// # Errors
    /// [`Error::Input`] if two disagree. It names them.
    pub fn agreed<'a>(named: impl IntoIterator<Item = (&'a str, Option<Crs>)>) -> Result<Option<Crs>> {
        let mut first: Option<(&str, Crs)> = None;
        for (name, crs) in named {
            let Some(crs) = crs else { continue };
            match &first {
                Some((other, known)) if !known.is_same(&crs) => return Err(disagree([(other, known), (name, &crs)])),
                // Of texts that mean the same the one that says most, whichever came first.
                Some((_, known)) if (known.text.len(), &known.text) >= (crs.text.len(), &crs.text) => {}
                _ => first = Some((name, crs)),
            }
        }
        Ok(first.map(|(_, crs)| crs))
    }

    /// Whether a text begins as well-known text does.
    pub fn is_well_known_text(text: &str) -> bool {
        keyword(text.trim_start()).is_some()
    }
}

/// The error of two scans of different systems.
fn disagree([(a, crs_a), (b, crs_b)]: [(&str, &Crs); 2]) -> Error {
    let remedy = "transform one of them first, or name the system of all where both mean the same";
    Error::input(format!("{a} is in {crs_a}, {b} in {crs_b}: {remedy}"))
}

/// Its name and code, for people. The text says all of it.
impl fmt::Display for Crs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = match keyword(&self.text) {
            Some(_) => self.text.split('"').nth(1).unwrap_or(&self.text),
            None => &self.text,
        };
        let shown = shown(name);
        match self.code().filter(|code| *code != shown.to_ascii_uppercase()) {
            Some(code) => write!(f, "{shown} ({code})"),
            None => f.write_str(&shown),
        }
    }
}

/// As much of a text as messages have room for.
fn shown(text: &str) -> String {
    text.chars().take(SHOWN).collect()
}

/// Its lines as one: between two words, and within quotes, there is a blank where a line ended, beside brackets and commas none.
fn in_one_line(text: &str) -> String {
    let mut whole = String::with_capacity(text.len());
    let mut quoted = false;
    for line in text.lines().map(str::trim).filter(|line| !line.is_empty()) {
        let is_mark = |letter: char| "[](),".contains(letter);
        let apart = quoted || !(whole.ends_with(is_mark) || line.starts_with(is_mark));
        if apart && !whole.is_empty() {
            whole.push(' ');
        }
        whole.push_str(line);
        quoted ^= line.matches('"').count() % 2 == 1;
    }
    whole
}

/// Whether all brackets and quotes of well-known text have an end.
fn is_closed(text: &str) -> bool {
    let bare = || text.split('"').step_by(2).flat_map(str::bytes);
    let count = |marks: &[u8]| bare().filter(|byte| marks.contains(byte)).count();
    text.matches('"').count().is_multiple_of(2) && count(b"[(") == count(b"])")
}

/// Whether a text is a code of an authority: `EPSG:25832`, `EPSG:25832+7837`, `urn:ogc:def:crs:EPSG::25832`.
fn is_code(text: &str) -> bool {
    let upper = text.to_ascii_uppercase();
    let is_word = |word: &str| word.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"_-.".contains(&byte));
    let Some((authority, code)) = upper.rsplit_once(':') else { return CODES_OF_ANGLES.contains(&upper.as_str()) };
    let is_of_epsg = authority.split(':').any(|part| part == "EPSG");
    let is_number = |part: &str| part.bytes().all(|byte| byte.is_ascii_digit());
    let is_known = |part: &str| !part.is_empty() && is_word(part) && (!is_of_epsg || is_number(part));
    authority.starts_with(|letter: char| letter.is_ascii_alphabetic())
        && authority.split(':').all(is_word)
        && code.split('+').all(is_known)
}

/// The word in front of the first bracket, if it begins well-known text.
fn keyword(text: &str) -> Option<&'static str> {
    let word = text.split(['[', '(']).next().filter(|word| word.len() < text.len())?.trim();
    KEYWORDS.into_iter().find(|known| word.eq_ignore_ascii_case(known))
}

/// The words in front of brackets, outside of quotes.
fn words(text: &str) -> impl Iterator<Item = &str> {
    let bare = text.split('"').step_by(2);
    bare.flat_map(|part| {
        part.match_indices(['[', '('])
            .map(move |(at, _)| part[..at].rsplit([',', '[', '(']).next().unwrap_or_default().trim())
    })
}

/// Systems in degrees that are named without well-known text, in capitals: those of satellites and of whole continents. Codes of others
/// are told by nothing.
const CODES_OF_ANGLES: [&str; 9] =
    ["EPSG:4326", "EPSG:4979", "EPSG:4258", "EPSG:4937", "EPSG:4269", "EPSG:4267", "OGC:CRS84", "CRS84", "OGC:CRS84H"];
/// Words for angles in texts of other languages: PROJ's, and PROJ's JSON.
const WORDS_OF_ANGLES: [&str; 3] = ["+PROJ=LONGLAT", "+PROJ=LATLONG", "\"GEOGRAPHICCRS\""];

fn is_in_degrees(text: &str) -> bool {
    if keyword(text).is_none() {
        let text = text.to_ascii_uppercase();
        // Of `urn:ogc:def:crs:EPSG::4326` and `EPSG:4326+5773` the code of places.
        let code = text.trim_start_matches("URN:OGC:DEF:CRS:").replace("::", ":");
        let code = code.replace(":1.3:", ":");
        let code = code.split('+').next().unwrap_or_default();
        return CODES_OF_ANGLES.contains(&code) || WORDS_OF_ANGLES.iter().any(|word| text.contains(word));
    }
    let has = |known: &[&str]| words(text).any(|word| known.iter().any(|one| word.eq_ignore_ascii_case(one)));
    let cartesian = || text.split('"').step_by(2).any(|part| part.to_ascii_lowercase().contains("cs[cartesian"));
    keyword(text).is_some() && !has(&PLANE) && has(&ANGLES) && !cartesian()
}

/// The code that stands in the outermost brackets: `AUTHORITY["EPSG","25832"]` or `ID["EPSG",25832]`.
fn root_code(text: &str) -> Option<String> {
    let (mut depth, mut quoted, mut begin) = (0_usize, false, 0);
    for (at, letter) in text.char_indices() {
        match letter {
            '"' => quoted = !quoted,
            _ if quoted => {}
            '[' | '(' => {
                depth += 1;
                if depth == 1 {
                    begin = at + 1;
                } else if depth == 2
                    && ["AUTHORITY", "ID"].iter().any(|known| text[begin..at].trim().eq_ignore_ascii_case(known))
                {
                    let inside = text[at + 1..].split([']', ')']).next()?;
                    let mut parts = inside.split(',').map(|part| part.trim().trim_matches('"'));
                    let (authority, code) = (parts.next()?, parts.next()?);
                    return Some(format!("{}:{code}", authority.to_ascii_uppercase()));
                }
            }
            ']' | ')' => depth = depth.saturating_sub(1),
            ',' if depth == 1 => begin = at + 1,
            _ => {}
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    const UTM: &str = "PROJCS[\"ETRS89 / UTM zone 32N\",GEOGCS[\"ETRS89\",DATUM[\"D (x]\",SPHEROID[\"GRS 1980\",6378137,298.257222101]],
        UNIT[\"degree\",0.0174532925199433],AUTHORITY[\"EPSG\",\"4258\"]],UNIT[\"metre\",1],AUTHORITY[\"EPSG\",\"25832\"]]";
    const DEGREES: &str =
        "GEOGCRS[\"WGS 84\",DATUM[\"World\"],CS[ellipsoidal,2],AXIS[\"lat\",north],ID[\"EPSG\",4326]]";

    #[test]
    fn systems_by_text_and_by_code() {
        let utm = Crs::new(UTM).unwrap();
        assert!(!utm.text().contains('\n') && !utm.is_in_degrees());
        assert_eq!(
            (utm.code().unwrap().as_str(), utm.to_string().as_str()),
            ("EPSG:25832", "ETRS89 / UTM zone 32N (EPSG:25832)")
        );
        assert!(utm.is_same(&Crs::new("epsg:25832").unwrap()) && !utm.is_same(&Crs::new("EPSG:25833").unwrap()));
        let degrees = Crs::new(DEGREES).unwrap();
        assert!(degrees.is_in_degrees() && degrees.code().as_deref() == Some("EPSG:4326"));
        for text in
            ["epsg:4326", "EPSG:4979", "EPSG:4326+5773", "urn:ogc:def:crs:OGC:1.3:CRS84", "+proj=longlat +datum=WGS84"]
        {
            assert!(Crs::new(text).unwrap().is_in_degrees(), "{text}");
        }
        assert!(!Crs::new("EPSG:432600").unwrap().is_in_degrees());
        assert!(!Crs::new("GEODCRS[\"x\",CS[Cartesian,3]]").unwrap().is_in_degrees());
        let compound = format!("COMPD_CS[\"both\",{},VERT_CS[\"DHHN\",AUTHORITY[\"EPSG\",\"7837\"]]]", utm.text());
        let compound = Crs::new(&compound).unwrap();
        assert!(!compound.is_in_degrees() && compound.code().is_none() && compound.to_string() == "both");
        assert_eq!(Crs::new("Gauß-Krüger, Zone 4").unwrap().to_string(), "Gauß-Krüger, Zone 4");
    }

    #[test]
    fn what_names_none_is_refused() {
        for (text, problem) in [
            ("", "empty"),
            (" \n\0", "empty"),
            ("a\u{1}", "none of text"),
            (&"x".repeat(LONGEST + 1), "bytes"),
            ("EPSG:", "EPSG: has no code"),
            (&UTM[..UTM.len() - 1], "not closed"),
            ("PROJCS[\"x]", "not closed"),
        ] {
            let error = Crs::new(text).unwrap_err().to_string();
            assert!(error.contains(problem) && error.contains("EPSG:25832"), "{error}");
        }
    }

    #[test]
    fn who_names_one_names_what_others_can_look_up() {
        for text in [
            UTM,
            DEGREES,
            "epsg:25832",
            "EPSG:25832+7837",
            "urn:ogc:def:crs:EPSG::25832",
            "urn:ogc:def:crs:OGC:1.3:CRS84",
            "https://www.opengis.net/def/crs/EPSG/0/25832",
            "ESRI:102100",
            "CRS84",
            "+proj=utm +zone=32",
            "{\"type\": \"ProjectedCRS\"}",
        ] {
            assert_eq!(Crs::told(text).unwrap(), Crs::new(text).unwrap(), "{text}");
        }
        for text in ["junk", "EPSG:junk", "EPSG:25832+", ":25832", "C:\\a.prj", "25832", "+", "a b:1", "JUNK[1]"] {
            let error = Crs::told(text).unwrap_err().to_string();
            let expected =
                format!("\"{text}\" names no coordinate reference system: give well-known text, or a code as");
            assert!(error.starts_with(&expected), "{error}");
        }
        assert!(Crs::told("EPSG:").is_err());
    }

    #[test]
    fn lines_become_one_and_no_words_grow_together() {
        for (lines, line) in [
            (
                "PROJCS[\"ETRS89 /\r\n  UTM zone\n32N\",\n UNIT[\"metre\",\n1\n]\n]",
                "PROJCS[\"ETRS89 / UTM zone 32N\",UNIT[\"metre\",1]]",
            ),
            ("LOCAL_CS[\"a,\nb\"]", "LOCAL_CS[\"a, b\"]"),
            ("+proj=utm\n\n+zone=32\n", "+proj=utm +zone=32"),
            ("\nOur\ngrid", "Our grid"),
        ] {
            assert_eq!(Crs::new(lines).unwrap().text(), line);
        }
    }

    #[test]
    fn one_world_has_one_system() {
        let [utm, code, other] = [UTM, "EPSG:25832", "EPSG:25833"].map(|text| Some(Crs::new(text).unwrap()));
        let common = |all: &[(&str, &Option<Crs>)]| Crs::common(all.iter().map(|(name, crs)| (*name, (*crs).clone())));
        assert_eq!(common(&[]).unwrap(), None);
        assert_eq!(common(&[("a", &None), ("b", &utm), ("c", &code)]).unwrap(), utm);
        let error = common(&[("a", &code), ("b", &other)]).unwrap_err().to_string();
        assert!(error.starts_with("a is in EPSG:25832, b in EPSG:25833: transform one"), "{error}");
        let error = common(&[("c", &Some(Crs::new(DEGREES).unwrap()))]).unwrap_err().to_string();
        assert!(error.starts_with("c: its coordinates are degrees (WGS 84 (EPSG:4326))"), "{error}");
        let degrees = Crs::new(DEGREES).unwrap();
        assert_eq!(Crs::agreed([("c", Some(degrees.clone()))]).unwrap(), Some(degrees));
        assert!(Crs::lengths(code.map(|crs| crs.with_degrees(true)).as_ref()).is_err());
    }

    proptest::proptest! {
        #[test]
        fn no_text_panics(text in "(PROJCS|GEOGCS|ID)?[\\[\\]()\",A-Z0-9ä ]{0,60}") {
            if let Ok(crs) = Crs::new(&text) {
                let _ = (crs.code(), crs.to_string(), crs.is_in_degrees());
            }
        }
    }
}
