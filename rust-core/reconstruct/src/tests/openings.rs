//! Openings between bars that are as thin as their samples are apart.

use glam::DVec3;

use super::shapes::torus;
use super::*;

/// A ball with rings through it, each of a bar of half a spacing. It has a sample per unit of area.
fn ringed() -> Vec<DVec3> {
    let mut random = random(23);
    let radius = 10.0;
    let mut points: Vec<DVec3> = (0..1257)
        .map(|_| {
            let (z, turn) = (2.0 * random() - 1.0, std::f64::consts::TAU * random());
            let around = (1.0 - z * z).sqrt();
            radius * DVec3::new(around * turn.cos(), around * turn.sin(), z)
        })
        .collect();
    for (seed, axis) in [(1, DVec3::X), (2, -DVec3::X), (3, DVec3::Y), (4, -DVec3::Y)] {
        let ring = torus(197, 8.0, 0.6, seed)
            .into_iter()
            .map(|p| 15.0 * axis + DVec3::new(0.0, 0.0, p.y) + p.x * axis + p.z * axis.cross(DVec3::Z));
        points.extend(ring.filter(|p| p.length() > radius));
    }
    points
}

/// A surface that reaches the last samples of the bars, which neither side touches, must not close the space between bars and ball.
#[test]
fn no_lid_is_put_over_openings_to_reach_a_few_samples() {
    let (made, report) = reconstruct(ringed(), &ReconstructParams::default());
    let edges = (0..made.mesh.triangles.len())
        .map(|t| made.mesh.corners(t))
        .flat_map(|[a, b, c]| [a.distance(b), b.distance(c), c.distance(a)]);
    let longest = edges.fold(0.0, f64::max);
    assert!(report.is_manifold() && report.is_closed(), "{report}");
    assert!(longest < 8.0, "{longest}");
}
