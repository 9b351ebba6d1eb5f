//! The tetrahedralization as the stages see it: cells, facets, stars, and the sizes of balls and facets.
//!
//! A facet is named by a cell and the slot of the vertex opposite to it. All sizes are computed from the vertices in the
//! order of their numbers, so that they do not depend on how a cell happens to list them.

use glam::DVec3;

use super::slivers;
use geom::delaunay3::{Cell, INFINITE};

/// Vertices of the facet opposite to each slot, counter-clockwise seen from outside the cell.
pub(super) const FACETS: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// A cell is taken as flat if its volume is less than this share of that of a box over its edges: what doubles tell of its circumscribed
/// ball may be rounding error. Decides on sizes only, never on topology.
const FLAT: f64 = 1e-10;

/// The place of a number that is one of four, without a branch: any place is as likely as the others.
#[inline]
pub(super) fn place_in(four: [u32; 4], number: u32) -> usize {
    debug_assert!(four.contains(&number), "{number} is none of {four:?}");
    usize::from(four[1] == number) + 2 * usize::from(four[2] == number) + 3 * usize::from(four[3] == number)
}

/// A view of the Delaunay cells. Those with the vertex [`INFINITE`] lie outside the convex hull.
#[derive(Clone, Copy)]
pub(super) struct Complex<'a> {
    pub(super) points: &'a [DVec3],
    /// First those inside the hull, then those outside.
    pub(super) cells: &'a [Cell],
    /// Number of those inside.
    pub(super) finite: usize,
}

impl Complex<'_> {
    pub(super) fn len(&self) -> usize {
        self.cells.len()
    }

    pub(super) fn is_outer(&self, cell: u32) -> bool {
        cell as usize >= self.finite
    }

    pub(super) fn vertices(&self, cell: u32) -> [u32; 4] {
        self.cells[cell as usize].vertices
    }

    pub(super) fn neighbour(&self, cell: u32, slot: usize) -> u32 {
        self.cells[cell as usize].neighbours[slot]
    }

    /// Vertices of a facet, counter-clockwise seen from outside the cell.
    pub(super) fn facet(&self, cell: u32, slot: usize) -> [u32; 3] {
        let vertices = self.vertices(cell);
        FACETS[slot].map(|i| vertices[i])
    }

    /// The slot of the neighbour beyond a facet that the facet is opposite to.
    pub(super) fn mirror(&self, cell: u32, slot: usize) -> usize {
        let beyond = self.cells[self.neighbour(cell, slot) as usize].neighbours;
        place_in(beyond, cell)
    }

    /// A cell of each vertex, or `u32::MAX`.
    pub(super) fn incident(&self) -> Vec<u32> {
        let mut incident = vec![u32::MAX; self.points.len()];
        for (number, cell) in self.cells.iter().enumerate() {
            for vertex in cell.vertices {
                if vertex != INFINITE {
                    incident[vertex as usize] = number as u32;
                }
            }
        }
        incident
    }

    /// Fills `star` with the cells around a vertex and its slot in each, starting from one of them.
    pub(super) fn star(&self, vertex: u32, start: u32, star: &mut Star) {
        star.cells.clear();
        star.push(start, self.slot(start, vertex));
        let mut next = 0;
        while next < star.cells.len() {
            let (cell, own) = star.cells[next];
            next += 1;
            for slot in 0..4 {
                let beyond = self.neighbour(cell, slot);
                if slot != usize::from(own) && star.position(beyond).is_none() {
                    star.push(beyond, self.slot(beyond, vertex));
                }
            }
        }
    }

    fn slot(&self, cell: u32, vertex: u32) -> usize {
        place_in(self.vertices(cell), vertex)
    }

    /// A cell's vertices in the order of their numbers: what it is called whatever its own number, which depends on the
    /// number of threads.
    pub(super) fn name(&self, cell: u32) -> [u32; 4] {
        let mut vertices = self.vertices(cell);
        vertices.sort_unstable();
        vertices
    }

    /// Corners of a facet, in the order of their numbers.
    fn corners(&self, mut vertices: [u32; 3]) -> [DVec3; 3] {
        vertices.sort_unstable();
        vertices.map(|v| self.points[v as usize])
    }

    pub(super) fn perimeter(&self, vertices: [u32; 3]) -> f64 {
        let [a, b, c] = self.corners(vertices);
        a.distance(b) + b.distance(c) + c.distance(a)
    }

    /// Area of a facet.
    pub(super) fn area(&self, vertices: [u32; 3]) -> f64 {
        let [a, b, c] = self.corners(vertices);
        (b - a).cross(c - a).length() / 2.0
    }

    /// Radius of a facet's circumscribed circle. Infinity where its corners lie on a line.
    pub(super) fn circle(&self, vertices: [u32; 3]) -> f64 {
        let [a, b, c] = self.corners(vertices);
        let (u, v) = (b - a, c - a);
        let squares = u.length_squared() * v.length_squared() * (u - v).length_squared();
        let radius = (squares / (4.0 * u.cross(v).length_squared())).sqrt();
        if radius.is_nan() { f64::INFINITY } else { radius }
    }

    /// Radius of the smallest ball that holds a facet.
    fn bounding(&self, vertices: [u32; 3]) -> f64 {
        let [a, b, c] = self.corners(vertices);
        let mut sides = [a.distance_squared(b), b.distance_squared(c), c.distance_squared(a)];
        sides.sort_unstable_by(f64::total_cmp);
        if sides[0] + sides[1] <= sides[2] { sides[2].sqrt() / 2.0 } else { self.circle(vertices) }
    }

    /// Radius of a finite cell's circumscribed ball, and for each slot (bit) whether the ball's centre lies on the
    /// cell's side of the facet opposite to it.
    pub(super) fn ball(&self, cell: u32) -> (f32, u8) {
        let ball = self.centred_ball(cell);
        (ball.1, ball.2)
    }

    /// Like [`Complex::ball`], with the ball's centre as seen from the cell's vertex of lowest number.
    pub(super) fn centred_ball(&self, cell: u32) -> (DVec3, f32, u8) {
        let vertices = self.vertices(cell);
        let mut order = [0, 1, 2, 3];
        order.sort_unstable_by_key(|&i| vertices[i]);
        let [a, b, c, d] = order.map(|i| self.points[vertices[i] as usize]);
        let (u, v, w) = (b - a, c - a, d - a);
        let (vw, wu, uv) = (v.cross(w), w.cross(u), u.cross(v));
        let (uu, vv, ww) = (u.length_squared(), v.length_squared(), w.length_squared());
        let volume = u.dot(vw);
        // Also for NaN.
        if !(volume.abs() > FLAT * (uu * vv * ww).sqrt()) {
            if let Some((centre, sides)) = slivers::ball([a, b, c, d]) {
                // Infinite ones are those of cells outside the hull.
                let radius = (centre.length() as f32).min(f32::MAX);
                return (centre, radius, (0..4).fold(0, |bits, i| bits | u8::from(sides[i]) << order[i]));
            }
            // In a plane: any ball will do, the smallest says least.
            let radius = (0..4).map(|slot| self.bounding(self.facet(cell, slot))).fold(0.0, f64::max);
            return (DVec3::ZERO, radius as f32, 0b1111);
        }
        let centre = (vw * uu + wu * vv + uv * ww) * (0.5 / volume);
        let sign = volume.signum();
        let [beside_b, beside_c, beside_d] = [vw, wu, uv].map(|normal| centre.dot(normal) * sign);
        let sides = [volume.abs() - beside_b - beside_c - beside_d, beside_b, beside_c, beside_d];
        let bits = (0..4).fold(0, |bits, i| bits | u8::from(sides[i] >= 0.0) << order[i]);
        (centre, centre.length() as f32, bits)
    }
}

/// The cells around a vertex. Kept and refilled, so that walking many stars allocates once.
#[derive(Default)]
pub(super) struct Star {
    /// Each cell with the vertex's slot in it.
    pub(super) cells: Vec<(u32, u8)>,
    /// Places in `cells` by cell, open addressing. Used once a star is large.
    table: Vec<u32>,
}

/// Stars up to this size are searched one by one.
const SMALL: usize = 48;

impl Star {
    /// Place of a cell in the star that is being filled.
    fn position(&self, cell: u32) -> Option<usize> {
        if self.cells.len() <= SMALL {
            return self.cells.iter().position(|c| c.0 == cell);
        }
        let mut at = self.hash(cell);
        while self.table[at] != u32::MAX {
            if self.cells[self.table[at] as usize].0 == cell {
                return Some(self.table[at] as usize);
            }
            at = (at + 1) & (self.table.len() - 1);
        }
        None
    }

    /// Place of a cell in the full star.
    pub(super) fn find(&self, cell: u32) -> Option<usize> {
        self.position(cell)
    }

    fn hash(&self, cell: u32) -> usize {
        (cell.wrapping_mul(0x9E37_79B1) >> 7) as usize & (self.table.len() - 1)
    }

    fn push(&mut self, cell: u32, slot: usize) {
        self.cells.push((cell, slot as u8));
        let count = self.cells.len();
        if count <= SMALL {
            return;
        }
        if count == SMALL + 1 || 2 * count > self.table.len() {
            self.table.clear();
            self.table.resize((4 * count).next_power_of_two(), u32::MAX);
            (0..count).for_each(|place| self.enter(place));
        } else {
            self.enter(count - 1);
        }
    }

    fn enter(&mut self, place: usize) {
        let mut at = self.hash(self.cells[place].0);
        while self.table[at] != u32::MAX {
            at = (at + 1) & (self.table.len() - 1);
        }
        self.table[at] = place as u32;
    }
}
