//! Merges the real scan sets named in the environment variable SURFRECON_DATA.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

use std::path::PathBuf;

use surfrecon::Progress;
use surfrecon::import;
use surfrecon::merge::{self, Loading, MergeParams, Merged, ScanSource};
use surfrecon::mesh::measure::{DistanceReport, Side, deviation};
use surfrecon::mesh::{CheckReport, check, check_welded};

/// A merge with the default limits, and the distances to its surface of all samples that have a triangle. Metres.
fn merge(conf: &str, voxel: f64) -> Option<(Merged, CheckReport, DistanceReport)> {
    let Some(data) = std::env::var_os("SURFRECON_DATA").map(PathBuf::from) else {
        println!("SKIPPED: SURFRECON_DATA is not set");
        return None;
    };
    let set = import::open(&data.join(conf)).unwrap();
    let sources: Vec<&dyn ScanSource> = set.scans.iter().map(|scan| scan as &dyn ScanSource).collect();
    let params = MergeParams { voxel: Some(voxel), ..MergeParams::default() };
    let merged = merge::merge(&sources, &params, merge::Run::default(), &Progress::none()).unwrap();
    let mut samples = Vec::new();
    for scan in &set.scans {
        let surface = scan.load(&Loading::default(), &Progress::none()).unwrap();
        samples.extend(surface.positions.iter().map(|&p| surface.world_from_surface.transform_point3(p)));
    }
    let off = deviation(&samples, &merged.mesh, Side::Ignored, 0, &Progress::none()).unwrap().summary;
    let report = check(&merged.mesh);
    println!("{conf} {voxel}: {report}; {off:?}");
    assert!(report.is_manifold() && report.zero_area_triangles == 0, "{report}");
    // A mesh in a file of single precision is no less a manifold.
    let welded = check_welded(&merged.mesh);
    assert!(welded.is_manifold(), "{welded}");
    assert_eq!(welded.vertices, report.vertices, "vertices fall together in single precision");
    assert_eq!(merged.report.faces.iter().sum::<u64>(), merged.mesh.triangles.len() as u64);
    assert!(merged.report.shortest_edge >= 0.01 * voxel, "{}", merged.report.shortest_edge);
    Some((merged, report, off))
}

/// The published reconstruction has five holes. The paper's grids had 109 x 107 x 84 and 333 x 338 x 266 cells.
#[test]
fn bunny() {
    for (voxel, cells, rms) in [(0.001436, [109, 107, 84], 0.16e-3), (0.00047, [333, 338, 266], 0.14e-3)] {
        let Some((merged, report, off)) = merge("stanford_bunny/bun.conf", voxel) else { return };
        assert_eq!(report.components, 1);
        assert!(report.boundary_loops <= 5, "{report}");
        assert!(off.rms < rms, "{off:?}");
        for (ours, papers) in merged.report.grid.into_iter().zip(cells) {
            assert!(ours.abs_diff(papers) * 25 <= papers, "{:?}", merged.report.grid);
        }
        let [direct, settled, filling] = merged.report.faces.map(|n| n as f64 / merged.mesh.triangles.len() as f64);
        assert!(direct > 0.98 && settled < 0.012 && filling < 0.01, "{direct} {settled} {filling}");
    }
}

#[test]
fn dragon() {
    let Some((_, _, off)) = merge("stanford_dragon_stand/dragonStandRight.conf", 0.00075) else { return };
    // Some samples stray far from the surface.
    assert!(off.p95 < 0.4e-3, "{off:?}");
}

#[test]
fn happy_buddha() {
    let Some((_, _, off)) = merge("stanford_happy_stand/happyStandRight.conf", 0.0006) else { return };
    assert!(off.rms < 0.17e-3, "{off:?}");
}
