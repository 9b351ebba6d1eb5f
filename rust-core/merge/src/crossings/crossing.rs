//! An intersection of a scan with a line of the grid, and where lines are: in bundles, rows of bricks along one axis.

use bytemuck::{Pod, Zeroable};

use super::lattice::BRICK_BITS;

/// An intersection of a scan, or of fused scans, with a line of the grid. [MI04, sec. 3.1]
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Crossing {
    /// Line within the bundle (bits 0 to 9), flags of the paper's fusing (10, 11), number of the scan ([`super::scan_order`], from 12 on).
    packed: u32,
    /// Cell along the line.
    pub cell: i32,
    /// Place within the cell, 0 to 1. With `cell` the paper's `ic`.
    pub fraction: f32,
    /// Component of the surface's unit normal along the line, the paper's `dr`: negative where the line enters the object.
    pub normal: f32,
    /// Trust in the sample, the paper's `w`.
    pub weight: f32,
    /// Colour, sRGB with straight alpha: 0 where the scan has none.
    pub colour: [u8; 4],
    /// Distance by which the surface lies further along the normal, without the bias of smoothing, in units of 1 / 4096 cell.
    residual: i16,
    /// Standard deviation of the samples here, in units of 1 / 1024 cell. 0: clean.
    deviation: u16,
}

pub const LINE_MASK: u32 = (1 << (2 * BRICK_BITS)) - 1;
#[cfg(any(test, feature = "reference"))]
const FLAG_BELOW: u32 = 1 << (2 * BRICK_BITS);
#[cfg(any(test, feature = "reference"))]
const FLAG_ABOVE: u32 = FLAG_BELOW << 1;
const RESIDUAL_UNITS: f64 = 4096.0;
const SCAN_SHIFT: u32 = 2 * BRICK_BITS + 2;

/// Largest number of scans: what the crossing's number has room for.
pub const MAX_SCANS: usize = 1 << (32 - SCAN_SHIFT);

impl Crossing {
    /// Deviations of samples are kept in units of so much of a cell.
    pub const DEVIATION_UNITS: f64 = 1024.0;

    /// A crossing of scan `scan` with line `line` of its bundle.
    #[inline]
    pub fn new(line: u32, scan: u32, cell: i32, fraction: f32, normal: f32, weight: f32, colour: [u8; 4]) -> Self {
        let packed = line | scan << SCAN_SHIFT;
        Crossing { packed, cell, fraction, normal, weight, colour, ..Crossing::default() }
    }

    /// The same of a scan of another number.
    pub fn of_scan(mut self, scan: u32) -> Self {
        self.packed = self.packed & ((1 << SCAN_SHIFT) - 1) | scan << SCAN_SHIFT;
        self
    }

    /// Notes what noise does to it: where the surface lies further along the normal, and the standard deviation of the
    /// samples, both in cells.
    pub fn set_noise(&mut self, residual: f64, deviation: f64) {
        let (least, most) = (i16::MIN.into(), i16::MAX.into());
        self.residual = (residual * RESIDUAL_UNITS).round().clamp(least, most) as i16;
        self.deviation = (deviation * Self::DEVIATION_UNITS).round().clamp(0.0, u16::MAX.into()) as u16;
    }

    /// Distance by which the surface lies further along the normal, in cells.
    #[inline]
    pub fn residual(&self) -> f64 {
        f64::from(self.residual) / RESIDUAL_UNITS
    }

    /// Standard deviation of the samples here, in cells. 0: clean.
    #[inline]
    pub fn deviation(&self) -> f64 {
        f64::from(self.deviation) / Self::DEVIATION_UNITS
    }

    /// The same in its units.
    pub fn deviation_units(&self) -> u16 {
        self.deviation
    }

    /// Whether its samples are no noisier than what a crossing tells.
    #[inline]
    pub fn is_clean(&self) -> bool {
        self.deviation == 0
    }

    /// Line within the bundle.
    #[inline]
    pub fn line(&self) -> usize {
        (self.packed & LINE_MASK) as usize
    }

    /// Number of the scan. For a fused crossing that of the scan of largest weight.
    #[inline]
    pub fn scan(&self) -> u32 {
        self.packed >> SCAN_SHIFT
    }

    /// Whether a walk along the line enters the object here, the paper's `+`.
    #[inline]
    pub fn enters(&self) -> bool {
        self.normal < 0.0
    }
}

#[cfg(any(test, feature = "reference"))]
impl Crossing {
    /// Notes that another crossing of the line lies in the next cell below (`above` = false) or above.
    pub fn set_neighbour(&mut self, above: bool) {
        self.packed |= if above { FLAG_ABOVE } else { FLAG_BELOW };
    }

    /// Whether another crossing of the line lies in the next cell below or above.
    #[inline]
    pub fn has_neighbour(&self, above: bool) -> bool {
        self.packed & if above { FLAG_ABOVE } else { FLAG_BELOW } != 0
    }
}

/// A row of bricks: the axis of its lines, and its brick coordinates along the two axes across.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct BundleKey {
    /// Axis of the lines.
    pub axis: u8,
    /// Brick coordinates along `ACROSS[axis]`.
    pub across: [i32; 2],
}

/// Something on an edge of the grid.
pub trait OnLine: Copy {
    /// Line within its bundle.
    fn line(&self) -> usize;
    /// Cell along the line.
    fn cell(&self) -> i32;
}

impl OnLine for Crossing {
    fn line(&self) -> usize {
        self.line()
    }

    fn cell(&self) -> i32 {
        self.cell
    }
}
