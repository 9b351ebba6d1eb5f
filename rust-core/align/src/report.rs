//! The report of an alignment.

use glam::{DAffine3, DVec3};

use crate::constraints::Axis;
use crate::judge::Hold;
use crate::names::told_apart;
use base::error::{Shown, counted};
use base::report::{FigureValue, Found, Report as _};

/// Result of [`run`](crate::run).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Alignment {
    /// The pose of each scan, in the order given. `None` for those that aren't placed. All are rigid. A fixed scan's is its
    /// own to the bit, as is that of the largest scan where none is fixed, and those of scans that stay undecided.
    pub world_from_scan: Vec<Option<DAffine3>>,
    /// The report.
    pub report: AlignReport,
}

base::choices! {
    /// The outcome of a scan.
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
    /// The outcome of a pair of scans.
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
        /// The shared part stood still before the sensor while the rest moved: not used.
        Background = "background" "Background",
        /// They fit by themselves, but other scans' sensors saw through there: not used.
        SeenThrough = "seen_through" "Seen through",
        /// They fit by themselves, but other pairs, that fit better, rough poses or the order of a recording say otherwise: not used.
        Disagrees = "disagrees" "Disagrees with others",
        /// The caller rejected it.
        Rejected = "rejected" "Rejected",
    }
}

base::report! {
    /// A way that a scan may move without leaving the surfaces it lies on.
    #[derive(Copy, Default)]
    pub struct Freedom {
        /// Whether it is a turn about an axis. Otherwise it is a slide.
        turns: bool = flag("Is a turn"),
        /// Unit direction of the axis, or of the slide, in the world.
        direction: DVec3 = vector("Direction"),
        /// A point of the axis, in the world.
        point: DVec3 = vector("Point"),
    }
}

base::report! {
    /// A scan that was aligned: its pose, and how sure that is.
    #[derive(Default)]
    pub struct AlignedScan {
        /// Its name.
        name: String = text("Scan"),
        /// State of the scan: placed, kept, or neither.
        state: ScanState = choice("State", ScanState::CHOICES).choices_named("scan_state"),
        /// Reason why it is not placed, or stays undecided, and what to do. Empty if it is placed.
        reason: String = text("Reason"),
        /// Number of its group. 0 is the group that is placed. There is none where the scan is joined with no other.
        group: Option<usize> = count("Group").optional(),
        /// Its pose in its group, which is rigid. For the first group it is the result. Scans of others lie together where
        /// the largest of them was given. There is none where the scan has no group.
        world_from_scan: Option<DAffine3> = pose("Pose").optional(),
        /// Covariance of a small motion of it in the world: a turn about `middle` in radians, then a shift. Zero for scans
        /// that are kept.
        covariance: [[f64; 6]; 6] = matrix("Covariance", 6),
        /// The middle of its points, in the world.
        middle: DVec3 = vector("Middle"),
        /// One standard deviation of the place of its points: the largest over the scan. It is at least the scan's size where
        /// nothing holds it, the reach where it stays undecided, and infinite where it has no place.
        deviation: f64 = length("Placed to"),
        /// Ways that nothing holds it.
        freedoms: Vec<Freedom> = nested("Freedoms", &Freedom::SCHEMA).up_to(6),
        /// Share of its surface that lies on the scan that shares most with it.
        overlap: f64 = ratio("Overlap"),
        /// Root mean square distance to the surfaces of others, along normals. 0 where there are none.
        residual: f64 = length("Distance to others"),
        /// Root mean square of how far it lies from the others where noise is averaged out. No rigid pose explains that, but warp
        /// does. Bending within a few samples counts as well, so that some of it is always there.
        misfit: f64 = length("Misfit"),
        /// Median distance of its samples.
        spacing: f64 = length("Spacing"),
    }
}

base::report! {
    /// Two scans that were compared, and how well they fit.
    #[derive(Default)]
    pub struct AlignedPair {
        /// Their numbers, the smaller first.
        scans: [usize; 2] = count("Scans").array(2),
        /// State of the pair: it fits, or why it is not used.
        state: PairState = choice("State", PairState::CHOICES).choices_named("pair_state"),
        /// Share of either surface that lies on the other.
        overlap: [f64; 2] = ratio("Overlap").array(2),
        /// Root mean square distance of the surfaces where they touch, along normals.
        residual: f64 = length("Distance of the surfaces"),
        /// How well the pair is held against turning and sliding: 1 at best, 0 where it may turn or slide.
        balance: f64 = number("Balance"),
        /// Of what the sensors can tell, the share that speaks against the pair.
        seen_through: f64 = ratio("Seen through"),
        /// Places in which one fits the other.
        places: usize = count("Places"),
        /// Ways that one may turn or slide on the other.
        freedoms: Vec<Freedom> = nested("Freedoms", &Freedom::SCHEMA).up_to(6),
    }
}

base::report! {
    /// A turntable as it was found.
    pub struct TurntableFound {
        /// Its axis, in the frame that the scans were taken in. The direction is of length 1.
        axis: Axis = vector("Axis").parts(&[("point", "A point of the axis."), ("direction", "Unit direction of the axis.")]),
        /// By how much it was turned at each scan, from 0 to 2 pi, counter-clockwise where the axis points to the viewer. 0 at
        /// the first scan that is placed. There is none for scans that are not placed.
        angles: Vec<Option<f64>> = angle("Angles").list_of_optional(),
    }
}

impl FigureValue for Axis {
    fn found(&self) -> Found<'_> {
        Found::Array(vec![self.point.found(), self.direction.found()])
    }
}

base::report! {
    /// Scans that were aligned, and their pairs.
    #[derive(Default)]
    pub struct AlignReport {
        /// Each scan, in the order given.
        scans: Vec<AlignedScan> = nested("Scans", &AlignedScan::SCHEMA).list().counted(),
        /// The pairs of which anything was found, by their numbers.
        pairs: Vec<AlignedPair> = nested("Pairs", &AlignedPair::SCHEMA).list().counted(),
        /// Numbers of the scans of each group, the placed one first. Only scans that are joined with others, or kept, are in
        /// one.
        groups: Vec<Vec<usize>> = count("Groups").lists().counted(),
        /// Pairs that were compared.
        compared: usize = count("Pairs compared"),
        /// Root mean square distance of the surfaces of all pairs that touch, along normals. There is none where none touch.
        residual: Option<f64> = length("Distance of the surfaces").optional(),
        /// The turntable, where there was one and it was found.
        turntable: Option<TurntableFound> = nested("Turntable", &TurntableFound::SCHEMA).optional(),
        /// Sentences that the user should know.
        messages: Vec<String> = text("Messages").list().counted(),
    }
    derived {
        /// Scans that lie in one frame: those that were placed, and those kept. 0 where a single one was kept for want of a
        /// place for others.
        placed = count("Placed"),
    }
}

impl AlignReport {
    /// The report as lines of text: what the user should know, then each scan. For logs.
    pub fn lines(&self) -> Vec<String> {
        let fit = self.pairs.iter().filter(|pair| pair.state == PairState::Fits).count();
        let mut lines = vec![format!(
            "{} of {} scans placed. {}{}. {} compared to find the places.",
            self.placed(),
            self.scans.len(),
            counted(fit as u64, "pair of scans overlaps there and fits", "pairs of scans overlap there and fit"),
            self.residual.map_or(String::new(), |residual| format!(", {} apart", Shown::digits(residual, 3))),
            counted(self.compared as u64, "pair was", "pairs were"),
        )];
        lines.extend(self.messages.iter().cloned());
        let names: Vec<String> = self.scans.iter().map(|scan| scan.name.clone()).collect();
        let numbers: Vec<usize> = (0..names.len()).collect();
        for (scan, name) in self.scans.iter().zip(told_apart(&names, &numbers)) {
            lines.push(match scan.state {
                ScanState::Kept if self.placed() == 0 => {
                    format!("{name}: stays where it is, and no other scan has a place beside it")
                }
                ScanState::Kept => format!("{name}: stays where it is"),
                ScanState::Placed => format!(
                    "{name}: placed, to {}, shares {:.0} % with another, {} apart",
                    Shown::digits(scan.deviation, 2),
                    100.0 * scan.overlap,
                    Shown::digits(scan.residual, 3),
                ),
                ScanState::Undecided => format!("{name}: stays where it was given, undecided: {}", scan.reason),
                ScanState::Apart | ScanState::Unplaced => format!("{name}: not placed: {}", scan.reason),
            });
        }
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
