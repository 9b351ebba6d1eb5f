use glam::DVec3;

use super::*;
use crate::tests::random;
use geom::delaunay3::Delaunay3;

/// At random over a sphere, with noise along the radius.
fn sphere(count: usize, noise: f64, seed: u64) -> Vec<DVec3> {
    let mut random = random(seed);
    (0..count)
        .map(|_| {
            let (z, turn) = (2.0 * random() - 1.0, std::f64::consts::TAU * random());
            let around = (1.0 - z * z).sqrt();
            let offs = (0..6).map(|_| random() - 0.5).sum::<f64>() * std::f64::consts::SQRT_2;
            DVec3::new(around * turn.cos(), around * turn.sin(), z) * (1.0 + noise * offs)
        })
        .collect()
}

fn with_complex<T>(points: &mut [DVec3], threads: usize, look: impl FnOnce(Complex<'_>) -> T) -> T {
    let delaunay = Delaunay3::in_place(points, threads, &Progress::none()).unwrap();
    look(Complex { points, cells: delaunay.cells(), finite: delaunay.finite_count() })
}

/// Cost of a cut of the cells, and of the smallest, found by one way after another.
#[test]
fn cuts_cost_what_the_largest_flow_of_single_ways_does() {
    for seed in 0..4 {
        with_complex(&mut sphere(300, 0.05, seed), 1, |complex| {
            let progress = Progress::none();
            let Problem { rooms, nodes, network, .. } =
                problem(complex, &Fronts::default(), &progress).unwrap().unwrap();
            let largest = largest_flow(&network);
            let sides = network.clone().cut(&progress).unwrap();
            assert!(largest > 0 && nodes.iter().any(|&node| node != u32::MAX), "nothing to cut");
            assert_eq!((sides.value, network.price(&sides.is_source)), (largest, largest));
            assert!(rooms.has_inside());
        });
    }
}

/// By the plainest method: any way with capacity left, until there is none.
fn largest_flow(network: &Network) -> i64 {
    let (terminals, edges) = (network.terminals(), network.edges());
    let count = terminals.len();
    let (source, sink) = (count, count + 1);
    let mut arcs: Vec<(usize, usize, i64)> = Vec::new();
    for (node, &terminal) in terminals.iter().enumerate() {
        let ends = if terminal > 0 { (source, node) } else { (node, sink) };
        arcs.extend([(ends.0, ends.1, terminal.abs()), (ends.1, ends.0, 0)]);
    }
    for (nodes, capacities) in edges {
        let [a, b] = nodes.map(|node| node as usize);
        arcs.extend([(a, b, i64::from(capacities[0])), (b, a, i64::from(capacities[1]))]);
    }
    let mut at = vec![Vec::new(); count + 2];
    arcs.iter().enumerate().for_each(|(arc, ends)| at[ends.0].push(arc));
    let mut flow = network.price(&vec![false; count]) - terminals.iter().map(|&terminal| terminal.max(0)).sum::<i64>();
    loop {
        let mut by = vec![usize::MAX; count + 2];
        let mut queue = std::collections::VecDeque::from([source]);
        while let Some(node) = queue.pop_front() {
            for &arc in &at[node] {
                let (_, to, capacity) = arcs[arc];
                if capacity > 0 && to != source && by[to] == usize::MAX {
                    by[to] = arc;
                    queue.push_back(to);
                }
            }
        }
        if by[sink] == usize::MAX {
            return flow;
        }
        let mut way = Vec::new();
        let mut node = sink;
        while node != source {
            way.push(by[node]);
            node = arcs[by[node]].0;
        }
        let amount = way.iter().map(|&arc| arcs[arc].2).min().unwrap();
        for arc in way {
            arcs[arc].2 -= amount;
            arcs[arc ^ 1].2 += amount;
        }
        flow += amount;
    }
}

#[test]
fn a_noisy_sphere_has_an_inside_and_an_outside() {
    let mut points = sphere(3000, 0.02, 7);
    with_complex(&mut points, 1, |complex| {
        let sides = sides(complex, &Fronts::default(), &Progress::none()).unwrap().unwrap();
        let middle =
            |cell: usize| complex.vertices(cell as u32).map(|v| complex.points[v as usize]).iter().sum::<DVec3>() / 4.0;
        for cell in 0..complex.finite {
            let far = middle(cell).length();
            assert!(sides[cell] == 1 || far > 0.9, "the cell at {far} is outside");
        }
        assert!(sides[complex.finite..].iter().all(|&side| side == 0));
    });
}

#[test]
fn a_sheet_has_no_inside() {
    let mut random = random(5);
    let mut points: Vec<DVec3> = (0..3000).map(|_| DVec3::new(random(), random(), 0.01 * random())).collect();
    with_complex(&mut points, 1, |complex| {
        assert!(sides(complex, &Fronts::default(), &Progress::none()).unwrap().is_none());
    });
}

/// Of every place along short lines before and behind samples, a cell that holds it is voted for, and for the side it is on.
#[test]
fn samples_vote_for_the_cells_along_their_lines() {
    let progress = Progress::none();
    let mut points = sphere(400, 0.05, 3);
    let away: Vec<DVec3> = points.iter().map(|p| p.normalize()).collect();
    with_complex(&mut points, 1, |complex| {
        let balls = Balls::of(complex, &progress).unwrap();
        let poles = poles(complex, &balls, &progress).unwrap();
        let votes = visibility::votes(complex, &poles, &Fronts::known(away.clone()), &progress).unwrap();
        let holds = |cell: usize, place: DVec3| {
            (0..4).all(|slot| {
                let [a, b, c] = complex.facet(cell as u32, slot).map(|v| complex.points[v as usize]);
                (b - a).cross(c - a).dot(place - a) <= 0.0
            })
        };
        let mut seen = 0;
        for (vertex, away) in away.iter().enumerate().step_by(7) {
            for (side, direction) in [*away, -*away].into_iter().enumerate() {
                for share in [0.05, 0.3, 0.6, 0.95] {
                    let place = complex.points[vertex] + direction * (share * f64::from(poles[vertex].spacing));
                    if let Some(cell) = (0..complex.finite).find(|&cell| holds(cell, place)) {
                        assert!(votes[cell][side] > 0, "{share} of a spacing off sample {vertex}");
                        seen += 1;
                    }
                }
            }
        }
        let most = 2 * complex.points.len() * 12;
        let all: u32 = votes.as_flattened().iter().sum();
        assert!(seen > 200 && (all as usize) < most, "{seen} places, {all} votes");
    });
}

/// Through a hole the room inside is one with that outside.
#[test]
fn fronts_tell_the_inside_of_a_sphere_with_a_hole() {
    let progress = Progress::none();
    let mut points = sphere(3000, 0.02, 7);
    points.retain(|p| p.z < 0.9 * p.length());
    let away = Fronts::known(points.iter().map(|p| p.normalize()).collect());
    with_complex(&mut points, 1, |complex| {
        assert!(sides(complex, &Fronts::default(), &progress).unwrap().is_none());
        let sides = sides(complex, &away, &progress).unwrap().expect("fronts tell");
        for cell in 0..complex.finite {
            let middle = complex.vertices(cell as u32).map(|v| complex.points[v as usize]).iter().sum::<DVec3>() / 4.0;
            assert!(sides[cell] == 1 || middle.length() > 0.9 || middle.z > 0.8, "the cell at {middle} is outside");
        }
    });
}

/// An upright triangle's corners in the plane z = 0, around the origin, a spacing of 1 apart, and an apex at a height above and one so
/// far beneath it.
fn two_cells(above: f64, beneath: f64) -> Vec<DVec3> {
    let corner = |i: i32| {
        let turn = f64::from(i) / 3.0 * std::f64::consts::TAU;
        DVec3::new(turn.cos(), turn.sin(), 0.0) / 3.0_f64.sqrt()
    };
    (0..3).map(corner).chain([DVec3::Z * above, DVec3::NEG_Z * beneath]).collect()
}

/// Samples that are as far apart as is said, whatever their cells.
fn spaced(count: usize, spacing: f32) -> Vec<Poles> {
    vec![Poles { cells: [u32::MAX; 2], spacing }; count]
}

/// The slot of the facet between the two cells of [`two_cells`], of which the first is asked.
fn between(complex: Complex<'_>) -> usize {
    assert_eq!(complex.finite, 2, "the triangle is no facet");
    (0..4).find(|&slot| complex.neighbour(0, slot) == 1).unwrap()
}

#[test]
fn facets_between_large_flat_balls_are_cheaper_than_those_of_slivers() {
    let price = |above: f64, beneath: f64, spacing: f32| {
        with_complex(&mut two_cells(above, beneath), 1, |complex| {
            let balls = Balls::of(complex, &Progress::none()).unwrap();
            let (poles, slot) = (spaced(5, spacing), between(complex));
            let prices = [(0, slot), (1, complex.mirror(0, slot))]
                .map(|(cell, slot)| price(complex, &balls, &poles, cell, slot));
            assert_eq!(prices[0], prices[1], "{above}, {beneath}");
            prices[0]
        })
    };
    // The circle of the triangle has a radius of 1 / sqrt(3), which counts for 1; a ball through an apex at a height h one of (h^2 + 1 / 3)
    // / 2 h.
    for (above, beneath, expected) in [(10.0, 10.0, 1), (1.0, 10.0, 5), (1.0, 1.0, 5), (0.58, 10.0, 9), (0.1, 10.0, 17)]
    {
        assert_eq!(price(above, beneath, 1.0), expected, "{above} above");
        assert_eq!(price(beneath, above, 1.0), expected, "{above} beneath");
    }
    // Beside samples close together it counts as if they were an eighth of its circle's radius apart; nothing is for free.
    assert_eq!([0.2, 0.01, 100.0].map(|spacing| price(10.0, 10.0, spacing)), [25, 192, 1]);
}

#[test]
fn a_facet_costs_the_same_from_either_cell() {
    let progress = Progress::none();
    for noise in [0.0, 0.05, 0.3] {
        with_complex(&mut sphere(600, noise, 4), 1, |complex| {
            let balls = Balls::of(complex, &progress).unwrap();
            let poles = poles(complex, &balls, &progress).unwrap();
            let mut prices = std::collections::BTreeSet::new();
            for cell in 0..complex.finite as u32 {
                for slot in 0..4 {
                    let price = |cell, slot| price(complex, &balls, &poles, cell, slot);
                    let here = price(cell, slot);
                    assert_eq!(here, price(complex.neighbour(cell, slot), complex.mirror(cell, slot)));
                    prices.insert(here);
                }
            }
            let dearest = (2.0 * FACET + AREA * LARGEST * LARGEST) as u32;
            assert!(prices.len() > 20 && *prices.first().unwrap() >= 1 && *prices.last().unwrap() <= dearest);
        });
    }
}

#[test]
fn lids_are_the_share_of_the_area_over_gaps() {
    let progress = Progress::none();
    // Beneath, facets are as large as the triangle; above, their circles are about five times as large.
    with_complex(&mut two_cells(10.0, 1.0), 1, |complex| {
        let areas = [0, 1].map(|cell| {
            let slots = (0..4).filter(|&slot| complex.is_outer(complex.neighbour(cell, slot)));
            slots.map(|slot| complex.area(complex.facet(cell, slot))).sum::<f64>()
        });
        let is_above = |cell: u32| complex.vertices(cell).iter().any(|&v| complex.points[v as usize].z == 10.0);
        let above = usize::from(!is_above(0));
        let lids = |inside: &[usize], spacing: f32| {
            let mut sides = vec![0; complex.len()];
            inside.iter().for_each(|&cell| sides[cell] = 1);
            lids(complex, &spaced(5, spacing), &sides, &progress).unwrap()
        };
        assert_eq!((lids(&[0, 1], 10.0), lids(&[0, 1], 0.1)), (0.0, 1.0));
        let share = areas[above] / (areas[0] + areas[1]);
        assert!((lids(&[0, 1], 1.0) - share).abs() < 1e-12 && share > 0.8, "{share}");
        // The triangle itself is on the surface of either cell alone, and no lid.
        let alone = areas[above] / (areas[above] + 3.0_f64.sqrt() / 4.0);
        assert!((lids(&[above], 1.0) - alone).abs() < 1e-12);
        assert_eq!(lids(&[1 - above], 1.0), 0.0);
    });
}

#[test]
fn small_crumbs_change_sides_unless_a_deep_room_is_in_them() {
    let progress = Progress::none();
    with_complex(&mut sphere(3000, 0.02, 7), 1, |complex| {
        let Problem { rooms, .. } = problem(complex, &Fronts::default(), &progress).unwrap().unwrap();
        let whole = sides(complex, &Fronts::default(), &progress).unwrap().unwrap();
        // Of cells that are turned over, how many are turned back.
        let turned_back = |crumb: &[u32]| {
            let mut sides = whole.clone();
            crumb.iter().for_each(|&cell| sides[cell as usize] ^= 1);
            fill_crumbs(complex, &rooms, &mut sides, &progress).unwrap();
            crumb.iter().filter(|&&cell| sides[cell as usize] == whole[cell as usize]).count()
        };
        // Cells from which no other side is reached at once: turned over, they are parts of their own.
        let is_within =
            |cell: u32| (0..4).all(|slot| whole[complex.neighbour(cell, slot) as usize] == whole[cell as usize]);
        let cells = || (0..complex.finite as u32).filter(|&cell| is_within(cell));
        let deep = cells().find(|&cell| rooms.side(cell) == Some(Side::Inside)).unwrap();
        assert_eq!(turned_back(&[deep]), 0, "a deep room");
        // So many of them in one part that has no room.
        let part = |first: u32, most: usize| {
            let mut part = vec![first];
            let mut next = 0;
            while next < part.len() && part.len() < most {
                let around = (0..4).map(|slot| complex.neighbour(part[next], slot));
                let beyond: Vec<u32> = around
                    .filter(|&cell| rooms.side(cell).is_none() && is_within(cell) && !part.contains(&cell))
                    .collect();
                part.extend(beyond);
                next += 1;
            }
            part.truncate(most);
            part
        };
        let shallow = cells().filter(|&cell| rooms.side(cell).is_none());
        let largest = shallow.map(|cell| part(cell, CRUMB)).max_by_key(Vec::len).unwrap();
        for size in 1..CRUMB {
            assert_eq!(turned_back(&largest[..size]), size, "{size} cells");
        }
        assert_eq!(turned_back(&largest), 0, "as many as a part has");
        let with_a_room: Vec<u32> = largest[..1].iter().copied().chain([deep]).collect();
        assert_eq!(turned_back(&with_a_room), 1, "two parts, one with a room");
    });
}
