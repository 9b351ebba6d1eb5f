//! Images that are gone or damaged. Opening skips frames whose depth is, and says so. It decodes files only where their end or their length
//! says that something is missing. Other damage is met when frames are read for something that takes many, and is left out.

use std::io::ErrorKind;
use std::path::Path;
use std::sync::{Arc, PoisonError};

use glam::DAffine3;

use super::super::options::ReadOptions;
use super::super::scan::Frames as _;
use super::decode::{Coding, is_damage};
use super::recording::{Lone, Recording};
use super::store::Place;
use base::error::{Error, Result};
use base::log::{self, Level};
use base::progress::Progress;
use image::frame::Frame;
use image::range_image::RangeImage;

/// End of a PNG file.
const END_OF_PNG: [u8; 12] = [0, 0, 0, 0, b'I', b'E', b'N', b'D', 0xAE, 0x42, 0x60, 0x82];

/// End of data in LZFSE.
const END_OF_LZFSE: &[u8] = b"bvx$";

/// Endings of files whose length follows from the size of the image.
const OF_ONE_LENGTH: [&str; 4] = [".bin", ".pgm", ".pfm", ".npy"];

/// Frames shown by name.
const SHOWN: usize = 3;

impl Recording {
    /// Skips the frames whose depth images are not there or end too early. Says which.
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

    /// Reason why the depths or the confidences of a frame can't be decoded. `None` if they can.
    pub(super) fn why_damaged(
        &self,
        index: usize,
        options: &Arc<ReadOptions>,
        progress: &Progress<'_>,
    ) -> Result<Option<String>> {
        let decoded = || {
            self.decoded(&self.entries[index], options, progress)?;
            self.confidence(index, options, progress)
        };
        let name = |path: &Path| path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        match decoded() {
            Ok(_) => Ok(None),
            Err(Error::Format { path, problem, .. }) => Ok(Some(format!("{} is damaged ({problem})", name(&path)))),
            Err(Error::Io { path, source }) if source.kind() == ErrorKind::NotFound => {
                Ok(Some(format!("{} is not there", name(&path))))
            }
            Err(other) => Err(other),
        }
    }

    /// Reads a frame as [`Recording::frame`] does, but without its colours if they are damaged, and without any sample if depth or
    /// confidence is. The log is told once per frame.
    pub(super) fn undamaged_parts(
        &self,
        index: usize,
        world_from_sensor: DAffine3,
        options: &Arc<ReadOptions>,
        progress: &Progress<'_>,
    ) -> Result<Frame> {
        let why = match self.frame(index, world_from_sensor, options, progress) {
            Err(error) if is_damage(&error) => error,
            outcome => return outcome,
        };
        let entry = &self.entries[index];
        let (mut frame, lacks) = match self.without_colour(index, options, progress) {
            Ok(frame) => (frame, "is read without colours"),
            // Depth that is gone by now is not damage of one frame.
            Err(Error::Format { .. }) => {
                let camera = entry.depth_camera;
                let [cols, rows] = camera.size.unwrap_or([1; 2]);
                let nothing = vec![f64::NAN; rows * cols];
                let image = RangeImage::from_values(rows, cols, nothing, camera.projection(self.depth.kind))?;
                (Frame::new(image), "is skipped")
            }
            Err(error) => return Err(error),
        };
        self.tell_damage(index, lacks, &why);
        frame.depth.world_from_sensor = world_from_sensor;
        Ok(frame)
    }

    /// Tells the log, once per frame, what damage has led to.
    pub(super) fn tell_damage(&self, index: usize, lacks: &str, why: &Error) {
        let damage = format!("{lacks}: {why}");
        let text = format!("{} {damage}", self.entries[index].name);
        if self.damages.lock().unwrap_or_else(PoisonError::into_inner).insert(index, damage).is_none() {
            log::tell(Level::Warning, &text);
        }
    }

    /// Damage of a frame that reading it has met.
    pub(super) fn damage(&self, index: usize) -> Option<String> {
        self.damages.lock().unwrap_or_else(PoisonError::into_inner).get(&index).cloned()
    }

    /// The photo of a frame, without its depths. `None` for poses that may still move with the clock.
    fn photo_alone(&self, index: usize) -> Option<Lone> {
        let entry = self.entries.get(index).filter(|_| self.timed.is_none())?;
        let world_from_camera = entry.world_from_sensor * self.colour_from_depth.inverse();
        Some(Lone { place: entry.colour.clone()?, camera: entry.colour_camera, lens: None, world_from_camera })
    }

    /// Takes frames out. Says which and why.
    pub(super) fn skip(&mut self, frames: Vec<(usize, String)>) -> Option<String> {
        if frames.is_empty() {
            return None;
        }
        let count = self.entries.len();
        let mut is_kept = vec![true; count];
        frames.iter().for_each(|(k, _)| is_kept[*k] = false);
        if self.keeps_photos {
            let without_depths = frames.iter().filter_map(|(k, _)| self.photo_alone(*k));
            self.photos.extend(without_depths.collect::<Vec<_>>());
        }
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
