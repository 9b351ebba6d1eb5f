//! Stage 1: the intersections of a surface with the lines of the grid. [MI04, sec. 3.1]
//!
//! Watertight by construction. The vertices are snapped to fixed point. An exact test decides which line meets which triangle and in which
//! cell, for a grid moved by the infinitesimals (e, e^2, e^3) along x, y, z (simulation of simplicity, Edelsbrunner and Muecke 1990). So no
//! line ever meets an edge or vertex of the surface and no node lies on it. A line through a shared edge belongs to one of its triangles.
//! The crossings of a closed surface along the twelve edges of a cell are always those of some labelling of its corners.

use glam::DVec3;

use super::bundles::Buckets;
use super::crossing::Crossing;
use super::lattice::{ACROSS, CELL, FRACTION_BITS, Lattice};
use base::error::{Error, Result};
use base::progress::Progress;
use image::source::OrientedSurface;
use mesh::srgb::Mix;

/// Crossings between two looks at the cancel flag, and triangles between them.
const CHECK_EVERY: u64 = 1 << 14;

/// A triangle's edges are measured in 64-bit integers up to this extent in cells. Larger ones take 128 bits.
const SMALL_EXTENT: i64 = 1 << 9;

/// Finds all crossings of `surface`, the scan of number `scan`, and adds them to `buckets`.
///
/// # Errors
/// A coordinate out of range. Cancelled.
pub fn discretize(
    surface: &OrientedSurface,
    name: &str,
    scan: u32,
    lattice: &Lattice,
    buckets: &mut Buckets,
    progress: &Progress<'_>,
) -> Result<()> {
    // A reflection (negative scale of a host's object) turns the triangles inside out.
    let flipped = surface.world_from_surface.matrix3.determinant() < 0.0;
    let vertices = lattice.snap(&surface.positions, &surface.world_from_surface, name)?;
    let colour = surface.colour.as_deref();
    let cells_from_surface = surface.world_from_surface.matrix3 * lattice.voxel.recip();
    let cells = cells_from_surface.determinant().abs().cbrt();
    let mut next_check = 0;
    for (t, &[a, b, c]) in surface.triangles.iter().enumerate() {
        if t as u64 + buckets.len >= next_check {
            progress.check()?;
            next_check = t as u64 + buckets.len + CHECK_EVERY;
        }
        let [b, c] = if flipped { [c, b] } else { [b, c] };
        let corners = [a as usize, b as usize, c as usize];
        let triangle = Triangle { vertices: [vertices[corners[0]], vertices[corners[1]], vertices[corners[2]]] };
        let low = triangle.bound(i64::min);
        let high = triangle.bound(i64::max);
        // Most triangles are smaller than a cell: their lines are none or one in each direction.
        let lines_along = |i: usize| (ceil_cell(low[i]), ceil_cell(high[i]));
        let lines = [lines_along(0), lines_along(1), lines_along(2)];
        let empty = [lines[0].0 >= lines[0].1, lines[1].0 >= lines[1].1, lines[2].0 >= lines[2].1];
        if u8::from(empty[0]) + u8::from(empty[1]) + u8::from(empty[2]) >= 2 {
            continue;
        }
        let extent = [high[0] - low[0], high[1] - low[1], high[2] - low[2]];
        if extent.iter().any(|&e| e > SMALL_EXTENT * CELL * 4096) {
            return Err(Error::input(format!(
                "{name}: triangle {t} spans more than {} cells: choose a larger voxel",
                SMALL_EXTENT * 4096
            )));
        }
        let small = extent.iter().all(|&e| e <= SMALL_EXTENT * CELL);
        let mut normal = None;
        for axis in 0..3 {
            let [u, v] = ACROSS[axis];
            if empty[u] || empty[v] {
                continue;
            }
            let mut emit = |hit: Hit| {
                let normal = *normal.get_or_insert_with(|| triangle.unit_normal());
                let weights = hit.barycentric;
                let blend = |at: &dyn Fn(usize) -> f32| {
                    weights[0] * at(corners[0]) + weights[1] * at(corners[1]) + weights[2] * at(corners[2])
                };
                let weight = blend(&|v| surface.confidence[v]);
                let colour = match colour {
                    Some(colour) => Mix::of_triangle(corners.map(|v| colour[v]), weights),
                    None => [0; 4],
                };
                buckets.push(axis, hit.line[0], hit.line[1], |line| {
                    let along = hit.sign_of(normal[axis]);
                    let mut crossing = Crossing::new(line, scan, hit.cell, hit.fraction, along, weight, colour);
                    if let Some(noise) = &surface.noise {
                        let residual = [0, 1, 2].map(|i| blend(&|v| noise.residual[v][i]));
                        let residual = cells_from_surface * DVec3::from_array(residual.map(f64::from));
                        let normal = DVec3::from_array(normal.map(f64::from));
                        let deviation = cells * f64::from(blend(&|v| noise.deviation[v]));
                        crossing.set_noise(residual.dot(normal), deviation);
                    }
                    crossing
                });
            };
            if small {
                scan_lines::<i64>(&triangle, axis, lines[u], lines[v], &mut emit);
            } else {
                // Row by row: one such triangle may take minutes.
                for row in lines[v].0..lines[v].1 {
                    progress.check()?;
                    scan_lines::<i128>(&triangle, axis, lines[u], (row, row + 1), &mut emit);
                }
            }
        }
    }
    Ok(())
}

/// The first line at or after a coordinate. Lines stand an infinitesimal beyond their node.
#[inline]
fn ceil_cell(coordinate: i64) -> i32 {
    ((coordinate + CELL - 1) >> FRACTION_BITS) as i32
}

struct Triangle {
    vertices: [[i64; 3]; 3],
}

/// The place where a line meets a triangle.
struct Hit {
    /// Coordinates of the line across its axis.
    line: [i32; 2],
    cell: i32,
    fraction: f32,
    barycentric: [f32; 3],
    /// Exact sign of the normal's component along the axis.
    positive: bool,
}

impl Hit {
    /// The normal's component with the exact sign, never zero.
    fn sign_of(&self, component: f32) -> f32 {
        let size = component.abs().max(f32::MIN_POSITIVE);
        if self.positive { size } else { -size }
    }
}

impl Triangle {
    #[inline(always)]
    fn bound(&self, choose: fn(i64, i64) -> i64) -> [i64; 3] {
        let [a, b, c] = &self.vertices;
        let at = |i: usize| choose(choose(a[i], b[i]), c[i]);
        [at(0), at(1), at(2)]
    }

    fn unit_normal(&self) -> [f32; 3] {
        let [a, b, c] = self.vertices;
        let ab = DVec3::new((b[0] - a[0]) as f64, (b[1] - a[1]) as f64, (b[2] - a[2]) as f64);
        let ac = DVec3::new((c[0] - a[0]) as f64, (c[1] - a[1]) as f64, (c[2] - a[2]) as f64);
        ab.cross(ac).normalize_or_zero().as_vec3().to_array()
    }
}

/// Integers wide enough for products of a triangle's coordinate differences.
trait Wide: Copy {
    fn cross(a: [i64; 2], b: [i64; 2]) -> Self;
    fn signum(self) -> i32;
    fn to_f64(self) -> f64;
    fn to_i128(self) -> i128;
}

impl Wide for i64 {
    #[inline]
    fn cross(a: [i64; 2], b: [i64; 2]) -> Self {
        a[0] * b[1] - a[1] * b[0]
    }
    #[inline]
    fn signum(self) -> i32 {
        i64::signum(self) as i32
    }
    #[inline]
    fn to_f64(self) -> f64 {
        self as f64
    }
    fn to_i128(self) -> i128 {
        self.into()
    }
}

impl Wide for i128 {
    fn cross(a: [i64; 2], b: [i64; 2]) -> Self {
        i128::from(a[0]) * i128::from(b[1]) - i128::from(a[1]) * i128::from(b[0])
    }
    fn signum(self) -> i32 {
        i128::signum(self) as i32
    }
    fn to_f64(self) -> f64 {
        self as f64
    }
    fn to_i128(self) -> i128 {
        self
    }
}

/// Calls `emit` for each line along `axis` within the half-open ranges that meets the triangle.
#[inline]
fn scan_lines<W: Wide>(
    triangle: &Triangle,
    axis: usize,
    (u_from, u_to): (i32, i32),
    (v_from, v_to): (i32, i32),
    emit: &mut impl FnMut(Hit),
) {
    let [u, v] = ACROSS[axis];
    let [a, b, c] = &triangle.vertices;
    let flat = [[a[u], a[v]], [b[u], b[v]], [c[u], c[v]]];
    // Side i lies opposite corner i.
    let side = |from: [i64; 2], to: [i64; 2]| [to[0] - from[0], to[1] - from[1]];
    let sides = [side(flat[1], flat[2]), side(flat[2], flat[0]), side(flat[0], flat[1])];
    let area = W::cross(sides[2], [-sides[1][0], -sides[1][1]]);
    let orientation = area.signum();
    if orientation == 0 {
        return;
    }
    // The side of side i on which a line at distance (e^a, e^b) from a point exactly on it stands; lower axes move further.
    let ties = sides.map(|side| {
        let by_u = -side[1].signum() as i32;
        let by_v = side[0].signum() as i32;
        if u < v {
            if by_u != 0 { by_u } else { by_v }
        } else if by_v != 0 {
            by_v
        } else {
            by_u
        }
    });
    let wide_rectangle = u_to - u_from > 8;
    for line_v in v_from..v_to {
        let (mut first, mut last) = (u_from, u_to);
        if wide_rectangle {
            (first, last) = narrow(&flat, line_v, first, last);
        }
        for line_u in first..last {
            let at = [i64::from(line_u) << FRACTION_BITS, i64::from(line_v) << FRACTION_BITS];
            let mut e = [area; 3];
            let mut inside = true;
            for i in 0..3 {
                let from = flat[(i + 1) % 3];
                e[i] = W::cross(sides[i], [at[0] - from[0], at[1] - from[1]]);
                let mut sign = e[i].signum();
                if sign == 0 {
                    sign = ties[i];
                }
                inside &= sign == orientation;
            }
            if !inside {
                continue;
            }
            let whole = 1.0 / area.to_f64();
            let barycentric = [e[0].to_f64() * whole, e[1].to_f64() * whole, e[2].to_f64() * whole];
            let [a, b, c] = &triangle.vertices;
            let heights = [a[axis], b[axis], c[axis]];
            let lowest = heights[0].min(heights[1]).min(heights[2]);
            let height = barycentric[0] * (heights[0] - lowest) as f64
                + barycentric[1] * (heights[1] - lowest) as f64
                + barycentric[2] * (heights[2] - lowest) as f64;
            let (cell, fraction) = locate(triangle, axis, e, area, lowest, height);
            emit(Hit {
                line: [line_u, line_v],
                cell,
                fraction,
                barycentric: [barycentric[0] as f32, barycentric[1] as f32, barycentric[2] as f32],
                positive: orientation > 0,
            });
        }
    }
}

/// Part of a row that can lie inside a large triangle, generously.
fn narrow(flat: &[[i64; 2]; 3], line_v: i32, first: i32, last: i32) -> (i32, i32) {
    let at = (i64::from(line_v) << FRACTION_BITS) as f64;
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for i in 0..3 {
        let (a, b) = (flat[i].map(|x| x as f64), flat[(i + 1) % 3].map(|x| x as f64));
        if at < a[1].min(b[1]) - 1.0 || at > a[1].max(b[1]) + 1.0 {
            continue;
        }
        if (a[1] - b[1]).abs() < 2.0 {
            (low, high) = (low.min(a[0]).min(b[0]), high.max(a[0]).max(b[0]));
        } else {
            let share = ((at - a[1]) / (b[1] - a[1])).clamp(0.0, 1.0);
            let x = a[0] + share * (b[0] - a[0]);
            (low, high) = (low.min(x), high.max(x));
        }
    }
    let margin = 2.0 * CELL as f64;
    let first = first.max(((low - margin) / CELL as f64).floor().max(-2.0e9) as i32);
    (first, last.min(((high + margin) / CELL as f64).ceil().min(2.0e9) as i32 + 1))
}

/// Cell and place within it of a crossing `height` fixed-point units above `lowest`: by floating point where that is
/// beyond doubt, exactly where the crossing lies near a node.
#[inline]
fn locate<W: Wide>(triangle: &Triangle, axis: usize, e: [W; 3], area: W, lowest: i64, height: f64) -> (i32, f32) {
    let from_cell = lowest >> FRACTION_BITS;
    let above = height + (lowest - (from_cell << FRACTION_BITS)) as f64;
    let cells = above * (1.0 / CELL as f64);
    // Truncation is the floor: the crossing lies above `from_cell`.
    let floor = cells as i64;
    let fraction = cells - floor as f64;
    let mut cell = from_cell + floor;
    // Rounding errors of `cells` are below 1e-12 of the triangle's extent in cells, at most 2^21.
    if !(1e-5..=1.0 - 1e-5).contains(&fraction) {
        let node = if fraction < 0.5 { cell } else { cell + 1 };
        cell = if node_is_below(triangle, axis, e, area, node) { node } else { node - 1 };
        let fraction = cells + (from_cell - cell) as f64;
        return (cell as i32, fraction.clamp(0.0, 1.0) as f32);
    }
    (cell as i32, fraction as f32)
}

/// Whether node `node` of the moved grid lies below the crossing.
#[cold]
fn node_is_below<W: Wide>(triangle: &Triangle, axis: usize, e: [W; 3], area: W, node: i64) -> bool {
    let node = node << FRACTION_BITS;
    let difference: i128 = (0..3).map(|i| e[i].to_i128() * i128::from(triangle.vertices[i][axis] - node)).sum::<i128>()
        * area.signum() as i128;
    if difference != 0 {
        return difference > 0;
    }
    // The node lies exactly on the triangle's plane: it is below if the moved node is on the lower side, which the first
    // component of the normal that isn't zero decides, because x moves furthest.
    let [a, b, c] = triangle.vertices;
    let ab = [0, 1, 2].map(|i| i128::from(b[i] - a[i]));
    let ac = [0, 1, 2].map(|i| i128::from(c[i] - a[i]));
    let normal = [0, 1, 2].map(|i| {
        let [j, k] = ACROSS[i];
        (ab[j] * ac[k] - ab[k] * ac[j]).signum()
    });
    let side = normal.into_iter().find(|&n| n != 0).unwrap_or(0);
    side * normal[axis] < 0
}
