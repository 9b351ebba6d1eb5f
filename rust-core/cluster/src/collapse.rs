//! Takes nodes away until as many are left as are wanted, or where two are too close. Ours: the paper has no such stage.
//!
//! k patches give a number of nodes that only the topology decides, near 3 k. The last few are taken away here, where edges are shortest
//! beside their neighbours. An edge is collapsed only if its ends have no common neighbours but those its triangles name, so the topology
//! stays.

use super::flip::Links;
use super::net::{Net, Size, Spot, area_vector, smallest_angle};
use super::surface::{NONE, Surface};
use base::error::Result;
use base::progress::Progress;

/// Edges at a sharp angle that are shorter than this share of their neighbours are collapsed.
const SHORT: f64 = 0.75;

/// Collapses edges until no more than `wanted` is left, or no edge can be.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn collapse(surface: &Surface, net: &mut Net, wanted: Size, progress: &Progress<'_>) -> Result<()> {
    while wanted.beyond(net) > 0 {
        progress.check()?;
        let before = net.points.len();
        // A pass far beyond the short edges would take away what later passes choose better.
        let most = wanted.beyond(net).min(1 + before / 20);
        let links = Links::of(&net.triangles, before, progress)?;
        let edges = by_length(net, &links);
        pass(surface, net, &links, &edges, most, false, progress)?;
        if net.points.len() == before {
            break;
        }
    }
    Ok(())
}

/// Collapses the short edges opposite angles below `sharp` if that makes the angles around it larger. Returns how many.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn collapse_sharp(surface: &Surface, net: &mut Net, sharp: f64, progress: &Progress<'_>) -> Result<usize> {
    let before = net.points.len();
    let links = Links::of(&net.triangles, before, progress)?;
    let is_sharp = |t: u32| smallest_angle(net.triangles[t as usize].map(|v| net.points[v as usize])) < sharp;
    let mut edges = by_length(net, &links);
    edges.retain(|&(length, h)| {
        let twin = links.twins[h as usize];
        length < SHORT && (is_sharp(h / 3) || twin != NONE && is_sharp(twin / 3))
    });
    pass(surface, net, &links, &edges, before, true, progress)?;
    Ok(before - net.points.len())
}

/// All edges, each by one of its half-edges, with their lengths beside those of their ends' edges. Shortest first.
pub fn by_length(net: &Net, links: &Links) -> Vec<(f64, u32)> {
    let length = |h: u32| {
        let [a, b] = ends(net, h).map(|v| net.points[v as usize]);
        a.distance(b)
    };
    let mut sums = vec![(0.0, 0.0); net.points.len()];
    for h in 0..links.twins.len() as u32 {
        // An edge inside is met from both sides, one on the border once.
        let (weight, length) = (if links.twins[h as usize] == NONE { 1.0 } else { 0.5 }, length(h));
        for v in ends(net, h) {
            sums[v as usize].0 += weight * length;
            sums[v as usize].1 += weight;
        }
    }
    let mean = |v: u32| sums[v as usize].0 / sums[v as usize].1;
    let mut edges: Vec<(f64, u32)> = (0..links.twins.len() as u32)
        .filter(|&h| links.twins[h as usize] == NONE || h < links.twins[h as usize])
        .map(|h| {
            let [a, b] = ends(net, h);
            let around = 0.5 * (mean(a) + mean(b));
            (if around > 0.0 { length(h) / around } else { 0.0 }, h)
        })
        .collect();
    edges.sort_unstable_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
    edges
}

/// Collapses up to `most` of the edges, whose surroundings don't touch, and closes the ranks. With `better`, only where the
/// smallest angle around grows.
fn pass(
    surface: &Surface,
    net: &mut Net,
    links: &Links,
    edges: &[(f64, u32)],
    most: usize,
    better: bool,
    progress: &Progress<'_>,
) -> Result<()> {
    let mut touched = vec![false; net.points.len()];
    let mut into: Vec<u32> = (0..net.points.len() as u32).collect();
    let (mut ring_a, mut ring_b, mut done) = (Vec::new(), Vec::new(), 0);
    for (i, &(_, h)) in edges.iter().enumerate() {
        if done == most {
            break;
        }
        if i.is_multiple_of(1024) {
            progress.check()?;
        }
        let [mut a, mut b] = ends(net, h);
        ring(net, links, a, &mut ring_a);
        ring(net, links, b, &mut ring_b);
        if ring_a.iter().chain(&ring_b).any(|&v| touched[v as usize]) {
            continue;
        }
        let (free_a, free_b) = (freedom(net, a), freedom(net, b));
        let at_border = links.twins[h as usize] == NONE;
        let along = at_border || net.is_ridge(a, b);
        if free_a.max(free_b) < Freedom::Surface && !along || free_a == Freedom::None && free_b == Freedom::None {
            continue;
        }
        let common = ring_a.iter().filter(|v| ring_b.contains(v)).count();
        let expected = if at_border { 1 } else { 2 };
        let least = if at_border { 4 } else { 5 };
        if common != expected || ring_a.len() + ring_b.len() < least + 2 * expected {
            continue;
        }
        if free_b < free_a {
            std::mem::swap(&mut a, &mut b);
        }
        // On a border of three edges nothing may go.
        if at_border && border_is_short(net, links, h) {
            continue;
        }
        let middle = (net.points[a as usize] + net.points[b as usize]) * 0.5;
        let spots = if free_a != free_b {
            [net.spot(a); 3]
        } else {
            [net.project(surface, a as usize, middle), net.spot(a), net.spot(b)]
        };
        let before = if better { smallest_before(net, links, a, b) } else { 0.0 };
        let best = spots[..if better { 3 } else { 1 }]
            .iter()
            .filter_map(|&spot| smallest_after(net, links, a, b, &spot).map(|angle| (angle, spot)))
            .reduce(|best, next| if next.0 > best.0 { next } else { best });
        let Some((after, spot)) = best else { continue };
        if better && after <= before {
            continue;
        }
        net.put(a as usize, spot);
        into[b as usize] = a;
        ring_a.iter().chain(&ring_b).for_each(|&v| touched[v as usize] = true);
        done += 1;
    }
    close_ranks(net, &into);
    Ok(())
}

/// Places that a node may go to, the least first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Freedom {
    /// It stays at a corner.
    None,
    Border,
    Crease,
    Surface,
}

fn freedom(net: &Net, v: u32) -> Freedom {
    match (net.is_fixed(v), net.on_rail(v), net.on_crease(v)) {
        (true, ..) => Freedom::None,
        (_, true, _) => Freedom::Border,
        (_, _, true) => Freedom::Crease,
        _ => Freedom::Surface,
    }
}

/// The ends of an edge.
pub fn ends(net: &Net, h: u32) -> [u32; 2] {
    let t = net.triangles[h as usize / 3];
    [t[h as usize % 3], t[(h as usize + 1) % 3]]
}

/// Nodes that share an edge with `v`.
fn ring(net: &Net, links: &Links, v: u32, ring: &mut Vec<u32>) {
    ring.clear();
    links.around(&net.triangles, v, |w| ring.push(w));
}

fn border_is_short(net: &Net, links: &Links, h: u32) -> bool {
    let mut at = h;
    for _ in 0..3 {
        at = links.first[ends(net, at)[1] as usize];
        if at == h {
            return true;
        }
    }
    false
}

/// Smallest angle of the triangles at two nodes.
fn smallest_before(net: &Net, links: &Links, a: u32, b: u32) -> f64 {
    let mut smallest = f64::INFINITY;
    for v in [a, b] {
        links.triangles_around(v, |t| {
            smallest = smallest.min(smallest_angle(net.triangles[t as usize].map(|w| net.points[w as usize])));
        });
    }
    smallest
}

/// Smallest angle of the other triangles at `a` and `b` with both nodes at `spot`. `None` if that turns one over.
fn smallest_after(net: &Net, links: &Links, a: u32, b: u32, spot: &Spot) -> Option<f64> {
    let (mut smallest, mut turned) = (f64::INFINITY, false);
    for (v, other) in [(a, b), (b, a)] {
        links.triangles_around(v, |t| {
            let triangle = net.triangles[t as usize];
            if turned || triangle.contains(&other) {
                return;
            }
            let before = net.area_vector(t as usize);
            let corners = triangle.map(|w| if w == v { spot.point } else { net.points[w as usize] });
            let after = area_vector(corners);
            turned |= !(after.dot(before) > 0.2 * after.length() * before.length());
            smallest = smallest.min(smallest_angle(corners));
        });
    }
    (!turned).then_some(smallest)
}

/// Drops the nodes that have gone into others, and their triangles.
fn close_ranks(net: &mut Net, into: &[u32]) {
    let mut number = vec![NONE; into.len()];
    for (count, v) in (0..).zip((0..into.len()).filter(|&v| into[v] == v as u32)) {
        number[v] = count;
    }
    net.renumber(&number);
    for ends in &mut net.ridges {
        *ends = ends.map(|v| number[into[v as usize] as usize]);
        ends.sort_unstable();
    }
    net.ridges.retain(|[a, b]| a != b);
    net.ridges.sort_unstable();
    net.ridges.dedup();
    for triangle in &mut net.triangles {
        *triangle = triangle.map(|v| number[into[v as usize] as usize]);
    }
    net.triangles.retain(|[a, b, c]| a != b && b != c && c != a);
}
