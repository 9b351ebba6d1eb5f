//! Checks of shapes whose answers are known.

use glam::{DVec2, DVec3};
use proptest::prelude::*;

use super::*;
use crate::params::UpAxis;
use base::error::Error;
use geom::bvh::Closest;
use mesh::AttributeData;
use mesh::shapes::Shape;

fn checked(mesh: &TriMesh) -> PrintReport {
    let (density, min_wall, max_wall) = (Some(2.0), Some(0.5), Some(100.0));
    let params = PrintParams { density, min_wall, max_wall, threads: 1, ..PrintParams::default() };
    check_print(mesh, &params, &Progress::none()).unwrap().report
}

fn kinds(report: &PrintReport) -> Vec<Fault> {
    report.findings.iter().map(|finding| finding.kind).collect()
}

/// All but overhangs.
fn standing(report: &PrintReport) -> Vec<Fault> {
    kinds(report).into_iter().filter(|kind| *kind != Fault::Overhang).collect()
}

fn cuboid(half: DVec3, detail: usize) -> TriMesh {
    Shape::Cuboid { half }.mesh(detail)
}

fn both(mut a: TriMesh, b: &TriMesh, shift: DVec3) -> TriMesh {
    let first = a.positions.len() as u32;
    a.positions.extend(b.positions.iter().map(|p| *p + shift));
    a.triangles.extend(b.triangles.iter().map(|t| t.map(|v| v + first)));
    a
}

#[test]
fn a_box_is_printable() {
    let report = checked(&cuboid(DVec3::new(1.0, 2.0, 0.5), 4));
    assert!(report.is_closed && report.crossings.is_empty() && report.findings.is_empty(), "{:?}", report.findings);
    assert!((report.volume.unwrap() - 8.0).abs() < 1e-9 && (report.weight.unwrap() - 16.0).abs() < 1e-9);
    assert_eq!((report.bodies, report.body_list.len(), report.size), (1, 1, [2.0, 4.0, 1.0]));
    // Behind the middle of its top a ball fits that is as thick as the box; near its edges smaller ones.
    let top: Vec<&Wall> = report.walls.iter().filter(|wall| (wall.ray - 1.0).abs() < 1e-9).collect();
    assert!(top.iter().any(|wall| (wall.ball - 1.0).abs() < 1e-6));
    let thinnest = report.thinnest_wall.unwrap();
    assert!((thinnest - 1.0).abs() < 1e-6 && report.walls[report.thinnest_face.unwrap()].thickness == thinnest);
    assert!(report.walls.iter().all(|wall| wall.ball <= wall.ray + 1e-9 && wall.ball > 0.0));
}

#[test]
fn walls_of_a_hollow_ball_are_as_thick_as_they_are() {
    let outer = Shape::Sphere { radius: 1.0 }.mesh(12);
    let mut inner = Shape::Sphere { radius: 0.8 }.mesh(12);
    inner.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    let report = checked(&both(outer, &inner, DVec3::ZERO));
    assert_eq!(report.bodies, 2);
    assert!(report.body_list[0].volume > 0.0 && report.body_list[1].volume < 0.0);
    assert_eq!(standing(&report), [Fault::Thin], "a cavity is right to be inside out");
    assert!(report.walls.iter().all(|wall| (wall.ball - 0.2).abs() < 0.02), "{:?}", report.walls[0]);
    let thin = report.findings.iter().find(|finding| finding.kind == Fault::Thin).unwrap();
    assert!(thin.text.contains("thinner than 0.5: ") && thin.text.ends_with("print it larger."), "{thin:?}");
    assert_eq!(report.thin_faces, report.walls.len());
}

#[test]
fn walls_are_measured_up_to_a_limit() {
    // 0.4 thick, its box 3.0 long from corner to corner.
    let plate = cuboid(DVec3::new(1.0, 1.0, 0.2), 3);
    let report = |min_wall, max_wall| {
        let params = PrintParams { min_wall, max_wall, threads: 1, ..PrintParams::default() };
        check_print(&plate, &params, &Progress::none()).unwrap().report
    };
    let [unknown, known] = [report(None, None), report(None, Some(0.5))];
    let diagonal = DVec3::new(2.0, 2.0, 0.4).length();
    assert_eq!((unknown.wall_limit, known.wall_limit), (0.1 * diagonal, 0.5));
    assert_eq!((unknown.thinnest_wall, unknown.thinnest_face), (None, None));
    assert!(unknown.walls.iter().all(|wall| wall.thickness == unknown.wall_limit && wall.ray > 0.39));
    assert!((known.thinnest_wall.unwrap() - 0.4).abs() < 1e-9);
    // A limit below the thinnest wall that is printed would hide walls that are too thin.
    let judged = report(Some(0.45), Some(0.1));
    assert!(judged.wall_limit == 0.45 && judged.thinnest_wall == known.thinnest_wall && judged.thin_faces > 0);
}

#[test]
fn a_wedge_is_thinner_than_its_rays_say() {
    let [a, b, c] = [DVec3::ZERO, 4.0 * DVec3::X, DVec3::new(4.0, 0.0, 4.0)];
    let mut prism = TriMesh::new([a, b, c].iter().flat_map(|&p| [p, p + 4.0 * DVec3::Y]).collect(), Vec::new());
    prism.triangles = vec![[0, 2, 4], [1, 5, 3], [0, 1, 3], [0, 3, 2], [2, 3, 5], [2, 5, 4], [4, 5, 1], [4, 1, 0]];
    let report = checked(&prism);
    assert!(report.is_closed, "{}", report.topology);
    assert!(report.walls.iter().any(|wall| wall.thickness < 0.9 * wall.ray));
}

#[test]
fn overhangs_are_told_by_their_angle() {
    // A mushroom: its cap hangs over, its foot stands.
    let foot = cuboid(DVec3::new(0.3, 0.3, 1.0), 1);
    let cap = cuboid(DVec3::new(1.0, 1.0, 0.2), 2);
    let report = checked(&both(foot, &cap, 1.5 * DVec3::Z));
    assert!((report.overhang_area - 4.0).abs() < 1e-9, "{}", report.overhang_area);
    let params = PrintParams { print_up: UpAxis::MinusZ, threads: 1, ..PrintParams::default() };
    let turned = check_print(&cuboid(DVec3::ONE, 1), &params, &Progress::none()).unwrap();
    assert_eq!((turned.report.overhang_area, turned.report.overhang_faces), (0.0, 0));
    assert!(turned.report.overhang_area.is_sign_positive(), "-0 reads like an error");
    // A roof of 40 degrees to the vertical is no overhang of more than 45.
    let lean = |angle: f64| {
        let mut leaning = cuboid(DVec3::ONE, 1);
        leaning.positions.iter_mut().for_each(|p| p.x += angle.tan() * p.z);
        checked(&leaning).overhang_area
    };
    assert_eq!(lean(40_f64.to_radians()), 0.0);
    assert!(lean(50_f64.to_radians()) > 4.0);
}

#[test]
fn crossings_of_degenerate_pairs_are_exact() {
    let pairs = |t: [[[f64; 3]; 3]; 2]| {
        let positions: Vec<DVec3> = t.iter().flatten().map(|&p| DVec3::from(p)).collect();
        checked(&TriMesh::new(positions, vec![[0, 1, 2], [3, 4, 5]])).crossings.len()
    };
    let base = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
    // In one plane: overlapping, beside each other, over a shared edge, folded onto each other.
    assert_eq!(pairs([base, [[1.0, 1.0, 0.0], [5.0, 1.0, 0.0], [1.0, 5.0, 0.0]]]), 1);
    assert_eq!(pairs([base, [[5.0, 0.0, 0.0], [9.0, 0.0, 0.0], [5.0, 4.0, 0.0]]]), 0);
    assert_eq!(pairs([base, [[4.0, 0.0, 0.0], [4.0, 4.0, 0.0], [0.0, 4.0, 0.0]]]), 0);
    assert_eq!(pairs([base, [[4.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 4.0, 0.0]]]), 1);
    // A shared vertex: apart, and through the other.
    assert_eq!(pairs([base, [[0.0, 0.0, 0.0], [-4.0, 0.0, 1.0], [0.0, -4.0, 1.0]]]), 0);
    assert_eq!(pairs([base, [[0.0, 0.0, 0.0], [2.0, 2.0, 1.0], [2.0, 1.0, -1.0]]]), 1);
    // A sliver that the other's plane just misses, or just touches.
    let tiny = f64::MIN_POSITIVE;
    assert_eq!(pairs([base, [[1.0, 1.0, tiny], [2.0, 1.0, tiny], [1.5, 1.0, 1.0]]]), 0);
    assert_eq!(pairs([base, [[1.0, 1.0, 0.0], [2.0, 1.0, 1.0], [1.5, 1.0, 1.0]]]), 1);
    // Without area it crosses nothing.
    assert_eq!(pairs([base, [[1.0, 1.0, -1.0], [1.0, 1.0, 0.0], [1.0, 1.0, 1.0]]]), 0);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: base::tier::cases(48), ..ProptestConfig::default() })]

    /// The tree finds what comparing all with all finds.
    #[test]
    fn crossings_are_those_of_all_pairs(places in prop::collection::vec([0..6_i32, 0..6, 0..6], 12..60)) {
        let positions: Vec<DVec3> = places.iter().map(|p| DVec3::from(p.map(f64::from))).collect();
        let count = positions.len() as u32;
        let triangles: Vec<[u32; 3]> = (0..count - 2).map(|i| [i, i + 1, (7 * i + 5) % count]).filter(|t| t[0] != t[2] && t[1] != t[2]).collect();
        let corners = |t: u32| triangles[t as usize].map(|v| positions[v as usize]);
        let n = triangles.len() as u32;
        let all: Vec<[u32; 2]> = (0..n)
            .flat_map(|i| (i + 1..n).map(move |j| [i, j]))
            .filter(|&[i, j]| geom::triangles::cross(corners(i), corners(j)))
            .collect();
        prop_assert_eq!(crossing::pairs(&positions, &triangles, |_| true, &Progress::none()).unwrap(), all.clone());
        let asked = |t: usize| t.is_multiple_of(3);
        let some: Vec<[u32; 2]> = all.into_iter().filter(|pair| pair.iter().any(|&t| asked(t as usize))).collect();
        prop_assert_eq!(crossing::pairs(&positions, &triangles, asked, &Progress::none()).unwrap(), some);
    }
}

/// Distance along a ray to a triangle, by Cramer's rule.
fn met(origin: DVec3, direction: DVec3, [a, b, c]: [DVec3; 3]) -> Option<f64> {
    let (ab, ac, ao) = (b - a, c - a, origin - a);
    let whole = -direction.dot(ab.cross(ac));
    let (u, v) = (-direction.dot(ao.cross(ac)) / whole, -direction.dot(ab.cross(ao)) / whole);
    let t = ao.dot(ab.cross(ac)) / whole;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then_some(t).filter(|t| *t > 1e-9)
}

/// Radius of the largest ball that touches `centre`, has its middle against `normal` and is not entered by a triangle, at most `most`.
fn largest_ball(centre: DVec3, normal: DVec3, corners: &[DVec3; 3], most: f64) -> f64 {
    let mut radius = most;
    for _ in 0..1000 {
        let middle = centre - radius * normal;
        let nearest = Closest::on_triangle(middle, corners, 0);
        let way = centre - nearest.point;
        if nearest.distance() >= radius * (1.0 - 1e-12) - 1e-13 || way.dot(normal) <= 0.0 {
            break;
        }
        radius = radius.min(0.5 * way.length_squared() / way.dot(normal));
    }
    radius
}

proptest! {
    #![proptest_config(ProptestConfig { cases: base::tier::cases(256), ..ProptestConfig::default() })]

    /// Rays are those that trying each face in turn finds. Balls are no smaller than those, and no face is far inside them.
    #[test]
    fn walls_are_those_of_all_faces(
        flat in 0.05..1.0_f64,
        detail in 2..5_usize,
        rough in prop_oneof![Just(0.0), 0.0..0.05_f64, 0.0..0.4_f64],
        noise in prop::collection::vec([-1.0..1.0_f64, -1.0..1.0, -1.0..1.0], 200),
        round in prop::bool::ANY,
        limit in prop_oneof![Just(100.0), 0.05..2.0_f64],
    ) {
        let shape = if round { Shape::Sphere { radius: 1.0 } } else { Shape::Cuboid { half: DVec3::new(1.0, 0.7, 0.4) } };
        let mut mesh = shape.mesh(detail);
        for (p, noise) in mesh.positions.iter_mut().zip(noise.iter().cycle()) {
            *p += rough * DVec3::from(*noise);
            p.z *= flat;
        }
        let params = PrintParams { max_wall: Some(limit), threads: 1, ..PrintParams::default() };
        let report = check_print(&mesh, &params, &Progress::none()).unwrap().report;
        let faces = || (0..mesh.triangles.len()).map(|t| mesh.corners(t));
        for (t, wall) in report.walls.iter().enumerate() {
            let corners = mesh.corners(t);
            let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
            let ray = faces().filter_map(|other| met(centre, -normal, other)).fold(f64::INFINITY, f64::min);
            prop_assert!(wall.ray == ray || (wall.ray - ray).abs() < 1e-9, "{} {}", wall.ray, ray);
            if ray == f64::INFINITY {
                prop_assert_eq!(wall.ball, ray);
                continue;
            }
            let radius = 0.5 * wall.ball;
            // The face itself is met at rounding's distance.
            let others = faces().enumerate().filter(|(other, _)| *other != t);
            let largest = others.fold(0.5 * ray.min(limit), |most, (_, other)| largest_ball(centre, normal, &other, most));
            prop_assert!(radius >= largest - 1e-9, "{} {}", radius, largest);
            prop_assert!(wall.thickness == wall.ball || wall.thickness == wall.ray.min(limit));
            let middle = centre - radius * normal;
            let room = faces().map(|other| Closest::on_triangle(middle, &other, 0).distance()).fold(f64::INFINITY, f64::min);
            prop_assert!(room >= radius * (1.0 - walls::END) - 1e-9, "{} {}", room, radius);
        }
    }
}

#[test]
fn walls_of_round_bodies_are_the_same_for_any_thread_count() {
    for shape in [Shape::Torus { major: 1.0, minor: 0.3 }, Shape::Cylinder { radius: 1.0, half_height: 1.0 }] {
        let mesh = shape.mesh(16);
        let walls = [1, 2, 7].map(|threads| {
            let params = PrintParams { threads, max_wall: Some(100.0), ..PrintParams::default() };
            check_print(&mesh, &params, &Progress::none()).unwrap().report.walls
        });
        assert!(walls[0].len() > 2048, "several chunks: {}", walls[0].len());
        assert!(walls[0] == walls[1] && walls[0] == walls[2]);
    }
}

#[test]
fn faults_are_told_with_what_to_do() {
    let open = checked(&Shape::Plane { half: DVec2::ONE }.mesh(1));
    assert_eq!(open.findings[0].kind, Fault::Open);
    assert_eq!(open.findings[0].text, "Openings of the mesh: 1. Close them.");
    assert_eq!((open.volume, open.weight, open.thinnest_wall, open.thinnest_face), (None, None, None, None));
    let crossing = checked(&both(cuboid(DVec3::ONE, 1), &cuboid(DVec3::ONE, 1), DVec3::splat(0.5)));
    assert!(kinds(&crossing).contains(&Fault::Crossing) && crossing.crossing_pairs == crossing.crossings.len());
    assert!(!kinds(&crossing).contains(&Fault::SeveralBodies), "they hang together");
    let [one, other] = crossing.crossings[0];
    let text = &crossing.findings.iter().find(|finding| finding.kind == Fault::Crossing).unwrap().text;
    assert!(text.contains(&format!(". The first are {one} and {other}, at (")), "{text}");
    let mut twice = cuboid(DVec3::ONE, 1);
    twice.triangles.push(twice.triangles[0]);
    let report = checked(&twice);
    assert_eq!(kinds(&report)[0], Fault::NotManifold);
    let first = *twice.triangles[0].iter().min().unwrap() as usize;
    let [x, y, z] = twice.positions[first].to_array();
    let text = &report.findings[0].text;
    assert!(text.contains(&format!(". The first is at ({x}, {y}, {z}). ")), "{text}");
    let empty = check_print(&TriMesh::default(), &PrintParams::default(), &Progress::none()).unwrap_err().to_string();
    assert_eq!(empty, "the mesh has no triangles, but must have some: give a surface");
    let mut flat = cuboid(DVec3::ONE, 1);
    flat.positions.iter_mut().for_each(|p| p.z = 0.0);
    assert!(kinds(&checked(&flat)).contains(&Fault::NoVolume));
    let mut unused = cuboid(DVec3::ONE, 1);
    unused.positions.push(DVec3::splat(100.0));
    assert_eq!(checked(&unused).size, checked(&cuboid(DVec3::ONE, 1)).size);
    let params = PrintParams { overhang: 2.0, ..PrintParams::default() };
    assert!(matches!(check_print(&cuboid(DVec3::ONE, 1), &params, &Progress::none()), Err(Error::Parameter { .. })));
    for checks in [0, 3, 6] {
        let cancelled = check_print(&cuboid(DVec3::ONE, 4), &PrintParams::default(), &Progress::cancel_after(checks));
        assert!(matches!(cancelled, Err(Error::Cancelled)), "{checks}");
    }
}

#[test]
fn each_body_is_judged_on_its_own() {
    let turned = |mut mesh: TriMesh| {
        mesh.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        mesh
    };
    let of = |half: f64| cuboid(DVec3::splat(half), 1);
    let text = |report: &PrintReport, kind: Fault| {
        let found = report.findings.iter().find(|finding| finding.kind == kind);
        found.map(|finding| finding.text.clone()).unwrap_or_default()
    };
    let lone = checked(&turned(of(1.0)));
    assert!(text(&lone, Fault::InsideOut).starts_with("Bodies that are inside out: 1. The first is at ("));
    // The small one is outweighed by the large one.
    let beside = checked(&both(of(3.0), &turned(of(1.0)), DVec3::splat(9.0)));
    assert_eq!(standing(&beside), [Fault::InsideOut]);
    assert!(beside.volume.unwrap() > 0.0);
    assert_eq!(standing(&checked(&both(of(3.0), &turned(of(1.0)), DVec3::ZERO))), []);
    let nested = checked(&both(of(3.0), &of(1.0), DVec3::ZERO));
    assert_eq!(standing(&nested), [Fault::Nested]);
    let several = checked(&both(of(1.0), &of(0.5), 9.0 * DVec3::X));
    assert_eq!(standing(&several), [Fault::SeveralBodies]);
    let said = text(&several, Fault::SeveralBodies);
    let start = "Bodies that hang together nowhere: 2. The smallest has a volume of 1, at (";
    assert!(said.starts_with(start) && said.ends_with("Remove those that are not to be printed."), "{said}");
}

#[test]
fn it_fits_as_it_is_or_turned_about_the_vertical() {
    // 2 by 4 by 1.
    let mesh = cuboid(DVec3::new(1.0, 2.0, 0.5), 1);
    let report = |size: [f64; 3], print_up| {
        let [printer_width, printer_depth, printer_height] = size.map(|x| (x > 0.0).then_some(x));
        let params = PrintParams {
            printer_width,
            printer_depth,
            printer_height,
            print_up,
            threads: 1,
            ..PrintParams::default()
        };
        check_print(&mesh, &params, &Progress::none()).unwrap().report
    };
    let fits = |size, up| report(size, up).is_fitting;
    assert!(fits([0.0; 3], UpAxis::Z) && fits([2.0, 4.0, 1.0], UpAxis::Z) && fits([4.0, 2.0, 1.0], UpAxis::MinusZ));
    assert!(!fits([3.0, 3.0, 3.0], UpAxis::Z) && !fits([4.0, 2.0, 0.9], UpAxis::Z));
    assert!(fits([1.0, 2.0, 4.0], UpAxis::Y) && !fits([1.0, 2.0, 4.0], UpAxis::X) && fits([1.0, 4.0, 2.0], UpAxis::X));
    // A length that is not given sets no limit.
    assert!(fits([0.0, 2.0, 0.0], UpAxis::Z) && !fits([0.0, 1.9, 0.0], UpAxis::Z));
    let said = |size: [f64; 3]| {
        let report = report(size, UpAxis::Z);
        assert!(kinds(&report).iter().all(|kind| *kind == Fault::TooLarge) && !report.is_fitting);
        let texts = report.findings.into_iter().map(|finding| finding.text);
        let short = texts.map(|text| {
            let text = text.strip_prefix("The mesh is 2 x 4 x 1: too large for the printer's ").unwrap();
            text.strip_suffix(". Scale it, or cut it into parts.").unwrap().to_owned()
        });
        short.collect::<Vec<_>>()
    };
    assert_eq!(said([3.0, 3.0, 0.0]), ["width and depth of 3 x 3"]);
    assert_eq!(said([1.5, 0.0, 0.5]), ["width of 1.5", "height of 0.5"]);
    assert_eq!(said([0.0, 1.9, 0.0]), ["depth of 1.9"]);
}

#[test]
fn faces_are_marked() {
    let mut mesh = both(cuboid(DVec3::ONE, 1), &cuboid(DVec3::ONE, 1), DVec3::new(0.5, 0.5, 0.5));
    mesh.positions.extend([DVec3::new(9.0, 0.0, 0.0), DVec3::new(10.0, 0.0, 0.0), DVec3::new(9.0, 1.0, 0.0)]);
    let first = mesh.positions.len() as u32 - 3;
    mesh.triangles.push([first, first + 1, first + 2]);
    mesh.face_attributes = vec![Attribute::f32("wall", vec![7.0; mesh.triangles.len()])];
    let Checked { mesh: marked, report } = check_print(&mesh, &PrintParams::default(), &Progress::none()).unwrap();
    assert_eq!((&marked.positions, &marked.triangles), (&mesh.positions, &mesh.triangles));
    assert_eq!(marked.face_attributes.len(), 3);
    let (Some(AttributeData::F32(wall)), Some(AttributeData::Bool(crossing)), Some(AttributeData::Bool(overhang))) =
        (marked.face_attribute("wall"), marked.face_attribute("crossing"), marked.face_attribute("overhang"))
    else {
        panic!("{:?}", marked.face_attributes);
    };
    // Nothing lies behind the lone face.
    let limit = report.wall_limit as f32;
    assert_eq!(*wall.last().unwrap(), limit);
    assert!(wall.iter().all(|wall| *wall > 0.0 && *wall <= limit) && wall.iter().any(|wall| *wall < limit));
    assert!(wall.iter().zip(&report.walls).all(|(wall, known)| *wall == limit || *wall == known.thickness as f32));
    let marks = |flags: &[bool]| flags.iter().filter(|flag| **flag).count();
    assert_eq!((marks(crossing), marks(overhang)), (report.crossing_faces, report.overhang_faces));
    assert!(report.crossings.iter().flatten().all(|&t| crossing[t as usize]) && report.crossing_faces > 0);
    assert!(!crossing.last().unwrap());
}
