//! Stage 6, last: nodes beside a crease of the surface go onto it, and edges that cross one are flipped along it; nodes beside
//! a corner of the border go there. Ours.
//!
//! A crease is a run of edges whose triangles turn by more than 40 degrees, at least as long as a few edges of the net: what is
//! shorter is noise, or detail that the net can't show. Of an edge that crosses a crease, one end is within half its length of
//! it, so hardly any crossing is left. Nothing turns a triangle over or makes an angle below 30 degrees.

use glam::DVec3;

use super::flip::{Goal, Links, flips, quad, turn};
use super::mend::sweep;
use super::net::{Net, Spot, area_vector, smallest_angle};
use super::relax::relax;
use super::surface::{NONE, Surface, looking};
use base::error::Result;
use base::progress::{Pace, Progress};
use geom::bvh::Bvh;
use geom::neighbours::KdTree;

/// Cosine of the angle between the normals at a crease, 40 degrees.
const CREASE: f64 = 0.766;
/// Cosine of the turn from which a crease has a corner: 45 degrees.
const CORNER: f64 = 0.7;
/// Least length of a crease, in mean edges of the net.
const LEAST: f64 = 3.0;
/// Farthest move of a node onto a crease, as a share of the mean edge around it.
const REACH: f64 = 0.5;
/// The same onto a corner.
const REACH_CORNER: f64 = 0.75;
/// Cosine of the most that a triangle may turn by a move onto a crease: 78 degrees, since the two sides of a crease differ.
const TURN: f64 = 0.2;
/// Smallest angle that a move or a flip may make, in radians, unless there was a smaller one.
const SHARP: f64 = std::f64::consts::FRAC_PI_6;
/// The same while the nodes around may still make way: 11 degrees.
const LOOSE: f64 = 0.2;
/// Angles below this are mended then, in radians: 34 degrees, a little above what is asked for.
const MENDED: f64 = 0.6;
/// Rounds of making way, their relaxation steps and sweeps.
const ROUNDS: usize = 2;
const STEPS: usize = 20;
const SWEEPS: usize = 6;

/// Most edges of the border that are looked along for a corner: dense borders cost no more than this each.
const LOOKED: usize = 512;

/// Creases as segments between vertices of the surface, each with a triangle beside it, and their corners.
struct Creases {
    segments: Vec<[u32; 3]>,
    beside: Vec<u32>,
    corners: Vec<(u32, u32)>,
}

/// A vertex where the border turns, and the half-edges of the border around it.
struct BorderCorner {
    vertex: u32,
    rails: Vec<u32>,
}

/// Draws the net onto the creases.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn keep(surface: &Surface, net: &mut Net, progress: &Progress<'_>) -> Result<()> {
    let links = Links::of(&net.triangles, net.points.len(), progress)?;
    let lengths = mean_lengths(net, &links);
    let mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
    let creases = Creases::of(surface, LEAST * mean, progress)?;
    let corners = border_corners(surface, mean, progress)?;
    if creases.segments.is_empty() {
        if corners.is_empty() {
            return Ok(());
        }
        let mut direct = net.clone();
        direct.held = vec![false; net.points.len()];
        if take_border_corners(surface, &mut direct, &links, &corners, &lengths, SHARP, progress)? == corners.len() {
            *net = direct;
            net.held = Vec::new();
            return Ok(());
        }
    }
    let tree = Bvh::build_with(&surface.points, &creases.segments, rayon::current_num_threads(), progress)?;
    let creases = (&creases, &corners[..]);
    // With room to make way most nodes beside a crease reach it; where that costs an angle, they get none.
    let mut loose = net.clone();
    draw(surface, &mut loose, &links, creases, &tree, &lengths, LOOSE, progress)?;
    for round in 0..ROUNDS {
        relax(surface, &mut loose, STEPS, progress)?;
        flips(&mut loose, Goal::Angle, progress)?;
        for _ in 0..SWEEPS {
            if sweep(surface, &mut loose, MENDED, progress)? == 0 {
                break;
            }
            flips(&mut loose, Goal::Angle, progress)?;
        }
        if round + 1 < ROUNDS {
            let links = Links::of(&loose.triangles, loose.points.len(), progress)?;
            draw(surface, &mut loose, &links, creases, &tree, &lengths, SHARP, progress)?;
        }
    }
    let smallest = |net: &Net| {
        let angle = |t: &[u32; 3]| smallest_angle(t.map(|v| net.points[v as usize]));
        net.triangles.iter().map(angle).fold(f64::INFINITY, f64::min)
    };
    if smallest(&loose) >= smallest(net).min(SHARP) {
        *net = loose;
    } else {
        draw(surface, net, &links, creases, &tree, &lengths, SHARP, progress)?;
    }
    net.held = Vec::new();
    Ok(())
}

/// Moves nodes to corners and creases and flips edges along these, without angles below `sharp`; nodes there are held.
#[expect(clippy::too_many_arguments, reason = "all of it is one stage's state")]
fn draw(
    surface: &Surface,
    net: &mut Net,
    links: &Links,
    (creases, corners): (&Creases, &[BorderCorner]),
    tree: &Bvh<'_>,
    lengths: &[f64],
    sharp: f64,
    progress: &Progress<'_>,
) -> Result<()> {
    if net.held.is_empty() {
        net.held = vec![false; net.points.len()];
        take_corners(surface, net, links, creases, lengths, sharp);
        take_border_corners(surface, net, links, corners, lengths, sharp, progress)?;
    }
    let mut near = Vec::new();
    for v in (0..net.points.len() as u32).filter(|&v| !net.on_rail(v) && !net.is_held(v)) {
        looking(v, progress)?;
        let Some(closest) = tree.closest_point(net.points[v as usize]) else { continue };
        let share = closest.distance() / lengths[v as usize];
        if share < REACH {
            near.push((share, v, closest.point, creases.beside[closest.triangle as usize]));
        }
    }
    near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    for &(_, v, point, place) in &near {
        net.held[v as usize] = try_move(net, links, v, Spot { point, place, rail: NONE }, sharp);
    }
    let mut links = Links::of(&net.triangles, net.points.len(), progress)?;
    align(net, &mut links, tree, sharp, progress)
}

impl Creases {
    fn of(surface: &Surface, least: f64, progress: &Progress<'_>) -> Result<Self> {
        let normal = |t: u32| area_vector(surface.corners(t)).normalize_or_zero();
        let mut edges = Vec::new();
        for h in 0..surface.twins.len() as u32 {
            looking(h, progress)?;
            let twin = surface.twins[h as usize];
            if twin != NONE && h < twin {
                let (a, b) = (normal(h / 3), normal(twin / 3));
                if a != DVec3::ZERO && b != DVec3::ZERO && a.dot(b) < CREASE {
                    edges.push(h);
                }
            }
        }
        // Runs of edges by union-find over their ends; the smaller number leads.
        let mut leader: Vec<u32> = (0..surface.points.len() as u32).collect();
        fn find(leader: &mut [u32], mut v: u32) -> u32 {
            while leader[v as usize] != v {
                leader[v as usize] = leader[leader[v as usize] as usize];
                v = leader[v as usize];
            }
            v
        }
        let length = |h: u32| surface.points[surface.from(h) as usize].distance(surface.points[surface.to(h) as usize]);
        for &h in &edges {
            let (a, b) = (find(&mut leader, surface.from(h)), find(&mut leader, surface.to(h)));
            leader[a.max(b) as usize] = a.min(b);
        }
        progress.check()?;
        let mut lengths = vec![0.0; leader.len()];
        for &h in &edges {
            lengths[find(&mut leader, surface.from(h)) as usize] += length(h);
        }
        edges.retain(|&h| lengths[find(&mut leader, surface.from(h)) as usize] >= least);
        let mut ends: Vec<(u32, u32, u32)> = edges
            .iter()
            .flat_map(|&h| [(surface.from(h), surface.to(h), h / 3), (surface.to(h), surface.from(h), h / 3)])
            .collect();
        ends.sort_unstable();
        let corners = ends
            .chunk_by(|a, b| a.0 == b.0)
            .filter(|at| {
                let towards = |i: usize| {
                    (surface.points[at[i].1 as usize] - surface.points[at[i].0 as usize]).normalize_or_zero()
                };
                at.len() > 2 || at.len() == 2 && -towards(0).dot(towards(1)) < CORNER
            })
            .map(|at| (at[0].0, at[0].2))
            .collect();
        let segments = edges.iter().map(|&h| [surface.from(h), surface.to(h), surface.to(h)]).collect();
        Ok(Creases { segments, beside: edges.iter().map(|h| h / 3).collect(), corners })
    }
}

/// Corners of the border, as seen by a net with edges of about `reach`: the sharpest turn first, no other within `reach` of it.
fn border_corners(surface: &Surface, reach: f64, progress: &Progress<'_>) -> Result<Vec<BorderCorner>> {
    // The border's half-edges from a vertex on, or up to it, as far as `reach`, and the point there.
    let along = |vertex: u32, forward: bool, visit: &mut dyn FnMut(u32)| {
        let (mut at, mut passed) = (vertex, 0.0);
        for _ in 0..LOOKED {
            let h = if forward { surface.first[at as usize] } else { surface.border_in[at as usize] };
            visit(h);
            let next = if forward { surface.to(h) } else { surface.from(h) };
            passed += surface.points[at as usize].distance(surface.points[next as usize]);
            at = next;
            if passed >= reach || at == vertex {
                break;
            }
        }
        surface.points[at as usize]
    };
    let mut turns = Vec::new();
    let mut pace = Pace::new(progress);
    for v in (0..surface.points.len() as u32).filter(|&v| surface.border_in[v as usize] != NONE) {
        let here = surface.points[v as usize];
        let mut steps = 1;
        let (ahead, behind) = (along(v, true, &mut |_| steps += 1), along(v, false, &mut |_| steps += 1));
        pace.after(steps)?;
        let turn = (ahead - here).normalize_or_zero().dot((here - behind).normalize_or_zero());
        if turn < CORNER {
            turns.push((turn, v));
        }
    }
    turns.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut near = vec![false; surface.points.len()];
    let mut corners = Vec::new();
    for (_, vertex) in turns {
        if near[vertex as usize] {
            continue;
        }
        pace.after(2 * LOOKED)?;
        let mut rails = Vec::new();
        along(vertex, true, &mut |h| rails.push(h));
        along(vertex, false, &mut |h| rails.push(h));
        for &h in &rails {
            (near[surface.from(h) as usize], near[surface.to(h) as usize]) = (true, true);
        }
        corners.push(BorderCorner { vertex, rails });
    }
    Ok(corners)
}

/// Mean length of the edges at each node.
fn mean_lengths(net: &Net, links: &Links) -> Vec<f64> {
    let mean = |v: u32| {
        let (mut sum, mut count) = (0.0, 0.0);
        links.around(&net.triangles, v, |w| {
            sum += net.points[v as usize].distance(net.points[w as usize]);
            count += 1.0;
        });
        sum / count
    };
    (0..net.points.len() as u32).map(mean).collect()
}

/// The nearest node to each corner goes there, if it may and reaches it.
fn take_corners(surface: &Surface, net: &mut Net, links: &Links, creases: &Creases, lengths: &[f64], sharp: f64) {
    let nodes = KdTree::new(&net.points);
    for &(corner, place) in &creases.corners {
        let point = surface.points[corner as usize];
        let Some((v, distance)) = nodes.nearest(point) else { continue };
        if distance < REACH_CORNER * lengths[v as usize] && !net.is_held(v) && !net.on_rail(v) {
            net.held[v as usize] = try_move(net, links, v, Spot { point, place, rail: NONE }, sharp);
        }
    }
}

/// The nearest node of the border to each of its corners slides there, if it may; how many did.
fn take_border_corners(
    surface: &Surface,
    net: &mut Net,
    links: &Links,
    corners: &[BorderCorner],
    lengths: &[f64],
    sharp: f64,
    progress: &Progress<'_>,
) -> Result<usize> {
    let mut sliding: Vec<(u32, u32)> =
        net.rails.iter().zip(0..).filter(|slide| *slide.0 != NONE).map(|(&rail, v)| (rail, v)).collect();
    sliding.sort_unstable();
    let mut taken = 0;
    let mut pace = Pace::new(progress);
    for corner in corners {
        pace.after(8 * corner.rails.len())?;
        let point = surface.points[corner.vertex as usize];
        let on = |&rail: &u32| {
            let start = sliding.partition_point(|s| s.0 < rail);
            sliding[start..].iter().take_while(move |s| s.0 == rail).map(|s| s.1)
        };
        let nearest = corner
            .rails
            .iter()
            .flat_map(on)
            .map(|v| (net.points[v as usize].distance(point), v))
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        if let Some((distance, v)) = nearest
            && distance < lengths[v as usize]
            && !net.is_held(v)
        {
            let rail = surface.first[corner.vertex as usize];
            net.held[v as usize] = try_move(net, links, v, Spot { point, place: rail / 3, rail }, sharp);
            taken += usize::from(net.held[v as usize]);
        }
    }
    Ok(taken)
}

/// Moves a node unless that spoils a triangle; whether it did.
fn try_move(net: &mut Net, links: &Links, v: u32, spot: Spot, sharp: f64) -> bool {
    let (mut before, mut after, mut turned) = (f64::INFINITY, f64::INFINITY, false);
    links.triangles_around(v, |t| {
        let triangle = net.triangles[t as usize];
        let corners = triangle.map(|w| net.points[w as usize]);
        let moved = triangle.map(|w| if w == v { spot.point } else { net.points[w as usize] });
        let (old, new) = (area_vector(corners), area_vector(moved));
        turned |= !(new.dot(old) > TURN * new.length() * old.length());
        before = before.min(smallest_angle(corners));
        after = after.min(smallest_angle(moved));
    });
    let fits = !turned && after >= before.min(sharp);
    if fits {
        net.put(v as usize, spot);
    }
    fits
}

/// Flips edges that cross a crease to run along it, between two nodes on it.
fn align(net: &mut Net, links: &mut Links, tree: &Bvh<'_>, sharp: f64, progress: &Progress<'_>) -> Result<()> {
    // How far the middle of an edge lies from the creases, in its lengths.
    let off =
        |p: DVec3, q: DVec3| tree.closest_point((p + q) * 0.5).map_or(f64::INFINITY, |c| c.distance()) / p.distance(q);
    for h in 0..links.twins.len() as u32 {
        looking(h, progress)?;
        let g = links.twins[h as usize];
        if g == NONE || g < h {
            continue;
        }
        let [a, b, c, d] = quad(net, h, g);
        if !net.is_held(c) || !net.is_held(d) || net.is_held(a) && net.is_held(b) {
            continue;
        }
        let [p, q, r, s] = [a, b, c, d].map(|v| net.points[v as usize]);
        if !(off(r, s) < 0.05 && off(p, q) < 0.25) {
            continue;
        }
        let before = smallest_angle([p, q, r]).min(smallest_angle([q, p, s]));
        let after = smallest_angle([r, p, s]).min(smallest_angle([s, q, r]));
        let (n, m) = (area_vector([r, p, s]), area_vector([s, q, r]));
        let old = area_vector([p, q, r]) + area_vector([q, p, s]);
        let alike = [n, m].iter().all(|n| n.dot(old) > 0.2 * n.length() * old.length());
        let mut joined = false;
        links.around(&net.triangles, c, |v| joined |= v == d);
        let spare = [a, b].iter().all(|&v| links.valences[v as usize] > if net.on_rail(v) { 2 } else { 3 });
        if alike && !joined && spare && after >= before.min(sharp) {
            turn(net, links, h, g);
        }
    }
    Ok(())
}
