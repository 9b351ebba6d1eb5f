//! Exact measures: distances of points to a mesh, areas and angles of its triangles.
//!
//! Distances are found in f64 through [`Bvh`], which no algorithm of this crate builds surfaces with: what judges a
//! result shares no code with what made it.

use glam::DVec3;
use rayon::prelude::*;

use super::TriMesh;
use base::error::{Error, Result};
use base::magnitude;
use base::progress::Progress;
use geom::bvh::{Bvh, Closest, Feature};

/// Points that are measured between two looks at the progress.
pub(super) const CHUNK: usize = 1024;
/// Triangles handled between two looks at the progress.
const BLOCK: usize = 1 << 16;

/// Whether distances say on which side of the surface a point is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// All distances are positive.
    Ignored,
    /// Distances behind the surface are negative. The side follows from the angle-weighted normal of the closest face, edge
    /// or vertex \[BA05\], which is right wherever the mesh is closed, and beside a boundary means the side of the nearest face.
    Signed,
}

/// Figures over many distances; all but `bias` are of their absolute values.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Summary {
    /// How many.
    pub count: usize,
    /// Mean.
    pub mean: f64,
    /// Root of the mean square.
    pub rms: f64,
    /// The smallest value that at least 95 % do not exceed.
    pub p95: f64,
    /// Largest.
    pub max: f64,
    /// Mean of the values with their signs.
    pub bias: f64,
    /// Index of the largest, the first of several.
    pub worst: Option<usize>,
}

impl Summary {
    /// Sums up `distances`; all zero without any.
    pub fn of(distances: &[f64]) -> Self {
        let count = distances.len();
        if count == 0 {
            return Summary::default();
        }
        let mut sizes: Vec<f64> = distances.iter().map(|d| d.abs()).collect();
        let worst = (0..count).fold(0, |w, i| if sizes[i] > sizes[w] { i } else { w });
        let n = count as f64;
        Summary {
            count,
            mean: sizes.iter().sum::<f64>() / n,
            rms: (sizes.iter().map(|d| d * d).sum::<f64>() / n).sqrt(),
            max: sizes[worst],
            bias: distances.iter().sum::<f64>() / n,
            worst: Some(worst),
            p95: *sizes.select_nth_unstable_by((count * 95).div_ceil(100) - 1, f64::total_cmp).1,
        }
    }
}

/// Distances of points to a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Deviation {
    /// One a point.
    pub distances: Vec<f64>,
    /// Their figures.
    pub summary: Summary,
}

/// Exact distances of `points` to the nearest point of `mesh`, with `threads` threads, 0 for one a core.
///
/// # Cost
/// Time O((n + m) log m) for n points and m triangles, memory O(n + m). The result is the same for any number of threads.
///
/// # Errors
/// [`Error::Input`] for a mesh without triangles or with a bad index, and for coordinates that aren't finite;
/// [`Error::Cancelled`].
pub fn deviation(
    points: &[DVec3],
    mesh: &TriMesh,
    side: Side,
    threads: usize,
    progress: &Progress<'_>,
) -> Result<Deviation> {
    check_measurable(points, mesh)?;
    progress.plan(&[("measuring", 1.0)]);
    progress.stage(0, chunks(points.len()));
    let pool = base::threads::pool(threads)?;
    progress.run(&pool, || distances(points, mesh, side, threads, 1, progress))
}

/// The same as part of another operation's work, within its pool. Each of the [`chunks`] advances the progress by
/// `counts`.
///
/// # Errors
/// As [`deviation`].
pub fn deviation_within(
    points: &[DVec3],
    mesh: &TriMesh,
    side: Side,
    counts: u64,
    progress: &Progress<'_>,
) -> Result<Deviation> {
    check_measurable(points, mesh)?;
    distances(points, mesh, side, rayon::current_num_threads(), counts, progress)
}

/// Steps in which so many points are measured.
#[doc(hidden)]
pub fn chunks(points: usize) -> u64 {
    points.div_ceil(CHUNK) as u64
}

/// For each of `points` the triangle of `mesh` that is nearest, of several as near the one of the smallest index.
///
/// # Cost
/// As [`deviation`].
///
/// # Errors
/// As [`deviation`].
pub fn nearest_triangles(
    points: &[DVec3],
    mesh: &TriMesh,
    threads: usize,
    progress: &Progress<'_>,
) -> Result<Vec<u32>> {
    check_measurable(points, mesh)?;
    progress.plan(&[("measuring", 1.0)]);
    progress.stage(0, chunks(points.len()));
    let pool = base::threads::pool(threads)?;
    progress.run(&pool, || {
        let bvh = Bvh::build_with(&mesh.positions, &mesh.triangles, threads, progress)?;
        let mut nearest = vec![0; points.len()];
        nearest.par_chunks_mut(CHUNK).zip(points.par_chunks(CHUNK)).try_for_each(|(nearest, points)| {
            for (nearest, &point) in nearest.iter_mut().zip(points) {
                *nearest = bvh.closest_point(point).expect("there is a triangle and the point is finite").triangle;
            }
            progress.advance(1)
        })?;
        Ok(nearest)
    })
}

fn check_measurable(points: &[DVec3], mesh: &TriMesh) -> Result<()> {
    magnitude::points("point", points)?;
    if mesh.triangles.is_empty() && !points.is_empty() {
        return Err(Error::input("the mesh has no triangle to measure distances to"));
    }
    Ok(())
}

/// On the pool of the caller; each chunk of points advances the progress by `counts`.
fn distances(
    points: &[DVec3],
    mesh: &TriMesh,
    side: Side,
    threads: usize,
    counts: u64,
    progress: &Progress<'_>,
) -> Result<Deviation> {
    let mut distances = vec![0.0; points.len()];
    let bvh = Bvh::build_with(&mesh.positions, &mesh.triangles, threads, progress)?;
    measure_points(points, mesh, &bvh, side, &mut distances, counts, progress)?;
    Ok(Deviation { summary: Summary::of(&distances), distances })
}

/// Writes the distances of `points` to `mesh` on the pool of the caller; each chunk advances the progress by `counts`.
pub(super) fn measure_points(
    points: &[DVec3],
    mesh: &TriMesh,
    bvh: &Bvh<'_>,
    side: Side,
    distances: &mut [f64],
    counts: u64,
    progress: &Progress<'_>,
) -> Result<()> {
    let normals = (side == Side::Signed).then(|| PseudoNormals::new(mesh, progress)).transpose()?;
    distances.par_chunks_mut(CHUNK).zip(points.par_chunks(CHUNK)).try_for_each(|(distances, points)| {
        for (distance, &point) in distances.iter_mut().zip(points) {
            let closest = bvh.closest_point(point).expect("there is a triangle and the point is finite");
            *distance = closest.distance();
            if let Some(normals) = &normals
                && normals.at(mesh, &closest).dot(point - closest.point) < 0.0
            {
                *distance = -*distance;
            }
        }
        progress.advance(counts)
    })
}

/// Normals of edges and vertices that tell the side of a point. \[BA05\]
struct PseudoNormals {
    vertices: Vec<DVec3>,
    /// The edges whose smaller end is vertex v are `starts[v]..starts[v + 1]` of `edges`.
    starts: Vec<usize>,
    /// The larger end and the triangle, sorted.
    edges: Vec<[u32; 2]>,
}

impl PseudoNormals {
    fn new(mesh: &TriMesh, progress: &Progress<'_>) -> Result<Self> {
        let mut vertices = vec![DVec3::ZERO; mesh.positions.len()];
        let mut starts = vec![0_usize; mesh.positions.len() + 1];
        let blocks = || (0..mesh.triangles.len()).step_by(BLOCK).map(|t| t..(t + BLOCK).min(mesh.triangles.len()));
        for block in blocks() {
            progress.check()?;
            for t in block {
                let (corners, normal, angles) = (mesh.triangles[t], face_normal(mesh, t), angles(mesh.corners(t)));
                for k in 0..3 {
                    vertices[corners[k] as usize] += normal * angles[k];
                    starts[edge(corners, k)[0] as usize + 1] += 1;
                }
            }
        }
        for v in 1..starts.len() {
            starts[v] += starts[v - 1];
        }
        let mut next = starts.clone();
        let mut edges = vec![[0; 2]; 3 * mesh.triangles.len()];
        for block in blocks() {
            progress.check()?;
            for t in block {
                for k in 0..3 {
                    let [low, high] = edge(mesh.triangles[t], k);
                    let slot = &mut next[low as usize];
                    edges[*slot] = [high, t as u32];
                    *slot += 1;
                }
            }
        }
        for (v, range) in starts.windows(2).enumerate() {
            if v % BLOCK == 0 {
                progress.check()?;
            }
            // Around one vertex: a handful.
            edges[range[0]..range[1]].sort_unstable();
        }
        Ok(PseudoNormals { vertices, starts, edges })
    }

    fn at(&self, mesh: &TriMesh, closest: &Closest) -> DVec3 {
        let corners = mesh.triangles[closest.triangle as usize];
        match closest.feature {
            Feature::Inside => face_normal(mesh, closest.triangle as usize),
            Feature::Corner(k) => self.vertices[corners[k as usize] as usize],
            Feature::Edge(k) => {
                let [low, high] = edge(corners, k as usize);
                let edges = &self.edges[self.starts[low as usize]..self.starts[low as usize + 1]];
                let first = edges.partition_point(|edge| edge[0] < high);
                let shared = edges[first..].iter().take_while(|edge| edge[0] == high);
                shared.fold(DVec3::ZERO, |sum, edge| sum + face_normal(mesh, edge[1] as usize))
            }
        }
    }
}

/// The edge opposite corner `k`, the smaller end first.
fn edge(corners: [u32; 3], k: usize) -> [u32; 2] {
    let (a, b) = (corners[(k + 1) % 3], corners[(k + 2) % 3]);
    [a.min(b), a.max(b)]
}

fn face_normal(mesh: &TriMesh, t: usize) -> DVec3 {
    let [a, b, c] = mesh.corners(t);
    (b - a).cross(c - a).normalize_or_zero()
}

/// Angles of a triangle at its corners, in radians; where two corners are equal, 0 at them.
pub fn angles(corners: [DVec3; 3]) -> [f64; 3] {
    std::array::from_fn(|k| {
        let u = corners[(k + 1) % 3] - corners[k];
        let v = corners[(k + 2) % 3] - corners[k];
        u.cross(v).length().atan2(u.dot(v))
    })
}

/// Area of a triangle.
pub fn area([a, b, c]: [DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}

/// Area of all triangles together.
pub fn total_area(mesh: &TriMesh) -> f64 {
    (0..mesh.triangles.len()).map(|t| area(mesh.corners(t))).sum()
}

/// Volume that a closed mesh encloses; negative if it is inside out, without meaning if it is open.
pub fn enclosed_volume(mesh: &TriMesh) -> f64 {
    // Measured from a vertex of the mesh: far from the origin the terms would cancel.
    let Some(&origin) = mesh.positions.first() else { return 0.0 };
    let sixfold: f64 = (0..mesh.triangles.len())
        .map(|t| {
            let [a, b, c] = mesh.corners(t).map(|p| p - origin);
            a.dot(b.cross(c))
        })
        .sum();
    sixfold / 6.0
}

/// Lower and upper corner of the points; `None` without points.
pub fn bounds(positions: &[DVec3]) -> Option<(DVec3, DVec3)> {
    let first = *positions.first()?;
    Some(positions.iter().fold((first, first), |(lo, hi), &p| (lo.min(p), hi.max(p))))
}

/// Areas and angles of a mesh's triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quality {
    /// Triangles.
    pub triangles: usize,
    /// Triangles whose area, computed in double precision, is zero.
    pub without_area: usize,
    /// Area of all together.
    pub area: f64,
    /// Area of the smallest and of the largest.
    pub area_range: [f64; 2],
    /// Smallest angle of all, radians.
    pub smallest_angle: f64,
    /// Mean over the triangles of their smallest angle, radians; pi/3 where all are equilateral.
    pub mean_smallest_angle: f64,
    /// Largest angle of all, radians.
    pub largest_angle: f64,
    /// Triangles by their smallest angle, in steps of 5 degrees; the last step includes 60.
    pub by_smallest_angle: [usize; 12],
}

/// Measures the triangles; all zero without any.
///
/// # Panics
/// If a triangle names a vertex that doesn't exist: see [`TriMesh::validate`].
pub fn quality(mesh: &TriMesh) -> Quality {
    let measured = quality_while(mesh, |_| Ok(()));
    measured.expect("nothing stops it")
}

/// The same with the angles of each triangle shown to `visit`, which may stop it.
///
/// # Errors
/// What `visit` returns.
pub fn quality_while(mesh: &TriMesh, mut visit: impl FnMut([f64; 3]) -> Result<()>) -> Result<Quality> {
    let triangles = mesh.triangles.len();
    if triangles == 0 {
        return Ok(Quality::default());
    }
    let mut q = Quality {
        triangles,
        area_range: [f64::INFINITY, 0.0],
        smallest_angle: std::f64::consts::PI,
        ..Quality::default()
    };
    for t in 0..triangles {
        let corners = mesh.corners(t);
        let (area, angles) = (area(corners), angles(corners));
        visit(angles)?;
        let [low, high] = angles.iter().fold([f64::INFINITY, 0.0_f64], |[l, h], &a| [l.min(a), h.max(a)]);
        q.without_area += usize::from(area == 0.0);
        q.area += area;
        q.area_range = [q.area_range[0].min(area), q.area_range[1].max(area)];
        q.smallest_angle = q.smallest_angle.min(low);
        q.largest_angle = q.largest_angle.max(high);
        q.mean_smallest_angle += low / triangles as f64;
        q.by_smallest_angle[((low.to_degrees() / 5.0) as usize).min(11)] += 1;
    }
    Ok(q)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_3, FRAC_PI_4, PI};

    use proptest::prelude::*;

    use super::*;
    use crate::shapes::Shape;

    fn measure(points: &[DVec3], mesh: &TriMesh, side: Side) -> Deviation {
        deviation(points, mesh, side, 2, &Progress::none()).unwrap()
    }

    proptest! {
        /// A box is its triangles: its formula and the mesh must agree, inside and outside, at faces, edges and corners.
        #[test]
        fn signed_distances_to_a_box_are_exact(
            points in prop::collection::vec([-3.0..3.0, -3.0..3.0, -3.0..3.0], 1..50),
            detail in 1usize..4,
            offset in prop_oneof![Just(0.0), Just(1e7)],
        ) {
            let shape = Shape::Cuboid { half: DVec3::new(1.0, 2.0, 0.5) };
            let mut mesh = shape.mesh(detail);
            mesh.positions.iter_mut().for_each(|p| *p += offset);
            let points: Vec<DVec3> = points.into_iter().map(|p| DVec3::from_array(p) + offset).collect();
            let measured = measure(&points, &mesh, Side::Signed);
            let unsigned = measure(&points, &mesh, Side::Ignored);
            for (i, &p) in points.iter().enumerate() {
                let exact = shape.distance(p - offset);
                prop_assert!((measured.distances[i] - exact).abs() <= 1e-14 + 4.0 * f64::EPSILON * offset);
                prop_assert_eq!(measured.distances[i].abs(), unsigned.distances[i]);
            }
        }

        #[test]
        fn the_summary_is_that_of_the_sorted_distances(distances in prop::collection::vec(-5.0..5.0, 1..200)) {
            let s = Summary::of(&distances);
            let mut sorted: Vec<f64> = distances.iter().map(|d: &f64| d.abs()).collect();
            sorted.sort_by(f64::total_cmp);
            let within = sorted.iter().filter(|&&d| d <= s.p95).count();
            let below = sorted.iter().filter(|&&d| d < s.p95).count();
            prop_assert!(within * 100 >= distances.len() * 95 && below * 100 < distances.len() * 95);
            prop_assert_eq!(s.max, sorted[sorted.len() - 1]);
            prop_assert_eq!(s.worst, distances.iter().position(|d| d.abs() == s.max));
            prop_assert!(s.bias.abs() <= s.mean + 1e-12 && s.mean <= s.rms + 1e-12 && s.rms <= s.max + 1e-12);
        }
    }

    #[test]
    fn distances_to_a_fine_sphere_are_those_of_the_sphere() {
        let shape = Shape::Sphere { radius: 1.0 };
        let mesh = shape.mesh(100);
        let points: Vec<DVec3> = (0..2000)
            .map(|i| {
                let (z, a) = (1.0 - (i as f64 + 0.5) / 1000.0, i as f64 * 2.4);
                let r = (1.0 - z * z).sqrt();
                DVec3::new(r * a.cos(), r * a.sin(), z) * (0.1 + 2.0 * ((i * 37 % 100) as f64 / 100.0))
            })
            .collect();
        let measured = measure(&points, &mesh, Side::Signed);
        for (p, d) in points.iter().zip(&measured.distances) {
            let difference = d - shape.distance(*p);
            assert!((-1e-12..1e-4).contains(&difference), "{difference}");
        }
    }

    #[test]
    fn the_side_is_right_beyond_a_sharp_edge() {
        // A thin wedge: close to its sharp edge the nearest face alone would often name the wrong side.
        let mesh = TriMesh::new(
            vec![DVec3::ZERO, DVec3::Y, DVec3::new(1.0, 0.0, 0.01), DVec3::new(1.0, 0.0, -0.01)],
            vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        );
        assert!(enclosed_volume(&mesh) > 0.0);
        let outside = [DVec3::new(-0.5, 0.5, 0.3), DVec3::new(-0.1, 0.4, -0.3), DVec3::new(-1.0, -1.0, 0.0)];
        let inside = [DVec3::new(0.5, 0.2, 0.0), DVec3::new(0.9, 0.05, 0.004)];
        assert!(measure(&outside, &mesh, Side::Signed).distances.iter().all(|&d| d > 0.0));
        assert!(measure(&inside, &mesh, Side::Signed).distances.iter().all(|&d| d < 0.0));
    }

    #[test]
    fn the_side_is_right_beyond_a_sharp_tip() {
        // Seen from beside the tip, the faces on its other side look away from the point.
        let base = [DVec3::new(1.0, 1.0, -10.0), DVec3::new(-1.0, 1.0, -10.0), DVec3::new(0.0, -1.0, -10.0)];
        let positions = [vec![DVec3::ZERO], base.to_vec()].concat();
        let mesh = TriMesh::new(positions, vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]);
        assert!(enclosed_volume(&mesh) > 0.0);
        let around: Vec<DVec3> = (0..24).map(|i| DVec3::new(0.0, 0.5, 0.2).rotate_z(0.26 * f64::from(i))).collect();
        let measured = measure(&around, &mesh, Side::Signed);
        assert!(around.iter().zip(&measured.distances).all(|(p, d)| (d - p.length()).abs() < 1e-15));
    }

    #[test]
    fn the_same_distances_for_any_number_of_threads() {
        let mesh = Shape::Torus { major: 2.0, minor: 0.5 }.mesh(12);
        let points: Vec<DVec3> =
            (0..5000).map(|i| DVec3::new((i % 17) as f64, (i % 13) as f64, (i % 7) as f64) * 0.3 - 2.0).collect();
        let all = [1, 2, 8].map(|n| deviation(&points, &mesh, Side::Signed, n, &Progress::none()).unwrap());
        assert!(all[0] == all[1] && all[0] == all[2]);
    }

    #[test]
    fn the_nearest_triangle_is_the_one_at_the_least_distance() {
        let mesh = Shape::Torus { major: 2.0, minor: 0.5 }.mesh(4);
        let points: Vec<DVec3> =
            (0..300).map(|i| DVec3::new((i % 17) as f64, (i % 13) as f64, 1.0) * 0.3 - 2.0).collect();
        let found = nearest_triangles(&points, &mesh, 2, &Progress::none()).unwrap();
        for (point, &found) in points.iter().zip(&found) {
            let distance = |t: usize| Closest::on_triangle(*point, &mesh.corners(t), 0).distance_squared;
            let least = (0..mesh.triangles.len()).map(distance).fold(f64::INFINITY, f64::min);
            assert_eq!(distance(found as usize), least);
        }
        let cancelled = nearest_triangles(&points, &mesh, 1, &Progress::cancel_after(1));
        assert!(matches!(cancelled, Err(Error::Cancelled)));
    }

    #[test]
    fn angles_areas_and_volumes_are_known() {
        let right = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let expected = [FRAC_PI_2, FRAC_PI_4, FRAC_PI_4];
        assert!(angles(right).iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15));
        assert_eq!(area(right), 0.5);
        assert_eq!(angles([DVec3::ZERO; 3]), [0.0; 3]);

        let mut mesh = Shape::Cuboid { half: DVec3::new(1.0, 2.0, 0.5) }.mesh(2);
        mesh.positions.iter_mut().for_each(|p| *p += 1e6);
        assert!((enclosed_volume(&mesh) - 8.0).abs() < 1e-8 && (total_area(&mesh) - 28.0).abs() < 1e-8);

        let side = 3f64.sqrt() / 2.0;
        let two = TriMesh::new(
            vec![DVec3::ZERO, DVec3::X, DVec3::new(0.5, side, 0.0), DVec3::X * 2.0],
            vec![[0, 1, 2], [0, 1, 3]],
        );
        let q = quality(&two);
        assert_eq!((q.triangles, q.without_area, q.smallest_angle), (2, 1, 0.0));
        assert!((q.largest_angle - PI).abs() < 1e-12 && (q.mean_smallest_angle - FRAC_PI_3 / 2.0).abs() < 1e-12);
        assert!((q.area - side / 2.0).abs() < 1e-15 && q.by_smallest_angle[0] == 1);
    }

    #[test]
    fn bad_input_is_named_and_cancelling_works() {
        let mesh = Shape::Sphere { radius: 1.0 }.mesh(3);
        let text = |points: &[DVec3], mesh: &TriMesh| {
            deviation(points, mesh, Side::Ignored, 1, &Progress::none()).unwrap_err().to_string()
        };
        let beyond = 2.0 * magnitude::LARGEST;
        // The largest of a number and of what is none is the number.
        let nan = DVec3::new(f64::NAN, 0.0, 0.0);
        for bad in [DVec3::NAN, DVec3::INFINITY, nan, DVec3::new(0.0, f64::NAN, 1.0), DVec3::splat(beyond)] {
            assert!(text(&[DVec3::ZERO, bad], &mesh).contains("point 1"), "{bad}");
        }
        let broken = TriMesh::new(vec![nan, DVec3::X, DVec3::Y], vec![[0, 1, 2]]);
        assert!(text(&[DVec3::ZERO], &broken).contains("vertex 0"));
        assert!(text(&[DVec3::ZERO], &TriMesh::default()).contains("no triangle"));
        assert!(text(&[DVec3::ZERO], &TriMesh::new(vec![DVec3::ZERO], vec![[0, 0, 9]])).contains("vertex 9"));
        assert_eq!(measure(&[], &TriMesh::default(), Side::Signed), Deviation::default());
        let points = vec![DVec3::X; 3 * CHUNK];
        for checks in 0..4 {
            let outcome = deviation(&points, &mesh, Side::Ignored, 1, &Progress::cancel_after(checks));
            assert!(matches!(outcome, Err(Error::Cancelled)), "{checks}");
        }
    }
}
