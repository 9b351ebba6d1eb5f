//! The samples that are no outliers at first sight, and the surface around each that the others tell.

use glam::DVec3;
use rayon::prelude::*;

use super::super::noise::Noise;
use super::super::patch::{Frame, Quadric, Weighted};
use super::super::scales::{Scale, Scales};
use super::super::seen::Fronts;
use base::error::Result;
use base::progress::Progress;
use geom::neighbours::{Few, KdTree};

/// Smallest radius tried, in deviations of the noise: within less, what is along the surface can't be told from what is across ...
const DEVIATIONS: f64 = 3.0;
/// ... and in spacings.
const SPACINGS: f64 = 2.5;
/// Radii tried, each so many times the one before.
const STEP: f64 = 1.3;
const STEPS: usize = 9;
/// The largest is taken whose error is at most so many times the least: where they differ by less, it is by chance.
const AS_GOOD: f64 = 1.01;
/// None larger is tried where the error is so many times the least.
const WORSE: f64 = 1.05;
/// Samples they are tried on.
const TRIED: usize = 1024;
/// A radius that is asked for in the deviations that are assumed to be noise.
const TO_DEVIATION: f64 = 8.0;

/// Neighbours that say how crowded a sample is, and that a fit has at least.
pub(super) const FEW: usize = 16;
/// Neighbours that a fit has at most.
const MANY: usize = 768;

/// Times a sample is moved at least, by all around it ...
pub(super) const ROUNDS: usize = 2;
/// ... and again while it still moves more than this part of the heights that count. One that does not settle lies on nothing.
pub(super) const SETTLED: f64 = 0.02;
const MOST_ROUNDS: usize = 6;
/// Share of what is around a place on a surface that speaks for it, at least. On a side of a thin wall it is a third.
const SUPPORT: f64 = 0.2;
/// Samples around a place are looked for again if it has moved by this part of its reach.
pub(super) const STALE: f64 = 0.1;
/// Times it is moved first by few samples, in neighbourhoods as wide as noise asks for ...
const SPARSE: usize = 2;
/// ... in deviations ...
const START: f64 = 8.0;
/// ... and so many samples about.
const TO_START: f64 = 64.0;

/// Heights above the surface, in deviations of the noise, at which a sample counts no more.
pub(super) const HIGH: f64 = 4.0;

/// The surface around a place on it.
#[derive(Clone, Copy)]
pub(super) struct Patch {
    pub(super) place: DVec3,
    pub(super) frame: Frame,
    pub(super) quadric: Quadric,
    /// Weight of the samples that it was fitted to, by area.
    pub(super) crowd: f64,
    /// Direction to the side that it was seen from, zero where that is not known.
    pub(super) front: DVec3,
}

/// Lengths that depend on how samples lie, from place to place.
#[derive(Clone, Copy)]
pub(super) struct Lengths {
    pub(super) noise: Noise,
    /// Distance within which a sample usually has [`FEW`] neighbours: no radius is smaller.
    pub(super) few: f64,
    /// The radius that is asked for, whatever the noise.
    pub(super) given: Option<f64>,
}

impl Lengths {
    /// Deviation that counts as noise: also one that is to be smoothed out, even if it was not taken for noise.
    pub(super) fn deviation(&self, scale: Scale) -> f64 {
        let asked = self.given.map_or(0.0, |given| self.radius(given, scale) / TO_DEVIATION);
        (self.noise.deviation * scale.deviation).max(asked)
    }

    /// A radius that is tried or given.
    pub(super) fn radius(&self, radius: f64, scale: Scale) -> f64 {
        if self.given.is_some() {
            return radius.max(self.few * scale.spacing);
        }
        (radius * scale.spacing).max(DEVIATIONS * self.noise.deviation * scale.deviation)
    }

    /// Radius of neighbourhoods of few samples, at least.
    pub(super) fn start(&self, scale: Scale) -> f64 {
        (START * self.deviation(scale)).max(SPACINGS * self.noise.spacing * scale.spacing)
    }
}

/// The samples that are no outliers at first sight.
pub(super) struct Kept {
    pub(super) lengths: Lengths,
    pub(super) samples: Vec<DVec3>,
    pub(super) fronts: Fronts,
    pub(super) scales: Scales,
    pub(super) tree: KdTree,
    /// Over every so many-th of them: from it places are found to begin with.
    pub(super) sparse: KdTree,
    pub(super) stride: usize,
    /// Of each sample, whether it is not to be counted. Empty if all are.
    pub(super) strays: Vec<bool>,
}

/// Memory that is used again from sample to sample.
#[derive(Default)]
pub(super) struct Room {
    pub(super) few: Few,
    /// Samples around a place.
    pub(super) around: Vec<usize>,
    /// Those that count, and the sum of what they do.
    pub(super) near: Vec<Weighted>,
    pub(super) weight: f64,
}

/// A sample that others are to foretell.
struct Trial {
    sample: usize,
    /// The place that it came to last.
    course: Option<Course>,
    /// Its distance from there, in deviations. At most [`HIGH`].
    off: f64,
}

/// A sample on its way to the surface.
#[derive(Clone, Copy)]
pub(super) struct Course {
    pub(super) place: DVec3,
    /// Direction to the side that it was seen from, zero where that is not known.
    pub(super) front: DVec3,
}

impl Kept {
    pub(super) fn new(
        samples: &[DVec3],
        fronts: &Fronts,
        scales: &Scales,
        is_outlier: &[bool],
        lengths: Lengths,
        progress: &Progress<'_>,
    ) -> Result<Self> {
        let fronts = fronts.kept(|sample| !is_outlier[sample]);
        let scales = scales.kept(|sample| !is_outlier[sample]);
        let kept = samples.iter().zip(is_outlier).filter(|(_, is)| !**is).map(|(sample, _)| *sample);
        let samples: Vec<DVec3> = kept.collect();
        let tree = KdTree::try_new(&samples, progress)?;
        let spacing = lengths.noise.spacing;
        let around = std::f64::consts::PI * (lengths.start(Scale::USUAL) / spacing).powi(2);
        let stride = if spacing > 0.0 { ((around / TO_START) as usize).max(1) } else { 1 };
        let every: Vec<DVec3> = samples.iter().copied().step_by(stride).collect();
        let sparse = KdTree::try_new(&every, progress)?;
        Ok(Kept { lengths, samples, fronts, scales, tree, sparse, stride, strays: Vec::new() })
    }

    /// The radius at which samples are best foretold by those around them, themselves left out: the larger it is, the more of
    /// the noise is gone, until the surface goes, too.
    pub(super) fn best_radius(&self, progress: &Progress<'_>) -> Result<f64> {
        let noise = self.lengths.noise;
        let mut radius = (DEVIATIONS * noise.deviation).max(SPACINGS * noise.spacing);
        let mut trials = self.trials(progress)?;
        let mut tried: Vec<(f64, f64)> = Vec::new();
        let mut least = f64::INFINITY;
        // In larger ones there are no more samples.
        let largest = (MANY as f64 / std::f64::consts::PI).sqrt() * noise.spacing * STEP;
        for _ in 0..STEPS {
            self.foretell(&mut trials, radius, progress)?;
            let error = trials.iter().map(|trial| trial.off * trial.off).sum::<f64>() / trials.len() as f64;
            tried.push((error, radius));
            least = least.min(error);
            if error > WORSE * least {
                break;
            }
            radius *= STEP;
            if radius > largest {
                break;
            }
        }
        let as_good = tried.iter().rev().find(|(error, _)| *error <= AS_GOOD * least);
        Ok(as_good.map_or(radius, |tried| tried.1))
    }

    /// Some of the samples, near the surface.
    fn trials(&self, progress: &Progress<'_>) -> Result<Vec<Trial>> {
        let count = self.samples.len().min(TRIED);
        let begin = |room: &mut Room, k: usize| {
            progress.check()?;
            let sample = (2 * k + 1) * self.samples.len() / (2 * count);
            Ok(Trial { sample, course: self.begun(sample, true, room), off: 0.0 })
        };
        (0..count).into_par_iter().with_min_len(16).map_init(Room::default, begin).collect()
    }

    /// Notes how far samples are from the surface that those around them tell.
    fn foretell(&self, trials: &mut [Trial], radius: f64, progress: &Progress<'_>) -> Result<()> {
        trials.par_iter_mut().with_min_len(16).try_for_each_init(Room::default, |room, trial| {
            progress.check()?;
            let Trial { sample, course, off } = trial;
            // From the place on the surface: samples chosen around this one would agree with it too well.
            let to = course.and_then(|from| self.settled(*sample, true, radius, from, 1, room));
            if let Some(Patch { place, front, .. }) = to {
                *course = Some(Course { place, front });
            }
            // So that those in places of much noise do not decide alone.
            let deviation = self.lengths.noise.deviation * self.scales.at(*sample).deviation;
            let far = |to: Patch| to.place.distance(self.samples[*sample]) / deviation;
            *off = to.map_or(HIGH, |to| far(to).min(HIGH));
            Ok(())
        })
    }

    /// The surface where a sample comes to, of those around it that were seen from no other side. `None` if nothing is around it.
    pub(super) fn patch(&self, sample: usize, radius: f64, room: &mut Room) -> Option<Patch> {
        let course = self.begun(sample, false, room)?;
        self.settled(sample, false, radius, course, ROUNDS, room)
    }

    /// Near the surface, by few samples around one, itself left out or not.
    pub(super) fn begun(&self, sample: usize, is_left_out: bool, room: &mut Room) -> Option<Course> {
        let scale = self.scales.at(sample);
        let high = HIGH * self.lengths.deviation(scale);
        let without = is_left_out.then_some(sample);
        let mut course = Course { place: self.samples[sample], front: self.fronts.at(sample) };
        for round in 0..SPARSE {
            let reach = self.gather(course, self.lengths.start(scale), without, true, room)?;
            // The first time the sample's own height is all that is known of its side.
            let high = if round == 0 { 2.0 * high } else { high };
            course = self.fit(course, reach, high, room)?.0;
        }
        Some(course)
    }

    /// On the surface, by all samples around one, in at least so many steps.
    pub(super) fn settled(
        &self,
        sample: usize,
        is_left_out: bool,
        radius: f64,
        mut course: Course,
        least: usize,
        room: &mut Room,
    ) -> Option<Patch> {
        let scale = self.scales.at(sample);
        let (high, radius) = (HIGH * self.lengths.deviation(scale), self.lengths.radius(radius, scale));
        let without = is_left_out.then_some(sample);
        let (mut reach, mut centre) = (0.0, course.place);
        for round in 0..MOST_ROUNDS {
            if round == 0 || course.place.distance(centre) > STALE * reach {
                reach = self.gather(course, radius, without, false, room)?;
                centre = course.place;
            }
            let from = course.place;
            let (to, patch) = self.fit(course, reach, high, room)?;
            course = to;
            if round + 1 >= least && course.place.distance(from) <= SETTLED * high {
                let crowd = patch.crowd * scale.spacing.powi(2) / (reach * reach);
                return (patch.crowd >= SUPPORT * room.weight).then_some(Patch { crowd, ..patch });
            }
        }
        None
    }

    /// Fills `room.around` with the samples around a place that are not behind it. Gives how far they reach.
    pub(super) fn gather(
        &self,
        Course { place, front }: Course,
        radius: f64,
        without: Option<usize>,
        is_sparse: bool,
        room: &mut Room,
    ) -> Option<f64> {
        let (tree, stride) = if is_sparse { (&self.sparse, self.stride) } else { (&self.tree, 1) };
        let mut reach = radius;
        tree.nearest_few(place, MANY, reach, &mut room.few);
        if room.few.len() < FEW {
            tree.nearest_few(place, FEW, f64::INFINITY, &mut room.few);
        }
        if room.few.len() == MANY || room.few.len() <= FEW {
            reach = room.few.furthest()?.sqrt() * BEYOND;
        }
        room.around.clear();
        let around = room.few.iter().map(|(i, _)| i as usize * stride);
        let counts = |&i: &usize| Some(i) != without && self.strays.get(i) != Some(&true);
        room.around.extend(around.filter(|i| counts(i) && !self.fronts.is_behind(*i, front)));
        Some(reach)
    }

    /// The place, on the surface of the samples around it, that a place comes to. Those further than `high` above or below it don't count.
    /// Also that surface, with the weight of those that do count.
    pub(super) fn fit(&self, course: Course, reach: f64, high: f64, room: &mut Room) -> Option<(Course, Patch)> {
        let place = course.place;
        room.near.clear();
        let (mut weight, mut towards) = (0.0, DVec3::ZERO);
        for &i in &room.around {
            let far = 1.0 - self.samples[i].distance_squared(place) / (reach * reach);
            if far > 0.0 {
                let counted = far * far;
                room.near.push((self.samples[i], counted));
                towards += self.fronts.at(i) * counted;
                weight += counted;
            }
        }
        room.weight = weight;
        let frame = Frame::new(place, &room.near)?;
        let front = frame.front(towards);
        let local = room.near.iter().map(|&(sample, weight)| {
            let at = frame.to_local(sample);
            (at, weight * level(at[2] / high))
        });
        let (quadric, crowd) = Quadric::fit(local, reach)?;
        let place = frame.above(quadric.height([0.0; 3]));
        Some((Course { place, front }, Patch { place, frame, quadric, crowd, front }))
    }
}

/// End of weights, if the furthest neighbour gives it.
const BEYOND: f64 = 1.2;

/// Weight of a sample at a part of the height up to which anything counts.
pub(super) fn level(height: f64) -> f64 {
    let level = (1.0 - height * height).max(0.0);
    level * level
}

/// Samples moved between two looks at the progress.
pub(super) const BLOCK: usize = 64;
