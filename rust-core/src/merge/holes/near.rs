//! The triangles around each loop, found in one pass over the mesh.
//!
//! A coarse grid over the region of the holes knows which of its cells a hole's surroundings touch. Each vertex gets its
//! cell; a triangle whose vertices span no touched cell, nearly all of them, is done with a look at a bit.

use glam::DVec3;
use rayon::prelude::*;

/// The mesh that has the holes.
#[derive(Clone, Copy)]
pub(super) struct Mesh<'a> {
    pub positions: &'a [DVec3],
    pub triangles: &'a [[u32; 3]],
}

impl Mesh<'_> {
    pub fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|v| self.positions[v as usize])
    }
}

/// A box parallel to the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bounds {
    pub min: DVec3,
    pub max: DVec3,
}

impl Bounds {
    pub const EMPTY: Bounds = Bounds { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    pub fn of(points: impl IntoIterator<Item = DVec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| Bounds { min: b.min.min(p), max: b.max.max(p) })
    }

    pub fn meets(&self, other: &Bounds) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }

    pub fn encloses(&self, other: &Bounds) -> bool {
        self.min.cmple(other.min).all() && other.max.cmple(self.max).all()
    }

    fn grown(self, by: f64) -> Self {
        Bounds { min: self.min - by, max: self.max + by }
    }
}

/// How far beyond the box of its loop a fill may reach, by that box's diagonal: a hemisphere over a circle reaches 0.35.
const MARGIN: f64 = 0.4;

/// The region of which [`gather`] knows all triangles; no fill may leave it.
pub(super) fn region(mesh: Mesh<'_>, hole: &[u32]) -> Bounds {
    let bounds = Bounds::of(hole.iter().map(|&v| mesh.positions[v as usize]));
    bounds.grown(MARGIN * bounds.min.distance(bounds.max))
}

/// Cells along each axis of the coarse grid.
const CELLS: u32 = 64;

/// A hole that touches more cells than this is compared with every triangle instead, and a triangle with every hole.
const MANY_CELLS: u32 = 8192;

/// For each hole the triangles whose boxes meet its region, rising.
pub(super) fn gather(mesh: Mesh<'_>, holes: &[Vec<u32>]) -> Vec<Vec<u32>> {
    let regions: Vec<Bounds> = holes.iter().map(|hole| region(mesh, hole)).collect();
    let grid = Grid::new(&regions);
    let cells: Vec<u32> = mesh.positions.par_iter().with_min_len(4096).map(|&p| grid.cell(p)).collect();
    let found: Vec<Vec<(u32, u32)>> = mesh
        .triangles
        .par_chunks(16384)
        .enumerate()
        .map(|(chunk, triangles)| {
            let (mut found, mut candidates) = (Vec::new(), Vec::new());
            for (i, t) in triangles.iter().enumerate() {
                candidates.clear();
                grid.holes_at(t.map(|v| cells[v as usize]), &mut candidates);
                if !candidates.is_empty() {
                    let bounds = Bounds::of(t.map(|v| mesh.positions[v as usize]));
                    let triangle = (chunk * 16384 + i) as u32;
                    let near = candidates.iter().filter(|&&h| regions[h as usize].meets(&bounds));
                    found.extend(near.map(|&hole| (hole, triangle)));
                }
            }
            found
        })
        .collect();
    let mut near = vec![Vec::new(); holes.len()];
    for (hole, triangle) in found.into_iter().flatten() {
        near[hole as usize].push(triangle);
    }
    near
}

struct Grid {
    min: DVec3,
    cells_per_length: DVec3,
    /// A bit a cell: whether `entries` has it.
    touched: Vec<u64>,
    /// Cells with the holes that touch them, sorted.
    entries: Vec<(u32, u32)>,
    /// Holes that touch too many cells to list.
    large: Vec<u32>,
    holes: u32,
}

impl Grid {
    fn new(regions: &[Bounds]) -> Self {
        let whole = regions.iter().fold(Bounds::EMPTY, |a, b| Bounds { min: a.min.min(b.min), max: a.max.max(b.max) });
        // The outermost cells take all that lies outside; so they belong to no hole.
        let size = (whole.max - whole.min).max(DVec3::splat(f64::MIN_POSITIVE));
        let mut grid = Grid {
            min: whole.min,
            // A little less, so that the upper end of the region stays within the last cell but one.
            cells_per_length: ((f64::from(CELLS - 2) - 1e-6) / size).min(DVec3::splat(f64::MAX)),
            holes: regions.len() as u32,
            touched: vec![0; (CELLS * CELLS * CELLS / 64) as usize],
            entries: Vec::new(),
            large: Vec::new(),
        };
        for (hole, region) in regions.iter().enumerate() {
            let (low, high) = (split(grid.cell(region.min)), split(grid.cell(region.max)));
            if count(low, high) > MANY_CELLS {
                grid.large.push(hole as u32);
            } else {
                cells_between(low, high, |cell| grid.entries.push((cell, hole as u32)));
            }
        }
        grid.entries.sort_unstable();
        for &(cell, _) in &grid.entries {
            grid.touched[(cell / 64) as usize] |= 1 << (cell % 64);
        }
        grid
    }

    /// The cell of a point. Along each axis it never falls where the coordinate rises, so what lies between two points
    /// lies in the cells between theirs.
    fn cell(&self, p: DVec3) -> u32 {
        let scaled = ((p - self.min) * self.cells_per_length).clamp(DVec3::NEG_ONE, DVec3::splat(f64::from(CELLS - 2)));
        let [x, y, z] = scaled.to_array().map(|s| (s + 1.0) as u32);
        x | y << 6 | z << 12
    }

    /// Adds the holes that a triangle with corners in these cells may come near, each once.
    fn holes_at(&self, corners: [u32; 3], holes: &mut Vec<u32>) {
        holes.extend_from_slice(&self.large);
        if corners[0] == corners[1] && corners[0] == corners[2] {
            self.add(corners[0], holes);
            return;
        }
        let [a, b, c] = corners.map(split);
        let low = [0, 1, 2].map(|i| a[i].min(b[i]).min(c[i]));
        let high = [0, 1, 2].map(|i| a[i].max(b[i]).max(c[i]));
        if count(low, high) > MANY_CELLS {
            holes.clear();
            holes.extend(0..self.holes);
            return;
        }
        cells_between(low, high, |cell| self.add(cell, holes));
        if holes.len() > 1 {
            holes.sort_unstable();
            holes.dedup();
        }
    }

    fn add(&self, cell: u32, holes: &mut Vec<u32>) {
        if self.touched[(cell / 64) as usize] >> (cell % 64) & 1 == 1 {
            let first = self.entries.partition_point(|e| e.0 < cell);
            holes.extend(self.entries[first..].iter().take_while(|e| e.0 == cell).map(|e| e.1));
        }
    }
}

fn split(cell: u32) -> [u32; 3] {
    [cell & 63, cell >> 6 & 63, cell >> 12]
}

fn count(low: [u32; 3], high: [u32; 3]) -> u32 {
    (0..3).map(|i| high[i] - low[i] + 1).product()
}

fn cells_between(low: [u32; 3], high: [u32; 3], mut visit: impl FnMut(u32)) {
    for z in low[2]..=high[2] {
        for y in low[1]..=high[1] {
            for x in low[0]..=high[0] {
                visit(x | y << 6 | z << 12);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn finds_what_comparing_all_with_all_finds(
            points in prop::collection::vec([-3.0..3.0_f64, -3.0..3.0, -3.0..3.0], 12..40),
            picks in prop::collection::vec([0..12_u32, 0..12, 0..12], 1..30),
            holes in prop::collection::vec(prop::collection::vec(0..12_u32, 3..5), 1..5),
            scale in prop_oneof![Just(1.0), Just(1e-3), Just(1e9)],
        ) {
            // Small regions among larger triangles: holes shrunk toward the origin.
            let mut positions: Vec<DVec3> = points.iter().map(|&p| DVec3::from(p) * scale).collect();
            positions[..6].iter_mut().for_each(|p| *p *= 0.1);
            let mesh = Mesh { positions: &positions, triangles: &picks };
            let expected: Vec<Vec<u32>> = holes.iter().map(|hole| {
                let region = region(mesh, hole);
                (0..picks.len() as u32).filter(|&t| region.meets(&Bounds::of(mesh.corners(t)))).collect()
            }).collect();
            prop_assert_eq!(gather(mesh, &holes), expected);
        }
    }
}
