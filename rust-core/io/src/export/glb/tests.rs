use glam::DVec4;
use gltf::Semantic;

use glam::{DMat3, Vec3};

use super::*;
use crate::export::images::ImageFormat;
use crate::export::sheet;
use mesh::shapes::Shape;
use mesh::{Attribute, TileImages, TriMesh};

fn written(nodes: &[GlbNode<'_>], options: &GlbOptions) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.glb");
    write_glb(&path, nodes, options, &Progress::none()).unwrap();
    std::fs::read(path).unwrap()
}

fn still(name: &'static str, mesh: &'static TriMesh) -> GlbNode<'static> {
    GlbNode { name, mesh, world_from_mesh: DAffine3::IDENTITY, coarser: &[], images: None }
}

fn textured<'a>(name: &'a str, mesh: &'a TriMesh, images: &'a TileImages) -> GlbNode<'a> {
    GlbNode { name, mesh, world_from_mesh: DAffine3::IDENTITY, coarser: &[], images: Some(images) }
}

fn leaked(mesh: TriMesh) -> &'static TriMesh {
    Box::leak(Box::new(mesh))
}

fn decorated() -> &'static TriMesh {
    let mut mesh = Shape::Torus { major: 2.0, minor: 0.5 }.mesh(6);
    let n = mesh.positions.len();
    mesh.vertex_attributes = vec![
        Attribute::colour("colour", (0..n).map(|i| [i as u8, 128, 255, 64]).collect()),
        Attribute::f32("confidence", (0..n).map(|i| i as f32 / 3.0).collect()),
        Attribute::i32("source_scan", (0..n).map(|i| i as i32 - 5).collect()),
        Attribute::bool("interpolated", (0..n).map(|i| i % 3 == 0).collect()),
        Attribute::colour("paint", (0..n).map(|i| [1, 2, 3, i as u8]).collect()),
    ];
    mesh.face_attributes = vec![Attribute::bool("hole_fill", vec![true; mesh.triangles.len()])];
    leaked(mesh)
}

/// The place where node `index` puts points, as an f64 reader sees it. `None` for parents.
fn place(gltf: &gltf::Gltf, name: &str) -> DAffine3 {
    fn find(node: gltf::Node<'_>, above: DAffine3, name: &str) -> Option<DAffine3> {
        let (t, r, s) = node.transform().decomposed();
        let here = above
            * DAffine3::from_scale_rotation_translation(
                Vec3::from(s).as_dvec3(),
                glam::Quat::from_array(r).as_dquat().normalize(),
                Vec3::from(t).as_dvec3(),
            );
        if node.name() == Some(name) {
            return Some(here);
        }
        node.children().find_map(|child| find(child, here, name))
    }
    gltf.default_scene().unwrap().nodes().find_map(|n| find(n, DAffine3::IDENTITY, name)).unwrap()
}

fn read_positions(gltf: &gltf::Gltf, mesh: usize) -> Vec<[f32; 3]> {
    let blob = gltf.blob.as_deref().unwrap();
    let primitive = gltf.meshes().nth(mesh).unwrap().primitives().next().unwrap();
    primitive.reader(|_| Some(blob)).read_positions().unwrap().collect()
}

#[test]
fn a_strict_reader_gets_back_what_was_written() {
    let mesh = decorated();
    let bytes = written(&[still("ring \"1\"\n", mesh)], &GlbOptions::default());
    let gltf = gltf::Gltf::from_slice(&bytes).unwrap();
    let blob = gltf.blob.as_deref().unwrap();
    let primitive = gltf.meshes().next().unwrap().primitives().next().unwrap();
    assert_eq!(gltf.nodes().next().unwrap().name(), Some("ring \"1\"\n"));
    let reader = primitive.reader(|_| Some(blob));
    let indices: Vec<u32> = reader.read_indices().unwrap().into_u32().collect();
    assert_eq!(indices, mesh.triangles.as_flattened());
    let positions: Vec<DVec3> = reader.read_positions().unwrap().map(|p| Vec3::from(p).as_dvec3()).collect();
    assert!(positions.iter().zip(&mesh.positions).all(|(a, b)| a.distance(*b) < 1e-6));
    let bounds = primitive.bounding_box();
    let (lo, hi) = mesh::measure::bounds(&positions).unwrap();
    assert_eq!((Vec3::from(bounds.min).as_dvec3(), Vec3::from(bounds.max).as_dvec3()), (lo, hi));

    // The normals of a torus are known.
    for (n, p) in reader.read_normals().unwrap().zip(&mesh.positions) {
        let centre = p.with_z(0.0).normalize() * 2.0;
        let n = Vec3::from(n).as_dvec3();
        assert!((n.length() - 1.0).abs() < 1e-6 && n.dot((*p - centre).normalize()) > 0.97);
    }
    let colours = reader.read_colors(0).unwrap();
    for (i, c) in colours.into_rgba_f32().enumerate() {
        let linear = |x: u8| {
            let x = f64::from(x) / 255.0;
            if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
        };
        let expected = DVec4::new(linear(i as u8), linear(128), 1.0, 64.0 / 255.0);
        assert!(glam::Vec4::from(c).as_dvec4().distance(expected) < 1e-4);
    }

    let floats = |name: &str| -> Vec<f32> {
        let wanted = Semantic::Extras(name.to_owned());
        let accessor = primitive.get(&wanted).unwrap_or_else(|| panic!("no {name}"));
        gltf::accessor::Iter::<f32>::new(accessor, |_| Some(blob)).unwrap().collect()
    };
    let n = mesh.positions.len();
    assert_eq!(floats("CONFIDENCE"), (0..n).map(|i| i as f32 / 3.0).collect::<Vec<_>>());
    assert_eq!(floats("SOURCE_SCAN"), (0..n).map(|i| i as f32 - 5.0).collect::<Vec<_>>());
    assert_eq!(floats("INTERPOLATED"), (0..n).map(|i| f32::from(u8::from(i % 3 == 0))).collect::<Vec<_>>());
    let paint = primitive.get(&Semantic::Extras("PAINT".to_owned())).unwrap();
    assert!(
        gltf::accessor::Iter::<[u8; 4]>::new(paint, |_| Some(blob))
            .unwrap()
            .enumerate()
            .all(|(i, c)| c == [1, 2, 3, i as u8])
    );
    assert_eq!(primitive.attributes().count(), 7);
}

#[test]
fn where_it_is_from_stands_beside_who_wrote_it_and_changes_nothing_else() {
    let nodes = [still("ring", decorated())];
    let provenance = Some(Provenance::from_json("{\"command\": \"merge\"}").unwrap());
    let bytes = written(&nodes, &GlbOptions { provenance, ..GlbOptions::default() });
    let (with, without) = (gltf::Gltf::from_slice(&bytes).unwrap(), written(&nodes, &GlbOptions::default()));
    let without = gltf::Gltf::from_slice(&without).unwrap();
    let text = String::from_utf8_lossy(&bytes);
    assert!(text.contains("\"extras\":{\"surfrecon\":{\"command\":\"merge\"}}},\"nodes\""), "{text}");
    assert_eq!(with.blob, without.blob);
    assert_eq!(with.nodes().count(), without.nodes().count());
}

#[test]
fn every_node_has_its_place_even_far_from_the_origin() {
    let near = leaked(Shape::Sphere { radius: 1.0 }.mesh(3));
    let mut far = Shape::Cuboid { half: DVec3::ONE }.mesh(2);
    far.positions.iter_mut().for_each(|p| *p += DVec3::new(5e6, -4.5e6, 120.0));
    let far = leaked(far);
    let turn = DAffine3::from_rotation_translation(DQuat::from_rotation_z(0.7), DVec3::new(1.0, 2.0, 3.0));
    let nodes =
        [still("near", near), GlbNode { name: "far", mesh: far, world_from_mesh: turn, coarser: &[], images: None }];
    for (options, world) in [
        (GlbOptions::default(), DAffine3::IDENTITY),
        (
            GlbOptions { up: Up::Z, metres_per_unit: 0.001, ..GlbOptions::default() },
            DAffine3::from_scale(DVec3::splat(0.001))
                * DAffine3::from_mat3(DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y)),
        ),
    ] {
        let gltf = gltf::Gltf::from_slice(&written(&nodes, &options)).unwrap();
        for (k, node) in nodes.iter().enumerate() {
            let pose = place(&gltf, node.name);
            let positions = read_positions(&gltf, k);
            assert_eq!(positions.len(), node.mesh.positions.len());
            // The shape, free of the single precision of the readers' translations.
            let first = Vec3::from(positions[0]).as_dvec3();
            let scale = world.matrix3.x_axis.length();
            for (p, &exact) in positions.iter().zip(&node.mesh.positions) {
                let p = Vec3::from(*p).as_dvec3();
                let edge = pose.transform_vector3(p - first);
                let expected = world.transform_vector3(turn_of(node).transform_vector3(exact - node.mesh.positions[0]));
                assert!(edge.distance(expected) < 2e-6 * scale, "{edge} {expected}");
                let expected = world.transform_point3(turn_of(node).transform_point3(exact));
                assert!(pose.transform_point3(p).distance(expected) < if k == 0 { 2e-6 } else { 1.0 } * scale);
            }
        }
    }
    fn turn_of(node: &GlbNode<'_>) -> DAffine3 {
        node.world_from_mesh
    }
}

#[test]
fn points_and_nothing_are_written_too() {
    let cloud = leaked(TriMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], vec![]));
    let empty = leaked(TriMesh::default());
    let flat = leaked(TriMesh::new(vec![DVec3::ZERO; 3], vec![[0, 1, 2]]));
    let gltf = gltf::Gltf::from_slice(&written(
        &[still("points", cloud), still("empty", empty), still("flat", flat)],
        &GlbOptions::default(),
    ))
    .unwrap();
    assert_eq!((gltf.nodes().count(), gltf.meshes().count()), (3, 2));
    let primitive = gltf.meshes().next().unwrap().primitives().next().unwrap();
    assert_eq!(primitive.mode(), gltf::mesh::Mode::Points);
    assert!(primitive.indices().is_none() && primitive.get(&Semantic::Normals).is_none());
    let normals: Vec<[f32; 3]> = {
        let blob = gltf.blob.as_deref().unwrap();
        let primitive = gltf.meshes().nth(1).unwrap().primitives().next().unwrap();
        primitive.reader(|_| Some(blob)).read_normals().unwrap().collect()
    };
    assert_eq!(normals, [[0.0, 0.0, 1.0]; 3]);

    let nothing = gltf::Gltf::from_slice(&written(&[], &GlbOptions::default())).unwrap();
    assert_eq!(nothing.nodes().count(), 0);
}

#[test]
fn what_can_not_be_written_is_named_and_leaves_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.glb");
    let sphere = Shape::Sphere { radius: 1.0 }.mesh(1);
    let n = sphere.positions.len();
    let with = |attributes: Vec<Attribute>| {
        let mesh = TriMesh { vertex_attributes: attributes, ..sphere.clone() };
        let node = GlbNode { name: "it", mesh: &mesh, world_from_mesh: DAffine3::IDENTITY, coarser: &[], images: None };
        write_glb(&path, &[node], &GlbOptions::default(), &Progress::none()).unwrap_err().to_string()
    };
    assert!(with(vec![Attribute::f32("error", vec![f32::NAN; n])]).contains("attribute error of vertex 0 is NaN"));
    assert!(with(vec![Attribute::i32("id", vec![i32::MAX; n])]).contains("attribute id of vertex 0 is 2147483647"));
    assert!(with(vec![Attribute::bool("short", vec![])]).contains("attribute short has 0 entries"));
    let twice = ["a", "A"].map(|name| Attribute::bool(name, vec![true; n]));
    assert!(with(twice.to_vec()).contains("_A"));

    let mesh = TriMesh { positions: vec![DVec3::ZERO, DVec3::X * 1e200, DVec3::Y], ..TriMesh::default() };
    let node = |mesh, world_from_mesh| GlbNode { name: "it", mesh, world_from_mesh, coarser: &[], images: None };
    let fails = |node: GlbNode<'_>, options: GlbOptions, words: &str| {
        let text = write_glb(&path, &[node], &options, &Progress::none()).unwrap_err().to_string();
        assert!(text.contains(words), "{text}");
    };
    fails(node(&mesh, DAffine3::IDENTITY), GlbOptions::default(), "too large");
    fails(node(&sphere, DAffine3::from_scale(DVec3::splat(2.0))), GlbOptions::default(), "rotation");
    let flat = GlbOptions { metres_per_unit: 0.0, ..GlbOptions::default() };
    fails(node(&sphere, DAffine3::IDENTITY), flat, "metres_per_unit");
    for checks in 0..3 {
        let cancelled = Progress::cancel_after(checks);
        let outcome = write_glb(&path, &[node(&sphere, DAffine3::IDENTITY)], &GlbOptions::default(), &cancelled);
        assert!(matches!(outcome, Err(Error::Cancelled)));
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

/// Meshes of fewer and fewer triangles.
fn levels() -> [&'static TriMesh; 3] {
    [12, 6, 3].map(|around| {
        let mut mesh = Shape::Torus { major: 2.0, minor: 0.5 }.mesh(around);
        mesh.positions.iter_mut().for_each(|p| *p += DVec3::new(4e6, 0.0, 0.0));
        leaked(mesh)
    })
}

#[test]
fn levels_of_another_system_are_refused() {
    let named = |mesh: &TriMesh, code| leaked(TriMesh { crs: Some(Crs::new(code).unwrap()), ..mesh.clone() });
    let [finest, coarse, _] = levels();
    let [fine, same, other] = [named(finest, "EPSG:25832"), named(coarse, "epsg:25832"), named(coarse, "EPSG:25833")];
    let path = std::env::temp_dir().join("never.glb");
    let refused = |nodes: &[GlbNode<'_>]| {
        let error = write_glb(&path, nodes, &GlbOptions::default(), &Progress::none()).unwrap_err().to_string();
        assert!(!path.exists());
        error
    };
    let error = refused(&[GlbNode { coarser: &[coarse, other], ..still("ground", fine) }]);
    assert!(error.starts_with("ground is in EPSG:25832, its level 2 in EPSG:25833: transform one of them"), "{error}");
    let error = refused(&[still("a", fine), still("b", other)]);
    assert!(error.starts_with("a is in EPSG:25832, b in EPSG:25833: transform one of them"), "{error}");
    written(&[GlbNode { coarser: &[same], ..still("ground", fine) }], &GlbOptions::default());
}

#[test]
fn levels_of_detail_stand_behind_their_node() {
    let [finest, coarser @ ..] = levels();
    let chain = GlbNode { coarser: &coarser, ..still("ring", finest) };
    let bytes = written(
        &[still("before", decorated()), chain],
        &GlbOptions { up: Up::Z, metres_per_unit: 0.001, ..GlbOptions::default() },
    );
    let json: serde_json::Value =
        serde_json::from_slice(&bytes[20..20 + u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize])
            .unwrap();
    assert_eq!(json["extensionsUsed"], serde_json::json!(["MSFT_lod"]));
    assert_eq!(json["nodes"][1]["extensions"]["MSFT_lod"]["ids"], serde_json::json!([2, 3]));
    let shares = json["nodes"][1]["extras"]["MSFT_screencoverage"].as_array().unwrap();
    assert_eq!(shares.len(), 3);
    let expected = 0.5 * coarser[0].triangles.len() as f64 / finest.triangles.len() as f64;
    assert!(shares[0] == expected && shares[1].as_f64() < Some(expected) && shares[2] == 0.0, "{shares:?}");
    // A reader that knows nothing of levels sees the finest only.
    assert_eq!(json["nodes"][4]["children"], serde_json::json!([0, 1]));
    assert_eq!(json["scenes"][0]["nodes"], serde_json::json!([4]));
    assert_eq!(json["nodes"][2]["name"], "ring LOD1");
    let places = [1, 2, 3].map(|node| json["nodes"][node]["translation"].clone());
    assert!(places.iter().all(|place| *place == places[0] && place.is_array()), "{places:?}");
    let gltf = gltf::Gltf::from_slice(&bytes).unwrap();
    assert_eq!(read_positions(&gltf, 3).len(), coarser[1].positions.len());

    let folder = tempfile::tempdir().unwrap();
    let wrong = GlbNode { coarser: &[finest], ..still("ring", coarser[0]) };
    let outcome = write_glb(&folder.path().join("x.glb"), &[wrong], &GlbOptions::default(), &Progress::none());
    assert!(outcome.unwrap_err().to_string().starts_with("ring: level 1 has"));
}

#[test]
fn the_khronos_validator_finds_nothing_wrong() {
    let Some(validator) = std::env::var_os("SURFRECON_GLTF_VALIDATOR") else {
        println!("SKIPPED: SURFRECON_GLTF_VALIDATOR does not name the folder of the Khronos validator");
        return;
    };
    let mut far = Shape::Cuboid { half: DVec3::ONE }.mesh(2);
    far.positions.iter_mut().for_each(|p| *p += DVec3::new(5e6, -4.5e6, 120.0));
    let [finest, coarser @ ..] = levels();
    let nodes = [
        still("ring \"1\" \\ ä", decorated()),
        still("far", leaked(far)),
        still("points", leaked(TriMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], vec![]))),
        still("empty", leaked(TriMesh::default())),
        still("sculpture", leaked(scan::sculpture::sculpture(6.0, 0, &Progress::none()).unwrap())),
        GlbNode { coarser: &coarser, ..still("chain", finest) },
    ];
    let folder = tempfile::tempdir().unwrap();
    let provenance = Some(Provenance::from_json("{\"command\": \"merge\", \"inputs\": [{\"name\": \"ä\"}]}").unwrap());
    let up = GlbOptions { up: Up::Z, metres_per_unit: 0.001, provenance, ..GlbOptions::default() };
    let mut files = Vec::new();
    let (sheet, images) = (sheet::mesh(), sheet::images());
    let jpeg = ImageOptions { image_format: ImageFormat::Jpeg, ..ImageOptions::default() };
    for (file, form) in [("png.glb", ImageOptions::default()), ("jpeg.glb", jpeg)] {
        files.push(folder.path().join(file));
        let coarse = leaked(TriMesh { triangles: sheet.triangles[2..].to_vec(), ..sheet.clone() });
        let both = [still("plain", decorated()), GlbNode { coarser: &[coarse], ..textured("sheet", &sheet, &images) }];
        let options = GlbOptions { images: form, ..GlbOptions::default() };
        write_glb(&files[files.len() - 1], &both, &options, &Progress::none()).unwrap();
    }
    for (file, nodes, options) in [
        ("plain.glb", &nodes[..], GlbOptions::default()),
        ("turned.glb", &nodes[..], up.clone()),
        ("none.glb", &[], up),
    ] {
        files.push(folder.path().join(file));
        write_glb(&files[files.len() - 1], nodes, &options, &Progress::none()).unwrap();
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tools/validate_gltf.js");
    let told = std::process::Command::new("node").arg(script).arg(validator).args(&files).output().unwrap();
    let printed = String::from_utf8_lossy(&told.stdout);
    assert!(told.status.success(), "{printed}{}", String::from_utf8_lossy(&told.stderr));
    // Coarser levels are in no scene and the extension is none of Khronos': it says so, and nothing else.
    let expected = ["UNUSED_OBJECT", "UNSUPPORTED_EXTENSION", "NODE_EMPTY"];
    assert!(printed.lines().all(|line| expected.iter().any(|code| line.contains(code))), "{printed}");
}

/// Theorem: no coordinate is read back further from what it was than single precision alone puts it, wherever the mesh lies.
#[test]
fn origins_round_no_further_than_single_precision() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    let centres = [
        DVec3::new(5e3, 40.0, 0.3),
        DVec3::new(-1e3, 1000.0, -7.0),
        DVec3::new(4e6, -5e6, 120.0),
        DVec3::new(3e7, 2e7 + 0.25, 30.0),
        DVec3::new(0.9, 1e-3, 0.0),
    ];
    for (centre, size) in centres.into_iter().flat_map(|centre| [1e-3, 1.0, 77.0].map(|size| (centre, size))) {
        let offset = |i: u32, k: u32| f64::from((i * 7919 + k * 104_729) % 10_007) / 10_007.0 - 0.5;
        let positions: Vec<DVec3> =
            (0..300).map(|i| centre + size * DVec3::new(offset(i, 1), offset(i, 2), offset(i, 3))).collect();
        let single = positions.iter().map(|p| p.as_vec3().as_dvec3());
        for positions in [single.collect(), positions.clone()] {
            let mesh = TriMesh::new(positions, (0..100).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect());
            let nodes =
                [GlbNode { name: "a", mesh: &mesh, world_from_mesh: DAffine3::IDENTITY, coarser: &[], images: None }];
            write_glb(&path, &nodes, &GlbOptions::default(), &Progress::none()).unwrap();
            let read = crate::import::open(&path).unwrap().scans[0].read().unwrap();
            let crate::import::Content::Mesh(read) = read else { panic!("no mesh") };
            for (was, is) in mesh.positions.iter().zip(&read.positions) {
                let bound = (*was - was.as_vec3().as_dvec3()).abs();
                assert!(
                    (*is - *was).abs().cmple(bound).all(),
                    "{is} was {was}, which single precision rounds by {bound}"
                );
            }
        }
    }
}

#[test]
fn texture_coordinates_count_from_the_top_and_come_back() {
    let mut mesh = TriMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z], vec![[0, 1, 2], [0, 2, 3]]);
    let cell = 1.0 / f32::from(1_u16 << 12) / f32::from(1_u16 << 12);
    mesh.vertex_attributes.push(Attribute::f32(texture::S, vec![0.0, 1.0, 0.25, cell]));
    mesh.vertex_attributes.push(Attribute::f32(texture::T, vec![cell, 2.5, 1.0 - cell, 0.0]));
    let bytes = written(&[still("a", leaked(mesh.clone()))], &GlbOptions::default());
    let gltf = gltf::Gltf::from_slice(&bytes).unwrap();
    let blob = gltf.blob.as_deref().unwrap();
    let primitive = gltf.meshes().next().unwrap().primitives().next().unwrap();
    let found: Vec<[f32; 2]> = primitive.reader(|_| Some(blob)).read_tex_coords(0).unwrap().into_f32().collect();
    assert_eq!(found, [[0.0, 1.0 - cell], [1.0, -1.5], [0.25, cell], [cell, 1.0]]);
    // They are no custom attributes as well.
    assert_eq!(primitive.attributes().count(), 3);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    let read = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        match crate::import::open(&path).unwrap().scans[0].read().unwrap() {
            crate::import::Content::Mesh(mesh) => mesh,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(read(&bytes), mesh);
    // Of a part of the scene alone they are left out.
    let bare = leaked(TriMesh { vertex_attributes: Vec::new(), ..mesh.clone() });
    let textured = leaked(mesh);
    for nodes in [[still("a", textured), still("b", bare)], [still("b", bare), still("a", textured)]] {
        assert_eq!(read(&written(&nodes, &GlbOptions::default())).vertex_attributes, []);
    }
    let both = read(&written(&[still("a", textured), still("b", textured)], &GlbOptions::default()));
    assert_eq!(both.vertex_attributes[0], Attribute::f32(texture::S, [0.0, 1.0, 0.25, cell].repeat(2)));
}

/// Pixels of an image of a file, by the decoders that read photos.
fn pixels(gltf: &gltf::Gltf, image: &gltf::Image<'_>) -> (String, Vec<[u8; 3]>) {
    let gltf::image::Source::View { view, mime_type } = image.source() else { panic!("not in the file") };
    let bytes = &gltf.blob.as_deref().unwrap()[view.offset()..view.offset() + view.length()];
    let colours = crate::import::frames::colours_of(bytes).unwrap();
    assert_eq!(colours.0, [sheet::SIZE as usize; 2]);
    (mime_type.to_owned(), colours.1)
}

#[test]
fn each_tile_has_a_material_with_its_images() {
    let (mesh, images) = (sheet::mesh(), sheet::images());
    let bytes = written(&[still("ring", decorated()), textured("sheet", &mesh, &images)], &GlbOptions::default());
    let gltf = gltf::Gltf::from_slice(&bytes).unwrap();
    assert_eq!((gltf.meshes().count(), gltf.materials().count(), gltf.images().count()), (2, 3, 6));
    let primitives: Vec<_> = gltf.meshes().nth(1).unwrap().primitives().collect();
    for (primitive, (tile, name)) in primitives.iter().zip([(0, "sheet 1001"), (2, "sheet 1003")]) {
        let (material, tile) = (primitive.material(), &images.tiles[tile]);
        let pbr = material.pbr_metallic_roughness();
        assert_eq!((material.name(), pbr.metallic_factor(), pbr.roughness_factor()), (Some(name), 0.0, 1.0));
        let base = pbr.base_color_texture().unwrap().texture();
        assert_eq!(pixels(&gltf, &base.source()), ("image/png".into(), tile.colour.clone()));
        let sampler = base.sampler();
        assert_eq!(sampler.min_filter(), Some(gltf::texture::MinFilter::LinearMipmapLinear));
        let normal = material.normal_texture().unwrap().texture().source();
        assert_eq!(pixels(&gltf, &normal).1, tile.normal.clone().unwrap());
        let occlusion = pixels(&gltf, &material.occlusion_texture().unwrap().texture().source()).1;
        assert!(occlusion.iter().zip(tile.occlusion.as_ref().unwrap()).all(|(found, &was)| *found == [was; 3]));
    }
    assert_eq!(primitives.len(), 2);
}

#[test]
fn a_tile_has_its_own_coordinates_and_tangents() {
    let (mesh, images) = (sheet::mesh(), sheet::images());
    let [right, up] = texture::coordinates(&mesh).unwrap();
    let bytes = written(&[textured("sheet", &mesh, &images)], &GlbOptions::default());
    let gltf = gltf::Gltf::from_slice(&bytes).unwrap();
    let blob = gltf.blob.as_deref().unwrap();
    let primitives: Vec<_> = gltf.meshes().next().unwrap().primitives().collect();
    let mut corners = images.tangents.as_ref().unwrap().as_flattened().iter().zip(mesh.triangles.as_flattened());
    for (primitive, (corner, vertices)) in primitives.iter().zip([(0.0, 6), (2.0, 4)]) {
        let reader = primitive.reader(|_| Some(blob));
        let positions: Vec<[f32; 3]> = reader.read_positions().unwrap().collect();
        let uv: Vec<[f32; 2]> = reader.read_tex_coords(0).unwrap().into_f32().collect();
        let tangents: Vec<[f32; 4]> = reader.read_tangents().unwrap().collect();
        assert!(reader.read_normals().unwrap().all(|n| n == [0.0, 0.0, 1.0]));
        // Glossy colours of vertices would be multiplied.
        assert!(reader.read_colors(0).is_none() && primitive.get(&Semantic::Extras("ID".into())).is_some());
        assert_eq!(positions.len(), vertices);
        for index in reader.read_indices().unwrap().into_u32() {
            let ((tangent, &vertex), index) = (corners.next().unwrap(), index as usize);
            let vertex = vertex as usize;
            assert_eq!(Vec3::from(positions[index]).as_dvec3(), mesh.positions[vertex]);
            assert_eq!(tangents[index], *tangent);
            assert_eq!(uv[index], [right[vertex] - corner, 1.0 - up[vertex]]);
        }
    }
    assert!(corners.next().is_none());
}

#[test]
fn jpeg_holds_colours_alone_and_levels_share_images() {
    let (mesh, images) = (sheet::mesh(), sheet::images());
    let coarse = TriMesh { triangles: mesh.triangles[2..].to_vec(), ..mesh.clone() };
    let node = GlbNode { coarser: &[&coarse], ..textured("sheet", &mesh, &images) };
    let form = ImageOptions { image_format: ImageFormat::Jpeg, jpeg_quality: 100 };
    let bytes = written(&[node], &GlbOptions { images: form, ..GlbOptions::default() });
    let gltf = gltf::Gltf::from_slice(&bytes).unwrap();
    assert_eq!((gltf.meshes().count(), gltf.materials().count(), gltf.images().count()), (2, 2, 6));
    let found: Vec<_> = gltf.images().map(|image| pixels(&gltf, &image)).collect();
    assert_eq!(found[0].0, "image/jpeg");
    let worst =
        found[0].1.as_flattened().iter().zip(images.tiles[0].colour.as_flattened()).map(|(a, b)| a.abs_diff(*b));
    assert!(worst.max().unwrap() < 8);
    assert_eq!(found[1], ("image/png".to_owned(), images.tiles[0].normal.clone().unwrap()));
    let coarse = gltf.meshes().nth(1).unwrap().primitives().next().unwrap();
    assert_eq!(coarse.material().name(), Some("sheet 1003"));
    // The tangents of the images are of the finest level. A coarser one gets its own.
    let reader = coarse.reader(|_| gltf.blob.as_deref());
    assert!(reader.read_tangents().unwrap().all(|tangent| tangent == [1.0, 0.0, 0.0, 1.0]));
}

#[test]
fn images_that_do_not_fit_the_mesh_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    let told = |mesh: &TriMesh, images: &TileImages| {
        let nodes = [textured("sheet", mesh, images)];
        write_glb(&path, &nodes, &GlbOptions::default(), &Progress::none()).unwrap_err().to_string()
    };
    let (mesh, images) = (sheet::mesh(), sheet::images());
    let bare = TriMesh { vertex_attributes: Vec::new(), ..mesh.clone() };
    let expected =
        "sheet: there are images, but no texture coordinates: unwrap the mesh first, or give it the attributes s and t";
    assert_eq!(told(&bare, &images), expected);
    let few = TileImages { tiles: images.tiles[..2].to_vec(), ..images.clone() };
    let expected =
        "sheet: triangle 2 lies in tile 2, counted from 0, but there are images of 2: give images of all tiles";
    assert_eq!(told(&mesh, &few), expected);
    let points = TriMesh { triangles: Vec::new(), ..mesh.clone() };
    assert!(told(&points, &images).contains("no triangles that show them"));
    assert!(told(&mesh, &TileImages { size: 0, ..images.clone() }).contains("give tiles of at least 1 texel"));
    let short = TileImages { tangents: Some(vec![[[0.0; 4]; 3]; 3]), ..images.clone() };
    assert!(
        told(&mesh, &short).ends_with("tangents of 3 triangles, but the mesh has 4: make the images for this mesh")
    );
    let mut across = mesh;
    across.vertex_attributes[1] = Attribute::f32(texture::S, vec![0.5; 8]);
    across.vertex_attributes[2] = Attribute::f32(texture::T, [0.5, 1.5].repeat(4));
    assert!(told(&across, &images).contains("sheet: the texture coordinates of triangle 0 lie in no one tile"));
    let many =
        GlbOptions { images: ImageOptions { jpeg_quality: 101, ..ImageOptions::default() }, ..GlbOptions::default() };
    let good = sheet::mesh();
    let nodes = [textured("sheet", &good, &images)];
    let error = write_glb(&path, &nodes, &many, &Progress::none()).unwrap_err().to_string();
    assert!(error.contains("jpeg_quality"), "{error}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
