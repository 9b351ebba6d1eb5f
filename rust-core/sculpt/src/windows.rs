//! Windows: boxes around what the sensor sees of triangles, and a grid that finds those near another.

use std::f64::consts::PI;

use glam::DVec3;
use rustc_hash::FxHashMap;

use super::view::{CentralSite, ParallelSite, Site};

/// Windowed sites: the place in the sensor's window where one is seen. Parallel rays across themselves, others by longitude and latitude.
pub(super) trait Windowed: Site {
    /// Whether the window ends where it begins, at 1.
    const AROUND: bool;

    /// A box around a triangle: lowest and highest place along both axes. If the window goes around, the first of them lies in [0, 1].
    fn window(corners: [&Self; 3]) -> Window;

    /// Rises with the range.
    fn depth(&self) -> f64;

    /// Whether two triangles surely lie on two sides of the sensor.
    fn on_two_sides(_one: [&Self; 3], _other: [&Self; 3]) -> bool {
        false
    }
}

impl Windowed for ParallelSite {
    const AROUND: bool = false;

    fn window(corners: [&Self; 3]) -> Window {
        let [a, b, c] = corners.map(|s| s.seen);
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        [[low.x, high.x], [low.y, high.y]]
    }

    fn depth(&self) -> f64 {
        -self.height
    }
}

impl Windowed for CentralSite {
    const AROUND: bool = true;

    fn window(corners: [&Self; 3]) -> Window {
        let directions = corners.map(|s| s.0.normalize_or_zero());
        let [a, b, c] = directions;
        // The arcs between two directions reach beyond their chords' boxes by less than the square of the chords.
        let reach = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a)) + 1e-12;
        let latitudes = directions.map(|d| d.z);
        let (low, high) = bounds(latitudes);
        let latitude = [low - reach, high + reach];
        let nearest_pole = directions.map(|d| d.truncate().length()).into_iter().fold(f64::INFINITY, f64::min);
        let mut turns = directions.map(|d| d.y.atan2(d.x) / (2.0 * PI));
        if bounds(turns).1 - bounds(turns).0 > 0.5 {
            turns = turns.map(|t| if t < 0.0 { t + 1.0 } else { t });
        }
        let (low, high) = bounds(turns);
        let margin = reach / nearest_pole;
        if !(margin < 0.25) || high - low > 0.25 {
            return [[0.0, 1.0], latitude];
        }
        let start = low - margin;
        let whole = start.floor();
        [[start - whole, high + margin - whole], latitude]
    }

    fn depth(&self) -> f64 {
        DVec3::length(self.0)
    }

    fn on_two_sides(one: [&Self; 3], other: [&Self; 3]) -> bool {
        let [one, other] = [one, other].map(|corners| corners.map(|site| site.0.normalize_or_zero()));
        let between = one.iter().sum::<DVec3>().normalize_or_zero() - other.iter().sum::<DVec3>().normalize_or_zero();
        one.iter().all(|p| between.dot(*p) > SURELY) && other.iter().all(|p| between.dot(*p) < -SURELY)
    }
}

/// Rounding of a dot product of directions is far below this.
const SURELY: f64 = 1e-9;

fn bounds(values: [f64; 3]) -> (f64, f64) {
    let [a, b, c] = values;
    (a.min(b).min(c), a.max(b).max(c))
}

/// Cells along an axis of the window at most.
const MOST_CELLS: f64 = 4096.0;

/// Entries of a cell from which on it is divided further ...
const CROWDED: u32 = 128;
/// ... so many times at most.
const MOST_LEVELS: u32 = 32;

/// A box in the sensor's window: lowest and highest place along both axes.
pub(super) type Window = [[f64; 2]; 2];

/// The windows' grid: what is seen in each cell as lists of numbers. A few windows much larger than the others, or far from
/// them, put nothing else together: large ones have a list of their own, and a crowded cell is a grid of its own.
pub(super) struct Grid {
    /// The measure of large windows.
    whole: Window,
    /// Numbers of large windows: most of these overlap each other.
    large: Vec<u32>,
    /// Lowest place of the others.
    low: [f64; 2],
    /// Cells by length.
    scale: [f64; 2],
    cells: [usize; 2],
    first: Vec<u32>,
    /// Number and next entry.
    entries: Vec<[u32; 2]>,
    /// Crowded cells.
    divided: FxHashMap<usize, Grid>,
}

const END: u32 = u32::MAX;

impl Grid {
    /// For `windows` that are about as many as cells of a mean size.
    pub fn new(windows: &[Window], around: bool) -> Self {
        let mut whole = bounding_box(windows.iter());
        if around {
            whole[0] = [0.0, 1.0];
        }
        Grid::divide(windows, whole, around, MOST_LEVELS)
    }

    fn divide(windows: &[Window], whole: Window, around: bool, levels: u32) -> Self {
        let small = || windows.iter().filter(|window| !is_large(window, &whole));
        let count = small().count();
        let mut bounds = bounding_box(small());
        for axis in 0..2 {
            bounds[axis] = clipped(bounds[axis], whole[axis]);
        }
        if around {
            bounds[0] = [0.0, 1.0];
        }
        let size = [0, 1].map(|i| bounds[i][1] - bounds[i][0]);
        let most = MOST_CELLS.min((windows.len() as f64).sqrt().ceil() + 1.0);
        let cells = [0, 1].map(|i| {
            let extent = |window: &Window| {
                let [low, high] = if around { window[i] } else { clipped(window[i], bounds[i]) };
                (high - low) / count as f64
            };
            let wanted = (size[i] / (1.5 * small().map(extent).sum::<f64>())).floor();
            if wanted >= 1.0 { wanted.min(most) } else { 1.0 }
        });
        let scale = [0, 1].map(|i| {
            let scale = cells[i] / size[i];
            if scale.is_finite() { scale } else { 0.0 }
        });
        let cells = cells.map(|n| n as usize);
        let mut grid = Grid {
            whole,
            large: Vec::new(),
            low: bounds.map(|b| b[0]),
            scale,
            cells,
            first: vec![END; cells[0] * cells[1]],
            entries: Vec::new(),
            divided: FxHashMap::default(),
        };
        if levels > 0 && grid.first.len() > 1 && count > CROWDED as usize {
            grid.divide_crowded(small(), levels - 1);
        }
        grid
    }

    fn divide_crowded<'w>(&mut self, windows: impl Iterator<Item = &'w Window> + Clone, levels: u32) {
        let mut counts = vec![0_u32; self.first.len()];
        for window in windows.clone() {
            self.cells_of(window).for_each(|(cell, _)| counts[cell] += 1);
        }
        if counts.iter().all(|&n| n <= CROWDED) {
            return;
        }
        let mut crowds: FxHashMap<usize, Vec<Window>> = FxHashMap::default();
        for window in windows {
            for (cell, turn) in self.cells_of(window).filter(|&(cell, _)| counts[cell] > CROWDED) {
                crowds.entry(cell).or_default().push(turned(window, turn));
            }
        }
        for (cell, crowd) in crowds {
            let all = bounding_box(crowd.iter());
            let place = [cell % self.cells[0], cell / self.cells[0]];
            let whole = [0, 1].map(|axis| {
                let edge = |i: usize| self.low[axis] + i as f64 / self.scale[axis];
                // An axis without an extent has one cell.
                let ends = [edge(place[axis]), edge(place[axis] + 1)];
                if ends.iter().all(|e| e.is_finite()) { clipped(all[axis], ends) } else { all[axis] }
            });
            let inner = Grid::divide(&crowd, whole, false, levels);
            if inner.first.len() > 1 || !inner.divided.is_empty() {
                self.divided.insert(cell, inner);
            }
        }
    }

    /// The cells of a window, and how often it has gone around there. If it goes around, the cells of the second turn are those of the
    /// first.
    fn cells_of(&self, window: &Window) -> impl Iterator<Item = (usize, usize)> + use<> {
        let along = |axis: usize, turns: usize| {
            let cell = |x: f64| ((x - self.low[axis]) * self.scale[axis]) as usize;
            let most = self.cells[axis] * turns - 1;
            (cell(window[axis][0]).min(most), cell(window[axis][1]).min(most))
        };
        let ((left, right), (top, bottom)) = (along(0, 2), along(1, 1));
        let cols = self.cells[0];
        let right = right.min(left + cols - 1);
        (top..=bottom).flat_map(move |row| (left..=right).map(move |col| (row * cols + col % cols, col / cols)))
    }

    /// Removes all numbers.
    pub fn clear(&mut self) {
        self.large.clear();
        self.first.fill(END);
        self.entries.clear();
        self.divided.values_mut().for_each(Grid::clear);
    }

    /// Adds a number to all cells of a window.
    pub fn add(&mut self, window: &Window, number: u32) {
        if is_large(window, &self.whole) {
            self.large.push(number);
            return;
        }
        for (cell, turn) in self.cells_of(window) {
            if !self.divided.is_empty()
                && let Some(inner) = self.divided.get_mut(&cell)
            {
                inner.add(&turned(window, turn), number);
                continue;
            }
            let entry = self.entries.len() as u32;
            self.entries.push([number, self.first[cell]]);
            self.first[cell] = entry;
        }
    }

    /// Whether something holds of all numbers in the cells of a window. Some come more than once.
    pub fn all(&self, window: &Window, mut holds: impl FnMut(u32) -> bool) -> bool {
        self.all_of(window, &mut holds)
    }

    #[inline]
    fn all_of<F: FnMut(u32) -> bool>(&self, window: &Window, holds: &mut F) -> bool {
        if !self.large.iter().all(|&number| holds(number)) {
            return false;
        }
        self.cells_of(window).all(|(cell, turn)| {
            if !self.divided.is_empty()
                && let Some(inner) = self.divided.get(&cell)
            {
                return inner.all_of(&turned(window, turn), holds);
            }
            let mut entry = self.first[cell];
            while entry != END {
                let [number, next] = self.entries[entry as usize];
                if !holds(number) {
                    return false;
                }
                entry = next;
            }
            true
        })
    }
}

/// Whether a window takes up a quarter of the whole along both axes.
fn is_large(window: &Window, whole: &Window) -> bool {
    (0..2).all(|axis| {
        let [low, high] = clipped(window[axis], whole[axis]);
        high - low >= 0.25 * (whole[axis][1] - whole[axis][0])
    })
}

/// The part of an interval that lies in another. Its nearer end if none does.
fn clipped([low, high]: [f64; 2], [least, most]: [f64; 2]) -> [f64; 2] {
    [low.max(least).min(most), high.max(least).min(most)]
}

fn bounding_box<'w>(windows: impl Iterator<Item = &'w Window>) -> Window {
    windows.fold([[f64::INFINITY, f64::NEG_INFINITY]; 2], |all, window| {
        [0, 1].map(|axis| [all[axis][0].min(window[axis][0]), all[axis][1].max(window[axis][1])])
    })
}

/// A window in the cells of its second turn around.
fn turned([[left, right], y]: &Window, turn: usize) -> Window {
    [[left - turn as f64, right - turn as f64], *y]
}
