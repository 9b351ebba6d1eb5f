//! Exposure, highlights, cameras that are off, and that no order and no number of threads matters.

use glam::{DAffine3, DMat3, DQuat, DVec3};

use mesh::srgb;

use super::kit::{PLAIN, Shot, apart, around, covered, pebble, shot_of, textured, unwrapped};
use crate::TextureParams;

/// Colours with detail for cameras to hold on to.
fn spots(p: DVec3) -> [u8; 3] {
    let wave = |a: f64, b: f64| (a * 6.0).sin() * (b * 7.0).sin();
    let of = |x: f64| (120.0 + 60.0 * x) as u8;
    [of(wave(p.x, p.y + 1.0)), of(wave(p.y, p.z + 0.5)), of(wave(p.z, p.x + 2.0))]
}

fn shots() -> Vec<Shot> {
    let mesh = pebble();
    around(9, 3.2)
        .iter()
        .enumerate()
        .map(|(i, &eye)| shot_of([240, 200], &format!("photo {i}"), &mesh, eye, &spots))
        .collect()
}

fn error(params: &TextureParams, shots: &[Shot]) -> f64 {
    let mesh = pebble();
    let flat = unwrapped(&mesh);
    let done = textured(&flat, &mesh, shots, params).unwrap();
    let texels = covered(&flat);
    let of =
        |&(place, point): &(usize, DVec3)| f64::from(apart(done.images.tiles[0].colour[place], spots(point))).powi(2);
    (texels.iter().map(of).sum::<f64>() / texels.len() as f64).sqrt()
}

#[test]
fn exposure_is_made_equal() {
    let mut shots = shots();
    for (i, shot) in shots.iter_mut().enumerate() {
        let gain = [1.25, 0.8, 1.0][i % 4 % 3];
        let bright = |byte: u8| srgb::byte((f64::from(srgb::light(byte)) * gain) as u16);
        shot.pixels.colours.iter_mut().for_each(|colour| *colour = colour.map(bright));
    }
    let plain = error(&PLAIN, &shots);
    let equal = error(&TextureParams { match_exposure: true, ..PLAIN }, &shots);
    assert!(equal < 0.6 * plain, "{plain} -> {equal}");
    let mesh = pebble();
    let done = textured(&unwrapped(&mesh), &mesh, &shots, &TextureParams { match_exposure: true, ..PLAIN }).unwrap();
    let [first, second] = [0, 1].map(|i| done.report.photos[i].gain[1]);
    assert!((second / first * 0.8 / 1.25 - 1.0).abs() < 0.05, "{first} {second}");
}

#[test]
fn highlights_of_one_photo_are_dropped() {
    let mut shots = shots();
    for (i, shot) in shots.iter_mut().enumerate() {
        // In a third of each photo, elsewhere in each.
        let columns = shot.pixels.size[0];
        for (pixel, colour) in shot.pixels.colours.iter_mut().enumerate() {
            if pixel % columns / 14 % 9 == i {
                *colour = [250, 250, 250];
            }
        }
    }
    let plain = error(&PLAIN, &shots);
    let dropped = error(&TextureParams { drop_highlights: true, ..PLAIN }, &shots);
    assert!(dropped < 0.8 * plain, "{plain} -> {dropped}");
}

#[test]
fn cameras_find_back_and_say_how_far_they_went() {
    let mut off = shots();
    let truth: Vec<DAffine3> = off.iter().map(|shot| shot.world_from_camera).collect();
    for (i, shot) in off.iter_mut().enumerate() {
        let turn = DVec3::new((i % 3) as f64 - 1.0, (i % 2) as f64 - 0.5, (i % 5) as f64 / 2.0 - 1.0) * 0.005;
        shot.world_from_camera.matrix3 *= DMat3::from_quat(DQuat::from_scaled_axis(turn));
        shot.world_from_camera.translation += DVec3::new(turn.z, turn.x, turn.y);
    }
    let refined = TextureParams { refine_cameras: true, ..PLAIN };
    let (before, after) = (error(&PLAIN, &off), error(&refined, &off));
    assert!(after < 0.7 * before, "{before} -> {after}");
    let mesh = pebble();
    let done = textured(&unwrapped(&mesh), &mesh, &off, &refined).unwrap();
    let pixels = |poses: &[DAffine3]| {
        let far = |(a, b): (&DAffine3, &DAffine3)| {
            let p = DVec3::new(0.3, -0.4, 0.2);
            let [a, b] = [a, b].map(|pose| pose.inverse().transform_point3(p)).map(|p| 220.0 * p.truncate() / p.z);
            a.distance(b)
        };
        poses.iter().zip(&truth).map(far).sum::<f64>() / truth.len() as f64
    };
    let given: Vec<DAffine3> = off.iter().map(|shot| shot.world_from_camera).collect();
    let [was, is] = [pixels(&given), pixels(&done.world_from_camera)];
    assert!(was > 0.5 && is < 0.4 * was, "{was} -> {is} pixels");
    assert!(done.report.photos.iter().all(|photo| photo.moved > 0.05 && photo.moved < 3.0), "{:?}", done.report.photos);
    let [before, after] = done.report.differences.unwrap();
    assert!(after < before);
    // Cameras that are right stay.
    let done = textured(&unwrapped(&mesh), &mesh, &shots(), &refined).unwrap();
    assert!(done.report.photos.iter().all(|photo| photo.moved < 0.6), "{:?}", done.report.photos);
}

#[test]
fn no_order_and_no_number_of_threads_matters() {
    let mesh = pebble();
    let flat = unwrapped(&mesh);
    let mut shots = shots();
    shots[2].world_from_camera.translation.x += 0.02;
    let all =
        TextureParams { size: 96, occlusion_rays: 4, normal_map: true, height_map: true, ..TextureParams::default() };
    let one = textured(&flat, &mesh, &shots, &TextureParams { threads: 1, ..all }).unwrap();
    shots.reverse();
    shots.swap(1, 5);
    let many = textured(&flat, &mesh, &shots, &TextureParams { threads: 6, ..all }).unwrap();
    assert!(one.images.tiles == many.images.tiles && one.images.tangents == many.images.tangents);
    assert!(many.report.photos.iter().zip(&shots).all(|(photo, shot)| photo.name == shot.name));
    let mut names: Vec<(String, DAffine3)> =
        shots.iter().map(|shot| shot.name.clone()).zip(many.world_from_camera).collect();
    names.sort_by(|a, b| a.0.cmp(&b.0));
    assert!(names.iter().zip(&one.world_from_camera).all(|(a, b)| a.1 == *b));
}
