//! Lines of sight: what a range image says of places that it did not measure.
//!
//! A place is **seen through** where the samples around its pixel lie behind it: whatever was there would have been met.

mod around;

use glam::{DAffine3, DVec3};

use crate::range_image::noise::Noise;
use crate::range_image::{DepthKind, Projection, RangeImage, Samples, Viewing};
use base::error::Result;
use base::progress::{Pace, Progress};

/// The answer of an image about a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seen {
    /// Nothing: it is outside of the image or hidden, no sample came back, or pixels are too far apart or it lies too close to
    /// a border or a jump to tell.
    Nothing,
    /// It is where the image has a surface.
    Surface,
    /// Nothing is there.
    Through,
}

/// Deviations of a sample beyond which it is behind a place.
const BEHIND: f64 = 4.0;

/// Places may be so much of the tolerance off to the side: it is the most that surfaces differ by, of which either is half
/// off.
const ASIDE: f64 = 0.5;

/// A range image made to be asked what it sees of places.
pub struct LinesOfSight {
    projection: Projection,
    sensor_from_world: DAffine3,
    noise: Noise,
    /// Depths by blocks of 1, 2, 4, ... pixels per side: of each block the least. [`NOT_KNOWN`] if one is invalid.
    levels: Vec<Depths>,
    farthest: f64,
}

/// Of an invalid pixel: nothing is sure to lie behind any place.
const NOT_KNOWN: f64 = f64::NEG_INFINITY;

struct Depths {
    cols: usize,
    least: Vec<f64>,
}

/// A place as a sensor sees it.
struct View {
    /// Row and column, pixel centres at whole numbers.
    pixel: [f64; 2],
    /// As values are, larger further away.
    depth: f64,
    /// Depth that a unit of length along the ray makes.
    depth_by_length: f64,
    /// Distance of neighbouring rows and columns there.
    pitch: [f64; 2],
}

impl LinesOfSight {
    /// Whether places can be looked up in images of this projection: not in a grid of points seen along parallel rays, which may
    /// have been made from several views (Stanford's are of one, but say nothing of it).
    pub fn are_known(projection: &Projection) -> bool {
        !matches!(projection, Projection::PointGrid(Viewing::Parallel(_)))
    }

    /// Of an image and its noise. `None` if rays aren't known. O(pixels), 11 bytes per pixel, for a grid of points 32 more.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn new(image: &RangeImage, noise: Noise, progress: &Progress<'_>) -> Result<Option<Self>> {
        let sensor_from_world = image.world_from_sensor.inverse();
        match (image.samples(), *image.projection()) {
            (Samples::Values(values), projection) => {
                Self::of_values(projection, sensor_from_world, image.cols(), values, noise, progress).map(Some)
            }
            (Samples::Points(_), Projection::PointGrid(Viewing::From(eye))) => {
                let Some(around) = around::Around::new(image, eye, progress)? else { return Ok(None) };
                let eye_from_sensor = DAffine3::from_mat3_translation(around.turn, -(around.turn * eye));
                let eye_from_world = eye_from_sensor * sensor_from_world;
                Self::of_values(around.projection, eye_from_world, around.cols, &around.ranges, noise, progress)
                    .map(Some)
            }
            (Samples::Points(_), _) => Ok(None),
        }
    }

    fn of_values(
        projection: Projection,
        sensor_from_world: DAffine3,
        cols: usize,
        values: &[f64],
        noise: Noise,
        progress: &Progress<'_>,
    ) -> Result<Self> {
        let away = if matches!(projection, Projection::Orthographic { .. }) { -1.0 } else { 1.0 };
        let mut farthest = f64::NEG_INFINITY;
        let mut least = Vec::with_capacity(values.len());
        for block in progress.ranges(values.len()) {
            least.extend(values[block?].iter().map(|value| {
                let depth = if value.is_nan() { NOT_KNOWN } else { away * value };
                farthest = depth.max(farthest);
                depth
            }));
        }
        let mut levels = vec![Depths { cols, least }];
        let mut pace = Pace::new(progress);
        while let Some(finer) = levels.last()
            && finer.least.len() > 1
        {
            let (rows, cols) = (finer.least.len() / finer.cols, finer.cols.div_ceil(2));
            let mut least = vec![f64::INFINITY; rows.div_ceil(2) * cols];
            for (row, depths) in finer.least.chunks_exact(finer.cols).enumerate() {
                let coarse = &mut least[row / 2 * cols..][..cols];
                for (coarse, pair) in coarse.iter_mut().zip(depths.chunks(2)) {
                    *coarse = pair.iter().fold(*coarse, |a, &b| a.min(b));
                }
                pace.after(depths.len())?;
            }
            levels.push(Depths { cols, least });
        }
        Ok(LinesOfSight { projection, sensor_from_world, noise, levels, farthest })
    }

    fn rows(&self) -> usize {
        self.levels[0].least.len() / self.levels[0].cols.max(1)
    }

    fn view(&self, at: DVec3) -> Option<View> {
        match self.projection {
            Projection::Orthographic { first, step } => Some(View {
                pixel: [(at.y - first[1]) / step[1], (at.x - first[0]) / step[0]],
                depth: -at.z,
                depth_by_length: 1.0,
                pitch: [step[1].abs(), step[0].abs()],
            }),
            Projection::Pinhole { focal, centre, depth } => (at.z > 0.0).then(|| {
                let length = at.length();
                let (depth, depth_by_length) = match depth {
                    DepthKind::Planar => (at.z, at.z / length),
                    DepthKind::Ray => (length, 1.0),
                };
                View {
                    pixel: [centre[1] + focal[1] * at.y / at.z, centre[0] + focal[0] * at.x / at.z],
                    depth,
                    depth_by_length,
                    pitch: [at.z / focal[1].abs(), at.z / focal[0].abs()],
                }
            }),
            Projection::Spherical { first, step } => {
                let (length, across) = (at.length(), at.truncate().length());
                let turn = std::f64::consts::TAU / step[0].abs();
                // Azimuths are the same after a turn: half a pixel before the first column and up to a turn later.
                let col = ((at.y.atan2(at.x) - first[0]) / step[0] + 0.5).rem_euclid(turn) - 0.5;
                Some(View {
                    pixel: [(at.z.atan2(across) - first[1]) / step[1], col],
                    depth: length,
                    depth_by_length: 1.0,
                    pitch: [length * step[1].abs(), across * step[0].abs()],
                })
            }
            Projection::PointGrid(_) => None,
        }
    }

    /// The answer of the image about a place in the world whose samples have this standard deviation along their rays. It and the image's
    /// pose may be off by `tolerance`. Both in world units.
    pub fn see(&self, place: DVec3, deviation: f64, tolerance: f64) -> Seen {
        let Some(view) = self.view(self.sensor_from_world.transform_point3(place)) else { return Seen::Nothing };
        let (rows, cols) = (self.rows(), self.levels[0].cols);
        let inside = |at: f64, count: usize| at > -0.5 && at < count as f64 - 0.5;
        if !inside(view.pixel[0], rows) || !inside(view.pixel[1], cols) {
            return Seen::Nothing;
        }
        let [row, col] = view.pixel.map(|x| (x + 0.5) as usize);
        let sample = self.levels[0].least[row * cols + col];
        let mut slack = tolerance.max(BEHIND * deviation) * view.depth_by_length;
        if sample < view.depth - slack {
            return Seen::Nothing;
        }
        if sample > view.depth + slack {
            let of_sample = self.noise.deviation(sample / view.depth_by_length, 1.0);
            slack = slack.max(BEHIND * of_sample * view.depth_by_length);
        }
        if sample <= view.depth + slack {
            return Seen::Surface;
        }
        // A thing smaller than a pixel may have been missed.
        if view.pitch[0].max(view.pitch[1]) > tolerance {
            return Seen::Nothing;
        }
        let around = view.pitch.map(|pitch| ASIDE * tolerance / pitch + 0.5);
        let [first, last] = [-1.0, 1.0].map(|side| [0, 1].map(|i| (view.pixel[i] + side * around[i]).round()));
        if first[0] < 0.0 || first[1] < 0.0 || last[0] >= rows as f64 || last[1] >= cols as f64 {
            return Seen::Nothing;
        }
        // Of blocks this large up to six lie side by side in the window, and they reach little further.
        let level = (around[0].max(around[1]).log2().max(0.0).floor() as usize).min(self.levels.len() - 1);
        let blocks = [first, last].map(|corner| corner.map(|x| x as usize >> level));
        let depths = &self.levels[level];
        let is_behind = (blocks[0][0]..=blocks[1][0]).all(|row| {
            let depths = &depths.least[row * depths.cols..];
            depths[blocks[0][1]..=blocks[1][1]].iter().all(|&least| least > view.depth + slack)
        });
        if is_behind { Seen::Through } else { Seen::Nothing }
    }

    /// Whether all of 3 x 3 pixels around a place lie behind it, along their rays, by more than `slack`, in world units, and by more than
    /// their noise: a surface there would have been met.
    pub fn is_past(&self, place: DVec3, slack: f64) -> bool {
        let Some(view) = self.view(self.sensor_from_world.transform_point3(place)) else { return false };
        let (rows, cols) = (self.rows(), self.levels[0].cols);
        let is_inside = |at: f64, count: usize| at > 0.5 && at < count as f64 - 1.5;
        if !is_inside(view.pixel[0], rows) || !is_inside(view.pixel[1], cols) {
            return false;
        }
        let [row, col] = view.pixel.map(|x| x.round() as usize);
        let depths = &self.levels[0].least;
        let nearest = view.depth + slack * view.depth_by_length;
        let is_behind = |depth: f64| {
            depth > nearest && {
                let noise = BEHIND * self.noise.deviation(depth / view.depth_by_length, 1.0) * view.depth_by_length;
                depth > view.depth + noise
            }
        };
        (row - 1..=row + 1).all(|row| depths[row * cols + col - 1..][..3].iter().all(|&depth| is_behind(depth)))
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> u64 {
        self.levels.iter().map(|depths| size_of_val(&depths.least[..]) as u64).sum()
    }

    /// Whether the image may say anything of places in a ball. Both in the world.
    pub fn may_see(&self, centre: DVec3, radius: f64) -> bool {
        let at = self.sensor_from_world.transform_point3(centre);
        match self.projection {
            Projection::Orthographic { .. } => -at.z - radius <= self.farthest,
            Projection::Pinhole { focal, centre, .. } => {
                let (near, far) = (at.z - radius, at.z + radius);
                if near <= 0.0 {
                    return far > 0.0;
                }
                let counts = [self.levels[0].cols, self.rows()];
                let crosses = |axis: usize| {
                    let [low, high] = [at[axis] - radius, at[axis] + radius];
                    let ends = [low / if low < 0.0 { near } else { far }, high / if high > 0.0 { near } else { far }]
                        .map(|slope| centre[axis] + focal[axis] * slope);
                    ends[0].max(ends[1]) > -0.5 && ends[0].min(ends[1]) < counts[axis] as f64 - 0.5
                };
                near <= self.farthest && crosses(0) && crosses(1)
            }
            _ => at.length() - radius <= self.farthest,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::range_image::test_images::{ahead, as_point_grid, projections, render, sphere};

    fn sight(image: &RangeImage) -> LinesOfSight {
        LinesOfSight::new(image, Noise::default(), &Progress::none()).unwrap().unwrap()
    }

    #[test]
    fn places_before_on_and_behind_a_surface() {
        let place = DAffine3::from_rotation_translation(glam::DQuat::from_rotation_y(2.0), DVec3::new(7.0, -3.0, 5.0));
        for projection in projections(90, 80) {
            let middle = ahead(&projection);
            let (_, along) = projection.ray(45, 40, DVec3::NAN);
            // A ball before a larger one.
            let (near, far) = (sphere(middle, 0.1), sphere(middle + 11.0 * along, 10.0));
            let mut image = render(90, 80, projection, |from, to| near(from, to).or_else(|| far(from, to)));
            image.world_from_sensor = place;
            let mut images = vec![image.clone()];
            if !matches!(projection, Projection::Orthographic { .. }) {
                images.push(as_point_grid(&image));
                images[1].world_from_sensor = place;
            }
            for image in &images {
                let sight = sight(image);
                let see = |at: DVec3| {
                    let at = place.transform_point3(at);
                    assert!(sight.may_see(at, 0.01) || sight.see(at, 0.0, 0.03) == Seen::Nothing);
                    sight.see(at, 0.0, 0.03)
                };
                let side = along.any_orthonormal_vector();
                assert_eq!(see(middle - 0.3 * along), Seen::Through, "{projection:?}");
                assert_eq!(see(middle - 0.1 * along), Seen::Surface, "{projection:?}");
                assert_eq!(see(middle + 0.1 * along), Seen::Nothing, "{projection:?}");
                // Beside the ball, before what is behind it; too near to the ball to tell.
                assert_eq!(see(middle - 0.3 * along + 0.16 * side), Seen::Through, "{projection:?}");
                assert_eq!(see(middle + 0.11 * side), Seen::Nothing, "{projection:?}");
                // Outside of the image, and behind the sensor.
                assert_eq!(see(middle + 5.0 * side), Seen::Nothing, "{projection:?}");
                if !matches!(projection, Projection::Orthographic { .. }) {
                    assert_eq!(see(-middle), Seen::Nothing, "{projection:?}");
                }
                // Pixels may measure anything.
                let past = |at: DVec3| sight.is_past(place.transform_point3(at), 0.03);
                assert!(past(middle - 0.3 * along) && past(middle - 0.3 * along + 0.16 * side), "{projection:?}");
                for at in [middle - 0.1 * along, middle + 0.1 * along, middle + 0.11 * side, middle + 5.0 * side] {
                    assert!(!past(at), "{projection:?}");
                }
                // In pixels that are larger than what is asked for nothing is seen through.
                let coarse = sight.see(place.transform_point3(middle - 0.3 * along), 0.0, 0.001);
                assert_eq!(coarse, Seen::Nothing, "{projection:?}");
            }
        }
    }

    #[test]
    fn a_scanner_looks_all_around() {
        let projection =
            Projection::Spherical { first: [-3.0, -1.2], step: [std::f64::consts::TAU / 360.0, 2.4 / 119.0] };
        let image = render(120, 360, projection, |from, to| {
            sphere(DVec3::new(0.5, 0.0, 0.0), 3.0)(from + 100.0 * to, -to).map(|t| 100.0 - t)
        });
        for image in [as_point_grid(&image), image] {
            let sight = sight(&image);
            let mut through = 0;
            for k in 0..400 {
                let (azimuth, up) = (k as f64 * 0.618 * std::f64::consts::TAU, (k % 20) as f64 / 10.0 - 0.95);
                let to = DVec3::new(azimuth.cos(), azimuth.sin(), up).normalize();
                assert!(sight.see(1.5 * to, 0.0, 0.1) != Seen::Surface);
                through += usize::from(sight.see(1.5 * to, 0.0, 0.1) == Seen::Through);
                assert!(sight.see(4.5 * to, 0.0, 0.1) == Seen::Nothing);
            }
            // All but where the image begins and ends.
            assert!(through > 360, "{through}");
        }
    }

    #[test]
    fn grids_of_points_with_nothing_to_tell_say_nothing() {
        let viewing = Viewing::From(DVec3::ZERO);
        for (rows, cols, points) in [
            (1, 1, vec![[1.0, 0.0, 0.0]]),
            (2, 2, vec![[f32::NAN; 3]; 4]),
            (2, 2, vec![[1.0, 0.0, 0.0]; 4]),
            (2, 2, vec![[0.0; 3]; 4]),
            (1, 3, vec![[1.0, 0.0, 0.0], [1.0, 0.1, 0.0], [1.0, 0.2, 0.0]]),
        ] {
            let image = RangeImage::from_points(rows, cols, points, viewing).unwrap();
            if let Some(sight) = LinesOfSight::new(&image, Noise::default(), &Progress::none()).unwrap() {
                assert_eq!(sight.see(DVec3::new(0.5, 0.0, 0.0), 0.0, 0.1), Seen::Nothing);
            }
        }
    }
}
