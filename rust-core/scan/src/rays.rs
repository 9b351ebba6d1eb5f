//! The rays of a camera's pixels, in tiles that run close together.

use glam::{DAffine3, DVec3};

use super::camera::VirtualCamera;
use base::error::{Error, Result};
use geom::bvh::{PACKET, Ray};
use image::range_image::{DepthKind, Projection};

/// Rows and columns of a tile: one packet of rays.
pub(super) const TILE: usize = 8;
const _: () = assert!(TILE * TILE == PACKET);

/// Row and column of the pixels of a tile, by squares of four: four rays that share a vector are neighbours.
pub(super) fn tile_order(rows: usize, cols: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..rows).step_by(2).flat_map(move |row| {
        (0..cols).step_by(2).flat_map(move |col| {
            let square = [(row, col), (row, col + 1), (row + 1, col), (row + 1, col + 1)];
            square.into_iter().filter(move |&(r, c)| r < rows && c < cols)
        })
    })
}

/// Makes the ray of each pixel, with what depends on a row or a column alone worked out beforehand.
pub(super) struct Tiles {
    pub rows: usize,
    pub cols: usize,
    kind: Kind,
    world_from_sensor: DAffine3,
    /// Value of a sample over the `t` of its hit.
    pub value_per_t: f64,
    /// Start of the rays.
    pub t_min: f64,
    /// Longest distance that is seen, world units.
    pub max_range: f64,
}

enum Kind {
    /// x of the columns, y of the rows.
    Orthographic(Vec<f64>, Vec<f64>),
    /// The same on the plane z = 1. Whether directions have length 1 (values are lengths) or z = 1 (values are z).
    Pinhole(Vec<f64>, Vec<f64>, DepthKind),
    /// Cosine and sine of the columns' azimuths and of the rows' elevations.
    Spherical(Vec<(f64, f64)>, Vec<(f64, f64)>),
}

impl Tiles {
    pub fn new(camera: &VirtualCamera, max_range: Option<f64>) -> Result<Self> {
        let along = |count: usize, f: &dyn Fn(f64) -> f64| (0..count).map(|i| f(i as f64)).collect::<Vec<f64>>();
        let turns = |angles: Vec<f64>| angles.into_iter().map(|a| (a.cos(), a.sin())).collect::<Vec<_>>();
        let (rows, cols) = (camera.rows, camera.cols);
        let (kind, value_per_t, t_min) = match camera.projection {
            Projection::Orthographic { first, step } => {
                if max_range.is_some() {
                    return Err(Error::input(
                        "max_range: an orthographic camera is infinitely far away. Leave it out or use another camera.",
                    ));
                }
                let x = along(cols, &|c| first[0] + c * step[0]);
                let y = along(rows, &|r| first[1] + r * step[1]);
                (Kind::Orthographic(x, y), -1.0, f64::NEG_INFINITY)
            }
            Projection::Pinhole { focal, centre, depth } => {
                let x = along(cols, &|c| (c - centre[0]) / focal[0]);
                let y = along(rows, &|r| (r - centre[1]) / focal[1]);
                (Kind::Pinhole(x, y, depth), 1.0, 0.0)
            }
            Projection::Spherical { first, step } => {
                let azimuths = turns(along(cols, &|c| first[0] + c * step[0]));
                let elevations = turns(along(rows, &|r| first[1] + r * step[1]));
                (Kind::Spherical(azimuths, elevations), 1.0, 0.0)
            }
            Projection::PointGrid(_) => return Err(Error::input("a point grid has no rays to scan along")),
        };
        Ok(Tiles {
            rows,
            cols,
            kind,
            world_from_sensor: camera.world_from_sensor,
            value_per_t,
            t_min,
            max_range: max_range.unwrap_or(f64::INFINITY),
        })
    }

    /// The ray of pixel `(row, col)` in the world.
    pub fn ray(&self, row: usize, col: usize) -> Ray {
        let pose = &self.world_from_sensor;
        match &self.kind {
            Kind::Orthographic(x, y) => {
                Ray { origin: pose.transform_point3(DVec3::new(x[col], y[row], 0.0)), direction: -pose.matrix3.z_axis }
            }
            Kind::Pinhole(x, y, depth) => {
                let through = DVec3::new(x[col], y[row], 1.0);
                let direction = match depth {
                    DepthKind::Planar => through,
                    DepthKind::Ray => through.normalize(),
                };
                Ray { origin: pose.translation, direction: pose.matrix3 * direction }
            }
            Kind::Spherical(azimuths, elevations) => {
                let ((ca, sa), (ce, se)) = (azimuths[col], elevations[row]);
                Ray { origin: pose.translation, direction: pose.matrix3 * DVec3::new(ce * ca, ce * sa, se) }
            }
        }
    }
}
