//! Rooms seen from inside, where walls fit walls and corners fit corners: what is placed is placed rightly.

use surfrecon_align::Constraints;

use crate::reach::{displaced, lines, room, rough, tour};
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
