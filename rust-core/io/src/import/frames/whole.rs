//! Depth images that are gone or damaged: their frames are skipped and said. Files are decoded only where their end or their length
//! says that something is missing.

use std::sync::Arc;

use super::super::ReadOptions;
use super::decode::Coding;
use super::recording::Recording;
use super::store::Place;
use base::error::{Error, Result};
use base::progress::Progress;

/// What a PNG file ends with.
const END_OF_PNG: [u8; 12] = [0, 0, 0, 0, b'I', b'E', b'N', b'D', 0xAE, 0x42, 0x60, 0x82];

/// What data in LZFSE end with.
const END_OF_LZFSE: &[u8] = b"bvx$";

/// Endings of files whose length follows from the size of the image.
const OF_ONE_LENGTH: [&str; 4] = [".bin", ".pgm", ".pfm", ".npy"];

/// Frames shown by name.
const SHOWN: usize = 3;

impl Recording {
    /// Skips the frames whose depth images are not there or end too early; says which.
    pub(super) fn skip_damaged(
        &mut self,
        options: &Arc<ReadOptions>,
        progress: &Progress<'_>,
    ) -> Result<Option<String>> {
        let mut damaged = Vec::new();
        let mut usual = None;
        for (k, entry) in self.entries.iter().enumerate() {
            progress.check()?;
            let Place::Named(name) = &entry.depth else { continue };
            let Some((end, length)) = self.store.end_of(name, END_OF_PNG.len() as u64, progress)? else {
                damaged.push((k, format!("{name} is not there")));
                continue;
            };
            let is_short = match self.depth.coding {
                Coding::LzfseFloats(_) | Coding::LzfseBytes(_) => {
                    end.as_ref().is_some_and(|end| !end.ends_with(END_OF_LZFSE))
                }
                _ if OF_ONE_LENGTH.iter().any(|ending| name.ends_with(ending)) => {
                    *usual.get_or_insert(length) != length
                }
                _ => name.ends_with(".png") && end.as_ref().is_some_and(|end| *end != END_OF_PNG),
            };
            if (is_short || length == 0 || k == 0)
                && let Some(why) = self.why_damaged(k, options, progress)?
            {
                damaged.push((k, why));
            }
        }
        Ok(self.skip(damaged))
    }

    /// Why the depths of a frame can't be decoded; `None` where they can.
    pub(super) fn why_damaged(
        &self,
        index: usize,
        options: &Arc<ReadOptions>,
        progress: &Progress<'_>,
    ) -> Result<Option<String>> {
        match self.decoded(&self.entries[index], options, progress) {
            Ok(_) => Ok(None),
            Err(Error::Format { path, problem, .. }) => {
                let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
                Ok(Some(format!("{name} is damaged ({problem})")))
            }
            Err(other) => Err(other),
        }
    }

    /// Takes frames out; says which and why.
    pub(super) fn skip(&mut self, frames: Vec<(usize, String)>) -> Option<String> {
        if frames.is_empty() {
            return None;
        }
        let count = self.entries.len();
        let mut is_kept = vec![true; count];
        frames.iter().for_each(|(k, _)| is_kept[*k] = false);
        let mut kept = is_kept.iter();
        self.entries.retain(|_| kept.next().copied().unwrap_or(true));
        if let Some(timed) = &mut self.timed {
            let mut kept = is_kept.iter();
            timed.times.retain(|_| kept.next().copied().unwrap_or(true));
        }
        let shown: Vec<&str> = frames.iter().take(SHOWN).map(|(_, why)| why.as_str()).collect();
        let more = if frames.len() > SHOWN { ", and others" } else { "" };
        Some(format!("{} of {count} frames are skipped: {}{more}", frames.len(), shown.join(", ")))
    }
}
