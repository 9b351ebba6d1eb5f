//! Checks of shapes whose answers are known.

use glam::{DVec2, DVec3};
use proptest::prelude::*;

use super::*;
use base::error::Error;
use mesh::shapes::Shape;

fn checked(mesh: &TriMesh) -> PrintReport {
    let params = PrintParams { density: Some(2.0), min_wall: Some(0.5), threads: 1, ..PrintParams::default() };
    check_print(mesh, &params, &Progress::none()).unwrap()
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
    assert!(
        report.topology.is_closed() && report.crossings.is_empty() && report.findings.is_empty(),
        "{:?}",
        report.findings
    );
    assert!((report.volume.unwrap() - 8.0).abs() < 1e-9 && (report.weight.unwrap() - 16.0).abs() < 1e-9);
    assert_eq!((report.parts.len(), report.size), (1, DVec3::new(2.0, 4.0, 1.0)));
    // Behind the middle of its top a ball fits that is as thick as the box; near its edges smaller ones.
    let top: Vec<&Wall> = report.walls.iter().filter(|wall| (wall.ray - 1.0).abs() < 1e-9).collect();
    assert!(top.iter().any(|wall| (wall.ball - 1.0).abs() < 1e-6));
    assert!((report.walls[report.thinnest.unwrap() as usize].thickness - 1.0).abs() < 1e-6);
    assert!(report.walls.iter().all(|wall| wall.ball <= wall.ray + 1e-9 && wall.ball > 0.0));
}

#[test]
fn walls_of_a_hollow_ball_are_as_thick_as_they_are() {
    let outer = Shape::Sphere { radius: 1.0 }.mesh(12);
    let mut inner = Shape::Sphere { radius: 0.8 }.mesh(12);
    inner.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    let report = checked(&both(outer, &inner, DVec3::ZERO));
    assert_eq!(report.parts.len(), 2);
    assert!(report.parts[0].volume > 0.0 && report.parts[1].volume < 0.0);
    assert!(report.walls.iter().all(|wall| (wall.ball - 0.2).abs() < 0.02), "{:?}", report.walls[0]);
    assert!(report.findings.iter().any(|finding| finding.contains("thinner than 0.5")), "{:?}", report.findings);
}

#[test]
fn a_wedge_is_thinner_than_its_rays_say() {
    let [a, b, c] = [DVec3::ZERO, 4.0 * DVec3::X, DVec3::new(4.0, 0.0, 4.0)];
    let mut prism = TriMesh::new([a, b, c].iter().flat_map(|&p| [p, p + 4.0 * DVec3::Y]).collect(), Vec::new());
    prism.triangles = vec![[0, 2, 4], [1, 5, 3], [0, 1, 3], [0, 3, 2], [2, 3, 5], [2, 5, 4], [4, 5, 1], [4, 1, 0]];
    let report = checked(&prism);
    assert!(report.topology.is_closed(), "{}", report.topology);
    assert!(report.walls.iter().any(|wall| wall.thickness < 0.9 * wall.ray));
}

#[test]
fn overhangs_are_told_by_their_angle() {
    // A mushroom: its cap hangs over, its foot stands.
    let foot = cuboid(DVec3::new(0.3, 0.3, 1.0), 1);
    let cap = cuboid(DVec3::new(1.0, 1.0, 0.2), 2);
    let report = checked(&both(foot, &cap, 1.5 * DVec3::Z));
    assert!((report.overhang_area - 4.0).abs() < 1e-9, "{}", report.overhang_area);
    let params = PrintParams { up: crate::UpAxis::MinusZ, threads: 1, ..PrintParams::default() };
    let turned = check_print(&cuboid(DVec3::ONE, 1), &params, &Progress::none()).unwrap();
    assert_eq!(turned.overhang_area, 0.0);
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

#[test]
fn what_is_wrong_is_said_with_what_to_do() {
    let open = checked(&Shape::Plane { half: DVec2::ONE }.mesh(1));
    assert!(open.findings[0].contains("1 opening. Close"), "{:?}", open.findings);
    assert_eq!((open.volume, open.thinnest), (None, None));
    let crossing = checked(&both(cuboid(DVec3::ONE, 1), &cuboid(DVec3::ONE, 1), DVec3::splat(0.5)));
    assert!(crossing.findings.iter().any(|finding| finding.contains("cross")), "{:?}", crossing.findings);
    let mut inside_out = cuboid(DVec3::ONE, 1);
    inside_out.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    assert!(checked(&inside_out).findings.iter().any(|finding| finding.contains("inside out")));
    let empty = checked(&TriMesh::default());
    assert!(empty.parts.is_empty() && empty.thinnest.is_none());
    let params = PrintParams { overhang: 2.0, ..PrintParams::default() };
    assert!(matches!(check_print(&cuboid(DVec3::ONE, 1), &params, &Progress::none()), Err(Error::Parameter { .. })));
    for checks in [0, 3, 6] {
        let cancelled = check_print(&cuboid(DVec3::ONE, 4), &PrintParams::default(), &Progress::cancel_after(checks));
        assert!(matches!(cancelled, Err(Error::Cancelled)), "{checks}");
    }
}
