//! Polygons of meshes as triangles.
//!
//! | file | what |
//! |---|---|
//! | `mod` | polygons that need other triangles than a fan, and where they are seen from |
//! | `ears` | polygons that touch or cross themselves |
//!
//! A reader makes a fan of each polygon around its first corner. Once the corners' places are known, a fan that turns a triangle over is
//! replaced: a polygon has as many triangles however it is cut. All other fans stay, those of convex polygons among them.
//!
//! A polygon is cut as it is seen along the axis in which its area is largest. There signs are exact. Simple polygons get their constrained
//! Delaunay triangulation, others lose their ears. Both run forward through the polygon's edges.

mod ears;

use glam::{DVec2, DVec3};

use base::error::Result;
use base::progress::Progress;
use geom::{delaunay2, span};

/// A triangle of a fan that is turned over, but lower than this part of the polygon's extent, is flat: corners on a straight edge
/// come out of files with few digits.
const FLAT: f64 = 1e-6;
/// Smaller parts of a polygon's extent are 0: products of four of them can be had in doubles.
const NOTHING: f64 = 1e-40;

/// The polygons of more than three corners among the triangles of a mesh.
#[derive(Debug, Default)]
pub(super) struct Polygons(Vec<Run>);

/// Polygons of as many corners, whose fans follow each other.
#[derive(Debug)]
struct Run {
    /// Number of the first triangle.
    first: usize,
    corners: usize,
    count: usize,
}

impl Polygons {
    /// Notes that the triangles from the `first` on are the fan of a polygon with so many corners.
    pub(super) fn add(&mut self, first: usize, corners: usize) {
        if corners < 4 {
            return;
        }
        match self.0.last_mut() {
            Some(run) if run.corners == corners && run.first + run.count * (corners - 2) == first => run.count += 1,
            _ => self.0.push(Run { first, corners, count: 1 }),
        }
    }

    /// Replaces the fans that turn triangles over.
    ///
    /// Cost: two cross products per triangle of a fan. O(n log n) for a polygon of n corners that is cut anew, bounded for those that touch
    /// or cross themselves.
    ///
    /// # Errors
    /// [`base::error::Error::Cancelled`].
    pub(super) fn cut(&self, positions: &[DVec3], triangles: &mut [[u32; 3]], progress: &Progress<'_>) -> Result<()> {
        for run in &self.0 {
            let size = run.corners - 2;
            for block in progress.ranges(run.count) {
                for k in block? {
                    let fan = &mut triangles[run.first + k * size..][..size];
                    if !turns_none(positions, fan) {
                        cut_anew(positions, fan, progress)?;
                    }
                }
            }
        }
        Ok(())
    }
}

/// Whether all triangles of a fan surely turn the same way.
fn turns_none(positions: &[DVec3], fan: &[[u32; 3]]) -> bool {
    let area = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|v| positions[v as usize]);
        (b - a).cross(c - a)
    };
    let whole: DVec3 = fan.iter().map(area).sum();
    fan.iter().all(|corners| area(corners).dot(whole) > 0.0)
}

fn cut_anew(positions: &[DVec3], fan: &mut [[u32; 3]], progress: &Progress<'_>) -> Result<()> {
    let [apex, second, _] = fan[0];
    let ring: Vec<u32> = [apex, second].into_iter().chain(fan.iter().map(|corners| corners[2])).collect();
    let Some(seen) = seen(&ring, positions) else { return Ok(()) };
    let (kept, flat) = without_spikes(&seen);
    let seen: Vec<DVec2> = kept.iter().map(|&corner| seen[corner as usize]).collect();
    let triangles = match simple(&seen, progress)? {
        Some(triangles) => triangles,
        None => ears::cut_off(&seen, progress)?,
    };
    let triangles = triangles.into_iter().map(|corners| corners.map(|corner| kept[corner as usize])).chain(flat);
    for (to, corners) in fan.iter_mut().zip(triangles) {
        *to = corners.map(|corner| ring[corner as usize]);
    }
    Ok(())
}

/// The corners of a polygon without those that repeat the one before, and without tips of spikes, from which the polygon goes straight back
/// to the corner before. Also a flat triangle for each that is left out. All corners, if fewer than three are left.
fn without_spikes(seen: &[DVec2]) -> (Vec<u32>, Vec<[u32; 3]>) {
    let at = |corner: u32| seen[corner as usize];
    let all = || (0..seen.len() as u32).collect::<Vec<u32>>();
    let (mut kept, mut flat) = (Vec::<u32>::with_capacity(seen.len()), Vec::new());
    for corner in all() {
        loop {
            match kept[..] {
                [.., before, last] if at(last) == at(corner) => {
                    flat.push([before, last, corner]);
                    break;
                }
                [.., before, last] if at(before) == at(corner) => {
                    flat.push([before, last, corner]);
                    kept.pop();
                }
                _ => {
                    kept.push(corner);
                    break;
                }
            }
        }
    }
    // The place where the end meets the beginning.
    while let [first, second, .., before, last] = kept[..] {
        if at(last) == at(first) || at(before) == at(first) {
            flat.push([before, last, first]);
            kept.pop();
        } else if at(last) == at(second) {
            flat.push([last, first, second]);
            kept.remove(0);
        } else {
            break;
        }
    }
    if kept.len() < 3 { (all(), Vec::new()) } else { (kept, flat) }
}

/// The triangles of a polygon that neither touches nor crosses itself.
fn simple(seen: &[DVec2], progress: &Progress<'_>) -> Result<Option<Vec<[u32; 3]>>> {
    let flat: Vec<DVec3> = seen.iter().map(|corner| corner.extend(0.0)).collect();
    let [a, b, c] = span::of(&flat, progress)?[..] else { return Ok(None) };
    delaunay2::polygon(&flat, [a, b, c], progress)
}

/// A polygon seen along an axis, counter-clockwise, about 1 large. `None` if its fan is right but for flat triangles, or if it has no area.
fn seen(ring: &[u32], positions: &[DVec3]) -> Option<Vec<DVec2>> {
    let corners = || ring.iter().map(|&v| positions[v as usize]);
    // Differences of the largest numbers are too large.
    let factor = to_one(corners().map(|p| p.abs().max_element()).fold(0.0, f64::max));
    let from_first = corners().map(|p| p * factor - positions[ring[0] as usize] * factor);
    let factor = to_one(from_first.clone().map(|p| p.abs().max_element()).fold(0.0, f64::max));
    let shown = |x: f64| if x.abs() < NOTHING { 0.0 } else { x };
    let local: Vec<DVec3> = from_first.map(|p| (p * factor).map(shown)).collect();
    let area: DVec3 = local.windows(2).map(|pair| pair[0].cross(pair[1])).sum();
    let normal = area.try_normalize()?;
    let is_turned = |pair: &[DVec3]| {
        let [b, c] = [pair[0], pair[1]];
        let longest = b.length().max(c.length()).max(b.distance(c));
        b.cross(c).dot(normal) < -FLAT * longest
    };
    if !local.windows(2).any(is_turned) {
        return None;
    }
    let size = normal.abs();
    let axis = if size.x >= size.y.max(size.z) { 0 } else { 1 + usize::from(size.z > size.y) };
    let [right, up] = [(axis + 1) % 3, (axis + 2) % 3];
    let [right, up] = if normal[axis] > 0.0 { [right, up] } else { [up, right] };
    Some(local.iter().map(|p| DVec2::new(p[right], p[up])).collect())
}

/// The power of two that brings a number to about 1.
fn to_one(x: f64) -> f64 {
    if x > 0.0 { (-x.log2().floor().clamp(-1000.0, 1000.0)).exp2() } else { 1.0 }
}

#[cfg(test)]
mod tests;
