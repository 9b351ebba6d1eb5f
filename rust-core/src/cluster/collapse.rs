//! Takes nodes away, shortest edges first, until as many are left as are wanted. Ours; the paper has no such stage.
//!
//! k patches give a number of nodes that only the topology decides, near 3 k; the last few are taken away here. An edge is
//! collapsed only if its ends have no common neighbours but those its triangles name, so the topology stays.

use super::flip::Links;
use super::net::{Net, Spot, area_vector};
use super::surface::{NONE, Surface};
use crate::error::Result;
use crate::progress::Progress;

/// Collapses edges until at most `wanted` nodes are left, or no edge can be.
///
/// # Errors
/// [`crate::Error::Cancelled`].
pub fn collapse(surface: &Surface, net: &mut Net, wanted: usize, progress: &Progress<'_>) -> Result<()> {
    while net.points.len() > wanted {
        progress.check()?;
        let before = net.points.len();
        pass(surface, net, before - wanted);
        if net.points.len() == before {
            break;
        }
    }
    Ok(())
}

/// Collapses up to `most` edges whose surroundings don't touch, and closes the ranks.
fn pass(surface: &Surface, net: &mut Net, most: usize) {
    let links = Links::of(&net.triangles, net.points.len());
    let mut edges: Vec<(f64, u32)> = (0..links.twins.len() as u32)
        .filter(|&h| links.twins[h as usize] == NONE || h < links.twins[h as usize])
        .map(|h| {
            let [a, b] = ends(net, h).map(|v| net.points[v as usize]);
            (a.distance_squared(b), h)
        })
        .collect();
    edges.sort_unstable_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
    // A pass far beyond the short edges would take away what later passes choose better.
    let most = most.min(1 + net.points.len() / 20);
    let mut touched = vec![false; net.points.len()];
    let mut into: Vec<u32> = (0..net.points.len() as u32).collect();
    let (mut ring_a, mut ring_b, mut done) = (Vec::new(), Vec::new(), 0);
    for &(_, h) in &edges {
        if done == most {
            break;
        }
        let [mut a, mut b] = ends(net, h);
        ring(net, &links, a, &mut ring_a);
        ring(net, &links, b, &mut ring_b);
        if ring_a.iter().chain(&ring_b).any(|&v| touched[v as usize]) {
            continue;
        }
        let (border_a, border_b) = (net.on_rail(a), net.on_rail(b));
        let at_border = links.twins[h as usize] == NONE;
        if border_a && border_b && !at_border {
            continue;
        }
        let common = ring_a.iter().filter(|v| ring_b.contains(v)).count();
        let expected = if at_border { 1 } else { 2 };
        let least = if at_border { 4 } else { 5 };
        if common != expected || ring_a.len() + ring_b.len() < least + 2 * expected {
            continue;
        }
        if border_b && !border_a {
            std::mem::swap(&mut a, &mut b);
        }
        // On a border of three edges nothing may go.
        if at_border && border_is_short(net, &links, h) {
            continue;
        }
        let middle = (net.points[a as usize] + net.points[b as usize]) * 0.5;
        let spot = if border_a != border_b {
            Spot { point: net.points[a as usize], place: net.places[a as usize], rail: net.rails[a as usize] }
        } else {
            net.project(surface, a as usize, middle)
        };
        if turns_over(net, &links, a, b, &spot) {
            continue;
        }
        net.put(a as usize, spot);
        into[b as usize] = a;
        ring_a.iter().chain(&ring_b).for_each(|&v| touched[v as usize] = true);
        done += 1;
    }
    close_ranks(net, &into);
}

fn ends(net: &Net, h: u32) -> [u32; 2] {
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

/// Whether moving `a` to `spot` and `b` onto it turns one of their other triangles over.
fn turns_over(net: &Net, links: &Links, a: u32, b: u32, spot: &Spot) -> bool {
    [a, b].into_iter().any(|v| {
        let other = if v == a { b } else { a };
        let mut turned = false;
        links.triangles_around(v, |t| {
            let triangle = net.triangles[t as usize];
            if triangle.contains(&other) {
                return;
            }
            let before = net.area_vector(t as usize);
            let after = area_vector(triangle.map(|w| if w == v { spot.point } else { net.points[w as usize] }));
            turned |= !(after.dot(before) > 0.2 * after.length() * before.length());
        });
        turned
    })
}

/// Drops the nodes that have gone into others, and their triangles.
fn close_ranks(net: &mut Net, into: &[u32]) {
    let kept = |v: usize| into[v] == v as u32;
    let mut number = vec![NONE; into.len()];
    let mut count = 0;
    for v in 0..into.len() {
        if kept(v) {
            number[v] = count;
            count += 1;
        }
    }
    let mut v = 0;
    net.points.retain(|_| (kept(v), v += 1).0);
    v = 0;
    net.places.retain(|_| (kept(v), v += 1).0);
    v = 0;
    net.rails.retain(|_| (kept(v), v += 1).0);
    for triangle in &mut net.triangles {
        *triangle = triangle.map(|v| number[into[v as usize] as usize]);
    }
    net.triangles.retain(|[a, b, c]| a != b && b != c && c != a);
}
