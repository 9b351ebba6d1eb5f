//! Outliers near a surface whose samples carry no noise.

use rayon::prelude::*;

use super::kept::{BLOCK, Kept, ROUNDS, Room};
use super::patches::{FAR, THIN};
use base::error::Result;
use base::progress::Progress;

/// Distance of a sample without noise from the surface that others tell, in spacings, from which it is an outlier: samples of a sharp
/// edge are nearer.
const OFF: f64 = 0.5;

impl Kept {
    /// Of each sample, whether it is off the surface that those around it tell without it: its own place would draw that to it. Advances
    /// `progress` by their number.
    pub(super) fn strays(&mut self, radius: f64, progress: &Progress<'_>) -> Result<Vec<bool>> {
        let count = self.samples.len();
        let look = |room: &mut Room, sample: usize| {
            if sample.is_multiple_of(BLOCK) {
                progress.advance(BLOCK as u64)?;
            }
            Ok(self.crowd_where_it_is(sample, radius, room))
        };
        let all = (0..count).into_par_iter().with_min_len(BLOCK);
        let crowds: Vec<f64> = all.clone().map_init(Room::default, look).collect::<Result<_>>()?;
        let mut sorted = crowds.clone();
        let usual = *sorted.select_nth_unstable_by(count / 2, f64::total_cmp).1;
        self.strays = crowds.iter().map(|&crowd| crowd < THIN * usual).collect();
        // Samples of the surface beside outliers are told right without these.
        let again = |room: &mut Room, sample: usize| {
            progress.check()?;
            Ok(self.strays[sample] && self.crowd_where_it_is(sample, radius, room) < THIN * usual)
        };
        all.map_init(Room::default, again).collect()
    }

    /// The weight of the others that tell a surface where a sample is. 0 if they tell it elsewhere, or none.
    fn crowd_where_it_is(&self, sample: usize, radius: f64, room: &mut Room) -> f64 {
        let (noise, scale) = (self.lengths.noise, self.scales.at(sample));
        let off = (OFF * noise.spacing * scale.spacing).max(FAR * noise.deviation * scale.deviation);
        let course = self.begun(sample, true, room);
        let told = course.and_then(|course| self.settled(sample, true, radius, course, ROUNDS, room));
        told.filter(|told| told.place.distance(self.samples[sample]) <= off).map_or(0.0, |told| told.crowd)
    }
}
