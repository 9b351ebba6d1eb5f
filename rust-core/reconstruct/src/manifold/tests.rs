use glam::DVec3;

use super::*;
use crate::tests::random;
use geom::delaunay3::Delaunay3;

/// Random sides of the cells of random points, every other set on a lattice, repaired.
fn with_sides(seed: u64, look: impl FnOnce(&mut Solid<'_>)) {
    let mut random = random(seed);
    let mut points: Vec<DVec3> = (0..40)
        .map(|_| DVec3::from_array([(); 3].map(|()| 5.0 * random())))
        .map(|point| if seed.is_multiple_of(2) { point } else { point.round() })
        .collect();
    points.sort_unstable_by(|a, b| a.to_array().partial_cmp(&b.to_array()).unwrap());
    points.dedup();
    let progress = Progress::none();
    let delaunay = Delaunay3::in_place(&mut points, 1, &progress).unwrap();
    let complex = Complex { points: &points, cells: delaunay.cells(), finite: delaunay.finite_count() };
    let share = 0.2 + 0.6 * random();
    let sides = (0..complex.len()).map(|cell| u8::from(cell < complex.finite && random() < share)).collect();
    let mut solid = Solid::new(complex, sides);
    solid.repair(&progress).unwrap();
    look(&mut solid);
}

impl Solid<'_> {
    /// Whether the cells inside around a vertex hang together, and those outside too, and there are both.
    fn is_manifold_at(&self, vertex: u32) -> bool {
        let parts = self.parts(vertex, &mut Star::default());
        parts.len() == 2 && self.is_inside(parts[0][0]) != self.is_inside(parts[1][0])
    }
}

#[test]
fn a_cell_gives_way_exactly_where_the_surface_stays_manifold_and_keeps_its_vertices() {
    // By the number of its facets on the surface, and by the answer.
    let mut seen = [[0; 2]; 5];
    for seed in 0..200 {
        with_sides(seed, |solid| {
            let (complex, progress) = (solid.complex, Progress::none());
            let is_on = solid.on_surface(&progress).unwrap();
            let pinched = pinched(&solid.surface(&progress).unwrap(), complex.points.len(), &progress).unwrap();
            for cell in 0..complex.finite as u32 {
                let vertices = complex.vertices(cell);
                let side = solid.is_inside(cell);
                let facets = (0..4).filter(|&slot| solid.is_inside(complex.neighbour(cell, slot)) != side).count();
                if facets == 0 || vertices.iter().any(|vertex| pinched.contains(vertex)) {
                    continue;
                }
                let gives_way = solid.gives_way(cell, |vertex| is_on[vertex as usize]);
                solid.change(cell);
                let stays = vertices.iter().all(|&vertex| solid.is_manifold_at(vertex));
                solid.change_back(cell);
                assert_eq!(gives_way, stays, "seed {seed}, cell {cell} with {facets} facets");
                seen[facets][usize::from(gives_way)] += 1;
            }
        });
    }
    assert!(seen[1].iter().chain(&seen[2]).all(|&count| count > 50) && seen[3][0] > 50, "{seen:?}");
}
