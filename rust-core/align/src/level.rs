//! A scan's surface by so many points: means over the cells of a grid, with normals and borders.

use glam::{DVec3, IVec3};
use rustc_hash::FxHashMap;

use crate::near::Near;
use crate::neighbours::Neighbours;
use crate::tint::{Tint, Tints};

/// Cells around a point within which its neighbours are looked for.
const RING: f64 = 2.2;
/// The largest angle, in radians, between directions to neighbours around a point inside of a surface.
const GAP: f64 = 2.1;

/// Points of a surface about a cell apart.
#[derive(Default)]
pub(crate) struct Level {
    pub cell: f64,
    pub points: Vec<DVec3>,
    /// Unit, outward.
    pub normals: Vec<DVec3>,
    /// Area of the surface that each stands for.
    pub areas: Vec<f64>,
    /// Whether the surface ends here.
    pub is_border: Vec<bool>,
    /// The others, rising.
    inside: Vec<u32>,
    /// How far points lie off the surface, as a standard deviation: by noise, and by what bends between samples.
    pub noise: f64,
    pub near: Near,
    pub tints: Tints,
}

impl Level {
    /// Points and their vector areas, averaged in cells, with their tints, if any. O(n).
    pub fn new(points: &[DVec3], areas: &[DVec3], tints: Option<&[Tint]>, cell: f64) -> Self {
        let (points, areas, tints) = averaged(points, areas, tints, cell);
        let mut level = Level { cell, near: Near::new(&points, cell), ..Level::default() };
        let grid = Neighbours::new(&points, RING * cell);
        let mut near = Vec::new();
        for (k, &here) in points.iter().enumerate() {
            grid.within(here, RING * cell, &mut near);
            let sum: DVec3 = near.iter().map(|&n| areas[n as usize]).sum();
            let normal = sum.normalize_or_zero();
            let around = || near.iter().filter(|&&n| n as usize != k).map(|&n| points[n as usize]);
            level.is_border.push(normal == DVec3::ZERO || ends(here, normal, around()));
            level.normals.push(normal);
            level.areas.push(areas[k].length());
        }
        level.points = points;
        level.inside = (0..level.len() as u32).filter(|&k| !level.is_border[k as usize]).collect();
        level.noise = level.own_distance(&grid);
        if let Some(tints) = tints {
            level.tints = Tints::new(tints, &level.points, &level.normals, cell, &grid);
        }
        level
    }

    /// Root mean square distance of neighbours along the mean of their normals: 0 on spheres and planes, little on what bends
    /// evenly, so that it is noise, and what lies between samples, that remains. By point.
    fn own_distance(&self, grid: &Neighbours) -> f64 {
        let mut near = Vec::new();
        let (mut sum, mut count) = (0.0, 0.0);
        for k in (0..self.len()).filter(|&k| !self.is_border[k]) {
            let (here, normal) = (self.points[k], self.normals[k]);
            grid.within(here, 1.5 * self.cell, &mut near);
            for &n in &near {
                let n = n as usize;
                let cosine = self.normals[n].dot(normal);
                if n != k && cosine > 0.6 {
                    let distance = (self.points[n] - here).dot((self.normals[n] + normal).normalize());
                    sum += distance * distance;
                    count += 1.0;
                }
            }
        }
        if count > 0.0 { (0.5 * sum / count).sqrt() } else { 0.0 }
    }

    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Indices of about `count` of the points inside the surface, spread evenly. Of all where there are fewer.
    pub fn spread(&self, count: usize) -> Vec<u32> {
        let step = (self.inside.len() as f64 / count as f64).max(1.0);
        let picked = (self.inside.len() as f64 / step) as usize;
        (0..picked).map(|k| self.inside[((k as f64 + 0.5) * step) as usize]).collect()
    }
}

/// The distance of surfaces that are the same, as a deviation: as a scan's own neighbours do, of both scans.
pub(crate) fn expected([first, second]: [&Level; 2]) -> f64 {
    first.noise.hypot(second.noise).max(STEADY * first.cell.max(second.cell))
}

/// Scanners' steady errors, which neighbours share, may part surfaces by so many cells: real ones' by 0.12, and different
/// surfaces lie 0.22 apart or more.
const STEADY: f64 = 0.2;

/// Whether directions to the neighbours leave a gap.
fn ends(here: DVec3, normal: DVec3, neighbours: impl Iterator<Item = DVec3>) -> bool {
    let x = normal.any_orthonormal_vector();
    let y = normal.cross(x);
    let mut angles: Vec<f64> = neighbours.map(|there| (there - here).dot(y).atan2((there - here).dot(x))).collect();
    angles.sort_unstable_by(f64::total_cmp);
    let (Some(first), Some(last)) = (angles.first(), angles.last()) else { return true };
    let around = first + std::f64::consts::TAU - last;
    around > GAP || angles.windows(2).any(|pair| pair[1] - pair[0] > GAP)
}

/// Means of points and tints, and sums of vector areas, over the cells of a grid.
fn averaged(
    points: &[DVec3],
    areas: &[DVec3],
    tints: Option<&[Tint]>,
    cell: f64,
) -> (Vec<DVec3>, Vec<DVec3>, Option<Vec<Tint>>) {
    #[derive(Default)]
    struct Sum {
        point: DVec3,
        area: DVec3,
        tint: Tint,
        weight: f64,
    }
    let mut places: FxHashMap<IVec3, u32> = FxHashMap::default();
    let mut sums: Vec<Sum> = Vec::new();
    for (k, (&point, &area)) in points.iter().zip(areas).enumerate() {
        let key = (point / cell).floor().as_ivec3();
        let place = *places.entry(key).or_insert_with(|| {
            sums.push(Sum::default());
            sums.len() as u32 - 1
        });
        let sum = &mut sums[place as usize];
        let share = area.length();
        sum.point += share * point;
        sum.area += area;
        sum.weight += share;
        if let Some(tints) = tints {
            sum.tint += share * tints[k];
        }
    }
    sums.retain(|sum| sum.weight > 0.0 && sum.area.length() > 0.1 * sum.weight);
    (
        sums.iter().map(|sum| sum.point / sum.weight).collect(),
        sums.iter().map(|sum| sum.area).collect(),
        tints.map(|_| sums.iter().map(|sum| sum.tint / sum.weight).collect()),
    )
}
