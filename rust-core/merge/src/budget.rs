//! Memory that a merge will take, found out before it is taken: a cell a thousand times too small, a slip of the unit, would
//! otherwise end the host.

use std::sync::{Mutex, PoisonError};

use glam::{DMat3, DVec3};
use rustc_hash::FxHashMap;

use super::lattice::BRICK;
use base::error::{Error, Result, Shown};
use base::memory::{self, size};
use image::source::OrientedSurface;

/// Bytes a crossing takes at the peak, with its share of the surface: of scans that overlap, some of whose crossings become
/// one, and of one alone. Measured.
const BYTES_A_CROSSING: [f64; 2] = [63.0, 73.0];
/// Bytes a brick with a part of the surface takes.
const BYTES_A_BRICK: f64 = 59.5e3;
/// How much more a merge takes whose scans are kept for another: of a crossing, and of a brick. Measured.
const KEPT: [f64; 2] = [28.0, 30e3];
/// Bytes that the surface alone takes at least, by crossing of the scan that has most: a vertex, the triangles at it.
const BYTES_A_VERTEX: f64 = 50.0;
/// Bytes of it, by crossing, that are held between two merges; no more than that.
const HELD: f64 = 100.0;
/// Crossings of a brick that count: more are of the same edges, and added up. Ten times what a plane has; of a hundred frames
/// of a room with a Kinect's noise 1.35 times the peak is foreseen with it.
const CROSSINGS_A_BRICK: f32 = 20e3;

/// Scans that weren't seen when memory was used up make it so many times as much, at most.
const UNSEEN: f64 = 3.0;

/// What the scans seen so far will take.
pub(super) struct Budget {
    /// Size of a cell.
    pub(super) voxel: f64,
    /// Scans there are.
    scans: usize,
    /// Bytes that there are, and whether they are `free` or only `allowed` or `given`; infinite where the system does not say.
    available: (f64, &'static str),
    /// Bytes that are held already of what is foreseen, where scans are kept for another merge.
    kept: Option<f64>,
    seen: Mutex<Seen>,
}

/// What the grid will hold.
#[derive(Default)]
struct Seen {
    crossings: f64,
    /// Those of the scan that has most.
    most_crossings: f64,
    scans: usize,
    /// Bricks with the middle of a triangle and the crossings of their triangles as far as they count, and how many more large
    /// triangles reach.
    bricks: FxHashMap<[i64; 3], f32>,
    more_bricks: f64,
    /// A cell that fits, where one is too small.
    fits: Option<f64>,
}

impl Seen {
    fn bytes(&self, are_kept: bool) -> f64 {
        let [a_crossing, a_brick] = if are_kept { KEPT } else { [0.0; 2] };
        (BYTES_A_CROSSING[usize::from(self.scans == 1)] + a_crossing) * self.crossings
            + (BYTES_A_BRICK + a_brick) * (self.bricks.len() as f64 + self.more_bricks)
    }

    /// About how many lines of the grid meet the surface: along each axis as many as its shadow has cells; and which bricks
    /// it lies in.
    fn add(&mut self, surface: &OrientedSurface, voxel: f64) {
        let cells_from_surface = surface.world_from_surface.matrix3 * voxel.recip();
        let brick = f64::from(BRICK);
        let (mut last, mut of_brick, mut of_scan) = ([i64::MIN; 3], 0.0, 0.0);
        self.scans += 1;
        for t in &surface.triangles {
            let corners = t.map(|v| surface.positions[v as usize]);
            let crossings = crossings_of(corners, &cells_from_surface);
            of_scan += crossings;
            let [a, b, c] = corners;
            let middle = surface.world_from_surface.transform_point3((a + b + c) / 3.0) / (voxel * brick);
            let key = middle.floor().to_array().map(|x| x as i64);
            if key != last {
                self.put(last, of_brick);
                (last, of_brick) = (key, 0.0);
            }
            if crossings <= brick * brick {
                of_brick += crossings;
            } else {
                self.crossings += crossings;
                self.more_bricks += crossings / (brick * brick);
            }
        }
        self.put(last, of_brick);
        self.most_crossings = self.most_crossings.max(of_scan);
    }

    /// Adds crossings of a brick, as far as they count.
    fn put(&mut self, brick: [i64; 3], crossings: f64) {
        if brick[0] != i64::MIN {
            let known = self.bricks.entry(brick).or_default();
            let counted = crossings.min(f64::from(CROSSINGS_A_BRICK - *known));
            *known += counted as f32;
            self.crossings += counted;
        }
    }
}

/// About how many lines meet a triangle.
fn crossings_of([a, b, c]: [DVec3; 3], cells_from_surface: &DMat3) -> f64 {
    let doubled = (*cells_from_surface * (b - a)).cross(*cells_from_surface * (c - a)).abs();
    0.5 * (doubled.x + doubled.y + doubled.z)
}

/// About how many lines of a grid of such cells meet a surface.
pub(super) fn crossings(surface: &OrientedSurface, voxel: f64) -> f64 {
    let cells_from_surface = surface.world_from_surface.matrix3 * voxel.recip();
    let corners = |t: &[u32; 3]| t.map(|v| surface.positions[v as usize]);
    surface.triangles.iter().map(|t| crossings_of(corners(t), &cells_from_surface)).sum()
}

impl Budget {
    /// For a grid of cells of size `voxel`, within the memory that is free now, and `most` bytes.
    pub(super) fn new(voxel: f64, scans: usize, most: f64) -> Self {
        // What the scans that are loaded take is given back before the peak.
        let (available, there) = memory::available();
        let available = available + memory::taken();
        Budget { scans, ..Self::within(voxel, if most < available { (most, "given") } else { (available, there) }) }
    }

    fn within(voxel: f64, available: (f64, &'static str)) -> Self {
        Budget { voxel, scans: 1, available, kept: None, seen: Mutex::default() }
    }

    /// A cell that will fit, where one of this size does not.
    pub(super) fn fits(&self) -> Option<f64> {
        self.seen.lock().unwrap_or_else(PoisonError::into_inner).fits
    }

    /// Whether a cell of this size does not fit, and all that speaks against the surface's fitting alone is unknown.
    pub(super) fn leaves_room_for_the_surface(&self) -> bool {
        let seen = self.seen.lock().unwrap_or_else(PoisonError::into_inner);
        seen.fits.is_some() && BYTES_A_VERTEX * seen.most_crossings <= self.available.0
    }

    /// Begins anew for scans that are kept for another merge, of which so many crossings are kept already.
    pub(super) fn begin_keeping(&mut self, crossings: u64) {
        self.kept = Some(HELD * crossings as f64);
        let seen = self.seen.get_mut().unwrap_or_else(PoisonError::into_inner);
        *seen = Seen { fits: seen.fits, ..Seen::default() };
    }

    /// Takes a scan into account that has so many crossings in each of these bricks, by world.
    pub(super) fn know(&self, bricks: impl Iterator<Item = ([i64; 3], f64)>) {
        let mut seen = self.seen.lock().unwrap_or_else(PoisonError::into_inner);
        seen.scans += 1;
        bricks.for_each(|(brick, crossings)| seen.put(brick, crossings));
    }

    /// Takes a scan into account.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] if it and those before it will need more than there is, with a voxel that fits.
    pub(super) fn expect(&self, surface: &OrientedSurface) -> Result<()> {
        let mut seen = self.seen.lock().unwrap_or_else(PoisonError::into_inner);
        seen.add(surface, self.voxel);
        let needed = seen.bytes(self.kept.is_some());
        memory::note(needed);
        let (available, there) = self.available;
        let available = available + self.kept.unwrap_or(0.0);
        if needed <= available {
            return Ok(());
        }
        if !needed.is_finite() {
            return Err(Error::input("a scan is too large to be counted in cells: check the scale of its pose"));
        }
        // Half of what there is, in two digits rounded up. Scans that weren't seen yet overlap with those that were, or don't.
        let unseen = (self.scans as f64 / seen.scans as f64).clamp(1.0, UNSEEN);
        let fits = 1.05 * self.voxel * (2.0 * unseen * needed / available).sqrt();
        seen.fits = Some(seen.fits.unwrap_or(0.0).max(fits));
        Err(Error::OutOfMemory(format!(
            "a voxel of {} (in the unit of the scans) needs {} or more, {} are {there}; a voxel of {} fits",
            Shown(self.voxel),
            size(needed),
            size(available),
            Shown::digits(fits, 2)
        )))
    }
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;

    use super::super::bundles::Buckets;
    use super::super::discretize::discretize;
    use super::super::lattice::Lattice;
    use super::*;
    use base::progress::Progress;
    use mesh::shapes::Shape;

    fn sphere() -> OrientedSurface {
        let pose = DAffine3::from_rotation_x(0.3) * DAffine3::from_scale(DVec3::splat(2.0));
        OrientedSurface::from_mesh(&Shape::Sphere { radius: 1.0 }.mesh(12), pose).unwrap()
    }

    #[test]
    fn crossings_are_foreseen() {
        for voxel in [0.3, 0.1, 0.02] {
            let mut buckets = Buckets::default();
            let lattice = Lattice { voxel, base: [0; 3] };
            discretize(&sphere(), "sphere", 0, &lattice, &mut buckets, &Progress::none()).unwrap();
            let (found, foreseen) = (buckets.len as f64, {
                let mut seen = Seen::default();
                seen.add(&sphere(), voxel);
                seen.crossings
            });
            assert!((found / foreseen - 1.0).abs() < 0.3 * voxel, "{found} {foreseen}");
        }
    }

    #[test]
    fn what_is_foreseen_follows_the_surface_however_many_scans_there_are() {
        let bytes = |scans: usize| {
            let mut seen = Seen::default();
            (0..scans).for_each(|_| seen.add(&sphere(), 0.1));
            seen.bytes(false)
        };
        let [few, many, more] = [2, 400, 800].map(bytes);
        assert!(many > 5.0 * few && more == many, "{few} {many} {more}");
    }

    #[test]
    fn what_does_not_fit_is_refused_with_a_voxel_that_does() {
        let budget = Budget::within(0.1, (1e7, "free"));
        budget.expect(&sphere()).unwrap();
        let text = std::iter::repeat_with(|| budget.expect(&sphere())).find_map(Result::err).unwrap().to_string();
        let voxel = text
            .strip_prefix("not enough memory: a voxel of 0.1 (in the unit of the scans) needs 10 MB or more, 10 MB are free; a voxel of ")
            .and_then(|rest| rest.strip_suffix(" fits"))
            .unwrap_or_else(|| panic!("{text}"));
        let mut one = Seen::default();
        one.add(&sphere(), 0.1);
        let scans = (1e7 / one.bytes(false)) as usize + 1;
        let budget = Budget::within(voxel.parse().unwrap(), (1e7, "free"));
        (0..scans).for_each(|_| budget.expect(&sphere()).unwrap());
        let text = Budget::within(1e-9, (1e9, "free")).expect(&sphere()).unwrap_err().to_string();
        assert!(text.contains(" GB or more, 1000 MB are free"), "{text}");
    }
}
