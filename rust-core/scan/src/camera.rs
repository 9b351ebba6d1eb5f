//! Virtual cameras: where a virtual scanner stands and how its pixels see.

use glam::{DAffine3, DMat3, DVec3};

use base::error::{Error, Result, Shown};
use base::magnitude::{self, LARGEST};
use base::memory;
use base::progress::Progress;
use image::range_image::{DepthKind, Projection};

/// A virtual scanner: `rows` x `cols` pixels, how they see, and the true pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VirtualCamera {
    /// Rows of the image.
    pub rows: usize,
    /// Columns of the image.
    pub cols: usize,
    /// Orthographic, pinhole or spherical.
    pub projection: Projection,
    /// The true pose: a rigid transform.
    pub world_from_sensor: DAffine3,
}

impl VirtualCamera {
    /// Parallel rays: looks along `toward`, `target` in the middle of the image, pixels `spacing` apart, row 0 on the side of
    /// `up`, or any side if that is zero. Along -z for a `toward` of zero.
    ///
    /// # Errors
    /// [`Error::Input`] for a number that can't be computed with.
    pub fn orthographic(
        rows: usize,
        cols: usize,
        spacing: f64,
        target: DVec3,
        toward: DVec3,
        up: DVec3,
    ) -> Result<Self> {
        if !(spacing > 0.0) {
            return Err(Error::input(format!("the camera's spacing must be > 0, got {}", Shown(spacing))));
        }
        magnitude::divisor("the camera's spacing", spacing)?;
        magnitude::place("the camera's target", target)?;
        let axes = axes(toward, up)?;
        let first = [-0.5 * spacing * (cols.max(1) - 1) as f64, 0.5 * spacing * (rows.max(1) - 1) as f64];
        Ok(VirtualCamera {
            rows,
            cols,
            projection: Projection::Orthographic { first, step: [spacing, -spacing] },
            // The frame looks along -z.
            world_from_sensor: DAffine3::from_mat3_translation(DMat3::from_cols(axes.x, axes.y, -axes.toward), target),
        })
    }

    /// A depth camera at `eye` that looks at `target`. `height_angle` is the angle between its first and its last row.
    ///
    /// # Errors
    /// [`Error::Input`] for an angle that is not between 0 and pi, or a number that can't be computed with.
    pub fn pinhole(rows: usize, cols: usize, height_angle: f64, eye: DVec3, target: DVec3, up: DVec3) -> Result<Self> {
        magnitude::place("the camera's eye", eye)?;
        magnitude::place("the camera's target", target)?;
        let axes = axes(target - eye, up)?;
        let focal = focal(rows, height_angle)?;
        let centre = [0.5 * (cols.max(1) - 1) as f64, 0.5 * (rows.max(1) - 1) as f64];
        Ok(VirtualCamera {
            rows,
            cols,
            projection: Projection::Pinhole { focal: [focal, focal], centre, depth: DepthKind::Planar },
            // The frame has y down and looks along +z.
            world_from_sensor: DAffine3::from_mat3_translation(DMat3::from_cols(axes.x, -axes.y, axes.toward), eye),
        })
    }

    /// A terrestrial scanner at `eye` with `up` as its vertical: all around, and from `lowest` to `highest` elevation, in
    /// radians, row 0 the highest.
    ///
    /// # Errors
    /// [`Error::Input`] for elevations that are equal, a vertical that is zero, or a number that can't be computed with.
    pub fn spherical(rows: usize, cols: usize, lowest: f64, highest: f64, eye: DVec3, up: DVec3) -> Result<Self> {
        magnitude::coordinate("the camera's lowest elevation", lowest)?;
        magnitude::coordinate("the camera's highest elevation", highest)?;
        magnitude::place("the camera's eye", eye)?;
        magnitude::direction("the camera's vertical", up)?;
        let axes = axes(up.any_orthogonal_vector(), up)?;
        let first = [-std::f64::consts::PI, highest];
        let step = [std::f64::consts::TAU / cols.max(1) as f64, (lowest - highest) / (rows.max(2) - 1) as f64];
        Ok(VirtualCamera {
            rows,
            cols,
            projection: Projection::Spherical { first, step },
            world_from_sensor: DAffine3::from_mat3_translation(DMat3::from_cols(axes.toward, -axes.x, axes.y), eye),
        })
    }

    /// Checks that the camera can see.
    ///
    /// # Errors
    /// [`Error::Input`]: more pixels than can be counted, a projection that isn't usable, a pose that isn't rigid.
    pub fn validate(&self) -> Result<()> {
        let pixels = self.rows.checked_mul(self.cols).and_then(|n| u32::try_from(n).ok());
        if pixels.is_none() {
            let (rows, cols) = (self.rows, self.cols);
            return Err(Error::input(format!(
                "an image of {rows} x {cols} pixels is too large: it may have at most 2^32 - 1"
            )));
        }
        if matches!(self.projection, Projection::PointGrid(_)) {
            return Err(Error::input("a point grid has no rays to scan along: give the camera another projection"));
        }
        self.projection.validate()?;
        let reach = self.projection.reach(self.rows, self.cols, 1.0);
        if !(reach <= LARGEST) {
            return Err(Error::input(format!(
                "the camera's rays reach to {}: at most {LARGEST:e} can be computed with",
                Shown(reach)
            )));
        }
        let (m, t) = (self.world_from_sensor.matrix3, self.world_from_sensor.translation);
        let gram = m.transpose() * m;
        let rigid = gram.abs_diff_eq(DMat3::IDENTITY, 1e-6) && m.determinant() > 0.0 && t.is_finite();
        if !rigid {
            return Err(Error::input(format!("the camera's pose must be a rotation and a translation, got {m} {t}")));
        }
        magnitude::place("the camera's place", t)?;
        Ok(())
    }
}

/// Focal length in pixels of a camera with this angle between its first and its last row.
fn focal(rows: usize, height_angle: f64) -> Result<f64> {
    let focal = 0.5 * (rows.max(2) - 1) as f64 / (0.5 * height_angle).tan();
    if height_angle > 0.0 && height_angle < std::f64::consts::PI && focal <= LARGEST {
        return Ok(focal);
    }
    Err(Error::input(format!(
        "the angle between a camera's first and last row must be > 0 and < pi, with a focal length up to {LARGEST:e} pixels, got {} rad",
        Shown(height_angle)
    )))
}

struct Axes {
    /// To the right.
    x: DVec3,
    /// Up.
    y: DVec3,
    toward: DVec3,
}

/// Axes of a viewer that looks `toward`, along -z if that is zero, with `up` upward. Any upright ones if `up` says nothing.
fn axes(toward: DVec3, up: DVec3) -> Result<Axes> {
    for (name, given) in [("the direction a camera looks in", toward), ("the camera's vertical", up)] {
        if given != DVec3::ZERO {
            magnitude::direction(name, given)?;
        }
    }
    let toward = toward.try_normalize().unwrap_or(DVec3::NEG_Z);
    let x = toward.cross(up).try_normalize().filter(|x| x.is_finite());
    let x = x.unwrap_or_else(|| toward.any_orthonormal_vector());
    // Once more: where `up` is nearly along `toward` their product has lost digits.
    let x = (x - toward * x.dot(toward)).normalize();
    Ok(Axes { x, y: x.cross(toward), toward })
}

/// Settings by which [`turntable`] places its cameras.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TurntableViews {
    /// Cameras on a ring about the vertical.
    pub around: usize,
    /// Cameras that look down from all sides.
    pub above: usize,
    /// Cameras that look up from all sides.
    pub below: usize,
    /// Height of those above and below over the ring, in radians.
    pub elevation: f64,
    /// The vertical.
    pub up: DVec3,
    /// Pixels across the diagonal of the bounds. An orthographic image has as many rows and columns as the bounds need.
    pub pixels: usize,
    /// Angle between the first and the last row of a pinhole camera, in radians. `None`: orthographic cameras.
    pub height_angle: Option<f64>,
}

impl Default for TurntableViews {
    /// Eight around, two above, two below, orthographic, z up, 400 pixels across.
    fn default() -> Self {
        TurntableViews {
            around: 8,
            above: 2,
            below: 2,
            elevation: 55f64.to_radians(),
            up: DVec3::Z,
            pixels: 400,
            height_angle: None,
        }
    }
}

/// Cameras around a mesh of these bounds, each of which sees all of it: first the ring, then those above, then those below.
///
/// # Errors
/// [`Error::Input`] for bounds or a vertical that aren't finite or have no size, or an angle that isn't between 0 and pi.
/// [`Error::OutOfMemory`]. [`Error::Cancelled`].
pub fn turntable(
    (lo, hi): (DVec3, DVec3),
    table: &TurntableViews,
    progress: &Progress<'_>,
) -> Result<Vec<VirtualCamera>> {
    let up = magnitude::direction("the turntable's vertical", table.up)?.normalize();
    magnitude::coordinate("the cameras' elevation", table.elevation)?;
    for corner in [lo, hi] {
        magnitude::place("each corner of the bounds of what a turntable turns", corner)?;
    }
    let centre = lo.midpoint(hi);
    let radius = 0.5 * lo.distance(hi);
    if radius == 0.0 {
        return Err(Error::input(format!("a turntable needs bounds of some size, got {lo} to {hi}")));
    }
    if let Some(angle) = table.height_angle {
        focal(table.pixels, angle)?;
    }
    let (a, b) = (up.any_orthonormal_vector(), up.cross(up.any_orthonormal_vector()));
    // Two rings of the same number of cameras look between each other's, so their azimuths are shifted.
    let rings = [(table.around, 0.0, 0.0), (table.above, table.elevation, 0.25), (table.below, -table.elevation, 0.75)];
    let count = [table.above, table.below].iter().fold(table.around, |sum, count| sum.saturating_add(*count));
    // Hosts make objects of them.
    memory::expect_each(count, 2.0 * size_of::<VirtualCamera>() as f64, 0.0, "placing", "cameras")?;
    let mut cameras = memory::reserved(count, || format!("placing {count} cameras"))?;
    progress.watch(|| {
        for (count, elevation, shift) in rings {
            for k in 0..count {
                if k % 256 == 0 {
                    progress.check()?;
                }
                let azimuth = std::f64::consts::TAU * (k as f64 + shift) / count as f64;
                let from = (a * azimuth.cos() + b * azimuth.sin()) * elevation.cos() + up * elevation.sin();
                let camera = match table.height_angle {
                    None => orthographic_fit(
                        (lo, hi),
                        2.0 * radius / table.pixels.max(2).saturating_sub(1) as f64,
                        -from,
                        up,
                    ),
                    Some(angle) => {
                        let eye = centre + from * (1.001 * radius / (0.5 * angle).sin());
                        VirtualCamera::pinhole(table.pixels, table.pixels, angle, eye, centre, up)
                    }
                };
                cameras.push(camera?);
            }
        }
        Ok(())
    })?;
    Ok(cameras)
}

/// An orthographic camera that sees the bounds with a margin of at least half a pixel, and little else.
fn orthographic_fit((lo, hi): (DVec3, DVec3), spacing: f64, toward: DVec3, up: DVec3) -> Result<VirtualCamera> {
    let axes = axes(toward, up)?;
    let size = hi - lo;
    let pixels = |axis: DVec3| (size.dot(axis.abs()) / spacing).ceil() as usize + 2;
    VirtualCamera::orthographic(pixels(axes.y), pixels(axes.x), spacing, lo.midpoint(hi), toward, up)
}
