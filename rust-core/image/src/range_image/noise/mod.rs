//! The noise of a range image, measured from its data alone.
//!
//! A plane is linear in 1 / z for a camera, nearly so in 1 / r for other rays that fan out, in z for parallel ones. Fourth differences of
//! these *heights* vanish on cubic surfaces. They leave noise, which fills the image, and relief, which doesn't: the noise is what the
//! quietest of all tiles show. Independent errors are the same at every lag of the differences, but relief grows with it. By that it is
//! told apart and taken off.

pub(super) mod heights;

use super::RangeImage;
use super::samples::SampleGrid;
use base::error::Result;
use base::progress::Progress;
use heights::{Heights, TILE, Tile, obliquity, range};

/// Share of the tiles, the quietest, that show the noise, and how many they are at least.
const QUIET: f64 = 0.05;
const LEAST_QUIET: usize = 3;

/// Factor that makes up for chance, which makes them quieter than others: by a tenth if there is nothing but white noise, by less if relief
/// has a part in the choice.
const BY_QUIET: f64 = 1.08;

/// Growth of the variance of relief with twice the lag, at least: 4 across creases, up to 256 where the surface is smooth.
const RELIEF: f64 = 4.0;

/// Growth of the deviation with twice the lag below which it counts as at rest: errors don't depend on each other. The
/// lags at which that is looked for, and the number of tiles, at most and at least.
const REST: f64 = 1.15;
const LAGS: [usize; 4] = [1, 2, 4, 8];
const LAG_TILES: usize = 64;
const LEAST_RESTING: usize = 4;

/// Tiles that a level comes from, at least, and the ratio of ranges that it spans, at least: a quarter of an octave.
const LEVEL_TILES: usize = 24;
const LEVEL_SPAN: f64 = 1.189_207;

/// So many tiles tell as much as more would, in a fraction of the time.
const MOST_TILES: usize = 384;

/// Rounds in which levels are fitted: which tiles of a level are quiet depends on how the noise changes within it.
const FITS: usize = 4;

/// Obliquity from which on tiles say how noise grows with it, the largest that counts, and the largest growth: more of
/// it is relief.
const OBLIQUE: f64 = 0.4;
const MOST_GROWTH: f64 = 2.0;

/// Values lie on steps if three things hold. This share of neighbours is equal in most tiles. The smallest difference of others is much the
/// same from tile to tile (the smaller ones of chance are far apart). The image reaches over this many steps: a box has equal neighbours,
/// too.
const EQUAL: f64 = 0.02;
const STEP_SPREAD: f64 = 2.0;
const STEPS: f64 = 8.0;

/// The standard deviation of the errors of a range image along its rays: by range, and growing with the *obliquity*
/// 1 / cos - 1, where cos is the cosine between ray and normal. Lengths are in the image's unit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Noise {
    /// By rising range.
    levels: Vec<Level>,
    /// Relative, for each unit of obliquity.
    growth: f64,
    correlation: f64,
    typical: f64,
}

/// The noise at a range, on a surface seen face on.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Level {
    range: f64,
    deviation: f64,
    step: f64,
}

impl Noise {
    /// It in numbers, exactly.
    pub fn to_numbers(&self) -> Vec<f64> {
        let levels = self.levels.iter().flat_map(|level| [level.range, level.deviation, level.step]);
        [self.growth, self.correlation, self.typical].into_iter().chain(levels).collect()
    }

    /// The noise that [`Noise::to_numbers`] wrote. `None` for other numbers.
    pub fn from_numbers(numbers: &[f64]) -> Option<Self> {
        let (&[growth, correlation, typical], rest) = numbers.split_first_chunk()?;
        let levels = rest.chunks(3).map(|of| match *of {
            [range, deviation, step] => Some(Level { range, deviation, step }),
            _ => None,
        });
        Some(Noise { levels: levels.collect::<Option<_>>()?, growth, correlation, typical })
    }

    /// Measures an image. O(pixels), 8 bytes per pixel, one thread. If too few samples have neighbours to tell, the noise is 0.
    ///
    /// Relief finer than a few pixels that covers all of the image is taken for noise. Errors that depend on each other over
    /// more than three pixels are taken for relief: of these only what differs from pixel to pixel counts.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn measure(image: &RangeImage, progress: &Progress<'_>) -> Result<Noise> {
        let heights = Heights::new(image, progress)?;
        let mut tiles = heights.tiles(image, MOST_TILES, progress)?;
        tiles.sort_by(|a, b| a.range.total_cmp(&b.range));
        heights.differ(&mut tiles, 1, progress)?;
        let mut noise = Noise::fit(&known(&tiles));
        // Rounding makes errors that depend on each other, too; what they come to is known.
        if noise.levels.iter().all(|level| level.step <= level.deviation) {
            let lag = rest(&heights, &known(&tiles));
            if lag > 1 {
                heights.differ(&mut tiles, lag, progress)?;
                noise = Noise { correlation: lag as f64, ..Noise::fit(&known(&tiles)) };
            }
        }
        let samples = tiles.iter().map(|tile| tile.count).sum();
        noise.typical = noise.median(&mut tiles, samples);
        Ok(noise)
    }

    /// Standard deviation along its ray of every sample of `grid`, by its range and the obliquity of its surroundings.
    /// O(pixels).
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn of_samples(&self, image: &RangeImage, grid: &SampleGrid, progress: &Progress<'_>) -> Result<Vec<f32>> {
        let heights = Heights::new(image, progress)?;
        let mut growths = vec![1.0; heights.across * heights.rows.div_ceil(TILE)];
        for tile in heights.tiles(image, usize::MAX, progress)? {
            growths[tile.top / TILE * heights.across + tile.left / TILE] = 1.0 + self.growth * tile.obliquity;
        }
        let mut deviations = Vec::with_capacity(grid.len());
        let (projection, cols) = (image.projection(), image.cols());
        for block in progress.ranges(grid.len()) {
            for k in block? {
                let (row, col) = (grid.pixels[k] as usize / cols, grid.pixels[k] as usize % cols);
                let growth = growths[row / TILE * heights.across + col / TILE];
                deviations.push((self.face_on(range(projection, grid.positions[k])) * growth) as f32);
            }
        }
        Ok(deviations)
    }

    /// Median of the standard deviation along the ray over all samples of the image.
    pub fn typical(&self) -> f64 {
        self.typical
    }

    /// Standard deviation across the ray that makes the noise grow with the obliquity of the surface as it does: errors to the
    /// side become errors along the ray with the tangent of the angle. 0 where it doesn't grow, or too little is oblique.
    pub fn across(&self) -> f64 {
        // At an obliquity of 1 the cosine is a half.
        self.typical * ((1.0 + self.growth).powi(2) - 1.0).sqrt() / 3.0_f64.sqrt()
    }

    /// Median over the ranges of the steps that values are multiples of, along the ray. 0 where none are seen.
    pub fn typical_step(&self) -> f64 {
        let mut steps: Vec<f64> = self.levels.iter().map(|level| level.step).collect();
        steps.sort_by(f64::total_cmp);
        steps.get(steps.len() / 2).copied().unwrap_or(0.0)
    }

    /// Pixels over which errors depend on each other, a power of two: 1 for white noise.
    pub fn correlation(&self) -> f64 {
        self.correlation
    }

    /// Share of the standard deviation that is left in means over blocks of `side` x `side` pixels.
    pub fn left_by_blocks(&self, side: usize) -> f64 {
        (self.correlation / side as f64).min(1.0)
    }

    /// Standard deviation along the ray at this distance from the sensor, where the cosine between ray and normal is
    /// `cosine`. The distance does not matter where rays are parallel.
    pub fn deviation(&self, range: f64, cosine: f64) -> f64 {
        self.face_on(range) * (1.0 + self.growth * obliquity(cosine))
    }

    /// The step that values at this distance from the sensor are multiples of, along the ray. 0 where none is seen.
    pub fn step(&self, range: f64) -> f64 {
        self.at(range, |level| level.step)
    }

    fn face_on(&self, range: f64) -> f64 {
        self.at(range, |level| level.deviation)
    }

    /// Between levels linear, beyond them constant.
    fn at(&self, range: f64, value: impl Fn(&Level) -> f64) -> f64 {
        let after = self.levels.partition_point(|level| level.range < range);
        match (after.checked_sub(1).map(|before| &self.levels[before]), self.levels.get(after)) {
            (Some(a), Some(b)) => value(a) + (value(b) - value(a)) * (range - a.range) / (b.range - a.range),
            (Some(level), None) | (None, Some(level)) => value(level),
            (None, None) => 0.0,
        }
    }

    fn of_tile(&self, tile: &Tile) -> f64 {
        self.face_on(tile.range) * (1.0 + self.growth * tile.obliquity)
    }

    /// The noise that the quietest of `tiles` show, which are sorted by range.
    fn fit(tiles: &[&Tile]) -> Noise {
        let spans = spans(tiles);
        let range = |span: &[&Tile]| span.iter().map(|tile| tile.range).sum::<f64>() / span.len() as f64;
        let levels = spans.iter().map(|span| Level { range: range(span), deviation: 1.0, step: 0.0 }).collect();
        let mut noise = Noise { levels, growth: 0.0, correlation: 1.0, typical: 0.0 };
        for _ in 1..FITS {
            let quiet: Vec<Quiet<'_>> = spans.iter().map(|span| noise.quietest(span)).collect();
            noise.scale(&quiet, |quiet, noise| quiet.deviation(|tile| noise.face_on(tile.range)));
        }
        // Once and last: where all is relief nothing is left to compare tiles with.
        let quiet: Vec<Quiet<'_>> = spans.iter().map(|span| noise.quietest(span)).collect();
        let oblique: Vec<&Tile> = tiles.iter().copied().filter(|tile| tile.obliquity >= OBLIQUE).collect();
        let oblique = noise.quietest(&oblique);
        noise.scale(&quiet, |quiet, noise| quiet.without_relief(|tile| noise.face_on(tile.range)));
        noise.grow(&Quiet(quiet.into_iter().flat_map(|quiet| quiet.0).collect()), &oblique);
        noise.add_steps(tiles);
        noise
    }

    /// Multiplies the deviation of each level.
    fn scale(&mut self, quiet: &[Quiet<'_>], factor: impl Fn(&Quiet<'_>, &Noise) -> f64) {
        let factors: Vec<f64> = quiet.iter().map(|quiet| factor(quiet, self)).collect();
        for (level, factor) in self.levels.iter_mut().zip(factors) {
            level.deviation *= factor;
        }
    }

    /// Takes the growth from tiles that levels come from and from oblique ones. By its definition the ratio of their
    /// deviations is (1 + growth b) / (1 + growth a), with the obliquities a and b.
    fn grow(&mut self, level: &Quiet<'_>, oblique: &Quiet<'_>) {
        let ratio = oblique.without_relief(|tile| self.face_on(tile.range));
        let [a, b] = [level, oblique].map(|quiet| quiet.mean(|tile| tile.obliquity));
        // Also false for NaN, where there are no oblique tiles or no noise.
        if ratio > 1.0 && b - ratio * a > 0.0 {
            self.growth = ((ratio - 1.0) / (b - ratio * a)).min(MOST_GROWTH);
            self.levels.iter_mut().for_each(|level| level.deviation /= 1.0 + self.growth * a);
        }
    }

    /// Those that differ least at both lags from what is expected of them.
    fn quietest<'t>(&self, tiles: &[&'t Tile]) -> Quiet<'t> {
        Quiet::of(tiles, |tile| self.of_tile(tile))
    }

    /// Finds the steps that values lie on. Rounding to them makes an error of at least 1 / sqrt 12 of a step, seen or not:
    /// on a gentle slope neighbours are off by the same.
    fn add_steps(&mut self, tiles: &[&Tile]) {
        let depths = tiles.iter().map(|tile| tile.depth);
        let reach = depths.clone().fold(f64::NEG_INFINITY, f64::max) - depths.fold(f64::INFINITY, f64::min);
        for (level, span) in self.levels.iter_mut().zip(spans(tiles)) {
            let varied: Vec<&&Tile> = span.iter().filter(|tile| tile.step < f64::INFINITY).collect();
            let mut steps: Vec<f64> = varied.iter().filter(|tile| tile.equal >= EQUAL).map(|tile| tile.step).collect();
            if steps.is_empty() || 2 * steps.len() < varied.len() {
                continue;
            }
            steps.sort_by(f64::total_cmp);
            let [low, step, high] = [1, 2, 3].map(|quarter| steps[quarter * (steps.len() - 1) / 4]);
            if high <= STEP_SPREAD * low && STEPS * step <= reach {
                level.step = step;
                level.deviation = level.deviation.max(step / 12f64.sqrt());
            }
        }
    }

    /// Median over the samples of all tiles.
    fn median(&self, tiles: &mut [Tile], samples: usize) -> f64 {
        tiles.sort_by(|a, b| self.of_tile(a).total_cmp(&self.of_tile(b)));
        let mut before = 0;
        let middle = tiles.iter().find(|tile| {
            before += tile.count;
            2 * before >= samples
        });
        middle.map_or(0.0, |tile| self.of_tile(tile))
    }
}

/// Those of which something is known.
fn known(tiles: &[Tile]) -> Vec<&Tile> {
    tiles.iter().filter(|tile| tile.deviations.is_some()).collect()
}

/// The quietest of some tiles.
struct Quiet<'t>(Vec<&'t Tile>);

impl<'t> Quiet<'t> {
    /// Those whose deviations at both lags are least by what is expected of them.
    fn of(tiles: &[&'t Tile], expected: impl Fn(&Tile) -> f64) -> Quiet<'t> {
        let loudness = |tile: &Tile| {
            let loudness = tile.deviations.map_or(f64::INFINITY, |[near, far]| near.max(far));
            if loudness > 0.0 { loudness / expected(tile) } else { 0.0 }
        };
        let mut sorted: Vec<(f64, &Tile)> = tiles.iter().map(|tile| (loudness(tile), *tile)).collect();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        let count = ((QUIET * tiles.len() as f64) as usize).max(LEAST_QUIET);
        Quiet(sorted.into_iter().take(count).map(|(_, tile)| tile).collect())
    }

    fn mean(&self, value: impl Fn(&Tile) -> f64) -> f64 {
        self.0.iter().map(|tile| value(tile)).sum::<f64>() / self.0.len() as f64
    }

    /// Mean squares at both lags of deviations by what is expected.
    fn squares(&self, expected: impl Fn(&Tile) -> f64) -> [f64; 2] {
        [0, 1].map(|i| {
            self.mean(|tile| {
                let [near, far] = tile.deviations.unwrap_or_default();
                // A deviation that is not known at the larger lag is taken to be the same.
                let deviation = if i == 1 && far < f64::INFINITY { far } else { near };
                let expected = expected(tile);
                if expected > 0.0 { (deviation / expected).powi(2) } else { 0.0 }
            })
        })
    }

    /// Root mean square of deviations by what is expected.
    fn deviation(&self, expected: impl Fn(&Tile) -> f64) -> f64 {
        BY_QUIET * self.squares(expected)[0].sqrt()
    }

    /// The same at a lag of 0, as if: without what grows with the lag as relief does.
    fn without_relief(&self, expected: impl Fn(&Tile) -> f64) -> f64 {
        let [near, far] = self.squares(expected);
        BY_QUIET * (near - (far - near).max(0.0) / (RELIEF - 1.0)).max(0.0).sqrt()
    }
}

/// The lag from which on deviations of the quietest tiles are at rest. 1 if there is none.
fn rest(heights: &Heights, tiles: &[&Tile]) -> usize {
    // Away from borders, or each lag would see another part of a tile.
    let whole: Vec<&Tile> = tiles.iter().copied().filter(|tile| tile.count == TILE * TILE).collect();
    let quiet = Quiet::of(&whole, |_| 1.0).0;
    let (mut squares, mut count) = ([0.0; LAGS.len()], 0);
    for tile in quiet.iter().step_by(quiet.len() / LAG_TILES + 1) {
        let known = LAGS.map(|lag| heights.deviation(tile, lag).unwrap_or_default());
        let [first, .., last] = known;
        if first.0 > 0.0 && 2.0 * last.1 >= first.1 {
            squares.iter_mut().zip(known).for_each(|(sum, known)| *sum += (known.0 / first.0).powi(2));
            count += 1;
        }
    }
    let growth = |i: usize| squares[i + 1] / squares[i];
    let rest = (0..LAGS.len() - 1).find(|&i| growth(i) < REST * REST).unwrap_or(0);
    // Relief comes to rest, too, where it rises and falls again, but from a steep growth.
    let is_relief = rest > 1 && growth(rest - 1) > RELIEF;
    if count < LEAST_RESTING || is_relief { 1 } else { LAGS[rest] }
}

/// Cuts tiles of rising range into runs of enough tiles over enough range.
fn spans<'a, 't>(tiles: &'a [&'t Tile]) -> Vec<&'a [&'t Tile]> {
    let mut spans = Vec::new();
    let mut start = 0;
    for end in 1..=tiles.len() {
        let enough = end - start >= LEVEL_TILES && tiles.len() - end >= LEVEL_TILES;
        let wide = tiles[end - 1].range >= LEVEL_SPAN * tiles[start].range && tiles[start].range > 0.0;
        if enough && wide || end == tiles.len() {
            spans.push(&tiles[start..end]);
            start = end;
        }
    }
    spans
}

#[cfg(test)]
mod tests;
