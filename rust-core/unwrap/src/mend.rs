//! Coordinates without flips and overlaps, exactly: rounding to single precision turns thin triangles.

use glam::DVec2;

use base::error::Result;
use base::progress::Progress;
use geom::predicates::orient2d;

use super::charts::{Charts, NONE, on_grid};
use super::check::check;
use super::join::area_vector;
use super::surface::Surface;

/// Steps of a vertex away from the edge it fell across, in units of the last place. Each is twice the one before.
const STEPS: i32 = 8;
/// Rounds of moving. Triangles that are still turned then lose their area.
const ROUNDS: usize = 8;

/// Moves vertices by a few units in the last place until no triangle is turned. Triangles that stay so, or that overlap
/// others, lose their area. How many vertices were moved.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn mend(charts: &mut Charts, surface: &Surface, progress: &Progress<'_>) -> Result<usize> {
    let moved = straighten(charts, progress)?;
    for t in 0..charts.of.len() {
        if charts.of[t] != NONE && !is_sound(charts.triangle(t)) {
            charts.collapse(t);
        }
    }
    loop {
        let with_area: Vec<u32> = (0..charts.of.len() as u32).filter(|&t| charts.of[t as usize] != NONE).collect();
        let corners: Vec<[u32; 3]> = with_area.iter().map(|&t| charts.corners[t as usize]).collect();
        let found = check(&charts.uv, &corners, progress)?;
        if found.overlapping.is_empty() {
            return Ok(moved);
        }
        for pair in found.overlapping {
            let [s, t] = pair.map(|i| with_area[i as usize] as usize);
            if charts.of[s] != NONE && charts.of[t] != NONE {
                let area = |t: usize| area_vector(surface.corners(t)).length();
                charts.collapse(if area(s) < area(t) { s } else { t });
            }
        }
    }
}

fn is_sound([a, b, c]: [DVec2; 3]) -> bool {
    orient2d(a, b, c) > 0
}

/// Moves vertices of turned triangles while that helps. Returns how many.
fn straighten(charts: &mut Charts, progress: &Progress<'_>) -> Result<usize> {
    let mut moved = 0;
    for _ in 0..ROUNDS {
        progress.check()?;
        let is_turned = |&t: &usize| charts.of[t] != NONE && !is_sound(charts.triangle(t));
        let turned: Vec<usize> = (0..charts.of.len()).filter(is_turned).collect();
        if turned.is_empty() {
            break;
        }
        let around = triangles_around(charts, &turned);
        let before = moved;
        for t in turned {
            moved += usize::from(raise(charts, t, &around));
        }
        if moved == before {
            break;
        }
    }
    Ok(moved)
}

/// Triangles with area at the places of some triangles.
fn triangles_around(charts: &Charts, of: &[usize]) -> rustc_hash::FxHashMap<u32, Vec<usize>> {
    let mut around: rustc_hash::FxHashMap<u32, Vec<usize>> = Default::default();
    for place in of.iter().flat_map(|&t| charts.corners[t]) {
        around.entry(place).or_default();
    }
    for (t, corners) in charts.corners.iter().enumerate() {
        for place in corners {
            if let Some(there) = around.get_mut(place).filter(|_| charts.of[t] != NONE) {
                there.push(t);
            }
        }
    }
    around
}

/// Moves a corner of a triangle away from the opposite edge until the triangle is sound, if no other is turned by that.
fn raise(charts: &mut Charts, t: usize, around: &rustc_hash::FxHashMap<u32, Vec<usize>>) -> bool {
    if is_sound(charts.triangle(t)) {
        return false;
    }
    let corners = charts.corners[t];
    let uv = charts.triangle(t);
    let side = |k: usize| uv[(k + 1) % 3].distance_squared(uv[(k + 2) % 3]);
    let mut order = [0, 1, 2];
    // Opposite the longest edge it is nearest to being sound.
    order.sort_by(|&a, &b| side(b).total_cmp(&side(a)));
    for k in order {
        let edge = uv[(k + 2) % 3] - uv[(k + 1) % 3];
        let up = edge.perp().try_normalize().unwrap_or(DVec2::Y);
        let place = corners[k] as usize;
        for step in 0..STEPS {
            let by = f64::from(f32::EPSILON) * uv[k].max_element().max(0.5) * f64::from(1 << step);
            charts.uv[place] = on_grid(uv[k] + up * by);
            if around[&corners[k]]
                .iter()
                .all(|&other| other != t && !was_sound(charts, other, place, uv[k]) || is_sound(charts.triangle(other)))
            {
                return true;
            }
        }
        charts.uv[place] = uv[k];
    }
    false
}

/// Whether a triangle was sound when one of its places was elsewhere.
fn was_sound(charts: &Charts, t: usize, place: usize, was: DVec2) -> bool {
    is_sound(charts.corners[t].map(|corner| if corner as usize == place { was } else { charts.uv[corner as usize] }))
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    /// Two triangles above and below an edge, and one so thin between them that rounding put its corner `by` below the edge.
    fn sliver(by: f64) -> (Charts, Surface) {
        let uv = [[0.25, 0.5], [0.75, 0.5], [0.5, 0.5 - by], [0.5, 0.875], [0.5, 0.125]].map(DVec2::from).to_vec();
        let triangles = vec![[0, 1, 2], [2, 1, 3], [0, 2, 3], [1, 0, 4]];
        let charts = Charts { uv: uv.clone(), vertex: (0..5).collect(), corners: triangles.clone(), of: vec![0; 4] };
        let positions: Vec<DVec3> = uv.iter().map(|at| at.extend(0.0)).collect();
        (charts, Surface { positions, triangles, unit: 1.0 })
    }

    #[test]
    fn a_corner_that_fell_across_an_edge_is_put_back() {
        let (mut charts, surface) = sliver(f64::from(f32::EPSILON) / 4.0);
        assert_eq!(mend(&mut charts, &surface, &Progress::none()).unwrap(), 1);
        let found = check(&charts.uv, &charts.corners, &Progress::none()).unwrap();
        assert!(found.is_sound() && found.without_area.is_empty(), "{found:?}");
        assert!(charts.uv.iter().all(|at| at.as_vec2().as_dvec2() == *at));
    }

    #[test]
    fn what_lies_far_on_the_wrong_side_loses_its_area() {
        let (mut charts, surface) = sliver(0.2);
        mend(&mut charts, &surface, &Progress::none()).unwrap();
        let found = check(&charts.uv, &charts.corners, &Progress::none()).unwrap();
        assert!(found.is_sound() && found.without_area.contains(&0), "{found:?}");
        assert_eq!(charts.of[0], NONE);
    }
}
