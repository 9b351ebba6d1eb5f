use std::path::Path;

use glam::DVec3;

use super::super::damage;
use super::*;
use crate::export::{GlbNode, GlbOptions, write_glb};
use mesh::{Attribute, TriMesh};

fn glb() -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    let mut mesh = TriMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z], vec![[0, 2, 1], [0, 1, 3]]);
    mesh.vertex_attributes.push(Attribute::colour("colour", (0..4).map(|i| [i * 60, 255, 7, 255]).collect()));
    let moved = glam::DAffine3::from_translation(DVec3::new(0.0, 10.0, 0.0));
    let nodes = [("a", glam::DAffine3::IDENTITY), ("b", moved)].map(|(name, world_from_mesh)| GlbNode {
        name,
        mesh: &mesh,
        world_from_mesh,
        coarser: &[],
    });
    write_glb(&path, &nodes, &GlbOptions::default(), &Progress::none()).unwrap();
    std::fs::read(&path).unwrap()
}

fn scan() -> Scan {
    Scan::new(Path::new("x.glb"))
}

#[test]
fn what_we_write_is_read_in_its_place() {
    let Content::Mesh(mesh) = damage::read(parse, &glb(), &scan()).unwrap() else { panic!("no mesh") };
    assert_eq!(mesh.triangles, [[0, 2, 1], [0, 1, 3], [4, 6, 5], [4, 5, 7]]);
    assert_eq!((mesh.positions[3], mesh.positions[6]), (DVec3::Z, DVec3::new(0.0, 11.0, 0.0)));
    let Some(mesh::AttributeData::Colour(colours)) = mesh.vertex_attribute("colour") else { panic!("none") };
    for (i, colour) in colours.iter().enumerate() {
        let expected = [(i % 4 * 60) as u8, 255, 7, 255];
        assert!(colour.iter().zip(expected).all(|(a, b)| a.abs_diff(b) <= 1), "{colour:?} {expected:?}");
    }
    damage::endure(parse, &glb(), &scan());
}

/// Theorem: room is made for what the scene places, however many other nodes there are.
#[test]
fn nodes_outside_of_the_scene_take_nothing() {
    let bytes = glb();
    let (both, second) = (b"\"nodes\":[0,1]", b"\"nodes\":[1  ]");
    let at = bytes.windows(both.len()).position(|some| some == both).unwrap();
    let mut one = bytes.clone();
    one[at..at + second.len()].copy_from_slice(second);
    for (bytes, count) in [(bytes, 8), (one, 4)] {
        let Content::Mesh(mesh) = damage::read(parse, &bytes, &scan()).unwrap() else { panic!("no mesh") };
        assert_eq!(
            (mesh.positions.len(), mesh.positions.capacity(), mesh.triangles.capacity()),
            (count, count, count / 2)
        );
    }
}

/// Two nodes of four vertices each are refused before the first is read where six vertices may be unpacked.
#[test]
fn more_than_may_be_placed_is_refused_at_once() {
    let mut scan = scan();
    let vertices = |count: f64| count * size_of::<DVec3>() as f64 / f64::from(1 << 30);
    scan.options = crate::import::ReadOptions { max_decoded_gib: vertices(6.0), ..Default::default() }.into();
    let text = damage::read(parse, &glb(), &scan).unwrap_err().to_string();
    let expected =
        "scene: 8 vertices and 12 corners of triangles are placed, more than max_decoded_gib allows; raise it";
    assert!(text.contains(expected), "{text}");
    scan.options = crate::import::ReadOptions { max_decoded_gib: vertices(8.0), ..Default::default() }.into();
    assert!(damage::read(parse, &glb(), &scan).is_ok());
}

fn text(uri: &str) -> String {
    format!(
        r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0]}}], "nodes": [{{"mesh": 0, "scale": [-2, 2, 2]}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "mode": 5}}]}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0,0,0], "max": [1,1,0]}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 48}}], "buffers": [{{"byteLength": 48, "uri": "{uri}"}}]}}"#
    )
}

#[test]
fn strips_mirrors_and_buffers_elsewhere() {
    let floats = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0_f32];
    let bytes: Vec<u8> = floats.iter().flat_map(|x| x.to_le_bytes()).collect();
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a b.bin"), &bytes).unwrap();
    let path = folder.path().join("a.gltf");
    let read = |uri: &str| {
        std::fs::write(&path, text(uri)).unwrap();
        crate::import::open(&path).and_then(|set| set.scans[0].read())
    };
    let packed = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAACAPwAAgD8AAAAA";
    for uri in ["missing.bin", "https://example.org/a.bin"] {
        let error = read(uri).unwrap_err().to_string();
        assert!(error.contains(&format!("a.gltf: buffer {uri}: ")), "{error}");
        assert!(error.ends_with("buffers are in the file itself or in files beside it"), "{error}");
    }
    for uri in ["a%20b.bin", &format!("data:application/octet-stream;base64,{packed}")] {
        let Content::Mesh(mesh) = read(uri).unwrap() else { panic!("no mesh") };
        assert_eq!(mesh.positions[3], DVec3::new(-2.0, 2.0, 0.0));
        // Mirrored: turned over, so that the outside stays outside.
        assert_eq!(mesh.triangles, [[0, 2, 1], [2, 3, 1]].map(|[a, b, c]: [u32; 3]| [a, b, c]));
    }
    for (uri, problem) in [
        ("../a.bin", "leads out of the folder"),
        ("%2e%2e/a.bin", "leads out of the folder"),
        ("/etc/passwd", "leads out of the folder"),
        ("none.bin", "none.bin"),
        ("data:text/plain,x", "only base64 is known"),
        ("data:;base64,!!", "this is not base64"),
        ("data:;base64,AAAA", "it has 3 bytes of 48"),
    ] {
        let error = read(uri).unwrap_err().to_string();
        assert!(error.contains(problem), "{error}");
    }
}
