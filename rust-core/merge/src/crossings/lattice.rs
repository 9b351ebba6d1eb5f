//! The grid: lines along x, y and z through the nodes `(i, j, k) * voxel`, and its partition into bricks.
//!
//! Scans are brought to fixed-point coordinates of the grid, [`FRACTION_BITS`] bits per cell. From there on every decision (which line
//! meets which triangle, in which cell) is made in integers, so it is exact and consistent. The rounding is at most 2^-21 of a cell, below
//! the resolution of the scans' own single-precision coordinates.
//!
//! A **brick** is a cube of 32^3 nodes with the edges that start there and the cells whose lowest corner lies there: one bit per node fills
//! 32 x 32 words. A **bundle** is a row of bricks along one axis: 32 x 32 whole lines.

use glam::{DAffine3, DVec3};

use base::error::{Error, Result, Shown};

/// Bits after the point of a fixed-point coordinate.
pub const FRACTION_BITS: u32 = 20;
/// One cell in fixed-point units.
pub const CELL: i64 = 1 << FRACTION_BITS;
/// Nodes along each side of a brick, as a power of two.
pub const BRICK_BITS: u32 = 5;
/// Nodes along each side of a brick.
pub const BRICK: i32 = 1 << BRICK_BITS;
/// Rows of 32 nodes in a brick.
pub const ROWS: usize = 1 << (2 * BRICK_BITS);

/// The two other axes of each axis, in the order that keeps the frame right-handed.
pub const ACROSS: [[usize; 2]; 3] = [[1, 2], [2, 0], [0, 1]];

/// Node coordinates must stay within plus or minus this, so that sums of neighbours fit an `i32`.
const MAX_NODE: i64 = 1_000_000_000;

/// Cells from the world's origin must stay below this, so that fixed-point coordinates fit an `i64`.
const MAX_WORLD_CELL: f64 = (1_u64 << 42) as f64;

/// Nodes between two places for a base, as a power of two: so many that scans of one object nearly always share one, so few
/// that the reach of [`MAX_NODE`] hardly suffers.
const BASE_BITS: u32 = 24;

/// The grid. Node coordinates count from `base`, a node of the world's grid near the scans: so georeferenced scans fit 32
/// bits. Whole bricks lie between two bases and world coordinates are rounded before the base is subtracted, so which
/// base it is changes no result, but what lies within reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    /// Size of a cell in world units.
    pub voxel: f64,
    /// World node from which node coordinates count: a corner of a brick.
    pub base: [i64; 3],
}

impl Lattice {
    /// A grid whose base is the place for one that is nearest to `near`. Bricks are counted from the world node `corner`, which changes no
    /// result but the order of its vertices and triangles.
    ///
    /// # Errors
    /// `near` is too far from the world's origin, counted in cells.
    pub fn new(voxel: f64, near: DVec3, corner: [i64; 3]) -> Result<Self> {
        let cell = near / voxel;
        if !cell.is_finite() || cell.abs().max_element() >= MAX_WORLD_CELL {
            return Err(Error::input(format!(
                "a scan lies at {}, more than 2^42 cells of {} from the origin: choose a larger voxel or move the scans",
                place(near),
                Shown(voxel)
            )));
        }
        let half = 1 << (BASE_BITS - 1);
        let base = |i: usize| ((cell[i] as i64 - corner[i] + half) >> BASE_BITS << BASE_BITS) + corner[i];
        Ok(Lattice { voxel, base: [base(0), base(1), base(2)] })
    }

    /// World position of a place on the grid, `cell + fraction` along each axis.
    #[inline]
    pub fn world(&self, node: [i32; 3], axis: usize, fraction: f64) -> DVec3 {
        let mut at = [0.0; 3];
        for i in 0..3 {
            at[i] = (self.base[i] + i64::from(node[i])) as f64;
        }
        at[axis] += fraction;
        DVec3::from_array(at) * self.voxel
    }

    /// Fixed-point grid coordinates of `positions`, placed in the world by `world_from_surface`.
    ///
    /// # Errors
    /// A coordinate is not finite, or too far from the other scans to be counted in cells.
    pub fn snap(&self, positions: &[DVec3], world_from_surface: &DAffine3, name: &str) -> Result<Vec<[i64; 3]>> {
        let units_from_surface = DAffine3 {
            matrix3: world_from_surface.matrix3 * (CELL as f64 / self.voxel),
            translation: world_from_surface.translation * (CELL as f64 / self.voxel),
        };
        let base = self.base.map(|b| b << FRACTION_BITS);
        let mut outside = false;
        let snapped = positions
            .iter()
            .map(|&p| {
                let units = units_from_surface.transform_point3(p);
                let mut snapped = [0; 3];
                for i in 0..3 {
                    snapped[i] = round(units[i]).saturating_sub(base[i]);
                    outside |= is_outside(units[i], snapped[i]);
                }
                snapped
            })
            .collect();
        if !outside {
            return Ok(snapped);
        }
        let bad = |p: &DVec3| {
            let units = units_from_surface.transform_point3(*p);
            (0..3).any(|i| is_outside(units[i], round(units[i]).saturating_sub(base[i])))
        };
        let worst = positions.iter().position(bad).unwrap_or(0);
        Err(Error::input(format!(
            "{name}: vertex {worst} lies at {}. It is not finite, or too far from the other scans or the origin to \
                be counted in cells of {}. Choose a larger voxel or check the scan's pose.",
            place(world_from_surface.transform_point3(positions[worst])),
            Shown(self.voxel)
        )))
    }
}

fn place(at: DVec3) -> String {
    format!("({}, {}, {})", Shown(at.x), Shown(at.y), Shown(at.z))
}

/// Whether a coordinate, in fixed-point units of the world and of the grid, is not finite or too far away.
#[inline]
fn is_outside(world: f64, grid: i64) -> bool {
    !world.is_finite()
        || world.abs() >= MAX_WORLD_CELL * CELL as f64
        || grid.unsigned_abs() > (MAX_NODE as u64) << FRACTION_BITS
}

/// The nearest integer, halves to even. Adding 1.5 * 2^52 leaves no bits after the point; if the sum would round further, it takes the
/// slower way.
#[inline]
fn round(x: f64) -> i64 {
    const SHIFT: f64 = 6_755_399_441_055_744.0;
    if x.abs() < 1.0e15 { ((x + SHIFT) - SHIFT) as i64 } else { x.round_ties_even() as i64 }
}

/// Index of a row of nodes within its brick.
#[inline]
pub fn row(y: i32, z: i32) -> usize {
    (((z & (BRICK - 1)) << BRICK_BITS) | (y & (BRICK - 1))) as usize
}
