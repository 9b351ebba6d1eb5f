//! From pixels to points and rays, for every kind of sensor.
//!
//! Frames: The orthographic frame looks along -z, the sensor at +z (height maps, Stanford scans). The pinhole frame has x to the right, y
//! down and z forward (depth cameras). The spherical frame has z up (terrestrial scanners).

use glam::DVec3;

use base::error::Result;
use base::magnitude;

base::choices! {
    /// Quantity that a pinhole image's values measure.
    pub enum DepthKind {
        /// Distance from the image plane through the centre of projection (z).
        Planar = "planar" "Planar",
        /// Distance along the pixel's ray.
        Ray = "ray" "Along the ray",
    }
}

/// Rays by which the pixels of a point grid were seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Viewing {
    /// All rays parallel to this direction, from the sensor toward the scene. Of any length but zero.
    Parallel(DVec3),
    /// Every ray starts here.
    From(DVec3),
}

impl Viewing {
    /// Stanford range grids: along -z of the scan's own frame.
    pub const ALONG_MINUS_Z: Viewing = Viewing::Parallel(DVec3::NEG_Z);
}

/// Projection of pixels: what a pixel's value measures and where its ray runs, in the sensor's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Rays along -z. The value is the point's z. Pixel `(row, col)` lies at `x = first[0] + col * step[0]`, `y = first[1] + row * step[1]`
    /// (a negative `step[1]` puts row 0 at the top).
    Orthographic {
        /// x and y of pixel (0, 0).
        first: [f64; 2],
        /// x from column to column, y from row to row. Neither is zero.
        step: [f64; 2],
    },
    /// Rays from the origin through `((col - centre[0]) / focal[0], (row - centre[1]) / focal[1], 1)`.
    Pinhole {
        /// fx and fy in pixels.
        focal: [f64; 2],
        /// cx and cy in pixels, pixel centres at whole numbers.
        centre: [f64; 2],
        /// The quantity that the values measure.
        depth: DepthKind,
    },
    /// Rays from the origin. Azimuth `first[0] + col * step[0]` from +x toward +y, elevation `first[1] + row * step[1]` from the horizon
    /// toward +z. The value is the distance along the ray.
    Spherical {
        /// Azimuth and elevation of pixel (0, 0), in radians.
        first: [f64; 2],
        /// Azimuth from column to column, elevation from row to row, in radians. Neither is zero.
        step: [f64; 2],
    },
    /// A measured point a pixel.
    PointGrid(Viewing),
}

impl Projection {
    /// Checks that the parameters are finite, not degenerate and no larger than can be computed with.
    ///
    /// # Errors
    /// [`base::Error::Input`] naming the parameter and its value.
    pub fn validate(&self) -> Result<()> {
        match self {
            Projection::Orthographic { first, step } | Projection::Spherical { first, step } => {
                magnitude::coordinate("the projection's place of the first pixel, across,", first[0])?;
                magnitude::coordinate("the projection's place of the first pixel, down,", first[1])?;
                magnitude::divisor("the projection's step from column to column", step[0])?;
                magnitude::divisor("the projection's step from row to row", step[1])?;
            }
            Projection::Pinhole { focal, centre, .. } => {
                magnitude::divisor("the camera's focal length fx", focal[0])?;
                magnitude::divisor("the camera's focal length fy", focal[1])?;
                magnitude::coordinate("the camera's centre cx", centre[0])?;
                magnitude::coordinate("the camera's centre cy", centre[1])?;
            }
            Projection::PointGrid(Viewing::Parallel(direction)) => {
                magnitude::direction("the viewing direction", *direction)?;
            }
            Projection::PointGrid(Viewing::From(origin)) => {
                magnitude::place("the sensor's origin", *origin)?;
            }
        }
        Ok(())
    }

    /// Largest number met on the way to a point that a pixel of an image of this size measures with a value up to `value`. For a point grid
    /// it is the points' own.
    pub fn reach(&self, rows: usize, cols: usize, value: f64) -> f64 {
        let last = [cols.saturating_sub(1) as f64, rows.saturating_sub(1) as f64];
        let farthest = |at: [f64; 2]| at[0].abs().max(at[1].abs());
        match self {
            Projection::Orthographic { first, step } | Projection::Spherical { first, step } => {
                (0..2).map(|axis| farthest([first[axis], first[axis] + last[axis] * step[axis]])).fold(value, f64::max)
            }
            Projection::Pinhole { focal, centre, depth } => {
                let slope = (0..2)
                    .map(|axis| farthest([centre[axis], last[axis] - centre[axis]]) / focal[axis].abs())
                    .fold(1.0, f64::max);
                if *depth == DepthKind::Planar { slope.max(slope * value) } else { slope.max(value) }
            }
            Projection::PointGrid(_) => value,
        }
    }

    /// The point that value `value` of pixel `(row, col)` measures. Meaningless for a point grid, where the point itself
    /// is the sample.
    pub fn point(&self, row: usize, col: usize, value: f64) -> DVec3 {
        let (row, col) = (row as f64, col as f64);
        match self {
            Projection::Orthographic { first, step } => {
                DVec3::new(first[0] + col * step[0], first[1] + row * step[1], value)
            }
            Projection::Pinhole { focal, centre, depth } => {
                let through = DVec3::new((col - centre[0]) / focal[0], (row - centre[1]) / focal[1], 1.0);
                match depth {
                    DepthKind::Planar => through * value,
                    DepthKind::Ray => through * (value / through.length()),
                }
            }
            Projection::Spherical { first, step } => {
                spherical_direction(first[0] + col * step[0], first[1] + row * step[1]) * value
            }
            Projection::PointGrid(_) => DVec3::NAN,
        }
    }

    /// The ray of pixel `(row, col)`: a point on it and its unit direction from the sensor toward the scene. For a point grid the ray runs
    /// through `sample`, the measured point. Otherwise `sample` is not used.
    pub fn ray(&self, row: usize, col: usize, sample: DVec3) -> (DVec3, DVec3) {
        match self {
            Projection::Orthographic { .. } => (self.point(row, col, 0.0), DVec3::NEG_Z),
            Projection::Pinhole { .. } | Projection::Spherical { .. } => {
                (DVec3::ZERO, self.point(row, col, 1.0).normalize_or_zero())
            }
            Projection::PointGrid(Viewing::Parallel(direction)) => (sample, direction.normalize_or_zero()),
            Projection::PointGrid(Viewing::From(origin)) => (*origin, (sample - *origin).normalize_or_zero()),
        }
    }

    /// Start of the rays, if they fan out from a point.
    pub fn eye(&self) -> Option<DVec3> {
        match *self {
            Projection::Orthographic { .. } | Projection::PointGrid(Viewing::Parallel(_)) => None,
            Projection::Pinhole { .. } | Projection::Spherical { .. } => Some(DVec3::ZERO),
            Projection::PointGrid(Viewing::From(origin)) => Some(origin),
        }
    }

    /// Unit direction from the sensor toward `sample`, a point measured by any pixel.
    pub fn view_direction(&self, sample: DVec3) -> DVec3 {
        match self {
            Projection::Orthographic { .. } => DVec3::NEG_Z,
            Projection::Pinhole { .. } | Projection::Spherical { .. } => sample.normalize_or_zero(),
            Projection::PointGrid(Viewing::Parallel(direction)) => direction.normalize_or_zero(),
            Projection::PointGrid(Viewing::From(origin)) => (sample - *origin).normalize_or_zero(),
        }
    }
}

/// Parts of [`Projection::point`] that depend on the row alone and on the column alone, computed once for all pixels.
pub(crate) struct Tables<'a> {
    projection: &'a Projection,
    /// Orthographic: y. Pinhole: y at depth 1. Spherical: cosine and sine of the elevation.
    rows: Vec<[f64; 2]>,
    /// Orthographic: x. Pinhole: x at depth 1. Spherical: cosine and sine of the azimuth.
    cols: Vec<[f64; 2]>,
}

impl Projection {
    pub(crate) fn tables(&self, rows: usize, cols: usize) -> Tables<'_> {
        let table = |count: usize, axis: usize| -> Vec<[f64; 2]> {
            let entry = |i: usize| {
                let i = i as f64;
                match self {
                    Projection::Orthographic { first, step } => [first[axis] + i * step[axis], 0.0],
                    Projection::Pinhole { focal, centre, .. } => [(i - centre[axis]) / focal[axis], 0.0],
                    Projection::Spherical { first, step } => {
                        let angle = first[axis] + i * step[axis];
                        [angle.cos(), angle.sin()]
                    }
                    Projection::PointGrid(_) => [f64::NAN; 2],
                }
            };
            (0..count).map(entry).collect()
        };
        Tables { projection: self, rows: table(rows, 1), cols: table(cols, 0) }
    }
}

impl Tables<'_> {
    /// The same as [`Projection::point`], to the bit.
    pub(crate) fn point(&self, row: usize, col: usize, value: f64) -> DVec3 {
        let ([x, sin_azimuth], [y, sin_elevation]) = (self.cols[col], self.rows[row]);
        match self.projection {
            Projection::Orthographic { .. } => DVec3::new(x, y, value),
            Projection::Pinhole { depth: DepthKind::Planar, .. } => DVec3::new(x, y, 1.0) * value,
            Projection::Pinhole { depth: DepthKind::Ray, .. } => {
                let through = DVec3::new(x, y, 1.0);
                through * (value / through.length())
            }
            Projection::Spherical { .. } => DVec3::new(y * x, y * sin_azimuth, sin_elevation) * value,
            Projection::PointGrid(_) => DVec3::NAN,
        }
    }
}

/// Unit direction of an azimuth and elevation, in radians.
pub fn spherical_direction(azimuth: f64, elevation: f64) -> DVec3 {
    DVec3::new(elevation.cos() * azimuth.cos(), elevation.cos() * azimuth.sin(), elevation.sin())
}
