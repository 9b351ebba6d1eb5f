//! Votes on what scans see through.

use std::f64::consts::TAU;

use super::eyes::MOST_VOTERS;
use super::*;
use crate::{MergeParams, Merged, Run, merge};
use geom::bvh::Bvh;
use image::RangeImage;
use image::range_image::test_images::as_point_grid;
use image::range_image::{Samples, Viewing};
use image::source::{Loading, ScanSource};
use mesh::TriMesh;
use mesh::shapes::Shape;
use scan::{ScanParams, VirtualCamera};

pub(crate) const CELL: f64 = 0.04;

/// Cuboids, by centre and half size.
pub(crate) fn cuboids(parts: &[[DVec3; 2]]) -> TriMesh {
    let mut all = TriMesh::default();
    for &[centre, half] in parts {
        let part = Shape::Cuboid { half }.mesh(1);
        let first = all.positions.len() as u32;
        all.positions.extend(part.positions.iter().map(|&p| p + centre));
        all.triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + first)));
    }
    all
}

pub(crate) const FLOOR: [DVec3; 2] = [DVec3::new(0.0, 0.0, -0.1), DVec3::new(2.5, 2.5, 0.1)];
pub(crate) const BOX: [DVec3; 2] = [DVec3::new(0.1, 0.0, 0.25), DVec3::new(0.2, 0.3, 0.25)];

/// Views of `count` cameras around the origin of a scene each, with noise of `sigma` cells and poses off by `off` cells.
pub(crate) fn frames(count: usize, [sigma, off]: [f64; 2], scene: impl Fn(usize) -> TriMesh) -> Vec<RangeImage> {
    let look = |k: usize| {
        let mesh = scene(k);
        let bvh = Bvh::build(&mesh.positions, &mesh.triangles, 0).unwrap();
        let (sin, cos) = (TAU * k as f64 / count as f64).sin_cos();
        let eye = DVec3::new(3.0 * cos, 3.0 * sin, 2.0);
        let camera = VirtualCamera::pinhole(150, 200, 0.8, eye, DVec3::ZERO, DVec3::Z).unwrap();
        let params =
            ScanParams { seed: k as u64, noise: sigma * CELL, pose_shift: off * CELL, ..ScanParams::default() };
        let mut image = scan::scan(&mesh, &bvh, &camera, &params, &Progress::none()).unwrap();
        image.name = format!("{k:02}");
        image
    };
    (0..count).map(look).collect()
}

#[test]
fn one_more_or_less_changes_one_voter() {
    let loading = Loading { triangulation: Default::default(), cell: 0.0 };
    let frame = &frames(1, [0.0; 2], |_| cuboids(&[FLOOR]))[0];
    let measured = frame.load(&loading, &Progress::none()).unwrap().measured.unwrap();
    let images: Vec<(u32, Measured)> = (0..300).map(|scan| (7 * scan, measured.clone())).collect();
    let of = |gone: usize| {
        let left: Vec<_> = images.iter().enumerate().filter(|of| of.0 != gone).map(|of| of.1.clone()).collect();
        voters(&left).iter().map(|voter| voter.0).collect::<std::collections::BTreeSet<_>>()
    };
    let all = of(usize::MAX);
    assert_eq!(all.len(), MOST_VOTERS);
    assert!((0..300).all(|gone| of(gone).difference(&all).count() <= 1));
}

fn merged(frames: &[RangeImage]) -> Merged {
    let sources: Vec<&dyn ScanSource> = frames.iter().map(|s| s as &dyn ScanSource).collect();
    let params = MergeParams { voxel: Some(CELL), max_hole_length: Some(0.0), ..MergeParams::default() };
    merge(&sources, &params, Run::default(), &Progress::none()).unwrap()
}

/// Share of the vertices of `a` near the middle that have no vertex of `b` within a cell.
fn alone(a: &Merged, b: &Merged) -> f64 {
    let key = |p: DVec3| (p / CELL).floor().as_ivec3();
    let there: std::collections::HashSet<_> = b.mesh.positions.iter().map(|&p| key(p)).collect();
    let beside =
        |p: DVec3| (0..27).any(|i| there.contains(&(key(p) + glam::ivec3(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1))));
    let near: Vec<_> = a.mesh.positions.iter().filter(|p| p.truncate().length() < 1.2).collect();
    near.iter().filter(|p| !beside(***p)).count() as f64 / near.len() as f64
}

#[test]
fn what_stood_there_for_a_few_frames_is_gone_and_the_floor_is_whole() {
    for sigma in [0.0, 0.5] {
        let empty = merged(&frames(16, [sigma, 0.0], |_| cuboids(&[FLOOR])));
        let with_box = |k: usize| if k % 4 == 1 { cuboids(&[FLOOR, BOX]) } else { cuboids(&[FLOOR]) };
        let found = merged(&frames(16, [sigma, 0.0], with_box));
        assert!(found.report.seen_through > 500, "{}", found.report.seen_through);
        let (stayed, lost) = (alone(&found, &empty), alone(&empty, &found));
        assert!(stayed < 0.002 && lost < 0.01, "at {sigma}: {stayed} stayed, {lost} of the floor lost");
    }
}

#[test]
fn what_most_frames_have_stays() {
    for sigma in [0.0, 0.5] {
        let still = merged(&frames(16, [sigma, 0.0], |_| cuboids(&[FLOOR, BOX])));
        // Some edges of the box, where pixels beyond them are noisy.
        assert!(still.report.seen_through < 20, "{}", still.report.seen_through);
        let gone = |k: usize| if k % 4 == 1 { cuboids(&[FLOOR]) } else { cuboids(&[FLOOR, BOX]) };
        let found = merged(&frames(16, [sigma, 0.0], gone));
        let lost = alone(&still, &found);
        assert!(lost < 0.005, "{lost}");
    }
}

#[test]
fn rods_and_sheets_stay() {
    // Rods of a pixel to seven; a sheet that most cameras see from its edge or not at all.
    for (half, off) in [(0.008, 0.0), (0.008, 0.4), (0.032, 0.0), (0.032, 0.4), (0.064, 0.4)] {
        let rod = [DVec3::new(0.0, 0.1, 0.4), DVec3::new(half, half, 0.4)];
        let sheet = [DVec3::new(0.6, -0.4, 0.3), DVec3::new(half, 0.3, 0.3)];
        let found = merged(&frames(16, [0.0, off], |_| cuboids(&[FLOOR, rod, sheet])));
        assert_eq!(found.report.seen_through, 0, "half a width of {half}");
        let up = found.mesh.positions.iter().filter(|p| p.z > 0.1 && p.x.abs() < 0.1 && (p.y - 0.1).abs() < 0.1);
        // A thing that no triangle of any scan shows can't be in the result.
        assert!(half < 0.03 || up.count() > 40, "half a width of {half}");
    }
}

#[test]
fn what_is_off_to_the_side_is_not_seen_through() {
    // Level floors fit, whatever the error to the side is.
    for off in [1.0, 2.0, 3.0] {
        let mut scans =
            frames(16, [0.0; 2], |_| cuboids(&[FLOOR, [DVec3::new(0.0, 0.0, 0.4), DVec3::new(0.08, 0.08, 0.4)]]));
        for (i, scan) in scans.iter_mut().enumerate() {
            let normal =
                |k: usize| (0..12).map(|j| ((12 * (7 * i + k) + j) as f64 * 0.754_877_666).fract()).sum::<f64>() - 6.0;
            scan.world_from_sensor.translation += off * CELL * DVec3::new(normal(0), normal(3), 0.0);
        }
        let found = merged(&scans);
        let up = found.mesh.positions.iter().filter(|p| p.z > 0.2 && p.z < 0.6).count();
        assert!(up > 200, "off by {off}: {up} left, {} seen through", found.report.seen_through);
    }
}

#[test]
fn veils_beside_jumps_are_gone() {
    let scene = |_| cuboids(&[FLOOR, BOX]);
    let clean = frames(16, [0.0; 2], scene);
    let veiled: Vec<RangeImage> = (clean.iter())
        .map(|image| {
            let Samples::Values(values) = image.samples() else { panic!("values") };
            let mut mixed = values.clone();
            for i in 15..values.len() - 15 {
                // A ramp from the nearer side on.
                let jump = values[i + 1] - values[i];
                if (5.0 * CELL..25.0 * CELL).contains(&jump.abs()) {
                    let (from, on) = if jump > 0.0 { (i, 1) } else { (i + 1, -1) };
                    for k in 1..15 {
                        let pixel = from.wrapping_add_signed(on * k);
                        mixed[pixel] = values[from] + (values[pixel] - values[from]) * k as f64 / 15.0;
                    }
                }
            }
            let mut veiled = RangeImage::from_values(image.rows(), image.cols(), mixed, *image.projection()).unwrap();
            (veiled.name, veiled.world_from_sensor) = (image.name.clone(), image.world_from_sensor);
            veiled
        })
        .collect();
    let (clean, veiled) = (merged(&clean), merged(&veiled));
    let (left, lost) = (alone(&veiled, &clean), alone(&clean, &veiled));
    // Without looking through 0.3 are left.
    assert!(left < 0.015 && lost < 0.005, "{left} left, {lost} lost");
}

#[test]
fn grids_of_points_vote_where_they_say_from_where_and_two_scans_are_no_majority() {
    let scene = |k: usize| if k == 0 { cuboids(&[FLOOR, BOX]) } else { cuboids(&[FLOOR]) };
    let images = frames(8, [0.0; 2], scene);
    let dropped = merged(&images).report.seen_through;
    assert!(dropped > 100);
    assert_eq!(merged(&images[..2]).report.seen_through, 0);
    let grids: Vec<RangeImage> = (images.iter())
        .map(|image| {
            let mut grid = as_point_grid(image);
            (grid.name, grid.world_from_sensor) = (image.name.clone(), image.world_from_sensor);
            grid
        })
        .collect();
    let by_grids = merged(&grids).report.seen_through;
    assert!(by_grids.abs_diff(dropped) * 20 < dropped, "{by_grids} of {dropped}");
    let still = frames(8, [0.0; 2], |_| cuboids(&[FLOOR, BOX]));
    let grids: Vec<RangeImage> = (still.iter())
        .map(|image| {
            let points = as_point_grid(image);
            let Samples::Points(points) = points.samples() else { panic!("points") };
            let viewing = Viewing::Parallel(DVec3::Z);
            let mut grid = RangeImage::from_points(image.rows(), image.cols(), points.clone(), viewing).unwrap();
            (grid.name, grid.world_from_sensor) = (image.name.clone(), image.world_from_sensor);
            grid
        })
        .collect();
    assert_eq!(merged(&grids).report.seen_through, 0);
}
