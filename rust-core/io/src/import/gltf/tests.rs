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
        images: None,
    });
    write_glb(&path, &nodes, &GlbOptions::default(), &Progress::none()).unwrap();
    std::fs::read(&path).unwrap()
}

fn scan() -> FileScan {
    FileScan::new(Path::new("x.glb"))
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
        "scene: 8 vertices and 12 corners of triangles are placed, more than max_decoded_gib allows: raise it";
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
        assert!(error.ends_with("buffers must be in the file itself or in files beside it"), "{error}");
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
        ("data:;base64,AAAA", "it has only 3 bytes of 48"),
    ] {
        let error = read(uri).unwrap_err().to_string();
        assert!(error.contains(problem), "{error}");
    }
}

/// A text file of two meshes of three vertices, moved by their nodes, drawn in this mode, with these scenes.
fn drawn(mode: u32, scenes: &str, nodes: &str) -> String {
    let floats = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.6, 0.8, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0_f32];
    let bytes: Vec<u8> = floats.iter().flat_map(|x| x.to_le_bytes()).collect();
    let digits: Vec<char> = ('A'..='Z').chain('a'..='z').chain('0'..='9').chain(['+', '/']).collect();
    let quad = |b: &[u8]| [b[0] >> 2, (b[0] & 3) << 4 | b[1] >> 4, (b[1] & 15) << 2 | b[2] >> 6, b[2] & 63];
    let packed: String = bytes.chunks(3).flat_map(quad).map(|digit| digits[digit as usize]).collect();
    format!(
        r#"{{"asset":{{"version":"2.0"}},{scenes}{nodes}
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1}},"mode":{mode}}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}},
        {{"bufferView":0,"byteOffset":36,"componentType":5126,"count":3,"type":"VEC3"}}],
        "bufferViews":[{{"buffer":0,"byteLength":72}}],
        "buffers":[{{"byteLength":72,"uri":"data:application/octet-stream;base64,{packed}"}}]}}"#
    )
}

fn content(text: &str) -> Result<Content> {
    damage::read(parse, text.as_bytes(), &scan())
}

const SCENE: &str = r#""scenes":[{"nodes":[0]}],"#;
/// The second of two nodes is above the first.
const NODES: &str = r#""nodes":[{"mesh":0,"translation":[5,0,0]},{"children":[0],"scale":[2,2,1]}],"#;

#[test]
fn points_are_a_cloud() {
    let text = drawn(0, r#""scenes":[{"nodes":[1]}],"#, NODES);
    let mut scan = scan();
    scan.world_from_sensor = glam::DAffine3::from_translation(DVec3::Z);
    let Content::Points(cloud) = damage::read(parse, text.as_bytes(), &scan).unwrap() else { panic!("no points") };
    assert_eq!(cloud.positions, [[10.0, 0.0, 0.0], [12.0, 0.0, 0.0], [10.0, 2.0, 0.0]].map(DVec3::from_array));
    assert_eq!((cloud.world_from_cloud, &cloud.colour), (scan.world_from_sensor, &None));
    // A surface stretched to twice the width leans less.
    let normals = cloud.normals.unwrap();
    let leaning = DVec3::new(0.0, 0.3, 0.8).normalize().as_vec3().to_array();
    assert_eq!(normals, [leaning, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]);
    damage::endure(parse, text.as_bytes(), &scan);
    // Points as we write them, with their colours. Two nodes.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    let mut points = TriMesh::new(vec![DVec3::ZERO, DVec3::X], Vec::new());
    points.vertex_attributes.push(Attribute::colour("colour", vec![[255, 0, 0, 255], [0, 255, 0, 128]]));
    let place = |x: f64| glam::DAffine3::from_translation(DVec3::new(x, 0.0, 0.0));
    let nodes =
        [0.0, 7.0].map(|x| GlbNode { name: "a", mesh: &points, world_from_mesh: place(x), coarser: &[], images: None });
    write_glb(&path, &nodes, &GlbOptions::default(), &Progress::none()).unwrap();
    let Content::Points(cloud) = crate::import::open(&path).unwrap().scans[0].read().unwrap() else { panic!("none") };
    assert_eq!(cloud.positions, [0.0, 1.0, 7.0, 8.0].map(|x| DVec3::new(x, 0.0, 0.0)));
    assert_eq!(cloud.colour.unwrap()[2..], [[255, 0, 0, 255], [0, 255, 0, 128]]);
    assert!(cloud.normals.is_none());
}

/// Theorem: a scene that names no nodes leaves none out, and nodes place their meshes also without a scene.
#[test]
fn scenes_without_nodes() {
    let first = |text: &str| match content(text).unwrap() {
        Content::Mesh(mesh) => (mesh.triangles.len(), mesh.positions[0]),
        other => panic!("{other:?}"),
    };
    for scenes in
        ["", r#""scenes":[{}],"#, r#""scene":0,"scenes":[{"nodes":[]},{"name":"b"}],"#, r#""scene":7,"scenes":[],"#]
    {
        assert_eq!(first(&drawn(4, scenes, NODES)), (1, DVec3::new(10.0, 0.0, 0.0)), "{scenes}");
        assert_eq!(first(&drawn(4, scenes, "")), (1, DVec3::ZERO), "{scenes}");
    }
    // A scene that names nodes is all there is.
    assert_eq!(first(&drawn(4, SCENE, NODES)), (1, DVec3::new(5.0, 0.0, 0.0)));
}

#[test]
fn what_has_no_surface_is_refused() {
    let told = |text: &str| content(text).unwrap_err().to_string();
    let nothing = r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"name":"camera"}]}"#;
    let end = "export a surface or points with it";
    for text in [nothing, r#"{"asset":{"version":"2.0"}}"#] {
        assert_eq!(told(text), format!("x.glb: scene: there is no mesh: {end}"));
    }
    for text in [drawn(1, SCENE, NODES), drawn(4, SCENE, r#""nodes":[{}],"#)] {
        assert_eq!(told(&text), format!("x.glb: scene: there are no triangles and no points: {end}"));
    }
}

#[test]
fn json_may_be_nested_to_a_depth() {
    let with = |depth: usize| {
        let extras = format!("{}0{}", "[".repeat(depth), "]".repeat(depth));
        drawn(4, SCENE, &NODES.replacen('{', &format!(r#"{{"extras":{extras},"#), 1))
    };
    assert!(content(&with(100)).is_ok());
    let error = content(&with(130)).unwrap_err().to_string();
    assert!(error.starts_with("x.glb: line 1, column "), "{error}");
    assert!(
        error.ends_with("JSON is nested more than 127 deep, which is the most: write it with fewer lists in lists")
    );
    let camera = format!("{{\"fx\":{}0{}}}", "[".repeat(130), "]".repeat(130));
    let error = crate::import::camera::parse(camera.as_bytes(), Path::new("c.json")).unwrap_err().to_string();
    assert!(error.contains("JSON is nested more than 127 deep"), "{error}");
}
