//! The space before a scan's samples as its sensor saw it: coarse depths, for judging where another scan may lie.
//!
//! For one scan of very many, beside [`image::visibility`], which is exact and holds every pixel.

use glam::{DMat3, DVec3, Vec3};

use image::range_image::Viewing;

/// Most pixels along a side.
const MOST_PIXELS: f64 = 192.0;
/// Width of a pixel in distances between samples.
const SAMPLES_A_PIXEL: f64 = 2.5;
/// Samples further than this from the middle of the view, as a cosine, are seen all around.
const WIDE: f64 = 0.2;
/// Share of a mesh's area that must face one direction, so that it is taken for seen from there.
const ONE_SIDED: f64 = 0.5;

/// The thing at a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Seen {
    /// Outside of the view, or nothing came back, or it can't be told.
    Nothing,
    /// Behind something.
    Hidden,
    Surface,
    /// A surface that faces another way.
    Otherwise,
    /// The sensor saw something behind it.
    Through,
}

enum Rays {
    Parallel,
    Fan { eye: DVec3 },
    Around { eye: DVec3 },
}

/// The samples of a pixel.
#[derive(Clone, Copy)]
struct Pixel {
    /// Nearest and farthest. NaN without any.
    depths: [f32; 2],
    /// Sum of the vector areas.
    area: Vec3,
}

/// Least cosine between normals of the same surface.
const SAME: f32 = 0.75;

/// Least cosine between a ray and the normal of a surface that it may be said to go through.
const GRAZING: f64 = 0.3;

/// Depths by pixels.
pub(crate) struct DepthMap {
    rays: Rays,
    /// Rows: right, down, forward.
    view_from_local: DMat3,
    first: [f64; 2],
    pitch: [f64; 2],
    counts: [usize; 2],
    pixels: Vec<Pixel>,
}

impl DepthMap {
    /// Of samples, their vector areas and where they were seen from. Guessed for a mesh whose faces look one way. `None` where it
    /// can't be told.
    pub fn new(points: &[DVec3], areas: &[DVec3], spacing: f64, viewing: Option<Viewing>) -> Option<Self> {
        let total: f64 = areas.iter().map(|a| a.length()).sum();
        if !(total > 0.0) || !(spacing > 0.0) {
            return None;
        }
        let viewing = match viewing {
            Some(viewing) => viewing,
            None => {
                let sum: DVec3 = areas.iter().sum();
                let away: f64 = areas.iter().filter(|a| a.dot(sum) < 0.0).map(|a| a.length()).sum();
                if sum.length() < ONE_SIDED * total || away > 0.02 * total {
                    return None;
                }
                Viewing::Parallel(-sum)
            }
        };
        let (rays, forward, spread) = match viewing {
            Viewing::Parallel(direction) => (Rays::Parallel, direction.normalize_or_zero(), spacing),
            Viewing::From(eye) => {
                let directions = || points.iter().map(|&p| (p - eye).normalize_or_zero());
                let forward = directions().sum::<DVec3>().normalize_or_zero();
                let mut ranges: Vec<f64> = points.iter().map(|p| p.distance(eye)).collect();
                let middle = ranges.len() / 2;
                let range = *ranges.select_nth_unstable_by(middle, f64::total_cmp).1;
                let wide = forward == DVec3::ZERO || directions().any(|d| d.dot(forward) < WIDE);
                let rays = if wide { Rays::Around { eye } } else { Rays::Fan { eye } };
                (rays, if wide { DVec3::Z } else { forward }, spacing / range.max(f64::MIN_POSITIVE))
            }
        };
        let right = forward.any_orthonormal_vector();
        let view_from_local = DMat3::from_cols(right, forward.cross(right), forward).transpose();
        let mut map =
            DepthMap { rays, view_from_local, first: [0.0; 2], pitch: [1.0; 2], counts: [0; 2], pixels: Vec::new() };
        let seen: Vec<([f64; 3], DVec3)> =
            points.iter().zip(areas).filter_map(|(&p, &area)| Some((map.view(p)?, area))).collect();
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for (at, _) in &seen {
            for axis in 0..2 {
                low[axis] = low[axis].min(at[axis]);
                high[axis] = high[axis].max(at[axis]);
            }
        }
        let longest = (high[0] - low[0]).max(high[1] - low[1]);
        if !longest.is_finite() {
            return None;
        }
        let pitch = (SAMPLES_A_PIXEL * spread).max(longest / MOST_PIXELS).max(f64::MIN_POSITIVE);
        map.first = low;
        map.pitch = [pitch; 2];
        map.counts = [0, 1].map(|axis| ((high[axis] - low[axis]) / pitch) as usize + 1);
        map.pixels = vec![Pixel { depths: [f32::NAN; 2], area: Vec3::ZERO }; map.counts[0] * map.counts[1]];
        for &(at, area) in &seen {
            if let Some([col, row]) = map.pixel(at) {
                let pixel = &mut map.pixels[row * map.counts[0] + col];
                let depth = at[2] as f32;
                pixel.depths = [pixel.depths[0].min(depth), pixel.depths[1].max(depth)];
                pixel.area += area.as_vec3();
            }
        }
        Some(map)
    }

    /// Two coordinates across and the depth.
    #[inline]
    fn view(&self, at: DVec3) -> Option<[f64; 3]> {
        match self.rays {
            Rays::Parallel => Some((self.view_from_local * at).to_array()),
            Rays::Fan { eye } => {
                let [x, y, z] = (self.view_from_local * (at - eye)).to_array();
                (z > 0.0).then(|| [x / z, y / z, z])
            }
            Rays::Around { eye } => {
                let p = at - eye;
                Some([p.y.atan2(p.x), p.z.atan2(p.truncate().length()), p.length()])
            }
        }
    }

    #[inline]
    fn pixel(&self, at: [f64; 3]) -> Option<[usize; 2]> {
        let (x, y) = ((at[0] - self.first[0]) / self.pitch[0], (at[1] - self.first[1]) / self.pitch[1]);
        (x >= 0.0 && y >= 0.0 && x < self.counts[0] as f64 && y < self.counts[1] as f64)
            .then_some([x as usize, y as usize])
    }

    /// The evidence of the sensor on a piece of surface that may be off by `tolerance` along its normal.
    #[inline]
    pub fn see(&self, at: DVec3, normal: DVec3, tolerance: f64) -> Seen {
        let Some(view) = self.view(at) else { return Seen::Nothing };
        let Some([col, row]) = self.pixel(view) else { return Seen::Nothing };
        let Pixel { depths: here, area } = self.pixels[row * self.counts[0] + col];
        let depth = view[2];
        if here[0].is_nan() {
            return Seen::Nothing;
        }
        if f64::from(here[0]) <= depth + tolerance && f64::from(here[1]) >= depth - tolerance {
            return if area.dot(normal.as_vec3()) > SAME * area.length() { Seen::Surface } else { Seen::Otherwise };
        }
        if row == 0 || col == 0 || row + 1 >= self.counts[1] || col + 1 >= self.counts[0] {
            return Seen::Nothing;
        }
        // A little off along the normal is much along a grazing ray.
        let slope = self.direction(at).dot(normal).abs();
        if slope < GRAZING {
            return Seen::Nothing;
        }
        let off = tolerance / slope;
        let all = |says: &dyn Fn(&Pixel) -> bool| {
            (row - 1..=row + 1).all(|row| self.pixels[row * self.counts[0] + col - 1..][..3].iter().all(says))
        };
        if all(&|pixel| f64::from(pixel.depths[0]) > depth + off) {
            Seen::Through
        } else if all(&|pixel| f64::from(pixel.depths[1]) < depth - off) {
            Seen::Hidden
        } else {
            Seen::Nothing
        }
    }

    fn direction(&self, at: DVec3) -> DVec3 {
        match self.rays {
            Rays::Parallel => self.view_from_local.row(2),
            Rays::Fan { eye } | Rays::Around { eye } => (at - eye).normalize_or_zero(),
        }
    }
}
