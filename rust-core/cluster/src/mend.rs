//! Sharp angles that springs and flips leave, mostly along borders. Nodes too close are joined, others are put where edges are longest, and
//! nodes at sharp angles are moved to where the smallest angle around them is largest. Ours.

use glam::DVec3;

use super::collapse::{by_length, collapse_sharp, ends};
use super::flip::{Goal, Links, flips};
use super::net::{Net, Size, Stars, area_vector, smallest_angle};
use super::relax::relax;
use super::surface::{NONE, Surface};
use base::error::Result;
use base::progress::Progress;
use mesh::measure::angles;

/// Angles below this, in degrees, are to be mended.
const SHARP: f64 = 35.0;
/// Angles below this, in radians, let go of creases: 30 degrees.
const RELEASED: f64 = std::f64::consts::FRAC_PI_6;
/// Rounds of joining, adding and moving nodes.
const ROUNDS: usize = 4;
/// Relaxation steps after nodes were joined or added.
const STEPS: usize = 20;
/// Sweeps of moves and flips in each round.
const SWEEPS: usize = 6;
/// Steps of the search for a node's best place, and the directions that each tries.
const SEARCH: usize = 16;
const DIRECTIONS: usize = 8;
/// The first step, as a share of the mean edge at the node. It is halved if no direction helps.
const FIRST_STEP: f64 = 0.25;
/// Gain of the smallest angle around a node, in radians, for a move to count. Less would keep sweeps going for nothing.
const GAIN: f64 = 1e-4;
/// Cosine of the most that a triangle may turn by a move of one of its corners: 60 degrees.
const TURN: f64 = 0.5;
/// Square of the least distance of a new node from the ends of the edge that it splits, in lengths of that edge: a fifth.
const CLEAR_SQUARED: f64 = 0.04;
/// Nodes between two looks at the progress.
const PACE: usize = 64;

/// Mends sharp angles. The net is of the size that is wanted afterwards, as far as the topology lets it.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn mend(surface: &Surface, net: &mut Net, wanted: Option<Size>, progress: &Progress<'_>) -> Result<()> {
    let sharp = SHARP.to_radians();
    for round in 0..ROUNDS {
        progress.check()?;
        let joined = collapse_sharp(surface, net, sharp, progress)?;
        if let Some(wanted) = wanted {
            let missing = wanted.missing(net);
            if missing > 0 {
                split_longest(surface, net, missing, progress)?;
            }
        }
        if joined > 0 {
            flips(net, Goal::Valence, progress)?;
            relax(surface, net, STEPS, progress)?;
            flips(net, Goal::Angle, progress)?;
        }
        for _ in 0..SWEEPS {
            progress.check()?;
            let moved = sweep(surface, net, sharp, progress)?;
            flips(net, Goal::Angle, progress)?;
            if moved == 0 {
                break;
            }
        }
        if joined == 0 && round > 0 {
            break;
        }
    }
    Ok(())
}

/// Lets go of creases beside angles below 30 degrees, unless two creases make that angle, and mends these: lines that noise makes
/// leave triangles no room.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn release(surface: &Surface, net: &mut Net, progress: &Progress<'_>) -> Result<()> {
    for _ in 0..ROUNDS {
        progress.check()?;
        let crowded = |t: &&[u32; 3]| {
            let angles = angles(t.map(|v| net.points[v as usize]));
            (0..3).any(|k| {
                let [v, a, b] = [0, 1, 2].map(|i| t[(k + i) % 3]);
                angles[k] < RELEASED && !(net.is_ridge(v, a) && net.is_ridge(v, b))
            })
        };
        let mut free: Vec<u32> =
            net.triangles.iter().filter(crowded).flatten().copied().filter(|&v| net.on_crease(v)).collect();
        if free.is_empty() {
            break;
        }
        free.sort_unstable();
        free.iter().for_each(|&v| net.ways[v as usize] = NONE);
        net.ridges.retain(|ends| ends.iter().all(|v| free.binary_search(v).is_err()));
        for _ in 0..SWEEPS {
            flips(net, Goal::Angle, progress)?;
            if sweep(surface, net, SHARP.to_radians(), progress)? == 0 {
                break;
            }
        }
    }
    Ok(())
}

/// Puts nodes in the middle of the `count` longest edges, of those inside that don't share a triangle.
fn split_longest(surface: &Surface, net: &mut Net, count: usize, progress: &Progress<'_>) -> Result<()> {
    let links = Links::of(&net.triangles, net.points.len(), progress)?;
    let edges = by_length(net, &links);
    let mut used = vec![false; net.triangles.len()];
    let mut left = count;
    for &(_, h) in edges.iter().rev() {
        let g = links.twins[h as usize];
        if left == 0 {
            break;
        }
        let [a, b] = ends(net, h);
        if g == NONE || used[h as usize / 3] || used[g as usize / 3] || net.is_ridge(a, b) {
            continue;
        }
        let [c, d] = [h, g].map(|h| ends(net, Surface::previous(h))[0]);
        let middle = (net.points[a as usize] + net.points[b as usize]) * 0.5;
        let place = surface.walk(middle, net.places[a as usize]);
        // On a rim the walk may end elsewhere.
        let [p, q] = [a, b].map(|v| net.points[v as usize].distance_squared(place.point));
        if !(p.min(q) > CLEAR_SQUARED * net.points[a as usize].distance_squared(net.points[b as usize])) {
            continue;
        }
        let new = net.points.len() as u32;
        net.points.push(place.point);
        net.places.push(place.triangle);
        net.rails.push(NONE);
        net.ways.push(NONE);
        net.triangles[h as usize / 3] = [a, new, c];
        net.triangles[g as usize / 3] = [b, new, d];
        net.triangles.extend([[new, b, c], [new, a, d]]);
        used[h as usize / 3] = true;
        used[g as usize / 3] = true;
        left -= 1;
    }
    Ok(())
}

/// Moves every node of a sharp triangle to where the smallest angle around it is largest. Returns how many moved.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn sweep(surface: &Surface, net: &mut Net, sharp: f64, progress: &Progress<'_>) -> Result<usize> {
    let corners = |t: &[u32; 3]| t.map(|v| net.points[v as usize]);
    let mut nodes: Vec<u32> =
        net.triangles.iter().filter(|t| smallest_angle(corners(t)) < sharp).flatten().copied().collect();
    if nodes.is_empty() {
        return Ok(0);
    }
    nodes.sort_unstable();
    nodes.dedup();
    nodes.retain(|&v| !net.is_fixed(v));
    let stars = Stars::of(&net.triangles, net.points.len());
    let mut moved = 0;
    for (i, &v) in nodes.iter().enumerate() {
        if i.is_multiple_of(PACE) {
            progress.check()?;
        }
        moved += usize::from(improve(surface, net, &stars, v as usize));
    }
    Ok(moved)
}

/// A search in shrinking steps over the tangent plane, or along the border.
fn improve(surface: &Surface, net: &mut Net, stars: &Stars, v: usize) -> bool {
    let star = stars.around(v);
    let (mut normal, mut length) = (DVec3::ZERO, 0.0);
    for &corner in star {
        let (t, k) = (corner as usize / 3, corner as usize % 3);
        normal += net.area_vector(t);
        length += net.points[v].distance(net.points[net.triangles[t][(k + 1) % 3] as usize]) / star.len() as f64;
    }
    let (Some(normal), true) = (normal.try_normalize(), length > 0.0) else { return false };
    let x = normal.any_orthonormal_vector();
    let y = normal.cross(x);
    let directions: Vec<DVec3> = (0..DIRECTIONS)
        .map(|i| {
            let (sin, cos) = (i as f64 * (std::f64::consts::TAU / DIRECTIONS as f64)).sin_cos();
            x * cos + y * sin
        })
        .collect();
    let before = net.spot(v as u32);
    let areas: Vec<DVec3> = star.iter().map(|&c| net.area_vector(c as usize / 3)).collect();
    let smallest = |net: &Net, point: DVec3| {
        let mut smallest = f64::INFINITY;
        for (&corner, before) in star.iter().zip(&areas) {
            let t = net.triangles[corner as usize / 3];
            let corners = t.map(|w| if w as usize == v { point } else { net.points[w as usize] });
            let after = area_vector(corners);
            // A triangle without area may turn anywhere.
            if !(after.dot(*before) > TURN * after.length() * before.length()) && *before != DVec3::ZERO {
                return f64::NEG_INFINITY;
            }
            smallest = smallest.min(smallest_angle(corners));
        }
        smallest
    };
    let (start, mut best) = (smallest(net, before.point), (smallest(net, before.point), before));
    let mut step = FIRST_STEP * length;
    for _ in 0..SEARCH {
        let from = best;
        for &direction in &directions {
            let place = net.project_from(surface, &from.1, from.1.point + direction * step);
            let angle = smallest(net, place.point);
            if angle > best.0 {
                best = (angle, place);
            }
        }
        if best.0 == from.0 {
            step *= 0.5;
        }
    }
    net.put(v, best.1);
    best.0 > start + GAIN
}
