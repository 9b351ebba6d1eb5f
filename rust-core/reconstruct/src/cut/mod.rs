//! Stage 3 for samples that carry noise: sides by a minimum cut. \[LPK09\], \[KSO04\]
//!
//! If basins of empty space are as small as the noise, gates and tangent balls between them say little. Cells deep in empty space are
//! certain all the same (`rooms`). At most samples, so are the cells that lie across the surface from there (`poles`). All other cells are
//! divided so that the fewest of these samples are contradicted and the surface is that of facets at which the balls on both sides are
//! large beside the facet.
//!
//! If it is known from which side samples were seen, by sensors or by normals, each says so of the cells next to it on that line
//! (`visibility`).
//!
//! *Differences from the papers.* Labatut, Pons and Keriven take whole lines of sight of cameras for what is outside. Here deep rooms do
//! that, which any samples have, and the other pole of a sample for what is inside. Lines count only if they are near their sample, as
//! noise lets others pass through thin bars. Kolluri, Shewchuk and O'Brien divide poles by an eigenvector, and then cells by another. The
//! cut divides all cells at once, exactly.

mod poles;
mod rooms;
mod visibility;

use super::balls::Balls;
use super::complex::Complex;
use super::seen::Fronts;
use base::error::Result;
use base::progress::Progress;
use geom::flow::Network;
use poles::{Poles, poles, spacing};
use rooms::{Rooms, Side};

/// Cost of contradicting a sample ...
const SAMPLE: u32 = 32;
/// ... beside a facet on the surface through whose sides balls pass upright ...
const FACET: f32 = 8.0;
/// ... and one whose circumscribed circle has a radius of a spacing. No larger one counts for more than the largest.
const AREA: f32 = 3.0;
const LARGEST: f32 = 8.0;

/// Cells of a part without any deep place, below which it is left over from the noise.
const CRUMB: usize = 64;

/// Radius of the ball of a pole, in spacings, below which it lies within what is left of the noise.
const POLE: f32 = 0.5;

/// Share of samples with the same deep room on both sides, from which they are not of a closed surface.
const OPEN: f64 = 0.25;

/// Share of the area over gaps, from which it is not, either, though fronts say what is behind the samples.
const LIDS: f64 = 0.2;

/// The cells and samples that are to be cut.
struct Problem {
    rooms: Rooms,
    /// The node of each cell whose side is not known, else `u32::MAX`.
    nodes: Vec<u32>,
    /// The outside is the source.
    network: Network,
    /// Of the samples.
    poles: Vec<Poles>,
    /// Whether rooms alone don't tell what is inside.
    is_torn: bool,
}

/// The side of each cell: 1 inside, 0 outside. `None` where the samples don't tell what is inside.
pub(super) fn sides(complex: Complex<'_>, fronts: &Fronts, progress: &Progress<'_>) -> Result<Option<Vec<u8>>> {
    let Some(Problem { poles, rooms, nodes, network, is_torn }) = problem(complex, fronts, progress)? else {
        return Ok(None);
    };
    let cut = network.cut(progress)?;
    let mut sides = vec![0; complex.len()];
    for range in progress.ranges(complex.len()) {
        for cell in range? {
            let is_inside = match rooms.side(cell as u32) {
                Some(side) => side == Side::Inside,
                None => !cut.is_source[nodes[cell] as usize],
            };
            sides[cell] = u8::from(is_inside);
        }
    }
    fill_crumbs(complex, &rooms, &mut sides, progress)?;
    Ok((!is_torn || lids(complex, &poles, &sides, progress)? < LIDS).then_some(sides))
}

fn problem(complex: Complex<'_>, fronts: &Fronts, progress: &Progress<'_>) -> Result<Option<Problem>> {
    let balls = Balls::of(complex, progress)?;
    let poles = poles(complex, &balls, progress)?;
    let rooms = Rooms::find(complex, &balls, &poles, fronts, progress)?;
    let is_torn = f64::from(rooms.through) > OPEN * poles.len() as f64 || !rooms.has_inside();
    if is_torn && fronts.are_unknown() {
        return Ok(None);
    }
    let votes = visibility::votes(complex, &poles, fronts, progress)?;
    let mut nodes = vec![u32::MAX; complex.len()];
    let mut free = 0;
    for range in progress.ranges(complex.len()) {
        for cell in range?.filter(|&cell| rooms.side(cell as u32).is_none()) {
            nodes[cell] = free;
            free += 1;
        }
    }
    let mut network = Network::new(free as usize, 2 * free as usize);
    for range in progress.ranges(complex.len()) {
        for cell in range?.filter(|&cell| nodes[cell] != u32::MAX).map(|cell| cell as u32) {
            for slot in 0..4 {
                let beyond = complex.neighbour(cell, slot);
                let side = rooms.side(beyond);
                if side.is_none() && beyond < cell {
                    continue;
                }
                let price = price(complex, &balls, &poles, cell, slot);
                match side {
                    None => network.add_edge([cell, beyond].map(|cell| nodes[cell as usize]), [price; 2]),
                    Some(side) => add(&mut network, nodes[cell as usize], side, price),
                }
            }
        }
    }
    for block in progress.blocks(&poles) {
        for Poles { cells: [a, b], spacing } in block?.iter().filter(|poles| poles.has_both()) {
            let (side, cell) = match (rooms.side(*a), rooms.side(*b)) {
                (Some(side), None) => (side.other(), *b),
                (None, Some(side)) => (side.other(), *a),
                _ => continue,
            };
            if balls.radii[cell as usize] >= POLE * spacing {
                add(&mut network, nodes[cell as usize], side, SAMPLE);
            }
        }
    }
    for (&node, &(mut votes)) in nodes.iter().zip(&votes).filter(|(node, _)| **node != u32::MAX) {
        if rooms.are_fronts_inside {
            votes.swap(0, 1);
        }
        let [outside, inside] = votes.map(|votes| votes.saturating_mul(SAMPLE));
        network.add_terminals(node, outside, inside);
    }
    Ok(Some(Problem { rooms, nodes, network, poles, is_torn }))
}

/// Share of a surface's area that lies over gaps no sampling leaves.
fn lids(complex: Complex<'_>, poles: &[Poles], sides: &[u8], progress: &Progress<'_>) -> Result<f64> {
    let mut areas = Vec::new();
    for range in progress.ranges(complex.finite) {
        for cell in range?.filter(|&cell| sides[cell] == 1).map(|cell| cell as u32) {
            for slot in (0..4).filter(|&slot| sides[complex.neighbour(cell, slot) as usize] == 0) {
                let facet = complex.facet(cell, slot);
                let is_lid = complex.circle(facet) as f32 > rooms::DEEP * spacing(poles, &facet);
                areas.push((complex.area(facet), is_lid));
            }
        }
    }
    // Sums depend on the order, and that on the number of threads.
    progress.sort(&mut areas, &|a, b| a.0.total_cmp(&b.0))?;
    let sum =
        |wanted: &dyn Fn(bool) -> bool| areas.iter().filter(|area| wanted(area.1)).map(|area| area.0).sum::<f64>();
    Ok(sum(&|is_lid| is_lid) / sum(&|_| true))
}

/// Puts parts of either side that no room is in, and that are small, on the other.
fn fill_crumbs(complex: Complex<'_>, rooms: &Rooms, sides: &mut [u8], progress: &Progress<'_>) -> Result<()> {
    let mut is_seen = vec![false; complex.len()];
    let mut part = Vec::new();
    let mut crumbs = Vec::new();
    for range in progress.ranges(complex.len()) {
        for first in range? {
            if std::mem::replace(&mut is_seen[first], true) {
                continue;
            }
            part.clear();
            part.push(first as u32);
            let (mut next, mut is_crumb) = (0, true);
            while next < part.len() {
                let cell = part[next];
                next += 1;
                is_crumb &= rooms.side(cell).is_none();
                if next.is_multiple_of(1 << 16) {
                    progress.check()?;
                }
                for slot in 0..4 {
                    let beyond = complex.neighbour(cell, slot);
                    if sides[beyond as usize] == sides[first] && !std::mem::replace(&mut is_seen[beyond as usize], true)
                    {
                        part.push(beyond);
                    }
                }
            }
            if is_crumb && part.len() < CRUMB {
                crumbs.extend_from_slice(&part);
            }
        }
    }
    crumbs.into_iter().for_each(|cell| sides[cell as usize] ^= 1);
    Ok(())
}

/// Adds what it costs to put a node on the other side.
fn add(network: &mut Network, node: u32, side: Side, price: u32) {
    match side {
        Side::Outside => network.add_terminals(node, price, 0),
        Side::Inside => network.add_terminals(node, 0, price),
    }
}

/// Cost of having a facet on the surface. It is the less, the smaller the facet is beside the spacing of its samples, and the flatter the
/// balls beside it pass through it \[LPK09\].
fn price(complex: Complex<'_>, balls: &Balls, poles: &[Poles], cell: u32, slot: usize) -> u32 {
    let facet = complex.facet(cell, slot);
    let circle = complex.circle(facet) as f32;
    let cosine = |cell: u32, slot: usize| {
        let radius = balls.radii[cell as usize];
        let share = if radius.is_finite() { (circle / radius).min(1.0) } else { 0.0 };
        let cosine = (1.0 - share * share).sqrt();
        if balls.sides[cell as usize] >> slot & 1 == 1 { cosine } else { -cosine }
    };
    let beyond = complex.neighbour(cell, slot);
    let smaller = cosine(cell, slot).min(cosine(beyond, complex.mirror(cell, slot)));
    // Of surfaces that cost nothing else, that of the fewest facets.
    let size = (circle / spacing(poles, &facet)).min(LARGEST);
    ((FACET * (1.0 - smaller) + AREA * size * size).round() as u32).max(1)
}

#[cfg(test)]
mod tests;
