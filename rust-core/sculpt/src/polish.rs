//! Fewer triangles at the same tolerance: vertices are removed as long as what remains can be triangulated within it.
//!
//! The mesh is cut into patches of a fixed size along its triangles. A patch is polished by one thread, its seams stay. The next pass cuts
//! elsewhere, and takes up only what lies around vertices that may still go. Patches, not threads, order the work, so any number of threads
//! gives the same mesh.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use rayon::prelude::*;

use super::borders::Region;
use super::delaunay::NONE;
use super::domain::Domain;
use super::patch::{Known, Patch};
use super::pieces::Pieces;
use super::search::{Search, Searcher};
use super::star::{Filling, Rules, Surgeon};
use super::view::View;
use base::error::Result;
use base::progress::{Pace, Progress};

/// Side of a patch in pixels. Tests look across many seams.
const PATCH: u32 = if cfg!(test) { 12 } else { 128 };

/// Triangles that one patch may well have where it is searched: below it, patches grow until they have as many or all.
const FEW: usize = if cfg!(test) { 64 } else { 4096 };

/// The same where vertices are removed only, which gains little on seams.
const FEWER: usize = if cfg!(test) { 64 } else { 512 };

/// Sides and shifts of the patches of each pass over a mesh of `triangles` triangles: first two cuts that avoid each other's seams, the
/// first of them also the lines between tiles. Then larger ones while they have few triangles.
pub(super) fn next_cut(pass: u32, domain: &Domain, triangles: usize, gained: bool) -> Option<[u32; 2]> {
    if pass < 2 {
        return Some([PATCH, if pass == 0 { PATCH / 2 } else { 0 }]);
    }
    let longest = domain.rows.max(domain.cols);
    let side = side_for(domain, triangles, FEWER);
    // Once; and once more across the seams that are left.
    match pass {
        2 if side > PATCH => Some([side, 0]),
        3 if side > PATCH && side < longest => Some([side, side / 2]),
        // A small mesh in one piece: until nothing changes.
        3.. if side >= longest && triangles < FEW && gained => Some([side, 0]),
        _ => None,
    }
}

/// Rounds of search at most.
const ROUNDS: u32 = 8;

/// The cut of a round of search. `gained` is the share of the triangles that went in the round before.
pub(super) fn next_search(round: u32, domain: &Domain, triangles: usize, gained: f64) -> Option<[u32; 2]> {
    if round >= ROUNDS || (round >= 2 && gained < 0.002) {
        return None;
    }
    let side = side_for(domain, triangles, FEW);
    // Seams elsewhere each time.
    let eighths = [0, 4, 2, 6, 1, 5, 3, 7][round as usize % 8];
    Some([side, if side >= domain.rows.max(domain.cols) { 0 } else { side / 8 * eighths }])
}

/// Side of patches that have at least about so many triangles each.
fn side_for(domain: &Domain, triangles: usize, few: usize) -> u32 {
    let mut side = u64::from(PATCH);
    let area = f64::from(domain.rows) * f64::from(domain.cols);
    while side < u64::from(domain.rows.max(domain.cols)) && triangles as f64 * (side * side) as f64 / area < few as f64
    {
        side *= 2;
    }
    side.min(u64::from(u32::MAX / 2)) as u32
}

/// One pass over the whole mesh with patches of `side` pixels whose corners lie `shift` pixels before those of a grid from
/// (0, 0), with a search before vertices are removed.
pub(super) fn pass<V: View>(
    view: &V,
    region: Region<'_>,
    pieces: &Pieces,
    [side, shift]: [u32; 2],
    rules: &Rules,
    search: Search,
    progress: &Progress<'_>,
) -> Result<Pieces> {
    let domain = region.domain;
    let (groups, rest) = group(domain, pieces, side, shift, search, progress)?;
    let pixels = domain.rows as usize * domain.cols as usize;
    let values = if search == Search::Free { pieces.values(pixels) } else { Vec::new() };
    let shared =
        if region.border.reaches_out() { shared(pixels, pieces, &groups, &rest, progress)? } else { Vec::new() };
    let known = Known { values, settled: pieces.settled.clone(), shared };
    let parts = groups
        .par_iter()
        .map_init(
            || (vec![0; pixels], Surgeon::new(progress), Searcher::new(progress)),
            |(scratch, surgeon, searcher), triangles| {
                let mut patch = Patch::new(view, region, pieces, triangles, &known, scratch, progress)?;
                searcher.improve(&mut patch, search, rules)?;
                remove_vertices(&mut patch, surgeon, rules)?;
                patch.into_pieces(&known, progress)
            },
        )
        .collect::<Result<Vec<_>>>()?;
    let mut settled = known.settled;
    settled.resize(pixels, false);
    let mut join = vec![pieces.some(&rest)];
    for (part, news) in parts {
        progress.check()?;
        join.push(part);
        news.into_iter().for_each(|(pixel, now)| settled[pixel as usize] = now);
    }
    Ok(Pieces { settled, ..Pieces::join(join) })
}

/// The triangles of each patch, in order, and those of none. A triangle belongs where its first pixel lies. If vertices are only removed,
/// triangles belong to none that lie two triangles or more from all vertices that may go.
fn group(
    domain: &Domain,
    pieces: &Pieces,
    side: u32,
    shift: u32,
    search: Search,
    progress: &Progress<'_>,
) -> Result<(Vec<Vec<u32>>, Vec<u32>)> {
    let place = |i: u32| (u64::from(i) + u64::from(shift)) / u64::from(side);
    let (across, down) = (place(domain.cols) as usize + 1, place(domain.rows) as usize + 1);
    let patch_of = |triangle: &[u32; 3]| {
        let p = triangle[0].min(triangle[1]).min(triangle[2]);
        place(p / domain.cols) as usize * across + place(p % domain.cols) as usize
    };
    let mut near = Vec::new();
    if search == Search::None && !pieces.settled.is_empty() {
        near = vec![false; pieces.settled.len()];
        for block in progress.blocks(&pieces.triangles) {
            for triangle in block? {
                if triangle.iter().any(|&p| !pieces.settled[p as usize]) {
                    triangle.iter().for_each(|&p| near[p as usize] = true);
                }
            }
        }
    }
    let rests = |triangle: &[u32; 3]| !near.is_empty() && triangle.iter().all(|&p| !near[p as usize]);
    let mut counts = vec![0_usize; across * down];
    for block in progress.blocks(&pieces.triangles) {
        block?.iter().filter(|t| !rests(t)).for_each(|triangle| counts[patch_of(triangle)] += 1);
    }
    let mut groups: Vec<Vec<u32>> = counts.iter().map(|&n| Vec::with_capacity(n)).collect();
    let mut rest = Vec::new();
    let mut pace = Pace::new(progress);
    for (t, triangle) in pieces.triangles.iter().enumerate() {
        pace.after(1)?;
        let list = if rests(triangle) { &mut rest } else { &mut groups[patch_of(triangle)] };
        list.push(t as u32);
    }
    groups.retain(|g| !g.is_empty());
    Ok((groups, rest))
}

/// Whether the triangles of more than one group have a pixel as a corner.
fn shared(
    pixels: usize,
    pieces: &Pieces,
    groups: &[Vec<u32>],
    rest: &Vec<u32>,
    progress: &Progress<'_>,
) -> Result<Vec<bool>> {
    let mut owner = vec![NONE; pixels];
    let mut shared = vec![false; pixels];
    for (group, triangles) in groups.iter().chain([rest]).enumerate() {
        for block in progress.blocks(triangles) {
            for p in block?.iter().flat_map(|&t| pieces.triangles[t as usize]).map(|p| p as usize) {
                shared[p] |= owner[p] != NONE && owner[p] != group as u32;
                owner[p] = group as u32;
            }
        }
    }
    Ok(shared)
}

/// A vertex that can be removed. The smallest cost comes first.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Entry {
    /// Bits of a number >= 0, which sort as the number does.
    cost: u64,
    vertex: u32,
    filling: Filling,
}

/// State of a vertex.
#[derive(Clone, Copy, PartialEq, Eq)]
enum State {
    /// Its star can't be filled, or could not when looked at last.
    Stuck,
    /// In the queue with its filling.
    Ready,
    /// In the queue, but its star has changed since.
    Stale,
    /// Gone.
    Removed,
}

/// Removes vertices, those whose stars are filled with the smallest errors first.
fn remove_vertices<S: super::view::Site>(
    patch: &mut Patch<'_, S>,
    surgeon: &mut Surgeon<'_, S>,
    rules: &Rules,
) -> Result<()> {
    let mut queue = BinaryHeap::with_capacity(patch.vertices);
    let mut states = vec![State::Stuck; patch.sites.len()];
    for v in 0..patch.sites.len() as u32 {
        if patch.out[v as usize] != NONE
            && !patch.settled[v as usize]
            && let Some((cost, filling)) = surgeon.find(patch, v, rules)?
        {
            states[v as usize] = State::Ready;
            queue.push(Reverse(Entry { cost, vertex: v, filling }));
        }
    }
    // Each vertex is in the queue once at most.
    while let Some(Reverse(Entry { vertex, filling, .. })) = queue.pop() {
        let v = vertex as usize;
        let filling = match states[v] {
            State::Ready => filling,
            State::Stale => {
                let Some((cost, filling)) = surgeon.find(patch, vertex, rules)? else {
                    states[v] = State::Stuck;
                    continue;
                };
                if queue.peek().is_some_and(|Reverse(next)| next.cost < cost) {
                    states[v] = State::Ready;
                    queue.push(Reverse(Entry { cost, vertex, filling }));
                    continue;
                }
                filling
            }
            _ => continue,
        };
        surgeon.make(patch, vertex, filling)?;
        states[v] = State::Removed;
        for &corner in surgeon.ring() {
            let state = &mut states[corner as usize];
            patch.settled[corner as usize] = false;
            match state {
                State::Ready => *state = State::Stale,
                State::Stuck if patch.out[corner as usize] != NONE => {
                    // Its star is smaller now: once more, after all others.
                    *state = State::Stale;
                    let cost = f64::INFINITY.to_bits();
                    queue.push(Reverse(Entry { cost, vertex: corner, filling: Filling::default() }));
                }
                _ => {}
            }
        }
    }
    Ok(())
}
