//! Lenses that distort, and images without their distortion.

use glam::DVec2;

use image::frame::Camera;
use mesh::srgb::Mix;

/// A distortion below this moves no pixel of any image by a tenth.
const NO_DISTORTION: f64 = 1e-6;

/// Steps in which the distortion of a place is undone, and pixels by which it may be missed then.
const STEPS: usize = 100;
const CLOSE: f64 = 0.01;

/// Least share of an image's side that is left without distortion: lenses that leave less are no pinhole's.
const LEAST: f64 = 0.5;

/// The distortion of a lens as OpenCV has it: along the radius by powers 2, 4, 6 and 8, and across.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Lens {
    pub(super) radial: [f64; 4],
    pub(super) tangential: [f64; 2],
}

impl Lens {
    /// The lens, unless it does not distort.
    pub(super) fn if_any(self) -> Option<Lens> {
        let distorts = |k: &f64| k.abs() > NO_DISTORTION;
        self.radial.iter().chain(&self.tangential).any(distorts).then_some(self)
    }

    /// Its coefficients that distort, for people.
    pub(super) fn shown(&self) -> String {
        let named = ["k1", "k2", "k3", "k4", "p1", "p2"].into_iter().zip(self.radial.iter().chain(&self.tangential));
        let distort = named.filter(|(_, k)| k.abs() > NO_DISTORTION);
        distort.map(|(name, k)| format!("{name} = {k}")).collect::<Vec<_>>().join(", ")
    }

    /// The place in the image plane at distance 1 where the lens puts a place of it.
    fn distorted(&self, at: DVec2) -> DVec2 {
        let ([k1, k2, k3, k4], [p1, p2]) = (self.radial, self.tangential);
        let r = at.length_squared();
        let along = 1.0 + r * (k1 + r * (k2 + r * (k3 + r * k4)));
        let across = 2.0 * at.x * at.y;
        at * along + DVec2::new(p1 * across + p2 * (r + 2.0 * at.x * at.x), p1 * (r + 2.0 * at.y * at.y) + p2 * across)
    }

    /// The place that the lens puts there. `None` if none is found.
    fn undistorted(&self, at: DVec2, close: f64) -> Option<DVec2> {
        let mut found = at;
        for _ in 0..STEPS {
            let miss = at - self.distorted(found);
            if miss.length() < close {
                return Some(found);
            }
            found += miss;
        }
        None
    }
}

/// A part of an image, without the distortion of its lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Part {
    /// The camera of the whole image.
    whole: Camera,
    lens: Option<Lens>,
    /// First column and row.
    first: [usize; 2],
    /// Columns and rows.
    size: [usize; 2],
}

impl Part {
    /// All of an image without distortion. Columns and rows from the first to the one behind.
    pub(super) fn of(whole: Camera, [columns, rows]: [[usize; 2]; 2]) -> Part {
        let size = [columns, rows].map(|[from, to]| to.saturating_sub(from));
        Part { whole, lens: None, first: [columns[0], rows[0]], size }
    }

    /// The part of an image of a lens that all borders of the image lie outside of.
    ///
    /// # Errors
    /// The words for a lens whose distortion can't be undone.
    pub(super) fn undistorted(whole: Camera, lens: Lens) -> Result<Part, String> {
        let problem =
            || format!("the distortion of its lens can't be undone ({}): undistort the images first", lens.shown());
        let (focal, centre) = (DVec2::from(whole.focal), DVec2::from(whole.centre));
        let close = CLOSE / focal.abs().max_element();
        let ideal = |column: usize, row: usize| {
            let at = (DVec2::new(column as f64, row as f64) - centre) / focal;
            lens.undistorted(at, close).map(|found| (found * focal + centre).to_array())
        };
        let [columns, rows] = whole.size.unwrap_or_default();
        let mut part = Part { whole, lens: Some(lens), first: [0; 2], size: [0; 2] };
        for (axis, [length, across]) in [[columns, rows], [rows, columns]].into_iter().enumerate() {
            let end = |at: usize| {
                let of = move |k| if axis == 0 { ideal(at, k) } else { ideal(k, at) };
                (0..across).map(move |k| of(k).map(|found| found[axis]))
            };
            let low = end(0).try_fold(0.0, |low: f64, at| at.map(|at| low.max(at))).ok_or_else(problem)?;
            let last = length.saturating_sub(1);
            let high =
                end(last).try_fold(last as f64, |high: f64, at| at.map(|at| high.min(at))).ok_or_else(problem)?;
            let (first, count) = (low.ceil(), high.floor() - low.ceil() + 1.0);
            if !(count >= LEAST * length as f64) {
                return Err(problem());
            }
            (part.first[axis], part.size[axis]) = (first as usize, count as usize);
        }
        Ok(part)
    }

    /// Columns and rows of the whole image.
    pub(super) fn whole_size(&self) -> [usize; 2] {
        self.whole.size.unwrap_or_default()
    }

    /// The camera of the part.
    pub(super) fn camera(&self) -> Camera {
        let centre = [0, 1].map(|axis| self.whole.centre[axis] - self.first[axis] as f64);
        Camera { centre, size: Some(self.size), ..self.whole }
    }

    /// The pixels of the part.
    pub(super) fn pixels(&self, all: Vec<[u8; 3]>) -> Vec<[u8; 3]> {
        let [columns, rows] = self.whole.size.unwrap_or_default();
        if self.size == [columns, rows] && self.lens.is_none() {
            return all;
        }
        let places = (0..self.size[1]).flat_map(|row| (0..self.size[0]).map(move |column| [column, row]));
        let places = places.map(|[column, row]| [column + self.first[0], row + self.first[1]]);
        let Some(lens) = self.lens else {
            return places.map(|[column, row]| all[row * columns + column]).collect();
        };
        let (focal, centre) = (DVec2::from(self.whole.focal), DVec2::from(self.whole.centre));
        places
            .map(|[column, row]| {
                let ideal = (DVec2::new(column as f64, row as f64) - centre) / focal;
                let at = lens.distorted(ideal) * focal + centre;
                between(&all, [columns, rows], at)
            })
            .collect()
    }
}

/// The colour between the pixels around a place. Places outside are moved to the border.
fn between(pixels: &[[u8; 3]], [columns, rows]: [usize; 2], at: DVec2) -> [u8; 3] {
    let at = at.clamp(DVec2::ZERO, DVec2::new((columns - 1) as f64, (rows - 1) as f64));
    let (left, top) = (at.x as usize, at.y as usize);
    let (right, bottom) = ((left + 1).min(columns - 1), (top + 1).min(rows - 1));
    let [x, y] = [at.x - left as f64, at.y - top as f64].map(|share| share as f32);
    let corners = [[top, left], [top, right], [bottom, left], [bottom, right]];
    let shares = [(1.0 - x) * (1.0 - y), x * (1.0 - y), (1.0 - x) * y, x * y];
    let mut mix = Mix::default();
    for ([row, column], share) in corners.into_iter().zip(shares) {
        let [r, g, b] = pixels[row * columns + column];
        mix.add_share([r, g, b, u8::MAX], share);
    }
    let [r, g, b, _] = mix.colour();
    [r, g, b]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_lens_did_is_undone() {
        let lens = Lens { radial: [-0.2, 0.05, 0.01, 0.0], tangential: [0.002, -0.003] };
        for at in [DVec2::ZERO, DVec2::new(0.6, -0.4), DVec2::new(-0.5, 0.5)] {
            let found = lens.undistorted(lens.distorted(at), 1e-9).unwrap();
            assert!(found.distance(at) < 1e-8, "{found}, not {at}");
        }
        assert_eq!(Lens { radial: [1e-7, 0.0, 0.0, 0.0], ..Lens::default() }.if_any(), None);
    }

    /// Theorem: a pixel of the part shows what the whole image shows where the lens puts the pixel's ray.
    #[test]
    fn parts_show_what_pinholes_see() {
        let whole = Camera::sized([90.0, 95.0], [60.0, 47.0], [121, 97]);
        for k in [-0.15, 0.15] {
            let lens = Lens { radial: [k, 0.0, 0.0, 0.0], tangential: [0.001, 0.0] };
            let part = Part::undistorted(whole, lens).unwrap();
            let camera = part.camera();
            let [columns, rows] = camera.size.unwrap();
            assert!(columns > 80 && rows > 70 && columns <= 121 && rows <= 97, "{columns} x {rows}");
            // Smooth colours of the directions in which the lens looks.
            let shown = |ray: DVec2| [128.0 + 120.0 * ray.x, 128.0 - 120.0 * ray.y, 90.0].map(|x| x as u8);
            let pixels = (0..97).flat_map(|row| (0..121).map(move |column| [column, row])).map(|[column, row]| {
                let at = (DVec2::new(f64::from(column), f64::from(row)) - DVec2::from(whole.centre))
                    / DVec2::from(whole.focal);
                shown(lens.undistorted(at, 1e-6).unwrap())
            });
            let found = part.pixels(pixels.collect());
            assert_eq!(found.len(), columns * rows);
            for (i, colour) in found.iter().enumerate() {
                let at = DVec2::new((i % columns) as f64, (i / columns) as f64);
                let ray = (at - DVec2::from(camera.centre)) / DVec2::from(camera.focal);
                let apart = shown(ray).iter().zip(colour).map(|(a, b)| a.abs_diff(*b)).max().unwrap();
                assert!(apart <= 3, "{ray}: {colour:?}");
            }
        }
        let wild = Lens { radial: [-3.0, 0.0, 0.0, 0.0], ..Lens::default() };
        assert!(Part::undistorted(whole, wild).unwrap_err().contains("can't be undone (k1 = -3"));
    }
}
