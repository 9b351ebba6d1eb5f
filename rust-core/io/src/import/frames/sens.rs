//! ScanNet's and BundleFusion's `.sens`, version 4: one file with cameras, then for each frame its pose, colour image and depth. The pose
//! is camera to world, minus infinity where it was lost. The colour image is JPEG or PNG. The depth has two bytes per pixel, packed with
//! zlib or not.
//!
//! Listed by going from frame to frame. Images are read when they are needed. All numbers are little-endian.

use std::io::{BufReader, Read};
use std::path::Path;

use super::asked::{Asked, counted};
use super::decode::Coding;
use super::poses;
use super::recording::{Entry, Recording, pose};
use super::store::{Place, Store};
use crate::import::file;
use base::error::{Error, Result};
use image::frame::Camera;

/// Version, and the longest name of a sensor that a file may have: what a file of the format starts with.
const VERSION: u32 = 4;
const LONGEST_NAME: u64 = 1 << 12;

/// Bytes of a frame before its images: the pose, two times, two sizes.
const FRAME_HEADER: u64 = 16 * 4 + 4 * 8;

pub(in super::super) fn sniff(start: &[u8]) -> bool {
    let version = start.first_chunk::<4>().map(|bytes| u32::from_le_bytes(*bytes));
    let length = start.get(4..12).and_then(|bytes| bytes.first_chunk::<8>()).map(|bytes| u64::from_le_bytes(*bytes));
    version == Some(VERSION)
        && length.is_some_and(|length| {
            let name = start.get(12..12 + length.min(LONGEST_NAME) as usize);
            length < LONGEST_NAME && name.is_some_and(|name| name.iter().all(|b| (b' '..=b'~').contains(b)))
        })
}

/// A file that is read from front to back.
struct Reader<'a, R> {
    input: R,
    at: u64,
    length: u64,
    path: &'a Path,
}

pub(super) fn list(path: &Path, asked: &Asked<'_, '_>) -> Result<Recording> {
    let (input, length) = file::open_bytes(path)?;
    listed(Reader { input: BufReader::with_capacity(1 << 12, input), at: 0, length, path }, asked)
}

fn listed<R: Read + std::io::Seek>(mut reader: Reader<'_, BufReader<R>>, asked: &Asked<'_, '_>) -> Result<Recording> {
    let version = reader.u32()?;
    if version != VERSION {
        return Err(reader.fail(format!("version {version} is not read, only {VERSION}")));
    }
    let name = reader.u64()?;
    reader.skip(name)?;
    let (colour_matrix, colour_extrinsic) = (reader.matrix()?, reader.matrix()?);
    let (depth_matrix, depth_extrinsic) = (reader.matrix()?, reader.matrix()?);
    let (_, depth_coding) = (reader.u32()?, reader.u32()?);
    let colour_size = [reader.u32()? as usize, reader.u32()? as usize];
    let depth_size = [reader.u32()? as usize, reader.u32()? as usize];
    let shift = f64::from(reader.f32()?);
    let coding = match depth_coding {
        0 => Coding::Numbers(depth_size),
        1 => Coding::ZlibNumbers(depth_size),
        _ => return Err(reader.fail(format!("depth packed in the way {depth_coding} is not read, only raw and zlib"))),
    };
    if !(shift > 0.0 && shift.is_finite()) {
        return Err(reader.fail(format!("depths are multiplied by {shift}, which must be > 0")));
    }
    let cameras = [(depth_matrix, depth_size), (colour_matrix, colour_size)].map(|(m, size)| {
        let camera = Camera::sized([m[0], m[5]], [m[2], m[6]], size);
        camera.validate().map(|()| camera)
    });
    let [depth_camera, colour_camera] = cameras;
    let depth_camera = depth_camera.map_err(|error| reader.fail(error.to_string()))?;
    let count = reader.u64()?;
    if count > (length_left(&reader)) / FRAME_HEADER {
        return Err(reader.fail(format!("it says that it has {count} frames, more than fit into it")));
    }
    let (mut entries, mut lost) = (Vec::new(), 0);
    for k in 0..count {
        asked.progress.check()?;
        let rows = reader.matrix()?;
        reader.skip(16)?;
        let (colour_bytes, depth_bytes) = (reader.u64()?, reader.u64()?);
        let colour_at = reader.at;
        reader.skip(colour_bytes)?;
        let depth_at = reader.at;
        reader.skip(depth_bytes)?;
        let Some(world_from_sensor) = pose(&rows).map_err(|problem| reader.fail(format!("frame {k}: {problem}")))?
        else {
            lost += 1;
            continue;
        };
        let colour = Place::Span { at: colour_at, bytes: colour_bytes };
        entries.push(Entry {
            name: format!("{k:06}").into(),
            depth: Place::Span { at: depth_at, bytes: depth_bytes },
            // Without a camera of their own colours could not be looked up.
            colour: (colour_bytes > 0 && colour_camera.is_ok()).then_some(colour),
            confidence: None,
            depth_camera,
            colour_camera: colour_camera.as_ref().map_or(depth_camera, |camera| *camera),
            world_from_sensor,
        });
    }
    let mut recording = Recording::new(Store::file(reader.path), "ScanNet or BundleFusion");
    recording.depth.coding = coding;
    recording.depth.unit = 1.0 / shift;
    recording.colour_from_depth = poses::between(&colour_extrinsic, &depth_extrinsic);
    recording.notes.extend(counted(lost, count as usize, "have no pose and are passed over"));
    Ok(Recording { entries, ..recording })
}

fn length_left<R>(reader: &Reader<'_, R>) -> u64 {
    reader.length.saturating_sub(reader.at)
}

impl<R> Reader<'_, R> {
    fn fail(&self, problem: String) -> Error {
        Error::format(self.path, format!("byte {}", self.at), problem)
    }
}

impl<R: Read + std::io::Seek> Reader<'_, BufReader<R>> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N]> {
        if length_left(self) < N as u64 {
            return Err(self.fail("the file ends within a frame or the header: it was cut off".to_owned()));
        }
        let mut bytes = [0; N];
        self.input.read_exact(&mut bytes).map_err(|error| Error::io(self.path, error))?;
        self.at += N as u64;
        Ok(bytes)
    }

    fn skip(&mut self, count: u64) -> Result<()> {
        if count > length_left(self) {
            return Err(self.fail(format!("{count} bytes are said to follow, but the file ends: it was cut off")));
        }
        self.at += count;
        // Less than the file's length, which a system's files keep below 2^63.
        self.input.seek_relative(count as i64).map_err(|error| Error::io(self.path, error))
    }

    fn u32(&mut self) -> Result<u32> {
        self.take().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Result<u64> {
        self.take().map(u64::from_le_bytes)
    }

    fn f32(&mut self) -> Result<f32> {
        self.take().map(f32::from_le_bytes)
    }

    fn matrix(&mut self) -> Result<[f64; 16]> {
        let mut rows = [0.0; 16];
        for value in &mut rows {
            *value = f64::from(self.f32()?);
        }
        Ok(rows)
    }
}
