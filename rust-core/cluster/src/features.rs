//! Stage 6, last: nodes beside a corner of the border go there. Ours.
//!
//! Nothing turns a triangle over or makes an angle below 30 degrees.

use super::flip::{Goal, Links, flips};
use super::mend::sweep;
use super::net::{Net, Spot, area_vector, smallest_angle};
use super::relax::relax;
use super::surface::{NONE, Surface};
use base::error::Result;
use base::progress::{Pace, Progress};

/// Cosine of the turn from which a border has a corner: 45 degrees.
const CORNER: f64 = 0.7;
/// Cosine of the most that a triangle may turn by a move onto a corner: 78 degrees.
const TURN: f64 = 0.2;
/// Smallest angle that a move may make, in radians, unless there was a smaller one.
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

/// A vertex where the border turns, and the half-edges of the border around it.
struct BorderCorner {
    vertex: u32,
    rails: Vec<u32>,
}

/// Draws the net onto the corners of the border.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn keep(surface: &Surface, net: &mut Net, progress: &Progress<'_>) -> Result<()> {
    let links = Links::of(&net.triangles, net.points.len(), progress)?;
    let lengths = mean_lengths(net, &links);
    let mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
    let corners = border_corners(surface, mean, progress)?;
    if corners.is_empty() {
        return Ok(());
    }
    let mut direct = net.clone();
    if draw(surface, &mut direct, &links, &corners, &lengths, SHARP, progress)? == corners.len() {
        *net = direct;
        return Ok(());
    }
    // With room to make way most nodes beside a corner reach it; where that costs an angle, they get none.
    let mut loose = net.clone();
    draw(surface, &mut loose, &links, &corners, &lengths, LOOSE, progress)?;
    for _ in 0..ROUNDS {
        relax(surface, &mut loose, STEPS, progress)?;
        flips(&mut loose, Goal::Angle, progress)?;
        for _ in 0..SWEEPS {
            if sweep(surface, &mut loose, MENDED, progress)? == 0 {
                break;
            }
            flips(&mut loose, Goal::Angle, progress)?;
        }
    }
    let smallest = |net: &Net| {
        let angle = |t: &[u32; 3]| smallest_angle(t.map(|v| net.points[v as usize]));
        net.triangles.iter().map(angle).fold(f64::INFINITY, f64::min)
    };
    if smallest(&loose) >= smallest(net).min(SHARP) {
        *net = loose;
    } else {
        draw(surface, net, &links, &corners, &lengths, SHARP, progress)?;
    }
    Ok(())
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

/// The nearest node of the border to each of its corners slides there, if it may. Returns how many did.
fn draw(
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
    net.held = vec![false; net.points.len()];
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
            && !net.is_fixed(v)
        {
            let rail = surface.first[corner.vertex as usize];
            net.held[v as usize] = try_move(net, links, v, Spot { point, place: rail / 3, rail, way: NONE }, sharp);
            taken += usize::from(net.held[v as usize]);
        }
    }
    Ok(taken)
}

/// Moves a node unless that spoils a triangle. Returns whether it did.
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
