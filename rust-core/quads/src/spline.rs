//! Stage 9, what the paper wants the grid for: a tensor-product B-spline surface through it. \[PT97, ch. 9\]
//!
//! Knots are uniform and clamped, the kind every modeller knows. A vertex's parameters come from its place in the grid, not from its place
//! in the image. Vertices are dense where the surface bends, and that is where the surface needs its knots. With as many control points as
//! vertices, vertex j lies at the Greville abscissa of control point j, where interpolation is well-conditioned. With fewer, it lies at the
//! place between them that corresponds.

use glam::DVec3;

use super::grid::QuadGrid;
use base::error::{Error, Result};
use base::magnitude;
use base::memory;
use base::operation::{DataKind, Operation};
use base::params::count;
use base::progress::Progress;
use mesh::QuadMesh;

/// Of the mesh while its arrays grow.
const BYTES_A_SAMPLE: f64 = 72.0;

/// The declaration of the operation.
pub const OPERATION: Operation = Operation {
    name: "spline",
    text: "Fits a tensor-product B-spline surface to a quad grid.",
    since: "0.1",
    takes: &[DataKind::Quads],
    gives: &[DataKind::Spline],
    params: Some(SCHEMA),
    report: &[],
    command: None,
    blender: None,
    meshlab: None,
};

base::params! {
    /// How a surface is fitted to a quad grid.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub struct SplineParams of "spline" {
        /// Order of the surface, its degree plus one: 2 is made of straight pieces, 4 is cubic.
        order: usize = count("Order").default(4.0).at_least(2.0).at_most(MOST as f64),
        /// Rows of control points, from the order to the grid's rows. Fewer make the surface smoother, in the sense of least squares.
        rows: Option<usize> = count("Control rows")
            .from_data("as many as the grid has, so that the surface runs through its vertices").at_least(2.0).at_most(PIXELS),
        /// Columns of control points, from the order to the grid's columns. Fewer make the surface smoother, in the sense of least squares.
        columns: Option<usize> = count("Control columns")
            .from_data("as many as the grid has, so that the surface runs through its vertices").at_least(2.0).at_most(PIXELS),
    }
}

/// A tensor-product B-spline surface over [0, 1] x [0, 1]. u runs along columns, v down rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Spline {
    /// Order in both directions.
    pub order: usize,
    /// Rows of control points.
    pub rows: usize,
    /// Columns of control points.
    pub cols: usize,
    /// Control points, row by row, in the sensor's frame.
    pub control: Vec<DVec3>,
}

/// A surface and how far the grid's vertices lie from it.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// The surface.
    pub spline: Spline,
    /// Largest distance of a vertex from the surface at the vertex's parameters, world units.
    pub max_residual: f64,
    /// Root of the mean square of these distances.
    pub rms_residual: f64,
}

/// Largest order.
const MOST: usize = 4;
/// As many control points along a side as an image may have pixels.
const PIXELS: f64 = 67_108_864.0;

impl QuadGrid {
    /// Fits a B-spline surface to all vertices of the grid, those on the background as well. O(vertices).
    ///
    /// # Errors
    /// [`Error::Parameter`]. [`Error::Input`] for a coordinate larger than [`magnitude::LARGEST`], for fewer control points than the order
    /// along a side, or more than vertices.
    pub fn spline(&self, params: &SplineParams, progress: &Progress<'_>) -> Result<Fit> {
        progress.plan(&[("fitting", 1.0)]);
        progress.watch(|| self.fit(params, progress))
    }

    fn fit(&self, params: &SplineParams, progress: &Progress<'_>) -> Result<Fit> {
        params.validate()?;
        magnitude::points("vertex", &self.positions)?;
        let order = params.order;
        let controls = |wanted: Option<usize>, vertices: usize, line: &str| {
            let count = wanted.unwrap_or(vertices);
            if (order..=vertices).contains(&count) {
                return Ok(count);
            }
            Err(Error::input(format!(
                "{count} {line} of control points: order {order} over {vertices} {line} of vertices needs {order} to {vertices}"
            )))
        };
        let (rows, cols) = (controls(params.rows, self.rows, "rows")?, controls(params.columns, self.cols, "columns")?);
        let most = (self.rows * cols) as f64 + (rows * cols) as f64;
        memory::expect(
            size_of::<DVec3>() as f64 * most,
            || format!("a spline surface of {rows} x {cols} control points"),
            "ask for fewer",
        )?;
        progress.stage(0, (self.rows + cols + self.rows) as u64);
        // Along each row of vertices, then down each column of what that gives.
        let across = Fitting::new(self.cols, cols, order);
        let mut half = vec![DVec3::ZERO; self.rows * cols];
        for (from, to) in self.positions.chunks_exact(self.cols).zip(half.chunks_exact_mut(cols)) {
            across.solve(from, to);
            progress.advance(1)?;
        }
        let down = Fitting::new(self.rows, rows, order);
        let mut control = vec![DVec3::ZERO; rows * cols];
        let (mut column, mut solved) = (vec![DVec3::ZERO; self.rows], vec![DVec3::ZERO; rows]);
        for j in 0..cols {
            column.iter_mut().enumerate().for_each(|(i, p)| *p = half[i * cols + j]);
            down.solve(&column, &mut solved);
            solved.iter().enumerate().for_each(|(i, &p)| control[i * cols + j] = p);
            progress.advance(1)?;
        }
        let spline = Spline { order, rows, cols, control };
        let (mut max, mut squares) = (0.0_f64, 0.0);
        for (i, v) in down.sites.iter().enumerate() {
            for (j, u) in across.sites.iter().enumerate() {
                let squared = spline.at(*u, *v).distance_squared(self.positions[i * self.cols + j]);
                max = max.max(squared);
                squares += squared;
            }
            progress.advance(1)?;
        }
        let rms_residual = (squares / self.positions.len() as f64).sqrt();
        Ok(Fit { spline, max_residual: max.sqrt(), rms_residual })
    }
}

impl Spline {
    /// Knots along u (`cols` control points) and v (`rows`): clamped, uniform, from 0 to 1.
    pub fn knots(&self) -> [Vec<f64>; 2] {
        [self.cols, self.rows].map(|count| (0..count + self.order).map(|i| knot(i, count, self.order)).collect())
    }

    /// The point of parameters (u, v), each taken into 0 to 1.
    pub fn at(&self, u: f64, v: f64) -> DVec3 {
        let (left, across) = basis(u, self.cols, self.order);
        let (top, down) = basis(v, self.rows, self.order);
        let mut point = DVec3::ZERO;
        for (i, weight) in down[..self.order].iter().enumerate() {
            let row = &self.control[(top + i) * self.cols + left..][..self.order];
            for (p, w) in row.iter().zip(&across) {
                point += *p * (weight * w);
            }
        }
        point
    }

    /// The surface at rows x cols evenly spread parameters, as quads that turn like the grid's when `mirrored` is the grid's.
    ///
    /// # Errors
    /// [`Error::Input`] for fewer than 2 x 2, or more than 2^26 points.
    pub fn sample(&self, rows: usize, cols: usize, mirrored: bool) -> Result<QuadMesh> {
        if rows < 2 || cols < 2 || rows.checked_mul(cols).is_none_or(|n| n > 1 << 26) {
            return Err(Error::input(format!(
                "a surface is sampled at 2 x 2 points or more, at most {}, got {rows} x {cols}",
                1 << 26
            )));
        }
        let bytes = BYTES_A_SAMPLE * (rows * cols) as f64;
        memory::expect(bytes, || format!("a surface of {rows} x {cols} points"), "use fewer")?;
        let share = |i: usize, count: usize| i as f64 / (count - 1) as f64;
        let mut mesh = QuadMesh::default();
        for i in 0..rows {
            for j in 0..cols {
                let (u, v) = (share(j, cols), share(i, rows));
                mesh.positions.push(self.at(u, v));
                mesh.uvs.push([u as f32, 1.0 - v as f32]);
                if i + 1 < rows && j + 1 < cols {
                    let a = (i * cols + j) as u32;
                    let [b, c, d] = [a + 1, a + cols as u32 + 1, a + cols as u32];
                    mesh.quads.push(if mirrored { [a, b, c, d] } else { [a, d, c, b] });
                }
            }
        }
        Ok(mesh)
    }
}

/// Knot `i` of a clamped uniform vector over [0, 1] for `count` control points.
fn knot(i: usize, count: usize, order: usize) -> f64 {
    let spans = count + 1 - order;
    (i.saturating_sub(order - 1)).min(spans) as f64 / spans as f64
}

/// The first control point that matters at a parameter, and the weights of it and the next ones. (Cox and de Boor)
fn basis(u: f64, count: usize, order: usize) -> (usize, [f64; MOST]) {
    let u = if u > 0.0 { u.min(1.0) } else { 0.0 };
    let spans = count + 1 - order;
    let first = ((u * spans as f64) as usize).min(spans - 1);
    let at = |i: usize| knot(i, count, order);
    let mut weights = [0.0; MOST];
    weights[0] = 1.0;
    let span = first + order - 1;
    for degree in 1..order {
        let mut carried = 0.0;
        for r in 0..degree {
            let (right, left) = (at(span + r + 1), at(span + r + 1 - degree));
            let share = weights[r] / (right - left);
            weights[r] = carried + (right - u) * share;
            carried = (u - left) * share;
        }
        weights[degree] = carried;
    }
    (first, weights)
}

/// Least squares of points on a line of control points: the normal equations, a band, as their Cholesky factor.
struct Fitting {
    /// Parameter of each point.
    sites: Vec<f64>,
    order: usize,
    /// Row i: entries i, i - 1, ... of the factor.
    factor: Vec<[f64; MOST]>,
}

impl Fitting {
    fn new(points: usize, controls: usize, order: usize) -> Self {
        // Mean of the knots inside a control point's reach.
        let greville = |c: usize| (1..order).map(|k| knot(c + k, controls, order)).sum::<f64>() / (order - 1) as f64;
        let sites: Vec<f64> = (0..points)
            .map(|j| {
                let at = (j * (controls - 1)) as f64 / (points - 1) as f64;
                let c = (at as usize).min(controls - 2);
                greville(c) + (greville(c + 1) - greville(c)) * (at - c as f64)
            })
            .collect();
        let mut factor = vec![[0.0; MOST]; controls];
        for &site in &sites {
            let (first, weights) = basis(site, controls, order);
            for a in 0..order {
                for b in 0..=a {
                    factor[first + a][a - b] += weights[a] * weights[b];
                }
            }
        }
        for i in 0..controls {
            for back in (0..order.min(i + 1)).rev() {
                let j = i - back;
                let inner: f64 =
                    (1..order - back).filter(|k| *k <= j).map(|k| factor[i][back + k] * factor[j][k]).sum();
                let rest = factor[i][back] - inner;
                factor[i][back] = if back == 0 { rest.sqrt() } else { rest / factor[j][0] };
            }
        }
        Fitting { sites, order, factor }
    }

    fn solve(&self, points: &[DVec3], controls: &mut [DVec3]) {
        controls.fill(DVec3::ZERO);
        for (&site, &point) in self.sites.iter().zip(points) {
            let (first, weights) = basis(site, controls.len(), self.order);
            for (control, weight) in controls[first..].iter_mut().zip(&weights[..self.order]) {
                *control += point * *weight;
            }
        }
        let count = controls.len();
        for i in 0..count {
            for back in 1..self.order.min(i + 1) {
                let known = controls[i - back];
                controls[i] -= known * self.factor[i][back];
            }
            controls[i] /= self.factor[i][0];
        }
        for i in (0..count).rev() {
            for ahead in 1..self.order.min(count - i) {
                let known = controls[i + ahead];
                controls[i] -= known * self.factor[i + ahead][ahead];
            }
            controls[i] /= self.factor[i][0];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{QuadParams, run};
    use base::progress::Progress;
    use image::range_image::{Projection, RangeImage};

    fn grid(z: impl Fn(f64, f64) -> f64) -> QuadGrid {
        let values = (0..60 * 80).map(|i| z(f64::from(i / 80), f64::from(i % 80))).collect();
        let projection = Projection::Orthographic { first: [0.0; 2], step: [1.0, -1.0] };
        let image = RangeImage::from_values(60, 80, values, projection).unwrap();
        run(&image, &QuadParams { threads: 1, ..QuadParams::default() }, &Progress::none()).unwrap()
    }

    fn wavy(r: f64, c: f64) -> f64 {
        5.0 * (r * 0.1).sin() + 3.0 * (c * 0.2).cos()
    }

    #[test]
    fn weights_are_those_of_the_recursion() {
        fn plain(i: usize, k: usize, u: f64, knots: &[f64]) -> f64 {
            if k == 1 {
                let last = knots[i + 1] == 1.0 && u == 1.0;
                return f64::from(u8::from(knots[i] < knots[i + 1] && knots[i] <= u && (u < knots[i + 1] || last)));
            }
            let term = |a: f64, b: f64, w: f64| if b == 0.0 { 0.0 } else { a / b * w };
            term(u - knots[i], knots[i + k - 1] - knots[i], plain(i, k - 1, u, knots))
                + term(knots[i + k] - u, knots[i + k] - knots[i + 1], plain(i + 1, k - 1, u, knots))
        }
        for order in 2..=4 {
            for count in order..9 {
                let knots: Vec<f64> = (0..count + order).map(|i| knot(i, count, order)).collect();
                for u in (0..=40).map(|i| f64::from(i) / 40.0) {
                    let (first, weights) = basis(u, count, order);
                    for i in 0..count {
                        let own = if (first..first + order).contains(&i) { weights[i - first] } else { 0.0 };
                        assert!((own - plain(i, order, u, &knots)).abs() < 1e-12, "{order} {count} {i} {u}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_full_net_interpolates_and_fewer_points_come_close() {
        let grid = grid(wavy);
        for order in 2..=4 {
            let fit = grid.spline(&SplineParams { order, ..SplineParams::default() }, &Progress::none()).unwrap();
            assert!(fit.max_residual < 1e-10, "{order}: {}", fit.max_residual);
            // Corners are control points.
            assert!(fit.spline.at(0.0, 0.0).distance(grid.positions[0]) < 1e-10);
            assert!(fit.spline.at(1.0, 1.0).distance(*grid.positions.last().unwrap()) < 1e-10);
        }
        let residual = |n: usize| {
            let fit =
                grid.spline(&SplineParams { order: 4, rows: Some(n), columns: Some(n) }, &Progress::none()).unwrap();
            assert!(fit.rms_residual <= fit.max_residual);
            fit.rms_residual
        };
        assert!(residual(9) < residual(7) && residual(7) < residual(5) && residual(8) < 2.0);
    }

    #[test]
    fn planes_are_kept_and_the_surface_samples_as_quads() {
        let grid = grid(|r, c| 2.0 * r - 0.5 * c);
        let fit = grid.spline(&SplineParams { order: 3, rows: Some(4), columns: Some(5) }, &Progress::none()).unwrap();
        let mesh = fit.spline.sample(7, 11, grid.mirrored).unwrap();
        assert_eq!((mesh.positions.len(), mesh.quads.len(), mesh.uvs.len()), (77, 60, 77));
        assert!(mesh.positions.iter().all(|p| (p.z - (-2.0 * p.y - 0.5 * p.x)).abs() < 1e-9));
        let report = mesh::check(&mesh.triangulated(|_| false));
        assert!(report.is_manifold() && report.boundary_loops == 1);
        let [u, v] = fit.spline.knots();
        assert_eq!((u.len(), v.len(), v[2], v[4]), (8, 7, 0.0, 1.0));
    }

    #[test]
    fn what_cannot_be_fitted_is_said() {
        let grid = grid(wavy);
        let message = |p: SplineParams| grid.spline(&p, &Progress::none()).unwrap_err().to_string();
        assert_eq!(message(SplineParams { order: 5, ..SplineParams::default() }), "order must be >= 2 and <= 4, got 5");
        assert_eq!(
            message(SplineParams { rows: Some(3), ..SplineParams::default() }),
            "3 rows of control points: order 4 over 9 rows of vertices needs 4 to 9"
        );
        assert!(grid.spline(&SplineParams::default(), &Progress::none()).unwrap().spline.sample(1, 5, false).is_err());
    }
}
