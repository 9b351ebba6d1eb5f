//! The bound as a promise: what the certificate finds beyond it is mended until nothing is.
//!
//! Digging and polish keep a hair below the tolerance, and their rounding may still differ from the certificate's if triangles are slivers.
//! Such triangles are split at their worst pixel, whose sample becomes a vertex. A vertex that has left its sample too far goes back to it.
//! Each round makes at least one more pixel exact, so it ends, with every sample a vertex at last.

use rustc_hash::{FxHashMap, FxHashSet};

use super::delaunay::NONE;
use super::pieces::Pieces;
use super::view::{Site, View};
use base::error::Result;
use base::progress::Progress;

/// Bounds that a tolerance sets to each stage, world units.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bound {
    /// Asked for.
    pub tolerance: f64,
    /// Bound of the certificate: the largest number of single precision that is not above the tolerance, so that errors rounded up to
    /// single precision are not, either.
    pub certified: f64,
    /// Bound of digging and polish: a hair less than the tolerance, so that rounding stays below it.
    pub dug: f64,
    /// Bound of vertices off their samples, which go to the very end of their room: a hair less than the certified one.
    pub free: f64,
}

impl Bound {
    /// For samples at most `farthest` from the sensor.
    pub fn new(tolerance: f64, farthest: f64) -> Self {
        let single = tolerance as f32;
        let floor = if f64::from(single) > tolerance { single.next_down() } else { single };
        let certified = if tolerance <= f64::from(f32::MAX) { f64::from(floor) } else { tolerance };
        let below = |bound: f64| (bound * (1.0 - 1e-12) - 16.0 * f64::EPSILON * farthest).max(0.0);
        Bound { tolerance, certified, dug: below(tolerance), free: below(certified) }
    }

    /// Whether a sample is not covered or lies too far from the mesh.
    pub fn is_broken_by(&self, error: f64) -> bool {
        !(error.abs() <= self.certified)
    }
}

/// The mesh with each triangle that breaks the bound split at its worst pixel, and vertices that do back at their samples. `errors` are
/// those of the certificate, one per pixel. `None` if nothing could be mended.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub(super) fn mend<V: View>(
    view: &V,
    pieces: &Pieces,
    errors: &[f64],
    bound: &Bound,
    progress: &Progress<'_>,
) -> Result<Option<Pieces>> {
    let is_broken = |pixel: u32| bound.is_broken_by(errors[pixel as usize]);
    let mut splits = Splits::new(view, pieces);
    let before = splits.moved.len();
    splits.moved.retain(|&pixel, _| !is_broken(pixel));
    let mut any = splits.moved.len() < before;
    let triangles: Vec<u32> = (0..pieces.triangles.len() as u32).collect();
    for block in progress.blocks(&triangles) {
        for &t in block? {
            let size =
                |pixel: u32| if errors[pixel as usize].is_nan() { f64::INFINITY } else { errors[pixel as usize].abs() };
            let broken = pieces.pixels_of(t as usize).iter().copied().filter(|&p| is_broken(p));
            let worst = broken.max_by(|&p, &q| size(p).total_cmp(&size(q)).then(q.cmp(&p)));
            if let Some(worst) = worst {
                any |= splits.split(t, worst);
            }
        }
    }
    Ok(any.then(|| splits.finish()))
}

struct Splits<'a, V> {
    view: &'a V,
    pieces: &'a Pieces,
    /// Triangles that are split, and what they become.
    gone: FxHashSet<u32>,
    mended: Pieces,
    /// Values of vertices that have left their samples.
    moved: FxHashMap<u32, f64>,
    /// The triangle on the left of each edge. Found when a pixel lies on one.
    left_of: FxHashMap<[u32; 2], u32>,
}

impl<'a, V: View> Splits<'a, V> {
    fn new(view: &'a V, pieces: &'a Pieces) -> Self {
        let moved = pieces.moved.iter().copied().collect();
        let (gone, left_of) = (FxHashSet::default(), FxHashMap::default());
        Splits { view, pieces, gone, mended: Pieces::default(), moved, left_of }
    }

    /// Splits a triangle at one of its pixels, and the one beyond the edge on which the pixel is seen. `false` if one of them was split
    /// before.
    fn split(&mut self, t: u32, pixel: u32) -> bool {
        let corners = self.pieces.triangles[t as usize];
        let edges = [0, 1, 2].map(|i| [corners[i], corners[(i + 1) % 3]]);
        let mut not_inside = edges.into_iter().filter(|&[a, b]| !(self.turn(a, b, pixel) > 0.0));
        let (on_edge, on_other) = (not_inside.next(), not_inside.next());
        if on_other.is_some() {
            // Off the lattice, rounding of a vertex that has left its sample may put a pixel barely beyond its triangle.
            let before = self.moved.len();
            self.moved.retain(|pixel, _| !corners.contains(pixel));
            return self.moved.len() < before;
        }
        let beyond = on_edge.map_or(NONE, |[a, b]| self.triangle_left_of([b, a]));
        if self.gone.contains(&t) || self.gone.contains(&beyond) {
            return false;
        }
        for split in [t, beyond] {
            if split != NONE {
                self.gone.insert(split);
                self.fan(split, pixel);
            }
        }
        true
    }

    /// Replaces a triangle by those between its edges and a pixel in it or on an edge.
    fn fan(&mut self, t: u32, pixel: u32) {
        let corners = self.pieces.triangles[t as usize];
        let edges = [0, 1, 2].map(|i| [corners[i], corners[(i + 1) % 3]]);
        let edges: Vec<_> = edges.into_iter().filter(|&[a, b]| self.turn(a, b, pixel) > 0.0).collect();
        let mut pixels = self.pieces.pixels_of(t as usize).to_vec();
        pixels.retain(|&p| p != pixel);
        for (k, &[a, b]) in edges.iter().enumerate() {
            let is_within =
                |p: u32| k + 1 == edges.len() || self.turn(b, pixel, p) >= 0.0 && self.turn(pixel, a, p) >= 0.0;
            let (inside, outside) = pixels.into_iter().partition::<Vec<_>, _>(|&p| is_within(p));
            self.mended.pixels.extend(inside);
            self.mended.push([a, b, pixel]);
            pixels = outside;
        }
    }

    /// As [`Site::turn`], of vertices where they are.
    fn turn(&self, a: u32, b: u32, c: u32) -> f64 {
        let [a, b, c] = [a, b, c].map(|p| {
            let sample = self.view.site(p);
            self.moved.get(&p).map_or(sample, |&value| sample.at(value))
        });
        V::Site::turn(&a, &b, &c)
    }

    fn triangle_left_of(&mut self, edge: [u32; 2]) -> u32 {
        if self.left_of.is_empty() {
            for (t, triangle) in self.pieces.triangles.iter().enumerate() {
                for i in 0..3 {
                    self.left_of.insert([triangle[i], triangle[(i + 1) % 3]], t as u32);
                }
            }
        }
        self.left_of.get(&edge).copied().unwrap_or(NONE)
    }

    /// The triangles that were split, and all others.
    fn finish(mut self) -> Pieces {
        let rest: Vec<u32> = (0..self.pieces.triangles.len() as u32).filter(|t| !self.gone.contains(t)).collect();
        self.mended.moved = self.moved.into_iter().collect();
        let rest = Pieces { moved: Vec::new(), ..self.pieces.some(&rest) };
        Pieces::join(vec![rest, self.mended])
    }
}
