//! Disks that fail while a file is written: the k-th write, for every k, of every format.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::io::{Error, Result};
use std::path::Path;

use glam::{DAffine3, DVec3};

use super::*;
use base::progress::Progress;
use image::range_image::{RangeImage, Viewing};
use mesh::point_cloud::PointCloud;
use mesh::{Attribute, QuadMesh, TriMesh};

thread_local! {
    /// Writes of this thread that go well before all fail.
    static GOOD: Cell<u64> = const { Cell::new(u64::MAX) };
}

/// Most bytes a write takes while failures are tried: so that there are many writes to fail.
const FEW: usize = 97;

/// The part of some bytes that may be written now.
pub(super) fn write(bytes: &[u8]) -> Result<&[u8]> {
    match GOOD.get() {
        u64::MAX => Ok(bytes),
        0 => Err(Error::other("disk full")),
        good => {
            GOOD.set(good - 1);
            Ok(&bytes[..bytes.len().min(FEW)])
        }
    }
}

pub(crate) type Write = Box<dyn Fn(&Path, &Progress<'_>) -> base::error::Result<()>>;

/// Something of every format, larger than one write.
pub(crate) fn writers() -> Vec<(&'static str, Write)> {
    let positions: Vec<DVec3> = (0..60).map(|i| DVec3::new(f64::from(i) * 0.1, f64::from(i * i), 1.0)).collect();
    let mut mesh = TriMesh::new(positions.clone(), (0..58).map(|i| [i, i + 1, i + 2]).collect());
    mesh.vertex_attributes.push(Attribute::colour("colour", vec![[1, 2, 3, 255]; 60]));
    let quads = QuadMesh {
        positions: positions.clone(),
        quads: (0..57).map(|i| [i, i + 1, i + 3, i + 2]).collect(),
        ..QuadMesh::default()
    };
    let cloud = PointCloud { positions, ..PointCloud::default() };
    let points = (0..60).map(|i| if i % 5 == 1 { [f32::NAN; 3] } else { [i as f32 * 0.25, -0.5, 3.0] }).collect();
    let mut image = RangeImage::from_points(6, 10, points, Viewing::From(DVec3::ZERO)).unwrap();
    image.intensity = Some(vec![0.5; 60]);
    image.name = "a".to_owned();
    let mut other = image.clone();
    other.name = "b".to_owned();
    let images = move || vec![image.clone(), other.clone()];
    let mut writers: Vec<(&'static str, Write)> = Vec::new();
    for encoding in [PlyEncoding::Ascii, PlyEncoding::BinaryLittleEndian] {
        let (mesh, cloud, quads, images) = (mesh.clone(), cloud.clone(), quads.clone(), images.clone());
        writers.push(("mesh.ply", Box::new(move |path, progress| write_ply(path, &mesh, encoding, progress))));
        writers.push(("quads.ply", Box::new(move |path, progress| write_quads_ply(path, &quads, encoding, progress))));
        writers
            .push(("points.ply", Box::new(move |path, progress| write_points_ply(path, &cloud, encoding, progress))));
        let grid = images()[0].clone();
        writers
            .push(("grid.ply", Box::new(move |path, progress| write_range_grid_ply(path, &grid, encoding, progress))));
        writers.push((
            "list.conf",
            Box::new(move |path, progress| {
                write_scan_list(path, &images().iter().collect::<Vec<_>>(), encoding, progress)
            }),
        ));
    }
    let pieces = mesh.clone();
    writers.push((
        "pieces.ply",
        Box::new(move |path, progress| {
            write_ply_in_pieces(
                path,
                PlyOptions::default(),
                |sink| {
                    sink.begin(&pieces.outline())?;
                    progress.check()?;
                    let entries = |list: &[Attribute]| list.iter().map(|of| of.data.clone()).collect::<Vec<_>>();
                    let corners: Vec<[u64; 3]> = pieces.triangles.iter().map(|t| t.map(u64::from)).collect();
                    sink.triangles(0, &corners, &entries(&pieces.face_attributes))?;
                    sink.vertices(0, &pieces.positions, &entries(&pieces.vertex_attributes))
                },
                progress,
            )
        }),
    ));
    let parts = mesh.clone();
    writers.push((
        "parts.ply",
        Box::new(move |path, progress| {
            write_ply(path, &parts, PlyOptions { part_triangles: 1, ..PlyOptions::default() }, progress)
        }),
    ));
    let (first, second) = (mesh.clone(), mesh.clone());
    writers.push(("mesh.obj", Box::new(move |path, progress| write_obj(path, &first, None, progress))));
    writers.push(("mesh.stl", Box::new(move |path, progress| write_stl(path, &second, 0.001, progress))));
    let third = mesh.clone();
    writers.push((
        "mesh.3mf",
        Box::new(move |path, progress| write_3mf(path, "a", &third, &GlbOptions::default(), progress)),
    ));
    writers.push((
        "mesh.glb",
        Box::new(move |path, progress| {
            let node = GlbNode {
                name: "a",
                mesh: &mesh,
                world_from_mesh: DAffine3::IDENTITY,
                coarser: &[&mesh],
                images: None,
            };
            write_glb(path, &[node], &GlbOptions::default(), progress)
        }),
    ));
    writers.push((
        "textured.glb",
        Box::new(move |path, progress| {
            let (mesh, images) = (sheet::mesh(), sheet::images());
            let place = DAffine3::IDENTITY;
            let node = GlbNode { name: "a", mesh: &mesh, world_from_mesh: place, coarser: &[], images: Some(&images) };
            write_glb(path, &[node], &GlbOptions::default(), progress)
        }),
    ));
    writers.push((
        "textured.obj",
        Box::new(move |path, progress| {
            let form = ImageOptions { image_format: ImageFormat::Jpeg, ..ImageOptions::default() };
            write_textured_obj(path, &sheet::mesh(), &sheet::images(), &form, None, progress)
        }),
    ));
    let both = images();
    writers.push((
        "scans.ptx",
        Box::new(move |path, progress| write_ptx(path, &both.iter().collect::<Vec<_>>(), progress)),
    ));
    let both = images();
    writers.push((
        "scans.e57",
        Box::new(move |path, progress| write_e57(path, &both.iter().collect::<Vec<_>>(), None, progress)),
    ));
    writers
}

fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    entries.map(|e| (e.file_name().into_string().unwrap(), std::fs::read(e.path()).unwrap())).collect()
}

/// Theorem: whichever write fails, first to last, the error is the disk's and names the file, nothing is left, and files that were there
/// are untouched. Writes that take few bytes change nothing.
#[test]
fn any_write_may_fail() {
    for (name, write) in writers() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        write(&path, &Progress::none()).unwrap();
        let whole = files(folder.path());
        let old: BTreeMap<String, Vec<u8>> = whole.keys().map(|name| (name.clone(), b"old".to_vec())).collect();
        for (name, content) in &old {
            std::fs::write(folder.path().join(name), content).unwrap();
        }
        for good in 0.. {
            GOOD.set(good);
            let outcome = write(&path, &Progress::none());
            let left = GOOD.replace(u64::MAX);
            match outcome {
                Err(base::error::Error::Io { path, source }) => {
                    assert!(path.starts_with(folder.path()) && source.to_string().contains("disk full"), "{source}");
                    assert!(files(folder.path()) == old, "{name}: write {good} failing leaves something behind");
                }
                Err(other) => panic!("{name}: write {good} failing gives {other:?}"),
                Ok(()) => {
                    assert!(good > 4 && files(folder.path()) == whole, "{name}: {good} writes, {left} left");
                    break;
                }
            }
        }
    }
}

/// Theorem: cancelled at any look at the progress, first to last, nothing is left and files that were there are untouched.
#[test]
fn any_look_may_cancel() {
    for (name, write) in writers() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        for checks in 0.. {
            match write(&path, &Progress::cancel_after(checks)) {
                Err(base::error::Error::Cancelled) => assert!(files(folder.path()).is_empty(), "{name}: {checks}"),
                Err(other) => panic!("{name}: {other:?}"),
                Ok(()) => {
                    assert!(checks > 0, "{name} never looks");
                    break;
                }
            }
        }
    }
}
