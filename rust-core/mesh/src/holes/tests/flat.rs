//! Loops in one plane.

use super::*;

/// A flat lattice with a hole like a star, of more edges than triangulations of least bend are made for at once.
fn starred(place: impl Fn(f64, f64) -> DVec3) -> TriMesh {
    let lattice = grid(90, 90, [false; 2], |r, c| DVec3::new(c - 45.0, r - 45.0, 0.0));
    let holed = cut(&lattice, |p| p.length() < 30.0 + 8.0 * (5.0 * p.y.atan2(p.x)).sin());
    let positions = lattice.positions.iter().map(|p| place(p.x, p.y)).collect();
    TriMesh::new(positions, holed.triangles)
}

fn over_loops(mesh: &TriMesh, limit: impl FnMut(&[u32]) -> f64) -> Vec<[u32; 3]> {
    let boundary = boundary_of(&mesh.triangles);
    let triangles = mesh.triangles.clone();
    close_over_loops(&mesh.positions, triangles, &boundary, limit, |_| Ok(true), &Progress::none()).unwrap()
}

/// The angles opposite to an edge that two triangles share are at most two right ones together, in the plane itself.
#[test]
fn a_long_flat_loop_is_closed_by_delaunay_triangles() {
    for place in [
        |x: f64, y: f64| DVec3::new(x, y, 0.0),
        |x: f64, y: f64| DVec3::new(7.0, 0.5 * y, 0.5 * x),
        |x: f64, y: f64| DVec3::new(x, y, 2.0 * x - 0.5 * y),
    ] {
        let mesh = starred(place);
        let outline = 4 * 90;
        assert!(boundary_of(&mesh.triangles).len() > outline + 3 * minimal::LARGEST / 2);
        let closed = over_loops(&mesh, |hole| if hole.len() == outline { 0.0 } else { f64::INFINITY });
        let new = &closed[mesh.triangles.len()..];
        assert_eq!(check(&TriMesh::new(mesh.positions.clone(), closed.clone())).boundary_loops, 1);
        let sides = |&[a, b, c]: &[u32; 3]| [([a, b], c), ([b, c], a), ([c, a], b)];
        let apex: std::collections::BTreeMap<[u32; 2], u32> = new.iter().flat_map(sides).collect();
        let mut shared = 0;
        for (&[a, b], &c) in &apex {
            let Some(&d) = apex.get(&[b, a]) else { continue };
            let [a, b, c, d] = [a, b, c, d].map(|v| mesh.positions[v as usize]);
            assert!((a - c).angle_between(b - c) + (a - d).angle_between(b - d) < std::f64::consts::PI + 1e-6);
            shared += 1;
        }
        assert_eq!(shared, 2 * (new.len() - 1));
    }
}

/// A box without its lid, whose walls stand across the plane of the loop.
#[test]
fn a_box_gets_a_flat_lid() {
    let n = 60;
    let ring = |i: u32| match (i / n, f64::from(i % n), f64::from(n)) {
        (0, t, _) => DVec3::new(t, 0.0, 0.0),
        (1, t, n) => DVec3::new(n, t, 0.0),
        (2, t, n) => DVec3::new(n - t, n, 0.0),
        (_, t, n) => DVec3::new(0.0, n - t, 0.0),
    };
    let walls = grid(6, 4 * n, [false, true], |r, c| ring(c as u32) + 3.0 * r * DVec3::Z);
    let closed = TriMesh::new(walls.positions.clone(), over_loops(&walls, |_| 1000.0));
    assert!(check(&closed).is_closed());
    let volume: f64 = (0..closed.triangles.len())
        .map(|t| {
            let [a, b, c] = closed.corners(t);
            a.cross(b).dot(c) / 6.0
        })
        .sum();
    assert_eq!(volume.abs(), 60.0 * 60.0 * 18.0);
}
