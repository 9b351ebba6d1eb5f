//! Stage 5: which cells can be reconstructed, and the anomalies that their neighbours settle. [MI04, sec. 3.4]
//!
//! Works on 32 nodes at a time: one bit per node, rows of a brick with a margin of its neighbours. The steps, each a few operations on
//! whole rows:
//!
//! 1. **active edges**: both nodes labelled by crossings, with different labels.
//! 2. the other corners of the cells around them take the label of their neighbours along edges without a crossing, twice, where these
//!    agree.
//! 3. **gap edges**: different labels, but not both from crossings. The surface would pass here, yet no scan was seen. One is accepted (the
//!    paper's case b) if it leaves no neighbouring cell with a configuration that can't be reconstructed. So pinholes close, while a
//!    surface never grows beyond its border.
//! 4. a **valid cell** has all corners labelled and its surface meets active or accepted edges only.
//! 5. cells that touch along an edge of the grid only, where two fans of triangles would share a vertex, are given up.

use crate::crossings::lattice::{BRICK, ROWS};
use crate::field::Plane;

/// Margin of neighbouring nodes on each side of a brick: the reach of all steps together. Whether an edge is used depends on the labels of
/// nodes from 7 below to 9 above it. Labels of corners reach 3 and 4, gap edges 1 more above. Each of the [`GAP_ROUNDS`] and
/// [`PINCH_ROUNDS`] reaches 1 on both sides, cells 1 more each.
pub const MARGIN: i32 = 9;
/// Distance from a labelled node, along each axis, within which a corner can get a label, or a cell lie.
pub const LABEL_REACH: i32 = 4;
/// Rows along y and z of a window.
const WIDTH: usize = (BRICK + 2 * MARGIN) as usize;
/// Rows before and after the window, so that neighbours need no test. Their content never reaches the brick.
const PAD: usize = WIDTH + 1;
/// Times a gap edge is tested against the cells around it.
const GAP_ROUNDS: usize = 2;
/// Times pinched cells are looked for.
const PINCH_ROUNDS: usize = 1;

/// Rows of a window with those before and after it. The length is known at compile time, so loops need no bounds checks.
type Rows = Box<[u64; LENGTH]>;
const LENGTH: usize = WIDTH * WIDTH + 2 * PAD;

/// Facts on a brick that reconstruction needs.
pub struct BrickSurface {
    /// Brick coordinates.
    pub brick: [i32; 3],
    /// Edges along x, y, z, by their lower node, that carry a vertex.
    pub used: [Plane; 3],
    /// Vertices before each row, all of x first, then y, then z.
    pub before: [[u32; ROWS]; 3],
    /// Number of vertices.
    pub vertices: u32,
    /// Cells, by their lowest corner, that are reconstructed.
    pub valid: Plane,
    /// Of these, the ones settled by their neighbours: case b.
    pub settled: Plane,
    /// Nodes inside.
    pub inside: Plane,
    /// Number of triangles.
    pub triangles: u32,
}

/// Analyses brick after brick, keeping its buffers.
pub struct Analyser {
    direct_in: Rows,
    direct_out: Rows,
    inside: Rows,
    outside: Rows,
    need: Rows,
    active: [Rows; 3],
    gap: [Rows; 3],
    accepted: [Rows; 3],
    cells: Rows,
    bad: Rows,
    valid: Rows,
    spare: Rows,
}

impl Default for Analyser {
    fn default() -> Self {
        let rows = || -> Rows {
            vec![0_u64; LENGTH].into_boxed_slice().try_into().expect("the vector has the array's length")
        };
        Analyser {
            direct_in: rows(),
            direct_out: rows(),
            inside: rows(),
            outside: rows(),
            need: rows(),
            active: [rows(), rows(), rows()],
            gap: [rows(), rows(), rows()],
            accepted: [rows(), rows(), rows()],
            cells: rows(),
            bad: rows(),
            valid: rows(),
            spare: rows(),
        }
    }
}

/// Copies the rows of a brick and of its neighbours, `margin` nodes far, into rows of `32 + 2 margin` bits.
/// `plane` gives the rows of the brick at an offset of -1, 0 or 1 along each axis.
pub fn gather<'a>(margin: i32, rows: &mut [u64], width: usize, plane: impl Fn([i32; 3]) -> Option<&'a Plane>) {
    let planes: Vec<Option<&Plane>> = (0..27).map(|i| plane([i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1])).collect();
    let mut i = 0;
    for z in -margin..BRICK + margin {
        for y in -margin..BRICK + margin {
            let at = ((z >> 5) + 1) * 9 + ((y >> 5) + 1) * 3;
            let row = crate::crossings::lattice::row(y, z);
            let word = |dx: i32| planes[(at + dx) as usize].map_or(0, |p| u64::from(p[row]));
            let low = word(0) >> (BRICK - margin);
            let high = word(2) & ((1 << margin) - 1);
            rows[i] = low | word(1) << margin | high << (BRICK + margin);
            i += 1;
        }
    }
    debug_assert_eq!(i, width * width);
}

/// Index distance from a row to the next along y and z.
const NEXT_Y: usize = 1;
const NEXT_Z: usize = WIDTH;

impl Analyser {
    /// Analyses a brick. `labels` gives the inside and outside nodes of the brick at an offset. `None` if it has neither a vertex nor a
    /// cell.
    pub fn analyse<'a>(
        &mut self,
        brick: [i32; 3],
        labels: impl Fn([i32; 3]) -> Option<[&'a Plane; 2]>,
    ) -> Option<Box<BrickSurface>> {
        let inner = PAD..PAD + WIDTH * WIDTH;
        gather(MARGIN, &mut self.direct_in[inner.clone()], WIDTH, |at| labels(at).map(|l| l[0]));
        gather(MARGIN, &mut self.direct_out[inner], WIDTH, |at| labels(at).map(|l| l[1]));
        self.active_edges();
        self.label_corners();
        self.gap_edges();
        self.accept_gaps();
        self.valid_cells();
        for _ in 0..PINCH_ROUNDS {
            self.give_up_pinched_cells();
        }
        self.extract(brick)
    }

    fn active_edges(&mut self) {
        let (inside, outside) = (&self.direct_in, &self.direct_out);
        for i in PAD..PAD + WIDTH * WIDTH {
            let (a, b) = (inside[i], outside[i]);
            self.active[0][i] = a & (b >> 1) | b & (a >> 1);
            self.active[1][i] = a & outside[i + NEXT_Y] | b & inside[i + NEXT_Y];
            self.active[2][i] = a & outside[i + NEXT_Z] | b & inside[i + NEXT_Z];
        }
    }

    /// Labels the corners of cells around active edges that no crossing speaks of.
    fn label_corners(&mut self) {
        around_edges(&self.active, &mut self.cells);
        for i in PAD..PAD + WIDTH * WIDTH {
            let c = &self.cells;
            let corners = c[i] | c[i - NEXT_Y] | c[i - NEXT_Z] | c[i - NEXT_Y - NEXT_Z];
            self.need[i] = (corners | corners << 1) & !(self.direct_in[i] | self.direct_out[i]);
        }
        self.inside.copy_from_slice(&self.direct_in[..]);
        self.outside.copy_from_slice(&self.direct_out[..]);
        for _ in 0..2 {
            neighbours(&self.inside, &mut self.bad);
            neighbours(&self.outside, &mut self.spare);
            for i in PAD..PAD + WIDTH * WIDTH {
                let open = self.need[i] & !(self.inside[i] | self.outside[i]);
                self.inside[i] |= open & self.bad[i] & !self.spare[i];
                self.outside[i] |= open & self.spare[i] & !self.bad[i];
            }
        }
        // Torn between neighbours: the majority. Whether the cells around may be used is decided by their gap edges.
        for i in PAD..PAD + WIDTH * WIDTH {
            let open = self.need[i] & self.bad[i] & self.spare[i] & !(self.inside[i] | self.outside[i]);
            if open == 0 {
                (self.spare[i], self.bad[i]) = (0, 0);
                continue;
            }
            let [i1, i2, i4] = count_neighbours(&self.inside, i);
            let [o1, o2, o4] = count_neighbours(&self.outside, i);
            let more = i4 & !o4 | !(i4 ^ o4) & (i2 & !o2 | !(i2 ^ o2) & i1 & !o1);
            self.spare[i] = open & more;
            self.bad[i] = open & !more;
        }
        for i in PAD..PAD + WIDTH * WIDTH {
            let open = self.need[i] & !(self.inside[i] | self.outside[i]);
            if open != 0 {
                self.inside[i] |= open & self.spare[i];
                self.outside[i] |= open & self.bad[i];
            }
        }
    }

    fn gap_edges(&mut self) {
        let (inside, outside) = (&self.inside, &self.outside);
        for i in PAD..PAD + WIDTH * WIDTH {
            let (a, b) = (inside[i], outside[i]);
            self.gap[0][i] = (a & (b >> 1) | b & (a >> 1)) & !self.active[0][i];
            self.gap[1][i] = (a & outside[i + NEXT_Y] | b & inside[i + NEXT_Y]) & !self.active[1][i];
            self.gap[2][i] = (a & outside[i + NEXT_Z] | b & inside[i + NEXT_Z]) & !self.active[2][i];
        }
        // Cells with all eight corners labelled.
        for i in PAD..PAD + WIDTH * WIDTH {
            let row = |j: usize| inside[j] | outside[j];
            let four = row(i) & row(i + NEXT_Y) & row(i + NEXT_Z) & row(i + NEXT_Y + NEXT_Z);
            self.cells[i] = four & (four >> 1);
        }
    }

    fn accept_gaps(&mut self) {
        for axis in 0..3 {
            self.accepted[axis].copy_from_slice(&self.gap[axis][..]);
        }
        for _ in 0..GAP_ROUNDS {
            self.find_bad_cells();
            let bad = &self.bad;
            for i in PAD..PAD + WIDTH * WIDTH {
                let [x, y, z] = edges_of_cells(bad, i);
                self.accepted[0][i] &= !x;
                self.accepted[1][i] &= !y;
                self.accepted[2][i] &= !z;
            }
        }
    }

    /// Cells that lack a label or meet a gap edge that isn't accepted.
    fn find_bad_cells(&mut self) {
        let refused = &mut self.valid;
        around(|axis, i| self.gap[axis][i] & !self.accepted[axis][i], refused);
        for i in PAD..PAD + WIDTH * WIDTH {
            self.bad[i] = !self.cells[i] | refused[i];
        }
    }

    fn valid_cells(&mut self) {
        self.find_bad_cells();
        let used = |axis: usize, i: usize| self.active[axis][i] | self.accepted[axis][i];
        around(used, &mut self.valid);
        for i in PAD..PAD + WIDTH * WIDTH {
            self.valid[i] &= !self.bad[i];
        }
    }

    /// Gives up two valid cells that meet at an edge with a vertex while the two others there aren't valid.
    fn give_up_pinched_cells(&mut self) {
        let valid = &self.valid;
        for i in PAD..PAD + WIDTH * WIDTH {
            let cell = |back: usize, x: u32| valid[i - back] << x;
            let pinched = |axis: usize, [a, b, c, d]: [u64; 4]| {
                (self.active[axis][i] | self.accepted[axis][i]) & (a & c & !b & !d | b & d & !a & !c)
            };
            self.gap[0][i] = pinched(0, [cell(0, 0), cell(NEXT_Y, 0), cell(NEXT_Y + NEXT_Z, 0), cell(NEXT_Z, 0)]);
            self.gap[1][i] = pinched(1, [cell(0, 0), cell(0, 1), cell(NEXT_Z, 1), cell(NEXT_Z, 0)]);
            self.gap[2][i] = pinched(2, [cell(0, 0), cell(0, 1), cell(NEXT_Y, 1), cell(NEXT_Y, 0)]);
        }
        around_edges(&self.gap, &mut self.bad);
        for i in PAD..PAD + WIDTH * WIDTH {
            self.valid[i] &= !self.bad[i];
        }
    }

    /// Cuts the brick out of the window.
    fn extract(&mut self, brick: [i32; 3]) -> Option<Box<BrickSurface>> {
        around_edges(&self.accepted, &mut self.spare);
        let mut surface = Box::new(BrickSurface {
            brick,
            used: [[0; ROWS]; 3],
            before: [[0; ROWS]; 3],
            vertices: 0,
            valid: [0; ROWS],
            settled: [0; ROWS],
            inside: [0; ROWS],
            triangles: 0,
        });
        let mut any = 0;
        for z in 0..BRICK {
            for y in 0..BRICK {
                let i = PAD + (z + MARGIN) as usize * WIDTH + (y + MARGIN) as usize;
                let row = crate::crossings::lattice::row(y, z);
                let cut = |word: u64| (word >> MARGIN) as u32;
                let around = edges_of_cells(&self.valid, i);
                for axis in 0..3 {
                    let used = (self.active[axis][i] | self.accepted[axis][i]) & around[axis];
                    surface.used[axis][row] = cut(used);
                    any |= cut(used);
                }
                surface.valid[row] = cut(self.valid[i]);
                surface.settled[row] = cut(self.spare[i]);
                surface.inside[row] = cut(self.inside[i]);
                any |= surface.valid[row] | surface.inside[row];
            }
        }
        if any == 0 {
            return None;
        }
        for axis in 0..3 {
            for row in 0..ROWS {
                surface.before[axis][row] = surface.vertices;
                surface.vertices += surface.used[axis][row].count_ones();
            }
        }
        Some(surface)
    }
}

/// The six neighbours of the nodes of a plane.
fn neighbours(nodes: &Rows, out: &mut Rows) {
    for i in PAD..PAD + WIDTH * WIDTH {
        out[i] = nodes[i] << 1
            | nodes[i] >> 1
            | nodes[i - NEXT_Y]
            | nodes[i + NEXT_Y]
            | nodes[i - NEXT_Z]
            | nodes[i + NEXT_Z];
    }
}

/// Number of the six neighbours of each node of a row that are set, as three binary digits, lowest first.
fn count_neighbours(nodes: &Rows, i: usize) -> [u64; 3] {
    let add = |a: u64, b: u64, c: u64| (a ^ b ^ c, a & b | c & (a ^ b));
    let (ones_a, twos_a) = add(nodes[i] << 1, nodes[i] >> 1, nodes[i - NEXT_Y]);
    let (ones_b, twos_b) = add(nodes[i + NEXT_Y], nodes[i - NEXT_Z], nodes[i + NEXT_Z]);
    let (twos, fours) = add(twos_a, twos_b, ones_a & ones_b);
    [ones_a ^ ones_b, twos, fours]
}

fn around_edges(edges: &[Rows; 3], cells: &mut Rows) {
    around(|axis, i| edges[axis][i], cells);
}

/// The cells around edges: four per edge.
#[inline]
fn around(edge: impl Fn(usize, usize) -> u64, cells: &mut Rows) {
    for i in PAD..PAD + WIDTH * WIDTH {
        let x = edge(0, i) | edge(0, i + NEXT_Y) | edge(0, i + NEXT_Z) | edge(0, i + NEXT_Y + NEXT_Z);
        let y = edge(1, i) | edge(1, i + NEXT_Z);
        let z = edge(2, i) | edge(2, i + NEXT_Y);
        cells[i] = x | y | y >> 1 | z | z >> 1;
    }
}

/// The edges of cells, by their lower node: each edge of any of the four cells around it.
#[inline]
fn edges_of_cells(cells: &Rows, i: usize) -> [u64; 3] {
    let (here, y, z, yz) = (cells[i], cells[i - NEXT_Y], cells[i - NEXT_Z], cells[i - NEXT_Y - NEXT_Z]);
    let (along_y, along_z) = (here | z, here | y);
    [here | y | z | yz, along_y | along_y << 1, along_z | along_z << 1]
}
