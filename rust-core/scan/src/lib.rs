//! The virtual range scanner: mesh + camera -> range image whose truth is known.
//!
//! | file | what |
//! |---|---|
//! | `camera` | place of a scanner, and how its pixels see; rings of cameras |
//! | `rays` | the rays of a camera's pixels, in tiles that run close together |
//! | `noise` | errors of a real scanner: noise, steps, dropouts, a wrong pose |
//! | `shapes` | meshes to scan whose distances are known exactly |
//! | `sculpture` | the rich shape of the demo: a serpent around a column |

mod camera;
mod operation;

mod noise;

mod rays;

pub mod sculpture;

pub use camera::{TurntableViews, VirtualCamera, turntable};

/// The former name of [`VirtualCamera`].
#[deprecated(since = "0.2.0", note = "it is called `VirtualCamera`")]
pub type Camera = VirtualCamera;

/// The former name of [`TurntableViews`].
#[deprecated(since = "0.2.0", note = "it is called `TurntableViews`")]
pub type Turntable = TurntableViews;
pub use mesh::measure::bounds;
pub use mesh::shapes;
pub use operation::OPERATION;

use glam::DVec3;
use rayon::prelude::*;

use base::error::{Error, Result};
use base::magnitude;
use base::memory;
use base::params::{angle, count, flag, length, ratio};
use base::progress::Progress;
use geom::bvh::{Bvh, Hit, PACKET, Ray};
use image::range_image::RangeImage;
use mesh::{AttributeData, TriMesh};
use rays::{TILE, Tiles};

base::params! {
    /// Errors that a virtual scanner adds to the truth. The defaults add nothing.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct ScanParams of "scan" with threads {
        /// Standard deviation of the Gaussian noise along each ray.
        noise: f64 = length("Noise"),
        /// Growth of the noise where the surface is seen at a grazing angle: it is multiplied by 1 + growth * (1 / cos - 1), with the
        /// cosine between ray and normal, at least 0.05.
        noise_grazing: f64 = ratio("Noise grazing").at_most(100.0),
        /// Values are rounded to multiples of this step.
        quantum: f64 = length("Quantum").off("they stay as they are"),
        /// Share of the pixels that give no value, whatever they see.
        dropout: f64 = ratio("Dropout").at_most(1.0),
        /// Share of further pixels that give no value where the ray grazes the surface. It falls with (1 - cos)^4 to 0 where the ray is
        /// perpendicular to the surface.
        dropout_grazing: f64 = ratio("Dropout grazing").at_most(1.0),
        /// Largest distance from the sensor at which a surface is seen. Orthographic sensors are infinitely far away and take none.
        max_range: Option<f64> = length("Max range").from_data("none, everything in sight is seen").above(0.0),
        /// Triangles seen from behind give values too.
        backfaces: bool = flag("Backfaces").off("they hide what is behind them and give none"),
        /// Standard deviation, along each axis, of the error of the reported position: how badly the scans are registered.
        pose_shift: f64 = length("Pose shift"),
        /// Standard deviation of the angle of the error of the reported orientation, about the centre of what was seen.
        pose_turn: f64 = angle("Pose turn").at_most(std::f64::consts::PI),
        /// Number all randomness follows from. Give each scan its own.
        seed: u64 = count("Seed").at_most(9_007_199_254_740_992.0),
    }
    checked by lengths
}

impl ScanParams {
    /// No length is larger than coordinates may be.
    fn lengths(&self) -> Result<()> {
        magnitude::coordinate("noise", self.noise)?;
        magnitude::coordinate("quantum", self.quantum)?;
        magnitude::coordinate("pose_shift", self.pose_shift).map(drop)
    }
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

    progress.plan(&[("scanning", 1.0)]);
    progress.stage(0, camera.rows.div_ceil(TILE) as u64);
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

#[cfg(test)]
mod tests;
