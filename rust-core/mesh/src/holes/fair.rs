//! Positions of the new vertices that make the fill as smooth as its surroundings. \[Lie03, sec. 5\]
//!
//! The umbrella of a vertex is its distance from a weighted mean of its neighbours. The fair fill is the one whose umbrellas, at the new
//! vertices and at those of the loop, have the least sum of squares, each by the square of the edge lengths around. It is a thin plate
//! clamped to the surface around. The weights are mean value coordinates \[Flo03\] of the fill before fairing.

use glam::DVec3;

use super::patch::Patch;
use base::error::Result;
use base::progress::Progress;

/// Largest tangent of half an angle at a vertex: beyond 157 degrees weights would run off to infinity.
const LARGEST_TANGENT: f64 = 5.0;

/// Conjugate gradients stop when the residual has fallen by this factor: far below what can be seen.
const PRECISION: f64 = 1e-7;

/// They stop after this many steps in any case: thousands of new vertices don't settle fully, but what is left are
/// the widest and gentlest waves.
const MOST_STEPS: usize = 400;

/// One umbrella: `own + sum(weight * new vertex)` must become small.
#[derive(Clone, Default)]
struct Row {
    /// The part of the fixed vertices.
    fixed: DVec3,
    /// First entry in the list of entries.
    first: usize,
}

/// The umbrellas as a linear map of the new vertices.
struct System {
    rows: Vec<Row>,
    /// New vertex and its weight, row after row.
    entries: Vec<(u32, f64)>,
    unknowns: usize,
}

/// The patch with its new vertices moved to where it is fair. `outside`: triangles of the mesh at the loop, as points of
/// their corners, with the corners' vertices in the loop.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub(super) fn fair(
    patch: &Patch,
    outside: &[([DVec3; 3], [Option<u32>; 3])],
    progress: &Progress<'_>,
) -> Result<Patch> {
    let mut faired = patch.clone();
    if patch.new_vertices() > 0 {
        let system = System::new(patch, outside);
        system.solve(&mut faired.points[patch.loop_len..], progress)?;
    }
    Ok(faired)
}

impl System {
    fn new(patch: &Patch, outside: &[([DVec3; 3], [Option<u32>; 3])]) -> Self {
        let vertices = patch.points.len();
        let mut gathered = Gathered { links: Vec::new(), fixed: vec![Default::default(); vertices] };
        for (t, corners) in patch.triangles.iter().enumerate() {
            gathered.add(patch.corners(t), corners.map(Some), patch.loop_len);
        }
        for &(points, corners) in outside {
            gathered.add(points, corners, patch.loop_len);
        }
        gathered.into_system(patch)
    }

    /// Least squares by conjugate gradients on the normal equations, from where the vertices are.
    fn solve(&self, x: &mut [DVec3], progress: &Progress<'_>) -> Result<()> {
        let mut residual: Vec<DVec3> = self.apply(x).iter().zip(&self.rows).map(|(a, row)| -(*a + row.fixed)).collect();
        let scaling = self.scaling();
        let scaled =
            |gradient: &[DVec3]| -> Vec<DVec3> { gradient.iter().zip(&scaling).map(|(g, s)| *g * *s).collect() };
        let dot = |a: &[DVec3], b: &[DVec3]| -> DVec3 { a.iter().zip(b).map(|(a, b)| *a * *b).sum() };
        let mut gradient = self.apply_transposed(&residual);
        let mut direction = scaled(&gradient);
        // x, y and z are three systems with one matrix, solved side by side.
        let mut slope = dot(&gradient, &direction);
        let goal = slope * (PRECISION * PRECISION);
        for step in 0..MOST_STEPS {
            if step % 16 == 0 {
                progress.check()?;
            }
            let image = self.apply(&direction);
            let length = dot(&image, &image);
            let stride = DVec3::select(length.cmpgt(DVec3::ZERO), slope / length, DVec3::ZERO);
            x.iter_mut().zip(&direction).for_each(|(x, d)| *x += stride * *d);
            residual.iter_mut().zip(&image).for_each(|(r, i)| *r -= stride * *i);
            gradient = self.apply_transposed(&residual);
            let ahead = scaled(&gradient);
            let new_slope = dot(&gradient, &ahead);
            if new_slope.cmple(goal).all() {
                break;
            }
            let turn = DVec3::select(slope.cmpgt(DVec3::ZERO), new_slope / slope, DVec3::ZERO);
            direction.iter_mut().zip(&ahead).for_each(|(d, a)| *d = *a + turn * *d);
            slope = new_slope;
        }
        Ok(())
    }

    fn entries_of(&self, row: usize) -> &[(u32, f64)] {
        let end = self.rows.get(row + 1).map_or(self.entries.len(), |next| next.first);
        &self.entries[self.rows[row].first..end]
    }

    fn apply(&self, x: &[DVec3]) -> Vec<DVec3> {
        let row = |r| self.entries_of(r).iter().map(|&(v, w)| x[v as usize] * w).sum();
        (0..self.rows.len()).map(row).collect()
    }

    fn apply_transposed(&self, y: &[DVec3]) -> Vec<DVec3> {
        let mut x = vec![DVec3::ZERO; self.unknowns];
        for (r, y) in y.iter().enumerate() {
            for &(v, w) in self.entries_of(r) {
                x[v as usize] += *y * w;
            }
        }
        x
    }

    /// One by the diagonal of the normal equations.
    fn scaling(&self) -> Vec<f64> {
        let mut diagonal = vec![0.0; self.unknowns];
        for &(v, w) in &self.entries {
            diagonal[v as usize] += w * w;
        }
        diagonal.iter().map(|d| if *d > 0.0 { 1.0 / d } else { 0.0 }).collect()
    }
}

/// Sums over the triangles at each vertex.
#[derive(Clone, Copy, Default)]
struct Sums {
    weight: f64,
    /// Of fixed neighbours.
    fixed: DVec3,
    length: f64,
    edges: f64,
}

struct Gathered {
    /// Vertex, new neighbour, weight: one for each triangle at the edge.
    links: Vec<(u32, u32, f64)>,
    fixed: Vec<Sums>,
}

impl Gathered {
    /// Adds what a triangle contributes to the umbrellas of its corners, as far as they are vertices of the patch.
    fn add(&mut self, points: [DVec3; 3], corners: [Option<u32>; 3], loop_len: usize) {
        for i in 0..3 {
            let Some(v) = corners[i] else { continue };
            let at = points[i];
            let others = [(i + 1) % 3, (i + 2) % 3];
            let [a, b] = others.map(|o| points[o] - at);
            let (lengths, twice_area) = (a.length() * b.length(), a.cross(b).length());
            let tangent = ((lengths - a.dot(b)) / twice_area).min(LARGEST_TANGENT);
            for other in others {
                let length = at.distance(points[other]);
                let weight = tangent / length;
                if !weight.is_finite() {
                    continue;
                }
                let sums = &mut self.fixed[v as usize];
                sums.weight += weight;
                sums.length += length;
                sums.edges += 1.0;
                match corners[other] {
                    Some(o) if o as usize >= loop_len => self.links.push((v, o, weight)),
                    _ => sums.fixed += weight * points[other],
                }
            }
        }
    }

    fn into_system(mut self, patch: &Patch) -> System {
        self.links.sort_by_key(|link| (link.0, link.1));
        let loop_len = patch.loop_len as u32;
        let mut system =
            System { rows: Vec::new(), entries: Vec::with_capacity(self.links.len()), unknowns: patch.new_vertices() };
        let mut links = self.links.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)).peekable();
        for (v, sums) in self.fixed.iter().enumerate() {
            let v = v as u32;
            let first = system.entries.len();
            // The umbrella by the square of the edge length around, a curvature; by a length, the root of the area.
            let mean_length = sums.length / sums.edges;
            let scale = 1.0 / (sums.weight * mean_length);
            while let Some(link) = links.next_if(|link| link[0].0 == v) {
                let weight: f64 = link.iter().map(|l| l.2).sum();
                system.entries.push((link[0].1 - loop_len, weight * scale));
            }
            if !scale.is_finite() || (first == system.entries.len() && v < loop_len) {
                system.entries.truncate(first);
                continue;
            }
            let mut fixed = sums.fixed * scale;
            if v < loop_len {
                fixed -= patch.points[v as usize] / mean_length;
            } else {
                system.entries.push((v - loop_len, -1.0 / mean_length));
            }
            system.rows.push(Row { fixed, first });
        }
        system
    }
}
