//! The cell that is chosen where none is given.

use super::noise::noisy_patch;
use super::*;
use crate::crossings::scan_order::ScanOrder;
use crate::intake::defaults;

/// Six scans of a plane with samples a unit apart, lifted by so much one way or the other.
fn patches(sigma: f64, off: f64) -> Vec<RangeImage> {
    (0..6).map(|i| noisy_patch(i, off * [1.0, -1.0, 0.3, -0.6, 0.8, -0.2][i], sigma)).collect()
}

#[test]
fn the_cell_follows_spacing_noise_and_distance() {
    let chosen = |scans: &[RangeImage]| {
        let report = merge_scans(scans, &MergeParams::default()).report;
        (report.voxel, report.voxel_reason)
    };
    let (cell, reason) = chosen(&patches(0.0, 0.0));
    assert!(reason == VoxelReason::Spacing && (1.45..1.6).contains(&cell), "{cell} {reason:?}");
    let (cell, reason) = chosen(&patches(6.0, 0.0));
    assert!(reason == VoxelReason::Noise && (2.5..3.5).contains(&cell), "{cell} {reason:?}");
    let (cell, reason) = chosen(&patches(0.0, 3.0));
    assert!(reason == VoxelReason::Distance && (3.0..7.0).contains(&cell), "{cell} {reason:?}");
    // Nothing is shared, so that nothing is said by how far apart they are.
    let apart: Vec<RangeImage> = (patches(0.0, 0.0).into_iter().enumerate())
        .map(|(i, mut image)| {
            image.world_from_sensor = DAffine3::from_translation(DVec3::X * 150.0 * i as f64);
            image
        })
        .collect();
    assert_eq!(chosen(&apart).1, VoxelReason::Spacing);
    let given = merge_scans(&apart, &MergeParams { voxel: Some(1.75), ..MergeParams::default() }).report;
    assert_eq!((given.voxel, given.voxel_reason), (1.75, VoxelReason::Given));
}

#[test]
fn the_cell_does_not_depend_on_order_or_threads() {
    let mut scans = patches(0.5, 1.0);
    scans.truncate(5);
    let expected = merge_scans(&scans, &MergeParams { threads: 1, ..MergeParams::default() }).report.voxel;
    scans.rotate_left(2);
    let turned = merge_scans(&scans, &MergeParams { threads: 3, ..MergeParams::default() }).report.voxel;
    assert_eq!(turned.to_bits(), expected.to_bits());
}

#[test]
fn a_scan_far_away_or_far_coarser_does_not_decide() {
    let mut scans = patches(0.0, 0.0);
    let clean = merge_scans(&scans, &MergeParams::default()).report.voxel;
    let mut coarse =
        RangeImage::from_values(3, 3, vec![0.0; 9], Projection::Orthographic { first: [0.0; 2], step: [500.0; 2] })
            .unwrap();
    coarse.name = "coarse".to_owned();
    scans.push(coarse);
    let report = merge_scans(&scans, &MergeParams::default()).report;
    assert!(report.voxel < 1.3 * clean && report.voxel_reason == VoxelReason::Spacing, "{} {clean}", report.voxel);
}

/// Theorem: the cell that is measured is what is read of it, and a scan that is turned about itself does not change it.
#[test]
fn the_cell_has_three_digits() {
    let scans: Vec<_> = (0..6).map(|i| noisy_patch(i, 0.1, 0.01)).collect();
    let cell = |scans: &[RangeImage]| merge_scans(scans, &MergeParams::default()).report.voxel;
    let found = cell(&scans);
    assert_eq!(format!("{found:.2e}").parse::<f64>().unwrap(), found);
    let mut turned = scans;
    let pose = turned[3].world_from_sensor;
    turned[3].world_from_sensor = pose * DAffine3::from_rotation_z(1e-5);
    assert_eq!(cell(&turned), found);
}

#[test]
fn a_scan_that_goes_seldom_changes_which_are_looked_at() {
    let scans: Vec<_> = (0..100).map(|i| noisy_patch(i, 0.0, 0.0)).collect();
    let names = |gone: usize| {
        let left = scans.iter().enumerate().filter(|scan| scan.0 != gone);
        let sources: Vec<&dyn ScanSource> = left.map(|scan| scan.1 as &dyn ScanSource).collect();
        let places: Vec<usize> = (0..sources.len()).collect();
        let scan_order = ScanOrder::new(&sources, &vec![0; sources.len()], &places);
        let looked_at = defaults::looked_at(&scan_order);
        assert!(looked_at.is_sorted() && looked_at.len() == 8);
        // Spread over the order.
        assert!((0..4).all(|part| (25 * part..25 * part + 25).contains(&looked_at[2 * part])), "{looked_at:?}");
        looked_at.into_iter().map(|place| scan_order.names()[place].clone()).collect::<Vec<_>>()
    };
    let all = names(usize::MAX);
    let changed = (0..100).filter(|&gone| names(gone) != all).count();
    assert!((8..25).contains(&changed), "{changed}");
}

#[test]
fn empty_scans_however_many_do_not_decide() {
    let empty = |i: usize| {
        let values = vec![f64::NAN; 4];
        let projection = Projection::Orthographic { first: [0.0; 2], step: [1.0; 2] };
        let mut image = RangeImage::from_values(2, 2, values, projection).unwrap();
        image.name = format!("patch {i:03}");
        image
    };
    let is_empty = |i: usize| i % 4 < 2;
    let scans: Vec<_> = (0..16).map(|i| if is_empty(i) { empty(i) } else { noisy_patch(i, 0.0, 0.0) }).collect();
    let report = merge_scans(&scans, &MergeParams::default()).report;
    assert!((1.45..1.6).contains(&report.voxel), "{}", report.voxel);
}

#[test]
fn layers_far_apart_and_large_triangles_choose_no_fine_cell_and_no_endless_one() {
    for up in [9.0, 12.0, 15.0, 20.0] {
        let scans: Vec<_> = (0..6).map(|i| noisy_patch(i, up * (i % 2) as f64, 0.0)).collect();
        let report = merge_scans(&scans, &MergeParams::default()).report;
        let expected = (1.5 * up).min(12.0);
        assert!((report.voxel / expected - 1.0).abs() < 0.1, "{up}: {}", report.voxel);
    }
    // A ground of two triangles has as many crossings as memory holds.
    let mut mesh = Shape::Sphere { radius: 1.0 }.mesh(24);
    let first = mesh.positions.len() as u32;
    mesh.positions
        .extend([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| DVec3::new(3e6 * x, 3e6 * y, -2.0)));
    mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    let scan = PlacedMesh { name: "ground".to_owned(), mesh: &mesh, world_from_mesh: DAffine3::IDENTITY };
    let found = defaults::voxel(
        &ScanOrder::new(&[&scan], &[0], &[0]),
        &Default::default(),
        &mut Default::default(),
        &Progress::none(),
    )
    .unwrap();
    assert!(found.0 < 0.3, "{found:?}");
}
