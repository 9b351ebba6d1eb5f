//! The triangles of a cell from the labels of its eight corners. [LC87; MSS94]
//!
//! ```text
//!        6 ────────── 7      corner = x + 2 y + 4 z
//!       /|           /|      edge   = 4 axis + the two other coordinates of its corners, lower axis first:
//!      / |          / |               0..3 along x (y + 2 z), 4..7 along y (x + 2 z), 8..11 along z (x + 2 y)
//!     4 ────────── 5  |      face   = 2 axis + side
//!     |  2 ────────|─ 3
//!     | /          | /       z y
//!     |/           |/        |/
//!     0 ────────── 1         o─ x
//! ```
//!
//! The table is made, not typed. On each face every run of inside corners is cut off by its own segment, which depends on the face alone.
//! So neighbouring cells always agree (no crack, as Montani et al.). The segments join to loops. Each loop is triangulated without a
//! diagonal between two vertices of one face. Such a diagonal could meet the same diagonal of the neighbouring cell, and four triangles
//! would share an edge. So any set of whole cells gives edges with at most two triangles.

use std::sync::Arc;

use base::threads::Exclusive;

/// Two corners of each edge, the lower first.
pub const EDGE_CORNERS: [[u8; 2]; 12] =
    [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]];

/// Corners of each face, counter-clockwise seen from outside the cell.
const FACE_CORNERS: [[u8; 4]; 6] = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

/// Marks a triangle side that lies on no face of the cell.
pub const INTERIOR: u8 = 6;

/// One triangle of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CellTriangle {
    /// Cell edges that hold the corners, counter-clockwise seen from outside the object.
    pub edges: [u8; 3],
    /// Face on which side `i` (corner `i` to `i + 1`) lies, or [`INTERIOR`].
    pub faces: [u8; 3],
}

/// Triangles of every configuration. Bit `c` of a configuration is set where corner `c` is inside.
pub struct Table {
    triangles: Vec<CellTriangle>,
    starts: [u16; 257],
}

/// The table, made for the first merge.
pub fn table() -> Arc<Table> {
    static KEPT: Exclusive<Option<Arc<Table>>> = Exclusive::new(None);
    if let Some(table) = KEPT.wait().and_then(|kept| kept.clone()) {
        return table;
    }
    let made = Arc::new(Table::new());
    if let Some(mut kept) = KEPT.wait() {
        *kept = Some(made.clone());
    }
    made
}

impl Table {
    fn new() -> Self {
        let mut table = Table { triangles: Vec::new(), starts: [0; 257] };
        for configuration in 0..=255 {
            for polygon in loops(configuration) {
                let triangles = triangulate(&polygon);
                table.triangles.extend(triangles.iter().map(|&edges| CellTriangle {
                    edges,
                    faces: [0, 1, 2].map(|i| common_face(edges[i], edges[(i + 1) % 3]).unwrap_or(INTERIOR)),
                }));
            }
            table.starts[configuration as usize + 1] = table.triangles.len() as u16;
        }
        table
    }

    /// The triangles of a configuration.
    #[inline]
    pub fn triangles(&self, configuration: u8) -> &[CellTriangle] {
        let c = configuration as usize;
        &self.triangles[self.starts[c] as usize..self.starts[c + 1] as usize]
    }

    /// Number of triangles of a configuration.
    #[inline]
    pub fn count(&self, configuration: u8) -> usize {
        let c = configuration as usize;
        (self.starts[c + 1] - self.starts[c]) as usize
    }
}

fn edge_between(a: u8, b: u8) -> u8 {
    let pair = [a.min(b), a.max(b)];
    EDGE_CORNERS.iter().position(|&e| e == pair).expect("the corners of a face are joined by edges") as u8
}

fn common_face(e: u8, f: u8) -> Option<u8> {
    let corners = [EDGE_CORNERS[e as usize], EDGE_CORNERS[f as usize]].concat();
    FACE_CORNERS.iter().position(|face| corners.iter().all(|c| face.contains(c))).map(|face| face as u8)
}

/// Closed loops of cell edges that separate inside from outside corners.
fn loops(configuration: u8) -> Vec<Vec<u8>> {
    let inside = |corner: u8| configuration >> corner & 1 == 1;
    let mut next = [u8::MAX; 12];
    for face in FACE_CORNERS {
        // A run of inside corners, counter-clockwise, is entered at `start` and left at `end`.
        for i in 0..4 {
            if inside(face[i]) || !inside(face[(i + 1) % 4]) {
                continue;
            }
            let end = (i + 1..i + 4).find(|&j| !inside(face[(j + 1) % 4])).expect("corner i is outside");
            let (enters, leaves) =
                (edge_between(face[i], face[(i + 1) % 4]), edge_between(face[end % 4], face[(end + 1) % 4]));
            next[enters as usize] = leaves;
        }
    }
    let mut loops = Vec::new();
    for first in 0..12 {
        let mut polygon = Vec::new();
        let mut edge = first;
        while next[edge as usize] != u8::MAX {
            polygon.push(edge);
            edge = std::mem::replace(&mut next[edge as usize], u8::MAX);
        }
        if !polygon.is_empty() {
            loops.push(polygon);
        }
    }
    loops
}

/// The triangulation of a loop without a diagonal on a face that has the largest smallest angle with vertices at the
/// middle of their edges.
fn triangulate(polygon: &[u8]) -> Vec<[u8; 3]> {
    let mut best: Option<(f64, Vec<[u8; 3]>)> = None;
    for triangles in triangulations(polygon) {
        let side_of_polygon = |a: u8, b: u8| {
            let (i, j) = (position(polygon, a), position(polygon, b));
            (i + 1) % polygon.len() == j || (j + 1) % polygon.len() == i
        };
        let diagonals_inside = triangles.iter().all(|t| {
            (0..3).all(|i| side_of_polygon(t[i], t[(i + 1) % 3]) || common_face(t[i], t[(i + 1) % 3]).is_none())
        });
        if !diagonals_inside {
            continue;
        }
        let quality = triangles.iter().map(|t| smallest_angle(*t)).fold(f64::INFINITY, f64::min);
        if best.as_ref().is_none_or(|b| quality > b.0 + 1e-9) {
            best = Some((quality, triangles));
        }
    }
    best.expect("every loop has a triangulation inside its cell").1
}

fn position(polygon: &[u8], edge: u8) -> usize {
    polygon.iter().position(|&e| e == edge).expect("a triangle's corners come from its polygon")
}

fn triangulations(polygon: &[u8]) -> Vec<Vec<[u8; 3]>> {
    let n = polygon.len();
    if n < 3 {
        return vec![Vec::new()];
    }
    let mut all = Vec::new();
    // The side from the last to the first vertex belongs to one triangle, whose third corner is `middle`.
    for middle in 1..n - 1 {
        for left in triangulations(&polygon[..=middle]) {
            for right in triangulations(&polygon[middle..]) {
                let mut triangles = left.clone();
                triangles.push([polygon[0], polygon[middle], polygon[n - 1]]);
                triangles.extend(right);
                all.push(triangles);
            }
        }
    }
    all
}

fn smallest_angle(triangle: [u8; 3]) -> f64 {
    let p = triangle.map(|edge| {
        let corner = |c: u8| glam::DVec3::new((c & 1).into(), (c >> 1 & 1).into(), (c >> 2).into());
        let [a, b] = EDGE_CORNERS[edge as usize];
        (corner(a) + corner(b)) / 2.0
    });
    (0..3).map(|i| (p[(i + 1) % 3] - p[i]).angle_between(p[(i + 2) % 3] - p[i])).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use glam::Vec3Swizzles as _;

    use super::*;

    fn middle(edge: u8) -> glam::DVec3 {
        let corner = |c: u8| glam::DVec3::new((c & 1).into(), (c >> 1 & 1).into(), (c >> 2).into());
        let [a, b] = EDGE_CORNERS[edge as usize];
        (corner(a) + corner(b)) / 2.0
    }

    #[test]
    fn a_single_inside_corner_faces_away_from_it() {
        for corner in 0..8_u8 {
            let table = table();
            let triangles = table.triangles(1 << corner);
            assert_eq!(triangles.len(), 1);
            let [a, b, c] = triangles[0].edges.map(middle);
            let at = glam::DVec3::new((corner & 1).into(), (corner >> 1 & 1).into(), (corner >> 2).into());
            assert!((b - a).cross(c - a).dot(a - at) > 0.0);
        }
    }

    #[test]
    fn sides_inside_a_cell_have_two_triangles_and_sides_on_faces_one() {
        for configuration in 0..=255_u8 {
            let mut sides = Vec::new();
            for t in table().triangles(configuration) {
                for i in 0..3 {
                    sides.push((t.edges[i], t.edges[(i + 1) % 3], t.faces[i]));
                }
            }
            for &(a, b, face) in &sides {
                let again = sides.iter().filter(|s| (s.0, s.1) == (a, b)).count();
                let back = sides.iter().filter(|s| (s.0, s.1) == (b, a)).count();
                assert_eq!(again, 1, "configuration {configuration}");
                assert_eq!(back, usize::from(face == INTERIOR), "configuration {configuration}, side {a}-{b}");
            }
        }
    }

    #[test]
    fn neighbouring_cells_agree_on_every_face() {
        // The face x = 1 of one cell is the face x = 0 of the next; its four labels are shared.
        let shared = [(1, 0), (3, 2), (5, 4), (7, 6)];
        for labels in 0..16_u8 {
            let mut segments = Vec::new();
            for side in 0..2 {
                for rest in 0..16_u8 {
                    let mut configuration = 0_u8;
                    for (bit, corners) in shared.iter().enumerate() {
                        let (here, other) = if side == 0 { *corners } else { (corners.1, corners.0) };
                        configuration |= (labels >> bit & 1) << here | (rest >> bit & 1) << other;
                    }
                    let mut found: Vec<_> = table()
                        .triangles(configuration)
                        .iter()
                        .flat_map(|t| (0..3).map(move |i| (t.edges[i], t.edges[(i + 1) % 3], t.faces[i])))
                        .filter(|s| s.2 == if side == 0 { 1 } else { 0 })
                        .map(|(a, b, _)| {
                            let (a, b) = if side == 0 { (a, b) } else { (b, a) };
                            (middle(a).yz(), middle(b).yz())
                        })
                        .map(|(a, b)| [a.x, a.y, b.x, b.y].map(f64::to_bits))
                        .collect();
                    found.sort_unstable();
                    segments.push(found);
                }
            }
            assert!(segments.windows(2).all(|w| w[0] == w[1]), "labels {labels:04b}");
        }
    }
}
