//! Stage 6, with a least angle: the net is drawn as near to the surface as its number of nodes lets it. Ours.
//!
//! The patches make about twice the nodes that are wanted, and quadrics take half of them away. In between and afterwards each node moves,
//! in any direction. It goes to where the points of the surface beside its triangles are nearest to these in the mean square. Edges are
//! flipped where that brings them nearer. So triangles grow long along what bends one way only, and small where the surface bends most, as
//! far as no angle falls below the least.

use std::collections::BTreeSet;

use glam::{DMat3, DVec3};

use super::collapse::collapse;
use super::fit::{Sample, beside, samples};
use super::flip::{Goal, Links, faces_alike, flips, joined, least_edges, quad, turn};
use super::mend::sweep;
use super::net::{Net, Size, area_vector, smallest_angle};
use super::quadrics::{MOST_AROUND, reduce};
use super::surface::{NONE, Surface};
use base::error::Result;
use base::progress::{Pace, Progress};
use geom::bvh::{Closest, Feature};

/// Nodes that the patches make for each that is wanted.
pub const SPARE: usize = 2;
/// By how much a pass of collapses divides the nodes: between passes they are moved.
const PASS: f64 = 1.45;
/// A pass is stuck that takes fewer than one in so many. Then the least angle is lowered by a factor, to be mended later, ...
const STUCK: usize = 50;
const LOOSER: f64 = 0.7;
/// ... down to this share of it.
const LOOSEST: f64 = 0.3;
/// Rounds of moves and flips at the end. Points are given to their nearest triangles anew in each.
const ROUNDS: usize = 2;
/// Sweeps of moves and flips in a round.
const SWEEPS: usize = 2;
/// Points of the surface for each node that is wanted, at least, where it has so many.
const POINTS: usize = 40;
/// Share of the squared distances around that a move or a flip must gain.
const GAIN: f64 = 1e-4;
/// Share of a node's stiffness that holds it where its triangles lie in a plane.
const RIDGE: f64 = 0.01;
/// Farthest move of a node, as a share of its shortest edge, and times it is halved before it is given up.
const FARTHEST: f64 = 0.3;
const HALVINGS: usize = 2;
/// Cosine of the most that a triangle may turn by a move of one corner: 60 degrees.
const TURN: f64 = 0.5;
/// Cosine of the largest angle between the normals of triangles that share an edge, 120 degrees: no move makes one above it.
const FOLD: f64 = -0.5;
/// Cosine of the angle from which an edge is a fold, which nodes beside a rim are drawn to: 60 degrees.
const RIM: f64 = 0.5;
/// Least angle, in radians, that drawing them leaves, unless there was a smaller one: 30 degrees.
const RIM_ANGLE: f64 = std::f64::consts::FRAC_PI_6;
/// Rounds that mend angles below the least which are left.
const MENDINGS: usize = 3;

/// Draws the net near the surface to the size that is wanted, unless it is smaller or the topology needs more. It takes at least `rounds` rounds.
/// No angle gets below `least`, in radians, as far as the net lets it.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn polish(
    surface: &Surface,
    net: &mut Net,
    wanted: Option<Size>,
    rounds: usize,
    least: f64,
    progress: &Progress<'_>,
) -> Result<()> {
    let mut samples = samples(surface, progress)?;
    let nodes = wanted.map_or(net.points.len(), |w| w.count() / w.choose(1, 2));
    let stride = samples.len() / (POINTS * nodes).max(1);
    if stride > 1 {
        samples = samples.into_iter().step_by(stride).collect();
    }
    if let Some(wanted) = wanted {
        let mut allowed = least;
        let most = wanted.count();
        while wanted.had(net) > most {
            let before = wanted.had(net);
            let next = (before as f64 / PASS) as usize;
            // No more than a few are left for a last pass.
            let next = if (next as f64) < 1.05 * most as f64 { most } else { next };
            reduce(surface, net, &samples, wanted.of(next), allowed, progress)?;
            round(net, &samples, least, progress)?;
            if wanted.had(net) > next && STUCK * (before - wanted.had(net)) < before {
                // The least angle stands in the way.
                allowed *= LOOSER;
                if allowed < LOOSEST * least {
                    collapse(surface, net, wanted, progress)?;
                    break;
                }
            }
        }
    }
    for _ in 0..rounds.max(ROUNDS) {
        round(net, &samples, least, progress)?;
    }
    for _ in 0..MENDINGS {
        if !(smallest(net) < least) {
            break;
        }
        sweep(surface, net, least, progress)?;
        flips(net, Goal::Angle, progress)?;
        round(net, &samples, least, progress)?;
    }
    // Attributes are those of the surface beside a node.
    for v in 0..net.points.len() {
        net.places[v] = surface.walk(net.points[v], net.places[v]).triangle;
    }
    Ok(())
}

fn smallest(net: &Net) -> f64 {
    let angle = |t: &[u32; 3]| smallest_angle(t.map(|v| net.points[v as usize]));
    net.triangles.iter().map(angle).fold(f64::INFINITY, f64::min)
}

/// Moves every node and flips edges, in a few sweeps.
fn round(net: &mut Net, samples: &[Sample], least: f64, progress: &Progress<'_>) -> Result<()> {
    let mut sheet = Sheet::new(net, samples, least, progress)?;
    let mut pace = Pace::new(progress);
    for _ in 0..SWEEPS {
        for v in 0..sheet.net.points.len() as u32 {
            let looked = sheet.shift(v);
            pace.after(8 * looked)?;
        }
        for h in 0..sheet.links.twins.len() as u32 {
            let looked = sheet.flip(h);
            pace.after(1 + 2 * looked)?;
        }
    }
    progress.advance(1)
}

/// Least cosine of the angles between the normals of triangles around a node, in turn.
fn folds(star: &[[DVec3; 3]]) -> f64 {
    let normals: Vec<DVec3> = star.iter().map(|&t| area_vector(t).normalize_or_zero()).collect();
    (0..normals.len()).map(|k| normals[k].dot(normals[(k + 1) % normals.len()])).fold(1.0, f64::min)
}

/// Draws nodes beside folds along the surface to where they lie nearest to it, and flips edges by the same measure: a rim that bends within an
/// edge's length is no saw then. Nodes elsewhere stay, and so do those on creases.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn rims(surface: &Surface, net: &mut Net, progress: &Progress<'_>) -> Result<()> {
    let links = Links::of(&net.triangles, net.points.len(), progress)?;
    let normals: Vec<DVec3> = (0..net.triangles.len()).map(|t| net.area_vector(t).normalize_or_zero()).collect();
    let mut at_rim = vec![false; net.points.len()];
    for (h, &twin) in links.twins.iter().enumerate() {
        let t = net.triangles[h / 3];
        if twin != NONE
            && normals[h / 3].dot(normals[twin as usize / 3]) < RIM
            && !net.is_ridge(t[h % 3], t[(h + 1) % 3])
        {
            t.iter().for_each(|&v| at_rim[v as usize] = true);
        }
    }
    if !at_rim.contains(&true) {
        return Ok(());
    }
    let mut samples = samples(surface, progress)?;
    let stride = (samples.len() / (POINTS * net.points.len())).max(1);
    samples = samples.into_iter().step_by(stride).collect();
    near(net, &at_rim, &mut samples, progress)?;
    for _ in 0..ROUNDS {
        let mut sheet = Sheet::new(net, &samples, RIM_ANGLE, progress)?;
        sheet.surface = Some(surface);
        let mut pace = Pace::new(progress);
        for _ in 0..SWEEPS {
            for v in (0..).zip(&at_rim).filter(|n| *n.1).map(|n| n.0) {
                if !sheet.net.is_fixed(v) && !sheet.net.on_crease(v) {
                    let looked = sheet.shift(v);
                    pace.after(8 * looked)?;
                }
            }
            for h in 0..sheet.links.twins.len() as u32 {
                if sheet.net.triangles[h as usize / 3].iter().any(|&v| at_rim[v as usize]) {
                    let looked = sheet.flip(h);
                    pace.after(1 + 2 * looked)?;
                }
            }
        }
    }
    Ok(())
}

/// Leaves the points that may lie beside the triangles of `nodes`: within twice the longest edge there.
fn near(net: &Net, nodes: &[bool], samples: &mut Vec<Sample>, progress: &Progress<'_>) -> Result<()> {
    let mut longest = 0.0_f64;
    for t in net.triangles.iter().filter(|t| t.iter().any(|&v| nodes[v as usize])) {
        let [a, b, c] = t.map(|v| net.points[v as usize]);
        longest = longest.max(a.distance(b)).max(b.distance(c)).max(c.distance(a));
    }
    // Of a net in one place all points stay.
    if !(longest > f64::EPSILON) {
        return Ok(());
    }
    let cell = |p: DVec3| (p / (2.0 * longest)).floor().as_i64vec3().to_array();
    let mut cells = BTreeSet::new();
    let mut pace = Pace::new(progress);
    for (p, _) in net.points.iter().zip(nodes).filter(|n| *n.1) {
        pace.after(27)?;
        let [x, y, z] = cell(*p);
        cells.extend((0..27).map(|i| [x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1]));
    }
    samples.retain(|s| cells.contains(&cell(s.point)));
    progress.check()
}

/// A net and the points of the surface that are nearest to each of its triangles.
struct Sheet<'a> {
    net: &'a mut Net,
    links: Links,
    samples: &'a [Sample],
    /// Points of each triangle, with their squared distances.
    beside: Vec<Vec<(u32, f64)>>,
    least: f64,
    star: Vec<u32>,
    /// The surface that nodes stay on, if they do.
    surface: Option<&'a Surface>,
}

impl<'a> Sheet<'a> {
    fn new(net: &'a mut Net, samples: &'a [Sample], least: f64, progress: &Progress<'_>) -> Result<Self> {
        let links = Links::of(&net.triangles, net.points.len(), progress)?;
        let mut lists = vec![Vec::new(); net.triangles.len()];
        for (closest, i) in beside(net, samples, progress)?.into_iter().zip(0..) {
            if let Some(closest) = closest {
                lists[closest.triangle as usize].push((i, closest.distance_squared));
            }
        }
        Ok(Sheet { net, links, samples, beside: lists, least, star: Vec::new(), surface: None })
    }

    /// Moves a node to where the points around it are nearest in the mean square, if that spoils no triangle. Nodes at the border stay.
    /// Returns how many points were looked at.
    fn shift(&mut self, v: u32) -> usize {
        if self.net.on_rail(v) {
            return 1;
        }
        let mut star = std::mem::take(&mut self.star);
        star.clear();
        self.links.triangles_around(v, |t| star.push(t));
        let looked = if star.len() > MOST_AROUND { star.len() } else { self.shift_within(v, &star) };
        self.star = star;
        looked
    }

    fn shift_within(&mut self, v: u32, star: &[u32]) -> usize {
        let net = &*self.net;
        let here = net.points[v as usize];
        let with = |at: DVec3| -> Vec<[DVec3; 3]> {
            let corners =
                |&t: &u32| net.triangles[t as usize].map(|w| if w == v { at } else { net.points[w as usize] });
            star.iter().map(corners).collect()
        };
        let before = with(here);
        let (mut angle, mut shortest) = (self.least, f64::INFINITY);
        // Gauss-Newton: by how much a move changes the distance of each point.
        let (mut stiffness, mut pull, mut start) = (DMat3::ZERO, DVec3::ZERO, 0.0);
        let mut points = Vec::new();
        for (k, (&t, corners)) in star.iter().zip(&before).enumerate() {
            angle = angle.min(smallest_angle(*corners));
            let corner = net.triangles[t as usize].iter().position(|&w| w == v).expect("a triangle of the star");
            shortest = shortest.min(corners[(corner + 1) % 3].distance(here));
            let normal = area_vector(*corners).normalize_or_zero();
            for &(s, _) in &self.beside[t as usize] {
                let sample = &self.samples[s as usize];
                let closest = Closest::on_triangle(sample.point, corners, 0);
                let offset = sample.point - closest.point;
                let inside = closest.feature == Feature::Inside || closest.distance_squared == 0.0;
                let towards = if inside { normal } else { offset.normalize_or_zero() };
                let (share, weight) = (closest.barycentric[corner], sample.weight);
                start += weight * closest.distance_squared;
                let slope = towards * (weight * share * share);
                stiffness += DMat3::from_cols(slope * towards.x, slope * towards.y, slope * towards.z);
                pull += towards * (weight * share * towards.dot(offset));
                points.push((s, k));
            }
        }
        let fold = folds(&before);
        let ridge = RIDGE * (stiffness.x_axis.x + stiffness.y_axis.y + stiffness.z_axis.z);
        let mut step = (stiffness + DMat3::from_diagonal(DVec3::splat(ridge))).inverse() * pull;
        if !(ridge > 0.0) || !step.is_finite() {
            return points.len();
        }
        step = step.clamp_length_max(FARTHEST * shortest);
        for _ in 0..=HALVINGS {
            let place = self.surface.map(|s| s.walk(here + step, self.net.places[v as usize]));
            let there = place.map_or(here + step, |p| p.point);
            let after = with(there);
            let fits = folds(&after) >= FOLD.min(fold)
                && after.iter().zip(&before).all(|(&new, &old)| {
                    let (turned, vector) = (area_vector(new), area_vector(old));
                    (turned.dot(vector) > TURN * turned.length() * vector.length() || vector == DVec3::ZERO)
                        && smallest_angle(new) >= angle
                });
            if fits && let Some(found) = self.nearest(&points, &after, start * (1.0 - GAIN)) {
                self.net.points[v as usize] = there;
                if let Some(place) = place {
                    self.net.places[v as usize] = place.triangle;
                }
                self.give(star, points.iter().map(|p| p.0).zip(found));
                break;
            }
            step *= 0.5;
        }
        points.len()
    }

    /// The nearest of the triangles for each point and its squared distance, if these sum up to less than `most`. Points come
    /// with the triangle that is looked at first, and alone if the point lies above its inside.
    fn nearest(&self, points: &[(u32, usize)], triangles: &[[DVec3; 3]], most: f64) -> Option<Vec<(usize, f64)>> {
        let mut sum = 0.0;
        let mut found = Vec::with_capacity(points.len());
        for &(s, first) in points {
            let sample = &self.samples[s as usize];
            let closest = Closest::on_triangle(sample.point, &triangles[first], 0);
            let mut best = (first, closest.distance_squared);
            if closest.feature != Feature::Inside {
                for (k, corners) in triangles.iter().enumerate().filter(|t| t.0 != first) {
                    let squared = Closest::on_triangle(sample.point, corners, 0).distance_squared;
                    if squared < best.1 {
                        best = (k, squared);
                    }
                }
            }
            sum += sample.weight * best.1;
            if !(sum < most) {
                return None;
            }
            found.push(best);
        }
        Some(found)
    }

    /// Gives points to triangles of `star`.
    fn give(&mut self, star: &[u32], points: impl Iterator<Item = (u32, (usize, f64))>) {
        star.iter().for_each(|&t| self.beside[t as usize].clear());
        for (s, (k, squared)) in points {
            self.beside[star[k] as usize].push((s, squared));
        }
    }

    /// Flips an edge if that brings the points beside it nearer and spoils no angle. Returns how many points were looked at.
    fn flip(&mut self, h: u32) -> usize {
        let g = self.links.twins[h as usize];
        if g == NONE || g < h {
            return 0;
        }
        let (net, links) = (&*self.net, &self.links);
        let [a, b, c, d] = quad(net, h, g);
        if net.is_ridge(a, b) {
            return 0;
        }
        let [p, q, r, s] = [a, b, c, d].map(|v| net.points[v as usize]);
        let before = smallest_angle([p, q, r]).min(smallest_angle([q, p, s]));
        let new = [[r, p, s], [s, q, r]];
        if !(new.into_iter().all(|t| smallest_angle(t) >= before.min(self.least)) && faces_alike(p, q, r, s)) {
            return 0;
        }
        if !least_edges(links, net, a) || !least_edges(links, net, b) || joined(net, links, c, d) {
            return 0;
        }
        let sides = [h / 3, g / 3];
        let mut start = 0.0;
        let mut points = Vec::new();
        for &(s, squared) in sides.iter().flat_map(|&t| &self.beside[t as usize]) {
            start += self.samples[s as usize].weight * squared;
            points.push((s, 0));
        }
        if let Some(found) = self.nearest(&points, &new, start * (1.0 - GAIN)) {
            turn(self.net, &mut self.links, h, g);
            self.give(&sides, points.iter().map(|p| p.0).zip(found));
        }
        points.len()
    }
}
