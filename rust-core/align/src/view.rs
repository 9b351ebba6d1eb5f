//! A scan made ready to be aligned: its surface by few points and by more, what looks like what, what its sensor saw through.

use std::hash::Hasher as _;
use std::sync::OnceLock;

use glam::{DAffine3, DVec3};
use rustc_hash::FxHasher;

use crate::envelope::walls;
use crate::features::Features;
use crate::level::Level;
use crate::tint::tints;
use crate::visibility::DepthMap;
use base::error::{Error, Result};
use base::magnitude;
use base::progress::Progress;
use image::oriented::OrientedPoints;
use image::range_image::is_rigid;
use image::source::ScanSource;

/// Points of a scan's finer level.
const FINE: f64 = 8000.0;
/// Points of the coarser level of the median scan.
const COARSE: f64 = 2500.0;
/// Cells are as wide as it takes for points to be off by so many of them.
const QUIET: f64 = 0.15;
/// Finest cell in distances between samples.
const FINEST: f64 = 1.2;

/// Points of a scan, fewer than it has. Frames are the scan's own, moved so that the middle of its points is the origin.
pub(crate) struct Reduced {
    /// Place of the middle in the scan's own frame.
    pub middle: DVec3,
    pub world_from_scan: DAffine3,
    pub spacing: f64,
    /// Area of the whole surface.
    pub area: f64,
    /// Largest distance of a point from the middle.
    pub radius: f64,
    /// The box of the points.
    pub bounds: [DVec3; 2],
    /// The same for the same samples.
    pub content: u64,
    /// Whether its tints are colours. Else they are intensities, if there are any.
    pub has_chroma: bool,
    /// Damage of its files, after its name.
    pub damage: Option<String>,
    /// The place of its sensor, in the scan's own frame.
    pub eye: Option<DVec3>,
    /// Direction of up, where its sensor measured gravity.
    pub up: Option<DVec3>,
    fine: Level,
    depth_map: Option<DepthMap>,
}

impl Reduced {
    /// Reads a scan. O(samples). Of these nothing is kept.
    ///
    /// # Errors
    /// Errors of reading. Cancelled.
    pub fn read(source: &dyn ScanSource, progress: &Progress<'_>) -> Result<Self> {
        let OrientedPoints { mut positions, areas, viewing, spacing, world_from_points, colour, intensity } =
            source.oriented_points(progress)?;
        let tints = tints(colour.as_deref(), intensity.as_deref());
        if !is_rigid(&world_from_points) {
            return Err(Error::input(format!(
                "scan {:?} is scaled, sheared or mirrored by its pose: apply its scale first, since alignment turns and shifts only",
                source.name()
            )));
        }
        magnitude::place(&format!("the place of scan {:?}", source.name()), world_from_points.translation)?;
        let mut hasher = FxHasher::default();
        hasher.write(bytemuck::cast_slice(&positions));
        hasher.write(bytemuck::cast_slice(&areas));
        hasher.write(bytemuck::cast_slice(colour.as_deref().unwrap_or_default()));
        let area: f64 = areas.iter().map(|a| a.length()).sum();
        let middle = positions.iter().sum::<DVec3>() / positions.len().max(1) as f64;
        positions.iter_mut().for_each(|p| *p -= middle);
        let eye = match viewing {
            Some(image::range_image::Viewing::From(eye)) => Some(eye),
            _ => None,
        };
        let viewing = viewing.map(|viewing| match viewing {
            image::range_image::Viewing::From(eye) => image::range_image::Viewing::From(eye - middle),
            parallel => parallel,
        });
        progress.check()?;
        let cell = (area / FINE).sqrt().max(FINEST * spacing);
        let mut fine =
            if area > 0.0 { Level::new(&positions, &areas, tints.as_deref(), cell) } else { Level::default() };
        // Means over cells twice as wide are off by half as much, in cells by a quarter.
        let wider = (fine.noise / (QUIET * cell)).sqrt();
        if wider > 1.2 {
            fine = Level::new(&positions, &areas, tints.as_deref(), wider.min(3.0) * cell);
        }
        Ok(Reduced {
            middle,
            eye,
            up: source.up(),
            world_from_scan: world_from_points,
            spacing,
            area,
            radius: positions.iter().map(|p| p.length()).fold(0.0, f64::max),
            bounds: positions.iter().fold([DVec3::ZERO; 2], |[lo, hi], p| [lo.min(*p), hi.max(*p)]),
            content: hasher.finish(),
            has_chroma: colour.is_some(),
            damage: source.damage(),
            depth_map: DepthMap::new(&positions, &areas, spacing, viewing),
            fine,
        })
    }
}

impl Reduced {
    /// The pose of the scan as it is given.
    pub fn world_from_local(&self) -> DAffine3 {
        self.world_from_scan * DAffine3::from_translation(self.middle)
    }
}

/// The cell that gives the median scan [`COARSE`] points.
pub(crate) fn coarse_cell<'r>(scans: impl Iterator<Item = &'r Reduced>) -> f64 {
    let mut cells: Vec<f64> = scans.filter(|s| s.area > 0.0).map(|s| (s.area / COARSE).sqrt()).collect();
    cells.sort_by(f64::total_cmp);
    cells.get(cells.len() / 2).copied().unwrap_or(0.0)
}

/// A scan of a room shows more than this share of walls: 100 frames of a virtual room 0.61 and more, 40 scans of three sculptures 0.11
/// and less.
const WALLED: f64 = 0.3;
/// Walls whose mean normal is longer than this are one.
const FLAT: f64 = 0.95;

pub(crate) struct View {
    pub reduced: Reduced,
    pub coarse: Level,
    /// Descriptions of its points. Found when first asked for.
    features: OnceLock<Features>,
    /// Whether each point of the finer level is of a wall. Found when first asked for.
    walls: OnceLock<Vec<bool>>,
    is_of_room: OnceLock<bool>,
    /// Motions that lay the scan on itself. Found when first asked for.
    pub symmetries: OnceLock<Vec<DAffine3>>,
    /// Descriptions by colours. Found when first asked for.
    pub colour_features: OnceLock<Features>,
}

impl View {
    pub fn new(reduced: Reduced, cell: f64) -> Self {
        let cell = cell.max(reduced.fine.cell);
        let fine = &reduced.fine;
        let areas: Vec<DVec3> = fine.normals.iter().zip(&fine.areas).map(|(&n, &a)| n * a).collect();
        let tints = (!fine.tints.is_empty()).then_some(&fine.tints.values[..]);
        let coarse = Level::new(&fine.points, &areas, tints, cell);
        let [features, colour_features] = [OnceLock::new(), OnceLock::new()];
        View {
            reduced,
            coarse,
            features,
            walls: OnceLock::new(),
            is_of_room: OnceLock::new(),
            symmetries: OnceLock::new(),
            colour_features,
        }
    }

    pub fn fine(&self) -> &Level {
        &self.reduced.fine
    }

    pub fn features(&self) -> &Features {
        self.features.get_or_init(|| Features::new(&self.coarse))
    }

    pub fn walls(&self) -> &[bool] {
        self.walls.get_or_init(|| walls(self.fine()))
    }

    /// Whether it shows a room from inside: walls, more than one.
    pub fn is_of_room(&self) -> bool {
        *self.is_of_room.get_or_init(|| {
            let normals =
                self.walls().iter().zip(&self.fine().normals).filter(|(is_wall, _)| **is_wall).map(|(_, n)| n);
            let (count, sum) = normals.fold((0.0, DVec3::ZERO), |(count, sum), normal| (count + 1.0, sum + *normal));
            count > WALLED * self.fine().len() as f64 && sum.length() < FLAT * count
        })
    }

    pub fn depth_map(&self) -> Option<&DepthMap> {
        self.reduced.depth_map.as_ref()
    }

    /// Whether there is any surface to go by.
    pub fn is_empty(&self) -> bool {
        self.coarse.len() == 0
    }
}
