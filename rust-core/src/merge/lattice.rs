//! The grid: lines along x, y and z through the nodes `(i, j, k) * voxel`, and its partition into bricks.
//!
//! Scans are brought to fixed-point coordinates of the grid, [`FRACTION_BITS`] bits a cell. From there on every decision
//! (which line meets which triangle, in which cell) is made in integers, so it is exact and consistent. The rounding is
//! at most 2^-21 of a cell, below the resolution of the scans' own single-precision coordinates.
//!
//! A **brick** is a cube of 32^3 nodes with the edges that start there and the cells whose lowest corner lies there: one
//! bit a node fills 32 x 32 words. A **bundle** is a row of bricks along one axis: 32 x 32 whole lines.

use glam::{DAffine3, DVec3};

use crate::error::{Error, Result};

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
const MAX_NODE: f64 = 1.0e9;

/// The grid. Node coordinates count from `base`, a node of the world's grid near the scans: a shift of integers, which
/// changes no result, keeps georeferenced scans exact in 32 bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    /// Size of a cell in world units.
    pub voxel: f64,
    /// World node from which node coordinates count.
    pub base: [i64; 3],
}

impl Lattice {
    /// A grid whose base lies near `near`.
    ///
    /// # Errors
    /// `near` is so far from the world's origin that its cell can't be counted in 53 bits.
    pub fn new(voxel: f64, near: DVec3) -> Result<Self> {
        let cell = near / voxel;
        if !cell.is_finite() || cell.abs().max_element() > (1_u64 << 52) as f64 {
            return Err(Error::input(format!(
                "a scan lies at {near}, more than 2^52 cells of {voxel} from the origin: choose a larger voxel or move the scans"
            )));
        }
        Ok(Lattice { voxel, base: cell.round().to_array().map(|c| c as i64) })
    }

    /// World position of a place on the grid, `cell + fraction` along each axis.
    pub fn world(&self, node: [i32; 3], axis: usize, fraction: f64) -> DVec3 {
        let mut at = [0, 1, 2].map(|i| (self.base[i] + i64::from(node[i])) as f64);
        at[axis] += fraction;
        DVec3::from_array(at) * self.voxel
    }

    /// Fixed-point grid coordinates of `positions`, placed in the world by `world_from_surface`.
    ///
    /// # Errors
    /// A coordinate is not finite, or too far from the other scans to be counted in cells.
    pub fn snap(&self, positions: &[DVec3], world_from_surface: &DAffine3, name: &str) -> Result<Vec<[i64; 3]>> {
        let grid_from_surface = DAffine3 {
            matrix3: world_from_surface.matrix3 * (1.0 / self.voxel),
            translation: world_from_surface.translation / self.voxel,
        };
        let base = DVec3::from_array(self.base.map(|b| b as f64));
        let mut largest = DVec3::ZERO;
        let snapped = positions
            .iter()
            .map(|&p| {
                let cell = grid_from_surface.transform_point3(p) - base;
                // NaN must not pass unseen: `max` would drop it.
                largest = DVec3::select(cell.abs().cmple(largest), largest, cell.abs());
                (cell * CELL as f64).round().to_array().map(|c| c as i64)
            })
            .collect();
        if largest.to_array().iter().all(|&c| c < MAX_NODE) {
            return Ok(snapped);
        }
        let worst = positions.iter().position(|&p| {
            let cell = grid_from_surface.transform_point3(p) - base;
            !cell.to_array().iter().all(|c| c.abs() < MAX_NODE)
        });
        let worst = worst.unwrap_or(0);
        Err(Error::input(format!(
            "{name}: vertex {worst} lies at {}, which is not finite or more than {MAX_NODE:e} cells of {} from the first scan: choose a larger voxel or check the scan's pose",
            world_from_surface.transform_point3(positions[worst]),
            self.voxel
        )))
    }
}

/// Index of a row of nodes within its brick.
#[inline]
pub fn row(y: i32, z: i32) -> usize {
    (((z & (BRICK - 1)) << BRICK_BITS) | (y & (BRICK - 1))) as usize
}
