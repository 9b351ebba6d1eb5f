//! Fills of holes that lie where a scan saw that nothing is.

use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use crate::visibility::eyes::Eyes;
use base::error::Result;
use base::progress::{Pace, Progress};
use glam::DVec3;
use image::visibility::LinesOfSight;
use mesh::holes::Bounds;

/// The rule by which a fill is seen through. Lengths are in world units.
#[derive(Clone, Copy)]
pub struct SeeingRule {
    /// Distance of the places that are looked at.
    pub step: f64,
    /// A scan saw through a place if all of 3 x 3 pixels lie farther than this behind it.
    pub slack: f64,
}

impl SeeingRule {
    /// Of a merge with cells and a merge distance of these sizes.
    pub fn of(voxel: f64, merge_distance: f64) -> Self {
        SeeingRule { step: 0.5 * voxel, slack: merge_distance + 0.5 * voxel }
    }
}

/// Of each fill whether a scan saw through it. `triangles` are the corners of its triangles.
///
/// # Errors
/// A scan can't be loaded any more. Cancelled.
pub fn seen_through<'f, F: Sync, I: Iterator<Item = [DVec3; 3]>>(
    fills: &'f [F],
    triangles: impl Fn(&'f F) -> I + Sync,
    eyes: &Eyes<'_>,
    rule: SeeingRule,
    progress: &Progress<'_>,
) -> Result<Vec<bool>> {
    if fills.is_empty() {
        return Ok(Vec::new());
    }
    let bounds: Vec<Bounds> = fills.iter().map(|fill| Bounds::of(triangles(fill).flatten())).collect();
    let seen: Vec<AtomicBool> = fills.iter().map(|_| AtomicBool::new(false)).collect();
    eyes.each(progress, |sight| {
        let mut pace = Pace::new(progress);
        for ((fill, bounds), seen) in fills.iter().zip(&bounds).zip(&seen) {
            pace.after(16)?;
            let (centre, radius) = (0.5 * (bounds.min + bounds.max), 0.5 * bounds.min.distance(bounds.max));
            if !seen.load(Relaxed) && sight.may_see(centre, radius) {
                let is_seen = is_past(sight, triangles(fill), rule, &mut pace)?;
                seen.fetch_or(is_seen, Relaxed);
            }
        }
        Ok(())
    })?;
    Ok(seen.into_iter().map(AtomicBool::into_inner).collect())
}

/// Whether a scan saw past any place of some triangles.
fn is_past(
    sight: &LinesOfSight,
    triangles: impl Iterator<Item = [DVec3; 3]>,
    rule: SeeingRule,
    pace: &mut Pace<'_>,
) -> Result<bool> {
    for corners in triangles {
        for place in places(corners, rule.step) {
            pace.after(16)?;
            if sight.is_past(place, rule.slack) {
                return Ok(true);
            }
        }
    }
    Ok(false)
}

/// Places inside a triangle, at most `step` apart: the middles of equal parts of it.
fn places([a, b, c]: [DVec3; 3], step: f64) -> impl Iterator<Item = DVec3> {
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let parts = (longest / step).ceil().max(1.0) as u32;
    let sides = [(b - a) / f64::from(parts), (c - a) / f64::from(parts)];
    (0..parts).flat_map(move |i| {
        (0..2 * (parts - i) - 1).map(move |k| {
            let (j, is_turned) = (f64::from(k / 2), k % 2 == 1);
            let inside = if is_turned { 2.0 / 3.0 } else { 1.0 / 3.0 };
            a + (f64::from(i) + inside) * sides[0] + (j + inside) * sides[1]
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_cover_a_triangle() {
        let corners = [DVec3::ZERO, 4.0 * DVec3::X, 3.0 * DVec3::Y];
        let found: Vec<DVec3> = places(corners, 1.0).collect();
        assert_eq!(found.len(), 25);
        let mean = found.iter().sum::<DVec3>() / 25.0;
        assert!(mean.distance(DVec3::new(4.0, 3.0, 0.0) / 3.0) < 1e-12);
        for place in &found {
            assert!(place.x > 0.0 && place.y > 0.0 && place.x / 4.0 + place.y / 3.0 < 1.0);
            let nearest = found.iter().filter(|other| *other != place).map(|other| other.distance(*place));
            assert!(nearest.fold(f64::INFINITY, f64::min) <= 1.0);
        }
        assert_eq!(places(corners, 100.0).collect::<Vec<_>>(), [DVec3::new(4.0, 3.0, 0.0) / 3.0]);
    }
}
