//! Records of LAS that name a system: well-known text (2112), else keys of GeoTIFF (34735, texts in 34737), before the points or,
//! from version 1.4 on, behind them.

use std::io::{Read, Seek, SeekFrom};

use mesh::Crs;
use mesh::crs::LONGEST;

use super::super::geo_keys::{GeoKeys, NamedCrs};
use crate::import::file;

/// Owner of the records.
const USER: &[u8] = b"LASF_Projection";
const TEXT: u16 = 2112;
const KEYS: u16 = 34735;
const TEXT_OF_KEYS: u16 = 34737;

/// Bytes of the header that are looked at, and of what goes before a record's content, before the points and behind them.
const HEADER: usize = 375;
const HEADS: [usize; 2] = [54, 60];
/// More records than a file in its right mind has.
const MOST: u32 = 10_000;

/// Records that were found, by kind.
#[derive(Default)]
struct Records {
    text: Option<Vec<u8>>,
    keys: Option<Vec<u8>>,
    text_of_keys: Vec<u8>,
}

fn number<const N: usize>(bytes: &[u8], at: usize) -> Option<u64> {
    let mut wide = [0; 8];
    wide[..N].copy_from_slice(bytes.get(at..at + N)?);
    Some(u64::from_le_bytes(wide))
}

/// The system that a file of so many bytes names. `None` if its records can't be followed.
pub(super) fn named(input: &mut (impl Read + Seek), length: u64) -> Option<NamedCrs> {
    let mut header = Vec::new();
    input.take(HEADER as u64).read_to_end(&mut header).ok()?;
    let minor = *header.get(25)?;
    let mut records = Records::default();
    let (own, begin) = (number::<2>(&header, 94)?, number::<4>(&header, 96)?);
    records.read(input, [own, begin.min(length)], number::<4>(&header, 100)? as u32, HEADS[0]);
    if minor >= 4 && own >= HEADER as u64 {
        let (behind, count) = (number::<8>(&header, 235)?, number::<4>(&header, 243)? as u32);
        records.read(input, [behind, length], count, HEADS[1]);
    }
    Some(records.crs())
}

impl Records {
    /// Follows records from one place of the file to another. A record that can't be followed ends them.
    fn read(&mut self, input: &mut (impl Read + Seek), [mut at, end]: [u64; 2], count: u32, head: usize) -> Option<()> {
        for _ in 0..count.min(MOST) {
            let content = at.checked_add(head as u64).filter(|content| *content <= end)?;
            input.seek(SeekFrom::Start(at)).ok()?;
            let mut bytes = vec![0; head];
            input.read_exact(&mut bytes).ok()?;
            let id = number::<2>(&bytes, 18)? as u16;
            let length = if head == HEADS[0] { number::<2>(&bytes, 20)? } else { number::<8>(&bytes, 20)? };
            at = content.checked_add(length).filter(|next| *next <= end)?;
            let slot = match id {
                TEXT => self.text.get_or_insert_default(),
                KEYS => self.keys.get_or_insert_default(),
                TEXT_OF_KEYS => &mut self.text_of_keys,
                _ => continue,
            };
            if bytes[2..18].starts_with(USER) && slot.is_empty() {
                // A byte more is enough to be refused.
                input.take(length.min(LONGEST as u64 + 1)).read_to_end(slot).ok()?;
            }
        }
        Some(())
    }

    fn crs(&self) -> NamedCrs {
        // A text of C ends at its first zero. One without a letter is a record that somebody left empty.
        let text = self.text.as_ref().map(|bytes| file::start_of_text(bytes));
        if let Some(text) = text.filter(|text| text.contains(char::is_alphanumeric)) {
            return Crs::new(&text).map(Some).map_err(|error| error.to_string());
        }
        let Some(keys) = &self.keys else { return Ok(None) };
        let directory: Vec<u16> = keys.as_chunks::<2>().0.iter().map(|pair| u16::from_le_bytes(*pair)).collect();
        GeoKeys { directory: &directory, text: &self.text_of_keys }.crs()
    }
}
