//! From which side samples were seen: towards the sensor, or along the normal.

use glam::DVec3;

use super::prepare::Samples;
use super::seeds::{FEWEST, WINDOW, seeds};
use base::error::Result;
use base::progress::Progress;

/// Share of a sample's neighbours that show the other side, up to which it agrees with them.
const OTHERS: f64 = 0.25;
/// Share of the samples that agree with their neighbours, at least. Of normals turned at random next to none do. Of thin walls whose noise
/// is larger than they are, those at edges, handles and wherever else something is thicker do.
const AGREED: f64 = 0.05;

/// Sensors and normals of a cloud's points, as far as they are known.
#[derive(Clone, Copy)]
pub(super) struct Seen<'a> {
    /// One a point. Zero, or no number, where there is none.
    pub(super) normals: Option<&'a [[f32; 3]]>,
    /// None, one for all, or one per point. NaN if a point's is not known.
    pub(super) sensors: &'a [DVec3],
}

impl Seen<'_> {
    pub(super) fn is_nothing(&self) -> bool {
        self.sensors.is_empty() && self.normals.is_none()
    }
}

/// Samples of a cloud.
#[derive(Clone, Copy)]
pub(super) struct Sighted<'a> {
    pub(super) samples: &'a Samples,
    pub(super) seen: Seen<'a>,
}

impl Sighted<'_> {
    /// The direction from a sample to its sensor, else its normal, else zero.
    pub(super) fn front(&self, sample: usize) -> DVec3 {
        let front = self.toward_sensor(sample).normalize_or_zero();
        if front != DVec3::ZERO {
            return front;
        }
        let point = self.samples.input[sample] as usize;
        let normal = self.seen.normals.map_or([0.0; 3], |normals| normals[point]);
        DVec3::from(normal.map(f64::from)).normalize_or_zero()
    }

    /// From a sample to its sensor. Zero, or no numbers, where that is not known.
    pub(super) fn toward_sensor(&self, sample: usize) -> DVec3 {
        let Sighted { samples, seen: Seen { sensors, .. } } = *self;
        let point = samples.input[sample] as usize;
        let sensor = if sensors.len() == 1 { sensors.first() } else { sensors.get(point) };
        sensor.map_or(DVec3::ZERO, |sensor| *sensor * samples.factor - samples.points[sample])
    }
}

/// Of each sample, the direction to the side that it was seen from: zero where that is not known.
#[derive(Clone, Debug, Default)]
pub(super) struct Fronts(Vec<DVec3>);

impl Fronts {
    /// None where samples don't agree with those around them: of normals that were found one by one either sign is as good.
    pub(super) fn of(sighted: Sighted<'_>, progress: &Progress<'_>) -> Result<Self> {
        let samples = &sighted.samples.points;
        if sighted.seen.is_nothing() {
            return Ok(Fronts::default());
        }
        let mut fronts = Vec::with_capacity(samples.len());
        for range in progress.ranges(samples.len()) {
            fronts.extend(range?.map(|sample| sighted.front(sample)));
        }
        let fronts = Fronts(fronts);
        Ok(if fronts.agree(samples, progress)? { fronts } else { Fronts::default() })
    }

    fn agree(&self, samples: &[DVec3], progress: &Progress<'_>) -> Result<bool> {
        let (mut known, mut agreed) = (0_u32, 0_u32);
        let mut nearest: Vec<(f64, usize)> = Vec::new();
        for sample in seeds(samples.len()).filter(|&sample| self.at(sample) != DVec3::ZERO) {
            progress.check()?;
            nearest.clear();
            let window = sample.saturating_sub(WINDOW)..(sample + WINDOW).min(samples.len());
            nearest.extend(window.map(|other| (samples[other].distance_squared(samples[sample]), other)));
            nearest.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            nearest.truncate(FEWEST);
            let others = nearest.iter().filter(|(_, other)| self.is_behind(*other, self.at(sample))).count();
            known += 1;
            agreed += u32::from(others as f64 <= OTHERS * nearest.len() as f64);
        }
        Ok(agreed > 0 && f64::from(agreed) >= AGREED * f64::from(known))
    }

    #[cfg(test)]
    pub(super) fn known(fronts: Vec<DVec3>) -> Self {
        Fronts(fronts)
    }

    /// Whether nothing is known of any sample.
    pub(super) fn are_unknown(&self) -> bool {
        self.0.is_empty()
    }

    pub(super) fn at(&self, sample: usize) -> DVec3 {
        self.0.get(sample).copied().unwrap_or(DVec3::ZERO)
    }

    /// Whether a sample is known to have been seen from the other side than that of a front.
    pub(super) fn is_behind(&self, sample: usize, front: DVec3) -> bool {
        self.at(sample).dot(front) < 0.0
    }

    /// Those of the samples that are kept.
    pub(super) fn kept(&self, is_kept: impl Fn(usize) -> bool) -> Fronts {
        let all = self.0.iter().enumerate();
        Fronts(all.filter(|(sample, _)| is_kept(*sample)).map(|(_, front)| *front).collect())
    }
}
