//! Points out of their records.

use std::path::Path;

use glam::DVec3;

use super::super::file::reserve;
use super::super::scan::{Content, FileScan};
use super::bytes::{u16_at, u32_at};
use super::header::Header;
use base::error::{Result, counted, known_as};
use base::log::{self, Level};
use mesh::point_cloud::PointCloud;

/// Place of its red, by format.
pub(super) const COLOUR: [Option<usize>; 11] =
    [None, None, Some(20), Some(28), None, Some(28), None, Some(30), Some(30), None, Some(30)];

/// The points so far.
pub(super) struct Points {
    pub(super) header: Header,
    pub(super) cloud: PointCloud,
    pub(super) intensity: Vec<f32>,
    pub(super) colour: Vec<[u8; 4]>,
    /// Bits that were set in any intensity, and in any colour.
    pub(super) seen: [u16; 2],
    /// Points that are left out as the format asks.
    pub(super) withheld: u64,
}

impl Points {
    /// For points whose number was checked against the file or the limit.
    pub(super) fn new(header: Header, scan: &FileScan) -> Result<Points> {
        let count = header.count as usize;
        let cloud = PointCloud {
            positions: reserve(count, &scan.path)?,
            world_from_cloud: scan.world_from_sensor,
            ..PointCloud::default()
        };
        let colours = if COLOUR[header.format].is_some() { count } else { 0 };
        Ok(Points {
            header,
            cloud,
            intensity: reserve(count, &scan.path)?,
            colour: reserve(colours, &scan.path)?,
            seen: [0; 2],
            withheld: 0,
        })
    }

    #[inline]
    pub(super) fn add(&mut self, record: &[u8]) {
        let withheld = if self.header.format < 6 { record[15] & 0x80 } else { record[15] & 0x04 };
        if withheld != 0 {
            self.withheld += 1;
            return;
        }
        let number = |axis: usize| f64::from(u32_at(record, 4 * axis).cast_signed());
        self.cloud.positions.push(DVec3::new(number(0), number(1), number(2)) * self.header.scale + self.header.offset);
        let intensity = u16_at(record, 12);
        self.seen[0] |= intensity;
        self.intensity.push(intensity.into());
        if let Some(at) = COLOUR[self.header.format] {
            let colour = [0, 2, 4].map(|channel| u16_at(record, at + channel));
            let bits = colour[0] | colour[1] | colour[2];
            if self.seen[1] < 256 && bits > 255 {
                // All before were below 256 as well, which is nothing in 16 bits.
                self.colour.fill([0, 0, 0, 255]);
            }
            self.seen[1] |= bits;
            let shift = if self.seen[1] > 255 { 8 } else { 0 };
            let [r, g, b] = colour.map(|channel| (channel >> shift) as u8);
            self.colour.push([r, g, b, 255]);
        }
    }

    pub(super) fn finish(mut self, path: &Path) -> Content {
        if self.withheld > 0 {
            let of = counted(self.header.count, "point is", "points are");
            let text = format!("{}: {} of {of} marked as withheld and left out", known_as(path), self.withheld);
            log::tell(Level::Info, &text);
        }
        self.cloud.intensity = (self.seen[0] != 0).then_some(self.intensity);
        self.cloud.colour = (self.seen[1] != 0).then_some(self.colour);
        Content::Points(self.cloud)
    }
}
