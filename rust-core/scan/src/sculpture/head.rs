//! The serpent's head, in its own frame: x to the side, y up, z ahead.

use glam::{DMat3, DVec3};

use super::field::{Part, bone, ellipsoid, smooth_max, smooth_min, smooth_step, tube};
use super::serpent::HeadFrame;

const SKIN: DVec3 = DVec3::new(0.03, 0.20, 0.12);
const JAW: DVec3 = DVec3::new(0.70, 0.50, 0.20);
const MOUTH: DVec3 = DVec3::new(0.45, 0.05, 0.05);
const HORN: DVec3 = DVec3::new(0.82, 0.72, 0.52);
const EYE: DVec3 = DVec3::new(0.95, 0.55, 0.02);
const PUPIL: DVec3 = DVec3::new(0.01, 0.01, 0.01);
const FIN: DVec3 = DVec3::new(0.62, 0.07, 0.03);

/// No part of the head is further from its centre.
const REACH: f64 = 46.0;

pub(super) struct Head {
    at: DVec3,
    head_from_world: DMat3,
}

impl Head {
    pub fn new(frame: HeadFrame) -> Self {
        Head { at: frame.at, head_from_world: frame.axes.transpose() }
    }

    pub fn part(&self, p: DVec3, coloured: bool) -> Part {
        let far = p.distance(self.at) - REACH;
        if far > 4.0 {
            return Part { distance: far, ..Part::FAR };
        }
        let p = self.head_from_world * (p - self.at);
        // Both halves are alike.
        let p = DVec3::new(p.x.abs(), p.y, p.z);
        let skull = skull(p, coloured);
        let jaw = lower_jaw(p, coloured);
        let face = skull.blend(jaw, 1.5);
        face.blend(fins(p), 1.0).or(teeth(p)).blend(horns(p), 1.0).or(eye(p)).blend(whisker(p), 0.8)
    }
}

fn skull(p: DVec3, coloured: bool) -> Part {
    let cranium = ellipsoid(p - DVec3::new(0.0, 1.5, 3.0), DVec3::new(9.5, 8.5, 11.5));
    let snout = bone(p * DVec3::new(0.82, 1.0, 1.0), DVec3::new(0.0, 1.5, 8.0), DVec3::new(0.0, 0.5, 28.0), 7.0, 4.0);
    let cheek = (p - DVec3::new(6.5, -2.0, 3.0)).length() - 5.5;
    let brow = bone(p, DVec3::new(3.2, 7.2, 14.0), DVec3::new(8.2, 8.0, 1.0), 1.5, 2.4);
    let ridge = bone(p, DVec3::new(0.0, 6.6, 14.0), DVec3::new(0.0, 4.8, 27.0), 0.9, 0.7);
    let nose = (p - DVec3::new(2.4, 3.2, 29.0)).length() - 2.3;
    let mut d = smooth_min(cranium, snout, 5.0);
    d = smooth_min(d, cheek, 3.0);
    d = smooth_min(d, brow, 1.6);
    d = smooth_min(d, ridge, 1.0);
    d = smooth_min(d, nose, 1.4);
    // Nostril, eye socket, palate.
    d = smooth_max(d, 1.1 - (p - DVec3::new(3.2, 3.8, 31.0)).length(), 0.5);
    d = smooth_max(d, 2.9 - (p - DVec3::new(7.9, 4.4, 9.5)).length(), 0.8);
    let palate = ellipsoid(p - DVec3::new(0.0, -5.2, 20.0), DVec3::new(4.6, 3.2, 14.0));
    d = smooth_max(d, -palate, 1.0);
    let bumps = 0.22 * ((p.x * 1.5).sin() * (p.z * 1.3).sin() * (p.y * 1.4).cos());
    let inside = coloured && palate < 0.6 && p.y < -2.0;
    Part::new((d - bumps) * 0.8, if inside { MOUTH } else { SKIN })
}

fn lower_jaw(p: DVec3, coloured: bool) -> Part {
    let (hinge, chin) = (DVec3::new(0.0, -6.5, 2.0), DVec3::new(0.0, -15.0, 24.0));
    let jaw = bone(p * DVec3::new(0.75, 1.0, 1.0), hinge, chin, 4.8, 2.6);
    let tongue_side = bone(p, DVec3::new(0.0, -2.8, 4.0), DVec3::new(0.0, -12.2, 25.0), 3.2, 2.4);
    let d = smooth_max(jaw, -tongue_side, 1.0);
    let tongue = tube(
        p,
        &[
            DVec3::new(0.0, -6.0, 5.0),
            DVec3::new(0.0, -9.2, 15.0),
            DVec3::new(0.0, -9.6, 24.0),
            DVec3::new(1.6, -7.6, 32.0),
        ],
        1.7,
        0.8,
    );
    let inner = coloured && tongue_side < 0.5;
    Part::new(d * 0.75, if inner { MOUTH } else { JAW }).blend(Part::new(tongue, MOUTH), 1.0)
}

fn horns(p: DVec3) -> Part {
    let long = tube(
        p,
        &[
            DVec3::new(5.5, 8.0, 0.0),
            DVec3::new(9.0, 13.5, -7.0),
            DVec3::new(11.5, 16.5, -15.0),
            DVec3::new(12.0, 20.5, -22.5),
            DVec3::new(10.0, 26.0, -27.5),
        ],
        3.1,
        0.8,
    );
    // Growth rings.
    let long = long - 0.22 * (1.7 * (p.z - p.y)).sin() * smooth_step(6.0, 2.0, p.z);
    let short =
        tube(p, &[DVec3::new(8.5, 4.0, -3.0), DVec3::new(13.0, 5.0, -8.5), DVec3::new(15.0, 8.0, -14.0)], 1.9, 0.7);
    Part::new(long.min(short) * 0.8, HORN)
}

fn eye(p: DVec3) -> Part {
    let centre = DVec3::new(7.0, 4.4, 9.2);
    let look = (p - centre).normalize_or_zero();
    let slit = (look.z - 0.25).abs() < 0.16 && look.x > 0.4;
    Part::new(p.distance(centre) - 2.6, if slit { PUPIL } else { EYE })
}

fn teeth(p: DVec3) -> Part {
    let mut d = f64::INFINITY;
    for (x, z, long) in [(3.1, 29.0, 5.0), (3.9, 25.0, 2.6), (4.5, 21.5, 2.6), (5.1, 18.0, 2.8)] {
        let root = DVec3::new(x, -2.0, z);
        d = d.min(bone(p, root, root + DVec3::new(0.1, -long, 0.4), 1.1, 0.45));
    }
    for (x, y, z, long) in [(2.2, -12.6, 24.5, 4.0), (3.3, -11.4, 20.5, 2.4), (4.1, -10.0, 16.5, 2.4)] {
        let root = DVec3::new(x, y, z);
        d = d.min(bone(p, root, root + DVec3::new(0.1, long, 0.3), 1.0, 0.45));
    }
    Part::new(d, HORN)
}

/// A thin ribbed fan behind each cheek.
fn fins(p: DVec3) -> Part {
    let root = DVec3::new(8.0, -2.0, -1.0);
    let out = DVec3::new(0.62, -0.12, -0.775).normalize();
    let normal = DVec3::new(0.77, 0.15, 0.62);
    let normal = (normal - out * normal.dot(out)).normalize();
    let across = out.cross(normal);
    let q = p - root;
    let (u, v, w) = (q.dot(out), q.dot(across), q.dot(normal));
    let spread = v.atan2(u.max(0.1));
    let rib = (spread * 9.0).cos();
    let edge = DVec3::new(u, v, 0.0).length() - (14.0 + 1.8 * rib);
    let wedge = v.abs() - (2.5 + 0.72 * u);
    let flat = w.abs() - (1.05 + 0.25 * rib);
    Part::new(smooth_max(smooth_max(edge, wedge, 1.0), flat, 0.6) * 0.72, FIN)
}

fn whisker(p: DVec3) -> Part {
    let d = tube(
        p,
        &[
            DVec3::new(4.2, 1.0, 28.0),
            DVec3::new(9.0, -1.0, 32.0),
            DVec3::new(13.5, -5.5, 31.0),
            DVec3::new(15.5, -11.0, 26.5),
            DVec3::new(18.5, -14.0, 21.0),
        ],
        1.15,
        0.75,
    );
    Part::new(d, HORN)
}
