//! What is said of an alignment.

use glam::{DAffine3, DVec3};

use crate::constraints::Axis;
use crate::judge::Hold;
use base::error::Shown;

/// Result of [`run`](crate::run).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Alignment {
    /// The pose of each scan, in the order given; `None` for those that aren't placed. All are rigid. A fixed scan's is its
    /// own to the bit, as is that of the largest scan where none is fixed, and those of scans that stay undecided.
    pub world_from_scan: Vec<Option<DAffine3>>,
    /// What was found.
    pub report: AlignReport,
}

base::choices! {
    /// What became of a scan.
    pub enum ScanState {
        /// It has no place: the reason says why.
        Unplaced = "unplaced" "Not placed",
        /// Its pose was found.
        Placed = "placed" "Placed",
        /// Its pose is as given: the caller fixed it, or it is the frame of the others.
        Kept = "kept" "Kept",
        /// It was joined with others, but nothing joins these with the first group.
        Apart = "apart" "In a group of its own",
        /// Its pose is as given: that was rough, and nothing decides where it belongs. The reason says why.
        Undecided = "undecided" "Undecided, as given",
    }
}

base::choices! {
    /// What became of a pair of scans.
    pub enum PairState {
        /// No motion was found that lays one on the other.
        Nothing = "nothing" "No match",
        /// They overlap and fit, where they lie in the end.
        Fits = "fits" "Fits",
        /// They overlap where they lie in the end, but surfaces lie further apart than noise explains: warp, or something moved.
        Misfit = "misfit" "Does not fit exactly",
        /// They fit, but may turn or slide on each other: not used.
        Slides = "slides" "May turn or slide",
        /// They fit in several places: not used.
        Ambiguous = "ambiguous" "Fits in several places",
        /// What they share stood still before the sensor while the rest moved: not used.
        Background = "background" "Background",
        /// They fit by themselves, but other scans' sensors saw through there: not used.
        SeenThrough = "seen_through" "Seen through",
        /// They fit by themselves, but other pairs, that fit better, rough poses or the order of a recording say otherwise: not used.
        Disagrees = "disagrees" "Disagrees with others",
        /// The caller rejected it.
        Rejected = "rejected" "Rejected",
    }
}

/// A way that a scan may move without leaving the surfaces it lies on: a turn about an axis, or a slide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Freedom {
    /// Whether it is a turn.
    pub turns: bool,
    /// Unit direction of the axis, or of the slide, in the world.
    pub direction: DVec3,
    /// A point of the axis, in the world.
    pub point: DVec3,
}

/// What was found of a scan.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AlignedScan {
    /// Its name.
    pub name: String,
    /// What became of it.
    pub state: ScanState,
    /// Number of its group: 0 is the one that is placed. `None` where it is joined with none.
    pub group: Option<usize>,
    /// Its pose in its group: of the first group the result; scans of others lie together where the largest of them was given.
    pub world_from_scan: Option<DAffine3>,
    /// Covariance of a small motion of it in the world: turn about `middle` (radians), then shift. Zero for scans that are kept.
    pub covariance: [[f64; 6]; 6],
    /// What it turns about there: the middle of its points, in the world.
    pub middle: DVec3,
    /// One standard deviation of the place of its points: the largest over the scan. At least its size where nothing holds it; infinite
    /// where it has no place.
    pub deviation: f64,
    /// Ways that nothing holds it.
    pub free: Vec<Freedom>,
    /// Share of its surface that lies on the scan that shares most with it.
    pub overlap: f64,
    /// Root mean square distance to the surfaces of others, along normals; 0 where there are none.
    pub residual: f64,
    /// Root mean square of how far it lies from the others where noise is averaged out: what no rigid pose explains, such as warp.
    /// Bending within a few samples counts as well, so that some of it is always there.
    pub misfit: f64,
    /// Median distance of its samples.
    pub spacing: f64,
    /// Why it is not placed, or stays undecided, and what to do; empty if it is placed.
    pub reason: String,
}

/// What was found of two scans.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AlignedPair {
    /// Their numbers, the smaller first.
    pub scans: [usize; 2],
    /// What became of the pair.
    pub state: PairState,
    /// Share of either surface that lies on the other.
    pub overlap: [f64; 2],
    /// Root mean square distance of the surfaces where they touch, along normals.
    pub residual: f64,
    /// How well it is held against turning and sliding: 1 at best, 0 where it may.
    pub balance: f64,
    /// Of what the sensors can tell, the share that speaks against it.
    pub seen_through: f64,
    /// Places in which one fits the other.
    pub places: usize,
    /// Ways that it may turn or slide.
    pub free: Vec<Freedom>,
}

/// What was found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AlignReport {
    /// Each scan, in the order given.
    pub scans: Vec<AlignedScan>,
    /// The pairs of which anything was found, by their numbers.
    pub pairs: Vec<AlignedPair>,
    /// Numbers of the scans of each group, the placed one first; only scans that are joined with others, or kept.
    pub groups: Vec<Vec<usize>>,
    /// Pairs that were compared.
    pub compared: usize,
    /// Root mean square distance of the surfaces of all pairs that touch, along normals; `None` where none do.
    pub residual: Option<f64>,
    /// The turntable, where there was one and it was found.
    pub turntable: Option<TurntableFound>,
    /// What the user should know, a sentence each.
    pub messages: Vec<String>,
}

/// A turntable as it was found.
#[derive(Clone, Debug, PartialEq)]
pub struct TurntableFound {
    /// Its axis, in the frame that the scans were taken in; the direction is of length 1.
    pub axis: Axis,
    /// By how much it was turned at each scan, in radians from 0 to 2 pi, counter-clockwise where the axis points to the viewer; 0
    /// at the first scan that is placed. `None` for scans that aren't.
    pub angles: Vec<Option<f64>>,
}

impl AlignReport {
    /// The report as lines of text: each scan, then what the user should know. For logs.
    pub fn lines(&self) -> Vec<String> {
        let mut lines = vec![format!(
            "{} of {} scans placed; {} pairs compared, {} overlap and fit{}",
            self.placed(),
            self.scans.len(),
            self.compared,
            self.pairs.iter().filter(|pair| pair.state == PairState::Fits).count(),
            self.residual.map_or(String::new(), |residual| format!(", {} apart", Shown::digits(residual, 3))),
        )];
        for scan in &self.scans {
            let name = &scan.name;
            lines.push(match scan.state {
                ScanState::Kept => format!("{name}: stays where it is"),
                ScanState::Placed => format!(
                    "{name}: placed, to {}; shares {:.0} % with another; {} apart",
                    Shown::digits(scan.deviation, 2),
                    100.0 * scan.overlap,
                    Shown::digits(scan.residual, 3),
                ),
                ScanState::Undecided => format!("{name}: stays where it was given, undecided: {}", scan.reason),
                ScanState::Apart | ScanState::Unplaced => format!("{name}: not placed: {}", scan.reason),
            });
        }
        lines.extend(self.messages.iter().cloned());
        lines
    }

    /// Scans that lie in one frame: those that were placed, and those kept. 0 where a single one was kept for want of a place for others.
    pub fn placed(&self) -> usize {
        let count = |state| self.scans.iter().filter(|scan| scan.state == state).count();
        let (placed, kept) = (count(ScanState::Placed), count(ScanState::Kept));
        if placed == 0 && kept < 2 { 0 } else { placed + kept }
    }
}

impl Freedom {
    /// Of a turn (times `radius`) and a shift about `middle`.
    pub(crate) fn of(vector: &[f64; 6], middle: DVec3, radius: f64) -> Self {
        let [turn, shift] = [0, 3].map(|i| DVec3::new(vector[i], vector[i + 1], vector[i + 2]));
        if turn.length() > 0.3 * shift.length() {
            let turn = turn / radius;
            // Points of the axis don't move: shift + turn x (point - middle) is along the axis.
            let point = middle + turn.cross(shift) / turn.length_squared();
            Freedom { turns: true, direction: turn.normalize(), point }
        } else {
            Freedom { turns: false, direction: shift.normalize_or_zero(), point: middle }
        }
    }
}

/// Ways that a pair may turn or slide, in the frame of `world_from_first`.
pub(crate) fn freedoms(hold: &Hold, world_from_first: &DAffine3) -> Vec<Freedom> {
    let free = hold.values.iter().zip(&hold.vectors).filter(|(value, _)| **value < crate::finding::BALANCE);
    free.map(|(_, vector)| {
        let freedom = Freedom::of(vector, hold.middle, hold.radius);
        Freedom {
            direction: world_from_first.transform_vector3(freedom.direction),
            point: world_from_first.transform_point3(freedom.point),
            ..freedom
        }
    })
    .collect()
}
