//! The base.

use std::collections::HashMap;

use glam::I64Vec3;
use proptest::prelude::*;

use super::solids::{beside, mapped, relief, reversed, single, voxels};
use super::*;

fn cut_at(mesh: &TriMesh, height: f64, up: UpAxis) -> PreparedPrint {
    let params = PrepareParams {
        flat_base: true,
        base_height: Some(height).filter(|height| *height > 0.0),
        print_up: up,
        ..params()
    };
    let result = prepared(mesh, &params);
    kept(mesh, &result, up);
    result
}

/// Vertices above keep their bits, all others lie on the base or beside it, and the faces of the base are marked.
fn kept(mesh: &TriMesh, result: &PreparedPrint, up: UpAxis) {
    let up = up.direction();
    let bits = |p: DVec3| (p + 0.0).to_array().map(f64::to_bits);
    let height = |p: DVec3| p.dot(up);
    let lowest = mesh.positions.iter().map(|&p| height(p)).fold(f64::INFINITY, f64::min);
    let base = result.mesh.positions.iter().map(|&p| height(p)).fold(f64::INFINITY, f64::min);
    assert!(base - lowest == result.report.base_height.unwrap() || result.report.base_faces == 0);
    let mut count: HashMap<[u64; 3], i64> = HashMap::new();
    mesh.positions.iter().filter(|&&p| height(p) > base).for_each(|&p| *count.entry(bits(p)).or_default() += 1);
    result.mesh.positions.iter().filter(|&&p| height(p) > base).for_each(|&p| *count.entry(bits(p)).or_default() -= 1);
    assert!(count.values().all(|&left| left == 0), "a vertex above the base moved, came or went");
    let Some(AttributeData::Bool(added)) = result.mesh.face_attribute("added") else { panic!("it is marked") };
    for (t, &added) in added.iter().enumerate() {
        let flat = result.mesh.corners(t).iter().all(|&p| height(p) == base);
        assert!(!added || flat);
    }
}

#[test]
fn a_ball_loses_a_cap() {
    let ball = single(&Shape::Sphere { radius: 1.0 }.mesh(40));
    for up in UPS {
        let result = cut_at(&ball, 0.3, up);
        let cap = std::f64::consts::PI * 0.09 * (1.0 - 0.1);
        assert!((result.report.volume_before - result.report.volume - cap).abs() < 0.005, "{:?}", result.report);
        assert!(is_near(result.report.base_height.unwrap(), 0.3, 1e-6));
        assert!((result.report.base_area - std::f64::consts::PI * (1.0 - 0.49)).abs() < 0.01);
        assert!(result.report.notes.is_empty());
    }
}

#[test]
fn a_cuboid_is_cut_exactly() {
    let cuboid = Shape::Cuboid { half: DVec3::new(1.0, 2.0, 4.0) }.mesh(2);
    for (up, side) in UPS.into_iter().zip([8.0, 4.0, 2.0, 8.0, 4.0, 2.0]) {
        // Between vertices, through vertices and faces, and not at all.
        for share in [0.125, 0.25, 0.5, 0.75, 0.0] {
            let result = cut_at(&cuboid, share * side, up);
            assert_eq!(result.report.volume, 64.0 * (1.0 - share));
            assert_eq!(result.report.base_area, 64.0 / side);
            assert_eq!(result.report.base_height, Some(share * side));
        }
    }
}

#[test]
fn rings_and_shells_get_bases_with_holes() {
    let lying = single(&Shape::Torus { major: 2.0, minor: 0.7 }.mesh(20));
    let torus = mapped(&lying, |p| DVec3::new(p.y, p.z, p.x));
    let result = cut_at(&torus, 2.7, UpAxis::Z);
    assert!(is_near(2.0 * result.report.volume, result.report.volume_before, 1e-6));
    assert_eq!(check(&result.mesh).genus(), Some(0));
    let result = cut_at(&lying, 0.7, UpAxis::Z);
    assert!(is_near(2.0 * result.report.volume, result.report.volume_before, 1e-6));
    assert_eq!(check(&result.mesh).genus(), Some(1));
    // A ball in a shell in a shell: a hole with an island that has a hole.
    let at = |radius: f64| single(&Shape::Sphere { radius }.mesh(12));
    let onion = beside(&beside(&at(3.0), &reversed(&at(2.5))), &beside(&at(2.0), &reversed(&at(1.5))));
    let onion = single(&beside(&onion, &at(1.0)));
    let result = cut_at(&onion, 3.0, UpAxis::Y);
    assert!(is_near(2.0 * result.report.volume, result.report.volume_before, 1e-6), "{:?}", result.report);
    assert_eq!(check(&result.mesh).components, 3);
}

/// A ball that stands on its point, or on a face: nothing lies below.
#[test]
fn what_has_nothing_below_stays_and_says_so() {
    let ball = single(&Shape::Sphere { radius: 1.0 }.mesh(4));
    let result = cut_at(&ball, 1e-300, UpAxis::Z);
    assert_eq!(result.mesh.positions, ball.positions);
    assert_eq!(result.report.notes[0].kind, PrepareProblem::NothingBelow);
}

#[test]
fn attributes_are_kept_and_mixed_on_cuts() {
    let mut cuboid = Shape::Cuboid { half: DVec3::ONE }.mesh(1);
    let count = cuboid.positions.len();
    let heights: Vec<f32> = cuboid.positions.iter().map(|p| p.z as f32).collect();
    let is_up = |v: usize| heights[v] > 0.0;
    cuboid.vertex_attributes = vec![
        Attribute::f32("confidence", heights.clone()),
        Attribute::i32("source_scan", (0..count as i32).collect()),
        Attribute::bool("interpolated", (0..count).map(is_up).collect()),
        Attribute::colour("colour", (0..count).map(|v| if is_up(v) { [255; 4] } else { [0, 0, 0, 255] }).collect()),
    ];
    cuboid.face_attributes = vec![Attribute::i32("group", (0..cuboid.triangles.len() as i32).collect())];
    let result = cut_at(&cuboid, 1.5, UpAxis::Z).mesh;
    let Some(AttributeData::F32(confidence)) = result.vertex_attribute("confidence") else { panic!() };
    assert!(result.positions.iter().zip(confidence).all(|(p, &c)| p.z == f64::from(c)));
    let Some(AttributeData::Colour(colours)) = result.vertex_attribute("colour") else { panic!() };
    let on_cut: Vec<usize> = (0..colours.len()).filter(|&v| result.positions[v].z == 0.5).collect();
    assert!(!on_cut.is_empty() && on_cut.iter().all(|&v| colours[v][0] > 128 && colours[v][0] < 255));
    let Some(AttributeData::I32(groups)) = result.face_attribute("group") else { panic!() };
    let Some(AttributeData::Bool(added)) = result.face_attribute("added") else { panic!() };
    for t in 0..groups.len() {
        assert_eq!(groups[t] == -1, added[t]);
        let centre = |mesh: &TriMesh, t: usize| mesh.corners(t).iter().sum::<DVec3>().normalize().abs().round();
        assert!(added[t] || centre(&result, t) == centre(&result, t));
    }
}

/// Cells at random, and a lean along x and y.
fn cells() -> impl Strategy<Value = (Vec<bool>, [i64; 2])> {
    let lean = (-2_i64..3, -2_i64..3).prop_map(|(x, y)| [x, y]);
    (prop::collection::vec(prop::bool::weighted(0.6), 27), lean)
}

/// Whether all was done as it was asked for. Parts of a surface may touch: single precision does not tell them apart.
fn is_done(report: &PrepareReport) -> bool {
    report
        .notes
        .iter()
        .all(|note| note.kind == PrepareProblem::TooFine && note.text.contains("STL joins bodies that touch"))
}

/// Cuts a solid at whole and other heights from both sides.
fn cut_both_ways(solid: &TriMesh, height: f64) -> (PrepareReport, PrepareReport) {
    let heights = || solid.positions.iter().map(|p| p.z);
    let highest = heights().fold(f64::NEG_INFINITY, f64::max) - heights().fold(f64::INFINITY, f64::min);
    assert!(height < highest);
    let above = cut_at(solid, height, UpAxis::Z).report;
    let below = cut_at(solid, highest - height, UpAxis::MinusZ).report;
    assert!((above.volume + below.volume - above.volume_before).abs() < 1e-4);
    // Faces in the plane lie on one side only.
    assert!((above.base_area - below.base_area).abs() < 1e-4 || height.fract() == 0.0);
    assert!(is_done(&above) && is_done(&below), "{:?} {:?}", above.notes, below.notes);
    (above, below)
}

/// A groove of one edge, a pit of one vertex and a floor of two faces touch the plane from above.
#[test]
fn grooves_pits_and_floors_may_end_in_the_plane() {
    let volume = |lowered: &[usize]| {
        let mut heights = [4_i64; 25];
        lowered.iter().for_each(|&i| heights[i] = 2);
        let solid = relief(5, &heights);
        let (above, below) = cut_both_ways(&solid, 2.0);
        assert_eq!(
            (below.volume, below.base_area, above.base_area),
            (128.0, 64.0 - if lowered.len() > 2 { above.base_area - 64.0 } else { 0.0 }, 64.0)
        );
        above.volume
    };
    assert_eq!(volume(&[12]), 128.0 - 8.0);
    assert!(volume(&[12, 13]) < 120.0);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(base::tier::cases(200)))]

    /// Planes through faces, edges and vertices, at which cells meet in all ways, and planes between them.
    #[test]
    fn cells_are_cut_exactly((cells, lean) in cells(), halves in 1_i64..12, up in 0_usize..6) {
        let is_inside = |c: I64Vec3| {
            c.min_element() >= 0 && c.max_element() < 3 && cells[(c.x + 3 * (c.y + 3 * c.z)) as usize]
        };
        prop_assume!(cells.contains(&true));
        let solid = voxels([3, 3, 3], is_inside);
        sound(&solid);
        let height = halves as f64 / 2.0;
        let up = UPS[up];
        let toward = up.direction();
        let extent = |solid: &TriMesh, toward: DVec3| {
            let along = solid.positions.iter().map(|p| p.dot(toward));
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), x| (lo.min(x), hi.max(x)))
        };
        let (lowest, highest) = extent(&solid, toward);
        if lowest + height < highest {
            let result = cut_at(&solid, height, up);
            let above = |c: I64Vec3| {
                let top = (2.0 * c.as_dvec3() + 1.0).dot(toward) + 1.0 - lowest - height;
                4.0 * top.clamp(0.0, 2.0)
            };
            let all = (0..27).map(|i| I64Vec3::new(i % 3, i / 3 % 3, i / 9)).filter(|&c| is_inside(c));
            prop_assert_eq!(result.report.volume, all.map(above).sum::<f64>());
            prop_assert!(is_done(&result.report), "{:?}", result.report.notes);
        }
        // Leaning, each plane hits vertices, edges and slanted faces at once.
        let leaning = mapped(&solid, |p| DVec3::new(p.x, p.y, p.z + lean[0] as f64 * p.x + lean[1] as f64 * p.y));
        let (lowest, highest) = extent(&leaning, DVec3::Z);
        if lowest + height < highest {
            cut_both_ways(&leaning, height);
        }
    }

    /// Planes through many vertices of few heights: grooves, ridges, pits, peaks, plateaus and floors in the plane.
    #[test]
    fn reliefs_are_cut_at_their_vertices(heights in prop::collection::vec(1_i64..4, 36), at in 1_i64..6) {
        let solid = relief(6, &heights);
        sound(&solid);
        let height = at as f64 / 2.0;
        prop_assume!(heights.iter().any(|&other| other as f64 > height));
        cut_both_ways(&solid, height);
    }

    #[test]
    fn bumps_are_cut_at_any_height(share in 0.01..0.99_f64, up in 0_usize..3, tilt in -1.0..1.0_f64) {
        let turn = glam::DQuat::from_rotation_y(tilt) * glam::DQuat::from_rotation_x(2.0 * tilt);
        let solid = single(&mapped(&bumpy(8), |p| turn * p));
        let size = solid.positions.iter().map(|p| p.dot(UPS[up].direction()));
        let (lo, hi) = size.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), x| (lo.min(x), hi.max(x)));
        let above = cut_at(&solid, share * (hi - lo), UPS[up]).report;
        let below = cut_at(&solid, (1.0 - share) * (hi - lo), UPS[up + 3]).report;
        prop_assert!((above.volume + below.volume - above.volume_before).abs() < 1e-5);
        prop_assert!(above.notes.is_empty());
    }
}
