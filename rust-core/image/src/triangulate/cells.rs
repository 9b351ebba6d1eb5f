//! The triangles that a cell of 2 x 2 pixels gets, and their orientation.
//!
//! ```text
//!  a --- b     a is pixel (row, col), b its right neighbour,
//!  |     |     d the one below, c the one below b
//!  d --- c
//! ```

use glam::DVec3;

use crate::range_image::samples::{NO_SAMPLE, SampleGrid};
use crate::range_image::spacing::{Along, EdgeLimit};
use crate::range_image::{Projection, Viewing};
use base::error::Result;
use base::progress::Progress;

/// The triangles of all cells, over samples.
pub(super) struct Cells {
    pub triangles: Vec<[u32; 3]>,
    pub surroundings: Vec<Surroundings>,
    /// Triangles left out because they are seen from behind.
    pub folds: usize,
}

/// Surroundings of a sample: the number of cells of two triangles in which it is a corner (0 to 4), and whether it is a vertex at all.
#[derive(Clone, Copy, Default)]
pub(super) struct Surroundings(u8);

impl Surroundings {
    const USED: u8 = 0x80;

    pub fn is_used(self) -> bool {
        self.0 != 0
    }
}

impl Cells {
    /// Whether sample `k` is surrounded by eight triangles. All its eight neighbours are valid then.
    pub fn is_interior(&self, k: usize) -> bool {
        self.surroundings[k].0 & !Surroundings::USED == 4
    }
}

/// The triangles within both limits.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub(super) fn triangulate(
    projection: &Projection,
    grid: &SampleGrid,
    limit: &EdgeLimit,
    grazing_limit: f64,
    progress: &Progress<'_>,
) -> Result<Cells> {
    let squares = limit.squares();
    let squared_range = |p: &DVec3| limit.eye().map_or(1.0, |eye| p.distance_squared(eye));
    match (limit.has_steps(), limit.eye()) {
        (false, None) => {
            let allows = |along: Along, squared, _, _| squared <= squares[along as usize];
            with_limit(projection, grid, allows, grazing_limit, progress)
        }
        (false, Some(_)) => {
            let range: Vec<f64> = grid.positions.iter().map(squared_range).collect();
            let allows = |along: Along, squared, a, b| {
                squared <= squares[along as usize] * range[a as usize].min(range[b as usize])
            };
            with_limit(projection, grid, allows, grazing_limit, progress)
        }
        (true, _) => {
            let range: Vec<f64> = grid.positions.iter().map(|p| squared_range(p).sqrt()).collect();
            let by_steps: Vec<f64> = range.iter().map(|&range| limit.by_steps(range)).collect();
            let limits = squares.map(f64::sqrt);
            let allows = |along: Along, squared: f64, a: u32, b: u32| {
                let nearer = if range[a as usize] < range[b as usize] { a } else { b } as usize;
                let longest = limits[along as usize] * range[nearer] + by_steps[nearer];
                squared <= longest * longest
            };
            with_limit(projection, grid, allows, grazing_limit, progress)
        }
    }
}

/// Chooses how a triangle's side is found: the function is positive for a triangle that turns counter-clockwise seen
/// from the sensor, negative for one seen from behind, 0 for one seen edge-on.
fn with_limit(
    projection: &Projection,
    grid: &SampleGrid,
    allows: impl Fn(Along, f64, u32, u32) -> bool,
    grazing_limit: f64,
    progress: &Progress<'_>,
) -> Result<Cells> {
    let p = &grid.positions;
    let from_above = |a: u32, b: u32, c: u32| {
        let (a, b, c) = (p[a as usize], p[b as usize], p[c as usize]);
        (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)
    };
    let along = |direction: DVec3| {
        move |a: u32, b: u32, c: u32| {
            let (a, b, c) = (p[a as usize], p[b as usize], p[c as usize]);
            -(b - a).cross(c - a).dot(direction)
        }
    };
    // Relative to the eye, or the differences of far-away points lose their digits.
    let from = |eye: DVec3| {
        move |a: u32, b: u32, c: u32| {
            let (a, b, c) = (p[a as usize], p[b as usize], p[c as usize]);
            -(b - a).cross(c - a).dot(a - eye)
        }
    };
    // Positive steps or focal lengths along both axes turn (a, b, c) this way; each negative one turns it over.
    let turned = |steps: [f64; 2], unturned: bool| (steps[0].signum() == steps[1].signum()) == unturned;
    match *projection {
        Projection::Orthographic { step, .. } => {
            fill(projection, grid, &allows, &from_above, turned(step, true), grazing_limit, progress)
        }
        Projection::Pinhole { focal, .. } => {
            fill(projection, grid, &allows, &from(DVec3::ZERO), turned(focal, false), grazing_limit, progress)
        }
        Projection::Spherical { step, .. } => {
            fill(projection, grid, &allows, &from(DVec3::ZERO), turned(step, false), grazing_limit, progress)
        }
        Projection::PointGrid(Viewing::Parallel(direction)) if direction.x == 0.0 && direction.y == 0.0 => {
            let sign = -direction.z.signum();
            fill_as_most_turn(projection, grid, &allows, &|a, b, c| sign * from_above(a, b, c), grazing_limit, progress)
        }
        Projection::PointGrid(Viewing::Parallel(direction)) => {
            fill_as_most_turn(projection, grid, &allows, &along(direction), grazing_limit, progress)
        }
        Projection::PointGrid(Viewing::From(eye)) => {
            fill_as_most_turn(projection, grid, &allows, &from(eye), grazing_limit, progress)
        }
    }
}

/// Nothing but its points tells how a point grid is turned: the side that most of its triangles show is the front, the
/// others are folds.
fn fill_as_most_turn(
    projection: &Projection,
    grid: &SampleGrid,
    allows: &impl Fn(Along, f64, u32, u32) -> bool,
    side: &impl Fn(u32, u32, u32) -> f64,
    grazing_limit: f64,
    progress: &Progress<'_>,
) -> Result<Cells> {
    let forward = guess_turn(grid, allows, side);
    let cells = fill(projection, grid, allows, side, forward, grazing_limit, progress)?;
    if cells.folds <= cells.triangles.len() {
        return Ok(cells);
    }
    fill(projection, grid, allows, side, !forward, grazing_limit, progress)
}

/// Checks for cancelling come once in this many samples.
const CHECK: usize = 1 << 18;

/// Samples asked for the turn of a point grid. A wrong guess costs a second walk over the cells, no more.
const VOTES: usize = 256;

/// Whether most corners (a, b, d) of some of the cells turn counter-clockwise seen from the sensor.
fn guess_turn(
    grid: &SampleGrid,
    allows: &impl Fn(Along, f64, u32, u32) -> bool,
    side: &impl Fn(u32, u32, u32) -> f64,
) -> bool {
    let mut balance = 0_i64;
    for k in (0..grid.len()).step_by(grid.len() / VOTES + 1) {
        let (a, b, d) = (k as u32, k as u32 + 1, grid.down[k]);
        if d != NO_SAMPLE
            && grid.has_right(k)
            && allows(Along::Row, grid.right_squared[k], a, b)
            && allows(Along::Column, grid.down_squared[k], a, d)
        {
            let side = side(a, b, d);
            balance += i64::from(side > 0.0) - i64::from(side < 0.0);
        }
    }
    balance >= 0
}

/// Walks over the cells. `forward`: whether (a, b, c) turns counter-clockwise seen from the sensor where nothing folds.
fn fill(
    projection: &Projection,
    grid: &SampleGrid,
    allows: &impl Fn(Along, f64, u32, u32) -> bool,
    side: &impl Fn(u32, u32, u32) -> f64,
    forward: bool,
    grazing_limit: f64,
    progress: &Progress<'_>,
) -> Result<Cells> {
    let positions = &grid.positions;
    let (right, below) = (&grid.right_squared, &grid.down_squared);
    let mut triangles: Vec<[u32; 3]> = Vec::with_capacity(2 * grid.len());
    let mut surroundings = vec![Surroundings::default(); grid.len()];
    let distance_squared = |a: u32, b: u32| positions[a as usize].distance_squared(positions[b as usize]);
    // At the limit of a right angle everything that is seen at all passes.
    let least_cosine = if grazing_limit < std::f64::consts::FRAC_PI_2 { grazing_limit.cos() } else { 0.0 };
    let steep_enough = |a: u32, b: u32, c: u32| {
        let (a, b, c) = (positions[a as usize], positions[b as usize], positions[c as usize]);
        let normal = (b - a).cross(c - a);
        let view = projection.view_direction((a + b + c) / 3.0);
        normal.dot(view).abs() >= least_cosine * normal.length()
    };
    let mut folds = 0;
    // Adds a triangle given clockwise on the screen with its edges' squared lengths and directions, if it is part of the
    // surface.
    let mut add = |surroundings: &mut [Surroundings], [i, j, k]: [u32; 3], [ij, jk, ki]: [(Along, f64); 3]| -> bool {
        let short = allows(ij.0, ij.1, i, j) && allows(jk.0, jk.1, j, k) && allows(ki.0, ki.1, k, i);
        if !short {
            return false;
        }
        let side = side(i, j, k);
        let seen = if forward { side > 0.0 } else { side < 0.0 };
        folds += usize::from(!seen && side != 0.0);
        if !seen || (least_cosine > 0.0 && !steep_enough(i, j, k)) {
            return false;
        }
        triangles.push(if forward { [i, j, k] } else { [i, k, j] });
        for v in [i, j, k] {
            surroundings[v as usize].0 |= Surroundings::USED;
        }
        true
    };
    let row = |squared: f64| (Along::Row, squared);
    let column = |squared: f64| (Along::Column, squared);
    let diagonal = |squared: f64| (Along::Diagonal, squared);
    for k in 0..grid.len() {
        if k.is_multiple_of(CHECK) {
            progress.check()?;
        }
        let (a, d) = (k as u32, grid.down[k]);
        let b = a + 1;
        // The cell to the left has no upper left corner.
        if d != NO_SAMPLE && !grid.has_left(k) && grid.has_left(d as usize) {
            let (b, c, d) = (a, d, d - 1);
            let edges = [column(below[k]), row(right[d as usize]), diagonal(distance_squared(d, b))];
            add(&mut surroundings, [b, c, d], edges);
        }
        match (grid.has_right(k), d != NO_SAMPLE) {
            (true, true) if grid.has_right(d as usize) => {
                let c = d + 1;
                let [ab, bc, cd, da] = [row(right[k]), column(below[k + 1]), row(right[d as usize]), column(below[k])];
                let (ac, bd) = (distance_squared(a, c), distance_squared(b, d));
                let (triangles, edges) = if ac <= bd {
                    let ac = diagonal(ac);
                    ([[a, b, c], [a, c, d]], [[ab, bc, ac], [ac, cd, da]])
                } else {
                    let bd = diagonal(bd);
                    ([[a, b, d], [b, c, d]], [[ab, bd, da], [bc, cd, bd]])
                };
                let both =
                    add(&mut surroundings, triangles[0], edges[0]) & add(&mut surroundings, triangles[1], edges[1]);
                if both {
                    for v in [a, b, c, d] {
                        surroundings[v as usize].0 += 1;
                    }
                }
            }
            (true, true) => {
                let edges = [row(right[k]), diagonal(distance_squared(b, d)), column(below[k])];
                add(&mut surroundings, [a, b, d], edges);
            }
            (true, false) => {
                let c = grid.down[k + 1];
                if c != NO_SAMPLE {
                    let edges = [row(right[k]), column(below[k + 1]), diagonal(distance_squared(a, c))];
                    add(&mut surroundings, [a, b, c], edges);
                }
            }
            (false, true) => {
                if grid.has_right(d as usize) {
                    let c = d + 1;
                    let edges = [diagonal(distance_squared(a, c)), row(right[d as usize]), column(below[k])];
                    add(&mut surroundings, [a, c, d], edges);
                }
            }
            (false, false) => {}
        }
    }
    Ok(Cells { triangles, surroundings, folds })
}
