//! The pose of each image by the numbers in its name.

use std::collections::BTreeMap;

use rustc_hash::FxHashMap;

use super::numbering::Key;
use super::trajectory::{APART, Trajectory};

/// The places in a list of the poses of images. `None` of images without a pose.
pub(super) type Places = Vec<Option<usize>>;

/// How the names of images give them their poses.
#[derive(Debug, PartialEq)]
pub(super) enum Placing {
    /// By the times in them.
    Times(Places),
    /// By numbers that the list has, too.
    Numbers(Places),
    /// Not at all: the order alone may.
    Order,
}

impl Trajectory {
    /// The pose of each image by the numbers in its name, if the list has such numbers, too.
    ///
    /// # Errors
    /// No image that has a pose. Numbers that may place an image at another one's pose.
    pub(super) fn placing(&self, keys: &[Key], names: &[&str]) -> Result<Placing, String> {
        let of_times: Vec<&Key> = keys.iter().filter(|key| key.are_times).collect();
        if let (Some(_), [first, ..]) = (self.times(), of_times.as_slice()) {
            let ways = of_times.iter().map(|key| self.by_times(key, names)).collect::<Result<Vec<_>, String>>()?;
            let shown = || first.values.iter().flatten().next().copied().unwrap_or_default();
            let places = self.agreed(ways, names)?;
            return places
                .map(Placing::Times)
                .ok_or_else(|| format!("a pose must lie within {APART} s of {}, but none does", shown()));
        }
        if !self.numbers().is_empty() && !keys.is_empty() {
            return self.by_numbers(keys, names);
        }
        if names.len() == self.poses().len() {
            keys.iter().try_for_each(|key| self.refuse_seconds(key))?;
        }
        Ok(Placing::Order)
    }

    /// The pose nearest to the time in each name. Of images that are nearest to one pose the nearest takes it.
    fn by_times(&self, key: &Key, names: &[&str]) -> Result<Places, String> {
        let times = self.times().unwrap_or_default();
        let mut places = vec![None; names.len()];
        // Distances and images of each pose that these are nearest to.
        let mut near: BTreeMap<usize, Vec<(f64, usize)>> = BTreeMap::new();
        for (image, value) in key.values.iter().enumerate() {
            let Some(value) = *value else { continue };
            if let Some(pose) = self.nearest(value, APART) {
                near.entry(pose).or_default().push(((times[pose] - value).abs(), image));
            }
        }
        for (pose, mut rivals) in near {
            rivals.sort_by(|a, b| a.0.total_cmp(&b.0));
            if let [first, second, ..] = rivals[..]
                && first.0 == second.0
            {
                return Err(format!(
                    "{} and {} both take the pose of time {}. Open the scans that the list is of, or align them and write \
                        the list anew, which then names them.",
                    names[first.1], names[second.1], times[pose]
                ));
            }
            places[rivals[0].1] = Some(pose);
        }
        Ok(places)
    }

    fn by_numbers(&self, keys: &[Key], names: &[&str]) -> Result<Placing, String> {
        let columns = self.numbers();
        let count_on = columns.iter().any(|column| counts_on(column));
        // Programs count the poses in a log, whichever images these are of.
        if count_on && self.is_log() {
            return Ok(Placing::Order);
        }
        let mut ways: Vec<Places> = Vec::new();
        for column in columns {
            let place_of: FxHashMap<u64, usize> = column.iter().map(|number| number.to_bits()).zip(0..).collect();
            // Else -0 is another number than 0.
            let place = |value: f64| place_of.get(&(value + 0.0).to_bits()).copied();
            ways.extend(keys.iter().map(|key| key.values.iter().map(|value| place((*value)?)).collect()));
        }
        let known = keys[0].values.iter().flatten().count();
        let most = ways.iter().map(fit).max().unwrap_or_default();
        if count_on {
            // Such numbers may count the poses alone.
            if most == 0 {
                return Ok(Placing::Order);
            }
            ways.retain(|way| fit(way) == known);
        }
        let count = self.poses().len();
        let are_as_many = count == names.len() || count == known;
        match self.agreed(ways, names)? {
            Some(places) if !are_as_many || fit(&places) * 2 >= known => Ok(Placing::Numbers(places)),
            _ => Err(self.doubt(keys, most)),
        }
    }

    /// The only way in which images take poses. If numbers of all images are those of all poses one by one, no other counts.
    fn agreed(&self, mut ways: Vec<Places>, names: &[&str]) -> Result<Option<Places>, String> {
        ways.retain(|way| fit(way) > 0);
        let is_exact = |way: &Places| fit(way) == names.len() && names.len() == self.poses().len();
        if ways.iter().any(is_exact) {
            ways.retain(is_exact);
        }
        let Some(first) = ways.pop() else { return Ok(None) };
        let differs = |image: &usize| ways.iter().any(|way| way[*image] != first[*image]);
        match (0..names.len()).find(differs).map(|image| names[image]) {
            None => Ok(Some(first)),
            Some(name) if self.is_log() => Err(format!(
                "it is in doubt which pose is that of {name}: the first and the third number before each matrix say \
                    different ones. Number the poses from 0 without a gap, and open as many scans as there are poses."
            )),
            Some(name) => Err(format!(
                "it is in doubt which pose is that of {name}: the numbers in the name say different ones. Rename the scans so \
                    that each has one number."
            )),
        }
    }

    /// The error that some numbers and the order place scans differently, where either may be meant.
    fn doubt(&self, keys: &[Key], fit: usize) -> String {
        let last = keys.last().map_or(&[][..], |key| &key.values);
        let [list, names] = [self.numbers()[0].clone(), last.iter().flatten().copied().collect()].map(|values| {
            let [least, most] = [f64::INFINITY, f64::NEG_INFINITY];
            (values.iter().copied().fold(least, f64::min), values.iter().copied().fold(most, f64::max))
        });
        let rest = format!(
            "Only {fit} of them fit, so that the order may be meant. Open the scans that fit alone, or number them as the list \
                does."
        );
        if self.times() == Some(&self.numbers()[0]) {
            format!(
                "its times are {} to {}, but the numbers in the names of the scans are {} to {}. {rest}",
                list.0, list.1, names.0, names.1
            )
        } else {
            format!(
                "its numbers are {} to {}, but the numbers in the names of the scans are {} to {}. {rest}",
                list.0, list.1, names.0, names.1
            )
        }
    }

    /// Refuses numbers in names that seem to be seconds of the list, but are in another order.
    fn refuse_seconds(&self, key: &Key) -> Result<(), String> {
        let mut values: Vec<f64> = key.values.iter().flatten().copied().collect();
        values.sort_by(f64::total_cmp);
        let found: Vec<(usize, usize)> =
            values.iter().enumerate().filter_map(|(place, value)| Some((place, self.nearest(*value, 0.0)?))).collect();
        let are_meant = found.len() >= 2 && found.len() * 2 >= values.len();
        if !are_meant || found.iter().all(|(place, pose)| place == pose) {
            return Ok(());
        }
        Err(format!(
            "{} of {} numbers in the names of the scans are times of the list, but in their order the scans would take \
                other poses. Name the scans by their times, with a decimal point, or give the poses numbers as times.",
            found.len(),
            values.len()
        ))
    }
}

/// How many images have a pose.
fn fit(way: &Places) -> usize {
    way.iter().flatten().count()
}

/// Whether numbers, of which none is there twice, count from 0 or 1 without a gap.
pub(super) fn counts_on(numbers: &[f64]) -> bool {
    let least = numbers.iter().copied().fold(f64::INFINITY, f64::min);
    let most = numbers.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    (least == 0.0 || least == 1.0) && most - least + 1.0 == numbers.len() as f64
}
