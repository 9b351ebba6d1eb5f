//! Stage 3: the crossings of every line, in order along it, and what each knows of the others.

use super::crossing::{BundleKey, Crossing, OnLine};
use super::edge_sums::{self, EdgeSums, edge_line};
use super::fine_details::remove_fine_details;
use super::lattice::{BRICK_BITS, ROWS};

/// Content of the lines of a row of bricks: by brick along the axis, then line, then place.
#[derive(Clone)]
pub struct SortedBundle<T = EdgeSums> {
    /// Axis and place of the row of bricks.
    pub key: BundleKey,
    /// The crossings or their sums.
    pub list: Vec<T>,
    /// Brick coordinate along the axis and first crossing of each brick that has any, ascending.
    pub bricks: Vec<(i32, u32)>,
}

impl<T: OnLine> SortedBundle<T> {
    /// The part that lies in cells of brick `brick` along the axis.
    pub fn in_brick(&self, brick: i32) -> &[T] {
        match self.bricks.binary_search_by_key(&brick, |b| b.0) {
            Ok(i) => {
                let end = self.bricks.get(i + 1).map_or(self.list.len(), |b| b.1 as usize);
                &self.list[self.bricks[i].1 as usize..end]
            }
            Err(_) => &[],
        }
    }
}

/// Sorts the crossings of a bundle by line, then along the line. Equal places by content, so that the order in which scans and threads
/// delivered them is forgotten. Calls `each` with every line that has crossings.
pub fn for_each_line(chunks: &[Vec<Crossing>], mut each: impl FnMut(usize, &mut Vec<Crossing>)) {
    let mut starts = [0_u32; ROWS + 1];
    let all = || chunks.iter().flatten();
    for crossing in all() {
        starts[crossing.line() + 1] += 1;
    }
    for i in 0..ROWS {
        starts[i + 1] += starts[i];
    }
    let mut next = starts;
    let mut sorted = vec![Crossing::default(); starts[ROWS] as usize];
    for crossing in all() {
        let slot = &mut next[crossing.line()];
        sorted[*slot as usize] = *crossing;
        *slot += 1;
    }
    let mut line = Vec::new();
    for i in 0..ROWS {
        let of_line = &mut sorted[starts[i] as usize..starts[i + 1] as usize];
        if of_line.is_empty() {
            continue;
        }
        of_line.sort_unstable_by(|a, b| {
            (a.cell.cmp(&b.cell)).then(a.fraction.total_cmp(&b.fraction)).then_with(|| {
                let content = |c: &Crossing| (c.normal.to_bits(), c.weight.to_bits(), c.colour, c.scan());
                content(a).cmp(&content(b))
            })
        });
        line.clear();
        line.extend_from_slice(of_line);
        each(i, &mut line);
    }
}

/// Adds up the crossings of whole scans by edge and sign. Sorted by [`EdgeSums::key`].
pub fn sums(chunks: &[Vec<Crossing>]) -> Vec<EdgeSums> {
    let mut all = Vec::new();
    for_each_line(chunks, |_, line| {
        remove_fine_details(line);
        edge_line(line, &mut all);
    });
    all
}

/// Adds up crossings of a bundle that are in order, without those that [`remove_fine_details`] drops.
pub fn add_up_sorted(crossings: &[Crossing], all: &mut Vec<EdgeSums>) {
    crossings.chunk_by(|a, b| a.line() == b.line()).for_each(|line| edge_line(line, all));
}

/// Number of sums that such crossings come to.
pub fn count_sums(crossings: &[Crossing]) -> usize {
    let of_edge = |of_edge: &[Crossing]| {
        [false, true].into_iter().filter(|&enters| of_edge.iter().any(|crossing| crossing.enters() == enters)).count()
    };
    crossings.chunk_by(|a, b| a.line() == b.line() && a.cell == b.cell).map(of_edge).sum()
}

/// Adds the crossings of a bundle to what is added up of it, and sorts it.
pub fn sort(key: BundleKey, mut all: Vec<EdgeSums>, rest: Vec<Vec<Crossing>>) -> SortedBundle {
    let sums = sums(&rest);
    drop(rest);
    if all.is_empty() {
        all = sums;
    } else {
        edge_sums::add_up(&mut all, &sums);
    }
    sort_sums(key, all)
}

/// Makes a bundle of sums that are sorted by [`EdgeSums::key`].
pub fn sort_sums(key: BundleKey, mut all: Vec<EdgeSums>) -> SortedBundle {
    all.chunk_by_mut(|a, b| a.line() == b.line()).for_each(note_room);
    by_brick(key, all)
}

/// Another surface has at least this share of the weight. A surface with less is a fold that noise made.
const SHARE: f64 = 0.25;

/// Notes of what is on a line how far the other surfaces are, those of the other sign.
fn note_room(line: &mut [EdgeSums]) {
    for i in 0..line.len() {
        let own = line[i];
        let other = |other: &&EdgeSums| other.enters() != own.enters() && other.weight() >= SHARE * own.weight();
        let below = line[..i].iter().rev().find(other).map_or(f64::INFINITY, |other| own.along() - other.along());
        let above = line[i + 1..].iter().find(other).map_or(f64::INFINITY, |other| other.along() - own.along());
        line[i].set_room(below, above);
    }
}

/// Sorts what comes line by line by brick.
pub fn by_brick<T: OnLine + Default>(key: BundleKey, all: Vec<T>) -> SortedBundle<T> {
    let lowest = all.iter().map(|c| c.cell() >> BRICK_BITS).min().unwrap_or(0);
    let highest = all.iter().map(|c| c.cell() >> BRICK_BITS).max().unwrap_or(0);
    if all.is_empty() {
        return SortedBundle { key, list: all, bricks: Vec::new() };
    }
    // Stable counting sort by brick; a row of scans far apart must not cost its length.
    let length = (i64::from(highest) - i64::from(lowest)) as u64 + 1;
    if length > 4 * all.len() as u64 + 64 {
        let mut all = all;
        all.sort_by_key(|c| c.cell() >> BRICK_BITS);
        let mut bricks: Vec<(i32, u32)> = Vec::new();
        for (i, c) in all.iter().enumerate() {
            if bricks.last().is_none_or(|b| b.0 != c.cell() >> BRICK_BITS) {
                bricks.push((c.cell() >> BRICK_BITS, i as u32));
            }
        }
        return SortedBundle { key, list: all, bricks };
    }
    let mut counts = vec![0_u32; length as usize + 1];
    for c in &all {
        counts[((c.cell() >> BRICK_BITS) - lowest) as usize + 1] += 1;
    }
    let mut bricks = Vec::new();
    for i in 0..length as usize {
        if counts[i + 1] > 0 {
            bricks.push((lowest + i as i32, counts[i]));
        }
        counts[i + 1] += counts[i];
    }
    let mut list = vec![T::default(); all.len()];
    for c in &all {
        let slot = &mut counts[((c.cell() >> BRICK_BITS) - lowest) as usize];
        list[*slot as usize] = *c;
        *slot += 1;
    }
    SortedBundle { key, list, bricks }
}
