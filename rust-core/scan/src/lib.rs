//! The virtual range scanner: mesh + camera -> range image whose truth is known.
//!
//! | file | what |
//! |---|---|
//! | `camera` | where a scanner stands and how its pixels see; rings of cameras |
//! | `rays` | the rays of a camera's pixels, in tiles that run close together |
//! | `noise` | what a real scanner adds: noise, steps, dropouts, a wrong pose |
//! | `shapes` | meshes to scan whose distances are known exactly |
//! | `sculpture` | the rich shape of the demo: a serpent around a column |

mod camera;

mod noise;

mod rays;

pub mod sculpture;

pub use camera::{Camera, Turntable, turntable};
pub use mesh::measure::bounds;
pub use mesh::shapes;

use glam::DVec3;
use rayon::prelude::*;

use base::error::{Error, Result};
use base::magnitude;
use base::memory;
use base::params::{Default, ParamSpec, Unit};
use base::progress::Progress;
use geom::bvh::{Bvh, Hit, PACKET, Ray};
use image::range_image::RangeImage;
use mesh::{AttributeData, TriMesh};
use rays::{TILE, Tiles};

/// Parameters of the virtual scanner.
pub const PARAMS: &[ParamSpec] = &[
    ParamSpec {
        operation: "scan",
        name: "noise",
        unit: Unit::WorldLength,
        default: Default::Value(0.0),
        min: 0.0,
        min_excluded: false,
        max: f64::INFINITY,
        text: "Standard deviation of the Gaussian noise along each ray.",
    },
    ParamSpec {
        operation: "scan",
        name: "noise_grazing",
        unit: Unit::Ratio,
        default: Default::Value(0.0),
        min: 0.0,
        min_excluded: false,
        max: 100.0,
        text: "Growth of the noise where the surface is seen at a grazing angle: it is multiplied by 1 + noise_grazing * (1 / cos - 1), with the cosine between ray and normal, at least 0.05.",
    },
    ParamSpec {
        operation: "scan",
        name: "quantum",
        unit: Unit::WorldLength,
        default: Default::Value(0.0),
        min: 0.0,
        min_excluded: false,
        max: f64::INFINITY,
        text: "Values are rounded to multiples of this step; 0 keeps them as they are.",
    },
    ParamSpec {
        operation: "scan",
        name: "dropout",
        unit: Unit::Ratio,
        default: Default::Value(0.0),
        min: 0.0,
        min_excluded: false,
        max: 1.0,
        text: "Share of the pixels that give no value, whatever they see.",
    },
    ParamSpec {
        operation: "scan",
        name: "dropout_grazing",
        unit: Unit::Ratio,
        default: Default::Value(0.0),
        min: 0.0,
        min_excluded: false,
        max: 1.0,
        text: "Share of further pixels that give no value where the ray grazes the surface; it falls with (1 - cos)^4 to 0 where the ray is perpendicular to it.",
    },
    ParamSpec {
        operation: "scan",
        name: "max_range",
        unit: Unit::WorldLength,
        default: Default::FromData("none: everything in sight is seen"),
        min: 0.0,
        min_excluded: true,
        max: f64::INFINITY,
        text: "Largest distance from the sensor at which a surface is seen. Orthographic sensors are infinitely far away and take none.",
    },
    ParamSpec {
        operation: "scan",
        name: "backfaces",
        unit: Unit::Count,
        default: Default::Value(0.0),
        min: 0.0,
        min_excluded: false,
        max: 1.0,
        text: "1: triangles seen from behind give values too; 0: they hide what is behind them and give none.",
    },
    ParamSpec {
        operation: "scan",
        name: "pose_shift",
        unit: Unit::WorldLength,
        default: Default::Value(0.0),
        min: 0.0,
        min_excluded: false,
        max: f64::INFINITY,
        text: "Standard deviation, along each axis, of the error of the reported position: how badly the scans are registered.",
    },
    ParamSpec {
        operation: "scan",
        name: "pose_turn",
        unit: Unit::Angle,
        default: Default::Value(0.0),
        min: 0.0,
        min_excluded: false,
        max: std::f64::consts::PI,
        text: "Standard deviation of the angle of the error of the reported orientation, about the centre of what was seen.",
    },
    ParamSpec {
        operation: "scan",
        name: "seed",
        unit: Unit::Count,
        default: Default::Value(0.0),
        min: 0.0,
        min_excluded: false,
        max: 9_007_199_254_740_992.0,
        text: "Number all randomness follows from; give each scan its own.",
    },
    ParamSpec {
        operation: "scan",
        name: "threads",
        unit: Unit::Count,
        default: Default::Value(0.0),
        min: 0.0,
        min_excluded: false,
        max: 1024.0,
        text: "Worker threads, 0 for one a core. The result is the same for any number.",
    },
];

/// What a scanner adds to the truth; see [`PARAMS`]. The default adds nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScanParams {
    /// Standard deviation of the noise along each ray, world units.
    pub noise: f64,
    /// Growth of the noise at grazing angles.
    pub noise_grazing: f64,
    /// Step of the values, world units; 0 for none.
    pub quantum: f64,
    /// Share of pixels without a value.
    pub dropout: f64,
    /// Further share of them at grazing angles.
    pub dropout_grazing: f64,
    /// Largest distance seen, world units.
    pub max_range: Option<f64>,
    /// Whether triangles seen from behind give values.
    pub backfaces: bool,
    /// Error of the reported position, world units.
    pub pose_shift: f64,
    /// Error of the reported orientation, radians.
    pub pose_turn: f64,
    /// What all randomness follows from, at most 2^53.
    pub seed: u64,
    /// Worker threads, 0 for one a core.
    pub threads: usize,
}

impl std::default::Default for ScanParams {
    fn default() -> Self {
        ScanParams {
            noise: 0.0,
            noise_grazing: 0.0,
            quantum: 0.0,
            dropout: 0.0,
            dropout_grazing: 0.0,
            max_range: None,
            backfaces: false,
            pose_shift: 0.0,
            pose_turn: 0.0,
            seed: 0,
            threads: 0,
        }
    }
}

impl ScanParams {
    /// Checks every parameter against [`PARAMS`].
    ///
    /// # Errors
    /// [`Error::Parameter`] naming the first one out of range; [`Error::Input`] for a length larger than
    /// [`magnitude::LARGEST`].
    pub fn validate(&self) -> Result<()> {
        let given = [
            ("noise", self.noise),
            ("noise_grazing", self.noise_grazing),
            ("quantum", self.quantum),
            ("dropout", self.dropout),
            ("dropout_grazing", self.dropout_grazing),
            ("pose_shift", self.pose_shift),
            ("pose_turn", self.pose_turn),
            ("seed", self.seed as f64),
            ("threads", self.threads as f64),
        ];
        for (name, value) in given.into_iter().chain(self.max_range.map(|r| ("max_range", r))) {
            let spec = PARAMS.iter().find(|p| p.name == name).expect("every field is in the table");
            spec.check(value)?;
        }
        magnitude::coordinate("noise", self.noise)?;
        magnitude::coordinate("quantum", self.quantum)?;
        magnitude::coordinate("pose_shift", self.pose_shift)?;
        Ok(())
    }
}

/// Scans a mesh.
///
/// `bvh` is built from the mesh's own positions and triangles. The image has the camera's projection and a value for
/// every pixel whose ray meets the mesh, exact up to rounding where `params` add nothing. Its pose is the camera's, with
/// the error that `params` ask for; the camera keeps the true one. Where the mesh has the vertex attribute `colour`, the
/// image has colours, mixed by the weights of the triangle's corners. The normal of a triangle is that of its corners.
///
/// # Guarantees
/// The same image for any number of threads. Randomness depends on the seed and the pixel's index alone, so the same
/// pixel gets the same noise from any mesh.
///
/// # Cost
/// Time: one ray a pixel, see [`Bvh::first_hits`]. Memory: the image.
///
/// # Errors
/// Parameters out of range; a camera that isn't usable; a `bvh` of another mesh; [`Error::OutOfMemory`] for an image that
/// does not fit; [`Error::Cancelled`].
pub fn scan(
    mesh: &TriMesh,
    bvh: &Bvh<'_>,
    camera: &Camera,
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
            return Err(Error::input(format!("attribute colour has {entries} entries for {vertices} vertices")));
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

fn allocate<T: Clone>(count: usize, value: T, camera: &Camera) -> Result<Vec<T>> {
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

    /// What the pixel reports of its hit.
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
