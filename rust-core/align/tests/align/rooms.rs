//! Rooms seen from inside, where walls fit walls and corners fit corners: what is placed is placed rightly.

use glam::DVec3;
use image::RangeImage;
use mesh::TriMesh;
use mesh::shapes::Shape;
use surfrecon_align::Constraints;

use crate::reach::{add, displaced, film, lines, room, rough, tour};
use crate::scans::{aligned, errors, without_poses};

/// Theorem: lines of sight of all frames together refuse joins that fit by themselves. Pairs of corners did, and whole groups came out
/// turned by half the room.
#[test]
fn no_frame_without_a_pose_is_placed_wrongly() {
    let count = base::tier::cases(8).into();
    for seed in 1..=count {
        let images = tour(&room(seed, 14), 14, (60, 75), 0.004);
        let alignment = aligned(&without_poses(&images), &Constraints::default());
        let off = errors(&images, &alignment);
        println!("{seed}: {} of {} placed", off.iter().flatten().count(), off.len());
        assert!(off.iter().flatten().all(|off| *off < 2.0), "{seed}: {off:?} {}", lines(&alignment));
    }
}

/// Theorem: with exact poses, what data do not hold is not placed; nothing that is placed has slid along walls.
#[test]
fn nothing_slides_in_an_empty_room() {
    for things in [0, 2] {
        let images = tour(&room(3, things), 10, (48, 60), 0.004);
        let alignment = rough(&images, Some(0.3), &Constraints::default());
        for (image, found) in images.iter().zip(&alignment.world_from_scan) {
            let off = found.map(|found| displaced(image, &found));
            assert!(off.is_none_or(|off| off < 0.06), "{things}: {off:?} {}", lines(&alignment));
        }
    }
}

fn boxed(scene: &mut TriMesh, half: DVec3, to: DVec3, is_inside_out: bool) {
    add(scene, &Shape::Cuboid { half }.mesh(4), 0.0, to, is_inside_out);
}

/// An office, 8 x 6 x 2.7 m, of equal desks, each with a screen.
pub fn office() -> TriMesh {
    let mut scene = TriMesh::default();
    boxed(&mut scene, DVec3::new(4.0, 3.0, 1.35), DVec3::new(0.0, 0.0, 1.35), true);
    for k in 0..6 {
        let at = DVec3::new(2.4 * f64::from(k % 3) - 2.4, if k < 3 { -1.7 } else { 1.7 }, 0.0);
        boxed(&mut scene, DVec3::new(0.7, 0.4, 0.37), at + 0.37 * DVec3::Z, false);
        boxed(&mut scene, DVec3::new(0.25, 0.03, 0.18), at + 0.95 * DVec3::Z, false);
    }
    scene
}

/// A corridor, 14 x 1.8 x 2.5 m, with equal doors on both sides.
pub fn corridor() -> TriMesh {
    let mut scene = TriMesh::default();
    boxed(&mut scene, DVec3::new(7.0, 0.9, 1.25), DVec3::new(0.0, 0.0, 1.25), true);
    for k in 0..6 {
        for side in [-0.9, 0.9] {
            boxed(&mut scene, DVec3::new(0.45, 0.06, 1.0), DVec3::new(2.2 * f64::from(k) - 5.5, side, 1.0), false);
        }
    }
    scene
}

/// Two equal rooms, 4 x 4 x 2.6 m, with the same things in them, joined by a passage.
pub fn twins() -> TriMesh {
    let mut scene = TriMesh::default();
    for x in [-2.0, 2.0] {
        boxed(&mut scene, DVec3::new(0.35, 0.5, 0.6), DVec3::new(x - 1.2, 1.4, 0.6), false);
        boxed(&mut scene, DVec3::new(0.5, 0.3, 0.35), DVec3::new(x + 0.4, -1.6, 0.35), false);
        boxed(&mut scene, DVec3::new(0.2, 0.2, 0.9), DVec3::new(x + 0.3, 1.7, 0.9), false);
    }
    boxed(&mut scene, DVec3::new(4.0, 2.0, 1.3), DVec3::new(0.0, 0.0, 1.3), true);
    boxed(&mut scene, DVec3::new(0.05, 0.75, 1.3), DVec3::new(0.0, 1.25, 1.3), false);
    boxed(&mut scene, DVec3::new(0.05, 0.75, 1.3), DVec3::new(0.0, -1.25, 1.3), false);
    scene
}

/// A walk that turns once about z while the eye goes along an ellipse.
pub fn walk(scene: &TriMesh, count: usize, radii: [f64; 2], size: (usize, usize)) -> Vec<RangeImage> {
    let place = |k: usize| {
        let turn = std::f64::consts::TAU * k as f64 / count as f64;
        let eye = DVec3::new(radii[0] * turn.cos(), radii[1] * turn.sin(), 1.4 + 0.1 * (2.0 * turn).sin());
        let ahead = turn + 0.7;
        (eye, eye + DVec3::new(2.0 * ahead.cos(), 2.0 * ahead.sin(), -0.5))
    };
    film(scene, &(0..count).map(place).collect::<Vec<_>>(), size, 0.004)
}

/// Theorem: pairs of frames that share walls alone join nothing.
#[test]
fn walls_alone_join_nothing() {
    let images = tour(&room(0, 2), 10, (60, 80), 0.004);
    let alignment = aligned(&without_poses(&images), &Constraints::default());
    let off = errors(&images, &alignment);
    assert!(off.iter().flatten().all(|off| *off < 2.0), "{off:?} {}", lines(&alignment));
}
