//! Units of length that files name, and the one that the header of an STL file says.

use std::ops::RangeInclusive;

use base::error::{Error, Result};

/// A unit of 3MF.
pub(crate) struct Unit {
    /// Its name in 3MF.
    pub name: &'static str,
    pub metres: f64,
    /// Its symbol in the header of an STL file.
    symbol: &'static str,
    /// Its name for people.
    plural: &'static str,
}

/// All units of 3MF, the smallest first but for the metre.
pub(crate) const UNITS: [Unit; 6] = [
    Unit { name: "micron", metres: 1e-6, symbol: "um", plural: "micrometres" },
    Unit { name: "millimeter", metres: 1e-3, symbol: "mm", plural: "millimetres" },
    Unit { name: "centimeter", metres: 1e-2, symbol: "cm", plural: "centimetres" },
    Unit { name: "inch", metres: 0.0254, symbol: "in", plural: "inches" },
    Unit { name: "foot", metres: 0.3048, symbol: "ft", plural: "feet" },
    Unit { name: "meter", metres: 1.0, symbol: "m", plural: "metres" },
];

/// The place of the millimetre, which 3MF takes for a file that names no unit.
pub(crate) const MILLIMETRE: &Unit = &UNITS[1];

/// Metres a unit whose scale single precision can hold.
const METRES: RangeInclusive<f64> = 1e-30..=1e30;

/// Bytes of an STL file's header before the number of triangles.
pub(crate) const STL_TEXT: usize = 80;
/// The start of the headers that we write. Not "solid": that would make the file look like text.
const STL_START: &[u8] = b"binary STL, mesh  ";
/// The key before a unit, in the form that colours have in such headers (`COLOR=`).
const STL_KEY: &[u8] = b"UNITS=";

/// The unit of so many metres, if it has a name.
pub(crate) fn named(metres: f64) -> Option<&'static Unit> {
    UNITS.iter().find(|unit| unit.metres == metres)
}

/// Refuses a unit whose scale single precision cannot hold, for a format of that name.
pub(crate) fn check(metres: f64, format: &str) -> Result<()> {
    if METRES.contains(&metres) {
        return Ok(());
    }
    let (least, most) = (METRES.start(), METRES.end());
    Err(Error::input(format!("metres_per_unit must be from {least:e} to {most:e} for {format}, got {metres:e}")))
}

/// The header of an STL file whose unit has so many metres. The metre is not said: without a word coordinates are read as they are.
pub(crate) fn stl_header(metres: f64) -> [u8; STL_TEXT] {
    let unit = match named(metres) {
        _ if metres == 1.0 => String::new(),
        Some(unit) => unit.symbol.to_owned(),
        None => format!("{metres:e}m"),
    };
    let key = if unit.is_empty() { b"" } else { STL_KEY };
    let text = [STL_START, key, unit.as_bytes()].concat();
    let mut header = [0; STL_TEXT];
    header[..text.len()].copy_from_slice(&text);
    header
}

/// Metres in the unit that the header of an STL file says. `None` if it says none, or in another form than ours.
pub(crate) fn of_stl_header(header: &[u8]) -> Option<f64> {
    let said = header.get(..STL_TEXT)?.strip_prefix(STL_START)?.strip_prefix(STL_KEY)?;
    let end = said.iter().position(|&byte| byte == 0).unwrap_or(said.len());
    let (said, rest) = said.split_at(end);
    if rest.iter().any(|&byte| byte != 0) {
        return None;
    }
    let said = str::from_utf8(said).ok()?;
    let symbol = UNITS.iter().find(|unit| unit.symbol == said).map(|unit| unit.metres);
    symbol.or_else(|| said.strip_suffix('m')?.parse().ok()).filter(|metres| METRES.contains(metres))
}

/// A unit for people: "millimetres", "units of 0.2 m".
pub(crate) fn words(metres: f64) -> String {
    named(metres).map_or_else(|| format!("units of {metres} m"), |unit| unit.plural.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Theorem: each unit comes back to the bit, and only our own form is one.
    #[test]
    fn a_header_says_its_unit() {
        for metres in UNITS.iter().map(|unit| unit.metres).chain([0.2, 1.0 / 3.0, 1e-30, 1e30, 1.0 + f64::EPSILON]) {
            let header = stl_header(metres);
            assert_eq!(of_stl_header(&header), (metres != 1.0).then_some(metres), "{metres}");
            assert!(header.starts_with(b"binary STL, mesh") && header.is_ascii());
        }
        assert_eq!(&stl_header(1e-3)[..26], b"binary STL, mesh  UNITS=mm");
        let changed = |from: &str, to: &str| {
            let text = String::from_utf8(stl_header(1e-3).to_vec()).unwrap().replacen(from, to, 1);
            of_stl_header(&text.as_bytes()[..STL_TEXT.min(text.len())])
        };
        assert_eq!(changed("UNITS", "UNITS"), Some(1e-3));
        for (from, to) in [
            ("binary STL, mesh  ", ""),
            ("UNITS=mm", "UNITS=mile"),
            ("UNITS=mm", "UNITS=-1m"),
            ("UNITS=mm", "UNITS=nanm"),
            ("UNITS=mm", "UNITS=0m"),
            ("UNITS=mm", "UNITS=1e31m"),
            ("UNITS=mm", "UNITS="),
            ("UNITS=mm", "UNITS=m\u{20ac}m"),
            ("UNITS=mm\0", "UNITS=mm\0COLOR="),
            ("UNITS", "units"),
        ] {
            assert_eq!(changed(from, to), None, "{to}");
        }
        assert_eq!(of_stl_header(&[]), None);
    }
}
