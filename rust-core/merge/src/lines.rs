//! Stage 3: the crossings of every line, in order along it, and what each knows of the others.

use super::bundles::{BundleKey, Crossing, RawBundle};
use super::lattice::{BRICK_BITS, ROWS};
use super::remove::remove_fine_details;

/// The crossings of a row of bricks: by brick along the axis, then line, then place.
pub struct SortedBundle {
    /// Axis and place of the row of bricks.
    pub key: BundleKey,
    /// The crossings.
    pub crossings: Vec<Crossing>,
    /// Brick coordinate along the axis and first crossing of each brick that has any, ascending.
    pub bricks: Vec<(i32, u32)>,
}

impl SortedBundle {
    /// The crossings whose cells lie in brick `brick` along the axis.
    pub fn in_brick(&self, brick: i32) -> &[Crossing] {
        match self.bricks.binary_search_by_key(&brick, |b| b.0) {
            Ok(i) => {
                let end = self.bricks.get(i + 1).map_or(self.crossings.len(), |b| b.1 as usize);
                &self.crossings[self.bricks[i].1 as usize..end]
            }
            Err(_) => &[],
        }
    }
}

/// Sorts the crossings of a bundle by line, then along the line; equal places by content, so that the order in which
/// scans and threads delivered them is forgotten. Calls `each` with every line that has crossings.
pub fn for_each_line(raw: &RawBundle, mut each: impl FnMut(usize, &mut Vec<Crossing>)) {
    let mut starts = [0_u32; ROWS + 1];
    let all = || raw.chunks.iter().flatten();
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

/// Sorts a bundle.
pub fn sort(raw: RawBundle) -> SortedBundle {
    let mut all: Vec<Crossing> = Vec::new();
    for_each_line(&raw, |_, line| {
        remove_fine_details(line);
        note_room(line);
        all.extend_from_slice(line);
    });
    let key = raw.key;
    drop(raw);
    by_brick(key, all)
}

/// Place along the line, in cells.
#[inline]
fn place(crossing: &Crossing) -> f64 {
    f64::from(crossing.cell) + f64::from(crossing.fraction)
}

/// Notes of each crossing of a sorted line how far those of the other sign are.
fn note_room(line: &mut [Crossing]) {
    let mut last = [f64::NEG_INFINITY; 2];
    for crossing in line.iter_mut() {
        last[usize::from(crossing.enters())] = place(crossing);
        crossing.set_room(place(crossing) - last[usize::from(!crossing.enters())], f64::INFINITY);
    }
    let mut next = [f64::INFINITY; 2];
    for crossing in line.iter_mut().rev() {
        next[usize::from(crossing.enters())] = place(crossing);
        crossing.set_room(2.0 * crossing.room(false), next[usize::from(!crossing.enters())] - place(crossing));
    }
}

/// Sorts crossings, which come line by line, by brick.
pub fn by_brick(key: BundleKey, all: Vec<Crossing>) -> SortedBundle {
    let lowest = all.iter().map(|c| c.cell >> BRICK_BITS).min().unwrap_or(0);
    let highest = all.iter().map(|c| c.cell >> BRICK_BITS).max().unwrap_or(0);
    if all.is_empty() {
        return SortedBundle { key, crossings: all, bricks: Vec::new() };
    }
    // Stable counting sort by brick; a row of scans far apart must not cost its length.
    let length = (i64::from(highest) - i64::from(lowest)) as u64 + 1;
    if length > 4 * all.len() as u64 + 64 {
        let mut all = all;
        all.sort_by_key(|c| c.cell >> BRICK_BITS);
        let mut bricks: Vec<(i32, u32)> = Vec::new();
        for (i, c) in all.iter().enumerate() {
            if bricks.last().is_none_or(|b| b.0 != c.cell >> BRICK_BITS) {
                bricks.push((c.cell >> BRICK_BITS, i as u32));
            }
        }
        return SortedBundle { key, crossings: all, bricks };
    }
    let mut counts = vec![0_u32; length as usize + 1];
    for c in &all {
        counts[((c.cell >> BRICK_BITS) - lowest) as usize + 1] += 1;
    }
    let mut bricks = Vec::new();
    for i in 0..length as usize {
        if counts[i + 1] > 0 {
            bricks.push((lowest + i as i32, counts[i]));
        }
        counts[i + 1] += counts[i];
    }
    let mut crossings = vec![Crossing::default(); all.len()];
    for c in &all {
        let slot = &mut counts[((c.cell >> BRICK_BITS) - lowest) as usize];
        crossings[*slot as usize] = *c;
        *slot += 1;
    }
    SortedBundle { key, crossings, bricks }
}
