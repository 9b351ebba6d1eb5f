//! A mesh over pixels between the stages: triangles, each with the pixels seen in it.

use rustc_hash::FxHashSet;

/// Triangles over pixel indices, turning like columns toward rows, with the pixels that are no vertices: each one in the
/// list of one triangle that it is seen in or on the edge of.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Pieces {
    pub triangles: Vec<[u32; 3]>,
    /// The end of each triangle's pixels in `pixels`. They start where those of the triangle before end.
    pub ends: Vec<u32>,
    pub pixels: Vec<u32>,
    /// Vertices that have left their samples: pixels with their values, [`super::view::Site::value`]. Some come twice.
    pub moved: Vec<(u32, f64)>,
    /// Whether each pixel of the image is a vertex that can't be removed from the triangles that it has: no need to try again
    /// before those change. Empty where nothing is known.
    pub settled: Vec<bool>,
}

impl Pieces {
    /// Triangles whose corners are all the pixels they cover.
    pub fn full(triangles: &[[u32; 3]]) -> Self {
        Pieces { triangles: triangles.to_vec(), ends: vec![0; triangles.len()], ..Pieces::default() }
    }

    /// Appends a triangle. Its pixels were appended before.
    pub fn push(&mut self, triangle: [u32; 3]) {
        self.triangles.push(triangle);
        self.ends.push(self.pixels.len() as u32);
    }

    /// The pixels listed with triangle `t`.
    pub fn pixels_of(&self, t: usize) -> &[u32] {
        let start = if t == 0 { 0 } else { self.ends[t - 1] as usize };
        &self.pixels[start..self.ends[t] as usize]
    }

    /// Values of the vertices that have left their samples, one a pixel of the image, NaN elsewhere.
    pub fn values(&self, pixels: usize) -> Vec<f64> {
        let mut values = vec![f64::NAN; pixels];
        for &(pixel, value) in &self.moved {
            values[pixel as usize] = value;
        }
        values
    }

    /// Some of the triangles.
    pub fn some(&self, triangles: &[u32]) -> Self {
        let mut some = Pieces::default();
        for &t in triangles {
            some.pixels.extend(self.pixels_of(t as usize));
            some.push(self.triangles[t as usize]);
        }
        if !self.moved.is_empty() {
            // Others of the moved may be back at their samples in their own part.
            let vertices: FxHashSet<u32> = some.triangles.iter().flatten().copied().collect();
            some.moved.extend(self.moved.iter().filter(|(pixel, _)| vertices.contains(pixel)));
        }
        some
    }

    /// All parts one after the other.
    pub fn join(parts: Vec<Pieces>) -> Self {
        let mut all = Pieces::default();
        all.triangles.reserve_exact(parts.iter().map(|p| p.triangles.len()).sum());
        all.ends.reserve_exact(parts.iter().map(|p| p.triangles.len()).sum());
        all.pixels.reserve_exact(parts.iter().map(|p| p.pixels.len()).sum());
        for part in parts {
            let offset = all.pixels.len() as u32;
            all.ends.extend(part.ends.iter().map(|end| end + offset));
            all.triangles.extend(part.triangles);
            all.pixels.extend(part.pixels);
            all.moved.extend(part.moved);
        }
        all
    }
}
