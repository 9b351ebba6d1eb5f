//! A mesh with images, for tests of writers.

use glam::DVec3;

use mesh::{Attribute, Tile, TileImages, TriMesh, texture};

/// Columns and rows of the images.
pub const SIZE: u32 = 4;

/// Two squares of two triangles: the first in tile 1001, the second in tile 1003. 1002 is empty.
pub fn mesh() -> TriMesh {
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let place = |x: f64| corners.map(|[u, v]| DVec3::new(x + u, v, 0.0));
    let mut mesh = TriMesh::new([place(0.0), place(3.0)].concat(), vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]);
    let along = |axis: usize| [0.0, 2.0].map(|tile| corners.map(|of| of[axis] as f32 * 0.75 + 0.125 + tile)).concat();
    let up: Vec<f32> = along(1).iter().map(|v| v % 2.0).collect();
    mesh.vertex_attributes = vec![
        Attribute::colour("colour", vec![[9, 9, 9, 255]; 8]),
        Attribute::f32(texture::S, along(0)),
        Attribute::f32(texture::T, up),
        Attribute::i32("id", (0..8).collect()),
    ];
    mesh
}

/// Images with all maps. The second triangle's tangents are mirrored, so that two vertices are split.
pub fn images() -> TileImages {
    let count = (SIZE * SIZE) as usize;
    let tile = |k: usize| {
        let byte = |i: usize| (i * 11 + k * 50) as u8;
        Tile {
            colour: (0..count).map(|i| [byte(i), 255 - byte(i), k as u8]).collect(),
            normal: Some((0..count).map(|i| [128, 120 + i as u8, 250]).collect()),
            height: Some((0..count).map(|i| (i * 4000 + k) as u16).collect()),
            occlusion: Some((0..count).map(|i| 255 - byte(i)).collect()),
            mask: Some(vec![255; count]),
        }
    };
    let tangents = [1.0, -1.0, 1.0, 1.0].map(|sign| [[1.0, 0.0, 0.0, sign]; 3]).to_vec();
    TileImages { size: SIZE, tiles: (0..3).map(tile).collect(), heights: Some([-0.5, 1.5]), tangents: Some(tangents) }
}
