use glam::{DAffine3, DQuat, DVec3};

use super::super::*;
use super::*;
use crate::import::{self, Content};
use base::error::Result;
use base::progress::Progress;
use image::range_image::{RangeImage, Viewing};
use mesh::{QuadMesh, TriMesh};

/// Long, not ASCII, with quotes.
fn utm() -> Crs {
    let axis = "AXIS[\"Easting\",EAST],".repeat(80);
    Crs::new(&format!("PROJCS[\"ETRS89 / Gauß, zone 32\",{axis}UNIT[\"metre\",1],AUTHORITY[\"EPSG\",\"25832\"]]"))
        .unwrap()
}

/// A square metre in UTM, with detail of tenths of millimetres.
fn square(crs: Option<Crs>) -> TriMesh {
    let corner = DVec3::new(500_000.0, 5_000_000.0, 300.0);
    let at = [[0.0, 0.0, 0.0], [1.0, 0.0, 1e-3], [1.0, 1.0, 2e-3], [0.0, 1.0, 1.2e-3]];
    let positions = at.map(|at| corner + DVec3::from_array(at)).to_vec();
    TriMesh { crs, ..TriMesh::new(positions, vec![[0, 1, 2], [0, 2, 3]]) }
}

fn same_places(found: &[DVec3], expected: &[DVec3]) {
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        assert!(found.distance(*expected) < 1e-6, "{found} for {expected}");
    }
}

fn provenance() -> Provenance {
    Provenance::from_json(r#"{"command":"merge","inputs":[{"name":"]]>é"},{"name":"b"}],"one":{"a":1}}"#).unwrap()
}

/// Theorem: meshes in UTM keep their millimetres and their system in every format that says it, whatever else the file says.
#[test]
fn meshes_keep_place_and_system() {
    let folder = tempfile::tempdir().unwrap();
    for ending in ["ply", "glb", "obj"] {
        for crs in [utm(), Crs::new("EPSG:25832+7837").unwrap(), Crs::new("EPSG:6318").unwrap().with_degrees(true)] {
            for provenance in [None, Some(provenance())] {
                let path = folder.path().join(format!("mesh.{ending}"));
                let options = WriteOptions { provenance: provenance.clone(), ..WriteOptions::default() };
                let mesh = square(Some(crs.clone()));
                write_mesh(&path, &mesh, &[], &options, &Progress::none()).unwrap();
                assert_eq!(crs_note(&path, Holding::Mesh, Some(&crs)), None);
                let Content::Mesh(read) = import::open(&path).unwrap().scans[0].read().unwrap() else {
                    panic!("no mesh")
                };
                assert_eq!(read.crs.as_ref(), Some(&crs), "{ending}");
                same_places(&read.positions, &mesh.positions);
                assert_eq!(import::provenance(&path).unwrap(), provenance, "{ending}");
            }
        }
    }
}

/// Theorem: without a system, and without provenance, files are as they were before there was either.
#[test]
fn nothing_is_said_of_nothing() {
    let folder = tempfile::tempdir().unwrap();
    for ending in ["ply", "glb", "obj", "stl", "3mf"] {
        let path = folder.path().join(format!("mesh.{ending}"));
        let mesh = mesh::shapes::Shape::Cuboid { half: DVec3::ONE }.mesh(1);
        write_mesh(&path, &mesh, &[], &WriteOptions::default(), &Progress::none()).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        assert!(!String::from_utf8_lossy(&bytes).contains("surfrecon {"), "{ending}");
        assert_eq!(import::provenance(&path).unwrap(), None);
        assert_eq!(import::open(&path).unwrap().scans[0].crs().unwrap(), None);
    }
}

#[test]
fn what_can_not_be_said_is_told() {
    let crs = Crs::new("EPSG:25832").unwrap();
    let note = |path: &str, holding| crs_note(Path::new(path), holding, Some(&crs));
    let expected = ".stl has no place for the coordinate reference system, EPSG:25832, which is left out: write .ply, .glb, .obj to keep it";
    assert_eq!(note("a.stl", Holding::Mesh).as_deref(), Some(expected));
    for (path, holding) in [("a.ptx", Holding::Images), ("a.conf", Holding::Images), ("a.ply", Holding::Image)] {
        assert!(note(path, holding).unwrap().ends_with("write .e57 to keep it"));
    }
    assert_eq!(note("a.e57", Holding::Images), None);
    assert_eq!(crs_note(Path::new("a.stl"), Holding::Mesh, None), None);
    // Single precision is refused where it would lose detail.
    let path = std::env::temp_dir().join("never.stl");
    let error = write_stl(&path, &square(None), 1.0, &Progress::none()).unwrap_err().to_string();
    assert!(error.contains("where STL's single precision would lose its detail") && !path.exists(), "{error}");
}

#[test]
fn points_and_quads() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("points.ply");
    let mut cloud = mesh::PointCloud { positions: square(None).positions, crs: Some(utm()), ..Default::default() };
    let read = |path: &Path| match import::open(path).unwrap().scans[0].read().unwrap() {
        Content::Points(cloud) => (cloud.positions, cloud.crs),
        Content::Mesh(mesh) => (mesh.positions, mesh.crs),
        Content::RangeImage(_) => panic!("an image"),
    };
    for encoding in [PlyEncoding::Ascii, PlyEncoding::BinaryLittleEndian, PlyEncoding::BinaryBigEndian] {
        write_points_ply(&path, &cloud, encoding, &Progress::none()).unwrap();
        same_places(&read(&path).0, &cloud.positions);
        assert_eq!(read(&path).1, cloud.crs);
    }
    // Their pose is left out, and with it the system of the world.
    cloud.world_from_cloud = DAffine3::from_translation(DVec3::X);
    write_points_ply(&path, &cloud, PlyEncoding::Ascii, &Progress::none()).unwrap();
    assert_eq!(read(&path).1, None);
    let quads =
        QuadMesh { positions: cloud.positions, quads: vec![[0, 1, 2, 3]], crs: Some(utm()), ..Default::default() };
    let path = folder.path().join("quads.ply");
    write_quads_ply(&path, &quads, PlyEncoding::Ascii, &Progress::none()).unwrap();
    assert_eq!(read(&path).1, quads.crs);
    let polygons = Polygons {
        positions: &quads.positions,
        colour: None,
        quads: &quads.quads,
        triangles: &[],
        provenance: Some(&provenance()),
        crs: quads.crs.as_ref(),
    };
    let path = folder.path().join("quads.obj");
    write_obj_polygons(&path, &polygons, &Progress::none()).unwrap();
    same_places(&read(&path).0, &quads.positions);
    assert_eq!((read(&path).1, import::provenance(&path).unwrap()), (quads.crs.clone(), Some(provenance())));
}

fn scan(name: &str, crs: Option<Crs>) -> RangeImage {
    let points = (0..12).map(|i| [i as f32 * 1e-3, 10.0, 0.5 * i as f32]).collect();
    let mut image = RangeImage::from_points(3, 4, points, Viewing::From(DVec3::ZERO)).unwrap();
    let corner = DVec3::new(500_000.25, 5_000_000.125, 300.0);
    image.world_from_sensor = DAffine3::from_rotation_translation(DQuat::from_rotation_z(0.5), corner);
    image.name = name.to_owned();
    image.crs = crs;
    image
}

/// Theorem: E57 keeps place, system and provenance. Files of scans of different systems are not written.
#[test]
fn scans_keep_place_and_system() -> Result<()> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.e57");
    let images = [scan("</e57Root>", Some(utm())), scan("b", None)];
    let all: Vec<_> = images.iter().collect();
    for given in [None, Some(provenance())] {
        write_e57(&path, &all, given.as_ref(), &Progress::none())?;
        let set = import::open(&path)?;
        assert_eq!(set.notes, ["coordinates are in ETRS89 / Gauß, zone 32 (EPSG:25832)"]);
        assert_eq!(import::provenance(&path)?, given);
        for (image, scan) in images.iter().zip(&set.scans) {
            let Content::RangeImage(read) = scan.read()? else { panic!("no image") };
            assert_eq!((read.name.as_str(), read.crs.as_ref()), (image.name.as_str(), Some(&utm())));
            for pixel in 0..image.len() {
                assert!(read.point_in_world(pixel).distance(image.point_in_world(pixel)) < 1e-6);
            }
        }
    }
    let other = scan("c", Some(Crs::new("EPSG:25833")?));
    std::fs::remove_file(&path).unwrap();
    let error = write_e57(&path, &[&images[0], &other], None, &Progress::none()).unwrap_err().to_string();
    assert!(error.contains("c in EPSG:25833: transform one of them first") && !path.exists(), "{error}");
    // Others keep the place.
    for (name, write) in [("a.ptx", true), ("a.conf", false)] {
        let path = folder.path().join(name);
        match write {
            true => write_ptx(&path, &[&images[1]], &Progress::none())?,
            false => write_scan_list(&path, &[&images[1]], PlyEncoding::Ascii, &Progress::none())?,
        }
        let Content::RangeImage(read) = import::open(&path)?.scans[0].read()? else { panic!("no image") };
        for pixel in 0..read.len() {
            assert!(read.point_in_world(pixel).distance(images[1].point_in_world(pixel)) < 1e-5);
        }
    }
    Ok(())
}

#[test]
fn a_gltf_of_nodes_in_two_systems_is_refused() {
    let path = std::env::temp_dir().join("never.glb");
    let meshes = [square(Some(utm())), square(Some(Crs::new("EPSG:25833").unwrap()))];
    let node = |mesh, world_from_mesh| GlbNode { name: "square", mesh, world_from_mesh, coarser: &[], images: None };
    let nodes = meshes.each_ref().map(|mesh| node(mesh, DAffine3::IDENTITY));
    let error = write_glb(&path, &nodes, &GlbOptions::default(), &Progress::none()).unwrap_err().to_string();
    let expected = "square is in ETRS89 / Gauß, zone 32 (EPSG:25832), square in EPSG:25833: transform one";
    assert!(error.starts_with(expected) && !path.exists(), "{error}");
}
