//! How far one surface lies from another: exact at the vertices, with a bound that holds for every point between them.
//!
//! Triangles that may hold a farther point than any found are split until none can, as in \[CRS98\] but to a certificate
//! instead of a sampling density. Two facts bound the distance over a triangle: it changes no faster than the point moves.
//! The distance to **one** triangle of the reference is a convex function, largest at a corner.

use glam::DVec3;
use rayon::prelude::*;

use super::measure::{CHUNK, Deviation, DistanceReport, Side, measure_points};
use super::{Crs, TriMesh};
use base::error::{Error, Result};
use base::magnitude;
use base::progress::{Pace, Progress};
use geom::bvh::{Bvh, Closest};

/// The bound is brought within this share of the largest distance found.
const SHARE: f64 = 0.01;
/// Or within this share of the reference's extent, where surfaces all but coincide.
const FLOOR: f64 = 1e-6;
/// Measurements between the vertices that may be spent: so many a vertex, and at least.
const PER_VERTEX: usize = 8;
const AT_LEAST: usize = 100_000;

/// The distance of a surface to another.
#[derive(Clone, Debug, PartialEq)]
pub struct Certified {
    /// Of the vertices: exact.
    pub vertices: Deviation,
    /// The largest distance found, between the vertices too.
    pub reached: f64,
    /// No point of the surface is farther.
    pub bound: f64,
}

impl Certified {
    /// The figures of the vertices, and those of the surface between them.
    pub fn report(&self) -> DistanceReport {
        DistanceReport { reached: Some(self.reached), bound: Some(self.bound), ..self.vertices.summary }
    }
}

/// Least share of the squared longest edge for a projection that rounding leaves no doubt about, and the share that it may take.
const CLEAR: f64 = 1e-6;
const ROUNDED: f64 = 1e-9;

/// No point of a triangle is farther than this from the nearest of its corners.
fn cover(corners: [DVec3; 3]) -> f64 {
    let edge = |k: usize| corners[(k + 1) % 3].distance(corners[(k + 2) % 3]);
    let k = (1..3).fold(0, |longest, k| if edge(k) > edge(longest) { k } else { longest });
    let (longest, apex) = (edge(k), corners[k]);
    // The circle through the corners, of a triangle without an obtuse angle.
    let most = longest / 3f64.sqrt();
    let [a, b] = [corners[(k + 1) % 3], corners[(k + 2) % 3]];
    if (a - apex).dot(b - apex) >= 0.0 {
        return most;
    }
    // Beside an obtuse angle, the places of the longest edge that are as far from its end as from the apex.
    let place = |end: DVec3, other: DVec3| {
        let along = (other - end).dot(apex - end);
        let clear = along > CLEAR * longest * longest;
        if clear { 0.5 * apex.distance_squared(end) * longest / along * (1.0 + ROUNDED) } else { most }
    };
    place(a, b).max(place(b, a)).min(most)
}

/// A triangle of the measured surface, or a part of one, with what is known of its corners.
#[derive(Clone, Copy)]
struct Part {
    corners: [DVec3; 3],
    distances: [f64; 3],
    /// Triangles of the reference closest to the corners.
    closest: [u32; 3],
}

impl Part {
    fn largest(&self) -> f64 {
        self.distances.iter().copied().fold(0.0, f64::max)
    }

    /// No point of the part is farther than this from the reference.
    fn bound(&self, reference: &TriMesh) -> f64 {
        let [a, b, c] = self.corners;
        let edges = [b.distance(c), c.distance(a), a.distance(b)];
        let mut least = self.largest() + cover(self.corners);
        for k in 0..3 {
            least = least.min(self.distances[k] + edges[(k + 1) % 3].max(edges[(k + 2) % 3]));
        }
        for k in 0..3 {
            if k == 0 || self.closest[k] != self.closest[k - 1] {
                least = least.min(self.bound_by(reference, self.closest[k]));
            }
        }
        least
    }

    /// The bound that one triangle of the reference gives.
    fn bound_by(&self, reference: &TriMesh, triangle: u32) -> f64 {
        let corners = reference.triangles[triangle as usize].map(|v| reference.positions[v as usize]);
        let distance = |point| Closest::on_triangle(point, &corners, triangle).distance();
        self.corners.map(distance).into_iter().fold(0.0, f64::max)
    }

    /// The bound that the middle gives: by the triangle of the reference that is closest to it, and as a corner of three triangles.
    fn bound_by_middle(&self, reference: &TriMesh, middle: DVec3, closest: &Closest) -> f64 {
        let third = |k: usize| {
            let [a, b] = [k, (k + 1) % 3];
            let largest = self.distances[a].max(self.distances[b]).max(closest.distance());
            largest + cover([self.corners[a], self.corners[b], middle])
        };
        self.bound_by(reference, closest.triangle).min(third(0).max(third(1)).max(third(2)))
    }

    fn middle(&self) -> DVec3 {
        (self.corners[0] + self.corners[1] + self.corners[2]) / 3.0
    }

    fn split(&self, middles: [(DVec3, Closest); 3]) -> [Part; 4] {
        let at = |k: usize| (self.corners[k], self.distances[k], self.closest[k]);
        let mid = |k: usize| (middles[k].0, middles[k].1.distance(), middles[k].1.triangle);
        // Middle k lies opposite corner k.
        [[at(0), mid(2), mid(1)], [at(1), mid(0), mid(2)], [at(2), mid(1), mid(0)], [mid(0), mid(1), mid(2)]]
            .map(|p| Part { corners: p.map(|q| q.0), distances: p.map(|q| q.1), closest: p.map(|q| q.2) })
    }
}

/// How far `surface` lies from `reference`, both in one frame, with `threads` threads, 0 for one a core.
///
/// # Guarantees
/// No point of `surface` is farther from `reference` than `bound`. Some point is as far as `reached`, up to rounding. The
/// bound is within 1 % of `reached`, or a millionth of the reference's extent above it, unless that takes more than 8
/// measurements a vertex and 100,000. The result is the same for any number of threads.
///
/// # Cost
/// Time O(k log m) for m triangles of the reference and k measurements, memory O(k).
///
/// # Errors
/// [`Error::Input`] for a reference without triangles, bad indices, and coordinates that aren't finite or are larger than
/// [`magnitude::LARGEST`]. The same for two meshes of different coordinate reference systems, or in degrees.
/// [`Error::Cancelled`].
pub fn certify(
    surface: &TriMesh,
    reference: &TriMesh,
    side: Side,
    threads: usize,
    progress: &Progress<'_>,
) -> Result<Certified> {
    surface.validate()?;
    reference.validate()?;
    Crs::common([("the surface", surface.crs.clone()), ("the reference", reference.crs.clone())])?;
    let points = &surface.positions;
    magnitude::points("vertex", points)?;
    if reference.triangles.is_empty() && !points.is_empty() {
        return Err(Error::input("the reference has no triangle to measure distances to"));
    }
    progress.plan(&[("measuring vertices", 1.0), ("measuring between them", 1.0)]);
    progress.stage(0, points.len().div_ceil(CHUNK) as u64);
    let pool = base::threads::pool(threads)?;
    progress.run(&pool, || {
        let bvh = Bvh::build_with(&reference.positions, &reference.triangles, threads, progress)?;
        let (vertices, closest) = measured(points, reference, &bvh, side, 1, progress)?;
        progress.stage(1, (budget(surface) / CHUNK) as u64);
        let (reached, bound) = between(surface, reference, &bvh, (&vertices, &closest), 0.0, 1, progress)?;
        Ok(Certified { vertices, reached, bound })
    })
}

/// As [`certify`] without sides, in the pool that it is called in and without a progress of its own. Both meshes are valid, and the
/// reference, of which `bvh` is, is not empty. Distances up to `known` are of no interest: neither `reached` nor the bound is less.
///
/// # Errors
/// [`Error::Cancelled`].
#[doc(hidden)]
pub fn certify_within(
    surface: &TriMesh,
    reference: &TriMesh,
    bvh: &Bvh<'_>,
    known: f64,
    progress: &Progress<'_>,
) -> Result<Certified> {
    let (vertices, closest) = measured(&surface.positions, reference, bvh, Side::Ignored, 0, progress)?;
    let (reached, bound) = between(surface, reference, bvh, (&vertices, &closest), known, 0, progress)?;
    Ok(Certified { vertices, reached, bound })
}

/// Distances of points, and the triangle closest to each. Each chunk advances the progress by `counts`.
fn measured(
    points: &[DVec3],
    reference: &TriMesh,
    bvh: &Bvh<'_>,
    side: Side,
    counts: u64,
    progress: &Progress<'_>,
) -> Result<(Deviation, Vec<u32>)> {
    let mut found = vec![(0.0, 0); points.len()];
    let keep = |found: &mut (f64, u32), distance, closest: &Closest| *found = (distance, closest.triangle);
    measure_points(points, reference, bvh, side, &mut found, keep, counts, progress)?;
    let (distances, closest): (Vec<f64>, _) = found.into_iter().unzip();
    Ok((Deviation { summary: DistanceReport::of(&distances), distances }, closest))
}

/// Measurements between the vertices that may be spent.
fn budget(surface: &TriMesh) -> usize {
    (PER_VERTEX * surface.positions.len()).max(AT_LEAST)
}

/// The largest distance found, `known` if there is none above it, and the bound, over all of the surface. Each chunk advances the progress by `counts`.
fn between(
    surface: &TriMesh,
    reference: &TriMesh,
    bvh: &Bvh<'_>,
    (vertices, closest): (&Deviation, &[u32]),
    known: f64,
    counts: u64,
    progress: &Progress<'_>,
) -> Result<(f64, f64)> {
    let (low, high) = super::measure::bounds(&reference.positions).unwrap_or_default();
    let largest = surface.positions.iter().chain([&low, &high]).fold(0.0_f64, |m, p| m.max(p.abs().max_element()));
    // The most that rounding may have taken off any of the distances.
    let rounding = 16.0 * f64::EPSILON * largest;
    let floor = FLOOR * low.distance(high) + rounding;
    let mut budget = budget(surface);
    let mut reached = vertices.summary.max.max(known);
    let enough = |reached: f64| (reached * (1.0 + SHARE)).max(reached + floor);

    let start = enough(reached);
    let doubtful = |t: &[u32; 3]| {
        let corners = t.map(|v| surface.positions[v as usize]);
        let distances = t.map(|v| vertices.distances[v as usize].abs());
        let part = Part { corners, distances, closest: t.map(|v| closest[v as usize]) };
        let near = part.largest() + cover(corners) <= start || part.bound(reference) <= start;
        (!near).then_some(part)
    };
    let mut parts = Vec::new();
    for triangles in surface.triangles.chunks(8 * CHUNK) {
        parts.par_extend(triangles.par_iter().filter_map(doubtful));
        progress.check()?;
    }
    loop {
        let limit = enough(reached);
        // A triangle of the reference that is closest to the middle often bounds what those of the corners don't.
        let open = |part: &Part| {
            if part.bound(reference) <= limit {
                return None;
            }
            let middle = part.middle();
            let closest = bvh.closest_point(middle).expect("there is a triangle and the point is finite");
            (part.bound_by_middle(reference, middle, &closest) > limit).then_some(*part)
        };
        let mut left = Vec::new();
        for some in parts.chunks(8 * CHUNK) {
            left.par_extend(some.par_iter().filter_map(open));
            progress.check()?;
        }
        if left.is_empty() {
            return Ok((reached, limit + rounding));
        }
        if 4 * left.len() > budget {
            let farthest = left.par_iter().map(|part| part.bound(reference)).reduce(|| 0.0, f64::max);
            return Ok((reached, farthest.max(limit) + rounding));
        }
        budget -= 4 * left.len();
        parts = Vec::new();
        for some in left.chunks(4 * CHUNK) {
            parts.par_extend(some.par_iter().flat_map_iter(|part| {
                part.split([0, 1, 2].map(|k| {
                    let point = part.corners[(k + 1) % 3].midpoint(part.corners[(k + 2) % 3]);
                    (point, bvh.closest_point(point).expect("there is a triangle and the point is finite"))
                }))
            }));
            progress.advance(counts * (4 * some.len() / CHUNK) as u64)?;
        }
        reached = parts.par_iter().map(Part::largest).reduce(|| reached, f64::max);
    }
}

/// Measurements that may be spent to show that a surface lies within a limit: so many a vertex of both surfaces, and at least.
/// Each triangle has its share of them by area.
const PER_VERTEX_WITHIN: f64 = 32.0;
const AT_LEAST_WITHIN: f64 = 1e6;
/// A triangle's share at least.
const LEAST_SHARE: f64 = 64.0;

/// How far a surface that should lie within a limit of another does so.
pub struct Within {
    /// No point of the triangles that do is farther.
    pub bound: f64,
    /// Triangles that don't, or of which it can't be shown, and the triangle of the reference closest to where.
    pub beyond: Vec<[u32; 2]>,
}

/// The triangles of a surface that lie within `limit` of a reference, with all their points. Both meshes are valid and not empty.
/// Runs in the pool that it is called in. The result is the same for any.
///
/// # Errors
/// Coordinates larger than [`magnitude::LARGEST`]. [`Error::Cancelled`].
#[doc(hidden)]
pub fn within(surface: &TriMesh, reference: &TriMesh, limit: f64, progress: &Progress<'_>) -> Result<Within> {
    let bvh = Bvh::build_with(&reference.positions, &reference.triangles, rayon::current_num_threads(), progress)?;
    let area = |corners: [DVec3; 3]| (corners[1] - corners[0]).cross(corners[2] - corners[0]).length();
    let whole: f64 = (0..surface.triangles.len()).map(|t| area(surface.corners(t))).sum();
    let vertices = surface.positions.len() + reference.positions.len();
    let budget = (PER_VERTEX_WITHIN * vertices as f64).max(AT_LEAST_WITHIN);
    let largest =
        surface.positions.iter().chain(&reference.positions).fold(0.0_f64, |m, p| m.max(p.abs().max_element()));
    // The most that rounding may have taken off any of the distances.
    let rounding = 16.0 * f64::EPSILON * largest;
    let limit = limit - rounding;
    let settle = |t: usize| {
        let corners = surface.corners(t);
        let share = budget * area(corners) / whole;
        settled(corners, reference, &bvh, limit, if share > LEAST_SHARE { share } else { LEAST_SHARE }, progress)
    };
    let numbers: Vec<u32> = (0..surface.triangles.len() as u32).collect();
    let settled = numbers
        .par_chunks(64)
        .map(|some| {
            progress.check()?;
            some.iter().map(|&t| Ok((t, settle(t as usize)?))).collect::<Result<Vec<_>>>()
        })
        .collect::<Result<Vec<_>>>()?;
    let mut within = Within { bound: 0.0, beyond: Vec::new() };
    for (t, outcome) in settled.into_iter().flatten() {
        match outcome {
            Ok(bound) => within.bound = within.bound.max(bound + rounding),
            Err(near) => within.beyond.push([t, near]),
        }
    }
    Ok(within)
}

/// A bound on the distances of a triangle's points that is not above `limit`. If there is none, or `measurements` don't show
/// one: the triangle of the reference closest to a point that may lie beyond.
fn settled(
    corners: [DVec3; 3],
    reference: &TriMesh,
    bvh: &Bvh<'_>,
    limit: f64,
    mut measurements: f64,
    progress: &Progress<'_>,
) -> Result<std::result::Result<f64, u32>> {
    // One large triangle may take most of all measurements.
    let mut pace = Pace::new(progress);
    let closest = |point| bvh.closest_point(point).expect("there is a triangle and the point is finite");
    let found = corners.map(closest);
    let (distances, nearest) = (found.map(|c| c.distance()), found.map(|c| c.triangle));
    let mut parts = vec![Part { corners, distances, closest: nearest }];
    let mut bound = 0.0_f64;
    while let Some(part) = parts.pop() {
        pace.after(16)?;
        if let Some(k) = (0..3).find(|&k| !(part.distances[k] <= limit)) {
            return Ok(Err(part.closest[k]));
        }
        let own = part.bound(reference);
        if own <= limit {
            bound = bound.max(own);
            continue;
        }
        // A triangle of the reference that is closest to the middle often bounds what those of the corners don't.
        let place = part.middle();
        let middle = closest(place);
        let own = part.bound_by_middle(reference, place, &middle);
        if own <= limit {
            bound = bound.max(own);
            continue;
        }
        measurements -= 4.0;
        if !(middle.distance() <= limit) || measurements < 0.0 {
            return Ok(Err(middle.triangle));
        }
        parts.extend(part.split([0, 1, 2].map(|k| {
            let point = part.corners[(k + 1) % 3].midpoint(part.corners[(k + 2) % 3]);
            (point, closest(point))
        })));
    }
    Ok(Ok(bound))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::Shape;

    fn certified(surface: &TriMesh, reference: &TriMesh) -> Certified {
        certify(surface, reference, Side::Ignored, 2, &Progress::none()).unwrap()
    }

    /// One large triangle over a pit of the same corners: its middle is as far from the three slopes as no other point.
    fn lid_and_pit() -> (TriMesh, TriMesh) {
        let side = 3f64.sqrt();
        let corners = [DVec3::new(2.0, 0.0, 0.0), DVec3::new(-1.0, side, 0.0), DVec3::new(-1.0, -side, 0.0)];
        let lid = TriMesh::new(corners.to_vec(), vec![[0, 1, 2]]);
        let pit = TriMesh::new([corners.to_vec(), vec![DVec3::NEG_Z]].concat(), vec![[0, 1, 3], [1, 2, 3], [2, 0, 3]]);
        (lid, pit)
    }

    #[test]
    fn no_point_of_a_triangle_is_farther_from_its_corners_than_said() {
        // Flat to pointed, on either side of a right angle, and without area.
        let apexes = (0..21).flat_map(|i| [0.0, 1e-9, 0.01, 0.2, 0.45, 0.5, 0.55, 0.8, 3.0].map(|y| (i, y)));
        for (i, y) in apexes {
            let corners = [DVec3::ZERO, DVec3::X, DVec3::new(0.1 * f64::from(i) - 0.5, y, 0.0)];
            let at = |i: i32, j: i32| {
                corners[0]
                    + (corners[1] - corners[0]) * (f64::from(i) / 64.0)
                    + (corners[2] - corners[0]) * (f64::from(j) / 64.0)
            };
            let points = (0..=64).flat_map(|i| (0..=64 - i).map(move |j| at(i, j)));
            let nearest = |p: DVec3| corners.iter().map(|c| c.distance(p)).fold(f64::INFINITY, f64::min);
            let (farthest, said) = (points.map(nearest).fold(0.0, f64::max), cover(corners));
            assert!(farthest <= said, "{corners:?}: {farthest} > {said}");
            let obtuse =
                (0..3).any(|k| (corners[(k + 1) % 3] - corners[k]).dot(corners[(k + 2) % 3] - corners[k]) < 0.0);
            assert!(!obtuse || said <= farthest + 0.05, "{corners:?}: {farthest}, {said}");
        }
    }

    #[test]
    fn distances_up_to_a_known_one_are_not_looked_into() {
        let [fine, coarse] = [30, 7].map(|n| Shape::Torus { major: 2.0, minor: 0.5 }.mesh(n));
        let bvh = Bvh::build_with(&fine.positions, &fine.triangles, 1, &Progress::none()).unwrap();
        let of = |known| certify_within(&coarse, &fine, &bvh, known, &Progress::none()).unwrap();
        let (all, plain) = (of(0.0), certified(&coarse, &fine));
        assert!(all == plain);
        let (below, above) = (of(0.5 * all.reached), of(2.0 * all.reached));
        assert!(below.reached <= below.bound && below.reached >= 0.99 * all.reached);
        assert!(
            above.reached == 2.0 * all.reached && above.bound >= above.reached && above.bound < 1.02 * above.reached
        );
    }

    #[test]
    fn surfaces_of_two_systems_are_not_compared() {
        let named = |code| Some(Crs::new(code).unwrap());
        let of = |crs: Option<Crs>| TriMesh { crs, ..Shape::Sphere { radius: 1.0 }.mesh(4) };
        let (utm, other, degrees) = (of(named("EPSG:25832")), of(named("EPSG:25833")), of(named("EPSG:4326")));
        let refused = |surface, reference| {
            certify(surface, reference, Side::Ignored, 1, &Progress::none()).unwrap_err().to_string()
        };
        let error = refused(&utm, &other);
        assert!(
            error.starts_with("the surface is in EPSG:25832, the reference in EPSG:25833: transform one"),
            "{error}"
        );
        let error = refused(&utm, &degrees);
        assert!(error.starts_with("the reference: its coordinates are degrees (EPSG:4326), in which"), "{error}");
        certified(&utm, &of(None));
    }

    #[test]
    fn what_lies_between_the_vertices_is_found() {
        let (lid, pit) = lid_and_pit();
        let there = certified(&lid, &pit);
        assert_eq!(there.vertices.summary.max, 0.0);
        // The slopes fall by 1 over the radius of the circle within, 1.
        let exact = 0.5f64.sqrt();
        assert!(there.reached <= exact + 1e-12 && there.reached > 0.99 * exact, "{}", there.reached);
        assert!(there.bound >= exact && there.bound < 1.02 * exact, "{}", there.bound);
        let back = certified(&pit, &lid);
        assert!(back.reached == 1.0 && (1.0..1.011).contains(&back.bound));
    }

    #[test]
    fn what_lies_within_a_limit_is_told_from_what_does_not() {
        let (lid, pit) = lid_and_pit();
        let exact = 0.5f64.sqrt();
        let of = |surface, reference, limit| within(surface, reference, limit, &Progress::none()).unwrap();
        let found = of(&lid, &pit, 1.001 * exact);
        assert!(found.beyond.is_empty() && (exact..=1.001 * exact).contains(&found.bound), "{}", found.bound);
        assert_eq!(of(&lid, &pit, 0.999 * exact).beyond.len(), 1);
        assert!(of(&pit, &lid, 1.001).beyond.is_empty());
        assert_eq!(of(&pit, &lid, 0.999).beyond.iter().map(|b| b[0]).collect::<Vec<_>>(), [0, 1, 2]);
        // Large triangles over many small ones in the same plane.
        let fine = Shape::Cuboid { half: DVec3::ONE }.mesh(60);
        let coarse = Shape::Cuboid { half: DVec3::ONE }.mesh(1);
        for (a, b) in [(&coarse, &fine), (&fine, &coarse)] {
            let found = of(a, b, 1e-2);
            assert!(found.beyond.is_empty() && found.bound <= 1e-2);
        }
    }

    #[test]
    fn the_bound_holds_for_a_dense_sampling() {
        let coarse = Shape::Torus { major: 2.0, minor: 0.5 }.mesh(7);
        let fine = Shape::Torus { major: 2.0, minor: 0.5 }.mesh(30);
        for (a, b) in [(&coarse, &fine), (&fine, &coarse)] {
            let found = certified(a, b);
            let points: Vec<DVec3> = (a.triangles.iter())
                .flat_map(|t| {
                    let [p, q, r] = t.map(|v| a.positions[v as usize]);
                    (0..=12).flat_map(move |i| {
                        (0..=12 - i).map(move |j| p + (q - p) * (i as f64 / 12.0) + (r - p) * (j as f64 / 12.0))
                    })
                })
                .collect();
            let dense = super::super::measure::deviation(&points, b, Side::Ignored, 2, &Progress::none()).unwrap();
            assert!(dense.summary.max <= found.bound && found.bound <= 1.02 * found.reached);
            assert!(found.reached >= 0.99 * dense.summary.max);
        }
    }

    #[test]
    fn surfaces_that_coincide_are_told_from_those_that_do_not() {
        let mesh = Shape::Sphere { radius: 1.0 }.mesh(40);
        let same = certified(&mesh, &mesh);
        assert!(same.reached < 1e-15 && same.bound < 1e-5, "{same:?}");
        // The same surface cut otherwise: every face of a cube has its own grid.
        let cube = |n| Shape::Cuboid { half: DVec3::splat(1.0) }.mesh(n);
        let other = certified(&cube(7), &cube(3));
        assert!(other.reached < 1e-15 && other.bound < 2e-2, "{} {}", other.reached, other.bound);
    }

    #[test]
    fn the_same_for_any_number_of_threads_and_cancelled_at_any_check() {
        let (a, b) = (Shape::Sphere { radius: 1.0 }.mesh(9), Shape::Sphere { radius: 1.1 }.mesh(5));
        let all = [1, 3].map(|n| certify(&a, &b, Side::Signed, n, &Progress::none()).unwrap());
        assert!(all[0] == all[1] && all[0].vertices.summary.bias < 0.0);
        for checks in 0..3 {
            let outcome = certify(&a, &b, Side::Ignored, 1, &Progress::cancel_after(checks));
            assert!(matches!(outcome, Err(Error::Cancelled)), "{checks}");
        }
    }

    #[test]
    fn bad_input_is_named() {
        let mesh = Shape::Sphere { radius: 1.0 }.mesh(3);
        let text =
            |a: &TriMesh, b: &TriMesh| certify(a, b, Side::Ignored, 1, &Progress::none()).unwrap_err().to_string();
        assert!(text(&mesh, &TriMesh::default()).contains("no triangle"));
        let mut bad = mesh.clone();
        bad.positions[3].y = f64::NAN;
        assert!(text(&bad, &mesh).contains("vertex 3"));
        bad.positions[3].y = -1e200;
        for (a, b) in [(&bad, &mesh), (&mesh, &bad)] {
            let text = text(a, b);
            assert!(text.starts_with("vertex 3 lies at (") && text.contains("-1e200"), "{text}");
        }
        let empty = certified(&TriMesh::default(), &mesh);
        assert!(empty.reached == 0.0 && empty.vertices.summary.count == 0);
        // Corners alone, without a triangle between them, have nothing to split.
        let points = certified(&TriMesh::new(vec![DVec3::X * 3.0], vec![]), &mesh);
        assert!((points.reached - 2.0).abs() < 0.2 && points.bound >= points.reached);
    }
}
