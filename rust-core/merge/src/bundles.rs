//! Storage of the intersections: lists by bundle, a row of bricks along one axis.

use rustc_hash::FxHashMap;

use super::lattice::{BRICK, BRICK_BITS};

/// An intersection of a scan, or of fused scans, with a line of the grid. [MI04, sec. 3.1]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Crossing {
    /// Line within the bundle (bits 0 to 9), flags of the paper's fusing (10, 11), number of the scan (from 12 on).
    packed: u32,
    /// Cell along the line.
    pub cell: i32,
    /// Place within the cell, 0 to 1; with `cell` the paper's `ic`.
    pub fraction: f32,
    /// Component of the surface's unit normal along the line, the paper's `dr`: negative where the line enters the object.
    pub normal: f32,
    /// Trust in the sample, the paper's `w`.
    pub weight: f32,
    /// Colour, sRGB with straight alpha.
    pub colour: [u8; 4],
    /// How much further along the normal the surface lies, without the bias of smoothing, in units of 1 / 4096 cell.
    residual: i16,
    /// Standard deviation of the samples here, in units of 1 / 32 cell; 0: clean.
    deviation: u8,
    /// Half the distance along the line to the next crossing of the other sign, below and above, in quarters of a cell; 15
    /// is far.
    room: u8,
}

const LINE_MASK: u32 = (1 << (2 * BRICK_BITS)) - 1;
#[cfg(any(test, feature = "reference"))]
const FLAG_BELOW: u32 = 1 << (2 * BRICK_BITS);
#[cfg(any(test, feature = "reference"))]
const FLAG_ABOVE: u32 = FLAG_BELOW << 1;
const RESIDUAL_UNITS: f64 = 4096.0;
const DEVIATION_UNITS: f64 = 32.0;
const ROOM_UNITS: f64 = 4.0;
const ROOM_FAR: u8 = 15;
const SCAN_SHIFT: u32 = 2 * BRICK_BITS + 2;

/// Largest number of scans: what the crossing's number has room for.
pub const MAX_SCANS: usize = 1 << (32 - SCAN_SHIFT);

impl Crossing {
    /// A crossing of scan `scan` with line `line` of its bundle.
    #[inline]
    pub fn new(line: u32, scan: u32, cell: i32, fraction: f32, normal: f32, weight: f32, colour: [u8; 4]) -> Self {
        let packed = line | scan << SCAN_SHIFT;
        Crossing { packed, cell, fraction, normal, weight, colour, ..Crossing::default() }
    }

    /// Notes what noise does to it: where the surface lies further along the normal, and the standard deviation of the
    /// samples, both in cells.
    pub fn set_noise(&mut self, residual: f64, deviation: f64) {
        let (least, most) = (i16::MIN.into(), i16::MAX.into());
        self.residual = (residual * RESIDUAL_UNITS).round().clamp(least, most) as i16;
        self.deviation = (deviation * DEVIATION_UNITS).round().clamp(0.0, u8::MAX.into()) as u8;
    }

    /// How much further along the normal the surface lies, in cells.
    #[inline]
    pub fn residual(&self) -> f64 {
        f64::from(self.residual) / RESIDUAL_UNITS
    }

    /// Standard deviation of the samples here, in cells; 0: clean.
    #[inline]
    pub fn deviation(&self) -> f64 {
        f64::from(self.deviation) / DEVIATION_UNITS
    }

    /// Whether its samples are no noisier than what a crossing tells.
    #[inline]
    pub fn is_clean(&self) -> bool {
        self.deviation == 0
    }

    /// Notes how far, in cells, crossings of the other sign lie below and above it on the line.
    pub fn set_room(&mut self, below: f64, above: f64) {
        let quarters = |distance: f64| (0.5 * distance * ROOM_UNITS).min(ROOM_FAR.into()) as u8;
        self.room = quarters(below) | quarters(above) << 4;
    }

    /// How far, in cells, it may speak of nodes below or above: half way to the next crossing of the other sign.
    #[inline]
    pub fn room(&self, above: bool) -> f64 {
        let quarters = if above { self.room >> 4 } else { self.room & ROOM_FAR };
        if quarters == ROOM_FAR { f64::INFINITY } else { f64::from(quarters) / ROOM_UNITS }
    }

    /// Line within the bundle.
    #[inline]
    pub fn line(&self) -> usize {
        (self.packed & LINE_MASK) as usize
    }

    /// Number of the scan; for a fused crossing that of the scan of largest weight.
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

const CHUNK: usize = 256;

/// The crossings of one worker, by bundle, in chunks of fixed size: growing copies nothing.
#[derive(Default)]
pub struct Buckets {
    index: FxHashMap<BundleKey, u32>,
    lists: Vec<Vec<Vec<Crossing>>>,
    /// Last bundle of each axis: neighbouring triangles mostly stay in it.
    last: [Option<(BundleKey, u32)>; 3],
    /// Number of crossings held.
    pub len: u64,
}

impl Buckets {
    /// Adds a crossing with the line `(u, v)` along `axis`.
    #[inline]
    pub fn push(&mut self, axis: usize, u: i32, v: i32, make: impl FnOnce(u32) -> Crossing) {
        let key = BundleKey { axis: axis as u8, across: [u >> BRICK_BITS, v >> BRICK_BITS] };
        let list = match self.last[axis] {
            Some((last, list)) if last == key => list,
            _ => self.find(key),
        };
        let line = ((v & (BRICK - 1)) << BRICK_BITS | (u & (BRICK - 1))) as u32;
        let chunks = &mut self.lists[list as usize];
        match chunks.last_mut() {
            Some(chunk) if chunk.len() < CHUNK => chunk.push(make(line)),
            _ => {
                let mut chunk = Vec::with_capacity(CHUNK);
                chunk.push(make(line));
                chunks.push(chunk);
            }
        }
        self.len += 1;
    }

    #[cold]
    fn find(&mut self, key: BundleKey) -> u32 {
        let list = *self.index.entry(key).or_insert_with(|| {
            self.lists.push(Vec::new());
            self.lists.len() as u32 - 1
        });
        self.last[key.axis as usize] = Some((key, list));
        list
    }
}

/// The crossings of one bundle, as several workers found them: in no particular order.
pub struct RawBundle {
    /// Which row of bricks.
    pub key: BundleKey,
    /// The crossings in pieces.
    pub chunks: Vec<Vec<Crossing>>,
}

/// Joins the workers' crossings into bundles, ordered by key.
pub fn gather(workers: Vec<Buckets>) -> Vec<RawBundle> {
    let mut all: Vec<RawBundle> = Vec::new();
    for mut worker in workers {
        for (key, list) in worker.index {
            all.push(RawBundle { key, chunks: std::mem::take(&mut worker.lists[list as usize]) });
        }
    }
    all.sort_by_key(|b| b.key);
    all.dedup_by(|later, first| {
        later.key == first.key && {
            first.chunks.append(&mut later.chunks);
            true
        }
    });
    all
}
