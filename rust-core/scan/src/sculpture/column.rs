//! Pedestal, fluted shaft, capital and the pearl on top. The axis is z.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::field::{Part, smooth_max, smooth_min, smooth_step};

const STONE: DVec3 = DVec3::new(0.56, 0.47, 0.36);
const DARK_STONE: DVec3 = DVec3::new(0.17, 0.12, 0.085);
const GOLD: DVec3 = DVec3::new(0.78, 0.45, 0.10);
const PEARL: DVec3 = DVec3::new(0.78, 0.82, 0.90);

/// Top of the pedestal.
pub(super) const FLOOR: f64 = 32.0;
/// The pearl's place.
const PEARL_CENTRE: DVec3 = DVec3::new(0.0, 0.0, FLOOR + 159.0);

/// Radius of the shaft at a height, without its flutes.
pub(super) fn shaft_radius(z: f64) -> f64 {
    let t = ((z - FLOOR) / 130.0).clamp(0.0, 1.0);
    21.0 - 7.0 * t + 2.5 * (TAU * 0.75 * t).sin()
}

pub(super) fn part(p: DVec3, coloured: bool) -> Part {
    let rho = p.truncate().length();
    let q = DVec2::new(rho, p.z);
    let angle = p.y.atan2(p.x);

    let (shaft, groove) = shaft(q, angle);
    let drum = pedestal(q, angle);
    let mut stone = smooth_min(drum, shaft, 4.0);
    stone = smooth_min(stone, capital(q, angle), 1.5);
    let stone = Part::new(stone, if coloured { stone_colour(p, groove) } else { STONE });

    let beads = bead_ring(p, 48, 60.0, FLOOR - 3.5, 2.0).min(bead_ring(p, 24, 16.6, FLOOR + 137.5, 1.6));
    let gold = Part::new(beads, GOLD).or(Part::new(p.distance(PEARL_CENTRE) - 14.0, PEARL));
    stone.blend(gold, 0.6)
}

/// Veins and dirt: darker in the flutes and near the floor.
fn stone_colour(p: DVec3, groove: f64) -> DVec3 {
    let vein = ((p.x * 0.11 + (p.z * 0.07).sin() * 2.0).sin() + (p.y * 0.13 + p.z * 0.05).sin()).abs();
    let dirt = 0.75 * groove + 0.2 * (1.0 - smooth_step(0.0, 0.25, vein));
    STONE.lerp(DARK_STONE, dirt.clamp(0.0, 1.0))
}

/// Distance to a solid of revolution's rectangle `0 <= rho <= radius`, `from <= z <= to` with rounded edges.
fn disc(q: DVec2, radius: f64, from: f64, to: f64, round: f64) -> f64 {
    let d = DVec2::new(q.x - radius, (q.y - 0.5 * (from + to)).abs() - 0.5 * (to - from)) + round;
    d.max(DVec2::ZERO).length() + d.max_element().min(0.0) - round
}

/// Distance to a ring of radius `radius` about the axis with a round section.
fn ring(q: DVec2, radius: f64, z: f64, section: f64) -> f64 {
    q.distance(DVec2::new(radius, z)) - section
}

/// The drum with an arcade of niches around it, between mouldings.
fn pedestal(q: DVec2, angle: f64) -> f64 {
    let base = disc(q, 66.0, 0.0, 6.0, 1.5);
    let torus = ring(q, 60.0, 7.5, 3.2);
    let drum = disc(q, 57.0, 2.0, 26.0, 0.5);
    let top = disc(q, 60.0, 25.0, FLOOR, 2.0);
    // Niches with round arches, cut by an upright capsule each.
    let niche = TAU / 24.0;
    let across = (angle.rem_euclid(niche) - 0.5 * niche) * 55.0;
    let upright = DVec2::new(across, q.y - q.y.clamp(12.0, 18.5)).length() - 4.6;
    let cut = smooth_max(upright, 52.5 - q.x, 0.6);
    let drum = smooth_max(drum, -cut, 0.8);
    let body = smooth_min(smooth_min(base, torus, 1.0), smooth_min(drum, top, 1.0), 1.0);
    // Petals sunk into the floor.
    let petals = 0.5 + 0.5 * (12.0 * angle).cos();
    let rosette = petals * smooth_step(29.0, 34.0, q.x) * (1.0 - smooth_step(48.0, 54.0, q.x));
    let near_floor = smooth_step(6.0, 3.0, (q.y - FLOOR).abs());
    body + 1.3 * rosette * near_floor
}

/// The shaft, and how deep in a flute the point is, 0 to 1.
fn shaft(q: DVec2, angle: f64) -> (f64, f64) {
    let turn = angle + 0.012 * (q.y - FLOOR);
    // Flutes fade out toward both ends.
    let fade = smooth_step(FLOOR + 8.0, FLOOR + 16.0, q.y) * (1.0 - smooth_step(FLOOR + 118.0, FLOOR + 126.0, q.y));
    let groove = fade * (0.5 + 0.5 * (16.0 * turn).cos()).powf(1.5);
    let side = (q.x - shaft_radius(q.y) + 2.4 * groove) * 0.6;
    let ends = (q.y - FLOOR - 68.0).abs() - 72.0;
    let foot = ring(q, 24.0, FLOOR + 2.0, 3.6).min(ring(q, 22.5, FLOOR + 7.5, 2.0));
    (smooth_min(smooth_max(side, ends, 2.0), foot, 1.2), groove)
}

/// Rings, a dish with leaves, and the cup of the pearl.
fn capital(q: DVec2, angle: f64) -> f64 {
    let neck = ring(q, 15.0, FLOOR + 129.0, 2.0);
    let band = disc(q, 16.4, FLOOR + 133.0, FLOOR + 142.0, 1.0);
    // The dish opens upward; its rim waves with eight leaves.
    let wave = 0.5 + 0.5 * (8.0 * angle).cos();
    let rise = ((q.y - FLOOR - 141.0) / 14.0).clamp(0.0, 1.0);
    let wall = 12.0 + 13.0 * rise * rise + 2.5 * wave * rise;
    let rim = FLOOR + 152.0 + 4.0 * wave;
    let dish = smooth_max(((q.x - wall).abs() - 1.9) * 0.62, (q.y - rim).max(FLOOR + 140.0 - q.y) * 0.75, 1.5);
    let cup = disc(q, 13.0, FLOOR + 140.0, FLOOR + 148.0, 1.0);
    smooth_min(smooth_min(neck, band, 1.0), smooth_min(dish, cup, 2.0), 1.0)
}

/// `count` balls on a ring.
fn bead_ring(p: DVec3, count: usize, radius: f64, z: f64, size: f64) -> f64 {
    let step = TAU / count as f64;
    let angle = p.y.atan2(p.x).rem_euclid(step) - 0.5 * step;
    let rho = p.truncate().length();
    DVec3::new(rho * angle.cos() - radius, rho * angle.sin(), p.z - z).length() - size
}
