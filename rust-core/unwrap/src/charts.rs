//! Charts in the making: a place for each vertex in each chart that it belongs to.

use glam::DVec2;

/// No chart.
pub const NONE: u32 = u32::MAX;

/// Cells of the grid of coordinates in a unit of length: as fine as single precision is just below 1.
const GRID: f64 = (1 << 24) as f64;

/// The nearest coordinates that single precision holds, and `1 - v` of them, too: files that count v from the top lose nothing.
pub fn on_grid(at: DVec2) -> DVec2 {
    ((at * GRID).round() / GRID).as_vec2().as_dvec2()
}

/// The flattened triangles. *Places* are vertices as charts have them: a vertex on a seam has one in each chart.
#[derive(Clone, Debug, Default)]
pub struct Charts {
    /// Texture coordinates of the places.
    pub uv: Vec<DVec2>,
    /// Vertex of each place.
    pub vertex: Vec<u32>,
    /// Places of the corners of each triangle.
    pub corners: Vec<[u32; 3]>,
    /// Chart of each triangle, [`NONE`] for one without area in the texture.
    pub of: Vec<u32>,
}

impl Charts {
    /// A triangle in the texture.
    #[inline]
    pub fn triangle(&self, t: usize) -> [DVec2; 3] {
        self.corners[t].map(|place| self.uv[place as usize])
    }

    /// Triangles of each chart. A chart may have none.
    pub fn members(&self) -> Vec<Vec<u32>> {
        let count = self.of.iter().filter(|&&chart| chart != NONE).max().map_or(0, |&last| last as usize + 1);
        let mut members = vec![Vec::new(); count];
        for (t, &chart) in self.of.iter().enumerate() {
            if chart != NONE {
                members[chart as usize].push(t as u32);
            }
        }
        members
    }

    /// Numbers the charts anew in the order of their first triangles, without those that are empty. How many there are.
    pub fn renumber(&mut self) -> usize {
        let mut numbers = rustc_hash::FxHashMap::default();
        for chart in self.of.iter_mut().filter(|chart| **chart != NONE) {
            let next = numbers.len() as u32;
            *chart = *numbers.entry(*chart).or_insert(next);
        }
        numbers.len()
    }

    /// Takes the area of a triangle: its corners become one point.
    pub fn collapse(&mut self, t: usize) {
        let at = self.uv[self.corners[t][0] as usize];
        for k in 0..3 {
            let place = self.corners[t][k] as usize;
            let vertex = self.vertex[place];
            if self.uv[place] != at {
                self.corners[t][k] = self.uv.len() as u32;
                self.uv.push(at);
                self.vertex.push(vertex);
            }
        }
        self.of[t] = NONE;
    }
}
