//! Misfits that no rigid pose explains are measured and said.

use base::progress::Progress;
use glam::{DAffine3, DVec3};
use image::source::{PlacedMesh, ScanSource};
use mesh::TriMesh;
use surfrecon_align::{AlignParams, Alignment, Constraints, Prepared, run};

use crate::scans::{around, sources, statue};

/// The statue's views as meshes, points changed by `change` in one of them, by where they are in the world.
fn bent(which: usize, change: impl Fn(DVec3) -> DVec3) -> (Vec<TriMesh>, Vec<DAffine3>) {
    let images = around(statue(), 5, 0.0);
    let mesh = |(k, image): (usize, &image::RangeImage)| {
        let surface = image.load(&image::source::Loading::default(), &Progress::none()).unwrap();
        let to_world = image.world_from_sensor;
        let place = |p: &DVec3| match k == which {
            true => to_world.inverse().transform_point3(change(to_world.transform_point3(*p))),
            false => *p,
        };
        let positions = surface.positions.iter().map(place).collect();
        TriMesh { positions, triangles: surface.triangles, ..TriMesh::default() }
    };
    (images.iter().enumerate().map(mesh).collect(), images.iter().map(|image| image.world_from_sensor).collect())
}

fn aligned(meshes: &[TriMesh]) -> Alignment {
    let placed: Vec<PlacedMesh<&TriMesh>> = meshes
        .iter()
        .enumerate()
        .map(|(k, mesh)| PlacedMesh { name: format!("mesh {k}"), mesh, world_from_mesh: DAffine3::IDENTITY })
        .collect();
    let sources: Vec<&dyn ScanSource> = placed.iter().map(|mesh| mesh as &dyn ScanSource).collect();
    run(&sources, &AlignParams::default(), &Constraints::default(), &Progress::none()).unwrap()
}

fn lines(alignment: &Alignment) -> String {
    alignment.report.lines().join("\n")
}

#[test]
fn another_size_is_said() {
    let (meshes, _) = bent(2, |p| 1.03 * p);
    let text = lines(&aligned(&meshes));
    assert!(text.contains("mesh 2: not placed") && text.contains("0.97"), "{text}");
}

#[test]
fn a_part_that_moved_is_said() {
    // The upper part leans by a fiftieth of the statue.
    let (meshes, _) = bent(2, |p| if p.z > 0.36 { p + DVec3::new(0.02, 0.0, 0.0) } else { p });
    let text = lines(&aligned(&meshes));
    assert!(text.contains("moved"), "{text}");
}

#[test]
fn warp_is_said() {
    let (meshes, _) = bent(2, |p| p + 0.015 * (12.0 * p.z).sin() * DVec3::X);
    let text = lines(&aligned(&meshes));
    assert!(text.contains("bent"), "{text}");
}

#[test]
fn the_map_shows_where() {
    let (meshes, poses) = bent(2, |p| if p.z > 0.25 { 1.01 * p } else { p });
    let placed: Vec<PlacedMesh<&TriMesh>> = meshes
        .iter()
        .map(|mesh| PlacedMesh { name: String::new(), mesh, world_from_mesh: DAffine3::IDENTITY })
        .collect();
    let sources: Vec<&dyn ScanSource> = placed.iter().map(|mesh| mesh as &dyn ScanSource).collect();
    let prepared = Prepared::read(&sources, 0, &Progress::none()).unwrap();
    let given: Vec<Option<DAffine3>> = poses.iter().copied().map(Some).collect();
    let map = prepared.misfit(2, &given, &meshes[2].positions, &Progress::none()).unwrap();
    assert_eq!(map.len(), meshes[2].positions.len());
    let mean = |is_in: &dyn Fn(f64) -> bool| {
        let places = meshes[2].positions.iter().map(|p| poses[2].transform_point3(*p).z);
        let of: Vec<f64> = places.zip(&map).filter(|(z, d)| is_in(*z) && d.is_finite()).map(|(_, d)| *d).collect();
        assert!(of.len() > 100);
        of.iter().sum::<f64>() / of.len() as f64
    };
    let (above, below) = (mean(&|z| z > 0.3), mean(&|z| z < 0.2));
    assert!(above > 0.0015 && below.abs() < 0.0005, "{above} {below}");
    // Nothing is known of what no other scan shows.
    let far = prepared.misfit(2, &given, &[DVec3::splat(1e3)], &Progress::none()).unwrap();
    assert!(far[0].is_nan());
}

#[test]
fn scans_that_fit_have_next_to_none() {
    let images = around(statue(), 5, 0.0);
    let alignment =
        run(&sources(&images), &AlignParams::default(), &Constraints::default(), &Progress::none()).unwrap();
    for scan in &alignment.report.scans {
        assert!(scan.misfit < 0.3 * scan.spacing, "{scan:?}");
    }
    assert!(!lines(&alignment).contains("not fit exactly"), "{}", lines(&alignment));
}
