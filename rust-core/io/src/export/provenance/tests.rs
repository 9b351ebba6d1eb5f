use super::super::*;
use super::*;
use crate::import;
use base::progress::Progress;
use image::range_image::{RangeImage, Viewing};
use mesh::TriMesh;

/// Writes provenance in each format that has a place for it, with a system and without, and reads it back.
fn written(said: &Provenance) -> Result<Vec<Option<Provenance>>> {
    let folder = tempfile::tempdir().unwrap();
    let mut read = Vec::new();
    for crs in [None, Some(Crs::new("EPSG:25832").unwrap())] {
        let mesh = TriMesh {
            crs: crs.clone(),
            ..TriMesh::new(vec![glam::DVec3::ZERO, glam::DVec3::X, glam::DVec3::Y], vec![[0, 1, 2]])
        };
        for ending in ["ply", "obj", "glb"] {
            let path = folder.path().join(format!("a.{ending}"));
            let options = WriteOptions { provenance: Some(said.clone()), ..WriteOptions::default() };
            write_mesh(&path, &mesh, &[], &options, &Progress::none())?;
            read.push(import::provenance(&path)?);
            assert_eq!(import::open(&path)?.scans[0].crs()?, crs, "{ending}");
        }
        let path = folder.path().join("a.e57");
        let mut image = RangeImage::from_points(1, 2, vec![[1.0; 3]; 2], Viewing::From(glam::DVec3::ZERO))?;
        image.crs = crs.clone();
        write_e57(&path, &[&image], Some(said), &Progress::none())?;
        read.push(import::provenance(&path)?);
        assert_eq!(import::open(&path)?.scans[0].crs()?, crs, "e57");
    }
    Ok(read)
}

fn said(value: &Value) -> Provenance {
    Provenance::from_json(&value.to_string()).unwrap()
}

/// Theorem: whatever is said is read back, and says nothing of the coordinate reference system, whatever its keys.
#[test]
fn what_is_said_is_read_back() {
    let long = "\u{1f5ff}ä\\\"\n]]>".repeat(1000);
    for value in [
        serde_json::json!({}),
        serde_json::json!({"crs": "EPSG:4326", "crs_unit": "degree", "text": "x", "surfrecon_crs": {"text": "EPSG:1"}}),
        serde_json::json!({"crs": {"text": "EPSG:4326", "unit": "degree"}}),
        serde_json::json!({"a": [], "b": {}, "c": [[]], "d": [{}], "e": null, "f": [[1], [2]], "g": {"h": [1, {}]}}),
        serde_json::json!({"thirds": [1.0 / 3.0, 2.0e-308, 1.797_693_134_862_315_7e308, u64::MAX, i64::MIN, -0.0, 0.1 + 0.2]}),
        serde_json::json!({
            "command": "merge",
            "parameters": {"voxel": 0.1, "levels": [1, 2, 3], "one": {"two": null}},
            "inputs": [{"name": "é.ply"}, {"name": long}, []],
        }),
    ] {
        let said = said(&value);
        assert_eq!(said.to_json(), value.to_string());
        for read in written(&said).unwrap() {
            assert_eq!(read.unwrap().to_json(), value.to_string());
        }
    }
}

/// Theorem: what is too long to be found again is refused, and what is as long as can be is found.
#[test]
fn nothing_is_too_long_to_be_read() {
    let of_length = |length: usize| said(&serde_json::json!({"notes": vec!["x".repeat(1000); length / 1100]}));
    let long = of_length(LONGEST);
    assert!(written(&long).unwrap().into_iter().all(|read| read.as_ref() == Some(&long)));
    let one = said(&serde_json::json!({"note": "x".repeat(LONGEST - 100_000)}));
    assert!(written(&one).unwrap().into_iter().all(|read| read.as_ref() == Some(&one)));
    let folder = tempfile::tempdir().unwrap();
    let error = written(&of_length(2 * LONGEST)).unwrap_err().to_string();
    let expected = "bytes of the file, more than 4194304: leave something of it out, or keep it in a file of its own";
    assert!(error.starts_with("provenance would take ") && error.ends_with(expected), "{error}");
    let path = folder.path().join("long.ply");
    let options = PlyOptions { provenance: Some(of_length(2 * LONGEST)), ..PlyOptions::default() };
    assert!(write_ply(&path, &TriMesh::default(), options, &Progress::none()).is_err());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn lines_are_short_and_ascii() {
    let long = said(&serde_json::json!({"long": "\u{1f5ff}ä\n".repeat(1000), "b": [1, 2]}));
    let crs = Crs::new(&format!("PROJCS[\"{}\"]", "Gauß".repeat(500))).unwrap();
    let lines = comments("comment", Some(&long), Some(&crs)).unwrap();
    for line in lines.lines() {
        assert!(line.is_ascii() && line.len() < 1000 && line.starts_with("comment surfrecon "), "{line}");
    }
    assert!(lines.contains("\ncomment surfrecon crs {\"text\":\"PROJCS[") && lines.lines().count() > 20);
    assert_eq!(comments("#", None, None).unwrap() + &extras(None, None).unwrap(), "");
    assert!(extras(Some(&long), Some(&crs)).unwrap().is_ascii());
}

#[test]
fn what_is_no_object_is_refused() {
    let deep = |depth: usize| format!("{}1{}", "{\"a\":".repeat(depth), "}".repeat(depth));
    let said = Provenance::from_json(&deep(DEEPEST)).unwrap();
    assert!(written(&said).unwrap().into_iter().all(|read| read.as_ref() == Some(&said)));
    for (text, problem) in [
        (deep(DEEPEST + 1).as_str(), "is nested more than 100 times"),
        ("[]", "must be a JSON object, got []"),
        ("{", "must be JSON: "),
        ("", "must be JSON: "),
    ] {
        let error = Provenance::from_json(text).unwrap_err().to_string();
        assert!(error.contains(problem), "{error}");
    }
}
