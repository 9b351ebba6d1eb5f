//! The paper's fusing: crossings of different scans that mean the same surface become one. [MI04, sec. 3.2, eq. 1 and 2]
//!
//! Differences from the paper:
//! 1. A line is fused from its original crossings at once, not pair by pair, so no order can matter. A group of crossings of one sign and
//!    of different scans whose span is within the merge distance becomes one crossing. A group that is too long is cut at its largest gap.
//! 2. The distance along the normal is the distance along the line times `|dr|` (the printed eq. 1 divides).
//! 3. A crossing counts with at least a quarter of the largest trust of all scans. At borders trust is 0, and eq. 2 would be 0/0 there. A
//!    border next to a single other scan would have no say at all.
//! 4. A cell edge keeps at most one crossing. The shift across cells and its artificial crossings follow from the signs that the fused
//!    crossings give the nodes (stage 4). That does on every line at once what the paper's insertions and removals do one after the other.

use crate::crossings::bundles::RawBundle;
use crate::crossings::crossing::Crossing;
use crate::crossings::fine_details::remove_fine_details;
use crate::crossings::lines::{SortedBundle, by_brick, for_each_line};
use mesh::srgb::Mix;

/// The rule that makes crossings one, and averages them.
#[derive(Clone, Copy, Debug, Default)]
pub struct Rule {
    /// Largest distance along the normal, in cells.
    pub merge_distance: f64,
    /// Largest trust of any sample.
    pub full_trust: f64,
}

/// Share of the full trust that every crossing has.
const LEAST_SHARE: f64 = 0.25;

impl Rule {
    fn weight(&self, c: &Crossing) -> f64 {
        let floor = if self.full_trust > 0.0 { LEAST_SHARE * self.full_trust } else { 1.0 };
        floor + (1.0 - LEAST_SHARE) * f64::from(c.weight)
    }
}

/// Fuses a bundle: at most one crossing a cell edge is left.
pub fn fuse(raw: RawBundle, rule: Rule) -> SortedBundle<Crossing> {
    let mut fused: Vec<Crossing> = Vec::new();
    let mut fuser = LineFuser { rule, ..LineFuser::default() };
    for_each_line(&raw.found.chunks, |_, line| {
        remove_fine_details(line);
        fuser.fuse_line(line, &mut fused);
    });
    let key = raw.key;
    drop(raw);
    by_brick(key, fused)
}

/// Fuses one line after the other, keeping its buffers.
#[derive(Default)]
struct LineFuser {
    rule: Rule,
    same_sign: Vec<Crossing>,
    clusters: Vec<Crossing>,
    edge: Vec<Crossing>,
}

impl LineFuser {
    /// Appends the fused crossings of `line`, which is sorted, to `out`.
    fn fuse_line(&mut self, line: &[Crossing], out: &mut Vec<Crossing>) {
        self.clusters.clear();
        if line.len() == 1 {
            self.clusters.push(line[0]);
        } else {
            for enters in [false, true] {
                self.same_sign.clear();
                self.same_sign.extend(line.iter().filter(|c| c.enters() == enters));
                cluster(&self.same_sign, &self.rule, &mut self.clusters);
            }
            self.clusters.sort_by(|a, b| (a.cell.cmp(&b.cell)).then(a.fraction.total_cmp(&b.fraction)));
        }
        let from = out.len();
        let mut i = 0;
        while i < self.clusters.len() {
            let cell = self.clusters[i].cell;
            let end = i + self.clusters[i..].iter().take_while(|c| c.cell == cell).count();
            out.extend(one_per_edge(&self.clusters[i..end], &self.rule, &mut self.edge));
            i = end;
        }
        for j in from + 1..out.len() {
            if out[j].cell == out[j - 1].cell + 1 {
                out[j - 1].set_neighbour(true);
                out[j].set_neighbour(false);
            }
        }
    }
}

/// Splits crossings of one sign, sorted along their line, into clusters and appends each cluster's crossing.
fn cluster(group: &[Crossing], rule: &Rule, out: &mut Vec<Crossing>) {
    match group {
        [] => {}
        [single] => out.push(*single),
        _ if is_one_surface(group, rule) => out.push(fused(group, rule)),
        _ => {
            let gap = |i: usize| along(&group[i], &group[i + 1]);
            let mut cut = 0;
            for i in 1..group.len() - 1 {
                if gap(i) > gap(cut) {
                    cut = i;
                }
            }
            cluster(&group[..=cut], rule, out);
            cluster(&group[cut + 1..], rule, out);
        }
    }
}

/// Distance along the line, in cells.
fn along(from: &Crossing, to: &Crossing) -> f64 {
    f64::from(to.cell) - f64::from(from.cell) + (f64::from(to.fraction) - f64::from(from.fraction))
}

fn is_one_surface(group: &[Crossing], rule: &Rule) -> bool {
    let (sum, total) = group.iter().fold((0.0, 0.0), |(sum, total), c| {
        let w = rule.weight(c);
        (sum + w * f64::from(c.normal.abs()), total + w)
    });
    along(&group[0], &group[group.len() - 1]) * (sum / total) <= rule.merge_distance
        && (1..group.len()).all(|i| group[..i].iter().all(|c| c.scan() != group[i].scan()))
}

/// The weighted mean of a cluster. Sums run along the line, so they do not depend on the order of the scans.
fn fused(group: &[Crossing], rule: &Rule) -> Crossing {
    let base = group[0].cell;
    let mut total = 0.0;
    let (mut place, mut normal, mut colour) = (0.0, 0.0, Mix::default());
    let mut strongest = &group[0];
    for c in group {
        let w = rule.weight(c);
        total += w;
        place += w * (f64::from(c.cell - base) + f64::from(c.fraction));
        normal += w * f64::from(c.normal);
        colour.add_share(c.colour, w as f32);
        if c.weight > strongest.weight || (c.weight == strongest.weight && c.scan() < strongest.scan()) {
            strongest = c;
        }
    }
    let place = place / total;
    // Members of one cell stay in it: a crossing exactly on a node belongs to the cell that stage 1 gave it.
    let cell = place.floor().min(f64::from(group[group.len() - 1].cell - base));
    Crossing::new(
        group[0].line() as u32,
        strongest.scan(),
        base + cell as i32,
        (place - cell) as f32,
        (normal / total) as f32,
        group.iter().map(|c| c.weight).sum(),
        colour.colour(),
    )
}

/// The rest of the crossings of one cell edge. None if as many enter as leave. Else one of the surplus sign, the mean of those left when
/// neighbours of opposite sign have cancelled.
fn one_per_edge(crossings: &[Crossing], rule: &Rule, stack: &mut Vec<Crossing>) -> Option<Crossing> {
    if let [single] = crossings {
        return Some(*single);
    }
    stack.clear();
    for &c in crossings {
        match stack.last() {
            Some(top) if top.enters() != c.enters() => {
                stack.pop();
            }
            _ => stack.push(c),
        }
    }
    match stack.as_slice() {
        [] => None,
        left => Some(fused(left, rule)),
    }
}
