//! Rooms that hold little: walls slide along walls, corners fit corners. Nothing is placed wrongly, and it is said.

use glam::DVec3;
use image::RangeImage;
use mesh::TriMesh;
use mesh::shapes::Shape;
use surfrecon_align::{Alignment, Constraints, ScanState};

use crate::reach::{add, film, lines, room, tour};
use crate::rooms::none_wrong;
use crate::scans::{aligned, without_poses};
use crate::sequence::followed;

const SIZE: (usize, usize) = (60, 80);

fn heap(images: &[RangeImage]) -> Alignment {
    aligned(&without_poses(images), &Constraints::default())
}

/// Not even pieces.
pub fn nothing_joined(alignment: &Alignment) {
    assert_eq!(alignment.report.placed(), 0, "{}", lines(alignment));
    assert!(alignment.report.groups.iter().all(|group| group.len() == 1), "{}", lines(alignment));
}

/// Every scan without a place has a reason, and one of them has one of these words.
fn is_said(alignment: &Alignment, words: &[&str]) {
    let scans = &alignment.report.scans;
    let has_no_place = |state| matches!(state, ScanState::Unplaced | ScanState::Apart);
    let reasons = || scans.iter().filter(|scan| has_no_place(scan.state)).map(|scan| &scan.reason);
    assert!(reasons().all(|reason| !reason.is_empty()), "{}", lines(alignment));
    assert!(reasons().any(|reason| words.iter().any(|word| reason.contains(word))), "{words:?}: {}", lines(alignment));
}

/// Theorem: frames of an empty room are a heap of which nothing is placed, nor joined in pieces.
#[test]
fn an_empty_room_is_refused() {
    let count = if base::tier::is_thorough() { 14 } else { 6 };
    let alignment = heap(&tour(&room(3, 0), count, SIZE, 0.004));
    nothing_joined(&alignment);
    is_said(&alignment, &["places", "elsewhere"]);
}

/// 3 m along each edge.
fn cube() -> TriMesh {
    let mut scene = TriMesh::default();
    add(&mut scene, &Shape::Cuboid { half: DVec3::splat(1.5) }.mesh(4), 0.0, DVec3::new(0.0, 0.0, 1.5), true);
    scene
}

/// Frames of a camera in a cube. It turns about z, `count` frames a turn, and looks up and down.
fn turn(cube: &TriMesh, count: usize, some: usize) -> Vec<RangeImage> {
    let place = |k: usize| {
        let turn = std::f64::consts::TAU * k as f64 / count as f64;
        let eye = DVec3::new(0.3 * turn.cos(), 0.2 * turn.sin(), 1.4);
        (eye, eye + DVec3::new((turn + 0.5).cos(), (turn + 0.5).sin(), 0.4 * (3.0 * turn).sin() - 0.2))
    };
    film(cube, &(0..some).map(place).collect::<Vec<_>>(), SIZE, 0.004)
}

#[test]
fn a_heap_of_a_cube_fits_in_several_places() {
    let count = if base::tier::is_thorough() { 12 } else { 5 };
    let alignment = heap(&turn(&cube(), count, count));
    nothing_joined(&alignment);
    is_said(&alignment, &["places", "elsewhere"]);
}

/// Theorem: corners hold neighbours. If a frame shows too little of one, track is lost, which is said, and pieces are not joined.
#[test]
fn a_cube_is_followed_as_far_as_its_corners_hold() {
    let images = turn(&cube(), 40, if base::tier::is_thorough() { 40 } else { 8 });
    let alignment = followed(&images, 0);
    none_wrong(&images, &alignment);
    assert!((2..images.len()).contains(&alignment.report.placed()), "{}", lines(&alignment));
    is_said(&alignment, &["slide"]);
    let lost = |text: &String| text.starts_with("track was lost") && text.contains("what both show can turn or slide");
    assert!(alignment.report.messages.iter().any(lost), "{}", lines(&alignment));
}

/// Two walls, floor and ceiling. No ends.
fn plain_corridor() -> TriMesh {
    let mut scene = TriMesh::default();
    add(
        &mut scene,
        &Shape::Cuboid { half: DVec3::new(12.0, 0.9, 1.25) }.mesh(8),
        0.0,
        DVec3::new(0.0, 0.0, 1.25),
        true,
    );
    let is_end = |t: &[u32; 3]| t.iter().all(|&v| scene.positions[v as usize].x.abs() > 11.9);
    scene.triangles = scene.triangles.iter().filter(|t| !is_end(t)).copied().collect();
    scene
}

#[test]
fn a_plain_corridor_slides_and_it_is_said() {
    // Along it, looking ahead and a little to the sides.
    let place = |k: usize| {
        let eye = DVec3::new(0.25 * k as f64 - 1.5, 0.1 * (k as f64).sin(), 1.3);
        (eye, eye + DVec3::new(1.0, 0.3 * (0.7 * k as f64).sin(), -0.15))
    };
    let count = if base::tier::is_thorough() { 12 } else { 5 };
    let images = film(&plain_corridor(), &(0..count).map(place).collect::<Vec<_>>(), SIZE, 0.004);
    let (heap, followed) = (heap(&images), followed(&images, 0));
    for alignment in [&heap, &followed] {
        nothing_joined(alignment);
        is_said(alignment, &["slide along the direction"]);
    }
    let lost = |k: usize| {
        let place = format!("track was lost between {:?} and {:?}", images[k].name, images[k + 1].name);
        let is_of_both = |text: &&String| text.starts_with(&place);
        followed.report.messages.iter().find(is_of_both).is_some_and(|text| text.contains("can turn or slide"))
    };
    assert!((0..4).all(lost), "{}", lines(&followed));
}
