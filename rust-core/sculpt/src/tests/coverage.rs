//! Places where the mesh may be, and places where there is none of it.

use super::*;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(base::tier::cases(160)))]

    #[test]
    fn half_cells_are_those_of_the_triangles(
        scene in scenes(), narrow in prop_oneof![Just(45_usize), Just(2), Just(3)], kind in 0..32_usize,
    ) {
        let scene = Scene { cols: scene.cols.min(narrow), ..scene };
        let domain = Domain::new(&seen(&scene, kind), &TriangulateParams::default(), &Progress::none()).unwrap();
        let (rows, cols) = (i64::from(domain.rows), i64::from(domain.cols));
        for row in 0..rows {
            for col in 0..cols {
                let corners = [[row, col], [row, col + 1], [row + 1, col + 1], [row + 1, col]];
                let mut halves = 0;
                for triangle in &domain.triangles {
                    let places = triangle.map(|p| [i64::from(p) / cols, i64::from(p) % cols]);
                    if places.iter().all(|place| corners.contains(place)) {
                        let missing = corners.iter().position(|corner| !places.contains(corner));
                        halves |= 1 << missing.unwrap();
                    }
                }
                prop_assert_eq!(domain.halves(row, col), halves);
            }
        }
        let mut pixels: Vec<u32> = domain.triangles.iter().flatten().copied().collect();
        pixels.sort_unstable();
        pixels.dedup();
        prop_assert_eq!(&domain.pixels, &pixels);
    }
}

#[test]
fn nothing_to_mesh_is_an_error() {
    let said = |image: &RangeImage| {
        let none = &Progress::none();
        let at_once = run(image, &SculptParams::default(), none).unwrap_err().to_string();
        let first = Sculptor::prepare(image, &SculptParams::default(), none).err().unwrap().to_string();
        assert_eq!(at_once, first);
        at_once
    };
    for (rows, cols) in [(0, 0), (0, 7), (1, 1), (1, 9), (9, 1), (5, 5)] {
        let image = flat(rows, cols, |_, _| if rows == 5 { f64::NAN } else { 1.0 });
        let text = said(&image);
        assert!(
            text.contains("no triangle comes of its") && text.contains("A triangle needs three neighbouring pixels"),
            "{text}"
        );
    }
    let text = said(&flat(5, 5, |r, c| 1e300 * (1.0 + r + c)));
    assert!(text.contains("Use a larger unit") && !text.contains("no triangle"), "{text}");
}

#[test]
fn where_the_domain_touches_itself_vertices_are_split() {
    // Two half cells that share the pixel (1, 0).
    let image = flat(3, 2, |r, c| if (r, c) == (1.0, 1.0) { f64::NAN } else { 1.0 });
    let sculpted = sculpt(&image, &absolute(0.1));
    assert_eq!(sculpted.mesh.positions.len(), 6);
    assert_eq!(sculpted.mesh.triangles.len(), 2);
    assert_eq!(sculpted.mesh.positions.iter().filter(|p| **p == DVec3::new(0.0, -1.0, 1.0)).count(), 2);
}
