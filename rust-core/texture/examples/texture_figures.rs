//! Figures of texturing: a virtual sculpture with known colours, photographed by 16 cameras, with and without errors.
//!
//! `cargo run --release -p surfrecon-texture --example texture_figures -- [SIZE] [CASE]`
//!
//! Texel PSNR in dB: all texels against the true colour at the nearest true point, in bytes of sRGB.

use std::f64::consts::TAU;
use std::time::Instant;

use glam::{DAffine3, DMat3, DQuat, DVec3};
use rayon::prelude::*;

use base::{Progress, Result};
use cluster::{ClusterParams, Resolution};
use geom::bvh::{Bvh, Ray};
use image::frame::Camera;
use image::photo::{Photo, PhotoInMemory, Pixels};
use mesh::{Attribute, TriMesh, srgb};
use scan::sculpture::sculpture;
use surfrecon_texture::{TextureParams, Textured, run};
use unwrap::{UnwrapParams, Unwrapped};

const PIXELS: usize = 800;
const FOCAL: f64 = 1150.0;

/// Errors of the photos.
#[derive(Clone, Copy)]
struct Errors {
    name: &'static str,
    poses: bool,
    exposure: bool,
    highlights: bool,
}

const CASES: [Errors; 5] = [
    Errors { name: "clean", poses: false, exposure: false, highlights: false },
    Errors { name: "poses", poses: true, exposure: false, highlights: false },
    Errors { name: "exposure", poses: false, exposure: true, highlights: false },
    Errors { name: "highlights", poses: false, exposure: false, highlights: true },
    Errors { name: "all", poses: true, exposure: true, highlights: true },
];

#[allow(clippy::print_stdout)]
fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let size = arguments.next().and_then(|word| word.parse().ok()).unwrap_or(1024);
    let only = arguments.next();
    let none = Progress::none();
    let truth = sculpture(2.0, 0, &none)?;
    let truth_bvh = Bvh::build(&truth.positions, &truth.triangles, 0)?;
    // As many triangles as a merge of scans of 200 x 200 pixels, as near to the truth.
    let merged = ClusterParams {
        resolution: Resolution::Vertices(14_000),
        iterations: 5,
        fitting: 2,
        ..ClusterParams::default()
    };
    let mut detail = cluster::run(&truth, &merged, &none)?.mesh;
    detail.vertex_attributes.clear();
    let colours = detail.positions.iter().map(|&p| nearest_colour(&truth_bvh, p)).map(|[r, g, b]| [r, g, b, 255]);
    let colours = colours.collect();
    detail.vertex_attributes.push(Attribute::colour("colour", colours));
    let coarse = ClusterParams { resolution: Resolution::Vertices(4000), iterations: 10, ..ClusterParams::default() };
    let light = cluster::run(&detail, &coarse, &none)?.mesh;
    let flat = unwrap::unwrap(&light, &UnwrapParams { size, ..UnwrapParams::default() }, &none)?;
    println!(
        "truth {} triangles, detailed {}, light {}, {} charts, {:.3} used, {:.2} texels per mm",
        truth.triangles.len(),
        detail.triangles.len(),
        light.triangles.len(),
        flat.report.charts,
        flat.report.used,
        flat.report.texels_per_unit
    );
    let params = TextureParams { size, threads: 1, ..TextureParams::default() };
    let of_vertices = run(&flat.mesh, &detail, &[], &params, &none)?;
    let known = true_colours(&flat, size, &truth_bvh);
    let (middle, all) = (true_middle(&truth), psnr(&of_vertices, &known, false));
    println!("vertex colours: {all:.2} dB");
    println!(
        "case, options, dB all, dB seen, unseen %, px before, px after, said px, grey before, grey after, gain residual %, s places, s colours, s a megatexel"
    );
    for case in CASES.iter().filter(|case| only.as_deref().is_none_or(|name| name == case.name)) {
        let (shots, poses) = photographed(&truth, &truth_bvh, middle, *case);
        let photos: Vec<&dyn Photo> = shots.iter().map(|shot| shot as &dyn Photo).collect();
        let plain = TextureParams { refine_cameras: false, match_exposure: false, drop_highlights: false, ..params };
        for (options, params) in [("plain", plain), ("default", params)] {
            let start = Instant::now();
            let done = run(&flat.mesh, &detail, &photos, &params, &none)?;
            let seconds = start.elapsed().as_secs_f64();
            let lap = |name: &str| done.report.seconds.iter().find(|lap| lap.0 == name).map_or(0.0, |lap| lap.1);
            let given: Vec<DAffine3> = shots.iter().map(|shot| shot.world_from_camera).collect();
            let [grey_before, grey_after] = done.report.differences.unwrap_or_default();
            let said = done.report.photos.iter().map(|photo| photo.moved).sum::<f64>() / shots.len() as f64;
            println!(
                "{}, {options}, {:.2}, {:.2}, {:.2}, {:.3}, {:.3}, {said:.3}, {grey_before:.3}, {grey_after:.3}, {:.2}, {:.2}, {:.2}, {:.2} ({seconds:.1} s) {:.2?}",
                case.name,
                psnr(&done, &known, false),
                psnr(&done, &known, true),
                100.0 * (1.0 - done.report.seen as f64 / done.report.texels as f64),
                pixels_off(&given, &poses, &truth),
                pixels_off(&done.world_from_camera, &poses, &truth),
                100.0 * gain_residual(&done, *case),
                lap("places"),
                lap("colours"),
                (lap("places") + lap("colours")) * 1e6 / done.report.texels as f64,
                done.report.seconds,
            );
        }
    }
    Ok(())
}

/// Waves of 4 to 50 mm, checks, dark lines of 1.5 mm.
fn colour(p: DVec3) -> [u8; 3] {
    let wave = |direction: DVec3, length: f64| (p.dot(direction.normalize()) * TAU / length).sin();
    let large = wave(DVec3::new(1.0, 0.3, 0.5), 50.0);
    let middle = wave(DVec3::new(-0.4, 1.0, 0.2), 17.0);
    let small = wave(DVec3::new(0.3, -0.5, 1.0), 7.0) * wave(DVec3::new(1.0, 1.0, -0.3), 4.0);
    let checks = (p / 12.0).floor().element_sum().rem_euclid(2.0) - 0.5;
    let line = (p.z + 3.0 * (p.x / 15.0).sin()).rem_euclid(14.0) < 1.5;
    let dark = if line { 0.35 } else { 1.0 };
    let of = |base: f64, a: f64, b: f64, c: f64, d: f64| {
        (255.0 * dark * (base + a * large + b * middle + c * small + d * checks)).clamp(8.0, 240.0).round() as u8
    };
    [of(0.5, 0.15, 0.1, 0.1, 0.12), of(0.48, -0.1, 0.15, 0.08, 0.1), of(0.45, 0.08, -0.12, 0.12, -0.14)]
}

fn nearest_colour(bvh: &Bvh<'_>, p: DVec3) -> [u8; 3] {
    bvh.closest_point(p).map_or([0; 3], |closest| colour(closest.point))
}

/// Centre and radius.
fn true_middle(truth: &TriMesh) -> (DVec3, f64) {
    let (lo, hi) = scan::bounds(&truth.positions).unwrap_or_default();
    ((lo + hi) / 2.0, (hi - lo).max_element() / 2.0)
}

/// Numbers between -1 and 1 that look like chance, the same everywhere.
fn chance(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    ((*seed >> 33) as f64 / (1_u64 << 30) as f64) - 1.0
}

fn normal_of(seed: &mut u64) -> f64 {
    3.0_f64.sqrt() * (chance(seed) + chance(seed) + chance(seed)) / 3.0_f64.sqrt()
}

/// Gains that photos were exposed by: of 15 % in the mean square, of a geometric mean of 1.
fn exposures(case: Errors) -> Vec<[f64; 3]> {
    let mut seed = 77;
    let mut logs: Vec<[f64; 3]> = (0..16)
        .map(|_| {
            let common = 0.14 * normal_of(&mut seed);
            [0; 3].map(|_| common + 0.05 * normal_of(&mut seed))
        })
        .collect();
    for channel in 0..3 {
        let mean = logs.iter().map(|log| log[channel]).sum::<f64>() / 16.0;
        logs.iter_mut().for_each(|log| log[channel] -= mean);
    }
    logs.iter().map(|log| log.map(|log| if case.exposure { log.exp() } else { 1.0 })).collect()
}

/// The photos, and the true poses of their cameras.
fn photographed(
    truth: &TriMesh,
    bvh: &Bvh<'_>,
    (middle, radius): (DVec3, f64),
    case: Errors,
) -> (Vec<PhotoInMemory>, Vec<DAffine3>) {
    let centre = (PIXELS as f64 - 1.0) / 2.0;
    let camera = Camera::sized([FOCAL; 2], [centre; 2], [PIXELS; 2]);
    let mut seed = 5;
    let exposures = exposures(case);
    let mut poses = Vec::new();
    let mut shots = Vec::new();
    for i in 0..16_u32 {
        // From below, from the side and from above, in a spiral.
        let angle = 2.4 * f64::from(i);
        let height: f64 = [-0.5, 0.1, 0.45, 0.95][i as usize % 4];
        let out = DVec3::new(angle.cos() * height.cos(), angle.sin() * height.cos(), height.sin());
        let eye = middle + out * radius * 3.6;
        let right = DVec3::Z.cross(out).normalize();
        let down = -out.cross(right).normalize();
        let pose = DAffine3 { matrix3: DMat3::from_cols(right, down, -out), translation: eye };
        poses.push(pose);
        let colours = (0..PIXELS * PIXELS)
            .into_par_iter()
            .map(|pixel| {
                let (column, row) = ((pixel % PIXELS) as f64, (pixel / PIXELS) as f64);
                let direction = pose.matrix3 * DVec3::new((column - centre) / FOCAL, (row - centre) / FOCAL, 1.0);
                let Some(hit) = bvh.first_hit(&Ray { origin: eye, direction }, 0.0, f64::INFINITY) else {
                    return [30; 3];
                };
                let at = eye + direction * hit.t;
                let bytes = colour(at);
                let [a, b, c] = truth.corners(hit.triangle as usize);
                let normal = (b - a).cross(c - a).normalize();
                // A lamp beside the camera.
                let lamp = (eye + (right * 0.3 - down * 0.3) * radius - at).normalize();
                let half = (lamp - direction.normalize()).normalize();
                let shine = if case.highlights { 0.8 * normal.dot(half).max(0.0).powi(60) } else { 0.0 };
                std::array::from_fn(|k| {
                    let light =
                        f64::from(srgb::light(bytes[k])) * exposures[i as usize][k] + shine * f64::from(srgb::WHITE);
                    srgb::byte(light.clamp(0.0, f64::from(srgb::WHITE)) as u16)
                })
            })
            .collect();
        let mut given = pose;
        if case.poses {
            let mut turn = || 0.05_f64.to_radians() * normal_of(&mut seed);
            let turn = DVec3::new(turn(), turn(), turn());
            let mut shift = || 0.25 * normal_of(&mut seed);
            given.translation += DVec3::new(shift(), shift(), shift());
            given.matrix3 *= DMat3::from_quat(DQuat::from_scaled_axis(turn));
        }
        shots.push(PhotoInMemory {
            name: format!("shot {i:02}"),
            camera,
            world_from_camera: given,
            pixels: Pixels { size: [PIXELS; 2], colours },
            depths: None,
        });
    }
    (shots, poses)
}

/// Error of cameras: pixels, in the root mean square over vertices.
fn pixels_off(poses: &[DAffine3], truth: &[DAffine3], mesh: &TriMesh) -> f64 {
    let (mut squares, mut count) = (0.0, 0.0);
    for (pose, known) in poses.iter().zip(truth) {
        for &p in mesh.positions.iter().step_by(101) {
            let at = |pose: &DAffine3| {
                let p = pose.inverse().transform_point3(p);
                FOCAL * p.truncate() / p.z
            };
            squares += at(pose).distance_squared(at(known));
            count += 1.0;
        }
    }
    (squares / f64::max(count, 1.0)).sqrt()
}

/// Root mean square of the logarithms of what is left of the exposures.
fn gain_residual(done: &Textured, case: Errors) -> f64 {
    let known = exposures(case);
    let of = |i: usize, k: usize| (done.report.photos[i].gain[k] * known[i][k]).ln();
    let squares: f64 = (0..known.len()).map(|i| (0..3).map(|k| of(i, k).powi(2)).sum::<f64>()).sum();
    (squares / (3 * known.len()) as f64).sqrt()
}

/// True colours of the covered texels: at the true point nearest to the texel's on the light mesh.
fn true_colours(flat: &Unwrapped, size: u32, bvh: &Bvh<'_>) -> Vec<Option<[u8; 3]>> {
    let mut known = vec![None; (size * size) as usize];
    for (t, corners) in flat.mesh.triangles.iter().enumerate() {
        let [a, b, c] = corners.map(|v| {
            let uv = flat.uv[v as usize];
            glam::DVec2::new(uv.x, 1.0 - uv.y) * f64::from(size) - 0.5
        });
        let (lo, hi) = (a.min(b).min(c).ceil(), a.max(b).max(c).floor());
        for row in lo.y.max(0.0) as u32..=hi.y.max(0.0) as u32 {
            for column in lo.x.max(0.0) as u32..=hi.x.max(0.0) as u32 {
                let p = glam::DVec2::new(column.into(), row.into());
                let whole = (b - a).perp_dot(c - a);
                let shares =
                    [(b - p).perp_dot(c - p), (c - p).perp_dot(a - p), (a - p).perp_dot(b - p)].map(|x| x / whole);
                if row < size && column < size && shares.iter().all(|&share| share >= 0.0) {
                    let at = flat.mesh.corners(t);
                    let at = at[0] * shares[0] + at[1] * shares[1] + at[2] * shares[2];
                    known[(row * size + column) as usize] = Some(nearest_colour(bvh, at));
                }
            }
        }
    }
    known
}

fn psnr(done: &Textured, known: &[Option<[u8; 3]>], seen_only: bool) -> f64 {
    let (mut squares, mut count) = (0.0, 0.0);
    for (i, known) in known.iter().enumerate() {
        let Some(known) =
            known.filter(|_| !seen_only || done.images.tiles[0].mask.as_ref().is_some_and(|mask| mask[i] == 255))
        else {
            continue;
        };
        for k in 0..3 {
            squares += (f64::from(known[k]) - f64::from(done.images.tiles[0].colour[i][k])).powi(2);
            count += 1.0;
        }
    }
    10.0 * (255.0_f64.powi(2) * count / squares).log10()
}
