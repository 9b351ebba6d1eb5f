//! Solids of many forms.

use std::collections::BTreeMap;

use glam::{DVec3, I64Vec3};

use mesh::TriMesh;
use mesh::shapes::Shape;

use crate::single::Precision;

/// The mesh in single precision, as steps leave it.
pub fn single(mesh: &TriMesh) -> TriMesh {
    let precision = Precision::single(mesh);
    mapped(mesh, |p| precision.place(p))
}

/// A ball with bumps.
pub fn bumpy(detail: usize) -> TriMesh {
    let mut mesh = Shape::Sphere { radius: 1.0 }.mesh(detail);
    mesh.positions.iter_mut().for_each(|p| {
        let wave = (7.0 * p.x).sin() + (5.0 * p.y + 1.0).sin() * (6.0 * p.z).cos();
        *p *= 1.0 + 0.12 * wave;
    });
    single(&mesh)
}

/// The surface of the cells of a lattice that are inside. Cells have sides of 2, so that all vertices have whole coordinates: corners,
/// middles of edges and centres of faces. Where cells meet in edges or corners only, it is parted there: it is a manifold with vertices at
/// the same place.
pub fn voxels(size: [i64; 3], is_inside: impl Fn(I64Vec3) -> bool) -> TriMesh {
    let mut faces: Vec<([I64Vec3; 9], I64Vec3)> = Vec::new();
    let cells = (0..size[0] * size[1] * size[2])
        .map(|i| I64Vec3::new(i % size[0], i / size[0] % size[1], i / size[0] / size[1]))
        .filter(|&cell| is_inside(cell));
    for cell in cells {
        for side in 0..6 {
            let axis = side / 2;
            let step = |k: usize| I64Vec3::AXES[k % 3];
            let far = side % 2 == 1;
            if is_inside(cell + if far { step(axis) } else { -step(axis) }) {
                continue;
            }
            let first = 2 * if far { cell + step(axis) } else { cell };
            let (mut u, mut v) = (step(axis + 1), step(axis + 2));
            if !far {
                std::mem::swap(&mut u, &mut v);
            }
            let around = [(0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (0, 1), (1, 1)];
            faces.push((around.map(|(i, j)| first + u * i + v * j), cell));
        }
    }
    // Over an edge of four faces a face goes with that of its own cell.
    let mut edges: BTreeMap<[[i64; 3]; 2], Vec<(usize, usize)>> = BTreeMap::new();
    for (f, (points, _)) in faces.iter().enumerate() {
        for k in 0..8 {
            let ends = [points[k].to_array(), points[(k + 1) % 8].to_array()];
            edges.entry([ends[0].min(ends[1]), ends[0].max(ends[1])]).or_default().push((f, k));
        }
    }
    let mut joined: Vec<usize> = (0..9 * faces.len()).collect();
    fn root(joined: &[usize], mut at: usize) -> usize {
        while joined[at] != at {
            at = joined[at];
        }
        at
    }
    let mut join = |a: usize, b: usize| {
        let (a, b) = (root(&joined, a), root(&joined, b));
        joined[a.max(b)] = a.min(b);
    };
    for group in edges.values() {
        for (i, &(f, k)) in group.iter().enumerate() {
            for &(g, l) in &group[..i] {
                if group.len() == 2 || faces[f].1 == faces[g].1 {
                    join(9 * f + k, 9 * g + (l + 1) % 8);
                    join(9 * f + (k + 1) % 8, 9 * g + l);
                }
            }
        }
    }
    let mut mesh = TriMesh::default();
    let mut numbers: BTreeMap<usize, u32> = BTreeMap::new();
    for (f, (points, _)) in faces.iter().enumerate() {
        let corners: [u32; 9] = std::array::from_fn(|k| {
            *numbers.entry(root(&joined, 9 * f + k)).or_insert_with(|| {
                mesh.positions.push(points[k].as_dvec3());
                mesh.positions.len() as u32 - 1
            })
        });
        mesh.triangles.extend((0..8).map(|k| [corners[8], corners[k], corners[(k + 1) % 8]]));
    }
    mesh
}

/// The solid between a plane at height 0 and these heights, which are `side * side`.
pub fn relief(side: usize, heights: &[i64]) -> TriMesh {
    let mut mesh = TriMesh::default();
    let at = |i: usize, j: usize, is_top: bool| (2 * (i + side * j) + usize::from(is_top)) as u32;
    for j in 0..side {
        for i in 0..side {
            let place = |z: i64| DVec3::new(2.0 * i as f64, 2.0 * j as f64, z as f64);
            mesh.positions.extend([place(0), place(heights[i + side * j])]);
        }
    }
    for j in 1..side {
        for i in 1..side {
            let quad =
                |is_top: bool| [at(i - 1, j - 1, is_top), at(i, j - 1, is_top), at(i, j, is_top), at(i - 1, j, is_top)];
            let ([a, b, c, d], [e, f, g, h]) = (quad(true), quad(false));
            mesh.triangles.extend([[a, b, c], [a, c, d], [e, g, f], [e, h, g]]);
        }
    }
    let mut wall = |from: [usize; 2], to: [usize; 2]| {
        let [a, b] = [at(from[0], from[1], false), at(to[0], to[1], false)];
        mesh.triangles.extend([[a, b, b + 1], [a, b + 1, a + 1]]);
    };
    for k in 1..side {
        wall([k - 1, 0], [k, 0]);
        wall([side - 1, k - 1], [side - 1, k]);
        wall([k, side - 1], [k - 1, side - 1]);
        wall([0, k], [0, k - 1]);
    }
    mesh
}

/// Two meshes as one.
pub fn beside(one: &TriMesh, other: &TriMesh) -> TriMesh {
    let mut mesh = one.clone();
    let first = one.positions.len() as u32;
    mesh.positions.extend(&other.positions);
    mesh.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + first)));
    mesh
}

/// The mesh turned inside out.
pub fn reversed(mesh: &TriMesh) -> TriMesh {
    TriMesh::new(mesh.positions.clone(), mesh.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect())
}

/// The mesh with its places mapped.
pub fn mapped(mesh: &TriMesh, map: impl Fn(DVec3) -> DVec3) -> TriMesh {
    TriMesh::new(mesh.positions.iter().map(|&p| map(p)).collect(), mesh.triangles.clone())
}
