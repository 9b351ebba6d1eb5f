//! Depth images that were enlarged by repeating pixels, as exporters do that store depth in the size of a photo: recognized,
//! and undone.
//!
//! Each column of such an image equals the one before it, in all rows, unless a block begins there. So do rows. Blocks begin where rounding
//! puts them: at each multiple of the factor. Quantized depth has equal neighbours, too, but its steps lie where the surface has them: at
//! other columns in other rows, and not at the same multiples in both directions.

use glam::DVec2;

use super::{Projection, RangeImage, Samples};

/// Blocks along an axis, at least: fewer may be chance. Along the only enlarged axis, more.
const LEAST: usize = 16;
const LEAST_ALONE: usize = 32;

/// Share of the blocks, at least, whose beginning shows: a missing margin hides some.
const SHOWN: f64 = 0.75;

/// Smallest factor, and how much those of both axes may differ.
const SMALLEST: f64 = 1.25;
const UNLIKE: f64 = 1.05;

/// The image in the size that it had before it was enlarged. `None` for one that was not. Attributes are those of the pixels in the middle
/// of each block. Pinhole images only: heights of blocks may be buildings. O(1) rows are looked at if neighbours differ, O(pixels) if they
/// are equal.
pub fn undone(image: &RangeImage) -> Option<RangeImage> {
    let (Samples::Values(values), &Projection::Pinhole { focal, centre, depth }) =
        (image.samples(), image.projection())
    else {
        return None;
    };
    let blocks = blocks(values, [image.cols(), image.rows()])?;
    let middles = blocks.map(|axis| axis.middles());
    let [cols, rows] = [middles[0].len(), middles[1].len()];
    let pixels: Vec<usize> =
        middles[1].iter().flat_map(|row| middles[0].iter().map(move |col| row * image.cols() + col)).collect();
    let factor = DVec2::new(cols as f64 / image.cols() as f64, rows as f64 / image.rows() as f64);
    let projection = Projection::Pinhole {
        focal: (DVec2::from(focal) * factor).to_array(),
        centre: ((DVec2::from(centre) + 0.5) * factor - 0.5).to_array(),
        depth,
    };
    let values = pixels.iter().map(|&pixel| values[pixel]).collect();
    let mut small = RangeImage::from_values(rows, cols, values, projection).ok()?;
    (small.name, small.world_from_sensor) = (image.name.clone(), image.world_from_sensor);
    small.crs = image.crs.clone();
    small.colour = image.colour.as_ref().map(|all| pixels.iter().map(|&pixel| all[pixel]).collect());
    small.intensity = image.intensity.as_ref().map(|all| pixels.iter().map(|&pixel| all[pixel]).collect());
    small.confidence = image.confidence.as_ref().map(|all| pixels.iter().map(|&pixel| all[pixel]).collect());
    Some(small)
}

/// Says that an image is one of `size` columns and rows, enlarged.
pub fn in_words(image: &RangeImage, size: [usize; 2]) -> String {
    let (cols, rows) = (image.cols(), image.rows());
    format!(
        "{cols} x {rows} pixels of depth are {} x {} pixels, enlarged by repeating them: merging and aligning take them in that size",
        size[0], size[1]
    )
}

/// Enlargement of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Axis {
    /// Pixels, and blocks of equal ones.
    pixels: usize,
    blocks: usize,
    /// Whether a pixel takes the block that its centre lies in, and not the one that its beginning lies in.
    by_centre: bool,
}

impl Axis {
    fn block(&self, pixel: usize) -> usize {
        if self.by_centre {
            (2 * pixel + 1) * self.blocks / (2 * self.pixels)
        } else {
            pixel * self.blocks / self.pixels
        }
    }

    fn factor(&self) -> f64 {
        self.pixels as f64 / self.blocks as f64
    }

    /// The pixel in the middle of each block.
    fn middles(&self) -> Vec<usize> {
        let mut firsts: Vec<usize> = vec![0];
        firsts.extend((1..self.pixels).filter(|&pixel| self.block(pixel) != self.block(pixel - 1)));
        let ends = firsts[1..].iter().copied().chain([self.pixels]);
        firsts.iter().zip(ends).map(|(first, end)| (first + end - 1) / 2).collect()
    }

    /// The fewest blocks that begin wherever `changes` has a change.
    fn of(changes: &[bool]) -> Option<Axis> {
        let pixels = changes.len();
        let shown = 1 + changes.iter().filter(|&&change| change).count();
        let most = (pixels as f64 / SMALLEST).min(shown as f64 / SHOWN) as usize;
        (shown.max(LEAST)..=most)
            .flat_map(|blocks| [false, true].map(|by_centre| Axis { pixels, blocks, by_centre }))
            .find(|axis| axis.fits(changes))
    }

    /// Whether a block begins wherever there is a change.
    fn fits(&self, changes: &[bool]) -> bool {
        (1..self.pixels).all(|pixel| !changes[pixel] || self.block(pixel) != self.block(pixel - 1))
    }

    /// As much of another axis, where its few changes don't contradict: on a surface that is level along an axis nothing
    /// shows how that one was enlarged, and pixels are as wide as high.
    fn like(&self, changes: &[bool]) -> Option<Axis> {
        let pixels = changes.len();
        let blocks = (pixels as f64 / self.factor()).round() as usize;
        let shown = changes.iter().filter(|&&change| change).count();
        let axis = Axis { pixels, blocks, by_centre: self.by_centre };
        (LEAST..pixels).contains(&blocks).then_some(axis).filter(|axis| 2 * shown < blocks && axis.fits(changes))
    }
}

/// Columns and rows as they were enlarged. `None` if neither was.
fn blocks(values: &[f64], [cols, rows]: [usize; 2]) -> Option<[Axis; 2]> {
    if cols < LEAST || rows < LEAST {
        return None;
    }
    let is_dense = |changes: &[bool]| changes.iter().filter(|&&c| c).count() as f64 * SMALLEST > changes.len() as f64;
    let mut of_cols = vec![false; cols];
    for row in values.chunks_exact(cols) {
        for (change, pair) in of_cols[1..].iter_mut().zip(row.windows(2)) {
            *change |= pair[0].to_bits() != pair[1].to_bits();
        }
        if is_dense(&of_cols) {
            break;
        }
    }
    let lines: Vec<&[f64]> = values.chunks_exact(cols).collect();
    let differ = |pair: &[&[f64]]| pair[0].iter().zip(pair[1]).any(|(a, b)| a.to_bits() != b.to_bits());
    let of_rows: Vec<bool> = [false].into_iter().chain(lines.windows(2).map(differ)).collect();
    let is_fine = |changes: &[bool]| changes.windows(2).filter(|pair| pair[0] && pair[1]).count() >= LEAST;
    let whole = |pixels: usize| Axis { pixels, blocks: pixels, by_centre: false };
    let alone = |axis: &Axis, is_x: bool| is_alone(values, *axis, |at| if is_x { at } else { at / cols }, cols);
    match (Axis::of(&of_cols), Axis::of(&of_rows)) {
        (Some(x), Some(y)) if x.factor() < UNLIKE * y.factor() && y.factor() < UNLIKE * x.factor() => Some([x, y]),
        (Some(x), None) if alone(&x, true) => match x.like(&of_rows) {
            Some(y) => Some([x, y]),
            // Interpolated along the other axis, perhaps.
            None => is_fine(&of_rows).then(|| [x, whole(rows)]),
        },
        (None, Some(y)) if alone(&y, false) => match y.like(&of_cols) {
            Some(x) => Some([x, y]),
            None => is_fine(&of_cols).then(|| [whole(cols), y]),
        },
        _ => None,
    }
}

/// Whether an axis was enlarged though the other one was not. Not if the steps between its blocks are one and the same: those
/// of quantized depth on a plane.
fn is_alone(values: &[f64], axis: Axis, pixel: impl Fn(usize) -> usize, cols: usize) -> bool {
    if axis.blocks < LEAST_ALONE || axis.factor() < 2.0 {
        return false;
    }
    let before = if axis.pixels == cols { 1 } else { cols };
    let step = |at: usize| {
        let pixel = pixel(at) % axis.pixels;
        let step = (values[at] - values[at - before]).abs();
        (pixel > 0 && axis.block(pixel) != axis.block(pixel - 1) && step > 0.0).then_some(step)
    };
    let steps: Vec<f64> = (cols..values.len()).filter_map(step).collect();
    let least = steps.iter().copied().fold(f64::INFINITY, f64::min);
    let alike = steps.iter().filter(|&&step| step < 1.01 * least).count();
    !steps.is_empty() && 2 * alike < steps.len()
}

#[cfg(test)]
mod tests {
    use super::super::DepthKind;
    use super::super::test_images::*;
    use super::*;
    use glam::DVec3;

    fn camera(size: [usize; 2]) -> Projection {
        let [w, h] = size.map(|side| side as f64);
        Projection::Pinhole { focal: [0.8 * w; 2], centre: [w / 2.0 - 0.7, h / 2.0 - 0.2], depth: DepthKind::Planar }
    }

    /// A floor seen from above, with nothing where it is far away.
    fn floor_as_it_is([cols, rows]: [usize; 2]) -> RangeImage {
        let tilted = plane(DVec3::new(0.0, 0.4, 1.5), DVec3::new(0.1, -0.8, -0.6).normalize());
        render(rows, cols, camera([cols, rows]), |o, d| tilted(o, d).filter(|t| (0.0..3.0).contains(t)))
    }

    /// To whole millimetres.
    fn floor(size: [usize; 2]) -> RangeImage {
        rounded(&floor_as_it_is(size), 0.001)
    }

    fn rounded(image: &RangeImage, step: f64) -> RangeImage {
        let Samples::Values(values) = image.samples() else { panic!("no values") };
        let values = values.iter().map(|value| (value / step).round() * step).collect();
        RangeImage::from_values(image.rows(), image.cols(), values, *image.projection()).unwrap()
    }

    fn enlarged(image: &RangeImage, [cols, rows]: [usize; 2], by_centre: bool) -> RangeImage {
        let Samples::Values(values) = image.samples() else { panic!("no values") };
        let from = |pixel: usize, of: usize, to: usize| {
            if by_centre { (2 * pixel + 1) * of / (2 * to) } else { pixel * of / to }
        };
        let value =
            |i: usize| values[from(i / cols, image.rows(), rows) * image.cols() + from(i % cols, image.cols(), cols)];
        let mut projection = *image.projection();
        if let Projection::Pinhole { focal, centre, .. } = &mut projection {
            let factor = [cols as f64 / image.cols() as f64, rows as f64 / image.rows() as f64];
            *focal = [0, 1].map(|axis| focal[axis] * factor[axis]);
            *centre = [0, 1].map(|axis| (centre[axis] + 0.5) * factor[axis] - 0.5);
        }
        RangeImage::from_values(rows, cols, (0..cols * rows).map(value).collect(), projection).unwrap()
    }

    #[test]
    fn enlarged_images_come_back_as_they_were() {
        let stepped = floor([64, 48]);
        // Along one axis steps must not be the same everywhere.
        let smooth = rounded(&floor_as_it_is([64, 48]), 1e-7);
        for (size, small) in [
            ([256, 192], &stepped),
            ([480, 360], &stepped),
            ([96, 72], &stepped),
            ([128, 48], &smooth),
            ([64, 192], &smooth),
        ] {
            for by_centre in [false, true] {
                let large = enlarged(small, size, by_centre);
                let back = undone(&large).unwrap_or_else(|| panic!("{size:?}"));
                assert_eq!([back.cols(), back.rows()], [64, 48], "{size:?}");
                for pixel in (0..small.len()).filter(|&pixel| small.is_valid(pixel)) {
                    let (at, was) = (back.point_in_sensor(pixel), small.point_in_sensor(pixel));
                    assert!(at.distance(was) < 1e-12, "{size:?}: {at} for {was}");
                }
                assert_eq!(undone(&back), None);
            }
        }
        // Level along rows, or along columns: only one axis shows the blocks.
        let level = |towards: DVec3, normal: DVec3| {
            let tilted = plane(towards, normal.normalize());
            rounded(&render(48, 64, camera([64, 48]), |o, d| tilted(o, d).filter(|t| (0.0..9.0).contains(t))), 0.001)
        };
        for small in [
            level(DVec3::new(0.0, 0.4, 1.5), DVec3::new(0.0, -0.8, -0.6)),
            level(DVec3::new(0.4, 0.0, 1.5), DVec3::new(-0.8, 0.0, -0.6)),
        ] {
            let back = undone(&enlarged(&small, [256, 192], true)).unwrap();
            assert_eq!([back.cols(), back.rows()], [64, 48]);
            assert_eq!(undone(&small), None);
        }
        let mut large = enlarged(&stepped, [256, 192], true);
        large.colour = Some((0..large.len()).map(|i| [(i % 256) as u8, (i / 256) as u8, 0, 255]).collect());
        assert_eq!(undone(&large).unwrap().colour.unwrap()[64 + 2], [9, 5, 0, 255]);
    }

    #[test]
    fn what_was_not_enlarged_stays() {
        let size = [128, 96];
        let of = |value: &dyn Fn(usize, usize) -> f64| {
            let values = (0..size[0] * size[1]).map(|i| value(i / size[0], i % size[0])).collect();
            RangeImage::from_values(size[1], size[0], values, camera(size)).unwrap()
        };
        let facing = plane(DVec3::Z, DVec3::Z);
        let mut images = vec![
            of(&|_, _| 1.0),
            of(&|_, _| f64::NAN),
            of(&|r, c| if r < 40 || c < 30 { f64::NAN } else { 2.0 }),
            // A box before a wall, both face on.
            of(&|r, c| if (30..60).contains(&r) && (40..80).contains(&c) { 1.0 } else { 2.0 }),
            // A wall face on that is off by a step here and there.
            of(&|r, c| if (r * 31 + c * 17) % 97 == 0 { 1.001 } else { 1.0 }),
            render(size[1], size[0], camera(size), facing),
        ];
        for step in [0.001, 0.01, 0.1] {
            images.push(rounded(&floor(size), step));
            // Turned about the vertical, about the horizontal, a corner of both, and linear in columns as no camera sees it.
            images.extend((0..6).map(|i| rounded(&of(&|_, c| 1.0 + 0.001 * f64::from(1 << i) * c as f64), step)));
            images
                .push(rounded(&of(&|r, c| if c < 64 { 1.0 + 0.002 * c as f64 } else { 1.0 + 0.002 * r as f64 }), step));
            images.push(rounded(&of(&|r, c| 1.0 / (1.0 - 0.003 * r.max(c) as f64)), step));
            images.push(rounded(&of(&|r, c| 1.0 + 0.01 * (r / 7) as f64 + 0.001 * c as f64), step));
        }
        for (k, image) in images.iter().enumerate() {
            assert!(undone(image).is_none(), "image {k}");
        }
        // Blocks seen from above may be houses.
        let town = Projection::Orthographic { first: [0.0; 2], step: [1.0; 2] };
        let values = (0..128 * 128).map(|i| ((i / 512 * 7 + i % 128 / 4 * 5) % 11) as f64).collect();
        assert_eq!(undone(&RangeImage::from_values(128, 128, values, town).unwrap()), None);
    }
}
