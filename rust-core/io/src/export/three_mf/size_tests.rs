//! Meshes of any size that our reader reads back from what we write. Programs of others read them in `tests/python/test_judges.py`.

use super::tests::{read, tetrahedron, written};
use super::*;
use mesh::Attribute;

/// A grid of `count` times `count` vertices that waves.
pub(in crate::export) fn sheet(count: u32, size: f64) -> TriMesh {
    let step = size / f64::from(count - 1);
    let place = |i: u32| {
        let (x, y) = (step * f64::from(i % count), step * f64::from(i / count));
        DVec3::new(x, y, 0.1 * size * (7.0 * x / size).sin())
    };
    let square = |i: u32| [[i, i + 1, i + count], [i + 1, i + count + 1, i + count]];
    let corners = (0..count * (count - 1)).filter(|i| i % count + 1 < count);
    TriMesh::new((0..count * count).map(place).collect(), corners.flat_map(square).collect())
}

pub(in crate::export) fn coloured(mut mesh: TriMesh) -> TriMesh {
    let colours = (0..mesh.positions.len() as u32).map(|i| [(i % 200) as u8, (i % 7) as u8, 5, 255 - (i % 2) as u8]);
    mesh.vertex_attributes.push(Attribute::colour("colour", colours.collect()));
    mesh
}

/// Theorem: the reader finds all triangles in their order, each vertex within single precision of the mesh's size, and each colour.
#[test]
fn what_we_write_is_read_as_it_was() {
    // Whole numbers, as the origin in the transform is.
    let far = |mut mesh: TriMesh, by: f64| {
        mesh.positions.iter_mut().for_each(|place| *place += DVec3::new(4e6, -5e6, 100.0) * by);
        mesh
    };
    for (name, mesh, metres) in [
        ("plain", tetrahedron(), 1e-3),
        ("coloured", coloured(tetrahedron()), 1e-3),
        ("of a million triangles", coloured(sheet(709, 200.0)), 1e-3),
        ("tiny", coloured(sheet(5, 1e-9)), 1.0),
        ("tiny in millimetres", sheet(5, 1e-9), 1e-3),
        ("far", coloured(far(sheet(9, 1.0), 1.0)), 1.0),
        ("tiny and far", far(sheet(9, 1e-3), 1e-2), 0.0254),
        ("of a unit without a name", coloured(sheet(3, 10.0)), 0.2),
    ] {
        let options = GlbOptions { metres_per_unit: metres, ..GlbOptions::default() };
        let bytes = written(&mesh, &options);
        let ours = read(&bytes);
        assert!(ours.triangles == mesh.triangles, "{name}");
        let first = mesh.positions[0];
        let size = mesh.positions.iter().map(|place| place.distance(first)).fold(0.0, f64::max);
        // Far places have the digits of double precision in the transform.
        let slack = metres * (size * 1e-7 + first.length() * 1e-15);
        for (k, place) in mesh.positions.iter().enumerate() {
            let found = ours.positions[k];
            assert!(found.abs_diff_eq(*place * metres, slack), "{name}: {found} {}", *place * metres);
        }
        let Some(AttributeData::Colour(colours)) = mesh.vertex_attribute("colour") else {
            assert!(ours.vertex_attributes.is_empty(), "{name}");
            continue;
        };
        let Some(AttributeData::Colour(found)) = ours.vertex_attribute("colour") else { panic!("{name}: no colours") };
        assert!(found == colours, "{name}");
    }
}
