//! Memory that a merge will take, found out before it is taken: a cell a thousand times too small, a slip of the unit, would
//! otherwise end the host.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use glam::{DMat3, DVec3};
use rustc_hash::FxHashMap;

use crate::crossings::lattice::BRICK;
use base::error::{Error, Result, Shown};
use base::memory::{self, size};
use image::source::OrientedSurface;

/// Bytes a crossing takes at the peak, with its share of the surface: of scans that overlap, some of whose crossings become
/// one, and of one alone. Measured.
const BYTES_A_CROSSING: [f64; 2] = [63.0, 73.0];
/// Bytes a brick with a part of the surface takes.
const BYTES_A_BRICK: f64 = 59.5e3;
/// Additional bytes of a merge whose scans are kept for another: of a crossing, and of a brick. Measured.
const KEPT: [f64; 2] = [28.0, 30e3];
/// Bytes that the surface alone takes at least, by crossing of the scan that has most: a vertex, the triangles at it.
const BYTES_A_VERTEX: f64 = 50.0;
/// Bytes of it, by crossing, that are held between two merges. No more than that.
const HELD: f64 = 100.0;
/// Crossings of a brick that count: more are of the same edges, and added up. Ten times what a plane has. Of a hundred frames of a room
/// with a Kinect's noise 1.35 times the peak is foreseen with it.
const CROSSINGS_A_BRICK: f32 = 20e3;

/// Words for what decides.
const FREE: &str = "free";
const ALLOWED: &str = "allowed";

/// Scans that weren't seen when memory was used up make it so many times as much, at most.
const UNSEEN: f64 = 3.0;

/// Memory that the scans will take, as far as they are counted: one after the other in their order, whichever of them are loaded first. So
/// decisions follow from the scans and from the memory that is allowed.
pub struct Budget {
    /// Size of a cell.
    pub voxel: f64,
    /// Scans there are.
    scans: usize,
    /// Bytes that decide, and whether they are `given`, only `allowed` or, where neither is said, `free`. Infinite if the system does not
    /// say.
    available: (f64, &'static str),
    /// Bytes that are free, where they do not decide: a merge that needs more is refused.
    free: f64,
    /// Scans that are kept for another merge.
    keeping: Option<Keeping>,
    counting: Mutex<Counting>,
}

/// Memory for what is to be kept for another merge.
#[derive(Clone, Copy)]
struct Keeping {
    /// Bytes that are held already of what is foreseen.
    held: f64,
    /// Whether a merge that keeps nothing has to fit as well: else it would choose other cells.
    as_fresh: bool,
}

/// The scans as far as they are counted.
#[derive(Default)]
struct Counting {
    seen: Seen,
    /// The first that is not counted yet ...
    next: usize,
    /// ... and those after it that were loaded before. `None` for those without a triangle.
    waiting: BTreeMap<usize, Option<Arc<Foreseen>>>,
    refusal: Option<Refusal>,
}

/// A scan that does not fit beside those before it.
#[derive(Clone, Copy)]
struct Refusal {
    scan: usize,
    /// Bytes that it needs with those before it, and those there are.
    needed: f64,
    available: (f64, &'static str),
    /// A cell that will fit.
    fits: f64,
    /// Whether all merges of these scans are refused that are allowed as much.
    is_for_all: bool,
}

/// Estimate for a scan in cells of one size.
#[derive(Default)]
pub struct Foreseen {
    /// Bricks with the middle of a triangle, and the crossings of their triangles, each brick once.
    bricks: Vec<([i64; 3], f64)>,
    /// Crossings of large triangles, and how many bricks these reach.
    of_large: [f64; 2],
    /// All crossings.
    crossings: f64,
}

/// The estimated content of the grid.
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
}

impl Seen {
    fn bytes(&self, are_kept: bool) -> f64 {
        let [a_crossing, a_brick] = if are_kept { KEPT } else { [0.0; 2] };
        (BYTES_A_CROSSING[usize::from(self.scans == 1)] + a_crossing) * self.crossings
            + (BYTES_A_BRICK + a_brick) * (self.bricks.len() as f64 + self.more_bricks)
    }

    fn add(&mut self, scan: &Foreseen) {
        self.scans += 1;
        for &(brick, crossings) in &scan.bricks {
            let known = self.bricks.entry(brick).or_default();
            let counted = crossings.min(f64::from(CROSSINGS_A_BRICK - *known));
            *known += counted as f32;
            self.crossings += counted;
        }
        let [crossings, bricks] = scan.of_large;
        self.crossings += crossings;
        self.more_bricks += bricks;
        self.most_crossings = self.most_crossings.max(scan.crossings);
    }
}

impl Foreseen {
    /// About how many lines of the grid meet the surface: along each axis as many as its shadow has cells. Also the bricks it lies in.
    /// Bricks that take more than `most` bytes are not listed but counted, so that the list is small beside them.
    fn of(surface: &OrientedSurface, voxel: f64, most: f64) -> Self {
        let cells_from_surface = surface.world_from_surface.matrix3 * voxel.recip();
        let side = f64::from(BRICK);
        let mut found = Foreseen::default();
        let mut bricks: FxHashMap<[i64; 3], f64> = FxHashMap::default();
        let mut put = |of_large: &mut [f64; 2], brick: [i64; 3], crossings: f64| {
            if crossings == 0.0 {
                return;
            }
            if let Some(known) = bricks.get_mut(&brick) {
                *known += crossings;
            } else if BYTES_A_BRICK * bricks.len() as f64 <= most {
                bricks.insert(brick, crossings);
            } else {
                of_large[0] += crossings;
                of_large[1] += crossings / (side * side);
            }
        };
        let mut last = ([0; 3], 0.0);
        for t in &surface.triangles {
            let corners = t.map(|v| surface.positions[v as usize]);
            let crossings = crossings_of(corners, &cells_from_surface);
            found.crossings += crossings;
            if crossings > side * side {
                found.of_large[0] += crossings;
                found.of_large[1] += crossings / (side * side);
                continue;
            }
            let [a, b, c] = corners;
            let middle = surface.world_from_surface.transform_point3((a + b + c) / 3.0) / (voxel * side);
            let brick = middle.floor().to_array().map(|x| x as i64);
            // Neighbouring triangles mostly lie in one.
            if brick != last.0 {
                put(&mut found.of_large, last.0, last.1);
                last = (brick, 0.0);
            }
            last.1 += crossings;
        }
        put(&mut found.of_large, last.0, last.1);
        found.bricks = bricks.into_iter().collect();
        found
    }

    /// Bytes that it takes at least, whichever scans are beside it.
    fn least(&self) -> f64 {
        let counted = |crossings: f64| crossings.min(f64::from(CROSSINGS_A_BRICK));
        let crossings: f64 = self.bricks.iter().map(|brick| counted(brick.1)).sum();
        let [of_large, more_bricks] = self.of_large;
        BYTES_A_CROSSING[0] * (crossings + of_large) + BYTES_A_BRICK * (self.bricks.len() as f64 + more_bricks)
    }
}

/// About how many lines meet a triangle.
fn crossings_of([a, b, c]: [DVec3; 3], cells_from_surface: &DMat3) -> f64 {
    let doubled = (*cells_from_surface * (b - a)).cross(*cells_from_surface * (c - a)).abs();
    0.5 * (doubled.x + doubled.y + doubled.z)
}

/// About how many lines of a grid of such cells meet a surface.
pub fn crossings(surface: &OrientedSurface, voxel: f64) -> f64 {
    let cells_from_surface = surface.world_from_surface.matrix3 * voxel.recip();
    let corners = |t: &[u32; 3]| t.map(|v| surface.positions[v as usize]);
    surface.triangles.iter().map(|t| crossings_of(corners(t), &cells_from_surface)).sum()
}

impl Budget {
    /// For a grid of cells of size `voxel`, within `most` bytes and what is allowed. If neither is said, within what is free now.
    pub fn new(voxel: f64, scans: usize, most: f64) -> Self {
        // Memory that loaded scans take is given back before the peak.
        let (there, known) = memory::available();
        let there = there + memory::taken();
        let allowed = memory::limit_of_calls().map_or(f64::INFINITY, |bytes| bytes as f64);
        let free = if known == FREE { there } else { f64::INFINITY };
        let available = match most.min(allowed) {
            f64::INFINITY => (free, FREE),
            bytes if most < allowed => (bytes, "given"),
            bytes => (bytes, ALLOWED),
        };
        Budget { scans, free, ..Self::within(voxel, available) }
    }

    fn within(voxel: f64, available: (f64, &'static str)) -> Self {
        Budget { voxel, scans: 1, available, free: f64::INFINITY, keeping: None, counting: Mutex::default() }
    }

    fn counting(&self) -> MutexGuard<'_, Counting> {
        self.counting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A cell that will fit, where one of this size does not for any merge of these scans that is allowed as much.
    pub fn fits(&self) -> Option<f64> {
        self.counting().refusal.filter(|refusal| refusal.is_for_all).map(|refusal| refusal.fits)
    }

    /// Whether a cell of this size does not fit, and all that speaks against the surface's fitting alone is unknown.
    pub fn leaves_room_for_the_surface(&self) -> bool {
        let Counting { seen, refusal, .. } = &*self.counting();
        refusal.is_some() && BYTES_A_VERTEX * seen.most_crossings <= self.available.0.min(self.free)
    }

    /// Begins anew for scans that are kept for another merge, of which so many crossings are kept already. `as_fresh` where those fit alone
    /// that fit if nothing is kept.
    pub fn begin_keeping(&mut self, crossings: u64, as_fresh: bool) {
        self.keeping = Some(Keeping { held: HELD * crossings as f64, as_fresh });
        *self.counting() = Counting::default();
    }

    /// Takes a scan into account of which this was foreseen. `None` for one without a triangle.
    pub fn know(&self, scan: usize, foreseen: Option<Arc<Foreseen>>) {
        let counting = &mut *self.counting();
        if counting.refusal.is_some() || scan < counting.next {
            return;
        }
        counting.waiting.insert(scan, foreseen);
        while counting.refusal.is_none()
            && let Some(foreseen) = counting.waiting.remove(&counting.next)
        {
            counting.next += 1;
            if let Some(foreseen) = foreseen {
                counting.seen.add(&foreseen);
                counting.refusal = self.refusal(&counting.seen, counting.next - 1);
            }
        }
    }

    /// Whether what was seen up to this scan does not fit.
    fn refusal(&self, seen: &Seen, scan: usize) -> Option<Refusal> {
        let held = self.keeping.map_or(0.0, |keeping| keeping.held);
        let (bytes, known) = self.available;
        let bound = if known == FREE { bytes + held } else { bytes };
        // Half of what there is. Scans that weren't seen yet overlap with those that were, or don't.
        let unseen = (self.scans as f64 / seen.scans as f64).clamp(1.0, UNSEEN);
        let beyond = |needed: f64, available: f64, known, is_for_all| {
            let fits = 1.05 * self.voxel * (2.0 * unseen * needed / available).sqrt();
            (needed > available).then_some(Refusal { scan, needed, available: (available, known), fits, is_for_all })
        };
        let (fresh, kept) = (seen.bytes(false), seen.bytes(true));
        memory::note(if self.keeping.is_some() { kept } else { fresh });
        match self.keeping {
            None => beyond(fresh, bound, known, true).or_else(|| beyond(fresh, self.free, FREE, false)),
            Some(keeping) => {
                let as_fresh = if keeping.as_fresh { beyond(fresh, bound, known, false) } else { None };
                as_fresh.or_else(|| beyond(kept, self.free.min(bytes) + held, known, false))
            }
        }
    }

    /// Takes a scan into account: what is foreseen of it.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] if it and those before it will need more than there is, with a voxel that fits: once all those are counted,
    /// as [`Self::refused`] says.
    pub fn expect(&self, scan: usize, surface: &OrientedSurface) -> Result<Arc<Foreseen>> {
        let foreseen = Arc::new(Foreseen::of(surface, self.voxel, self.most()));
        self.know(scan, Some(foreseen.clone()));
        let counting = self.counting();
        if let Some(refusal) = counting.refusal.filter(|refusal| refusal.scan <= scan) {
            return Err(self.error(&refusal));
        }
        // Those before it that are not counted yet only add to what it needs.
        let mut alone = Seen::default();
        if scan >= counting.next && counting.refusal.is_none() && foreseen.least() > self.most() {
            alone.add(&foreseen);
            if let Some(refusal) = self.refusal(&alone, scan) {
                return Err(self.error(&refusal));
            }
        }
        Ok(foreseen)
    }

    /// Bytes beyond which nothing fits, whatever is kept.
    fn most(&self) -> f64 {
        self.available.0.min(self.free) + self.keeping.map_or(0.0, |keeping| keeping.held)
    }

    /// The first scan that does not fit beside those before it, and the error of that.
    pub fn refused(&self) -> Option<(usize, Error)> {
        let refusal = self.counting().refusal?;
        Some((refusal.scan, self.error(&refusal)))
    }

    fn error(&self, refusal: &Refusal) -> Error {
        if !refusal.needed.is_finite() {
            return Error::input("a scan is too large to be counted in cells: check the scale of its pose");
        }
        let (available, there) = refusal.available;
        // In two digits rounded up.
        Error::OutOfMemory(format!(
            "a voxel of {} (in the unit of the scans) needs {} or more, {} are {there}: choose a voxel of {}, which fits",
            Shown(self.voxel),
            size(refusal.needed),
            size(available),
            Shown::digits(refusal.fits, 2)
        ))
    }
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;

    use super::*;
    use crate::crossings::bundles::Buckets;
    use crate::crossings::discretize::discretize;
    use crate::crossings::lattice::Lattice;
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
                seen.add(&Foreseen::of(&sphere(), voxel, f64::INFINITY));
                seen.crossings
            });
            assert!((found / foreseen - 1.0).abs() < 0.3 * voxel, "{found} {foreseen}");
        }
    }

    #[test]
    fn what_is_foreseen_follows_the_surface_however_many_scans_there_are() {
        let bytes = |scans: usize| {
            let mut seen = Seen::default();
            (0..scans).for_each(|_| seen.add(&Foreseen::of(&sphere(), 0.1, f64::INFINITY)));
            seen.bytes(false)
        };
        let [few, many, more] = [2, 400, 800].map(bytes);
        assert!(many > 5.0 * few && more == many, "{few} {many} {more}");
    }

    #[test]
    fn what_is_refused_follows_from_the_scans_whichever_are_loaded_first() {
        let scans: Vec<OrientedSurface> = (0..6)
            .map(|i| {
                let pose =
                    DAffine3::from_translation(DVec3::X * 0.7 * f64::from(i)) * DAffine3::from_rotation_y(f64::from(i));
                let shape = Shape::Sphere { radius: 1.0 + 0.2 * f64::from(i * i % 4) };
                OrientedSurface::from_mesh(&shape.mesh(6 + i as usize), pose).unwrap()
            })
            .collect();
        let told = |available: f64, are_kept: bool, order: &[usize], known: &[usize]| {
            let mut budget = Budget { scans: 9, ..Budget::within(0.1, (available, ALLOWED)) };
            if are_kept {
                budget.begin_keeping(0, true);
            }
            let foreseen = |&scan: &usize| (scan, Some(Arc::new(Foreseen::of(&scans[scan], 0.1, f64::INFINITY))));
            known.iter().map(foreseen).for_each(|(scan, foreseen)| budget.know(scan, foreseen));
            budget.know(6, None);
            let refused = |&&scan: &&usize| budget.expect(scan, &scans[scan]).is_err();
            let of: Vec<usize> = order.iter().filter(refused).copied().collect();
            let (scan, error) = budget.refused()?;
            // A scan that is refused before all scans before it are known is refused by itself.
            assert!(of.iter().all(|&refused| refused >= scan), "{of:?} {scan}");
            Some((scan, error.to_string(), budget.counting().refusal.map(|refusal| refusal.fits.to_bits())))
        };
        let mut all = Seen::default();
        scans.iter().for_each(|scan| all.add(&Foreseen::of(scan, 0.1, f64::INFINITY)));
        let orders =
            [[0, 1, 2, 3, 4, 5], [5, 4, 3, 2, 1, 0], [1, 0, 3, 2, 5, 4], [2, 5, 0, 4, 1, 3], [4, 0, 5, 1, 2, 3]];
        for share in [1.01, 0.99, 0.8, 0.6, 0.4, 0.2, 0.05] {
            let of = |are_kept: bool| share * all.bytes(are_kept);
            let expected = told(of(false), false, &orders[0], &[]);
            assert_eq!(expected.is_some(), share < 1.0);
            assert!(orders.iter().all(|order| told(of(false), false, order, &[]) == expected), "{share}");
            let expected = told(of(true), true, &orders[0], &[]);
            assert_eq!(expected.is_some(), share < 1.0);
            for (order, known) in [([3, 1, 5, 0], [4, 2]), ([0, 3, 4, 5], [1, 2])] {
                assert_eq!(told(of(true), true, &order, &known), expected, "{share}");
            }
        }
    }

    #[test]
    fn what_does_not_fit_is_refused_with_a_voxel_that_does() {
        let budget = Budget::within(0.1, (1e7, "free"));
        let text = (0..).map(|scan| budget.expect(scan, &sphere())).find_map(Result::err).unwrap().to_string();
        assert!(budget.refused().unwrap().0 > 0);
        let voxel = text
            .strip_prefix("not enough memory: a voxel of 0.1 (in the unit of the scans) needs 10 MB or more, 10 MB are free: choose a voxel of ")
            .and_then(|rest| rest.strip_suffix(", which fits"))
            .unwrap_or_else(|| panic!("{text}"));
        let mut one = Seen::default();
        one.add(&Foreseen::of(&sphere(), 0.1, f64::INFINITY));
        let scans = (1e7 / one.bytes(false)) as usize + 1;
        let budget = Budget::within(voxel.parse().unwrap(), (1e7, "free"));
        (0..scans).for_each(|scan| assert!(budget.expect(scan, &sphere()).is_ok()));
        let text = Budget::within(1e-9, (1e9, "free")).expect(0, &sphere()).err().unwrap().to_string();
        assert!(text.contains(" GB or more, 1000 MB are free"), "{text}");
    }
}
