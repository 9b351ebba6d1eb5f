//! Values that stand for nothing, though they are finite: the background of a rendered depth image is 1e10, or the largest
//! number of half precision.

use super::{Projection, RangeImage, Samples, repeats};
use base::error::Shown;
use base::log::{self, Level};

/// Numbers that programs write where a ray meets nothing: largest of half precision and of 16 bits, Blender's clip end, the
/// largest of single precision. Values are in another unit by then, perhaps: one of so many tenths, hundredths...
const MARKS: [f64; 4] = [65504.0, 65535.0, 1e10, f32::MAX as f64];
const UNITS: i32 = 5;

/// Values are far if so many powers of two lie between them and all others: marks, any one depth, any one height (maps have flat
/// ground, and flat roofs on it), points. Zeros are no scale that others could be far beyond.
const GAP_OF_MARKS: usize = 3;
const GAP_OF_DEPTHS: usize = 10;
const GAP_OF_HEIGHTS: usize = 16;
const GAP_OF_POINTS: usize = 20;

/// Share of the samples that the others are at least: a few that are close may be wrong instead.
const OTHERS: f64 = 0.01;

/// The samples that were left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Far {
    /// Pixels.
    pub count: usize,
    /// Farthest of their values.
    pub value: f64,
    /// Farthest of all others.
    pub others: f64,
}

impl Far {
    /// A sentence for people.
    pub fn in_words(&self) -> String {
        let Far { count, value, others } = *self;
        let are = if count == 1 { "pixel is" } else { "pixels are" };
        format!(
            "{count} {are} left out, with values up to {}: all others lie within {}, so these stand for no measurement",
            Shown(value),
            Shown(others)
        )
    }
}

impl RangeImage {
    /// Leaves out samples that lie far beyond all others, and tells the log. It also tells that pixels are repeated, as they are in images
    /// that were enlarged: merging and aligning take these in their own size. For images that programs hand over as arrays.
    pub fn leave_out_what_is_no_measurement(&mut self) {
        if let Some(far) = leave_out(self) {
            log::tell(Level::Warning, &format!("{}: {}", self.called(), far.in_words()));
        }
        if let Some(own_size) = repeats::undone(self) {
            let words = repeats::in_words(self, [own_size.cols(), own_size.rows()]);
            log::tell(Level::Info, &format!("{}: {words}", self.called()));
        }
    }
}

/// Leaves out the samples that lie far beyond all others: single values most of which are one and the same, or points.
/// O(pixels).
pub fn leave_out(image: &mut RangeImage) -> Option<Far> {
    let sizes = Sizes::of(image);
    // Most images have no such gap, and are looked at once.
    sizes.least_beyond(GAP_OF_MARKS)?;
    let size = |pixel: usize| size(image, pixel);
    let farthest = (0..image.len()).map(size).fold(0.0, f64::max);
    let gap = match (image.samples(), image.projection()) {
        (Samples::Points(_), _) => GAP_OF_POINTS,
        (Samples::Values(_), _) if is_mark(farthest) => GAP_OF_MARKS,
        (Samples::Values(_), Projection::Orthographic { .. }) => GAP_OF_HEIGHTS,
        (Samples::Values(_), _) => GAP_OF_DEPTHS,
    };
    let least = sizes.least_beyond(gap)?;
    let far: Vec<usize> = (0..image.len()).filter(|&pixel| size(pixel) >= least).collect();
    let alike = far.iter().filter(|&&pixel| size(pixel) >= farthest * (1.0 - 1e-6)).count();
    if matches!(image.samples(), Samples::Values(_)) && 2 * alike < far.len() {
        return None;
    }
    let others = (0..image.len()).map(size).filter(|&size| size < least).fold(0.0, f64::max);
    let count = far.len();
    image.leave_out(far);
    Some(Far { count, value: farthest, others })
}

/// Whether a number is one that programs write where a ray meets nothing, in some unit.
fn is_mark(value: f64) -> bool {
    let marks = MARKS.iter().flat_map(|mark| (0..UNITS).map(move |unit| mark / 10_f64.powi(unit)));
    marks.into_iter().any(|mark| (value / mark - 1.0).abs() < 1e-6)
}

/// Size of a value, or the largest coordinate of a point. NaN for an invalid pixel.
fn size(image: &RangeImage, pixel: usize) -> f64 {
    match image.samples() {
        Samples::Values(values) => values[pixel].abs(),
        Samples::Points(points) => size_of_point(points[pixel]),
    }
}

fn size_of_point(point: [f32; 3]) -> f64 {
    let [x, y, z] = point.map(|x| f64::from(x.abs()));
    if x.is_nan() { f64::NAN } else { x.max(y).max(z) }
}

/// Number of sizes of each power of two, but zeros.
struct Sizes {
    counts: Vec<usize>,
    total: usize,
}

/// Bits of a number >= 0 before its fraction are its power of two.
const FRACTION: u32 = 52;

impl Sizes {
    fn of(image: &RangeImage) -> Sizes {
        let mut counts = vec![0_usize; 1 << 11];
        let mut count = |size: f64| counts[(size.to_bits() >> FRACTION) as usize] += 1;
        match image.samples() {
            Samples::Values(values) => values.iter().for_each(|value| count(value.abs())),
            Samples::Points(points) => points.iter().for_each(|&point| count(size_of_point(point))),
        }
        // NaN, and zero.
        counts.truncate(counts.len() - 1);
        counts[0] = 0;
        let total = counts.iter().sum();
        Sizes { counts, total }
    }

    /// The power of two from which on sizes are far, after a gap of so many powers.
    fn least_beyond(&self, gap: usize) -> Option<f64> {
        let top = self.counts.iter().rposition(|&count| count > 0)?;
        let mut far = top;
        loop {
            let next = self.counts[..far].iter().rposition(|&count| count > 0)?;
            if far - next > gap {
                let others: usize = self.counts[..=next].iter().sum();
                let is_enough = others as f64 >= OTHERS * self.total as f64 && others > 3;
                return is_enough.then(|| f64::from_bits((far as u64) << FRACTION));
            }
            far = next;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{DepthKind, Viewing};
    use super::*;

    const CAMERA: Projection = Projection::Pinhole { focal: [20.0; 2], centre: [10.0; 2], depth: DepthKind::Planar };
    const ABOVE: Projection = Projection::Orthographic { first: [0.0; 2], step: [1.0; 2] };

    fn image(projection: Projection, value: impl Fn(usize, usize) -> f64) -> RangeImage {
        RangeImage::from_values(20, 20, (0..400).map(|i| value(i / 20, i % 20)).collect(), projection).unwrap()
    }

    #[test]
    fn a_background_that_stands_for_nothing_is_left_out() {
        for (mark, near) in [
            (1e10, 3.0),
            (65504.0, 3.0),
            (65504.0, 900.0),
            (65535.0, 3.0),
            (65.504, 1.5),
            (3.4028234e38, 1e3),
            (1e6, 2.0),
        ] {
            for projection in [CAMERA, ABOVE] {
                for share in [1, 10, 18] {
                    // Pixels of the rim are mixed with the background.
                    let value = |r: usize, c: usize| match c {
                        c if c < share => mark,
                        c if c == share && r < share => 0.5 * mark,
                        _ => near + 0.01 * r as f64,
                    };
                    let mut image = image(projection, value);
                    let far = leave_out(&mut image).unwrap_or_else(|| panic!("{mark} beside {near}, {share}"));
                    assert!(far.count == 21 * share && (far.value / mark - 1.0).abs() < 1e-6, "{far:?}");
                    assert_eq!(image.valid_count(), 400 - far.count);
                    assert!(far.others <= near + 0.19);
                    assert_eq!(leave_out(&mut image), None);
                }
            }
        }
        let mut points: Vec<[f32; 3]> = (0..400).map(|i| [i as f32 * 0.01, 1.0, 2.0]).collect();
        points[7] = [1e9, -3e9, 1e10];
        let mut grid = RangeImage::from_points(20, 20, points, Viewing::From(glam::DVec3::ZERO)).unwrap();
        assert_eq!(leave_out(&mut grid).unwrap().count, 1);
        let words = Far { count: 1, value: 1e10, others: 3.5 }.in_words();
        assert_eq!(
            words,
            "1 pixel is left out, with values up to 1e10: all others lie within 3.5, so these stand for no measurement"
        );
    }

    /// Points that stand for nothing at the sensor do not make the others far.
    #[test]
    fn zeros_are_no_scale() {
        let at = |i: usize| if i % 20 < 8 { [0.0; 3] } else { [i as f32 * 0.01, 1.0, 2.0] };
        let mut grid =
            RangeImage::from_points(20, 20, (0..400).map(at).collect(), Viewing::From(glam::DVec3::ZERO)).unwrap();
        assert_eq!(leave_out(&mut grid), None);
        // One roof on flat ground, or one pit in it.
        for (ground, level) in [(0.0, 3.0), (1e-4, 3.0), (0.0, -3.0), (0.0, 65535.0)] {
            let mut map = image(ABOVE, |r, c| if (4..9).contains(&r) && c > 6 { level } else { ground });
            assert_eq!(leave_out(&mut map), None, "{level} on {ground}");
        }
    }

    #[test]
    fn what_may_be_measured_stays() {
        let stays = |projection: Projection, value: &dyn Fn(usize, usize) -> f64| {
            let mut image = image(projection, value);
            let before = image.clone();
            assert_eq!(leave_out(&mut image), None);
            assert!(image.valid_count() == before.valid_count());
        };
        for projection in [CAMERA, ABOVE] {
            stays(projection, &|_, _| f64::NAN);
            stays(projection, &|_, _| 1e10);
            stays(projection, &|_, _| 65504.0);
            // A hand before a wall; a few specks on the lens before it.
            stays(projection, &|r, _| if r < 9 { 0.05 } else { 20.0 });
            stays(projection, &|r, c| if r == 0 && c < 3 { 0.001 } else { 20.0 });
            // Depths up to a mountain's, and heights in millimetres that reach the largest of 16 bits.
            stays(projection, &|r, _| 2.0_f64.powi(r as i32));
            stays(projection, &|r, c| 40000.0 + 1344.0 * r as f64 - 32.0 * (c / 20) as f64);
            // Many different ones that lie far away are something else.
            stays(projection, &|r, c| if r < 9 { 1.0 } else { 5000.0 + (r * c) as f64 });
        }
    }
}
