use glam::{DVec2, DVec3};
use proptest::prelude::*;

mod exact;
mod jumps;
mod open;
mod openings;
mod pinned;
mod rounded;
mod seen;
mod shapes;
mod threads;

use super::*;
use base::error::Error;
use base::progress::Progress;
use geom::delaunay3::Delaunay3;
use mesh::check::CheckReport;
use mesh::point_cloud::PointCloud;
use mesh::{TriMesh, check};
use shapes::{beaker, double_cone, level_set, plate, sphere, torus, waves};

pub(super) fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = state;
        z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ z >> 31) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

pub(super) fn cloud(positions: Vec<DVec3>) -> PointCloud {
    PointCloud { positions, ..PointCloud::default() }
}

fn reconstruct(points: Vec<DVec3>, params: &ReconstructParams) -> (Reconstructed, CheckReport) {
    let made = run(&cloud(points), params, &Progress::none()).unwrap();
    made.mesh.validate().unwrap();
    let report = check(&made.mesh);
    assert_eq!(report.vertices, made.report.used);
    assert_eq!(made.report.used + made.report.dropped.len(), made.report.points);
    (made, report)
}

fn volume(mesh: &TriMesh) -> f64 {
    (0..mesh.triangles.len()).map(|t| mesh.corners(t)).map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
}

#[test]
fn a_sphere() {
    for count in [20, 100, 3000] {
        let (made, report) = reconstruct(sphere(count, DVec3::ONE, 2.0), &ReconstructParams::default());
        assert!(report.is_closed() && report.genus() == Some(0), "{report}");
        assert_eq!((made.report.used, report.components), (count, 1));
        assert!(volume(&made.mesh) > 0.5, "not outward");
    }
}

/// Also where so few samples enclose nothing at once.
#[test]
fn closed_is_what_auto_closes() {
    let closed = ReconstructParams { closure: Closure::Closed, ..Default::default() };
    for count in 4..40 {
        let (made, report) = reconstruct(sphere(count, DVec3::ONE, 2.0), &closed);
        assert!(made.report.closed && report.is_closed() && report.genus() == Some(0), "{count}: {report}");
        assert!(volume(&made.mesh) > 0.0, "{count}: not outward");
    }
}

#[test]
fn a_torus_sampled_at_random() {
    let (made, report) = reconstruct(torus(6000, 3.0, 1.0, 1), &ReconstructParams::default());
    assert!(report.is_closed() && report.genus() == Some(1) && report.components == 1, "{report}");
    assert!(made.report.used >= 5999, "{:?}", made.report);
    let exact = 2.0 * std::f64::consts::PI.powi(2) * 3.0;
    assert!((volume(&made.mesh) / exact - 1.0).abs() < 0.01);
}

#[test]
fn a_double_torus() {
    // x^2 (1 - x^2) = y^2 is an eight; around it a tube.
    let f = |p: DVec3| {
        let eight = p.x * p.x * (1.0 - p.x * p.x) - p.y * p.y;
        (eight * eight + p.z * p.z - 0.01) * 10.0
    };
    let (made, report) = reconstruct(level_set(12_000, 1.3, f, 2), &ReconstructParams::default());
    assert!(report.is_closed() && report.genus() == Some(2), "{report}");
    assert!(made.report.used * 10_000 >= made.report.points * 9_998, "{:?}", made.report);
}

#[test]
fn two_components_and_a_shell() {
    let mut points = sphere(800, DVec3::ZERO, 1.0);
    points.extend(sphere(800, DVec3::X * 3.0, 1.0));
    // The second sphere has a cavity.
    points.extend(sphere(300, DVec3::X * 3.0, 0.5));
    let (made, report) = reconstruct(points, &ReconstructParams::default());
    assert!(report.is_closed() && report.components == 3 && report.genus() == Some(0), "{report}");
    let exact = 4.0 / 3.0 * std::f64::consts::PI * (2.0 - 0.125);
    assert!((volume(&made.mesh) / exact - 1.0).abs() < 0.02, "the cavity is no hole");
}

/// Samples at random of a plate of 4 by 4.
#[test]
fn a_thin_plate() {
    // About 0.08 between samples, 0.25 between the sides.
    let (made, report) = reconstruct(plate(6000, 0.25), &ReconstructParams::default());
    assert!(report.is_closed() && report.genus() == Some(0) && report.components == 1, "{report}");
    assert!(made.report.used >= 5998, "{:?}", made.report);
}

/// A beaker with a round bottom, 1 wide and 2 high, its wall's two sides in rings of `around` samples that are `spacing`
/// apart.
#[test]
fn walls_thinner_than_their_samples_are_apart() {
    let (made, report) = reconstruct(beaker(0.4, 14, 0.2), &ReconstructParams::default());
    assert!(made.report.closed && report.is_closed() && report.genus() == Some(0), "{report}");
    assert_eq!((made.report.used, report.components), (made.report.points, 1));
    // It can't be told any more which side of its wall a sample is of: none but the middle of the bottom is lost for that.
    for wall in [0.05, 0.1] {
        let (made, report) = reconstruct(beaker(wall, 20, 0.2), &ReconstructParams::default());
        assert!(report.is_manifold(), "{report}");
        assert!(made.report.used + 1 >= made.report.points, "{wall}");
    }
}

#[test]
fn a_sheet_with_a_border() {
    let (made, report) = reconstruct(waves(4000), &ReconstructParams::default());
    assert!(report.is_manifold(), "{report}");
    assert!(!made.report.closed && report.components == 1 && report.boundary_loops == 1, "{report}");
    assert!(made.report.used >= 3999, "{:?}", made.report.used);
    let area: f64 = (0..made.mesh.triangles.len())
        .map(|t| made.mesh.corners(t))
        .map(|[a, b, c]| (b - a).cross(c - a).z / 2.0)
        .sum();
    assert!((area / 36.0 - 1.0).abs() < 0.03, "seen from above it covers {area} of 36");
}

/// Costa's minimal surface, sampled far more densely along its rims than beside them: a torus with three ends, which lie
/// on rings above each other.
#[test]
fn costas_surface_keeps_its_three_ends_apart() {
    let Some(data) = std::env::var_os("SURFRECON_DATA") else {
        println!("SKIPPED Costa's surface: SURFRECON_DATA is not set");
        return;
    };
    let text = std::fs::read_to_string(std::path::Path::new(&data).join("points/giaccari_hypersheet.xyz")).unwrap();
    let number = |column: Option<&str>| column.unwrap().parse::<f64>().unwrap();
    let points: Vec<DVec3> = text
        .lines()
        .map(|line| line.split_whitespace())
        .map(|mut line| DVec3::new(number(line.next()), number(line.next()), number(line.next())))
        .collect();
    let (made, report) = reconstruct(points, &ReconstructParams::default());
    assert!(report.is_manifold() && report.components == 1 && !made.report.closed, "{report}");
    assert_eq!((report.genus(), report.boundary_loops, made.report.used), (Some(1), 3, 6752), "{report}");
}

#[test]
fn normals_and_sensors_turn_it() {
    let points = sphere(500, DVec3::ZERO, 1.0);
    let mut inward = cloud(points.clone());
    inward.normals = Some(points.iter().map(|p| (-*p).as_vec3().to_array()).collect());
    inward.colour = Some((0..500).map(|i| [i as u8, 0, 0, 255]).collect());
    let made = run(&inward, &ReconstructParams::default(), &Progress::none()).unwrap();
    assert!(volume(&made.mesh) < 0.0 && made.report.turned_parts == 1, "a room is seen from inside");
    let Some(mesh::AttributeData::Colour(colour)) = made.mesh.vertex_attribute("colour") else { panic!() };
    assert_eq!(colour[77], [77, 0, 0, 255]);
    let mut again = Reconstructor::new(cloud(points)).unwrap();
    assert!(again.seen_from(vec![DVec3::ZERO; 3]).is_err() && again.seen_from(vec![DVec3::NAN]).is_err());
    again.seen_from(vec![DVec3::ZERO]).unwrap();
    let made = again.surface(&ReconstructParams::default(), &Progress::none()).unwrap();
    assert!(volume(&made.mesh) < 0.0, "towards the sensor in the middle");
}

#[test]
fn carving_as_in_the_paper() {
    for threshold in [Threshold::Global, Threshold::Local] {
        let params = ReconstructParams { topology: Topology::Free, threshold, factor: 1.8, ..Default::default() };
        let (made, report) = reconstruct(sphere(2000, DVec3::ZERO, 1.0), &params);
        assert!(report.boundary_edges == 0 && report.genus() == Some(0), "{report}");
        assert!(made.report.used == 2000 && made.report.rounds >= 1, "{:?}", made.report);
    }
}

#[test]
fn a_gap_is_spanned_or_left_open() {
    let points: Vec<DVec3> = sphere(3000, DVec3::ZERO, 1.0).into_iter().filter(|p| p.z < 0.9).collect();
    let open = ReconstructParams { closure: Closure::Open, ..Default::default() };
    let mut made = Reconstructor::new(cloud(points)).unwrap();
    let closed = check(&made.surface(&ReconstructParams::default(), &Progress::none()).unwrap().mesh);
    assert!(closed.is_closed(), "{closed}");
    let made_open = made.surface(&open, &Progress::none()).unwrap();
    assert!(!made_open.report.closed, "it has a gap");
    let open = check(&made_open.mesh);
    assert!(open.is_manifold() && open.boundary_loops == 1 && open.genus() == Some(0), "{open}");
    assert_eq!(check(&made.surface(&ReconstructParams::default(), &Progress::none()).unwrap().mesh), closed);
}

#[test]
fn a_stray_point_stays_out() {
    let mut points = sphere(2000, DVec3::ZERO, 1.0);
    points.push(DVec3::new(0.0, 0.0, 1.5));
    let (made, report) = reconstruct(points, &ReconstructParams::default());
    assert!(report.is_closed());
    assert_eq!(made.report.dropped, [Dropped { point: 2000, reason: Reason::Outside }]);
}

/// A mesh as a set of triangles of places.
pub(super) fn as_set(mesh: &TriMesh) -> Vec<[[u64; 3]; 3]> {
    let mut all: Vec<[[u64; 3]; 3]> = (0..mesh.triangles.len())
        .map(|t| {
            let mut corners = mesh.corners(t).map(|p| p.to_array().map(f64::to_bits));
            let lowest = (0..3).min_by_key(|&i| corners[i]).unwrap();
            corners.rotate_left(lowest);
            corners
        })
        .collect();
    all.sort_unstable();
    all
}

#[test]
fn the_same_for_any_order_and_any_threads() {
    let mut noisy = torus(3000, 3.0, 1.0, 3);
    let mut random = random(9);
    noisy.iter_mut().for_each(|p| *p += DVec3::new(random(), random(), random()) * 0.1);
    let grid: Vec<DVec3> =
        (0..1000).map(|i| DVec3::new((i % 10) as f64, (i / 10 % 10) as f64, (i / 100) as f64)).collect();
    let shell: Vec<DVec3> = grid.into_iter().filter(|p| p.min_element() == 0.0 || p.max_element() == 9.0).collect();
    for points in [noisy, shell, waves(1000)] {
        let params = ReconstructParams { threads: 1, ..Default::default() };
        let (one, _) = reconstruct(points.clone(), &params);
        for threads in [2, 8] {
            let (other, _) = reconstruct(points.clone(), &ReconstructParams { threads, ..params });
            assert!(one.mesh == other.mesh, "{threads} threads");
        }
        let mut shuffled = points;
        for i in (1..shuffled.len()).rev() {
            shuffled.swap(i, (random() * (i + 1) as f64) as usize);
        }
        let (other, _) = reconstruct(shuffled, &params);
        assert!(as_set(&one.mesh) == as_set(&other.mesh), "another order");
    }
}

#[test]
fn a_double_cone_has_a_surface() {
    for around in [1000, 5000, 10_000] {
        for heights in [[1.0, -1.0], [0.5, -0.5], [2.0, -2.0], [1.5, -0.2]] {
            let (made, report) = reconstruct(double_cone(around, heights), &ReconstructParams::default());
            assert!(report.is_manifold() && made.report.used == around + 2, "{around} {heights:?}: {report}");
        }
    }
}

#[test]
fn degenerate_points_give_a_result_or_say_why() {
    let line = |n: usize| (0..n).map(|i| DVec3::new(i as f64, 2.0 * i as f64, 0.5)).collect::<Vec<_>>();
    let circle = |n: usize| {
        (0..n).map(|i| i as f64 / n as f64 * std::f64::consts::TAU).map(|a| DVec3::new(a.cos(), a.sin(), 1.0)).collect()
    };
    let cube = |n: i32| -> Vec<DVec3> {
        (0..n * n * n).map(|i| DVec3::new((i % n).into(), (i / n % n).into(), (i / n / n).into())).collect()
    };
    let mut clusters = sphere(100, DVec3::ZERO, 1.0);
    clusters.extend(sphere(100, DVec3::X * 1e12, 1.0));
    let copies: Vec<DVec3> = sphere(40, DVec3::ZERO, 1.0).into_iter().flat_map(|p| vec![p; 1000]).collect();
    let mut broken = sphere(100, DVec3::ZERO, 1.0);
    broken.extend([DVec3::NAN, DVec3::new(f64::INFINITY, 0.0, 0.0), DVec3::new(0.0, f64::NEG_INFINITY, 1.0)]);
    let cases: Vec<(&str, Vec<DVec3>)> = vec![
        ("empty", vec![]),
        ("one", line(1)),
        ("two", line(2)),
        ("three", vec![DVec3::ZERO, DVec3::X, DVec3::Y]),
        ("four", vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z]),
        ("all equal", vec![DVec3::ONE; 50]),
        ("collinear", line(50)),
        ("coplanar", cube(6).into_iter().map(|p| DVec3::new(p.x, p.y + 0.1 * p.z, 0.0)).collect()),
        ("cocircular", circle(24)),
        ("cospherical", sphere(200, DVec3::ZERO, 1.0)),
        ("grid", cube(5)),
        ("clusters", clusters),
        ("copies", copies),
        ("not finite", broken),
        ("denormals", sphere(100, DVec3::ZERO, 1e-310)),
        ("tiny", sphere(100, DVec3::ZERO, 1e-300)),
        ("huge", sphere(100, DVec3::ZERO, 1e300)),
    ];
    for (name, points) in cases {
        for topology in [Topology::Manifold, Topology::Free] {
            for threshold in [Threshold::Local, Threshold::Global] {
                for closure in [Closure::Auto, Closure::Closed, Closure::Open] {
                    let params = ReconstructParams { topology, threshold, closure, ..Default::default() };
                    let about = format!("{name}, {topology:?}, {threshold:?}, {closure:?}");
                    let refusal = refusal(name, topology, threshold, closure);
                    match run(&cloud(points.clone()), &params, &Progress::none()) {
                        Ok(made) => {
                            assert_eq!(refusal, None, "{about}");
                            made.mesh.validate().unwrap();
                            assert_eq!(made.report.used + made.report.dropped.len(), points.len(), "{about}");
                            let report = check(&made.mesh);
                            assert!(topology == Topology::Free || report.is_manifold(), "{about}: {report}");
                            if BALLS.contains(&name) {
                                assert!(report.is_closed() && report.genus() == Some(0), "{about}: {report}");
                            }
                        }
                        Err(Error::Input(text)) => {
                            assert!(refusal.is_some_and(|part| text.contains(part)), "{about}: {text}")
                        }
                        Err(error) => panic!("{about}: {error}"),
                    }
                }
            }
        }
    }
}

/// Degenerate sets that are the points of a ball.
const BALLS: [&str; 6] = ["cospherical", "copies", "not finite", "denormals", "tiny", "huge"];

/// Reason why there is no surface of a degenerate set, if there is none.
fn refusal(set: &str, topology: Topology, threshold: Threshold, closure: Closure) -> Option<&'static str> {
    let closes = topology == Topology::Manifold && closure == Closure::Closed;
    match set {
        "empty" | "one" | "two" | "all equal" => {
            Some("a surface needs at least 3 different points with finite coordinates, but of")
        }
        "collinear" => Some("the 50 different points lie on one line, which bounds no surface"),
        "three" | "coplanar" | "cocircular" | "clusters" => {
            closes.then_some("lie in one plane, which encloses nothing: let the closure be auto or open")
        }
        "four" | "grid" if topology == Topology::Manifold => None,
        "grid" if threshold == Threshold::Global => None,
        _ => (topology == Topology::Free).then_some("Raise the factor, or let the topology be manifold"),
    }
}

#[test]
fn any_power_of_two_gives_the_same_surface() {
    let points = torus(2_000, 3.0, 1.0, 7);
    for threshold in [Threshold::Local, Threshold::Global] {
        let params = ReconstructParams { threshold, ..ReconstructParams::default() };
        let (plain, _) = reconstruct(points.clone(), &params);
        for exponent in [-1000, -500, -130, 130, 500, 1000] {
            let factor = f64::from(exponent).exp2();
            let (scaled, check) = reconstruct(points.iter().map(|&p| p * factor).collect(), &params);
            assert_eq!(check.genus(), Some(1), "2^{exponent}");
            assert_eq!(scaled.mesh.triangles, plain.mesh.triangles, "2^{exponent}");
            if threshold == Threshold::Global {
                assert_eq!(scaled.report.threshold, plain.report.threshold * factor);
            }
        }
    }
}

#[test]
fn duplicates_and_what_is_not_finite_are_reported() {
    let mut points = sphere(100, DVec3::ZERO, 1.0);
    points.extend([points[7], DVec3::NAN]);
    let (made, _) = reconstruct(points.clone(), &ReconstructParams::default());
    let owned = run_owned(cloud(points), &ReconstructParams::default(), &Progress::none()).unwrap();
    assert_eq!((&owned.mesh, &owned.report.dropped), (&made.mesh, &made.report.dropped));
    let dropped = |point, reason| Dropped { point, reason };
    assert_eq!(made.report.dropped, [dropped(100, Reason::Duplicate), dropped(101, Reason::NotFinite)]);
}

#[test]
fn cancels_at_any_check() {
    let points = cloud(torus(2000, 3.0, 1.0, 4));
    for checks in [0, 1, 2, 5, 20, 60] {
        let outcome = run(&points, &ReconstructParams::default(), &Progress::cancel_after(checks));
        assert!(matches!(outcome, Err(Error::Cancelled)) || checks > 5, "{checks}");
    }
}

#[test]
fn bad_parameters_are_refused() {
    let points = cloud(sphere(20, DVec3::ZERO, 1.0));
    let refused = |params: ReconstructParams| run(&points, &params, &Progress::none()).unwrap_err().to_string();
    let text = refused(ReconstructParams { factor: 0.5, ..Default::default() });
    assert_eq!(text, "factor must be >= 1 and <= 2, got 0.5");
    let mut short = points.clone();
    short.normals = Some(vec![]);
    let text = run(&short, &ReconstructParams::default(), &Progress::none()).unwrap_err().to_string();
    assert_eq!(text, "0 normals for 20 points: give one a point");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: base::tier::cases(64), ..ProptestConfig::default() })]

    /// Any points, also on a lattice with duplicates: the surface is manifold, closed if it says so, and every point is accounted for.
    #[test]
    fn any_points_give_a_manifold_surface(
        points in prop::collection::vec([0..6_i32, 0..6, 0..6], 0..120),
        jitter in prop::bool::ANY,
        closure in prop::sample::select(vec![Closure::Auto, Closure::Closed, Closure::Open]),
    ) {
        let mut random = random(points.len() as u64);
        let points: Vec<DVec3> = points
            .iter()
            .map(|p| DVec3::from(p.map(f64::from)) + if jitter { random() } else { 0.0 })
            .collect();
        let params = ReconstructParams { closure, ..Default::default() };
        match run(&cloud(points.clone()), &params, &Progress::none()) {
            Ok(made) => {
                let report = check(&made.mesh);
                prop_assert!(report.is_manifold(), "{report}");
                prop_assert_eq!(made.report.closed, report.is_closed(), "{}", report);
                prop_assert_eq!(made.report.used + made.report.dropped.len(), points.len());
            }
            Err(Error::Input(_)) => {}
            Err(error) => prop_assert!(false, "{}", error),
        }
    }
}

mod thorough {
    use super::*;

    /// A ring of samples and two on its axis.
    #[test]
    fn the_same_for_any_threads_where_many_insert() {
        let mut random = random(11);
        let noisy: Vec<DVec3> = (0..60_000)
            .map(|_| {
                let (z, angle) = (2.0 * random() - 1.0, random() * std::f64::consts::TAU);
                let outward = (DVec2::from_angle(angle) * (1.0 - z * z).sqrt()).extend(z);
                outward * (1.0 + 0.004 * (2.0 * random() - 1.0))
            })
            .collect();
        // Lattices: as many ties as there can be.
        let faces = (0..6 * 100 * 100).map(|i| {
            let mut at = [(i % 100) as f64, (i / 100 % 100) as f64, if i / 10_000 % 2 == 0 { 0.0 } else { 99.0 }];
            at.rotate_left(i / 20_000);
            DVec3::from(at)
        });
        let sheet = (0..240 * 250).map(|i| {
            let [x, y] = [(i % 240) as f64, (i / 240) as f64];
            DVec3::new(x, y, if i % 240 < 120 { 0.0 } else { x - 120.0 })
        });
        let (shell, sheet): (Vec<DVec3>, Vec<DVec3>) = (faces.collect(), sheet.collect());
        let cells = [1, 2].map(|n| Delaunay3::new(&noisy, n, &Progress::none()).unwrap());
        assert!(cells[0].cells() != cells[1].cells(), "too few points: the cells have the same numbers");
        let by_default = ReconstructParams::default();
        let carved = ReconstructParams { topology: Topology::Free, factor: 1.5, ..by_default };
        let cut = ReconstructParams { closure: Closure::Open, ..by_default };
        for (name, points, params) in [
            ("noisy sphere", &noisy, by_default),
            ("noisy sphere, carved", &noisy, carved),
            ("noisy sphere, cut", &noisy, cut),
            ("shell", &shell, by_default),
            ("shell, carved", &shell, carved),
            ("sheet", &sheet, by_default),
        ] {
            let made = |threads| {
                let (mut made, _) = reconstruct(points.clone(), &ReconstructParams { threads, ..params });
                made.report.seconds.clear();
                made
            };
            let one = made(1);
            for threads in [2, 3] {
                assert!(one == made(threads), "{name}: {threads} threads");
            }
        }
    }
}
