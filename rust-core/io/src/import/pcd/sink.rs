//! A PCD file's values to the grid or the cloud that they are of.

use std::path::Path;

use glam::{DAffine3, DVec3};

use super::header::{Header, Target};
use crate::import::file::reserve;
use crate::import::grid::PointGrid;
use crate::import::scan::{Content, FileScan};
use base::error::Result;
use mesh::point_cloud::PointCloud;

/// Targets of the values of a file.
pub(super) enum Sink {
    Grid(PointGrid),
    Cloud {
        positions: Vec<DVec3>,
        normals: Option<Vec<[f32; 3]>>,
        colour: Option<Vec<[u8; 4]>>,
        intensity: Option<Vec<f32>>,
    },
}

impl Sink {
    pub fn new(header: &Header, points: usize, path: &Path) -> Result<Self> {
        let has = |target| header.fields.iter().any(|f| f.target == target);
        if header.height > 1 {
            let (rows, cols) = (header.height as usize, header.width as usize);
            return Ok(Sink::Grid(PointGrid::new(rows, cols, has(Target::Intensity), has(Target::Colour), path)?));
        }
        fn filled<T: Clone>(wanted: bool, count: usize, with: T, path: &Path) -> Result<Option<Vec<T>>> {
            if !wanted {
                return Ok(None);
            }
            let mut list = reserve(count, path)?;
            list.resize(count, with);
            Ok(Some(list))
        }
        Ok(Sink::Cloud {
            positions: filled(true, points, DVec3::NAN, path)?.unwrap_or_default(),
            normals: filled((0..3).all(|axis| has(Target::Normal(axis))), points, [0.0; 3], path)?,
            colour: filled(has(Target::Colour), points, [0; 4], path)?,
            intensity: filled(has(Target::Intensity), points, 0.0, path)?,
        })
    }

    #[inline(always)]
    pub fn set(&mut self, point: usize, target: Target, value: f64) {
        // Packed as 0xAARRGGBB; most writers leave alpha 0.
        let unpacked = |bits: f64| {
            let [b, g, r, _] = (bits as u32).to_le_bytes();
            [r, g, b, 255]
        };
        match (self, target) {
            (Sink::Grid(grid), Target::Position(axis)) => grid.set_coordinate(point, axis, value),
            (
                Sink::Grid(PointGrid { colour: Some(list), .. }) | Sink::Cloud { colour: Some(list), .. },
                Target::Colour,
            ) => {
                list[point] = unpacked(value);
            }
            (
                Sink::Grid(PointGrid { intensity: Some(list), .. }) | Sink::Cloud { intensity: Some(list), .. },
                Target::Intensity,
            ) => list[point] = value as f32,
            (Sink::Cloud { positions, .. }, Target::Position(axis)) => positions[point][axis] = value,
            (Sink::Cloud { normals: Some(list), .. }, Target::Normal(axis)) => list[point][axis] = value as f32,
            _ => {}
        }
    }

    pub fn into_content(self, header: &Header, scan: &FileScan) -> Result<Content> {
        let (mut positions, mut normals, mut colour, mut intensity) = match self {
            Sink::Grid(grid) => return grid.into_content(header.viewpoint, scan),
            Sink::Cloud { positions, normals, colour, intensity } => (positions, normals, colour, intensity),
        };
        if positions.iter().any(|p| !p.is_finite()) {
            fn retain<T>(list: &mut Vec<T>, kept: &[bool]) {
                let mut kept = kept.iter();
                list.retain(|_| kept.next() == Some(&true));
            }
            let kept: Vec<bool> = positions.iter().map(|p| p.is_finite()).collect();
            retain(&mut positions, &kept);
            normals.iter_mut().for_each(|list| retain(list, &kept));
            colour.iter_mut().for_each(|list| retain(list, &kept));
            intensity.iter_mut().for_each(|list| retain(list, &kept));
        }
        let world_from_cloud: DAffine3 = scan.world_from_sensor;
        // Writers who know of none leave it at the origin.
        let sensor = Some(header.viewpoint).filter(|viewpoint| *viewpoint != DVec3::ZERO);
        Ok(Content::Points(PointCloud { positions, normals, colour, intensity, sensor, world_from_cloud, crs: None }))
    }
}
