//! Noisy points with normals or sensors.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::{check, cloud, random, run, volume};
use crate::{Closure, NoisyPoints, ReconstructParams, Reconstructed, Reconstructor};
use base::progress::Progress;
use mesh::check::CheckReport;
use mesh::point_cloud::PointCloud;

/// Points with the normals of the surface they were taken from.
#[derive(Clone)]
pub(super) struct Noisy {
    pub(super) points: Vec<DVec3>,
    normals: Vec<DVec3>,
}

/// Numbers with the standard normal distribution.
fn gauss(seed: u64) -> impl FnMut() -> f64 {
    let mut random = random(seed);
    move || (-2.0 * (1.0 - random()).ln()).sqrt() * (TAU * random()).cos()
}

/// Radii of a hollow ball.
const OUTER: f64 = 1.0;
const INNER: f64 = 0.85;

/// At random over both spheres. Noise in spacings.
pub(super) fn hollow_ball(count: usize, noise: f64) -> Noisy {
    let (mut random, mut gauss) = (random(7), gauss(9));
    let squares = OUTER * OUTER + INNER * INNER;
    let deviation = noise * (4.0 * PI * squares / count as f64).sqrt();
    let mut made = Noisy { points: Vec::new(), normals: Vec::new() };
    for _ in 0..count {
        let (z, turn) = (2.0 * random() - 1.0, TAU * random());
        let around = (1.0 - z * z).sqrt();
        let away = DVec3::new(around * turn.cos(), around * turn.sin(), z);
        let (radius, normal) = if random() * squares < OUTER * OUTER { (OUTER, away) } else { (INNER, -away) };
        made.points.push(away * radius + deviation * DVec3::new(gauss(), gauss(), gauss()));
        made.normals.push(normal);
    }
    made
}

impl Noisy {
    /// Places up to 70 degrees off the normals, so far away.
    pub(super) fn sensors(&self, far: f64) -> Vec<DVec3> {
        let mut random = random(31);
        let seen = self.points.iter().zip(&self.normals).map(|(&point, &normal)| {
            let (tilt, turn) = (70_f64.to_radians() * random(), TAU * random());
            let (u, v) = normal.any_orthonormal_pair();
            point + far * (normal * tilt.cos() + (u * turn.cos() + v * turn.sin()) * tilt.sin())
        });
        seen.collect()
    }

    pub(super) fn cloud(&self) -> PointCloud {
        PointCloud {
            normals: Some(self.normals.iter().map(|normal| normal.as_vec3().to_array()).collect()),
            ..cloud(self.points.clone())
        }
    }
}

fn seen(points: &[DVec3], sensors: Vec<DVec3>, params: &ReconstructParams) -> Reconstructed {
    let mut made = Reconstructor::new(cloud(points.to_vec())).unwrap();
    made.seen_from(sensors).unwrap();
    made.surface(params, &Progress::none()).unwrap()
}

fn plain(cloud: &PointCloud) -> Reconstructed {
    run(cloud, &ReconstructParams::default(), &Progress::none()).unwrap()
}

/// Whether a surface is that of the hollow ball: two spheres, the wall between them.
fn is_hollow(made: &Reconstructed) -> bool {
    let report: CheckReport = check(&made.mesh);
    let exact = 4.0 / 3.0 * PI * (OUTER.powi(3) - INNER.powi(3));
    let (volume, noise) = (volume(&made.mesh), made.report.noise / made.report.spacing);
    println!("{report}, volume {volume} of {exact}, noise {noise}");
    report.is_closed() && report.components == 2 && report.genus() == Some(0) && (volume / exact - 1.0).abs() < 0.1
}

#[test]
fn walls_thinner_than_their_noise_have_two_sides_where_normals_or_sensors_say() {
    let ball = hollow_ball(20_000, 1.5);
    assert!(!is_hollow(&plain(&cloud(ball.points.clone()))), "nothing tells the sides apart");
    let params = ReconstructParams::default();
    for far in [0.3, 3.0, 1e6] {
        assert!(is_hollow(&seen(&ball.points, ball.sensors(far), &params)), "by sensors {far} away");
    }
    let made = plain(&ball.cloud());
    assert!(is_hollow(&made), "by normals");
    assert!((made.report.noise / made.report.spacing - 1.5).abs() < 0.6, "{:?}", made.report);
}

#[test]
fn sensors_may_be_known_of_some_points_only() {
    let ball = hollow_ball(20_000, 1.0);
    let mut sensors = ball.sensors(3.0);
    sensors.iter_mut().step_by(2).for_each(|sensor| *sensor = DVec3::NAN);
    // A sensor in a point looks nowhere.
    sensors[1] = ball.points[1];
    assert!(is_hollow(&seen(&ball.points, sensors, &ReconstructParams::default())));
    let none = seen(&ball.points, vec![DVec3::NAN; 20_000], &ReconstructParams::default());
    assert_eq!(none.mesh, plain(&cloud(ball.points)).mesh);
}

#[test]
fn the_same_bytes_for_any_threads_and_surfaces_for_any_order() {
    let ball = hollow_ball(6_000, 0.8);
    let sensors = ball.sensors(3.0);
    let made = |order: &[usize], is_seen: bool, threads: usize| {
        let params = ReconstructParams { threads, ..ReconstructParams::default() };
        let pick = |all: &[DVec3]| order.iter().map(|&i| all[i]).collect::<Vec<_>>();
        if is_seen {
            return seen(&pick(&ball.points), pick(&sensors), &params).mesh;
        }
        let turned = Noisy { points: pick(&ball.points), normals: pick(&ball.normals) };
        run(&turned.cloud(), &params, &Progress::none()).unwrap().mesh
    };
    let order: Vec<usize> = (0..ball.points.len()).collect();
    let mut shuffled = order.clone();
    let mut random = random(3);
    (1..shuffled.len()).for_each(|i| shuffled.swap(i, (random() * (i + 1) as f64) as usize));
    let corners = |mesh: &mesh::TriMesh| {
        let turned = |t: usize| {
            let mut corners = mesh.corners(t).map(|p| p.to_array().map(f64::to_bits));
            let least = (0..3).min_by_key(|&i| corners[i]).unwrap();
            corners.rotate_left(least);
            corners
        };
        let mut all: Vec<_> = (0..mesh.triangles.len()).map(turned).collect();
        all.sort_unstable();
        all
    };
    for is_seen in [false, true] {
        let first = made(&order, is_seen, 1);
        for threads in [2, 3, 8] {
            assert_eq!(made(&order, is_seen, threads), first, "{threads} threads");
        }
        assert_eq!(corners(&made(&shuffled, is_seen, 2)), corners(&first));
    }
}

#[test]
fn normals_that_say_nothing_change_nothing() {
    let ball = hollow_ball(6_000, 0.5);
    let without = plain(&cloud(ball.points.clone())).mesh;
    let mut random = random(11);
    let mut signs = ball.normals.clone();
    signs.iter_mut().filter(|_| random() < 0.5).for_each(|normal| *normal = -*normal);
    for normals in [vec![DVec3::ZERO; 6_000], vec![DVec3::NAN; 6_000], signs] {
        let made = plain(&Noisy { normals, ..ball.clone() }.cloud()).mesh;
        assert_eq!((&made.positions, made.triangles.len()), (&without.positions, without.triangles.len()));
    }
}

#[test]
fn normals_that_look_inwards_turn_the_same_surface() {
    let ball = hollow_ball(20_000, 1.0);
    let outward = plain(&ball.cloud()).mesh;
    let inverted = Noisy { normals: ball.normals.iter().map(|normal| -*normal).collect(), ..ball };
    let inward = plain(&inverted.cloud()).mesh;
    assert_eq!(outward.positions, inward.positions);
    assert_eq!(outward.triangles.len(), inward.triangles.len());
    assert!(volume(&outward) > 0.0 && (volume(&inward) / volume(&outward) + 1.0).abs() < 1e-9);
}

#[test]
fn a_noisy_room_seen_from_its_middle_is_closed() {
    let (mut random, mut gauss) = (random(5), gauss(6));
    let points: Vec<DVec3> = (0..6_000)
        .map(|_| {
            let mut p = DVec3::new(random(), random(), random()) * 2.0 - 1.0;
            let axis = (random() * 3.0) as usize;
            p[axis] = p[axis].signum();
            p + 0.05 * DVec3::new(gauss(), gauss(), gauss())
        })
        .collect();
    let made = seen(&points, vec![DVec3::new(0.1, 0.2, 0.3)], &ReconstructParams::default());
    let report = check(&made.mesh);
    assert!(report.is_closed() && report.genus() == Some(0) && report.components == 1, "{report}");
    assert!((volume(&made.mesh) / -8.0 - 1.0).abs() < 0.1, "{}", volume(&made.mesh));
}

#[test]
fn a_noisy_sheet_seen_from_one_side_stays_open() {
    let (mut random, mut gauss) = (random(5), gauss(6));
    let mut sheet = Noisy { points: Vec::new(), normals: Vec::new() };
    for _ in 0..6_000 {
        let [x, y] = [random(), random()].map(|x| 6.0 * x);
        let noise = 0.08 * DVec3::new(gauss(), gauss(), gauss());
        sheet.points.push(DVec3::new(x, y, x.sin() * y.cos()) + noise);
        sheet.normals.push(DVec3::new(-x.cos() * y.cos(), x.sin() * y.sin(), 1.0).normalize());
    }
    for made in [plain(&sheet.cloud()), seen(&sheet.points, vec![DVec3::Z * 50.0], &ReconstructParams::default())] {
        let report = check(&made.mesh);
        assert!(!made.report.closed && report.components == 1 && report.genus() == Some(0), "{report}");
        let up = |t: usize| {
            let [a, b, c] = made.mesh.corners(t);
            (b - a).cross(c - a).z
        };
        let area: f64 = (0..made.mesh.triangles.len()).map(up).sum::<f64>() / 2.0;
        assert!((30.0..38.0).contains(&area), "{area}");
    }
}

/// Theorem: turning the surface to a place claims nothing of who saw the points: but for the side that is shown it is the surface without.
#[test]
fn turning_to_a_place_only_turns() {
    let (mut random, mut gauss) = (random(8), gauss(9));
    let mut points = Vec::new();
    while points.len() < 4_000 {
        let point = DVec3::new(random(), random(), random()) - 0.5;
        if (0.1..0.5).contains(&point.length()) {
            points.push(point.normalize() + 0.04 * DVec3::new(gauss(), gauss(), gauss()));
        }
    }
    let outward = plain(&cloud(points.clone()));
    let turned = |place: DVec3| {
        let mut made = Reconstructor::new(cloud(points.clone())).unwrap();
        made.turn_toward(place).unwrap();
        made.surface(&ReconstructParams::default(), &Progress::none()).unwrap()
    };
    let inward = turned(DVec3::ZERO);
    assert!(inward.report.smoothing > 0.0 && volume(&outward.mesh) > 0.0 && volume(&inward.mesh) < 0.0);
    assert!(inward.mesh.positions == outward.mesh.positions);
    let sorted = |mesh: &mesh::TriMesh| {
        let mut triangles = mesh.triangles.clone();
        triangles.iter_mut().for_each(|triangle| triangle.sort_unstable());
        triangles.sort_unstable();
        triangles
    };
    assert!(sorted(&inward.mesh) == sorted(&outward.mesh));
    // As sensors there it is another one: all points would lie behind others.
    assert!(
        seen(&points, vec![DVec3::new(3.0, 0.0, 0.0)], &ReconstructParams::default()).mesh.positions
            != outward.mesh.positions
    );
    assert!(sorted(&turned(DVec3::new(3.0, 0.0, 0.0)).mesh) == sorted(&outward.mesh));
    assert!(Reconstructor::new(cloud(points.clone())).unwrap().turn_toward(DVec3::NAN).is_err());
}

/// A state kept of noisy points and their sensors gives the same as one made from scratch, whatever is asked for next.
#[test]
fn kept_noisy_points_follow_the_parameters() {
    let ball = hollow_ball(3000, 0.3);
    let (points, sensors) = (cloud(ball.points.clone()), ball.sensors(3.0));
    let seen = || {
        let mut seen = Reconstructor::new(&points).unwrap();
        seen.seen_from(sensors.clone()).unwrap();
        seen
    };
    let mut kept = seen();
    let asked = [
        (1.0, Closure::Auto, NoisyPoints::Moved),
        (1.7, Closure::Open, NoisyPoints::Moved),
        (1.2, Closure::Closed, NoisyPoints::Moved),
        (1.2, Closure::Closed, NoisyPoints::PutBack),
        (2.0, Closure::Auto, NoisyPoints::AsClean),
        (1.0, Closure::Auto, NoisyPoints::Moved),
    ];
    for (factor, closure, noisy_points) in asked {
        let params = ReconstructParams { factor, closure, noisy_points, ..ReconstructParams::default() };
        let again = kept.surface(&params, &Progress::none()).unwrap();
        assert_eq!(again.mesh, seen().into_surface(&params, &Progress::none()).unwrap().mesh, "{params:?}");
    }
}
