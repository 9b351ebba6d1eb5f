//! Disks that fail while a file is read: the k-th read, for every k, of every format and of every file beside it.

use std::path::{Path, PathBuf};

use super::faults::{FAULT, Fault};
use super::opening::open_with;
use super::options::ReadOptions;
use super::scan::Content;
use base::progress::Progress;

/// The contents of files and of their scans, in words.
pub(crate) fn outcome_of(paths: &[PathBuf]) -> base::error::Result<String> {
    read_all(paths, Fault::None).0
}

/// Opens files and reads all their scans while `fault` is on. The outcome and the fault afterwards.
fn read_all(paths: &[PathBuf], fault: Fault) -> (base::error::Result<String>, Fault) {
    FAULT.set(fault);
    let outcome = open_with(paths, &ReadOptions::default(), &Progress::none()).and_then(|set| {
        let mut text = String::new();
        for scan in &set.scans {
            text += &match scan.read()? {
                Content::RangeImage(image) => format!("{image:?}"),
                Content::Mesh(mesh) => format!("{mesh:?}"),
                Content::Points(cloud) => format!("{cloud:?}"),
            };
            text += &format!("{:?}", scan.preview_points(3)?);
        }
        Ok(text)
    });
    (outcome, FAULT.replace(Fault::None))
}

/// Sets of files that open together: each seed of the fuzz targets, and lists, cameras, trajectories and poses with scans.
pub(crate) fn sets(folder: &Path) -> Vec<Vec<PathBuf>> {
    let seeds = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/seeds");
    let mut sets = Vec::new();
    for kind in ["import_scan", "import_ply", "import_points", "import_frames"] {
        for seed in std::fs::read_dir(seeds.join(kind)).unwrap() {
            let seed = seed.unwrap().path();
            // Parts of a recording open with the whole alone.
            let is_whole = seed.extension().is_some_and(|ending| ending == "r3d" || ending == "sens");
            if kind == "import_frames" && !is_whole {
                continue;
            }
            // A copy: what lies beside it in the folder belongs to it.
            let copy = folder.join(kind).join(seed.file_stem().unwrap()).join(seed.file_name().unwrap());
            std::fs::create_dir_all(copy.parent().unwrap()).unwrap();
            std::fs::copy(&seed, &copy).unwrap();
            sets.push(vec![copy]);
        }
    }
    let ply = std::fs::read(seeds.join("import_ply/grid_little.ply")).unwrap();
    let pgm = std::fs::read(seeds.join("import_scan/map.pgm")).unwrap();
    let identity = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
    let put = |name: &str, content: &[u8]| {
        let path = folder.join("lists").join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, content).unwrap();
        path
    };
    for name in ["a.ply", "b.ply", "posed/c.ply"] {
        put(name, &ply);
    }
    put("posed/c.xf", identity.as_bytes());
    let conf = put("s.conf", b"bmesh a.ply 0 0 0 0 0 0 1\nbmesh b.ply 1 0 0 0 0.6 0 0.8\n");
    let aln = put("s.aln", format!("2\na.ply\n#\n{identity}b.ply\n#\n{identity}0\n").as_bytes());
    let mlp = put(
        "s.mlp",
        b"<!DOCTYPE MeshLabDocument><MeshLabProject><MeshGroup><MLMesh filename=\"a.ply\" label=\"a\"/></MeshGroup>\
          </MeshLabProject>",
    );
    let depth = put("depth/0.pgm", &pgm);
    let camera = put("depth/camera.json", br#"{"fx": 2, "fy": 2, "cx": 0.5, "cy": 0.5}"#);
    let trajectory = put("depth/trajectory.log", format!("0 0 1\n{identity}").as_bytes());
    let buffer: Vec<u8> = [0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].map(f32::to_le_bytes).concat();
    put("buffer.bin", &buffer);
    let gltf = put(
        "split.gltf",
        br#"{"asset": {"version": "2.0"}, "buffers": [{"uri": "buffer.bin", "byteLength": 36}],
            "bufferViews": [{"buffer": 0, "byteLength": 36}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}], "nodes": [{"mesh": 0}],
            "scenes": [{"nodes": [0]}]}"#,
    );
    sets.extend([
        vec![conf],
        vec![aln],
        vec![mlp],
        vec![gltf],
        vec![folder.join("lists/posed/c.ply")],
        vec![depth, camera, trajectory],
    ]);
    sets
}

/// Theorem: whichever read of a file fails, first to last, the error is the disk's and names the file. Reads that give few bytes or are
/// interrupted change nothing.
#[test]
fn any_read_may_fail() {
    let folder = tempfile::tempdir().unwrap();
    check(folder.path(), sets(folder.path()));
}

/// Has every read of the sets of files in a folder fail, one after the other.
pub(super) fn check(folder: &Path, sets: Vec<Vec<PathBuf>>) {
    let mut wrong = Vec::new();
    for paths in sets {
        let name = paths[0].strip_prefix(folder).unwrap().display();
        let whole = read_all(&paths, Fault::None).0.unwrap_or_else(|error| panic!("{error}"));
        let interrupted = read_all(&paths, Fault::Interrupted(false)).0;
        if interrupted.as_ref().ok() != Some(&whole) {
            wrong.push(format!("{name}, interrupted: {:?}", interrupted.err()));
        }
        for good in 0.. {
            match read_all(&paths, Fault::After(good)) {
                (Err(base::error::Error::Io { path, source }), _)
                    if path.starts_with(folder) && source.to_string().contains("broken disk") => {}
                (Err(other), _) => wrong.push(format!("{name}, read {good} fails: {other:?}")),
                // Past the last read.
                (Ok(_), Fault::After(left)) if left > 0 => {
                    assert!(good > 2, "{name}: {good} reads");
                    break;
                }
                // The read that found the end.
                (Ok(text), _) if text == whole => {}
                (Ok(_), _) => wrong.push(format!("{name}, read {good} fails: another result")),
            }
        }
    }
    assert!(wrong.is_empty(), "{} wrong:\n{}", wrong.len(), wrong.join("\n"));
}
