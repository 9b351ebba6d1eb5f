//! The driver: rays through all pixels, and what the scanner reports of their hits.

use glam::DVec3;
use rayon::prelude::*;

use crate::camera::VirtualCamera;
use crate::noise;
use crate::params::ScanParams;
use crate::rays::{self, TILE, Tiles};
use base::error::{Error, Result};
use base::memory;
use base::progress::Progress;
use geom::bvh::{Bvh, Hit, PACKET, Ray};
use image::range_image::RangeImage;
use mesh::{AttributeData, TriMesh};

base::stages! {
    /// Stages with their shares of the time.
    PLAN:
    SCANNING = "scanning", 1.0;
}

/// Scans a mesh.
///
/// `bvh` is built from the mesh's own positions and triangles. The image has the camera's projection and a value for every pixel whose ray
/// meets the mesh, exact up to rounding if `params` add nothing. Its pose is the camera's, with the error that `params` ask for; the camera
/// keeps the true one. If the mesh has the vertex attribute `colour`, the image has colours, mixed by the weights of the triangle's
/// corners. The normal of a triangle is that of its corners.
///
/// # Guarantees
/// The same image for any number of threads. Randomness depends on the seed and the pixel's index alone, so the same
/// pixel gets the same noise from any mesh.
///
/// # Cost
/// Time: one ray a pixel, see [`Bvh::first_hits`]. Memory: the image.
///
/// # Errors
/// Parameters out of range. A camera that isn't usable. A `bvh` of another mesh. [`Error::OutOfMemory`] for an image that does not fit.
/// [`Error::Cancelled`].
pub fn scan(
    mesh: &TriMesh,
    bvh: &Bvh<'_>,
    camera: &VirtualCamera,
    params: &ScanParams,
    progress: &Progress<'_>,
) -> Result<RangeImage> {
    params.validate()?;
    camera.validate()?;
    if bvh.len() != mesh.triangles.len() {
        return Err(Error::input(format!(
            "the hierarchy has {} triangles, the mesh {}: build it from this mesh",
            bvh.len(),
            mesh.triangles.len()
        )));
    }
    let colours = match mesh.vertex_attribute("colour") {
        Some(AttributeData::Colour(c)) if c.len() == mesh.positions.len() => Some(c.as_slice()),
        Some(AttributeData::Colour(c)) => {
            let (entries, vertices) = (c.len(), mesh.positions.len());
            return Err(Error::input(format!(
                "attribute colour has {entries} entries for {vertices} vertices: give one each"
            )));
        }
        _ => None,
    };
    let tiles = Tiles::new(camera, params.max_range)?;
    let pixels = camera.rows * camera.cols;
    let mut values = allocate(pixels, f64::NAN, camera)?;
    let mut colour = allocate(if colours.is_some() { pixels } else { 0 }, [0u8; 4], camera)?;

    progress.plan(PLAN);
    progress.stage(SCANNING, camera.rows.div_ceil(TILE) as u64);
    let pool = base::threads::pool(params.threads)?;
    let shooter = Shooter { mesh, bvh, colours, params, tiles: &tiles };
    let band = (TILE * camera.cols).max(1);
    progress.run(&pool, || {
        if colours.is_some() {
            values.par_chunks_mut(band).zip(colour.par_chunks_mut(band)).enumerate().try_for_each(|(b, (v, c))| {
                shooter.band(b, v, c);
                progress.advance(1)
            })
        } else {
            values.par_chunks_mut(band).enumerate().try_for_each(|(b, v)| {
                shooter.band(b, v, &mut []);
                progress.advance(1)
            })
        }
    })?;

    let mut image = RangeImage::from_values(camera.rows, camera.cols, values, camera.projection)?;
    image.colour = colours.map(|_| colour);
    image.world_from_sensor = camera.world_from_sensor;
    image.world_from_sensor = noise::reported_pose(&image, params);
    Ok(image)
}

fn allocate<T: Clone>(count: usize, value: T, camera: &VirtualCamera) -> Result<Vec<T>> {
    let mut all = memory::reserved(count, || format!("an image of {} x {} pixels", camera.rows, camera.cols))?;
    all.resize(count, value);
    Ok(all)
}

struct Shooter<'a> {
    mesh: &'a TriMesh,
    bvh: &'a Bvh<'a>,
    colours: Option<&'a [[u8; 4]]>,
    params: &'a ScanParams,
    tiles: &'a Tiles,
}

impl Shooter<'_> {
    /// Scans one band of tiles: `TILE` rows, fewer in the last one.
    fn band(&self, band: usize, values: &mut [f64], colour: &mut [[u8; 4]]) {
        let tiles = self.tiles;
        let first_row = band * TILE;
        let rows = TILE.min(tiles.rows - first_row);
        let mut rays = [Ray { origin: DVec3::ZERO, direction: DVec3::ZERO }; PACKET];
        let mut pixels = [(0usize, 0usize); PACKET];
        let mut hits = [None; PACKET];
        for first_col in (0..tiles.cols).step_by(TILE) {
            let cols = TILE.min(tiles.cols - first_col);
            let mut count = 0;
            for (row, col) in rays::tile_order(rows, cols) {
                pixels[count] = (first_row + row, first_col + col);
                rays[count] = tiles.ray(first_row + row, first_col + col);
                count += 1;
            }
            self.bvh.first_hits(&rays[..count], tiles.t_min, f64::INFINITY, &mut hits[..count]);
            for i in 0..count {
                let Some(hit) = hits[i] else { continue };
                let (row, col) = pixels[i];
                let Some(value) = self.value(row, col, &rays[i], &hit) else { continue };
                let place = (row - first_row) * tiles.cols + col;
                values[place] = value;
                if let Some(colours) = self.colours {
                    colour[place] = mix(colours, self.mesh.triangles[hit.triangle as usize], hit.barycentric);
                }
            }
        }
    }

    /// The value that the pixel reports of its hit.
    fn value(&self, row: usize, col: usize, ray: &Ray, hit: &Hit) -> Option<f64> {
        if hit.from_behind && !self.params.backfaces {
            return None;
        }
        let length = ray.direction.length();
        if hit.t * length > self.tiles.max_range {
            return None;
        }
        let pixel = (row * self.tiles.cols + col) as u64;
        let cosine = || {
            let [a, b, c] = self.mesh.corners(hit.triangle as usize);
            let normal = (b - a).cross(c - a);
            (normal.dot(ray.direction) / (normal.length() * length)).abs()
        };
        let error = noise::along_ray(self.params, pixel, cosine)?;
        let value = (hit.t + error / length) * self.tiles.value_per_t;
        Some(noise::quantize(value, self.params.quantum))
    }
}

/// The colour at a point of a triangle, in the encoding of the colours.
fn mix(colours: &[[u8; 4]], triangle: [u32; 3], weights: [f64; 3]) -> [u8; 4] {
    let corners = triangle.map(|v| colours[v as usize]);
    std::array::from_fn(|k| {
        let mixed: f64 = (0..3).map(|i| weights[i] * f64::from(corners[i][k])).sum();
        (mixed + 0.5) as u8
    })
}
