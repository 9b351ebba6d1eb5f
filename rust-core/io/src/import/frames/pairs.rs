//! Pairs of frames that surely overlap, and how far apart their surfaces lie under poses that are tried.
//!
//! The angle by which a frame is turned against another is the same in both senses and with all axes: so pairs are chosen by it before
//! anything is known. Points of one frame are compared with the depths that the other has where it sees them: as finely as its pixels are,
//! not as a few points of it lie.

use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::super::file;
use super::super::options::ReadOptions;
use super::decode::is_damage;
use super::recording::Recording;
use base::error::{Error, Result};
use base::progress::Progress;
use image::frame::LeftOutReport;
use image::range_image::{Projection, RangeImage};

/// Pairs at most. Of more, some are taken evenly.
const PAIRS: usize = 8;

/// Frames of a pair are turned against each other by at most this, in radians, but for neighbours: 15 degrees.
const TURN: f64 = 0.26;

/// Points of a frame, about.
const POINTS: usize = 1500;

/// One of so many of these is compared.
const COMPARED: usize = 5;

/// Pixels of a frame that are kept, about.
const PIXELS: usize = 320_000;

/// The share of all points that lie no further than the distance of a pair: fewer than two frames have in common.
const SHARE: f64 = 0.3;

/// Of the points that another frame sees, those in front of its surface by more than this share of their depth: it looked through
/// them, which it did not where they are.
const THROUGH: f64 = 0.02;

/// No distance counts as less than this share of the depths: what is stored is no finer.
const FINEST: f64 = 1e-4;

/// Frames that are looked at.
pub(super) struct Pairs {
    frames: Vec<Seen>,
    /// Two of the frames each.
    pairs: Vec<[usize; 2]>,
    /// The samples of them that are left out.
    pub(super) left_out: LeftOutReport,
    /// Frames of the recording whose depths can't be decoded, and why.
    pub(super) damaged: Vec<(usize, String)>,
}

/// A frame.
struct Seen {
    /// Its number in the recording.
    index: usize,
    points: Vec<DVec3>,
    /// z of each pixel that is kept, row by row. NaN for none.
    depths: Vec<f32>,
    /// Columns and rows that are kept, and pixels from one to the next.
    size: [usize; 2],
    step: usize,
    focal: [f64; 2],
    centre: [f64; 2],
}

/// The frames of pairs, by the numbers of the recording.
fn chosen(recording: &Recording) -> Vec<[usize; 2]> {
    let count = recording.entries.len();
    let anchors = PAIRS.min(count.saturating_sub(1));
    let turn = |a: usize, b: usize| {
        let [a, b] = [a, b].map(|k| recording.entries[k].world_from_sensor.matrix3);
        let trace = (a.transpose() * b).to_cols_array();
        ((trace[0] + trace[4] + trace[8] - 1.0) / 2.0).clamp(-1.0, 1.0).acos()
    };
    let partner = |first: usize| {
        let last = (first + (count / anchors).max(1)).min(count - 1);
        let within = (first + 1..=last).take_while(|&other| turn(first, other) <= TURN);
        within.max_by(|&a, &b| turn(first, a).total_cmp(&turn(first, b))).unwrap_or(first + 1)
    };
    (0..anchors).map(|k| k * (count - 1) / anchors).map(|first| [first, partner(first)]).collect()
}

/// Reason why a frame that can be decoded is none of the others.
fn why_unfit(error: &Error) -> Option<String> {
    let Error::Format { path, problem, .. } = error else { return None };
    Some(format!("{} does not fit ({problem})", file::name(path)))
}

impl Pairs {
    /// Reads depths and confidences of the frames.
    pub(super) fn of(recording: &Recording, options: &Arc<ReadOptions>, progress: &Progress<'_>) -> Result<Pairs> {
        let chosen = chosen(recording);
        let mut indices: Vec<usize> = chosen.iter().flatten().copied().collect();
        indices.extend((recording.entries.len() == 1).then_some(0));
        indices.sort_unstable();
        indices.dedup();
        let mut all =
            Pairs { frames: Vec::new(), pairs: Vec::new(), left_out: LeftOutReport::default(), damaged: Vec::new() };
        for index in indices {
            progress.check()?;
            let frame = match recording.without_colour(index, options, progress) {
                Ok(frame) => frame,
                Err(error) if is_damage(&error) => {
                    let why = recording.why_damaged(index, options, progress)?;
                    let Some(why) = why.or_else(|| why_unfit(&error)) else { return Err(error) };
                    all.damaged.push((index, why));
                    continue;
                }
                Err(other) => return Err(other),
            };
            let (image, out) = frame.into_range_image(progress)?;
            all.left_out.add(&out);
            all.frames.push(Seen::of(index, &image));
        }
        let place = |index: usize| all.frames.iter().position(|frame| frame.index == index);
        all.pairs = chosen.iter().filter_map(|&[a, b]| Some([place(a)?, place(b)?])).collect();
        Ok(all)
    }

    /// Number of frames that are looked at.
    pub(super) fn count(&self) -> usize {
        self.frames.len()
    }

    /// The numbers of the frames in the recording, and some points of each in its own frame.
    pub(super) fn points(&self) -> impl Iterator<Item = (usize, &[DVec3])> {
        self.frames.iter().map(|frame| (frame.index, frame.points.as_slice()))
    }

    /// The depth in the middle of all.
    pub(super) fn depth(&self) -> f64 {
        let mut depths: Vec<f64> = self.frames.iter().flat_map(|frame| frame.points.iter().map(|p| p.z)).collect();
        if depths.is_empty() {
            return 0.0;
        }
        let middle = depths.len() / 2;
        *depths.select_nth_unstable_by(middle, f64::total_cmp).1
    }

    /// The share of the points within view of other frames, of all of them, that these look through where `pose` places each. 0 if none is
    /// within view. A surface lies where nobody looks through it, so a right reading has few.
    pub(super) fn looked_through(&self, pose: &dyn Fn(usize) -> DAffine3) -> f64 {
        let (mut through, mut within) = (0_u32, 0_u32);
        for from in &self.frames {
            for to in self.frames.iter().filter(|to| to.index != from.index) {
                let relative = pose(to.index).inverse() * pose(from.index);
                for point in from.points.iter().step_by(COMPARED) {
                    if let Some(behind) = to.behind(relative.transform_point3(*point)) {
                        within += 1;
                        through += u32::from(behind < -THROUGH * point.z);
                    }
                }
            }
        }
        if within == 0 { 0.0 } else { f64::from(through) / f64::from(within) }
    }

    /// Distance between the frames of pairs where `pose` places each, by its number in the recording. Infinite if too few of their points
    /// meet, or where half of the pairs have no poses.
    pub(super) fn apart(&self, pose: &dyn Fn(usize) -> Option<DAffine3>) -> f64 {
        let mut distances = Vec::new();
        let mut placed = 0;
        for &[a, b] in &self.pairs {
            let (a, b) = (&self.frames[a], &self.frames[b]);
            let (Some(from_a), Some(from_b)) = (pose(a.index), pose(b.index)) else { continue };
            placed += 1;
            for (from, to, relative) in [(a, b, from_b.inverse() * from_a), (b, a, from_a.inverse() * from_b)] {
                let points = from.points.iter().step_by(COMPARED);
                let behind = points.map(|point| to.behind(relative.transform_point3(*point)));
                distances.extend(behind.map(|behind| behind.map_or(f64::INFINITY, f64::abs)));
            }
        }
        if distances.is_empty() || placed * 2 < self.pairs.len() {
            return f64::INFINITY;
        }
        let rank = (SHARE * (distances.len() - 1) as f64) as usize;
        let share = *distances.select_nth_unstable_by(rank, f64::total_cmp).1;
        share.max(FINEST * self.depth())
    }
}

impl Seen {
    fn of(index: usize, image: &RangeImage) -> Seen {
        let (focal, centre) = match *image.projection() {
            Projection::Pinhole { focal, centre, .. } => (focal, centre),
            _ => ([1.0; 2], [0.0; 2]),
        };
        let step = ((image.len() as f64 / PIXELS as f64).sqrt().ceil() as usize).max(1);
        let size = [image.cols().div_ceil(step), image.rows().div_ceil(step)];
        let pixels = (0..size[1]).flat_map(|row| (0..size[0]).map(move |col| row * step * image.cols() + col * step));
        let depths = pixels.map(|pixel| image.point_in_sensor(pixel).z as f32).collect();
        let every = (image.valid_count() / POINTS).max(1);
        let valid = (0..image.len()).filter(|&i| image.is_valid(i));
        let points = valid.step_by(every).map(|i| image.point_in_sensor(i)).collect();
        Seen { index, points, depths, size, step, focal, centre }
    }

    /// Distance of a point behind the surface, or before it if that is negative. `None` if the frame does not see.
    fn behind(&self, point: DVec3) -> Option<f64> {
        let at = |axis: usize| {
            let place = self.focal[axis] * point[axis] / point.z + self.centre[axis];
            let pixel = (place / self.step as f64).round();
            (pixel >= 0.0 && pixel < self.size[axis] as f64).then_some(pixel as usize)
        };
        if point.z <= 0.0 {
            return None;
        }
        let depth = f64::from(self.depths[at(1)? * self.size[0] + at(0)?]);
        (!depth.is_nan()).then_some(point.z - depth)
    }
}
