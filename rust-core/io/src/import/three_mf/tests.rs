use std::io::Write as _;
use std::path::PathBuf;

use super::*;
use crate::import;
use mesh::{AttributeData, TriMesh};
use zip::CompressionMethod;

const HEAD: &str = "<model unit=\"millimeter\" xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\" \
    xmlns:p=\"http://schemas.microsoft.com/3dmanufacturing/production/2015/06\">";
const RELS: &str = "<Relationships><Relationship Target=\"/3D/a.model\" Id=\"0\" \
    Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>";
const MESH: &str = "<mesh><vertices><vertex x=\"0\" y=\"0\" z=\"0\"/><vertex x=\"1\" y=\"0\" z=\"0\"/>\
    <vertex x=\"0\" y=\"1\" z=\"0\"/></vertices><triangles><triangle v1=\"0\" v2=\"1\" v3=\"2\"/></triangles></mesh>";

/// A package of these parts, stored or deflated.
fn package_by(method: CompressionMethod, parts: &[(&str, &str)]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.3mf");
    let mut zip = zip::ZipWriter::new(std::fs::File::create(&path).unwrap());
    for (name, text) in parts {
        zip.start_file(*name, zip::write::SimpleFileOptions::default().compression_method(method)).unwrap();
        zip.write_all(text.as_bytes()).unwrap();
    }
    zip.finish().unwrap();
    (folder, path)
}

fn package(parts: &[(&str, &str)]) -> (tempfile::TempDir, PathBuf) {
    package_by(CompressionMethod::Stored, parts)
}

fn packed(parts: &[(&str, &str)]) -> (tempfile::TempDir, PathBuf) {
    package_by(CompressionMethod::Deflated, parts)
}

fn read_parts(parts: &[(&str, &str)]) -> Result<TriMesh> {
    let (_folder, path) = package(&[&[("_rels/.rels", RELS)], parts].concat());
    match import::open(&path)?.scans[0].read()? {
        Content::Mesh(mesh) => Ok(mesh),
        _ => panic!("no mesh"),
    }
}

/// A model of one part, with its resources and its build.
fn of(inside: &str) -> Result<TriMesh> {
    read_parts(&[("3D/a.model", &format!("{HEAD}{inside}</model>"))])
}

fn refused(inside: &str) -> String {
    of(inside).map(|mesh| mesh.triangles.len()).unwrap_err().to_string()
}

#[test]
fn objects_of_objects_are_placed_in_metres() {
    let mesh = of(&format!(
        "<resources><object id=\"1\">{MESH}</object><object id=\"2\"><components>\
         <component objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 10 0 0\"/>\
         <component objectid=\"1\" transform=\"-1 0 0 0 1 0 0 0 1 0 0 0\"/></components></object></resources>\
         <build><item objectid=\"2\" transform=\"2 0 0 0 2 0 0 0 2 0 0 5\"/></build>"
    ))
    .unwrap();
    let expected = [[20.0, 0.0, 5.0], [22.0, 0.0, 5.0], [20.0, 2.0, 5.0], [0.0, 0.0, 5.0], [-2.0, 0.0, 5.0]];
    for (found, expected) in mesh.positions.iter().zip(expected) {
        assert!(found.abs_diff_eq(DVec3::from_array(expected) * 1e-3, 1e-15), "{found}");
    }
    // The mirrored one keeps its front.
    assert_eq!(mesh.triangles, [[0, 1, 2], [3, 5, 4]]);
    assert!(mesh.vertex_attributes.is_empty());
}

#[test]
fn objects_may_lie_in_other_parts() {
    let other = format!("<model unit=\"meter\"><resources><object id=\"7\">{MESH}</object></resources></model>");
    let root = format!(
        "{HEAD}<resources><object id=\"1\"><components><component p:path=\"/3D/Objects/b.model\" objectid=\"7\"/></components>\
         </object></resources><build><item objectid=\"1\"/></build></model>"
    );
    let parts = [("3D/a.model", root.as_str()), ("3D/Objects/b.model", &other)];
    let mesh = read_parts(&parts).unwrap();
    // The unit of the model holds for all parts.
    assert_eq!(mesh.positions[1], DVec3::X * 1e-3);
    let error = read_parts(&parts[..1]).unwrap_err().to_string();
    assert!(error.contains("b.model") && error.contains("there is no such file in the archive"), "{error}");
}

#[test]
fn a_build_of_nothing_is_all_that_nothing_contains() {
    let two = format!(
        "<resources><object id=\"1\">{MESH}</object><object id=\"2\"><components><component objectid=\"1\"/></components></object>\
         <object id=\"3\">{MESH}</object></resources><build/>"
    );
    assert_eq!(of(&two).unwrap().triangles.len(), 2);
}

#[test]
fn colours_come_from_groups_and_materials() {
    let coloured = MESH.replace("v3=\"2\"", "v3=\"2\" pid=\"5\" p1=\"0\" p2=\"1\" p3=\"0\"");
    let mesh = of(&format!(
        "<resources><m:colorgroup id=\"5\"><m:color color=\"#010203\"/><m:color color=\"#0A0b0C80\"/></m:colorgroup>\
         <basematerials id=\"6\"><base name=\"red\" displaycolor=\"#FF0000\"/></basematerials>\
         <object id=\"1\">{coloured}</object><object id=\"2\" pid=\"6\" pindex=\"0\">{MESH}</object>\
         <object id=\"3\">{MESH}</object></resources>\
         <build><item objectid=\"1\"/><item objectid=\"2\"/><item objectid=\"3\"/></build>"
    ))
    .unwrap();
    let Some(AttributeData::Colour(colours)) = mesh.vertex_attribute("colour") else { panic!("no colours") };
    let (red, white) = ([255, 0, 0, 255], [255; 4]);
    let first = [1, 2, 3, 255];
    assert_eq!(*colours, [first, [10, 11, 12, 128], first, red, red, red, white, white, white]);
}

#[test]
fn damaged_and_foreign_files_are_refused() {
    let object = format!("<resources><object id=\"1\">{MESH}</object></resources>");
    for (inside, expected) in [
        (
            format!("{object}<build><item objectid=\"2\"/></build>"),
            "3D/a.model, object 2: it is placed, but it is not there",
        ),
        (MESH.to_owned(), "there is no triangle"),
        (object.replace("v3=\"2\"", "v3=\"3\""), "triangle 0 names vertex 3: there are 3 vertices"),
        (object.replace("v3=\"2\"", ""), "triangle 0 must have whole numbers v1, v2 and v3"),
        (object.replace("v3=\"2\"", "v3=\"-1\""), "triangle 0 must have whole numbers v1, v2 and v3"),
        (object.replace("v3=\"2\"", "v3=\"4294967296\""), "triangle 0 must have whole numbers v1, v2 and v3"),
        (object.replace("v3=\"2\"", "v3=\"4294967295\""), "triangle 0 names vertex 4294967295: there are 3 vertices"),
        (
            "<resources><object id=\"1\"><mesh><vertices/><triangles/></mesh></object></resources>".to_owned(),
            "there is no triangle",
        ),
        (
            format!(
                "<resources><object id=\"1\">{}</object></resources>",
                MESH.split("<triangles>").next().unwrap().to_owned() + "</mesh>"
            ),
            "there is no triangle",
        ),
        (object.replace("x=\"1\"", "x=\"-inf\""), "vertex 1 must have finite numbers x, y and z"),
        (object.replace("x=\"1\"", "x=\"1e999\""), "vertex 1 must have finite numbers x, y and z"),
        (
            format!(
                "{}<build><item objectid=\"1\" transform=\"1e9 0 0 0 1 0 0 0 1 0 0 0\"/></build>",
                object.replace("x=\"1\"", "x=\"1e306\"")
            ),
            "vertex 1 is placed beyond the largest number",
        ),
        (
            format!("{object}<build><item objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 inf 0 0 0\"/></build>"),
            "must be twelve finite numbers",
        ),
        (object.clone() + &object, "object 1 is there twice"),
        (object.replace("id=\"1\"", "id=\"&a;\""), "a`"),
        (object.replace("x=\"1\"", "x=\"nan\""), "vertex 1 must have finite numbers x, y and z"),
        (object.replace("x=\"1\"", ""), "vertex 1 must have finite numbers x, y and z"),
        (object.replace("id=\"1\"", "id=\"one\""), "id must be a whole number, got \"one\""),
        (object.replace("</mesh>", ""), "expected `</mesh>`"),
        (format!("{object}<build><item objectid=\"1\" transform=\"1 2\"/></build>"), "must be twelve finite numbers"),
        ("<resources><colorgroup id=\"1\"><color color=\"red\"/></colorgroup></resources>".to_owned(), "#RRGGBB"),
        (
            "<resources><object id=\"1\"><components><component objectid=\"1\"/></components></object></resources>\
             <build><item objectid=\"1\"/></build>"
                .to_owned(),
            "objects contain each other more than 64 deep",
        ),
    ] {
        let error = refused(&inside);
        assert!(error.contains(expected), "{inside}: {error}");
    }
    for (text, expected) in [
        (format!("{HEAD}\n{object}\n"), "3D/a.model, line 3: it ends within an element"),
        (format!("<!DOCTYPE model [<!ENTITY a \"aaaa\">]>{HEAD}{object}</model>"), "3MF files have no DTD"),
        (format!("{HEAD}{}", "<a>".repeat(300)), "elements are nested more than 256 deep"),
        (String::new(), "there is no model in it"),
    ] {
        let error = read_parts(&[("3D/a.model", &text)]).unwrap_err().to_string();
        assert!(error.contains(expected), "{text}: {error}");
    }
    let asks = HEAD.replace(
        "<model ",
        "<model requiredextensions=\"b\" xmlns:b=\"http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02\" ",
    );
    let error = read_parts(&[("3D/a.model", &format!("{asks}{object}</model>"))]).unwrap_err().to_string();
    assert!(error.contains("it needs http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02"), "{error}");
    let error = read_parts(&[("3D/a.model", &format!("{}{object}</model>", HEAD.replace("millimeter", "mile")))]);
    assert!(error.unwrap_err().to_string().contains("unit must be one of micron, millimeter"));
    let error = read_parts(&[("3D/a.model", "<html></html>")]).unwrap_err().to_string();
    assert!(error.contains("there is no model in it"), "{error}");
}

/// Theorem: objects that multiply, 2^40 times here, end in an error, and soon.
#[test]
fn objects_that_multiply_are_refused() {
    let mut resources = format!("<resources><object id=\"0\">{MESH}</object>");
    for id in 1..=40 {
        let inner = format!("<component objectid=\"{}\"/>", id - 1).repeat(2);
        resources += &format!("<object id=\"{id}\"><components>{inner}</components></object>");
    }
    let error = refused(&format!("{resources}</resources><build><item objectid=\"40\"/></build>"));
    assert!(error.contains("objects are placed, which is the most"), "{error}");
}

/// Theorem: objects in other parts that contain each other end in an error.
#[test]
fn a_circle_of_parts_is_refused() {
    let part = |id: u32, path: &str, inner: u32| {
        format!(
            "{HEAD}<resources><object id=\"{id}\"><components><component p:path=\"{path}\" objectid=\"{inner}\"/></components>\
             </object></resources><build><item objectid=\"{id}\"/></build></model>"
        )
    };
    let error = read_parts(&[("3D/a.model", &part(1, "/3D/b.model", 2)), ("3D/b.model", &part(2, "/3D/a.model", 1))]);
    let error = error.unwrap_err().to_string();
    assert!(error.contains("objects contain each other more than 64 deep"), "{error}");
}

/// Theorem: a small file that unpacks to gigabytes ends in an error, of which the memory that it takes is far from as much.
#[test]
fn bombs_are_refused() {
    let (begin, end) =
        (format!("{HEAD}<resources><object id=\"1\">{MESH}</object></resources><build>"), "</build></model>");
    let zeros = "0".repeat(40 << 20);
    let items = "<item objectid=\"1\"/>".repeat((1 << 20) + 1);
    for (inside, expected) in [
        (zeros.as_str(), "a tag or a text is longer than 16 MiB, which is the most"),
        (&format!("<!--{zeros}-->"), "a tag or a text is longer than 16 MiB, which is the most"),
        (&format!("<item objectid=\"{zeros}\"/>"), "a tag or a text is longer than 16 MiB, which is the most"),
        (&items, "more than 1048576 objects and materials, which is the most"),
    ] {
        let (_folder, path) = packed(&[("_rels/.rels", RELS), ("3D/a.model", &format!("{begin}{inside}{end}"))]);
        assert!(std::fs::metadata(&path).unwrap().len() < 1 << 20);
        let error = import::open(&path).unwrap().scans[0].read().map(|_| ()).unwrap_err().to_string();
        assert!(error.contains("3D/a.model, line 1") && error.contains(expected), "{error}");
        // All parts together have so many bytes at most.
        let options = ReadOptions { max_decoded_gib: 0.01, ..ReadOptions::default() };
        let error = import::open_with(&[&path], &options, &Progress::none()).unwrap().scans[0]
            .read()
            .map(|_| ())
            .unwrap_err()
            .to_string();
        assert!(error.contains("more than they can or than max_decoded_gib allows"), "{error}");
    }
    // A list of relations is read likewise.
    let (_folder, path) = packed(&[("_rels/.rels", &zeros)]);
    let error = import::open(&path).unwrap().scans[0].read().map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("_rels/.rels, line 1: ") && error.contains("longer than 16 MiB"), "{error}");
}

/// Theorem: parts that each are within the limit are not, if all together are beyond it.
#[test]
fn the_limit_is_that_of_all_parts() {
    let other = |next: u32| {
        let spaces = " ".repeat(600 << 10);
        format!(
            "{HEAD}{spaces}<resources><object id=\"1\"><components><component p:path=\"/3D/{next}.model\" objectid=\"1\"/>\
             </components></object></resources></model>"
        )
    };
    let first = format!("{}<build><item objectid=\"1\"/></build></model>", other(1).trim_end_matches("</model>"));
    let (_folder, path) =
        packed(&[("_rels/.rels", RELS), ("3D/a.model", &first), ("3D/1.model", &other(2)), ("3D/2.model", &other(1))]);
    let read = |mebibytes: f64| {
        let options = ReadOptions { max_decoded_gib: mebibytes / 1024.0, ..ReadOptions::default() };
        import::open_with(&[&path], &options, &Progress::none()).unwrap().scans[0]
            .read()
            .map(|_| ())
            .unwrap_err()
            .to_string()
    };
    let error = read(1.7);
    assert!(error.contains("2.model") && error.contains("max_decoded_gib allows"), "{error}");
    let error = read(1.8);
    assert!(error.contains("objects contain each other"), "{error}");
}

/// Theorem: a package that is cut off anywhere is refused, and so is one with a wrong byte in its model, or it is a mesh all the same.
#[test]
fn cut_and_damaged_packages_are_refused() {
    let text = format!("{HEAD}<resources><object id=\"1\">{MESH}</object></resources><build/></model>");
    let (folder, path) = packed(&[("[Content_Types].xml", "<Types/>"), ("_rels/.rels", RELS), ("3D/a.model", &text)]);
    let bytes = std::fs::read(&path).unwrap();
    assert!(import::open(&path).unwrap().scans[0].read().is_ok());
    let path = folder.path().join("b.3mf");
    let read = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        import::open(&path).and_then(|set| set.scans[0].read())
    };
    for length in 0..bytes.len() {
        let error = read(&bytes[..length]).map(|_| ()).unwrap_err();
        assert!(matches!(error, Error::Format { .. } | Error::Input(_)), "{length}: {error:?}");
        // Before that the start does not tell what the file is.
        let is_told = error.to_string().contains("the archive was cut off or is damaged, so copy or export it again");
        assert!(is_told || length < 64, "{length}: {error}");
    }
    let mut refused = 0;
    for at in 0..bytes.len() {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x55;
        match read(&damaged) {
            Ok(Content::Mesh(mesh)) => assert_eq!(mesh.triangles, [[0, 1, 2]], "{at}"),
            Ok(_) => panic!("{at}: no mesh"),
            Err(Error::Format { .. } | Error::Input(_)) => refused += 1,
            Err(other) => panic!("{at}: {other:?}"),
        }
    }
    assert!(refused > bytes.len() / 2, "{refused} of {}", bytes.len());
}

/// Theorem: a wrong byte anywhere in a model is told as damage, whatever else it makes of the text.
#[test]
fn damage_is_told_as_such() {
    let text = format!("{HEAD}<resources><object id=\"1\">{MESH}</object></resources><build/></model>");
    let (folder, path) = package(&[("_rels/.rels", RELS), ("3D/a.model", &text)]);
    let bytes = std::fs::read(&path).unwrap();
    let begin = memchr::memmem::find(&bytes, text.as_bytes()).unwrap();
    let path = folder.path().join("b.3mf");
    for at in begin..begin + text.len() {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x11;
        std::fs::write(&path, damaged).unwrap();
        let error = import::open(&path).unwrap().scans[0].read().map(|_| ()).unwrap_err().to_string();
        assert!(
            error.contains("it unpacks to something else than was packed: the archive is damaged"),
            "{at}: {error}"
        );
    }
}

#[test]
fn archives_that_are_no_package_stay_recordings() {
    let (_folder, path) = package(&[("rgbd/0.jpg", "")]);
    let error = import::open(&path).unwrap_err().to_string();
    assert!(error.contains("this archive is no recording that is known"), "{error}");
    let (_folder, path) = package(&[("[Content_Types].xml", "<Types/>")]);
    let error = import::open(&path).unwrap().scans[0].read().map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("there is no _rels/.rels: it is no 3MF file. Export the model again"), "{error}");
}
