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

/// What a cut of the cells costs, and that of the smallest, found by one way after another.
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
        let votes = sight::votes(complex, &poles, &Fronts::known(away.clone()), &progress).unwrap();
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
