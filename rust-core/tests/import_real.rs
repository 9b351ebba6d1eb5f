//! Reads the real scan sets named in the environment variable SURFRECON_DATA.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

use std::path::PathBuf;

use surfrecon::import::{self, Content};

fn data() -> Option<PathBuf> {
    let data = std::env::var_os("SURFRECON_DATA").map(PathBuf::from);
    if data.is_none() {
        println!("SKIPPED: SURFRECON_DATA is not set");
    }
    data
}

/// Opens a set, checks that its quaternions are found to rotate world to scan, and counts the samples of each scan.
fn samples(conf: &str) -> Option<Vec<(String, usize)>> {
    let set = import::open(&data()?.join(conf)).unwrap();
    let note = set.notes.last().unwrap();
    println!("{note}");
    assert!(note.contains(".conf: quaternions read as (x y z w) rotating world to scan (median overlap distance"));
    Some(
        set.scans
            .iter()
            .map(|scan| {
                let Content::RangeImage(image) = scan.read().unwrap() else {
                    panic!("{} is no range image", scan.name)
                };
                assert_eq!(image.name, scan.name);
                assert_eq!(image.world_from_sensor, scan.world_from_sensor);
                let preview = scan.preview_points(1000).unwrap();
                assert!((800..=1200).contains(&preview.len()), "{}: {} points", scan.name, preview.len());
                (scan.name.clone(), image.valid_count())
            })
            .collect(),
    )
}

#[test]
fn bunny() {
    let Some(samples) = samples("stanford_bunny/bun.conf") else { return };
    let expected = [
        ("bun000", 40_256),
        ("bun045", 40_097),
        ("bun090", 30_379),
        ("bun180", 40_251),
        ("bun270", 31_701),
        ("top2", 38_298),
        ("top3", 36_023),
        ("bun315", 35_336),
        ("chin", 37_738),
        ("ear_back", 32_193),
    ];
    assert_eq!(samples, expected.map(|(name, count)| (name.to_owned(), count)));
}

#[test]
fn dragon() {
    let Some(samples) = samples("stanford_dragon_stand/dragonStandRight.conf") else { return };
    assert_eq!((samples.len(), samples.iter().map(|s| s.1).sum::<usize>()), (15, 469_193));
}

#[test]
fn happy() {
    let Some(samples) = samples("stanford_happy_stand/happyStandRight.conf") else { return };
    assert_eq!((samples.len(), samples.iter().map(|s| s.1).sum::<usize>()), (15, 1_099_005));
}

#[test]
fn meshes() {
    let Some(data) = data() else { return };
    let files = [
        ("stanford_bunny/bun_zipper.ply", 35_947, 69_451, &["confidence", "intensity"][..]),
        ("meshes/dragon_vrip_res2.ply", 100_250, 202_520, &[]),
        ("meshes/igea.ply", 134_345, 268_686, &[]),
        ("meshes/horse.ply", 48_485, 96_966, &[]),
        ("points/bunny70k.ply", 34_834, 69_451, &[]),
        ("meshlab_rangemaps/lato000.ply", 44_461, 86_766, &["quality"]),
    ];
    for (file, vertices, triangles, attributes) in files {
        let set = import::open(&data.join(file)).unwrap();
        let Content::Mesh(mesh) = set.scans[0].read().unwrap() else { panic!("{file} is no mesh") };
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (vertices, triangles), "{file}");
        assert_eq!(mesh.vertex_attributes.iter().map(|a| a.name.as_str()).collect::<Vec<_>>(), attributes);
        mesh.validate().unwrap();
    }
}
