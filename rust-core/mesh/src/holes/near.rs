//! The triangles around each loop, found in one pass over the mesh.
//!
//! A coarse grid over the region of the holes knows which of its cells a hole's surroundings touch. Each vertex gets its cell. A triangle
//! whose vertices span no touched cell, nearly all of them, is done with a look at a bit.

use glam::DVec3;
use rayon::prelude::*;

use base::error::Result;
use base::progress::Progress;
use base::work;

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

    /// The region that no fill of a hole leaves.
    pub fn region(&self, hole: &[u32]) -> Bounds {
        region(Bounds::of(hole.iter().map(|&v| self.positions[v as usize])))
    }
}

/// A box parallel to the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Lowest corner.
    pub min: DVec3,
    /// Highest corner.
    pub max: DVec3,
}

impl Bounds {
    const EMPTY: Bounds = Bounds { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// The smallest around some points.
    pub fn of(points: impl IntoIterator<Item = DVec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| Bounds { min: b.min.min(p), max: b.max.max(p) })
    }

    /// Takes a point in.
    pub fn add(&mut self, point: DVec3) {
        (self.min, self.max) = (self.min.min(point), self.max.max(point));
    }

    /// Whether they have a point in common.
    pub fn meets(&self, other: &Bounds) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }

    /// Whether all of another lies in it.
    pub fn encloses(&self, other: &Bounds) -> bool {
        self.min.cmple(other.min).all() && other.max.cmple(self.max).all()
    }

    /// Whether a point lies in it.
    pub fn contains(&self, point: DVec3) -> bool {
        self.encloses(&Bounds { min: point, max: point })
    }

    /// It with more on all sides.
    pub fn grown(self, by: f64) -> Self {
        Bounds { min: self.min - by, max: self.max + by }
    }
}

/// Reach of a fill beyond the box of its loop, by that box's diagonal: a quarter of a sphere's circumference bulges by 0.15, a hemisphere
/// by 0.35.
const MARGIN: f64 = 0.25;

/// The region that no fill of a loop leaves whose box is `bounds`.
pub fn region(bounds: Bounds) -> Bounds {
    bounds.grown(MARGIN * bounds.min.distance(bounds.max))
}

/// For each region the triangles whose boxes meet it, rising.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub(super) fn gather(mesh: Mesh<'_>, regions: &[Bounds], progress: &Progress<'_>) -> Result<Vec<Vec<u32>>> {
    let grid = Grid::new(regions);
    const CHUNK: usize = 16384;
    let mut cells = vec![Cell(0); mesh.positions.len()];
    cells.par_chunks_mut(CHUNK).zip(mesh.positions.par_chunks(CHUNK)).try_for_each(|(cells, positions)| {
        progress.check()?;
        cells.iter_mut().zip(positions).for_each(|(cell, &p)| *cell = grid.cell(p));
        Ok(())
    })?;
    let found: Vec<Vec<(u32, u32)>> = mesh
        .triangles
        .par_chunks(CHUNK)
        .enumerate()
        .map(|(chunk, triangles)| {
            progress.check()?;
            let (mut found, mut candidates) = (Vec::new(), Vec::new());
            for (i, t) in triangles.iter().enumerate() {
                let corners = t.map(|v| cells[v as usize]);
                if grid.is_far(corners) {
                    continue;
                }
                grid.holes_at(corners, &mut candidates);
                if !candidates.is_empty() {
                    candidates.iter().for_each(|_| work::step());
                    let bounds = Bounds::of(t.map(|v| mesh.positions[v as usize]));
                    let triangle = (chunk * CHUNK + i) as u32;
                    let near = candidates.iter().filter(|&&h| regions[h as usize].meets(&bounds));
                    found.extend(near.map(|&hole| (hole, triangle)));
                }
            }
            Ok(found)
        })
        .collect::<Result<_>>()?;
    let mut near = vec![Vec::new(); regions.len()];
    for (hole, triangle) in found.into_iter().flatten() {
        near[hole as usize].push(triangle);
    }
    Ok(near)
}

/// Cells along each axis of the coarse grid.
const CELLS: u32 = 128;

/// Cells along each axis that the mean hole touches at most.
const CELLS_A_HOLE: u32 = 16;

/// A hole that touches more cells than this is compared with every triangle instead, and a triangle with every hole.
const MANY_CELLS: u32 = 8192;

/// A cell: its places along x, y and z in fields of ten bits, and on top whether it is [`Cell::NEAR`].
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Cell(u32);

impl Cell {
    /// A touched cell is at most one place away along each axis.
    const NEAR: u32 = 1 << 31;

    const ONE_EACH: u32 = 1 | 1 << 10 | 1 << 20;

    fn at([x, y, z]: [u32; 3]) -> Self {
        Cell(x | y << 10 | z << 20)
    }

    fn places(self) -> [u32; 3] {
        [self.0 & 127, self.0 >> 10 & 127, self.0 >> 20 & 127]
    }

    /// Whether `other` is at most one place away along each axis. All three at once: a bit above each field keeps it from
    /// borrowing from the next.
    fn is_beside(self, other: Cell) -> bool {
        let guard = Cell::ONE_EACH << 8;
        let ahead = ((other.0 & !Cell::NEAR) + guard + Cell::ONE_EACH).wrapping_sub(self.0 & !Cell::NEAR);
        // Each field must be the guard with 0, 1 or 2: no higher bit, and not both low ones.
        ((ahead ^ guard) & (Cell::ONE_EACH * 0x3fc)) | (ahead & ahead >> 1 & Cell::ONE_EACH) == 0
    }
}

/// A bit for each cell.
struct CellSet(Vec<u64>);

impl CellSet {
    fn new() -> Self {
        CellSet(vec![0; (CELLS * CELLS * CELLS / 64) as usize])
    }

    fn place(cell: Cell) -> (usize, u32) {
        let [x, y, z] = cell.places();
        ((x >> 6 | y << 1 | z << 8) as usize, x & 63)
    }

    fn insert(&mut self, cell: Cell) {
        let (word, bit) = Self::place(cell);
        self.0[word] |= 1 << bit;
    }

    fn contains(&self, cell: Cell) -> bool {
        let (word, bit) = Self::place(cell);
        self.0[word] >> bit & 1 == 1
    }
}

struct Grid {
    min: DVec3,
    cells_per_length: DVec3,
    /// Cells that a hole touches.
    touched: CellSet,
    /// Those and the cells around them.
    near: CellSet,
    /// Number of touched cells before each word of `touched`.
    rank: Vec<u32>,
    /// First hole of each touched cell in `holes_in`.
    start: Vec<u32>,
    holes_in: Vec<u32>,
    /// Holes that touch too many cells to list.
    large: Vec<u32>,
    holes: u32,
}

impl Grid {
    fn new(regions: &[Bounds]) -> Self {
        let whole = regions.iter().fold(Bounds::EMPTY, |a, b| Bounds { min: a.min.min(b.min), max: a.max.max(b.max) });
        // The outermost cells take all that lies outside; the holes' own are 1 to CELLS - 2.
        let size = (whole.max - whole.min).max(DVec3::splat(f64::MIN_POSITIVE));
        // Or each hole in a wall would touch all the cells through it.
        let finest =
            f64::from(CELLS_A_HOLE) * regions.len() as f64 / regions.iter().map(|r| r.max - r.min).sum::<DVec3>();
        let mut grid = Grid {
            min: whole.min,
            cells_per_length: (f64::from(CELLS - 3) / size).min(finest).min(DVec3::splat(f64::MAX)),
            touched: CellSet::new(),
            near: CellSet::new(),
            rank: Vec::new(),
            start: Vec::new(),
            holes_in: Vec::new(),
            large: Vec::new(),
            holes: regions.len() as u32,
        };
        let mut entries = Vec::new();
        for (hole, region) in regions.iter().enumerate() {
            let (low, high) = (grid.cell(region.min).places(), grid.cell(region.max).places());
            if count(low, high) > MANY_CELLS {
                grid.large.push(hole as u32);
            } else {
                cells_between(low, high, |cell| {
                    work::step();
                    entries.push((cell, hole as u32));
                });
            }
        }
        // Cells in the order of their bits in a set.
        entries.sort_unstable();
        for group in entries.chunk_by(|a, b| a.0 == b.0) {
            grid.start.push(grid.holes_in.len() as u32);
            grid.holes_in.extend(group.iter().map(|entry| entry.1));
            grid.touched.insert(group[0].0);
            let places = group[0].0.places();
            let low = places.map(|p| p.saturating_sub(1));
            let high = places.map(|p| (p + 1).min(CELLS - 1));
            cells_between(low, high, |cell| grid.near.insert(cell));
        }
        grid.start.push(grid.holes_in.len() as u32);
        let mut before = 0;
        grid.rank.extend(grid.touched.0.iter().map(|word| {
            before += word.count_ones();
            before - word.count_ones()
        }));
        grid
    }

    /// The holes that touch a cell.
    fn holes_in(&self, cell: Cell) -> &[u32] {
        let (word, bit) = CellSet::place(cell);
        let bits = self.touched.0[word];
        if bits >> bit & 1 == 0 {
            return &[];
        }
        let group = (self.rank[word] + (bits & ((1 << bit) - 1)).count_ones()) as usize;
        &self.holes_in[self.start[group] as usize..self.start[group + 1] as usize]
    }

    /// The cell of a point. Along each axis it never falls where the coordinate rises, so what lies between two points
    /// lies in the cells between theirs.
    fn cell(&self, p: DVec3) -> Cell {
        // Adding 2^52 leaves the nearest whole number in the lowest bits: faster than a conversion that minds the range.
        const WHOLE: f64 = (1_u64 << 52) as f64;
        let place = |p: f64, min: f64, scale: f64| {
            let place = ((p - min) * scale + 1.0).max(0.0).min(f64::from(CELLS - 1));
            (place + WHOLE).to_bits() as u32
        };
        let (min, scale) = (self.min, self.cells_per_length);
        let cell = Cell::at([place(p.x, min.x, scale.x), place(p.y, min.y, scale.y), place(p.z, min.z, scale.z)]);
        if self.near.contains(cell) { Cell(cell.0 | Cell::NEAR) } else { cell }
    }

    /// Whether a triangle with corners in these cells surely touches none that a hole does: it spans few cells and its
    /// corners are far from all holes.
    fn is_far(&self, [a, b, c]: [Cell; 3]) -> bool {
        (a.0 | b.0 | c.0) & Cell::NEAR == 0 && a.is_beside(b) && a.is_beside(c) && self.large.is_empty()
    }

    /// The holes that a triangle with corners in these cells may come near, each once.
    fn holes_at(&self, corners: [Cell; 3], holes: &mut Vec<u32>) {
        holes.clear();
        holes.extend_from_slice(&self.large);
        if corners[0] == corners[1] && corners[0] == corners[2] {
            holes.extend_from_slice(self.holes_in(corners[0]));
            return;
        }
        let [a, b, c] = corners.map(Cell::places);
        let low = [0, 1, 2].map(|i| a[i].min(b[i]).min(c[i]));
        let high = [0, 1, 2].map(|i| a[i].max(b[i]).max(c[i]));
        if count(low, high) > MANY_CELLS {
            holes.clear();
            holes.extend(0..self.holes);
            return;
        }
        cells_between(low, high, |cell| holes.extend_from_slice(self.holes_in(cell)));
        if holes.len() > 1 {
            holes.sort_unstable();
            holes.dedup();
        }
    }
}

fn count(low: [u32; 3], high: [u32; 3]) -> u32 {
    (0..3).map(|i| high[i] - low[i] + 1).product()
}

fn cells_between(low: [u32; 3], high: [u32; 3], mut visit: impl FnMut(Cell)) {
    for z in low[2]..=high[2] {
        for y in low[1]..=high[1] {
            for x in low[0]..=high[0] {
                visit(Cell::at([x, y, z]));
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
            let regions: Vec<Bounds> = holes.iter().map(|hole| mesh.region(hole)).collect();
            let expected: Vec<Vec<u32>> = regions.iter().map(|region| {
                (0..picks.len() as u32).filter(|&t| region.meets(&Bounds::of(mesh.corners(t)))).collect()
            }).collect();
            prop_assert_eq!(gather(mesh, &regions, &Progress::none()).unwrap(), expected);
        }
    }
}
