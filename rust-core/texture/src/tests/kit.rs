//! Scenes for the tests: meshes with coordinates, photos of them with known colours.

use std::f64::consts::TAU;

use glam::{DAffine3, DMat3, DVec2, DVec3};

use base::{Progress, Result};
use geom::bvh::{Bvh, Ray};
use image::frame::Camera;
pub use image::photo::PhotoInMemory as Shot;
use image::photo::{Photo, Pixels};
use mesh::shapes::Shape;
use mesh::{Tile, TriMesh, srgb};
use unwrap::{UnwrapParams, Unwrapped};

use crate::{TextureParams, Textured, run};

/// Texels of a side.
pub const SIZE: u32 = 96;

/// Nothing is done beside blending.
pub const PLAIN: TextureParams = TextureParams {
    size: SIZE,
    refine_cameras: false,
    match_exposure: false,
    drop_highlights: false,
    normal_map: false,
    height_map: false,
    occlusion_rays: 0,
    threads: 1,
};

/// A camera at a place that looks at another.
pub fn looking(eye: DVec3, at: DVec3) -> DAffine3 {
    let forward = (at - eye).normalize();
    let right = forward.cross(DVec3::Z).try_normalize().unwrap_or(DVec3::X);
    DAffine3 { matrix3: DMat3::from_cols(right, forward.cross(right), forward), translation: eye }
}

/// A photo of 120 x 100 pixels of a mesh whose places have these colours. The background is grey.
pub fn shot(name: &str, mesh: &TriMesh, eye: DVec3, colour: &dyn Fn(DVec3) -> [u8; 3]) -> Shot {
    shot_of([120, 100], name, mesh, eye, colour)
}

/// The same at another size.
pub fn shot_of(size: [usize; 2], name: &str, mesh: &TriMesh, eye: DVec3, colour: &dyn Fn(DVec3) -> [u8; 3]) -> Shot {
    let focal = size[1] as f64 * 1.1;
    let camera = Camera::sized([focal; 2], size.map(|count| (count as f64 - 1.0) / 2.0), size);
    let pose = looking(eye, DVec3::ZERO);
    let bvh = Bvh::build(&mesh.positions, &mesh.triangles, 1).unwrap();
    let of = |i: usize| {
        let at = DVec2::new((i % size[0]) as f64, (i / size[0]) as f64);
        let through = (at - DVec2::from(camera.centre)) / focal;
        let direction = pose.matrix3 * through.extend(1.0);
        let hit = bvh.first_hit(&Ray { origin: eye, direction }, 0.0, f64::INFINITY);
        hit.map_or([90, 90, 90], |hit| colour(eye + direction * hit.t))
    };
    let pixels = Pixels { size, colours: (0..size[0] * size[1]).map(of).collect() };
    Shot { name: name.into(), camera, world_from_camera: pose, pixels, depths: None }
}

/// Smooth colours of space.
pub fn waves(p: DVec3) -> [u8; 3] {
    let of = |x: f64| (128.0 + 80.0 * (x * 1.7).sin()) as u8;
    [of(p.x + p.z), of(p.y - 0.4 * p.z), of(p.z + 0.5 * p.x)]
}

/// Cameras all around, at some height.
pub fn around(count: usize, distance: f64) -> Vec<DVec3> {
    let of = |i: usize| {
        let angle = TAU * i as f64 / count as f64;
        DVec3::new(angle.cos(), angle.sin(), [0.5, -0.5, 0.05][i % 3]).normalize() * distance
    };
    (0..count).map(of).collect()
}

pub fn unwrapped(mesh: &TriMesh) -> Unwrapped {
    let params = UnwrapParams { size: SIZE, padding: 2, threads: 1, ..UnwrapParams::default() };
    unwrap::unwrap(mesh, &params, &Progress::none()).unwrap()
}

pub fn textured(flat: &Unwrapped, detail: &TriMesh, shots: &[Shot], params: &TextureParams) -> Result<Textured> {
    let photos: Vec<&dyn Photo> = shots.iter().map(|shot| shot as &dyn Photo).collect();
    run(&flat.mesh, detail, &photos, params, &Progress::none())
}

/// Covered texels with their points on the mesh, by a loop over all triangles for each.
pub fn covered(flat: &Unwrapped) -> Vec<(usize, DVec3)> {
    let mut covered = Vec::new();
    for place in 0..(SIZE * SIZE) as usize {
        let at = DVec2::new((place as u32 % SIZE) as f64 + 0.5, f64::from(SIZE) - (place as u32 / SIZE) as f64 - 0.5);
        let at = at / f64::from(SIZE);
        for (t, corners) in flat.mesh.triangles.iter().enumerate() {
            let [a, b, c] = corners.map(|v| flat.uv[v as usize]);
            let whole = (b - a).perp_dot(c - a);
            let shares = [(b - at).perp_dot(c - at), (c - at).perp_dot(a - at), (a - at).perp_dot(b - at)];
            if whole > 0.0 && shares.iter().all(|&share| share > 1e-9 * whole) {
                let [p, q, r] = flat.mesh.corners(t);
                covered.push((place, (p * shares[0] + q * shares[1] + r * shares[2]) / whole));
                break;
            }
        }
    }
    covered
}

/// Light of a photo at a place, bilinear, slowly.
pub fn light_at(shot: &Shot, at: DVec2) -> [f64; 3] {
    let mut light = [0.0; 3];
    let [columns, rows] = shot.pixels.size;
    for row in 0..rows {
        for column in 0..columns {
            let share = (1.0 - (at.x - column as f64).abs()).max(0.0) * (1.0 - (at.y - row as f64).abs()).max(0.0);
            if share > 0.0 {
                let colour = shot.pixels.colours[row * columns + column];
                (0..3).for_each(|k| light[k] += share * f64::from(srgb::light(colour[k])));
            }
        }
    }
    light
}

pub fn sphere() -> TriMesh {
    Shape::Sphere { radius: 1.0 }.mesh(4)
}

/// A shape along which no texture can slide.
pub fn pebble() -> TriMesh {
    let mut mesh = Shape::Sphere { radius: 1.0 }.mesh(6);
    let bump = |p: DVec3| 1.0 + 0.12 * (4.0 * p.x).sin() * (5.0 * p.y + 1.0).sin() + 0.1 * (4.0 * p.z).cos();
    mesh.positions.iter_mut().for_each(|p| *p = *p * DVec3::new(0.9, 0.6, 1.1) * bump(*p));
    mesh
}

/// Entry of the mask.
pub fn source(tile: &Tile, place: usize) -> u8 {
    tile.mask.as_ref().unwrap()[place]
}

/// Largest difference of a channel.
pub fn apart(a: [u8; 3], b: [u8; 3]) -> u8 {
    (0..3).map(|k| a[k].abs_diff(b[k])).max().unwrap_or(0)
}
