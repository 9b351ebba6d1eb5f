//! Colours of scans whose exposures differ, that reflect lamps, and some of which have none.

use super::*;
use mesh::srgb;

/// Light of a pattern at a place, of 1.
fn light_at(p: DVec3) -> [f64; 3] {
    let waves = (3.0 * p.x).sin() * (3.0 * p.y).cos() + (2.0 * p.z).sin();
    [0.30 + 0.08 * waves, 0.22 + 0.06 * waves, 0.15 - 0.04 * waves]
}

/// Scans of a shape with the pattern on it, a scan as bright as `exposure` says. `sheen` is light that a place sends to one scan in
/// addition.
fn patterned(shape: Shape, exposure: impl Fn(usize) -> f64, sheen: impl Fn(usize, DVec3) -> f64) -> Vec<RangeImage> {
    let mut scans = clean_scans(shape, 100);
    for (i, scan) in scans.iter_mut().enumerate() {
        let mut colours = vec![[0; 4]; scan.len()];
        let (cols, world_from_sensor) = (scan.cols(), scan.world_from_sensor);
        scan.for_each_valid(|row, col, at| {
            let at = world_from_sensor.transform_point3(at);
            let byte = |of: f64| srgb::byte((65_535.0 * (of + sheen(i, at)) * exposure(i)).min(65_535.0) as u16);
            let [red, green, blue] = light_at(at).map(byte);
            colours[row * cols + col] = [red, green, blue, 255];
        });
        scan.colour = Some(colours);
    }
    scans
}

fn colours(mesh: &TriMesh) -> &[[u8; 4]] {
    match mesh.vertex_attribute("colour") {
        Some(AttributeData::Colour(colours)) => colours,
        _ => panic!("no colours"),
    }
}

/// RMS difference of the bytes to the pattern's, a factor that all have in common aside.
fn off_pattern(mesh: &TriMesh) -> f64 {
    let light = |colour: &[u8; 4]| [0, 1, 2].map(|i| f64::from(srgb::light(colour[i])) / 65_535.0);
    let all = || colours(mesh).iter().map(light).zip(mesh.positions.iter().map(|&p| light_at(p)));
    let factor = [0, 1, 2].map(|i| all().map(|of| of.1[i]).sum::<f64>() / all().map(|of| of.0[i]).sum::<f64>());
    let byte = |of: f64| f64::from(srgb::byte((65_535.0 * of).min(65_535.0) as u16));
    let squares: f64 =
        all().map(|(a, b)| (0..3).map(|i| (byte(a[i] * factor[i]) - byte(b[i])).powi(2)).sum::<f64>()).sum();
    (squares / (3 * mesh.positions.len()) as f64).sqrt()
}

fn exposure(scan: usize) -> f64 {
    [0.75, 1.25, 1.0, 0.7, 1.3, 0.9, 1.1, 0.8, 1.2][scan % 9]
}

/// A lamp that each scan sees somewhere else.
fn lamp(scan: usize, at: DVec3) -> f64 {
    let angle = 2.4 * scan as f64;
    let there = DVec3::new(angle.cos(), angle.sin(), 0.3 * (angle * 0.7).sin());
    if at.normalize().dot(there.normalize()) > 0.96 { 0.5 } else { 0.0 }
}

const SHAPE: Shape = Shape::Sphere { radius: 1.0 };

#[test]
fn exposures_that_differ_leave_no_patches_and_lamps_no_spots() {
    let merged =
        |matched, scans: &[RangeImage]| merge_scans(scans, &MergeParams { match_exposure: matched, ..plain(0.04) });
    let scans = patterned(SHAPE, exposure, |_, _| 0.0);
    let found = merged(true, &scans);
    let products: Vec<f64> = found.report.colour_gains.iter().zip(0..).map(|(of, i)| of[1] * exposure(i)).collect();
    let mean = products.iter().sum::<f64>() / products.len() as f64;
    assert!(products.len() == 9 && products.iter().all(|of| (of / mean - 1.0).abs() < 0.02), "{products:?}");
    let (with, without) = (off_pattern(&found.mesh), off_pattern(&merged(false, &scans).mesh));
    assert!(with < 1.0 && without > 5.0, "{with} {without}");
    let lit = patterned(SHAPE, exposure, lamp);
    let (with, without) = (off_pattern(&merged(true, &lit).mesh), off_pattern(&merged(false, &lit).mesh));
    assert!(with < 4.0 && without > 2.0 * with, "{with} {without}");
}

#[test]
fn exposures_that_differ_by_more_than_two_stops_are_matched() {
    let scans = patterned(SHAPE, |scan| [1.0, 0.2][scan % 2], |_, _| 0.0);
    let found = merge_scans(&scans, &plain(0.04));
    let gains = found.report.colour_gains;
    assert!(gains.len() == 9 && (gains[1][1] / gains[0][1] - 5.0).abs() < 0.15, "{gains:?}");
}

#[test]
fn scans_that_agree_are_left_as_they_are() {
    let scans = patterned(SHAPE, |_| 1.0, |_, _| 0.0);
    let found = merge_scans(&scans, &plain(0.04));
    assert!(found.report.colour_gains.is_empty());
    let as_they_are = merge_scans(&scans, &MergeParams { match_exposure: false, ..plain(0.04) });
    assert!(found.mesh == as_they_are.mesh);
    assert!(off_pattern(&found.mesh) < 0.7, "{}", off_pattern(&found.mesh));
}

#[test]
fn colours_are_the_same_for_any_order_threads_blocks_bricks_and_adding_up() {
    let scans = patterned(SHAPE, exposure, lamp);
    let params = MergeParams { voxel: Some(0.04), ..MergeParams::default() };
    let by = |setup: &Setup, order: &[usize], threads: usize| {
        let sources: Vec<&dyn ScanSource> = order.iter().map(|&i| &scans[i] as &dyn ScanSource).collect();
        let pool = threads::pool(threads).unwrap();
        pool.install(|| by_setup(&sources, &params, setup, &Progress::none())).unwrap()
    };
    let order: Vec<usize> = (0..scans.len()).collect();
    let expected = by(&Setup::default(), &order, 1);
    assert!(!expected.report.colour_gains.is_empty());
    let mut turned = order.clone();
    turned.reverse();
    for (setup, order, threads) in [
        (Setup::default(), &turned, 1),
        (Setup::default(), &order, 3),
        (Setup { kept: 0, ..Setup::default() }, &order, 1),
        (Setup { kept: 0, ..Setup::default() }, &turned, 3),
        (Setup { block: Some(1), ..Setup::default() }, &order, 1),
    ] {
        let found = by(&setup, order, threads);
        assert!(found.mesh == expected.mesh && found.report.colour_gains == expected.report.colour_gains);
    }
    // Bricks from elsewhere number vertices otherwise.
    let placed = |merged: &Merged| {
        let all = merged.mesh.positions.iter().zip(colours(&merged.mesh));
        let mut all: Vec<_> =
            all.map(|(p, colour)| (p.to_array().map(|x| (1e9 * x).round() as i64), *colour)).collect();
        all.sort_unstable();
        all
    };
    let found = by(&Setup { corner: [1, -7, 40], ..Setup::default() }, &order, 1);
    assert!(placed(&found) == placed(&expected));
}

#[test]
fn scans_without_colours_take_none_away() {
    let mut scans = patterned(SHAPE, |_| 1.0, |_, _| 0.0);
    for i in [1, 4] {
        scans[i].colour = None;
    }
    let found = merge_scans(&scans, &plain(0.04)).mesh;
    let bare = colours(&found).iter().filter(|colour| colour[3] == 0).count();
    assert!(off_pattern(&found) < 2.0, "{}", off_pattern(&found));
    // As if samples had colours of alpha 0.
    for i in [1, 4] {
        scans[i].colour = Some(vec![[200, 9, 9, 0]; scans[i].len()]);
    }
    assert!(merge_scans(&scans, &plain(0.04)).mesh == found);
    assert!(bare * 4 < found.positions.len(), "{bare}");
    for scan in &mut scans {
        scan.colour = None;
    }
    assert!(merge_scans(&scans, &plain(0.04)).mesh.vertex_attribute("colour").is_none());
}

#[test]
fn where_no_scan_has_a_colour_it_is_the_nearest_and_alpha_says_so() {
    let mut scans = patterned(SHAPE, |_| 1.0, |_, _| 0.0);
    // A surface below has no colour in any scan.
    for scan in &mut scans {
        let (cols, world_from_sensor) = (scan.cols(), scan.world_from_sensor);
        let mut colours = scan.colour.take().unwrap();
        scan.for_each_valid(|row, col, at| {
            if world_from_sensor.transform_point3(at).z < -0.3 {
                colours[row * cols + col] = [0; 4];
            }
        });
        scan.colour = Some(colours);
    }
    let mesh = merge_scans(&scans, &plain(0.04)).mesh;
    for (p, colour) in mesh.positions.iter().zip(colours(&mesh)) {
        assert!(colour[3] == 255 || p.z < -0.2, "{p} {colour:?}");
        assert!(colour[3] == 0 || p.z > -0.4, "{p} {colour:?}");
        // Nothing is darker than the pattern is anywhere.
        assert!(colour[1] > 60, "{p} {colour:?}");
    }
}
