//! The keys of GeoTIFF (OGC 19-008), in the records of LAS too: a directory of four numbers per key, values beside it.

use mesh::Crs;

/// A system, or none. Or the fault of one that is named.
pub(super) type NamedCrs = Result<Option<Crs>, String>;

/// Numbers of keys.
const MODEL: u16 = 1024;
const CITATION: u16 = 1026;
const GEOGRAPHIC: u16 = 2048;
const PROJECTED: u16 = 3072;
const PROJECTED_CITATION: u16 = 3073;
const VERTICAL: u16 = 4096;
/// The model of latitude and longitude.
const DEGREES: u16 = 2;
/// Place of a key's text: in the parameters of text.
const IN_TEXT: u16 = 34737;
/// Code of what has none.
const USER_DEFINED: u16 = 32767;
/// Beginning of well-known text in citations.
const ESRI: &str = "ESRI PE String = ";

/// The directory and the parameters of text.
pub(super) struct GeoKeys<'a> {
    pub(super) directory: &'a [u16],
    pub(super) text: &'a [u8],
}

impl GeoKeys<'_> {
    fn entry(&self, id: u16) -> Option<[u16; 4]> {
        let entries = self.directory.as_chunks::<4>().0;
        entries.iter().skip(1).find(|entry| entry[0] == id).copied()
    }

    /// A key's value in the directory itself.
    pub(super) fn value(&self, id: u16) -> Option<u16> {
        self.entry(id).filter(|entry| entry[1] == 0).map(|entry| entry[3])
    }

    fn code(&self, id: u16) -> Option<u16> {
        self.value(id).filter(|code| !matches!(*code, 0 | USER_DEFINED))
    }

    fn citation(&self, id: u16) -> Option<String> {
        let [_, place, count, at] = self.entry(id).filter(|entry| entry[1] == IN_TEXT)?;
        debug_assert_eq!(place, IN_TEXT);
        let bytes = self.text.get(usize::from(at)..usize::from(at) + usize::from(count))?;
        // Texts end with a bar.
        let text = String::from_utf8_lossy(bytes);
        let text = text.trim_end_matches(['|', '\0', ' ']);
        (!text.is_empty()).then(|| text.to_owned())
    }

    /// Whether x and y are degrees.
    pub(super) fn are_degrees(&self) -> bool {
        self.value(MODEL) == Some(DEGREES)
    }

    /// The system: by its code, with that of the heights if there is one, else by well-known text or a name in a citation.
    pub(super) fn crs(&self) -> NamedCrs {
        let degrees = self.are_degrees();
        let code = if degrees { self.code(GEOGRAPHIC) } else { self.code(PROJECTED) };
        let text = match code {
            Some(code) => match self.code(VERTICAL) {
                Some(heights) => format!("EPSG:{code}+{heights}"),
                None => format!("EPSG:{code}"),
            },
            None => {
                let Some(citation) = self.citation(PROJECTED_CITATION).or_else(|| self.citation(CITATION)) else {
                    return Ok(None);
                };
                citation.strip_prefix(ESRI).unwrap_or(&citation).to_owned()
            }
        };
        let crs = Crs::new(&text).map_err(|error| error.to_string())?;
        Ok(Some(if degrees { crs.with_degrees(true) } else { crs }))
    }
}
